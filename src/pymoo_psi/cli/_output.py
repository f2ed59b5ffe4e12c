"""What the commands print and write: sentences, tables, files."""

from __future__ import annotations

import errno
import os
import re
import shutil
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile
from zipfile import ZipFile, is_zipfile

import pandas as pd

from pymoo_psi._output import write_table
from pymoo_psi._validation import Received, invalid
from pymoo_psi.cli._app import printable
from pymoo_psi.pareto import number, wrapped
from pymoo_psi.table import Layout, designs_head

_HEAD = 65_536  # bytes at an end of a file, in which its names of columns are
# How CSV and HTML of ours are known: a ranking by its columns, all else by a mark.
_OURS = re.compile(rb'mu3"?,"?rank"?[,\r\n]|pymoo_psi_|name="generator" content="pymoo-psi')


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


def print_frame(frame: pd.DataFrame, title: str) -> None:
    """Print a frame with numbers in 6 digits, missing ones blank.

    A table that is wider than the terminal is continued below, its first column repeated.
    """
    say(title if len(frame) else f"{title.rstrip(':')}: none")
    if not len(frame):
        return
    first = frame.columns[0]
    shown = frame.set_index(first).rename_axis(index=None, columns=first)
    with pd.option_context("display.unicode.east_asian_width", True):
        _print(
            shown.to_string(
                float_format=lambda value: number(value, 6), na_rep="", line_width=width()
            )
        )


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
