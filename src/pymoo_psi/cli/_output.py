"""What the commands print and write: sentences, tables, progress, files."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import shutil
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryFile
from time import monotonic
from typing import Any

import pandas as pd
from rich.cells import cell_len

from pymoo_psi._output import whole_file, write_table
from pymoo_psi._validation import Received, invalid
from pymoo_psi.cli._app import REPORTED, print_error, printable
from pymoo_psi.pareto import number, wrapped
from pymoo_psi.table import Layout, designs_head

_FIRST, _EVERY = 10.0, 60.0  # seconds until the first line of a log, and between later ones


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
    if not len(frame):
        return
    columns = [_cells(str(name), column.tolist()) for name, column in frame.items()]
    first, rest = columns[:lead], deque(columns[lead:])
    room = (width() or math.inf) + 2
    leading = sum(cell_len(cells[0]) + 2 for cells in first)
    while rest:
        part, used = list(first), leading
        while rest and (len(part) == len(first) or used + cell_len(rest[0][0]) + 2 <= room):
            used += cell_len(rest[0][0]) + 2
            part.append(rest.popleft())
        lines = ["  ".join(row).rstrip() for row in zip(*part, strict=True)]
        _print("\n".join([*lines, ""] if rest else lines))


def _cells(name: str, column: Sequence[Any]) -> list[str]:
    """Return the name, a line and the cells of a column, all of one width; numbers to the right."""
    texts = [name, *map(_text, column)]
    size = max(map(cell_len, texts))  # of Chinese, a letter takes two
    texts.insert(1, "-" * size)
    gaps = [" " * (size - cell_len(text)) for text in texts]
    left = any(isinstance(cell, str) for cell in column)
    return [text + gap if left else gap + text for text, gap in zip(texts, gaps, strict=True)]


def _text(cell: Any) -> str:
    if cell is None or cell != cell:
        return ""
    return number(cell, 6) if isinstance(cell, float) else printable(str(cell))


@contextmanager
def progress(
    description: str, total: int | None, *, bar: bool = True
) -> Iterator[Callable[..., None]]:
    """Give a function ``show(done, note="", total=...)`` of the progress of the body.

    It shows a bar on standard error; where that is no terminal, now and then a line, for a log.
    """
    from rich.console import Console  # loaded where a bar is drawn
    from rich.progress import Progress, TextColumn

    console, due = Console(stderr=True), monotonic() + _FIRST
    columns = (*Progress.get_default_columns(), TextColumn("{task.fields[note]}"))
    silent = not console.is_terminal or console.is_dumb_terminal
    shown = Progress(*columns, console=console, disable=silent or not bar, transient=True)
    with nullcontext() if shown.disable else shown:
        task = shown.add_task(description, total=total, note="")

        def show(done: int, note: str = "", total: int | None = total) -> None:
            nonlocal due
            count = f"{done} of {total}{f', {note}' if note else ''}"
            shown.update(task, completed=done, total=total, note=count)
            if silent and monotonic() >= due:
                due = monotonic() + _EVERY
                print_error(f"{description}: {count}")

        yield show


@contextmanager
def keeping(kept: Callable[[], str]) -> Iterator[None]:
    """Say in a line what is kept, and how to go on, if the user or SIGTERM stops the body."""
    try:
        yield
    except KeyboardInterrupt as stop:
        print_error(f"pymoo-psi: interrupted; {kept()}")
        stop.args = REPORTED
        raise


_HEAD = 65_536  # bytes at an end of a file, in which its names of columns are
# How a file that a command wrote is known: a ranking by its last columns, others by a mark.
_WRITTEN = {
    "solve": rb'mu3"?,"?rank"?\r?\n',
    "rank": rb'mu3"?,"?rank"?,"?pareto"?\r?\n|"salukvadze_rows": ',
    "export": rb"pymoo_psi_test_table",
    "page": rb'<meta name="generator" content="pymoo-psi page"',
    "figure": rb"pymoo-psi rank",  # as the program that has made it
    "report": rb'<meta name="generator" content="pymoo-psi report"',
}


def require_output(
    path: Path | None,
    suffixes: Sequence[str],
    *inputs: Path | None,
    by: str,
    force: bool,
    option: str = "--out",
) -> Path | None:
    """Refuse a file that cannot be written, or must not be, before the work is done.

    Args:
        path: The file to write; None for none.
        suffixes: Those of the formats that can be written.
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
    if path is None:
        return None
    # Resolved, as a link to the input is the input.
    if any(given is not None and path.resolve() == given.resolve() for given in inputs):
        raise invalid(option, "another file than the one that is read", str(path))
    if path.suffix.lower() not in suffixes:
        raise invalid(option, f"a file with the suffix {' or '.join(suffixes)}", str(path))
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():
        return path.absolute()  # /dev/null, a pipe: written to, not replaced
    if not force and path.exists() and path.stat().st_size > 0:
        with path.open("rb") as file:
            content = file.read(_HEAD)
            file.seek(max(path.stat().st_size - _HEAD, 0))  # where what the columns are stands
            content += file.read()
        if not re.search(_WRITTEN[by], content):
            rule = "a new file, or one that this command wrote"
            raise invalid(option, rule, str(path), "--force overwrites it")
    return require_folder(path.absolute().parent, str(path)) / path.name


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
    found = [path for pattern in files for path in out.glob(pattern)]
    if found and not force and not any(out.glob(files[0])):
        rule = "a folder without such results of others"
        received = Received(f"{found[0].name} in {out}")
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
        remedy = "" if folder.exists() else f"; make the folder {folder.absolute()} first"
        raise OSError(error.errno, f"{error.strerror}{remedy}", shown) from None
    return folder.absolute()


def write_csv(
    frame: pd.DataFrame, path: Path, layout: Layout | None = None, chosen: tuple[str, ...] = ()
) -> None:
    """Write a frame as CSV or .xlsx, whole or not at all, missing cells blank and no formula in it.

    With the layout of designs, it says what these are, unless the names of the columns do, and
    which is chosen and why.
    """
    head = {}
    if layout is not None:
        head = designs_head(layout, [*frame], [*frame.select_dtypes(["number", "bool"])], chosen)
    columns = {
        str(n): column.astype(object).where(column.notna(), None) for n, column in frame.items()
    }
    write_table(path, columns, head)


def write_json(content: dict[str, Any], path: Path) -> None:
    """Write plain values as JSON, whole or not at all."""
    text = json.dumps(content, ensure_ascii=False, indent=1, allow_nan=False)
    with whole_file(path) as written:
        # A name that is no Unicode holds lone surrogates, which UTF-8 cannot.
        written.write_text(f"{text}\n", encoding="utf-8", errors="replace")
