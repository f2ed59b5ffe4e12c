"""What is not in the columns of a table, as values that JSON can hold, and its columns as texts.

Files and studies hold a table as columns, an array of float64, int64, bool or texts for each name,
and a head: schema, decision and the identity of the problem.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind, option_of, option_text
from pymoo_psi._validation import AnyArray, Columns, Head, Names, Values
from pymoo_psi.table._decision import Decision
from pymoo_psi.table._schema import (
    EQUALITY,
    INEQUALITY,
    LABEL,
    NOTE,
    OBJECTIVE,
    OUTPUT,
    TEST,
    VARIABLE,
    Column,
    Schema,
    result_columns,
)

MARK = "pymoo_psi_test_table"  # an entry in the head of a file of tests
# The entry in the head of a file of designs, which does not say what all columns are.
DESIGNS_MARK = "pymoo_psi_designs"
FORMAT = 1  # the version of the head

_GROUPS = {  # groups of columns in a head, and their roles
    "variables": VARIABLE,
    "objectives": OBJECTIVE,
    "inequalities": INEQUALITY,
    "equalities": EQUALITY,
    "outputs": OUTPUT,
}
# Entries of a head that state a decision; objectives and the like are in the columns.
_OF_DECISION = ("limits", "ranges", "normalize", "chosen", "reason", "positions", "decided")


def schema_head(schema: Schema) -> Values:
    """Return the entries of a head for the columns: names by role, kinds, bounds and units."""
    head: Values = {group: [*schema.of_role(role)] for group, role in _GROUPS.items()}
    variables = schema.with_role(VARIABLE)
    head["kinds"] = [kind.value for kind in schema.kinds]
    head["lower"] = [column.lower for column in variables]
    head["upper"] = [column.upper for column in variables]
    head["eq_tolerance"] = schema.eq_tolerance
    further = {
        "maximize": [*schema.maximize],
        "units": schema.units,
        "label": schema.label,
        "notes": [*schema.notes],
    }
    return head | {name: value for name, value in further.items() if value}


def schema_of(head: Head) -> Schema:
    """Return the columns of a head.

    Raises:
        KeyError: An entry is missing.
        ArgumentValueError: The columns do not fit one another.
    """
    groups = [head[group] for group in _GROUPS if group != "outputs"]
    schema = Schema.of(
        *groups,
        lower=np.array(head["lower"], dtype=np.float64),
        upper=np.array(head["upper"], dtype=np.float64),
        eq_tolerance=head["eq_tolerance"],
        kinds=head["kinds"],
        outputs=head.get("outputs", ()),
        maximize=head.get("maximize", ()),
    )
    columns = []
    for name in head.get("notes", ()):
        role = LABEL if name == head.get("label") else NOTE
        columns.append(Column(name, role, Kind.CHOICE))
    schema = schema.with_columns(*columns)
    return schema.with_units(units_of(schema.names, head.get("units", {})))


def decision_head(decision: Decision) -> Values:
    """Return the entries of a head for a decision: what no column shows."""
    stated = decision.stated
    return {name: stated[name] for name in _OF_DECISION if name in stated}


def decision_of_head(head: Head) -> Decision:
    """Return the decision in a head."""
    return Decision.of_stated({name: head[name] for name in _OF_DECISION if name in head})


def head_of(table: Any) -> Values:
    """Return what is not in the columns of a :class:`TestTable`, as values that JSON can hold."""
    head = schema_head(table.schema) | decision_head(table.decision)
    if table.problem:
        head["problem"] = table.problem
    return head


def marked(table: Any) -> Values:
    """Return the head of a file of a table."""
    return {MARK: FORMAT, "tests": len(table), **head_of(table), **marks_of(table)}


def marks_of(table: Any) -> Values:
    """Return the entries of a head for the marks of the source, which files keep."""
    marks = {}
    if table.decimal != ".":
        marks["decimal"] = table.decimal
    if table.separator != ",":
        marks["separator"] = table.separator
    return marks


def units_of(names: Collection[str], units: Mapping[str, str]) -> dict[str, str]:
    """Return the units of some columns."""
    return {name: unit for name, unit in units.items() if name in names}


# Columns


def columns_of(table: Any, number: str = TEST) -> Columns:
    """Return the columns of a :class:`TestTable` as files and studies hold them.

    Args:
        table: The table.
        number: The name of the column of the numbers.

    Returns:
        ``(n,)`` arrays by name: the numbers; the columns, objectives in the original direction, a
        choice and a note as texts, see :func:`choice_texts`; ``status``; ``reason``.
    """
    columns = {number: table.numbers}
    for column in table.schema.columns:
        cells = table.column(column.name)
        columns[column.name] = cells
        if cells.dtype == object:
            columns[column.name] = choice_texts(cells)
        if column.role in (LABEL, NOTE):
            # A spreadsheet reads 7 as a number.
            for i, cell in enumerate(cells.tolist()):
                if type(cell) is int and abs(cell) < 2**63:
                    columns[column.name][i] = cell
    results = result_columns(table.columns)
    columns[results["status"]] = table.status.astype(object)
    columns[results["reason"]] = reason_cells(table)
    return columns


def reason_cells(table: Any) -> NDArray[np.object_]:
    """``(n,)`` why the tests of a :class:`TestTable` failed, empty texts of others."""
    failed = table.failed()
    cells = np.full(len(table), "", dtype=object)
    cells[failed] = [table.reasons[number] for number in table.numbers[failed].tolist()]
    return cells


def columns_of_designs(names: Names, kinds: Sequence[Kind], X: AnyArray) -> Columns:
    """Return the columns of ``(n, n_var)`` designs; choices are texts."""
    columns = {}
    for name, column, kind in zip(names, X.T, kinds, strict=True):
        if kind is Kind.CHOICE:
            columns[name] = choice_texts(column)
        else:
            columns[name] = column.astype(DTYPES[kind])
    return columns


def choice_texts(cells: AnyArray) -> NDArray[np.object_]:
    """Return the texts of the options that designs have chosen, see :func:`option_text`."""
    return np.fromiter(map(option_text, cells.tolist()), object)


def choice_values(texts: Iterable[str]) -> NDArray[np.object_]:
    """Return the options of the texts of :func:`choice_texts`."""
    return np.fromiter(map(option_of, texts), object)


def kinds_of_columns(schema: Schema) -> dict[str, Kind]:
    """Return the kind of every column that a table needs in a file; texts are those of a choice."""
    kinds = {TEST: Kind.INTEGER}
    for column in schema.columns:
        kinds[column.name] = column.kind or Kind.REAL
    results = result_columns(schema.names)
    return kinds | dict.fromkeys((results["status"], results["reason"]), Kind.CHOICE)
