"""The test table: every tested point, and what an investigator asks of them.

The order of work is that of Parameter Space Investigation (Sobol' and Statnikov, Choosing Optimal
Parameters in Problems with Several Criteria, 1981; Statnikov and Matusov, 1995): test the points,
look at the ordered test tables, set limits on the objectives, take the Pareto set of the designs
that are feasible then, and refine the bounds for the next investigation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import compress
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._names import Renamed
from pymoo_psi._output import Shown
from pymoo_psi._validation import Received, instance, invalid, wrong_type
from pymoo_psi.table._formats import CSV, STUDY, WORKBOOK
from pymoo_psi.table._formulation import ATTRIBUTES, Formulation
from pymoo_psi.table._head import Columns, columns_of
from pymoo_psi.table._joining import blank, difference, require_one_result, stacked, unequal
from pymoo_psi.table._questions import Questions, facts_of
from pymoo_psi.table._tests import Tests, extra_columns, require_distinct

if TYPE_CHECKING:
    import pandas as pd


class TestTable(Questions, Shown):
    __doc__ = Tests.__doc__
    __test__ = False  # not a test class, whatever its name suggests to pytest

    # Tables put together

    def extended(self, *blocks: TestTable) -> TestTable:
        """Return this table with the tests of others behind its own, in their order.

        Joining many blocks in one call copies the rows once. An output that one of them does not
        have is NaN for its tests.

        Raises:
            ArgumentValueError: A block has another layout, or a test point occurs twice.
            ArgumentTypeError: A block is no table.

        Example:
            >>> first, second = (TestTable.of([n], [[0.1 * n]], [[1.0]]) for n in (1, 2))
            >>> first.extended(second).numbers
            array([1, 2])
        """
        for block in blocks:
            instance("block", block, TestTable)
        tested = _stacked([self, *blocks])
        require_distinct(tested.numbers)
        return self._asked_as_before(tested)

    def _asked_as_before(self, tested: TestTable) -> TestTable:
        """Return other tests under the formulation of these."""
        if self.tested is self:
            return tested
        return tested.under(self.formulation)

    def merge(self, other: TestTable) -> TestTable:
        """Return the tests of this and another run of the same problem, by number of test point.

        ``PSI(1024)`` and ``PSI(3072, first=1025)`` merged are ``PSI(4096)``. A test point in both
        tables counts once, with the outputs and extra columns of both.

        Raises:
            ArgumentValueError: The tables differ in names, directions, units, bounds, tolerance or
                problem, or in results of a test point or design by more than rounding.
            ArgumentTypeError: ``other`` is no table.

        Example:
            >>> ahead = TestTable.of([3, 4], [[0.25], [0.75]], [[1], [3]])
            >>> TestTable.of([1, 2], [[0.0], [0.5]], [[0], [2]]).merge(ahead).numbers
            array([1, 2, 3, 4])
        """
        instance("other", other, TestTable)
        whole = _stacked([self, other])
        _, rows, inverse = np.unique(whole.numbers, return_index=True, return_inverse=True)
        first = rows[inverse]
        require_one_result(whole, first)
        repeated = np.flatnonzero(first != np.arange(len(whole)))
        before = first[repeated]
        outputs = whole.outputs.copy()
        outputs[before] = np.where(np.isnan(outputs[before]), outputs[repeated], outputs[before])
        extra = {name: column.copy() for name, column in whole.extra.items()}
        for column in extra.values():
            unknown = blank(column[before])
            column[before[unknown]] = column[repeated[unknown]]
        table = whole._with(outputs=outputs, extra=extra).rows(rows)
        require_one_result(table)
        return self._asked_as_before(table)

    @classmethod
    def combined(cls, experiments: Mapping[str, TestTable]) -> TestTable:
        """Return the tests of several experiments on one problem: other bounds, sequences, methods.

        Test points are numbered on from experiment to experiment; the extra columns ``experiment``
        and ``number`` say where each is from. Sets, ranks and plots are over all. The bounds hold
        those of all, and are unknown where one has none; an output that an experiment lacks is NaN
        for its tests.

        Args:
            experiments: The tables by a name for each.

        Raises:
            ArgumentValueError: The tables differ in names, directions, units, kinds, tolerance or
                problem, or in the results of a design.
            ArgumentTypeError: The experiments are no mapping of one table or more.

        Example:
            >>> coarse = TestTable.of([1, 2], [[0.0], [0.5]], [[3.0], [1.0]])
            >>> refined = TestTable.of([1, 2], [[0.4], [0.6]], [[0.9], [2.0]])
            >>> table = TestTable.combined({"coarse": coarse, "refined": refined})
            >>> print(table.to_frame()[["experiment", "number", "f1", "pareto"]])
                       experiment number   f1  pareto
            test_point
            1              coarse      1  3.0   False
            2              coarse      2  1.0   False
            3             refined      1  0.9    True
            4             refined      2  2.0   False
        """
        if not isinstance(experiments, Mapping) or not experiments:
            rule = "tables by name, such as {'coarse': a, 'refined': b}"
            raise wrong_type("experiments", rule, experiments)
        tables = [instance(repr(name), table, TestTable) for name, table in experiments.items()]
        _require_one_formulation(tables)
        tested = [table.tested for table in tables]
        bounds = {}
        if len({table.layout.variables for table in tested}) == 1:
            # NaN, where there is no bound, is passed on.
            bounds["lower"] = np.minimum.reduce([table.layout.lower for table in tested])
            bounds["upper"] = np.maximum.reduce([table.layout.upper for table in tested])
        blocks: list[TestTable] = []
        last = 0
        for name, table in zip(experiments, tested, strict=True):
            origin = {"experiment": [name] * len(table), "number": table.numbers.tolist()}
            block = table._with(
                layout=replace(table.layout, **bounds),
                numbers=table.numbers + last,
                extra=extra_columns({**table.extra, **origin}, table.layout, len(table)),
                reasons={number + last: text for number, text in table.reasons.items()},
                problem=facts_of(table.problem, "problem", "parameters", "key"),
            )
            blocks.append(block)
            last = int(block.numbers.max(initial=last))
        whole = stacked(blocks)
        require_one_result(whole)
        return tables[0]._asked_as_before(whole)

    def equals(self, other: object) -> bool:
        """Say whether another table has the same tests in everything; NaN is equal to NaN.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]])
            >>> table.equals(table.rows([0, 1])), table.equals(table.rows([0]))
            (True, False)
        """
        if not isinstance(other, TestTable) or len(self) != len(other):
            return False
        if difference(self._with(problem=None), other):
            return False
        columns, others = columns_of(self), columns_of(other)
        if list(columns) != list(others):
            return False
        return not any(unequal(columns[name], others[name]).any() for name in columns)

    # Frames and files

    def to_frame(self) -> pd.DataFrame:
        """Return the table with one row per test point.

        Returns:
            Index ``test_point``; a column for each variable, objective, constraint, output and
            extra column under its name, objectives in the original direction; ``status``;
            ``violated``, the names of the constraints a design violates; ``reason``, why it
            failed; ``pareto``.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[0.0], [0.1]])
            >>> print(table.to_frame().drop(columns="reason"))
                         x1   f1   g1      status violated  pareto
            test_point
            1           0.0  1.0  0.0          ok             True
            2           0.5  2.0  0.1  infeasible       g1   False
        """
        import pandas as pd

        columns = self._shown_columns()
        for name, column, kind in zip(self.layout.variables, self.X.T, self.kinds, strict=True):
            if kind is Kind.CHOICE:  # the options themselves, not texts
                columns[name] = column
        return pd.DataFrame(columns).set_index("test_point")

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        # The Pareto set of a million tests is not needed for ten rows.
        frame = self.rows(np.arange(min(n, len(self)))).to_frame().drop(columns="pareto")
        empty = [name for name in ("violated", "reason") if not frame[name].any()]
        headings = {name: self.layout.label_of(name) for name in self.layout.columns}
        return frame.drop(columns=empty).rename(columns=headings), len(self)

    def _shown_columns(self) -> Columns:
        """Return the columns of frame and file: two follow from the others, for the reader."""
        mask, names = self.violations()
        violated = [", ".join(compress(names, row)) for row in mask.tolist()]
        columns = columns_of(self)
        for name, cells in self.extra.items():
            columns[name] = _plain_integers(cells, columns[name])
        reason = columns.pop("reason")
        columns["violated"] = np.fromiter(violated, object)
        columns["reason"] = reason
        columns["pareto"] = self.pareto()
        return columns

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table; :func:`read_table` reads it back without a change.

        The columns are those of :meth:`to_frame`. Below the rows, a comment holds names,
        directions, units, bounds and tolerance as JSON. Before 3.1 pandas wants
        ``float_precision="round_trip"`` to read the last digit. An interrupted writing leaves the
        old file as it was.

        Raises:
            OSError: The file cannot be written.

        Example:
            >>> import os, tempfile
            >>> import pandas as pd
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = os.path.join(folder, "table.csv")
            ...     table.to_csv(path)
            ...     print(pd.read_csv(path, comment="#", index_col="test_point")[["x1", "f1"]])
                         x1   f1
            test_point
            1           0.0  3.0
            2           0.5  4.0
        """
        CSV.save_tests(path, self)

    def to_xlsx(self, path: str | PathLike[str]) -> None:
        """Write the table as a workbook, which :func:`read_table` reads back without a change.

        The tests are on the first sheet, the columns those of :meth:`to_frame`; what they mean and
        which design is chosen is on the second.

        Args:
            path: A file with the suffix ``.xlsx``.

        Raises:
            PsiError: openpyxl is not installed.
            ArgumentValueError: The file has another suffix.
            OSError: The file cannot be written.

        Example:
            >>> import os, tempfile
            >>> from pymoo_psi.table import read_table
            >>> table = TestTable.of([1, 2], [[0.0], [0.1]], [[1 / 3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     table.to_xlsx(os.path.join(folder, "table.xlsx"))
            ...     read_table(os.path.join(folder, "table.xlsx")).equals(table)
            True
        """
        WORKBOOK.save_tests(path, self)

    def to_study(self, path: str | PathLike[str]) -> None:
        """Write the table as a new study, which a run continues, whole or not at all.

        So tests of several tables go on as one: ``a.merge(b).to_study("all.db")``, then
        ``minimize(problem, PSI(n, study="all.db"))``. A table whose problem is unknown, as one made
        by :meth:`of`, can be read again, but no run continues it. What evaluations took and where
        designs come from, ``seconds`` and ``origin`` of a study, are no columns of a table and
        stay in the studies that it was read from; ``extra`` columns are not written.

        Raises:
            StudyAccessError: There is a file of that name, or none can be written.

        Example:
            >>> import os, tempfile
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> problem = VectorizedSphereChute()
            >>> parts = [investigate(problem, 100, share=(k, 2)) for k in (1, 2)]
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     study = os.path.join(folder, "chute.db")
            ...     parts[0].merge(parts[1]).to_study(study)
            ...     table = investigate(problem, 200, study=study)  # 100 of them are stored
            >>> len(table)
            200
        """
        STUDY.save_tests(path, self)

    read_csv = Renamed("read_table(path)")
    read_study = Renamed("read_table(path)")


