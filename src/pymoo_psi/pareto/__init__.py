"""Geometry of Pareto sets: dominance, distances, ranks of efficiency, reasons, robustness."""

from pymoo_psi.pareto._cautions import Caution, cautions
from pymoo_psi.pareto._dominance import nondominated
from pymoo_psi.pareto._explanation import DesignComparison, Explanation, compare_designs, explain
from pymoo_psi.pareto._ranking import EfficiencyRanking, rank_of_efficiency
from pymoo_psi.pareto._representatives import Representatives, representatives
from pymoo_psi.pareto._scenarios import Robustness

__all__ = [
    "Caution",
    "DesignComparison",
    "EfficiencyRanking",
    "Explanation",
    "Representatives",
    "Robustness",
    "cautions",
    "compare_designs",
    "explain",
    "nondominated",
    "rank_of_efficiency",
    "representatives",
]
