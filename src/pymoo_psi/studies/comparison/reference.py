"""What all runs of a comparison are measured against: one reference set, point and scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi.algorithms import refine
from pymoo_psi.arguments import Received, broken_rule, objective_matrix
from pymoo_psi.host import design_space
from pymoo_psi.pareto import UtopianFrame, nondominated, rank_of_efficiency
from pymoo_psi.pareto.indicators import epsilon_additive, hypervolume, igd_plus, spread_subset
from pymoo_psi.pareto.objectives import Objectives
from pymoo_psi.pareto.ranking import ranking_of
from pymoo_psi.studies.comparison.run import Run

__all__ = ["REFERENCE_POINT", "REFERENCE_SIZE", "Reference"]

Array = NDArray[np.float64]

REFERENCE_POINT = 1.1
"""Each coordinate of the reference point of the hypervolume, in units of N − U."""

REFERENCE_SIZE = 1000
"""Points that the reference set is thinned to."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The reference of a comparison.

    All designs that any run found, and the points of a known front if one is given, are put
    together, and those that no other dominates are kept. They span the scale: U and N are their
    best and worst values, and every objective is measured in units of N − U. The reference set of
    IGD+ and of the additive epsilon indicator are ``REFERENCE_SIZE`` of them, evenly spread; the
    reference point of the hypervolume is U + 1.1 (N − U).

    Attributes:
        frame: U, N and the scale.
        points: ``(k, m)`` the reference set, in the scale; none if no run found anything.
        n_union: Points it was thinned from.
        optimum: ``(m,)`` objectives of the continuous Salukvadze optimum, the feasible design
            nearest to U: the nearest of all points, polished by :func:`pymoo_psi.refine`.
        optimum_evaluations: Evaluations that the polishing took; no algorithm is charged for them.
    """

    frame: UtopianFrame
    points: Array
    n_union: int
    optimum: Array
    optimum_evaluations: int

    @classmethod
    def of(
        cls, problem: Any, runs: Sequence[Run], front: ArrayLike | None, *, polish: bool
    ) -> Reference:
        """Return the reference of runs.

        Args:
            problem: The problem.
            runs: All runs, of every algorithm, budget and seed.
            front: ``(k, m)`` objectives known to be attainable, such as a true Pareto front.
            polish: Whether to search the continuous optimum from the best point on.
        """
        m = problem.n_obj
        known = np.zeros((0, m)) if front is None else objective_matrix("reference_front", front)
        if known.shape[1] != m:
            shape = Received(f"an array of shape {known.shape}")
            raise broken_rule("reference_front", f"of {m} objectives", shape)
        F = np.unique(np.vstack([*(run.F for run in runs), known]), axis=0)
        F = F[nondominated(F)]
        if len(F) == 0:
            nowhere = np.full(m, np.nan)
            return cls(UtopianFrame(nowhere, nowhere, True), F, 0, nowhere, 0)
        frame = UtopianFrame(F.min(axis=0), F.max(axis=0), normalize=True)
        scaled = (F - frame.ideal) / frame.scale
        points = scaled[spread_subset(scaled, REFERENCE_SIZE)]
        optimum, spent = _optimum(problem, runs, F, frame, polish)
        return cls(frame, points, len(F), optimum, spent)

    def scaled(self, F: Array) -> Array:
        """Return ``(n, m)`` objectives in the scale: U is 0 and N is 1."""
        scaled: Array = (F - self.frame.ideal) / self.frame.scale
        return scaled

    def measure(self, F: Array) -> dict[str, float]:
        """Return the quality of the ``(n, m)`` non-dominated objectives that a run found.

        ``optimum_distance`` is the distance, in the scale, from the Salukvadze optimum among them,
        by their own U and N as a user would find it, to the continuous one.
        """
        if len(F) == 0:
            return {
                "hypervolume": 0.0,
                "igd_plus": np.inf,
                "epsilon": np.inf,
                "optimum_distance": np.inf,
                "n_nondominated": 0,
            }
        scaled = self.scaled(F)
        best = F[rank_of_efficiency(F).salukvadze[:1]]
        return {
            "hypervolume": hypervolume(scaled, REFERENCE_POINT),
            "igd_plus": igd_plus(scaled, self.points),
            "epsilon": epsilon_additive(scaled, self.points),
            "optimum_distance": float(
                np.linalg.norm(self.scaled(best) - self.scaled(self.optimum))
            ),
            "n_nondominated": len(F),
        }


def _optimum(
    problem: Any, runs: Sequence[Run], F: Array, frame: UtopianFrame, polish: bool
) -> tuple[Array, int]:
    """Return the objectives nearest to U, and the evaluations spent on finding them."""
    distances = frame.distances(F)[:, 0]
    nearest, best = F[distances.argmin()], distances.min()
    if not polish or not design_space(problem).continuous:
        return nearest, 0
    candidates = [(frame.distances(run.F)[:, 0], run) for run in runs if len(run.F)]
    if not candidates:
        return nearest, 0
    mu1, run = min(candidates, key=lambda pair: float(pair[0].min()))
    everything = np.ones(len(F), dtype=bool)
    ranking = ranking_of(Objectives.of(F), everything, normalize=True)
    found = refine(problem, run.X[mu1.argmin()], ranking)
    return (found.f if found.distance < best else nearest), found.n_evaluations
