"""Reading a file of designs: a reader per kind of file, chosen by how the file begins."""

from __future__ import annotations

import json
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi.investigation.design_file.cells import UnfitError, parsed
from pymoo_psi.investigation.design_file.file import DesignFile, unfit
from pymoo_psi.investigation.design_file.roles import Roles
from pymoo_psi.investigation.records import STATUSES
from pymoo_psi.investigation.table import TestTable
from pymoo_psi.pareto.ranking import RANKING_COLUMNS

__all__ = ["read_designs"]

_TEST_TABLE = b"pymoo_psi_test_table"


def read_designs(path: str | PathLike[str]) -> DesignFile:
    r"""Read the designs of a file.

    Args:
        path: A CSV with commas, semicolons (with decimal commas or points) or tabs, comments
            (``#``) above its header or none; a test table, CSV or Parquet, or a study, of which
            the feasible designs are taken; a ranking that ``pymoo-psi rank --out`` wrote as CSV
            or JSON; what the decision page exported.

    Raises:
        OSError: The file cannot be opened.
        ArgumentValueError: It is no table of named columns with one design or more.
        StudyError: It is a database but no study, or a damaged one.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder, "set.csv")
        ...     _ = path.write_text("id;cost;mass\nA;1,5;4\nB;2;1\n", encoding="utf-8")
        ...     file = read_designs(path)
        >>> file.values(["cost", "mass"])
        array([[1.5, 4. ],
               [2. , 1. ]])
    """
    path = Path(path)
    with path.open("rb") as file:
        start = file.read(4096)
    if start.startswith(b"SQLite format 3\0"):
        return _of_tests(path, TestTable.read_study(path))
    if start.startswith(b"PAR1"):
        return _of_tests(path, TestTable.read_parquet(path))
    if start.startswith(b"PK\x03\x04"):
        raise unfit(path, "it is a workbook or an archive; save the sheet as CSV")
    if _TEST_TABLE in start.partition(b"\n")[0]:
        return _of_tests(path, TestTable.read_csv(path))
    try:
        with path.open(encoding="utf-8-sig", newline="") as lines:
            text = lines.read()
    except UnicodeDecodeError as error:
        raise unfit(path, f"it is no UTF-8 text: {error.reason}; save it as CSV UTF-8") from None
    if text.lstrip().startswith(("{", "[")):
        return _of_json(path, text)
    return _of_csv(path, text)


def _of_tests(path: Path, table: TestTable) -> DesignFile:
    """Return the feasible designs of a test table with finite criteria, and its prototype."""
    import pandas as pd

    layout, prototype = table.layout, table.prototype
    if not layout.objectives:
        raise unfit(path, "its tests have no criteria")
    feasible = np.flatnonzero(table.eligible())
    if len(feasible) == 0:
        raise unfit(path, f"none of its {len(table)} tests is feasible")
    rows = None
    if prototype is not None:
        cells = dict(zip(layout.objectives, prototype.f.tolist(), strict=True))
        cells |= dict(zip(layout.variables, prototype.x.tolist(), strict=True))
        rows = pd.DataFrame([cells], index=[prototype.name])
    frame = table.rows(feasible).to_frame().reset_index()
    frame = frame.drop(columns=["status", "broken", "reason", "pareto"])
    n, others = len(feasible), len(table) - len(feasible)
    remark = f"{n} of {len(table)} tests are feasible; the others are left out." if others else ""
    roles = Roles(layout.objectives, layout.variables, "test_point")
    return DesignFile(path, frame, (), roles, rows, remark)


def _of_csv(path: Path, text: str) -> DesignFile:
    """Return the designs of a CSV, without those that it says are prototypes, or not feasible."""
    import pandas as pd

    try:
        columns, lines = parsed(text)
    except UnfitError as error:
        raise unfit(path, str(error)) from None
    frame = pd.DataFrame(columns, dtype=object)
    feasible = np.ones(len(frame), dtype=bool)
    if set(columns.get("status", ["?"])) <= set(STATUSES):
        feasible = (frame["status"] == "ok").to_numpy()
    existing = np.zeros(len(frame), dtype=bool)
    if {"mark", *RANKING_COLUMNS[:-1]} <= set(columns):  # the page's export
        existing = (frame.pop("mark") == "prototype").to_numpy()
    kept = feasible & ~existing
    if not kept.any():
        raise unfit(path, f"none of its {len(kept)} designs is feasible, or all are prototypes")
    others = int((~feasible).sum())
    remark = f"{others} designs that are not feasible are left out." if others else ""
    cells = frame[kept].reset_index(drop=True)
    found = DesignFile(path, cells, [lines[i] for i in np.flatnonzero(kept)], remark=remark)
    if not existing.any():
        return found
    rows = DesignFile(path, frame[existing]).frame(())
    names = rows[found.label].astype(str) if found.label else ["prototype"] * len(rows)
    rows.index = pd.Index(names)
    return replace(found, prototype=rows)


def _of_json(path: Path, text: str) -> DesignFile:
    """Return a ranking that was written as JSON, with the objectives it names."""
    import pandas as pd

    try:
        content: Any = json.loads(text)
        objectives = tuple(map(str, content["objectives"]))
        maximized = tuple(map(str, content["maximized"]))
        designs = content["designs"]
        rows = [{str(name): _cell(cell) for name, cell in row.items()} for row in designs]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        what = "it is JSON, but none that 'pymoo-psi rank --out FILE.json' wrote"
        raise unfit(path, f"{what}; give the designs as CSV") from None
    if not rows or any({*row} != {*rows[0]} for row in rows) or not {*objectives} <= {*rows[0]}:
        raise unfit(path, "its designs are missing, or lack columns; rank the designs anew")
    found = DesignFile(path, pd.DataFrame(rows, dtype=object))
    return replace(found, known=Roles(objectives, (), found.label, maximized))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return value if isinstance(value, str) else repr(value)
