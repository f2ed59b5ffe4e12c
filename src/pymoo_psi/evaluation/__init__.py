"""Evaluations: designs that fail, with their reasons, and a study of whatever is evaluated."""

from pymoo_psi.evaluation._failures import FailureTolerant
from pymoo_psi.evaluation._recorded import Recorded

__all__ = ["FailureTolerant", "Recorded"]
