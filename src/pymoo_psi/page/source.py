"""Designs from a file: the CSV of any Pareto set, or a test table.

A reader per kind of file, chosen by how the file begins.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pymoo_psi.arguments import Received, broken_rule, known_name
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.investigation import TestTable

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["PageTable", "table_from_file", "table_of_tests"]

_LABELS = ("test_point", "number", "label", "name", "id", "design", "row")
_DERIVED = ("mu1", "mu2", "mu3", "rank", "pareto", "mark")  # what our own files add to designs


@dataclass(frozen=True, eq=False)
class PageTable:
    """Designs and what their columns are, as :func:`decision_page` takes them.

    Attributes:
        frame: One row per design.
        objectives: Names of the columns with criteria.
        variables: Names of the columns with design variables.
        label: Name of the column with the designs' numbers; None: the frame's index.
        prototype: Rows of existing designs, or None.

    Example:
        >>> import pandas as pd
        >>> frame = pd.DataFrame({"f1": [0, 1, 4], "f2": [4, 1, 0], "x1": [1, 2, 3]})
        >>> PageTable(frame, objectives=("f1", "f2"), variables=("x1",)).label is None
        True
    """

    frame: pd.DataFrame
    objectives: tuple[str, ...]
    variables: tuple[str, ...] = ()
    label: str | None = None
    prototype: pd.DataFrame | None = None


def table_from_file(
    path: str | PathLike[str],
    *,
    objectives: Sequence[str] | None = None,
    variables: Sequence[str] | None = None,
) -> PageTable:
    """Read designs from a file.

    Args:
        path: A CSV with a header, or a file of :meth:`TestTable.to_csv` or of a study, of which
            the feasible designs are taken.
        objectives: Names of the columns with criteria. Unless given: those the test table names;
            else f1, f2, … with variables x1, x2, …, if there are any; else all numeric columns.
        variables: Names of the columns with design variables, likewise.

    Raises:
        ArgumentValueError: The file is empty, no table, or lacks a column.
        StudyError: It is a database but no study, or a damaged one.
        OSError: The file cannot be opened.

    Example:
        >>> import os, tempfile
        >>> import pandas as pd
        >>> designs = pd.DataFrame({"name": ["A", "B"], "x1": [1, 2], "f1": [0, 4], "f2": [4, 0]})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     designs.to_csv(os.path.join(folder, "designs.csv"), index=False)
        ...     table = table_from_file(os.path.join(folder, "designs.csv"))
        >>> table.objectives, table.variables, table.label
        (('f1', 'f2'), ('x1',), 'name')
    """
    with open(path, "rb") as file:
        start = file.read(64)
    if start.startswith(b"SQLite format 3\0"):
        table = table_of_tests(TestTable.read_study(path))
    elif b"pymoo_psi_test_table" in start:
        table = table_of_tests(TestTable.read_csv(path))
    else:
        table = _table_of_any(path, _read_csv(path), objectives, variables)
    chosen = table.objectives if objectives is None else tuple(objectives)
    kept = table.variables if variables is None else tuple(variables)
    for argument, names in (("objectives", chosen), ("variables", kept)):
        for name in names:
            known_name(argument, name, [str(c) for c in table.frame.columns], f"see {path}")
    kept = tuple(name for name in kept if name not in chosen or variables is not None)
    return PageTable(table.frame, chosen, kept, table.label, table.prototype)


def table_of_tests(table: TestTable) -> PageTable:
    """Return the feasible designs of a test table with finite criteria, and its prototype.

    Raises:
        ArgumentValueError: The table has no criteria.
    """
    import pandas as pd

    layout, prototype = table.layout, table.prototype
    if not layout.objectives:
        raise broken_rule("the test table", "one with criteria", Received("none"))
    rows = None
    if prototype is not None:
        cells = dict(zip(layout.objectives, prototype.f.tolist(), strict=True))
        cells |= dict(zip(layout.variables, prototype.x.tolist(), strict=True))
        rows = pd.DataFrame([cells], index=[prototype.name])
    frame = table.to_frame()[table.eligible()]
    return PageTable(frame, layout.objectives, layout.variables, None, rows)


def _read_csv(path: str | PathLike[str]) -> pd.DataFrame:
    import pandas as pd

    # pandas reads the last digit of a number as it was written only if asked to, and from 3.1 on
    # always, and warns of being asked.
    before = tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1)
    exact: dict[str, Any] = {"float_precision": "round_trip"} if before else {}
    try:
        frame: pd.DataFrame = pd.read_csv(path, encoding="utf-8-sig", index_col=False, **exact)
    except pd.errors.EmptyDataError:
        raise broken_rule(str(path), "a CSV with a header", Received("an empty file")) from None
    except (pd.errors.ParserError, UnicodeDecodeError) as error:
        raise ArgumentValueError(f"{path} must be a CSV file: {error}") from None
    if frame.empty:
        raise broken_rule(str(path), "a CSV with a row per design", Received("a header only"))
    frame.columns = pd.Index([str(name).strip() for name in frame.columns])
    return frame


def _require_plain(path: str | PathLike[str], name: str, column: pd.Series) -> None:
    """Refuse a column of numbers with text in it: a typo must not drop an objective in silence."""
    import pandas as pd

    numbers = pd.to_numeric(column, errors="coerce")
    text = column.notna() & numbers.isna()
    if text.any() and not text.all():
        row = int(text.to_numpy().argmax())
        raise broken_rule(
            f"column {name!r} of {path}",
            "numbers only or text only",
            Received(f"{column.iloc[row]!r} in row {row + 1}"),
            "correct it, or name the objectives",
        )


def _table_of_any(
    path: str | PathLike[str],
    frame: pd.DataFrame,
    objectives: Sequence[str] | None,
    variables: Sequence[str] | None,
) -> PageTable:
    """Guess what was not said from the names of the columns."""
    label = next((name for name in _LABELS if name in frame), None)
    taken: set[Any] = {*(objectives or ()), *(variables or ()), *_DERIVED, label}
    if label in {*(objectives or ()), *(variables or ())}:
        label = None
    free = [str(name) for name in frame.columns if name not in taken]
    criteria = [name for name in free if re.fullmatch(r"f\d+", name)]
    designs = [name for name in free if re.fullmatch(r"[xu]\d+", name)]
    if objectives is not None:
        criteria = list(objectives)
    elif not criteria:
        designs = []
        for name in free:
            _require_plain(path, name, frame[name])
        criteria = list(frame[free].select_dtypes("number").columns)
    if not criteria:
        raise broken_rule(
            Path(path).name, "a table with numeric columns", Received(", ".join(frame.columns))
        )
    if label is None:
        frame = frame.set_axis(frame.index + 1).rename_axis("row")
    return PageTable(frame, tuple(criteria), tuple(designs), label)
