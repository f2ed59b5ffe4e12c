"""Designs as a matrix: float64, int64 or bool where all variables are of that kind, else objects.

A cell of a matrix of objects is Python's float, int, bool or str. So every value comes back from a
frame or a file with the type that it had.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Names,
    Received,
    Rows,
    finite_array,
    finite_number,
    invalid,
    wrong_type,
)
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError

_KIND_OF_TYPE = {float: Kind.REAL, int: Kind.INTEGER, bool: Kind.BINARY, str: Kind.CHOICE}
_KIND_OF_DTYPE = {"f": Kind.REAL, "i": Kind.INTEGER, "b": Kind.BINARY}


def is_writable(text: str) -> bool:
    """Say whether every file can hold a text: it has no NUL and no half of a surrogate pair."""
    # UTF-8 has no code for half a pair, and SQLite's functions and C programs end a text at NUL.
    # What one file could not hold is refused at once, lest a table be written to some files only.
    if "\0" in text:
        return False
    return not any("\ud800" <= letter <= "\udfff" for letter in text)


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
    listed = not isinstance(value, np.ndarray)
    array = value
    if listed:
        array = _array(name, value, variables)
    if array.ndim != 2:
        raise invalid(
            name, "two-dimensional (n designs, n_var variables)", Received(f"shape {array.shape}")
        )
    matrix = _normal(name, array, listed=listed and not kinds)
    # Another number of columns is refused where the table is put together.
    stored = tuple(Kind.REAL if kind.real else kind for kind in kinds)
    if len(kinds) != matrix.shape[1] or column_kinds(matrix) == stored:
        return matrix
    result = np.empty(matrix.shape, dtype=object)
    for j, kind in enumerate(stored):
        cells = [_as_kind(cell, kind) for cell in matrix[:, j].tolist()]
        for cell in cells:
            if kind not in (Kind.CHOICE, _KIND_OF_TYPE[type(cell)]):
                column = f"x{j + 1}"
                if variables is not None:
                    column = variables[j]
                raise ArgumentTypeError(
                    f"{name} must hold {kind.value} values for {column}, got {cell!r:.80}"
                )
        result[:, j] = cells
    return result.astype(common_dtype(kinds))


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
                    f"table.rows(table.column({name!r}) == value)"
                )
    return column.astype(np.float64)


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


def design_keys(X: AnyArray) -> list[tuple[str, ...]]:
    """Return a key for each row of ``(n, n_var)`` designs; equal designs have equal keys.

    The keys are texts, as files and studies keep the options of a choice.
    """
    return [tuple(map(str, row)) for row in X.tolist()]


def first_rows(X: AnyArray, F: Array | None = None) -> Rows:
    """Return ``(n,)`` the first row with the same design, and the same objectives if given."""
    first = np.arange(len(X))
    if X.size == 0:  # without variables nothing is known of designs
        return first
    rows = first
    if X.dtype != object:  # a design with a value that occurs once occurs once
        _, value, count = np.unique(X[:, 0], return_inverse=True, return_counts=True)
        rows = np.flatnonzero(count[value] > 1)
    keys: list[Any] = design_keys(X[rows])
    if F is not None:
        keys = list(zip(keys, map(bytes, F[rows]), strict=True))
    first[rows] = rows[first_of(keys)]
    return first


def first_of(keys: Iterable[Any]) -> Rows:
    """Return ``(n,)`` the index of the first of n keys that is equal to each."""
    index_by_key: dict[Any, int] = {}
    return np.array([index_by_key.setdefault(key, i) for i, key in enumerate(keys)], dtype=np.intp)


def _array(name: str, value: Any, variables: Names | None) -> AnyArray:
    """Return rows, mappings or a frame as an array of objects."""
    if hasattr(value, "itertuples"):  # a frame of pandas
        value = value.to_dict("records")
    if isinstance(value, (str, Mapping)) or not isinstance(value, Iterable):
        raise wrong_type(name, "an array or rows, or a frame of pandas", value)
    rows = list(value)
    if rows and isinstance(rows[0], Mapping):
        rows = _rows_of_mappings(name, rows, variables or list(rows[0]))
    try:
        return np.array(rows, dtype=object)
    except ValueError as error:  # rows of unequal length
        raise ArgumentValueError(f"{name} must be a rectangular array: {error}") from error


def _rows_of_mappings(name: str, mappings: list[Any], variables: Names) -> list[list[Any]]:
    rows = []
    for mapping in mappings:
        if not isinstance(mapping, Mapping) or set(mapping) != set(variables):
            raise invalid(
                name, f"mappings of the variables {', '.join(map(str, variables))}", mapping
            )
        rows.append([mapping[variable] for variable in variables])
    return rows


def _normal(name: str, array: AnyArray, *, listed: bool) -> AnyArray:
    """Return a new array of the values as they are, of float64, int64, bool or objects.

    Args:
        name: Name of the argument, for messages.
        array: Two-dimensional.
        listed: Whether whole numbers beside fractions are real numbers if there are no others.
    """
    if array.dtype.kind == "f":
        return np.array(finite_array(name, array), order="C")
    if array.dtype.kind in "biu":
        dtype = np.bool_ if array.dtype.kind == "b" else np.int64
        return np.array(array, dtype=dtype, order="C")
    types: set[type] = set()
    cells = []
    for row in array.tolist():
        values = [_plain(name, cell) for cell in row]
        types.update(map(type, values))
        cells.append(values)
    if listed and types == {int, float}:
        cells = [list(map(float, values)) for values in cells]
        types = {float}
    matrix = np.empty(array.shape, dtype=DTYPES[_common_kind(types or {float})])
    if matrix.size:  # NumPy cannot spread an empty list over shape (0, n_var)
        matrix[:] = cells
    return matrix


def _as_kind(cell: Any, kind: Kind) -> Any:
    """Return the number of a kind that is equal to a cell, or the cell if there is none."""
    # Exact types, since True is an int for isinstance.
    if type(cell) is int and kind is Kind.REAL and float(cell) == cell:
        return float(cell)
    if type(cell) is float and kind is Kind.INTEGER and cell.is_integer() and abs(cell) < 2**63:
        return int(cell)
    if type(cell) in (int, float) and kind is Kind.BINARY and cell in (0, 1):
        return bool(cell)
    return cell


def _plain(name: str, cell: Any) -> float | int | bool | str:
    """Return a cell as Python's own type; values of subclasses are converted."""
    if isinstance(cell, np.generic):
        cell = cell.item()
    if isinstance(cell, bool):
        return cell
    if isinstance(cell, float):
        return finite_number(name, cell)
    if isinstance(cell, int) and -(2**63) <= cell < 2**63:
        return int(cell)
    if isinstance(cell, str) and is_writable(cell):
        return str(cell)
    error = invalid if isinstance(cell, (int, str)) else wrong_type
    raise error(
        f"a value of {name}",
        "a number, an integer within int64, True, False or Unicode text",
        cell,
        "name options of a choice by text",
    )
