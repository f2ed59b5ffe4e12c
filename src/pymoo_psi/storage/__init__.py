"""Studies on disk: what was evaluated is kept, whatever happens to the process that did it.

Each test is on the disk within a second or two of its arrival. A study is an ordinary SQLite
database, one row a test with its number, status, reason, origin, seconds, variables, criteria,
constraints and outputs under their names: ``pandas.read_sql("SELECT * FROM tests",
sqlite3.connect("chute.db"))`` reads it without this package. Files of several machines in one
folder are read as one study.
"""

from pymoo_psi.storage._folder import read_folder
from pymoo_psi.storage._study import Study, read_study, write_study

__all__ = ["Study", "read_folder", "read_study", "write_study"]
