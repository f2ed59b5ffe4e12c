"""``pymoo-psi export``, ``merge``, ``combine``: tests of files as one table, or as one study."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.cli._options import tests_in
from pymoo_psi.cli._output import require_folder, require_output, require_study, say
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table import STATUSES, TestTable, read_tests

_TABLES = (".csv", ".parquet")  # suffixes of files with a test table


def run_export(study: Path, out: Path, *, force: bool) -> int:
    """Write every test of a study, or of a folder of them, to a CSV or Parquet file."""
    require_output(out, _TABLES, study, by="export", force=force)
    table, missing = read_tests(study)
    _write(table, out)
    if missing:
        say(f"{study}: {missing}.")
    _say_written(table, out, [f"{(table.status == s).sum()} {s}" for s in STATUSES])
    return 0


def run_merge(inputs: Sequence[Path], out: Path) -> int:
    """Merge studies, folders of studies and tables (CSV, Parquet) into a new study."""
    if os.path.lexists(out):
        raise invalid("--out", "the name of a new file", str(out))
    require_study(out, "--out")
    require_folder(out.absolute().parent, str(out))
    table = TestTable.empty()
    remarks = []
    elsewhere = "; the others that are merged may hold them" if inputs[1:] else ""
    for path in inputs:
        tests, missing = tests_in(path)
        if missing:  # in this folder: those of two machines complete each other
            remarks.append(f"{path}: {missing}{elsewhere}.")
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
    _say_written(table, out, [f"{(table.status == s).sum()} {s}" for s in STATUSES])
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
        name, equals, file = entry.partition("=")
        # A file may have a sign in its name, and is meant where it is there.
        if not equals or Path(entry).exists():
            name, file = Path(entry).stem, entry
        if not name:
            raise invalid("NAME=FILE", "with a name", Received(entry))
        if name in files:
            rule = "of different names, each its own or that of the file"
            raise invalid("NAME=FILE", rule, Received(f"{name} twice"))
        files[name] = Path(file).expanduser()
    require_output(out, _TABLES, *files.values(), by="combine", force=force)
    tables = {}
    for name, path in files.items():
        tables[name], missing = tests_in(path)
        if missing:
            say(f"{name}: {missing}.")
    table = TestTable.combined(tables)
    _write(table, out)
    _say_written(table, out, [f"{len(t)} of {name}" for name, t in tables.items()])
    return 0


def _write(table: TestTable, out: Path) -> None:
    write = table.to_parquet if out.suffix.lower() == ".parquet" else table.to_csv
    write(out)


def _say_written(table: TestTable, out: Path, counts: Sequence[str]) -> None:
    say(f"{counted(len(table), 'test')} ({', '.join(counts)}) written to {out}")
