"""What is entered in a test table, checked: numbers of test points, reasons of failures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.table._layout import Layout, is_writable


def widths(layout: Layout) -> dict[str, int]:
    """Return how many columns X, F, G and H have."""
    groups = (layout.variables, layout.objectives, layout.inequalities, layout.equalities)
    return {name: len(group) for name, group in zip("XFGH", groups, strict=True)}


def point_numbers(value: ArrayLike) -> NDArray[np.int64]:
    """Return numbers of test points as an array of its own: integers from 1, each once."""
    array = np.asarray(value)
    if array.size and array.dtype.kind not in "iu":
        raise ArgumentTypeError(f"numbers must be integers from 1, got dtype {array.dtype}")
    if array.ndim != 1:
        raise invalid("numbers", "one-dimensional", Received(f"shape {array.shape}"))
    numbers = np.array(array, dtype=np.int64)
    if (numbers < 1).any():
        raise invalid("numbers", "integers from 1", Received(str(numbers.min())))
    require_distinct(numbers)
    return numbers


def require_distinct(numbers: NDArray[np.int64]) -> None:
    """Refuse numbers of test points of which one occurs twice."""
    if (numbers[1:] > numbers[:-1]).all():
        return
    values, counts = np.unique(numbers, return_counts=True)
    if (counts > 1).any():
        twice = Received(f"test point {values[counts > 1][0]} twice")
        raise invalid("the test points of a table", "distinct", twice)


def reason_texts(reasons: Mapping[int, str]) -> dict[int, str]:
    """Return reasons of failures by number of the test point, as texts that files can hold."""
    if not isinstance(reasons, Mapping):
        raise ArgumentTypeError(f"reasons must map test points to texts, got {reasons!r:.80}")
    return {int(number): _readable(str(text)) for number, text in reasons.items()}


def _readable(reason: str) -> str:
    """Return a reason without what no file can hold; it is only to be read."""
    if not is_writable(reason):
        reason = reason.replace("\0", "␀").encode("utf-8", "backslashreplace").decode("utf-8")
    return reason or "no reason given"
