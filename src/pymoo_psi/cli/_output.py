"""What the commands print and write: tables, progress, files."""

from __future__ import annotations

import errno
import json
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Literal

import pandas as pd
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
from rich.table import Table
from rich.text import Text

from pymoo_psi._files import whole_file
from pymoo_psi._validation import invalid
from pymoo_psi.table import Formulation, TestTable
from pymoo_psi.table._design_file import Roles, roles_head


def say(text: str) -> None:
    """Print lines of text, whatever the width of the terminal.

    Whoever reads them may have seen enough (``| head -1``), which is no error.
    """
    try:
        print(text, flush=True)  # or errors of the stream would show when Python ends
    except BrokenPipeError:
        pass
    except OSError as error:  # a full disk
        raise OSError(error.errno, error.strerror, "standard output") from None


def print_frame(frame: pd.DataFrame, title: str, *, spare: Sequence[str] = ()) -> None:
    """Print a frame as a table: numbers to the right, with 4 decimals; missing ones blank.

    A table that is wider than the terminal is continued below, as pandas does, each part led by
    the first column: a cell that is cut would show a wrong number.

    Args:
        frame: What to print.
        title: The line above it.
        spare: Columns to leave out, saying so, where the terminal is too narrow for all.
    """
    console = Console(highlight=False, markup=False)  # "mass [kg]" is text
    if not console.is_terminal:  # a file has no width, and rich would take 80
        console = Console(highlight=False, markup=False, width=200)
    left_out = spare and _width(frame, console) > console.width
    if left_out:
        frame = frame.drop(columns=list(spare))
    say(title)
    # rich ends the process with code 1 where a pipe is closed, whatever the code of the results;
    # what it captures is said as any other text.
    for part in _parts(frame, console):
        with console.capture() as printed:
            console.print(_table(part))
        say(printed.get().rstrip("\n"))
    if left_out:
        say(f"({spare[0]} to {spare[-1]} not shown: the terminal is too narrow)")


def _width(frame: pd.DataFrame, console: Console) -> int:
    unlimited = console.options.update(max_width=10_000)
    return console.measure(_table(frame), options=unlimited).maximum


def _parts(frame: pd.DataFrame, console: Console) -> Iterator[pd.DataFrame]:
    """Yield as many columns at a time as the terminal is wide, the first one with all of them."""
    first, at = 1, 2
    while at <= frame.shape[1]:
        part = frame.iloc[:, [0, *range(first, at)]]
        if at - first > 1 and _width(part, console) > console.width:
            yield part.iloc[:, :-1]
            first = at - 1
        at += 1
    yield frame.iloc[:, [0, *range(first, frame.shape[1])]]


def _table(frame: pd.DataFrame) -> Table:
    table = Table()
    for name in frame.columns:
        number = pd.api.types.is_numeric_dtype(frame[name])
        table.add_column(str(name), justify="right" if number else "left", no_wrap=True)
    for row in frame.itertuples(index=False):
        table.add_row(*map(_cell, row))
    return table


def _cell(value: object) -> str:
    if value is None or value != value:
        return ""
    return f"{value:.4f}" if isinstance(value, float) else str(value)


def progress_bar(*columns: ProgressColumn) -> Progress:
    """Return a progress bar on standard error, silent when that is no terminal."""
    error_console = Console(stderr=True)  # standard output may go on into a file or a pipe
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        *columns,
        console=error_console,
        disable=not error_console.is_terminal,
        transient=True,  # the results stand alone when it is done
    )


def judged(tests: TestTable, asked: Formulation) -> TestTable:
    """Return tests under a formulation, if it asks for anything."""
    # Of tests that all failed, as the first ones may, nobody knows which outputs they have.
    plain = asked == Formulation() or (tests.status == "failed").all()
    return tests if plain else tests.under(asked)


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

    def block(self, tests: TestTable) -> None:
        """Show more tests that have arrived; a column that they lack ends the run here."""
        table = judged(tests, self.asked)
        self.tested += len(table)
        self.feasible += int(table.feasible().sum())
        self.failed += int((table.status == "failed").sum())
        note = f"{self.feasible} feasible, {self.failed} failed"
        self.bar.update(self.task, completed=self.tested, note=note)

    def evaluations(self, algorithm: Any) -> None:
        """Show the evaluations of any algorithm."""
        self.bar.update(self.task, completed=algorithm.evaluator.n_eval)


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        if not task.speed:
            return Text("")
        return Text(f"{task.speed:.0f}/s" if task.speed >= 10 else f"{task.speed:.2g}/s")


def require_output(
    path: Path, suffixes: Sequence[str], *inputs: Path | None, option: str = "--out"
) -> Path:
    """Refuse a file that cannot be written, or must not be, before the work is done.

    Args:
        path: The file to write.
        suffixes: Those of the formats that can be written; any will do if there are none.
        inputs: Files that are read and must stay as they are.
        option: Which option names it.

    Returns:
        The absolute path, which stays right if a model changes the working directory.

    Raises:
        ArgumentValueError: The file has another suffix, or is one of the inputs.
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
    return require_folder(path.absolute().parent, str(path)) / path.name


def require_folder(folder: Path, shown: str) -> Path:
    """Return the absolute path of an existing folder; refuse one that cannot be written to.

    Raises:
        OSError: It cannot; the error is about the file or folder ``shown``.
    """
    try:
        with TemporaryFile(dir=folder):  # rights alone do not tell of file systems
            pass
    except OSError as error:  # it names the trial's file, which tells the user nothing
        raise OSError(error.errno, error.strerror, shown) from None
    return folder.absolute()


# page.js has this rule for what the page exports; the cells of tests/formulas.py try both. A sign
# alone, which people write for "none", counts as a number.
_FORMULA = re.compile(r"[=+\-@\t\r]")
_NUMBER = re.compile(r"[+-]?([\d.,]*(e[+-]?\d+)?%?|inf|infinity|nan)", re.IGNORECASE)


def write_csv(
    frame: pd.DataFrame,
    path: Path,
    roles: Roles | None = None,
    units: Mapping[str, str] | None = None,
    numbers: Collection[str] = (),
) -> None:
    """Write a frame whole or not at all: an interrupted run leaves the old file as it was.

    With the roles of its columns, their units and which are numbers, a comment above their names
    says these, unless the names do.

    A text that a spreadsheet would run as a formula is led by an apostrophe; numbers are left
    alone, also those with a comma, a percent sign or an exponent. The page exports likewise.
    """
    head = "" if roles is None else _head(frame, roles, units or {}, numbers)
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
