"""Workbooks (.xlsx): the rows on the first sheet, what the columns are on the second."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any
from warnings import catch_warnings, simplefilter
from zipfile import ZipFile, is_zipfile

from pymoo_psi._validation import (
    Entries,
    Head,
    Names,
    Values,
    counted,
    known_name,
)
from pymoo_psi.errors import PsiError
from pymoo_psi.table._cells import Cells, RowsByLine, UnfitError, cells_as_written, cells_of_rows
from pymoo_psi.table._formats._format import (
    FileFormat,
    SourceFile,
)
from pymoo_psi.table._head import is_of_tests
from pymoo_psi.table._layout import headings_of

_ZIP = b"PK\x03\x04"  # how a local file in ZIP begins
_OLE = b"\xd0\xcf\x11\xe0"  # a compound file
_HEAD_SHEET = "pymoo-psi"
_CREATOR = "pymoo-psi"  # the creator of the workbooks that the command may overwrite
_WIDTH = 16  # the width of columns, in characters
_LONGEST = 30_000  # characters in a cell, which holds 32 767
_ESCAPED = re.compile("_x([0-9A-Fa-f]{4})_")  # a character that XML does not keep
_MOST_BYTES = 100_000_000  # of XML in a workbook, some millions of cells, which take minutes


class WorkbookFile(FileFormat):
    """A workbook, the designs on its only sheet or on the one that is named."""

    suffix = ".xlsx"
    writes = ("tests", "designs")
    has_sheets = True

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether a file begins as workbooks do, those of old too."""
        return file.start.startswith((_ZIP, _OLE))

    def read(self, file: SourceFile) -> Cells:
        """Return the cells of a sheet, with what we wrote of them."""
        if file.start.startswith(_OLE):
            raise UnfitError(
                "it is an old workbook (.xls), or has a password",
                "save it as .xlsx without one, or as CSV",
            )
        head, rows = _rows_of_workbook(file.content, file.skip_rows, file.sheet)
        if is_of_tests(head):
            return cells_as_written(rows, head)
        return replace(cells_of_rows(rows), head=head)

    def write(self, path: Path, columns: Entries, head: Head) -> None:
        """Write columns on the first sheet, and the head on the second."""
        import pandas as pd

        openpyxl = _openpyxl()
        book = openpyxl.Workbook(write_only=True)
        book.properties.creator = _CREATOR
        sheet = book.create_sheet("designs")
        sheet.freeze_panes = "A2"
        headings = headings_of(columns, head.get("units", {}))
        sheet.sheet_format.defaultColWidth = _WIDTH
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
            if isinstance(value, (int, float)) and abs(value) != float("inf"):
                cell.data_type = "n"
            return cell

        frame = pd.DataFrame(dict(columns), dtype=object)
        for row in (headings.values(), *frame.itertuples(index=False, name=None)):
            sheet.append(list(map(typed, row)))
        about = book.create_sheet(_HEAD_SHEET)
        for name, value in head.items():
            text = json.dumps(value, ensure_ascii=False)
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
        return f">{_CREATOR}<".encode() in properties


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


def _rows_of_workbook(
    content: bytes, skip_rows: Collection[int], name: str | None
) -> tuple[Head, RowsByLine]:
    """Return the head in a workbook of pymoo-psi, else an empty one, and its rows by number.

    All rows are filled up to one length.

    Raises:
        ArgumentValueError: It is no workbook, there is no sheet of that name, it is not known which
            one is meant, or the sheet hides columns, or rows that are not left out.
        PsiError: openpyxl is not installed.
    """
    openpyxl = _openpyxl()
    try:
        _require_few_bytes(content)
        with catch_warnings():
            simplefilter("ignore")  # warnings on drawings and the like, which are not read
            # Read-only: else one merged range or link of 100 bytes becomes a million cells.
            book = openpyxl.load_workbook(BytesIO(content), read_only=True, data_only=True)
            head: Head = {}
            titles = [sheet.title for sheet in book.worksheets]
            if titles[1:] == [_HEAD_SHEET]:
                head = _sheet_head(book[_HEAD_SHEET].iter_rows(values_only=True))
                titles = titles[:1]
            sheet = book[_title(titles, name)]
            sheet.reset_dimensions()  # what a file declares may be more than it holds
            rows = {}
            for number, cells in enumerate(sheet.iter_rows(), start=1):
                row = list(map(_typed, cells))
                while row and row[-1] == "":
                    row.pop()
                if row and number not in skip_rows:
                    rows[number] = row
            width = max(map(len, rows.values()), default=0)
            _require_visible(sheet, rows, width)
    except PsiError:
        raise
    except Exception as error:  # zipfile, XML and openpyxl raise errors of many kinds
        raise UnfitError(f"it cannot be read as a workbook (.xlsx): {error}") from None
    for row in rows.values():
        row += [""] * (width - len(row))
    return head, rows


