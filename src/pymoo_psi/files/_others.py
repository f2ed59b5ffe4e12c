"""Files of other programs that are no table of ours to read: what they are, and how to export them.

A few bytes at the beginning tell what a file is. Parquet is read where pandas can do so.
"""

from __future__ import annotations

import re
from contextlib import suppress
from io import BytesIO

from pymoo_psi._validation import Head
from pymoo_psi.files._cells import Cells, UnfitError, cells_of_frame
from pymoo_psi.files._format import FileFormat, SourceFile

_PARQUET = "Parquet"
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
    "Feather or Arrow": (
        rb"ARROW1|FEA1",
        "export it by pandas.read_feather('FILE').to_csv('designs.csv')",
    ),
    "a MAT-file of MATLAB": (rb"MATLAB 5\.0", "export it by writetable(T, 'designs.csv')"),
    "an old workbook (.xls), or one with a password": (
        rb"\xd0\xcf\x11\xe0",
        "save it as .xlsx without one, or as CSV",
    ),
    "compressed by gzip": (rb"\x1f\x8b", "unpack it"),
    "a PDF": (rb"%PDF-", "export the table as CSV by the program that made it"),
}


class OtherFile(FileFormat):
    """A file that is no text, workbook or study; it is refused, with the way to export it."""

    suffix = ""

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether the first bytes are those of such a file."""
        return _kind(file) is not None

    def read(self, file: SourceFile) -> tuple[Cells, Head]:
        """Return the cells of a Parquet file if pandas can read it."""
        kind = str(_kind(file))
        if kind == _PARQUET:
            import pandas as pd

            with suppress(ImportError):
                return cells_of_frame(pd.read_parquet(BytesIO(file.content)))
        remedy = _KINDS[kind][1].replace("FILE", file.path.name)
        raise UnfitError(f"it is {kind}, which is not read", remedy)


def _kind(file: SourceFile) -> str | None:
    """Return what a file is by its first bytes, or None."""
    for kind, (beginning, _) in _KINDS.items():
        if re.match(beginning, file.start, re.DOTALL):
            return kind
    return None
