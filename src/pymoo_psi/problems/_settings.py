r"""The sections of a program's file: variables, the program, outputs, objectives and limits.

A placeholder stands where the value of a variable belongs in a text of the program: ``{width}`` or
``{width:.6g}``. Other languages have such braces of their own: a shell writes ``${width}``, YAML
``{width: 60}``, Python ``f"{width}"``. So anything else between braces that names a variable is
refused. Doubled braces stand for those of the text: ``${{width}}`` becomes ``${width}``.
"""

from __future__ import annotations

import json
import math
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import chain
from pathlib import Path, PureWindowsPath
from typing import Any

import msgspec
from pymoo.core.variable import Choice, Integer, Real

from pymoo_psi._validation import (
    Entries,
    Names,
    Received,
    Values,
    finite_number,
    invalid,
    known_name,
    known_names,
    mapping,
    plain_value,
    positive_number,
)
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.files import cells_of_text
from pymoo_psi.parallel import run_program
from pymoo_psi.problems._pymoo import NO_OUTPUTS
from pymoo_psi.table import Expression, Limit, limit_of_text

BRACES = "{name}"
_TOLERANCE = 1e-3  # of the width of a variable's bounds, for what a format may round away

_MARKS = re.compile(r"([^\w\s'\"`\\]+)name([^\w\s'\"`\\:]+)")
# A format of Python that gives a plain number, or s for a text. Its letter is required, as 60 is a
# format, too: {width:60} may be a constant.
_FORMAT = r":[<>^=]?[+-]?\#?0?[0-9]{0,3}(?:\.[0-9]{1,3})?[deEfFgGs]"
_FOREIGN = r"""
    \$                              # braces of a shell
    | \{\{ (?= \{[^{}]*\}\}\} )      # three on each side, which could be either
    | (?<!\w) [rR]?[fF][rR]?        # an f-string, from its quotation marks to the braces
      (?: (?P<three>\"{3}|'{3}) (?: (?!(?P=three)) [\s\S] )*?
      | (?P<one>[\"']) (?: (?!(?P=one)) . )*? )
      (?<!\{)
"""


class Placeholders:
    """The placeholders of some variables.

    Args:
        marks: How a placeholder is written, such as ``{name}``.
        settings: The variables by name; ``seed`` is one, too.
    """

    def __init__(self, marks: str, settings: Mapping[str, Setting]) -> None:
        parts = _MARKS.fullmatch(marks)
        if parts is None:
            raise invalid(
                "marks",
                "'name' between marks that are no letters, digits, blanks or quotation marks",
                marks,
                "write them such as '@name@'",
            )
        self.marks = marks
        self._settings = settings
        names = [*settings, "seed"]
        before, after = map(re.escape, parts.groups())
        name = rf"(?<!\w)(?:{'|'.join(map(re.escape, names))})(?!\w)"
        inside = rf"(?!{before}|{after})."  # of the marks
        quoted = rf"\"(?:(?!\"){inside})*\"|'(?:(?!'){inside})*'"  # which names no variable
        rest = f"(?:{inside})*{after}"
        # Marks around anything that names a variable; looking ahead keeps the time linear.
        naming = f"{before}(?={rest})(?:{quoted}|(?![\"']){inside})*?{name}{rest}"
        foreign = "(?!)"
        if marks == BRACES:
            foreign = _FOREIGN
        self._pattern = re.compile(
            rf"""
            {before} (?P<literal>{naming}) {after}              # doubled marks
            | (?:{foreign}) {naming}                            # marks of another language
            | {before} (?P<name>{name}) (?P<format>{_FORMAT})? {after}
            | {naming}                                          # what could be a placeholder
            """,
            re.VERBOSE,
        )

    def names_in(self, text: str) -> set[str]:
        """Return the variables that have placeholders in a text."""
        return {match["name"] for match in self._pattern.finditer(text)} - {None}

    def fill(self, where: str, text: str, values: Entries) -> str:
        """Return a text with values for its placeholders.

        Args:
            where: Name of the text.
            text: The text.
            values: The value of each variable by name.

        Raises:
            ArgumentValueError: Something in it could be a placeholder, or a format does not fit or
                rounds a value too much.
        """

        def value(match: re.Match[str]) -> str:
            if match["literal"]:
                return match["literal"]
            problem = ""
            if match["name"]:
                try:
                    written = format(values[match["name"]], (match["format"] or "")[1:])
                except ValueError as error:
                    problem = f" ({error})"
                else:
                    self._require_digits(where, match, values[match["name"]], written)
                    return written
            number = text.count("\n", 0, match.end()) + 1
            raise invalid(
                f"{where}, line {number}: a placeholder",
                f"{self.marks} or {self.marks.replace('name', 'name:FORMAT')} with a format such "
                "as .6g, 08.3f or, for integers, d; braces without $ before, and in no f-string",
                Received(f"{match[0]!r:.60}{problem}"),
                "double the marks if they belong to the text, as {{x}} stands for {x}, or choose "
                "others in [program], such as marks = '@name@'",
            )

        return self._pattern.sub(value, text)

    def _require_digits(self, where: str, match: re.Match[str], value: Any, written: str) -> None:
        """Refuse a format that rounds: the program would run another design than the recorded."""
        name = match["name"]
        if name not in self._settings or not isinstance(value, (int, float)):
            return
        try:
            error = abs(float(written) - value)
        except ValueError:  # True is written for a choice
            return
        if error > self._settings[name].tolerance(value):
            raise invalid(
                f"{where}: the placeholder {match[0]}",
                "of a format that keeps the value",
                Received(f"{written.strip()} for {value!r}"),
                f"give it more digits, such as {self.marks.replace('name', f'{name}:.9g')}, or "
                f"make {name} an integer variable",
            )


