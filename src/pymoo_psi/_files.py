"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path


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
    if mode is not None and not stat.S_ISREG(mode):
        yield Path(path)
        return
    # In the same folder, as os.replace() works within one file system only; by a name of its own
    # and not target's with a suffix, which may be as long as names can be; hidden from globs.
    written = target.with_name(f".{secrets.token_hex(8)}.tmp")
    try:
        yield written
        if mode is not None:
            os.chmod(written, stat.S_IMODE(mode))  # before, so that it never has wider rights
        os.replace(written, target)
    except BaseException as error:  # an interruption, too
        if isinstance(error, OSError) and error.filename == str(written):
            error.filename = str(path)  # the other name tells the user nothing
        with suppress(FileNotFoundError):  # the body may not have come to write
            os.unlink(written)
        raise
