"""What the commands print and write: tables, progress, files."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

__all__ = ["console", "print_frame", "progress_bar", "write_csv"]


def console() -> Console:
    """Return a console on standard output that does not cut tables when it is no terminal."""
    plain = Console(highlight=False)
    return plain if plain.is_terminal else Console(highlight=False, width=120)


def progress_bar() -> Progress:
    """Return a progress bar on standard error, silent when that is no terminal."""
    error_console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=error_console,
        disable=not error_console.is_terminal,
        transient=True,
    )


def print_frame(frame: pd.DataFrame, title: str, *, decimals: int = 4) -> None:
    """Print a frame as a table: numbers right-aligned, missing values blank."""
    table = Table(title=title, title_justify="left", title_style="bold")
    for name in frame.columns:
        number = pd.api.types.is_numeric_dtype(frame[name])
        table.add_column(str(name), justify="right" if number else "left", no_wrap=True)
    for row in frame.itertuples(index=False):
        table.add_row(*_cells(row, decimals))
    console().print(table)


def _cells(row: Sequence[object], decimals: int) -> list[str]:
    return [
        ""
        if value is None or value != value
        else f"{value:.{decimals}f}"
        if isinstance(value, float)
        else str(value)
        for value in row
    ]


def write_csv(frame: pd.DataFrame, path: Path) -> None:
    """Write a frame whole or not at all: an interrupted run leaves the old file as it was."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
            frame.to_csv(file, index=False)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
