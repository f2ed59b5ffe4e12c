"""What the commands print and write: sentences, tables, files."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

from pymoo_psi._numbers import number
from pymoo_psi._output import is_marked
from pymoo_psi._validation import Names, invalid, known_name
from pymoo_psi.cli._app import Options, printable
from pymoo_psi.files import FORMATS, designs_head, format_of
from pymoo_psi.guide import guides, site_page
from pymoo_psi.pareto import wrapped
from pymoo_psi.table import TestTable, metadata_path

if TYPE_CHECKING:
    import pandas as pd


def width() -> int | None:
    """Return the number of columns of the terminal or in COLUMNS; None for a pipe or a file."""
    if sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdigit():
        return shutil.get_terminal_size().columns
    return None


def say(*lines: object) -> None:
    """Print lines, wrapped if there is a width."""
    columns = width()
    for line in lines:
        text = str(line)
        if columns is not None:
            text = wrapped([text], columns)
        print_text(text)


def print_text(text: str) -> None:
    """Print a text as it is."""
    try:  # flushed, as errors of the stream would otherwise appear only when Python ends
        print(printable(text), flush=True)
    except BrokenPipeError:
        pass
    except OSError as error:  # a full disk
        raise OSError(error.errno, error.strerror, "standard output") from None


def print_frame(frame: pd.DataFrame, title: str) -> None:
    """Print a frame with numbers in 6 digits and blanks for missing values.

    The columns of a table that is wider than the terminal continue below, with the first column
    repeated.
    """
    if frame.empty:
        say(f"{title.rstrip(':')}: none")
        return
    from pandas import option_context

    say(title)
    first = frame.columns[0]
    indexed = frame.set_index(first).rename_axis(index=None, columns=first)
    with option_context("display.unicode.east_asian_width", True):
        text = indexed.to_string(
            float_format=lambda value: number(value, 6),
            na_rep="",
            line_width=width(),
        )
    print_text(text)


def require_output(path: Path, suffixes: Names, *inputs: Path | None) -> Path:
    """Refuse an output file that cannot or must not be written, before the work is done.

    Args:
        path: The file to write. An existing file must be a result of pymoo-psi.
        suffixes: Suffixes of the formats that can be written.
        inputs: Files that are read.

    Returns:
        The absolute path, which stays right if a model changes the working directory.

    Raises:
        ArgumentValueError: The file has another suffix, is an input, or is no result of pymoo-psi.
        OSError: Its folder does not exist or cannot be written to.
    """
    for source in inputs:
        # Resolved, as a link to an input is the input.
        if source is not None and source.resolve() == path.resolve():
            raise invalid("--out", "another file than the one that is read", str(path))
    if path.suffix.lower() not in suffixes or path.is_dir():
        raise invalid("--out", f"a file with the suffix {' or '.join(suffixes)}", str(path))
    if path.exists() and not path.is_file():
        return path.absolute()  # /dev/null, a pipe: written to, not replaced
    for file in (path, metadata_path(path)):  # a CSV is written with its metadata
        if file.exists() and not _is_ours(file):
            rule = "a new file, or one that pymoo-psi has written"
            remedy = "choose another name, or remove the file first"
            raise invalid("--out", rule, str(path.with_name(file.name)), remedy)
    return _writable(path.absolute().parent) / path.name


def _is_ours(path: Path) -> bool:
    """Return whether a file is empty or a result of pymoo-psi, which a new one may replace."""
    if path.stat().st_size == 0:
        return True
    for file_format in FORMATS:
        if file_format.suffix == path.suffix.lower():
            return file_format.is_ours(path)
    return is_marked(path)  # HTML


def results_folder(out: Path) -> Path:
    """Make a folder for results and return its absolute path.

    Raises:
        OSError: The folder cannot be made or written to.
    """
    out.mkdir(parents=True, exist_ok=True)
    return _writable(out.absolute())


def _writable(folder: Path) -> Path:
    """Return a folder, in which it must be possible to make files."""
    try:
        with TemporaryFile(dir=folder):  # access rights do not tell of read-only file systems
            return folder
    except OSError as error:  # it names the temporary file, which the user has never seen
        problem = f"{error.strerror}; --out needs a folder that exists and can be written to"
        raise OSError(error.errno, problem, str(folder)) from None


def write_frame(frame: pd.DataFrame, path: Path, designs: TestTable | None = None) -> None:
    """Write a frame in the format of the suffix, whole or not at all, blanks for missing values.

    Args:
        frame: The rows. Texts are never written as formulas.
        path: The file.
        designs: The designs of the rows, if they are that. What their columns are is written with
            the rows.
    """
    head = {}
    if designs is not None:
        head = designs_head(designs, [*frame])
    blanked = frame.astype(object).where(frame.notna(), None)  # integer columns, too
    columns = {str(name): column for name, column in blanked.items()}
    format_of(path, "designs").save(path, columns, head)


def run_guide(options: Options) -> int:
    """Print a guide, or the names and titles of all of them, or open its page."""
    import webbrowser

    texts = guides()
    if options.name is not None:
        known_name("NAME", options.name, texts)
    if options.open:
        page = site_page(options.name or "index")
        print_text(f"Opening {page}")
        webbrowser.open(page.as_uri())
    elif options.name is not None:
        print_text(texts[options.name])
    else:
        for name, text in texts.items():
            title = text.partition("\n")[0].removeprefix("# ")
            print_text(f"{name:18}{title}")
        print_text("pymoo-psi guide NAME prints one of them.")
    return 0
