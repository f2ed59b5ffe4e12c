"""Tests under a formulation: rows, columns, and the arrays that pymoo and Pareto sets take.

The attributes are what a file keeps. All else follows from them, and is computed when it is asked
for. This is the only place that knows signs: ``F`` is minimised, columns have the original
direction.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._kinds import first_of, matrix_of
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Columns,
    Entries,
    Integers,
    Mask,
    Received,
    Rows,
    invalid,
    known_name,
    real_array,
    require_shape,
)
from pymoo_psi.pareto import nondominated, violated_constraints
from pymoo_psi.table._cells import in_decimals, real_column
from pymoo_psi.table._decision import Decision
from pymoo_psi.table._expression import Expression
from pymoo_psi.table._formulation import Formulation
from pymoo_psi.table._limits import Limit
from pymoo_psi.table._schema import (
    EQUALITY,
    INEQUALITY,
    NOT_OF_DESIGNS,
    OBJECTIVE,
    TEST,
    VARIABLE,
    Column,
    Schema,
)

if TYPE_CHECKING:
    from typing_extensions import Self

MATRICES = {"F": OBJECTIVE, "G": INEQUALITY, "H": EQUALITY}
STATUSES = ("ok", "infeasible", "failed")
_OK, _INFEASIBLE, _FAILED = range(3)


@dataclass(frozen=True, eq=False, repr=False)
class View:
    """The rows, columns and arrays of n tests under a formulation; see :class:`TestTable`."""

    evaluated: Schema
    data: Columns
    numbers: Integers
    failures: Mapping[int, str] = field(default_factory=dict)
    decision: Decision = field(default_factory=Decision)
    problem: Entries | None = None
    remarks: tuple[str, ...] = ()
    decimal: str = "."
    separator: str = ","
    n_stored: int = 0

    def __post_init__(self) -> None:
        """Make the arrays read-only, as all formulations share them, and check their lengths."""
        for name, cells in {"numbers": self.numbers, **self.data}.items():
            require_shape(f"column {name!r}", cells, self.numbers.shape)
            cells.setflags(write=False)

    def __len__(self) -> int:
        """Return the number of tests."""
        return len(self.numbers)

    # What is asked

    @property
    def formulation(self) -> Formulation:
        """Objectives, limits, ranges, normalisation, computed columns.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]])
            >>> table.under(limits="f1<=1.5").formulation
            Formulation(limits={'f1': [None, 1.5]})
        """
        return self.decision.formulation

    @property
    def fixed_ranges(self) -> Mapping[str, Sequence[float]]:
        """Fixed ranges of all objectives by name; empty where those of the Pareto set count.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]])
            >>> table.under(ranges={"f1": (0, 9)}).fixed_ranges
            {'f1': [0.0, 9.0]}
        """
        return self.formulation.ranges or {}

    @cached_property
    def schema(self) -> Schema:
        """The columns, in the roles that the formulation gives them.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1, 3], [2, 2]])
            >>> table.under(objectives=["f2"]).schema.outputs
            ('f1',)
        """
        return self.formulation.roles_in(self.evaluated)

    @cached_property
    def _columns(self) -> Columns:
        """The columns of the formulation, with computed ones, in the original directions."""
        if self.schema is self.evaluated:
            return self.data
        columns = dict(self.data)
        for name, text in self.formulation.computed.items():
            columns[name] = in_decimals(Expression.of(text).values(columns))
        for name in self.schema.objectives:
            columns[name] = real_column(name, columns[name])
            if name in self.evaluated.of_role(EQUALITY):
                columns[name] = np.abs(columns[name])
        for cells in columns.values():
            cells.setflags(write=False)
        return columns

    # Rows and columns

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns: variables, objectives, constraints, outputs, label and notes.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1], [[0.5]], [[2.0, 3.0]]).columns
            ('x1', 'f1', 'f2')
        """
        return self.schema.names

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of tests and of columns.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1], [[0.5]], [[2.0, 3.0]]).shape
            (1, 3)
        """
        return len(self), len(self.columns)

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the columns, as a data frame does."""
        return iter(self.columns)

    def column(self, name: str) -> AnyArray:
        """``(n,)`` values of a column; objectives are in the original direction.

        Raises:
            ArgumentValueError: There is no such column.
            ArgumentTypeError: The name is not text.

        Example:
            >>> from pymoo_psi import TestTable
            >>> schema = Schema.of(["width"], ["mass", "gain"], maximize=["gain"])
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[3, -0.8], [4, -0.9]], schema=schema)
            >>> table.column("width"), table["gain"]
            (array([0.1, 0.5]), array([0.8, 0.9]))
        """
        return self._columns[known_name("column", name, self.columns)]

    def __getitem__(self, name: str) -> AnyArray:
        """Return the ``(n,)`` values of a column: :meth:`column`."""
        return self.column(name)

    def take(self, selection: ArrayLike) -> Self:
        """Return the table of some rows.

        Args:
            selection: ``(n,)`` mask, or ``(k,)`` indices of rows in the wanted order. A mask or an
                index of :meth:`to_frame` selects by numbers of tests, however it is sorted.

        Raises:
            ArgumentValueError: The selection is neither mask nor indices; a mask is not of
                shape (n,), an index is out of range or occurs twice.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]])
            >>> table.take([2, 0]).numbers, table.take(table.F[:, 0] > 1).numbers
            (array([3, 1]), array([2, 3]))
        """
        rows = self._rows_of(selection)
        numbers = self.numbers.take(rows)
        require_distinct(numbers)
        failures = self.failures
        if failures:
            selected = {*numbers.tolist()}
            failures = {number: why for number, why in failures.items() if number in selected}
        # `take` of an array needs a quarter of the time of an index in brackets.
        data = {name: cells.take(rows) for name, cells in self.data.items()}
        table = replace(self, data=data, numbers=numbers, failures=failures)
        if "_front" in vars(self) and self._front[rows].all():
            # A part of a Pareto set is one. Of 2^20 points, the search takes a third of the time.
            vars(table)["_front"] = np.ones(len(rows), dtype=bool)
        return table

    def _rows_of(self, selection: Any) -> Rows:
        """Return the indices of the rows that :meth:`take` selects."""
        rows = selection
        if str(getattr(rows, "dtype", "")) in ("bool", "boolean"):
            rows = self._by_row(rows, False)
        elif getattr(rows, "name", None) == TEST and hasattr(rows, "get_indexer"):  # of pandas
            row_of_number = {number: row for row, number in enumerate(self.numbers.tolist())}
            rows = [row_of_number.get(number, len(self)) for number in rows]
        indices = np.asarray(rows)
        rule = "a mask or indices of rows"
        if indices.ndim != 1:
            raise invalid("selection", rule, Received(f"shape {indices.shape}"))
        if indices.size == 0:  # numpy makes float64 of [], which selects no row and is no mistake
            indices = indices.astype(np.intp)
        try:
            return np.asarray(np.arange(len(self))[indices])
        except IndexError as error:
            raise invalid("selection", rule, Received(error)) from None

    def _by_row(self, values: Any, missing: Any) -> Any:
        """Return a series of pandas in the order of the rows, if it has numbers of tests."""
        if getattr(getattr(values, "index", None), "name", None) == TEST:
            return values.reindex(self.numbers, fill_value=missing).to_numpy()
        return values

    # Matrices, as pymoo has them

    def _matrix(self, role: str) -> AnyArray:
        """Return the columns of a role as a matrix, of objects if their types differ."""
        data = self._columns  # also without a column of the role: an expression may be wrong
        columns = [minimized(column, data[column.name]) for column in self.schema.with_role(role)]
        matrix = matrix_of(columns, len(self))
        matrix.setflags(write=False)
        return matrix

    @cached_property
    def F(self) -> Array:
        """``(n, m)`` objectives, all minimised; NaN or infinite where a design failed.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]])
            >>> table.under(maximize=["f1"]).F.tolist()
            [[-1.0], [-2.0]]
        """
        return self._matrix(OBJECTIVE)

    @cached_property
    def G(self) -> Array:
        """``(n, n_ieq)`` inequality constraints, met where <= 0.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]], G=[[-1], [0.5]]).G.tolist()
            [[-1.0], [0.5]]
        """
        return self._matrix(INEQUALITY)

    @cached_property
    def H(self) -> Array:
        """``(n, n_eq)`` equality constraints, met where ``|h|`` is within the tolerance.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]], H=[[0], [0.5]]).status.tolist()
            ['ok', 'infeasible']
        """
        return self._matrix(EQUALITY)

    @cached_property
    def X(self) -> AnyArray:
        """``(n, n_var)`` designs.

        They are float64; int64 or bool if all variables are integers or all binary; object if they
        differ, or are choices.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1, 2], [[1, "oak"], [2, "tin"]], [[1], [2]]).X.tolist()
            [[1, 'oak'], [2, 'tin']]
        """
        return self._matrix(VARIABLE)

    # Limits and status

    @cached_property
    def limits(self) -> dict[str, Limit]:
        """The limits by column, in the order of the table's columns, those on texts last.

        Raises:
            ArgumentValueError: A column is unknown or a constraint, has other values, or it is
                unclear which side of it a number limits.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [["oak"], ["tin"]], [[1.0], [2.0]])
            >>> [limit.written(name) for name, limit in table.under(
            ...     limits="x1=tin, f1<=1.5").limits.items()]
            ['f1<=1.5', 'x1=tin']
        """
        schema = self.schema
        limits = {}
        for name, limit in self.formulation.allowed.items():
            if name not in schema.names and self._have_failed.all():
                continue  # which outputs a model has is unknown before its first value
            limit = limit.fitted(name, schema)
            if limit != Limit():
                limits[name] = limit
        # The order of the columns, not of the mapping: columns of violations stand in it.
        on_numbers = [name for name in limits if limits[name].texts is None]
        on_numbers.sort(key=schema.values.index)
        return {name: limits[name] for name in dict.fromkeys([*on_numbers, *limits])}

    @property
    def _have_failed(self) -> Mask:
        """``(n,)`` which tests failed in their evaluation."""
        return np.isin(self.numbers, [*self.failures])

    def _violated(self) -> Mask:
        """``(n, k)`` which tests violate each constraint, and then each limit.

        A design that a requirement kept from running violates no limit.
        """
        constraints = violated_constraints(self.G, self.H, self.schema.eq_tolerance)
        has_run = ~constraints.any(axis=1) | np.isfinite(self.F).any(axis=1)
        masks = [constraints]
        for name, limit in self.limits.items():
            masks.append(has_run & (limit.excess(name, self._columns[name]) > 0))
        return np.column_stack(masks)

    @cached_property
    def _codes(self) -> NDArray[np.int8]:
        """``(n,)`` the indices of the statuses: a text takes 40 bytes.

        A test failed if its evaluation did, or if it meets its constraints and limits but an
        objective is not finite. All others are infeasible if they violate one, else ok.
        """
        codes = np.asarray(self._violated().any(axis=1)).astype(np.int8)
        codes[(codes == _OK) & ~np.isfinite(self.F).all(axis=1)] = _FAILED
        codes[self._have_failed] = _FAILED
        return codes

    @property
    def status(self) -> NDArray[np.str_]:
        """``(n,)`` "ok", "infeasible" (violates a constraint or a limit) or "failed".

        It follows from constraints, limits and reasons; a test whose objectives could not be
        computed failed.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("nan")]]).status.tolist()
            ['ok', 'failed']
        """
        return np.asarray(np.array(STATUSES)[self._codes])

    def failed(self) -> Mask:
        """``(n,)`` which tests failed.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("nan")]]).failed()
            array([False,  True])
        """
        return np.asarray(self._codes == _FAILED)

    def feasible(self) -> Mask:
        """``(n,)`` which designs are "ok": constraints and limits are met, objectives finite.

        Example:
            >>> from pymoo_psi import TestTable
            >>> X, F, G = [[0.1], [0.5], [0.9]], [[1], [2], [3]], [[0.5], [0.0], [0.0]]
            >>> table = TestTable.of([1, 2, 3], X, F, G)
            >>> table.feasible()
            array([False,  True,  True])
            >>> table.under(limits={"f1": 2}).feasible()
            array([False,  True, False])
        """
        return np.asarray(self._codes == _OK)

    @cached_property
    def reasons(self) -> Mapping[int, str]:
        """Why tests failed, by their numbers.

        Example:
            >>> from pymoo_psi import TestTable
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("inf")]]).reasons
            {2: 'f1 is inf'}
        """
        reasons = dict(self.failures)
        for row in np.flatnonzero(self.failed() & ~self._have_failed).tolist():
            name = self.schema.objectives[int(np.argmin(np.isfinite(self.F[row])))]
            reasons[int(self.numbers[row])] = f"{name} is {self._columns[name][row]}"
        return reasons

    def violations(self) -> tuple[Mask, tuple[str, ...]]:
        """Return which constraints and limits each design violates, and their names.

        Returns:
            ``(n, k)`` mask, with a column for each constraint and then for each limit, and the k
            names, of limits as they are written. Rows of failed designs are False, and so are the
            limits of designs that did not run because of a requirement.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[2.0], [-2.0]])
            >>> mask, names = table.under(limits={"f1": 1.5}).violations()
            >>> mask.tolist(), names
            ([[True, False], [False, True]], ('g1', 'f1<=1.5'))
        """
        texts = [limit.written(name) for name, limit in self.limits.items()]
        mask = self._violated()
        mask[self.failed()] = False
        return mask, (*self.schema.constraints, *texts)

    # The Pareto set, in which each design is once

    def pareto(self) -> Mask:
        """``(n,)`` which designs are Pareto optimal among the feasible ones.

        Tests of the same design count once, by the first of them; see :attr:`repeats`.

        Example:
            Without a limit on f1 no design beats another; with one there are fewer to compare.

            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1, 3], [2, 2], [3, 3]])
            >>> table.pareto()
            array([ True,  True, False])
            >>> table.under(limits={"f1": 1.5}).pareto()
            array([ True, False, False])
        """
        return self._front.copy()

    @property
    def repeats(self) -> Mask:
        """``(n,)`` which tests repeat the design, the objectives and all texts of an earlier one.

        PSI calls the model once for each design, and a Pareto set contains the first test only.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2, 3], [[4], [5], [4]], [[0.3], [0.2], [0.3]])
            >>> table.repeats
            array([False, False,  True])
        """
        return self._repeated(np.arange(len(self)))

    @property
    def ranked_as(self) -> Rows:
        """``(n,)`` the row as which each test is ranked: of a repeated design, that of the first.

        It is that of the first feasible one; a test that is not feasible is not ranked, and has its
        own row.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2, 3], [[4], [5], [4]], [[0.3], [0.2], [0.3]])
            >>> table.ranked_as
            array([0, 1, 0])
        """
        result = np.arange(len(self))
        rows = np.flatnonzero(self.feasible())
        result[rows] = rows[self._firsts(rows)]
        return result

    @cached_property
    def _front(self) -> Mask:
        """``(n,)`` which designs are Pareto optimal among those that are ok, each once."""
        mask = self.feasible()
        if self.schema.objectives:  # without them no design is better than another
            mask[mask] = nondominated(self.F[mask])
        mask[mask] = ~self._repeated(np.flatnonzero(mask))
        return mask

    def _repeated(self, rows: Rows) -> Mask:
        """Return which of some tests repeat design, objectives and notes of an earlier one of them.

        The design is that of all variables, also of those that the formulation makes objectives.
        """
        return self._firsts(rows) < np.arange(len(rows))

    def _firsts(self, rows: Rows) -> Rows:
        """Return for each of some tests which of them is the first that it repeats, or itself."""
        variables = self.evaluated.variables
        result = np.arange(len(rows))
        if not variables:  # no design equals another
            return result
        # A row with an objective that occurs once occurs once. Here, NaN is a number like others.
        firsts = np.zeros(len(rows))
        if self.schema.objectives:
            firsts = np.nan_to_num(self.F[rows, 0])
        values, counts = np.unique(firsts, return_counts=True)
        places = np.flatnonzero(np.isin(firsts, values[counts > 1]))
        rows = rows[places]
        designs = {name: self.data[name][rows] for name in variables}
        parts = [self.evaluated.keys(designs), map(bytes, self.F[rows])]
        for name in self.evaluated.notes:
            if name not in NOT_OF_DESIGNS:
                parts.append(map(str, self.data[name][rows]))
        result[places] = places[first_of(zip(*parts, strict=True))]
        return result


