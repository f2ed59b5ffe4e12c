"""Texts: CSV and others in rows and columns, and JSON, a list of designs.

What we write is read without a change. We also read semicolons, tabs, bars or spaces between the
cells, titles and comments.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Collection
from contextlib import suppress
from dataclasses import replace
from io import StringIO
from itertools import takewhile
from pathlib import Path

from pymoo_psi._names import argument
from pymoo_psi._output import is_marked
from pymoo_psi._validation import (
    Entries,
    FilePath,
    Head,
    Names,
    counted,
    distinct_keys,
    invalid,
)
from pymoo_psi.files._cells import (
    Cells,
    RowsByLine,
    UnfitError,
    cells_of_frame,
    cells_of_rows,
    is_blank,
    is_number,
    named_cells,
)
from pymoo_psi.files._format import FileFormat, SourceFile
from pymoo_psi.files._tests import HEAD_REMEDY
from pymoo_psi.table import (
    HEAD_ENTRY,
    MARK,
    ROWS_ENTRY,
    metadata_path,
    write_csv,
    written_text,
)

_SEPARATORS = ";\t|, "
# A list must begin with an object, as a name in the header of a CSV may begin with a bracket.
_JSON = re.compile(r"\s*(?:\{|\[\s*\{)")
# A first line of Excel that states the separator.
_STATED = re.compile(r'\s*"?sep=([^\w"\r\n])"?\s*', re.IGNORECASE)
_COMMENT = re.compile(r'\s*"*#+|\s*"*%+')
_BLANK = re.compile(r"\s*$")
_PADDING = re.compile(r'"[ \t]+(?=[;,|\t]|$)', re.MULTILINE)  # behind a cell in quotation marks


class CsvFile(FileFormat):
    """A text in rows and columns, a line of names first."""

    suffix = ".csv"
    writes = ("tests", "designs")

    def recognizes(self, file: SourceFile) -> bool:
        """Return True, as any text may be one."""
        return True

    def read(self, file: SourceFile) -> tuple[Cells, Head]:
        """Return the cells of a text, with what we wrote of them."""
        metadata = metadata_path(file.path)
        text = file.text
        if not is_marked(metadata):
            cells, separator = cells_of_text(text, file.skip_rows)
            return cells, {"separator": separator, "metadata": metadata.name}
        head, n_rows = _described(metadata)
        if MARK in head:
            separator = head.get("separator", ",")
            rows = _rows([*StringIO(text, newline="")], separator, skipinitialspace=False)
            cells = cells_of_rows(rows)
        else:
            cells, _ = cells_of_text(text, file.skip_rows, has_comments=False)
        if n_rows != len(cells.rows) and not file.skip_rows:
            raise UnfitError(
                f"it has {counted(len(cells.rows), 'row')}, and {n_rows} by {metadata.name}",
                "restore both, or remove the latter and say --objectives and --maximize",
            )
        columns = {}
        for name, column in cells.columns.items():
            columns[written_text(name)] = list(map(written_text, column))
        return replace(cells, columns=columns), {"decimal": ".", **head}

    def save(self, path: FilePath, columns: Entries, head: Head | None = None) -> None:
        """Write columns, and what they are into a file beside, whole or not at all.

        Raises:
            ArgumentValueError: There are metadata of another program.
            OSError: A file cannot be written.
        """
        write_csv(path, columns, head)

    def is_ours(self, path: Path) -> bool:
        """Say whether pymoo-psi wrote a file: by a mark in it, or by metadata that describe it."""
        if is_marked(path):
            return True
        try:
            with path.open("rb") as stream:
                _, head = self.read(SourceFile(path, stream))
        except UnfitError:
            return False
        return "metadata" not in head


def _described(metadata: Path) -> tuple[Head, int]:
    """Return the head of a file and its number of rows, as metadata that we wrote say them.

    Raises:
        UnfitError: They are damaged.
    """
    try:
        document = json.loads(metadata.read_bytes())
        return dict(document[HEAD_ENTRY]), int(document[ROWS_ENTRY])
    except (ValueError, LookupError, TypeError, RecursionError):
        raise UnfitError(f"{metadata.name} is damaged", HEAD_REMEDY) from None


# Texts of other programs and people


def cells_of_text(
    text: str, skip_rows: Collection[int] = (), *, has_comments: bool = True
) -> tuple[Cells, str]:
    """Return the cells of a text and the mark between them.

    By the csv module, as pandas fills short rows up and joins rows between stray quotation marks.
    Lines that begin with ``#`` may be comments; one that could be a design is refused.

    Raises:
        ArgumentValueError: It is no table of named columns with one row or more.
    """
    lines = [*StringIO(text, newline="")]
    # Lines that do not count are blank, so that all others keep their numbers.
    for number in skip_rows:
        if not 1 <= number <= len(lines):
            raise invalid("skip_rows", f"numbers of lines of the file, 1 to {len(lines)}", number)
        lines[number - 1] = "\n"
    above = [*takewhile(lambda line: _COMMENT.match(line) or _BLANK.match(line), lines)]
    lines[: len(above)] = ["\n"] * len(above)
    stated = _STATED.fullmatch("".join(lines[len(above) :][:1]))
    if stated is not None:
        lines[len(above)] = "\n"
        separator = stated[1]
    else:
        separator = _separator([line for line in lines if not line.startswith("#")])
    rows = _rows(lines, separator)
    if has_comments:
        rows = _without_comments(rows)
    first, row = next(iter(rows.items()), (0, []))
    if any(map(is_number, row)):  # the names may be in a comment, as numpy.savetxt writes them
        rows = _names_in_comments(above, len(row)) | rows
    elif separator == " ":
        _require_plain_names(lines[first - 1], len(row))
    return named_cells(rows), separator


def _names_in_comments(comments: Names, n: int) -> RowsByLine:
    """Return the n names that a comment holds, by the number of its line; none if none does.

    Raises:
        UnfitError: Several comments may hold them.
    """
    lines = [f"{_COMMENT.sub('', comment, count=1).strip()}\n" for comment in comments]
    for separator in _SEPARATORS:
        names: RowsByLine = {}
        for number, row in _rows(lines, separator).items():
            if len(row) == n > 1:
                names[number] = row
        if len(names) > 1:
            numbers = ",".join(map(str, names))
            raise UnfitError(
                f"the comments in lines {numbers} may all be the names of its columns",
                f"leave out those that are not by {argument('skip_rows')}",
            )
        if names:
            return names
    return {}


def _without_comments(rows: RowsByLine) -> RowsByLine:
    """Return the rows that are no comments.

    Raises:
        ArgumentValueError: A row may be a comment or a design.
    """
    designs: RowsByLine = {}
    for end, row in rows.items():
        if not row[0].startswith("#") or is_blank(row[0]):
            designs[end] = row
        elif all(row) and all(len(row) == len(design) for design in designs.values()):
            raise UnfitError(
                f"line {end} begins with # and has a cell in each column",
                f"leave it out by {argument('skip_rows', [end])} if it is a comment, or rename it",
            )
    return designs


def _separator(lines: Names) -> str:
    """Return the mark between cells: the first that divides all rows alike.

    A comma comes late, as names and decimals may have some, and spaces last.
    """
    text = "".join(lines)
    for mark in _SEPARATORS:
        if mark in text:
            with suppress(UnfitError):  # quotation marks within cells
                lengths = {*map(len, _rows(lines, mark).values())}
                if len(lengths) == 1 and lengths != {1}:
                    return mark
    return max(",;\t|", key=text.count)  # the text is going to be refused


def _require_plain_names(header: str, n: int) -> None:
    """Refuse a header above n cells that may also be that of numbered rows, a name of two words."""
    names = re.split(r"\s\s+", header.strip())
    if header.startswith(" ") and len(names) == n - 1:
        raise UnfitError(
            "blanks separate its columns, and may occur in their names",
            "put commas between the cells",
        )


def _rows(lines: Names, separator: str, *, skipinitialspace: bool = True) -> RowsByLine:
    """Return the rows that are not blank.

    Args:
        lines: The lines.
        separator: The mark between cells.
        skipinitialspace: Whether a cell begins behind spaces: else in 'a, "b, c"' the marks would
            be text and its comma a separator.

    Raises:
        UnfitError: They are no rows.
    """
    if separator == " ":
        # Several spaces align printed columns; at the end of a line they begin no cell.
        lines = [f"{line.strip()}\n" for line in lines]
    if separator == "\t":
        skipinitialspace = False
    rows = {}
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=skipinitialspace, strict=True)
    try:
        for row in reader:
            if any(map(str.strip, row)):
                rows[reader.line_num] = row
    except csv.Error as error:
        # Some programs align cells by blanks behind their quotation marks.
        aligned = [_PADDING.sub('"', line) for line in lines]
        if aligned != lines:
            return _rows(aligned, separator, skipinitialspace=skipinitialspace)
        raise UnfitError(f"it is no text in rows and columns: {error}") from None
    return rows


# JSON, as other programs export it


class JsonFile(FileFormat):
    """A list of designs, one object each; such files are read, not written."""

    suffix = ".json"

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether a text begins as JSON does."""
        return _JSON.match(file.text) is not None

    def read(self, file: SourceFile) -> tuple[Cells, Head]:
        """Return the designs, whose keys name the columns."""
        import pandas as pd  # loaded only where JSON is read

        if file.skip_rows:
            rule = "left out for JSON, whose designs are not lines"
            raise invalid("skip_rows", rule, file.skip_rows)
        call = f"pandas.read_json('{file.path.name}', lines=True).to_csv('designs.csv')"
        try:
            designs = json.loads(file.text, object_pairs_hook=distinct_keys)
            if not all(isinstance(row, dict) for row in designs):
                raise TypeError("it holds other values than objects")
        except (ValueError, TypeError, RecursionError) as error:
            example = '[{"name": "A", "cost": 1.5}]'
            raise UnfitError(
                f"it is JSON, but no list of designs such as {example}: {error}",
                f"if it has one object on each line (JSON Lines), export it by {call}",
            ) from None
        return cells_of_frame(pd.DataFrame(designs))
