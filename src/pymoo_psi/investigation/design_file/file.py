"""A file of designs that has been read: its columns, what they are, their numbers."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.arguments import known_name
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.investigation.design_file.cells import kind_of
from pymoo_psi.investigation.design_file.roles import Roles, guessed_roles

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["DesignFile", "unfit"]

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
