"""Which tests sample their bounds evenly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pymoo_psi._validation import Received, counted, instance, invalid
from pymoo_psi.table import POINT, PROPOSAL_ROUND, RUN, TestTable

_BY_ALGORITHM = "an algorithm"  # samplings that follow no sequence
_BY_PEOPLE = "tests of "
_SAMPLE = "an even sample of one set of bounds"


def even_part(table: TestTable) -> tuple[TestTable, tuple[str, ...]]:
    """Return the tests that sample the bounds evenly, and remarks on them.

    Sensitivities and convergence use these tests only, because designs chosen by an algorithm show
    where it searched. If the sampling is unknown, all tests are returned, and a remark says so.

    Args:
        table: Tests of any origin.

    Returns:
        The tests, in their order, and sentences on which they are and how many failed.

    Raises:
        ArgumentValueError: There is none.

    Example:
        >>> from pymoo_psi import lp_tau
        >>> table, sentences = even_part(TestTable.of(range(1, 65), lp_tau(64, 2), lp_tau(64, 2)))
        >>> print(len(table), *sentences)
        64 It is unknown how designs were sampled: ...
    """
    instance("table", table, TestTable)
    sentences = []
    if {RUN, POINT} <= {*table.schema.notes}:
        run, table = _largest_sample(table)
        sentences.append(f"By {counted(len(table), 'test')} of run {run} alone.")
    sampling = str((table.problem or {}).get("sampling") or "")
    if _BY_ALGORITHM in sampling:
        raise invalid("the tests", _SAMPLE, Received("those that an algorithm has chosen"))
    if PROPOSAL_ROUND in table.schema.outputs:
        # Tests that failed have no round.
        proposed = table.numbers[table.column(PROPOSAL_ROUND) > 0]
        n = len(table)
        table = table.take(table.numbers < proposed.min(initial=np.iinfo(np.int64).max))
        if len(table) < n:
            sentences.append(
                f"By the first {len(table)} of {n} tests, the points of a sequence: surrogates "
                "proposed the others."
            )
    elif not sampling:
        sentences.append(
            "It is unknown how designs were sampled: sensitivities and convergence hold only if "
            "they are spread evenly over the bounds, and in no order of their values."
        )
    # A requirement has rejected a design that is infeasible without objectives.
    lost = int(np.sum((table.status == "failed") | ~np.isfinite(table.F).all(axis=1)))
    if lost:
        sentences.append(
            f"Of {counted(len(table), 'test')} {lost} failed or were rejected and do not count; if "
            "they are many, the others are not spread evenly and sensitivities are rough."
        )
    return table, tuple(sentences)


def _largest_sample(table: TestTable) -> tuple[str, TestTable]:
    """Return the run of a study that has most points of a sequence, and its tests."""
    runs = (table.problem or {}).get("runs", {})
    sizes = {}
    for run, points in runs.items():
        if not str(points.get("sampling")).startswith((_BY_ALGORITHM, _BY_PEOPLE)):
            sizes[run] = np.sum(table[RUN] == int(run))
    if not any(sizes.values()):  # tests of a run may all be those of another one
        received = Received("tests that algorithms or people have chosen")
        raise invalid("the tests", _SAMPLE, received)
    run = max(sizes, key=lambda run: sizes[run])
    points = runs[run]
    part = table.take(table[RUN] == int(run))
    bounds = {}
    for side in ("lower", "upper"):
        bounds[side] = dict(zip(part.evaluated.variables, points[side], strict=True))
    schema = part.evaluated.changed(**bounds)
    return run, replace(part, evaluated=schema, problem={"sampling": points.get("sampling")})
