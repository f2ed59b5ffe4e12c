"""Tests from elsewhere: the rows of a table become a run of a study."""

from __future__ import annotations

import hashlib
from collections import Counter
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi._kinds import DTYPES, Kind, first_of
from pymoo_psi._names import named_as
from pymoo_psi._validation import Columns, Integers, Names, Received, Rows, counted, invalid
from pymoo_psi.algorithms._laboratory import ROUNDED, design_value, mark_of, with_computed
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._sources import RunOptions
from pymoo_psi.algorithms._store import StudyStore
from pymoo_psi.files import read_table
from pymoo_psi.pareto import RANKING_COLUMNS
from pymoo_psi.problems import problem_identity
from pymoo_psi.study import ADDED
from pymoo_psi.table import (
    BY_PEOPLE,
    N_TESTS,
    PROPOSAL_ROUND,
    Formulation,
    TestTable,
    choice_texts,
    error_column,
    units_of,
)

# Columns of rankings, means and studies, which are no outputs of a model unless it says so.
_BOOKKEEPING = {*RANKING_COLUMNS, N_TESTS, "design", "point", "repeat", "row", "rowid"}


def import_tests(problem: Any, source: Any, options: RunOptions) -> TestTable:
    """Add tests from elsewhere to a study, as a separate run.

    Each row is one test. Outputs that are expressions are computed; where the source has another
    value, a remark reports both. Tests that the study has already are not stored again: those of
    the same design or, of a noisy model, those of the same design with the same results. If the
    model is not noisy, they are completed by the outputs that only the source has.

    Failed tests and rows that lack a result are omitted. Designs may lie outside the bounds of the
    problem, which a remark reports.

    Args:
        problem: The problem whose tests they are.
        source: A file that :func:`read_table` reads, a frame or a table: one column for each
            variable, objective, constraint and output with a limit, in the original units and
            directions, or for the outputs of which these are expressions. Further outputs are added
            if the source has them, except columns of rankings and studies, such as ``place``.
        options: The options of the study.

    Returns:
        The tests of the source that have results. The first remark says how many were new, and
        how many of the others were completed.

    Raises:
        ArgumentValueError: A column is missing or in another unit, a variable cannot have a value,
            the rows are means of tests, or the study is a share of one.
        StudyError: The study belongs to another model, or cannot be written.

    Example:
        >>> import tempfile
        >>> import pandas as pd
        >>> from pymoo.problems import get_problem
        >>> results = pd.DataFrame({"x1": [1.0, 2.0], "x2": [0.5, 1.0], "f1": [7.0, 8.0]})
        >>> results[["f2", "g1", "g2"]] = [[9.0, -1.0, -1.0], [1.0, -1.0, -1.0]]
        >>> options = RunOptions(study=tempfile.mkdtemp() + "/bnh.db")
        >>> import_tests(get_problem("bnh"), results, options).remarks
        ('2 of 2 tests taken, 0 known already.',)
    """
    if options.share is not None:
        remedy = "join the shares by 'pymoo-psi export', and add the tests to that study"
        raise invalid("share", "left out for tests from elsewhere", options.share, remedy)
    repeat = 0 if getattr(problem, "noisy", False) else 1
    model = Model(problem, options, repeat)
    table = _table_of(model, source)
    tested = table.take(table.status != "failed")
    results = _results_of(model, tested)
    is_unmade = model.unmade(results | {"status": tested.status})
    if not model.noisy:
        _require_same_results(tested, first_of(model.schema.keys(results)))
    identity = _identity(source, results)
    store = StudyStore(model, options, lambda: identity)
    _restore_digits(results, store.study.contents()[1], model.schema.variables)
    remarks = [*table.remarks, *_left_out(table, results)]
    results = with_computed(store.study.facts().head, results, tested.names, remarks)
    remarks += _beyond_bounds(model, results)
    tests = store.table(results, "test").take(~is_unmade)
    if not model.noisy:
        tests = tests.take(~tests.repeats)
    n_new, n_completed = _keep(store, model, tests, remarks)
    taken = f"{n_new} of {counted(len(table), 'test')} taken, {len(tests) - n_new} known already"
    if n_completed > 0:
        taken += f", {n_completed} of these completed"
    return replace(tests, remarks=(f"{taken}.", *remarks))


def _restore_digits(results: Columns, stored: Columns, names: Names) -> None:
    """Give designs that are stored all digits of their variables; a file may have fewer."""
    designs = [
        zip(*(columns[name].tolist() for name in names), strict=True)
        for columns in (stored, results)
    ]
    known = {mark_of(design): design for design in designs[0]}
    for row, design in enumerate(designs[1]):
        for name, value in zip(names, known.get(mark_of(design), design), strict=True):
            results[name][row] = value


def _left_out(table: TestTable, results: Columns) -> list[str]:
    """Return remarks on the failed tests and the columns that are left out."""
    remarks = []
    n_failed = len(table) - len(results["test"])
    if n_failed > 0:
        remarks.append(f"{counted(n_failed, 'failed test')} left out.")
    names = _BOOKKEEPING & {*table.schema.outputs} - {*results}
    if names:
        listing = ", ".join(sorted(names))
        remarks.append(f"{listing} left out: rankings and studies have columns of this name.")
    return remarks


def _require_same_results(tests: TestTable, first: Rows) -> None:
    """Refuse tests of a design that differ in results, given the first test of each design."""
    if (tests.F[first] != tests.F).any():
        rule = "one of each design if the model is not noisy"
        remedy = "say that it is, by noisy = true, or --noisy of 'pymoo-psi solve'"
        raise invalid("the tests", rule, Received("some that differ in results only"), remedy)


