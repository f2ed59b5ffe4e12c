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
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.chute import ChuteParameters, Trajectory, criteria, motion, trajectory
from pymoo_psi.paper._reproduction import Case
from pymoo_psi.problems import VectorizedSphereChute
from pymoo_psi.sequences import lp_tau

Array = NDArray[np.float64]

INITIAL_SPEEDS = tuple(np.linspace(0.05, 1.0, 39).tolist())  # around the paper's c = 0.3193


@dataclass(frozen=True, eq=False)
class CriterionSurfaces:
    """f1 and f2 over the design box.

    Attributes:
        model: ``"full"`` or ``"rolling"``.
        mu: Friction coefficient.
        u1: ``(n, n)`` slopes, growing along the first axis.
        u2: ``(n, n)`` speeds of the plane, growing along the second axis.
        f: ``(2, n, n)`` the criteria, NaN where the sphere stalls before the exit.
    """

    model: str
    mu: float
    u1: Array
    u2: Array
    f: Array


def criterion_surfaces(mu: float, model: str, *, n: int = 41) -> CriterionSurfaces:
    """Compute f1 and f2 on a regular grid of n × n designs over the box [0, 3.5 μ] × [0.1, 6]."""
    problem = VectorizedSphereChute(mu, model=model)
    sides = [np.linspace(low, high, n) for low, high in zip(problem.xl, problem.xu, strict=True)]
    u1, u2 = np.meshgrid(*sides, indexing="ij")
    F = problem.evaluate(np.column_stack([u1.ravel(), u2.ravel()]), return_values_of=["F"])
    # Infinite where the sphere stalls; NaN leaves a hole in a surface.
    f = np.where(np.isfinite(F), F, np.nan).T[:2].reshape(2, n, n)
    return CriterionSurfaces(model, mu, u1, u2, f)


@dataclass(frozen=True, eq=False)
class RankedPoints:
    """A ranked Pareto set in a space of two or three coordinates.

    Attributes:
        names: The k coordinates, such as ``("u1", "u2")``.
        values: ``(n, k)`` the points.
        rank: ``(n,)`` their ranks of efficiency, 0 for the unranked.
        optimum: ``(n,)`` which of them is the Salukvadze optimum.
    """

    names: tuple[str, ...]
    values: Array
    rank: NDArray[np.int64]
    optimum: NDArray[np.bool_]

    def groups(self) -> dict[str, NDArray[np.intp]]:
        """Return what a legend tells apart, and the indices of the points of each group."""
        groups = {
            f"rank {rank}" if rank else "unranked": np.flatnonzero(
                (self.rank == rank) & ~self.optimum
            )
            for rank in (0, 3, 4, 5)
        }
        # Of several optima, equally near to U, none may have rank 6.
        rank = " (rank 6)" if (self.rank == 6).any() else ""
        groups[f"Salukvadze optimum{rank}"] = np.flatnonzero(self.optimum)
        return {name: members for name, members in groups.items() if len(members)}

    def nearby(self, margin: float = 0.15) -> RankedPoints:
        """Return the points in the smallest box around the ranked ones and the optimum.

        The box is longer by the share ``margin`` of its length on each side.
        """
        core = self.values[(self.rank > 0) | self.optimum]
        low, high = core.min(axis=0), core.max(axis=0)
        wider = margin * (high - low)
        inside = ((self.values >= low - wider) & (self.values <= high + wider)).all(axis=1)
        return replace(
            self, values=self.values[inside], rank=self.rank[inside], optimum=self.optimum[inside]
        )


def ranked_points(case: Case, names: Sequence[str]) -> RankedPoints:
    """Return a case in the space of two or three of u1, u2, f1 … f4 and μ1, μ2, μ3 (``mu1`` …)."""
    columns = {
        f"{letter}{k}": column
        for letter, matrix in (("u", case.X), ("f", case.F), ("mu", case.ranking.criteria))
        for k, column in enumerate(matrix.T, start=1)
    }
    optimum = np.zeros(len(case.X), dtype=bool)
    optimum[case.ranking.salukvadze] = True
    values = np.column_stack([columns[name] for name in names])
    return RankedPoints(tuple(names), values, case.ranking.rank, optimum)


def optimal_motion(case: Case) -> tuple[int, Trajectory]:
    """Return the row of the Salukvadze optimum, and its motion under the full model."""
    best = int(case.ranking.salukvadze[0])
    u1, v_p = case.X[best].tolist()
    return best, trajectory(u1, v_p, ChuteParameters(mu=case.mu))


@dataclass(frozen=True, eq=False)
class SalukvadzeFunctions:
    """The Salukvadze optimum for each of k initial speeds.

    Attributes:
        model: ``"full"`` or ``"rolling"``.
        mu: Friction coefficient.
        c: ``(k,)`` initial speeds of the centre.
        test_point: ``(k,)`` numbers of the optimal test points.
        F: ``(k, 4)`` their criteria f1 to f4, of which f3 and f4 are the design.
        exit_speed: ``(k,)`` their exit speeds.
    """

    model: str
    mu: float
    c: Array
    test_point: NDArray[np.intp]
    F: Array
    exit_speed: Array


def salukvadze_functions(
    mu: float, model: str, n_points: int, c: Sequence[float] = INITIAL_SPEEDS
) -> SalukvadzeFunctions:
    """Evaluate the first ``n_points`` LPτ points at every c and take the one nearest to U."""
    points = lp_tau(n_points, 2)
    numbers, F, exit_speed = [], [], []
    for speed in c:
        problem = VectorizedSphereChute(mu, c=speed, model=model)
        X = problem.xl + (problem.xu - problem.xl) * points
        # The same points for every c, so that a jump of the curves is one of the optimum.
        moved = motion(X[:, 0], X[:, 1], problem.parameters, model=model)
        f = criteria(moved)
        best = _nearest_to_ideal(f)
        numbers.append(1 + best)
        F.append(f[best])
        exit_speed.append(moved.exit_speed[best])
    return SalukvadzeFunctions(
        model, mu, np.array(c), np.array(numbers), np.array(F), np.array(exit_speed)
    )


def _nearest_to_ideal(f: Array) -> int:
    """Return the row of ``f``, ``(n, 4)``, that is nearest to U among those that reach the exit.

    The Pareto set is not needed for that. The componentwise minimum over it is that over all
    feasible points, since some point that has the least f_j is Pareto optimal; and with f ≥ U
    a point that dominates another is nearer to U, so that the nearest of all is Pareto optimal.
    """
    exits = np.flatnonzero(np.isfinite(f).all(axis=1))  # test point 1, the level chute, always
    distance = np.linalg.norm(f[exits] - f[exits].min(axis=0), axis=1)
    return int(exits[distance.argmin()])
