"""What the commands print and write: tables, progress, files."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

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
from pymoo_psi.table import TestTable
from pymoo_psi.table._layout import Limits


def say(line: str) -> None:
    """Print one line of text, whatever the width of the terminal."""
    print(line, flush=True)


def counted(n: int, thing: str) -> str:
    """Return a number of things: "1 design", "2 designs"."""
    return f"{n} {thing}{'' if n == 1 else 's'}"


def print_frame(frame: pd.DataFrame, title: str, *, spare: Sequence[str] = ()) -> None:
    """Print a frame as a table: numbers right-aligned, fractions with 4 decimals, nothing blank.

    Args:
        frame: What to print.
        title: The line above it.
        spare: Columns to leave out, saying so, where the terminal is too narrow for all.
    """
    console = Console(highlight=False, markup=False)  # "mass [kg]" is text
    if not console.is_terminal:
        console = Console(highlight=False, markup=False, width=200)
    table = _table(frame)
    unlimited = console.options.update(max_width=10_000)
    left_out = spare and console.measure(table, options=unlimited).maximum > console.width
    if left_out:
        table = _table(frame.drop(columns=list(spare)))
    say(title)
    console.print(table)
    if left_out:
        say(f"({spare[0]} to {spare[-1]} not shown: the terminal is too narrow)")


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
    error_console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        *columns,
        console=error_console,
        disable=not error_console.is_terminal,
        transient=True,
    )


@contextmanager
def run_bar(description: str, total: int) -> Iterator[_RunDisplay]:
    """Show a run while the body runs: points done, feasible and failed, rate and time left."""
    bar = progress_bar(TextColumn("{task.fields[note]}"), _Rate(), TimeRemainingColumn())
    with bar:
        yield _RunDisplay(bar, bar.add_task(description, total=total, note=""))


class _RunDisplay:
    """Callbacks that show a run of an algorithm on a bar."""

    def __init__(self, bar: Progress, task: TaskID) -> None:
        self.bar, self.task = bar, task
        self.tested = self.feasible = self.failed = 0

    def psi(self, algorithm: Any) -> None:
        """Show tested, failed and feasible points of a run of PSI."""
        self.feasible = self.failed = self.tested = 0
        self.block(algorithm.table, algorithm.limits)

    def block(self, table: TestTable, limits: Limits | None) -> None:
        """Show one more block of tested points."""
        self.tested += len(table)
        self.feasible += int(table.feasible(limits).sum())
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


def require_output(path: Path | None, suffixes: Sequence[str] = (), *inputs: Path | None) -> None:
    """Refuse a file that cannot be written, or must not be, before the work is done.

    Args:
        path: The file to write; nothing is asked of none.
        suffixes: Those of the formats that can be written; any will do if there are none.
        inputs: Files that are read and must stay as they are.

    Raises:
        ArgumentValueError: The file has another suffix, or is one of the inputs.
        FileNotFoundError: Its folder is not there.
    """
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise invalid("--out", f"a file with the suffix {' or '.join(suffixes)}", str(path))
    if any(given is not None and path.resolve() == given.resolve() for given in inputs):
        raise invalid("--out", "another file than the one that is read", str(path))
    if not path.absolute().parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write a frame whole or not at all: an interrupted run leaves the old file as it was."""
    with whole_file(path) as written:
        frame.to_csv(written, index=False)
