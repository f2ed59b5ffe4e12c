"""The continuous Salukvadze optimum, from the best test point on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, finite_array, instance, invalid
from pymoo_psi.pareto import EfficiencyRanking, competes, meets_constraints, unit_lengths
from pymoo_psi.problems import design_space, evaluate_designs, require_problem

Array = NDArray[np.float64]

# Edges of the first simplex of each start, in units of the bounds: wider than the spacing of some
# hundred test points, then finer, as the optimum is near.
_SIMPLEXES = (0.05, 0.005, 0.0005)


@dataclass(frozen=True, eq=False)
class Refinement:
    """A design polished from a starting one.

    Attributes:
        x: ``(n_var,)`` the refined design.
        f: ``(m,)`` its objectives as the problem has them, all minimised.
        distance: Its distance μ1 to the utopian point U.
        start: ``(n_var,)`` the design it started from.
        start_distance: The distance μ1 of that one: how far the best test point was from U.
        n_evaluations: Evaluations spent.

    Example:
        The nearest of 64 points is a little off the optimum of x² and (x − 2)², which is at x = 1.

        >>> from pymoo.optimize import minimize
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from pymoo_psi import PSI, rank_of_efficiency
        >>> squares = [lambda x: x[0] ** 2, lambda x: (x[0] - 2) ** 2]
        >>> problem = FunctionalProblem(1, squares, xl=0, xu=2.1)
        >>> res = minimize(problem, PSI(64))
        >>> ranking = rank_of_efficiency(res.F, ideal=[0, 0], nadir=[4, 4])
        >>> refined = refine(problem, res.X[ranking.salukvadze[0]], ranking)
        >>> refined.start.round(2), refined.x.round(6)
        (array([0.98]), array([1.]))
    """

    x: Array
    f: Array
    distance: float
    start: Array
    start_distance: float
    n_evaluations: int


def refine(
    problem: Any, x0: ArrayLike, ranking: EfficiencyRanking, *, tolerance: float = 1e-9
) -> Refinement:
    """Minimise the distance to the utopian point from a design on, within the bounds.

    U, N and the scale stay those of ``ranking``, so that the result is the optimum that the
    ranked set approximates. The method is that of Nelder and Mead, as the objectives may have kinks
    (f2 of the chute is an absolute value), restarted because a simplex may collapse at a bound.
    Designs that fail or violate a constraint are passed over. Limits, under which a table was
    ranked, are not known here: the refined design may exceed them.

    Args:
        problem: A pymoo problem with continuous variables and finite bounds.
        x0: ``(n_var,)`` a feasible design to start from, such as the best test point.
        ranking: The ranking it is the best of: ``table.ranking()``, or ``rank_of_efficiency`` of
            the problem's F.
        tolerance: Of the design, in units of the bounds, and of the distance.

    Returns:
        The refined design; it is never farther from U than ``x0``.

    Raises:
        ArgumentValueError: ``x0`` is out of bounds, infeasible or has infinite objectives.
        ArgumentTypeError: ``ranking`` is no ranking, or the problem is no pymoo problem.

    Example:
        >>> from pymoo.optimize import minimize
        >>> from pymoo_psi import PSI, VectorizedSphereChute, rank_of_efficiency
        >>> problem = VectorizedSphereChute(0.4, model="rolling")
        >>> res = minimize(problem, PSI(256))
        >>> ranking = rank_of_efficiency(res.F)
        >>> best = ranking.salukvadze[0]
        >>> refined = refine(problem, res.X[best], ranking)
        >>> bool(refined.distance < refined.start_distance == ranking.criteria[best, 0])
        True
    """
    from scipy.optimize import minimize as scipy_minimize  # heavy to import

    require_problem(problem)
    ranking = instance("ranking", ranking, EfficiencyRanking, "rank_of_efficiency(F) gives one")
    space = design_space(problem, continuous=True).free
    lower, upper = space.lower, space.upper
    start = finite_array("x0", x0)
    if start.shape != lower.shape or (start < lower).any() or (start > upper).any():
        rule = f"a design of {len(lower)} variables within the bounds of the problem"
        raise invalid("x0", rule, Received(str(start.tolist())))
    width = upper - lower

    def design(z: Array) -> Array:
        return np.minimum(lower + width * z, upper)  # of 1 rounding may lie above

    def distance(out: dict[str, Array]) -> float:
        """Return μ1 of what a design has; infinite if infeasible or an objective is not finite."""
        if not competes(out["F"], meets_constraints(out["G"], out["H"])).all():
            return float("inf")
        return float(ranking.frame.distances(out["F"] * sign)[0, 0])

    # As a rule the problem has turned what is maximised, and so has a table's ranking. Whoever has
    # ranked the problem's own F with maximize= has turned it.
    ranked, begun = ranking.objectives, evaluate_designs(problem, start[None])
    given, minimized = (
        np.isclose(begun["F"], rows, rtol=1e-9, atol=0).all(axis=1).any()
        for rows in (ranked.values, ranked.minimized)
    )
    sign = ranked.sign if given and not minimized else np.ones_like(ranked.sign)
    z = (start - lower) / unit_lengths(lower, upper)
    start_distance = best = distance(begun)
    if not np.isfinite(best):
        raise invalid("x0", "a feasible design with finite objectives", Received(str(start)))
    evaluations = 2  # of the start, and of the refined design once more for its objectives
    # twice SciPy's own number of iterations, for kinks
    options = {"xatol": tolerance, "fatol": tolerance, "maxiter": 400 * len(z)}
    for size in _SIMPLEXES:
        # around the best point so far, its edges turned inwards at an upper bound
        steps = np.where(z + size <= 1, size, -size)
        found = scipy_minimize(
            lambda z: distance(evaluate_designs(problem, design(z)[None])),
            z,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * len(z),
            options=options | {"initial_simplex": np.vstack([z, z + np.diag(steps)])},
        )
        evaluations += found.nfev
        if found.fun < best:
            z, best = found.x, float(found.fun)
    x = design(z) if best < start_distance else start
    f = evaluate_designs(problem, x[None])["F"][0]
    return Refinement(x, f, best, start, start_distance, evaluations)