def _require_few_bytes(content: bytes) -> None:
    """Refuse a workbook that takes minutes to read, by the size of its parts before it is read."""
    with ZipFile(BytesIO(content)) as archive:
        sizes = [part.file_size for part in archive.infolist() if part.filename.endswith(".xml")]
    if sum(sizes) > _MOST_BYTES:
        size, most = (n // 1_000_000 for n in (sum(sizes), _MOST_BYTES))
        raise UnfitError(
            f"it has {size} MB of cells, and at most {most} MB are read",
            "save the sheet with the designs as CSV",
        )


def _title(titles: Names, name: str | None) -> str:
    """Return the title of the sheet with the designs: the user's ``name``, or the only title."""
    if name is not None:
        return known_name("sheet", name, titles)
    # Taking the first sheet would rank the wrong one where a cover comes first.
    if len(titles) != 1:
        raise UnfitError(
            f"it has {counted(len(titles), 'sheet')}: {', '.join(titles) or 'none'}",
            "name the one with the designs by sheet=",
        )
    return titles[0]


def _sheet_head(rows: Iterable[Sequence[Any]]) -> Values:
    """Return what the second sheet says of the columns on the first one.

    Raises:
        ValueError: It is damaged.
    """
    head = {}
    for name, *parts in rows:
        text = "".join(str(part) for part in parts if part is not None)
        head[str(name)] = json.loads(text)
    return head


def _require_visible(sheet: Any, rows: RowsByLine, width: int) -> None:
    """Refuse a sheet that hides one of the rows, or one of its first columns.

    openpyxl tells what is hidden only where it loads everything.

    Args:
        sheet: The sheet.
        rows: The rows that count.
        width: The number of columns that count.

    Raises:
        UnfitError: It hides some; the message names them.
    """
    from xml.etree.ElementTree import iterparse  # loaded where a workbook is read

    hidden_rows = []
    hidden_columns: list[int] = []
    with sheet._get_source() as file:
        for _, element in iterparse(file):
            is_hidden = element.get("hidden") in ("1", "true")
            if is_hidden and element.tag.endswith("}col"):
                last = min(int(element.attrib["max"]), width)
                hidden_columns += range(int(element.attrib["min"]), last + 1)
            elif is_hidden and element.tag.endswith("}row"):
                number = int(element.attrib["r"])
                if number in rows:
                    hidden_rows.append(str(number))
            element.clear()
    if hidden_columns:
        letters = map(_openpyxl().utils.get_column_letter, hidden_columns)
        raise UnfitError(f"the sheet hides the columns {', '.join(letters)}", "show or delete them")
    if hidden_rows:
        numbers = ",".join(hidden_rows)
        raise UnfitError(
            f"the sheet hides the rows {numbers}",
            f"show them, or leave them out by skip_rows=[{numbers}]",
        )


def _typed(cell: Any) -> Any:
    """Return a cell of a workbook as a number, a boolean or text; empty text for nothing.

    What has the format 0 % is the text that it shows: 85 % and not 0.85.
    """
    value = cell.value
    if value is None:
        return ""
    if isinstance(value, (int, float)) and "%" in cell.number_format:
        return f"{100 * value:.15g} %"
    if isinstance(value, str):
        return _ESCAPED.sub(lambda match: chr(int(match[1], 16)), value)
    if isinstance(value, (int, float)):
        return value
    return str(value).removesuffix(" 00:00:00")  # a date
