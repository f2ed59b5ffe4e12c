# The public names. `_names` reads this file when the subpackage is imported.

from ._engine import ExecutorRunner as ExecutorRunner
from ._engine import ProcessRunner as ProcessRunner
from ._joblib import JoblibRunner as JoblibRunner

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._evaluation import one_line as one_line
from ._evaluation import same_folder as same_folder
from ._joblib import in_parallel as in_parallel
from ._joblib import runner_of_jobs as runner_of_jobs
from ._pool import run_program as run_program
from ._runner import Queue as Queue
from ._runner import Runner as Runner
from ._runner import raise_original as raise_original
