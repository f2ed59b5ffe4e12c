"""The test table: tests as they were evaluated, and what an investigator asks of them.

The order of work is that of Parameter Space Investigation (Sobol' and Statnikov, Choosing Optimal
Parameters in Problems with Several Criteria, 1981; Statnikov and Matusov, 1995): test the points,
look at the ordered test tables, set limits on the objectives, take the Pareto set of the designs
that are feasible then, and refine the bounds for the next investigation.

A :class:`TestTable` has the columns as evaluated, and a formulation. Its rows, columns and arrays
are those of :class:`View`; :meth:`TestTable.under` returns the same tests with another formulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._kinds import Kind, plain
from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    Array,
    Columns,
    Entries,
    FilePath,
    Integers,
    counted,
    finite_number,
    instance,
    invalid,
    known_name,
    real_array,
)
from pymoo_psi.pareto import EfficiencyRanking
from pymoo_psi.table._cells import cells_of_kind, designs_of
from pymoo_psi.table._decision import Decision, decision_of
from pymoo_psi.table._designs import (
    confidence_frame,
    names_of_designs,
    none_feasible,
    ranking_of_rows,
    row_named,
)
from pymoo_psi.table._formulation import Formulation, FormulationFields
from pymoo_psi.table._joining import are_equal, merged, stacked
from pymoo_psi.table._limits import texts_of
from pymoo_psi.table._schema import (
    LABEL,
    NOTE,
    OUTPUT,
    TEST,
    VARIABLE,
    Column,
    Schema,
)
from pymoo_psi.table._storage import columns_of, marked, reason_cells, result_columns, write_csv
from pymoo_psi.table._view import View, checked_numbers, columns_of_matrix, require_distinct

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Unpack

_N_SHOWN = 50  # the most rows whose texts a message names


@dataclass(frozen=True, eq=False, repr=False)
class TestTable(View, Shown):
    """A table of tests or designs, in the order of testing.

    Made by :meth:`of` from arrays, by :meth:`empty` and :meth:`extended` block after block, or by
    :func:`read_table`. A table never changes; its arrays are read-only.

    A table has a :class:`Formulation`: objectives, limits, normalisation. :meth:`under` returns the
    same tests under another one, without an evaluation: ``table.under(limits={"mass":
    30}).pareto()``.

    ``F`` is as in pymoo: all objectives are minimised, and those to be maximised have the opposite
    sign. Everywhere else, objectives are in the original direction: ``table["mass"]``, limits,
    frames, files, plots.

    Attributes:
        evaluated: The columns as evaluated, before any formulation.
        data: ``(n,)`` their cells by name, in the original directions.
        numbers: ``(n,)`` numbers of the tests, from 1, each once.
        failures: Why evaluations failed, by the number of the test.
        decision: What is asked of the tests, and what people decided: the formulation, the chosen
            design, positions.
        problem: The identity of the problem: name, parameters, sampling and key, by which studies
            distinguish problems; ``None`` if unknown.
        remarks: Sentences on what a reader must know about the rows; they are not written to files.
        decimal: The decimal mark of the source, which the page and files written use.
        separator: The mark between the cells of the source, which files written use.
        n_stored: How many tests the study has in which these are kept; 0 if they are in none.

    Example:
        >>> table = TestTable.of(
        ...     [1, 2, 3], X=[[0.1], [0.5], [0.9]], F=[[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]],
        ...     G=[[-1.0], [0.0], [0.5]])
        >>> table
        TestTable(3 tests: 2 ok, 1 infeasible, 0 failed; 1 variable, 2 objectives, 1 constraint)
        >>> table.under(limits={"f1": 1.5}).feasible().tolist()
        [True, False, False]
    """

    __test__ = False  # not a test class, whatever its name suggests to pytest

    # Tables made

    @classmethod
    def of(
        cls,
        numbers: ArrayLike,
        X: Any,
        F: ArrayLike,
        G: ArrayLike | None = None,
        H: ArrayLike | None = None,
        *,
        outputs: Mapping[str, ArrayLike] | None = None,
        reasons: Mapping[int, str] | None = None,
        schema: Schema | None = None,
        notes: Entries | None = None,
        label: str | None = None,
    ) -> TestTable:
        """Return a table of evaluated designs; their status follows from the constraints.

        A design with a reason has failed, as has one that meets its constraints but has an
        objective that is not finite.

        Args:
            numbers: ``(n,)`` numbers of the tests, from 1, each once.
            X: ``(n, n_var)`` designs, or n mappings from variable to value.
            F: ``(n, m)`` objectives, all minimised: negatives of those that the schema maximises.
                NaN and infinity are allowed.
            G: ``(n, n_ieq)`` inequality constraints, met where <= 0.
            H: ``(n, n_eq)`` equality constraints, met within the tolerance.
            outputs: ``(n,)`` further outputs of the model, by name. They are added to those of the
                schema, which are NaN if not given.
            reasons: Why designs failed, for their numbers.
            schema: Names, directions, units, kinds, bounds and tolerance. By default names are x1,
                f1, …, all objectives are minimised, and there are no bounds.
            notes: ``(n,)`` other columns, by name, such as texts of a file.
            label: The note that names the designs.

        Raises:
            ArgumentValueError: The arrays do not fit one another or the schema, or a reason is that
                of no test.
            ArgumentTypeError: An array holds what it cannot.

        Example:
            >>> table = TestTable.of([1, 2], X=[[0.0], [0.5]], F=[[3.0], [4.0]], G=[[0.0], [0.1]])
            >>> table.status.tolist()
            ['ok', 'infeasible']
        """
        numbers = checked_numbers(numbers)
        n = len(numbers)
        data, designs = designs_of(X, None if schema is None else schema.with_role(VARIABLE))
        matrices = {"F": _matrix("F", F, n), "G": _matrix("G", G, n), "H": _matrix("H", H, n)}
        if schema is None:
            schema = Schema.of([*data], *[matrix.shape[-1] for matrix in matrices.values()])
        schema = schema.with_columns(*designs)
        for name, matrix in matrices.items():
            data |= columns_of_matrix(name, matrix, schema, n)
        data |= dict.fromkeys(schema.outputs, np.full(n, np.nan))
        table = cls(schema, data, numbers, _writable_reasons(reasons or {}, numbers))
        return table.with_outputs(outputs or {}).with_notes(notes or {}, label)

    @classmethod
    def empty(cls, schema: Schema | None = None) -> TestTable:
        """Return a table without any test.

        Args:
            schema: Names, kinds, bounds and tolerance. Without one the table takes the schema of
                the first block it is extended by.

        Example:
            >>> table = TestTable.empty()
            >>> len(table), len(table.extended(TestTable.of([1], [[0.5]], [[2.0]])))
            (0, 1)
        """
        schema = schema or Schema()
        data = {c.name: cells_of_kind(c.name, [], c.kind) for c in schema.columns}
        return cls(schema, data, np.zeros(0, dtype=np.int64))

    def with_outputs(self, outputs: Mapping[str, ArrayLike]) -> TestTable:
        """Return the table with further outputs; they replace those with their names.

        Args:
            outputs: ``(n,)`` values by name.

        Raises:
            ArgumentValueError: Another column has the name, or there are not n values.
            ArgumentTypeError: The values are not numbers.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]])
            >>> table.with_outputs({"heat": [3, 4]})["heat"]
            array([3., 4.])
        """
        data: Columns = {}
        for name, values in outputs.items():
            values = self._by_row(values, np.nan)
            data[name] = np.array(real_array(f"the output {name!r}", values))
        return self._with_columns(data, Kind.REAL, OUTPUT)

    def with_notes(self, notes: Mapping[str, Any], label: str | None = None) -> TestTable:
        """Return the table with further columns of texts, or of whatever else a file has.

        Args:
            notes: ``(n,)`` cells by name; they replace those with their names.
            label: The note that names the designs; the same as before unless given.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]])
            >>> table.with_notes({"model": ["A", "B"]}, "model").names
            ['A', 'B']
        """
        data: Columns = {}
        for name, values in notes.items():
            data[name] = np.fromiter(map(plain, self._by_row(values, None)), object)
        table = self._with_columns(data, Kind.CHOICE, NOTE, LABEL)
        if label is None:
            return table
        schema = table.evaluated
        known_name("label", label, schema.notes)
        roles = dict.fromkeys(schema.notes, NOTE) | {label: LABEL}
        return replace(table, evaluated=schema.changed(role=roles))

    def _with_columns(self, data: Columns, kind: Kind, *roles: str) -> TestTable:
        """Return the table with cells of columns, new ones and those that have one of the roles.

        New ones get the first role.
        """
        schema = self.evaluated
        present = schema.of_role(*roles)
        new = [Column(name, roles[0], kind) for name in data if name not in present]
        schema = replace(schema, columns=(*schema.columns, *new))
        return replace(self, evaluated=schema, data={**self.data, **data})

    # Formulations

    def under(
        self,
        formulation: Formulation | Decision | None = None,
        /,
        **fields: Unpack[FormulationFields],
    ) -> TestTable:
        """Return the table of the same tests under another formulation, without an evaluation.

        The result is the table of a problem with these objectives, directions and limits; other
        columns become outputs. Numbers and designs stay the same. A design fails if an objective
        cannot be computed, and stays failed if its evaluation failed.

        The formulation replaces that of the table and applies to the tests as evaluated: limits can
        be loosened as well as tightened, and ``under(limits={})`` has none. A :class:`Decision`
        also replaces what people decided. What is not given stays: without a formulation all that
        ``fields`` do not name, with one the ranges; but not directions and ranges of objectives
        that are left out.

        A limit is the same as removing the rows that it rejects: sets, rankings, explanations,
        cautions and shares are those of the table without these rows. Fixed ranges stay.

        Args:
            formulation: The formulation, or a decision; that of the table unless given.
            **fields: Attributes of :class:`Formulation`, which replace those of the formulation:
                ``under(limits={"mass": 30}, normalize=False)``.

        Raises:
            ArgumentValueError: A column or attribute is unknown, or cannot be used as stated.
            ArgumentTypeError: An attribute has a wrong type.

        Example:
            >>> schema = Schema.of(["width"], ["mass"], ["stress"], outputs=["gain"])
            >>> table = TestTable.of(
            ...     [1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]], G=[[0.2], [-0.1], [-0.3]],
            ...     outputs={"gain": [0.5, 0.7, 0.6]}, schema=schema)
            >>> free = table.under(
            ...     objectives=["mass", "gain"], maximize=["gain"], limits={"stress": 0.3},
            ...     omitted=["stress"])
            >>> free.pareto(), table.pareto()
            (array([ True,  True, False]), array([False,  True, False]))
            >>> free.under(limits={"mass": 1.5}).pareto()
            array([ True, False, False])
        """
        for name in fields:
            known_name("an argument of under()", name, FormulationFields.__annotations__)
        decision = decision_of(formulation, self.decision)
        asked = decision.formulation
        former = replace(asked, objectives=asked.objectives or self.evaluated.objectives)
        asked = replace(asked, **fields)
        objectives = asked.objectives or self.evaluated.objectives
        if "objectives" in fields:
            asked = replace(former.with_objectives(objectives), **fields)
        if asked.ranges is None:
            asked = replace(asked, ranges=self.formulation.with_objectives(objectives).ranges)
        table = replace(self, decision=replace(decision, formulation=asked))
        table._require_fit()
        return table

    def _require_fit(self) -> None:
        """Refuse limits on texts that no test has, and fixed ranges of other objectives.

        Rows that are taken from a table keep its limits, even if they meet none. Nor must tests of
        a variable meet one: other tests may follow, and its problem knows the options.
        """
        for name, limit in self.limits.items():
            if limit.texts and len(self) and name not in self.schema.variables:
                cells = self.column(name)
                if len(limit.missing(cells)) == len(limit.texts):
                    texts = {*texts_of(cells[:_N_SHOWN]).tolist()}
                    known_name(f"{name!r} in limits", limit.texts[0], texts)
        self.feasible()  # refuses columns that limits and expressions cannot use
        ranges = self.fixed_ranges
        objectives = self.schema.objectives
        if ranges and {*ranges} != {*objectives}:
            rule = f"of every objective ({', '.join(objectives)}), or of none"
            raise invalid("ranges", rule, [*ranges])

    # Names

    @cached_property
    def names(self) -> list[str]:
        """Unique names of the n designs: labels, or otherwise numbers of tests.

        Tests of the second run of a study and of later ones are named by run and point, test 2.5.
        So a test keeps its name while the study grows. Designs that share a name get their number
        appended; a label that is a number is preceded by the name of its column.

        Example:
            >>> table = TestTable.of([1, 2, 1_000_001], [[0.1], [0.5], [0.9]], [[1], [2], [3]])
            >>> table.names
            ['test 1', 'test 2', 'test 1000001']
            >>> table.with_notes({"run": ["1", "1", "2"], "test_point": ["1", "2", "1"]}).names
            ['test 1', 'test 2', 'test 2.1']
            >>> table.with_notes({"row_no": ["A", -1.5, 7]}, "row_no").names
            ['A', 'row no -1.5', 'row no 7']
        """
        return names_of_designs(self)

    def row_of(self, design: int | str) -> int:
        """Return the row of a design by the number of its test or by its label.

        Args:
            design: The number of a test, or a text: a name as in :attr:`names`; a label that only
                one design has; or the number of a test, unless labels are numbers. A number that is
                a label of another test, too, is refused.

        Raises:
            ArgumentValueError: It names no design, or several.
            ArgumentTypeError: It is neither a whole number nor a text.

        Example:
            >>> table = TestTable.of([4, 5], [[0.1], [0.5]], [[1], [2]])
            >>> table.row_of(5), table.row_of("test 4")
            (1, 0)
        """
        return row_named(self, self.names, design)

    # Rankings

    def ranking(self) -> EfficiencyRanking:
        """Rank the Pareto-optimal designs by efficiency; see :func:`~pymoo_psi.rank_of_efficiency`.

        Returns:
            The ranking of the rows :meth:`pareto`, in that order. Its objectives have the table's
            names and directions, its labels are the designs' :attr:`names` if the table has labels,
            else the numbers of the tests, so that ``.to_frame()`` has the index ``test``; ``.rows``
            are the rows of the table.

        Raises:
            ArgumentValueError: There is no design to rank.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> ranking = table.ranking()
            >>> table.numbers[ranking.rows[ranking.salukvadze]]
            array([2])
        """
        import pandas as pd

        rows = np.flatnonzero(self._front)
        labels = pd.Index(self.numbers[rows], name=TEST)
        if self.schema.label is not None:
            labels = pd.Index(np.array(self.names)[rows], name=self.schema.label)
        return ranking_of_rows(self, rows, labels)

    def feasible_ranking(self) -> EfficiencyRanking:
        """Rank all feasible designs, dominated ones among them, each design once.

        Commands, page and report show this ranking. It includes dominated designs because they may
        become optimal if another design is dropped, which :func:`~pymoo_psi.cautions` report.

        Returns:
            The ranking of the feasible designs, as that of :meth:`ranking`; its labels are the
            designs' :attr:`names`.

        Raises:
            ArgumentValueError: There is no design to rank.

        Example:
            >>> table = TestTable.of([4, 5, 6], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [2, 2]])
            >>> ranking = table.feasible_ranking()
            >>> ranking.rows, ranking.rank, ranking.name_of(1)
            (array([0, 1, 2]), array([6, 6, 0]), 'test 5')
        """
        return self._feasible_ranking

    @cached_property
    def _feasible_ranking(self) -> EfficiencyRanking:
        rows = np.flatnonzero(self.feasible())
        rows = rows[~self._repeated(rows)]
        return ranking_of_rows(self, rows, [self.names[row] for row in rows.tolist()])

    def best(self) -> TestTable:
        """Return the Salukvadze optimum, the nearest design to the ideal point, as one row.

        Raises:
            ArgumentValueError: There is no design to rank.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> table.best().names, table.best().F
            (['test 2'], array([[1., 1.]]))
        """
        ranking = self.ranking()
        return self.take(ranking.rows[ranking.salukvadze[:1]])

    def confidence(self) -> pd.DataFrame:
        """Return how probable it is that each design is Pareto optimal, the best, or near it.

        The probabilities come from samples of the true values, given means and their standard
        errors: columns such as ``f1 standard error``, which
        :func:`pymoo_psi.analysis.average_repeats` adds. Noise is assumed to be normal and
        independent. With five designs or more for each objective, means are shrunk towards those
        of all designs. All designs are assumed to meet the limits.

        Returns:
            Index: the names of the feasible designs. Columns: the expected true values of the
            objectives; ``pareto``, ``best``, the nearest to the ideal point, and ``near_best``, at
            most 5 % farther: probabilities, with standard errors of at most 0.016 (0.035 of more
            than 2000 designs). Designs that tie are all the best.

        Raises:
            ArgumentValueError: There is no feasible design, or no standard error of an objective.

        Example:
            >>> from pymoo_psi.analysis import average_repeats
            >>> F = [[0, 4], [0.1, 4.1], [1, 1], [1.1, 0.9], [4, 0], [3.9, 0.1]]
            >>> tests = TestTable.of(range(1, 7), [[1], [1], [2], [2], [3], [3]], F)
            >>> average_repeats(tests).confidence()["best"].round(2).tolist()
            [0.0, 1.0, 0.0]
        """
        return confidence_frame(self, self.feasible_ranking())

    def refined_bounds(self, *, margin: float = 0.0) -> tuple[Array, Array]:
        """Return the bounds of the feasible set, for the next investigation.

        Args:
            margin: Widen them on each side by this share of their width, but not beyond the
                bounds of this table. Integers are rounded outwards.

        Returns:
            Lower and upper bounds, ``(n_var,)`` each; those of the table for choices and
            binary variables, NaN where it has none.

        Raises:
            ArgumentValueError: No design is feasible, or the margin is below 0.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.0], [0.5], [0.7]], [[3.0], [1.0], [2.0]])
            >>> table.under(limits={"f1": 2.0}).refined_bounds(margin=0.5)
            (array([0.4]), array([0.8]))
        """
        if finite_number("margin", margin) < 0:
            raise invalid("margin", "0 or more", margin)
        feasible = self.take(self.feasible())
        if not len(feasible):
            raise none_feasible(self)
        return self.evaluated.bounds_around(feasible.data, margin)

    # Tables put together

    def extended(self, *blocks: TestTable) -> TestTable:
        """Return this table with the tests of others appended, in their order.

        Joining many blocks in one call copies the rows once. An output that one of them does not
        have is NaN for its tests.

        Raises:
            ArgumentValueError: A block has other columns, or a test occurs twice.

        Example:
            >>> first, second = (TestTable.of([n], [[0.1 * n]], [[1.0]]) for n in (1, 2))
            >>> first.extended(second).numbers
            array([1, 2])
        """
        whole = stacked([self, *blocks])
        require_distinct(whole.numbers)
        return whole

    def merge(self, other: TestTable) -> TestTable:
        """Return the tests of this and another run of the same problem, ordered by their numbers.

        ``PSI(1024)`` and ``PSI(3072, first=1025)`` merged are ``PSI(4096)``. A test in both tables
        counts once, with the outputs and notes of both.

        Raises:
            ArgumentValueError: The tables differ in names, directions, units, bounds, tolerance or
                problem, or in results of a test by more than rounding.

        Example:
            >>> ahead = TestTable.of([3, 4], [[0.25], [0.75]], [[1], [3]])
            >>> TestTable.of([1, 2], [[0.0], [0.5]], [[0], [2]]).merge(ahead).numbers
            array([1, 2, 3, 4])
        """
        instance("other", other, TestTable)
        return merged(self, other)

    def equals(self, other: object) -> bool:
        """Whether another table is equal in every column, value and decision.

        NaN is equal to NaN. What is not written to files, such as remarks, is not compared.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]])
            >>> table.equals(table.take([0, 1])), table.equals(table.take([0]))
            (True, False)
        """
        return isinstance(other, TestTable) and are_equal(self, other)

    # For readers

    def __repr__(self) -> str:
        """Return the size of the table, and that of its study if this has further tests."""
        sizes = []
        schema = self.schema
        for word in ("variable", "objective", "constraint", "output"):
            names = getattr(schema, f"{word}s")
            if names or word != "output":
                sizes.append(counted(len(names), word))
        tests = counted(len(self), schema.words["row"])
        if self.n_stored > len(self):
            tests += f", the study has {self.n_stored}"
        return f"TestTable({tests}: {self.status_counts()}; {', '.join(sizes)})"

    def status_counts(self) -> str:
        """Return how many rows have each status, in words.

        Example:
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("nan")]]).status_counts()
            '1 ok, 0 infeasible, 1 failed'
        """
        n_ok, n_infeasible, n_failed = np.bincount(self._codes, minlength=3)
        word = self.schema.words["failed"]
        return f"{n_ok} ok, {n_infeasible} infeasible, {n_failed} {word}"

    def to_frame(self) -> pd.DataFrame:
        """Return the table with one row per test.

        Returns:
            Index ``test``; a column for each variable, objective, constraint, output, label and
            note under its name, objectives in the original direction; ``status``; ``violated``, the
            names of the constraints a design violates; ``reason``, why it failed; ``pareto``.
            Beside a column of another program's file with such a name they are called ``status
            (pymoo-psi)`` and so on.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[0.0], [0.1]])
            >>> print(table.to_frame().drop(columns="reason"))
                   x1   f1   g1      status violated  pareto
            test
            1     0.0  1.0  0.0          ok             True
            2     0.5  2.0  0.1  infeasible       g1   False
        """
        import pandas as pd

        return pd.DataFrame(self.display_columns()).set_index(TEST)

    def display_columns(self) -> Columns:
        """Return the columns of a frame: the numbers, the cells, and what follows from them.

        Example:
            >>> [*TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]]).display_columns()]
            ['test', 'x1', 'f1', 'status', 'violated', 'reason', 'pareto']
        """
        columns: Columns = {TEST: self.numbers}
        for name in self.columns:
            columns[name] = self.column(name)
        results = result_columns(self.columns)
        columns[results["status"]] = self.status.astype(object)
        mask, names = self.violations()
        texts = [", ".join(compress(names, row)) for row in mask.tolist()]
        columns[results["violated"]] = np.fromiter(texts, object)
        columns[results["reason"]] = reason_cells(self)
        columns[results["pareto"]] = self.pareto()
        return columns

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        frame = self.take(np.arange(len(self))[:n]).to_frame()
        results = result_columns(self.columns)
        frame[results["pareto"]] = False  # that of ten rows is another one than that of all
        dropped = [name for name in results.values() if not frame[name].any()]
        headings = {column.name: column.heading for column in self.schema.columns}
        return frame.drop(columns=dropped).rename(columns=headings), len(self)

    def to_csv(self, path: FilePath) -> None:
        """Write the table; :func:`read_table` reads it back without a change.

        The columns are those of :meth:`to_frame`, with units in the header, such as ``mass [kg]``.
        ``FILE.csv-metadata.json`` beside the file holds names, directions, units, bounds and
        tolerance, in the W3C's vocabulary for tabular data (CSVW); keep both together. Before
        version 3.1 pandas needs ``float_precision="round_trip"`` to read the last digit. If writing
        is interrupted, the old files stay as they were.

        Raises:
            ArgumentValueError: The file is a workbook or a study by its name, or another program
                has written metadata of it.
            OSError: A file cannot be written.

        Example:
            >>> import os, tempfile
            >>> import pandas as pd
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = os.path.join(folder, "table.csv")
            ...     table.to_csv(path)
            ...     print(pd.read_csv(path, index_col="test")[["x1", "f1"]])
                   x1   f1
            test
            1     0.0  3.0
            2     0.5  4.0
        """
        write_csv(path, self.display_columns() | columns_of(self), marked(self))

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Pickle the attributes, without what follows from them."""
        return TestTable, tuple(getattr(self, attribute.name) for attribute in fields(self))

    def __deepcopy__(self, memo: dict[int, Any]) -> TestTable:
        """Return the table itself, which never changes; pymoo copies its algorithms often."""
        return self


def require_table(table: object) -> None:
    """Refuse what is no table, such as an array or the name of a file."""
    instance("table", table, TestTable, "pymoo_psi.read_table(...) makes one of any source")


def _writable_reasons(reasons: Mapping[int, str], numbers: Integers) -> dict[int, str]:
    """Return reasons of tests by their numbers, without characters that files cannot hold."""
    writable = {}
    for number, reason in reasons.items():
        text = str(reason).encode("utf-8", "backslashreplace").decode("utf-8")
        writable[int(number)] = text.replace("\0", "␀") or "no reason given"
    for number in writable.keys() - numbers.tolist():
        raise invalid("reasons", "by the numbers of tests", number)
    return writable


def _matrix(name: str, values: ArrayLike | None, n: int) -> Array:
    """Return values as a new matrix of n rows; without any it has no columns."""
    if values is None:
        return np.zeros((n, 0))
    return np.array(real_array(name, values), order="C", ndmin=1)
