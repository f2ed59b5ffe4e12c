"""From a file of any kind to its designs or tests."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi._validation import integer, invalid
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.pareto import RANKING_COLUMNS
from pymoo_psi.table._analysis import alike
from pymoo_psi.table._cells import Column, Marks, read_columns
from pymoo_psi.table._design_file import DesignFile, unfit
from pymoo_psi.table._designs import is_writable
from pymoo_psi.table._files import MARK, read_csv, read_parquet, table_of
from pymoo_psi.table._formulation import distinct
from pymoo_psi.table._layout import ORIGIN
from pymoo_psi.table._roles import ROLES_MARK, Roles, labels_among, told_roles
from pymoo_psi.table._sheet import Sheet, UnfitError, decoded, sheet_of_text, sheet_of_workbook
from pymoo_psi.table._summaries import require_designs
from pymoo_psi.table._table import STATUSES, TestTable, read_tests

_ZIP = b"PK\x03\x04"  # how a local file in ZIP begins, such as an .xlsx


def read_designs(
    path: str | PathLike[str],
    *,
    decimal: str | None = None,
    thousands: str | None = None,
    encoding: str | None = None,
    skip_rows: Collection[int | str] = (),
    sheet: str | None = None,
) -> DesignFile:
    r"""Read the designs of a file, which is read once, so that it may be a pipe.

    A number of which more than one reading is possible, such as ``1.250`` where nothing else tells
    whether points divide thousands, is refused when its column is asked for, with the option
    that settles it; so is a column that looks like numbers but cannot be read. The command line
    has the same options.

    Args:
        path: Text with commas, semicolons, tabs, bars or spaces between its cells, comments
            (``#``) above its header or none; a workbook (.xlsx); a test table, CSV or Parquet,
            a study, or a folder of studies, of which the feasible designs are taken; a ranking that
            ``pymoo-psi rank --out`` wrote as CSV or JSON; what the decision page exported.
        decimal: The decimal mark of its numbers, ``"."`` or ``","``; as they tell unless given.
        thousands: The mark between thousands, ``"."``, ``","``, ``" "`` or ``"'"``, likewise.
        encoding: Of a text; by its byte-order mark, or UTF-8, unless given.
        skip_rows: Numbers of lines to leave out, from 1, such as titles and lines of units;
            ``"hidden"`` among them for all hidden rows of a workbook.
        sheet: Name of the sheet of a workbook; the only one with cells unless given.

    Raises:
        OSError: The file cannot be opened.
        ArgumentValueError: It is no table of named columns with one design or more, or a row of it
            summarises others.
        ArgumentTypeError: ``skip_rows`` holds no numbers.
        StudyError: It is a database but no study, or a damaged one.
        PsiError: A package that reads such files is not installed.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = Path(folder, "set.csv")
        ...     _ = path.write_text("id;cost;mass\nA;1,5;1.250\nB;2;980\n", encoding="utf-8")
        ...     file = read_designs(path, decimal=",")
        >>> file.values(["cost", "mass"]).tolist()
        [[1.5, 1250.0], [2.0, 980.0]]
    """
    found, missing = read_designs_or_tests(path, decimal, thousands, encoding, skip_rows, sheet)
    return found if isinstance(found, DesignFile) else designs_of_tests(path, found, missing)


def read_designs_or_tests(
    path: str | PathLike[str],
    decimal: str | None = None,
    thousands: str | None = None,
    encoding: str | None = None,
    skip_rows: Collection[int | str] = (),
    sheet: str | None = None,
) -> tuple[DesignFile | TestTable, str]:
    """Return the designs of a file, or all tests if it holds these, and which tests are missing.

    See :func:`read_designs`.
    """
    path, marks = Path(path), Marks(decimal, thousands)
    if isinstance(skip_rows, str) or not isinstance(skip_rows, Collection):
        raise ArgumentTypeError(f"skip_rows must be numbers of lines, got {skip_rows!r:.80}")
    skipped = frozenset(
        "hidden" if line == "hidden" else integer("a number in skip_rows", line, minimum=1)
        for line in skip_rows
    )
    if not isinstance(encoding, (str, type(None))):
        raise ArgumentTypeError(f"encoding must be the name of one, got {encoding!r:.80}")
    found, missing = (
        read_tests(path) if path.is_dir() else _content(path, marks, encoding, skipped, sheet)
    )
    if skipped and (isinstance(found, TestTable) or not found.lines):
        what = f"left out, as {path} is neither a text of designs nor a workbook"
        raise invalid("skip_rows", what, [*skipped])
    return found, missing


def _content(
    path: Path,
    marks: Marks,
    encoding: str | None,
    skipped: Collection[int | str],
    sheet: str | None,
) -> tuple[DesignFile | TestTable, str]:
    """Return what a file holds, by its content, and which tests are missing."""
    with path.open("rb") as opened:  # once: what a pipe has given it does not give again
        content = opened.read(16)  # as much as SQLite's mark
        if sheet is not None and not content.startswith(_ZIP):
            raise invalid("sheet", f"left out, as {path} is no workbook (.xlsx)", sheet)
        # SQLite opens files by name only, so a study, unlike the other files, cannot be a pipe.
        if content.startswith(b"SQLite format 3\0"):
            return read_tests(path)
        content += opened.read()
    # By content, not by suffix, which a pipe has not and people change. The marks are those of the
    # Parquet format, of ZIP, and of OLE compound files (.xls).
    try:
        if content.startswith(b"PAR1"):
            return table_of(*read_parquet(path, content), path, TestTable), ""
        if content.startswith(_ZIP):
            return _of_sheet(path, sheet_of_workbook(content, skipped, sheet), marks), ""
        if content.startswith(b"\xd0\xcf\x11\xe0"):
            what = "it is a workbook of old, or with a password"
            raise UnfitError(f"{what}; save it as .xlsx without one, or as CSV")
        text = decoded(content, encoding)
        first, end, rest = text.partition("\n")
        if MARK in first:
            return table_of(*read_csv(path, text), path, TestTable), ""
        if text.lstrip().startswith(("{", "[")):
            return _of_json(path, text, marks), ""
        told = ROLES_MARK in first
        # The line stays, as lines are counted, but as an empty comment.
        cells = sheet_of_text(f"#{end}{rest}" if told else text, skipped)
        file = _of_sheet(path, cells, marks)
        if told:
            roles, units = told_roles(first, file.names, file.label)
            file = replace(file, columns=_in_units(file.columns, units), known=roles)
        return file, ""
    except UnfitError as error:
        raise unfit(path, str(error)) from None


def designs_of_tests(path: str | PathLike[str], table: TestTable, missing: str = "") -> DesignFile:
    """Return the feasible designs of a test table with finite criteria, and its prototype."""
    import pandas as pd

    layout, prototype = table.layout, table.prototype
    if not layout.objectives:
        raise unfit(path, "its tests have no criteria")
    feasible = np.flatnonzero(table.eligible())
    lost = table.numbers[table.status == "failed"].tolist()
    reasons = Counter(alike(table.reasons.get(number) or "no reason is known" for number in lost))
    if len(feasible) == 0:
        violated, names = table.violations()
        rejects = violated.sum(axis=0)
        # Without any that is violated, values of a criterion are not finite, or all tests failed.
        why = f"{names[rejects.argmax()]} rejects most: {rejects.max()}" if violated.any() else (
            f"no test has finite values of {', '.join(layout.objectives)}"
        )  # fmt: skip
        # As many as a criterion leaves that cannot be computed of any.
        why += f"; {len(lost)} failed: {reasons.most_common(1)[0][0]:.80}" if lost else ""
        none = f"none of its {len(table)} tests is feasible; {why}"
        raise unfit(path, none if len(table) else "it holds no tests yet")
    rows = None
    if prototype is not None:
        names = (*layout.objectives, *layout.variables)
        cells = {name: prototype.column(name) for name in names}
        rows = pd.DataFrame(cells, index=prototype.names)
    n, others = len(feasible), len(table) - len(feasible)
    # Of tests with the same design the first stands for all, as in the table's own Pareto set.
    feasible = feasible[table.rows(feasible).repeats == 0]
    frame = table.rows(feasible).to_frame().reset_index()
    # Of feasible designs these say nothing; a ranking adds a pareto of its own.
    frame = frame.drop(columns=["status", "violated", "reason", "pareto"])
    columns = _in_units({str(n): Column.of(frame[n].tolist()) for n in frame.columns}, layout.units)
    remarks = [f"{missing}."] if missing else []
    if others:
        are = "is" if n == 1 else "are"
        remarks.append(f"{n} of {len(table)} tests {are} feasible; the others are left out.")
    if again := n - len(feasible):
        remarks.append(f"{again} of them tested a design once more, which counts once.")
    # The other column of their origin numbers the tests, as the label does: it is nothing to weigh.
    further = layout.outputs + (ORIGIN[:1] if layout.experiments else ())
    roles = Roles(layout.objectives, layout.variables, "test_point", layout.maximize, further)
    told = tuple(remarks)
    return DesignFile(
        Path(path), columns, feasible + 1, (), roles, rows, told, reasons, others - len(lost)
    )


def _of_sheet(path: Path, sheet: Sheet, marks: Marks) -> DesignFile:
    """Return the designs of a sheet, without those that it says are prototypes, or not feasible."""
    import pandas as pd

    columns, n = dict(sheet.columns), len(sheet.lines)
    status = columns.get("status", ["ok"] * n)
    # A column status of somebody else's, with other words in it, selects nothing.
    if not {*status} <= {*STATUSES}:
        status = ["ok"] * n
    reasons = zip(status, columns.get("reason", [""] * n), strict=True)
    lost = [str(why or "no reason is known") for how, why in reasons if how == "failed"]
    page = {"mark", *RANKING_COLUMNS[:-1]} <= {*columns}  # as it exports
    existing = np.array([page and cell == "prototype" for cell in columns.get("mark", [""] * n)])
    if page:
        del columns["mark"]
    feasible = np.array([cell == "ok" for cell in status])
    if not (feasible & ~existing).any():
        raise UnfitError(f"none of its {n} designs is feasible, or all are prototypes")
    # Before the numbers are read: a failed design may hold anything. With the prototypes: what is
    # certain of a column is so for all rows of it.
    taken = np.flatnonzero(feasible | existing)
    cells = {name: [column[i] for i in taken.tolist()] for name, column in columns.items()}
    whole = read_columns(cells, marks, sheet.divider, labels_among(columns))
    kept, old = np.flatnonzero(~existing[taken]), np.flatnonzero(existing[taken])
    n = int((~feasible & ~existing).sum())
    left = (
        "1 design that is not feasible is" if n == 1 else f"{n} designs that are not feasible are"
    )
    found = DesignFile(
        path,
        {name: column.some(kept) for name, column in whole.items()},
        taken[kept] + 1,
        [sheet.lines[i] for i in taken[kept]],
        remarks=(*sheet.remarks, f"{left} left out.") if n else sheet.remarks,
        failed=Counter(alike(lost)),
        infeasible=n - len(lost),
    )
    apart = {*labels_among(found.names), *RANKING_COLUMNS}
    if remark := require_designs(found.columns, apart, found.lines, sheet.hidden, found._where):
        found = replace(found, remarks=(*found.remarks, remark))
    if len(old) == 0:
        return found
    former = {name: column.some(old) for name, column in whole.items()}
    rows = DesignFile(path, former, taken[old] + 1).frame(())
    names = rows[found.label].astype(str) if found.label else ["prototype"] * len(rows)
    rows.index = pd.Index(names)
    return replace(found, prototype=rows)


def _of_json(path: Path, text: str, marks: Marks) -> DesignFile:
    """Return a ranking that was written as JSON, with the objectives it names."""
    try:
        content: Any = json.loads(text, object_pairs_hook=distinct)
        objectives, maximized = content["objectives"], content["maximized"]
        rows = [dict(row) for row in content["designs"]]
        units = dict(content.get("units", {}))
        names = [*objectives, *maximized, *(name for row in rows for name in row)]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        what = "it is JSON, but none that 'pymoo-psi rank --out FILE.json' wrote"
        raise UnfitError(f"{what}; give the designs as CSV") from None
    # JSON can hold what no table, CSV or page can: lists, objects, halves of surrogate pairs.
    cells = [cell for row in rows for cell in row.values()]
    texts = [value for value in (*names, *cells) if isinstance(value, str)]
    if (
        not rows
        or any({*row} != {*rows[0]} for row in rows)
        or not all(isinstance(name, str) for name in [*names, *units.values()])
        or not {*objectives} <= {*rows[0]}
        or any(len({*group}) < len(group) for group in (objectives, maximized))
        or not {*maximized} <= {*rows[0]}
        or not all(map(is_writable, texts))
        or not all(isinstance(cell, (str, int, float, type(None))) for cell in cells)
    ):
        what = "its designs are missing, lack columns, or hold what no table can"
        raise UnfitError(f"{what}, or its objectives are named twice; rank the designs anew")
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    read = _in_units(read_columns(columns, marks), units)
    file = DesignFile(path, read, np.arange(1, len(rows) + 1))
    others = tuple(name for name in maximized if name not in objectives)
    return replace(file, known=Roles(tuple(objectives), (), file.label, tuple(maximized), others))


def _in_units(columns: Mapping[str, Column], units: Mapping[str, str]) -> dict[str, Column]:
    """Return columns in the units that are told, the others in those of their cells."""
    return {n: replace(column, unit=units.get(n, column.unit)) for n, column in columns.items()}
