"""What all runs of a comparison are measured against: one reference set, point and scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._output import whole_file
from pymoo_psi._validation import Received, invalid, objective_matrix
from pymoo_psi.algorithms import refine
from pymoo_psi.comparison._runs import Run, problem_text
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import (
    Objectives,
    UtopianFrame,
    epsilon_additive,
    hypervolume,
    igd_plus,
    nondominated,
    rank_of_efficiency,
    ranking_of,
    spread_subset,
)
from pymoo_psi.problems import design_space

Array = NDArray[np.float64]

REFERENCE_POINT = 1.1
"""Each coordinate of the reference point of the hypervolume, in units of N − U.

Beyond N, where the extreme points of a front would dominate nothing and count for nothing; 1.1 is
the customary choice (Ishibuchi et al., Evol. Comput. 26, 2018, discuss it).
"""

REFERENCE_SIZE = 1000
"""Points that the reference set is thinned to, as IGD+ takes all distances to each of them."""

_STORED = ("points", "n_union", "optimum", "optimum_evaluations", "problem")


@dataclass(frozen=True, eq=False)
class Reference:
    """The reference of a comparison.

    All designs that any run found, and the points of a known front if one is given, are put
    together, and those that no other dominates are kept. They span the scale: U and N are their
    best and worst values, and every objective is measured in units of N − U. An objective in
    which they all agree is measured up to the worst value that any run found. The reference set of
    IGD+ and of the additive epsilon indicator are ``REFERENCE_SIZE`` of them, evenly spread; the
    reference point of the hypervolume is U + 1.1 (N − U).

    Attributes:
        frame: U, N and the scale.
        points: ``(k, m)`` the reference set, in the scale; none if no run found anything.
        n_union: Points it was thinned from.
        optimum: ``(m,)`` objectives, all minimised, of the continuous Salukvadze optimum, the
            feasible design nearest to U: the nearest of all points, polished by
            :func:`pymoo_psi.algorithms.refine`.
        optimum_evaluations: Evaluations that the polishing took; no algorithm is charged for them.
        problem: The problem that it is for, as JSON.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> bnh = get_problem("bnh")
        >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
        >>> reference = result.reference
        >>> bool((reference.points >= 0).all() and (reference.points <= 1).all())
        True
    """

    frame: UtopianFrame
    points: Array
    n_union: int
    optimum: Array
    optimum_evaluations: int
    problem: str

    def __repr__(self) -> str:
        """Return the sizes."""
        k, m = self.points.shape
        return f"Reference({k} points of {self.n_union}, {m} objectives)"

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

        Example:
            Of the result in the example of :class:`Reference`:

            >>> again = Reference.of(bnh, result.runs, None, polish=False)
            >>> again.n_union == result.reference.n_union
            True
        """
        m, name = problem.n_obj, problem_text(problem)
        known = np.zeros((0, m)) if front is None else objective_matrix("reference_front", front)
        if known.shape[1] != m:
            raise invalid("reference_front", f"of {m} objectives", Received(f"{known.shape[1]}"))
        # Each once and sorted: the order of the runs must not decide which points are kept.
        F = np.unique(np.vstack([*(run.F for run in runs), known]), axis=0)
        if len(F) == 0:
            nowhere = np.full(m, np.nan)
            return cls(UtopianFrame(nowhere, nowhere, True), F, 0, nowhere, 0, name)
        worst = F.max(axis=0)
        F = F[nondominated(F)]
        U, N = F.min(axis=0), F.max(axis=0)
        # Without a span of its own an objective would count for nothing, and runs that are worse
        # in it would pass for equal: a single best point would make all runs alike.
        frame = UtopianFrame(U, np.where(N > U, N, worst), normalize=True)
        scaled = frame.scaled(F)
        points = scaled[spread_subset(scaled, REFERENCE_SIZE)]
        optimum, spent = _optimum(problem, runs, F, frame, polish)
        return cls(frame, points, len(F), optimum, spent, name)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the reference, so that later runs can be measured against it.

        Example:
            Of the result in the example of :class:`Reference`:

            >>> import os, tempfile
            >>> from pymoo_psi import compare
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = os.path.join(folder, "bnh.npz")
            ...     result.reference.save(path)
            ...     reference = Reference.load(path)
            >>> one = compare(bnh, n_evaluations=64, algorithms=["psi"], reference=reference)
            >>> rows = [frame.query("algorithm == 'psi' and evaluations == 64")
            ...         for frame in (one.to_frame(), result.to_frame())]
            >>> rows[0]["hypervolume"].item() == rows[1]["hypervolume"].item()
            True
        """
        values = {name: getattr(self, name) for name in _STORED}
        with whole_file(path) as written, written.open("wb") as file:
            np.savez_compressed(file, ideal=self.frame.ideal, nadir=self.frame.nadir, **values)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Reference:
        """Read a reference that :meth:`save` wrote, bit for bit.

        Raises:
            ArgumentValueError: The file is no reference.
            OSError: It cannot be read.

        Example:
            See :meth:`save`; a file of another kind is refused.

            >>> import os, tempfile
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = os.path.join(folder, "other.npz")
            ...     np.savez(path, F=np.zeros(3))
            ...     Reference.load(path)
            Traceback (most recent call last):
            pymoo_psi.errors.ArgumentValueError: reference must be a file with a reference, got ...
        """
        try:
            with open(path, "rb") as file, np.load(file, allow_pickle=False) as stored:
                frame = UtopianFrame(stored["ideal"], stored["nadir"], normalize=True)
                points, n_union, optimum, spent, problem = (stored[name] for name in _STORED)
            return cls(frame, points, int(n_union), optimum, int(spent), str(problem))
        except (KeyError, TypeError, ValueError, EOFError, BadZipFile) as error:
            remedy = "Reference.save and 'pymoo-psi compare --out' write one"
            raise invalid("reference", "a file with a reference", str(path), remedy) from error

    def measure(self, F: Array) -> dict[str, float]:
        """Return the quality of the ``(n, m)`` non-dominated objectives that a run found.

        ``optimum_distance`` is the distance, in the scale, from the Salukvadze optimum among them,
        by their own U and N as a user would find it, to the continuous one.

        Example:
            Of the result in the example of :class:`Reference`:

            >>> result.reference.measure(np.zeros((0, 2)))["hypervolume"]
            0.0
        """
        scaled, distance = self.frame.scaled(F), np.inf
        if len(F):
            best = self.frame.scaled(F[rank_of_efficiency(F).salukvadze[:1]])
            distance = float(np.linalg.norm(best - self.frame.scaled(self.optimum)))
        return {
            "hypervolume": hypervolume(scaled, REFERENCE_POINT)[0],
            "igd_plus": igd_plus(scaled, self.points),
            "epsilon": epsilon_additive(scaled, self.points),
            "optimum_distance": distance,
            "n_nondominated": len(F),
        }


def _optimum(
    problem: Any, runs: Sequence[Run], F: Array, frame: UtopianFrame, polish: bool
) -> tuple[Array, int]:
    """Return the objectives nearest to U, and the evaluations spent on finding them."""
    distances = frame.distances(F)[:, 0]
    nearest, best = F[distances.argmin()], distances.min()
    # The search is a simplex, which whole numbers and choices do not have.
    if not polish or not design_space(problem).continuous:
        return nearest, 0
    # A known front has no designs: the search begins at the nearest design of a run.
    found = [run for run in runs if len(run.F)]
    if not found:
        return nearest, 0
    F_of, X_of = np.vstack([run.F for run in found]), np.vstack([run.X for run in found])
    start = X_of[frame.distances(F_of)[:, 0].argmin()]
    # No row of F dominates another: all are Pareto optimal, and span the scale of the frame.
    ranking = ranking_of(Objectives.of(F), np.ones(len(F), dtype=bool), normalize=True)
    try:
        refined = refine(problem, start, ranking)
    except ArgumentValueError:  # a model with noise: the design is no longer feasible
        return nearest, 0
    return (refined.f if refined.distance < best else nearest), refined.n_evaluations
