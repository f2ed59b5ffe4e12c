"""What the decision page shows, as data: columns of numbers, designs in the order of drawing.

A design is drawn by its group: the rank of efficiency, or one of the groups named here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Role = Literal["criterion", "variable", "output", "geometric"]

DOMINATED, OPTIMUM, PROTOTYPE = -1, 6, 7
"""Groups beside the ranks 0 to 5; a higher group is drawn on top."""
# page.js knows them as numbers: 7 stays whatever the limits, above 5 lines are bold, above 0 they
# do not fade with their number.

# page.js looks for the optimum by this text among the marks.
_SPECIAL = {OPTIMUM: "Salukvadze optimum", DOMINATED: "dominated", PROTOTYPE: "prototype"}

_DIGITS = 4  # that a written number resolves within the range of its column


@dataclass(frozen=True, eq=False)
class Column:
    """A quantity of the page: what it is called, how its numbers are written, its values.

    Attributes:
        field: Its name within the page, free of the user's characters.
        name: The user's name.
        unit: The user's unit; empty if there is none.
        role: What it is.
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
        """Whether it can be an axis; a column of texts is in the table only."""
        return self.values.dtype.kind == "f"

    @property
    def notation(self) -> tuple[Literal["fixed", "exponent"], int]:
        """How its numbers are written: fixed or with an exponent, and with how many decimals.

        The decimals tell designs apart: they follow the range, not the size, of the values. From
        1e7 on, or where more than 8 decimals would be needed, an exponent is shorter.
        """
        known = self.values[np.isfinite(self.values)]
        low, high = (known.min(), known.max()) if len(known) else (0.0, 0.0)
        size, span = max(abs(low), abs(high)), high - low
        # The axes change to an exponent at the same size: power_limit_high in the theme.
        if size < 1e7 and (known == np.round(known)).all():
            return "fixed", 0
        # A constant has no range; its own size then says how many decimals are of use.
        decimals = _DIGITS - 1 - int(np.floor(np.log10(span if span > 0 else size)))
        if size >= 1e7 or decimals > 8:
            # Leading digits that all values have in common come on top of those that differ.
            common = 0 if span <= 0 else int(np.floor(np.log10(size) - np.log10(span)))
            return "exponent", min(_DIGITS - 1 + max(common, 0), 12)
        return "fixed", max(decimals, 0)

    @property
    def printf(self) -> str:
        """The notation as a format of printf."""
        kind, digits = self.notation
        return f"%.{digits}{'f' if kind == 'fixed' else 'e'}"


@dataclass(frozen=True, eq=False)
class PageData:
    """What a page shows, the best design drawn last.

    Attributes:
        title: Heading of the page.
        columns: Criteria, variables, outputs, then μ1, μ2, μ3; each with ``(n,)`` values.
        label_name: What the designs' labels are called, such as "test_point".
        labels: ``(n,)`` labels of the designs, integers or texts.
        rank: ``(n,)`` ranks of efficiency; -1 for prototypes.
        group: ``(n,)`` groups of drawing: ranks, but -1 dominated, 6 the Salukvadze optimum
            whatever its rank, 7 a prototype.
        n_designs: How many designs there are, shown or not, without prototypes.
        remarks: What a reader must know, in short sentences.
        normalize: Whether the criteria are measured in units of their ranges.
        limits: Limits the page opens with, by name of the criterion.
    """

    title: str
    columns: tuple[Column, ...]
    label_name: str
    labels: NDArray[Any]
    rank: NDArray[np.int32]
    group: NDArray[np.int32]
    n_designs: int
    remarks: tuple[str, ...]
    normalize: bool
    limits: Mapping[str, float]

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
        return text_column([_SPECIAL.get(g, "") for g in self.group.tolist()])

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


def columns_with(data: PageData, *roles: Role) -> list[Column]:
    """Return the columns of numbers with one of these roles, for axes."""
    return [column for column in data.columns if column.role in roles and column.is_number]


def group_name(group: int) -> str:
    """Return what the page calls a group."""
    return _SPECIAL.get(group) or (f"rank {group}" if group else "unranked")


def text_column(cells: Sequence[object]) -> NDArray[np.object_]:
    """Return cells as texts, missing ones empty."""
    texts = np.empty(len(cells), dtype=object)
    texts[:] = ["" if cell is None or cell != cell else str(cell) for cell in cells]
    return texts
