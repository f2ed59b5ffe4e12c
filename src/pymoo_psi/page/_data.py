"""The decision page: what it shows, as data, how its script gets it, and the file."""

from __future__ import annotations

from base64 import b64encode
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._files import whole_file
from pymoo_psi._validation import counted
from pymoo_psi.page._document import html_of
from pymoo_psi.pareto import EfficiencyRanking, settled
from pymoo_psi.table import Bounds
from pymoo_psi.table._roles import Roles, roles_head

Role = Literal["criterion", "variable", "output"]

# Under these names ``rank --out`` writes them.
_GEOMETRIC = {"mu1": "μ1 (to U)", "mu2": "μ2 (to line UN)", "mu3": "μ3 (along UN)"}
_DIGITS = 4  # that a written number resolves within the range of its column
_REASONS = 20  # why designs failed; more would not be read
# Of the distance between the quartiles: what lies farther beyond them is an outlier, a penalty
# perhaps. Of an exponential distribution that is one value in a thousand, of a normal one none.
_FENCE = 5.0
_DECADES = 2.0  # that a logarithmic scale spans at least: on a straight one a tenth is all below
# Dominators that are tried on all designs at once, before each is searched for by itself.
_STRONGEST = 64


@dataclass(frozen=True, eq=False)
class Column:
    """A quantity of the page: what it is called and its values.

    Attributes:
        name: The user's name.
        unit: The user's unit; empty if there is none.
        role: What it is.
        maximize: Whether more is better.
        values: ``(n,)`` float64, or texts.
    """

    name: str
    unit: str
    role: Role
    maximize: bool
    values: NDArray[Any]

    @property
    def is_number(self) -> bool:
        """Whether it can be an axis and have limits; of texts some can be chosen."""
        return self.values.dtype.kind == "f"


def notation_of(values: NDArray[np.float64]) -> tuple[Literal["fixed", "exponent"], int]:
    """Return how numbers are written: fixed or with an exponent, and with how many decimals.

    The decimals tell designs apart: they follow the range, not the size, of the values. From 1e7
    on, or where more than 8 decimals would be needed, an exponent is shorter.
    """
    known = values[np.isfinite(values)]
    low, high = (known.min(), known.max()) if len(known) else (0.0, 0.0)
    # Beyond all floats, the range of a column that is no criterion is as good as the greatest one.
    size, span = max(abs(low), abs(high)), min(float(high) - float(low), np.finfo(float).max)
    if size < 1e7 and (known == np.round(known)).all():
        return "fixed", 0
    # A constant has no range; its own size then says how many decimals are of use.
    decimals = _DIGITS - 1 - int(np.floor(np.log10(span if span > 0 else size)))
    if size >= 1e7 or decimals > 8:
        # Leading digits that all values have in common come on top of those that differ.
        common = 0 if span <= 0 else int(np.floor(np.log10(size) - np.log10(span)))
        return "exponent", min(_DIGITS - 1 + max(common, 0), 12)
    return "fixed", max(decimals, 0)


