"""Geometry of Pareto sets: dominance, the three distances, ranks of efficiency."""

from pymoo_psi.pareto.dominance import nondominated
from pymoo_psi.pareto.geometry import UtopianFrame
from pymoo_psi.pareto.ranking import EfficiencyRanking, rank_of_efficiency

__all__ = ["EfficiencyRanking", "UtopianFrame", "nondominated", "rank_of_efficiency"]
