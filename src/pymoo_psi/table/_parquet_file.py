"""Test tables as Parquet, by pandas and pyarrow, where that is installed."""

from __future__ import annotations

import os
from importlib import import_module
from os import PathLike
from typing import Any, TypeVar

import numpy as np

from pymoo_psi._files import whole_file
from pymoo_psi.errors import PsiError
from pymoo_psi.table._designs import column_kinds
from pymoo_psi.table._frames import (
    PARSERS,
    column_formats,
    damaged,
    encoded,
    head_text,
    parsed_head,
    table_columns,
    table_of_columns,
)
from pymoo_psi.table._judgement import JudgedRecords
from pymoo_psi.table._records import Records

Table = TypeVar("Table", bound=Records)


_HEAD = "pymoo_psi"  # key of the head among the frame's attributes, which pandas keeps


def write_parquet(table: JudgedRecords, path: str | PathLike[str]) -> None:
    """Write a table whole or not at all; see :meth:`TestTable.to_parquet`."""
    _require_pyarrow()
    import pandas as pd

    kinds = dict(zip(table.layout.variables, column_kinds(table.X), strict=True))
    frame = pd.DataFrame(encoded(table_columns(table), kinds))
    frame.attrs = {_HEAD: head_text(table)}
    with whole_file(path) as written:
        frame.to_parquet(written, engine="pyarrow", index=False)


def read_parquet(path: str | PathLike[str], make: type[Table]) -> Table:
    """Read a table; see :meth:`TestTable.read_parquet`."""
    _require_pyarrow()
    import pandas as pd

    os.stat(path)  # a file that is not there is no damaged file
    try:
        frame = pd.read_parquet(path, engine="pyarrow")
    except Exception as error:  # pyarrow has errors of many kinds
        raise damaged(path, f"it cannot be read as Parquet: {error}") from None
    head = parsed_head(path, str(frame.attrs.get(_HEAD, "")))
    formats = column_formats(head["layout"], head["kinds"])
    missing = [name for name in formats if name not in frame]
    if missing:
        raise damaged(path, f"the columns {', '.join(map(repr, missing))} are missing")
    columns: dict[str, Any] = {}
    for name, kind in formats.items():
        try:
            if kind == "mixed":
                cells = [PARSERS[kind](cell) for cell in frame[name]]
                columns[name] = np.array(cells, dtype=object)
            else:
                columns[name] = frame[name].to_numpy(dtype=_DTYPES[kind])
        except (ValueError, TypeError):
            what = f"the column {name!r} holds other than {kind} values"
            raise damaged(path, what) from None
    return table_of_columns(path, head, columns, make)


_DTYPES: dict[str, Any] = {
    "real": np.float64,
    "integer": np.int64,
    "boolean": object,
    "text": object,
}


def _require_pyarrow() -> None:
    try:
        import_module("pyarrow")
    except ImportError:
        raise PsiError(
            "Parquet needs pyarrow, which is not installed; pip install pyarrow, or use to_csv"
        ) from None
