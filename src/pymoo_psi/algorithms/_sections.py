"""Sections through a design: each objective along each variable, from surrogates of the tests.

They are the graphs of criteria against parameters of Parameter Space Investigation, without an
evaluation: the points of a sequence do not lie on lines through a design, and surrogates do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import AnyArray, Array, Received, integer, invalid, known_names
from pymoo_psi.algorithms._surrogate_models import (
    REACH,
    GaussianProcess,
    OutputFit,
    bounded,
    encoded,
)
from pymoo_psi.problems import DesignSpace, Variable
from pymoo_psi.table import PROPOSAL_ROUND, TestTable, value_ranks

_LEAST_TESTS = 8
_NEAREST = 512  # tests from which a section is predicted: more take seconds, and change little
_DEVIATIONS = 2.0  # half of the width of a band, which holds 95 % of a normal distribution


def sections(
    table: TestTable,
    design: int | str | None = None,
    *,
    row: int | None = None,
    columns: Sequence[str] | None = None,
    n_values: int = 33,
) -> pd.DataFrame:
    """Predict by surrogates how objectives change with one variable of a design.

    For each column a Gaussian process is fitted to the tests, as in :class:`SurrogatePSI`, and
    predicts along lines through the design within the bounds. The model does not run. The band is
    narrow near tested designs and wide where tests follow no pattern.

    Args:
        table: Tests. Those that failed do not count, nor those that are outside the bounds by more
            than their width; infeasible ones do.
        design: The number of its test, or its label; by default the chosen design, or the
            Salukvadze optimum if none is chosen.
        row: Its row in the table, from 0, instead of ``design``.
        columns: Objectives, constraints or outputs; the objectives unless given.
        n_values: Number of values of a variable that is real.

    Returns:
        A frame with the columns ``column``, ``variable``, ``value`` of the variable, ``design``,
        its value in the design, ``expected``, and the band from ``lower`` to ``upper``, two
        standard deviations to both sides, in the original units and direction. ``error`` is the
        error of predicting each test from all others, in standard deviations of the column: near 0
        the section is reliable, near 1 it says nothing.

    Raises:
        ArgumentValueError: There are no variables, there are fewer than 8 tests, a column or
            design is unknown, or the design is far outside the bounds.

    Example:
        >>> from pymoo_psi import SphereChute, PSI
        >>> from pymoo.optimize import minimize
        >>> table = minimize(SphereChute(0.4), PSI(64)).algorithm.table
        >>> frame = sections(table, columns=["f1"])
        >>> frame.groupby("variable")["expected"].agg(["min", "max"]).round(1).rename_axis(None)
            min  max
        x1  1.8  4.2
        x2  1.8  2.2
    """
    integer("n_values", n_values, minimum=2)
    schema = table.schema
    if not schema.variables:
        raise invalid("the variables of the table", "one or more", Received("none"))
    if columns is None:
        columns = schema.objectives
    known_names("columns", columns, [*schema.objectives, *schema.constraints, *schema.outputs])
    row = _row_of(table, design, row)
    space = space_of_table(table)
    is_near = space.are_near(table.X, REACH)
    if not is_near[row]:
        rule = "within the bounds, or at most their width outside"
        raise invalid("the design of sections", rule, Received(table.names[row]))
    Z = encoded(space, space.places(table.X))
    Z[~is_near] = np.nan
    lines = _lines(space, table.X[row], n_values)
    frames = []
    with threadpool_limits(limits=1, user_api="blas"):
        for name in columns:
            frames += _sections_of(table, name, Z, row, lines)
    sections = pd.concat(frames, ignore_index=True)
    sections.attrs["units"] = dict(schema.units)
    sections.attrs["decimal"] = table.decimal
    return sections


def _lines(
    space: DesignSpace, design: AnyArray, n_values: int
) -> dict[str, tuple[AnyArray, Array]]:
    """Return lines through a design along each variable; see :func:`_sections_of`."""
    lines = {}
    for j, variable in enumerate(space.variables):
        values = _values(variable, n_values)
        line = np.repeat(design[None], len(values), axis=0)
        line[:, j] = values
        lines[variable.name] = values, encoded(space, space.places(line))
    return lines


def _sections_of(
    table: TestTable, name: str, Z: Array, row: int, lines: Mapping[str, tuple[AnyArray, Array]]
) -> list[pd.DataFrame]:
    """Return the sections of a column, one for each variable.

    Args:
        table: The tests.
        name: The column.
        Z: ``(n, d)`` the tests as surrogates see them.
        row: The row of the design.
        lines: For each variable its values, and the designs on the line as surrogates see them.
    """
    # Minimised: on a logarithmic scale, the best values are finest.
    sign = -1.0 if name in table.schema.maximize else 1.0
    fit, process = _surrogate(table, name, sign, Z, row)
    frames = []
    for (variable, (values, Z_line)), value in zip(lines.items(), table.X[row], strict=True):
        expected, *ends = sign * _predicted(fit, process, Z_line)
        section = {
            "column": name,
            "variable": variable,
            "value": values,
            "design": [value] * len(values),
            "expected": expected,
            "lower": np.min(ends, axis=0),
            "upper": np.max(ends, axis=0),
            "error": fit.error,
        }
        frames.append(pd.DataFrame(section))
    return frames


def _row_of(table: TestTable, design: int | str | None, row: int | None) -> int:
    """Return a row of a table, that of a design, the chosen one, or the Salukvadze optimum."""
    if row is not None:
        if integer("row", row, minimum=0) >= len(table):
            raise invalid("row", f"a row of the table, from 0 to {len(table) - 1}", row)
        return row
    if design is None:
        design = table.decision.chosen
    if design is None:
        design = int(table.best().numbers[0])
    return table.row_of(design)


def _surrogate(
    table: TestTable, name: str, sign: float, Z: Array, row: int
) -> tuple[OutputFit, GaussianProcess]:
    """Return the surrogate of a column near a design.

    Args:
        table: The tests.
        name: The column.
        sign: -1 to learn the negative of it.
        Z: ``(n, d)`` the tests as surrogates see them.
        row: The row of the design.
    """
    y = sign * np.asarray(table.column(name), dtype=float)
    is_usable = (table.status != "failed") & np.isfinite(Z).all(axis=1) & np.isfinite(y)
    n_usable = np.count_nonzero(is_usable)
    if n_usable < _LEAST_TESTS:
        rule = f"{_LEAST_TESTS} or more with a value of {name!r}"
        raise invalid("the tests of sections", rule, Received(f"{n_usable}"))
    is_even = np.full(n_usable, True)
    if PROPOSAL_ROUND in table.schema.outputs:
        is_even = table.column(PROPOSAL_ROUND)[is_usable] == 0
    if is_even.sum() < _LEAST_TESTS:
        is_even[:] = True
    y = bounded(y[is_usable, None])[:, 0]
    Z_usable = Z[is_usable]
    constraint = name in table.schema.constraints and bool((y < 0).any())
    fit = OutputFit.of(Z_usable, y, y[is_even], constraint=constraint)
    distance = ((Z_usable - Z[row]) ** 2).sum(axis=1)
    nearest = np.argsort(distance, kind="stable")[:_NEAREST]
    return fit, fit.process(Z_usable[nearest], fit.scale.to(y[nearest]))


def _predicted(fit: OutputFit, process: GaussianProcess, Z: Array) -> Array:
    """Return ``(3, k)`` expected values at designs, and the ends of their bands."""
    mean = process(Z)
    width = _DEVIATIONS * process.deviation(Z)
    values = fit.scale.back(np.array([mean, mean - width, mean + width]))
    return np.clip(values, -fit.scale.most, fit.scale.most)


def space_of_table(table: TestTable) -> DesignSpace:
    """Return the variables of tests; without bounds, such as those of a file, what they span."""
    schema = table.schema
    variables = []
    for j, (name, kind) in enumerate(zip(schema.variables, table.schema.kinds, strict=True)):
        column = table.X[:, j]
        if kind is Kind.CHOICE:
            options = tuple(value_ranks(column)[0])
            variables.append(Variable(name, kind, 0, len(options) - 1, options))
            continue
        low, high = schema.lower[j], schema.upper[j]
        if not np.isfinite([low, high]).all():
            numbers = column.astype(float)
            low, high = numbers.min(), numbers.max()
        variables.append(Variable(name, kind, low, high))
    return DesignSpace(tuple(variables), named=False)


def _values(variable: Variable, n: int) -> AnyArray:
    """Return values of a variable, increasing: n of a real one, at most n or all options else."""
    if variable.kind is Kind.CHOICE:
        return np.array(variable.options, dtype=object)
    return np.unique(variable.values(np.linspace(0, 1, n)))
