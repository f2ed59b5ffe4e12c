"""Workbooks (.xlsx): the rows on the first sheet, what the columns are on the second."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any
from warnings import catch_warnings, simplefilter
from zipfile import ZipFile, is_zipfile

from pymoo_psi._names import argument
from pymoo_psi._validation import Entries, Head, Names, counted
from pymoo_psi.errors import PsiError
from pymoo_psi.files._cells import Cells, RowsByLine, UnfitError, cells_of_rows, named_cells
from pymoo_psi.files._format import FileFormat, SourceFile
from pymoo_psi.table import MARK, headings_of

_NAME = "pymoo-psi"  # of the second sheet, and of the creator of what a command may overwrite
_FIRST = 50  # rows whose formats are looked at: there may be titles and gaps
_LONGEST = 30_000  # characters in a cell, which holds 32 767
_ESCAPED = re.compile("_x([0-9A-Fa-f]{4})_")  # a character that XML does not keep
_NO_NUMBERS = ("inf", "-inf", "-0.0")  # floats that a workbook keeps as texts only


class WorkbookFile(FileFormat):
    """A workbook, the designs on its only sheet or on the one that is named."""

    suffix = ".xlsx"
    writes = ("tests", "designs")

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether a file begins as workbooks do."""
        return file.start.startswith(b"PK\x03\x04")  # an archive (ZIP)

    def read(self, file: SourceFile) -> tuple[Cells, Head]:
        """Return the cells of a sheet, with what we wrote of them."""
        import pandas as pd

        head = {}
        try:
            with catch_warnings():
                simplefilter("ignore")  # warnings on drawings and the like, which are not read
                book = pd.ExcelFile(BytesIO(file.content), engine="openpyxl")
                titles = list(map(str, book.sheet_names))
                if titles[1:] == [_NAME]:
                    for name, *parts in _rows_of_sheet(book, titles.pop()).values():
                        head[name] = json.loads("".join(parts))
                title = _title(titles, file.sheet)
                rows = _rows_of_sheet(book, title)
                in_per_cent = _in_per_cent(book.book[title])
        except PsiError:
            raise
        except Exception as error:  # zipfile, XML and openpyxl raise errors of many kinds
            raise UnfitError(f"it cannot be read as a workbook (.xlsx): {error}") from None
        for number in file.skip_rows:
            rows.pop(number, None)
        if MARK in head:
            return cells_of_rows(rows), head
        cells = named_cells(rows)
        header, *_ = rows.values()
        remarks = []
        for name in [str(header[j]).strip() for j in sorted(in_per_cent)]:
            if name in cells.columns:
                remarks.append(f"{name} has hundredths where the workbook shows per cent.")
        return replace(cells, remarks=remarks), head

    def require_packages(self) -> None:
        """Refuse to write workbooks without openpyxl."""
        _openpyxl()

    def write(self, path: Path, columns: Entries, head: Head) -> None:
        """Write columns on the first sheet, and the head on the second."""
        import pandas as pd

        openpyxl = _openpyxl()
        book = openpyxl.Workbook(write_only=True)
        book.properties.creator = _NAME
        sheet = book.create_sheet("designs")
        sheet.freeze_panes = "A2"
        headings = headings_of(columns, head.get("units", {}))
        make_cell = openpyxl.cell.cell.WriteOnlyCell
        illegal = openpyxl.cell.cell.ILLEGAL_CHARACTERS_RE

        def typed(value: Any) -> Any:
            if value is None or value != value:
                return None
            if isinstance(value, bool):
                return value
            text = illegal.sub("\ufffd", _ESCAPED.sub(r"_x005F\g<0>", str(value)))
            # A parser of XML takes \r\n for \n.
            cell = make_cell(sheet, text.replace("\r", "_x000D_"))
            # Set, as a text such as =A1 would be a formula, and openpyxl cuts numbers to 16 digits.
            cell.data_type = "s"
            if isinstance(value, (int, float)) and str(value) not in _NO_NUMBERS:
                cell.data_type = "n"
            return cell

        frame = pd.DataFrame(dict(columns), dtype=object)
        for row in (headings.values(), *frame.itertuples(index=False, name=None)):
            sheet.append(list(map(typed, row)))
        about = book.create_sheet(_NAME)
        for name, value in head.items():
            # Excel takes a text such as _x0041_ for a character; JSON has escapes of its own.
            text = json.dumps(value, ensure_ascii=False).replace("_x", r"\u005fx")
            parts = [text[i : i + _LONGEST] for i in range(0, len(text), _LONGEST)]
            about.append([name, *parts])
        book.save(path)

    def is_ours(self, path: Path) -> bool:
        """Say whether pymoo-psi made a workbook, by its properties."""
        if not is_zipfile(path):
            return False
        with ZipFile(path) as archive:
            try:
                properties = archive.read("docProps/core.xml")
            except KeyError:  # an archive of another kind
                return False
        return f">{_NAME}<".encode() in properties


def _openpyxl() -> Any:
    """Return the package that reads and writes workbooks.

    Raises:
        PsiError: It is not installed.
    """
    try:
        import openpyxl  # type: ignore[import-untyped]
    except ImportError:
        raise PsiError(
            "a workbook needs openpyxl, which is not installed; pip install openpyxl, or use CSV"
        ) from None
    return openpyxl


# Reading


def _rows_of_sheet(book: Any, title: str) -> RowsByLine:
    """Return the rows of a sheet that are not blank, their numbers and texts as they are."""
    frame = book.parse(title, header=None, dtype=object, na_filter=False)
    rows = {}
    for number, row in enumerate(frame.itertuples(index=False, name=None), start=1):
        if set(row) != {""}:
            rows[number] = list(map(_typed, row))
    return rows


def _in_per_cent(sheet: Any) -> set[int]:
    """Return the columns in which a sheet shows numbers in per cent: 2 % for 0.02."""
    columns = set()
    for row in sheet.iter_rows(max_row=_FIRST):
        for j, cell in enumerate(row):
            if isinstance(cell.value, (int, float)):
                number_format = re.sub(r'"[^"]*"|\\.', "", cell.number_format)  # without texts
                if "%" in number_format:
                    columns.add(j)
    return columns


def _title(titles: Names, name: str | None) -> str:
    """Return the title of the sheet with the designs: the user's ``name``, or the only title."""
    if name is not None:
        return name
    # Taking the first sheet would rank the wrong one where a cover comes first.
    if len(titles) != 1:
        raise UnfitError(
            f"it has {counted(len(titles), 'sheet')}: {', '.join(titles)}",
            f"name that of the designs by {argument('sheet')}, or save it as a file of its own",
        )
    return titles[0]


def _typed(value: Any) -> Any:
    """Return a cell of a workbook as a number, a boolean or text; empty text for nothing."""
    if value in _NO_NUMBERS:
        return float(value)
    if isinstance(value, str):
        return _ESCAPED.sub(lambda match: chr(int(match[1], 16)), value)
    if isinstance(value, (int, float)):
        return value
    return str(value).removesuffix(" 00:00:00")  # a date