# How an output can be given.
_WAYS = "given as file with one of pattern, key and column, or as expression"
# Fortran writes 1.5D+03.
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_NO_LETTER = re.compile(r"(\.\d+)([+-]\d{3})\Z")  # and 1.5+103 if the exponent has three digits
# A number that begins before this place, and one that goes on after it.
_AFTER_A_BEGINNING = re.compile(
    r"(?:(?<=\d)|(?<=\d\.)|(?<=[^\w)]-)|(?<=\d[eEdD])|(?<=\d[eEdD][+-]))[\d.]"
)
_REST = re.compile(r"[\d.]\d|\d(?:\.\d|[eEdD][+-]?\d)")
_WITH_COMMA = re.compile(r"\s*[+-]?\d+,\d+(?:[eEdD][+-]?\d+)?\s*")
_SWAPPED = str.maketrans(",.", ".,")


@dataclass(frozen=True)
class Setting:
    """A variable: an entry of the section ``[variables]``.

    Attributes:
        bounds: Lower and upper bound.
        choices: The options of a choice, instead of bounds.
        kind: ``"real"`` or ``"integer"``.
        scale: ``"linear"`` or ``"log"``.
        unit: Its unit.
    """

    bounds: Sequence[int | float] = ()
    choices: Sequence[str | bool | int | float] = ()
    kind: str = "real"
    scale: str = "linear"
    unit: str = ""

    def __post_init__(self) -> None:
        """Check the settings."""
        known_name("scale", self.scale, ("linear", "log"))
        known_name("kind", self.kind, ("real", "integer"))
        n_bounds = 0 if self.choices else 2
        if len(self.bounds) != n_bounds:
            raise invalid("a variable", "given by bounds = [lower, upper] or choices", self.bounds)
        for end in self.bounds:
            finite_number("bounds", end)

    @property
    def variable(self) -> Any:
        """The variable in pymoo."""
        if self.choices:
            return Choice(options=list(self.choices))
        kind = Real if self.kind == "real" else Integer
        return kind(bounds=tuple(map(float, self.bounds)))

    def tolerance(self, value: float) -> float:
        """Return by how much the text of a value may differ from it."""
        width = abs(value)  # of a choice, or of a variable that is fixed
        if self.bounds and self.bounds[0] != self.bounds[1]:
            lower, upper = self.bounds
            width = upper - lower
            if self.scale == "log" and lower > 0:  # as is checked later
                width = value * math.log(upper / lower)
        return _TOLERANCE * abs(width)  # bounds in wrong order are refused later, too


