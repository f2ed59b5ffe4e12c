"""Objectives as statistics over scenarios."""

from pymoo_psi.evaluation._robust import Robust

__all__ = ["Robust"]
