"""Designs from any file: what its columns are, their numbers, and what may be said of both."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import counted, integer, invalid, known_name
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError
from pymoo_psi.pareto._ranking import RANKING_COLUMNS
from pymoo_psi.table._cells import Column, Marks, is_blank, read_columns
from pymoo_psi.table._designs import INT64, alike
from pymoo_psi.table._exchange import table_of
from pymoo_psi.table._expression import Expression
from pymoo_psi.table._files import MARK, comment_text, read_csv, read_parquet
from pymoo_psi.table._formulation import Formulation, computed_columns, distinct
from pymoo_psi.table._layout import ORIGIN, RESERVED, Layout, is_writable
from pymoo_psi.table._limits import bounds_of, within
from pymoo_psi.table._sheet import (
    Sheet,
    UnfitError,
    decoded,
    in_a_line,
    sheet_of_text,
    sheet_of_workbook,
)
from pymoo_psi.table._summaries import require_designs
from pymoo_psi.table._table import STATUSES, TestTable, read_tests

if TYPE_CHECKING:
    import pandas as pd

# Begins the comment above a CSV that says what its columns are, see `roles_head`.
_ROLES_MARK = "pymoo_psi_designs"
# Names of columns that name designs, and of those that number the rows of a file, which names of
# its designs say better. Not "no", which is also an exhaust gas.
_NAMING = ("test_point", "number", "label", "name", "id", "design")
_LABELS = (*_NAMING, "row", "index", "nr", "nr.", "no.", "nummer", "#")
# 18 digits are below 2^63, so that a column of them is one of int64 without a further check.
_WHOLE = re.compile(r"[+-]?\d{1,18}")
_CODE = re.compile(r"0\d+")  # whose zeros belong to it
_TOLD = 6  # rows that a line names
_ZIP = b"PK\x03\x04"  # how a local file in ZIP begins, such as an .xlsx
_UNNAMED = re.compile(r"|Unnamed: \d+")  # as data frames write, and read, their row labels


@dataclass(frozen=True)
class Roles:
    """Which columns are what; a column without a role is carried along.

    Attributes:
        objectives: Names of the columns with objectives.
        variables: Names of the columns with design variables.
        label: Name of the column with the designs' numbers or names; ``None`` if there is none.
        maximize: The objectives of which more is better, and other columns of which it would be if
            they were objectives: a sense must not be lost while a column is none.
        outputs: Names of columns with what else a model gave.
    """

    objectives: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    label: str | None = None
    maximize: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()


def _guessed_roles(
    names: Sequence[str], holds_numbers: Callable[[str], bool]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the objectives and variables of a file that does not tell them.

    With columns f1, f2, … these are the objectives, and x1, x2, … (or u1, u2, …) the variables.
    Otherwise all columns of numbers are objectives. Numbers and names of designs never are, nor
    are the columns that a ranking adds.

    Args:
        names: Names of all columns.
        holds_numbers: Whether a column is one of numbers.
    """
    labels = _labels(names)
    free = [name for name in names if name not in labels and name not in RANKING_COLUMNS]
    numbered = [name for name in free if re.fullmatch(r"f\d+", name)]
    variables = [name for name in free if re.fullmatch(r"[xu]\d+", name)]
    # One column called f1 without any x1 is no numbering, and says nothing about the others.
    if not ("f1" in numbered and (variables or len(numbered) > 1)):
        numbered, variables = [name for name in free if holds_numbers(name)], []
    return tuple(numbered), tuple(variables)


def roles_head(
    names: Sequence[str],
    holds_numbers: Callable[[str], bool],
    roles: Roles,
    units: Mapping[str, str],
) -> dict[str, Any]:
    """Return what to write as JSON, a comment of one line, above a CSV; empty if needless.

    It is needed where the names of the columns do not tell the objectives, where one is to be
    maximised, or a column has a unit: so that the file ranks as what it was written from.

    Args:
        names: Names of all columns of the CSV.
        holds_numbers: Whether a column is one of numbers.
        roles: What the columns are.
        units: Units of columns by name.
    """
    guessed, _ = _guessed_roles(names, holds_numbers)
    if guessed == roles.objectives and not roles.maximize and not any(units.values()):
        return {}
    return {
        _ROLES_MARK: 1,
        "objectives": roles.objectives,
        "maximized": roles.maximize,
        "variables": roles.variables,
        "outputs": roles.outputs,
        "units": {name: unit for name, unit in units.items() if unit},
    }


