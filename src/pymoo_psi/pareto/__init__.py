"""Geometry of Pareto sets: dominance, the three distances, ranks of efficiency, robustness."""

from pymoo_psi.pareto.dominance import nondominated
from pymoo_psi.pareto.geometry import UtopianFrame
from pymoo_psi.pareto.ranking import EfficiencyRanking, rank_of_efficiency
from pymoo_psi.pareto.robustness import Robustness

__all__ = ["EfficiencyRanking", "Robustness", "UtopianFrame", "nondominated", "rank_of_efficiency"]
