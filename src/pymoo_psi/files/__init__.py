"""Files of tests and designs: CSV, workbooks, studies, JSON, and formats that users add.

:func:`read_table` reads any source into a :class:`TestTable`; :func:`write_table` writes a table
that it reads back without a change, decision included. ``pd.read_csv(path)`` and
``pd.read_excel(path)`` read CSV and workbooks without the metadata of ``FILE.csv-metadata.json``
and of the second sheet.

FORMATS is the registry of formats; a FileFormat reads a file into columns and a head.

Example:
    >>> import os, tempfile
    >>> from pymoo_psi import TestTable
    >>> from pymoo_psi.files import read_table, write_table
    >>> table = TestTable.of([1, 2], [[0.0], [0.1]], [[1 / 3], [4]]).under(limits={"f1": 2})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "table.csv")
    ...     write_table(table, path)
    ...     read_table(path).equals(table)
    True
"""

from pymoo_psi._names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
