# The public names. `_names` reads this file when the subpackage is imported.

from ._format import FileFormat as FileFormat
from ._formats import FORMATS as FORMATS
from ._formats import write_table as write_table
from ._source import read_table as read_table

# Names that other subpackages share; they are no promise to users.
# isort: split

from ._cells import UnfitError as UnfitError
from ._cells import is_blank as is_blank
from ._format import SourceFile as SourceFile
from ._formats import STUDY as STUDY
from ._formats import format_of as format_of
from ._formats import suffixes_for as suffixes_for
from ._source import source_columns as source_columns
from ._tests import designs_head as designs_head
from ._tests import stored_tests as stored_tests
from ._tests import table_of as table_of
from ._tests import table_with as table_with
from ._tests import with_remark_on_lacks as with_remark_on_lacks
from ._texts import cells_of_text as cells_of_text
