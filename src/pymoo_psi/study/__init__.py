"""Studies on disk: what was evaluated is kept, whatever happens to the process that did it.

Each test is on the disk within a second or two of its arrival. A study is an ordinary SQLite
database, one row a test: ``pandas.read_sql("SELECT * FROM tests", sqlite3.connect("chute.db"))``
reads it without this package. Files of several machines in one folder are read as one study.

- `Study`: tests and proposals of one file, block after block; one process at a time writes.
- `write_study`: a whole file at once.
- `Share`, `read_folder`: the points of one investigation divided among machines, and read again;
  `ALL` is the share that has every point, `LAST` the largest number of a test point.
"""

from pymoo_psi.study._study import ALL, LAST, Proposal, Share, Study, read_folder, write_study

__all__ = ["ALL", "LAST", "Proposal", "Share", "Study", "read_folder", "write_study"]