@dataclass(frozen=True)
class Output:
    """The source of a number: an entry of the section ``[outputs]``.

    Attributes:
        file: File in the design's folder; ``stdout.txt`` has what the program prints. It may be one
            of the program's ``files`` that the program edits in place.
        pattern: Regular expression with one group, which is the number.
        key: Path in a JSON file, such as ``"tip.u"`` or ``"loads.0"``; if names have dots, a list
            such as ``["tip.u", "x"]``.
        column: Column of a table with a header and rows of equal length, whose cells are separated
            by tabs, semicolons, commas, bars or blanks; see :func:`read_table`.
        header: Number of the line that names the columns, from 1, if other text is above it.
        row: Number of the match of the pattern, or of the table's row: from 0, or from -1
            backwards. By default there must be exactly one.
        encoding: Encoding of the file, such as ``"cp1252"``. By default UTF-8, or UTF-16 if the
            file begins with its mark.
        decimal: The decimal mark of its numbers, ``"."`` or ``","``.
        expression: Arithmetic of variables and of the outputs above, instead of a file.
        unit: Its unit.

    If people make the tests, the number comes from their results, without a file.

    Raises:
        ArgumentValueError: There is not exactly one way to find the number, or the pattern cannot
            be used.
    """

    file: str = ""
    pattern: str = ""
    key: str | Sequence[str | int] = ""
    column: str = ""
    header: int = 1
    row: int | None = None
    encoding: str = ""
    decimal: str = "."
    expression: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        """Check that there is one way to find the number."""
        ways = [*filter(None, (self.pattern, self.key, self.column, self.expression))]
        is_measured = not ways and not self.file
        if not is_measured and (len(ways) != 1 or bool(self.file) == bool(self.expression)):
            raise invalid("an output", _WAYS, [self.file, *ways])
        _require_inside("file", self.file)
        known_name("decimal", self.decimal, (".", ","))
        if self.pattern:
            try:
                problem = f"{re.compile(self.pattern).groups} groups"
            except re.error as error:
                problem = str(error)
            if problem != "1 groups":
                received = Received(f"'{self.pattern}', {problem}")  # as typed: a backslash is one
                raise invalid(
                    "the pattern of an output",
                    r"a regular expression with one group, the number, such as 'mass = (\S+)'",
                    received,
                    r"write \( and \) for brackets of the text",
                )

    def read(self, folder: Path) -> float:
        """Return the number that a program has left in a folder.

        Raises:
            ValueError: There is none, or not exactly one.
        """
        cell = self.cell(folder)
        number = _NO_LETTER.sub(r"\1e\2", cell)
        if self.decimal == ",":
            number = number.translate(_SWAPPED)  # 1.250,5 is refused as 1,250.5 is
        if not _NUMBER.fullmatch(number):
            remedy = ""
            if _WITH_COMMA.fullmatch(cell):
                remedy = "; write decimal = ',' if it has a decimal comma"
            raise ValueError(f"{cell!r:.60} in {self.file} is no plain number{remedy}")
        return float(number.lower().replace("d", "e"))

    def cell(self, folder: Path) -> str:
        """Return the text of the number.

        Raises:
            ValueError: There is none, or not exactly one.
        """
        path = folder / self.file
        if not path.is_file():
            raise ValueError(f"the program left no file {self.file}")
        content = path.read_bytes()
        encoding = self.encoding or json.detect_encoding(content)
        text = content.decode(encoding, "replace").replace("\r\n", "\n")
        if self.key:
            return self._value_at_key(text)
        if self.column:
            return str(self._one(f"row of {self.column!r}", self._column(text))).strip()
        matches = [*re.finditer(self.pattern, text, re.MULTILINE)]
        match = self._one(f"match of '{self.pattern}'", matches)
        _require_whole(match)
        return (match[1] or "").strip()

    def _one(self, kind: str, items: Sequence[Any]) -> Any:
        """Return the match, or the cell, that ``row`` says; the only one if it says none."""
        if self.row is None and len(items) > 1:
            raise ValueError(
                f"{self.file} has {len(items)} times a {kind}; say which one by row, -1 for the "
                "last"
            )
        row = self.row or 0
        if not -len(items) <= row < len(items):
            problem = f"{self.file} has no {kind}"
            if self.row is not None:
                problem += f" number {row}"
            if not kind.isascii():
                problem += "; if it is no UTF-8, write the one that it is, as encoding = 'cp1252'"
            raise ValueError(problem)
        return items[row]

    def _value_at_key(self, text: str) -> str:
        """Return the value at the path in JSON."""
        path = self.key
        if isinstance(path, str):
            path = path.split(".")
        try:
            value = json.loads(text)
            for part in path:
                value = value[int(part)] if isinstance(value, list) else value[str(part)]
        except (ValueError, LookupError, TypeError) as error:
            remedy = "a name with dots is one part of a list, as key = ['tip.u', 'x']"
            reason = f"{type(error).__name__}: {error}"
            raise ValueError(f"no {self.key} in {self.file} ({reason:.80}); {remedy}") from None
        return str(value)

    def _column(self, text: str) -> list[str]:
        """Return the cells of the column."""
        remedy = "write header = 3 if line 3 names them, encoding = 'cp1252' if it is no UTF-8"
        try:
            table, _ = cells_of_text(text, range(1, self.header))
        except ArgumentValueError as error:
            raise ValueError(f"{self.file} is no table: {error}; {remedy}") from None
        columns = table.columns
        if self.column not in columns:
            names = ", ".join(columns)
            problem = f"{self.file} has {names:.80}, not one column {self.column!r}"
            raise ValueError(f"{problem}; {remedy}")
        cells = chain.from_iterable(columns.values())
        if self.decimal == "." and any(map(_WITH_COMMA.fullmatch, cells)):
            # Beside it 1.250 may be a thousand and more.
            raise ValueError(f"{self.file} has decimal commas; write decimal = ','")
        return columns[self.column]


