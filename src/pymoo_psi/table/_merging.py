"""Tables of runs made apart, put together by the numbers of their test points."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.table._records import Records

Mask = NDArray[np.bool_]
Table = TypeVar("Table", bound=Records)
_BLOCKS = ("X", "F", "G", "H", "status")


def merged(a: Table, b: Table) -> Table:
    """Return the tests of both tables by number; see :meth:`TestTable.merge`."""
    if not isinstance(b, type(a)):
        raise ArgumentTypeError(f"other must be a TestTable, got {b!r:.80}")
    for blank, other in ((a, b), (b, a)):
        if len(blank) == 0 and blank.layout.is_blank:
            return _sorted(other)
    difference = a.layout.difference(b.layout) or _prototype_difference(a, b)
    if difference:
        raise invalid("other", "a table of the same problem", Received(difference))
    _, in_a, in_b = np.intersect1d(a.numbers, b.numbers, assume_unique=True, return_indices=True)
    if len(in_a):
        for block in _BLOCKS:
            same = same_cells(getattr(a, block)[in_a], getattr(b, block)[in_b])
            for i in np.flatnonzero(~same.reshape(len(in_a), -1).all(axis=1)):
                _refuse(int(a.numbers[in_a[i]]), block)
        for number in a.numbers[in_a].tolist() if a.reasons or b.reasons else ():
            if a.reasons.get(number) != b.reasons.get(number):
                _refuse(number, "reason")
        new = np.ones(len(b), dtype=bool)
        new[in_b] = False
        b = b.rows(new)
    return _sorted(a.extended(b))


def difference_of_tables(a: Records, b: Records) -> str:
    """Say in what two tables differ first; empty if in nothing. NaN is equal to NaN."""
    difference = a.layout.difference(b.layout)
    if difference:
        return difference
    if len(a) != len(b) or (a.numbers != b.numbers).any():
        return "test points"
    for block in _BLOCKS:
        if not same_cells(getattr(a, block), getattr(b, block)).all():
            return block
    if dict(a.reasons) != dict(b.reasons):
        return "reasons"
    if (a.prototype is None) != (b.prototype is None):
        return "prototype"
    return _prototype_difference(a, b)


def same_cells(a: NDArray[Any], b: NDArray[Any]) -> Mask:
    """Mark the cells of two arrays of one shape that are equal, NaN to NaN, and of one type."""
    if a.dtype == object or a.dtype != b.dtype:
        cells = [
            type(x) is type(y) and x == y
            for x, y in zip(a.ravel().tolist(), b.ravel().tolist(), strict=True)
        ]
        return np.array(cells, dtype=bool).reshape(a.shape)
    same: Mask = a == b
    if a.dtype.kind == "f":
        same |= np.isnan(a) & np.isnan(b)
    return same


def _prototype_difference(a: Records, b: Records) -> str:
    if a.prototype is None or b.prototype is None or a.prototype.same_as(b.prototype):
        return ""
    return f"prototype {a.prototype.name!r} against {b.prototype.name!r} or its values"


def _refuse(number: int, block: str) -> None:
    raise invalid(
        "other",
        "a table with the same results for the same test points",
        Received(f"another {block} for test point {number}"),
        "do not merge runs of different problems, boxes or versions",
    )


def _sorted(table: Table) -> Table:
    if (table.numbers[1:] > table.numbers[:-1]).all():
        return table
    return table.rows(np.argsort(table.numbers))
