"""What the commands print and write: sentences, tables, progress, files."""

from __future__ import annotations

import errno
import math
import os
import re
import shutil
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import timedelta
from pathlib import Path
from tempfile import TemporaryFile
from time import monotonic
from typing import Any
from unicodedata import east_asian_width
from zipfile import ZipFile, is_zipfile

import pandas as pd

from pymoo_psi._output import write_table
from pymoo_psi._validation import Received, invalid
from pymoo_psi.cli._app import REPORTED, print_error, printable
from pymoo_psi.pareto import number, wrapped
from pymoo_psi.table import Layout, designs_head

_FIRST, _EVERY = 10.0, 60.0  # seconds until the first line of a log, and between later ones
_HEAD = 65_536  # bytes at an end of a file, in which its names of columns are
# How CSV and HTML of ours are known: a ranking by its columns, all else by a mark.
_OURS = re.compile(rb'mu3"?,"?rank"?[,\r\n]|pymoo_psi_|name="generator" content="pymoo-psi')
_REDRAWN = 0.2  # seconds between two states of the line of a terminal


def width() -> int | None:
    """Return how many columns a terminal has, or COLUMNS says; None of a pipe or a file."""
    narrow = sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return shutil.get_terminal_size().columns if narrow else None


def say(line: str) -> None:
    """Print a line, wrapped where there is a width."""
    columns = width()
    _print(line if columns is None else wrapped([line], columns))


def _print(text: str) -> None:
    try:  # flushed, or errors of the stream would show when Python ends
        print(printable(text), flush=True)
    except BrokenPipeError:
        pass
    except OSError as error:  # a full disk
        raise OSError(error.errno, error.strerror, "standard output") from None


def print_frame(frame: pd.DataFrame, title: str, *, lead: int = 1) -> None:
    """Print a frame with numbers in 6 digits, missing ones blank.

    A table that is wider than the terminal is continued below, its first ``lead`` columns repeated.
    """
    say(title if len(frame) else f"{title.rstrip(':')}: none")
    columns = [_cells(str(name), column.tolist()) for name, column in frame.items()]
    first, rest = columns[:lead], deque(columns[lead:] if len(frame) else [])
    room = (width() or math.inf) + 2
    leading = sum(_size(cells[0]) + 2 for cells in first)
    while rest:
        part, used = list(first), leading
        while rest and (len(part) == len(first) or used + _size(rest[0][0]) + 2 <= room):
            used += _size(rest[0][0]) + 2
            part.append(rest.popleft())
        lines = ["  ".join(row).rstrip() for row in zip(*part, strict=True)]
        _print("\n".join([*lines, ""] if rest else lines))


def _cells(name: str, column: Sequence[Any]) -> list[str]:
    """Return the name, a line and the cells of a column, all of one width; numbers to the right."""
    texts = [name]
    for cell in column:
        shown = number(cell, 6) if isinstance(cell, float) else printable(str(cell))
        texts.append("" if cell is None or cell != cell else shown)
    size = max(map(_size, texts))
    texts.insert(1, "-" * size)
    gaps = [" " * (size - _size(text)) for text in texts]
    left = any(isinstance(cell, str) for cell in column)
    return [text + gap if left else gap + text for text, gap in zip(texts, gaps, strict=True)]


def _size(text: str) -> int:
    """Return the places that a text takes in a terminal: of Chinese, a letter takes two."""
    return len(text) + sum(east_asian_width(letter) in "WF" for letter in text)


@contextmanager
def progress(what: str, total: int) -> Iterator[Callable[..., None]]:
    """Give a function ``show(done, note="")`` of the progress of the body, on standard error.

    In a terminal it rewrites a line; elsewhere it prints one now and then, for a log.
    """
    terminal, begun = sys.stderr.isatty(), monotonic()
    due = begun + (0 if terminal else _FIRST)
    first = 0  # what was done before the run, and says nothing of its speed

    def show(done: int, note: str = "") -> None:
        nonlocal due, first
        first = first or done
        if (now := monotonic()) < due:
            return
        due = now + (_REDRAWN if terminal else _EVERY)
        text = f"{what}: {done} of {total}{note and ', '}{note}"
        if first < done < total:
            seconds = math.ceil((now - begun) * (total - done) / (done - first))
            text += f", {timedelta(seconds=seconds)} left"
        if terminal:
            print(f"\r\033[K{printable(text)}", end="", file=sys.stderr, flush=True)
        else:
            print_error(text)

    try:
        yield show
    finally:
        if terminal:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


