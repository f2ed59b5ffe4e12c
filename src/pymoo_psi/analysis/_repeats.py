"""Repeated tests of a design: their mean, and how sure a decision on means is."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from shlex import quote
from typing import Any

import numpy as np

from pymoo_psi._kinds import first_of
from pymoo_psi._numbers import percent
from pymoo_psi._validation import (
    Array,
    Columns,
    Mask,
    Received,
    Rows,
    counted,
    invalid,
    known_name,
)
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import sentence, standard_errors
from pymoo_psi.table import (
    N_TESTS,
    NUMBERS_ROLES,
    OUTPUT,
    PROPOSAL_ROUND,
    ROW,
    Column,
    Decision,
    Expression,
    Formulation,
    TestTable,
    blank,
    error_column,
    has_errors,
    in_decimals,
    require_table,
    unequal,
)

_VARIABLES = "variables"
_FEWEST_NAMES = 3  # different texts of a column that may name designs
_TIES = 1.5  # the sum of probabilities of being the best from which on several are so together
_ROUNDED = 1e-13  # the relative rounding error of a mean of equal values


def average_repeats(table: TestTable, by: str | None = None) -> TestTable:
    """Return the table of designs, each the mean of its tests.

    Tests with the same value in a column are tests of one design. Further outputs are ``tests``,
    their number, and the standard error of each objective, also of those that the formulation
    names or computes. Failed tests do not count. Notes in which tests of a design differ are
    omitted.

    Args:
        table: The tests.
        by: Name of the column; by default, and for ``"variables"``, all variables.

    Raises:
        ArgumentValueError: There is no such column, it has gaps, tests with the same value have
            different variables, or a column has the name of a further output.

    Example:
        >>> tests = TestTable.of(range(1, 6), np.zeros((5, 0)), [[1], [2], [3], [5], [7]],
        ...                      notes={"rail": ["A", "A", "B", "B", "B"]})
        >>> designs = average_repeats(tests, "rail")
        >>> designs.names, designs["f1"], designs["tests"]
        (['A', 'B'], array([1.5, 5. ]), array([2., 3.]))
        >>> designs["f1 standard error"].round(2)
        array([1.19, 0.97])
    """
    require_table(table)
    tests = _under_all_objectives(table)
    by, first, design = _tests_by_design(tests, by)
    new_names = [N_TESTS, *map(error_column, tests.schema.objectives)]
    for name in new_names:
        if name in tests.evaluated.names:
            rule = f"without a column {name!r}, which the means of repeated tests have"
            raise invalid("table", rule, Received("one"), "rename the column")
    usable = ~tests.failed() & np.isfinite(tests.F).all(axis=1)
    designs = tests.take(first)
    schema = tests.evaluated.without(_differing_notes(tests, first[design]))
    data = {name: designs.data[name] for name in schema.names}
    data |= _statistics(tests.take(usable), designs, design[usable])
    designs = replace(
        designs,
        evaluated=schema.with_columns(*[Column(name, OUTPUT) for name in new_names]),
        data=data,
        failures=designs.take(data[N_TESTS] == 0).failures,
        problem=None,  # no run continues a study of means
        remarks=(*table.remarks, *_remarks(by, len(first), usable)),
        n_stored=0,
    )
    label = by if by in schema.notes else None
    return designs.with_notes({}, label).under(table.decision)


def _differing_notes(tests: TestTable, first: Rows) -> list[str]:
    """Return the notes in which tests differ from the first one of their design."""
    differing = []
    for name in tests.evaluated.notes:
        cells = tests.data[name]
        if name != ROW and unequal(cells, cells[first]).any():
            differing.append(name)
    return differing


def _remarks(by: str, n_designs: int, usable: Mask) -> list[str]:
    """Return how many designs and tests there are, and how many tests do not count."""
    remarks = [
        f"{counted(n_designs, 'design')}, {counted(len(usable), 'test')}: "
        f"rows with the same {by} are tests of one design."
    ]
    if not usable.all():
        n_unusable = counted((~usable).sum(), "test")
        remarks.append(f"Left out, as they have no values: {n_unusable}.")
    return remarks


def _under_all_objectives(table: TestTable) -> TestTable:
    """Return tests whose objectives are those evaluated and those asked for, without limits.

    What is computed of the means, such as of their standard errors, is unknown of tests.
    """
    names = {*table.evaluated.values}
    computed = {}
    for name, text in table.formulation.computed.items():
        expression = Expression.of(text)
        if names.issuperset(expression.columns):
            computed[name] = text
            names.add(name)
    objectives = dict.fromkeys([*table.evaluated.objectives, *table.formulation.objectives])
    known = [name for name in objectives if name in names]
    evaluated = replace(table, decision=Decision())
    return evaluated.under(Formulation(known, computed=computed))


def _statistics(tests: TestTable, designs: TestTable, design: Rows) -> Columns:
    """Return the means of designs, the standard errors of objectives, and the numbers of tests.

    Args:
        tests: The n tests that count.
        designs: The first test of each of k designs, whose values stay where no test counts.
        design: ``(n,)`` the design of each test.
    """
    counts = np.bincount(design, minlength=len(designs))
    columns: Columns = {N_TESTS: counts.astype(np.float64)}
    rows = np.flatnonzero(counts)

    def means_of(values: Array) -> Array:
        return np.bincount(design, values, len(counts)) / np.maximum(counts, 1)

    for name in tests.evaluated.of_role(*NUMBERS_ROLES):
        columns[name] = designs.data[name].copy()
        if name != PROPOSAL_ROUND:  # that of the first test
            means = means_of(tests.data[name])
            means[counts > 1] = in_decimals(means[counts > 1])  # others are values of one test
            columns[name][rows] = means[rows]
    for name in tests.schema.objectives:
        values = tests.column(name)
        deviations = values - means_of(values)[design]
        deviations[np.abs(deviations) <= _ROUNDED * np.abs(values)] = 0.0
        squares = np.bincount(design, deviations**2, len(counts)).astype(np.float64)
        columns[error_column(name)] = standard_errors(squares, counts)
    return columns


def _tests_by_design(table: TestTable, by: str | None) -> tuple[str, Rows, Rows]:
    """Return which tests are those of one design.

    Args:
        table: The n tests.
        by: As for :func:`average_repeats`.

    Returns:
        The name of the column whose equal values mark the tests of one design; ``(k,)`` the row of
        the first test of each design; ``(n,)`` the design of each test.

    Raises:
        ArgumentValueError: A value is missing, or tests with equal ones have different variables.
    """
    keys = table.evaluated.keys(table.data)  # none without variables
    labels: list[Any] = keys
    if by is None or (by == _VARIABLES and by not in table.columns):
        by = _VARIABLES
        if not table.evaluated.variables:
            raise invalid("by", "the column that names designs, as there are no variables", None)
    else:
        cells = table.column(known_name("by", by, table.columns))
        labels = cells.tolist()
        gaps = blank(cells)
        if gaps.any():
            received = Received(f"none in row {int(gaps.argmax()) + 1} of {by}")
            raise invalid("by", "a column without gaps", received)
    first_of_label = first_of(labels)
    first, design = np.unique(first_of_label, return_inverse=True)
    for row, key in enumerate(keys):
        if key != keys[first_of_label[row]]:
            received = Received(f"{by} {labels[row]} with different ones")
            raise invalid("by", "a column whose equal values have equal variables", received)
    return by, first, design


def first_tests(table: TestTable) -> Rows:
    """Return ``(n,)`` the row of the first test of the same design."""
    if not table.evaluated.variables:  # no design equals another
        return np.arange(len(table))
    # A design whose first variable has a value of its own occurs once: a quarter of the time in
    # which a large study is read.
    cells = table.data[table.evaluated.variables[0]]
    if cells.dtype != object and len(np.unique(cells)) == len(cells):
        return np.arange(len(table))
    return first_of(table.evaluated.keys(table.data))


def averaged_repeats(table: TestTable) -> TestTable:
    """Return the tests of a noisy model, those of the same design averaged if there are any."""
    if (first_tests(table) == np.arange(len(table))).all():
        return table
    return average_repeats(table)


def has_repeats(table: TestTable) -> bool:
    """Whether tests of the same design differ in objectives."""
    table = table.take(np.isfinite(table.F).all(axis=1))  # others have nothing to differ in
    return bool(unequal(table.F, table.F[first_tests(table)]).any())


def undeclared_repeats(table: TestTable) -> list[str]:
    """Say which of feasible designs share a name, or all variables, and differ in objectives."""
    firsts = {}
    naming = _naming_column(table)
    if naming is not None:
        with suppress(ArgumentValueError):  # of a column that marks no tests of one design
            _, rows, design = _tests_by_design(table, naming)
            firsts[naming] = rows[design]
    for by, first in (firsts | {_VARIABLES: first_tests(table)}).items():
        differing = unequal(table.F, table.F[first]).any(axis=1)
        if differing.any():
            n_designs = len({*first[differing].tolist()})
            return [
                f"For {counted(n_designs, 'design')}, rows with the same {by} differ in "
                "objectives: each row counts as a design; if they are repeated tests, say "
                f"--average-by {quote(by)}, or average_by= in Python."
            ]
    return []


def _naming_column(table: TestTable) -> str | None:
    """Return the column that names the designs.

    If they are called by their rows, the first column of texts may name them, tests of one design
    by the same text. A column of few texts, or of which most recur, holds categories instead.
    """
    label = table.schema.label
    if label != ROW:
        return label
    for name in table.schema.notes:
        cells = table.column(name).tolist()
        if name != label and all(isinstance(cell, str) for cell in cells):
            n_texts = len({*cells})
            if n_texts >= _FEWEST_NAMES and 2 * n_texts >= len(cells):
                return name
            return None
    return None


def confidence_sentences(table: TestTable, row: int) -> list[str]:
    """Say how sure it is that a design is the best; nothing if no errors are known.

    Nor if several designs usually tie, as two do of which none dominates the other.
    """
    if not has_errors(table):
        return []
    frame = table.confidence()
    if frame["best"].sum() > _TIES:
        return []
    chances = frame.iloc[row]
    text = sentence(
        "confidence",
        design=str(chances.name),
        best=percent(chances["best"], table.decimal),
        near=percent(chances["near_best"], table.decimal),
        pareto=percent(chances["pareto"], table.decimal),
    )
    return [text]
