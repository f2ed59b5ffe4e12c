"""The designs of a table: their names, their ranking, and how sure it is."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._validation import Array, Received, Rows, counted, invalid
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import (
    EfficiencyRanking,
    Objectives,
    probabilities,
    ranking_of,
    row_of_design,
    unique_names,
)
from pymoo_psi.table._cells import blank
from pymoo_psi.table._schema import N_TESTS, POINT, RUN, TEST, error_column
from pymoo_psi.table._view import View

if TYPE_CHECKING:
    import pandas as pd

# Names: labels, or otherwise the numbers of tests


def names_of_designs(table: View) -> list[str]:
    """Return the unique names of the n designs; see :attr:`TestTable.names`."""
    word = (table.schema.label or TEST).replace("_", " ")
    names = []
    for label in map(str, _labels(table)):
        if _is_value(label):
            label = f"{word} {label}"
        names.append(label)
    return unique_names(names, table.numbers.tolist())


def row_named(table: View, names: list[str], design: int | str) -> int:
    """Return the row of a design by its number, label or one of the names of the designs.

    Raises:
        ArgumentValueError: It names no design, or several.
        ArgumentTypeError: It is neither a whole number nor a text.
    """
    numbers = table.numbers.tolist()
    if table.schema.label is None:
        short = [name.removeprefix(f"{TEST} ") for name in names]  # a command takes 2.5
        return row_of_design(design, numbers, names, numbers, short)
    labels = list(map(str, _labels(table)))
    # Where labels are numbers, one that is none of them is more likely a mistake.
    if any(map(_is_value, labels)) and labels != list(map(str, numbers)):
        numbers = []
    return row_of_design(design, numbers, names, labels, numbers)


def _labels(table: View) -> list[Any]:
    """Return the cells of the column that names the designs, or else the numbers of tests."""
    labels: list[Any] = table.numbers.tolist()
    if table.schema.label is not None:
        cells = table.column(table.schema.label)
        are_empty = blank(cells)
        for row, cell in enumerate(cells.tolist()):
            labels[row] = f"{TEST} {labels[row]}" if are_empty[row] else cell
    elif {RUN, POINT} <= {*table.schema.notes}:
        places = zip(table.column(RUN), table.column(POINT), strict=True)
        for row, (run, point) in enumerate(places):
            if str(run) != "1":
                labels[row] = f"{TEST} {run}.{point}"
    return labels


def _is_value(label: str) -> bool:
    """Whether a label alone would be taken for a value: 7, 1.5, -2."""
    return re.fullmatch(r"[-+−]?\d*[.,]?\d+(?:[eE][-+]?\d+)?", label) is not None


# Rankings


def ranking_of_rows(table: View, rows: Rows, labels: Any) -> EfficiencyRanking:
    """Return the ranking of some feasible rows of a table.

    Args:
        table: The table.
        rows: ``(n,)`` the rows.
        labels: ``(n,)`` what they are called.

    Raises:
        ArgumentValueError: There is no row.
    """
    if len(rows) == 0:
        raise none_feasible(table)
    schema = table.schema
    F = Objectives.of(table.F[rows]).values * schema.sign + 0.0  # no -0.0
    numbers = table.numbers[rows].tolist()
    objectives = Objectives(
        F, schema.sign, schema.objectives, labels, numbers, schema.units, table.decimal
    )
    ends: dict[str, Array] = {}
    if table.fixed_ranges:
        low, high = np.array([table.fixed_ranges[name] for name in schema.objectives]).T
        ends["ideal"] = np.where(schema.sign > 0, low, high)
        ends["nadir"] = np.where(schema.sign > 0, high, low)
    normalize = table.formulation.normalize
    return ranking_of(objectives, table.pareto()[rows], rows, normalize=normalize, **ends)


def none_feasible(table: View) -> ArgumentValueError:
    """Return the error of a table without a feasible design."""
    words = table.schema.words
    size = counted(len(table), words["row"])
    return ArgumentValueError(
        f"none of {size} is feasible ({table.failed().sum()} {words['failed']}); "
        "loosen the limits, test more points, or see the reasons of failures"
    )


def confidence_frame(table: View, ranking: EfficiencyRanking) -> pd.DataFrame:
    """Return how probable it is that each design is the best; see :meth:`TestTable.confidence`.

    Args:
        table: The table.
        ranking: The ranking of its feasible designs.
    """
    import pandas as pd

    objectives = table.schema.objectives
    names = list(map(error_column, objectives))
    if not has_errors(table):
        rule = f"one with the standard errors in columns {', '.join(map(repr, names))}"
        remedy = "average tests by pymoo_psi.analysis.average_repeats(table, label)"
        raise invalid("the table", rule, Received("none"), remedy)
    errors = np.column_stack([table.column(name)[ranking.rows] for name in names])
    counts = None
    if N_TESTS in table.schema.outputs:
        counts = table.column(N_TESTS)[ranking.rows]
    expected, shares = probabilities(ranking, errors, counts)
    frame = pd.DataFrame(expected, list(ranking.objectives.labels), list(objectives))
    frame[["pareto", "best", "near_best"]] = shares
    return frame


def has_errors(table: View) -> bool:
    """Whether the feasible designs have a standard error of each objective."""
    names = list(map(error_column, table.schema.objectives))
    if not {*names} <= {*table.schema.outputs}:
        return False
    designs = table.feasible()
    return all(np.isfinite(table.column(name)[designs]).all() for name in names)