def _table_of(model: Model, source: Any) -> TestTable:
    """Return the tests of a source, which must have all that the problem needs.

    Raises:
        ArgumentValueError: A column is missing or in another unit, or the rows are means.
    """
    schema = model.schema
    inequalities = schema.of_role("inequality")[: model.n_ieq_constr]
    names = (*schema.objectives, *inequalities, *schema.of_role("equality"), *model.default_limits)
    needed = dict.fromkeys(names)
    expressions = getattr(model.program, "known_expressions", {})
    for name, expression in reversed([*expressions.items()]):
        if name in needed:  # an expression uses outputs before it
            del needed[name]
            needed |= dict.fromkeys(expression.columns)
    results = [name for name in needed if name not in schema.variables]
    units = units_of((*schema.variables, *results), schema.units)
    formulation = Formulation(objectives=results, units=units)
    arguments = ("objectives", "units", "column")  # which nobody has given
    with named_as(dict.fromkeys(arguments, "a column that the problem needs")):
        table = read_table(source, formulation, average_by=False, drop_incomplete=True)
        for name in schema.variables:
            table.column(name)
    means = error_column(schema.objectives[0])
    if means in table.columns:
        remedy = "give the study that has them, or its tests by 'pymoo-psi export'"
        raise invalid("the tests", "single ones", Received(f"means with {means!r}"), remedy)
    return table


def _results_of(model: Model, table: TestTable) -> Columns:
    """Return tests of a source as columns of a study; outputs that it lacks are NaN."""
    schema = model.schema
    n = len(table)
    results: Columns = {"test": np.arange(1, n + 1), "reason": np.full(n, "", object)}
    results |= _variables_of(model, table)
    others = [name for name in table.schema.outputs if name not in _BOOKKEEPING]
    outputs = getattr(model.inner, "outputs", others)
    for name in (*schema.objectives, *schema.constraints, *model.default_limits, *outputs):
        if name not in results and name not in (*ADDED, PROPOSAL_ROUND):  # those of other runs
            results[name] = np.full(n, np.nan)
            if name in table.schema.values:
                results[name] = table.column(name)
    return results


def _variables_of(model: Model, table: TestTable) -> Columns:
    """Return the variables of tests of a source, each cell a value that its variable can have."""
    columns: Columns = {}
    identity, _ = problem_identity(model.problem)
    choices = identity["choices"]  # those beyond a box, too
    for variable, name in zip(model.space.variables, model.schema.variables, strict=True):
        kind = variable.kind
        options = choices.get(variable.title)
        cells = table.column(name)
        if options is not None:
            cells = choice_texts(cells)
        values = []
        for cell, place in zip(cells.tolist(), table.names, strict=True):
            values.append(design_value(cell, f"{place}, {name}", kind, options))
        columns[name] = np.array(values, DTYPES[kind])
    return columns


def _beyond_bounds(model: Model, results: Columns) -> list[str]:
    """Return remarks on the values outside the bounds."""
    remarks = []
    for variable, name in zip(model.space.variables, model.schema.variables, strict=True):
        values = results[name]
        beyond = values[~variable.are_near(values, reach=0.0)]
        if variable.kind is not Kind.CHOICE and len(beyond):
            bounds = f"{variable.lower:g} to {variable.upper:g}"
            n = counted(len(beyond), "test")
            remarks.append(f"{name} is outside {bounds} in {n}, the first {beyond[0]:g}.")
    return remarks


def _contradictions(tests: TestTable, stored: TestTable, numbers: Integers) -> list[str]:
    """Return a remark on known tests that have other results in the study.

    Args:
        tests: The tests of a source.
        stored: The known ones of them, as the study has them.
        numbers: ``(n,)`` the numbers of the tests in the study; 0 for new ones.
    """
    known = np.flatnonzero(numbers)
    former = stored.F[np.searchsorted(stored.numbers, numbers[known])]
    differ = ~np.isclose(tests.F[known], former, rtol=ROUNDED, atol=0) & np.isfinite(former)
    rows = known[differ.any(axis=1)]
    if len(rows) == 0:
        return []
    n = counted(len(rows), "known test")
    return [f"{n} with other results in the study, which stay, the first {tests.names[rows[0]]}."]


def _keep(store: StudyStore, model: Model, tests: TestTable, remarks: list[str]) -> tuple[int, int]:
    """Store the tests that a study does not have, and complete others if the model is not noisy.

    Returns:
        How many were new, and how many were completed. Remarks on the others are added.
    """
    keys = model.keys(tests.X)
    if not model.noisy:
        with store.study.reading() as database:
            numbers = database.find(keys)
            stored = store.table(database.tests_with(numbers), "test")
        remarks += _contradictions(tests, stored, numbers)
        n_new = int((numbers == 0).sum())
        return n_new, store.keep(tests) - n_new
    # Tests of a noisy model are known by their results, too; each stored one is one of them.
    stored = store.table(store.study.contents()[1], "test")
    known = Counter(zip(model.keys(stored.X), map(tuple, stored.F.tolist()), strict=True))
    is_new = np.ones(len(tests), dtype=bool)
    for row, mark in enumerate(zip(keys, map(tuple, tests.F.tolist()), strict=True)):
        is_new[row] = known[mark] <= 0
        known[mark] -= 1
    if tests.schema.outputs and not is_new.all():
        remarks.append("Further outputs of known tests are not added: the model is noisy.")
    return store.keep(tests.take(is_new)), 0


def _identity(source: Any, results: Columns) -> str:
    """Return by what a study recognises the run of tests from a source."""
    origin = "a table"
    if isinstance(source, (str, PathLike)):
        origin = Path(source).name
    text = repr({name: cells.tolist() for name, cells in results.items()})
    return f"{BY_PEOPLE} {origin} ({hashlib.sha256(text.encode()).hexdigest()[:8]})"
