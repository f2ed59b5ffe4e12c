"""What the decision page shows, as data: columns of numbers, designs in the order of drawing.

A design is drawn by its group: the rank of efficiency, or one of the groups named here.
"""

from __future__ import annotations

from base64 import b64encode
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto import nondominated
from pymoo_psi.pareto._rounding import settled
from pymoo_psi.table._design_file import Roles, roles_head

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
        return notation_of(self.values)

    @property
    def printf(self) -> str:
        """The notation as a format of printf."""
        kind, digits = self.notation
        return f"%.{digits}{'f' if kind == 'fixed' else 'e'}"


def notation_of(values: NDArray[np.float64]) -> tuple[Literal["fixed", "exponent"], int]:
    """Return how numbers are written, see :attr:`Column.notation`."""
    known = values[np.isfinite(values)]
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


# Of the values between the quartiles: what lies farther out by more than this many times their
# distance is an outlier, a penalty perhaps. Of an exponential distribution that is one in a
# thousand, of a normal one none.
_FENCE = 5.0
_DECADES = 2.0  # from which on a scale is logarithmic: on a straight one a tenth is all below


@dataclass(frozen=True)
class Scale:
    """The range of a column that sliders and axes show.

    Attributes:
        low: Its least value.
        high: Its greatest value, not below ``low``.
        log: Whether it is shown logarithmically; then ``low`` is above 0.
    """

    low: float
    high: float
    log: bool

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> Scale:
        """Return the range of ``(n,)`` values without NaN, n >= 0, that leaves outliers out."""
        if len(values) == 0:
            return cls(0.0, 0.0, log=False)
        low, high = _without_outliers(values)
        inside = values[(low <= values) & (values <= high)]
        # Logarithmic where a straight scale would press most of the values into its first tenth.
        middle = float(np.median(inside))
        crowded = middle - low < 0.1 * (high - low)
        return cls(low, high, log=bool(low > 0 and high >= 10**_DECADES * low and crowded))


