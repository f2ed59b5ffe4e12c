"""What the paper's figures 2 to 8 show, as numbers.

Figure 2: the criteria f1 and f2 as surfaces over the design box; f3 = u1 and f4 = u2 do not
depend on the friction coefficient and are not drawn.

Figures 3 to 6: the Pareto-optimal test points, by rank of efficiency, in four spaces.

Figure 7: the motion of the Salukvadze optimum.

Figure 8: the Salukvadze optimum as a function of the initial speed c of the centre, as
f_j^S(c) and v_Cf^S(c).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.algorithms import refine
from pymoo_psi.chute import criteria, motion
from pymoo_psi.pareto import rank_of_efficiency
from pymoo_psi.problems import VectorizedSphereChute
from pymoo_psi.sequences import lp_tau

Array = NDArray[np.float64]

INITIAL_SPEEDS = tuple(np.linspace(0.05, 1.0, 39).tolist())  # around the paper's c = 0.3193
_FINE = 201  # lines on which is seen where the criteria of Figure 2 change fast


@dataclass(frozen=True, eq=False)
class CriterionSurfaces:
    """f1 and f2 over the design box.

    Attributes:
        mu: Friction coefficient.
        u1: ``(n, n)`` slopes, increasing along the first axis.
        u2: ``(n, n)`` speeds of the plane, increasing along the second axis.
        f: ``(2, n, n)`` the criteria, NaN where the sphere stalls before the exit.

    Example:
        >>> criterion_surfaces(0.4, "rolling", n=5).f.shape
        (2, 5, 5)
    """

    mu: float
    u1: Array
    u2: Array
    f: Array


def criterion_surfaces(
    mu: float, model: str, *, c: float = 0.3193, r: float = 0.1, n: int = 61
) -> CriterionSurfaces:
    """Compute f1 and f2 on a grid of n × n designs over the box [0, 3.5 μ] × [0.1, 6].

    The grid's lines are dense where a criterion changes fast: near the level chute, where the time
    grows by half within a fortieth of the box.

    Example:
        >>> criterion_surfaces(0.4, "rolling", n=5).f.shape
        (2, 5, 5)
    """
    problem = VectorizedSphereChute(mu, c=c, r=r, model=model)
    sides = [
        np.linspace(low, high, _FINE) for low, high in zip(problem.xl, problem.xu, strict=True)
    ]
    f = _on_grid(problem, *sides)[2]
    graded = []
    for axis, side in enumerate(sides):
        # The change of either criterion from line to line, as a share of the whole way; as much
        # again is spread evenly over the box, so that flat parts keep lines too.
        change = np.abs(np.diff(np.moveaxis(f, axis + 1, 1), axis=1))
        change = np.nanmax(change, axis=2, initial=0.0)
        whole = change.sum(axis=1, keepdims=True)
        whole[whole == 0] = 1.0  # rolling from the start, the time does not depend on u2
        weight = (change / whole).mean(axis=0) + 1 / (_FINE - 1)
        reached = np.concatenate([[0.0], np.cumsum(weight)])
        graded.append(np.interp(np.linspace(0, reached[-1], n), reached, side))
    return CriterionSurfaces(mu, *_on_grid(problem, *graded))


def _on_grid(problem: VectorizedSphereChute, *sides: Array) -> tuple[Array, Array, Array]:
    """Return u1, u2 and the first two criteria on the grid of these lines."""
    u1, u2 = np.meshgrid(*sides, indexing="ij")
    F = problem.evaluate(np.column_stack([u1.ravel(), u2.ravel()]), return_values_of=["F"])
    # Infinite where the sphere stalls; NaN leaves a hole in a surface.
    return u1, u2, np.where(np.isfinite(F), F, np.nan).T[:2].reshape(2, *u1.shape)


@dataclass(frozen=True, eq=False)
class SalukvadzeFunctions:
    """The Salukvadze optimum for each of k initial speeds.

    Attributes:
        model: ``"full"`` or ``"rolling"``.
        mu: Friction coefficient.
        c: ``(k,)`` initial speeds of the centre.
        test_point: ``(k,)`` numbers of the optimal test points, or of those that were refined.
        F: ``(k, 4)`` the criteria f1 to f4 of the optima, of which f3 and f4 are the design.
        exit_speed: ``(k,)`` their exit speeds.

    Example:
        >>> salukvadze_functions(0.4, "rolling", 64, [0.3, 0.4]).F.shape
        (2, 4)
    """

    model: str
    mu: float
    c: Array
    test_point: NDArray[np.intp]
    F: Array
    exit_speed: Array


def salukvadze_functions(
    mu: float,
    model: str,
    n_points: int,
    c: Sequence[float] = INITIAL_SPEEDS,
    *,
    r: float = 0.1,
    refined: bool = False,
) -> SalukvadzeFunctions:
    """Evaluate the first ``n_points`` LPτ points at every c and take the one nearest to U.

    As c grows, one test point after the other is the nearest: the functions are staircases. Where
    the steps come from is seen beside ``refined`` optima, each polished from its test point against
    the U of all of them.

    Example:
        >>> salukvadze_functions(0.4, "rolling", 4096, [0.3193]).test_point  # as Table 6.1
        array([3085])
    """
    points = lp_tau(n_points, 2)
    numbers, F, exit_speed = [], [], []
    for speed in c:
        problem = VectorizedSphereChute(mu, c=speed, r=r, model=model)
        X = problem.xl + (problem.xu - problem.xl) * points
        # The same points for every c, so that a jump of the curves is one of the optimum.
        f = criteria(motion(X[:, 0], X[:, 1], problem.parameters, model=model))
        best, ideal, nadir = _nearest_to_ideal(f)
        x = X[best]
        if refined:
            ranking = rank_of_efficiency(f[[best]], normalize=False, ideal=ideal, nadir=nadir)
            # To a thousandth of what a picture resolves.
            x = refine(problem, x, ranking, tolerance=1e-6).x
        moved = motion(x[:1], x[1:], problem.parameters, model=model)
        numbers.append(1 + best)
        F.append(criteria(moved)[0])
        exit_speed.append(float(moved.exit_speed[0]))
    return SalukvadzeFunctions(
        model, mu, np.array(c), np.array(numbers), np.array(F), np.array(exit_speed)
    )


def _nearest_to_ideal(f: Array) -> tuple[int, Array, Array]:
    """Return the row of ``f``, ``(n, 4)``, that reaches the exit and is nearest to U; U; a nadir.

    The Pareto set is not needed for that. The componentwise minimum over it is that over all
    feasible points, since some point that has the least f_j is Pareto optimal; and with f ≥ U
    a point that dominates another is nearer to U, so that the nearest of all is Pareto optimal.
    Of the nadir, plain distances to U do not depend.
    """
    exits = np.flatnonzero(np.isfinite(f).all(axis=1))  # test point 1, the level chute, always
    ideal, nadir = f[exits].min(axis=0), f[exits].max(axis=0)
    distance = np.linalg.norm(f[exits] - ideal, axis=1)
    return int(exits[distance.argmin()]), ideal, nadir
