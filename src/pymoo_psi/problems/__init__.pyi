# The public names, and those for other subpackages. `lazy_loader` reads this file.

from ._design_space import DesignSpace as DesignSpace
from ._design_space import design_space as design_space
from ._design_space import problem_identity as problem_identity
from ._design_space import problem_layout as problem_layout
from ._evaluation import columns_of_values as columns_of_values
from ._evaluation import evaluate_designs as evaluate_designs
from ._evaluation import stream_designs as stream_designs
from ._evaluation import streams as streams
from ._evaluation import value_column as value_column
from ._failures import FailureTolerant as FailureTolerant
from ._failures import leave_failed_out as leave_failed_out
from ._failures import untolerant as untolerant
from ._pymoo import WrappedProblem as WrappedProblem
from ._pymoo import call_of as call_of
from ._pymoo import require_known_keywords as require_known_keywords
from ._pymoo import require_problem as require_problem
from ._pymoo import seed_ties as seed_ties
from ._restricted import Restricted as Restricted
from ._robust import Robust as Robust
from ._robust import evaluated as evaluated
from ._robust import scenario_problem as scenario_problem
from ._robust import scenario_values as scenario_values
from ._sphere_chute import SphereChute as SphereChute
from ._sphere_chute import VectorizedSphereChute as VectorizedSphereChute
