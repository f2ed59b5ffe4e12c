"""What the columns of a file of designs are, as far as their names tell.

A file of designs that has been read: its columns, what they are, their numbers.

Reading a file of designs: a reader per kind of file, chosen by how the file begins.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import known_name
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto._ranking import RANKING_COLUMNS
from pymoo_psi.table._cells import UnfitError, kind_of, parsed
from pymoo_psi.table._table import STATUSES, TestTable

if TYPE_CHECKING:
    import pandas as pd


_LABELS = ("test_point", "number", "label", "name", "id", "design", "row", "index")
_UNNAMED = re.compile(r"|Unnamed: \d+")  # as data frames write, and read, their row labels


@dataclass(frozen=True)
class Roles:
    """Which columns are what; a column without a role is carried along.

    Attributes:
        objectives: Names of the columns with objectives.
        variables: Names of the columns with design variables.
        label: Name of the column with the designs' numbers or names; ``None`` if there is none.
        maximize: The objectives that the file says are to be maximised.

    Example:
        >>> Roles(("cost", "mass"), label="id").variables
        ()
    """

    objectives: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    label: str | None = None
    maximize: tuple[str, ...] = ()


def guessed_roles(names: Sequence[str], holds_numbers: Callable[[str], bool]) -> Roles:
    """Return the roles of the columns of a file that does not tell them.

    With columns f1, f2, … these are the objectives, and x1, x2, … (or u1, u2, …) the variables.
    Otherwise all columns of numbers are objectives. Numbers and names of designs never are, nor
    are the columns that a ranking adds.

    Args:
        names: Names of all columns.
        holds_numbers: Whether a column is one of numbers.

    Example:
        >>> guessed_roles(["id", "x1", "f1", "f2", "rank"], lambda name: True)
        Roles(objectives=('f1', 'f2'), variables=('x1',), label='id', maximize=())
        >>> guessed_roles(["cost", "metal"], lambda name: name == "cost").objectives
        ('cost',)
    """
    labels = [name for name in names if name.strip().lower() in _LABELS]
    labels.sort(key=lambda name: _LABELS.index(name.strip().lower()))
    labels += [name for name in names if _UNNAMED.fullmatch(name)]
    free = [name for name in names if name not in labels and name not in RANKING_COLUMNS]
    numbered = [name for name in free if re.fullmatch(r"f\d+", name)]
    variables = [name for name in free if re.fullmatch(r"[xu]\d+", name)]
    if not ("f1" in numbered and (variables or len(numbered) > 1)):
        numbered, variables = [name for name in free if holds_numbers(name)], []
    return Roles(tuple(numbered), tuple(variables), labels[0] if labels else None)


_WHOLE = re.compile(r"[+-]?\d{1,18}")


@dataclass(frozen=True, eq=False)
class DesignFile:
    """The designs of a file.

    Attributes:
        path: The file.
        cells: One row per design, one or more; texts as they are written, or the values of a
            test table.
        lines: The line of the file on which each row ends; empty if it has no lines.
        known: The roles of the columns, where the file tells them.
        prototype: Rows of existing designs under the names of the columns, their index the
            designs' names; ``None`` if there are none.
        remark: What a reader must know about the rows, as a sentence; often empty.

    Example:
        >>> from pathlib import Path
        >>> import pandas as pd
        >>> cells = pd.DataFrame({"id": ["A", "B"], "cost": ["1.5", "2"]}, dtype=object)
        >>> file = DesignFile(Path("set.csv"), cells)
        >>> file.names, file.label, file.roles().objectives
        (['id', 'cost'], 'id', ('cost',))
    """

    path: Path
    cells: pd.DataFrame
    lines: Sequence[int] = ()
    known: Roles | None = None
    prototype: pd.DataFrame | None = None
    remark: str = ""

    @property
    def names(self) -> list[str]:
        """The names of the columns.

        Example:
            >>> import pandas as pd
            >>> DesignFile(Path("set.csv"), pd.DataFrame({"id": ["A"], "cost": ["1.5"]})).names
            ['id', 'cost']
        """
        return [str(name) for name in self.cells.columns]

    @property
    def label(self) -> str | None:
        """The column with the designs' numbers or names, as far as its name tells.

        Example:
            >>> import pandas as pd
            >>> DesignFile(Path("set.csv"), pd.DataFrame({"id": ["A"], "cost": ["1.5"]})).label
            'id'
        """
        return guessed_roles(self.names, lambda name: False).label

    def roles(
        self, objectives: Sequence[str] | None = None, variables: Sequence[str] | None = None
    ) -> Roles:
        """Return what the columns are: as named, else as the file tells, else by their names.

        Args:
            objectives: Names of the columns with objectives, if they are named.
            variables: Names of the columns with design variables, likewise.

        Raises:
            ArgumentValueError: There is no such column, one is named twice, or there is no
                column of numbers to take.

        Example:
            >>> import pandas as pd
            >>> cells = pd.DataFrame({"x1": ["0"], "f1": ["1"], "f2": ["2"]}, dtype=object)
            >>> file = DesignFile(Path("set.csv"), cells)
            >>> file.roles()
            Roles(objectives=('f1', 'f2'), variables=('x1',), label=None, maximize=())
            >>> file.roles(["f2"]).objectives
            ('f2',)
        """
        for argument, names in (("objectives", objectives), ("variables", variables)):
            self.require_columns(argument, names or ())
        found = self.known or guessed_roles(
            self.names, self._holds_numbers if objectives is None else lambda name: False
        )
        chosen = found.objectives if objectives is None else tuple(objectives)
        kept = found.variables if variables is None else tuple(variables)
        if variables is None:
            kept = tuple(name for name in kept if name not in chosen)
        if objectives is None:
            chosen = tuple(name for name in chosen if name not in kept)
            if not chosen:
                raise unfit(self.path, "no column holds numbers that can be objectives")
        label = None if found.label in {*chosen, *kept} else found.label
        return Roles(chosen, kept, label, tuple(n for n in found.maximize if n in chosen))

    def require_columns(self, argument: str, names: Sequence[str]) -> None:
        """Refuse names that are no columns, or are given twice.

        Raises:
            ArgumentValueError: There is such a name.

        Example:
            >>> import pandas as pd
            >>> file = DesignFile(Path("set.csv"), pd.DataFrame({"cost": ["1"], "mass": ["2"]}))
            >>> file.require_columns("objectives", ["cots"])
            Traceback (most recent call last):
            ...
            pymoo_psi.errors.ArgumentValueError: objectives must be one of 'cost', 'mass', ...
        """
        for name in names:
            known_name(argument, name, self.names, f"see {self.path}")
        if twice := [name for name, count in Counter(names).items() if count > 1]:
            raise unfit(self.path, f"{argument} names the column {twice[0]!r} twice")

    def told(self, roles: Roles) -> str:
        """Say in a line which columns were taken as objectives, and which were left out.

        Example:
            >>> import pandas as pd
            >>> cells = pd.DataFrame({"id": ["A"], "cost": ["1"]}, dtype=object)
            >>> file = DesignFile(Path("set.csv"), cells)
            >>> file.told(file.roles())
            'Objectives: cost; not as objectives: id'
        """
        rest = [name or "(no name)" for name in self.names if name not in roles.objectives]
        left_out = f"; not as objectives: {', '.join(rest)}" if rest else ""
        return f"Objectives: {', '.join(roles.objectives)}{left_out}"

    def values(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Return the ``(n, m)`` values of columns, every digit as it is written.

        Raises:
            ArgumentValueError: A cell holds no finite number.

        Example:
            >>> import pandas as pd
            >>> cells = pd.DataFrame({"cost": ["1.5", "2"], "mass": ["4", "1e1"]}, dtype=object)
            >>> DesignFile(Path("set.csv"), cells).values(["mass", "cost"])
            array([[ 4. ,  1.5],
                   [10. ,  2. ]])
        """
        return np.column_stack([self._numbers(name) for name in names])

    def frame(self, objectives: Sequence[str]) -> pd.DataFrame:
        """Return the designs with numbers for texts, in every column of numbers.

        Args:
            objectives: Names of the columns that must be complete.

        Raises:
            ArgumentValueError: A cell of an objective holds no finite number.

        Example:
            >>> import pandas as pd
            >>> cells = pd.DataFrame({"id": ["A", "B"], "cost": ["1.5", "2"]}, dtype=object)
            >>> DesignFile(Path("set.csv"), cells).frame(["cost"])["cost"].tolist()
            [1.5, 2.0]
        """
        frame = self.cells.copy()
        for name in self.names:
            if name in objectives:
                frame[name] = self._numbers(name)
            elif frame[name].dtype == object:
                frame[name] = _plain(frame[name].tolist())
        return frame

    def _holds_numbers(self, name: str) -> bool:
        """Say whether a column is one of numbers; a text among numbers is told of later."""
        if self.cells[name].dtype != object:
            return bool(self.cells[name].dtype.kind in "iuf")
        kinds = {kind_of(str(cell)) for cell in self.cells[name]}
        if kinds == {"blank"}:
            remedy = "leave it out, or name the objectives by --objectives"
            raise unfit(self.path, f"its column {name!r} holds no number at all; {remedy}")
        return "number" in kinds

    def _numbers(self, name: str) -> NDArray[np.float64]:
        column = self.cells[name]
        if column.dtype.kind in "biuf" and np.isfinite(column.to_numpy(np.float64)).all():
            return column.to_numpy(np.float64)
        cells = [str(cell) for cell in column]
        kinds = [kind_of(cell) for cell in cells]
        if "number" not in kinds:
            raise unfit(self.path, f"its column {name!r} holds no number at all")
        for i, (kind, cell) in enumerate(zip(kinds, cells, strict=True)):
            where = f"row {i + 1}" + (f" (line {self.lines[i]})" if self.lines else "")
            if kind == "text":
                remedy = "correct it, or name the objectives by --objectives"
                what = f"{where} holds text in the number column {name!r}: {cell!r:.40}; {remedy}"
                raise unfit(self.path, what)
            if kind == "blank" or not math.isfinite(float(cell)):
                what = "no number" if kind == "blank" else cell.strip()
                remedy = "leave out designs that failed"
                raise unfit(self.path, f"{where} holds {what} in the column {name!r}; {remedy}")
        return np.array([float(cell) for cell in cells])


