"""Parameter Space Investigation on arrays, for many cheap designs.

``minimize(problem, PSI(n))`` goes in blocks small enough to be watched. Here the points pass
through the problem in large blocks, and only what is wanted is kept.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Collection, Iterator, Mapping
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import LoopedElementwiseEvaluation
from pymoo.util.display.progress import ProgressBar

from pymoo_psi._validation import boolean, integer, invalid, job_count, known_name
from pymoo_psi.algorithms._blocks import Keep, arriving
from pymoo_psi.algorithms._plan import Plan
from pymoo_psi.algorithms._sampling import UniformSampling, uniform_sampling
from pymoo_psi.errors import EvaluationError
from pymoo_psi.evaluation._evaluator import evaluate_designs
from pymoo_psi.evaluation._failures import FAILURE_ACTIONS, untolerant
from pymoo_psi.evaluation._memory import Memory
from pymoo_psi.evaluation._outputs import table_of_values
from pymoo_psi.parallel._backend import active_workers
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.table import TestTable
from pymoo_psi.table._layout import Limits

_KEPT = ("all", "feasible", "pareto")
# Rows from which on a Pareto set is sifted on the way. Each time there are twice as many rows as
# were left, so that all sifting together takes as long as the last one, or twice that.
_WORTH_SIFTING = 2**17
# What is evaluated between two commits of a study should take about so many seconds: as much is
# lost by an interruption, and beside it a commit of some milliseconds does not count.
_SECONDS = 2.0
# Designs of a vectorised model in the first piece of a block: enough to tell what one takes, and
# few enough that a model of seconds a design loses minutes only.
_LEAST = 64


def investigate(
    problem: Any,
    n_points: int,
    *,
    first: int = 1,
    sampling: UniformSampling | None = None,
    seed: int | None = None,
    limits: Limits | None = None,
    keep: str = "all",
    block_size: int | None = None,
    progress: bool = False,
    n_jobs: int = 1,
    share: tuple[int, int] | None = None,
    study: str | PathLike[str] | None = None,
    study_key: str | None = None,
    retry: str | Collection[int] = (),
    on_failure: str = "record",
    names: Mapping[str, str] | None = None,
    maximize: Collection[str] | None = None,
    units: Mapping[str, str] | None = None,
) -> TestTable:
    """Test the points of a uniform sequence and return the table of tests.

    The result is that of ``minimize(problem, PSI(n_points)).algorithm.table``; a vectorised
    problem is evaluated at millions of points in seconds, on as many cores as are asked for.
    Memory grows with what is kept, and with the size of a block and the number of cores.

    Args:
        problem: A pymoo problem with finite bounds.
        n_points: How many points to test.
        first: Number of the first point, from 1.
        sampling: Where the points come from; as for :class:`PSI`.
        seed: Seed of a randomised sampling.
        limits: Limits on criteria that a feasible design must keep, for ``keep``.
        keep: ``"all"`` tests, the ``"feasible"`` ones or the ``"pareto"`` set of these.
        block_size: Points tested at a time; by default 65 536 of a vectorised problem, else 64.
        progress: Show a progress bar, if the output is a terminal.
        n_jobs: Processes for a vectorised problem, or workers of the cluster that
            ``joblib.parallel_config`` names; -1 for as many as there are. The table does not
            depend on it. A problem that is evaluated one design at a time has a runner of its own,
            :class:`~pymoo_psi.JoblibRunner`.
        share: As for :class:`PSI`.
        study: Name of a study file, as for :class:`PSI`.
        study_key: As for :class:`PSI`.
        retry: As for :class:`PSI`.
        on_failure: As for :class:`PSI`.
        names: As for :class:`PSI`.
        maximize: As for :class:`PSI`.
        units: As for :class:`PSI`.

    Returns:
        The table of the tests kept, by number.

    Raises:
        ArgumentValueError: A count is out of range, ``keep`` or a limit is unknown, or the
            problem does not fit, as for :class:`PSI`.
        ArgumentTypeError: An argument has the wrong type.
        StudyError: As for :class:`PSI`.
        EvaluationError: A design failed and ``on_failure`` is ``"raise"``.
        WorkerError: The problem cannot be sent to processes, or one of them was lost.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 10_000, keep="pareto")
        >>> bool(table.pareto().all())
        True
    """
    require_problem(problem)
    n_points = integer("n_points", n_points, minimum=1)
    first = integer("first", first, minimum=1)
    if block_size is None:
        # 65 536 designs fill NumPy's loops and take some megabytes; 64 let a progress bar move.
        block_size = 64 if problem.elementwise else 65_536
    block_size = integer("block_size", block_size, minimum=1)
    keep = known_name("keep", keep, _KEPT)
    if job_count("n_jobs", n_jobs) != 1 and problem.elementwise:
        rule = "1 for a problem that is evaluated one design at a time"
        remedy = "give the problem elementwise_runner=JoblibRunner(n_jobs)"
        raise invalid("n_jobs", rule, n_jobs, remedy)
    stop = known_name("on_failure", on_failure, FAILURE_ACTIONS) == "raise"
    problem, stop = untolerant(problem, stop)
    plan = Plan.of(
        problem,
        n_points,
        first=first,
        sampling=uniform_sampling(sampling),
        seed=seed,
        limits=limits,
        memory=Memory.of(study, retry, share),
        study_key=study_key,
        names=names,
        maximize=maximize,
        units=units,
    )
    kept = Keep(keep, limits)
    bar = ProgressBar() if boolean("progress", progress) and sys.stdout.isatty() else None
    tables, done = [plan.table], 0
    size = least = 0  # how many rows there are, and had been left when they were sifted last
    if problem.elementwise:
        arrivals = Investigation(plan, stop).arriving(block_size, kept)
    else:
        arrivals = arriving(plan, kept, stop=stop, block_size=block_size, n_jobs=n_jobs)
    try:
        for table, tested, _ in arrivals:
            tables.append(table)
            size += len(table)
            if keep == "pareto" and size > max(2 * least, _WORTH_SIFTING):
                tables = [_joined(tables, kept)]
                size = least = len(tables[0])
            done += tested
            if bar is not None:
                bar.set(done / len(plan.points))
    finally:
        if bar is not None:
            bar.close()
    return _joined(tables, kept)


def _joined(tables: list[TestTable], keep: Keep) -> TestTable:
    """Return what is kept of tables, by number."""
    table = tables[0].extended(*tables[1:])
    if keep.what == "pareto":  # of what is feasible or all, all was kept
        table = table.rows(keep.mask(table))
    if (np.diff(table.numbers) < 0).any():
        table = table.rows(np.argsort(table.numbers))
    return table


class Investigation:
    """The testing of a problem: its points are evaluated, or taken from a study.

    Args:
        plan: What is tested.
        stop: Whether a design that fails ends the run.

    Attributes:
        space: The variables of the problem.
        layout: The columns of the test table that the problem promises: names, senses, bounds.
        limits: ``{column of F: limit}``.
        numbers: ``(n,)`` the numbers of the points, rising.
        points: ``(n, n_var)`` the points of the unit cube.
    """

    def __init__(self, plan: Plan, stop: bool) -> None:
        self.problem, self.memory, self.stop = plan.problem, plan.memory, stop
        self.space, self.layout, self.limits = plan.space, plan.table.layout, plan.limits
        cut = plan.points.cut(range(len(plan.points)))
        self.numbers, self.points = cut.numbers, cut.units
        self._piece = 1  # how many designs take a few seconds, as far as blocks have shown

    def arriving(self, block_size: int, keep: Keep) -> Iterator[tuple[TestTable, int, int]]:
        """Test all points and give what is kept of each block, as :func:`arriving` does."""
        for start in range(0, len(self.numbers), block_size):
            table, evaluated = self.tested(start, block_size)
            yield table.rows(keep.mask(table)), len(table), evaluated

    def tested(self, start: int, count: int) -> tuple[TestTable, int]:
        """Test consecutive points; a study has each piece as soon as it is evaluated.

        Args:
            start: Index of the first of them.
            count: How many, at most.

        Returns:
            The tests, and how many of them are evaluated now.

        Raises:
            EvaluationError: A design failed and the run is to stop; it is in the study as failed.
        """
        X = self.space.matrix(self.points[start : start + count])
        numbers = self.numbers[start : start + count]
        with self.memory.turn(self.layout, numbers) as stored:
            new = np.flatnonzero(~np.isin(numbers, stored.numbers))
            blocks = []
            for piece in self._pieces(new):
                began = time.monotonic()
                out = evaluate_designs(self.problem, self.space.designs(X[piece]))
                block = table_of_values(self.layout, numbers[piece], X[piece], out)
                self.memory.keep(block, (time.monotonic() - began) / len(piece))
                if self.stop:
                    for number, reason in block.reasons.items():
                        raise EvaluationError(block.X[block.numbers == number][0], reason)
                blocks.append(block)
        table = stored.extended(*blocks)
        if len(stored):  # what is stored may have gaps, where failures are tried again
            table = table.rows(np.argsort(table.numbers))
        return table, len(new)

    def _pieces(self, rows: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
        """Cut a block into what is evaluated, and stored, at a time.

        The pieces grow until one takes a few seconds; however slow the model, a piece has a design
        for every worker. A run that stops at a failure goes one by one where the model does.
        """
        runner, elementwise = self.problem.elementwise_runner, self.problem.elementwise
        one_by_one = elementwise and isinstance(runner, LoopedElementwiseEvaluation)
        if self.memory.study is None and not (elementwise and self.stop):
            yield from [rows] if len(rows) else []
            return
        if elementwise:
            least = 1 if one_by_one else active_workers(getattr(runner, "n_jobs", -1)).count
        else:
            least = _LEAST
        start = 0
        while start < len(rows):
            began = time.monotonic()
            size = max(least, self._piece)
            yield rows[start : start + size]
            size = min(size, len(rows) - start)
            start += size
            if not (one_by_one and self.stop):
                took = max(time.monotonic() - began, 1e-6)
                # a first design, which loads libraries, says little: at most 100 times as many
                self._piece = int(size * min(_SECONDS / took, 100))
