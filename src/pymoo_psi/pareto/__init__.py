"""Geometry of Pareto sets: dominance, distances, ranks of efficiency, explanations.

The place orders the Pareto-optimal designs: it is 1 plus the number of Pareto-optimal designs that
are nearer to the utopian point U, which has the best value of every objective. Place 1 is the
Salukvadze optimum. Dominated rows have no place and no effect. The rank of efficiency, 0 to 6, is a
number of the literature that does not order the designs. It follows from three distances: μ1 to U,
μ2 to the line from U to its opposite N, and μ3 from U to the projection onto this line. A design
scores 3 if no other dominates it in (μ2, μ3), 2 in (μ1, μ3) and 1 in (μ1, μ2). The sum of all
three, 6, is the rank of the designs of place 1; most others score nothing.

Any ``(n, m)`` array or data frame of objectives can be ranked. All are minimised unless
``maximize=["yield"]`` (names of a data frame's columns, or indices from 0) says otherwise. By
default each objective is measured in units of its range over the Pareto set; ``normalize=False``
takes plain Euclidean distances, as the paper does, which makes sense where all objectives have one
unit.

Example:
    >>> import pandas as pd
    >>> from pymoo_psi import rank_of_efficiency
    >>> F = [[0.0, 1.0], [0.2, 0.5], [0.4, 0.32], [1.0, 0.0], [0.9, 0.9]]
    >>> print(rank_of_efficiency(pd.DataFrame(F, columns=["cost", "mass"])).to_frame().round(3))
       place  cost  mass    mu1    mu2    mu3  efficiency_rank  pareto
    2      1   0.4  0.32  0.512  0.057  0.509                6    True
    1      2   0.2  0.50  0.539  0.212  0.495                5    True
    0      3   0.0  1.00  1.000  0.707  0.707                0    True
    3      3   1.0  0.00  1.000  0.707  0.707                0    True
    4   <NA>   0.9  0.90  1.273  0.000  1.273                0   False

:func:`cautions` returns reasons not to rely on the optimum. :func:`explain` states why a design is
the optimum and what another would cost. :func:`acceptability` returns for which share of the
weights each design is the best, :func:`compare_designs` gains and losses, :func:`representatives` a
few designs that cover the set. :class:`Preferences` asks which of two designs a person would
rather have, and finds the design that fits the answers. All of them accept arrays, frames, test
tables, rankings and results of pymoo.

For the other subpackages: the rule of feasibility (:func:`meets_constraints`, :func:`competes`),
indicators of the quality of a set, :class:`Objectives` and :class:`UtopianFrame` behind a ranking,
and the templates of all sentences (:data:`SENTENCES`).

Public names: :func:`rank_of_efficiency` and :class:`EfficiencyRanking`; :func:`acceptability`;
:func:`cautions` and :class:`Caution`; :func:`explain` and
:class:`Explanation`; :func:`compare_designs` and :class:`DesignComparison`;
:class:`Preferences`; :func:`representatives` and :class:`Representatives`; :func:`nondominated`;
:func:`hypervolume`.
"""

from pymoo_psi._names import attach_names

# Each name at its first use: sentences need no geometry. (Of another size than the stub, for whose
# bytecode pdoc would take that of this file if both had the same size and time.)
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
