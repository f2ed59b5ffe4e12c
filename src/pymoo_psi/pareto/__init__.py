"""Geometry of Pareto sets: dominance, the three distances, ranks of efficiency, robustness."""

from pymoo_psi.pareto._dominance import nondominated
from pymoo_psi.pareto._ranking import EfficiencyRanking, UtopianFrame, rank_of_efficiency
from pymoo_psi.pareto._scenarios import Robustness

__all__ = ["EfficiencyRanking", "Robustness", "UtopianFrame", "nondominated", "rank_of_efficiency"]
