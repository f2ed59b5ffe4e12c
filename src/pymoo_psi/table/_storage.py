"""How a table is stored: its columns, its head, and both as CSV.

Files and studies hold a table as columns, an array of float64, int64, bool or texts for each name,
and a head, values that JSON can hold: schema, decision and the identity of the problem.

In CSV, the first line names the columns, with their units, and the rows follow. Numbers have as
many digits as it takes to read the same number back; no text is a formula. Beside FILE.csv,
FILE.csv-metadata.json says what the columns are: in the "Metadata Vocabulary for Tabular Data" of
the W3C (CSVW), and in the head, which is an entry of our own.
"""

from __future__ import annotations

import csv
import json
import os
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind, option_of
from pymoo_psi._output import is_marked, whole_file, with_unit
from pymoo_psi._validation import AnyArray, Columns, Entries, FilePath, Head, Names, Values, invalid
from pymoo_psi.table._decision import Decision
from pymoo_psi.table._schema import (
    EQUALITY,
    INEQUALITY,
    LABEL,
    NOTE,
    OBJECTIVE,
    OUTPUT,
    RESULTS,
    TEST,
    VARIABLE,
    Column,
    Schema,
    choice_texts,
)
from pymoo_psi.table._view import View

MARK = "pymoo_psi_test_table"  # an entry in the head of a file of tests
# The entry in the head of a file of designs, which does not say what all columns are.
DESIGNS_MARK = "pymoo_psi_designs"
FORMAT = 1  # the version of the head
_NOT_TEXT = (".xlsx", ".xls", ".ods", ".db")  # files of spreadsheets, and studies

_GROUPS = {  # groups of columns in a head, and their roles
    "variables": VARIABLE,
    "objectives": OBJECTIVE,
    "inequalities": INEQUALITY,
    "equalities": EQUALITY,
    "outputs": OUTPUT,
}
# Entries of a head that state a decision; objectives and the like are in the columns.
_OF_DECISION = ("limits", "ranges", "normalize", "chosen", "reason", "positions", "decided")
_DATATYPES: Values = {  # data types of CSVW by those of pandas
    "integer": "integer",
    "floating": "number",
    "mixed-integer-float": "number",
    "boolean": {"base": "boolean", "format": "True|False"},
}
_USUAL_MARKS = {"decimal": ".", "separator": ","}
HEAD_ENTRY = "pymoo-psi:head"  # entries of the metadata that are ours
ROWS_ENTRY = "pymoo-psi:rows"
# What a spreadsheet runs as a formula: a cell that begins with a sign, full-width ones too, or with
# a gap that it drops, unless it is a number; a sign alone, which people write for "none", is one.
# Apostrophes in front count with the text, so that no two texts are written alike. exports.js has
# this rule for what the page exports; the cells of tests/helpers/formulas.py try both.
_LEADING = "'=+-@＝＋－＠\t\r\n"
_FORMULA = re.compile(
    r"'*(?![+-]?([0-9.,]*(e[+-]?[0-9]+)?%?|inf|infinity|nan)\Z)[=+\-@＝＋－＠\t\r\n]", re.IGNORECASE
)


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
        lower=head["lower"],
        upper=head["upper"],
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
    stated = decision.to_dict()
    return {name: stated[name] for name in _OF_DECISION if name in stated}


def decision_of_head(head: Head) -> Decision:
    """Return the decision in a head."""
    return Decision.from_dict({name: head[name] for name in _OF_DECISION if name in head})


def head_of(table: View) -> Values:
    """Return what is not in the columns of a table, as values that JSON can hold."""
    head = schema_head(table.schema) | decision_head(table.decision)
    if table.problem:
        head["problem"] = table.problem
    return head


def marked(table: View) -> Values:
    """Return the head of a file of a table."""
    return {MARK: FORMAT, **head_of(table), **marks_of(table)}


def marks_of(table: View) -> Values:
    """Return the entries of a head for the marks of the source, which files keep."""
    marks = {name: getattr(table, name) for name in _USUAL_MARKS}
    return {name: mark for name, mark in marks.items() if mark != _USUAL_MARKS[name]}


def units_of(names: Collection[str], units: Mapping[str, str]) -> dict[str, str]:
    """Return the units of some columns."""
    return {name: unit for name, unit in units.items() if name in names}


# Columns


def columns_of(table: View, number: str = TEST) -> Columns:
    """Return the columns of a table as files and studies hold them.

    Args:
        table: The table.
        number: The name of the column of the numbers.

    Returns:
        ``(n,)`` arrays by name: the numbers; the columns, objectives in the original direction, a
        choice and a note as texts, see :func:`choice_texts`; ``status``; ``reason``.
    """
    columns: Columns = {number: table.numbers}
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


def reason_cells(table: View) -> NDArray[np.object_]:
    """``(n,)`` why the tests of a table failed, empty texts of others."""
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


def write_csv(path: FilePath, columns: Entries, head: Head | None = None) -> None:
    """Write columns, and what they are into a file beside, whole or not at all.

    Without a head, former metadata of ours are removed. What is no file, such as a pipe, has
    none.

    Raises:
        ArgumentValueError: The name is that of a workbook or study, or there are metadata of
            another program.
        OSError: A file cannot be written.
    """
    if Path(path).suffix.lower() in _NOT_TEXT:
        rule = "the name of a text file, such as table.csv"
        raise invalid("path", rule, str(path), "write_table(table, path) writes other files")
    is_pipe = os.path.exists(path) and not os.path.isfile(path)
    metadata = metadata_path(path)
    is_former = is_marked(metadata)
    if head and metadata.exists() and not is_former:
        raise invalid(
            "path",
            f"a file without {metadata.name} of another program",
            str(path),
            "remove that, or choose another name",
        )
    with whole_file(path) as new:
        _write_rows(new, columns, head or {})
        if head and not is_pipe:
            with whole_file(metadata) as new_metadata:
                document = _document(path, columns, head)
                text = json.dumps(document, ensure_ascii=False, indent=1) + "\n"
                # Half a pair of surrogates, as in a name that is no text, stays one in JSON.
                new_metadata.write_text(text, encoding="utf-8", errors="backslashreplace")
        elif is_former:
            metadata.unlink()


