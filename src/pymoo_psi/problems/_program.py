"""An external program as a pymoo problem, with values in its input files and numbers as outputs.

The sections of its file are values of :class:`Setting`, :class:`Output`, :class:`Program` and
``Directions``. A :class:`ProgramProblem` checks them before any run, has a fingerprint for studies,
runs the program in a folder for each design, and completes the outputs of stored tests.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import shlex
import shutil
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from itertools import chain
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
from pymoo.core.variable import Choice

from pymoo_psi._validation import (
    Entries,
    FilePath,
    Names,
    Received,
    Rows,
    Values,
    boolean,
    distinct,
    invalid,
    known_name,
    positive_number,
)
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, EvaluationError
from pymoo_psi.parallel import run_program
from pymoo_psi.problems._named import (
    NamedProblem,
    require_output_names,
    section,
    sections,
    units_of,
)
from pymoo_psi.problems._placeholders import BRACES, Placeholders
from pymoo_psi.problems._wrapped import require_model
from pymoo_psi.table import Expression, cells_of_text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# How an output can be given.
_WAYS = "given as file with one of pattern, key and column, or as expression"
# Python, git and macOS leave these in a template; they are neither copied nor part of the model.
_LEFT_OUT = ("__pycache__", ".git", ".DS_Store")
# Fortran writes 1.5D+03.
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_NO_LETTER = re.compile(r"(\.\d+)([+-]\d{3})\Z")  # and 1.5+103 if the exponent has three digits
_WITH_COMMA = re.compile(r"\s*[+-]?\d+,\d+(?:[eEdD][+-]?\d+)?\s*")
_SWAPPED = str.maketrans(",.", ".,")
_NAME = re.compile(r"[^\W\d]\w*")


class ProgramError(Exception):
    """A run failed, or an output cannot be read; the message says why."""


_UNREADABLE = (ProgramError, OSError, LookupError)  # what reading an output raises


@dataclass(frozen=True)
class Output:
    """The source of a number: an entry of the section ``[outputs]``.

    Attributes:
        file: File in the design's folder; ``stdout.txt`` has what the program prints.
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
            groups: Any = None
            try:
                groups = re.compile(self.pattern).groups
                problem = f"{groups} groups"
            except re.error as error:
                problem = str(error)
            if groups != 1:
                rule = r"a regular expression with one group, the number, such as 'mass = (\S+)'"
                received = Received(f"'{self.pattern}', {problem}")  # as typed: a backslash is one
                remedy = r"write \( and \) for brackets of the text"
                raise invalid("the pattern of an output", rule, received, remedy)

    def read(self, folder: Path) -> float:
        """Return the number that a program has left in a folder.

        Raises:
            ProgramError: There is none, or not exactly one.
        """
        cell = self.cell(folder)
        number = _NO_LETTER.sub(r"\1e\2", cell)
        if self.decimal == ",":
            number = number.translate(_SWAPPED)  # 1.250,5 is refused as 1,250.5 is
        if not _NUMBER.fullmatch(number):
            remedy = ""
            if _WITH_COMMA.fullmatch(cell):
                remedy = "; write decimal = ',' if it has a decimal comma"
            raise ProgramError(f"{cell!r:.60} in {self.file} is no plain number{remedy}")
        return float(number.lower().replace("d", "e"))

    def cell(self, folder: Path) -> str:
        """Return the text of the number.

        Raises:
            ProgramError: There is none, or not exactly one.
        """
        path = folder / self.file
        if not path.is_file():
            raise ProgramError(f"the program left no file {self.file}")
        content = path.read_bytes()
        encoding = self.encoding or json.detect_encoding(content)
        text = content.decode(encoding, "replace").replace("\r\n", "\n")
        if self.key:
            texts = [self._value_at_key(text)]
        elif self.pattern:
            texts = re.findall(self.pattern, text, re.MULTILINE)
        else:
            texts = self._column(text)
        kind = f"match of '{self.pattern}'" if self.pattern else f"row of {self.column!r}"
        if self.row is None and len(texts) > 1:
            remedy = "say which one by row, -1 for the last"
            raise ProgramError(f"{self.file} has {len(texts)} times a {kind}; {remedy}")
        row = self.row or 0
        if not -len(texts) <= row < len(texts):
            number = "" if self.row is None else f" number {row}"
            if not kind.isascii():
                number += "; if it is no UTF-8, write the one that it is, as encoding = 'cp1252'"
            raise ProgramError(f"{self.file} has no {kind}{number}")
        return texts[row].strip()

    def _value_at_key(self, text: str) -> str:
        """Return the value at the path in JSON."""
        path = self.key
        if isinstance(path, str):
            path = path.split(".")
        try:
            value = json.loads(text, object_pairs_hook=distinct)
            for part in path:
                value = value[int(part)] if isinstance(value, list) else value[str(part)]
        except (ValueError, LookupError, TypeError, RecursionError) as error:
            reason = f"{type(error).__name__}: {error}"
            problem = f"no {self.key} in {self.file} ({reason:.80})"
            if isinstance(error, KeyError):
                problem += "; a name with dots is one part of a list, as key = ['tip.u', 'x']"
            raise ProgramError(problem) from None
        return str(value)

    def _column(self, text: str) -> list[str]:
        """Return the cells of the column."""
        remedy = "write header = 3 if line 3 names them, encoding = 'cp1252' if it is no UTF-8"
        try:
            columns = cells_of_text(text, range(1, self.header)).columns
        except ArgumentValueError as error:
            problem = getattr(error, "problem", error)  # without options of the command
            raise ProgramError(f"{self.file} is no table: {problem}; {remedy}") from None
        if self.column not in columns:
            names = ", ".join(columns)
            problem = f"{self.file} has {names:.80}, not one column {self.column!r}"
            raise ProgramError(f"{problem}; {remedy}")
        cells = chain.from_iterable(columns.values())
        if self.decimal == "." and any(map(_WITH_COMMA.fullmatch, cells)):
            # Beside it 1.250 may be a thousand and more.
            raise ProgramError(f"{self.file} has decimal commas; write decimal = ','")
        return columns[self.column]


