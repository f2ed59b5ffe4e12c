"""What leaves the package: files, written whole, and tables for readers."""

from __future__ import annotations

import html
import os
import re
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd

_ENDS = 65_536  # bytes at each end of a file, in which its names of columns are
# A ranking is known by its columns, all else by a mark.
_OURS = re.compile(rb'mu3"?,"?rank"?[,\r\n]|pymoo_psi_|name="generator" content="pymoo-psi')

ROWS = 10  # that a notebook shows: a table of 100 000 tests is asked for by to_frame()
_COLUMNS = 24


@contextmanager
def whole_file(path: str | PathLike[str]) -> Iterator[Path]:
    """Give the path of a file to write, which then takes the place of ``path`` at once.

    If the body raises, ``path`` is as it was and what was written is removed. A link is followed,
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
    replaced = mode is None or stat.S_ISREG(mode)
    # In the same folder, as os.replace() works within one file system only; by a name of its own
    # and not target's with a suffix, which may be as long as names can be; hidden from globs.
    written = target.with_name(f".{secrets.token_hex(8)}.tmp") if replaced else Path(path)
    try:
        yield written
        if replaced and mode is not None:
            os.chmod(written, stat.S_IMODE(mode))  # before, so that it never has wider rights
        if replaced:
            os.replace(written, target)
    except BaseException as error:  # an interruption, too
        # The other name tells the user nothing, and a full disk comes without any.
        if isinstance(error, OSError) and error.errno and error.filename in (None, str(written)):
            error.filename = str(path)
        if replaced:
            with suppress(FileNotFoundError):  # the body may not have come to write
                os.unlink(written)
        raise


def is_marked(path: Path) -> bool:
    """Say whether a text, such as CSV or HTML, has a mark by which those of pymoo-psi are known."""
    with path.open("rb") as file:
        content = file.read(_ENDS)
        file.seek(max(path.stat().st_size - _ENDS, 0))
        content += file.read()
    return _OURS.search(content) is not None


class Shown:
    """What a notebook shows as its name and a short table."""

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        """Return the first n rows, for a reader, and how many there are."""
        frame = self.to_frame()  # type: ignore[attr-defined]  # of every class that is shown
        return frame.head(n), len(frame)

    def _repr_html_(self) -> str:
        """Return what Jupyter shows; names are data, and no markup of theirs is."""
        lines = [repr(self)]
        table = ""
        with suppress(ValueError):  # of names that do not fit into one table
            frame, n = self._first_rows(ROWS)
            table = frame.to_html(
                max_cols=_COLUMNS, na_rep="", notebook=True, float_format=lambda v: f"{v:.5g}"
            )
            lines += [f"The first {len(frame)} of {n} rows:"] if n > len(frame) else []
        return "".join(f"<p>{html.escape(line)}</p>\n" for line in lines) + table
