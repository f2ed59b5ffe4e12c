# The public names. `_names` reads this file when the subpackage is imported.

from ._nsga3 import nsga3 as nsga3
from ._psi import PSI as PSI
from ._psi import investigate as investigate
from ._recorded import Recorded as Recorded
from ._sampling import LPTauSampling as LPTauSampling
from ._sampling import QMCSampling as QMCSampling
from ._sampling import UniformSampling as UniformSampling
from ._sections import sections as sections
from ._surrogate import SurrogatePSI as SurrogatePSI

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._imported import import_tests as import_tests
from ._laboratory import ask_tests as ask_tests
from ._laboratory import tell_tests as tell_tests
from ._model import Model as Model
from ._model import table_of_values as table_of_values
from ._nsga3 import operators as operators
from ._nsga3 import population_size as population_size
from ._nsga3 import reference_directions as reference_directions
from ._nsga3 import run_within_budget as run_within_budget
from ._nsga3 import vary_logarithms as vary_logarithms
from ._psi import PointAlgorithm as PointAlgorithm
from ._run import Run as Run
from ._run import by_number as by_number
from ._run import progress_bar as progress_bar
from ._run import repeated_tests as repeated_tests
from ._run import run_of_sequence as run_of_sequence
from ._sources import Points as Points
from ._sources import RunOptions as RunOptions
from ._sources import Source as Source
from ._store import stored_at_termination as stored_at_termination
