"""Limits on columns: what they say, which rows keep them, by how much rows exceed them."""

from __future__ import annotations

import numbers
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import invalid, known_name, mapping, wrong_type
from pymoo_psi.table._designs import real_column
from pymoo_psi.table._layout import Layout, Limits

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Bounds = dict[str, tuple[float, float]]
"""The least and the greatest value of columns by name, in the original direction; infinite if
open."""


def bounds_of(limits: Limits | None, layout: Layout) -> Bounds:
    """Return what limits say, in the order of the table's columns.

    Raises:
        ArgumentValueError: A column is not known, is named twice, or is a constraint; a limit is
            NaN, its lower end above the upper one, or which end it is remains open.
        ArgumentTypeError: The limits are no mapping, a limit is neither number nor pair.
    """
    found: Bounds = {}
    limits = {} if limits is None else limits
    for key, limit in mapping("limits", limits, "columns to numbers, such as {'f1': 2.5}").items():
        name = key if isinstance(key, str) else layout.objectives[layout.objective(key)]
        if name in layout.constraints:
            remedy = "leave the constraint out by Formulation(relaxed=...) to give it other limits"
            raise invalid("a limit", "on an objective, a variable or an output", name, remedy)
        known_name("a limit", name, [n for n in layout.columns if n not in layout.constraints])
        if name in found:
            raise invalid("limits", "given once for a column", limits)
        found[name] = ends(name, limit)
        if name in layout.maximize and isinstance(limit, numbers.Real):
            raise invalid(
                f"the limit on {name!r}, which is maximised,",
                "a pair (lower, upper)",
                limit,
                f"say ({limit}, None) for at least or (None, {limit}) for at most",
            )
    # The order of the columns, not of the mapping: columns of violations stand in it.
    return {name: found[name] for name in layout.columns if name in found}


def lacking(limits: Limits | None, layout: Layout) -> bool:
    """Whether a limit is on no column so far: on an output that only later tests may have.

    A test without a value keeps no limit, so no test so far keeps this one. Whether the name is a
    mistake is known when all tests are there, however they were cut into blocks.
    """
    names = limits if isinstance(limits, Mapping) else ()
    return any(isinstance(name, str) and name not in layout.columns for name in names)


def ends(name: str, limit: Any) -> tuple[float, float]:
    """Return the least and the greatest value that a limit allows; a number is the greatest.

    Raises:
        ArgumentValueError: A number is NaN, or the lower one is above the upper one.
        ArgumentTypeError: It is neither a number nor a pair of numbers or None.
    """
    pair = tuple(limit) if isinstance(limit, (tuple, list)) else (None, limit)
    values = [np.inf * (2 * k - 1) if end is None else end for k, end in enumerate(pair)]
    plain = all(isinstance(v, numbers.Real) and not isinstance(v, (bool, np.bool_)) for v in values)
    if len(pair) != 2 or limit is None or not plain:
        raise wrong_type(f"the limit on {name!r}", "a number or a pair (lower, upper)", limit)
    try:
        low, high = map(float, values)
    except OverflowError:
        low = high = np.nan
    if not low <= high:  # of NaN, too
        raise invalid(f"the limit on {name!r}", "(lower, upper) in increasing order", limit)
    return low, high


def within(bounds: Bounds, column: Callable[[str], NDArray[Any]], n: int) -> Mask:
    """``(n,)`` which rows keep every limit; what is not finite keeps none.

    Args:
        bounds: The limits.
        column: Gives the ``(n,)`` values of a column by its name, in the original direction.
        n: How many rows there are.
    """
    mask = np.ones(n, dtype=bool)
    for low, high, values in _limited(bounds, column):
        # Infinity is what a division by zero leaves: nothing that is known to be large enough.
        mask &= (low <= values) & (values <= high) & np.isfinite(values)
    return mask


def excess(bounds: Bounds, column: Callable[[str], NDArray[Any]], n: int) -> Array:
    """``(n,)`` by how much rows exceed limits, summed; infinite where a value is not finite."""
    total = np.zeros(n)
    for low, high, values in _limited(bounds, column):
        known = np.isfinite(values)
        over = np.maximum(low - values[known], 0) + np.maximum(values[known] - high, 0)
        total[known] += over
        total[~known] = np.inf
    return total


def _limited(
    bounds: Bounds, column: Callable[[str], NDArray[Any]]
) -> Iterator[tuple[float, float, Array]]:
    """Yield the ends and the values of each limit that is not open at both ends."""
    for name, (low, high) in bounds.items():
        if low > -np.inf or high < np.inf:
            yield low, high, real_column(name, column(name))
