"""What the columns of a test table mean, and the matrix of its designs.

- :class:`Layout`: names, roles, directions, units, kinds and bounds of the columns. How a layout is
  written in a file is in ``_head.py``.
- Names of columns in files, and rules for names and units.
- :func:`design_matrix`: designs in one normal form, whatever the kinds of their variables; what is
  equal among them.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._kinds import DTYPES, keys_of_designs, option_text, plain
from pymoo_psi._kinds import Kind as Kind  # public here
from pymoo_psi._output import with_unit
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Mask,
    Names,
    Received,
    Rows,
    finite_array,
    finite_number,
    instance,
    integer,
    invalid,
    known_name,
    mapping,
    real_array,
    require_shape,
    wrong_type,
)
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.pareto import EQ_TOLERANCE

# Columns that a model cannot have: the number of a test, and what a frame says of it.
RESULTS = ("status", "violated", "reason", "pareto")
RESERVED = ("test_point", *RESULTS)
# Extra columns of tests of several runs: the run for which each was made, and its test point there.
RUN, POINT = "run", "test_point"
NUMBERS = {RUN, POINT, "row"}  # extra columns that tell tests apart, not designs
PROPOSAL_ROUND = "proposal_round"
"""Name of the output that tells points of the sequence, 0, from proposals, by their round."""
_TYPES = {Kind.REAL: float, Kind.INTEGER: int, Kind.BINARY: bool, Kind.CHOICE: str}
_KIND_OF_TYPE = {kind_type: kind for kind, kind_type in _TYPES.items()}
_KIND_OF_DTYPE = {"f": Kind.REAL, "i": Kind.INTEGER, "b": Kind.BINARY}
GROUPS = ("variables", "objectives", "inequalities", "equalities", "outputs")


# What sentences call the rows of a table, and those without values.
_OF_TESTS = {"row": "test", "failed": "failed"}
_OF_DESIGNS = {"row": "design", "failed": "incomplete"}


@dataclass(frozen=True, eq=False)
class Layout:
    """The columns of a test table.

    Attributes:
        variables: ``n_var`` names of the design variables.
        objectives: ``m`` names of the objectives.
        inequalities: ``n_ieq`` names of the inequality constraints, met where g <= 0.
        equalities: ``n_eq`` names of the equality constraints, met where ``|h| <= eq_tolerance``.
        lower: ``(n_var,)`` lower bounds; NaN where there is none or it is not known.
        upper: ``(n_var,)`` upper bounds, as for ``lower``.
        eq_tolerance: How far an equality constraint may be from 0.
        kinds: ``n_var`` kinds of the variables; empty where they follow from the designs.
        outputs: ``k`` names of further outputs of the model, neither objectives nor constraints.
        maximize: The objectives to be maximised, and outputs that would be such objectives. ``F``
            holds the negatives of these objectives, because pymoo minimises; columns that are
            accessed by name have the original direction.
        units: Units of columns by name, also of outputs without values so far.
        label: Name of the column in ``extra`` that names the designs, or None.

    Example:
        >>> layout = Layout.of(["width", "height"], ["mass"], lower=[1, 1], upper=[2, 5])
        >>> layout.variables, layout.upper
        (('width', 'height'), array([2., 5.]))
    """

    variables: tuple[str, ...]
    objectives: tuple[str, ...]
    inequalities: tuple[str, ...]
    equalities: tuple[str, ...]
    lower: Array
    upper: Array
    eq_tolerance: float
    kinds: tuple[Kind, ...] = ()
    outputs: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    label: str | None = None

    def __post_init__(self) -> None:
        """Check that the names are distinct, and directions, units, kinds and bounds fit."""
        for group in (*GROUPS, "maximize"):
            self._set(group, column_names(group, getattr(self, group)))
        self._set("units", unit_texts(self.units))
        self._set("eq_tolerance", finite_number("eq_tolerance", self.eq_tolerance))
        if self.eq_tolerance < 0:
            raise invalid("eq_tolerance", "0 or more", self.eq_tolerance)
        self._check_kinds()
        self._check_bounds()
        columns = self.objectives + self.outputs
        for name in self.maximize:
            known_name("maximize", name, columns)
        # In the order of the columns, so that layouts of one meaning are equal.
        self._set("maximize", tuple(name for name in columns if name in self.maximize))
        for name, count in Counter((POINT, *self.columns)).items():
            if count > 1:
                rule = f"distinct, and none of {POINT}"
                raise invalid("the names of a test table", rule, name, "give it another name")

    @property
    def words(self) -> dict[str, str]:
        """The words for rows in sentences: tests of a model, which may fail, or designs of a file.

        Designs of a file have a column of names and no bounds; they may be incomplete.

        Example:
            >>> Layout.of(["width"], ["mass"], lower=[1], upper=[2]).words["failed"]
            'failed'
        """
        if self.label is None or np.isfinite(self.lower).any():
            return _OF_TESTS
        return _OF_DESIGNS

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _check_kinds(self) -> None:
        self._set("kinds", tuple(map(Kind, self.kinds)))
        n = len(self.variables)
        if len(self.kinds) not in (0, n):
            raise invalid("kinds", f"{n} kinds, one for each variable", Received(len(self.kinds)))

    def _check_bounds(self) -> None:
        n = len(self.variables)
        for side in ("lower", "upper"):
            bounds = getattr(self, side)
            if bounds is None:
                bounds = np.full(n, np.nan)
            # A copy, as it is made read-only and the caller's array is the caller's.
            bounds = real_array(side, bounds).copy()
            require_shape(side, bounds, (n,))
            bounds.setflags(write=False)
            self._set(side, bounds)
        if (self.lower > self.upper).any():  # false with NaN, a bound that is not known
            raise invalid("lower", "at most upper", Received(f"{self.lower} and {self.upper}"))
        for name, kind, low in zip(self.variables, self.kinds, self.lower, strict=False):
            if kind is Kind.LOG and low <= 0:
                raise invalid(f"the lower bound of {name!r}", "above 0 on a log scale", low)

    @classmethod
    def of(
        cls,
        variables: int | Names = 0,
        objectives: int | Names = 0,
        inequalities: int | Names = 0,
        equalities: int | Names = 0,
        *,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        eq_tolerance: float = EQ_TOLERANCE,
        kinds: Sequence[Kind | str] = (),
        outputs: Names = (),
        maximize: Names = (),
        units: Mapping[str, str] | None = None,
    ) -> Layout:
        """Return a layout with these names; a number stands for as many default names.

        Args:
            variables: Names of the variables, or how many: x1, x2, …
            objectives: Names of the objectives, or how many: f1, f2, …
            inequalities: Names of the inequality constraints, or how many: g1, g2, …
            equalities: Names of the equality constraints, or how many: h1, h2, …
            lower: ``(n_var,)`` lower bounds, NaN where there is none; unknown unless given.
            upper: ``(n_var,)`` upper bounds, as for ``lower``.
            eq_tolerance: How far an equality constraint may be from 0.
            kinds: What each variable is, "real", "log" (real, on a logarithmic scale), "integer",
                "binary" or "choice"; as the values of the designs unless given.
            outputs: Names of what else the model gives.
            maximize: The objectives to be maximised.
            units: Units of columns by name.

        Raises:
            ArgumentValueError: A name occurs twice, is reserved or not known; bounds or kinds do
                not fit.
            ArgumentTypeError: A name is not text, a bound not a number.

        Example:
            >>> layout = Layout.of(2, ["mass", "gain"], maximize=["gain"], units={"mass": "kg"})
            >>> layout.label_of("x1"), layout.label_of("mass"), layout.sign
            ('x1', 'mass [kg]', array([ 1., -1.]))
        """
        # Brought into their final form by the class.
        settings: Any = (lower, upper, eq_tolerance, kinds, outputs, maximize, units or {})
        return cls(
            column_names("variables", variables, "x"),
            column_names("objectives", objectives, "f"),
            column_names("inequalities", inequalities, "g"),
            column_names("equalities", equalities, "h"),
            *settings,
        )

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of all constraints, the inequalities first.

        Example:
            >>> Layout.of(1, 1, ["stress"], ["volume"]).constraints
            ('stress', 'volume')
        """
        return self.inequalities + self.equalities

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns: variables, objectives, constraints, outputs.

        Example:
            >>> Layout.of(1, ["mass"], ["stress"], outputs=["heat"]).columns
            ('x1', 'mass', 'stress', 'heat')
        """
        return self.variables + self.objectives + self.constraints + self.outputs

    @property
    def blocks(self) -> dict[str, tuple[str, ...]]:
        """Names of the columns of each array of a table: X, F, G, H, outputs.

        Example:
            >>> Layout.of(1, ["mass"], ["stress"]).blocks["G"]
            ('stress',)
        """
        return {
            "X": self.variables,
            "F": self.objectives,
            "G": self.inequalities,
            "H": self.equalities,
            "outputs": self.outputs,
        }

    @property
    def sign(self) -> Array:
        """``(m,)`` 1 for an objective to be minimised, -1 for one to be maximised.

        ``F * sign`` are the objectives in the original direction, and these times ``sign`` are F.

        Example:
            >>> Layout.of(1, ["mass", "gain"], maximize=["gain"]).sign
            array([ 1., -1.])
        """
        sign = np.ones(len(self.objectives))
        for j, name in enumerate(self.objectives):
            if name in self.maximize:
                sign[j] = -1.0
        return sign

    def label_of(self, name: str) -> str:
        """Return the name of a column with its unit, and "(max)" if it is to be maximised.

        For axes and headings, as the decision page has them.

        Example:
            >>> Layout.of(1, ["mass"], units={"mass": "kg"}).label_of("mass")
            'mass [kg]'
        """
        heading = with_unit(name, self.units.get(name, ""))
        if name in self.maximize:
            return f"{heading} (max)"
        return heading

    def is_log(self, name: str) -> bool:
        """Whether a column is a variable on a logarithmic scale.

        Example:
            >>> Layout.of(["width", "area"], 1, kinds=["real", "log"]).is_log("area")
            True
        """
        return (name, Kind.LOG) in zip(self.variables, self.kinds, strict=False)

    def variable(self, name: str) -> int:
        """Return the index of a variable.

        Example:
            >>> Layout.of(["width", "height"], 1).variable("height")
            1
        """
        return self.variables.index(known_name("variable", name, self.variables))


def headings_of(names: Collection[str], units: Mapping[str, str]) -> dict[str, str]:
    """Return the headings of columns in a file: with units, unless another column is called so."""
    headings = {}
    for name in names:
        headings[name] = with_unit(name, units.get(name, ""))
        if headings[name] in names:
            headings[name] = name
    return headings


def names_of(headings: Names, units: Mapping[str, str]) -> list[str]:
    """Return the names of columns by their headings, with units or without."""
    names = {}
    for name, unit in units.items():
        if name not in headings:
            names[with_unit(name, unit)] = name
    return [names.get(heading, heading) for heading in headings]


def joined_layout(layout: Layout, other: Layout) -> Layout:
    """Return a layout with the outputs of another that agrees, their directions and units."""
    if layout is other:
        return layout
    return replace(
        layout,
        outputs=tuple(dict.fromkeys((*layout.outputs, *other.outputs))),
        maximize=tuple(dict.fromkeys((*layout.maximize, *other.maximize))),
        units={**other.units, **layout.units},
        kinds=layout.kinds or other.kinds,
    )


def number_column(extra: Collection[str]) -> str:
    """Return the name of the column with the numbers of tests.

    Args:
        extra: The extra columns. With those of several runs, tests have numbers of their own.
    """
    return "test" if POINT in extra else POINT


def result_columns(names: Collection[str]) -> dict[str, str]:
    """Return the names in a frame or file of status, violated, reason and pareto.

    Args:
        names: The columns of the table. Those of another program's file keep their names.
    """
    columns = {}
    for name in RESULTS:
        columns[name] = name
        if name in names:
            columns[name] = f"{name} (pymoo-psi)"
    return columns


def has_runs(extra: Collection[str]) -> bool:
    """Whether tests are those of several runs, by their extra columns."""
    return RUN in extra and POINT in extra


def column_names(group: str, names: Any, letter: str = "") -> tuple[str, ...]:
    """Return names as texts that every file can hold; with a letter, a number gives as many."""
    if letter and not isinstance(names, (str, Sequence)):
        count = integer(f"the number of {group}", names, minimum=0)
        return tuple(f"{letter}{j + 1}" for j in range(count))
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise wrong_type(group, "a list of names", names)
    for name in names:
        instance(f"a name in {group}", name, str)
        # UTF-8 has no code for half a surrogate pair, and SQLite ends a text at NUL.
        if re.search("^$|[\0\ud800-\udfff]", name):
            raise invalid(group, "names of at least one Unicode character", name)
    return tuple(map(str, names))


def unit_texts(units: Any) -> dict[str, str]:
    """Return units as texts that every file can hold, without those that are empty."""
    texts = {}
    for name, unit in mapping("units", units, "columns to units, such as {'mass': 'kg'}").items():
        text = instance(f"the unit of {name!r}", unit, str).strip()
        if not text.isprintable():
            raise invalid(f"the unit of {name!r}", "one line of Unicode text", unit)
        if text:
            texts[str(name)] = text
    return texts


# Designs as a matrix: float64, int64 or bool where all variables are of that kind, else objects.
# A cell of a matrix of objects is Python's float, int, bool or str, so that every value comes back
# from a frame or a file with the type that it had.


def design_matrix(
    name: str, value: Any, variables: Names | None = None, kinds: Sequence[Kind] = ()
) -> AnyArray:
    """Return designs as a new ``(n, n_var)`` array in one normal form.

    Args:
        name: Name of the argument, for messages.
        value: ``(n, n_var)`` array, rows, or frame; or n mappings from variable to value, as
            pymoo's mixed-variable problems have them. Whole numbers beside fractions are real
            numbers where all cells of rows are numbers; other values keep their types.
        variables: The names of the variables, in the order of the columns; for mappings, their
            keys unless given.
        kinds: The kinds of the variables, if known; values are converted to them.

    Raises:
        ArgumentValueError: Rows differ in length, a variable is missing, a number is not finite.
        ArgumentTypeError: A value is neither number nor boolean nor text, or not of its kind.
    """
    array = value
    if not isinstance(value, np.ndarray):
        array = _array(name, value, variables)
    if array.ndim != 2:
        raise invalid(
            name, "two-dimensional (n designs, n_var variables)", Received(f"shape {array.shape}")
        )
    if array.dtype.kind == "f":
        matrix: AnyArray = np.array(finite_array(name, array), order="C")
    elif array.dtype.kind in "biu":
        dtype = np.bool_ if array.dtype.kind == "b" else np.int64
        matrix = np.array(array, dtype=dtype, order="C")
    else:
        are_rows = array is not value
        matrix = _matrix_of_cells(name, array, real=are_rows and not kinds)
    # Another number of columns is refused where the table is put together.
    stored = tuple(Kind.REAL if kind.real else kind for kind in kinds)
    if len(kinds) != matrix.shape[1] or column_kinds(matrix) == stored:
        return matrix
    result = np.empty(matrix.shape, dtype=object)
    for j, kind in enumerate(stored):
        column = f"x{j + 1}"
        if variables is not None:
            column = variables[j]
        place = f"{name} must hold {kind.value} values for {column}"
        result[:, j] = [_as_kind(place, cell, kind) for cell in matrix[:, j].tolist()]
    return result.astype(common_dtype(kinds))


def _array(name: str, value: Any, variables: Names | None) -> AnyArray:
    """Return rows, mappings or a frame as an array of objects."""
    if hasattr(value, "itertuples"):  # a frame of pandas
        value = value.to_dict("records")
    rows = list(value)
    if rows and isinstance(rows[0], Mapping):
        variables = variables or list(rows[0])
        for i, row in enumerate(rows):
            if not isinstance(row, Mapping) or row.keys() != {*variables}:
                raise invalid(
                    name, f"mappings of the variables {', '.join(map(str, variables))}", row
                )
            rows[i] = [row[variable] for variable in variables]
    return np.array(rows, dtype=object)


def _matrix_of_cells(name: str, array: AnyArray, *, real: bool) -> AnyArray:
    """Return the cells of a two-dimensional array of objects in normal form.

    Args:
        name: Name of the argument, for messages.
        array: The cells.
        real: Whether whole numbers beside fractions are real numbers if there are no others.
    """
    cells = [[_plain(name, cell) for cell in row] for row in array.tolist()]
    types = set(map(type, chain.from_iterable(cells))) or {float}
    if real and types == {int, float}:
        types = {float}
    matrix = np.empty(array.shape, dtype=DTYPES[_common_kind(types)])
    if matrix.size:  # NumPy cannot spread an empty list over shape (0, n_var)
        matrix[:] = cells
    return matrix


def _plain(name: str, cell: Any) -> float | int | bool | str:
    """Return a cell as Python's own type; values of subclasses are converted."""
    cell = plain(cell)
    if isinstance(cell, bool):
        return cell
    if isinstance(cell, float):
        return finite_number(name, cell)
    if isinstance(cell, int) and -(2**63) <= cell < 2**63:
        return cell
    if isinstance(cell, str):
        return cell
    rule = "a number, an integer within int64, True, False or text"
    raise wrong_type(f"a value of {name}", rule, cell, "name options of a choice by text")