def _write_rows(path: Path, columns: Entries, head: Head) -> None:
    """Write columns under their names and units."""
    import pandas as pd

    headings = headings_of(columns, head.get("units", {}))
    cells = {}
    for name, column in columns.items():
        if column.dtype.kind not in "biuf":
            column = list(map(inert, column))
        cells[inert(headings[name])] = column
    frame = pd.DataFrame(cells, dtype=object)  # 1 beside blanks stays an integer
    if head.get("decimal") == ",":
        frame = frame.map(_with_comma)
    layout = {"index": False, "lineterminator": "\n", "sep": head.get("separator", ",")}
    text = frame.to_csv(**layout)
    # Until Python 3.13 the csv module leaves a carriage return unquoted, which breaks the row.
    if "\r" in text:
        text = frame.to_csv(**layout, quoting=csv.QUOTE_NONNUMERIC)
    # Spreadsheets take a file for UTF-8 by its mark, others stumble over it: only where needed.
    encoding = "utf-8" if text.isascii() else "utf-8-sig"
    path.write_text(text, encoding, newline="")


def _with_comma(cell: Any) -> Any:
    """Return a cell as it is written in a file with decimal commas."""
    # An integer becomes text, too, as pandas takes integers beside blanks for floats.
    if isinstance(cell, (int, float)) and cell == cell:
        return str(cell).replace(".", ",")
    return cell


# Names of columns in frames and files


def headings_of(names: Collection[str], units: Mapping[str, str]) -> dict[str, str]:
    """Return the headings of columns in a file: with units, unless another column is called so."""
    headings = {}
    for name in names:
        headings[name] = with_unit(name, units.get(name, ""))
        if headings[name] in names:
            headings[name] = name
    return headings


def names_of(headings: Names, units: Mapping[str, str]) -> list[str]:
    """Return the names of columns by their headings, with units or without."""
    names = {with_unit(name, unit): name for name, unit in units.items() if name not in headings}
    return [names.get(heading, heading) for heading in headings]


def result_columns(names: Collection[str]) -> dict[str, str]:
    """Return the names in a frame or file of status, violated, reason and pareto.

    Args:
        names: The columns of the table. Those of another program's file keep their names.
    """
    return {name: free_name(name, names, "pymoo-psi") for name in RESULTS}


def free_name(name: str, names: Collection[str], mark: str) -> str:
    """Return a name that none of some others has: with a mark behind it, if needed repeatedly.

    Example:
        >>> free_name("status", ["mass", "status"], "pymoo-psi")
        'status (pymoo-psi)'
    """
    while name in names:
        name = f"{name} ({mark})"
    return name


def added_columns(names: Collection[str], *, present: bool = False) -> tuple[str, str]:
    """Return the names of the two columns that an export of the page adds, place and mark.

    Args:
        names: The columns of the table, which keep their names.
        present: Whether these are the columns of an export, so that the two are among them.
    """
    added = []
    for name in ("place", "mark"):
        further = f"{name} (pymoo-psi)"
        while further in names or (name in names and not present):
            name, further = further, f"{further} (pymoo-psi)"
        added.append(name)
    return added[0], added[1]


# Formulas


def inert(cell: Any) -> Any:
    """Return a cell as it is written: a text that would be a formula is led by an apostrophe."""
    # Only the first letter is checked at first, as most cells are no formulas.
    if isinstance(cell, str) and cell[:1] in _LEADING and _FORMULA.match(cell):
        return f"'{cell}"
    return cell


def written_text(cell: str) -> str:
    """Return the text of which :func:`inert` made a cell."""
    if cell[:1] == "'" and _FORMULA.match(cell[1:]):
        return cell[1:]
    return cell


# Metadata


def metadata_path(path: FilePath) -> Path:
    """Return where the metadata of a CSV file stand; of a link, beside the file."""
    return Path(f"{os.path.realpath(path)}-metadata.json")


def _document(path: FilePath, columns: Entries, head: Head) -> Values:
    """Return the metadata of columns in CSVW."""
    from pandas.api.types import infer_dtype

    units = head.get("units", {})
    described = []
    for name, heading in headings_of(columns, units).items():
        datatype = _DATATYPES.get(infer_dtype(columns[name]), "string")
        if datatype == "number" and head.get("decimal") == ",":
            datatype = {"base": "number", "format": {"decimalChar": ","}}
        column = {"titles": inert(heading), "datatype": datatype}
        if name in units:
            column["schema:unitText"] = units[name]
        described.append(column)
    dialect = {"commentPrefix": None}  # a text that begins with # is no comment
    if "separator" in head:
        dialect["delimiter"] = head["separator"]
    return {
        "@context": "http://www.w3.org/ns/csvw",
        "url": quote(os.fsencode(Path(path).name)),
        "dialect": dialect,
        ROWS_ENTRY: max(map(len, columns.values())),
        HEAD_ENTRY: head,
        "tableSchema": {"columns": described},
    }
