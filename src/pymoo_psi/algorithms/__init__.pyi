# The public names. `lazy_loader` reads this file when the subpackage is imported.

from ._engine import Engine as Engine
from ._engine import by_number as by_number
from ._nsga3 import nsga3 as nsga3
from ._nsga3 import operators as operators
from ._nsga3 import population_size as population_size
from ._nsga3 import reference_directions as reference_directions
from ._nsga3 import run_within_budget as run_within_budget
from ._psi import PSI as PSI
from ._psi import investigate as investigate
from ._recorded import Recorded as Recorded
from ._run import RunOptions as RunOptions
from ._run import stored_at_termination as stored_at_termination
from ._sampling import LPTauSampling as LPTauSampling
from ._sampling import QMCSampling as QMCSampling
from ._sampling import UniformSampling as UniformSampling
from ._surrogate import SurrogatePSI as SurrogatePSI
