"""The numbers that an external program leaves in its files."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import dataclass
from pathlib import Path

from pymoo_psi._validation import Received, invalid
from pymoo_psi.table import Expression

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?")  # Fortran writes 1.5D+03


class RunError(Exception):
    """A run failed, or an output cannot be read; the message says why."""


@dataclass(frozen=True)
class Output:
    """Where a number comes from: an entry of the section ``[outputs]``.

    Attributes:
        file: File in the design's folder; ``stdout.txt`` has what the program prints.
        pattern: Regular expression with one group, which is the number.
        key: Path in a file of JSON, such as ``"tip.u"`` or ``"loads.0"``.
        column: Column in a table with a header, separated by tabs, semicolons, commas or blanks.
        row: Which match of the pattern, or row of the table: from 0, or from -1 backwards. Unless
            it is given, there must be exactly one.
        expression: Arithmetic of variables and of the outputs above, instead of a file.
        unit: Its unit.

    Raises:
        ArgumentValueError: Not exactly one way to find the number is given, or the pattern is none.
    """

    file: str = ""
    pattern: str = ""
    key: str = ""
    column: str = ""
    row: int | None = None
    expression: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        """Check that there is one way to find the number."""
        ways = [w for w in ("pattern", "key", "column", "expression") if getattr(self, w)]
        if len(ways) != 1 or bool(self.file) == bool(self.expression):
            rule = "given as file with one of pattern, key and column, or as expression"
            raise invalid("an output", rule, Received(" and ".join(ways) or "none of these"))
        try:
            groups = re.compile(self.pattern).groups
        except re.error as error:
            rule = f"a regular expression ({error})"
            raise invalid("the pattern of an output", rule, self.pattern) from None
        if self.pattern and groups != 1:
            rule = r"with one group, which is the number, such as 'mass = (\S+)'"
            raise invalid("the pattern of an output", rule, self.pattern)

    @property
    def names(self) -> list[str]:
        """The variables and outputs that its expression uses."""
        return Expression.of(self.expression).columns if self.expression else []

    def read(self, folder: Path) -> float:
        """Return the number that a program has left in a folder.

        Raises:
            RunError: There is none, or not exactly one.
        """
        if not (folder / self.file).is_file():
            raise RunError(f"the program left no file {self.file}")
        text = text_of(folder / self.file).removeprefix("\ufeff").replace("\r\n", "\n")
        cell = self._value(text) if self.key else self._cell(text)
        if not _NUMBER.fullmatch(cell.strip()):
            raise RunError(f"{cell.strip()!r:.60} in {self.file} is no plain number")
        return float(cell.strip().lower().replace("d", "e"))

    def _value(self, text: str) -> str:
        """Return what is at the path in JSON."""
        try:
            found = json.loads(text)
            for part in self.key.split("."):
                found = found[int(part)] if isinstance(found, list) else found[part]
        except (ValueError, LookupError, TypeError) as error:
            reason = f"{type(error).__name__}: {error}"
            raise RunError(f"no {self.key} in {self.file} ({reason:.80})") from None
        return str(found)

    def _cell(self, text: str) -> str:
        """Return the match of the pattern, or the cell of the column."""
        what = f"match of {self.pattern!r}" if self.pattern else f"row of {self.column!r}"
        cells = re.findall(self.pattern, text, re.MULTILINE) if self.pattern else self._column(text)
        if self.row is None and len(cells) > 1:
            remedy = "say which one by row, -1 for the last"
            raise RunError(f"{self.file} has {len(cells)} times a {what}; {remedy}")
        try:
            return str(cells[self.row or 0])
        except IndexError:
            number = "" if self.row is None else f" number {self.row}"
            raise RunError(f"{self.file} has no {what}{number}") from None

    def _column(self, text: str) -> list[str]:
        lines = [line for line in text.splitlines() if line.strip()] or [""]
        mark = next((mark for mark in "\t;," if mark in lines[0]), None)
        rows = [*csv.reader(lines, delimiter=mark)] if mark else [line.split() for line in lines]
        header = [cell.strip() for cell in rows[0]]
        if header.count(self.column) != 1:
            found = ", ".join(header)
            raise RunError(f"{self.file} has {found:.80}, not one column {self.column!r}")
        index = header.index(self.column)
        return [row[index] if index < len(row) else "" for row in rows[1:]]


def text_of(path: Path) -> str:
    """Return the text of a file; bytes that are no UTF-8 pass through it unchanged."""
    return path.read_bytes().decode(errors="surrogateescape")
