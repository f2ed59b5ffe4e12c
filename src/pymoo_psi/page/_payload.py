"""The data of the page: columns, their scales and digits, as JSON can hold them."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto import SENTENCES, nondominated
from pymoo_psi.table import Kind, TestTable

Array = NDArray[np.float64]

# Under these names ``rank --out`` writes them.
_GEOMETRIC = {"mu1": "μ1 (to U)", "mu2": "μ2 (to line UN)", "mu3": "μ3 (along UN)"}
_DIGITS = 4  # that a written number resolves within the range of its column
# Of the distance between the quartiles: what lies farther beyond them is an outlier, a penalty
# perhaps. Of an exponential distribution that is one value in a thousand, of a normal one none.
_FENCE = 5.0
_DECADES = 2.0  # that a logarithmic scale spans at least: on a straight one a tenth is all below


def payload(
    title: str,
    table: TestTable,
    former: TestTable | None,
    opens_with: Mapping[str, Any],
    said: Sequence[str],
) -> dict[str, Any]:
    """Return what the script of the page works with, see ``decode`` in ``logic.js``.

    Numbers are little-endian float64 in base64: every digit, and a third of the length of a text.

    Args:
        title: Heading of the page.
        table: Feasible designs, one or more.
        former: Existing designs to compare with; None if there are none.
        opens_with: The decision that the page opens with, as a formulation in JSON.
        said: Reasons not to rely on the optimum of all designs.
    """
    layout = table.layout
    optimal = nondominated(table.F)
    names = table.names
    labels = _labels(table)
    if former is not None:
        taken = set(names)
        names += [f"{name} (existing)" if name in taken else name for name in former.names]
        labels += _labels(former)
    roles = {
        "objective": layout.objectives,
        "variable": layout.variables,
        "output": (*layout.outputs, *(name for name in table.extra if name != layout.label)),
    }
    columns = [(role, name) for role, names in roles.items() for name in names]
    return {
        "title": title,
        "file": "_".join("".join(c if c.isalnum() else " " for c in title).split())[:60] or "page",
        "label": layout.label or "test_point",
        "labels": labels,
        "names": names,
        "n": len(table),
        "normalize": opens_with["normalize"],
        "columns": [
            *(
                # The field is free of the user's characters.
                {"field": f"c{j}", "name": name, "unit": layout.units.get(name, ""), "role": role}
                | {"maximize": name in layout.maximize, "texts": None}
                | _packed(values_of(name, table, former), optimal, log=layout.is_log(name))
                for j, (role, name) in enumerate(columns)
            ),
            *(_geometric(field, name) for field, name in _GEOMETRIC.items()),
        ],
        "optimal": _base64(optimal.view(np.uint8)),
        "head": {
            "pymoo_psi_designs": 1,
            "objectives": layout.objectives,
            "maximized": layout.maximize,
            "variables": layout.variables,
            "outputs": layout.outputs,
            "units": {name: layout.units[name] for _, name in columns if layout.units.get(name)},
        },
        "opens_with": dict(opens_with),
        "remarks": list(table.remarks),
        "cautions": list(said),
        "sentences": SENTENCES,
    }


def notation_of(near: Array, known: Array) -> tuple[Literal["fixed", "exponent"], int]:
    """Return how numbers are written: fixed or with an exponent, and with how many decimals.

    Numbers of up to three decimals and seven digits are written as they are. Otherwise the decimals
    tell designs apart: they follow the range, not the size, of the values near the optimal ones.
    From 1e7 on, or where more than 8 decimals would be needed, an exponent is shorter.
    """
    low, high = (near.min(), near.max()) if len(near) else (0.0, 0.0)
    # Beyond all floats, the range of an output is as good as the greatest one.
    size, span = max(abs(low), abs(high)), min(float(high) - float(low), np.finfo(float).max)
    for decimals in range(4):
        if size < 10.0 ** (7 - decimals) and (known == np.round(known, decimals)).all():
            return "fixed", decimals
    # A constant has no range; its own size then says how many decimals are of use.
    decimals = _DIGITS - 1 - int(np.floor(np.log10(span if span > 0 else size)))
    if size >= 1e7 or decimals > 8:
        # Leading digits that all values have in common come on top of those that differ.
        common = 0 if span <= 0 else int(np.floor(np.log10(size) - np.log10(span)))
        return "exponent", min(_DIGITS - 1 + max(common, 0), 12)
    return "fixed", max(decimals, 0)


def scale_of(values: Array) -> tuple[float, float, bool]:
    """Return the range of ``(n,)`` values that axes show, outliers left out, and if it is log."""
    if len(values) == 0:
        return 0.0, 0.0, False
    # Values over decades, by their sizes: of 1, 10, …, 1e6 none is an outlier.
    decades = values.min() > 0 and np.quantile(values, 0.75) / 10 > np.quantile(values, 0.25)
    measured, kept = np.log(values) if decades else values, values
    # Wider parts where more than half of the values are equal, and tell of no distance.
    for share in (0.25, 0.1, 0.02):
        # Python's floats, as these overflow without a warning: then all are inside.
        first, last = map(float, np.quantile(measured, [share, 1 - share]))
        if last > first:
            reach = _FENCE * (last - first)
            kept = values[(measured >= first - reach) & (measured <= last + reach)]
            break
    low, high = float(kept.min()), float(kept.max())
    # Logarithmic where a straight scale would press most of the values into its first tenth.
    crowded = float(np.median(kept)) - low < 0.1 * (high - low)
    return low, high, low > 0 and high >= 10**_DECADES * low and crowded


def values_of(name: str, table: TestTable, former: TestTable | None = None) -> NDArray[Any]:
    """Return ``(n,)`` numbers or texts, those of existing designs last, NaN or empty if none."""
    layout = table.layout
    cells: list[Any] = []
    for one in (table, former) if former is not None else (table,):
        if name in one.extra:
            cells += one.extra[name].tolist()
        elif name in one.layout.columns:
            cells += one.column(name).tolist()
        else:
            cells += [None] * len(one)
    kinds = dict(zip(layout.variables, table.kinds, strict=True))
    if name in table.extra or kinds.get(name) is Kind.CHOICE:
        return np.array(["" if c is None or c != c else str(c) for c in cells], dtype=object)
    return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)


def _labels(table: TestTable) -> list[Any]:
    label = table.layout.label
    if label is None:
        return [*table.numbers.tolist()]
    return [cell if type(cell) is int else str(cell) for cell in table.extra[label].tolist()]


def _packed(every: NDArray[Any], optimal: NDArray[np.bool_], *, log: bool) -> dict[str, Any]:
    """Return the values of a column as the payload has them, those of existing designs last."""
    if every.dtype == object:
        texts, places = np.unique(every.astype(str), return_inverse=True)
        return {"texts": texts.tolist(), "values": _base64(places.astype(np.float64))}
    finite = every[np.isfinite(every)]
    values = every[: len(optimal)]  # without those of existing designs
    known = np.isfinite(values)
    low, high, crowded = scale_of(values[known & optimal])
    # what is spread over decades has its digits in each of them
    decades = log and high > 10**_DECADES * low
    beyond = known & optimal & ((values < low) | (values > high))
    near = values[known & optimal & ~beyond]
    return {
        "values": _base64(every),
        "notation": ("exponent", _DIGITS - 1) if decades else notation_of(near, finite),
        "range": [low, high],
        "log": crowded or (log and low > 0),
        "clipped": int(beyond.sum()),
    }


def _geometric(field: str, name: str) -> dict[str, Any]:
    """Return a column whose values depend on the limits: the script computes them."""
    packed = {"field": field, "name": name, "unit": "", "role": "geometric", "maximize": False}
    more = {"texts": None, "values": None, "notation": ["fixed", 4], "range": [0, 1], "log": False}
    return packed | more


def _base64(values: NDArray[Any]) -> str:
    little = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return b64encode(little.tobytes()).decode("ascii")
