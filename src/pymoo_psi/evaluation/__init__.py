"""Designs that fail: what counts as a failure, and how a run goes on with its reason kept."""

from pymoo_psi.evaluation._failures import FailureTolerant

__all__ = ["FailureTolerant"]
