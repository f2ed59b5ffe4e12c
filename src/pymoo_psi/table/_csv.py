"""CSV as we write it, and a file beside it that says what the columns are.

The first line names the columns, with their units, and the rows follow. Numbers have as many digits
as it takes to read the same number back; no text is a formula. Beside FILE.csv,
FILE.csv-metadata.json says what the columns are: in the "Metadata Vocabulary for Tabular Data" of
the W3C (CSVW), and in the head of the table, which is an entry of our own.
"""

from __future__ import annotations

import csv
import json
import os
import re
from pathlib import Path
from typing import Any
from urllib.parse import quote

from pymoo_psi._output import is_marked, whole_file
from pymoo_psi._validation import Entries, FilePath, Head, Values, invalid
from pymoo_psi.table._schema import headings_of

HEAD_ENTRY = "pymoo-psi:head"  # entries of the metadata that are ours
ROWS_ENTRY = "pymoo-psi:rows"
_DATATYPES: Values = {  # data types of CSVW by those of pandas
    "integer": "integer",
    "floating": "number",
    "mixed-integer-float": "number",
    "boolean": {"base": "boolean", "format": "True|False"},
}
# What a spreadsheet runs as a formula: a cell that begins with a sign, full-width ones too, or with
# a gap that it drops, unless it is a number; a sign alone, which people write for "none", is one.
# Apostrophes in front count with the text, so that no two texts are written alike. exports.js has
# this rule for what the page exports; the cells of tests/helpers/formulas.py try both.
_LEADING = "'=+-@＝＋－＠\t\r\n"
_FORMULA = re.compile(
    r"'*(?![+-]?([0-9.,]*(e[+-]?[0-9]+)?%?|inf|infinity|nan)\Z)[=+\-@＝＋－＠\t\r\n]", re.IGNORECASE
)


def write_csv(path: FilePath, columns: Entries, head: Head | None = None) -> None:
    """Write columns, and what they are into a file beside, whole or not at all.

    Without a head, former metadata of ours are removed. What is no file, such as a pipe, has
    none.

    Raises:
        ArgumentValueError: There are metadata of another program.
        OSError: A file cannot be written.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        with whole_file(path) as new:
            _write_rows(new, columns, head or {})
        return
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
        if head:
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
