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
import pandas as pd

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


def order_by_rank(ranking):
    """The rows by rank of efficiency, then by distance, the dominated ones last."""
    if CARRIES_FORMULATION:
        return np.lexsort((ranking.criteria[:, 0], -ranking.rank, ~ranking.pareto))
    return ranking.order


def explain(designs, row, **options):
    """The explanation of a row of an array or a frame."""
    if CARRIES_FORMULATION:
        return psi.explain(psi.rank_of_efficiency(designs, **options), row=row)
    return psi.explain(designs, row, **options)


def explain_best(question):
    """The explanation of the optimum in units of the ranges of the feasible designs.

    0.4 measures shares by the ranges of all Pareto-optimal designs, whatever the limits, unless
    the designs within the limits are given as a frame.
    """
    if not CARRIES_FORMULATION:
        return ask(psi.TestTable.explain, question)
    objectives = question.explain().ranking.objectives
    names = list(objectives.names)
    frame = pd.DataFrame(objectives.values, columns=names, index=list(objectives.labels))
    ranking = psi.rank_of_efficiency(
        frame,
        maximize=[name for name in names if name in question.layout.maximize],
        normalize=question.formulation.normalize,
    )
    return psi.explain(ranking, row=question.explain().row)


def cautions_by_kind(cautions):
    """Sentences of cautions by kind: without ``edge``, which 0.4 lacks, and ``weights``, new in it.

    What is ``unlike`` in 0.3 is ``suspect`` in 0.4.
    """
    kinds = [caution.kind.replace("unlike", "suspect") for caution in cautions]
    texts = common_cautions([caution.sentence for caution in cautions])
    return [kind for kind in kinds if kind not in ("edge", "weights")], texts


def common_cautions(texts):
    """Sentences of cautions that both versions know."""
    return [text for text in texts if "an edge of the set" not in text and "weights" not in text]


def compare_designs(designs, rows, **options):
    """The comparison of rows of an array or a frame."""
    if CARRIES_FORMULATION:
        return psi.compare_designs(psi.rank_of_efficiency(designs, **options), rows=rows)
    return psi.compare_designs(designs, rows, **options)


def decision_page(tests, formulation):
    """The page of tests under a formulation, whose limits it opens with."""
    if CARRIES_FORMULATION:
        return page.decision_page(tests.under(formulation))
    return page.decision_page(tests, formulation)


def read(path):
    """The table in a file, a study or a folder of shares that was written by the package."""
    if CARRIES_FORMULATION:
        return table.read_table(path, repeats=False)  # every test; 0.3 takes no means
    if path.suffix == ".xlsx":
        return table.read_table(path)
    if path.suffix == ".csv":
        return psi.TestTable.read_csv(path)
    return psi.TestTable.read_study(path)


def without_repeats(columns, file):
    """The columns of a file's designs without rows that repeat another, which 0.4 leaves out."""
    if CARRIES_FORMULATION or file.suffix != ".csv":
        return columns
    content = file.read_bytes()
    text = content.decode("utf-16" if content[:2] == b"\xff\xfe" else "utf-8-sig")
    lines = text.splitlines()[1:]
    repeats = [k + 1 for k, line in enumerate(lines) if line in lines[:k]]
    kept = np.flatnonzero(~np.isin(columns["row"], repeats))
    return {name: [cells[k] for k in kept] for name, cells in columns.items()}


# Limits, which are columns of constraints in 0.3 --------------------------------------------------


def limited_column(name):
    """The column that a limit is on, or the name of a constraint."""
    parts = re.split("<=|>=", name)
    return parts[1] if len(parts) == 3 else parts[0]


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
    """The columns of a table as it is shown or written, without limits and units, by name."""
    shown = {}
    for name, cells in columns.items():
        if not is_limit(str(name)):
            shown[re.sub(r" \[\w+\]$", "", str(name))] = cells
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