def _require_whole(match: re.Match[str]) -> None:
    r"""Refuse a match whose group is a part of a number.

    A pattern may say what follows the group, as ``(\d+),`` does.
    """
    start, end = match.span(1)
    text = match.string
    rest = text[end : end + 3]
    is_part = _AFTER_A_BEGINNING.match(text, start)
    if end == match.end():
        is_part = is_part or _REST.match(match[1][-1:] + rest)
        if match[1].isdigit():  # perhaps 1,5 or 1,500; what follows 1.5 is another number
            is_part = is_part or re.match(r",\d", rest)
    if is_part:
        problem = f"{match[1]!r} in {text[max(start - 10, 0) : end + 10]!r} is a part of a number"
        remedy = r"the group must match all of it, or the pattern what follows, as (\d+), does"
        raise ValueError(f"{problem}; {remedy}")


def _require_inside(argument: str, file: str) -> None:
    """Refuse a file that is not in the folder of a run, where no design meets another one."""
    path = PureWindowsPath(file)  # it knows the separators of all systems
    if path.anchor or ".." in path.parts:
        raise invalid(
            argument,
            "a relative path inside the folder in which the program runs, without '..'",
            file,
        )


@dataclass(frozen=True)
class Program:
    """How a program is run: the section ``[program]``.

    Attributes:
        command: The program with its arguments, run without a shell; ``{width}`` is replaced by the
            value.
        template: Folder that is copied for each design; the command runs in the copy.
        files: Files of it in which ``{width}`` or ``{width:.6g}`` is replaced by a value. Doubled
            braces stand for those of the text: ``{{width}}`` becomes ``{width}``.
        marks: How a placeholder is written, if other than ``{name}``: such as ``@name@``.
        exit_codes: Exit codes that mean success.
        error: Where a failed program says why, like an output: ``file`` with ``pattern`` or
            ``key``. The first match begins the reason unless there is a ``row``.
        timeout: Seconds after which a design fails; None for no limit.
        keep: Which folders are kept: ``"failed"``, those of failed designs; ``"all"``; ``"none"``.
        folder: Folder in which the folders of the designs are made.
    """

    command: str = ""
    template: str = ""
    files: Names = ()
    marks: str = BRACES
    exit_codes: Sequence[int] = (0,)
    error: dict[str, Any] = field(default_factory=dict)
    timeout: int | float | None = None
    keep: str = "failed"
    folder: str = "runs"

    def __post_init__(self) -> None:
        """Check the settings."""
        words = shlex.split(self.command)
        if not words or {*words} & {"|", ">", "<", "&&", "||", ";", "&", "2>&1"}:
            raise invalid(
                "command",
                "one program with its arguments, without a shell",
                self.command,
                'or write a script, "sh run.sh"',
            )
        known_name("keep", self.keep, ("failed", "all", "none"))
        if self.timeout is not None:
            positive_number("timeout", self.timeout)
        for file in self.files:
            _require_inside("files", file)

    def run(self, words: Names, folder: Path) -> None:
        """Run the command in a folder, then kill it and all processes that it has started.

        Args:
            words: The command with all values in it.
            folder: Folder in which it runs and in which its output is written.

        Raises:
            RuntimeError: It takes too long, ends with an exit code that is none of success, or ends
                before what it has started.
        """
        code, left_some = run_program(words, folder, self.timeout)
        if code is None:
            raise RuntimeError(f"timed out after {self.timeout:g} s")
        if code not in self.exit_codes:
            raise RuntimeError(f"exit code {code}: {_last_line(folder) or 'no message'}")
        if left_some:
            problem = "it ended while processes that it had started went on, so they were killed"
            raise RuntimeError(f"{problem}; let the command wait for them")


