# The public names. `_names` reads this file when the subpackage is imported.

from ._acceptability import acceptability as acceptability
from ._cautions import Caution as Caution
from ._cautions import cautions as cautions
from ._dominance import nondominated as nondominated
from ._explanation import DesignComparison as DesignComparison
from ._explanation import Explanation as Explanation
from ._explanation import compare_designs as compare_designs
from ._explanation import explain as explain
from ._indicators import hypervolume as hypervolume
from ._preferences import Preferences as Preferences
from ._ranking import EfficiencyRanking as EfficiencyRanking
from ._ranking import rank_of_efficiency as rank_of_efficiency
from ._representatives import Representatives as Representatives
from ._representatives import representatives as representatives

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._acceptability import weight_shares as weight_shares
from ._acceptability import weights_sentence as weights_sentence
from ._cautions import cautions_of_distances as cautions_of_distances
from ._cautions import cautions_with_weights as cautions_with_weights
from ._confidence import probabilities as probabilities
from ._confidence import standard_errors as standard_errors
from ._dominance import EQ_TOLERANCE as EQ_TOLERANCE
from ._dominance import LAST_PLACES as LAST_PLACES
from ._dominance import competes as competes
from ._dominance import conflicting_pairs as conflicting_pairs
from ._dominance import constraint_violation as constraint_violation
from ._dominance import enough_digits as enough_digits
from ._dominance import levels as levels
from ._dominance import meets_constraints as meets_constraints
from ._dominance import unit_lengths as unit_lengths
from ._dominance import violated_constraints as violated_constraints
from ._dominance import without_rounding as without_rounding
from ._explanation import ranked_row as ranked_row
from ._explanation import within_range as within_range
from ._indicators import epsilon_additive as epsilon_additive
from ._indicators import igd_plus as igd_plus
from ._indicators import pareto_rank as pareto_rank
from ._ranking import RANKING_COLUMNS as RANKING_COLUMNS
from ._ranking import Objectives as Objectives
from ._ranking import UtopianFrame as UtopianFrame
from ._ranking import measured_as as measured_as
from ._ranking import measured_in as measured_in
from ._ranking import nearest_of_front as nearest_of_front
from ._ranking import nearest_to_ideal as nearest_to_ideal
from ._ranking import ranking_frame as ranking_frame
from ._ranking import ranking_of as ranking_of
from ._ranking import row_of_design as row_of_design
from ._ranking import unique_names as unique_names
from ._ranking import with_units as with_units
from ._representatives import spread_subset as spread_subset
from ._sentences import SENTENCES as SENTENCES
from ._sentences import capital as capital
from ._sentences import listed as listed
from ._sentences import sentence as sentence
from ._sentences import with_article as with_article
from ._sentences import wrapped as wrapped
