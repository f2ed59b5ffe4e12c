# The public names. `_names` reads this file when the subpackage is imported.

from ._evaluation import FailureTolerant as FailureTolerant
from ._program import ProgramProblem as ProgramProblem
from ._requirements import Required as Required
from ._robust import Robust as Robust
from ._sphere_chute import SphereChute as SphereChute
from ._sphere_chute import VectorizedSphereChute as VectorizedSphereChute
from ._transformed import LogScaled as LogScaled
from ._transformed import Restricted as Restricted
from ._wrapped import WrappedProblem as WrappedProblem

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._design_space import DesignSpace as DesignSpace
from ._design_space import Variable as Variable
from ._design_space import design_space as design_space
from ._design_space import is_permutation as is_permutation
from ._design_space import require_no_permutation as require_no_permutation
from ._evaluation import CheckedFunction as CheckedFunction
from ._evaluation import columns_of_values as columns_of_values
from ._evaluation import evaluate_designs as evaluate_designs
from ._evaluation import streams as streams
from ._model import problem_identity as problem_identity
from ._model import problem_schema as problem_schema
from ._program import ProgramRun as ProgramRun
from ._program import known_limits as known_limits
from ._pymoo import NO_OUTPUTS as NO_OUTPUTS
from ._pymoo import problem_name as problem_name
from ._pymoo import require_known_keywords as require_known_keywords
from ._pymoo import require_problem as require_problem
from ._pymoo import seed_ties as seed_ties
from ._requirements import requirement_texts as requirement_texts
from ._requirements import requirements_of as requirements_of
from ._requirements import with_requirements as with_requirements
from ._requirements import without_requirements as without_requirements
from ._settings import Output as Output
from ._wrapped import Wrapper as Wrapper
from ._wrapped import layers as layers
from ._wrapped import require_model as require_model
from ._wrapped import untolerant as untolerant
from ._wrapped import within_same_columns as within_same_columns
