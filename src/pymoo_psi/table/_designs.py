"""Designs as a matrix: float64, int64 or bool where all variables are of that kind, else objects.

In a matrix of objects a cell is Python's float, int, bool or str. So every value comes back from
a frame or a file with the type it had.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._validation import Received, finite_array, invalid, wrong_type
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError

_KIND_OF_TYPE = {float: Kind.REAL, int: Kind.INTEGER, bool: Kind.BINARY, str: Kind.CHOICE}
_KIND_OF_DTYPE = {"f": Kind.REAL, "i": Kind.INTEGER, "b": Kind.BINARY}


def is_writable(text: str) -> bool:
    """Say whether every file can hold a text: it has no NUL and no half of a surrogate pair."""
    # UTF-8 has no code for half a pair, and SQLite's functions and C programs end a text at NUL.
    # What one file could not hold is refused at once, lest a table be written to some files only.
    return "\0" not in text and not any("\ud800" <= c <= "\udfff" for c in text)


def design_matrix(
    name: str, value: Any, variables: Sequence[str] | None = None, kinds: Sequence[Kind] = ()
) -> NDArray[Any]:
    """Return designs as a new ``(n, n_var)`` array in one normal form.

    Args:
        name: Name of the argument, for messages.
        value: ``(n, n_var)`` array, rows, or frame; or n mappings from variable to value, as
            pymoo's mixed-variable problems have them. Whole numbers beside fractions are real
            numbers in rows of numbers alone; others are taken as they are.
        variables: The names of the variables, the order for mappings; theirs unless given.
        kinds: What the variables are, where that is known; values are taken accordingly.

    Raises:
        ArgumentValueError: Rows differ in length, a variable is missing, a number is not finite.
        ArgumentTypeError: A value is neither number nor boolean nor text, or not of its kind.
    """
    array = value if isinstance(value, np.ndarray) else _array(name, value, variables)
    if array.ndim != 2:
        rule = "two-dimensional (n designs, n_var variables)"
        raise invalid(name, rule, Received(f"shape {array.shape}"))
    matrix = _normal(name, array, listed=array is not value and not kinds)
    if len(kinds) != matrix.shape[1] or column_kinds(matrix) == _of_values(kinds):
        return matrix  # whoever puts the table together refuses another number of columns
    result = np.empty(matrix.shape, dtype=object)
    for j, (kind, of_values) in enumerate(zip(kinds, _of_values(kinds), strict=True)):
        result[:, j] = [_as_kind(cell, kind) for cell in matrix[:, j].tolist()]
        for cell in result[:, j].tolist():
            if of_values is not Kind.CHOICE and of_values is not _KIND_OF_TYPE[type(cell)]:
                column = f"x{j + 1}" if variables is None else variables[j]
                rule = f"{name} must hold {kind.value} values for {column}, got {cell!r:.80}"
                raise ArgumentTypeError(rule)
    return result.astype(common_dtype(kinds))


def joined_designs(blocks: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return the rows of several design matrices in normal form, their values of the same types."""
    # A matrix without rows may be float64 whatever its variables are, and makes no other objects.
    filled = [block for block in blocks if len(block)] or [blocks[0]]
    if any(block.dtype != filled[0].dtype for block in filled):
        # Before they are put together: numpy would make floats of integers, integers of booleans.
        filled = [block.astype(object) for block in filled]
    return np.concatenate(filled)


def column_kinds(X: NDArray[Any]) -> tuple[Kind, ...]:
    """Return the kind of each column of ``(n, n_var)`` designs, as the values tell.

    Values of several types are those of a choice.
    """
    if X.dtype != object:
        return (_KIND_OF_DTYPE[X.dtype.kind],) * int(X.shape[1])
    types = [set(map(type, column)) for column in X.T.tolist()]
    return tuple(_KIND_OF_TYPE[t.pop()] if len(t) == 1 else Kind.CHOICE for t in types)


def real_column(name: str, column: NDArray[Any]) -> NDArray[np.float64]:
    """Return a ``(n,)`` column as float64; one of a matrix of objects may hold numbers, too.

    Raises:
        ArgumentTypeError: It holds other than numbers.
    """
    if column.dtype.kind == "O" and not all(isinstance(v, (int, float)) for v in column.tolist()):
        other = next(v for v in column.tolist() if not isinstance(v, (int, float)))
        found = f"{name!r} holds {other!r:.40}"
        raise ArgumentTypeError(
            f"only columns of numbers can be limited and computed with, and {found}; select "
            f"designs by it with table.rows(table.column({name!r}) == value)"
        )
    return column.astype(np.float64)


def value_ranks(column: NDArray[Any]) -> tuple[list[Any], NDArray[np.intp]]:
    """Return the distinct values of a column, ordered, and ``(n,)`` the index of each cell's.

    Values of one type stand together.
    """
    # With the types, as 1, 1.0 and True are equal and hash alike; by the types' names, as text and
    # numbers have no order.
    keys = [(type(cell).__name__, cell) for cell in column.tolist()]
    ranks = {key: k for k, key in enumerate(sorted({*keys}))}
    return [value for _, value in ranks], np.array([ranks[key] for key in keys], dtype=np.intp)


