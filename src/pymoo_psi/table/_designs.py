"""Designs as a matrix: float64, int64 or bool where all variables are of that kind, else objects.

In a matrix of objects a cell is Python's float, int, bool or str. So every value comes back from
a frame or a file with the type it had.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._validation import Received, invalid, wrong_type
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError
from pymoo_psi.table._cells import INT64
from pymoo_psi.table._layout import is_writable

_DECIMALS = re.compile(r"\d*\.\d+(?:[eE][+-]?\d+)?|\d+(?:\.\d*)?[eE][+-]?\d+")
_KIND_OF_TYPE = {float: Kind.REAL, int: Kind.INTEGER, bool: Kind.BINARY, str: Kind.CHOICE}
_KIND_OF_DTYPE = {"f": Kind.REAL, "i": Kind.INTEGER, "b": Kind.BINARY}


def design_matrix(
    name: str, value: Any, variables: Sequence[str] | None = None, kinds: Sequence[Kind] = ()
) -> NDArray[Any]:
    """Return designs as a new ``(n, n_var)`` array in one normal form.

    Args:
        name: Name of the argument, for messages.
        value: ``(n, n_var)`` array or rows; or n mappings from variable to value, as pymoo's
            mixed-variable problems have them. In rows of numbers alone, whole numbers beside
            fractions are real numbers; other rows are taken as they are.
        variables: The names of the variables, the order for mappings; theirs unless given.
        kinds: What the variables are, where that is known; values are taken accordingly.

    Raises:
        ArgumentValueError: Rows differ in length, a variable is missing, a number is not finite.
        ArgumentTypeError: A value is neither number nor boolean nor text, or not of its kind.
    """
    if not isinstance(value, np.ndarray):
        # Iterating over a frame gives its names; its rows are designs whose variables have these.
        frame: Any = value if hasattr(value, "itertuples") else None
        columns = frame is None and hasattr(value, "columns")  # those of polars for rows
        if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Iterable) or columns:
            raise wrong_type(name, "an array or rows, or a frame of pandas", value)
        if frame is not None and not frame.columns.is_unique:  # a design would lose a variable
            rule = "a frame whose columns have different names"
            raise invalid(name, rule, list(frame.columns))
        value = list(value) if frame is None else frame.to_dict("records")
    if np.ma.is_masked(value):
        raise invalid(name, "without masked cells", value)
    # Told by the first row; rows of another sort than the first are refused below.
    first = value[0] if (isinstance(value, list) or value.ndim) and len(value) else None
    if isinstance(first, Mapping):
        value = _from_mappings(name, value, list(first) if variables is None else variables)
    try:
        array = np.asarray(value)
        # numpy gives [2^62 + 1, 0.5] float64, which loses the last digits of the integer; as
        # objects the cells keep their types until their kinds are known.
        if isinstance(value, list) and (len(set(kinds)) > 1 or _has_lost_types(value, array)):
            array = np.array(value, dtype=object)
    except ValueError as error:  # rows of unequal length
        raise ArgumentValueError(f"{name} must be a rectangular array: {error}") from error
    if array.ndim != 2:
        raise invalid(
            name, "two-dimensional (n designs, n_var variables)", Received(f"shape {array.shape}")
        )
    return _of_kinds(name, _normal(name, array), variables, kinds)


def joined_designs(blocks: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return the rows of several design matrices in normal form, their values of the same types."""
    # A matrix without rows may be float64 whatever its variables are, and makes no other objects.
    filled = [block for block in blocks if len(block)] or [blocks[0]]
    if any(block.dtype != filled[0].dtype for block in filled):
        # Before they are put together: numpy would make floats of integers, integers of booleans.
        filled = [block.astype(object) for block in filled]
    return np.concatenate(filled)


def design_row(
    name: str, value: Any, variables: Sequence[str], kinds: Sequence[Kind] = ()
) -> NDArray[Any]:
    """Return one design as a new ``(n_var,)`` array in the normal form of :func:`design_matrix`.

    Args:
        name: Name of the argument, for messages.
        value: ``(n_var,)`` array or values, or a mapping from variable to value.
        variables: The names of the variables.
        kinds: What the variables are, where that is known; a value that is equal to none of its
            kind is taken as it is.
    """
    rows = value[None] if isinstance(value, np.ndarray) and value.ndim else [value]
    matrix = design_matrix(name, rows, variables)
    if matrix.shape[1] != len(variables):
        rule = f"{len(variables)} values, one for each variable"
        raise invalid(name, rule, Received(matrix.shape[1]))
    if len(kinds) == len(variables):
        cells = [_as_kind(cell, kind) for cell, kind in zip(matrix[0].tolist(), kinds, strict=True)]
        matrix = _narrowest([cells], matrix.shape)
    row: NDArray[Any] = matrix[0]
    return row


