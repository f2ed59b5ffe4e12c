"""What leaves the package: files, written whole and without formulas, and tables for readers."""

from __future__ import annotations

import csv
import html
import json
import os
import re
import secrets
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pymoo_psi.errors import PsiError

if TYPE_CHECKING:
    import pandas as pd

HEAD_SHEET = "pymoo-psi"  # of a workbook, on which is what its columns are
_ROWS = 8192  # written at a time, so that the memory for texts stays small
# What a spreadsheet runs as a formula: a cell that begins with a sign, full-width ones too, or with
# a gap that it drops, unless it is a number; a sign alone, which people write for "none", is one.
# Apostrophes in front count with the text, so that no two texts are written alike. logic.js has
# this rule for what the page exports; the cells of tests/formulas.py try both.
_LEADING = "'=+-@＝＋－＠\t\r\n"
_FORMULA = re.compile(
    r"'*(?![+-]?([0-9.,]*(e[+-]?[0-9]+)?%?|inf|infinity|nan)\Z)[=+\-@＝＋－＠\t\r\n]", re.IGNORECASE
)

ROWS = 10  # that a notebook shows: a table of 100 000 tests is asked for by to_frame()
_COLUMNS = 24


@contextmanager
def whole_file(path: str | PathLike[str]) -> Iterator[Path]:
    """Give the path of a file to write, which then takes the place of ``path`` at once.

    If the body raises, ``path`` is as it was and what was written is removed. A link is followed,
    and the mode of a file that is replaced is kept. What is no file, such as ``/dev/null`` or a
    pipe, is not replaced but written to.

    Raises:
        OSError: The file cannot be written there.
    """
    target = Path(os.path.realpath(path))
    try:
        mode = os.stat(path).st_mode
    except OSError:  # there is none yet; any other reason shows when the new one is written
        mode = None
    replaced = mode is None or stat.S_ISREG(mode)
    # In the same folder, as os.replace() works within one file system only; by a name of its own
    # and not target's with a suffix, which may be as long as names can be; hidden from globs.
    written = target.with_name(f".{secrets.token_hex(8)}.tmp") if replaced else Path(path)
    try:
        yield written
        if replaced and mode is not None:
            os.chmod(written, stat.S_IMODE(mode))  # before, so that it never has wider rights
        if replaced:
            os.replace(written, target)
    except BaseException as error:  # an interruption, too
        # The other name tells the user nothing, and a full disk comes without any.
        if isinstance(error, OSError) and error.errno and error.filename in (None, str(written)):
            error.filename = str(path)
        if replaced:
            with suppress(FileNotFoundError):  # the body may not have come to write
                os.unlink(written)
        raise


def inert(cell: Any) -> Any:
    """Return a cell as it is written: a text that would be a formula is led by an apostrophe."""
    # The first letter alone is looked at before, as most cells are no formulas.
    if isinstance(cell, str) and cell[:1] in _LEADING and _FORMULA.match(cell):
        return f"'{cell}"
    return cell


def written_text(cell: str) -> str:
    """Return the text that :func:`inert` has made a cell of."""
    return cell[1:] if cell[:1] == "'" and _FORMULA.match(cell[1:]) else cell


def comment(content: Mapping[str, Any]) -> str:
    """Return the comment of JSON that says what the columns of a CSV are."""
    text = json.dumps(content)  # in ASCII: a unit alone does not make the file need a mark
    # Commas in texts would begin cells for a spreadsheet, which may be formulas.
    escaped = {",": r"\u002c", ";": r"\u003b"}
    strings = re.compile(r'"(?:[^"\\]|\\.)*"')
    text = strings.sub(lambda s: re.sub("[,;]", lambda mark: escaped[mark[0]], s[0]), text)
    return f"# {text}"


