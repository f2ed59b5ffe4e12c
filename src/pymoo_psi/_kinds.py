"""The kinds of variables and columns, in pymoo's words, and what tells their values apart."""

import json
from collections.abc import Collection, Iterable, Sequence
from decimal import Decimal
from enum import Enum
from hashlib import blake2b
from typing import Any

import numpy as np

from pymoo_psi._validation import AnyArray, Rows, known_name


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
# By the exact type of a cell, since True is an int for isinstance.
_KIND_OF_TYPE = {float: Kind.REAL, int: Kind.INTEGER, bool: Kind.BINARY}


def plain(value: Any) -> Any:
    """Return a value of a design as Python's own bool, int, float or str; others as they are."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Decimal):  # of a database
        return float(value)
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            return kind(value)
    return value


def is_of_kind(cell: Any, kind: Kind) -> bool:
    """Whether a cell is of the type of a kind, or a number that is equal to one of it."""
    kind_of_cell = _KIND_OF_TYPE.get(type(cell), Kind.CHOICE)
    if kind in (kind_of_cell, Kind.CHOICE):
        return True
    if kind_of_cell not in (Kind.REAL, Kind.INTEGER):
        return False
    if kind.real:
        return bool(float(cell) == cell)
    if kind is Kind.INTEGER:
        return bool(cell == cell // 1)
    return cell in (0, 1)


def kind_of_cells(array: AnyArray) -> Kind:
    """Return the kind that ``(n,)`` cells show; cells of several types are those of a choice."""
    sample = array
    if array.dtype != object:  # all are of one type
        sample = array[:1]
    types = {type(plain(cell)) for cell in sample.tolist()} or {float}
    if len(types) > 1:
        return Kind.CHOICE
    return _KIND_OF_TYPE.get(types.pop(), Kind.CHOICE)


def first_of(keys: Iterable[Any]) -> Rows:
    """Return ``(n,)`` the index of the first of n keys that is equal to each."""
    index_by_key: dict[Any, int] = {}
    return np.array([index_by_key.setdefault(key, i) for i, key in enumerate(keys)], dtype=np.intp)


def matrix_of(columns: Sequence[AnyArray], n: int) -> AnyArray:
    """Return columns of n cells as a matrix: of their type, of objects if their types differ."""
    dtypes = {cells.dtype for cells in columns} or {np.dtype(np.float64)}
    dtype = dtypes.pop() if len(dtypes) == 1 else np.dtype(object)
    # A matrix of objects has Python's own int, float and bool, as one would write such a design.
    matrix = np.empty((n, len(columns)), dtype)
    for j, cells in enumerate(columns):
        matrix[:, j] = cells
    return matrix


def keys_of_designs(columns: Sequence[AnyArray], kinds: Sequence[Kind]) -> list[str]:
    """Return a key for each of n designs, which is that of no other design, in files too.

    It tells 12, "12", 12.0 and True apart, as a model can; 0.0 and -0.0 are one number.

    Args:
        columns: ``(n,)`` values of each variable; choices as the texts of :func:`option_text`.
        kinds: The kind of each variable.
    """
    numbers = []
    texts = []
    for column, kind in zip(columns, kinds, strict=True):
        if kind is Kind.CHOICE:
            texts.append(column.tolist())
            continue
        cells = column.astype(DTYPES[kind])
        if kind.real:
            cells[np.isnan(cells)] = np.nan  # one of the many
            cells += 0.0  # no -0.0
        elif kind is Kind.BINARY:
            cells = cells.astype(np.int64)
        numbers.append(cells.view(np.int64))
    n = max(map(len, columns), default=0)
    cells = np.column_stack([np.zeros((n, 0), np.int64), *numbers]).astype("<i8")
    rows = [row.tobytes() for row in cells]
    if texts:
        choices = map(json.dumps, zip(*texts, strict=True))
        rows = [row + text.encode() for row, text in zip(rows, choices, strict=True)]
    return [blake2b(row, digest_size=16).hexdigest() for row in rows]


def option_text(option: Any) -> str:
    """Return an option of a choice as the text that files and studies have for it.

    An option that is text stays as it is unless it could be taken for JSON; all others are JSON:
    ``oak``, ``"12"``, ``12``, ``12.0``, ``true``.
    """
    option = plain(option)
    # The types matter: a choice of 12 is another option than one of "12", and must come back so.
    if isinstance(option, str) and option_of(option) is option:
        return option
    return json.dumps(option, ensure_ascii=False, default=str)


def option_of(text: str) -> Any:
    """Return the option that has a text: what the text is in JSON, or the text itself."""
    try:
        # Python's JSON also has NaN and Infinity: as options they are put in quotation marks.
        return json.loads(text)
    except (TypeError, ValueError, RecursionError):  # nothing is no text
        return text


def named_option(place: str, text: str, options: Collection[str]) -> str:
    """Return the option that a text names, of the texts of some options.

    The text is that of :func:`option_text`, or what one option alone is printed as.
    """
    if text not in options:
        printed = str(option_of(text))
        matches = [option for option in options if str(option_of(option)) == printed]
        if len(matches) == 1:
            return matches[0]
    return known_name(place, text, options)
