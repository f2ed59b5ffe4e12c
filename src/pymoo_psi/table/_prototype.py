"""The prototype: an existing design, carried along to see what the investigation gains on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, finite_array, invalid, real_array, wrong_type
from pymoo_psi.table._designs import design_row
from pymoo_psi.table._formulation import Formulation, formulated
from pymoo_psi.table._layout import Layout, is_writable

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Prototype:
    """An existing design.

    Attributes:
        name: What it is called.
        x: ``(n_var,)`` its variables; they may lie outside the box.
        f: ``(m,)`` its criteria, finite, each in its own sense.
        g: ``(n_ieq,)`` its inequality constraints; NaN where not known.
        h: ``(n_eq,)`` its equality constraints; NaN where not known.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1], [[0.0]], [[1.0]], G=[[-1.0]]).with_prototype([0.3], [3.0])
        >>> table.prototype.f, table.prototype.g  # its constraint was not said
        (array([3.]), array([nan]))
    """

    name: str
    x: NDArray[Any]
    f: Array
    g: Array
    h: Array

    def checked(self, layout: Layout) -> Prototype:
        """Return the prototype with read-only arrays that fit the layout."""
        if not isinstance(self.name, str) or not is_writable(self.name):
            raise wrong_type("the prototype's name", "Unicode text", self.name)
        arrays: dict[str, NDArray[Any]] = {
            "x": design_row("x of the prototype", self.x, layout.variables),
            "f": finite_array("f of the prototype", self.f).copy(),
            "g": real_array("g of the prototype", self.g).copy(),
            "h": real_array("h of the prototype", self.h).copy(),
        }
        groups = {"f": layout.objectives, "g": layout.inequalities, "h": layout.equalities}
        for letter, names in groups.items():
            if arrays[letter].shape != (len(names),):
                rule = f"of shape {(len(names),)}"
                found = Received(f"shape {arrays[letter].shape}")
                raise invalid(f"{letter} of the prototype", rule, found)
        for array in arrays.values():
            array.setflags(write=False)
        return Prototype(self.name, **arrays)

    def under(self, formulation: Formulation, layout: Layout) -> Prototype:
        """Return the prototype of a table of this layout under another formulation.

        Raises:
            ArgumentValueError: A criterion is not known.
        """
        groups = (layout.variables, layout.objectives, layout.inequalities, layout.equalities)
        columns: dict[str, NDArray[Any]] = dict.fromkeys(layout.outputs, np.array([np.nan]))
        for letter, names in zip("xfgh", groups, strict=True):
            values = getattr(self, letter)
            columns |= {name: values[j : j + 1] for j, name in enumerate(names)}
        asked, columns = formulated(formulation, layout, columns)
        for name in asked.objectives:
            if not np.isfinite(columns[name][0]):
                remedy = "give the prototype with its constraints, or after under()"
                rule, found = f"{name} of the prototype", Received(f"{columns[name][0]}")
                raise invalid(rule, "known and finite", found, remedy)
        f, g, h = (
            np.array([columns[name][0] for name in names], dtype=np.float64)
            for names in (asked.objectives, asked.inequalities, asked.equalities)
        )
        return Prototype(self.name, self.x, f, g, h).checked(asked)

    def same_as(self, other: Prototype) -> bool:
        """Say whether another prototype has the same name and values."""
        # By repr NaN, not known, is equal to NaN, and 1, 1.0 and True are different values.
        return self.name == other.name and all(
            [repr(v) for v in getattr(self, letter).tolist()]
            == [repr(v) for v in getattr(other, letter).tolist()]
            for letter in "xfgh"
        )
