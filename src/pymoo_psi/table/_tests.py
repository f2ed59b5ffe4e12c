"""Tests as columns: the data of a test table, and the selection of rows and columns."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Entries,
    Integers,
    Mask,
    Names,
    Received,
    Rows,
    Values,
    counted,
    invalid,
    known_name,
    real_array,
    require_shape,
)
from pymoo_psi.pareto import row_of_design, violated_constraints
from pymoo_psi.table._formulation import Allowed, Formulation, limits_of, limits_on
from pymoo_psi.table._layout import (
    NUMBERS,
    Layout,
    blank,
    column_kinds,
    design_matrix,
    first_rows,
    number_column,
    real_column,
)

if TYPE_CHECKING:
    from typing_extensions import Self


STATUSES = ("ok", "infeasible", "failed")
_N_SHOWN = 50  # the most rows whose texts a message names
_ARRAYS = ("numbers", "X", "F", "G", "H", "outputs", "_codes")  # arrays with a row for each test


@dataclass(frozen=True, eq=False, repr=False)
class Tests:
    """A table of tests or designs, in the order of testing.

    Made by :meth:`of` from arrays, by :meth:`empty` and :meth:`extended` block after block, or by
    :func:`read_table`. A table never changes; its arrays are read-only.

    A table has a :class:`Formulation`: objectives, limits, normalisation. :meth:`under` returns the
    same tests under another one, without an evaluation: ``table.under(limits={"mass":
    30}).pareto()``.

    ``F`` is as in pymoo: all objectives are minimised, and those to be maximised
    (``layout.maximize``) have the opposite sign. Everywhere else, objectives are in the original
    direction: ``table["mass"]``, limits, frames, files, plots.

    Attributes:
        layout: Names and units of all columns, directions of the objectives, kinds and bounds of
            the variables, the tolerance of equality constraints.
        numbers: ``(n,)`` numbers of the test points, from 1, each once.
        X: ``(n, n_var)`` designs: float64; int64 or bool if all variables are integers or all
            binary; object if they differ, or are choices.
        F: ``(n, m)`` objectives, all minimised; NaN or infinite where a design failed.
        G: ``(n, n_ieq)`` inequality constraints, met where <= 0.
        H: ``(n, n_eq)`` equality constraints, met where ``|h|`` is within the tolerance.
        reasons: Why designs failed, for the numbers of their test points.
        outputs: ``(n, k)`` further outputs of the model, named ``layout.outputs``; NaN if a design
            failed, or an earlier version of the model did not return it.
        problem: The identity of the problem: name, parameters, sampling and key, by which studies
            distinguish problems; ``None`` if unknown.
        extra: ``(n,)`` columns with other content, such as texts of a file.
        remarks: Sentences on what a reader must know about the rows; they are not written to files.
        formulation: Objectives, limits, ranges, normalisation, computed columns, a chosen design.
        decimal: The decimal mark of the source, which the page and files written use.
        separator: The mark between the cells of the source, which files written use.

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

    layout: Layout
    numbers: Integers
    X: AnyArray
    F: Array
    G: Array
    H: Array
    reasons: Mapping[int, str] = field(default_factory=dict)
    outputs: Array = None  # type: ignore[assignment]  # its default has the shape (n, 0)
    problem: Entries | None = None
    extra: Mapping[str, NDArray[np.object_]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    formulation: Formulation = field(default_factory=Formulation)
    decimal: str = "."
    separator: str = ","
    # ``(n,)`` the indices of their statuses: a text takes 40 bytes.
    _codes: NDArray[np.int8] = field(init=False)
    # The tests as they were before `under`; None if they are that themselves. It is an argument of
    # the class so that `dataclasses.replace` keeps it.
    _tested: Tests | None = None
    # How many tests the study has in which these are kept; 0 if they are in none.
    _n_stored: int = field(default=0, init=False)
    # The Pareto-optimal designs, once they are known. It is no field: no other table takes it over.
    _pareto: ClassVar[Mask | None] = None

    def __post_init__(self) -> None:
        """Bring the arrays into their normal form and check that they belong together."""
        layout = self.layout
        numbers = _point_numbers(self.numbers)
        n = len(numbers)
        arrays = {"X": design_matrix("X", self.X, layout.variables, layout.kinds)}
        for name in ("F", "G", "H", "outputs"):
            values = getattr(self, name)
            if values is None:
                values = np.zeros((n, 0))
            arrays[name] = np.array(real_array(name, values), order="C")
        for name, names in layout.blocks.items():
            require_shape(name, arrays[name], (n, len(names)))
        if self._tested is None and self.formulation.without_columns() != self.formulation:
            raise invalid(
                "formulation of new tests",
                "without objectives, omitted constraints, computed columns and units",
                self.formulation,
                "use table.under(formulation)",
            )
        extra = extra_columns(self.extra, layout, n)
        self._set(arrays | {"numbers": numbers, "extra": extra})
        self._check_ranges()
        self._set_status(self.reasons)
        # Which outputs a model gives is known as soon as it has run for a test without failing.
        run = ~self.failed() & np.isfinite(self.F).any(axis=1)
        if run.any():
            for name in layout.units:
                known_name("units", name, layout.columns)

    def _check_ranges(self) -> None:
        ranges = self.formulation.ranges
        if ranges and {*ranges} != {*self.layout.objectives}:
            raise invalid(
                "ranges",
                f"of every objective ({', '.join(self.layout.objectives)}), or of none",
                Received([*ranges]),
            )

    def _set_status(self, reasons: Mapping[int, str]) -> None:
        """Derive the status of the tests, and the reasons of failures.

        A test failed if it has a reason, or if it meets its constraints and limits but an objective
        is not finite. All others are infeasible if they violate a constraint or a limit, else ok.
        """
        reasons = _writable_reasons(reasons)
        failed = np.isin(self.numbers, list(reasons))
        violates = np.asarray(self._violated(self._limits(failed)).any(axis=1))
        is_finite = np.isfinite(self.F).all(axis=1)
        for row in np.flatnonzero(~failed & ~violates & ~is_finite):
            reasons[int(self.numbers[row])] = nonfinite_objective(self, row)
            failed[row] = True
        codes = violates.astype(np.int8)
        codes[failed] = STATUSES.index("failed")
        self._set({"_codes": codes, "reasons": reasons})

    @property
    def status(self) -> NDArray[np.str_]:
        """``(n,)`` "ok", "infeasible" (violates a constraint or a limit) or "failed".

        It follows from constraints, limits and reasons; a test whose objectives could not be
        computed failed.

        Example:
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("nan")]]).status.tolist()
            ['ok', 'failed']
        """
        return np.asarray(np.array(STATUSES)[self._codes])

    def failed(self) -> Mask:
        """``(n,)`` which tests failed.

        Example:
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("nan")]]).failed()
            array([False,  True])
        """
        return np.asarray(self._codes == STATUSES.index("failed"))

    def _violated(self, allowed: Mapping[str, Allowed]) -> Mask:
        """``(n, k)`` which tests violate each constraint, and then each limit.

        A design that a requirement kept from running violates no limit.
        """
        constraints = violated_constraints(self.G, self.H, self.layout.eq_tolerance)
        masks = [constraints]
        if allowed:
            has_run = ~constraints.any(axis=1) | np.isfinite(self.F).any(axis=1)
            for name, limit in allowed.items():
                masks.append(((self.excess(name, limit) > 0) & has_run)[:, None])
        return np.hstack(masks)

    def excess(self, name: str, limit: Allowed) -> Array:
        """``(n,)`` by how much tests exceed a limit on a column.

        It is infinite if a number is not finite, and 1 if a text is not allowed.

        Raises:
            ArgumentValueError: The column has no such values.
            ArgumentTypeError: It holds other values than numbers.

        Example:
            >>> table = TestTable.of([1, 2], [["oak"], ["tin"]], [[1.0], [2.5]])
            >>> table.excess("f1", (0.0, 2.0)), table.excess("x1", ["tin"])
            (array([0. , 0.5]), array([1., 0.]))
        """
        if isinstance(limit, list):
            return np.where(self._has_texts(name, limit), 0.0, 1.0)
        values = real_column(name, self.column(name))
        low, high = limit
        # Differences of float64 have the sign of the comparison: gradual underflow sees to it.
        with np.errstate(over="ignore", invalid="ignore"):
            excess = np.maximum(low - values, 0) + np.maximum(values - high, 0)
        # Infinity is what a division by zero leaves: nothing that is known to be large enough.
        return np.asarray(np.where(np.isfinite(values), excess, np.inf))

    def _has_texts(self, name: str, texts: Names) -> Mask:
        """``(n,)`` which tests have one of some texts in a column; a missing one is empty."""
        known_name("a name in limits", name, self.columns)
        kinds = dict(zip(self.layout.variables, self.kinds, strict=True))
        if name not in self.extra and kinds.get(name) is not Kind.CHOICE:
            raise invalid(
                f"{name!r} in limits",
                "numbers, as its values are",
                [*texts],
                "a limit on numbers is such as '<= 250'",
            )
        cells = np.where(blank(self.column(name)), "", self.column(name)).astype(str)
        mask = np.isin(cells, [*texts])
        if texts and len(cells) and not mask.any():
            known_name(f"{name!r} in limits", texts[0], {*cells[:_N_SHOWN].tolist()})
        return mask

    @property
    def limits(self) -> dict[str, Allowed]:
        """The limits by column: the least and the greatest value, or the allowed texts.

        They are in the order of the columns, columns of texts last; an open end is infinite.

        Example:
            >>> table = TestTable.of([1, 2], [["oak"], ["tin"]], [[1.0], [2.0]])
            >>> table.under(limits="f1<=1.5, x1=tin").limits
            {'f1': (-inf, 1.5), 'x1': ['tin']}
        """
        return self._limits(self.failed())

    def _limits(self, failed: Mask) -> dict[str, Allowed]:
        limits = limits_of(self.formulation.limits)
        if failed.all():  # the first tests may fail: which outputs there are is unknown then
            columns = self.columns
            limits = {name: limit for name, limit in limits.items() if name in columns}
        return limits_on(limits, self.layout)

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
        layout: Layout | None = None,
        extra: Entries | None = None,
    ) -> Self:
        """Return a table of evaluated designs; their status follows from the constraints.

        A design with a reason has failed, as has one that meets its constraints but has an
        objective that is not finite.

        Args:
            numbers: ``(n,)`` numbers of the test points, from 1, each once.
            X: ``(n, n_var)`` designs, or n mappings from variable to value.
            F: ``(n, m)`` objectives, all minimised: negatives of those that the layout maximises.
                NaN and infinity are allowed.
            G: ``(n, n_ieq)`` inequality constraints, met where <= 0.
            H: ``(n, n_eq)`` equality constraints, met within the tolerance.
            outputs: ``(n,)`` further outputs of the model, by name. They are added to those of the
                layout, which are NaN if not given.
            reasons: Why designs failed, for their numbers.
            layout: Names, directions, units, kinds, bounds and tolerance. By default names are x1,
                f1, …, all objectives are minimised, and there are no bounds.
            extra: ``(n,)`` other columns, by name.

        Raises:
            ArgumentValueError: The arrays do not fit one another or the layout.
            ArgumentTypeError: An array holds what it cannot.

        Example:
            >>> table = TestTable.of([1, 2], X=[[0.0], [0.5]], F=[[3.0], [4.0]], G=[[0.0], [0.1]])
            >>> table.status.tolist()
            ['ok', 'infeasible']
        """
        if layout is None:
            X = design_matrix("X", X)
            layout = Layout.of(X.shape[1], _width("F", F), _width("G", G), _width("H", H))
        columns = outputs or {}
        names = tuple(dict.fromkeys((*layout.outputs, *columns)))
        further = np.full((len(np.asarray(numbers)), len(names)), np.nan)
        for j, name in enumerate(names):
            if name in columns:
                column = real_array(f"the output {name!r}", columns[name])
                require_shape(f"the output {name!r}", column, further.shape[:1])
                further[:, j] = column
        arrays = {"numbers": numbers, "X": X, "F": F, "G": G, "H": H, "outputs": further}
        layout = replace(layout, outputs=names)
        return cls(layout, reasons=reasons or {}, extra=extra or {}, **arrays)

    @classmethod
    def empty(cls, layout: Layout | None = None) -> Self:
        """Return a table without any test.

        Args:
            layout: Names, kinds, bounds and tolerance. Without one the table takes the layout of
                the first block it is extended by.

        Example:
            >>> table = TestTable.empty()
            >>> len(table), len(table.extended(TestTable.of([1], [[0.5]], [[2.0]])))
            (0, 1)
        """
        layout = Layout.of() if layout is None else layout
        blocks: Any = {name: np.zeros((0, len(names))) for name, names in layout.blocks.items()}
        return cls(layout, np.zeros(0, dtype=np.int64), **blocks)

    def __repr__(self) -> str:
        """Return the size of the table, and that of its study if this has further tests."""
        layout = self.layout
        sizes = []
        for word in ("variable", "objective", "constraint", "output"):
            names = getattr(layout, f"{word}s")
            if names or word != "output":
                sizes.append(counted(len(names), word))
        tests = counted(len(self), layout.words["row"])
        if self._n_stored > len(self):
            tests += f", the study has {self._n_stored}"
        return f"TestTable({tests}: {self.status_counts()}; {', '.join(sizes)})"

    def of_study(self, n_stored: int) -> Self:
        """Return these tests as a part of those of a study, which has ``n_stored``.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [2.0]])
            >>> repr(table.of_study(64)).partition(";")[0]
            'TestTable(2 tests, the study has 64: 2 ok, 0 infeasible, 0 failed'
        """
        return self._with(_n_stored=n_stored)

    def status_counts(self) -> str:
        """Return how many rows have each status, in words.

        Example:
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("nan")]]).status_counts()
            '1 ok, 0 infeasible, 1 failed'
        """
        counts = [f"{np.sum(self.status == status)} {status}" for status in STATUSES]
        return ", ".join(counts).replace("failed", self.layout.words["failed"])

    def __len__(self) -> int:
        """Return the number of tested points."""
        return len(self.numbers)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns: variables, objectives, constraints, outputs, extra ones.

        Example:
            >>> TestTable.of([1], [[0.5]], [[2.0, 3.0]]).columns
            ('x1', 'f1', 'f2')
        """
        return (*self.layout.columns, *self.extra)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of tests and of columns.

        Example:
            >>> TestTable.of([1], [[0.5]], [[2.0, 3.0]]).shape
            (1, 3)
        """
        return len(self), len(self.columns)

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the columns, as a data frame does."""
        return iter(self.columns)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """The kind of each variable, by the layout or else by the values of the designs.

        Example:
            >>> table = TestTable.of([1], [{"width": 0.5, "teeth": 12, "metal": "iron"}], [[1.0]])
            >>> [kind.value for kind in table.kinds]
            ['real', 'integer', 'choice']
        """
        return self.layout.kinds or column_kinds(self.X)

    @property
    def names(self) -> list[str]:
        """Unique names of the n designs: labels, or otherwise test points or numbers of tests.

        Designs that share a label get their number appended; a label that is a number is preceded
        by the name of its column.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]])
            >>> table.names
            ['test point 1', 'test point 2', 'test point 3']
            >>> from dataclasses import replace
            >>> layout = replace(table.layout, label="row_no")
            >>> replace(table, layout=layout, extra={"row_no": ["A", "A", 7]}).names
            ['A #1', 'A #2', 'row no 7']
        """
        word = (self.layout.label or number_column(self.extra)).replace("_", " ")
        labels = list(map(str, self._labels()))
        count = Counter(labels)
        names = []
        for name, number in zip(labels, self.numbers.tolist(), strict=True):
            if count[name] > 1:
                name = f"{name} #{number}"
            if re.fullmatch(r"\d+( #\d+)?", name):
                name = f"{word} {name}"
            names.append(name)
        return names

    def _labels(self) -> list[Any]:
        """Return the cells of the column that names the designs, or else the numbers of tests."""
        labels: AnyArray = self.numbers
        if self.layout.label is not None:
            labels = self.extra[self.layout.label]
        return list(labels.tolist())

    def row_of(self, design: int | str) -> int:
        """Return the row of a design by the number of its test or by its label.

        Args:
            design: The number of a test, or a text: a name as in :attr:`names`; a label that only
                one design has; or the number of a test, unless labels are numbers. A number that
                is a label of another test, too, is refused.

        Raises:
            ArgumentValueError: It names no design, or several.
            ArgumentTypeError: It is neither a whole number nor a text.

        Example:
            >>> table = TestTable.of([4, 5], [[0.1], [0.5]], [[1], [2]])
            >>> table.row_of(5), table.row_of("test point 4")
            (1, 0)
        """
        labels = self._labels()
        texts = list(map(str, labels))
        numbers = self.numbers.tolist()
        is_unclear = design in labels
        if isinstance(design, str):
            # Where labels are numbers, one that is none of them is more likely a mistake.
            is_unclear = any(map(str.isdecimal, texts))
        if is_unclear and texts != list(map(str, numbers)):
            numbers = []
        return row_of_design(design, numbers, self.names, texts, numbers)

    @property
    def repeats(self) -> Mask:
        """``(n,)`` which tests repeat the design, the objectives and all texts of an earlier one.

        PSI calls the model once for each design, and a Pareto set contains the first test only.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[4], [5], [4]], [[0.3], [0.2], [0.3]])
            >>> table.repeats
            array([False, False,  True])
        """
        return self._repeated(np.arange(len(self)))

    def _repeated(self, rows: Rows) -> Mask:
        texts = [cells[rows] for name, cells in self.extra.items() if name not in NUMBERS]
        first = first_rows(self.X[rows], self.F[rows], texts)
        return np.asarray(first < np.arange(len(rows)))

    def column(self, name: str) -> AnyArray:
        """``(n,)`` values of a variable, objective, constraint, output or extra column.

        Objectives are in the original direction.

        Raises:
            ArgumentValueError: There is no such column.
            ArgumentTypeError: The name is not text.

        Example:
            >>> layout = Layout.of(["width"], ["mass", "gain"], maximize=["gain"])
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[3, -0.8], [4, -0.9]], layout=layout)
            >>> table.column("width"), table.column("gain")
            (array([0.1, 0.5]), array([0.8, 0.9]))
        """
        layout = self.layout
        known_name("column", name, self.columns)
        if name in self.extra:
            return self.extra[name]
        block, names = next(pair for pair in layout.blocks.items() if name in pair[1])
        values: AnyArray = getattr(self, block)[:, names.index(name)]
        if name in layout.objectives and name in layout.maximize:
            return -values
        return values

    def __getitem__(self, name: str) -> AnyArray:
        """Return the ``(n,)`` values of a column: :meth:`column`."""
        return self.column(name)

    def take(self, selection: ArrayLike) -> Self:
        """Return the table of some rows.

        Args:
            selection: ``(n,)`` mask, or ``(k,)`` indices of rows in the wanted order.

        Raises:
            ArgumentValueError: The selection is neither mask nor indices; a mask has another length
                than the table, an index is out of range or occurs twice.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]])
            >>> table.take([2, 0]).numbers, table.take(table.F[:, 0] > 1).numbers
            (array([3, 1]), array([2, 3]))
        """
        rows = np.asarray(selection)
        if rows.size == 0:  # numpy makes float64 of [], which selects no row and is no mistake
            rows = rows.astype(np.intp)
        try:
            rows = np.arange(len(self))[rows.ravel()]
        except IndexError as error:
            raise invalid("selection", "a mask or indices of rows", Received(error)) from error
        # Rows of a right table are right, unless one that is selected twice.
        require_distinct(self.numbers[rows])
        return self._cut(rows)

    def _cut(self, rows: Rows) -> Self:
        # `take` needs a quarter of the time of an index in brackets
        arrays = {name: getattr(self, name).take(rows, axis=0) for name in _ARRAYS}
        reasons = {}
        if self.reasons:
            selected = {*self.numbers[rows].tolist()}
            reasons = {n: reason for n, reason in self.reasons.items() if n in selected}
        return self._with(
            reasons=reasons,
            extra={name: column[rows] for name, column in self.extra.items()},
            _tested=None if self._tested is None else self._tested._cut(rows),
            **arrays,
        )

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return the table itself, which never changes; pymoo copies its algorithms often."""
        return self

    def __setstate__(self, state: Values) -> None:
        """Restore a pickled table with its arrays read-only."""
        # numpy's arrays come back writable from a pickle.
        self._set(state)

    def _with(self, **changes: Any) -> Self:
        """Return the table with new arrays, which are not checked."""
        # Past __post_init__: parts of checked arrays are right, callers vouch for the rest.
        table = object.__new__(type(self))
        table._set({f.name: getattr(self, f.name) for f in fields(self)} | changes)
        return table

    def _set(self, values: Entries) -> None:
        for name, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)


