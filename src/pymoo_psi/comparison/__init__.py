"""PSI against other algorithms: runs at equal cost, one reference, tests of what differs."""

from pymoo_psi.comparison._algorithms import DEFAULT_ALGORITHMS
from pymoo_psi.comparison._comparison import Comparison, compare
from pymoo_psi.comparison._reference import Reference
from pymoo_psi.comparison._report import conclusions, report
from pymoo_psi.comparison._statistics import INDICATORS

__all__ = [
    "DEFAULT_ALGORITHMS",
    "INDICATORS",
    "Comparison",
    "Reference",
    "compare",
    "conclusions",
    "report",
]