def _as_kind(place: str, cell: Any, kind: Kind) -> Any:
    """Return the value of a kind that is equal to a cell."""
    number: Any = _TYPES[kind]
    if kind is Kind.CHOICE or type(cell) is number:
        return cell
    # Exact types, since True is an int for isinstance.
    if type(cell) in (int, float) and abs(cell) < 2**63 and number(cell) == cell:
        return number(cell)
    raise ArgumentTypeError(f"{place}, got {cell!r:.80}")


def joined_designs(blocks: Sequence[AnyArray]) -> AnyArray:
    """Return the rows of several design matrices in normal form, their values of the same types."""
    # A matrix without rows may be float64 whatever its variables are, and makes no other objects.
    filled = [block for block in blocks if len(block)] or [blocks[0]]
    if len({block.dtype for block in filled}) > 1:
        # Before they are joined: NumPy would make floats of integers, integers of booleans.
        return np.concatenate([block.astype(object) for block in filled])
    return np.concatenate(filled)


def column_kinds(X: AnyArray) -> tuple[Kind, ...]:
    """Return the kind of each column of ``(n, n_var)`` designs, as their values show.

    A column with values of several types is that of a choice.
    """
    if X.dtype != object:
        return (_KIND_OF_DTYPE[X.dtype.kind],) * int(X.shape[1])
    return tuple(_common_kind(set(map(type, column))) for column in X.T.tolist())


