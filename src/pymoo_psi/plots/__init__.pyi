# The public names. `_names` reads this file when the subpackage is imported.

from ._figures import plot_indicators as plot_indicators
from ._figures import plot_objectives as plot_objectives
from ._figures import plot_ranking as plot_ranking
from ._figures import plot_sections as plot_sections
from ._figures import plot_sensitivities as plot_sensitivities
from ._figures import plot_table as plot_table
from ._paper import paper_figures as paper_figures
from ._style import Drawing as Drawing
from ._style import save_figures as save_figures

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._figures import places_in_row as places_in_row
from ._figures import plot_indicator as plot_indicator
from ._style import literal as literal
from ._style import svg_of as svg_of
