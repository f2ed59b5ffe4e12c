"""Running a model on many workers, without losing a design."""

from pymoo_psi.parallel._joblib_runner import JoblibRunner

__all__ = ["JoblibRunner"]
