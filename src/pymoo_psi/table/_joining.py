"""Joining of tables: what they must have in common, and what may not differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._validation import (
    AnyArray,
    Mask,
    Received,
    Rows,
    Values,
    flat,
    invalid,
)
from pymoo_psi.table._layout import (
    blank,
    design_matrix,
    joined_designs,
    joined_layout,
)

if TYPE_CHECKING:
    from pymoo_psi.table._table import TestTable


_ROUNDING = 1e-9  # the relative difference of results that two machines have computed


def stacked(tables: Sequence[TestTable]) -> TestTable:
    """Return the tests of tables one below the other, with their joint layout and problem.

    Args:
        tables: One or more. Those without tests and columns are left out.

    Raises:
        ArgumentValueError: They differ.
    """
    tables = [table for table in tables if len(table) or table.layout.columns] or tables[:1]
    whole = tables[0]
    for table in tables[1:]:
        differing = difference(whole, table)
        if differing:
            raise invalid(
                "tables", "of one problem and formulation to be joined", Received(differing)
            )
        problem = table.problem
        if "problem" in (whole.problem or {}):
            problem = whole.problem
        whole = whole._with(layout=joined_layout(whole.layout, table.layout), problem=problem)
    X = joined_designs([table.X for table in tables])
    # Designs of a block that declares no kinds take those of the others.
    if any(table.layout.kinds != whole.layout.kinds for table in tables):
        X = design_matrix("X of a block", X, whole.layout.variables, whole.layout.kinds)
    joined = {}
    for name in ("numbers", "F", "G", "H", "_codes"):
        joined[name] = np.concatenate([getattr(table, name) for table in tables])
    reasons: dict[int, str] = {}
    remarks: dict[str, None] = {}  # each remark once, in order
    for table in tables:
        reasons = {**table.reasons, **reasons}  # the first of the tests with one number counts
        remarks |= dict.fromkeys(table.remarks)
    outputs = [np.zeros((len(X), 0))]
    for name in whole.layout.outputs:
        outputs.append(_stacked_column(tables, name, np.nan))
    extra = {}
    for name in dict.fromkeys(name for table in tables for name in table.extra):
        extra[name] = _stacked_column(tables, name, None)
    return whole._with(
        X=X,
        outputs=np.column_stack(outputs),
        reasons=reasons,
        extra=extra,
        remarks=tuple(remarks),
        **joined,
    )


def _stacked_column(tables: Sequence[TestTable], name: str, missing: float | None) -> AnyArray:
    """Return the cells of a column of all tables."""
    parts: list[AnyArray] = []
    for table in tables:
        if name in table.columns:
            parts.append(table.column(name))
        else:
            parts.append(np.full(len(table), missing))
    return np.concatenate(parts)


def merged(table: TestTable, other: TestTable) -> TestTable:
    """Return the tests of two runs as evaluated; see :meth:`TestTable.merge`."""
    require_one_formulation([table, other])
    whole = stacked([table.tested, other.tested])
    _, rows, inverse = np.unique(whole.numbers, return_index=True, return_inverse=True)
    # first[i] is the first row with the number of row i.
    first = rows[inverse]
    _require_one_result(whole, first)
    later = np.flatnonzero(first != np.arange(len(whole)))
    earlier = first[later]
    outputs = whole.outputs.copy()
    outputs[earlier] = np.where(np.isnan(outputs[earlier]), outputs[later], outputs[earlier])
    extra = {name: column.copy() for name, column in whole.extra.items()}
    for column in extra.values():
        unknown = blank(column[earlier])
        column[earlier[unknown]] = column[later[unknown]]
    return whole._with(outputs=outputs, extra=extra).take(rows)


def require_one_formulation(tables: Sequence[TestTable]) -> None:
    """Refuse to join tables under different formulations."""
    formulations = []
    for table in tables:
        if table.layout.columns:
            ranges = table.formulation.ranges or None
            formulation = replace(table.formulation, chosen=None, reason="", page={}, ranges=ranges)
            formulations.append(formulation)
    if any(formulation != formulations[0] for formulation in formulations):
        raise invalid(
            "tables",
            "under one formulation to be joined",
            Received("several"),
            "give each of them the same formulation by table.under(...)",
        )


def _require_one_result(table: TestTable, first: Rows) -> None:
    """Refuse tests whose results differ from those of the first test with the same number.

    Args:
        table: The tests.
        first: ``(n,)`` the row of that test.
    """
    optional = {*table.layout.outputs, *table.extra}  # not every table has them
    repeats = np.flatnonzero(first != np.arange(len(table)))
    columns = {name: table.column(name) for name in table.columns}
    for name, column in (columns | {"status": table.status}).items():
        earlier = column[first[repeats]]
        later = column[repeats]
        differing = unequal(earlier, later, _ROUNDING)
        if name in optional:
            differing &= ~(blank(earlier) | blank(later))
        if differing.any():
            i = differing.argmax()
            test = table.take([repeats[i]]).names[0]
            raise invalid(
                "tests",
                "the same for each test point",
                Received(f"{earlier[i]} and {later[i]} as {name} of {test}"),
                "do not join runs of different problems, bounds or versions",
            )


def unequal(one: AnyArray, two: AnyArray, rounding: float = 0.0) -> Mask:
    """``(n,)`` where cells differ; NaN is equal to NaN, and 1 is not to True."""
    if one.dtype.kind == "f" == two.dtype.kind:
        with np.errstate(over="ignore"):
            return ~np.isclose(one, two, rtol=rounding, atol=0, equal_nan=True)
    pairs = zip(one.tolist(), two.tolist(), strict=True)
    return np.array([type(u) is not type(v) or u != v for u, v in pairs], dtype=bool)


def difference(a: TestTable, b: TestTable) -> str:
    """Return the first difference between two tables apart from their tests, or "".

    It is no difference if one of them lacks an output, kinds or the problem.
    """
    if a.layout is b.layout and a.problem is b.problem:
        return ""
    facts = _facts(a)
    others = _facts(b)
    keys = [key for key in facts if key in others]
    problem = flat(a.problem or {})
    other_problem = flat(b.problem or {})
    if "problem" in problem and "problem" in other_problem:
        keys += sorted({*problem, *other_problem})
        facts |= problem
        others |= other_problem
    for key in keys:
        if facts.get(key) != others.get(key):
            return f"{key} {facts.get(key)} against {others.get(key)}"
    return ""


def _facts(table: TestTable) -> dict[str, str]:
    """Return the facts of a table apart from its tests, as texts, so that NaN equals NaN."""
    layout = table.layout
    facts: Values = {}
    for group in ("variables", "objectives", "inequalities", "equalities", "eq_tolerance"):
        facts[group] = getattr(layout, group)
    for name in layout.columns:
        facts[f"unit of {name}"] = layout.units.get(name, "none")
        facts[f"direction of {name}"] = "max" if name in layout.maximize else "min"
    for name, *bounds in zip(layout.variables, layout.lower, layout.upper, strict=True):
        facts[f"bounds of {name}"] = tuple(map(float, bounds))
    facts["fixed ranges"] = table.formulation.ranges or {}
    facts["limits"] = table.limits
    if layout.kinds:
        facts["kinds"] = [kind.value for kind in layout.kinds]
    return {key: str(value) for key, value in facts.items()}
