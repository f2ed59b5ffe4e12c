"""The registry of file formats: how each is recognized, read and written.

A new format is a subclass of :class:`FileFormat` in a file of its own and an entry of
:data:`FORMATS`. No other module knows formats or suffixes: :func:`read_table` asks
:func:`recognized`, everything that writes asks :func:`format_of`, and messages list
:func:`suffixes_for`. Only the help of commands names the suffixes once more.

Of files of other programs that are no table to read, a few bytes at the beginning tell what they
are, and the message says how to export them.
"""

from __future__ import annotations

import re
from contextlib import suppress
from io import BytesIO
from pathlib import Path

from pymoo_psi._validation import FilePath, Head, invalid
from pymoo_psi.files._cells import Cells, UnfitError, cells_of_frame
from pymoo_psi.files._format import FileFormat, SourceFile
from pymoo_psi.files._tests import StudyFile
from pymoo_psi.files._texts import CsvFile, JsonFile
from pymoo_psi.files._workbook import WorkbookFile
from pymoo_psi.table import TestTable, require_table

_PARQUET = "Parquet"
_PROBLEM = "the description of a problem"
_ARCHIVED = rb"PK\x03\x04.{26}"  # up to the name of the first file in a ZIP archive
_KINDS = {  # the beginning of a file by what it is, and how to export it
    _PARQUET: (rb"PAR1", "export it by pandas.read_parquet('FILE').to_csv('designs.csv')"),
    "an array of NumPy (.npy)": (
        rb"\x93NUMPY",
        "export it by numpy.savetxt('designs.csv', numpy.load('FILE'), delimiter=',', "
        "header='f1,f2'), or use read_table(numpy.load('FILE')) in Python",
    ),
    "an archive of NumPy (.npz)": (
        _ARCHIVED + rb"[^/]+\.npy",
        "export an array of it by numpy.savetxt('designs.csv', numpy.load('FILE')['F'], "
        "delimiter=',', header='f1,f2')",
    ),
    "an OpenDocument": (_ARCHIVED + rb"mimetypeapp", "save it as CSV or .xlsx"),
    "HDF5": (rb"\x89HDF", "export it by pandas.read_hdf('FILE').to_csv('designs.csv') or h5py"),
    "a pickle of Python": (
        rb"\x80[\x02-\x05]",
        "export its table by to_csv of pandas, or use read_table(object) in Python",
    ),
    "a MAT-file of MATLAB": (rb"MATLAB 5\.0", "export it by writetable(T, 'designs.csv')"),
    "an old workbook (.xls), or one with a password": (
        rb"\xd0\xcf\x11\xe0",
        "save it as .xlsx without one, or as CSV",
    ),
    "compressed by gzip": (rb"\x1f\x8b", "unpack it"),
    # Known by its suffix, as any text may begin like it.
    _PROBLEM: (rb"(?!)", "run pymoo-psi solve FILE --study STEM.db, and read STEM.db instead"),
}


class OtherFile(FileFormat):
    """A file that is no text, workbook or study; it is refused, with the way to export it."""

    suffix = ""

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether the first bytes or the suffix are those of such a file."""
        return _kind(file) is not None

    def read(self, file: SourceFile) -> tuple[Cells, Head]:
        """Return the cells of a Parquet file if pandas can read it."""
        kind = str(_kind(file))
        if kind == _PARQUET:
            import pandas as pd

            with suppress(ImportError):
                return cells_of_frame(pd.read_parquet(BytesIO(file.content)))
        remedy = _KINDS[kind][1].replace("FILE", file.path.name).replace("STEM", file.path.stem)
        raise UnfitError(f"it is {kind}, which is not read", remedy)


def _kind(file: SourceFile) -> str | None:
    """Return what a file is by its first bytes, or by its suffix, or None."""
    if file.path.suffix.lower() == ".toml":
        return _PROBLEM
    for kind, (beginning, _) in _KINDS.items():
        if re.match(beginning, file.start, re.DOTALL):
            return kind
    return None


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
    require_table(table)
    format_of(path, "tests").save_tests(path, table)