def _common_kind(types: set[type]) -> Kind:
    if len(types) == 1:
        return _KIND_OF_TYPE[types.pop()]
    return Kind.CHOICE


def real_column(name: str, column: AnyArray) -> Array:
    """Return a ``(n,)`` column as float64; one of a matrix of objects may hold numbers, too.

    Raises:
        ArgumentTypeError: The column holds other values than numbers.
    """
    if column.dtype.kind not in "biuf":
        for value in column.tolist():
            if not isinstance(value, (int, float)):
                raise ArgumentTypeError(
                    "only columns of numbers can be limited and computed with, and "
                    f"{name!r} holds {value!r:.40}; select designs by it with "
                    f"table.take(table.column({name!r}) == value)"
                )
    return column.astype(np.float64)


def blank(column: AnyArray) -> Mask:
    """``(n,)`` which cells hold nothing."""
    if column.dtype.kind == "f":
        return np.isnan(column)
    return np.array([cell is None or cell != cell for cell in column.tolist()], dtype=bool)


def value_ranks(column: AnyArray) -> tuple[list[Any], Rows]:
    """Return the distinct values of a column in order, and ``(n,)`` the index of each cell's value.

    Values of one type stand together.
    """
    # With the types, as 1, 1.0 and True are equal and hash alike; by the types' names, as text and
    # numbers have no order.
    keys = [(type(cell).__name__, cell) for cell in column.tolist()]
    ranks = {key: rank for rank, key in enumerate(sorted(set(keys)))}
    values = [value for _, value in ranks]
    return values, np.array([ranks[key] for key in keys], dtype=np.intp)


