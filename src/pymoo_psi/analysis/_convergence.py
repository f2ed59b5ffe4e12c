"""Convergence of the decision with the number of tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._numbers import percent
from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.analysis._sampling import even_part
from pymoo_psi.pareto import UtopianFrame, hypervolume
from pymoo_psi.table import TestTable

if TYPE_CHECKING:
    import pandas as pd

_FIRST = 8  # tests of the first row of a convergence; fewer have no front to speak of
# The reference point of the hypervolume, in units of the last front's range: a little beyond its
# worst values, so that the designs at its ends count, too.
_REFERENCE = 1.1
# The least gain for which the other half of the tests is worth it: the share of μ1 by which the
# best design came nearer, or the share of the last hypervolume that the first half lacks.
_WORTH = 0.01


def convergence(table: TestTable) -> pd.DataFrame:
    """Return the decisions that the first half, quarter, … of the tests give.

    The number of tests n doubles from row to row up to all tests. Distances use the scale of all
    tests, so that rows can be compared. If one design is the best in every objective, there is no
    scale, and ``mu1``, ``hypervolume`` and ``moved`` are NaN. :func:`convergence_sentence` states
    the result.

    Args:
        table: The tests of an investigation.

    Returns:
        Index: ``tests``, the numbers n. Columns:

        - ``feasible``, how many are feasible;
        - ``pareto``, how many of these are Pareto optimal among the first n;
        - ``hypervolume``, what their front dominates, as a share of what the last one does;
        - ``volume_error``, the standard error of that share; 0 where it is exact;
        - ``optimum``, the test nearest to U by the ranking of the first n; 0 where no design is
          feasible;
        - ``mu1``, its distance to the U of all tests; infinite where there is none;
        - ``moved``, how far it is from the optimum of the row before: the largest difference in an
          objective, in units of the objective's range over the last front; NaN if there was none.

    Raises:
        ArgumentValueError: There is no feasible design, there are fewer than eight tests, or an
            algorithm has chosen them, see :func:`even_part`.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> steps = convergence(investigate(VectorizedSphereChute(0.4, model="rolling"), 64))
        >>> print(steps[["pareto", "optimum", "mu1"]].round(2))
               pareto  optimum   mu1
        tests
        8           6        5  0.78
        16         12       13  0.58
        32         18       21  0.49
        64         36       21  0.49
    """
    import pandas as pd

    table, _ = even_part(table)
    if len(table) < _FIRST:
        received = Received(counted(len(table), "test"))
        raise invalid("the table", f"of {_FIRST} tests or more", received, "test more points")
    # What the first n tests decide, n doubling: their front, and their optimum or -1.
    n_sizes = (len(table) // _FIRST).bit_length()
    sizes = len(table) >> np.arange(n_sizes)[::-1]
    fronts = []
    optima = []
    for n in sizes:
        first = table.take(np.arange(n))
        fronts.append(np.flatnonzero(first.pareto()))
        optima.append(-1)
        if len(fronts[-1]):
            ranking = first.ranking()
            optima[-1] = int(ranking.rows[ranking.salukvadze[0]])
    # Measured in the units of the ranking of all tests; no optimum has NaN for its objectives.
    frame = table.ranking().frame
    scale = UtopianFrame(frame.ideal, frame.nadir, True)
    best = np.insert(table.F, len(table), np.nan, axis=0)[optima]
    mu1 = frame.distances(best)[:, 0]
    moved = np.abs(np.diff(scale.scaled(best), axis=0, prepend=np.nan)).max(axis=1)
    pairs = [hypervolume(scale.scaled(table.F[front]), _REFERENCE) for front in fronts]
    volumes, errors = np.array(pairs).T / (pairs[-1][0] or 1.0)
    if not frame.line.any():  # one design is the best in every objective
        mu1, volumes, moved = np.full((3, len(sizes)), np.nan)
    columns = {
        "feasible": np.cumsum(table.feasible())[sizes - 1],
        "pareto": list(map(len, fronts)),
        "hypervolume": volumes,
        "volume_error": errors,
        "optimum": np.append(table.numbers, 0)[optima],
        "mu1": mu1,
        "moved": moved,
    }
    return pd.DataFrame(columns, pd.Index(sizes, name="tests"))


def convergence_sentence(steps: pd.DataFrame) -> str:
    """Return a sentence on what the last doubling of the tests changed in the decision.

    The effect of the next doubling is not predicted, because no such estimate proved reliable on
    problems with known solutions.

    Args:
        steps: What :func:`convergence` returns.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
        >>> print(convergence_sentence(convergence(table.under(normalize=False))))
        The last doubling, from 512 to 1024 tests, still mattered: it brought ...
    """
    n = steps.index[-1]
    last = steps.iloc[-1]
    if len(steps) < 2 or not steps["optimum"].iloc[-2]:
        return (
            f"Too few tests to tell: {last['feasible']:.0f} of {n} are feasible, and half of the "
            "tests must have had some."
        )
    before = steps.iloc[-2]
    doubling = f"The last doubling, from {steps.index[-2]} to {n} tests,"
    unknown = (
        "Not known: whether there is a better region between the tests, and how right the model is."
    )
    if np.isnan(last["moved"]):  # distances have no unit
        change = "the design that is the best in every objective"
        if last["optimum"] == before["optimum"]:
            change = "nothing"
        return f"{doubling} changed {change}. {unknown}"
    nearer = max(0.0, before["mu1"] - last["mu1"]) / (before["mu1"] or 1.0)
    share = before["hypervolume"]
    mattered = "hardly mattered"
    if max(nearer, 1 - share - 2 * before["volume_error"]) > _WORTH:
        mattered = "still mattered"
    return (
        f"{doubling} {mattered}: it brought the best design {percent(nearer)} nearer to the ideal "
        f"point, moved it by {percent(last['moved'])} of a range, and enlarged the hypervolume "
        f"from {percent(share)} of its present value. {unknown}"
    )
