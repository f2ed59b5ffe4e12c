"""Reading a CSV file of designs, from whatever program, to rank or look at them.

The first line that is no comment (``#``) names the columns; then comes one line for each design.
Cells are kept as they are written, so that what is carried along into a result is unchanged.
"""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.arguments import known_name
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto.ranking import RANKING_COLUMNS

__all__ = ["ParetoFile", "read_pareto_file", "unfit"]

_BLANK = {"", "nan", "na", "n/a", "null", "none"}


@dataclass(frozen=True, eq=False)
class ParetoFile:
    """The cells of a file.

    Attributes:
        path: The file.
        cells: For each named column the texts of its n cells, one or more; in the file's order.
        lines: The line of the file on which each row ends.
        usual: The objectives, if the file says which they are.
    """

    path: Path
    cells: dict[str, list[str]]
    lines: list[int]
    usual: tuple[str, ...] = ()

    def objectives(self, wanted: Sequence[str] = ()) -> tuple[str, ...]:
        """Return the names of the objectives: those wanted, or all columns of numbers.

        Args:
            wanted: Names of columns; an entry may hold several, separated by commas.

        Raises:
            ArgumentValueError: There is no such column, one is named twice, or it is not clear
                which columns are objectives.
        """
        if wanted:
            return self.columns("--objectives", wanted)
        if self.usual:
            return self.usual
        names = [name for name in self.cells if self._holds_numbers(name)]
        if not names:
            raise unfit(self.path, "no column holds numbers")
        if ours := [name for name in names if name in RANKING_COLUMNS]:
            what = f"its column {ours[0]!r} is one that this command adds"
            raise unfit(self.path, f"{what}; name the objectives by --objectives")
        return tuple(names)

    def columns(self, option: str, wanted: Sequence[str]) -> tuple[str, ...]:
        """Return the columns that the entries of an option name, each once."""
        names = [
            part.strip()
            for entry in wanted
            for part in ([entry] if entry in self.cells else entry.split(","))
        ]
        for name in names:
            known_name(option, name, self.cells)
        if twice := [name for name, count in Counter(names).items() if count > 1]:
            raise unfit(self.path, f"{option} names the column {twice[0]!r} twice")
        return tuple(names)

    def values(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Return the ``(n, m)`` values of columns.

        Raises:
            ArgumentValueError: A cell holds no finite number.
        """
        return np.column_stack([self._numbers(name) for name in names])

    def _holds_numbers(self, name: str) -> bool:
        """Say whether a column is one of numbers; a text among numbers or no cell at all is none.

        A column without a name, as data frames write their row labels, is never one.
        """
        kinds = {_kind(cell) for cell in self.cells[name]} if name else set()
        if kinds == {"blank"}:
            remedy = "leave it out, or name the objectives by --objectives"
            raise unfit(self.path, f"its column {name!r} holds no number at all; {remedy}")
        return "number" in kinds

    def _numbers(self, name: str) -> NDArray[np.float64]:
        cells = self.cells[name]
        kinds = [_kind(cell) for cell in cells]
        if "number" not in kinds:
            raise unfit(self.path, f"its column {name!r} holds no number at all")
        for i, (kind, cell) in enumerate(zip(kinds, cells, strict=True)):
            where = f"row {i + 1} (line {self.lines[i]})"
            if kind == "text":
                remedy = "correct it, or name the objectives by --objectives"
                what = f"{where} holds text in the number column {name!r}: {cell!r:.40}; {remedy}"
                raise unfit(self.path, what)
            if kind == "blank" or not math.isfinite(float(cell)):
                what = "no number" if kind == "blank" else cell.strip()
                remedy = "leave out designs that failed"
                raise unfit(self.path, f"{where} holds {what} in the column {name!r}; {remedy}")
        return np.array([float(cell) for cell in cells])


def unfit(path: Path, what: str) -> ArgumentValueError:
    """Compose the error for a file that cannot be used; the caller raises it."""
    return ArgumentValueError(f"{path}: {what}")


def read_pareto_file(path: Path) -> ParetoFile:
    """Read a file: a CSV with commas, semicolons or tabs, or a test table of this package.

    Of a test table the feasible designs are taken, and its criteria are the objectives.

    Raises:
        OSError: The file cannot be opened.
        ArgumentValueError: It is no table of named columns with one row or more.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = list(file)
    except UnicodeDecodeError as error:
        raise unfit(path, f"it is no UTF-8 text: {error.reason}") from None
    comments = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    if lines and '"pymoo_psi_test_table"' in lines[0]:
        return _feasible_tests(path)
    try:
        return _parsed(path, lines[comments:], comments)
    except csv.Error as error:
        raise unfit(path, f"it is no text in rows and columns: {error}") from None


def _feasible_tests(path: Path) -> ParetoFile:
    from pymoo_psi.investigation import TestTable

    table = TestTable.read_csv(path)
    feasible = np.flatnonzero(table.feasible())
    if len(feasible) == 0:
        raise unfit(path, f"none of its {len(table)} tests is feasible")
    frame = table.rows(feasible).to_frame().reset_index()
    cells = {str(name): [str(cell) for cell in frame[name].tolist()] for name in frame.columns}
    return ParetoFile(path, cells, (feasible + 3).tolist(), table.layout.objectives)


def _parsed(path: Path, lines: list[str], skipped: int) -> ParetoFile:
    if not any(line.strip() for line in lines):
        raise unfit(path, "it is empty; it must hold a line of column names, then the designs")
    first = next(line for line in lines if line.strip())
    separator = next((mark for mark in ",;\t" if mark in first), ",")
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    header: list[str] = []
    rows: list[list[str]] = []
    ends: list[int] = []
    for row in reader:
        if not any(cell.strip() for cell in row):
            continue
        if not header:
            header = [name.strip() for name in row]
            continue
        if len(row) != len(header):
            where = f"row {len(rows) + 1} (line {skipped + reader.line_num})"
            what = f"{where} has {len(row)} cells, the header {len(header)}"
            raise unfit(path, what)
        rows.append(row)
        ends.append(skipped + reader.line_num)
    if all(_kind(name) == "number" for name in header):
        raise unfit(path, "its first line must name the columns, and holds numbers")
    if not rows:
        raise unfit(path, "it holds column names, but no row")
    columns = list(zip(*rows, strict=True))
    named = [
        (name, list(column))
        for name, column in zip(header, columns, strict=True)
        if name or any(cell.strip() for cell in column)  # a comma at the end of every line
    ]
    for name, count in Counter(name for name, _ in named).items():
        if count > 1:
            what = f"names the column {name!r} {count} times" if name else "names not all columns"
            raise unfit(path, f"its header {what}")
    return ParetoFile(path, dict(named), ends)


def _kind(cell: str) -> str:
    """Return ``"number"``, ``"blank"`` or ``"text"``."""
    text = cell.strip()
    if text.lower() in _BLANK:
        return "blank"
    try:
        float(text)
    except ValueError:
        return "text"
    return "text" if "_" in text else "number"  # Python alone reads 1_000 as a number
