"""``pymoo-psi export``: from a study to a test table for other programs."""

from __future__ import annotations

from pathlib import Path

from pymoo_psi.cli._output import counted, require_output, say
from pymoo_psi.table import TestTable


def run_export(study: Path, out: Path) -> int:
    """Write every test of a study, whole or not at all; the study is not changed.

    Args:
        study: The study file.
        out: The file to write, CSV or Parquet by its suffix.
    """
    require_output(out, (".csv", ".parquet"), study)
    table = TestTable.read_study(study)
    write = table.to_parquet if out.suffix.lower() == ".parquet" else table.to_csv
    write(out)
    counts = ", ".join(f"{(table.status == s).sum()} {s}" for s in ("ok", "infeasible", "failed"))
    say(f"{counted(len(table), 'test')} ({counts}) written to {out}")
    return 0
