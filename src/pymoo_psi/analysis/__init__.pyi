# The public names. `_names` reads this file when the subpackage is imported.

from ._costs import constraint_costs as constraint_costs
from ._histogram import Histogram as Histogram
from ._histogram import histogram as histogram
from ._repeats import average_repeats as average_repeats
from ._samples import convergence as convergence
from ._samples import convergence_sentence as convergence_sentence
from ._samples import even_part as even_part
from ._samples import sensitivities as sensitivities
from ._switching import switching_sentences as switching_sentences
from ._switching import switching_values as switching_values

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._costs import alike as alike
from ._costs import counts_sentence as counts_sentence
from ._costs import failure_sentences as failure_sentences
from ._costs import limit_words as limit_words
from ._costs import none_left_reason as none_left_reason
from ._costs import text_beyond as text_beyond
from ._costs import within_limits as within_limits
from ._positions import beyond_limits as beyond_limits
from ._positions import decision_sentences as decision_sentences
from ._positions import latest_positions as latest_positions
from ._positions import position_sentences as position_sentences
from ._positions import positions_frame as positions_frame
from ._positions import ranking_without_limits as ranking_without_limits
from ._positions import rows_by_name as rows_by_name
from ._positions import separation_sentences as separation_sentences
from ._positions import written_limits as written_limits
from ._repeats import averaged_repeats as averaged_repeats
from ._repeats import confidence_sentences as confidence_sentences
from ._repeats import has_repeats as has_repeats
from ._repeats import undeclared_repeats as undeclared_repeats
from ._switching import change_text as change_text
from ._switching import changed_limit as changed_limit
from ._switching import is_best as is_best