@dataclass(frozen=True, eq=False, repr=False)
class DecisionPage:
    """A page to decide on a Pareto set with; :func:`decision_page` makes it.

    Attributes:
        title: Heading of the page.
        columns: Criteria, variables, outputs, each with ``name``, ``unit``, ``role``,
            ``maximize`` and ``(n,)`` ``values``.
        label_name: What the designs' labels are called, such as "test_point".
        labels: ``(n,)`` labels of the designs in the order of the frame, integers or texts;
            existing designs last.
        ids: What the designs are called, each otherwise: the label, with its row if several have
            it; existing designs last.
        n_designs: How many of them are designs and no existing ones.
        ranking: The :class:`~pymoo_psi.pareto.EfficiencyRanking` of the designs without any limits.
        limits: Limits the page opens with, ``(least, greatest)`` by name of the column.
        opens_with: What else the page opens with.
        remarks: What a reader must know, in sentences.
        failed: How many designs failed, or have no finite criteria, by reason.
        infeasible: How many designs violate constraints, and are not on the page.

    Example:
        >>> import pandas as pd
        >>> from pymoo_psi.page import decision_page
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
        >>> decision_page(frame, ["cost", "mass"], title="Brackets")
        DecisionPage('Brackets': 3 designs)
    """

    title: str
    columns: tuple[Column, ...]
    label_name: str
    labels: NDArray[Any]
    ids: Sequence[str]
    n_designs: int
    ranking: EfficiencyRanking
    limits: Bounds
    opens_with: Mapping[str, Any]
    remarks: tuple[str, ...]
    failed: Mapping[str, int]
    infeasible: int

    def __repr__(self) -> str:
        """Return the title and how many designs there are."""
        return f"DecisionPage({self.title!r}: {counted(self.n_designs, 'design')})"

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
        return [str(label) for label in self.labels[self.ranking.salukvadze]]

    def html(self) -> str:
        """Return the page as one HTML document that needs no network.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
            >>> html = decision_page(frame, ["cost", "mass"], title="Brackets").html()
            >>> html.startswith("<!DOCTYPE html>"), "Brackets" in html
            (True, True)
        """
        return html_of(self.title, payload(self))

    def _repr_html_(self) -> str:
        """Return the page as a notebook shows it: in a frame that reaches nothing outside."""
        # What a notebook stores is UTF-8, which the name of a file need not be; see save.
        text = self.html().encode("utf-8", "replace").decode()
        # Without allow-same-origin the scripts of the page see neither notebook nor cookies.
        return (
            f'<iframe srcdoc="{escape(text)}" sandbox="allow-scripts allow-downloads allow-modals" '
            'style="width: 100%; height: 90vh; min-height: 600px; border: 0"></iframe>'
        )

    def save(self, path: str | PathLike[str]) -> None:
        """Write the page, whole or not at all.

        Raises:
            OSError: The file cannot be written there.

        Example:
            >>> import pathlib, tempfile
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = pathlib.Path(folder, "page.html")
            ...     decision_page(frame, ["cost", "mass"], title="Brackets").save(path)
            ...     "Brackets" in path.read_text("utf-8")
            True
        """
        html = self.html()
        with whole_file(path) as written:
            # A title may be the name of a file that is no Unicode.
            written.write_text(html, encoding="utf-8", errors="replace")


def text_column(cells: Sequence[object]) -> NDArray[np.object_]:
    """Return cells as texts, missing ones empty."""
    texts = ("" if cell is None or cell != cell else str(cell) for cell in cells)
    return np.fromiter(texts, object)


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
    wide = positive and np.quantile(values, 0.75) / 10 > np.quantile(values, 0.25)
    measured = np.log(values) if wide else values
    # Wider parts where more than half of the values are equal, and tell of no distance.
    for share in (0.25, 0.1, 0.02):
        # Python's floats, as these overflow without a warning: then all are inside.
        first, last = map(float, np.quantile(measured, [share, 1 - share]))
        if last > first:
            reach = _FENCE * (last - first)
            inside = (measured >= first - reach) & (measured <= last + reach)
            return float(values[inside].min()), float(values[inside].max())
    return float(values.min()), float(values.max())


