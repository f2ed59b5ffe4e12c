"""A report on an investigation, for those who must agree to its choice: one file, to be printed.

What was tested and what failed, what limits cost, where the designs lie, the Pareto set, the choice
with its reasons, its cautions and its alternatives: :func:`decision_report` writes of a test table
what the commands ``rank``, ``analyze`` and ``solve`` print, in the same sentences.
"""

from pymoo_psi.report._report import DecisionReport, decision_report

__all__ = ["DecisionReport", "decision_report"]
