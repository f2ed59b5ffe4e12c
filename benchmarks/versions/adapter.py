"""The calls of 0.4 on both versions: what 0.3 has under other names or with other arguments.

In 0.4 a table carries its formulation and its questions take no limits. In 0.3 the limits of a
formulation are constraints of the table, and the questions take limits and normalisation. Here
:func:`under` and :func:`ask` put a question to both, and names of limits are reduced to those of
the columns that are limited.
"""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import pymoo_psi as psi
from pymoo_psi import page, table

CARRIES_FORMULATION = "limits" not in inspect.signature(psi.TestTable.pareto).parameters


@dataclass
class Question:
    """Tests of 0.3 with the limits and the normalisation that its functions take."""

    tests: psi.TestTable
    limits: Any
    normalize: bool

    @property
    def layout(self):
        """The layout of the tests."""
        return self.tests.layout


def under(tests, formulation=None, *, limits=None, normalize=True, limits_apart=False):
    """Tests under a formulation, or under limits and normalisation, for :func:`ask`.

    In 0.3 the limits of a formulation become constraints, unless ``limits_apart``.
    """
    if CARRIES_FORMULATION and formulation is not None:
        return tests.under(formulation)
    if CARRIES_FORMULATION:
        return tests.under(limits=limits, normalize=normalize)
    if formulation is None:
        return Question(tests, limits, normalize)
    if not limits_apart:
        return Question(tests.under(formulation), None, formulation.normalize)
    tests = tests.under(replace(formulation, limits={}))
    return Question(tests, formulation.limits, formulation.normalize)


def ask(function, question, *words, **options):
    """What a function or a method of tables gives for tests under a formulation."""
    if CARRIES_FORMULATION:
        return function(question, *words, **options)
    parameters = inspect.signature(function).parameters
    for name in ("limits", "normalize"):
        if name in parameters:
            options[name] = getattr(question, name)
    return function(question.tests, *words, **options)


def table_of(question):
    """The tests of a question as a table."""
    return question if CARRIES_FORMULATION else question.tests


def tests_of_run(tests, limits):
    """The tests of a run without its limits, and which of them are feasible under these."""
    if CARRIES_FORMULATION:
        return tests.under(limits={}), tests.feasible()
    return tests, tests.feasible(limits)


def feasible_ranking(question):
    """The rows of all feasible designs and their ranking."""
    if CARRIES_FORMULATION:
        ranking = question.feasible_ranking()
        return ranking.rows, ranking
    return ask(psi.TestTable.ranked, question)


def explain(designs, row, **options):
    """The explanation of a row of an array or a frame."""
    if CARRIES_FORMULATION:
        return psi.explain(designs, row=row, **options)
    return psi.explain(designs, row, **options)


def compare_designs(designs, rows, **options):
    """The comparison of rows of an array or a frame."""
    if CARRIES_FORMULATION:
        return psi.compare_designs(designs, rows=rows, **options)
    return psi.compare_designs(designs, rows, **options)


def decision_page(tests, formulation):
    """The page of tests under a formulation, whose limits it opens with."""
    if CARRIES_FORMULATION:
        return page.decision_page(tests.under(formulation))
    return page.decision_page(tests, formulation)


def read(path):
    """The table in a file, a study or a folder of shares that was written by the package."""
    if CARRIES_FORMULATION or path.suffix == ".xlsx":
        return table.read_table(path)
    if path.suffix == ".csv":
        return psi.TestTable.read_csv(path)
    return psi.TestTable.read_study(path)


# Limits, which are columns of constraints in 0.3 --------------------------------------------------


def limited_column(name):
    """The column that a limit is on, or the name of a constraint."""
    parts = re.split("<=|>=", name)
    return parts[1] if len(parts) == 3 else parts[0]


def without_ends(text):
    """A text in which limits have the names of their columns, as in 0.3: "f1" for "f1<=2"."""
    number = r"-?[0-9][0-9.e+-]*"
    return re.sub(rf"({number}<=)?\b([a-z][\w ]*)[<>]={number}", r"\2", text)


def is_limit(name):
    return limited_column(name) != name


def constraints_of(tests):
    """Names and values of the inequality constraints without limits."""
    names = tests.layout.inequalities
    kept = [j for j, name in enumerate(names) if not is_limit(name)]
    return [names[j] for j in kept], tests.G[:, kept]


def violations_of(question):
    """Which designs violate a constraint or a limit, by the name of the column."""
    mask, names = ask(psi.TestTable.violations, question)
    violated = {}
    for name, rows in zip(names, mask.T, strict=True):
        column = limited_column(name)
        violated[column] = violated.get(column, np.zeros(len(rows), bool)) | rows
    return violated


def costs_of(question):
    """What each constraint and each limited column costs."""
    frame = ask(table.constraint_costs, question)
    columns = [limited_column(name) for name in frame.index]
    numbers = [name for name in frame.columns if name != "column"]
    return {
        f"{column} {name}": value
        for column, row in zip(columns, frame[numbers].to_numpy(), strict=True)
        for name, value in zip(numbers, row.tolist(), strict=True)
    }


def shown_columns(columns):
    """The columns of a table as it is shown or written, without limits, by name."""
    shown = {name: cells for name, cells in columns.items() if not is_limit(str(name))}
    if "mu3" in shown:
        shown = ranked_columns(shown)
    if "violated" in shown:
        shown["violated"] = [violated_columns(cell) for cell in shown["violated"]]
    return shown


def ranked_columns(columns):
    """The columns of a ranking as 0.3 names them, without places, the rows sorted."""
    columns = {name: cells for name, cells in columns.items() if name != "place"}
    if "efficiency_rank" in columns:
        columns["rank"] = columns.pop("efficiency_rank")
    names = sorted(columns, key=str)
    rows = sorted(zip(*(columns[name] for name in names), strict=True))
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}


def violated_columns(cell):
    """The columns named in a cell of the column "violated"."""
    if not isinstance(cell, str):
        return cell
    return sorted({limited_column(name) for name in cell.split(", ")})
