"""The kinds of variables and columns, in pymoo's words."""

from enum import Enum
from typing import Any

import numpy as np


class Kind(str, Enum):
    """The kind of a variable, and of the values in its column.

    Example:
        >>> Kind("real") is Kind.REAL, Kind.CHOICE == "choice"
        (True, True)
    """

    REAL = "real"
    """A float64."""
    LOG = "log"
    """A float64 above 0 on a logarithmic scale, where steps are factors."""
    INTEGER = "integer"
    """An int64."""
    BINARY = "binary"
    """A bool."""
    CHOICE = "choice"
    """One of some options: texts, or values of several types."""

    @property
    def real(self) -> bool:
        """Whether values are real numbers, on either scale."""
        return self in (Kind.REAL, Kind.LOG)


DTYPES: dict[Kind, Any] = {
    Kind.REAL: np.float64,
    Kind.LOG: np.float64,
    Kind.INTEGER: np.int64,
    Kind.BINARY: np.bool_,
    Kind.CHOICE: np.object_,
}
"""Of columns of values."""