def write_table(
    path: str | PathLike[str],
    columns: Mapping[str, Any],
    head: Mapping[str, Any] | None = None,
    *,
    quoted: bool = False,
) -> None:
    """Write ``(n,)`` columns, whole or not at all: a workbook if ``path`` ends in .xlsx, else CSV.

    What the columns are stands where it is in no reader's way: in a CSV in a comment below the
    rows and a blank line, so that the first line names the columns and a spreadsheet ends its table
    at the blank one; in a workbook on a second sheet. Numbers have as many digits as it takes to
    read the same number back; no text is a formula.

    Args:
        path: The file.
        columns: Arrays, or series of pandas, by name; None and NaN are blank.
        head: What the columns are, as values that JSON can hold.
        quoted: Whether all texts of a CSV are in quotation marks, so that ``#`` in them is text to
            every reader.

    Raises:
        OSError: It cannot be written.
        PsiError: openpyxl is not installed.
    """
    if os.fspath(path).lower().endswith(".xlsx"):
        _write_workbook(path, columns, head or {})
        return
    texts = {name for name, column in columns.items() if column.dtype.kind not in "biuf"}
    cells = [cell for name in texts for cell in columns[name].tolist() if isinstance(cell, str)]
    foot = f"\n{comment(head)}\n" if head else ""
    # Until Python 3.13 the csv module leaves a carriage return unquoted, which breaks the row.
    quoted = quoted or any("\r" in text for text in (*columns, *cells))
    # Spreadsheets take a file for UTF-8 by its mark, others stumble over it: only where it matters.
    plain = all(map(str.isascii, (*columns, *cells)))
    encoding = "utf-8" if plain else "utf-8-sig"
    with whole_file(path) as written, written.open("w", encoding=encoding, newline="") as file:
        quoting: Any = csv.QUOTE_NONNUMERIC if quoted else csv.QUOTE_MINIMAL
        writer = csv.writer(file, quoting=quoting, lineterminator="\n")
        writer.writerow(map(inert, columns))
        for rows in _rows(columns, csv=True):
            writer.writerows(rows)
        file.write(foot)


def _rows(columns: Mapping[str, Any], *, csv: bool) -> Iterator[Iterator[tuple[Any, ...]]]:
    """Yield rows, some at a time; their cells are Python's numbers and texts, None for blanks."""
    for start in range(0, max(map(len, columns.values()), default=0), _ROWS):
        parts = []
        for column in columns.values():
            cells, kind = column[start : start + _ROWS].tolist(), column.dtype.kind
            if kind not in "biu":
                cells = [None if cell != cell else cell for cell in cells]
            parts.append([*map(inert, cells)] if csv and kind not in "biuf" else cells)
        yield zip(*parts, strict=True)


def workbooks() -> Any:
    """Return openpyxl.

    Raises:
        PsiError: It is not installed.
    """
    try:
        import openpyxl  # type: ignore[import-untyped]
    except ImportError:
        what = "a workbook needs openpyxl, which is not installed"
        raise PsiError(f"{what}; pip install openpyxl, or use CSV") from None
    return openpyxl


def _write_workbook(
    path: str | PathLike[str], columns: Mapping[str, Any], head: Mapping[str, Any]
) -> None:
    openpyxl = workbooks()
    book, cells = openpyxl.Workbook(write_only=True), openpyxl.cell.cell
    book.properties.creator = "pymoo-psi"  # by which the command knows what it may overwrite
    sheet = book.create_sheet("designs")
    sheet.freeze_panes = "A2"
    for j, (name, column) in enumerate(columns.items(), start=1):
        letter = openpyxl.utils.get_column_letter(j)
        lengths = [len(cell) for cell in column[:_ROWS].tolist() if isinstance(cell, str)]
        sheet.column_dimensions[letter].width = min(50, 2 + max(8, len(name), *lengths))

    def typed(cell: Any) -> Any:
        if cell is None or isinstance(cell, bool):
            return cell
        number = isinstance(cell, (int, float)) and abs(cell) != float("inf")
        made = cells.WriteOnlyCell(sheet, cells.ILLEGAL_CHARACTERS_RE.sub("\ufffd", str(cell)))
        # Set, as a text such as =A1 would be a formula, and openpyxl cuts numbers to 16 digits.
        made.data_type = "n" if number else "s"
        return made

    sheet.append([*map(typed, columns)])
    for rows in _rows(columns, csv=False):
        for row in rows:
            sheet.append([*map(typed, row)])
    about = book.create_sheet(HEAD_SHEET)
    for name, value in head.items():
        text = json.dumps(value, ensure_ascii=False)
        # A cell holds 32 767 characters.
        about.append([name, *(text[i : i + 30_000] for i in range(0, len(text), 30_000))])
    with whole_file(path) as written:
        book.save(written)


class Shown:
    """What a notebook shows as its name and a short table."""

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        """Return the first n rows, for a reader, and how many there are."""
        frame = self.to_frame()  # type: ignore[attr-defined]  # of every class that is shown
        return frame.head(n), len(frame)

    def _repr_html_(self) -> str:
        """Return what Jupyter shows; names are data, and no markup of theirs is."""
        lines = [repr(self)]
        table = ""
        with suppress(ValueError):  # of names that do not fit into one table
            frame, n = self._first_rows(ROWS)
            table = frame.to_html(
                max_cols=_COLUMNS, na_rep="", notebook=True, float_format=lambda v: f"{v:.5g}"
            )
            lines += [f"The first {len(frame)} of {n} rows:"] if n > len(frame) else []
        return "".join(f"<p>{html.escape(line)}</p>\n" for line in lines) + table
