"""First-order sensitivities of columns to variables, from the tests at hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._validation import (
    AnyArray,
    Array,
    Names,
    Received,
    counted,
    invalid,
    known_name,
)
from pymoo_psi.analysis._sampling import even_part
from pymoo_psi.table import NUMBERS_ROLES, PROPOSAL_ROUND, TestTable, value_ranks

if TYPE_CHECKING:
    import pandas as pd

_COSINES = 10  # terms that show the effect of a variable with many values
_LEAST_TESTS = 40  # tests, of which ten terms explain a quarter by chance


def sensitivities(table: TestTable, columns: Names | None = None) -> pd.DataFrame:
    """Return the first-order sensitivity of columns to each variable, from the tests at hand.

    The index S_i of a variable is the share of a column's variance that the variable explains by
    itself: Var(E[y | x_i]) / Var(y). The rest, 1 minus the sum, is due to interactions. For a
    variable with few values, such as a choice, E[y | x_i] is the mean for each value; otherwise it
    is a sum of ten cosines of its rank, as in the given-data estimates of Plischke (Reliability
    Engineering and System Safety 95, 2010). The share that as many terms explain by chance is
    subtracted, so that an estimate may be negative. The effects of stronger variables are
    subtracted first, because few points of a sequence may confound two variables. A jump in a real
    variable loses up to 4 % of its share.

    All tests with a finite value count, feasible or not, because the variables must be independent
    and uniform within the bounds; this does not hold for the feasible designs alone, nor if many
    fail. For the role of an algorithm's proposals see :func:`even_part`.

    Args:
        table: The tests of one investigation.
        columns: Names of objectives, constraints and further outputs; all of them unless given.

    Returns:
        Index ``(column, variable)``; ``first_order``, the index S_i; ``lower`` and ``upper``, its
        95 % confidence band. Variables with one value are omitted; NaN if a column is constant.

    Raises:
        ArgumentValueError: The tests are no even sample, or a column is unknown, a variable or has
            too few values.

    Example:
        Of x1 + 2 x2 the first variable explains 1/5 of the variance, the second 4/5.

        >>> from pymoo_psi import lp_tau
        >>> X = lp_tau(1024, 2)
        >>> table = TestTable.of(range(1, 1025), X, (X @ [1, 2])[:, None])
        >>> sensitivities(table)["first_order"].round(2).tolist()
        [0.2, 0.8]
    """
    import pandas as pd

    table, _ = even_part(table)
    dependent = []
    for name in table.schema.of_role(*NUMBERS_ROLES):
        if name != PROPOSAL_ROUND:
            dependent.append(name)
    variables = []
    for name in table.schema.variables:
        if len(set(table.column(name).tolist())) > 1:
            variables.append(name)
    rows = []
    # The bases are those of all columns that are known of the same tests.
    bases_by_tests = {}
    for name in dependent if columns is None else columns:
        known_name("a column", name, dependent)
        values = table.column(name)
        finite = np.isfinite(values)
        y = values[finite]
        if len(y) < _LEAST_TESTS:
            raise invalid(
                name,
                f"known of {_LEAST_TESTS} tests or more",
                Received(counted(len(y), "finite value")),
                "test more points",
            )
        key = finite.tobytes()
        if key not in bases_by_tests:
            bases_by_tests[key] = [_basis(table.column(v)[finite]) for v in variables]
        shares = np.full((len(variables), 3), np.nan)
        if y.min() < y.max():
            shares = _shares(bases_by_tests[key], y)
        for variable, row in zip(variables, shares, strict=True):
            rows.append((name, variable, *row))
    frame = pd.DataFrame(rows, columns=["column", "variable", "first_order", "lower", "upper"])
    return frame.set_index(["column", "variable"])


def _basis(column: AnyArray) -> Array:
    """Return ``(n, p)`` orthonormal functions of a variable, each of mean 0."""
    values, ranks = value_ranks(column)
    if len(values) <= _COSINES + 1 or isinstance(values[0], str):
        functions = np.eye(len(values))[ranks][:, 1:]
    else:
        counts = np.bincount(ranks)
        midpoints = (np.cumsum(counts) - counts / 2) / len(column)
        functions = np.cos(np.pi * np.outer(midpoints[ranks], np.arange(1, _COSINES + 1)))
    return np.linalg.qr(functions - functions.mean(axis=0))[0]


def _shares(bases: list[Array], y: Array) -> Array:
    """Return ``(n_var, 3)`` the share of the variance that each basis explains, and its band."""
    n = len(y)
    y = y / np.abs(y).max()  # no square overflows
    y = (y - y.mean()) / y.std()
    strengths = [float(((Q.T @ y) ** 2).sum()) - Q.shape[1] for Q in bases]
    shares = np.full((len(bases), 3), np.nan)
    unexplained = y
    for j in np.argsort(strengths)[::-1]:  # the strongest first
        Q = bases[j]
        p = Q.shape[1]
        free = n - p - 1
        if free < 1:
            continue
        fit = Q @ (Q.T @ unexplained)
        fit_of_y = Q @ (Q.T @ y)
        explained = (fit**2).mean()
        share = explained - p / free * ((unexplained - fit) ** 2).mean()
        half = _half_width(y, fit_of_y, p, free)
        # A sequence may be so even that nothing is explained by chance: then `explained` is right.
        shares[j] = share, share - half, max(share + half, explained)
        if share > half:
            unexplained = unexplained - fit
    return shares


def _half_width(y: Array, fit: Array, p: int, free: int) -> float:
    """Return half the width of the band about a share of the variance that p terms explain.

    The standard error of 1 - left as a ratio of two means, and what p terms have by chance.
    """
    left = ((y - fit) ** 2).mean()
    ratio = left * y**2 - (y - fit) ** 2
    half: float = 1.96 * np.sqrt((ratio**2).mean() / free + 2 * p * left**2 / (len(y) * free))
    return half