def column_kinds(X: NDArray[Any]) -> tuple[Kind, ...]:
    """Return the kind of each column of a design matrix in normal form, as its values tell.

    Values of several types, and integers beyond int64, are those of a choice.
    """
    if X.dtype != object:
        return (_KIND_OF_DTYPE[X.dtype.kind],) * int(X.shape[1])
    columns: list[list[Any]] = X.T.tolist()
    return tuple(map(_kind, columns))


def real_column(name: str, column: NDArray[Any]) -> NDArray[np.float64]:
    """Return a column as float64; one of a matrix of objects may hold numbers, too.

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


def values_in_order(column: NDArray[Any]) -> list[Any]:
    """Return the distinct values of a column, ordered; values of one type stand together."""
    # With the types, as 1, 1.0 and True are equal and hash alike; by the types' names, as text and
    # numbers have no order.
    distinct = {(type(value), value) for value in column.tolist()}
    ordered = sorted(distinct, key=lambda pair: (pair[0].__name__, pair[1]))
    return [value for _, value in ordered]


def value_ranks(column: NDArray[Any]) -> tuple[list[Any], NDArray[np.intp]]:
    """Return the distinct values of a column, ordered, and ``(n,)`` the index of each cell's."""
    values = values_in_order(column)
    ranks = {(type(value), value): k for k, value in enumerate(values)}
    cells = column.tolist()
    return values, np.array([ranks[type(cell), cell] for cell in cells], dtype=np.intp)


def common_dtype(kinds: Sequence[Kind]) -> Any:
    """Return the dtype of a matrix of variables of these kinds; float64 if there is none."""
    different = set(kinds) or {Kind.REAL}
    return DTYPES[different.pop()] if len(different) == 1 else np.object_


def _normal(name: str, array: NDArray[Any]) -> NDArray[Any]:
    """Return a new array of the values as they are, of float64, int64, bool or objects."""
    if array.dtype.kind in "bi":
        return np.array(array, dtype=bool if array.dtype.kind == "b" else np.int64, order="C")
    if array.dtype.kind == "f":
        array = np.array(array, dtype=np.float64, order="C")
        if not np.isfinite(array).all():
            i, j = (int(k) for k in np.argwhere(~np.isfinite(array))[0])
            raise invalid(name, "finite", Received(f"{array[i, j]} at index {(i, j)}"))
        return array
    if array.dtype.kind not in "OUu":
        rule = f"{name} must hold numbers, booleans or text, got dtype {array.dtype}"
        raise ArgumentTypeError(rule)
    return _narrowest([[_plain(name, cell) for cell in row] for row in array.tolist()], array.shape)


def _narrowest(cells: list[list[Any]], shape: tuple[int, ...]) -> NDArray[Any]:
    types = {type(cell) for row in cells for cell in row} or {float}
    dtype: Any = object
    if len(types) == 1:
        dtype = {float: np.float64, int: np.int64, bool: np.bool_}.get(types.pop(), object)
    # Integers of Python have no bounds: beyond int64 they stay objects, see column_kinds.
    if dtype is np.int64 and not all(cell in INT64 for row in cells for cell in row):
        dtype = object
    array = np.empty(shape, dtype=dtype)
    # numpy cannot spread an empty list over shape (0, n_var).
    if array.size:
        array[:] = cells
    return array


def _of_kinds(
    name: str, array: NDArray[Any], variables: Sequence[str] | None, kinds: Sequence[Kind]
) -> NDArray[Any]:
    if len(kinds) != array.shape[1] or column_kinds(array) == kinds:
        return array  # another number of columns is told of where the table is put together
    result = np.empty(array.shape, dtype=object)
    for j, kind in enumerate(kinds):
        for i, cell in enumerate(array[:, j].tolist()):
            result[i, j] = _as_kind(cell, kind)
            if kind not in (Kind.CHOICE, _kind([result[i, j]])):
                column = f"x{j + 1}" if variables is None else variables[j]
                rule = f"{name} must hold {kind.value} values for {column}, got {cell!r:.80}"
                raise ArgumentTypeError(rule)
    return result.astype(common_dtype(kinds))


