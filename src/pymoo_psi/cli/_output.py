"""What the commands print and write: tables, progress, files."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import shutil
import sys
import textwrap
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryFile
from time import monotonic
from typing import Any, Literal

import pandas as pd
from rich.cells import cell_len
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from pymoo_psi._files import whole_file
from pymoo_psi._validation import Received, invalid
from pymoo_psi.cli._groups import printable
from pymoo_psi.cli._options import judged
from pymoo_psi.pareto import wrapped
from pymoo_psi.table import Formulation, TestTable
from pymoo_psi.table._roles import Roles, roles_head

_EVERY = 60.0  # seconds between the lines of a log that show that a run goes on
_LISTED = 6  # names that a line tells; of more the first and the last one


def width() -> float:
    """Return how many columns are there to print in: those of a terminal.

    A pipe or a file has no width, so that each design stays on one line for ``grep`` and
    ``less -S``, unless COLUMNS says how wide its reader is.
    """
    try:
        narrow = sys.stdout.isatty() or int(os.environ.get("COLUMNS", "0")) > 0
    except ValueError:
        narrow = False
    return shutil.get_terminal_size().columns if narrow else math.inf


def say(text: str) -> None:
    """Print lines of text, broken between words where they are longer than the terminal is wide.

    Whoever reads them may have seen enough (``| head -1``), which is no error.
    """
    columns = width()
    for line in text.splitlines():
        if len(line) > columns:
            indent = " " * (len(line) - len(line.lstrip()))
            # A percent sign stays with its number, and a file's name or an option is whole.
            line = textwrap.fill(
                line.replace(" %", "\0%"), int(columns), subsequent_indent=indent,
                break_long_words=False, break_on_hyphens=False, drop_whitespace=True,
            ).replace("\0", " ")  # fmt: skip
        _print(line)


def say_sentences(sentences: Sequence[str]) -> None:
    """Print sentences in lines to read, also in a pipe, of at most 80 columns."""
    say(wrapped(sentences, int(min(80, width()))))


def _print(line: str) -> None:
    try:
        print(printable(line), flush=True)  # or errors of the stream would show when Python ends
    except BrokenPipeError:
        pass
    except OSError as error:  # a full disk
        raise OSError(error.errno, error.strerror, "standard output") from None


def print_frame(
    frame: pd.DataFrame,
    title: str,
    *,
    lead: int = 1,
    plain: Collection[str] = (),
    spare: Sequence[Sequence[str]] = (),
) -> None:
    """Print a frame: numbers to the right, with 4 decimals; missing ones blank.

    Without frames and colours: the same on any terminal, in a pipe and in a file. A table that is
    wider than the terminal is continued below, each part led by the first column: a cell that is
    cut would show a wrong number.

    Args:
        frame: What to print.
        title: The line above it.
        lead: How many columns tell what a row is.
        plain: Columns of numbers of any scale, which have 6 digits instead.
        spare: Columns to leave out, saying so: the first group where the table would be continued
            below, the second where that would be so more than once.
    """
    if frame.empty:
        say(f"{title.rstrip(':')}: none")
        return
    columns = {str(name): _texts(frame[name], name in plain) for name in frame.columns}
    parts, left_out = _parts(columns, width(), lead), []
    for most, names in enumerate(spare, start=1):
        if len(parts) > most and (names := [name for name in names if name in columns]):
            columns = {name: texts for name, texts in columns.items() if name not in names}
            parts = _parts(columns, width(), lead)
            few = len(names) <= _LISTED
            left_out.append(", ".join(names) if few else f"{names[0]} to {names[-1]}")
    say(title)
    for i, part in enumerate(parts):
        if i > 0:
            _print("")
        for cells in zip(*(columns[name] for name in part), strict=True):
            _print("  ".join(cells).rstrip())
    if left_out:
        say(f"(not shown in {width():.0f} columns: {', '.join(left_out)})")


def _texts(column: pd.Series[Any], plain: bool) -> list[str]:
    """Return the name, a line and the cells of a column, all of one width."""
    number = plain or pd.api.types.is_numeric_dtype(column)
    cells = [six_digits(cell) if plain else _cell(cell) for cell in column]
    size = max(map(cell_len, [str(column.name), *cells]))
    texts = [str(column.name), "-" * size, *cells]
    room = [" " * (size - cell_len(text)) for text in texts]  # of Chinese, a letter takes two
    return [r + t if number else t + r for r, t in zip(room, texts, strict=True)]


def _parts(columns: Mapping[str, list[str]], columns_wide: float, n_lead: int) -> list[list[str]]:
    """Return names of as many columns at a time as there is room for, the first ones with all."""
    names = list(columns)
    lead, parts = names[:n_lead], [names[:n_lead]]
    for name in names[n_lead:]:
        used = sum(cell_len(columns[each][0]) + 2 for each in parts[-1])
        if len(parts[-1]) > n_lead and used + cell_len(columns[name][0]) > columns_wide:
            parts.append([*lead])
        parts[-1].append(name)
    return parts


def six_digits(value: Any) -> str:
    """Return a number in 6 digits; another cell as it is."""
    try:
        return f"{float(value) + 0.0:.6g}"  # of -0.0, a zero whose sign was turned, 0
    except ValueError:  # a choice among numbers, or nothing
        return _cell(value)


def _cell(value: object) -> str:
    if value is None or value != value:
        return ""
    return f"{value:.4f}" if isinstance(value, float) else str(value)


def progress_bar(*columns: ProgressColumn) -> Progress:
    """Return a progress bar on standard error, silent when that is no terminal."""
    error_console = Console(stderr=True)  # standard output may go on into a file or a pipe
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=10),  # numbers need the room of 80 columns
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        *columns,
        console=error_console,
        disable=not error_console.is_terminal or error_console.is_dumb_terminal,
        transient=True,  # the results stand alone when it is done
    )


class Log:
    """Lines in place of a bar that is not shown, so that a log tells that a long run goes on."""

    def __init__(self, bar: Progress) -> None:
        self.bar, self.due = bar, monotonic() + _EVERY

    def tell(self, line: str) -> None:
        """Print a line on standard error, unless one was printed just before."""
        if self.bar.disable and monotonic() >= self.due:
            self.due = monotonic() + _EVERY
            with suppress(OSError):
                print(line, file=sys.stderr, flush=True)


@contextmanager
def run_bar(
    description: str, total: int, asked: Formulation | None = None
) -> Iterator[_RunDisplay]:
    """Show a run while the body runs: points done, feasible and failed, rate and time left."""
    bar = progress_bar(TextColumn("{task.fields[note]}"), _Rate(), TimeRemainingColumn())
    with bar:
        task = bar.add_task(description, total=total, note="")
        yield _RunDisplay(bar, task, asked or Formulation())


class _RunDisplay:
    """Callbacks that show a run of an algorithm on a bar."""

    def __init__(self, bar: Progress, task: TaskID, asked: Formulation) -> None:
        self.bar, self.task, self.asked = bar, task, asked
        self.tested = self.feasible = self.failed = 0
        self.log = Log(bar)

    def block(self, tests: TestTable) -> None:
        """Show more tests that have arrived; a column that they lack ends the run here."""
        table = judged(tests, self.asked)
        self.tested += len(table)
        self.feasible += int(table.feasible().sum())
        self.failed += int((table.status == "failed").sum())
        self._show(self.tested, f"{self.feasible} feasible, {self.failed} failed")

    def evaluations(self, algorithm: Any) -> None:
        """Show the evaluations of any algorithm."""
        self._show(algorithm.evaluator.n_eval)

    def _show(self, done: int, note: str = "") -> None:
        self.bar.update(self.task, completed=done, note=note)
        of = f"{done} of {self.bar.tasks[0].total:.0f} evaluated"
        self.log.tell(f"{of}, {note}" if note else of)


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        if not task.speed:
            return Text("")
        return Text(f"{task.speed:.0f}/s" if task.speed >= 10 else f"{task.speed:.2g}/s")


_HEAD = 65_536  # bytes at an end of a file, in which its names of columns are
# How a file is known that a command wrote before. None would be so by chance: CSV by the names of
# the columns, that end with those of a ranking, or by the head of a test table; others by a head.
WRITTEN = {
    "solve": rb'mu3"?,"?rank"?\r?\n',
    "rank": rb'mu3"?,"?rank"?,"?pareto"?\r?\n|\{\s*"file": .*\s*"objectives": ',
    "export": rb'pymoo_psi_test_table(?!.*experiments\\*": \[\[)',
    "combine": rb'pymoo_psi_test_table.*experiments\\*": \[\[',
    "page": rb'<meta name="generator" content="pymoo-psi page"',
    "figure": rb"pymoo-psi rank",  # as the program that has made it
    "report": rb'<meta name="generator" content="pymoo-psi report"',
}


def require_output(
    path: Path,
    suffixes: Sequence[str],
    *inputs: Path | None,
    by: str,
    force: bool,
    option: str = "--out",
) -> Path:
    """Refuse a file that cannot be written, or must not be, before the work is done.

    Args:
        path: The file to write.
        suffixes: Those of the formats that can be written; any will do if there are none.
        inputs: Files that are read and must stay as they are.
        by: The command; what it has written before may be overwritten.
        force: Whether anything else may be, too.
        option: Which option names it.

    Returns:
        The absolute path, which stays right if a model changes the working directory.

    Raises:
        ArgumentValueError: The file has another suffix, is one of the inputs, or is there and
            not of this command.
        OSError: Its folder is not there, or nothing can be written to it.
    """
    # Resolved, as a link to the input is the input.
    if any(given is not None and path.resolve() == given.resolve() for given in inputs):
        raise invalid(option, "another file than the one that is read", str(path))
    if suffixes and path.suffix.lower() not in suffixes:
        raise invalid(option, f"a file with the suffix {' or '.join(suffixes)}", str(path))
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():
        return path.absolute()  # /dev/null, a pipe: written to, not replaced
    if not force and path.exists() and path.stat().st_size > 0:
        with path.open("rb") as file:
            content = file.read(_HEAD)
            file.seek(max(path.stat().st_size - _HEAD, 0))  # where Parquet has it
            content += file.read()
        if not re.search(WRITTEN[by], content):
            rule = "a new file, or one that this command wrote"
            raise invalid(option, rule, str(path), "--force overwrites it")
    return require_folder(path.absolute().parent, str(path)) / path.name


# A study is a database: under the name of a text or a page no program would open it.
_OTHERS = (".csv", ".tsv", ".txt", ".json", ".html", ".htm", ".parquet", ".xlsx", ".pdf")


def require_study(path: Path, option: str) -> None:
    """Refuse a name for a study that is one of another kind of file."""
    if path.suffix.lower() in _OTHERS and not path.exists():
        raise invalid(option, "a study, with a suffix such as .db", str(path))


def require_results(out: Path, files: Sequence[str], *, force: bool) -> Path:
    """Make a folder for results, unless it holds files of others that these would overwrite.

    Args:
        out: The folder.
        files: Patterns of what is written; the first is what only this command writes, by which
            its own results are known.
        force: Whether anything may be overwritten.

    Returns:
        The absolute path.

    Raises:
        ArgumentValueError: There are such files, or the folder is a file.
        OSError: Nothing can be written there.
    """
    if out.exists() and not out.is_dir():
        raise invalid("--out", "a folder", Received(f"the file {out}"))
    out.mkdir(parents=True, exist_ok=True)
    if not force and not any(out.glob(files[0])):
        for found in (path for pattern in files for path in out.glob(pattern)):
            rule = "a folder without such results of others"
            received = Received(f"{found.name} in {out}")
            raise invalid("--out", rule, received, "--force overwrites it")
    return require_folder(out, str(out))


def require_folder(folder: Path, shown: str) -> Path:
    """Return the absolute path of an existing folder; refuse one that cannot be written to.

    Raises:
        OSError: It cannot; the error is about the file or folder ``shown``.
    """
    try:
        with TemporaryFile(dir=folder):  # rights alone do not tell of file systems
            pass
    except OSError as error:  # it names the trial's file, which tells the user nothing
        remedy = f"; make the folder {folder.absolute()} first"
        if folder.exists():
            denied = isinstance(error, PermissionError)
            remedy = "; write to a folder where you may" if denied else ""
        raise OSError(error.errno, f"{error.strerror}{remedy}", shown) from None
    return folder.absolute()


# logic.js has this rule for what the page exports; the cells of tests/formulas.py try both. A sign
# alone, which people write for "none", counts as a number.
_FORMULA = re.compile(r"[=+\-@\t\r]")
_NUMBER = re.compile(r"[+-]?([\d.,]*(e[+-]?\d+)?%?|inf|infinity|nan)", re.IGNORECASE)


def write_csv(
    frame: pd.DataFrame,
    path: Path,
    roles: Roles | None = None,
    units: Mapping[str, str] | None = None,
    numbers: Collection[str] = (),
    remark: str = "",
) -> None:
    """Write a frame whole or not at all: an interrupted run leaves the old file as it was.

    With the roles of its columns, their units and which are numbers, a comment above their names
    says these, unless the names do. A remark is a comment, too.

    A text that a spreadsheet would run as a formula is led by an apostrophe; numbers are left
    alone, also those with a comma, a percent sign or an exponent. The page exports likewise.
    """
    head = "" if roles is None else _head(frame, roles, units or {}, numbers)
    head = f"# {remark}" if remark else head
    frame = frame.rename(columns=_inert)  # heads are texts too; a copy, the caller's stays
    texts = frame.select_dtypes(exclude=["number", "bool"]).map(_inert)
    frame[texts.columns] = texts
    # Until Python 3.13 the csv module leaves a carriage return unquoted, which breaks the row.
    returns = any("\r" in str(cell) for cell in (*frame, *texts.to_numpy().ravel()))
    quoting: Literal[0, 2] = 2 if returns else 0  # csv.QUOTE_NONNUMERIC, csv.QUOTE_MINIMAL
    with whole_file(path) as written, written.open("w", encoding="utf-8", newline="") as file:
        file.write(f"{head}\n" if head else "")
        frame.to_csv(file, index=False, quoting=quoting, lineterminator=os.linesep)


def _head(
    frame: pd.DataFrame, roles: Roles, units: Mapping[str, str], numbers: Collection[str]
) -> str:
    """Return what stands above the names of the columns, these as they are written."""

    def written(names: Iterable[str]) -> tuple[str, ...]:
        return tuple(str(_inert(name)) for name in names)

    told = replace(
        roles,
        objectives=written(roles.objectives),
        variables=written(roles.variables),
        maximize=written(roles.maximize),
        outputs=written(roles.outputs),
    )
    texts = {str(_inert(name)): unit for name, unit in units.items()}
    inert = written(numbers)
    head = roles_head(written(frame.columns), lambda name: name in inert, told, texts)
    return f"# {json.dumps(head, ensure_ascii=False)}" if head else ""


def _inert(cell: object) -> object:
    if isinstance(cell, str) and _FORMULA.match(cell) and not _NUMBER.fullmatch(cell):
        return f"'{cell}"
    return cell
