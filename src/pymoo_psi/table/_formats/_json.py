"""JSON: a list of designs, one object each, as other programs export them."""

from __future__ import annotations

import json
import re

from pymoo_psi._validation import distinct
from pymoo_psi.table._cells import Cells, UnfitError, cells_of_frame
from pymoo_psi.table._formats._format import FileFormat, SourceFile

# A list must begin with an object, as a name in the header of a CSV may begin with a bracket.
_BEGINNING = re.compile(r"\s*(?:\{|\[\s*\{)")


class JsonFile(FileFormat):
    """A list of designs, one object each; such files are read, not written."""

    suffix = ".json"

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether a text begins as JSON does."""
        return _BEGINNING.match(file.text) is not None

    def read(self, file: SourceFile) -> Cells:
        """Return the designs, whose keys name the columns."""
        import pandas as pd  # only where JSON is read

        try:
            designs = json.loads(file.text, object_pairs_hook=distinct)
        except (ValueError, RecursionError) as error:
            raise UnfitError(f"it is JSON, but no list of designs: {error}") from None
        if not isinstance(designs, list) or not all(isinstance(row, dict) for row in designs):
            example = '[{"name": "A", "cost": 1.5}]'
            raise UnfitError(f"it is JSON, but no list of designs such as {example}")
        return cells_of_frame(pd.DataFrame(designs))
