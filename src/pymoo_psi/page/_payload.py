"""The data of the page: columns, their scales and digits, as JSON can hold them.

Numbers are little-endian float64 in base64, which keeps every digit in a third of a text's length.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from pymoo_psi._numbers import LOG_RANGE, NumberFormat, needs_logarithms
from pymoo_psi._output import with_unit
from pymoo_psi._validation import AnyArray, Array, Mask, Values
from pymoo_psi.pareto import N_WEIGHTS, SENTENCES, enough_digits, nondominated
from pymoo_psi.sequences import lp_tau
from pymoo_psi.table import (
    POINT,
    PROPOSAL_ROUND,
    RUN,
    TEST,
    Decision,
    Kind,
    TestTable,
    added_columns,
    free_name,
    headings_of,
)

# Values farther beyond the first and the last tenth, in units of the distance between these, are
# outliers, perhaps penalties. These are four in ten thousand of an exponential distribution, and
# none of a normal one.
_FENCE = 2.5


def payload(table: TestTable, prototype: TestTable | None, decision: Decision) -> Values:
    """Return the designs and the decision as the page reads them, see ``decode`` in ``data.js``.

    Args:
        table: The designs.
        prototype: Existing designs to compare with; None if there are none.
        decision: The decision that the page opens with.
    """
    schema = table.schema
    names = [*table.names]
    labels = _labels(table)
    tables = [table]
    if prototype is not None:
        for name in prototype.names:
            names.append(free_name(name, names, "existing"))
        labels += _labels(prototype)
        tables.append(prototype)
    optimal = nondominated(table.F)
    columns = _columns(tables, optimal)
    return {
        "normalize": decision.formulation.normalize,
        "decimal": table.decimal,
        "opens_with": _opening(table, decision),
        "sentences": SENTENCES,
        "points": _points(len(schema.objectives) - 1),
        "label": schema.label or TEST,
        "labels": labels,
        "names": names,
        "n": len(table),
        "columns": columns,
        "optimal": _base64(optimal.view(np.uint8)),
        "export": _export(table, columns),
    }


def _opening(table: TestTable, decision: Decision) -> Values:
    """Return a decision on designs as a file, with what the page reads where it is a default."""
    # The commands compute the same columns from the decision files that the page writes.
    formulation = replace(
        decision.formulation,
        objectives=table.schema.objectives,
        maximize=[name for name in table.schema.objectives if name in table.schema.maximize],
        ranges=table.fixed_ranges,
    )
    opening = replace(decision, formulation=formulation).to_dict()
    return {"maximize": [], "normalize": True, "page": {}, **opening}


def _export(table: TestTable, columns: Sequence[Values]) -> Values:
    """Return what the metadata of an export say of its columns (CSVW), and the roles of these."""
    schema = table.schema
    label = schema.label or TEST
    headings = headings_of([label, *(column["name"] for column in columns)], schema.units)
    # What we add is named apart, so that no name of the user's changes.
    place, mark = added_columns([*headings, *headings.values()])
    kind = "string"
    if all(isinstance(one, int) for one in _labels(table)):
        kind = "integer"
    described: list[Values] = [
        {"titles": place, "datatype": "integer"},
        {"titles": label, "datatype": kind},
    ]
    for column in columns:
        entry = {"titles": headings[column["name"]], "datatype": "number"}
        if column["texts"] is not None:
            entry["datatype"] = "string"
        if column["unit"]:
            entry["schema:unitText"] = column["unit"]
        described.append(entry)
    described.append({"titles": mark, "datatype": "string"})
    head = {
        "pymoo_psi_designs": 1,
        "objectives": schema.objectives,
        "maximized": schema.maximize,
        "variables": schema.variables,
        "outputs": schema.outputs,
        "units": schema.units,
    }
    return {"head": head, "columns": described}


def _points(n_dim: int) -> list[str]:
    """Return the first points of the LPτ sequence, times their number, by dimension."""
    if not 1 <= n_dim <= 51:  # the page asks no questions about more objectives
        return []
    points = lp_tau(N_WEIGHTS, n_dim) * N_WEIGHTS
    return [_base64(column.astype(np.uint16)) for column in points.T]


def rows_of(designs: TestTable) -> Values:
    """Return designs as the script adds them to the page, see ``addDesigns`` in ``data.js``."""
    columns = []
    for _, name in roles(designs):
        values = values_of(name, designs)
        if values.dtype == object:
            columns.append(_packed_texts(values))
        else:
            columns.append({"values": _base64(values)})
    return {"names": designs.names, "labels": _labels(designs), "columns": columns}


def _labels(table: TestTable) -> list[Any]:
    """Return the labels of designs: whole numbers or texts."""
    label = table.schema.label
    if label is None:
        return list(table.numbers.tolist())
    labels: list[Any] = []
    for cell in table.column(label).tolist():
        labels.append(cell if type(cell) is int else str(cell))
    return labels


# Columns


def roles(table: TestTable) -> list[tuple[str, str]]:
    """Return role and name of each column, in the order of the page."""
    schema = table.schema
    names_by_role = {
        "objective": schema.objectives,
        "variable": schema.variables,
        "output": (*schema.outputs, *table.schema.notes),
    }
    # Names, and numbers of runs, are no properties of designs.
    left_out = {schema.label, PROPOSAL_ROUND}
    if POINT in table.schema.notes:  # beside the numbers of tests of several runs
        left_out |= {RUN, POINT}
    roles = []
    for role, names in names_by_role.items():
        for name in names:
            if name not in left_out:
                roles.append((role, name))
    return roles


def _columns(tables: Sequence[TestTable], optimal: Mask) -> list[Values]:
    """Return the columns of the page: those of the tables.

    Args:
        tables: The designs, then existing designs if there are any.
        optimal: ``(n,)`` which of the designs are Pareto optimal without limits.
    """
    schema = tables[0].schema
    formats = _formats(tables, optimal)
    columns = []
    for j, (role, name) in enumerate(roles(tables[0])):
        unit = schema.units.get(name, "")
        column: Values = {
            "field": f"c{j}",  # free of the user's characters
            "name": name,
            "label": with_unit(name, unit),
            "unit": unit,
            "role": role,
            "maximize": name in schema.maximize,
        }
        values = values_of(name, *tables)
        if values.dtype == object:
            column |= _packed_texts(values)
        else:
            is_log = schema[name].kind is Kind.LOG
            column |= _packed_numbers(values, optimal, formats[name], log=is_log)
        columns.append(column)
    return columns


def number_formats(table: TestTable, *others: TestTable) -> dict[str, NumberFormat]:
    """Return by name how the numbers of a column are written on the page and in the report.

    Args:
        table: Tests, one or more of them feasible.
        *others: Further designs that are written.
    """
    designs = table.take(table.feasible())
    return _formats([designs, *others], nondominated(designs.F))


def _formats(tables: Sequence[TestTable], optimal: Mask) -> dict[str, NumberFormat]:
    """Return the formats of columns of numbers, see :func:`_columns` for the arguments."""
    designs = tables[0]
    ranges = designs.formulation.ranges or {}
    formats = {}
    for _, name in roles(designs):
        values = values_of(name, *tables)
        if values.dtype != object:
            is_log = designs.schema[name].kind is Kind.LOG
            ends = ranges.get(name, [])  # of a fixed range, which is written, too
            written = _format(np.append(values, ends), optimal, log=is_log)
            formats[name] = replace(written, mark=designs.decimal)
    objectives = [name for name in designs.schema.objectives if name in formats]
    longer = enough_digits(designs.F[optimal], [formats[name] for name in objectives])
    return formats | dict(zip(objectives, longer, strict=True))


def values_of(name: str, *tables: TestTable) -> AnyArray:
    """Return the ``(n,)`` numbers or texts of a column, of one table after another.

    Where a table lacks the column they are NaN or empty. The first table says which they are.
    """
    parts = []
    for table in tables:
        if name in table.columns:
            parts.append(table.column(name))
        else:
            parts.append(np.full(len(table), np.nan))
    column = np.concatenate(parts)
    first = tables[0]
    if first.schema[name].kind is Kind.CHOICE:
        texts = pd.Series(column, dtype=object)
        return np.array(texts.where(texts.notna(), "").map(str), dtype=object)
    return column.astype(np.float64)


def _packed_texts(cells: AnyArray) -> Values:
    """Return ``(n,)`` texts as the payload has them: the different ones, and the place of each."""
    texts, places = np.unique(cells.astype(str), return_inverse=True)
    return {"texts": texts.tolist(), "values": _base64(places.astype(np.float64))}


def _packed_numbers(
    values: Array, optimal: Mask, number_format: NumberFormat, *, log: bool
) -> Values:
    """Return the numbers of a column as the payload has them, with their scale and format.

    Args:
        values: ``(n + k,)`` numbers of the designs, then those of existing designs.
        optimal: ``(n,)`` which designs are Pareto optimal.
        number_format: How the numbers are written.
        log: Whether the column is a logarithmic variable.
    """
    low, high, crowded = scale_of(_finite_and_optimal(values, optimal))
    least, most = _ends(without_outliers(values[np.isfinite(values)]))
    return {
        "texts": None,
        "values": _base64(values),
        "notation": number_format.pattern,
        "axis": [min(low, least), max(high, most)],
        "log": crowded or (log and low > 0),
    }


def _format(values: Array, optimal: Mask, *, log: bool) -> NumberFormat:
    """Return how the numbers of a column are written."""
    optimal_values = _finite_and_optimal(values, optimal)
    low, high, _ = scale_of(optimal_values)
    if log and high > LOG_RANGE * low:  # digits in each decade
        return NumberFormat(2, has_powers=True)
    near = optimal_values[(optimal_values >= low) & (optimal_values <= high)]
    return NumberFormat.of(values, near)


def _finite_and_optimal(values: Array, optimal: Mask) -> Array:
    """Return the finite values of the Pareto-optimal designs."""
    optimal_values = values[: len(optimal)][optimal]
    return np.asarray(optimal_values[np.isfinite(optimal_values)])


def _ends(values: Array) -> tuple[float, float]:
    """Return the least and the greatest value as Python's floats, which overflow silently."""
    if len(values) == 0:
        return 0.0, 0.0
    return float(values.min()), float(values.max())


def scale_of(values: Array) -> tuple[float, float, bool]:
    """Return the ends of an axis without outliers, and whether it should be logarithmic.

    Args:
        values: ``(n,)`` finite values.
    """
    inside = without_outliers(values)
    return *_ends(inside), needs_logarithms(inside)


def without_outliers(values: Array) -> Array:
    """Return the ``(n,)`` values without those that are far beyond the first and last tenth."""
    measured = values
    if len(values) == 0:
        return values
    # Values over decades are measured by their logarithms: of 1, 10, …, 1e6 none is an outlier.
    if values.min() > 0 and np.quantile(values, 0.75) / 10 > np.quantile(values, 0.25):
        measured = np.log(values)
    # Python's floats, which overflow silently: then no value is an outlier.
    first, last = np.quantile(measured, [0.1, 0.9]).tolist()
    reach = _FENCE * (last - first)
    if reach == 0:  # most of the values are equal
        return values
    inside = (measured >= first - reach) & (measured <= last + reach)
    return np.asarray(values[inside])


def _base64(values: AnyArray) -> str:
    little_endian = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return b64encode(little_endian.tobytes()).decode("ascii")
