"""PSI compared with other algorithms: runs at equal cost, one reference, statistical tests.

:func:`compare` runs algorithms with equal numbers of evaluations, counted by the problem, and
measures all runs against one reference: hypervolume, IGD+, additive epsilon and the distance to the
best known Salukvadze optimum. The result has medians, quartiles, tests and effect sizes.

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

Any algorithm of pymoo can be compared (``algorithms={"mine": lambda n: NSGA2(pop_size=50)}``), and
``n_jobs`` runs seeds in parallel. With ``folder=`` a comparison continues after an interruption:
the folder contains each finished run as a study with all its tests, which any command opens.
``pymoo-psi compare bnh --out comparison`` prints medians and tests, and writes tables and a figure
(:func:`pymoo_psi.plots.plot_indicators`).

The p values are corrected for all pairs and budgets. With the default of four algorithms and three
budgets, six seeds are the fewest that can show a difference, and nine for a difference from
``psi``, which has a single run.

Public names: :func:`compare` and its :class:`Comparison`, whose ``reference`` is the front
against which indicators are measured.
"""

from pymoo_psi.comparison._comparison import Comparison, compare

# Names that other subpackages share; they are no promise to users.
# isort: split
from pymoo_psi.comparison._comparison import INDICATORS as INDICATORS
from pymoo_psi.comparison._comparison import Reference as Reference
from pymoo_psi.comparison._comparison import effect_size as effect_size
from pymoo_psi.comparison._comparison import holm as holm
from pymoo_psi.comparison._comparison import p_value as p_value
from pymoo_psi.comparison._runs import DEFAULT_ALGORITHMS as DEFAULT_ALGORITHMS
from pymoo_psi.comparison._runs import RunResult as RunResult

__all__ = [
    "Comparison",
    "compare",
]
