"""The registry of file formats: how each is recognized, read and written.

A new format is a subclass of :class:`FileFormat` in a file of its own and an entry of
:data:`FORMATS`. No other module knows formats or suffixes: :func:`read_table` asks
:func:`recognized`, everything that writes asks :func:`format_of`, and messages list
:func:`suffixes_for`. Only the help of commands names the suffixes once more.
"""

from __future__ import annotations

from pathlib import Path

from pymoo_psi._validation import FilePath, invalid
from pymoo_psi.table._formats._format import FileFormat, SourceFile, StudyFile, tests_of_folder
from pymoo_psi.table._formats._others import OtherFile
from pymoo_psi.table._formats._texts import CsvFile, JsonFile, cells_of_text, metadata_path
from pymoo_psi.table._formats._xlsx import WorkbookFile

__all__ = [
    "CSV",
    "FORMATS",
    "STUDY",
    "WORKBOOK",
    "FileFormat",
    "SourceFile",
    "cells_of_text",
    "format_of",
    "metadata_path",
    "recognized",
    "suffixes_for",
    "tests_of_folder",
]

CSV = CsvFile()
WORKBOOK = WorkbookFile()
STUDY = StudyFile()

FORMATS: list[FileFormat] = [STUDY, OtherFile(), WORKBOOK, JsonFile(), CSV]
"""All formats, in the order in which they are asked whether a file is theirs. CSV comes last, as
any text could be CSV, and what begins like JSON is JSON: insert a further format in front."""


def recognized(file: SourceFile) -> FileFormat:
    """Return the format of a file that is to be read; any text may be CSV."""
    return next(file_format for file_format in FORMATS if file_format.recognizes(file))


def format_of(path: FilePath, content: str) -> FileFormat:
    """Return the format in which a file is written, by its suffix.

    Args:
        path: The file.
        content: What is written, ``"tests"`` or ``"designs"``.

    Raises:
        ArgumentValueError: No format with this suffix can hold the content.
    """
    suffix = Path(path).suffix.lower()
    for file_format in FORMATS:
        if file_format.suffix == suffix and content in file_format.writes:
            return file_format
    raise invalid("path", f"a file with the suffix {' or '.join(suffixes_for(content))}", str(path))


def suffixes_for(content: str) -> list[str]:
    """Return the suffixes of the formats that can hold tests or designs, CSV first.

    Example:
        >>> suffixes_for("tests"), suffixes_for("designs")
        (['.csv', '.xlsx', '.db'], ['.csv', '.xlsx'])
    """
    suffixes = []
    for file_format in reversed(FORMATS):
        if content in file_format.writes:
            suffixes.append(file_format.suffix)
    return suffixes
