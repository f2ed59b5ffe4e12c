"""Designs that fail: what counts as a failure, and how a run goes on with its reason kept."""

from pymoo_psi.failures.evaluation import Evaluated, evaluate_guarded
from pymoo_psi.failures.evaluator import GuardedEvaluator, failure_action
from pymoo_psi.failures.guard import FAILED
from pymoo_psi.failures.tolerant import Failure, FailureTolerant, unguarded

__all__ = [
    "FAILED",
    "Evaluated",
    "Failure",
    "FailureTolerant",
    "GuardedEvaluator",
    "evaluate_guarded",
    "failure_action",
    "unguarded",
]
