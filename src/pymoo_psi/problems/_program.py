"""An external program as a pymoo problem, with values in its input files and numbers as outputs.

A :class:`ProgramProblem` checks its sections before any run, has a fingerprint for studies, runs
the program in a folder for each design, and completes the outputs of stored tests.
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
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Choice, Real

from pymoo_psi._validation import (
    Entries,
    FilePath,
    Mask,
    Received,
    Values,
    boolean,
    invalid,
    known_names,
)
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, EvaluationError
from pymoo_psi.problems._pymoo import OF_A_MODEL, numbered, require_known_keywords
from pymoo_psi.problems._requirements import requirements_of
from pymoo_psi.problems._settings import (
    Output,
    Placeholders,
    Program,
    Setting,
    expressions_of,
    limits_on_outputs,
    objectives_of,
    outputs_of,
    section,
    settings_of,
)
from pymoo_psi.problems._wrapped import has_same_values, require_model, within_same_columns
from pymoo_psi.table import Limit, Schema, unit_texts

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# Python, git and macOS leave these in a template; they are neither copied nor part of the model.
_LEFT_OUT = ("__pycache__", ".git", ".DS_Store")
_NAME = re.compile(r"[^\W\d]\w*")
_UNREADABLE = (OSError, ValueError, LookupError)  # what reading an output raises


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


class ProgramProblem(ElementwiseProblem):
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
        ArgumentValueError: A section cannot be used, the program is missing, or a variable is used
            nowhere.
        ArgumentTypeError: A value has the wrong type.
        OSError: A file of the template is missing.

    Example:
        >>> problem = ProgramProblem(
        ...     variables={"width": {"bounds": [20, 60], "unit": "mm"}},
        ...     program={"command": "echo area = {width}", "keep": "none"},
        ...     outputs={"area": {"file": "stdout.txt", "pattern": r"area = (\S+)"}},
        ...     objectives={"minimize": ["area"]})
        >>> problem.run({"width": 25}).outputs
        {'area': 25.0}
    """

    has_named_outputs = True  # in one study, other outputs may become objectives and limits

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
        require_known_keywords("ProgramProblem", ElementwiseProblem, kwargs, taken=OF_A_MODEL)
        self.base = Path(base).absolute()
        self.key = str(key)
        self.noisy = boolean("noisy", noisy)
        self.by_people = program is None
        self._name = str(name)

        settings = settings_of(variables)
        self.variables = {name: setting.variable for name, setting in settings.items()}
        self.log = [name for name, setting in settings.items() if setting.scale == "log"]
        self.outputs = outputs_of(outputs, self.variables, self.by_people)
        self.known_expressions = expressions_of(self.outputs, self.variables)
        self.units = unit_texts(
            {name: entry.unit for name, entry in (settings | self.outputs).items()}
        )
        minimize, self.maximize = objectives_of(objectives, self.outputs)
        self.objectives = minimize + self.maximize
        self.limits = limits_on_outputs(limits, self.outputs)
        self.requirements = requirements
        self._required = requirements_of(requirements, [*self.variables])
        if program is not None:
            self._prepare(program, settings)

        limit_texts = [limit.written(name) for name, limit in self.limits.items()]
        self.names = numbered("f", self.objectives) | numbered("g", limit_texts)
        sizes: Values = {"n_obj": len(self.objectives), "n_ieq_constr": len(self.limits)}
        if all(isinstance(variable, Real) for variable in self.variables.values()):
            # pymoo takes such variables as a vector, without names.
            self.names |= numbered("x", self.variables)
            lower, upper = np.transpose([variable.bounds for variable in self.variables.values()])
            sizes |= {"n_var": len(lower), "xl": lower, "xu": upper}
        else:
            sizes["vars"] = self.variables
        super().__init__(**sizes, **kwargs)

    @classmethod
    def from_toml(cls, path: FilePath, **kwargs: Any) -> ProgramProblem:
        """Return the problem that a TOML file describes; its paths start from the file's folder.

        ``pymoo-psi solve --new bracket.toml`` writes a commented example.

        Args:
            path: The file.
            **kwargs: pymoo's own, such as ``elementwise_runner``.

        Raises:
            ArgumentValueError: It is no TOML, or a section cannot be used; see the class.
            OSError: The file, or one of the template, cannot be opened.
        """
        path = Path(path)
        needed: Values = dict.fromkeys(("variables", "program", "outputs", "objectives"))
        further = ("limits", "requirements", "name", "key", "noisy")
        try:
            sections = tomllib.loads(path.read_text(encoding="utf-8-sig"))
            known_names("a section", sections, (*needed, *further))
            return cls(**needed | sections, base=path.parent, **kwargs)
        except (ValueError, ArgumentTypeError) as error:  # tomllib's own is a ValueError
            message = f"{path}: {error}"
            if isinstance(error, tomllib.TOMLDecodeError):
                message += "; a text with \\ stands between '…', a name such as \"Höhe\" in quotes"
            raise ArgumentValueError(message) from error

    # What is checked before any run

    def _prepare(self, program: Entries, settings: Mapping[str, Setting]) -> None:
        """Read the section of the program, and check all that can be checked without a run."""
        self.program: Program = section("program", Program, program)
        listing = {"row": 0} | self.program.error  # the first match, unless there is a row
        self._listing: Output = section("program: error", Output, listing)
        self._placeholders = Placeholders(self.program.marks, settings)
        self._check_folders()
        self._check_command()
        self._check_names()
        self._check_placeholders()

    def _check_folders(self) -> None:
        """Refuse a missing template, and runs within the template."""
        program = self.program
        if not program.template:
            return
        template = self._template
        if not template.is_dir():
            raise invalid(
                "template",
                f"a folder in {self.base}",
                program.template,
                "make it, with the files that the program needs; or leave template out",
            )
        if (self.base / program.folder).resolve().is_relative_to(template.resolve()):
            raise invalid("folder", "outside of the template, which is copied", program.folder)

    def _check_command(self) -> None:
        """Refuse a program that is nowhere."""
        word = shlex.split(self.program.command)[0]
        in_template = bool(self.program.template) and (self._template / word).is_file()
        if not shutil.which(word) and not in_template:
            raise invalid(
                "command",
                "a program that is on PATH or in the template",
                word,
                "install it, or give its whole path",
            )

    def _check_names(self) -> None:
        """Refuse names of variables that a placeholder cannot have."""
        for name in self.variables:
            if not _NAME.fullmatch(name):
                raise invalid(
                    "the name of a variable",
                    "letters, digits and _ that do not begin with a digit",
                    name,
                    "rename it, such as t_web for t-web",
                )

    def _check_placeholders(self) -> None:
        """Refuse what could be a placeholder and is none, and variables that are used nowhere.

        A placeholder for a seed makes a model noisy.
        """
        values: Values = {"seed": 1}
        for name, variable in self.variables.items():
            if isinstance(variable, Choice):
                values[name] = variable.options[0]
            else:
                # No round number, which a format with too few digits would not change.
                values[name] = variable.vtype(variable.lb + 0.618034 * (variable.ub - variable.lb))
        texts = [("command", self.program.command)]
        texts += [(file, text_of(self._template / file)) for file in self.program.files]
        used = set()
        for where, text in texts:
            self._placeholders.fill(where, text, values)
            used |= self._placeholders.names_in(text)
        if "seed" in used and "seed" not in self.variables:
            self.noisy = True
        for expression in self.known_expressions.values():
            used.update(expression.columns)
        for name in self.variables:
            if name not in used:
                placeholder = self._placeholders.marks.replace("name", name)
                raise invalid(
                    f"the variable {name}",
                    "in the command, in one of files or in an expression",
                    Received("in none"),
                    f"write {placeholder} where its value belongs, in UTF-8",
                )

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

    def name(self) -> str:
        """Return the name of the problem."""
        return self._name

    @property
    def _tested(self) -> dict[str, Output]:
        """The outputs that are read or measured; the others are expressions of them."""
        return {name: output for name, output in self.outputs.items() if not output.expression}

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
            self._copy_template(run.folder)
            inputs = self._fill_files(run, values)
            for word in shlex.split(self.program.command):
                run.words.append(self._placeholders.fill("command", word, values))
            self.program.run(run.words, run.folder)
            self._read(run, values, inputs)
        except (RuntimeError, OSError, ValueError) as error:  # the template may have changed
            run.flaws.append(str(error))
        if run.flaws and self._listing.file:
            with suppress(*_UNREADABLE):
                run.flaws[0] = f"{self._listing.cell(run.folder)}; {run.flaws[0]}"
        run.seconds = time.monotonic() - began
        if keep or self.program.keep == "all" or (run.flaws and self.program.keep == "failed"):
            text = json.dumps({**values, **run.outputs}, indent=1, default=str)
            (run.folder / "design.json").write_text(text, encoding="utf-8")
        else:
            shutil.rmtree(run.folder, ignore_errors=True)
        return run

    def _copy_template(self, folder: Path) -> None:
        """Copy the template into the folder of a run, without outputs of other runs.

        A file with placeholders stays, although outputs may be read from it: a program may write
        its results into its input.
        """
        if self.program.template:
            left_out = shutil.ignore_patterns(*_LEFT_OUT)
            shutil.copytree(
                self._template,
                folder,
                dirs_exist_ok=True,
                ignore=left_out,
                ignore_dangling_symlinks=True,  # editors leave such links for open files
            )
        inputs = {Path(file) for file in self.program.files}
        for output in (*self.outputs.values(), self._listing):
            if output.file and Path(output.file) not in inputs:
                (folder / output.file).unlink(missing_ok=True)

    def _fill_files(self, run: ProgramRun, values: Entries) -> dict[Path, str]:
        """Write values for the placeholders in files; return the texts of these files."""
        texts = {}
        for file in self.program.files:
            path = run.folder / file
            text = text_of(path)
            filled = self._placeholders.fill(file, text, values)
            path.write_bytes(filled.encode(errors="surrogateescape"))
            texts[Path(file)] = filled
            lines = zip(text.split("\n"), filled.split("\n"), strict=False)
            for number, (line, new) in enumerate(lines, 1):
                if new != line:
                    run.filled.append(f"{file}, line {number}: {new.strip()}")
        return texts

    def _read(self, run: ProgramRun, values: Entries, inputs: Mapping[Path, str]) -> None:
        """Read or compute the outputs in their order; what cannot be read is a flaw.

        Args:
            run: The run.
            values: The value of each variable.
            inputs: The texts of files before the run: results in them may be those of another run.
        """
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
                    file = Path(output.file)
                    if file in inputs and inputs[file] == text_of(run.folder / file):
                        raise ValueError(f"the program left {output.file} as it was")
                if not math.isfinite(value):
                    raise ValueError(f"it is {value}")
            except _UNREADABLE as error:
                run.flaws.append(f"output {name}: {error}")
                continue
            run.outputs[name] = value
            columns[name] = np.array([value])

    def _evaluate(self, x: Any, out: Values, *args: Any, **kwargs: Any) -> None:
        require_model(self)
        design = dict(x if isinstance(x, Mapping) else zip(self.variables, x, strict=True))
        self._require_met(design)
        if "seed" in kwargs:
            design["seed"] = kwargs["seed"]
        run = self.run(design)
        if run.flaws:
            reason = run.flaws[0]
            if run.folder.exists():
                reason += f"; see {run.folder}"
            raise EvaluationError(design, reason)
        outputs = run.outputs
        out["G"] = [limit.violation(outputs[name]) for name, limit in self.limits.items()]
        out["F"] = []
        for name in self.objectives:
            value = outputs.pop(name)
            out["F"].append(-value if name in self.maximize else value)
        out.update(outputs)

    def _require_met(self, design: Entries) -> None:
        """Refuse to run a design that violates a requirement, which other algorithms propose."""
        columns = {name: np.array([design[name]]) for name in self.variables}
        for rule in self._required:
            if rule.violation(columns)[0] > 0:
                remedy = "give the algorithm Required(problem)"
                raise EvaluationError(design, f"it violates the requirement {rule.name}; {remedy}")

    # Outputs of stored tests

    def has_objectives_of(self, schema: Schema) -> bool:
        """Whether the objectives of tests have the names and directions of the problem."""
        names = tuple(self.objectives)
        return schema.objectives == names and {*schema.maximize} == {*self.maximize}

    def completed(self, columns: Entries) -> Values:
        """Return outputs of tests that were made before the outputs were what they are.

        Expressions are computed anew; other outputs that tests lack are read from the folders of
        their runs, where these are kept.

        Args:
            columns: ``(n,)`` each, by name: ``status``, variables, and outputs as far as they are
                known.
        """
        has_failed = columns["status"] == "failed"
        unknown = np.full(len(has_failed), np.nan)
        outputs = {name: np.array(columns.get(name, unknown)) for name in self._tested}
        is_missing = np.isnan(np.array([*outputs.values()])).any(axis=0) & ~has_failed
        if is_missing.any() and not self.by_people:
            self._read_again(is_missing, outputs, columns)
        for name, expression in self.known_expressions.items():
            outputs[name] = expression.values({**columns, **outputs})
        for values in outputs.values():
            values[has_failed] = np.nan
        return outputs

    def _read_again(self, is_missing: Mask, outputs: Values, columns: Entries) -> None:
        """Fill in outputs that some tests lack with the values in kept folders.

        Other studies, and repeats, may have left folders of the same design. That of a test is
        known by the outputs that the test has.
        """
        variables = [columns[name].tolist() for name in self.variables]
        rows = defaultdict(list)  # by the texts of a design
        for row, design in enumerate(zip(*variables, strict=True)):
            if is_missing[row]:
                rows[tuple(map(str, design))].append(row)
        for path in sorted((self.base / self.program.folder).glob("*/design.json")):
            with suppress(OSError, ValueError, KeyError):
                values = json.loads(path.read_text(encoding="utf-8"))
                design = tuple(str(values[name]) for name in self.variables)
                for row in rows.get(design, ()):
                    kept = self._outputs_in(path.parent)
                    known = {name: v[row] for name, v in outputs.items() if not np.isnan(v[row])}
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


def known_limits(problem: Any, schema: Schema) -> dict[str, Limit]:
    """Return the limits on outputs that are the first constraints of a problem.

    A table shows them as limits, which can be changed without a test. If the columns of its tests
    have other names or directions than the outputs, they stay constraints.
    """
    while has_same_values(problem) or within_same_columns(problem) is not problem:
        problem = problem.wrapped
    if isinstance(problem, ProgramProblem) and problem.has_objectives_of(schema):
        return problem.limits
    return {}


def text_of(path: Path) -> str:
    """Return the text of a file; bytes that are no UTF-8 are the same when it is written."""
    return path.read_bytes().decode(errors="surrogateescape")
