"""Test tables as CSV and as Parquet: heads and columns, see :mod:`._exchange`, in and out.

A CSV begins with a comment line, the head as JSON; then come a header and one row per test point.
Numbers are written with as many digits as it takes to read the same number back, texts in
quotation marks, so that ``#``, commas and line breaks in them are text to every reader. In Parquet
the head is an attribute of the frame, which pandas keeps.
"""

from __future__ import annotations

import csv
import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from io import BytesIO, StringIO
from itertools import islice
from os import PathLike
from typing import Any, TypeAlias

import numpy as np

from pymoo_psi._files import whole_file
from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi.errors import PsiError
from pymoo_psi.table._cells import boolean, integer, real
from pymoo_psi.table._exchange import (
    Columns,
    Head,
    choice_texts,
    damaged,
    kinds_of_columns,
    layout_of,
)

Path: TypeAlias = str | PathLike[str]
MARK = "pymoo_psi_test_table"
_FORMAT = 4  # of the head; a reader refuses a later one
_WORDS = {"boolean": "binary", "text": "choice", "mixed": "choice"}  # for kinds in format 1
_ATTRIBUTE = "pymoo_psi"  # that holds the head in a frame
_ROWS = 8192  # parsed at a time, so that the memory for texts stays small
_PARSERS: dict[Kind, Callable[[str], Any]] = {
    Kind.REAL: real,
    Kind.INTEGER: integer,
    Kind.BINARY: boolean,
    Kind.CHOICE: str,
}

_TYPES = {Kind.REAL: "fi", Kind.INTEGER: "i", Kind.BINARY: "b"}  # of columns in Parquet


