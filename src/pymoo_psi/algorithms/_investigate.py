"""Parameter Space Investigation on arrays, for many cheap designs.

``minimize(problem, PSI(n))`` makes an object of every design, as pymoo's algorithms do. Here the
points pass through the problem in large blocks, and only what is wanted is kept.
"""

from __future__ import annotations

import sys
from collections.abc import Collection
from os import PathLike
from typing import Any

import numpy as np
from pymoo.util.display.progress import ProgressBar

from pymoo_psi._validation import boolean, integer, known_name
from pymoo_psi.algorithms._memory import Memory, fingerprint
from pymoo_psi.algorithms._psi import problem_layout
from pymoo_psi.algorithms._sampling import LPTauSampling, UniformSampling, require_uniform
from pymoo_psi.errors import EvaluationError
from pymoo_psi.evaluation._evaluator import evaluate_guarded, failure_action
from pymoo_psi.evaluation._failures import unguarded
from pymoo_psi.problems import DesignSpace, design_space
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.table import Layout, TestTable
from pymoo_psi.table._layout import Limits
from pymoo_psi.table._limits import limit_vector

_KEPT = ("all", "feasible", "pareto")


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
    study: str | PathLike[str] | None = None,
    study_key: str | None = None,
    retry: str | Collection[int] = (),
    on_failure: str = "record",
) -> TestTable:
    """Test the points of a uniform sequence and return the table of tests.

    The result is that of ``minimize(problem, PSI(n_points)).algorithm.table``; a vectorised
    problem is evaluated at millions of points in seconds. Memory grows with what is kept and with
    the size of a block only.

    Args:
        problem: A pymoo problem with finite bounds.
        n_points: How many points to test.
        first: Number of the first point, from 1.
        sampling: Where the points come from; ``LPTauSampling()`` by default.
        seed: Seed of a randomised sampling.
        limits: Limits on criteria that a feasible design must keep, for ``keep``.
        keep: ``"all"`` tests, the ``"feasible"`` ones or the ``"pareto"`` set of these.
        block_size: Points evaluated, and stored in a study, at a time; by default 65 536 of a
            vectorised problem without a study, else 64.
        progress: Show a progress bar, if the output is a terminal.
        study: Name of a study file, as for :class:`PSI`.
        study_key: As for :class:`PSI`.
        retry: As for :class:`PSI`.
        on_failure: As for :class:`PSI`; ``"raise"`` stops after the block of the failed design.

    Returns:
        The table of the tests kept, by number.

    Raises:
        ArgumentValueError: A count is out of range, ``keep`` or a limit is unknown, or the
            problem does not fit, as for :class:`PSI`.
        ArgumentTypeError: An argument has the wrong type.
        StudyError: As for :class:`PSI`.
        EvaluationError: A design failed and ``on_failure`` is ``"raise"``.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 10_000, keep="pareto")
        >>> bool(table.pareto().all())
        True
    """
    require_problem(problem)
    problem = unguarded(problem)
    n_points = integer("n_points", n_points, minimum=1)
    first = integer("first", first, minimum=1)
    if block_size is None:
        block_size = 65_536 if study is None and not problem.elementwise else 64
    block_size = integer("block_size", block_size, minimum=1)
    keep = known_name("keep", keep, _KEPT)
    sampling = require_uniform(LPTauSampling() if sampling is None else sampling)
    space = design_space(problem)
    layout = problem_layout(problem, space)
    points = sampling.unit_points(
        n_points, len(space.variables), first=first, random_state=np.random.default_rng(seed)
    )
    memory, on_failure = Memory.of(study, retry), failure_action("on_failure", on_failure)
    if memory.study is not None:
        memory.study.begin(layout, fingerprint(problem, space, sampling, n_points, seed, study_key))
    limit_vector(limits, layout)  # a wrong limit is told before the first evaluation
    bar = ProgressBar() if boolean("progress", progress) and sys.stdout.isatty() else None
    kept: list[TestTable] = []
    try:
        for start in range(0, n_points, block_size):
            X = space.matrix(points[start : start + block_size])
            numbers = np.arange(first + start, first + start + len(X))
            with memory.writing():
                stored = memory.recall(layout, int(numbers[0]), len(X))
                new = ~np.isin(numbers, stored.numbers)
                tested = TestTable.empty(layout)
                if new.any():
                    tested = _tested(problem, space, layout, numbers[new], X[new])
                    memory.keep(tested)
            if on_failure == "raise":
                _require_success(tested)
            block = stored.merge(tested) if len(stored) else tested
            kept.append(_wanted(block, keep, limits))
            if keep == "pareto":
                _sift(kept, limits)
            if bar is not None:
                bar.set((start + len(X)) / n_points)
    finally:
        if bar is not None:
            bar.close()
    return _wanted(TestTable.empty(layout).extended(*kept), keep, limits)


def _tested(problem: Any, space: DesignSpace, layout: Layout, numbers: Any, X: Any) -> TestTable:
    F, G, H, failures = evaluate_guarded(problem, _as_objects(space.designs(X)))
    reasons = {n: r for n, r in zip(numbers.tolist(), failures, strict=True) if r}
    return TestTable.of(numbers, X, F, G, H, reasons=reasons, layout=layout)


def _require_success(tested: TestTable) -> None:
    for number, reason in tested.reasons.items():
        raise EvaluationError(tested.X[tested.numbers == number][0], reason)


def _as_objects(designs: Any) -> Any:
    """Return named designs as the array of objects that a population would hand over."""
    if isinstance(designs, list):
        array = np.empty(len(designs), dtype=object)
        array[:] = designs
        return array
    return designs


def _wanted(table: TestTable, keep: str, limits: Limits | None) -> TestTable:
    if keep == "all":
        return table
    return table.rows(table.feasible(limits) if keep == "feasible" else table.pareto(limits))


def _sift(kept: list[TestTable], limits: Limits | None) -> None:
    """Join the last Pareto sets while the older one is not much larger.

    So each row is sifted a number of times that grows only with the logarithm of the blocks.
    """
    while len(kept) > 1 and len(kept[-2]) < 2 * len(kept[-1]):
        last = kept.pop()
        kept.append(_wanted(kept.pop().extended(last), "pareto", limits))