def _stacked(tables: Sequence[TestTable]) -> TestTable:
    """Return the tests of tables under one formulation, as they were tested."""
    _require_one_formulation(tables)
    return stacked([table.tested for table in tables])


def _require_one_formulation(tables: Sequence[TestTable]) -> None:
    """Refuse to join tables of which different things are asked."""
    first: Formulation | None = None
    for table in tables:
        if not table.layout.columns:
            continue
        formulation = replace(table.formulation, chosen=None, reason="", page={})
        if first is None:
            first = formulation
        for name in ATTRIBUTES:
            value, other = getattr(first, name), getattr(formulation, name)
            if (value or None) != (other or None):
                remedy = "ask each of them by the same table.under(...)"
                difference = Received(f"{name} {value} against {other}")
                raise invalid("tables", "under one formulation to be joined", difference, remedy)


def _plain_integers(cells: Any, texts: Any) -> Any:
    """Return texts with the integers among cells as they are: to a spreadsheet 7 is a number."""
    column = np.array(texts, dtype=object)
    for row, cell in enumerate(cells.tolist()):
        if type(cell) is int:
            column[row] = cell
    return column


# The documentation shows the members of a class itself, not of bases that are private.
for _base in (Questions, Tests):
    for _name, _member in vars(_base).items():
        if not _name.startswith("_") and _name not in vars(TestTable):
            setattr(TestTable, _name, _member)
