"""The constraints designs break, and what relaxing one would buy.

A constraint whose bound is negotiable (a soft limit) can be looked at as a criterion more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.pareto._feasibility import meets_constraints
from pymoo_psi.table._judgement import JudgedRecords
from pymoo_psi.table._layout import Key, Limits
from pymoo_psi.table._limits import limit_vector
from pymoo_psi.table._records import Records

if TYPE_CHECKING:
    import pandas as pd


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Table = TypeVar("Table", bound=Records)


def broken_matrix(table: Records, limits: Limits | None) -> tuple[Mask, tuple[str, ...]]:
    """Return which constraint and limit each design breaks, and their names.

    Returns:
        ``(n, k)`` mask, with a column for each constraint and then for each limit, and k names.
        Rows of failed designs are False: what was not computed breaks nothing.
    """
    chosen = limit_vector(limits, table.layout)
    over = [~(table.F[:, j] <= limit)[:, None] for j, limit in chosen.items()]
    broken = np.hstack([table.broken_constraints, *over])
    broken[table.status == "failed"] = False
    return broken, table.layout.constraints + tuple(table.layout.objectives[j] for j in chosen)


def broken_names(table: Records, limits: Limits | None) -> dict[int, tuple[str, ...]]:
    """Return the names of what each design breaks, for the numbers of those that break any."""
    broken, names = broken_matrix(table, limits)
    rows = np.flatnonzero(broken.any(axis=1))
    patterns, which = _patterns(broken[rows])
    named = [tuple(names[j] for j in np.flatnonzero(pattern)) for pattern in patterns]
    return {
        number: named[k]
        for number, k in zip(table.numbers[rows].tolist(), which.tolist(), strict=True)
    }


def broken_texts(table: Records) -> NDArray[np.object_]:
    """``(n,)`` the names of the constraints each design breaks, joined by commas."""
    broken, names = broken_matrix(table, None)
    patterns, which = _patterns(broken)
    texts = np.empty(len(patterns), dtype=object)
    for k, pattern in enumerate(patterns):
        texts[k] = ", ".join(names[j] for j in np.flatnonzero(pattern))
    result: NDArray[np.object_] = texts[which]
    return result


def cost_of_constraints(table: JudgedRecords, limits: Limits | None) -> pd.DataFrame:
    """Return what each constraint and limit costs; see :meth:`TestTable.constraint_costs`."""
    import pandas as pd

    broken, names = broken_matrix(table, limits)
    layout = table.layout
    bounds = [0.0] * len(layout.inequalities) + [layout.eq_tolerance] * len(layout.equalities)
    bounds += limit_vector(limits, layout).values()
    alone = broken & (broken.sum(axis=1) == 1)[:, None]
    frame = pd.DataFrame(
        {"limit": bounds, "rejects": broken.sum(axis=0), "alone": alone.sum(axis=0)},
        index=pd.Index(names, name="constraint", dtype=object),
    )
    feasible = table.feasible(limits)
    for j, name in enumerate(layout.objectives):
        frame[f"{name}_feasible"] = _best(table.F[feasible, j])
        frame[f"{name}_alone"] = [_best(table.F[column, j]) for column in alone.T]
    return frame.astype({"limit": float})


def constraint_as_criterion(table: Table, name: Key) -> Table:
    """Move a constraint among the criteria; see :meth:`TestTable.with_constraint_as_criterion`."""
    layout, k = table.layout, table.layout.constraint(name)
    j = k - len(layout.inequalities)  # index among the equalities, if not below 0
    value = table.G[:, k] if j < 0 else np.abs(table.H[:, j])
    moved = replace(
        layout,
        objectives=(*layout.objectives, layout.constraints[k]),
        inequalities=layout.inequalities[:k] + layout.inequalities[k + 1 :],
        equalities=layout.equalities
        if j < 0
        else layout.equalities[:j] + layout.equalities[j + 1 :],
    )
    G = np.delete(table.G, k, axis=1) if j < 0 else table.G
    H = table.H if j < 0 else np.delete(table.H, j, axis=1)
    prototype = table.prototype
    if prototype is not None:
        seen = prototype.g[k] if j < 0 else abs(prototype.h[j])
        if np.isnan(seen):
            what, hint = f"{moved.objectives[-1]} of the prototype", "give it with its constraints"
            raise invalid(what, "known", Received("nan"), hint)
        g = np.delete(prototype.g, k) if j < 0 else prototype.g
        h = prototype.h if j < 0 else np.delete(prototype.h, j)
        prototype = replace(prototype, f=np.append(prototype.f, seen), g=g, h=h)
    F = np.column_stack([table.F, value])
    freed = (table.status == "infeasible") & meets_constraints(G, H, layout.eq_tolerance)
    computed = np.isfinite(table.F).all(axis=1)
    status, reasons = table.status.copy(), dict(table.reasons)
    status[freed & computed] = "ok"
    status[freed & ~computed] = "failed"  # feasible now, but its criteria are not known
    for number in table.numbers[freed & ~computed].tolist():
        reasons[number] = f"its criteria are not finite, as it breaks {layout.constraints[k]}"
    return replace(
        table, layout=moved, F=F, G=G, H=H, status=status, reasons=reasons, prototype=prototype
    )


def _patterns(broken: Mask) -> tuple[Mask, NDArray[np.intp]]:
    """Return the distinct rows of a mask, and which of them each row is."""
    packed = np.packbits(broken, axis=1)
    packed = np.pad(packed, ((0, 0), (0, -packed.shape[1] % 8 or (0 if packed.shape[1] else 8))))
    if packed.shape[1] == 8:  # the usual case, at most 64 constraints: compare integers
        _, first, which = np.unique(
            packed.view(np.uint64)[:, 0], return_index=True, return_inverse=True
        )
    else:
        _, first, which = np.unique(packed, axis=0, return_index=True, return_inverse=True)
    return broken[first], which.reshape(-1)


def _best(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else float("nan")