def _writable_reasons(reasons: Mapping[int, str]) -> dict[int, str]:
    """Return reasons without characters that files cannot hold."""
    writable = {}
    for number, reason in reasons.items():
        text = str(reason).encode("utf-8", "backslashreplace").decode("utf-8")
        writable[number] = text.replace("\0", "␀") or "no reason given"
    return writable


def nonfinite_objective(table: Tests, row: np.intp) -> str:
    """Return the first objective of a test that is not finite, with its value; else ""."""
    for j in np.flatnonzero(~np.isfinite(table.F[row])):
        return f"{table.layout.objectives[j]} is {table.F[row, j] * table.layout.sign[j]}"
    return ""


def _width(name: str, array: ArrayLike | None) -> int:
    """Return how many columns a matrix has."""
    if array is None:
        return 0
    return int(np.atleast_1d(real_array(name, array)).shape[-1])


def _point_numbers(value: ArrayLike) -> Integers:
    """Return numbers of test points as a new array: distinct integers from 1."""
    array = real_array("numbers", value)
    # Beyond 2^53 not every integer is a float64.
    if array.ndim != 1 or not ((array >= 1) & (array < 2**53) & (array == np.floor(array))).all():
        raise invalid("numbers", "one-dimensional, of integers from 1", value)
    numbers = array.astype(np.int64)
    require_distinct(numbers)
    return numbers


def require_distinct(numbers: Integers) -> None:
    """Refuse duplicate numbers of test points."""
    ordered = np.sort(numbers, kind="stable")  # fast where they ascend, but for a few places
    twice = ordered[1:][ordered[1:] == ordered[:-1]]
    if len(twice):
        raise invalid(
            "the test points of a table", "distinct", Received(f"test point {twice[0]} twice")
        )


def extra_columns(extra: Any, layout: Layout, n: int) -> dict[str, NDArray[np.object_]]:
    """Return extra columns as arrays of objects; they need n cells and names of their own."""
    columns = {name: np.fromiter(cells, object) for name, cells in extra.items()}
    for name, column in columns.items():
        if name in layout.columns or column.shape != (n,):
            raise invalid(
                "an extra column",
                f"{n} cells long and named unlike other columns",
                Received(f"{name!r} of {len(column)}"),
            )
        column.setflags(write=False)
    if layout.label is not None:
        known_name("label", layout.label, columns)
    return columns
