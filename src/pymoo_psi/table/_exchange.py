"""Tests as a data frame and as files, from which they come back unchanged."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING

from pymoo_psi.table._csv_file import read_csv, write_csv
from pymoo_psi.table._frames import table_frame
from pymoo_psi.table._judgement import JudgedRecords
from pymoo_psi.table._parquet_file import read_parquet, write_parquet

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Self


@dataclass(frozen=True, eq=False, repr=False)
class FiledRecords(JudgedRecords):
    """Judged tests that go to frames and files, and are read from them."""

    def to_frame(self) -> pd.DataFrame:
        """Return the table with one row per test point.

        Returns:
            Index ``test_point``; a column for each variable, criterion and constraint under its
            name; ``status``; ``broken``, the names of the constraints a design breaks;
            ``reason``, why it failed; ``pareto``.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[0.0], [0.1]])
            >>> print(table.to_frame().drop(columns="reason"))
                         x1   f1   g1      status broken  pareto
            test_point
            1           0.0  1.0  0.0          ok           True
            2           0.5  2.0  0.1  infeasible     g1   False
        """
        return table_frame(self)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table; :meth:`read_csv` reads it back without a change.

        The first line, a comment, holds names, bounds, tolerance and prototype as JSON; below are
        a header and one row per test point, the columns those of :meth:`to_frame`. pandas reads
        them by ``pd.read_csv(path, comment="#", index_col="test_point")``; before 3.1 it wants
        ``float_precision="round_trip"`` for the last digit. An interrupted writing leaves the old
        file as it was.

        Example:
            >>> import os, tempfile
            >>> import pandas as pd
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = os.path.join(folder, "table.csv")
            ...     table.to_csv(path)
            ...     print(pd.read_csv(path, comment="#", index_col="test_point")[["x1", "f1"]])
                         x1   f1
            test_point
            1           0.0  3.0
            2           0.5  4.0
        """
        write_csv(self, path)

    @classmethod
    def read_csv(cls, path: str | PathLike[str]) -> Self:
        """Read a table that :meth:`to_csv` wrote.

        Rows may stand in any order, and further columns are not read; ``broken`` and ``pareto``
        follow from the others.

        Raises:
            ArgumentValueError: The file is not such a table, or is damaged.
            OSError: The file cannot be opened.

        Example:
            >>> import os, tempfile
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.0], [0.1]], [[1 / 3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     table.to_csv(os.path.join(folder, "table.csv"))
            ...     TestTable.read_csv(os.path.join(folder, "table.csv")).equals(table)
            True
        """
        return read_csv(path, cls)

    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Write the table as Parquet, by pandas and pyarrow, whole or not at all.

        Raises:
            PsiError: pyarrow is not installed.

        Example:
            >>> import os, tempfile
            >>> import pandas as pd
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     table.to_parquet(os.path.join(folder, "table.parquet"))
            ...     pd.read_parquet(os.path.join(folder, "table.parquet"))["f1"].tolist()
            [3.0, 4.0]
        """
        write_parquet(self, path)

    @classmethod
    def read_parquet(cls, path: str | PathLike[str]) -> Self:
        """Read a table that :meth:`to_parquet` wrote.

        Raises:
            PsiError: pyarrow is not installed.
            ArgumentValueError: The file is not such a table, or is damaged.
            OSError: The file cannot be opened.

        Example:
            >>> import os, tempfile
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.0], [0.1]], [[1 / 3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     table.to_parquet(os.path.join(folder, "table.parquet"))
            ...     TestTable.read_parquet(os.path.join(folder, "table.parquet")).equals(table)
            True
        """
        return read_parquet(path, cls)