def _labels(names: Collection[str]) -> list[str]:
    """Return the columns whose names say that they number or name designs, the likeliest first."""
    labels = [name for name in names if name.strip().lower() in _LABELS]
    # A file may have both id and test_point; the order of _LABELS decides, not that of the columns.
    labels.sort(key=lambda name: _LABELS.index(name.strip().lower()))
    return labels + [name for name in names if _UNNAMED.fullmatch(name)]


def design_ids(labels: Sequence[object], rows: Sequence[object] = ()) -> list[str]:
    """Return what designs are called: the label, with its row if several have it.

    Args:
        labels: ``(n,)`` labels.
        rows: ``(n,)`` rows; counted from 1 unless given.

    Example:
        >>> design_ids([7, "A", "A"])
        ['7', 'A #2', 'A #3']
    """
    texts = [str(label) for label in labels]
    count = Counter(texts)
    numbered = zip(texts, rows or range(1, len(texts) + 1), strict=True)
    return [text if count[text] == 1 else f"{text} #{row}" for text, row in numbered]


@dataclass(frozen=True, eq=False)
class DesignFile:
    r"""The designs of a file.

    Attributes:
        path: The file.
        columns: The n cells of each column by its name, n >= 1, with their numbers.
        rows: ``(n,)`` which row of the file each design is, from 1; rows that are left out count.
        lines: The line of the file on which each design ends; empty if it has no lines.
        known: The roles of the columns, where the file tells them.
        prototype: Rows of existing designs under the names of the columns, their index the
            designs' names; ``None`` if there are none.
        remarks: What a reader must know about the rows, in sentences.
        failed: How many designs that are left out failed, by reason.
        infeasible: How many designs that are left out violate constraints.
        origin: The designs that these are some of; ``None`` if none was left out.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder, "set.csv")
        ...     _ = path.write_text("id,cost,mass\nA,1.5,4\nB,2,1\n", encoding="utf-8")
        ...     file = read_designs(path)
        >>> file.names, file.label, file.roles().objectives
        (['id', 'cost', 'mass'], 'id', ('cost', 'mass'))
    """

    path: Path
    columns: Mapping[str, Column]
    rows: NDArray[np.intp]
    lines: Sequence[int] = ()
    known: Roles | None = None
    prototype: pd.DataFrame | None = None
    remarks: tuple[str, ...] = field(default=())
    failed: Mapping[str, int] = field(default_factory=dict)
    infeasible: int = 0
    origin: DesignFile | None = None

    def __repr__(self) -> str:
        """Return which file, and how many designs of which columns."""
        names = ", ".join(self.names)
        return f"DesignFile({str(self.path)!r}: {counted(len(self), 'design')}; {names})"

    def __len__(self) -> int:
        """Return the number of designs."""
        return len(next(iter(self.columns.values())).cells)

    @property
    def names(self) -> list[str]:
        """The names of the columns."""
        return list(self.columns)

    @property
    def cells(self) -> pd.DataFrame:
        """One row per design, every cell as it was written.

        Numbers that a program might read otherwise, such as ``1.250,5``, have a decimal point
        only. Cells of files whose cells have types keep these.
        """
        import pandas as pd

        texts = (any(isinstance(cell, str) for cell in c.cells) for c in self.columns.values())
        return pd.DataFrame(
            {
                name: np.fromiter(column.cells, object) if text else _plain(column)
                for (name, column), text in zip(self.columns.items(), texts, strict=True)
            }
        )

    @property
    def label(self) -> str | None:
        """The column with the designs' numbers or names.

        As its name tells. Where that only numbers rows, or none does, it is the first of the
        others, if it holds texts, each another: so people write lists, under "Variante" as under
        "Model".
        """
        labels = _labels(self.names)
        if labels and labels[0].strip().lower() in _NAMING:
            return labels[0]
        for name in [name for name in self.names if name not in labels][:1]:
            column = self.columns[name]
            texts = {cell for cell in column.cells if isinstance(cell, str) and not is_blank(cell)}
            certain = column.numbers is None and column.problem is None
            if certain and len(texts) == len(column.cells):
                return name
        return labels[0] if labels else None

    def called(self, label: str | None) -> list[str]:
        """``(n,)`` what sentences call the designs: "A", "test point 7", or by row of the file.

        As the decision page does: a label that is a text stands for itself, and one that several
        designs have has the row of the file behind it, whatever else is left out.
        """
        if not label:  # a column without a name numbers rows
            return [f"row {row}" for row in self.rows]
        whole, word = self.origin or self, label.replace("_", " ")
        ids = design_ids(_plain(whole.columns[label]).tolist(), whole.rows.tolist())
        of_row = dict(zip(whole.rows.tolist(), ids, strict=True))
        mine = [of_row[row] for row in self.rows.tolist()]
        return [f"{word} {t}" if re.fullmatch(r"\d+( #\d+)?", t) else t for t in mine]

    def roles(
        self, objectives: Sequence[str] | None = None, variables: Sequence[str] | None = None
    ) -> Roles:
        """Return what the columns are: as named, else as the file tells, else by their names.

        Args:
            objectives: Names of the columns with objectives, if they are named.
            variables: Names of the columns with design variables, likewise.

        Raises:
            ArgumentValueError: There is no such column, one is named twice, a column may hold
                numbers that cannot be read for certain, or there is but one column to take.
        """
        for argument, names in (("objectives", objectives), ("variables", variables)):
            self.require_columns(argument, names or ())
        # With the objectives named, no other column is asked for numbers: one that cannot be read
        # must not keep the named ones from being ranked.
        found = self.known
        if found is None:
            asked = self._holds_numbers if objectives is None else lambda name: False
            found = Roles(*_guessed_roles(self.names, asked), self.label)
        chosen = found.objectives if objectives is None else tuple(objectives)
        kept = found.variables if variables is None else tuple(variables)
        if variables is None:
            kept = tuple(name for name in kept if name not in chosen)
        if objectives is None:
            chosen = tuple(name for name in chosen if name not in kept)
            if not chosen:
                raise unfit(self.path, "no column holds numbers that can be objectives")
            # By one objective there is nothing to weigh, so the others were probably not read.
            if len(chosen) == 1 and self.known is None:
                what = f"{chosen[0]!r} is the only column that can be an objective"
                remedy = f"if you mean to rank by it alone, say --objectives {chosen[0]!r}"
                raise unfit(self.path, f"{what}; {remedy}")
        # Who names a label as objective or variable means it; it is then no label any more.
        label = None if found.label in {*chosen, *kept} else found.label
        # What a file tells of its objectives holds on when others are named.
        further = (*(found.objectives if self.known else ()), *found.outputs)
        others = tuple(name for name in further if name not in {*chosen, *kept})
        more = tuple(name for name in found.maximize if name in {*chosen, *others})
        return Roles(chosen, kept, label, more, others)

    def require_columns(self, argument: str, names: Sequence[str]) -> None:
        """Refuse names that are no columns, or are given twice.

        Raises:
            ArgumentValueError: There is such a name.
        """
        for name in names:
            known_name(argument, name, self.names, f"see {self.path}")
        if twice := [name for name, count in Counter(names).items() if count > 1]:
            raise unfit(self.path, f"{argument} names the column {twice[0]!r} twice")

    def told(self, roles: Roles) -> str:
        """Say in a line which columns were taken as objectives, in what, and which were not."""
        units = {name: self.columns[name].unit for name in roles.objectives}
        taken = [f"{name} (in {unit})" if unit else name for name, unit in units.items()]
        rest = [name or "(no name)" for name in self.names if name not in roles.objectives]
        left_out = f"; not as objectives: {', '.join(rest)}" if rest else ""
        line, first = f"Objectives: {', '.join(taken)}{left_out}", self.names[0]
        numbers = self.columns[first].numbers
        # Ranked by the number of the design, any other would be the best.
        if first not in units or numbers is None or len(numbers) < 3:
            return line
        counts = np.array_equal(numbers, numbers[0] + np.arange(len(numbers)))
        remedy = f"{first} counts the rows: if it only numbers designs, say --objectives"
        return f"{line}. {remedy}" if counts else line

    def under(self, asked: Formulation) -> DesignFile:
        """Return the designs within the limits of a formulation, with what it computes.

        Raises:
            ArgumentValueError: A column is not there or cannot be read, no design is left, or a
                constraint is to be relaxed, of which the file knows none.
        """
        if asked.relaxed:
            what = "it tells no constraints that could be relaxed"
            raise unfit(self.path, f"{what}; give the study, or the table of all its tests")
        known = [*self.names]
        if taken := [name for name in asked.computed if name in self.columns]:
            raise unfit(
                self.path, f"it has a column {taken[0]!r} already; call the new one otherwise"
            )
        needed = {*asked.limits}
        for computed, how in asked.computed.items():
            if callable(how):
                raise unfit(self.path, "columns of a file are computed by expressions only")
            used = Expression.of(how).columns
            for name in used:
                known_name(f"a column of {how!r:.60}", name, known, f"see {self.path}")
            needed.update(used)
            known.append(computed)
        numbers = {name: self.numbers(name) for name in self.names if name in needed}
        values = computed_columns(asked, numbers)
        roles = self.roles(() if asked.criteria else None)
        former = self.known or roles
        criteria = tuple(asked.criteria) or roles.objectives
        for name in (*criteria, *asked.limits):
            known_name("a column of the formulation", name, known, f"see {self.path}")
        for name in (*asked.maximize, *asked.minimize):
            known_name("maximize", name, criteria, "only criteria have a sense")
        more = {*former.maximize, *asked.maximize}.difference(asked.minimize)
        others = tuple(n for n in known if n not in criteria and n not in RESERVED)
        layout = Layout.of(0, criteria, outputs=others, maximize=[n for n in known if n in more])
        n = len(self)
        inside = within(bounds_of(asked.limits, layout), values.__getitem__, n)
        lacking = ~np.logical_and.reduce([np.isfinite(values[name]) for name in asked.limits])
        lost = [name for name in criteria if name in asked.computed]
        whole = [np.isfinite(values[name]) for name in lost]
        kept = np.flatnonzero(np.logical_and.reduce([inside, *whole]))
        if len(kept) == 0:
            what = f"none of its {n} designs keeps the limits and has the criteria asked for"
            raise unfit(self.path, what)
        reasons = {
            "beyond the limits": ~inside & ~lacking,
            "without a number in a limited column": ~inside & lacking,
            **{f"without a finite {name}": ~mask for name, mask in zip(lost, whole, strict=True)},
        }
        remarks = [
            f"{counted(int(mask.sum()), 'design')} {reason}: left out."
            for reason, mask in reasons.items()
            if mask.any()
        ]
        added = {name: _column(values[name].tolist()) for name in asked.computed}
        label = None if roles.label in criteria else roles.label
        variables = tuple(name for name in roles.variables if name not in criteria)
        further = (*former.objectives, *former.outputs, *asked.computed)
        outputs = tuple(dict.fromkeys(n for n in further if n not in criteria))
        senses = tuple(name for name in (*criteria, *outputs) if name in more)
        found = self.some(kept, {**self.columns, **added}, [*self.remarks, *remarks])
        return replace(found, known=Roles(criteria, variables, label, senses, outputs))

    def complete(self, names: Sequence[str]) -> DesignFile:
        """Return the designs with a finite number in each of some columns.

        Raises:
            ArgumentValueError: A column cannot be read, or no design is complete.
        """
        F = np.column_stack([self.numbers(name) for name in names])
        kept = np.flatnonzero(np.isfinite(F).all(axis=1))
        if len(kept) == len(F):
            return self
        if len(kept) == 0:
            raise unfit(self.path, f"none of its {len(F)} designs is complete")
        left = np.delete(self.rows, kept).tolist()
        told = ", ".join(map(str, left[:_TOLD])) + (", …" if len(left) > _TOLD else "")
        remark = f"{counted(len(left), 'incomplete design')} left out: row {told}."
        lacking = (~np.isfinite(np.delete(F, kept, axis=0))).argmax(axis=1).tolist()
        failed = Counter(self.failed) + Counter(f"no finite {names[j]}" for j in lacking)
        found = self.some(kept, self.columns, (*self.remarks, remark))
        return replace(found, failed=dict(failed))

    def some(
        self, kept: NDArray[np.intp], columns: Mapping[str, Column], remarks: Sequence[str]
    ) -> DesignFile:
        """Return some of the designs, with other columns and remarks."""
        # Numbers were read with all rows there: leaving some out cannot change how others are read.
        return replace(
            self,
            columns={name: _rows_of(column, kept) for name, column in columns.items()},
            rows=self.rows[kept],
            lines=[self.lines[i] for i in kept.tolist()] if self.lines else (),
            remarks=tuple(remarks),
            origin=self.origin or self,
        )

    def values(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Return the ``(n, m)`` values of columns, every digit as it is written.

        Raises:
            ArgumentValueError: A cell holds no finite number, or none that is certain.
        """
        F = np.column_stack([self.numbers(name) for name in names])
        for i, j in np.argwhere(~np.isfinite(F)):
            cell = self.columns[names[j]].cells[i]
            blank = is_blank(cell)
            what = "no number" if blank else str(cell).strip()
            remedy = "leave out such designs by --drop-incomplete"
            raise unfit(
                self.path, f"{self._where(i)} holds {what} in the column {names[j]!r}; {remedy}"
            )
        return F

    def frame(self, objectives: Sequence[str]) -> pd.DataFrame:
        """Return the designs with numbers and booleans for texts, wherever these are certain.

        Args:
            objectives: Names of the columns that must be complete.

        Raises:
            ArgumentValueError: A cell of an objective holds no finite number, or none that is
                certain.
        """
        import pandas as pd

        values = dict(zip(objectives, self.values(objectives).T, strict=True)) if objectives else {}
        plain = {name: values.get(name, _plain(column)) for name, column in self.columns.items()}
        return pd.DataFrame(plain)

    def as_tests(self, roles: Roles) -> TestTable:
        """Return the designs as a test table, each of them feasible, numbered by rows of the file.

        A variable that a design lacks is left out, and so is an output that is no number.

        Raises:
            ArgumentValueError: A cell of an objective holds no finite number, or a column has a
                name that no column of a test table can have.
        """
        F = self.values(roles.objectives)
        cells = {
            name: _plain(self.columns[name]).tolist()
            for name in roles.variables
            if not any(map(is_blank, self.columns[name].cells))
        }
        rows = zip(*cells.values(), strict=True) if cells else [()] * len(F)
        outputs = {
            name: numbers
            for name in roles.outputs
            if (numbers := self.columns[name].numbers) is not None
        }
        layout = Layout.of(
            list(cells),
            roles.objectives,
            outputs=list(outputs),
            maximize=[name for name in roles.maximize if name in {*roles.objectives, *outputs}],
            units={name: column.unit for name, column in self.columns.items()},
        )
        X = [list(row) for row in rows] if cells else np.empty((len(F), 0))
        return TestTable.of(self.rows, X, F * layout.sign, outputs=outputs, layout=layout)

    def _where(self, i: int) -> str:
        if i < 0:
            return "a row that is left out"
        return f"row {self.rows[i]}" + (f" (line {self.lines[i]})" if self.lines else "")

    def _holds_numbers(self, name: str) -> bool:
        """Say whether a column is one of numbers; refuse one of which that is not certain."""
        column = self.columns[name]
        if all(map(is_blank, column.cells)):
            remedy = "leave it out, or name the objectives by --objectives"
            raise unfit(self.path, f"its column {name!r} holds no number at all; {remedy}")
        self._require_read(name)
        return column.numbers is not None

    def _require_read(self, name: str) -> None:
        column = self.columns[name]
        if (problem := column.problem) is not None:
            line = self.lines[problem.row] if self.lines else self.rows[problem.row]
            remedy = problem.remedy.replace("{line}", str(line))
            cell = f"{self._where(problem.row)} holds {problem.cell!r:.40}"
            raise unfit(self.path, f"{cell} in the column {name!r}, {problem.what}; {remedy}")

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return the ``(n,)`` values of a column; NaN where it has none."""
        self._require_read(name)
        numbers = self.columns[name].numbers
        if numbers is None:
            raise unfit(self.path, f"its column {name!r} holds no number at all")
        return numbers


def unfit(path: object, what: str) -> ArgumentValueError:
    """Compose the error for a file that cannot be used; the caller raises it."""
    return ArgumentValueError(f"{path}: {what}")


def read_designs(
    path: str | PathLike[str],
    *,
    decimal: str | None = None,
    thousands: str | None = None,
    encoding: str | None = None,
    skip_rows: Collection[int | str] = (),
    sheet: str | None = None,
) -> DesignFile:
    r"""Read the designs of a file, which is read once, so that it may be a pipe.

    A number of which more than one reading is possible, such as ``1.250`` where nothing else tells
    whether points divide thousands, is refused when its column is asked for, with the option
    that settles it; so is a column that looks like numbers but cannot be read. The command line
    has the same options.

    Args:
        path: Text with commas, semicolons, tabs, bars or spaces between its cells, comments
            (``#``) above its header or none; a workbook (.xlsx); a test table, CSV or Parquet,
            a study, or a folder of studies, of which the feasible designs are taken; a ranking that
            ``pymoo-psi rank --out`` wrote as CSV or JSON; what the decision page exported.
        decimal: The decimal mark of its numbers, ``"."`` or ``","``; as they tell unless given.
        thousands: The mark between thousands, ``"."``, ``","``, ``" "`` or ``"'"``, likewise.
        encoding: Of a text; by its byte-order mark, or UTF-8, unless given.
        skip_rows: Numbers of lines to leave out, from 1, such as titles and lines of units;
            ``"hidden"`` among them for all hidden rows of a workbook.
        sheet: Name of the sheet of a workbook; the only one with cells unless given.

    Raises:
        OSError: The file cannot be opened.
        ArgumentValueError: It is no table of named columns with one design or more, or a row of it
            summarises others.
        ArgumentTypeError: ``skip_rows`` holds no numbers.
        StudyError: It is a database but no study, or a damaged one.
        PsiError: A package that reads such files is not installed.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder, "set.csv")
        ...     _ = path.write_text("id;cost;mass\nA;1,5;1.250\nB;2;980\n", encoding="utf-8")
        ...     file = read_designs(path, decimal=",")
        >>> file.values(["cost", "mass"]).tolist()
        [[1.5, 1250.0], [2.0, 980.0]]
    """
    found, missing = read_designs_or_tests(path, decimal, thousands, encoding, skip_rows, sheet)
    return found if isinstance(found, DesignFile) else designs_of_tests(path, found, missing)


def read_designs_or_tests(
    path: str | PathLike[str],
    decimal: str | None = None,
    thousands: str | None = None,
    encoding: str | None = None,
    skip_rows: Collection[int | str] = (),
    sheet: str | None = None,
) -> tuple[DesignFile | TestTable, str]:
    """Return the designs of a file, or all tests if it holds these, and which tests are missing.

    See :func:`read_designs`.
    """
    path, marks = Path(path), Marks(decimal, thousands)
    if isinstance(skip_rows, str) or not isinstance(skip_rows, Collection):
        raise ArgumentTypeError(f"skip_rows must be numbers of lines, got {skip_rows!r:.80}")
    skipped = frozenset(
        "hidden" if line == "hidden" else integer("a number in skip_rows", line, minimum=1)
        for line in skip_rows
    )
    if not isinstance(encoding, (str, type(None))):
        raise ArgumentTypeError(f"encoding must be the name of one, got {encoding!r:.80}")
    found, missing = (
        read_tests(path) if path.is_dir() else _content(path, marks, encoding, skipped, sheet)
    )
    if skipped and (isinstance(found, TestTable) or not found.lines):
        what = f"left out, as {path} is neither a text of designs nor a workbook"
        raise invalid("skip_rows", what, [*skipped])
    return found, missing


def _content(
    path: Path,
    marks: Marks,
    encoding: str | None,
    skipped: Collection[int | str],
    sheet: str | None,
) -> tuple[DesignFile | TestTable, str]:
    """Return what a file holds, by its content, and which tests are missing."""
    with path.open("rb") as opened:  # once: what a pipe has given it does not give again
        content = opened.read(16)  # as much as SQLite's mark
        if sheet is not None and not content.startswith(_ZIP):
            raise invalid("sheet", f"left out, as {path} is no workbook (.xlsx)", sheet)
        # SQLite opens files by name only, so a study, unlike the other files, cannot be a pipe.
        if content.startswith(b"SQLite format 3\0"):
            return read_tests(path)
        content += opened.read()
    # By content, not by suffix, which a pipe has not and people change. The marks are those of the
    # Parquet format, of ZIP, and of OLE compound files (.xls).
    try:
        if content.startswith(b"PAR1"):
            return table_of(*read_parquet(path, content), path, TestTable), ""
        if content.startswith(_ZIP):
            return _of_sheet(path, sheet_of_workbook(content, skipped, sheet), marks), ""
        if content.startswith(b"\xd0\xcf\x11\xe0"):
            what = "it is a workbook of old, or with a password"
            raise UnfitError(f"{what}; save it as .xlsx without one, or as CSV")
        text = decoded(content, encoding)
        first, end, rest = text.partition("\n")
        if MARK in first:
            return table_of(*read_csv(path, text), path, TestTable), ""
        if text.lstrip().startswith(("{", "[")):
            return _of_json(path, text, marks), ""
        told = _ROLES_MARK in first
        # The line stays, as lines are counted, but as an empty comment.
        cells = sheet_of_text(f"#{end}{rest}" if told else text, skipped)
        file = _of_sheet(path, cells, marks)
        return (_with_roles(file, first) if told else file), ""
    except UnfitError as error:
        raise unfit(path, str(error)) from None


def designs_of_tests(path: str | PathLike[str], table: TestTable, missing: str = "") -> DesignFile:
    """Return the feasible designs of a test table with finite criteria, and its prototype."""
    import pandas as pd

    layout, prototype = table.layout, table.prototype
    if not layout.objectives:
        raise unfit(path, "its tests have no criteria")
    feasible = np.flatnonzero(table.eligible())
    lost = table.numbers[table.status == "failed"].tolist()
    reasons = Counter(alike(table.reasons.get(number) or "no reason is known" for number in lost))
    if len(feasible) == 0:
        violated, names = table.violations()
        rejects = violated.sum(axis=0)
        # Without any that is violated, values of a criterion are not finite, or all tests failed.
        why = f"{names[rejects.argmax()]} rejects most: {rejects.max()}" if violated.any() else (
            f"no test has finite values of {', '.join(layout.objectives)}"
        )  # fmt: skip
        # As many as a criterion leaves that cannot be computed of any.
        why += f"; {len(lost)} failed: {reasons.most_common(1)[0][0]:.80}" if lost else ""
        raise unfit(path, f"none of its {len(table)} tests is feasible; {why}")
    rows = None
    if prototype is not None:
        cells = dict(zip(layout.objectives, prototype.f.tolist(), strict=True))
        cells |= dict(zip(layout.variables, prototype.x.tolist(), strict=True))
        rows = pd.DataFrame([cells], index=[prototype.name])
    n, others = len(feasible), len(table) - len(feasible)
    # Of tests with the same design the first stands for all, as in the table's own Pareto set.
    feasible = feasible[table.rows(feasible).repeats == 0]
    frame = table.rows(feasible).to_frame().reset_index()
    # Of feasible designs these say nothing; a ranking adds a pareto of its own.
    frame = frame.drop(columns=["status", "violated", "reason", "pareto"])
    columns = _in_units({str(n): _column(frame[n].tolist()) for n in frame.columns}, layout.units)
    remarks = [f"{missing}."] if missing else []
    if others:
        are = "is" if n == 1 else "are"
        remarks.append(f"{n} of {len(table)} tests {are} feasible; the others are left out.")
    if again := n - len(feasible):
        remarks.append(f"{again} of them tested a design once more, which counts once.")
    # The other column of their origin numbers the tests, as the label does: it is nothing to weigh.
    further = layout.outputs + (ORIGIN[:1] if layout.experiments else ())
    roles = Roles(layout.objectives, layout.variables, "test_point", layout.maximized, further)
    told = tuple(remarks)
    return DesignFile(
        Path(path), columns, feasible + 1, (), roles, rows, told, reasons, others - len(lost)
    )


def _of_sheet(path: Path, sheet: Sheet, marks: Marks) -> DesignFile:
    """Return the designs of a sheet, without those that it says are prototypes, or not feasible."""
    import pandas as pd

    columns, n = dict(sheet.columns), len(sheet.lines)
    status = columns.get("status", ["ok"] * n)
    # A column status of somebody else's, with other words in it, selects nothing.
    if not {*status} <= {*STATUSES}:
        status = ["ok"] * n
    reasons = zip(status, columns.get("reason", [""] * n), strict=True)
    lost = [str(why or "no reason is known") for how, why in reasons if how == "failed"]
    page = {"mark", *RANKING_COLUMNS[:-1]} <= {*columns}  # as it exports
    existing = np.array([page and cell == "prototype" for cell in columns.get("mark", [""] * n)])
    if page:
        del columns["mark"]
    feasible = np.array([cell == "ok" for cell in status])
    if not (feasible & ~existing).any():
        raise UnfitError(f"none of its {n} designs is feasible, or all are prototypes")
    # Before the numbers are read: a failed design may hold anything. With the prototypes: what is
    # certain of a column is so for all rows of it.
    taken = np.flatnonzero(feasible | existing)
    cells = {name: [column[i] for i in taken.tolist()] for name, column in columns.items()}
    whole = read_columns(cells, marks, sheet.divider, _labels(columns))
    kept, old = np.flatnonzero(~existing[taken]), np.flatnonzero(existing[taken])
    n = int((~feasible & ~existing).sum())
    left = (
        "1 design that is not feasible is" if n == 1 else f"{n} designs that are not feasible are"
    )
    found = DesignFile(
        path,
        {name: _rows_of(column, kept) for name, column in whole.items()},
        taken[kept] + 1,
        [sheet.lines[i] for i in taken[kept]],
        remarks=(*sheet.remarks, f"{left} left out.") if n else sheet.remarks,
        failed=Counter(alike(lost)),
        infeasible=n - len(lost),
    )
    apart = {*_labels(found.names), *RANKING_COLUMNS}
    if remark := require_designs(found.columns, apart, found.lines, sheet.hidden, found._where):
        found = replace(found, remarks=(*found.remarks, remark))
    if len(old) == 0:
        return found
    former = {name: _rows_of(column, old) for name, column in whole.items()}
    rows = DesignFile(path, former, taken[old] + 1).frame(())
    names = rows[found.label].astype(str) if found.label else ["prototype"] * len(rows)
    rows.index = pd.Index(names)
    return replace(found, prototype=rows)


def _with_roles(file: DesignFile, line: str) -> DesignFile:
    """Return designs with what the comment above them says of their columns."""
    try:
        head = json.loads(comment_text(line))
        groups = ("objectives", "maximized", "variables", "outputs")
        objectives, maximized, variables, outputs = (
            tuple(map(in_a_line, head[key])) for key in groups
        )
        units = {in_a_line(name): unit for name, unit in head["units"].items()}
        if head[_ROLES_MARK] != 1 or not {*maximized} <= {*objectives, *outputs}:
            raise ValueError
        if not all(isinstance(unit, str) for unit in units.values()):
            raise TypeError
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, csv.Error):
        what = "its first line, which says what the columns are, is damaged or of a later version"
        raise UnfitError(f"{what}; remove it, and say --objectives and --maximize") from None
    if missing := [name for name in objectives if name not in file.columns]:
        what = f"its first line names the objective {missing[0]!r}, which is no column"
        raise UnfitError(f"{what}; restore the column, or remove the line")
    # Other columns may be gone: nothing is ranked by them.
    kept, others, more = (
        tuple(name for name in group if name in file.columns)
        for group in (variables, outputs, maximized)
    )
    roles = Roles(objectives, kept, file.label, more, others)
    return replace(file, columns=_in_units(file.columns, units), known=roles)


