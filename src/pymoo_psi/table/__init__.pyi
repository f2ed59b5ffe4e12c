# The public names. `_names` reads this file when the subpackage is imported.

from ._analysis import Convergence as Convergence
from ._analysis import Histogram as Histogram
from ._analysis import constraint_costs as constraint_costs
from ._analysis import convergence as convergence
from ._analysis import even_part as even_part
from ._analysis import histogram as histogram
from ._analysis import sensitivities as sensitivities
from ._cells import Cells as Cells
from ._formats import FORMATS as FORMATS
from ._formats import FileFormat as FileFormat
from ._formats import SourceFile as SourceFile
from ._formulation import Formulation as Formulation
from ._layout import Kind as Kind
from ._layout import Layout as Layout
from ._source import read_table as read_table
from ._table import TestTable as TestTable

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._analysis import PROPOSAL_ROUND as PROPOSAL_ROUND
from ._analysis import alike as alike
from ._cells import UnfitError as UnfitError
from ._cells import is_blank as is_blank
from ._designs import design_keys as design_keys
from ._designs import design_matrix as design_matrix
from ._designs import value_ranks as value_ranks
from ._expression import Expression as Expression
from ._formats import STUDY as STUDY
from ._formats import cells_of_text as cells_of_text
from ._formats import format_of as format_of
from ._formats import metadata_path as metadata_path
from ._formats import source_suffixes as source_suffixes
from ._formats import stored_tests as stored_tests
from ._formats import suffixes_for as suffixes_for
from ._formulation import NUMBER as NUMBER
from ._formulation import OPEN as OPEN
from ._formulation import Allowed as Allowed
from ._formulation import Limit as Limit
from ._formulation import Limits as Limits
from ._formulation import ends as ends
from ._formulation import entries_of as entries_of
from ._formulation import is_of_texts as is_of_texts
from ._formulation import limit_text as limit_text
from ._formulation import limits_by_name as limits_by_name
from ._formulation import limits_of as limits_of
from ._formulation import limits_on as limits_on
from ._formulation import sides_of_text as sides_of_text
from ._head import choice_texts as choice_texts
from ._head import choice_values as choice_values
from ._head import columns_of as columns_of
from ._head import columns_of_designs as columns_of_designs
from ._head import designs_head as designs_head
from ._head import head_of as head_of
from ._head import kinds_of_columns as kinds_of_columns
from ._head import lacking as lacking
from ._head import table_of as table_of
from ._joining import difference as difference
from ._layout import POINT as POINT
from ._layout import RESERVED as RESERVED
from ._layout import RUN as RUN
from ._layout import Key as Key
from ._layout import number_column as number_column
from ._repeats import averaged_repeats as averaged_repeats
from ._repeats import confidence_sentence as confidence_sentence
from ._source import source_columns as source_columns
