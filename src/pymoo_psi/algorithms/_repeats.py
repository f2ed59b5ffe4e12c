"""Designs that occur again: each is evaluated once, and its later tests take the known result."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from pymoo_psi.algorithms._outputs import values_of_table
from pymoo_psi.parallel import Values
from pymoo_psi.table import TestTable, design_keys

_Key = tuple[str, ...]


class Repeats:
    """The results of a run by design, for variables of which none is real.

    Attributes:
        learned: The values of every design that is known.
    """

    def __init__(self) -> None:
        self.learned: dict[_Key, Values] = {}
        self.forget()

    def forget(self) -> None:
        """Forget what is under way."""
        self._first: dict[_Key, int] = {}
        self._under_way: dict[int, tuple[_Key, list[int]]] = {}

    def learn(self, tests: TestTable) -> None:
        """Take the results of tests from a study."""
        for key, values in zip(design_keys(tests.X), values_of_table(tests), strict=True):
            self.learned.setdefault(key, values)

    def met(self, rows: list[int], X: NDArray[Any]) -> tuple[list[int], list[tuple[int, Values]]]:
        """Return which points are to be evaluated, and those whose values are known.

        The others are given by :meth:`arrived` when the point with the same design has arrived.

        Args:
            rows: ``k`` indices of points.
            X: ``(k, n_var)`` their designs.
        """
        new, known = [], []
        for i, key in zip(rows, design_keys(X), strict=True):
            if key in self.learned:
                known.append((i, self.learned[key]))
            elif key in self._first:
                self._under_way[self._first[key]][1].append(i)
            else:
                self._first[key] = i
                self._under_way[i] = key, []
                new.append(i)
        return new, known

    def arrived(self, row: int, values: Values) -> list[int]:
        """Learn the values of a point; return the points that waited for them."""
        key, others = self._under_way.pop(row)
        del self._first[key]
        self.learned[key] = values
        return others