def _last_line(folder: Path) -> str:
    """Return the last line that a program has printed, for messages."""
    text = ""
    for name in ("stdout.txt", "stderr.txt"):
        text = (folder / name).read_text("utf-8", "replace").strip() or text
    return text.rpartition("\n")[2][:120]


def settings_of(variables: Any) -> dict[str, Setting]:
    """Return the settings of variables, of which some may be given by their bounds alone."""
    entries = {}
    for name, entry in mapping("variables", variables, "names to settings").items():
        entries[name] = {"bounds": entry} if isinstance(entry, (tuple, list)) else entry
    if not entries:
        raise invalid("variables", "one or more", variables)
    return sections("variables", Setting, entries)


def outputs_of(entries: Any, variables: Entries, by_people: bool) -> dict[str, Output]:
    """Return the outputs of a file, each of which can be found."""
    outputs: dict[str, Output] = sections("outputs", Output, entries)
    for name, output in outputs.items():
        if name in NO_OUTPUTS:
            raise invalid(
                "an output",
                "named unlike the entries that pymoo has for a design",
                name,
                "rename it, such as 'force' instead of 'F'",
            )
        if name in variables:
            raise invalid("the name of an output", "unlike those of variables", name)
        if not output.expression and by_people == bool(output.file):
            raise invalid(
                f"outputs: {name}: an output",
                f"{_WAYS}; without [program], as expression or without a way",
                Received(output.file or "no file"),
            )
    return outputs


def expressions_of(outputs: Mapping[str, Output], variables: Entries) -> dict[str, Expression]:
    """Return the expressions of outputs, which use variables and the outputs above."""
    expressions = {}
    operands = [*variables]
    for name, output in outputs.items():
        if output.expression:
            expressions[name] = Expression.of(output.expression)
            used = expressions[name].columns
            known_names(f"a name in the expression of {name}", used, operands)
        operands.append(name)
    return expressions


def objectives_of(entry: Any, outputs: Entries) -> tuple[list[str], list[str]]:
    """Return the outputs to be minimized and those to be maximized, one or more together."""
    mapping("objectives", entry, "settings to values")
    known_names("a setting of objectives", entry, ("minimize", "maximize"))
    minimize = known_names("objectives: minimize", entry.get("minimize", ()), outputs)
    maximize = known_names("objectives: maximize", entry.get("maximize", ()), outputs)
    if not minimize and not maximize:
        raise invalid("objectives", "one or more outputs", entry)
    for name in maximize:
        if name in minimize:
            raise invalid("objectives", "minimized or maximized", Received(f"{name} in both"))
    return minimize, maximize


def limits_on_outputs(texts: Any, outputs: Entries) -> dict[str, Limit]:
    """Return the limits of texts by output."""
    limits: dict[str, Limit] = {}
    if texts is None:
        return limits
    for output, text in mapping("limits", texts, "outputs to texts, as '<= 250'").items():
        known_name("what is limited", output, outputs, "variables have bounds and requirements")
        limits[output] = limit_of_text(f"the limit on {output}", text)
    return limits


def sections(where: str, kind: type[Any], entries: Any) -> Values:
    """Return named entries of a file as values of a class."""
    entries = mapping(where, entries, "names to settings")
    return {name: section(f"{where}: {name}", kind, entry) for name, entry in entries.items()}


def section(where: str, kind: type[Any], entry: Any) -> Any:
    """Return a section of a file as a value of its class, whose annotations are its schema."""
    settings = [setting.name for setting in fields(kind)]
    mapping(where, entry, "settings to values")
    known_names(f"a setting of {where}", entry, settings)
    # NumPy's numbers and arrays, and ranges, become Python's numbers and lists.
    plain = msgspec.to_builtins(entry, enc_hook=plain_value)
    try:
        return msgspec.convert(plain, kind)
    except msgspec.ValidationError as error:
        problem = error.__cause__ or error  # an error of the class itself
        raise ArgumentValueError(f"{where}: {problem}") from None
