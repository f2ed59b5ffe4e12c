"""``pymoo-psi merge`` and ``combine``: the tests of several files as one study, or as one table."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.cli._groups import FileOptions
from pymoo_psi.cli._options import opened, tests_in
from pymoo_psi.cli._output import require_folder, require_output, require_study, say
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table import TestTable
from pymoo_psi.table._table import STATUSES


def run_merge(inputs: Sequence[Path], out: Path) -> int:
    """Merge studies, folders of studies and tables (CSV, Parquet) into a new study."""
    if os.path.lexists(out):
        raise invalid("--out", "the name of a new file", str(out))
    require_study(out, "--out")
    require_folder(out.absolute().parent, str(out))
    table = TestTable.empty()
    remarks = []
    for path in inputs:
        tests, missing = tests_in(path)
        remarks += [f"{path}: {missing}."] if missing else []
        try:
            table = table.merge(tests)
        except PsiError as error:
            told = str(error).replace("other must", "it must", 1)  # an argument of merge
            remedy = "'combine' joins tests of other boxes and samplings of a problem"
            what = f"{path} does not fit those before it: {told}; {remedy}"
            raise ArgumentValueError(what) from error
    table.to_study(out)
    for remark in remarks:
        say(remark)
    if table.problem is None:
        say("None of them says what problem its tests are of: no run continues the study.")
    counts = ", ".join(f"{(table.status == s).sum()} {s}" for s in STATUSES)
    say(f"{counted(len(table), 'test')} ({counts}) written to {out}")
    return 0


def run_combine(experiments: Sequence[str], out: Path, *, force: bool) -> int:
    """Write the tests of all experiments as one table, each with where it is from.

    Args:
        experiments: Files with tests, each as it is or as ``name=file``; the file's name without
            its suffix is that of the experiment unless given.
        out: The CSV or Parquet file to write.
        force: Whether to overwrite any file.
    """
    files: dict[str, Path] = {}
    for entry in experiments:
        name, equals, rest = entry.partition("=")
        # A file may have a sign in its name, and is meant where it is there.
        path = Path(rest if equals and not Path(entry).exists() else entry).expanduser()
        name = name if equals and not Path(entry).exists() else path.stem
        if not name:
            raise invalid("NAME=FILE", "with a name", Received(entry))
        if name in files:
            rule = "of different names, each its own or that of the file"
            raise invalid("NAME=FILE", rule, Received(f"{name} twice"))
        files[name] = path
    require_output(out, (".csv", ".parquet"), *files.values(), by="combine", force=force)
    tables = {}
    for name, path in files.items():
        found, missing = opened(FileOptions(), path)
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