def common_dtype(kinds: Sequence[Kind]) -> Any:
    """Return the dtype of a matrix of variables of these kinds; float64 if there is none."""
    dtypes = {DTYPES[kind] for kind in kinds} or {np.float64}
    if len(dtypes) == 1:
        return dtypes.pop()
    return np.object_


def design_keys(X: AnyArray) -> list[str]:
    """Return a key for each row of ``(n, n_var)`` designs in normal form, to compare these."""
    if X.shape[1] == 0:
        return [""] * len(X)
    kinds = column_kinds(X)
    columns = []
    for cells, kind in zip(X.T, kinds, strict=True):
        if kind is Kind.CHOICE:
            cells = np.fromiter(map(option_text, cells.tolist()), object)
        columns.append(cells)
    return keys_of_designs(columns, kinds)


def first_rows(X: AnyArray, F: Array | None = None, columns: Iterable[AnyArray] = ()) -> Rows:
    """Return ``(n,)`` the first row with the same design.

    Args:
        X: ``(n, n_var)`` designs.
        F: ``(n, m)`` objectives, in which the rows agree, too, if given.
        columns: ``(n,)`` further columns in which they agree, too, beside the objectives.
    """
    first = np.arange(len(X))
    if X.size == 0:  # without variables, no design equals another
        return first
    rows = first
    values = X
    if F is not None and F.size:
        values = F
    if values.dtype != object:  # a row with a value that occurs once occurs once
        ordered = np.sort(values[:, 0])
        recurring = ordered[1:][ordered[1:] == ordered[:-1]]
        rows = np.flatnonzero(np.isin(values[:, 0], recurring) | np.isnan(values[:, 0]))
    keys: list[Any] = design_keys(X[rows])
    if F is not None:
        cells = [map(str, column[rows]) for column in columns]
        keys = list(zip(keys, map(bytes, F[rows]), *cells, strict=True))
    first[rows] = rows[first_of(keys)]
    return first


def first_of(keys: Iterable[Any]) -> Rows:
    """Return ``(n,)`` the index of the first of n keys that is equal to each."""
    index_by_key: dict[Any, int] = {}
    return np.array([index_by_key.setdefault(key, i) for i, key in enumerate(keys)], dtype=np.intp)
