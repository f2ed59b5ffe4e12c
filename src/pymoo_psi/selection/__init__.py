"""Selection of designs from a Pareto set: selectors and robustness.

Every selector has a method ``.do(F)``, which returns the rows that it chooses. Methods of other
packages accept arrays, too: ``pymcdm.methods.TOPSIS()(res.F, weights, -np.ones(m))`` returns
scores.

Example:
    >>> import numpy as np
    >>> from pymoo_psi.selection import CompromiseProgramming, SalukvadzeOptimum, compare_selectors
    >>> F = np.array([[0.0, 1.0], [0.2, 0.5], [0.4, 0.32], [1.0, 0.0], [0.9, 0.9]])
    >>> SalukvadzeOptimum().do(F)
    array([2])
    >>> compare_selectors(F, {
    ...     "Salukvadze": SalukvadzeOptimum(),
    ...     "sum": CompromiseProgramming(1),
    ...     "worst": CompromiseProgramming(np.inf),
    ... })
    {'Salukvadze': array([2]), 'sum': array([1]), 'worst': array([2])}

    If parameters of the problem are uncertain, :func:`robustness` evaluates the designs in
    quasi-random scenarios and ranks them in each. It returns how often a design is the optimum, and
    how much worse it is than the best design of the scenario (regret).

    >>> from scipy.stats import uniform
    >>> from pymoo_psi import VectorizedSphereChute, robustness
    >>> frame = robustness(
    ...     lambda mu, c: VectorizedSphereChute(mu, c=c, model="rolling"),
    ...     [[0.25, 0.1], [0.3, 0.1], [0.35, 0.1], [0.4, 0.1]],
    ...     uncertainty={"mu": uniform(0.3, 0.2), "c": uniform(0.25, 0.1)},
    ...     normalize=False,
    ... )
    >>> print(frame[["x1", "optimum_share", "efficient_share", "mean_regret"]].round(3))
         x1  optimum_share  efficient_share  mean_regret
    2  0.35          0.844            1.000        0.000
    1  0.30          0.156            0.156        0.012
    3  0.40          0.000            0.762        0.039
    0  0.25          0.000            0.000        0.083

    :class:`pymoo_psi.Robust` is a problem whose objectives are robust, for any algorithm.

To write a selector that uses distances or ranks, derive from :class:`RankingSelector` and implement
``_choose(self, ranking)``, which returns an array of indices. For any other selector, derive from
pymoo's ``Indicator`` and implement ``do(self, F, *args, **kwargs)``. :func:`compare_selectors`
accepts both.

Public names: :class:`SalukvadzeOptimum`, :class:`EfficientSubset`,
:class:`CompromiseProgramming`, :class:`ReferencePoint`, :class:`Preferred`, :class:`Knee` and their
base :class:`RankingSelector`; :func:`compare_selectors`; :func:`robustness`.
"""

from pymoo_psi._names import attach_names

# Each name at its first use: a selector needs no workers.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
