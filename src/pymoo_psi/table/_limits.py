"""Limits on columns of a test table, which are set after the tests and change none of them."""

from __future__ import annotations

import numbers
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid, known_name, mapping, wrong_type
from pymoo_psi.table._designs import real_column
from pymoo_psi.table._layout import Layout, Limits

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Bounds = dict[str, tuple[float, float]]
"""The least and the greatest value of columns, by name and in their own sense; infinite if open."""


def bounds_of(limits: Limits | None, layout: Layout) -> Bounds:
    """Return what limits say, in the order of the table's columns.

    Raises:
        ArgumentValueError: A column is not known, is named twice, or is a constraint; a limit is
            NaN, its lower end above the upper one, or which end it is remains open.
        ArgumentTypeError: The limits are no mapping, a limit is neither number nor pair.
    """
    if limits is None:
        return {}
    mapping("limits", limits, "columns to numbers, such as {'f1': 2.5}")
    found: Bounds = {}
    for key, limit in limits.items():
        name = _limited(key, layout)
        if name in found:
            raise invalid("limits", "given once for a column", limits)
        found[name] = ends(name, limit)
        if name in layout.maximize and isinstance(limit, numbers.Real):
            raise invalid(
                f"the limit on {name!r}, of which more is better,",
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
    pair = limit if isinstance(limit, (tuple, list)) else (None, limit)
    if len(pair) != 2 or limit is None:
        raise wrong_type(f"the limit on {name!r}", "a number or a pair (lower, upper)", limit)
    low, high = _number(name, pair[0], -np.inf), _number(name, pair[1], np.inf)
    if low > high:
        raise invalid(f"the limit on {name!r}", "(lower, upper) in rising order", limit)
    return low, high


def within(bounds: Bounds, column: Callable[[str], NDArray[Any]], n: int) -> Mask:
    """``(n,)`` which rows keep every limit; what is not finite keeps none.

    Args:
        bounds: The limits.
        column: Gives the ``(n,)`` values of a column by its name, in its own sense.
        n: How many rows there are.
    """
    mask = np.ones(n, dtype=bool)
    for name, (low, high) in bounds.items():
        if low == -np.inf and high == np.inf:
            continue
        values = real_column(name, column(name))
        # Infinity is what a division by zero leaves: nothing that is known to be large enough.
        mask &= (low <= values) & (values <= high) & np.isfinite(values)
    return mask


def excess(bounds: Bounds, column: Callable[[str], NDArray[Any]], n: int) -> Array:
    """``(n,)`` by how much rows exceed limits, summed; infinite where a value is not finite."""
    total = np.zeros(n)
    for name, (low, high) in bounds.items():
        if low == -np.inf and high == np.inf:
            continue
        values = real_column(name, column(name))
        known = np.isfinite(values)
        over = np.maximum(low - values[known], 0) + np.maximum(values[known] - high, 0)
        total[known] += over
        total[~known] = np.inf
    return total


def _limited(key: Any, layout: Layout) -> str:
    if not isinstance(key, str):
        return layout.objectives[layout.objective(key)]  # by index, as everywhere
    free = [name for name in layout.columns if name not in layout.constraints]
    if key in layout.constraints:
        remedy = "leave the constraint out by Formulation(relaxed=...) to give it other limits"
        raise invalid("a limit", "on a criterion, a variable or an output", key, remedy)
    return known_name("a limit", key, free, "limits are on criteria, variables and outputs")


def _number(name: str, limit: Any, open_end: float) -> float:
    if limit is None:
        return open_end
    if isinstance(limit, (bool, np.bool_)) or not isinstance(limit, numbers.Real):
        raise wrong_type(f"the limit on {name!r}", "a number", limit)
    if isinstance(limit, int) and abs(limit) >= 2**1023:
        raise invalid(f"the limit on {name!r}", "within what float64 reaches", limit)
    # Infinity is an end that is open; NaN would reject all designs unsaid.
    if np.isnan(float(limit)):
        hint = "leave the column out where it has no limit"
        raise invalid(f"the limit on {name!r}", "a number", Received("nan"), hint)
    return float(limit)
