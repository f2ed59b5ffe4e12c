"""First-order sensitivities: how much of a column's variance each variable explains by itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, counted, integer, invalid, known_name
from pymoo_psi.errors import PsiError
from pymoo_psi.table._designs import value_ranks
from pymoo_psi.table._table import TestTable

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

_HARMONICS = 10  # SALib's own number, which Tarantola et al. recommend
# The bands come from halves of the tests, and a half must hold more values than the harmonics take
# (two each, a sine and a cosine).
_LEAST = 4 * _HARMONICS + 4


def sensitivities(
    table: TestTable,
    columns: Sequence[str] | None = None,
    *,
    n_resamples: int = 50,
    seed: int = 1,
) -> pd.DataFrame:
    """Return the first-order sensitivity of columns to each variable, from the tests at hand.

    The index S_i of a variable is the share of a column's variance that the variable explains by
    itself: Var(E[y | x_i]) / Var(y). What the S_i lack to 1 is interaction. It is estimated by
    RBD-FAST with the bias correction of Tissot and Prieur (Reliability Engineering and System
    Safety 107, 2012) as SALib has it, which needs no further evaluation. Estimates scatter about
    0 where a variable explains nothing, so they may be negative. A jump, as between two values of
    a binary variable, loses up to 4 % of its share.

    All tests whose value is finite count, feasible or not: the variables must be independent and
    uniform within the bounds, which is not so of the feasible designs only, nor where many fail.

    Args:
        table: The tests of one investigation.
        columns: Names of objectives, constraints and further outputs; all of them unless given.
        n_resamples: Bootstrap samples for the bands, of half of the tests each, which makes them
            cautious; of 50 they are known to a tenth.
        seed: Of these samples.

    Returns:
        Index ``(column, variable)``; ``first_order``, the index S_i; ``lower`` and ``upper``, the
        ends of its band, which holds the true value at 95 %. Variables with one value are left
        out; NaN where a column is constant.

    Raises:
        PsiError: SALib is not installed.
        ArgumentValueError: There is no such column, it is a variable, or it has too few values.

    Example:
        Of x1 + 2 x2 the first variable explains 1/5 of the variance, the second 4/5.

        >>> from pymoo_psi import lp_tau
        >>> X = lp_tau(1024, 2)
        >>> table = TestTable.of(range(1, 1025), X, (X @ [1, 2])[:, None])
        >>> sensitivities(table)["first_order"].round(2).tolist()
        [0.18, 0.8]
    """
    try:
        from SALib.analyze import rbd_fast
    except ImportError as error:
        raise PsiError(
            "sensitivities need SALib, which is not installed; pip install SALib scikit-learn"
        ) from error
    import pandas as pd

    layout = table.layout
    n_resamples = integer("n_resamples", n_resamples, minimum=2)
    seed = integer("seed", seed, minimum=1)
    dependent = layout.columns[len(layout.variables) :]
    names = list(dependent) if columns is None else list(columns)
    variables = [name for name in layout.variables if len(set(table.column(name).tolist())) > 1]
    rows = []
    for name in names:
        known_name("a column", name, dependent)
        y = table.column(name)
        finite = np.isfinite(y)
        y = y[finite]
        if len(y) < _LEAST:
            found = Received(counted(len(y), "finite value"))
            raise invalid(name, f"known of {_LEAST} tests or more", found, "test more points")
        X = np.column_stack([_places(table, variable, finite, y) for variable in variables])
        problem = {"num_vars": len(variables), "names": variables, "bounds": [[0, 1]]}
        if y.min() == y.max():
            estimate = band = np.full(len(variables), np.nan)
        else:
            # SALib before 1.6 seeds NumPy's global generator.
            state = np.random.get_state()  # noqa: NPY002
            try:
                found = rbd_fast.analyze(
                    problem, X, y, M=_HARMONICS, num_resamples=n_resamples, seed=seed
                )
            finally:
                np.random.set_state(state)  # noqa: NPY002
            estimate, band = np.array(found["S1"]), np.array(found["S1_conf"])
        rows += [
            (name, *row)
            for row in zip(variables, estimate, estimate - band, estimate + band, strict=True)
        ]
    frame = pd.DataFrame(rows, columns=["column", "variable", "first_order", "lower", "upper"])
    return frame.set_index(["column", "variable"])


def _places(table: TestTable, variable: str, rows: NDArray[np.bool_], y: Array) -> Array:
    """``(n,)`` numbers by which the tests of some rows are put in the order of a variable."""
    column = table.column(variable)[rows]
    if table.kinds[table.layout.variable(variable)] is not Kind.CHOICE:
        return column.astype(np.float64)
    # Options have no order, and in a bad one a few harmonics would miss their effect: the order
    # of their means. That fits at most as many levels as there are options, and the correction
    # counts twenty.
    _, ranks = value_ranks(column)
    means = np.bincount(ranks, y) / np.bincount(ranks)
    places: Array = np.argsort(np.argsort(means)).astype(np.float64)[ranks]
    return places