def _of_json(path: Path, text: str, marks: Marks) -> DesignFile:
    """Return a ranking that was written as JSON, with the objectives it names."""
    try:
        content: Any = json.loads(text, object_pairs_hook=distinct)
        objectives, maximized = content["objectives"], content["maximized"]
        rows = [dict(row) for row in content["designs"]]
        units = dict(content.get("units", {}))
        names = [*objectives, *maximized, *(name for row in rows for name in row)]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        what = "it is JSON, but none that 'pymoo-psi rank --out FILE.json' wrote"
        raise UnfitError(f"{what}; give the designs as CSV") from None
    # JSON can hold what no table, CSV or page can: lists, objects, halves of surrogate pairs.
    cells = [cell for row in rows for cell in row.values()]
    texts = [value for value in (*names, *cells) if isinstance(value, str)]
    if (
        not rows
        or any({*row} != {*rows[0]} for row in rows)
        or not all(isinstance(name, str) for name in [*names, *units.values()])
        or not {*objectives} <= {*rows[0]}
        or any(len({*group}) < len(group) for group in (objectives, maximized))
        or not {*maximized} <= {*rows[0]}
        or not all(map(is_writable, texts))
        or not all(isinstance(cell, (str, int, float, type(None))) for cell in cells)
    ):
        what = "its designs are missing, lack columns, or hold what no table can"
        raise UnfitError(f"{what}, or its objectives are named twice; rank the designs anew")
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    read = _in_units(read_columns(columns, marks), units)
    file = DesignFile(path, read, np.arange(1, len(rows) + 1))
    others = tuple(name for name in maximized if name not in objectives)
    return replace(file, known=Roles(tuple(objectives), (), file.label, tuple(maximized), others))