def unfit(path: object, what: str) -> ArgumentValueError:
    """Compose the error for a file that cannot be used; the caller raises it.

    Example:
        >>> unfit("set.csv", "no column holds numbers")
        ArgumentValueError('set.csv: no column holds numbers')
    """
    return ArgumentValueError(f"{path}: {what}")


def _plain(cells: list[Any]) -> NDArray[Any]:
    """Return cells as numbers or booleans if they all are such, or blank; else as they are."""
    kinds = {kind_of(cell) if isinstance(cell, str) else "text" for cell in cells}
    if kinds == {"number"} and all(_WHOLE.fullmatch(cell.strip()) for cell in cells):
        return np.array([int(cell) for cell in cells])
    if kinds <= {"number", "blank"} and "number" in kinds:
        return np.array([float(c) if kind_of(c) == "number" else math.nan for c in cells])
    texts = {str(cell).strip() for cell in cells}
    if texts <= {"True", "False"}:
        return np.array([str(cell).strip() == "True" for cell in cells])
    plain = np.empty(len(cells), dtype=object)
    plain[:] = cells
    return plain


_TEST_TABLE = b"pymoo_psi_test_table"


def read_designs(path: str | PathLike[str]) -> DesignFile:
    r"""Read the designs of a file.

    Args:
        path: A CSV with commas, semicolons (with decimal commas or points) or tabs, comments
            (``#``) above its header or none; a test table, CSV or Parquet, or a study, of which
            the feasible designs are taken; a ranking that ``pymoo-psi rank --out`` wrote as CSV
            or JSON; what the decision page exported.

    Raises:
        OSError: The file cannot be opened.
        ArgumentValueError: It is no table of named columns with one design or more.
        StudyError: It is a database but no study, or a damaged one.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder, "set.csv")
        ...     _ = path.write_text("id;cost;mass\nA;1,5;4\nB;2;1\n", encoding="utf-8")
        ...     file = read_designs(path)
        >>> file.values(["cost", "mass"])
        array([[1.5, 4. ],
               [2. , 1. ]])
    """
    path = Path(path)
    with path.open("rb") as file:
        start = file.read(4096)
    if start.startswith(b"SQLite format 3\0"):
        return _of_tests(path, TestTable.read_study(path))
    if start.startswith(b"PAR1"):
        return _of_tests(path, TestTable.read_parquet(path))
    if start.startswith(b"PK\x03\x04"):
        raise unfit(path, "it is a workbook or an archive; save the sheet as CSV")
    if _TEST_TABLE in start.partition(b"\n")[0]:
        return _of_tests(path, TestTable.read_csv(path))
    try:
        with path.open(encoding="utf-8-sig", newline="") as lines:
            text = lines.read()
    except UnicodeDecodeError as error:
        raise unfit(path, f"it is no UTF-8 text: {error.reason}; save it as CSV UTF-8") from None
    if text.lstrip().startswith(("{", "[")):
        return _of_json(path, text)
    return _of_csv(path, text)


