"""One quantity of the page: what it is called, how its numbers are written, its values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.arguments import Received, broken_rule
from pymoo_psi.errors import ArgumentTypeError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Column", "Role", "checked_values", "text_column"]

Role = Literal["criterion", "variable", "geometric", "text"]

_DIGITS = 4  # that a written number resolves within the range of its column


@dataclass(frozen=True, eq=False)
class Column:
    """A column of the page.

    Attributes:
        field: Its name within the page, free of the user's characters.
        name: The user's name.
        unit: The user's unit; empty if there is none.
        role: What it is; columns of text are shown in the table only.
        maximize: Whether more is better.
        values: ``(n,)`` float64, or texts.
    """

    field: str
    name: str
    unit: str
    role: Role
    maximize: bool
    values: NDArray[Any]

    @property
    def label(self) -> str:
        """Name and unit, for axes and headings."""
        unit = f" [{self.unit}]" if self.unit else ""
        return f"{self.name}{unit}{' (max)' if self.maximize else ''}"

    @property
    def is_number(self) -> bool:
        """Whether it can be an axis."""
        return self.role != "text"

    @property
    def extent(self) -> tuple[float, float]:
        """The least and the greatest value; (0, 0) if there is none."""
        known = self.values[np.isfinite(self.values)]
        return (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)

    @property
    def notation(self) -> tuple[Literal["fixed", "exponent"], int]:
        """How its numbers are written: fixed or with an exponent, and with how many decimals."""
        low, high = self.extent
        size, span = max(abs(low), abs(high)), high - low
        known = self.values[np.isfinite(self.values)]
        if size < 1e7 and (known == np.round(known)).all():
            return "fixed", 0
        decimals = _DIGITS - 1 - int(np.floor(np.log10(span if span > 0 else size)))
        if size >= 1e7 or decimals > 8:
            lost = 0 if span <= 0 else int(np.floor(np.log10(size) - np.log10(span)))
            return "exponent", min(_DIGITS - 1 + max(lost, 0), 12)
        return "fixed", max(decimals, 0)

    @property
    def printf(self) -> str:
        """The notation as a format of printf."""
        kind, digits = self.notation
        return f"%.{digits}{'f' if kind == 'fixed' else 'e'}"


def checked_values(frame: pd.DataFrame, name: str, *, complete: bool) -> NDArray[np.float64]:
    """Return a column of a frame as float64.

    Args:
        frame: The frame.
        name: One of its columns.
        complete: Refuse missing values.

    Raises:
        ArgumentTypeError: The column holds something other than numbers.
        ArgumentValueError: A value is infinite, or missing where it must not be.
    """
    from pandas.api.types import is_bool_dtype, is_numeric_dtype

    column = frame[name]
    if not (is_numeric_dtype(column) or is_bool_dtype(column)):
        cell, row = _first_text(column.tolist())
        raise ArgumentTypeError(
            f"column {name!r} must be numbers, got {cell!r:.40} in row {row + 1}"
        )
    values = column.to_numpy(dtype=np.float64, na_value=np.nan)
    bad = ~np.isfinite(values) if complete else np.isinf(values)
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        received = Received(f"{values[row]} in row {row + 1}")
        remedy = "leave out designs that failed" if complete else ""
        raise broken_rule(f"column {name!r}", "finite", received, remedy)
    return values


def text_column(cells: Sequence[object]) -> NDArray[np.object_]:
    """Return cells as texts, missing ones empty."""
    texts = np.empty(len(cells), dtype=object)
    texts[:] = ["" if cell is None or cell != cell else str(cell) for cell in cells]
    return texts


def _first_text(cells: Sequence[object]) -> tuple[object, int]:
    for row, cell in enumerate(cells):
        try:
            float(cell)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            return cell, row
    return (cells[0] if cells else "nothing"), 0
