"""The designs of a file: their numbers, what they are called, and which of them are taken."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Remark, counted, known_name
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table._cells import Column, is_blank
from pymoo_psi.table._expression import Expression
from pymoo_psi.table._formulation import Formulation, computed_columns
from pymoo_psi.table._layout import RESERVED, Layout, bounds_of, within
from pymoo_psi.table._roles import NAMING, Roles, guessed_roles, labels_among
from pymoo_psi.table._table import TestTable

if TYPE_CHECKING:
    import pandas as pd

_TOLD = 6  # rows that a line names


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
        >>> from pymoo_psi.table import read_designs
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
                name: np.fromiter(column.cells, object) if text else column.plain
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
        labels = labels_among(self.names)
        if labels and labels[0].strip().lower() in NAMING:
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
        ids = design_ids(whole.columns[label].plain.tolist(), whole.rows.tolist())
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
            found = Roles(*guessed_roles(self.names, asked), self.label)
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

    def told(self, roles: Roles) -> Remark:
        """Say in a line which columns were taken as objectives, in what, and which were not."""
        units = {name: self.columns[name].unit for name in roles.objectives}
        taken = [f"{name} (in {unit})" if unit else name for name, unit in units.items()]
        rest = [name or "(no name)" for name in self.names if name not in roles.objectives]
        left_out = f"; not as objectives: {', '.join(rest)}" if rest else ""
        line, first = f"Objectives: {', '.join(taken)}{left_out}", self.names[0]
        # One that knows its columns needs no choice.
        hint = " (--objectives chooses others)" if self.known is None else ""
        numbers = self.columns[first].numbers
        # Ranked by the number of the design, any other would be the best.
        if first not in units or numbers is None or len(numbers) < 3:
            return Remark(line, hint)
        counts = np.array_equal(numbers, numbers[0] + np.arange(len(numbers)))
        remedy = f". {first} counts the rows: if it only numbers designs, say --objectives"
        return Remark(line, f"{remedy}{hint}" if counts else hint)

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
        roles = self.roles(() if asked.objectives else None)
        former = self.known or roles
        criteria = tuple(asked.objectives) or roles.objectives
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
        added = {name: Column.of(values[name].tolist()) for name in asked.computed}
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
            columns={name: column.some(kept) for name, column in columns.items()},
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
        plain = {name: values.get(name, column.plain) for name, column in self.columns.items()}
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
            name: self.columns[name].plain.tolist()
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
