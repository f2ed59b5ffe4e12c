"""Columns of cells that never change, and the matrices that are made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from pymoo_psi._validation import AnyArray, Rows
from pymoo_psi.table._schema import OBJECTIVE, Column


class Data(dict[str, AnyArray]):
    """``(n,)`` columns by name, read-only, shared by all formulations of a table.

    Args:
        columns: ``(n,)`` arrays by name.
        matrices: Matrices of columns that are known already.

    Attributes:
        matrices: Matrices by their columns, as long as something uses them.
    """

    def __init__(
        self,
        columns: Mapping[str, AnyArray],
        matrices: Mapping[tuple[Column, ...], AnyArray] | None = None,
    ) -> None:
        super().__init__(columns)
        self.matrices: WeakValueDictionary[tuple[Column, ...], AnyArray]
        self.matrices = WeakValueDictionary(matrices or {})
        for array in (*self.values(), *self.matrices.values()):
            array.setflags(write=False)

    def __reduce__(self) -> tuple[type, tuple[Mapping[str, AnyArray]]]:
        """Pickle the columns alone; NumPy's arrays come back writable."""
        return Data, (dict(self),)

    def matrix(self, n: int, columns: tuple[Column, ...]) -> AnyArray:
        """Return the ``(n, k)`` matrix of columns, shared by all formulations that use it.

        It is of objects if their types differ. Objectives that are maximised are negated.
        """
        matrix = self.matrices.get(columns)
        if matrix is not None:
            return matrix
        dtypes = {self[column.name].dtype for column in columns}
        dtype: np.dtype[Any] = np.dtype(np.float64)
        if dtypes:
            dtype = np.dtype(object)
        if len(dtypes) == 1:
            (dtype,) = dtypes
        matrix = np.empty((n, len(columns)), dtype)
        for j, column in enumerate(columns):
            cells = self[column.name]
            if column.role == OBJECTIVE and column.maximize:
                cells = -cells
            matrix[:, j] = cells
        matrix.setflags(write=False)
        self.matrices[columns] = matrix
        return matrix

    def with_columns(self, columns: Mapping[str, AnyArray]) -> Data:
        """Return these and further columns, or others in the place of those with their names."""
        if not columns:
            return self
        matrices = {}
        for key, matrix in self.matrices.items():
            if not any(column.name in columns for column in key):
                matrices[key] = matrix
        return Data({**self, **columns}, matrices)

    def take(self, rows: Rows) -> Data:
        """Return some rows; `take` needs a quarter of the time of an index in brackets."""
        return Data({name: cells.take(rows) for name, cells in self.items()})