def witnesses(F: NDArray[np.float64], optimal: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return for each dominated row one Pareto-optimal row that dominates it; -1 for the others.

    Args:
        F: ``(n, m)`` objectives without NaN, all minimised.
        optimal: ``(n,)`` which rows no other dominates.
    """
    from scipy.spatial import KDTree  # takes a tenth of a second to import

    found = np.full(len(F), -1, dtype=np.int32)
    rest, front = np.flatnonzero(~optimal), np.flatnonzero(optimal)
    if len(rest) == 0:
        return found
    # Ranks in each column, which are compared as the values are and have sums of one size. The
    # rows near the ideal point dominate most, so that a few of them leave little to search.
    ranks = np.column_stack([np.unique(column, return_inverse=True)[1] for column in settled(F).T])
    front = front[np.argsort(ranks[front].sum(axis=1), kind="stable")]
    for row in front[:_STRONGEST]:
        below = (ranks[rest] >= ranks[row]).all(axis=1)
        found[rest[below]] = row
        rest = rest[~below]
    # Of the others nearly all have a dominator among the nearest optimal rows.
    tree = KDTree(ranks[front])
    for k in (8, 64):
        if len(rest) == 0:
            return found
        near = tree.query(ranks[rest], min(k, len(front)))[1].reshape(len(rest), -1)
        below = (ranks[front[near]] <= ranks[rest][:, None]).all(axis=2)
        has = below.any(axis=1)
        found[rest[has]] = front[near[has, below[has].argmax(axis=1)]]
        rest = rest[~has]
    for part in np.array_split(rest, max(1, len(rest) * len(front) // 2_000_000)):
        below = np.ones((len(part), len(front)), dtype=bool)
        for column in ranks.T:
            below &= column[part, None] >= column[front]
        found[part] = front[below.argmax(axis=1)]
    return found


def payload(page: DecisionPage) -> dict[str, Any]:
    """Return what the script of the page works with, as JSON can hold it; see ``logic.js``.

    Numbers are little-endian float64 in base64: every digit, and a third of the length of a text.
    """
    n, ranking = page.n_designs, page.ranking
    witness = witnesses(ranking.objectives.minimized, ranking.pareto)
    labels, ids = page.labels.tolist(), list(page.ids)
    return {
        "title": page.title,
        "file": file_name(page.title),
        "label_name": page.label_name,
        "labels": labels,
        "ids": None if ids == [str(label) for label in labels] else ids,
        "n": n,
        "prototypes": len(labels) - n,
        "normalize": ranking.frame.normalize,
        "remarks": list(page.remarks),
        "failed": {
            "count": sum(page.failed.values()),
            # The most frequent ones: messages may all differ.
            "reasons": [list(pair) for pair in Counter(page.failed).most_common(_REASONS)],
        },
        "infeasible": page.infeasible,
        "columns": [
            *(_packed(f"c{j}", column, ranking.pareto) for j, column in enumerate(page.columns)),
            *(_geometric(field, name) for field, name in _GEOMETRIC.items()),
        ],
        "witness": _base64(witness),
        "head": _csv_head(page),
        "opens_with": {
            **page.opens_with,
            "limits": {
                name: [end if np.isfinite(end) else None for end in pair]
                for name, pair in page.limits.items()
            },
        },
    }


def _csv_head(page: DecisionPage) -> dict[str, Any]:
    """Return what stands above an exported CSV, so that it is ranked in the same senses."""
    names: dict[str, tuple[str, ...]] = {
        role: tuple(column.name for column in page.columns if column.role == role)
        for role in ("criterion", "variable", "output")
    }
    more = tuple(column.name for column in page.columns if column.maximize)
    roles = Roles(names["criterion"], names["variable"], page.label_name, more, names["output"])
    units = {column.name: column.unit for column in page.columns}
    numbers = {*_GEOMETRIC, *(column.name for column in page.columns if column.is_number)}
    if page.labels.dtype != object:
        numbers.add(page.label_name)
    header = [page.label_name, *units, *_GEOMETRIC, "rank", "mark"]
    return roles_head(header, numbers.__contains__, roles, units)


def _packed(field: str, column: Column, optimal: NDArray[np.bool_]) -> dict[str, Any]:
    """Return a column as the payload has it.

    Args:
        field: Its name within the page, free of the user's characters.
        column: The column.
        optimal: ``(n,)`` which designs are Pareto optimal.
    """
    packed: dict[str, Any] = {
        "field": field,
        "name": column.name,
        "unit": column.unit,
        "role": column.role,
        "maximize": column.maximize,
        "texts": None,
    }
    if not column.is_number:
        texts, places = np.unique(column.values.astype(str), return_inverse=True)
        return packed | {"texts": texts.tolist(), "values": _base64(places.astype(np.float64))}
    values = column.values[: len(optimal)]  # without those of existing designs
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


def _geometric(field: str, name: str) -> dict[str, Any]:
    """Return a column whose values depend on the limits: the script computes them."""
    packed = {"field": field, "name": name, "unit": "", "role": "geometric", "maximize": False}
    more = {"texts": None, "values": None, "notation": ["fixed", 4], "range": [0, 1], "log": False}
    return packed | more


def _base64(values: NDArray[Any]) -> str:
    little = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return b64encode(little.tobytes()).decode("ascii")


def file_name(title: str) -> str:
    """Return what the files that the page writes are called, without a suffix."""
    # Letters and digits only: a title may hold slashes, and dots would hide the file.
    words = "".join(c if c.isalnum() else " " for c in title).split()
    return "_".join(words)[:60] or "designs"
