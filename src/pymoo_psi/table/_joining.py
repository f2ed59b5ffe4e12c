"""Tables joined, one below the other or merged by the numbers of tests, and compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from pymoo_psi._validation import (
    AnyArray,
    Columns,
    Mask,
    Received,
    Values,
    identity_facts,
    invalid,
)
from pymoo_psi.table._cells import blank, cells_of_kind
from pymoo_psi.table._designs import names_of_designs
from pymoo_psi.table._schema import (
    EQUALITY,
    INEQUALITY,
    LABEL,
    NOTE,
    NUMBERS_ROLES,
    OBJECTIVE,
    VARIABLE,
    Column,
)
from pymoo_psi.table._storage import columns_of, decision_head, schema_head
from pymoo_psi.table._view import View

T = TypeVar("T", bound=View)

_ROUNDING = 1e-9  # the relative difference of results that two machines have computed


def stacked(tables: Sequence[T]) -> T:
    """Return the tests of tables one below the other, as evaluated, under the first formulation.

    Raises:
        ArgumentValueError: The tables differ in more than their tests.
    """
    tables = [table for table in tables if len(table) or table.evaluated.columns] or tables[:1]
    whole = tables[0]
    for table in tables[1:]:
        difference = _difference(whole, table)
        if difference:
            rule = "of one problem and formulation to be joined"
            raise invalid("tables", rule, Received(difference))
        problem = whole.problem
        if "problem" not in (problem or {}):
            problem = table.problem
        whole = replace(
            whole,
            evaluated=whole.evaluated.joined(table.evaluated),
            # The first test with a number counts.
            failures={**table.failures, **whole.failures},
            problem=problem,
        )
    data: Columns = {}
    for column in whole.evaluated.columns:
        data[column.name] = np.concatenate([_cells_of(table, column) for table in tables])
    remarks = dict.fromkeys(remark for table in tables for remark in table.remarks)
    return replace(
        whole,
        data=data,
        numbers=np.concatenate([table.numbers for table in tables]),
        remarks=tuple(remarks),
    )


def _cells_of(table: View, column: Column) -> AnyArray:
    """Return the cells of a column as evaluated, blank ones of one that is not there."""
    if column.role == VARIABLE:
        return cells_of_kind(column.name, table.data[column.name], column.kind)
    if column.name in table.data:
        return table.data[column.name]
    missing = np.nan if column.role in NUMBERS_ROLES else None
    return np.full(len(table), missing)


def merged(one: T, other: T) -> T:
    """Return the tests of two runs of a problem by their numbers; see :meth:`TestTable.merge`.

    Raises:
        ArgumentValueError: The tables differ, or the results of a test do by more than rounding.
    """
    whole = stacked([one, other])
    _, rows, inverse = np.unique(whole.numbers, return_index=True, return_inverse=True)
    earlier = rows[inverse]  # the first row with the number of each row
    data = dict(whole.data)
    for name, cells in whole.data.items():
        before = cells[earlier]
        differing = unequal(before, cells, _ROUNDING)
        if name in (*whole.evaluated.outputs, *whole.evaluated.notes):  # some tables lack them
            is_gap = blank(before)
            differing &= ~(is_gap | blank(cells))
            data[name] = cells.copy()
            data[name][earlier[is_gap]] = cells[is_gap]
        if differing.any():
            row = int(differing.argmax())
            test = names_of_designs(whole.take([row]))[0]
            raise invalid(
                "tests",
                "the same for each number",
                Received(f"{before[row]} and {cells[row]} as {name} of {test}"),
                "do not join runs of different problems, bounds or versions",
            )
    return replace(whole, data=data).take(rows)


def _difference(a: View, b: View) -> str:
    """Return the first difference between two tables apart from their tests, or "".

    It is no difference if one of them lacks an output, a note or the problem, nor if kinds differ:
    a table without declared kinds has those that its values show.
    """
    facts = _facts(a, b)
    others = _facts(b, a)
    for name, fact in facts.items():
        if others.get(name, fact) != fact:
            return f"{name} {fact} against {others[name]}"
    return ""


def _facts(table: View, other: View) -> Values:
    """Return what the tests of a table have in common, by the words for it.

    The problem is compared as a whole if both tables know theirs: what only one has is a fact, too.
    """
    schema = table.evaluated
    facts: Values = {}
    for role in (VARIABLE, OBJECTIVE, INEQUALITY, EQUALITY):
        facts[role] = schema.of_role(role)
    facts["eq_tolerance"] = schema.eq_tolerance
    for column in schema.columns:
        column = column._replace(role=column.role.replace(LABEL, NOTE), kind=None)
        for attribute, value in column._asdict().items():
            facts[f"{attribute} of {column.name}"] = value
    facts["formulation"] = replace(table.formulation, ranges=table.fixed_ranges)
    problem = table.problem or {}
    other_problem = other.problem or {}
    if "problem" in problem and "problem" in other_problem:
        facts |= dict.fromkeys(identity_facts(other_problem, problem), "absent")
        facts |= identity_facts(problem, other_problem)
    return facts


def are_equal(one: View, other: View) -> bool:
    """Whether two tables are equal in every column, value and decision."""
    if len(one) != len(other) or _stated(one) != _stated(other):
        return False
    columns = columns_of(other)
    return not any(unequal(cells, columns[name]).any() for name, cells in columns_of(one).items())


def _stated(table: View) -> Values:
    """Return the columns and the decision, in which no ranges are those of the Pareto set."""
    ranges = {"ranges": table.fixed_ranges}
    return schema_head(table.schema) | decision_head(table.decision) | ranges


def unequal(one: AnyArray, two: AnyArray, rounding: float = 0.0) -> Mask:
    """``(n,)`` where cells differ; NaN is equal to NaN, and 1 is not to True."""
    if one.dtype.kind == "f" == two.dtype.kind:
        with np.errstate(over="ignore"):
            return ~np.isclose(one, two, rtol=rounding, atol=0, equal_nan=True)
    differing = []
    for u, v in zip(one.tolist(), two.tolist(), strict=True):
        differing.append(type(u) is not type(v) or (u != v and (u == u or v == v)))
    return np.array(differing, dtype=bool)
