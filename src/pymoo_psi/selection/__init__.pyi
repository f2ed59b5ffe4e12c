# The public names. `_names` reads this file when the subpackage is imported.

from ._robustness import Robustness as Robustness
from ._robustness import robustness as robustness
from ._selectors import CompromiseProgramming as CompromiseProgramming
from ._selectors import EfficientSubset as EfficientSubset
from ._selectors import Knee as Knee
from ._selectors import RankingSelector as RankingSelector
from ._selectors import ReferencePoint as ReferencePoint
from ._selectors import SalukvadzeOptimum as SalukvadzeOptimum
from ._selectors import compare_selectors as compare_selectors
from ._switching import switching_values as switching_values

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._switching import decision_sentences as decision_sentences
from ._switching import group_sentences as group_sentences
from ._switching import latest_positions as latest_positions
from ._switching import position_sentences as position_sentences
from ._switching import separation_sentences as separation_sentences
from ._switching import switching_sentences as switching_sentences