def minimized(column: Column, cells: AnyArray) -> AnyArray:
    """Return cells with the opposite sign if they are objectives to be maximised, and back."""
    if column.role == OBJECTIVE and column.maximize:
        return -cells
    return cells


def columns_of_matrix(name: str, matrix: Array, schema: Schema, n: int) -> Columns:
    """Return the columns of an ``(n, k)`` matrix F, G or H, in the original directions."""
    columns = schema.with_role(MATRICES[name])
    require_shape(name, matrix, (n, len(columns)))
    return {column.name: minimized(column, matrix[:, j]) for j, column in enumerate(columns)}


def checked_numbers(value: ArrayLike) -> Integers:
    """Return numbers of tests as a new array: distinct integers from 1."""
    array = real_array("numbers", value)
    # Beyond 2^53 not every integer is a float64.
    if array.ndim != 1 or not ((array >= 1) & (array < 2**53) & (array == np.floor(array))).all():
        raise invalid("numbers", "one-dimensional, of integers from 1 to 2^53", value)
    numbers = array.astype(np.int64)
    require_distinct(numbers)
    return numbers


def require_distinct(numbers: Integers) -> None:
    """Refuse duplicate numbers of tests."""
    ordered = np.sort(numbers, kind="stable")  # fast where they ascend, but for a few places
    twice = ordered[1:][ordered[1:] == ordered[:-1]]
    if len(twice):
        raise invalid("the tests of a table", "distinct", Received(f"test {twice[0]} twice"))
