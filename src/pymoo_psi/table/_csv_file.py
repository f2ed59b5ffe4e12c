"""Test tables as CSV: a comment line with the head, a header, one row per test point.

Numbers are written with as many digits as it takes to read the same number back, texts in
quotation marks, so that ``#``, commas and line breaks in them are text to every reader.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice
from os import PathLike
from typing import Any, TypeVar

import numpy as np

from pymoo_psi._files import whole_file
from pymoo_psi.table._designs import column_kinds
from pymoo_psi.table._frames import (
    PARSERS,
    column_formats,
    damaged,
    encoded,
    head_text,
    parsed_head,
    table_columns,
    table_of_columns,
)
from pymoo_psi.table._judgement import JudgedRecords
from pymoo_psi.table._records import Records

Table = TypeVar("Table", bound=Records)


_ROWS = 8192  # at a time, so that the memory for texts stays small


def write_csv(table: JudgedRecords, path: str | PathLike[str]) -> None:
    """Write a table whole or not at all; see :meth:`TestTable.to_csv`."""
    kinds = dict(zip(table.layout.variables, column_kinds(table.X), strict=True))
    columns = encoded(table_columns(table), kinds)
    with (
        whole_file(path) as written,
        written.open("x", encoding="utf-8", newline="") as file,
    ):
        file.write(f"# {head_text(table)}\n")
        writer = csv.writer(file, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\n")
        writer.writerow(columns)
        for start in range(0, len(table), _ROWS):
            cells = (column[start : start + _ROWS].tolist() for column in columns.values())
            writer.writerows(zip(*cells, strict=True))


def read_csv(path: str | PathLike[str], make: type[Table]) -> Table:
    """Read a table; see :meth:`TestTable.read_csv`."""
    try:
        with (
            open(path, encoding="utf-8-sig", newline="") as file,
            _fields_of_any_length(),
        ):
            head = parsed_head(path, _comment(file.readline()))
            reader = csv.reader(file)
            formats = column_formats(head["layout"], head["kinds"])
            places = _places(path, next(reader, []), formats)
            columns = _parsed(path, reader, formats, places)
    except (UnicodeDecodeError, csv.Error) as error:
        raise damaged(path, f"it is no text in rows and columns: {error}") from None
    return table_of_columns(path, head, columns, make)


def _comment(line: str) -> str:
    """Return the text of the first line, also if a spreadsheet program took it for cells."""
    if line.startswith('"'):
        line = ",".join(next(csv.reader([line])))
    return line.rstrip("\r\n").rstrip(",").removeprefix("#")


def _places(path: object, header: list[str], formats: Mapping[str, str]) -> dict[str, int]:
    missing = [name for name in formats if name not in header]
    if missing:
        names = ", ".join(map(repr, missing))
        raise damaged(path, f"the columns {names} are missing from its header")
    twice = [name for name in formats if header.count(name) > 1]
    if twice:
        raise damaged(path, f"its header names the column {twice[0]!r} twice")
    return {name: header.index(name) for name in formats}


def _parsed(
    path: object,
    reader: Iterable[list[str]],
    formats: Mapping[str, str],
    places: Mapping[str, int],
) -> dict[str, Any]:
    """Return the columns of the rows that are left, blank rows left out."""
    pieces: dict[str, list[Any]] = {name: [] for name in formats}
    rows, done = (row for row in reader if row), 0
    last = max(places.values())
    while chunk := list(islice(rows, _ROWS)):
        for i, row in enumerate(chunk):
            if len(row) <= last:
                raise damaged(
                    path, f"row {done + i + 1} below its header has {len(row)} cells only"
                )
        for name, kind in formats.items():
            place, parse = places[name], PARSERS[kind]
            try:
                cells = [parse(row[place]) for row in chunk]
                pieces[name].append(np.array(cells, dtype=_DTYPES[kind]))
            except (ValueError, KeyError, OverflowError):
                raise _bad_cell(path, name, kind, [row[place] for row in chunk], done) from None
        done += len(chunk)
    return {name: np.concatenate(parts) if parts else np.zeros(0) for name, parts in pieces.items()}


_DTYPES: dict[str, Any] = {"real": np.float64, "integer": np.int64}
_DTYPES |= dict.fromkeys(("boolean", "text", "mixed"), object)


def _bad_cell(path: object, name: str, kind: str, cells: list[str], done: int) -> Exception:
    for i, cell in enumerate(cells):
        try:
            np.array(PARSERS[kind](cell), dtype=_DTYPES[kind])
        except (ValueError, KeyError, OverflowError):
            where = f"column {name!r} of row {done + i + 1} below its header"
            return damaged(path, f"{where} is no {kind} value: {cell!r:.40}")
    raise AssertionError("a column that cannot be read has a cell that cannot")


@contextmanager
def _fields_of_any_length() -> Iterator[None]:
    before = csv.field_size_limit(min(sys.maxsize, 2**31 - 1))  # a C long everywhere
    try:
        yield
    finally:
        csv.field_size_limit(before)