def _without_outliers(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the least and the greatest of values that are no outliers."""
    # Values over decades, by their sizes: of 1, 10, …, 1e6 none is an outlier.
    positive = bool(values.min() > 0)
    wide = positive and np.quantile(values, 0.75) > 10 * np.quantile(values, 0.25)
    measured = np.log(values) if wide else values
    low, high = float(measured.min()), float(measured.max())
    # Wider parts where more than half of the values are equal, and tell of no distance.
    for share in (0.25, 0.1, 0.02):
        first, last = np.quantile(measured, [share, 1 - share])
        if last > first:
            reach = _FENCE * (last - first)
            inside = (measured >= first - reach) & (measured <= last + reach)
            return float(values[inside].min()), float(values[inside].max())
    return (float(values.min()), float(values.max())) if wide else (low, high)


def witnesses(F: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return for each dominated row one Pareto-optimal row that dominates it; -1 for the others.

    Args:
        F: ``(n, m)`` objectives without NaN, all minimised.
    """
    found = np.full(len(F), -1, dtype=np.int32)
    optimal = nondominated(F)
    F = settled(F)
    front = np.flatnonzero(optimal)
    rest = np.flatnonzero(~optimal)
    # Ranks in each column, which are compared as the values are and have sums of one size. The
    # rows near the ideal point dominate most, so that a few of them leave little to search.
    ranks = np.column_stack([np.unique(column, return_inverse=True)[1] for column in F.T])
    front = front[np.argsort(ranks[front].sum(axis=1), kind="stable")]
    for row in front[:64]:
        below = (ranks[rest] >= ranks[row]).all(axis=1)
        found[rest[below]] = row
        rest = rest[~below]
    for part in np.array_split(rest, max(1, len(rest) * len(front) // 2_000_000)):
        below = np.ones((len(part), len(front)), dtype=bool)
        for column in ranks.T:
            below &= column[part, None] >= column[front]
        found[part] = front[below.argmax(axis=1)]
    return found


def design_ids(labels: Sequence[object]) -> list[str]:
    """Return what states and decision files call designs: the label, with its row if it is not one.

    Example:
        >>> design_ids([7, "A", "A"])
        ['7', 'A #2', 'A #3']
    """
    texts = [str(label) for label in labels]
    count = Counter(texts)
    return [t if count[t] == 1 else f"{t} #{row}" for row, t in enumerate(texts, start=1)]


def payload(data: PageData) -> dict[str, Any]:
    """Return what the script of the page works with, as JSON can hold it; see ``logic.js``.

    Numbers are little-endian float64 in base64: every digit, and a third of the length of a text.
    """
    designs = data.group != PROTOTYPE
    n = int(designs.sum())
    criteria = [column for column in data.columns if column.role == "criterion"]
    F = np.column_stack([-c.values if c.maximize else c.values for c in criteria])
    witness = witnesses(F[:n])
    ids = design_ids(data.labels.tolist())
    labels = data.labels.tolist()
    return {
        "title": data.title,
        "file": file_name(data.title),
        "label_name": data.label_name,
        "labels": labels,
        "ids": None if ids == [str(label) for label in labels] else ids,
        "n": n,
        "prototypes": len(labels) - n,
        "normalize": data.normalize,
        "remarks": list(data.remarks),
        "failed": {"count": 0, "reasons": []},
        "infeasible": 0,
        "columns": [_packed(column, witness < 0, n) for column in data.columns],
        "witness": _base64(witness),
        "head": csv_head(data),
        "opens_with": _opening(data),
    }


def csv_head(data: PageData) -> dict[str, Any]:
    """Return what stands above an exported CSV, so that it is ranked in the same senses."""
    names: dict[str, tuple[str, ...]] = {
        role: tuple(column.name for column in data.columns if column.role == role)
        for role in ("criterion", "variable", "output")
    }
    # The geometric criteria are exported under the names that ``rank --out`` gives them.
    known = {c.field if c.role == "geometric" else c.name: c for c in data.columns}
    more = tuple(column.name for column in data.columns if column.maximize)
    roles = Roles(names["criterion"], names["variable"], data.label_name, more, names["output"])
    units = {name: column.unit for name, column in known.items()}
    numbers = {name for name, column in known.items() if column.is_number}
    if data.labels.dtype != object:
        numbers.add(data.label_name)
    return roles_head([data.label_name, *known, "rank", "mark"], numbers.__contains__, roles, units)


def _opening(data: PageData) -> dict[str, Any]:
    maximized = {column.name for column in data.columns if column.maximize}
    limits = {
        name: [limit, None] if name in maximized else [None, limit]
        for name, limit in data.limits.items()
    }
    return {"limits": limits}


def _packed(column: Column, optimal: NDArray[np.bool_], n: int) -> dict[str, Any]:
    """Return a column as the payload has it; ``optimal`` are the ``(n,)`` Pareto-optimal rows."""
    packed: dict[str, Any] = {
        "field": column.field,
        "name": column.name,
        "unit": column.unit,
        "role": column.role,
        "maximize": column.maximize,
        "texts": None,
        "values": None,
    }
    if column.role == "geometric":
        return packed | {"notation": ["fixed", 4], "range": [0, 1], "log": False}
    if not column.is_number:
        texts, places = np.unique(column.values.astype(str), return_inverse=True)
        return packed | {"texts": texts.tolist(), "values": _base64(places.astype(np.float64))}
    values = column.values[:n]
    known = np.isfinite(values)
    scale = Scale.of(values[known & optimal])
    beyond = known & ((values < scale.low) | (values > scale.high))
    return packed | {
        "values": _base64(column.values),
        "notation": notation_of(values[known & optimal & ~beyond]),
        "range": [scale.low, scale.high],
        "log": scale.log,
        "clipped": int((beyond & optimal).sum()),
        "beyond": int(beyond.sum()),
    }


def _base64(values: NDArray[Any]) -> str:
    little = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return b64encode(little.tobytes()).decode("ascii")


def file_name(title: str) -> str:
    """Return what the files that the page writes are called, without a suffix."""
    # Letters and digits only: a title may hold slashes, and dots would hide the file.
    words = "".join(c if c.isalnum() else " " for c in title).split()
    return "_".join(words)[:60] or "designs"
