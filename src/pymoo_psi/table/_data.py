"""Columns of cells that never change, and the matrices that are made of them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

import numpy as np

from pymoo_psi._validation import AnyArray, Names, Rows

_MOST = 8  # matrices that are kept


class Data(Mapping[str, AnyArray]):
    """``(n,)`` columns by name, read-only, shared by all formulations of a table.

    Args:
        columns: ``(n,)`` arrays by name.
        matrices: Matrices of columns that are known already.

    Attributes:
        matrices: Matrices of columns by the names of these, each after a sign: ``-`` of a column
            that is negated, else ``+``.
    """

    def __init__(
        self,
        columns: Mapping[str, AnyArray],
        matrices: Mapping[tuple[str, ...], AnyArray] | None = None,
    ) -> None:
        self._columns = dict(columns)
        self.matrices = dict(matrices or {})
        for array in (*self._columns.values(), *self.matrices.values()):
            array.setflags(write=False)

    def __getitem__(self, name: str) -> AnyArray:
        """Return the cells of a column."""
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(self._columns)

    def __len__(self) -> int:
        """Return the number of columns."""
        return len(self._columns)

    def __reduce__(self) -> tuple[type, tuple[Mapping[str, AnyArray]]]:
        """Pickle the columns alone; NumPy's arrays come back writable."""
        return Data, (self._columns,)

    @staticmethod
    def key(names: Names, turned: Collection[str] = ()) -> tuple[str, ...]:
        """Return the key of a matrix of some columns, of which some are negated."""
        return tuple(f"-{name}" if name in turned else f"+{name}" for name in names)

    def matrix(self, n: int, names: Names, turned: Collection[str] = ()) -> AnyArray:
        """Return the ``(n, k)`` matrix of some columns, made once for all formulations.

        Args:
            n: The number of rows.
            names: The columns. Their matrix is of objects if their types differ.
            turned: The columns that are negated.
        """
        key = self.key(names, turned)
        if key not in self.matrices:
            columns = []
            for name in names:
                cells = self._columns[name]
                columns.append(-cells if name in turned else cells)
            matrix = joined_columns(columns, n)
            matrix.setflags(write=False)
            while len(self.matrices) >= _MOST:
                self.matrices.pop(next(iter(self.matrices)))
            self.matrices[key] = matrix
        return self.matrices[key]

    def with_columns(self, columns: Mapping[str, AnyArray]) -> Data:
        """Return these and further columns, or others in the place of those with their names."""
        replaced = {f"{sign}{name}" for name in columns for sign in "+-"}
        matrices = {}
        for key, matrix in self.matrices.items():
            if replaced.isdisjoint(key):
                matrices[key] = matrix
        return Data({**self._columns, **columns}, matrices)

    def take(self, rows: Rows) -> Data:
        """Return some rows; `take` needs a quarter of the time of an index in brackets."""
        columns = {name: cells.take(rows) for name, cells in self._columns.items()}
        return Data(columns)


def joined_columns(columns: list[AnyArray], n: int) -> AnyArray:
    """Return the ``(n, k)`` matrix of columns, of objects if their types differ."""
    dtypes = {cells.dtype for cells in columns} or {np.dtype(np.float64)}
    dtype = dtypes.pop() if len(dtypes) == 1 else np.dtype(object)
    matrix = np.empty((n, len(columns)), dtype)
    for j, cells in enumerate(columns):
        matrix[:, j] = cells.tolist() if dtype.kind == "O" else cells
    return matrix
