"""``pymoo-psi combine``: the tests of several experiments on one problem in one table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.cli._options import FileOptions
from pymoo_psi.cli._output import require_output, say
from pymoo_psi.table import TestTable


def run_combine(experiments: Sequence[str], out: Path) -> int:
    """Write the tests of all experiments as one table, each with where it is from.

    Args:
        experiments: Files with tests, each as it is or as ``name=file``; the file's name without
            its suffix is that of the experiment unless given.
        out: The CSV or Parquet file to write.
    """
    files: dict[str, Path] = {}
    for entry in experiments:
        name, equals, rest = entry.partition("=")
        # A file may have a sign in its name, and is meant where it is there.
        path = Path(rest if equals and not Path(entry).exists() else entry).expanduser()
        name = name if equals and not Path(entry).exists() else path.stem
        if name in files:
            remedy = "say name=FILE"
            raise invalid("the experiments", "of different names", Received(name), remedy)
        files[name] = path
    require_output(out, (".csv", ".parquet"), *files.values())
    tables = {}
    for name, path in files.items():
        found, missing = FileOptions().opened(path)
        if missing:
            say(f"{name}: {missing}.")
        if not isinstance(found, TestTable):
            rule = "a study or a table of tests, of solve --study or export"
            raise invalid(str(path), rule, Received("designs without their tests"))
        tables[name] = found
    table = TestTable.combined(tables)
    write = table.to_parquet if out.suffix.lower() == ".parquet" else table.to_csv
    write(out)
    counts = ", ".join(f"{len(t)} of {name}" for name, t in tables.items())
    say(f"{counted(len(table), 'test')} ({counts}) written to {out}")
    return 0
