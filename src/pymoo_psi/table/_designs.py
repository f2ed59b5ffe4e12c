"""Designs in any form, as columns: an array, rows, a frame, or mappings of the variables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from pymoo_psi._kinds import plain
from pymoo_psi._validation import (
    AnyArray,
    Columns,
    Names,
    Received,
    finite_array,
    invalid,
    wrong_type,
)
from pymoo_psi.table._schema import VARIABLE, Column, cells_of_kind, kind_of_cells


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
    if hasattr(value, "itertuples"):  # a frame of pandas
        value = value.to_dict("records")
    if isinstance(value, np.ndarray) and value.dtype == object and value.ndim == 1:
        value = value.tolist()
    names = None
    if variables is not None:
        names = [column.name for column in variables]
    elif isinstance(value, Sequence) and value and isinstance(value[0], Mapping):
        names = [*value[0]]
    is_declared = variables is not None and all(column.kind for column in variables)
    array = _array(value, names, real=not is_declared)
    if array.ndim != 2 or (variables is not None and array.shape[1] != len(variables)):
        width = "n_var" if variables is None else len(variables)
        raise invalid("X", f"of shape (n, {width})", Received(f"shape {array.shape}"))
    if variables is None:
        names = names or [f"x{j + 1}" for j in range(array.shape[1])]
        variables = [Column(name, VARIABLE, None) for name in names]
    columns = []
    data: Columns = {}
    for column, cells in zip(variables, array.T, strict=True):
        name = column.name
        data[name] = cells_of_kind(name, cells, column.kind)
        if data[name].dtype.kind == "f":
            finite_array(f"X, {name},", data[name])
        elif data[name].dtype == object:
            fractions = [cell for cell in data[name].tolist() if isinstance(cell, float)]
            finite_array(f"X, {name},", np.array(fractions))
        if len(array):
            column = column._replace(kind=column.kind or kind_of_cells(data[name]))
        columns.append(column)
    return data, columns


def _array(value: Any, names: Names | None, *, real: bool) -> AnyArray:
    """Return designs as a new two-dimensional array, of objects unless all are of one type.

    Args:
        value: The designs.
        names: The variables of mappings.
        real: Whether whole numbers beside fractions are real numbers.
    """
    if isinstance(value, np.ndarray):
        return np.array(value, order="C")
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise wrong_type("X", "an (n, n_var) array, rows, mappings or a frame", value)
    rows = list(value)
    if rows and isinstance(rows[0], Mapping):
        names = names or []
        for i, row in enumerate(rows):
            if not isinstance(row, Mapping) or row.keys() != {*names}:
                raise invalid("X", f"mappings of the variables {', '.join(map(str, names))}", row)
            rows[i] = [row[name] for name in names]
    try:
        array = np.array(rows, dtype=object)
    except ValueError as error:
        raise invalid("X", "rows of one length", Received(error)) from None
    types = {type(plain(cell)) for cell in array.ravel().tolist()}
    if real and types == {int, float}:
        return array.astype(np.float64)
    return array
