"""A prototype given to a table, and what the designs of the table gain on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import Received, invalid, real_array
from pymoo_psi.table._designs import column_kinds, design_row
from pymoo_psi.table._judgement import JudgedRecords
from pymoo_psi.table._layout import Limits
from pymoo_psi.table._prototype import Prototype
from pymoo_psi.table._records import Records

if TYPE_CHECKING:
    import pandas as pd


def make_prototype(
    table: Records, name: str, x: Any, f: ArrayLike, g: ArrayLike | None, h: ArrayLike | None
) -> Prototype:
    """Return the prototype; constraints that are not given are not known."""
    layout, kinds = table.layout, column_kinds(table.X) if len(table) else ()
    unknown_g, unknown_h = (
        np.full(len(n), np.nan) for n in (layout.inequalities, layout.equalities)
    )
    values = (
        real_array("f of the prototype", f),
        unknown_g if g is None else real_array("g of the prototype", g),
        unknown_h if h is None else real_array("h of the prototype", h),
    )
    x = design_row("x of the prototype", x, layout.variables, kinds)
    return Prototype(name, x, *values).checked(layout)


def comparison_with_prototype(table: JudgedRecords, limits: Limits | None) -> pd.DataFrame:
    """Return what the Pareto-optimal designs gain on the prototype, the best first."""
    import pandas as pd

    if table.prototype is None:
        raise invalid(
            "the table", "one with a prototype", Received("none"), "give it by with_prototype(x, f)"
        )
    pareto = table.pareto(limits)
    names, F = table.layout.objectives, table.F[pareto]
    gain = table.prototype.f - F
    better = (gain > 0).sum(axis=1)
    dominates = (gain >= 0).all(axis=1) & (better > 0)
    frame = pd.DataFrame(
        F, columns=list(names), index=pd.Index(table.numbers[pareto], name="test_point")
    )
    frame[[f"gain_{name}" for name in names]] = gain
    frame["better_in"], frame["dominates"] = better, dominates
    frame["better_in_all"] = better == len(names)
    return frame.iloc[np.lexsort((frame.index.to_numpy(), -better, ~dominates))]