def _require_inside(argument: str, file: str) -> None:
    """Refuse a file that is not in the folder of a run, where no design meets another one."""
    path = PureWindowsPath(file)  # it knows the separators of all systems
    if path.anchor or ".." in path.parts:
        rule = "a relative path inside the folder in which the program runs, without '..'"
        raise invalid(argument, rule, file)


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
        try:
            words = shlex.split(self.command)
        except ValueError:  # a quotation mark has no partner
            words = []
        if not words or {*words} & {"|", ">", "<", "&&", "||", ";", "&", "2>&1"}:
            rule = "one program with its arguments, quotation marks in pairs, without a shell"
            raise invalid("command", rule, self.command, 'or write a script, "sh run.sh"')
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
            ProgramError: It takes too long, ends with an exit code that is none of success, or ends
                before what it has started.
        """
        code, left_some = run_program(words, folder, self.timeout)
        if code is None:
            raise ProgramError(f"timed out after {self.timeout:g} s")
        if code not in self.exit_codes:
            raise ProgramError(f"exit code {code}: {_last_line(folder) or 'no message'}")
        if left_some:
            problem = "it ended while processes that it had started went on, so they were killed"
            raise ProgramError(f"{problem}; let the command wait for them")


def _last_line(folder: Path) -> str:
    """Return the last line that a program has printed, for messages."""
    text = ""
    for name in ("stdout.txt", "stderr.txt"):
        with suppress(OSError):  # a program may remove them
            text = (folder / name).read_text("utf-8", "replace").strip() or text
    return text.rpartition("\n")[2][:120]


@dataclass(frozen=True)
class Directions:
    """The objectives: the section ``[objectives]``.

    Attributes:
        minimize: Outputs to be minimized.
        maximize: Outputs to be maximized.
    """

    minimize: Names = ()
    maximize: Names = ()


@dataclass
class ProgramRun:
    """One run of a program.

    Attributes:
        folder: The folder in which it ran.
        words: The command as it ran.
        outputs: The numbers that were read.
        seconds: How long it took.
        filled: The lines of files that have placeholders, with their values.
        flaws: What is wrong.
    """

    folder: Path
    words: list[str] = field(default_factory=list)
    outputs: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    filled: list[str] = field(default_factory=list)
    flaws: list[str] = field(default_factory=list)


class ProgramProblem(NamedProblem):
    r"""An external program as a problem: a simulator with its input files.

    For each design the template folder is copied, values are written into its files, the command
    runs there, and numbers are read from the files that it writes. Each design has its own folder,
    so that workers can run at the same time. A design fails if its program fails, hangs or writes
    no number; the reason names its folder, which is kept.

    The arguments are the sections of the TOML file that :meth:`from_toml` reads.

    Args:
        variables: By name: ``{"bounds": [20, 60]}`` with ``"unit"``, ``"scale": "log"`` or
            ``"kind": "integer"``, or ``{"choices": ["S235", "S355"]}``; see :class:`Setting`.
        program: See :class:`Program`; ``None`` if people make the tests, see ``pymoo-psi ask``.
        outputs: By name; see :class:`Output`.
        objectives: ``{"minimize": [...], "maximize": [...]}``, names of outputs.
        limits: On outputs, such as ``{"stress": "<= 250", "f": ">= 1, <= 5"}``: constraints.
        requirements: Rules on variables by name, such as ``"height <= 4*width"``. PSI,
            ``SurrogatePSI`` and ``investigate`` never run a design that violates one; other
            algorithms take a :class:`Required` problem.
        name: Name of the problem.
        key: Version of the model, part of the study's key.
        noisy: Whether two runs of a design differ. This is also implied by ``{seed}`` in the
            command or in files, which is replaced by an integer that differs between tests.
        base: Folder from which relative paths start.
        **kwargs: pymoo's own, such as ``elementwise_runner``.

    Attributes:
        names: The names of all columns by pymoo's names.
        noisy: Whether two runs for a design differ.
        by_people: Whether people make the tests because there is no program.
        units: Units by name.
        maximize: Objectives whose sign is changed in ``F``.
        log: Variables of logarithmic scale.

    Raises:
        ArgumentValueError: A section cannot be used, a file or the program is missing, or a
            variable is used nowhere.
        ArgumentTypeError: A value has the wrong type.

    Example:
        >>> problem = ProgramProblem(
        ...     variables={"width": {"bounds": [20, 60], "unit": "mm"}},
        ...     program={"command": "echo area = {width}", "keep": "none"},
        ...     outputs={"area": {"file": "stdout.txt", "pattern": r"area = (\S+)"}},
        ...     objectives={"minimize": ["area"]})
        >>> problem.run({"width": 25}).outputs
        {'area': 25.0}
    """

    def __init__(
        self,
        variables: Entries,
        program: Entries | None,
        outputs: Entries,
        objectives: Entries,
        limits: Entries | None = None,
        requirements: Any = None,
        *,
        name: str = "program",
        key: str = "",
        noisy: bool = False,
        base: FilePath = ".",
        **kwargs: Any,
    ) -> None:
        self.base = Path(base).absolute()
        self.key = str(key)
        self.noisy = boolean("noisy", noisy)
        self.outputs: dict[str, Output] = sections("outputs", Output, outputs)
        self.by_people = program is None
        directions = section("objectives", Directions, objectives)
        super().__init__(
            variables,
            [*directions.minimize, *directions.maximize],
            directions.maximize,
            limits,
            requirements,
            units=units_of(self.outputs),
            name=str(name),
            **kwargs,
        )
        for objective in self.objectives:
            known_name("an objective", objective, self.outputs)
        for limit in self.limits:
            remedy = "variables have bounds and requirements"
            known_name("what is limited", limit.output, self.outputs, remedy)
        self.known_expressions: dict[str, Expression] = {}
        self._tested: dict[str, Output] = {}  # the outputs that are no expressions
        self._check_outputs()
        if program is not None:
            self.program: Program = section("program", Program, program)
            self._listing: Output = section("program: error", Output, self.program.error)
            self._read_files = [*self.outputs.values(), self._listing]
            self._placeholders = Placeholders(self.program.marks, [*self.variables, "seed"])
            self._check_files()
            self._check_placeholders()

    @classmethod
    def from_toml(cls, path: FilePath, **kwargs: Any) -> ProgramProblem:
        """Return the problem that a TOML file describes; its paths start from the file's folder.

        ``pymoo-psi solve --new bracket.toml`` writes a commented example.

        Args:
            path: The file.
            **kwargs: pymoo's own, such as ``elementwise_runner``.

        Raises:
            ArgumentValueError: It is no TOML, or a section cannot be used; see the class.
            OSError: The file cannot be opened.
        """
        path = Path(path)
        needed: Values = dict.fromkeys(("variables", "program", "outputs", "objectives"))
        further = ("limits", "requirements", "name", "key", "noisy")
        try:
            sections = tomllib.loads(path.read_text(encoding="utf-8-sig"))
            for word in sections:
                known_name("a section", word, (*needed, *further))
            return cls(**needed | sections, base=path.parent, **kwargs)
        # tomllib's own is a ValueError; brackets may be nested too deeply for it.
        except (ValueError, ArgumentTypeError, RecursionError) as error:
            message = f"{path}: {error}"
            if "Unescaped" in str(error):
                message += "; between '…' it stays as it is"
            if re.search("after a key|Invalid statement", str(error)):
                message += '; a name with other letters than a-z stands in quotes, as "Höhe"'
            raise ArgumentValueError(message) from error

    # What is checked before any run

    def _check_outputs(self) -> None:
        """Divide the outputs into expressions and others; refuse those that cannot be found."""
        require_output_names(self.outputs)
        names = [*self.variables]  # names that an expression may use
        for name, output in self.outputs.items():
            if name in self.variables:
                raise invalid("the name of an output", "unlike those of variables", name)
            if output.expression:
                expression = Expression.of(output.expression)
                for operand in expression.columns:
                    known_name(f"a name in the expression of {name}", operand, names)
                self.known_expressions[name] = expression
            elif self.by_people == bool(output.file):
                rule = f"{_WAYS}; without [program], as expression or without a way"
                received = Received(output.file or "no file")
                raise invalid(f"outputs: {name}: an output", rule, received)
            else:
                self._tested[name] = output
            names.append(name)

    def _check_files(self) -> None:
        """Refuse a missing program, template or file, and runs within the template."""
        program = self.program
        template = self._template
        if program.template:
            if not template.is_dir():
                raise invalid("template", f"a folder in {self.base}", program.template)
            if (self.base / program.folder).resolve().is_relative_to(template.resolve()):
                raise invalid("folder", "outside of the template, which is copied", program.folder)
        word = shlex.split(program.command)[0]
        in_template = bool(program.template) and (template / word).is_file()
        if not shutil.which(word) and not in_template:
            rule = "a program that is on PATH or in the template"
            raise invalid("command", rule, word, "install it, or give its whole path")
        read = {os.path.normpath(output.file) for output in self._read_files}
        for file in program.files:
            if not program.template or not (template / file).is_file():
                raise invalid("files", "files in the folder of the template", file)
            if os.path.normpath(file) in read:
                remedy = "let the command copy the input, so that no value of it is an output"
                raise invalid("files", "inputs, and none of them an output", file, remedy)

    def _check_placeholders(self) -> None:
        """Refuse what could be a placeholder and is none, and variables that are used nowhere.

        A placeholder for a seed makes a model noisy.
        """
        values: Values = {"seed": 1}
        for name, variable in self.variables.items():
            if not _NAME.fullmatch(name):
                rule = "letters, digits and _ that do not begin with a digit"
                raise invalid(
                    "the name of a variable", rule, name, "rename it, such as t_web for t-web"
                )
            if isinstance(variable, Choice):
                values[name] = variable.options[0]
            else:
                values[name] = variable.vtype(variable.lb)
        self._placeholders.fill("command", self.program.command, values)
        for file in self.program.files:
            self._placeholders.fill(file, text_of(self._template / file), values)
        used = self._placeholders.used
        if "seed" in used and "seed" not in self.variables:
            self.noisy = True
        for expression in self.known_expressions.values():
            used.update(expression.columns)
        for name in self.variables:
            if name not in used:
                rule = "in the command, in one of files or in an expression"
                placeholder = self._placeholders.marks.replace("name", name)
                remedy = f"write {placeholder} where its value belongs, in UTF-8"
                raise invalid(f"the variable {name}", rule, Received("in none"), remedy)

    # What a study depends on

    def fingerprint(self) -> Values:
        """Return what a study depends on: key, program, and hashes of files of the template."""
        if self.by_people:
            return {"key": self.key}
        outputs = {}
        for name, output in self._tested.items():  # expressions are computed anew where they change
            outputs[name] = asdict(output)
            del outputs[name]["unit"], outputs[name]["expression"]
        template = {}
        for path in sorted(filter(Path.is_file, self._template_files())):
            file = path.relative_to(self._template).as_posix()
            template[file] = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
        return {
            "key": self.key,
            "command": self.program.command,
            "inputs": {"files": [*self.program.files], "marks": self.program.marks},
            "template": template,
            "outputs": outputs,
        }

    def _template_files(self) -> Iterator[Path]:
        """Yield the files that each run copies."""
        if self.program.template:
            for folder, folders, files in os.walk(self._template, followlinks=True):
                folders[:] = [name for name in folders if name not in _LEFT_OUT]
                for name in files:
                    if name not in _LEFT_OUT:
                        yield Path(folder, name)

    # A run

    @property
    def _template(self) -> Path:
        return Path(self.base, self.program.template)

    def run(self, values: Entries, *, keep: bool = False) -> ProgramRun:
        """Run the program for one design.

        Args:
            values: The value of each variable by name; of a noisy problem also the ``seed``, 1
                unless given.
            keep: Keep the folder, whatever the program's ``keep`` says.

        Raises:
            OSError: The folder cannot be made.
        """
        if self.noisy:
            values = {"seed": 1, **values}
        folder = self.base / self.program.folder
        folder.mkdir(parents=True, exist_ok=True)
        run = ProgramRun(Path(tempfile.mkdtemp(prefix="design-", dir=folder)))
        began = time.monotonic()
        try:
            self._fill_template(run, values)
            self.program.run(run.words, run.folder)
            self._read(run, values)
        except (ProgramError, OSError, ValueError) as error:  # the template may have changed
            run.flaws.append(str(error))
        if run.flaws and self._listing.file:
            with suppress(*_UNREADABLE):
                first = replace(self._listing, row=self._listing.row or 0)
                run.flaws[0] = f"{first.cell(run.folder)}; {run.flaws[0]}"
        run.seconds = time.monotonic() - began
        keep = keep or self.program.keep == "all"
        if keep or (run.flaws and self.program.keep == "failed"):
            text = json.dumps({**values, **run.outputs}, indent=1, default=str)
            with suppress(OSError):  # the disk may be full, which is the flaw already
                (run.folder / "design.json").write_text(text, encoding="utf-8")
        else:
            shutil.rmtree(run.folder, ignore_errors=True)
        return run

    def _fill_template(self, run: ProgramRun, values: Entries) -> None:
        """Copy the template into the folder of a run and write values for its placeholders.

        Outputs of another run that lie in the template are no outputs of this one.
        """
        if self.program.template:
            left_out = shutil.ignore_patterns(*_LEFT_OUT)
            shutil.copytree(
                self._template,
                run.folder,
                dirs_exist_ok=True,
                ignore=left_out,
                ignore_dangling_symlinks=True,  # editors leave such links for open files
            )
        for output in self._read_files:
            if output.file:
                (run.folder / output.file).unlink(missing_ok=True)
        for file in self.program.files:
            path = run.folder / file
            text = text_of(path)
            filled = self._placeholders.fill(file, text, values)
            lines = zip(text.split("\n"), filled.split("\n"), strict=False)
            for number, (line, new) in enumerate(lines, 1):
                if new != line:
                    run.filled.append(f"{file}, line {number}: {new.strip()}")
            path.write_bytes(filled.encode(errors="surrogateescape"))
        for word in shlex.split(self.program.command):
            run.words.append(self._placeholders.fill("command", word, values))

    def _read(self, run: ProgramRun, values: Entries) -> None:
        """Read or compute the outputs in their order; what cannot be read is a flaw."""
        columns = {name: np.array([value]) for name, value in values.items()}
        for name, output in self.outputs.items():
            try:
                if output.expression:
                    expression = self.known_expressions[name]
                    if not columns.keys() >= {*expression.columns}:
                        continue  # an output above is missing, which is the flaw
                    value = float(expression.values(columns)[0])
                else:
                    value = output.read(run.folder)
                if not math.isfinite(value):
                    raise ProgramError(f"it is {value}")
            except _UNREADABLE as error:
                run.flaws.append(f"output {name}: {error}")
                continue
            run.outputs[name] = value
            columns[name] = np.array([value])

    def values(self, design: Entries) -> Entries:
        """Return the outputs of a design; see :class:`NamedProblem`."""
        require_model(self)
        run = self.run(design)
        if run.flaws:
            reason = run.flaws[0]
            if run.folder.exists():
                reason += f"; see {run.folder}"
            raise EvaluationError(dict(design), reason)
        return run.outputs

    # Outputs of stored tests

    def computed(self, columns: Entries) -> Values:
        """Return the outputs that are expressions, by name.

        Args:
            columns: ``(n,)`` each, by name: variables, and outputs of the program.
        """
        outputs = dict.fromkeys(self.outputs, np.nan) | dict(columns)
        for name, expression in self.known_expressions.items():
            outputs[name] = expression.values(outputs)
        return {name: outputs[name] for name in self.known_expressions}

    def completed(self, columns: Entries) -> Values:
        """Return outputs of tests that were made before the outputs were what they are.

        Expressions are computed anew; other outputs that tests lack are read from the folders of
        their runs, where these are kept.

        Args:
            columns: ``(n,)`` each, by name: ``status``, variables, and outputs as far as they are
                known.
        """
        has_failed = columns["status"] == "failed"
        outputs = {}
        unknown = np.full(len(has_failed), np.nan)
        for name in self._tested:
            outputs[name] = np.array(columns.get(name, unknown))
        is_missing = np.isnan(np.array([*outputs.values()])).any(axis=0) & ~has_failed
        if is_missing.any() and not self.by_people:
            self._read_again(np.flatnonzero(is_missing), outputs, columns)
        outputs |= self.computed({**columns, **outputs})
        for values in outputs.values():
            values[has_failed] = np.nan
        return outputs

    def _read_again(self, rows: Rows, outputs: Values, columns: Entries) -> None:
        """Fill in outputs that some tests lack with the values in kept folders.

        Other studies, and repeats, may have left folders of the same design. That of a test is
        known by the outputs that the test has.
        """
        # The row of each test and the outputs that it has, by the texts of its design.
        tests = defaultdict(list)
        for row in rows.tolist():
            design = [str(columns[name].tolist()[row]) for name in self.variables]
            known = {name: v[row] for name, v in outputs.items() if not np.isnan(v[row])}
            tests[tuple(design)].append((row, known))
        for path in sorted((self.base / self.program.folder).glob("*/design.json")):
            with suppress(OSError, ValueError, KeyError):
                values = json.loads(path.read_text(encoding="utf-8"))
                design = [str(values[name]) for name in self.variables]
                for row, known in tests.get(tuple(design), ()):
                    kept = self._outputs_in(path.parent)
                    if known and known.items() <= kept.items():
                        for name, value in kept.items():
                            outputs[name][row] = value

    def _outputs_in(self, folder: Path) -> dict[str, float]:
        """Return the outputs that can be read from the folder of a run."""
        values = {}
        for name, output in self._tested.items():
            with suppress(*_UNREADABLE):
                values[name] = output.read(folder)
        return values


def text_of(path: Path) -> str:
    """Return the text of a file; bytes that are no UTF-8 are the same when it is written."""
    return path.read_bytes().decode(errors="surrogateescape")
