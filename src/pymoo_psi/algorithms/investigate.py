"""Parameter Space Investigation on arrays, for many cheap designs.

``minimize(problem, PSI(n))`` makes an object of every design, as pymoo's algorithms do. Here the
points pass through the problem in large blocks, and only what is wanted is kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.util.display.progress import ProgressBar

from pymoo_psi.arguments import boolean, integer, known_name
from pymoo_psi.design_space import DesignSpace, design_space, problem_layout
from pymoo_psi.host import require_problem
from pymoo_psi.investigation import Layout, TestTable
from pymoo_psi.investigation.layout import Limits
from pymoo_psi.sampling import LPTauSampling, UniformSampling, require_uniform

__all__ = ["investigate"]

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
    block_size: int = 65_536,
    progress: bool = False,
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
        block_size: Points evaluated at a time.
        progress: Show a progress bar.

    Returns:
        The table of the tests kept, by number.

    Raises:
        ArgumentValueError: A count is out of range, ``keep`` or a limit is unknown, or the
            problem does not fit, as for :class:`PSI`.
        ArgumentTypeError: An argument has the wrong type.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 10_000, keep="pareto")
        >>> bool(table.pareto().all())
        True
    """
    require_problem(problem)
    n_points = integer("n_points", n_points, minimum=1)
    first = integer("first", first, minimum=1)
    block_size = integer("block_size", block_size, minimum=1)
    keep = known_name("keep", keep, _KEPT)
    sampling = require_uniform(LPTauSampling() if sampling is None else sampling)
    space = design_space(problem)
    layout = problem_layout(problem, space)
    points = sampling.unit_points(
        n_points, len(space.variables), first=first, random_state=np.random.default_rng(seed)
    )
    bar = ProgressBar() if boolean("progress", progress) else None
    kept: list[TestTable] = []
    try:
        for start in range(0, n_points, block_size):
            X = space.matrix(points[start : start + block_size])
            numbers = np.arange(first + start, first + start + len(X))
            kept.append(_wanted(_tested(problem, space, layout, numbers, X), keep, limits))
            if keep == "pareto":
                _sift(kept, limits)
            if bar is not None:
                bar.set((start + len(X)) / n_points)
    finally:
        if bar is not None:
            bar.close()
    return _wanted(TestTable.empty(layout).extended(*kept), keep, limits)


def _tested(problem: Any, space: DesignSpace, layout: Layout, numbers: Any, X: Any) -> TestTable:
    out = problem.evaluate(
        _as_objects(space.designs(X)),
        return_values_of=["F", "G", "H"],
        return_as_dictionary=True,
    )
    return TestTable.of(numbers, X, out["F"], out["G"], out["H"], layout=layout)


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
