"""Studies: files on disk that keep evaluated designs, even if the process is killed.

Each test is on the disk within a second or two. A study is an ordinary SQLite database with a row
for each test, which can be read without this package: ``pandas.read_sql("SELECT * FROM tests",
sqlite3.connect("chute.db"))``. The files of several machines in one folder are read as one study.

- `Study`: the tests and proposals of one file, block after block; one process writes at a time.
- `write_study`: a whole file at once.
- `Share`, `read_folder`: divide the points of one investigation among machines, and read their
  files; `ALL` is the share that has every point, `LAST` the largest number of a test point.
"""

from pymoo_psi.study._study import Study

# Names that other subpackages share; they are no promise to users.
# isort: split
from pymoo_psi.study._database import LAST as LAST
from pymoo_psi.study._database import Database as Database
from pymoo_psi.study._database import Proposal as Proposal
from pymoo_psi.study._facts import ACTIONS as ACTIONS
from pymoo_psi.study._facts import ADDED as ADDED
from pymoo_psi.study._facts import ALL as ALL
from pymoo_psi.study._facts import LASTING as LASTING
from pymoo_psi.study._facts import NOT_VALUES as NOT_VALUES
from pymoo_psi.study._facts import Facts as Facts
from pymoo_psi.study._facts import Share as Share
from pymoo_psi.study._facts import StudyRun as StudyRun
from pymoo_psi.study._facts import further_tests as further_tests
from pymoo_psi.study._facts import identity_of_run as identity_of_run
from pymoo_psi.study._study import read_folder as read_folder
from pymoo_psi.study._study import write_study as write_study

__all__ = [
    "Study",
]
