# The public names, by purpose. `lazy_loader` reads this file when the package is imported.

from . import chute as chute
from .algorithms import PSI as PSI
from .algorithms import LPTauSampling as LPTauSampling
from .algorithms import QMCSampling as QMCSampling
from .algorithms import SurrogatePSI as SurrogatePSI
from .algorithms import investigate as investigate
from .algorithms import nsga3 as nsga3
from .comparison import compare as compare
from .errors import PsiError as PsiError
from .evaluation import FailureTolerant as FailureTolerant
from .evaluation import Recorded as Recorded
from .evaluation import Robust as Robust
from .parallel import JoblibRunner as JoblibRunner
from .pareto import EfficiencyRanking as EfficiencyRanking
from .pareto import cautions as cautions
from .pareto import compare_designs as compare_designs
from .pareto import explain as explain
from .pareto import rank_of_efficiency as rank_of_efficiency
from .pareto import representatives as representatives
from .problems import Restricted as Restricted
from .problems import SphereChute as SphereChute
from .problems import VectorizedSphereChute as VectorizedSphereChute
from .selection import CompromiseProgramming as CompromiseProgramming
from .selection import EfficientSubset as EfficientSubset
from .selection import Knee as Knee
from .selection import Lexicographic as Lexicographic
from .selection import ReferencePoint as ReferencePoint
from .selection import SalukvadzeOptimum as SalukvadzeOptimum
from .selection import robustness as robustness
from .sequences import lp_tau as lp_tau
from .table import Formulation as Formulation
from .table import TestTable as TestTable

__version__: str
