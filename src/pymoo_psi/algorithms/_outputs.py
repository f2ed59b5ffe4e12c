"""From the values of designs to their tests, with what else the model gives."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.algorithms._points import Points
from pymoo_psi.parallel import Values
from pymoo_psi.table import RESERVED, Layout, TestTable, is_writable

# What pymoo knows by itself and its users put beside the outputs of a model; and our reasons.
NO_OUTPUTS = {
    *("F", "G", "H", "dF", "dG", "dH", "ddF", "ddG", "ddH", "CV", "cv", "feas", "X", "hash"),
    "failure",
}

PROPOSAL_ROUND = "proposal_round"
"""Name of the output that tells points of the sequence, 0, from proposals, by their round."""


def table_of_values(layout: Layout, points: Points, X: Any, out: Mapping[str, Any]) -> TestTable:
    """Return the tests of n designs with all numbers that the model gave.

    What is no single number for any design, or has the name of another column, is left out with a
    warning: the values of the other columns count, and a run is not to end for it. What is one for
    some designs stays theirs, whatever others of the same block have.

    Args:
        layout: The columns that the problem promises.
        points: The n points that they are of.
        X: ``(n, n_var)`` the designs.
        out: Their values, as :func:`evaluate_designs` returns them.
    """
    numbers = points.numbers
    if points.rounds is not None:
        # First, whatever the first design gives; a repeated design has the round of its own point.
        out = {PROPOSAL_ROUND: None} | dict(out) | {PROPOSAL_ROUND: points.rounds}
    reasons = {n: r for n, r in zip(numbers.tolist(), out["failure"], strict=True) if r}
    failed = np.isin(numbers, list(reasons)) if reasons else np.zeros(len(numbers), dtype=bool)
    taken = {*layout.columns, *RESERVED}
    outputs = {}
    for name, values in out.items():
        if name in NO_OUTPUTS or (isinstance(name, str) and name.startswith("__")):
            continue
        column = np.asarray(values)
        if column.shape == (len(numbers), 1):
            column = column[:, 0]
        if column.shape == numbers.shape and column.dtype == object:
            column = _numbers(name, column)
        problem = ""
        if not isinstance(name, str) or not name.strip() or not is_writable(name):
            problem = "its name is no text that a file can hold"
        elif column.shape != numbers.shape or column.dtype.kind not in "fiub":
            problem = (
                "it is not one number for each design; give its parts names of their own, such as "
                f"out['{name}1']"
            )
        elif name in taken:
            problem = "another column has that name; give it another one in the model"
        if problem:
            warnings.warn(f"out[{name!r}] is not kept in the table: {problem}", stacklevel=2)
        else:
            outputs[name] = np.where(failed, np.nan, column.astype(np.float64))
    table = TestTable.of(
        numbers, X, out["F"], out["G"], out["H"], outputs=outputs, reasons=reasons, layout=layout
    )
    unknown = [name for name in layout.units if name not in table.layout.columns]
    if unknown and not failed.all():
        columns = ", ".join(table.layout.columns)
        warnings.warn(f"units names {unknown[0]!r}, but the columns are {columns}", stacklevel=2)
    return table


def values_of_table(tests: TestTable) -> list[Values]:
    """Return the values of each test as its evaluation has given them."""
    names = ("F", "G", "H", *tests.layout.outputs, "failure")
    reasons = [tests.reasons.get(number, "") for number in tests.numbers.tolist()]
    rows = zip(tests.F, tests.G, tests.H, *tests.outputs.T.tolist(), reasons, strict=True)
    return [dict(zip(names, row, strict=True)) for row in rows]


def _numbers(name: Any, cells: NDArray[Any]) -> NDArray[Any]:
    """Return the numbers among values of designs, NaN for others; the values if there is none."""
    found = np.full(len(cells), np.nan)
    known = np.zeros(len(cells), dtype=bool)
    for i, cell in enumerate(cells):
        if isinstance(cell, (int, float, np.generic, np.ndarray)):
            value = np.asarray(cell)
            if value.size == 1 and value.dtype.kind in "fiub":
                found[i], known[i] = value.item(), True
    if not known.any():
        return cells
    for cell in cells[~known]:
        if cell is not None:
            rule = "is not kept in the table where it is no single number, such as"
            warnings.warn(f"out[{name!r}] {rule} {cell!r:.40}", stacklevel=3)
            break
    return found
