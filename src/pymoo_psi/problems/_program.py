"""An external program as a pymoo problem: values into its files, numbers out of them."""

from __future__ import annotations

import csv
import difflib
import hashlib
import json
import math
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi._validation import (
    Received,
    collection,
    invalid,
    known_name,
    mapping,
    positive_number,
)
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, EvaluationError
from pymoo_psi.problems._design_space import design_space
from pymoo_psi.problems._named import NamedProblem, section, sections
from pymoo_psi.table import Expression

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?")  # Fortran writes 1.5D+03
_PLACEHOLDER = re.compile(r"\{([^\W\d]\w*)(?::([^{}]*))?\}")


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
            one = not self.pattern or re.compile(self.pattern).groups == 1
        except re.error:
            one = False
        if not one:
            rule = r"a regular expression with one group, the number, such as 'mass = (\S+)'"
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
        cell = (self._value(text) if self.key else self._cell(text)).strip()
        if not _NUMBER.fullmatch(cell):
            raise RunError(f"{cell!r:.60} in {self.file} is no plain number")
        return float(cell.lower().replace("d", "e"))

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
        row = self.row or 0
        if not -len(cells) <= row < len(cells):
            which = "" if self.row is None else f" number {row}"
            raise RunError(f"{self.file} has no {what}{which}")
        return str(cells[row])

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


@dataclass(frozen=True)
class Program:
    """How a program is run: the section ``[program]``.

    Attributes:
        command: The program with its arguments, as in a shell but without one; ``{width}`` is
            replaced in it, too.
        template: Folder that is copied for each design; the command runs in the copy.
        files: Files of it in which ``{width}`` or ``{width:.6g}`` is replaced by a value.
        timeout: Seconds that it may run; None is any number.
        keep: Which folders are kept: of designs that ``"failed"``, ``"all"``, or ``"none"``.
        folder: Where the folders of the designs are made.
    """

    command: str = ""
    template: str = ""
    files: Sequence[str] = ()
    timeout: float | None = None
    keep: str = "failed"
    folder: str = "runs"

    def __post_init__(self) -> None:
        """Check the settings."""
        try:
            words = shlex.split(self.command)
        except ValueError:  # of quotation marks
            words = []
        if not words or {*words} & {"|", ">", "<", "&&", "||", ";", "&", "2>&1"}:
            rule = "one program with its arguments, quotation marks in pairs, without a shell"
            raise invalid("command", rule, self.command, 'or write a script, "sh run.sh"')
        known_name("keep", self.keep, ("failed", "all", "none"))
        if self.timeout is not None:
            positive_number("timeout", self.timeout)
        collection("files", self.files, "a list of files")
        if self.files and not self.template:
            raise invalid("files", "given with template, the folder they are in", self.files)

    def run(self, words: Sequence[str], folder: Path) -> None:
        """Run the command in a folder to its end; end it with all that it has started.

        Args:
            words: The command with all values in it.
            folder: Where it runs and what it prints is written.

        Raises:
            RunError: It takes too long, or ends with another exit code than 0.
        """
        out, err = folder / "stdout.txt", folder / "stderr.txt"
        program = shutil.which(words[0]) or str(folder / words[0])
        with out.open("wb") as stdout, err.open("wb") as stderr:
            process = subprocess.Popen(
                [program, *words[1:]],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=stderr,
                start_new_session=True,
            )
        try:
            code = process.wait(self.timeout)
        except subprocess.TimeoutExpired:
            raise RunError(f"timed out after {self.timeout:g} s") from None
        finally:
            with suppress(ProcessLookupError, PermissionError):
                if hasattr(os, "killpg"):
                    os.killpg(process.pid, signal.SIGKILL)
                process.kill()
            process.wait()
        if code != 0:
            lines = (text_of(err).strip() or text_of(out).strip() or "no message").splitlines()
            how = f"exit code {code}" if code > 0 else f"ended by {signal.Signals(-code).name}"
            last = lines[-1].encode(errors="surrogateescape").decode(errors="replace")
            raise RunError(f"{how}: {last:.120}")


