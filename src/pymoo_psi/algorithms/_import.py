"""Tests from elsewhere: a table of results as a run of a study."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import AnyArray, Array, Received, invalid, known_name
from pymoo_psi.algorithms._executor import Model
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._run import table_of_run
from pymoo_psi.algorithms._sources import Points
from pymoo_psi.algorithms._store import StudyStore
from pymoo_psi.parallel import Values
from pymoo_psi.problems import Variable
from pymoo_psi.table import Formulation, TestTable, read_table


def import_tests(
    problem: Any,
    source: Any,
    options: RunOptions,
    columns: Mapping[str, str] | None = None,
) -> TestTable:
    """Take tests from elsewhere into a study, as a run of its own.

    Designs that the study has already are not stored again. Rows that lack an objective are left
    out, which a remark says. Designs may lie outside the bounds of the problem.

    Args:
        problem: The problem whose tests they are.
        source: A file that :func:`read_table` reads, a frame or a table: one column for each
            variable, objective and constraint, in the original units and directions. Further
            outputs are taken over as far as the source has them.
        options: The options of the study.
        columns: The columns of the source by the names of the problem, where these differ.

    Returns:
        The tests of the source.

    Raises:
        ArgumentValueError: A column is missing, or a value is none that its variable can have.
        StudyError: The study belongs to another model, or cannot be written.

    Example:
        >>> import tempfile
        >>> import pandas as pd
        >>> from pymoo.problems import get_problem
        >>> results = pd.DataFrame({"x1": [1.0, 2.0], "x2": [0.5, 1.0], "time": [7.0, 8.0]})
        >>> results[["f2", "g1", "g2"]] = [[9.0, -1.0, -1.0], [1.0, -1.0, -1.0]]
        >>> options = RunOptions(study=tempfile.mkdtemp() + "/bnh.db")
        >>> len(import_tests(get_problem("bnh"), results, options, {"f1": "time"}))
        2
    """
    model = Model(problem, options)
    columns = dict(columns or {})
    names = {name: columns.get(name, name) for name in _known_names(model)}
    for name in columns:
        known_name("a name of the problem", name, names)
    objectives = [names[name] for name in model.layout.objectives]
    table = read_table(source, Formulation(objectives=objectives), drop_incomplete=True)
    needed = (*model.layout.variables, *_results(model))
    for name in needed:
        if names[name] not in (*table.layout.columns, *table.extra):
            rule = "a table with a column for each variable, objective and constraint"
            remedy = f"name the column that is {name}, as {{{name!r}: 'column'}}"
            raise invalid("the tests", rule, Received(f"none named {names[name]!r}"), remedy)
    if table.problem is None:  # a file of designs, of which some lack a value
        table = table.rows(table.status != "failed")
    results = {}
    for name in names:
        if name not in model.layout.variables and names[name] in table.layout.columns:
            results[name] = table.column(names[name])
    failed = np.isin(table.numbers, list(table.reasons))
    rows = np.arange(len(table))
    X = _designs(model, table, names)
    sampling = f"tests of {_name_of(source)} ({_fingerprint(X, results)})"
    store = StudyStore(table_of_run(model, options, lambda: sampling), options, model)
    points = Points(rows + 1, 0, designs=X)
    values = []
    for row in rows.tolist():
        reason = ""
        if failed[row]:
            reason = table.reasons[int(table.numbers[row])]
        values.append(_values(model, {name: cells[row] for name, cells in results.items()}, reason))
    tests = model.tests(points, values)
    with store.session() as recall:
        recall(points)  # designs that other runs have tested are theirs
        store.keep(tests)
    return replace(tests, remarks=table.remarks)


def _results(model: Model) -> tuple[str, ...]:
    """Return the names of what a test has to say: objectives, constraints, limited outputs."""
    layout = model.layout
    inequalities = layout.inequalities[: model.n_ieq_constr]
    limited = [name for name in model.default_limits if name not in layout.columns]
    return (*layout.objectives, *inequalities, *layout.equalities, *limited)


def _known_names(model: Model) -> tuple[str, ...]:
    outputs = getattr(model.inner, "outputs", {})
    return tuple(dict.fromkeys((*model.layout.variables, *_results(model), *outputs)))


def _name_of(source: Any) -> str:
    if isinstance(source, (str, PathLike)):
        return Path(fspath(source)).name
    return "a table"


def _fingerprint(X: AnyArray, results: Mapping[str, Array]) -> str:
    """Return a text that differs for other tests."""
    text = repr((X.tolist(), {name: cells.tolist() for name, cells in results.items()}))
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def _designs(model: Model, table: TestTable, names: Mapping[str, str]) -> AnyArray:
    """Return the ``(n, n_var)`` designs of a table."""
    columns = []
    for variable, title in zip(model.space.variables, model.layout.variables, strict=True):
        cells = table.column(names[title])
        columns.append(_values_of(variable, title, cells))
    dtypes = {column.dtype for column in columns}
    dtype = dtypes.pop() if len(dtypes) == 1 else np.dtype(object)
    return np.column_stack([column.astype(dtype) for column in columns])


def _values_of(variable: Variable, title: str, cells: AnyArray) -> AnyArray:
    """Return cells as values of a variable."""
    if variable.kind in (Kind.CHOICE, Kind.BINARY):
        options: tuple[Any, ...] = variable.options or (False, True)
        option_by_text = {str(option): option for option in options}
        if variable.kind is Kind.BINARY:
            option_by_text |= {"0": False, "1": True, "0.0": False, "1.0": True}
        values = []
        for cell in cells.tolist():
            values.append(option_by_text[known_name(title, str(cell), option_by_text)])
        dtype = bool if variable.kind is Kind.BINARY else object
        return np.fromiter(values, dtype)
    numbers = np.array(cells.tolist(), dtype=np.float64)
    is_wrong = ~np.isfinite(numbers)
    rule = "finite numbers"
    if variable.kind is Kind.INTEGER:
        is_wrong |= numbers != np.round(numbers)
        rule = "whole numbers"
    if is_wrong.any():
        raise invalid(title, rule, Received(numbers[is_wrong][0]))
    if variable.kind is Kind.INTEGER:
        return numbers.astype(np.int64)
    return numbers


def _values(model: Model, results: Mapping[str, float], reason: str) -> Values:
    """Return a test's values as its evaluation would have returned them."""
    if reason:
        return {"failure": reason}
    layout = model.layout
    objectives = []
    for name, sign in zip(layout.objectives, layout.sign, strict=True):
        objectives.append(sign * results[name])
    constraints = [0.0] * (model.inner.n_ieq_constr - model.n_ieq_constr)  # of limits on outputs
    constraints += [results[name] for name in layout.inequalities[: model.n_ieq_constr]]
    values: Values = {
        "F": np.array(objectives),
        "G": np.array(constraints),
        "H": np.array([results[name] for name in layout.equalities]),
        "failure": "",
    }
    for name, value in results.items():
        if name not in layout.columns:
            values[name] = value
    return values
