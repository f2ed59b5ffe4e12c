"""``pymoo-psi report``: from a study, a table or a file of designs to the report on a choice."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path

import numpy as np

from pymoo_psi._validation import invalid
from pymoo_psi.cli._choice import preferences_in
from pymoo_psi.cli._decision import decided_tests, decision_in
from pymoo_psi.cli._groups import ColumnOptions, DocumentOptions, FileOptions
from pymoo_psi.cli._options import formulated_in, units_in
from pymoo_psi.cli._output import require_output, say
from pymoo_psi.errors import StudyError
from pymoo_psi.report import decision_report
from pymoo_psi.study import Study
from pymoo_psi.table import TestTable


def run_report(
    path: Path,
    columns: ColumnOptions,
    written: FileOptions,
    document: DocumentOptions,
    *,
    prefer: Sequence[str],
    design: int | None,
    out: Path,
    force: bool,
) -> int:
    """Write the report and say where it is.

    Returns:
        0, or 1 if no design is feasible; the report then says what stands in the way.
    """
    decision, normalize = document.decision, not document.no_normalize
    require_output(out, (".html", ".htm"), path, decision, by="report", force=force)
    decided = None
    if decision is not None:
        if design is not None:
            remedy = "it has a chosen design of its own"
            raise invalid("--design", "left out beside --decision", design, remedy)
        decided, columns = decision_in(decision, columns, normalize)
        normalize = decided.normalize
    limited = () if decided is None else decided.limits
    table, limits, labels, column, remarks = formulated_in(
        path, columns, written, document.variables, limited
    )
    if decided is not None:
        limits = decided.limits
        design, told_of_it = decided_tests(decided, path, table, labels)
        remarks += told_of_it
    if design is not None and labels is not None:
        design = _row_of(design, table, labels, column)
    unshown = "" if labels is None else "--variables shows further columns"
    told = {**table.layout.units, **units_in(document.units, table.layout.columns, unshown)}
    table = replace(table, layout=replace(table.layout, units=told))
    selectors = preferences_in(prefer, table.layout.objectives, normalize=normalize)
    today = f"{datetime.now(timezone.utc):%Y-%m-%d}"
    about = [f"{path.name}, {today}, pymoo-psi {version('pymoo-psi')}"]
    about += [getattr(remark, "fact", remark) for remark in remarks]
    if path.is_file():  # what a pipe has given it does not give again
        with suppress(StudyError):  # another file tells no date
            about.insert(1, f"Study begun {Study(path).facts()['begun']}")
    if labels is not None:
        layout = replace(table.layout, label="design")
        extra = {**table.extra, "design": np.array(labels, object)}
        table = replace(table, layout=layout, extra=extra)
    report = decision_report(
        table,
        limits,
        normalize=normalize,
        design=design,
        selectors=selectors or None,
        title=document.title or path.stem,
        about=about,
    )
    report.save(out)
    for remark in remarks:
        say(remark)
    say(f"{report}: open {out} in a browser, or print it")
    return 0 if report.ranking is not None else 1


def _row_of(design: int, table: TestTable, labels: Sequence[str], column: str | None) -> int:
    """Return by which number a table of a file's designs has one: its row.

    Where a column numbers the designs, as test_point in what 'solve' writes, it goes by that.
    """
    if not column:
        return design
    word = column.replace("_", " ")
    if (called := f"{word} {design}") in labels:
        return int(table.numbers[labels.index(called)])
    if any(re.fullmatch(rf"{re.escape(word)} \d+( #\d+)?", label) for label in labels):
        rule = f"a number that the column {column!r} holds once"
        raise invalid("--design", rule, design)
    return design
