"""PSI against other algorithms: runs at equal cost, one reference, tests of what differs.

When does an even investigation of the bounds beat an evolutionary search, and when not?
:func:`compare` runs both at equal cost, counted by the problem, and measures all runs against one
reference: hypervolume, IGD+, additive epsilon and the distance to the best known Salukvadze
optimum, with medians, quartiles, tests and effect sizes.

Example:
    >>> from pymoo.problems import get_problem
    >>> from pymoo_psi import compare
    >>> result = compare(
    ...     get_problem("osy"), n_evaluations=512, seeds=6, algorithms=["psi", "nsga3"]
    ... )
    >>> summary = result.summary().set_index("algorithm")
    >>> bool(summary.loc["nsga3", "hypervolume"] > summary.loc["psi", "hypervolume"])
    True
    >>> test = result.tests("hypervolume").iloc[0]          # six variables: PSI loses
    >>> print(test["better"], test["effect"], test["p_holm"])
    nsga3 1.0 0.03125

Other algorithms of pymoo take part, too (``algorithms={"mine": lambda n: NSGA2(pop_size=50)}``),
``n_jobs`` runs seeds in parallel, and with ``folder=`` a comparison goes on after an interruption:
each finished run is a study there, with all that it tested, which any command opens.
``pymoo-psi compare bnh --out comparison`` prints :func:`conclusions` and writes tables and a figure
(:func:`pymoo_psi.plots.plot_indicators`).

Tests are corrected over all pairs and budgets: of the four algorithms and three budgets that are
taken by default, fewer than six seeds cannot tell any two apart, and fewer than nine nothing from
``psi``, which has one run.
"""

from pymoo_psi.comparison._algorithms import DEFAULT_ALGORITHMS
from pymoo_psi.comparison._comparison import SIGNIFICANCE, Comparison, compare, conclusions
from pymoo_psi.comparison._quality import INDICATORS, Reference, effect_size, holm, p_value
from pymoo_psi.comparison._runs import Run

__all__ = [
    "DEFAULT_ALGORITHMS",
    "INDICATORS",
    "SIGNIFICANCE",
    "Comparison",
    "Reference",
    "Run",
    "compare",
    "conclusions",
    "effect_size",
    "holm",
    "p_value",
]
