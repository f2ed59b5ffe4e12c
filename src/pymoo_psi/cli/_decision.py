"""``--decision FILE``: designs looked at as somebody has decided on them on the page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from pymoo_psi._validation import counted, invalid
from pymoo_psi.cli._decided import Decision, text_column
from pymoo_psi.cli._groups import ColumnOptions, FileOptions
from pymoo_psi.cli._options import designs_of
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table import DesignFile, TestTable
from pymoo_psi.table._design_file import design_ids
from pymoo_psi.table._roles import Roles


def decision_in(
    decision: Path, columns: ColumnOptions, normalize: bool
) -> tuple[Decision, ColumnOptions]:
    """Read a decision, and take its criteria unless others are named.

    Raises:
        ArgumentValueError: It is no decision, or options say otherwise.
        OSError: The file cannot be opened.
    """
    decided = Decision.read(decision)
    if columns.limits:
        remedy = "it has its own; rank without it to set others"
        raise invalid("--limits", "left out beside --decision", columns.limits[0], remedy)
    if decided.normalize and not normalize:
        remedy = f"{decision} was decided with each objective in units of its range"
        raise invalid("--no-normalize", "left out beside --decision", "--no-normalize", remedy)
    if not columns.objectives and not columns.formulated:
        columns = replace(columns, objectives=decided.criteria, maximize=decided.maximize)
    return decided, columns


def decided_designs(
    path: Path,
    columns: ColumnOptions,
    written: FileOptions,
    decision: Path,
    normalize: bool,
    variables: Sequence[str] = (),
) -> tuple[DesignFile, Roles, list[str], Decision]:
    """Read a file of designs and a decision on them, whose criteria are taken unless named.

    Raises:
        ArgumentValueError: The decision is about other criteria, directions, units or columns, or
            the options say otherwise.
        OSError: A file cannot be opened.
    """
    decided, columns = decision_in(decision, columns, normalize)
    try:
        file, roles, remarks = designs_of(path, columns, written, variables)
    except ArgumentValueError as error:
        raise ArgumentValueError(f"{decision} does not fit: {error}") from None
    units = {name: column.unit for name, column in file.columns.items()}
    decided.require(path, roles.objectives, roles.maximize, units, file.names)
    return file, roles, remarks, decided


def decided_tests(
    decided: Decision, path: Path, table: TestTable, labels: Sequence[str] | None
) -> tuple[int | None, list[str]]:
    """Return which test a decision has chosen, and what there is to tell of it.

    Args:
        decided: The decision.
        path: Where the tests are from, for messages.
        table: All tests, under the criteria of the decision.
        labels: ``(n,)`` what they are called if not by test point.

    Raises:
        ArgumentValueError: The decision is about others, or has left out designs otherwise than
            by limits, what such a choice costs being unknown.
    """
    layout = table.layout
    decided.require(path, layout.objectives, layout.maximize, layout.units, layout.columns)
    if decided.kept is not None or decided.categories:
        what = "it keeps designs by hand or by options, and a report tells what limits cost"
        raise ArgumentValueError(f"{decided.path}: {what}; decide by limits alone")
    chosen, ids = decided.chosen, [str(number) for number in table.numbers]
    if labels is not None:  # of "row 7" the page keeps the number alone
        number = re.compile(r"\d+( #\d+)?$" if re.match(r"\d+( #|$)", chosen or "") else "$^")
        ids = [found[0] if (found := number.search(label)) else label for label in labels]
    used = {*layout.objectives, *decided.limits}
    told = decided.now(ids, pd.DataFrame({name: table.column(name) for name in used}))
    point = int(table.numbers[ids.index(chosen)]) if chosen in ids else None
    reason = [f"Reason: {decided.reason}"] if decided.reason else []
    return point, [f"{decided.path.name}: decided on {decided.date}.", *reason, *told]


def under_decision(
    file: DesignFile, roles: Roles, decided: Decision
) -> tuple[DesignFile, list[str]]:
    """Return the designs within the limits of a decision, and what there is to tell.

    Raises:
        ArgumentValueError: None is left, or a limited column is not one of numbers.
    """
    frame = file.frame(roles.objectives)
    labels = file.rows if roles.label is None else frame[roles.label]
    ids = design_ids(text_column(labels.tolist()).tolist(), file.rows.tolist())
    left = decided.left(ids, frame)
    if not left.any():
        what = f"it leaves none of the {len(file)} designs of {file.path}"
        raise ArgumentValueError(f"{decided.path}: {what}; decide anew on the page")
    told = [f"{decided.path}: decided on {decided.date} by {', '.join(decided.criteria)}."]
    if decided.reason:
        told.append(f"Reason: {decided.reason}")
    if decided.verdict:
        told.append(f"Then: {decided.verdict[0]}")
    told += decided.now(ids, frame)
    kept = np.flatnonzero(left)
    if beyond := len(file) - len(kept):
        told.append(f"{counted(beyond, 'design')} beyond its limits: left out.")
    return file.some(kept, file.columns, file.remarks), told
