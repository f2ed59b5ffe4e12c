"""One quantity of the page: what it is called, how its numbers are written, its values.

The decision page as data: designs in the order of drawing, columns, counts, remarks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.errors import ArgumentTypeError

if TYPE_CHECKING:
    import pandas as pd
from collections.abc import Mapping
from dataclasses import field

from pymoo_psi.page._groups import DOMINATED, OPTIMUM, PROTOTYPE, group_name

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
        raise invalid(f"column {name!r}", "finite", received, remedy)
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


@dataclass(frozen=True, eq=False)
class PageData:
    """What a page shows, the best design drawn last.

    Attributes:
        title: Heading of the page.
        columns: Criteria, then variables, then μ1, μ2, μ3; each with ``(n,)`` values.
        label_name: What the designs' labels are called, such as "test_point".
        labels: ``(n,)`` labels of the designs, integers or texts.
        rank: ``(n,)`` ranks of efficiency; -1 for prototypes.
        group: ``(n,)`` groups of drawing (:mod:`pymoo_psi.page._groups`).
        n_designs: How many designs there are, shown or not, without prototypes.
        remarks: What a reader must know, in short sentences.
        normalize: Whether the criteria are measured in units of their ranges.
        limits: Limits the page opens with, by name of the criterion.

    Example:
        >>> import pandas as pd
        >>> from pymoo_psi.page import decision_page
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]}, index=["A", "B", "C"])
        >>> data = decision_page(frame, ["cost", "mass"])
        >>> data.labels.tolist(), data.rank.tolist()
        (['A', 'C', 'B'], [0, 0, 6])
    """

    title: str
    columns: tuple[Column, ...]
    label_name: str
    labels: NDArray[Any]
    rank: NDArray[np.int32]
    group: NDArray[np.int32]
    n_designs: int
    remarks: tuple[str, ...]
    normalize: bool = True
    limits: Mapping[str, float] = field(default_factory=dict)

    def having(self, *roles: Role) -> list[Column]:
        """Return the columns with one of these roles.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0], "width": [1, 2, 3]})
            >>> data = decision_page(frame, ["cost", "mass"], variables=["width"])
            >>> [column.name for column in data.having("criterion", "variable")]
            ['cost', 'mass', 'width']
        """
        return [column for column in self.columns if column.role in roles]

    @property
    def marks(self) -> NDArray[np.object_]:
        """``(n,)`` what is special about a design; empty for most.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4, 5], "mass": [4, 1, 0, 5]})
            >>> decision_page(frame, ["cost", "mass"]).marks.tolist()
            ['dominated', '', '', 'Salukvadze optimum']
        """
        special = (PROTOTYPE, OPTIMUM, DOMINATED)
        return text_column([group_name(g) if g in special else "" for g in self.group.tolist()])

    @property
    def optima(self) -> list[str]:
        """The labels of the Salukvadze optimum.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]}, index=["A", "B", "C"])
            >>> decision_page(frame, ["cost", "mass"]).optima
            ['B']
        """
        return [str(label) for label in self.labels[self.group == OPTIMUM]]