@contextmanager
def keeping(kept: Callable[[], str]) -> Iterator[None]:
    """Say in a line what is kept, and how to go on, if the user or SIGTERM stops the body."""
    try:
        yield
    except KeyboardInterrupt as stop:
        print_error(f"pymoo-psi: interrupted; {kept()}")
        stop.args = REPORTED
        raise


def require_output(path: Path | None, suffixes: Sequence[str], *inputs: Path | None) -> Path | None:
    """Refuse a file that cannot be written, or must stay, before the work is done.

    Args:
        path: The file to write, which may be there if it is ours; None for none.
        suffixes: Those of the formats that can be written.
        inputs: Files that are read.

    Returns:
        The absolute path, which stays right if a model changes the working directory.

    Raises:
        ArgumentValueError: The file has another suffix, is one of the inputs, or of others.
        OSError: Its folder is not there, or nothing can be written to it.
    """
    if path is None:
        return None
    # Resolved, as a link to the input is the input.
    if any(given is not None and path.resolve() == given.resolve() for given in inputs):
        raise invalid("--out", "another file than the one that is read", str(path))
    if path.suffix.lower() not in suffixes:
        raise invalid("--out", f"a file with the suffix {' or '.join(suffixes)}", str(path))
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():
        return path.absolute()  # /dev/null, a pipe: written to, not replaced
    # An older study is refused when it is to be written.
    if path.suffix.lower() != ".db" and path.exists() and not _is_ours(path):
        rule = "a new file, or one that pymoo-psi has written"
        raise invalid("--out", rule, str(path), "choose another name, or remove the file first")
    return _writable(path.absolute().parent, path) / path.name


def _is_ours(path: Path) -> bool:
    """Return whether we have written a file, or it is empty: a later result may take its place."""
    if is_zipfile(path):
        with ZipFile(path) as workbook, suppress(KeyError):
            return b">pymoo-psi<" in workbook.read("docProps/core.xml")
    with path.open("rb") as file:
        content = file.read(_HEAD)
        file.seek(max(path.stat().st_size - _HEAD, 0))
        content += file.read()
    return not content or _OURS.search(content) is not None


def results_folder(out: Path) -> Path:
    """Make a folder for results, and return its absolute path.

    Raises:
        ArgumentValueError: It is a file.
        OSError: Nothing can be written there.
    """
    if out.exists() and not out.is_dir():
        raise invalid("--out", "a folder", Received(f"the file {out}"))
    out.mkdir(parents=True, exist_ok=True)
    return _writable(out.absolute(), out)


def _writable(folder: Path, shown: Path) -> Path:
    """Return a folder; refuse one that cannot be written to, by an error about what is shown."""
    try:
        with TemporaryFile(dir=folder):  # rights alone do not tell of file systems
            pass
    except OSError as error:  # it names the trial's file, which tells the user nothing
        remedy = "" if folder.exists() else f"; make the folder {folder} first"
        raise OSError(error.errno, f"{error.strerror}{remedy}", str(shown)) from None
    return folder


def write_frame(
    frame: pd.DataFrame, path: Path, layout: Layout | None = None, chosen: tuple[str, ...] = ()
) -> None:
    """Write a frame as CSV or .xlsx, whole or not at all, missing cells blank and no formula in it.

    With the layout of designs, it says what these are, unless the names of the columns do, and
    which is chosen and why.
    """
    numbers = [*frame.select_dtypes(["number", "bool"])]
    head = {} if layout is None else designs_head(layout, [*frame], numbers, chosen)
    blank = frame.astype(object).where(frame.notna(), None)  # of whole numbers, too
    write_table(path, {str(name): column for name, column in blank.items()}, head)
