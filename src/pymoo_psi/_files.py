"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path


@contextmanager
def whole_file(path: str | PathLike[str]) -> Iterator[Path]:
    """Give the path of a file to write, which then takes the place of ``path`` at once.

    If the body raises, ``path`` is as it was and what was written is removed. A link is followed.

    Raises:
        OSError: The file cannot be written there.
    """
    target = Path(os.path.realpath(path))
    written = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    try:
        yield written
        os.replace(written, target)
    except BaseException:
        with suppress(FileNotFoundError):
            os.unlink(written)
        raise
