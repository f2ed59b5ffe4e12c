"""Evaluations: designs that fail, a study of whatever is evaluated, criteria over scenarios."""

from pymoo_psi.evaluation._failures import FailureTolerant
from pymoo_psi.evaluation._recorded import Recorded
from pymoo_psi.evaluation._robust import Robust

__all__ = ["FailureTolerant", "Recorded", "Robust"]
