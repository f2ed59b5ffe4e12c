"""The registry of file formats: how each is recognized, read and written.

A new format is a subclass of :class:`FileFormat` in a file of its own and an entry of
:data:`FORMATS`. No other module knows formats or suffixes: :func:`read_table` asks
:func:`recognized`, everything that writes asks :func:`format_of`, and messages list
:func:`suffixes_for`. Only the help of commands names the suffixes once more.
"""

from __future__ import annotations

from pathlib import Path

from pymoo_psi._validation import FilePath, instance, invalid
from pymoo_psi.files._format import FileFormat, SourceFile
from pymoo_psi.files._others import OtherFile
from pymoo_psi.files._study import StudyFile
from pymoo_psi.files._texts import CsvFile, JsonFile
from pymoo_psi.files._workbook import WorkbookFile
from pymoo_psi.table import TestTable

STUDY = StudyFile()
FORMATS: list[FileFormat] = [STUDY, OtherFile(), WorkbookFile(), JsonFile(), CsvFile()]
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


def write_table(table: TestTable, path: FilePath) -> None:
    """Write a table in the format of the suffix; :func:`read_table` reads it without a change.

    - ``.csv``: as by :meth:`TestTable.to_csv`.
    - ``.xlsx``: a workbook. The first sheet has the tests, in the columns of
      :meth:`TestTable.to_frame` with units in the header; the second describes the columns and the
      decision.
    - ``.db``: a new study that a run can continue. To continue several tables in one run, use
      ``write_table(a.merge(b), "all.db")``, then ``minimize(problem, PSI(n, study="all.db"))``. A
      table whose problem is unknown, such as one made by :meth:`TestTable.of`, can be read again,
      but not continued. Notes with the names of columns of a study, such as ``origin``, are not
      written.

    Args:
        table: The tests.
        path: The file; if writing is interrupted, an old one stays as it was.

    Raises:
        ArgumentValueError: There is no such format, or another program has written metadata of the
            file.
        StudyAccessError: The study exists already.
        PsiError: A package that writes such files is not installed.
        OSError: The file cannot be written.

    Example:
        >>> import os, tempfile
        >>> from pymoo_psi import VectorizedSphereChute, investigate, read_table
        >>> problem = VectorizedSphereChute()
        >>> parts = [investigate(problem, 100, share=(k, 2)) for k in (1, 2)]
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     study = os.path.join(folder, "chute.db")
        ...     write_table(parts[0].merge(parts[1]), study)
        ...     table = investigate(problem, 200, study=study)  # 100 of them are stored
        ...     write_table(table, os.path.join(folder, "chute.xlsx"))
        ...     read_table(os.path.join(folder, "chute.xlsx")).equals(table)
        True
        >>> len(table)
        200
    """
    instance("table", table, TestTable)
    format_of(path, "tests").save_tests(path, table)