def _column(cells: list[Any]) -> Column:
    """Return a column of a test table, whose cells have types."""
    if all(isinstance(cell, (int, float)) and not isinstance(cell, bool) for cell in cells):
        return Column(cells, np.array(cells, dtype=np.float64))
    return Column(cells)


def _in_units(columns: Mapping[str, Column], units: Mapping[str, str]) -> dict[str, Column]:
    """Return columns in the units that are told, the others in those of their cells."""
    return {n: replace(column, unit=units.get(n, column.unit)) for n, column in columns.items()}


def _rows_of(column: Column, rows: NDArray[np.intp]) -> Column:
    """Return some cells of a column, read as the whole column is."""
    problem = column.problem
    if problem is not None:
        # The problem stays though its row may be gone: the column was never read.
        places = np.flatnonzero(rows == problem.row)
        problem = problem._replace(row=int(places[0]) if len(places) else -1)
    return replace(
        column,
        cells=[column.cells[i] for i in rows.tolist()],
        numbers=None if column.numbers is None else column.numbers[rows],
        problem=problem,
    )


def _plain(column: Column) -> NDArray[Any]:
    """Return cells as numbers or booleans if they all are such, or blank; else as they are."""
    texts = [cell.strip() if isinstance(cell, str) else cell for cell in column.cells]
    coded = any(isinstance(cell, str) and _CODE.fullmatch(cell) for cell in texts)
    if column.numbers is not None and not coded:
        whole = all(
            _WHOLE.fullmatch(cell) if isinstance(cell, str) else type(cell) is int and cell in INT64
            for cell in texts
        )
        return np.array([int(cell) for cell in texts]) if whole else column.numbers
    if all(isinstance(cell, (str, bool)) and str(cell) in ("True", "False") for cell in texts):
        return np.array([str(cell) == "True" for cell in texts])
    return np.fromiter(column.cells, object)
