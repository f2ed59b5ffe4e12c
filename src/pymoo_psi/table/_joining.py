"""Tables put together: what they must have in common, and what may not differ."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, flat, invalid
from pymoo_psi.table._designs import design_matrix, first_rows, joined_designs
from pymoo_psi.table._layout import ORIGIN, Layout, joined_layout

if TYPE_CHECKING:
    from pymoo_psi.table._table import TestTable

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_ROUNDING = 1e-9  # relative, of results that two machines have computed


def outputs_under(layout: Layout, table: TestTable) -> Array:
    """Return the outputs of a table in a layout that has them all; NaN for others."""
    names = layout.outputs
    outputs = np.full((len(table), len(names)), np.nan)
    outputs[:, [names.index(name) for name in table.layout.outputs]] = table.outputs
    return outputs


def stacked(tables: Sequence[TestTable]) -> TestTable:
    """Return the tests of tables one below the other, with layout and problem of all.

    Args:
        tables: One or more. Those without tests and columns take on those of the others.

    Raises:
        ArgumentValueError: They differ.
    """
    tables = [t for t in tables if len(t) or t.layout.columns] or tables[:1]
    whole = tables[0]
    for table in tables[1:]:
        if found := difference(whole, table):
            raise invalid("tables", "of one problem and formulation to be joined", Received(found))
        whole = whole._with(
            layout=joined_layout(whole.layout, table.layout),
            problem=whole.problem if "problem" in (whole.problem or {}) else table.problem,
        )
    X = joined_designs([t.X for t in tables])
    # Designs of a block that declares no kinds take those of the others.
    if any(t.layout.kinds != whole.layout.kinds for t in tables):
        X = design_matrix("X of a block", X, whole.layout.variables, whole.layout.kinds)
    extra = dict.fromkeys(name for table in tables for name in table.extra)
    none = [np.full(len(table), None, dtype=object) for table in tables]
    stacks = {n: [t.extra.get(n, gap) for t, gap in zip(tables, none, strict=True)] for n in extra}
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(t, name) for t in tables])
        for name in ("numbers", "F", "G", "H", "status")
    }
    return whole._with(
        X=X,
        outputs=np.concatenate([outputs_under(whole.layout, t) for t in tables]),
        reasons={n: text for t in tables[::-1] for n, text in t.reasons.items()},
        extra={name: np.concatenate(parts) for name, parts in stacks.items()},
        remarks=tuple(dict.fromkeys(remark for t in tables for remark in t.remarks)),
        **joined,
    )


def require_one_result(table: TestTable, first: NDArray[np.intp] | None = None) -> None:
    """Refuse tests of which the first of the same design has another result.

    Args:
        table: The tests.
        first: ``(n,)`` the row of the first test with the same number; by the designs of those that
            have not failed unless given.
    """
    layout = table.layout
    columns = {name: table.column(name) for name in layout.columns}
    if first is None:
        first = np.arange(len(table))
        known = np.flatnonzero(table.status != "failed")
        first[known] = known[first_rows(table.X[known])]
    else:
        columns |= {"status": table.status, **table.extra}
    again = np.flatnonzero(first != np.arange(len(table)))
    if len(again) == 0:
        return
    for name, column in columns.items():
        one, two = column[first[again]], column[again]
        other = unequal(one, two, _ROUNDING)
        if name in layout.outputs or name in table.extra:  # which not every experiment has
            other &= ~(blank(one) | blank(two))
        if other.any():
            i = other.argmax()
            pair = [table.rows([row]) for row in (first[again[i]], again[i])]
            a, b = (one.names[0] for one in pair)
            if table.experiments:
                where = [[one.extra[name][0] for name in ORIGIN] for one in pair]
                a, b = (f"test point {number} of {name}" for name, number in where)
            which = a if a == b else f"{a} and {b}, the same design"
            found = Received(f"{one[i]} and {two[i]} as {name} of {which}")
            remedy = "do not join runs of different problems, bounds or versions"
            raise invalid("tests", "of one result for each test point and design", found, remedy)


def blank(column: NDArray[Any]) -> Mask:
    """``(n,)`` which cells hold nothing."""
    if column.dtype.kind == "f":
        return np.asarray(np.isnan(column))
    return np.array([cell is None or cell != cell for cell in column.tolist()], dtype=bool)


def unequal(one: NDArray[Any], two: NDArray[Any], rounding: float = 0.0) -> Mask:
    """``(n,)`` where cells differ; NaN is equal to NaN, and 1 is not to True."""
    if one.dtype.kind == "f" == two.dtype.kind:
        other = (one != two) & ~(np.isnan(one) & np.isnan(two))
        if rounding and other.any():
            other &= ~np.isclose(one, two, rtol=rounding, atol=0)
        return np.asarray(other)
    pairs = zip(one.tolist(), two.tolist(), strict=True)
    return np.array([type(u) is not type(v) or u != v for u, v in pairs], dtype=bool)


def difference(a: TestTable, b: TestTable, *, apart_from: Collection[str] = ()) -> str:
    """Say in what two tables differ first besides their tests; empty if in nothing.

    What one of them does not have or know is no difference: an output, kinds, problem.
    """
    if a.layout is b.layout and a.problem is b.problem:
        return ""
    one, other = _facts(a), _facts(b)
    keys = [key for key in one if key in other]
    mine, theirs = (flat(table.problem or {}) for table in (a, b))
    if "problem" in mine and "problem" in theirs:
        keys += sorted({*mine, *theirs})
        one, other = one | mine, other | theirs
    for key in keys:
        if key not in apart_from and one.get(key) != other.get(key):
            return f"{key} {one.get(key)} against {other.get(key)}"
    return ""


def _facts(table: TestTable) -> dict[str, str]:
    """Return what is known of a table besides its tests, as texts, in which NaN is equal to NaN."""
    layout = table.layout
    groups = ("variables", "objectives", "inequalities", "equalities", "eq_tolerance")
    facts: dict[str, Any] = {name: getattr(layout, name) for name in groups}
    for name in layout.columns:
        facts[f"unit of {name}"] = layout.units.get(name, "none")
        facts[f"direction of {name}"] = "max" if name in layout.maximize else "min"
    facts["fixed ranges"] = table.formulation.ranges or {}
    facts["limits"] = table.limits
    facts |= {f"kind of {n}": k.value for n, k in zip(layout.variables, layout.kinds, strict=False)}
    bounds = zip(layout.lower.tolist(), layout.upper.tolist(), strict=True)
    facts |= {f"bounds of {n}": pair for n, pair in zip(layout.variables, bounds, strict=True)}
    return {key: str(value) for key, value in facts.items()}