def _of_tests(path: Path, table: TestTable) -> DesignFile:
    """Return the feasible designs of a test table with finite criteria, and its prototype."""
    import pandas as pd

    layout, prototype = table.layout, table.prototype
    if not layout.objectives:
        raise unfit(path, "its tests have no criteria")
    feasible = np.flatnonzero(table.eligible())
    if len(feasible) == 0:
        raise unfit(path, f"none of its {len(table)} tests is feasible")
    rows = None
    if prototype is not None:
        cells = dict(zip(layout.objectives, prototype.f.tolist(), strict=True))
        cells |= dict(zip(layout.variables, prototype.x.tolist(), strict=True))
        rows = pd.DataFrame([cells], index=[prototype.name])
    frame = table.rows(feasible).to_frame().reset_index()
    frame = frame.drop(columns=["status", "violated", "reason", "pareto"])
    n, others = len(feasible), len(table) - len(feasible)
    remark = f"{n} of {len(table)} tests are feasible; the others are left out." if others else ""
    roles = Roles(layout.objectives, layout.variables, "test_point")
    return DesignFile(path, frame, (), roles, rows, remark)


def _of_csv(path: Path, text: str) -> DesignFile:
    """Return the designs of a CSV, without those that it says are prototypes, or not feasible."""
    import pandas as pd

    try:
        columns, lines = parsed(text)
    except UnfitError as error:
        raise unfit(path, str(error)) from None
    frame = pd.DataFrame(columns, dtype=object)
    feasible = np.ones(len(frame), dtype=bool)
    if set(columns.get("status", ["?"])) <= set(STATUSES):
        feasible = (frame["status"] == "ok").to_numpy()
    existing = np.zeros(len(frame), dtype=bool)
    if {"mark", *RANKING_COLUMNS[:-1]} <= set(columns):  # the page's export
        existing = (frame.pop("mark") == "prototype").to_numpy()
    kept = feasible & ~existing
    if not kept.any():
        raise unfit(path, f"none of its {len(kept)} designs is feasible, or all are prototypes")
    others = int((~feasible).sum())
    remark = f"{others} designs that are not feasible are left out." if others else ""
    cells = frame[kept].reset_index(drop=True)
    found = DesignFile(path, cells, [lines[i] for i in np.flatnonzero(kept)], remark=remark)
    if not existing.any():
        return found
    rows = DesignFile(path, frame[existing]).frame(())
    names = rows[found.label].astype(str) if found.label else ["prototype"] * len(rows)
    rows.index = pd.Index(names)
    return replace(found, prototype=rows)


def _of_json(path: Path, text: str) -> DesignFile:
    """Return a ranking that was written as JSON, with the objectives it names."""
    import pandas as pd

    try:
        content: Any = json.loads(text)
        objectives = tuple(map(str, content["objectives"]))
        maximized = tuple(map(str, content["maximized"]))
        designs = content["designs"]
        rows = [{str(name): _cell(cell) for name, cell in row.items()} for row in designs]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        what = "it is JSON, but none that 'pymoo-psi rank --out FILE.json' wrote"
        raise unfit(path, f"{what}; give the designs as CSV") from None
    if not rows or any({*row} != {*rows[0]} for row in rows) or not {*objectives} <= {*rows[0]}:
        raise unfit(path, "its designs are missing, or lack columns; rank the designs anew")
    found = DesignFile(path, pd.DataFrame(rows, dtype=object))
    return replace(found, known=Roles(objectives, (), found.label, maximized))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else repr(value)
