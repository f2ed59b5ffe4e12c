"""A report on an investigation and its choice: one file to read or print.

:func:`decision_report` describes the chosen or proposed design, the reasons against it, the costs
of limits, the Pareto set, alternatives, and the tests.

Public names: :func:`decision_report` and its :class:`DecisionReport`.
"""

from pymoo_psi.report._report import DecisionReport, decision_report

__all__ = ["DecisionReport", "decision_report"]
