"""The kinds of variables and columns, in pymoo's words."""

from enum import Enum


class Kind(str, Enum):
    """What a variable is, and with it what a column of its values holds.

    Example:
        >>> Kind("real") is Kind.REAL, Kind.CHOICE == "choice"
        (True, True)
    """

    REAL = "real"
    """A float64."""
    INTEGER = "integer"
    """An int64."""
    BINARY = "binary"
    """A bool."""
    CHOICE = "choice"
    """One of some options: texts, or values of several types."""
