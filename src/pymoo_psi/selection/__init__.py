"""Choosing from a Pareto set: selectors by pymoo's convention, their agreement, robustness."""

from pymoo_psi.selection._agreement import SelectorComparison, compare_selectors
from pymoo_psi.selection._mcdm import HighTradeoff, McdmMethod
from pymoo_psi.selection._robustness import robustness
from pymoo_psi.selection._selectors import (
    CompromiseProgramming,
    EfficientSubset,
    Knee,
    Lexicographic,
    ReferencePoint,
    SalukvadzeOptimum,
)

__all__ = [
    "CompromiseProgramming",
    "EfficientSubset",
    "HighTradeoff",
    "Knee",
    "Lexicographic",
    "McdmMethod",
    "ReferencePoint",
    "SalukvadzeOptimum",
    "SelectorComparison",
    "compare_selectors",
    "robustness",
]