def common_dtype(kinds: Sequence[Kind]) -> Any:
    """Return the dtype of a matrix of variables of these kinds; float64 if there is none."""
    different = {*_of_values(kinds)} or {Kind.REAL}
    return DTYPES[different.pop()] if len(different) == 1 else np.object_


def design_keys(X: NDArray[Any]) -> list[tuple[str, ...]]:
    """Return for each row of ``(n, n_var)`` designs what is the same where the design is.

    Texts, as files and studies keep the options of a choice.
    """
    return [tuple(map(str, row)) for row in X.tolist()]


def first_rows(X: NDArray[Any], F: NDArray[np.float64] | None = None) -> NDArray[np.intp]:
    """``(n,)`` the index of the first row with the same design, and objectives if given."""
    rows = first = np.arange(len(X))
    if X.size == 0:  # of no variables, nothing is known of designs
        return first
    if X.dtype != object:  # a value that occurs once is of a design that does
        _, value, count = np.unique(X[:, 0], return_inverse=True, return_counts=True)
        rows = np.flatnonzero(count[value] > 1)
    seen: dict[Any, int] = {}
    more = [b""] * len(rows) if F is None else map(bytes, F[rows])
    for i, key in zip(rows.tolist(), zip(design_keys(X[rows]), more, strict=True), strict=True):
        first[i] = seen.setdefault(key, i)
    return first


def _array(name: str, value: Any, variables: Sequence[str] | None) -> NDArray[Any]:
    """Return rows, mappings or a frame as an array of objects."""
    if hasattr(value, "itertuples"):  # a frame of pandas
        value = value.to_dict("records")
    if isinstance(value, (str, Mapping)) or not isinstance(value, Iterable):
        raise wrong_type(name, "an array or rows, or a frame of pandas", value)
    rows = list(value)
    if rows and isinstance(rows[0], Mapping):
        names = list(rows[0]) if variables is None else list(variables)
        for row in rows:
            if not isinstance(row, Mapping) or {*row} != {*names}:
                rule = f"mappings of the variables {', '.join(map(str, names))}"
                raise invalid(name, rule, row)
        rows = [[row[variable] for variable in names] for row in rows]
    try:
        return np.array(rows, dtype=object)
    except ValueError as error:  # rows of unequal length
        raise ArgumentValueError(f"{name} must be a rectangular array: {error}") from error


def _normal(name: str, array: NDArray[Any], *, listed: bool) -> NDArray[Any]:
    """Return a new array of the values as they are, of float64, int64, bool or objects.

    Args:
        name: Name of the argument, for messages.
        array: Two-dimensional.
        listed: Whether whole numbers beside fractions are real numbers if there are no others.
    """
    kind = array.dtype.kind
    if kind == "f":
        return np.array(finite_array(name, array), order="C")
    if kind in "biu":
        return np.array(array, dtype=bool if kind == "b" else np.int64, order="C")
    cells = [[_plain(name, cell) for cell in row] for row in array.tolist()]
    if listed and {type(cell) for row in cells for cell in row} == {int, float}:
        cells = [[*map(float, row)] for row in cells]
    types = {type(cell) for row in cells for cell in row} or {float}
    narrowest = _KIND_OF_TYPE[types.pop()] if len(types) == 1 else Kind.CHOICE
    matrix = np.empty(array.shape, dtype=DTYPES[narrowest])
    if matrix.size:  # numpy cannot spread an empty list over shape (0, n_var)
        matrix[:] = cells
    return matrix


def _of_values(kinds: Sequence[Kind]) -> tuple[Kind, ...]:
    """Return what values of these kinds are by themselves."""
    return tuple(Kind.REAL if kind.real else kind for kind in kinds)


def _as_kind(cell: Any, kind: Kind) -> Any:
    """Return the number of a kind that is equal to a cell, or the cell if there is none."""
    # Exact types, since True is an int for isinstance.
    if type(cell) is int and kind.real and float(cell) == cell:
        return float(cell)
    if type(cell) is float and kind is Kind.INTEGER and cell.is_integer() and abs(cell) < 2**63:
        return int(cell)
    if type(cell) in (int, float) and kind is Kind.BINARY and cell in (0, 1):
        return bool(cell)
    return cell


def _plain(name: str, cell: Any) -> float | int | bool | str:
    """Return a cell as Python's own type; subclasses of it become it, too."""
    if isinstance(cell, np.generic):
        cell = cell.item()
    kind = next((kind for kind in (bool, int, float, str) if isinstance(cell, kind)), None)
    if kind is None:
        raise wrong_type(name, "of numbers, booleans or text", cell)
    if kind is float and not math.isfinite(cell):
        raise invalid(name, "finite", cell)
    if (kind is int and not -(2**63) <= cell < 2**63) or (kind is str and not is_writable(cell)):
        found = Received("a larger integer") if kind is int else cell
        rule = "an integer within int64 or Unicode text"
        raise invalid(f"a value of {name}", rule, found, "name options of a choice by text")
    return kind(cell)
