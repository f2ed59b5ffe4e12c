# The public names. `_names` reads this file when the subpackage is imported.

from ._robustness import robustness as robustness
from ._selectors import CompromiseProgramming as CompromiseProgramming
from ._selectors import EfficientSubset as EfficientSubset
from ._selectors import Knee as Knee
from ._selectors import Preferred as Preferred
from ._selectors import RankingSelector as RankingSelector
from ._selectors import ReferencePoint as ReferencePoint
from ._selectors import SalukvadzeOptimum as SalukvadzeOptimum
from ._selectors import compare_selectors as compare_selectors
