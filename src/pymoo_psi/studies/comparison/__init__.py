"""PSI against other algorithms: runs at equal cost, one reference, tests of what differs."""

from pymoo_psi.studies.comparison.comparing import compare
from pymoo_psi.studies.comparison.comparison import Comparison
from pymoo_psi.studies.comparison.contenders import DEFAULT_ALGORITHMS
from pymoo_psi.studies.comparison.reference import Reference
from pymoo_psi.studies.comparison.run import Run, Task
from pymoo_psi.studies.comparison.statistics import INDICATORS

__all__ = ["DEFAULT_ALGORITHMS", "INDICATORS", "Comparison", "Reference", "Run", "Task", "compare"]
