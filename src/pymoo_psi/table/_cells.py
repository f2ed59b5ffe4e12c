"""Cells of columns, their kinds, and designs in any form as columns of cells."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from pymoo_psi._kinds import DTYPES, Kind, is_of_kind, kind_of_cells, plain
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Columns,
    Mask,
    Names,
    Received,
    Rows,
    finite_array,
    invalid,
    source_type,
    wrong_type,
)
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.table._schema import VARIABLE, Column, Schema

# Cells


def cells_of_kind(name: str, values: Any, kind: Kind | None) -> AnyArray:
    """Return the ``(n,)`` cells of a column as an array of its kind, the same one if it is that.

    Raises:
        ArgumentTypeError: A cell is not of the kind.
    """
    array = values if isinstance(values, np.ndarray) else np.fromiter(values, object)
    kind = kind or kind_of_cells(array)
    dtype = np.dtype(DTYPES[kind])
    if array.dtype == dtype != np.object_:
        return array
    cells = np.empty(len(array), dtype)
    for i, cell in enumerate(map(plain, array.tolist())):
        if not is_of_kind(cell, kind):
            message = f"X must hold {kind.value} values for {name}, got {cell!r:.80}"
            raise ArgumentTypeError(message)
        if not isinstance(cell, (int, float, str)):
            rule = "a number, True, False or text"
            raise wrong_type(f"a value of {name}", rule, cell, "name options of a choice by text")
        cells[i] = cell
    return cells


def real_column(name: str, column: AnyArray) -> Array:
    """Return a ``(n,)`` column as float64; one of objects may hold numbers, too.

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
    return column.astype(np.float64, copy=False)


def in_decimals(values: Array) -> Array:
    """Return ``(n,)`` computed values with 15 digits, as 0.1 + 0.2 is to keep the limit 0.3."""
    digits = np.array([float(f"{value:.15g}") for value in values.tolist()], dtype=np.float64)
    return np.where(np.isinf(digits), values, digits)  # the largest number is a penalty


def blank(column: AnyArray) -> Mask:
    """``(n,)`` which cells hold nothing, or an empty text."""
    if column.dtype.kind == "f":
        return np.isnan(column)
    cells = column.tolist()
    return np.array([cell is None or cell != cell or cell == "" for cell in cells], dtype=bool)


def value_ranks(column: AnyArray) -> tuple[list[Any], Rows]:
    """Return the distinct values of a column in order, and ``(n,)`` the index of each cell's value.

    Numbers stand together, as do texts, true and false.
    """
    keys = []
    for cell in column.tolist():
        kind = type(cell).__name__
        # Text and numbers have no order; 1, 1.0 and True are equal and hash alike.
        keys.append(("float" if kind == "int" else kind, cell, kind))
    ranks = {key: rank for rank, key in enumerate(sorted(set(keys)))}
    values = [value for _, value, _ in ranks]
    return values, np.array([ranks[key] for key in keys], dtype=np.intp)


# Designs


def designs_of(
    value: Any, variables: Sequence[Column] | None = None
) -> tuple[Columns, list[Column]]:
    """Return n designs as columns, and the variables with their kinds.

    Args:
        value: ``(n, n_var)`` array, rows, or frame; or n mappings from variable to value, as
            pymoo's mixed-variable problems have them. Whole numbers beside fractions are real
            numbers where all cells of rows are numbers; other values keep their types.
        variables: The variables; unless given, those of mappings or a frame, or else x1, x2, ….
            The kind of one that has none is that of its values.

    Raises:
        ArgumentValueError: Rows differ in length, a variable is missing, a number is not finite.
        ArgumentTypeError: A value is neither number nor boolean nor text, or not of its kind.
    """
    array, variables = _matrix(value, variables)
    columns = []
    data: Columns = {}
    for column, values in zip(variables, array.T, strict=True):
        cells = cells_of_kind(column.name, values, column.kind)
        numbers = cells
        if cells.dtype == object:
            numbers = np.array([cell for cell in cells.tolist() if isinstance(cell, float)])
        finite_array(f"X, {column.name},", numbers)
        data[column.name] = cells
        if len(cells):
            column = column._replace(kind=column.kind or kind_of_cells(cells))
        columns.append(column)
    return data, columns


def _matrix(designs: Any, variables: Sequence[Column] | None) -> tuple[AnyArray, Sequence[Column]]:
    """Return designs in any form as a new ``(n, n_var)`` array, and the variables."""
    if isinstance(designs, str) or not isinstance(designs, Iterable):
        raise wrong_type("X", "an (n, n_var) array, rows, mappings or a frame", designs)
    if isinstance(designs, np.ndarray) and designs.ndim > 1:
        array = np.array(designs, order="C")
    else:
        frame: Any = designs
        rows = frame.to_dict("records") if source_type(frame) == "frame" else [*frame]
        if rows and isinstance(rows[0], Mapping):
            if variables is None:
                variables = [Column(name, VARIABLE, None) for name in rows[0]]
            rows = _rows_of_mappings(rows, [column.name for column in variables])
        array = _array_of_rows(rows, variables)
    if variables is None and array.ndim == 2:
        variables = Schema.of(array.shape[1]).with_role(VARIABLE)
    n_var = "n_var" if variables is None else len(variables)
    if variables is None or array.shape[1:] != (n_var,):
        raise invalid("X", f"of shape (n, {n_var})", Received(f"shape {array.shape}"))
    return array, variables


def _rows_of_mappings(rows: Sequence[Any], names: Names) -> list[list[Any]]:
    """Return mappings from variable to value as rows of values."""
    for row in rows:
        if not isinstance(row, Mapping) or row.keys() != {*names}:
            raise invalid("X", f"mappings of the variables {', '.join(names)}", row)
    return [[row[name] for name in names] for row in rows]


def _array_of_rows(rows: Sequence[Any], variables: Sequence[Column] | None) -> AnyArray:
    """Return rows of cells as an array of objects; of real numbers if no kind says otherwise."""
    array = np.array(rows, dtype=object)
    if variables and all(column.kind for column in variables):
        return array
    types = {type(plain(cell)) for cell in array.ravel().tolist()}
    if types == {int, float}:
        return array.astype(np.float64)
    return array