def write_csv(path: Path, head: Head, columns: Columns) -> None:
    """Write a table whole or not at all.

    Raises:
        OSError: It cannot be written.
    """
    with (
        whole_file(path) as written,
        written.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(f"# {_head_text(head, columns)}\n")
        # csv writes floats by repr: the shortest digits that read back as the same number.
        writer = csv.writer(file, quoting=csv.QUOTE_NONNUMERIC, lineterminator="\n")
        writer.writerow(columns)
        for start in range(0, len(columns["test_point"]), _ROWS):
            cells = (column[start : start + _ROWS].tolist() for column in columns.values())
            writer.writerows(zip(*cells, strict=True))


def read_csv(path: Path, text: str | None = None) -> tuple[Head, Columns]:
    """Return head and columns of a table, of its text if that has been read already.

    Raises:
        ArgumentValueError: It is no file of a table, or a damaged one.
        OSError: It cannot be read.
    """
    try:
        with (
            # With or without the byte-order mark that spreadsheet programs put in front; newline=''
            # leaves line breaks within quoted texts to csv.
            open(path, encoding="utf-8-sig", newline="")
            if text is None
            else StringIO(text, newline="") as file,
            _fields_of_any_length(),
        ):
            head, n, kinds, old_texts = _parsed_head(path, comment_text(file.readline()))
            reader = csv.reader(file)
            columns = _parsed(path, reader, kinds, _places(path, next(reader, []), kinds))
    except (UnicodeDecodeError, csv.Error) as error:
        raise damaged(path, f"it is no text in rows and columns: {error}") from None
    return head, _complete(path, columns, n, old_texts)


def write_parquet(path: Path, head: Head, columns: Columns) -> None:
    """Write a table whole or not at all.

    Raises:
        PsiError: pyarrow is not installed.
        OSError: It cannot be written.
    """
    _require_pyarrow()
    import pandas as pd

    frame = pd.DataFrame(columns)
    # pandas keeps attrs in the metadata of the file, where other readers pass over them.
    frame.attrs = {_ATTRIBUTE: _head_text(head, columns)}
    with whole_file(path) as written:
        frame.to_parquet(written, engine="pyarrow", index=False)


def read_parquet(path: Path, content: bytes | None = None) -> tuple[Head, Columns]:
    """Return head and columns of a table, of its bytes if these have been read already.

    Raises:
        PsiError: pyarrow is not installed.
        ArgumentValueError: It is no file of a table, or a damaged one.
        OSError: It cannot be read.
    """
    _require_pyarrow()
    import pandas as pd

    if content is None:
        os.stat(path)  # a file that is not there is no damaged file
    try:
        source = path if content is None else BytesIO(content)
        frame = pd.read_parquet(source, engine="pyarrow")
    except Exception as error:  # pyarrow has errors of many kinds
        raise damaged(path, f"it cannot be read as Parquet: {error}") from None
    head, n, kinds, old_texts = _parsed_head(path, str(frame.attrs.get(_ATTRIBUTE, "")))
    columns: Columns = {}
    for name, kind in kinds.items():
        if name not in frame:
            raise damaged(path, f"the column {name!r} is missing")
        try:
            # Told by the type: NumPy would make 1 of 1.5, True of 2 and numbers of texts.
            if kind in _TYPES and frame[name].dtype.kind not in _TYPES[kind]:
                raise TypeError
            columns[name] = frame[name].to_numpy(dtype=DTYPES[kind])
        except (ValueError, TypeError):
            what = f"the column {name!r} holds other than {kind.value} values"
            raise damaged(path, what) from None
        if kind is Kind.CHOICE and not all(isinstance(cell, str) for cell in columns[name]):
            raise damaged(path, f"the column {name!r} holds other than texts")
    return head, _complete(path, columns, n, old_texts)


def _head_text(head: Head, columns: Columns) -> str:
    """Return the head of a file, JSON in one line."""
    marks = {MARK: _FORMAT, "tests": len(columns["test_point"])}
    return json.dumps(marks | head, ensure_ascii=False)


def _parsed_head(path: Path, text: str) -> tuple[Head, int, dict[str, Kind], list[str]]:
    """Return head, number of tests, kinds of the columns, and which hold texts of format 1."""
    try:
        head = json.loads(text)
        version = head.pop(MARK)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise damaged(path, "its head, one line of JSON, is missing or damaged") from None
    if version not in range(1, _FORMAT + 1):
        what = f"its format is {version!r:.20}, this version of pymoo-psi reads 1 to {_FORMAT}"
        raise damaged(path, what)
    n, old_texts = head.pop("tests", None), []
    # Not isinstance: true of JSON is no number of tests.
    if type(n) is not int:
        raise damaged(path, "its head is damaged: there is no number of tests")
    if version == 1 and isinstance(kinds := head.get("kinds"), list):
        named = zip(head.get("variables", ()), kinds, strict=False)
        old_texts = [name for name, kind in named if kind == "text"]
        head["kinds"] = [_WORDS.get(str(kind), kind) for kind in kinds] if n else []
    return head, n, kinds_of_columns(layout_of(head, path), head.get("extra", ())), old_texts


def _complete(path: Path, columns: Columns, n: int, old_texts: Iterable[str]) -> Columns:
    """Return the columns, with choices as texts of the present format, if no test is missing."""
    # A CSV cut at the end of a line is a valid CSV with fewer tests; the number in the head tells.
    found = len(columns["test_point"])
    if found != n:
        what = f"it holds {found} of {n} tests, so it was cut or edited"
        raise damaged(path, f'{what}; if that is meant, set "tests" in its head to {found}')
    return columns | {name: choice_texts(columns[name]) for name in old_texts}


def comment_text(line: str) -> str:
    """Return the text of the first line, also if a spreadsheet program took it for cells."""
    if line.startswith('"'):
        line = ",".join(next(csv.reader([line])))
    return line.rstrip("\r\n").rstrip(",").removeprefix("#")


def _places(path: Path, header: list[str], kinds: Mapping[str, Kind]) -> dict[str, int]:
    # By name, not by place: people rearrange columns and add their own, which are not read.
    if missing := [name for name in kinds if name not in header]:
        names = ", ".join(map(repr, missing))
        raise damaged(path, f"the columns {names} are missing from its header")
    if twice := [name for name in kinds if header.count(name) > 1]:
        raise damaged(path, f"its header names the column {twice[0]!r} twice")
    return {name: header.index(name) for name in kinds}


def _parsed(
    path: Path,
    reader: Iterable[list[str]],
    kinds: Mapping[str, Kind],
    places: Mapping[str, int],
) -> Columns:
    """Return the columns of the rows that are left, blank rows left out."""
    pieces: dict[str, list[Any]] = {
        name: [np.zeros(0, dtype=DTYPES[kind])] for name, kind in kinds.items()
    }
    rows, done = (row for row in reader if row), 0
    last = max(places.values())
    while chunk := list(islice(rows, _ROWS)):
        for i, row in enumerate(chunk):
            if len(row) <= last:
                what = f"row {done + i + 1} below its header has {len(row)} cells only"
                raise damaged(path, what)
        for name, kind in kinds.items():
            cells = [row[places[name]] for row in chunk]
            try:
                parsed = [_PARSERS[kind](cell) for cell in cells]
                pieces[name].append(np.array(parsed, dtype=DTYPES[kind]))
            except (ValueError, OverflowError):
                raise _bad_cell(path, name, kind, cells, done) from None
        done += len(chunk)
    return {name: np.concatenate(parts) for name, parts in pieces.items()}


def _bad_cell(path: Path, name: str, kind: Kind, cells: list[str], done: int) -> Exception:
    # Cell by cell only once a column has failed: sound files are read by columns.
    for i, cell in enumerate(cells):
        try:
            np.array(_PARSERS[kind](cell), dtype=DTYPES[kind])
        except (ValueError, OverflowError):
            where = f"column {name!r} of row {done + i + 1} below its header"
            return damaged(path, f"{where} is no {kind.value} value: {cell!r:.40}")
    raise AssertionError("a column that cannot be read has a cell that cannot")


@contextmanager
def _fields_of_any_length() -> Iterator[None]:
    before = csv.field_size_limit(min(sys.maxsize, 2**31 - 1))  # a C long everywhere
    try:
        yield
    finally:
        csv.field_size_limit(before)


def _require_pyarrow() -> None:
    try:
        import_module("pyarrow")
    except ImportError:
        raise PsiError(
            "Parquet needs pyarrow, which is not installed; pip install pyarrow, or write CSV"
        ) from None