def _as_kind(cell: Any, kind: Kind) -> Any:
    """Return the number of a kind that is equal to a cell, or the cell if there is none."""
    # Exact types, since True is an int for isinstance. Python compares int and float exactly, so
    # that 2^53 + 1, which float64 does not have, is not taken for its neighbour.
    if type(cell) is int and kind is Kind.REAL and float(cell) == cell:
        return float(cell)
    if type(cell) is float and kind is Kind.INTEGER and cell.is_integer() and int(cell) in INT64:
        return int(cell)
    if type(cell) in (int, float) and kind is Kind.BINARY and cell in (0, 1):
        return bool(cell)
    return cell


def _kind(column: list[Any]) -> Kind:
    types = set(map(type, column))
    if len(types) != 1:
        return Kind.CHOICE
    kind = _KIND_OF_TYPE[types.pop()]
    if kind is Kind.INTEGER and not all(value in INT64 for value in column):
        return Kind.CHOICE  # no column of a file holds such integers
    return kind


def _from_mappings(name: str, rows: Any, variables: Sequence[str]) -> NDArray[Any]:
    matrix = np.empty((len(rows), len(variables)), dtype=object)
    for i, row in enumerate(rows):
        if not isinstance(row, Mapping) or set(row) != set(variables):
            rule = f"mappings of the variables {', '.join(variables)}"
            raise invalid(name, rule, _shown(row))
        for j, variable in enumerate(variables):
            matrix[i, j] = row[variable]
    return matrix


def _shown(row: Any) -> object:
    return Received(", ".join(map(str, row)) or "none") if isinstance(row, Mapping) else row


def _has_lost_types(rows: list[Any], array: NDArray[Any]) -> bool:
    """Say whether numbers beside text have become text, or booleans beside numbers numbers."""
    if array.dtype.kind in "if" and array.ndim == 2:
        return any(isinstance(cell, (bool, np.bool_)) for row in rows for cell in row)
    return array.dtype.kind in "US"


def _plain(name: str, cell: object) -> float | int | bool | str:
    if isinstance(cell, np.generic):
        cell = cell.item()
    # str(), bool(), int() and float() turn subclasses into Python's own types: _kind looks types up
    # exactly, and cells are equal only if their types are.
    if isinstance(cell, str) and is_writable(cell):
        return str(cell)
    # Ahead of int, of which bool is a subclass.
    if isinstance(cell, bool):
        return bool(cell)
    if isinstance(cell, int) and abs(cell) < 2**1023:  # what float64 reaches
        return int(cell)
    if isinstance(cell, float) and np.isfinite(cell):
        return float(cell)
    found = "an integer beyond float64" if isinstance(cell, int) else f"{cell!r:.80}"
    rule = f"{name} must hold finite numbers, booleans or Unicode text, got {found}"
    kind = ArgumentValueError if isinstance(cell, (int, float, str)) else ArgumentTypeError
    raise kind(f"{rule}; name the options of a choice by text")


def design_keys(X: NDArray[Any]) -> list[tuple[str, ...]]:
    """Return for each row of ``(n, n_var)`` designs what is the same where the design is.

    Texts, as files and studies keep the options of a choice.
    """
    return [tuple(map(str, row)) for row in X.tolist()]


def first_rows(X: NDArray[Any], F: NDArray[np.float64]) -> NDArray[np.intp]:
    """``(n,)`` the index of the first row with the same design and criteria, perhaps its own."""
    seen: dict[Any, int] = {}
    keys = zip(design_keys(X), map(bytes, F), strict=True)
    return np.array([seen.setdefault(key, i) for i, key in enumerate(keys)], dtype=np.intp)


def alike(reasons: Iterable[str]) -> list[str]:
    """Return reasons of failures as lines; those that differ in decimals only have dots for these.

    Programs quote the design that they fail at, so that no two reasons are the same. Whole numbers
    stay: a program that exits with 3 fails otherwise than one that exits with 4.
    """
    lines = [" ".join(reason.split()) for reason in reasons]
    dotted = [_DECIMALS.sub("…", line) for line in lines]
    texts: dict[str, set[str]] = {}
    for line, same in zip(lines, dotted, strict=True):
        texts.setdefault(same, set()).add(line)
    pairs = zip(lines, dotted, strict=True)
    return [line if len(texts[same]) == 1 else same for line, same in pairs]
