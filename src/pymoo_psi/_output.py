"""What leaves the package: files, written whole, and tables for readers."""

from __future__ import annotations

import html
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pymoo_psi._names import require_no_other_name
from pymoo_psi._validation import FilePath

if TYPE_CHECKING:
    import pandas as pd

_ENDS = 65_536  # bytes at each end of a file, in which its names of columns are
# A ranking is known by its columns, all else by a mark.
_OURS = re.compile(
    rb'mu3"?,"?efficiency_rank"?[,\r\n]|pymoo_psi_|name="generator" content="pymoo-psi'
)

ROWS = 10  # shown in a notebook; to_frame() gives all rows
_COLUMNS = 24


@contextmanager
def whole_file(path: FilePath) -> Iterator[Path]:
    """Yield the path of a new file, which replaces ``path`` at once when the body ends.

    If the body raises, ``path`` stays as it was and the new file is removed. A link is followed,
    and the mode of a file that is replaced is kept. What is no file, such as ``/dev/null`` or a
    pipe, is not replaced but written to.

    Raises:
        OSError: The file cannot be written there.
    """
    target = Path(os.path.realpath(path))
    try:
        mode = os.stat(path).st_mode
    except OSError:  # there is none yet; any other reason shows when the new one is written
        mode = None
    if mode is not None and not stat.S_ISREG(mode):
        yield Path(path)
        return
    # In the same folder, as os.replace() works within one file system only; by a name of its own
    # and not target's with a suffix, which may be as long as names can be; hidden from globs.
    new = target.with_name(f".{os.urandom(8).hex()}.tmp")
    try:
        yield new
        if mode is not None:
            os.chmod(new, stat.S_IMODE(mode))  # before, so that it never has wider rights
        os.replace(new, target)
    except BaseException as error:  # an interruption, too
        new.unlink(missing_ok=True)  # the body may not have come to write
        if isinstance(error, OSError) and error.filename == str(new):
            error.filename = str(path)  # the other name tells the user nothing
        raise


def is_marked(path: Path) -> bool:
    """Say whether there is a text, such as CSV or HTML, with a mark of those of pymoo-psi."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        content = file.read(_ENDS)
        file.seek(max(path.stat().st_size - _ENDS, 0))
        content += file.read()
    return _OURS.search(content) is not None


def with_unit(name: str, unit: str) -> str:
    """Return the name of a column with its unit, ``mass [kg]``, unless the name ends so."""
    if not unit or name.endswith(f"[{unit}]"):
        return name
    return f"{name} [{unit}]"


class Shown:
    """A class that a notebook shows as one line and a short table."""

    if not TYPE_CHECKING:  # type checkers would take every name for an attribute

        def __getattr__(self, name: str) -> Any:
            """Raise the error of a missing attribute, which may say what it is called here."""
            require_no_other_name(type(self).__name__, name)
            return object.__getattribute__(self, name)  # raises that of Python

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        """Return the first n rows for a reader, and the number of all rows."""
        frame = self.to_frame()  # type: ignore[attr-defined]  # of every class that is shown
        return frame.head(n), len(frame)

    def _repr_html_(self) -> str:
        """Return what Jupyter shows; names are data, and markup in them is escaped."""
        from pandas import option_context

        page = _paragraph(repr(self))
        frame, n = self._first_rows(ROWS)
        with option_context("display.max_colwidth", None, "display.precision", 5):
            table = frame.to_html(max_cols=_COLUMNS, na_rep="", notebook=True)
        if n > len(frame):
            page += _paragraph(f"The first {len(frame)} of {n} rows:")
        return page + table


class WithTable:
    """A class that a notebook shows as its name and the first rows of its table of tests."""

    def _repr_html_(self) -> str:
        """Return what Jupyter shows."""
        tests: Shown = self.table  # type: ignore[attr-defined]  # of every such class
        return _paragraph(type(self).__name__) + tests._repr_html_()


class Document:
    """A document as HTML, which can be saved; Jupyter shows it in a frame."""

    def html(self) -> str:
        """Return the document, which needs no network."""
        raise NotImplementedError

    def save(self, path: FilePath) -> None:
        """Write the document, whole or not at all.

        Raises:
            OSError: The file cannot be written there.
        """
        with whole_file(path) as new:
            # A title may be a file name that is not Unicode.
            new.write_text(self.html(), encoding="utf-8", errors="replace")

    def _repr_html_(self) -> str:
        """Return the document in a frame from which it reaches nothing else in a notebook."""
        # Notebooks are stored as UTF-8, which a file name need not be.
        text = self.html().encode("utf-8", "replace").decode()
        # Without allow-same-origin the scripts of a page see neither notebook nor cookies.
        return (
            f'<iframe srcdoc="{html.escape(text)}" '
            'sandbox="allow-scripts allow-downloads allow-modals" '
            'style="width: 100%; height: 90vh; min-height: 600px; border: 0"></iframe>'
        )


def _paragraph(text: str) -> str:
    return f"<p>{html.escape(text)}</p>\n"
