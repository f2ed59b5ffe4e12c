"""Folders that tests begin with."""

from pathlib import Path


def write_files(folder, contents):
    """Write files, texts or bytes by their names, and the folders that they are in."""
    for name, content in contents.items():
        path = Path(folder, name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
