"""``pymoo-psi merge``: one study of the tests of several."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from pymoo_psi._validation import counted, invalid
from pymoo_psi.cli._options import tests_in
from pymoo_psi.cli._output import require_output, say
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table import TestTable
from pymoo_psi.table._table import STATUSES


def run_merge(inputs: Sequence[Path], out: Path) -> int:
    """Merge studies, folders of studies and tables (CSV, Parquet) into a new study."""
    if os.path.lexists(out):
        raise invalid("--out", "the name of a new file", str(out))
    require_output(out, ())
    table = TestTable.empty()
    remarks = []
    for path in inputs:
        tests, missing = tests_in(path)
        remarks += [f"{path}: {missing}."] if missing else []
        try:
            table = table.merge(tests)
        except PsiError as error:
            raise ArgumentValueError(f"{path} does not fit those before it: {error}") from error
    table.to_study(out)
    for remark in remarks:
        say(remark)
    if table.problem is None:
        say("None of them says what problem its tests are of: no run continues the study.")
    counts = ", ".join(f"{(table.status == s).sum()} {s}" for s in STATUSES)
    say(f"{counted(len(table), 'test')} ({counts}) written to {out}")
    return 0
