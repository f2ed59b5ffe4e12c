"""Geometry of Pareto sets: dominance, the three distances, ranks of efficiency, robustness."""

from pymoo_psi.pareto._dominance import nondominated
from pymoo_psi.pareto._ranking import EfficiencyRanking, rank_of_efficiency
from pymoo_psi.pareto._scenarios import Robustness

__all__ = ["EfficiencyRanking", "Robustness", "nondominated", "rank_of_efficiency"]