@dataclass
class ProgramRun:
    """One run of a program.

    Attributes:
        folder: Where it ran.
        words: The command as it ran.
        written: The values written, by file and placeholder; other braces as they are.
        outputs: The numbers that were read.
        seconds: How long it took.
        flaw: What is wrong; empty if nothing is.
    """

    folder: Path
    words: list[str] = field(default_factory=list)
    written: dict[str, dict[str, str]] = field(default_factory=dict)
    outputs: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    flaw: str = ""


class ProgramProblem(NamedProblem):
    r"""An external program as a problem: a simulator with its input files.

    For each design a template folder is copied, values are written into its files, the command
    runs there, and numbers are read from the files that it leaves. Each design has a folder of its
    own, so that workers can run at the same time. A design whose program fails, hangs or leaves no
    number has failed, with the reason and the folder, which is kept.

    The arguments are the sections of the TOML file that :meth:`from_toml` reads.

    Args:
        variables: By name: ``{"bounds": [20, 60]}`` with ``"unit"``, ``"scale": "log"`` or
            ``"kind": "integer"``, or ``{"choices": ["S235", "S355"]}``; see :class:`Setting`.
        program: See :class:`Program`.
        outputs: By name; see :class:`Output`.
        objectives: ``{"minimize": [...], "maximize": [...]}``, names of outputs.
        limits: On outputs, such as ``{"stress": "<= 250", "f": ">= 1, <= 5"}``: constraints.
        requirements: Rules on variables by name, such as ``"height <= 4*width"``. PSI,
            ``SurrogatePSI`` and ``investigate`` never run a design that violates one; other
            algorithms take a :class:`Required` problem.
        name: Name of the problem.
        key: Version of the model, part of the study's key.
        base: Folder that relative paths start from.
        **kwargs: pymoo's own, such as ``elementwise_runner``.

    Attributes:
        names: The names of all columns by pymoo's.
        units: Units by name.
        maximize: Objectives whose sign is turned in ``F``.
        log: Variables of logarithmic scale.

    Raises:
        ArgumentValueError: A section does not fit, a file or the program is missing, or a variable
            is used nowhere.
        ArgumentTypeError: A value is of a type that it cannot have.

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
        variables: Mapping[str, Any],
        program: Mapping[str, Any],
        outputs: Mapping[str, Any],
        objectives: Mapping[str, Any],
        limits: Mapping[str, str] | None = None,
        requirements: Any = None,
        *,
        name: str = "program",
        key: str = "",
        base: str | PathLike[str] = ".",
        **kwargs: Any,
    ) -> None:
        self.base, self.key = Path(base).absolute(), str(key)
        self.program: Program = section("program", Program, program)
        self.outputs: dict[str, Output] = sections("outputs", Output, outputs)
        units = {n: output.unit for n, output in self.outputs.items() if output.unit}
        for word, goals in mapping("objectives", objectives, "minimize and maximize").items():
            known_name("an entry of objectives", word, ("minimize", "maximize"))
            for n in collection(f"objectives: {word}", goals, "a list of outputs"):
                known_name("an objective", n, self.outputs)
        most = [*objectives.get("maximize", ())]
        every = [*objectives.get("minimize", ()), *most]
        if not every or len({*every}) < len(every):
            raise invalid("objectives", "outputs named once, one or more", every)
        for n in limits or ():
            remedy = "of variables there are bounds, and requirements"
            known_name("what is limited", n, self.outputs, remedy)
        super().__init__(
            variables, every, most, limits, requirements, units=units, name=str(name), **kwargs
        )
        if both := self.variables.keys() & self.outputs.keys():
            raise invalid("the name of an output", "unlike those of variables", min(both))
        self._check_files()

    @classmethod
    def from_toml(cls, path: str | PathLike[str], **kwargs: Any) -> ProgramProblem:
        """Return the problem that a TOML file describes; its paths start from the file's folder.

        ``pymoo-psi solve --new bracket.toml`` writes a commented example.

        Args:
            path: The file.
            **kwargs: pymoo's own, such as ``elementwise_runner``.

        Raises:
            ArgumentValueError: It is no TOML, or what it says does not fit; see the class.
            OSError: The file cannot be opened.
        """
        path = Path(path)
        words = ("variables", "program", "outputs", "objectives", "limits", "requirements")
        try:
            sections = tomllib.loads(path.read_text(encoding="utf-8"))
            for word in sections:
                known_name("a section", word, (*words, "name", "key"))
            for word in words[:4]:
                mapping(f"[{word}]", sections.get(word), "names to settings")
            return cls(**sections, base=path.parent, **kwargs)
        except (ValueError, ArgumentTypeError) as error:  # tomllib's own is a ValueError
            remedy = "; between '…' it stays as it is" if "Unescaped" in str(error) else ""
            raise ArgumentValueError(f"{path}: {error}{remedy}") from error

    def fingerprint(self) -> dict[str, Any]:
        """Return what a study depends on: key, command, and a hash of the template and outputs."""
        outputs = {n: asdict(output) for n, output in self.outputs.items()}
        content = hashlib.sha256(json.dumps([outputs, [*self.program.files]]).encode())
        for path in sorted(self._template.rglob("*")) if self.program.template else ():
            inside = path.relative_to(self._template)
            # A run copies all of it, too. Editors, systems and Python hide what they keep there.
            hidden = any(part[0] == "." or part == "__pycache__" for part in inside.parts)
            if path.is_file() and not hidden:
                content.update(inside.as_posix().encode())
                content.update(path.read_bytes())
        known = {"key": self.key, "command": self.program.command}
        return known | {"template and outputs": content.hexdigest()[:16]}

    def run(self, values: Mapping[str, Any], *, keep: bool = False) -> ProgramRun:
        """Run the program for one design.

        Args:
            values: The value of each variable by name.
            keep: Keep the folder, whatever the program's ``keep`` says.

        Raises:
            OSError: The folder cannot be made.
        """
        folder = self.base / self.program.folder
        folder.mkdir(parents=True, exist_ok=True)
        prefix = re.sub(r"\W+", "-", f"{self._name}-")
        run = ProgramRun(Path(tempfile.mkdtemp(prefix=prefix, dir=folder)))
        began = time.monotonic()
        try:
            if self.program.template:
                shutil.copytree(self._template, run.folder, dirs_exist_ok=True)
            for file in self.program.files:
                written = run.written.setdefault(file, {})
                text = filled(text_of(run.folder / file), values, written)
                (run.folder / file).write_bytes(text.encode(errors="surrogateescape"))
            run.words = [filled(w, values, {}) for w in shlex.split(self.program.command)]
            self.program.run(run.words, run.folder)
            self._read(run, values)
        except (RunError, OSError) as error:
            run.flaw = str(error)
        run.seconds = time.monotonic() - began
        if keep or self.program.keep in ({"failed", "all"} if run.flaw else {"all"}):
            text = json.dumps({**values, **run.outputs}, indent=1, default=str)
            with suppress(OSError):  # of a full disk, which is the flaw already
                (run.folder / "design.json").write_text(text, encoding="utf-8")
        else:
            shutil.rmtree(run.folder, ignore_errors=True)
        return run

    @property
    def _template(self) -> Path:
        return Path(self.base, self.program.template)

    def _check_files(self) -> None:
        """Refuse before the first run what would make each run fail or have no effect."""
        program, template = self.program, self._template
        if program.template:
            if not template.is_dir():
                raise invalid("template", f"a folder in {self.base}", program.template)
            if (self.base / program.folder).resolve().is_relative_to(template.resolve()):
                raise invalid("folder", "outside of the template, which is copied", program.folder)
        word, texts = shlex.split(program.command)[0], {"the command": program.command}
        if not shutil.which(word) and not (program.template and (template / word).is_file()):
            rule = "a program that is on PATH or in the template"
            raise invalid("command", rule, word, "install it, or give its whole path")
        for file in program.files:
            if not (template / file).is_file():
                raise invalid("files", f"files in the folder {program.template}", file)
            texts[f"the file {file}"] = text_of(template / file)
        used: set[str] = set()
        known = [*self.variables]
        for n, output in self.outputs.items():
            used |= {known_name(f"a name in the expression of {n}", m, known) for m in output.names}
            known.append(n)
        space = design_space(self)
        lowest = space.matrix(np.zeros((1, len(space.searched))))[0].tolist()
        values = dict(zip(self.variables, lowest, strict=True))
        for where, text in texts.items():
            try:
                filled(text, values, {})
            except ValueError as error:
                rule = "with formats that fit, such as {width:.6g}"
                raise invalid(f"a placeholder in {where}", rule, Received(error)) from None
            for name, _ in _PLACEHOLDER.findall(text):
                near = difflib.get_close_matches(name, self.variables, n=1, cutoff=0.8)
                if name not in self.variables and near:  # other braces stay as they are
                    rule = f"{{{near[0]}}}, or unlike a variable"
                    raise invalid(f"the placeholder in {where}", rule, f"{{{name}}}")
                used.add(name)
        for n in self.variables:
            if n not in used:
                rule = "in the command, in one of files or in an expression"
                remedy = f"write {{{n}}} where its value belongs"
                raise invalid(f"the variable {n}", rule, Received("in none"), remedy)

    def _read(self, run: ProgramRun, values: Mapping[str, Any]) -> None:
        """Read the outputs, or compute them, in their order; all that can be read is there.

        Raises:
            RunError: Some cannot be read.
        """
        columns, wrong = {n: np.array([value]) for n, value in values.items()}, []
        for n, output in self.outputs.items():
            try:
                if not output.expression:
                    value = output.read(run.folder)
                elif {*output.names} <= columns.keys():
                    value = float(Expression.of(output.expression).values(columns)[0])
                else:  # what it is computed from is wrong already
                    continue
                if not math.isfinite(value):
                    raise RunError(f"it is {value}")
                run.outputs[n], columns[n] = value, np.array([value])
            except RunError as error:
                wrong.append(f"output {n}: {error}")
        if wrong:
            raise RunError("; ".join(wrong))

    @property
    def known_expressions(self) -> dict[str, Output]:
        """The outputs that are computed by expressions, by name."""
        return {name: output for name, output in self.outputs.items() if output.expression}

    def computed(self, columns: Mapping[str, Any]) -> dict[int, Any]:
        """Return the objectives and constraints that are expressions, by their place among all.

        Args:
            columns: ``(n,)`` each, by name: variables, and outputs of the program.
        """
        found = dict.fromkeys(self.outputs, np.nan) | dict(columns)
        for n, output in self.outputs.items():
            if output.expression:
                found[n] = Expression.of(output.expression).values(found)
        F, G = self.objectives_and_constraints(found)
        names = [*self.objectives, *(n for n, *_ in self.limits)]
        each = enumerate(zip(names, F + G, strict=True))
        return {j: values for j, (n, values) in each if self.outputs[n].expression}

    def values(self, design: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the outputs of a design; see :class:`NamedProblem`."""
        run = self.run(design)
        if run.flaw:
            where = f"; see {run.folder}" if run.folder.exists() else ""
            raise EvaluationError(dict(design), run.flaw + where)
        return run.outputs


def filled(text: str, values: Mapping[str, Any], written: dict[str, str]) -> str:
    """Return a text with values for placeholders, and note them in ``written``."""

    def value(found: re.Match[str]) -> str:
        name, form = found.groups("")
        text = format(values[name], form) if name in values else found[0]
        return written.setdefault(found[0], text)

    return _PLACEHOLDER.sub(value, text)


def text_of(path: Path) -> str:
    """Return the text of a file; bytes that are no UTF-8 pass through it unchanged."""
    return path.read_bytes().decode(errors="surrogateescape")
