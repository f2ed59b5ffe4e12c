"""A vectorised model at many points: blocks of them, on one core or by workers on many.

A block is a task: its points are made, evaluated and sifted where the model runs, and only what is
kept comes back, in any order. At most a few blocks for each worker are on their way or wait here,
so that memory does not grow with the number of points.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Generator, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.algorithms._outputs import table_of_values
from pymoo_psi.algorithms._plan import Plan
from pymoo_psi.algorithms._points import Cut, Points
from pymoo_psi.algorithms._store import SECONDS
from pymoo_psi.errors import EvaluationError, PsiError, WorkerError
from pymoo_psi.parallel import active_workers, in_parallel, one_line
from pymoo_psi.problems import evaluate_designs
from pymoo_psi.problems._design_space import DesignSpace
from pymoo_psi.table import Layout, Limits, TestTable, lacking

# Designs in the first block of a run with a study: enough to tell what one takes, and few enough
# that a model of seconds a design loses minutes only.
LEAST = 64
# Blocks without a study: so many for each worker that the last ones end at about the same time.
_BLOCKS = 8
Rows: TypeAlias = "range | NDArray[np.intp]"


@dataclass(frozen=True)
class Keep:
    """Which tests of a run are kept.

    Attributes:
        what: ``"all"`` tests, the ``"feasible"`` ones or the ``"pareto"`` set of these.
        limits: Limits that a feasible design must keep.
    """

    what: str = "all"
    limits: Limits | None = None

    def mask(self, table: TestTable, threads: int = 1) -> NDArray[np.bool_]:
        """``(n,)`` which tests of a table are kept; a Pareto set is sifted by so many threads."""
        if self.what == "all":
            return np.ones(len(table), dtype=bool)
        if lacking(self.limits, table.layout):
            return np.zeros(len(table), dtype=bool)
        if self.what == "feasible":
            return table.feasible(self.limits)
        return table.pareto(self.limits, threads=threads)


@dataclass(frozen=True, eq=False)
class _Model:
    """What the task of a block needs to know.

    Attributes:
        problem: A vectorised problem, not tolerant of failures.
        space: Its variables.
        layout: The columns of its test table.
        keep: What is kept.
        stored: Whether all tests are wanted, for a study, beside those kept.
    """

    problem: Any
    space: DesignSpace
    layout: Layout
    keep: Keep
    stored: bool

    def tested(self, points: Cut) -> _Block:
        """Test some points."""
        began = time.monotonic()
        numbers, X = points.numbers, self.space.matrix(points.units)
        out = evaluate_designs(self.problem, self.space.designs(X))
        seconds = (time.monotonic() - began) / len(numbers)
        table = table_of_values(self.layout, numbers, X, out)
        kept = self.keep.mask(table)
        return _Block(table if self.stored else table.rows(kept), kept, seconds)


class _Block(NamedTuple):
    """What comes back of a block.

    Attributes:
        table: Its tests: all of them for a study, else those kept.
        kept: ``(n,)`` which of its n tests are kept.
        seconds: What the evaluation of a design took.
    """

    table: TestTable
    kept: NDArray[np.bool_]
    seconds: float


def arriving(
    plan: Plan, keep: Keep, *, stop: bool, block_size: int, n_jobs: int
) -> Iterator[tuple[TestTable, int, int]]:
    """Test all points of a plan and give what is kept of each block as it arrives.

    Blocks come from the study first, then from the workers, in any order. Each is stored before
    it is given.

    Args:
        plan: What is tested.
        keep: What is kept.
        stop: Whether a design that fails ends the run.
        block_size: Points in a block, at most.
        n_jobs: Processes, or workers as joblib is configured; -1 for all there are.

    Yields:
        The tests kept, how many were tested or stored, and how many were evaluated now.

    Raises:
        EvaluationError: A design failed and the run is to stop; it is in the study as failed.
        WorkerError: A worker process was lost, or the problem cannot be sent to one.
    """
    points, memory, n = plan.points, plan.memory, len(plan.points)
    model = _Model(plan.problem, plan.space, plan.table.layout, keep, memory.study is not None)
    if keep.what == "all":  # more than there can be room for is refused now, not after hours
        np.empty((n, 1 + len(plan.table.layout.columns)))
    missing: deque[Rows] = deque([range(n)])
    with ExitStack() as stack:
        if memory.study is not None:
            missing.clear()
            for start in range(0, n, block_size):
                rows = range(start, min(start + block_size, n))
                numbers = points.cut(rows).numbers
                stored = memory.recall(model.layout, numbers)
                if len(stored) < len(rows) and not missing:
                    # From here on nobody else tests these points; another process may have
                    # stored some before we got the lock.
                    stack.enter_context(memory.study.writing())
                    stored = memory.recall(model.layout, numbers)
                if len(stored):
                    yield stored.rows(keep.mask(stored)), len(stored), 0
                if len(stored) < len(rows):
                    missing.append(start + np.flatnonzero(~np.isin(numbers, stored.numbers)))
        blocks = stack.enter_context(
            closing(_evaluated(model, points, missing, block_size, n_jobs))
        )
        for block in blocks:
            if model.stored:
                memory.keep(block.table, block.seconds)
                kept = block.table.rows(block.kept)
            else:
                kept = block.table
            if stop:
                raise_failure(block.table)
            yield kept, len(block.kept), len(block.kept)


def raise_failure(tests: TestTable) -> None:
    """Raise the error of the first test that failed, if there is one."""
    for number, reason in tests.reasons.items():
        raise EvaluationError(tests.X[tests.numbers == number][0], reason)


def _evaluated(
    model: _Model, points: Points, missing: deque[Rows], block_size: int, n_jobs: int
) -> Generator[_Block]:
    """Evaluate rows of a run in blocks, and give these in the order in which they end."""
    workers = 1 if n_jobs == 1 else active_workers(n_jobs).count
    size = block_size
    if model.stored:
        size = min(size, LEAST)
    elif workers > 1:
        n = sum(map(len, missing))
        size = min(size, max(LEAST, -(-n // (_BLOCKS * workers))))

    def blocks() -> Iterator[Cut]:
        while missing:
            rows = missing.popleft()
            if len(rows) > size:
                missing.appendleft(rows[size:])
            yield points.cut(rows[:size])

    for block in (
        _on_workers(model, blocks(), n_jobs) if workers > 1 else map(model.tested, blocks())
    ):
        yield block
        if model.stored:
            # The first designs, which load libraries, say little: at most 100 times as many.
            fitting = SECONDS / max(block.seconds, 1e-9)
            size = max(LEAST, min(block_size, int(min(fitting, 100 * len(block.kept)))))


def _on_workers(model: _Model, blocks: Iterator[Cut], n_jobs: int) -> Iterator[_Block]:
    try:
        for _, block in in_parallel(model.tested, blocks, n_jobs):
            yield block
    except PsiError:
        raise
    except Exception as error:  # joblib's backends have errors of their own for this
        raise WorkerError(
            f"the workers did not give back what they were sent: {one_line(error)}; a problem must "
            "be one that pickle can send, and a block (block_size) fit into a worker's memory"
        ) from error
