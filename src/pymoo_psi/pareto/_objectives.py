"""Objectives as the user has them: with names and senses, an array or a data frame."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import (
    Received,
    collection,
    finite_array,
    integer,
    invalid,
    known_name,
    objective_matrix,
)
from pymoo_psi.errors import ArgumentTypeError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Objectives:
    """The objective values of n designs in the user's own sense and under the user's own names.

    Attributes:
        values: ``(n, m)`` finite objective values as given; a copy of its own.
        sign: ``(m,)`` 1 for an objective to be minimised, -1 for one to be maximised.
        names: The m column names of a data frame; f1, f2, … for an array.
        labels: The row labels of a data frame; 0, 1, … for an array.
    """

    values: Array
    sign: Array
    names: tuple[Any, ...]
    labels: Any

    @classmethod
    def of(cls, F: Any, maximize: Collection[Any] = ()) -> Objectives:
        """Check and keep objective values.

        Args:
            F: ``(n, m)`` array or data frame, n, m >= 1.
            maximize: Which are to be maximised: column indices from 0 or, of a data frame, names.

        Raises:
            ArgumentValueError: The values are not finite, or there is no such objective.
            ArgumentTypeError: The values are not real numbers, or ``maximize`` is no collection.
        """
        names: tuple[Any, ...] | None = None
        labels: Any = None
        # A data frame by what it offers, so that arrays do not pay for importing pandas.
        if hasattr(F, "columns") and hasattr(F, "index") and hasattr(F, "to_numpy"):
            names, labels = tuple(F.columns), F.index
            F = _numbers(F)
        values = objective_matrix("F", F).copy()
        n, m = values.shape
        collection("maximize", maximize, "a list of objectives", "one goes into a list too")
        sign = np.ones(m)
        sign[[_column("maximize", entry, m, names) for entry in maximize]] = -1.0
        if names is None:
            names, labels = tuple(f"f{j + 1}" for j in range(m)), range(n)
        return cls(values, sign, names, labels)

    @property
    def minimized(self) -> Array:
        """``(n, m)`` the values with the sign of those to be maximised turned."""
        return self.values * self.sign

    def in_users_sense(self, values: Array) -> Array:
        """Return ``(..., m)`` values in the sense of :attr:`minimized` in the user's own."""
        turned: Array = values * self.sign + 0.0  # no -0.0
        return turned

    def headings(self, units: Mapping[Any, str]) -> list[str]:
        """Return the names for readers, each with its unit, and "(max)" if more is better."""
        pairs = zip(self.names, self.sign.tolist(), strict=True)
        return [
            f"{name}{f' [{units[name]}]' if units.get(name) else ''}{' (max)' if sign < 0 else ''}"
            for name, sign in pairs
        ]

    def column(self, argument: str, entry: Any) -> int:
        """Return the index of an objective that an argument gives by name or index."""
        return _column(argument, entry, len(self.names), self.names)

    def rows(self, indices: NDArray[np.intp]) -> Objectives:
        """Return the same objectives of some of the designs."""
        labels = [self.labels[i] for i in indices.tolist()]
        return Objectives(self.values[indices], self.sign, self.names, labels)

    def turned(self, name: str, value: ArrayLike) -> Array:
        """Return a point given in the user's sense in that of :attr:`minimized`."""
        point = finite_array(name, value)
        if point.shape != self.sign.shape:
            rule = f"of shape {self.sign.shape}"
            raise invalid(name, rule, Received(f"shape {point.shape}"))
        return point * self.sign


def _numbers(frame: Any) -> Array:
    """Return the values of a data frame; a missing value is NaN."""
    for name, dtype in zip(frame.columns, frame.dtypes, strict=True):
        # Nothing is converted: text, dates and objects are no numbers until the user says so.
        if getattr(dtype, "kind", "O") not in "fiub":
            raise ArgumentTypeError(
                f"column {name!r} of F must hold real numbers, got dtype {dtype}; "
                f"give F[[...]], the columns that are objectives; names of the designs are "
                f"labels by F.set_index({name!r})"
            )
    values: Array = frame.to_numpy(dtype=np.float64, na_value=np.nan)
    return values


def _column(argument: str, entry: Any, m: int, names: Sequence[Any] | None) -> int:
    """Return the index of an objective; a name goes before an index."""
    if names is not None and entry in names:
        if names.count(entry) > 1:
            raise invalid(argument, "names that only one column has", entry)
        return names.index(entry)
    if isinstance(entry, str):
        if names is None:
            remedy = "name objectives only where F is a data frame"
            raise invalid(argument, f"column indices from 0 to {m - 1}", entry, remedy)
        known_name(argument, entry, [name for name in names if isinstance(name, str)])
    column = integer(argument, entry, minimum=0)
    if column >= m:
        raise invalid(argument, f"column indices from 0 to {m - 1}", column)
    return column
