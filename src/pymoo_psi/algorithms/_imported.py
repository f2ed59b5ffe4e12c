"""Tests from elsewhere: the rows of a table become a run of a study."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from pymoo_psi._kinds import Kind, named_option, option_text
from pymoo_psi._validation import AnyArray, Columns, Received, Values, invalid, known_name
from pymoo_psi.algorithms._laboratory import OF_LOG, TRUTH_VALUES
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._run import table_of_run
from pymoo_psi.algorithms._store import StudyStore
from pymoo_psi.problems import Variable
from pymoo_psi.table import Formulation, TestTable, columns_of_designs, design_matrix, read_table


def import_tests(
    problem: Any,
    source: Any,
    options: RunOptions,
    columns: Mapping[str, str] | None = None,
) -> TestTable:
    """Add tests from elsewhere to a study, as a separate run.

    Designs that the study has already are not stored again. Rows that lack an objective are
    omitted, with a remark; so are failed tests. Designs may lie outside the bounds of the problem.

    Args:
        problem: The problem whose tests they are.
        source: A file that :func:`read_table` reads, a frame or a table: one column for each
            variable, objective and constraint, in the original units and directions. Further
            outputs are added if the source has them.
        options: The options of the study.
        columns: The columns of the source by the names of the problem, where these differ.

    Returns:
        The tests of the source.

    Raises:
        ArgumentValueError: A column is missing or in another unit, or a variable cannot have a
            value.
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
    layout = model.layout
    needed = [
        *layout.variables,
        *layout.objectives,
        *layout.inequalities[: model.n_ieq_constr],
        *layout.equalities,
        *model.default_limits,
    ]
    names = {name: name for name in (*needed, *getattr(model.inner, "outputs", ()))}
    for name, column in (columns or {}).items():
        names[known_name("a name of the problem", name, names)] = column
    objectives = [names[name] for name in layout.objectives]
    table = read_table(source, Formulation(objectives=objectives), drop_incomplete=True)
    present = (*table.layout.columns, *table.extra)
    for name in needed:
        if names[name] not in present:
            rule = "a table with a column for each variable, objective and constraint"
            remedy = f"name the column that is {name}, as {{{name!r}: 'column'}}"
            raise invalid("the tests", rule, Received(f"none named {names[name]!r}"), remedy)
    for name, unit in layout.units.items():
        column = names.get(name, name)
        received = table.layout.units.get(column, unit)
        if received != unit:
            rule = f"that of the problem, {unit}"
            raise invalid(f"the unit of {column!r}", rule, received, "convert its values")
    results = _results_of(model, table.rows(table.status != "failed"), names)
    identity = _identity(source, results)
    store = StudyStore(table_of_run(model, options, lambda: identity), options, model)
    tests = store.table(results, "test")
    store.keep(tests)
    return replace(tests, remarks=table.remarks)


def _results_of(model: Model, table: TestTable, names: Mapping[str, str]) -> Columns:
    """Return tests of a source as columns of a study.

    Args:
        model: The model.
        table: The tests.
        names: Their columns by the names of the problem; further outputs may be missing.
    """
    layout = model.layout
    designs = []
    for variable, name in zip(model.space.variables, layout.variables, strict=True):
        designs.append(_values_of(variable, name, table.column(names[name])))
    X = design_matrix("X", np.column_stack(designs), layout.variables, layout.kinds)
    numbers = np.arange(1, len(table) + 1)
    results: Columns = columns_of_designs(layout.variables, layout.kinds, X)
    for name, kind in zip(layout.variables, layout.kinds, strict=True):
        if kind is Kind.LOG and (results[name] <= 0).any():
            raise invalid(name, OF_LOG, float(results[name].min()))
    results |= {"test": numbers, "test_point": numbers}
    results |= {"reason": np.full(len(X), "", object), "status": np.full(len(X), "ok", object)}
    for name, column in names.items():
        if name not in results and column in table.layout.columns:
            results[name] = table.column(column)
    return results


def _values_of(variable: Variable, name: str, cells: AnyArray) -> AnyArray:
    """Return cells as values of a variable."""
    texts = [str(cell) for cell in cells.tolist()]
    if variable.kind is Kind.BINARY:
        value_by_text: Values = TRUTH_VALUES
        texts = [text.lower() for text in texts]
    elif variable.kind is Kind.CHOICE:
        value_by_text = {option_text(option): option for option in variable.options}
        texts = [named_option(name, option_text(cell), value_by_text) for cell in cells.tolist()]
    else:
        return cells.astype(object)
    values = np.empty(len(cells), dtype=object)
    for row, text in enumerate(texts):
        values[row] = value_by_text[known_name(name, text, value_by_text)]
    return values


def _identity(source: Any, results: Columns) -> str:
    """Return by what a study recognises the run of tests from a source."""
    origin = "a table"
    if isinstance(source, (str, PathLike)):
        origin = Path(source).name
    text = repr({name: cells.tolist() for name, cells in results.items()})
    return f"tests of {origin} ({hashlib.sha256(text.encode()).hexdigest()[:8]})"
