"""Choosing from a Pareto set: selectors by pymoo's convention, their comparison, robustness."""

from pymoo_psi.deciding.agreement import SelectorComparison, compare_selectors
from pymoo_psi.deciding.mcdm import McdmMethod
from pymoo_psi.deciding.selectors import CompromiseProgramming, EfficientSubset, SalukvadzeOptimum
from pymoo_psi.deciding.uncertainty import robustness, scenarios

__all__ = [
    # Selectors
    "CompromiseProgramming",
    "EfficientSubset",
    "McdmMethod",
    "SalukvadzeOptimum",
    # Several of them on one set
    "SelectorComparison",
    "compare_selectors",
    # Uncertain parameters
    "robustness",
    "scenarios",
]
