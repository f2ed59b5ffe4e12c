"""Tests that people make: designs that they are asked to test, and the results that they tell."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import AnyArray, Numbers, Received, counted, invalid, known_name
from pymoo_psi.algorithms._executor import Model, executor_of
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._run import Run, table_of_run
from pymoo_psi.algorithms._sources import PlannedPoints, Points, unit_points
from pymoo_psi.algorithms._store import StudyStore
from pymoo_psi.problems import requirements_of
from pymoo_psi.study import Columns, Proposal, Requests, Study, run_of
from pymoo_psi.table import (
    PROPOSAL_ROUND,
    Expression,
    choice_texts,
    choice_values,
    columns_of_designs,
    is_blank,
    source_columns,
)

if TYPE_CHECKING:
    import pandas as pd

TEST, FAILURE = "test", "failure"  # columns of a file beside those of the problem
_POINTS = 20  # of the sequence, which come before proposals of surrogates
_BLOCKS = 200  # of points that are tried until enough of them are new designs
_ROUNDING = 1e-9  # of the terms of an equality
_DISCRETE = (Kind.CHOICE, Kind.BINARY)


# Asking


def ask_tests(
    problem: Any, n_tests: int, options: RunOptions, *, with_surrogates: bool = False
) -> pd.DataFrame:
    """Return designs that people are to test, which are pending in the study from now on.

    What is tested, or was asked for before, is not asked for again.

    Args:
        problem: A pymoo problem; it is not evaluated.
        n_tests: How many designs; 0 for all that are pending.
        options: The options of the run, with a study.
        with_surrogates: Whether surrogates of all tests propose the designs, in regard to those
            that are pending; the first 20 are points of the sequence.

    Returns:
        For each design ``test``, the number of its test; the variables; empty columns for the
        results; and ``failure``, for the reason of a failed test.

    Raises:
        ArgumentValueError: There are not so many new designs.
        StudyError: The study belongs to another model, or cannot be written.
    """
    model = Model(problem, options)
    for name in (TEST, FAILURE):
        if name in model.layout.columns:
            raise invalid("the columns", f"named unlike {TEST} and {FAILURE}", name)
    store = _store(model, options, "")
    texts = {}
    for variable in model.space.variables:
        if variable.kind in _DISCRETE:
            texts[variable.title] = choice_texts(variable.options or (False, True)).tolist()
    store.remembered("options", texts)
    of_surrogates = store
    if with_surrogates:
        of_surrogates = _store(model, options, ", then proposals on request")
    while True:
        with store.study.requests() as known:
            if n_tests == 0:
                return _frame(known, known.pending)
        search = _Search(model, options, known)
        n_first = n_tests
        if with_surrogates:
            n_first = min(n_tests, max(0, _POINTS - search.n_known))
        points = search.points(store, n_first)
        proposals: list[Proposal] = []
        if n_first < n_tests:
            proposals = search.proposals(of_surrogates, n_tests - n_first)
        with store.study.requests() as requests:
            if len(requests.asked) == len(known.asked):  # otherwise somebody else has asked
                numbers = requests.add(store.run, points)
                numbers += requests.add(of_surrogates.run, proposals)
                return _frame(requests, numbers)


def _store(model: Model, options: RunOptions, method: str) -> StudyStore:
    sampling = options.sampling_in(len(model.space.searched))

    def identity() -> str:
        return sampling.identity(_BLOCKS, options.seed) + method

    return StudyStore(table_of_run(model, options, identity), options, model)


class _Search:
    """The search for new designs.

    Args:
        model: The model.
        options: The options of the run.
        known: What is tested and asked for.

    Attributes:
        n_known: How many designs are tested or pending.
    """

    def __init__(self, model: Model, options: RunOptions, known: Requests) -> None:
        self._model = model
        self._options = options
        self._facts = known.facts
        self._pending = [known.asked[number]["design"] for number in known.pending]
        cells = [known.tests[name].tolist() for name in model.layout.variables]
        self._seen = {*zip(*cells, strict=True)}
        for request in known.asked.values():
            self._seen.add(tuple(request["design"].values()))
        self.n_known = len(known.tests["test"]) + len(self._pending)
        self._last_round = max([r["proposal"][1] for r in known.asked.values()], default=0)

    def points(self, store: StudyStore, n: int) -> list[Proposal]:
        """Return the next n points of the sequence that are new and meet the requirements."""
        model = self._model
        found: list[Proposal] = []
        first = run_of(self._facts, store.run).planned + 1
        last = first + n * _BLOCKS
        while len(found) < n:
            if first > last:
                rule = f"at most {len(found)}, the new designs up to point {last}"
                raise invalid("the number of designs", rule, n)
            options = replace(self._options, first=first)
            points = unit_points(options, n - len(found), len(model.space.searched))
            first += len(points)
            X = points.matrix(model.space)
            is_met = (model.violations(X) <= 0).all(axis=1)
            found += self._new(points.numbers[is_met], X[is_met], 0, store.origin)
        return found

    def proposals(self, store: StudyStore, n: int) -> list[Proposal]:
        """Return n new designs that surrogates propose."""
        from pymoo_psi.algorithms._surrogate import SurrogateSource  # imports half of SciPy

        model = self._model
        none = Points.none()
        points = replace(none, n_dim=len(model.space.searched), coordinates=np.zeros((0, 0)))
        run = Run(model, PlannedPoints(points), executor_of(model, self._options), store)
        source = SurrogateSource(run, 0, n, self._options.seed or 0, n, is_asynchronous=False)
        source.tell(store.known())
        layout = model.layout
        cells = []
        for name, kind in zip(layout.variables, layout.kinds, strict=True):
            column: Any = [design[name] for design in self._pending]
            if kind is Kind.CHOICE:
                column = choice_values(column)
            cells.append(np.array(column, dtype=object))
        designs = np.column_stack(cells)
        units = model.space.points(designs[model.space.has_options(designs)])
        pending = Points(np.arange(len(units)), points.n_dim, units)
        X = model.space.matrix(source.proposed(n, pending, self._last_round))
        first = run_of(self._facts, store.run).planned + 1
        numbers = first + np.arange(len(X))
        found = self._new(numbers, X, self._last_round + 1, "surrogates")
        if not found:
            raise invalid("the number of designs", "0, as surrogates find no new one", n)
        return found

    def _new(self, numbers: Numbers, X: AnyArray, proposed_in: int, origin: str) -> list[Proposal]:
        """Return those of designs that are new as proposals; they are pending from now on."""
        layout = self._model.layout
        columns = columns_of_designs(layout.variables, layout.kinds, X)
        cells = [column.tolist() for column in columns.values()]
        found: list[Proposal] = []
        for number, *values in zip(numbers.tolist(), *cells, strict=True):
            if tuple(values) not in self._seen:
                self._seen.add(tuple(values))
                design = dict(zip(columns, values, strict=True))
                self._pending.append(design)
                found.append((number, proposed_in, origin, {"design": design}))
        return found


def _frame(requests: Requests, numbers: Sequence[int]) -> pd.DataFrame:
    """Return requests as a table to be filled in."""
    import pandas as pd

    head = requests.facts["head"]
    frame = pd.DataFrame([requests.asked[number]["design"] for number in numbers])
    for name, kind in zip(head["variables"], head["kinds"], strict=True):
        if kind == Kind.CHOICE.value:
            frame[name] = choice_values(frame[name])
    frame.insert(0, TEST, numbers)
    frame[[*_results(head), FAILURE]] = None
    return frame


def _results(head: Mapping[str, Any]) -> list[str]:
    """Return the columns that are told of a test, as they do not follow from others."""
    expressions = head.get("expressions", {})
    n_constraints = head.get("model_inequalities", 0)
    names = [*head["objectives"], *head["inequalities"][:n_constraints], *head["equalities"]]
    return [name for name in dict.fromkeys([*names, *expressions]) if not expressions.get(name)]


# Telling


def tell_tests(
    source: Any,
    study: str | PathLike[str],
    *,
    correct: bool = False,
    withdraw: Collection[int] = (),
    cancel: Collection[int] = (),
    decimal: str | None = None,
    sheet: str | None = None,
) -> list[str]:
    """Take the results of tests that people were asked for into their study, all or none.

    A row belongs to the test of its number; several of a number are repeats, and all are kept. Rows
    without results stay pending. If a variable differs in 15 digits from what was asked for, what
    was tested counts. Results that the study has already change nothing.

    Args:
        source: The table of :func:`ask_tests` with results, as a file or a data frame; or ``None``.
        study: The study.
        correct: Whether other results of a test than those in the study take their place.
        withdraw: Tests whose results are withdrawn; those that were asked for are pending again.
        cancel: Pending tests that will not be made.
        decimal: The decimal mark of a text, if it is not clear.
        sheet: The sheet of a workbook, if it has several.

    Returns:
        Sentences on what was taken, and what is pending. What was corrected, withdrawn or
        cancelled is in the table ``history`` of the study.

    Raises:
        ArgumentValueError: A row cannot be read, or belongs to no test that was asked for; or the
            study has other results.
        StudyError: The study is damaged or cannot be written.
    """
    sentences: list[str] = []
    with Study(study).requests() as requests:
        for test in withdraw:
            known_name("a test to withdraw", str(test), [*map(str, requests.tests["test"])])
            requests.discard(test, "withdrawn")
        for test in cancel:
            known_name("a test to cancel", str(test), [*map(str, requests.pending)])
            requests.discard(test, "cancelled")
        if source is not None:
            rows = _rows_of(source, requests, decimal, sheet, sentences)
            new = _new_tests(requests, rows, correct)
            if new:
                requests.keep(_columns(requests, new, sentences))
            n_known = len(rows) - len(new)
            sentences.insert(0, f"{counted(len(new), 'test')} taken, {n_known} known already.")
        pending = ", ".join(map(str, requests.pending)) or "none"
    return [*sentences, f"Pending tests: {pending}."]


def _rows_of(
    source: Any,
    requests: Requests,
    decimal: str | None,
    sheet: str | None,
    remarks: list[str],
) -> list[dict[str, Any]]:
    """Return the rows with results: values by name, ``test``, ``reason`` and ``where``."""
    head = requests.facts["head"]
    cells, columns = source_columns(source, head.get("units", {}), decimal=decimal, sheet=sheet)
    results = _results(head)
    kinds = {TEST: Kind.INTEGER, FAILURE: Kind.CHOICE} | dict.fromkeys(results, Kind.REAL)
    kinds |= zip(head["variables"], map(Kind, head["kinds"]), strict=True)
    missing = kinds.keys() - columns.keys()
    if missing:
        rule = "those of the file that was written for these tests"
        raise invalid("the columns", rule, Received(f"none named {min(missing)!r}"))
    texts: dict[str, Any] = {}
    for run in requests.facts["runs"]:
        texts |= run.record.get("options", {})
    rows = []
    for i in range(len(cells.rows)):
        row: dict[str, Any] = {"where": cells.where(i)}
        for name, kind in kinds.items():
            cell = columns[name].cells[i]
            if is_blank(cell):
                continue
            row[name] = str(cell).strip()
            if name in texts:
                options = {str(option): option for option in choice_values(texts[name])}
                if kind is Kind.BINARY:  # TRUE in spreadsheets
                    row[name] = row[name].capitalize()
                row[name] = options[known_name(f"{row['where']}, {name}", row[name], options)]
                if kind is Kind.CHOICE:
                    row[name] = choice_texts([row[name]])[0]
            elif name != FAILURE:
                row[name] = columns[name].require_numbers()[i].item()
                is_whole = row[name] % 1 == 0 or kind is not Kind.INTEGER
                if not (math.isfinite(row[name]) and is_whole):
                    raise invalid(f"{row['where']}, {name}", f"one {kind.value} number", cell)
        row["reason"] = row.pop(FAILURE, "")
        n_results = len(row.keys() & {*results})
        if n_results == 0 and not row["reason"]:
            continue
        if TEST not in row or (n_results and row["reason"]):
            rule = "a number of a test, and either results or the reason of a failure"
            raise invalid(row["where"], rule, Received(", ".join(row)))
        if n_results < len(results) and not row["reason"]:
            remarks.append(f"Test {row[TEST]:g} stays pending, as it lacks some results.")
            continue
        rows.append(_as_asked(requests, row) | {"repeat": 1})
    return rows


def _as_asked(requests: Requests, row: dict[str, Any]) -> dict[str, Any]:
    """Return a row with all columns; a variable as it was asked for has all its digits."""
    number = int(row[TEST])
    request = requests.asked.get(number, {"of": number})
    if "of" in request:
        rule = "that of a test that was asked for and is not cancelled"
        raise invalid(f"{row['where']}, {TEST}", rule, number)
    whole = dict.fromkeys(_results(requests.facts["head"]), np.nan) | row | {TEST: number}
    for name, value in request["design"].items():
        if _text(row.get(name, value)) == _text(value):
            whole[name] = value
    return whole


def _text(value: Any) -> str:
    """Return a value as a text, a number in the 15 digits that spreadsheets keep."""
    if isinstance(value, str):
        return value
    return f"{value:.15g}"


def _new_tests(
    requests: Requests, rows: Sequence[dict[str, Any]], correct: bool
) -> list[dict[str, Any]]:
    """Return the rows that the study does not have, with the numbers of their tests and repeats.

    Raises:
        ArgumentValueError: A row has other results than the study, and this is no correction.
    """
    rows_by_test: dict[int, list[dict[str, Any]]] = {}
    for row in rows:
        rows_by_test.setdefault(row[TEST], []).append(row)
    tests = []
    free = requests.pending
    for number, rows_of_test in rows_by_test.items():
        stored = _stored(requests, number)
        repeats = [test["repeat"] for test in stored]
        new = []
        for row in rows_of_test:
            equal = [test for test in stored if not _differences(row, test)]
            if equal:
                stored = [test for test in stored if test is not equal[0]]
            else:
                new.append(row)
        if new and stored and not (correct and len(new) == len(stored)):
            received = Received("; ".join(_differences(new[0], stored[0])))
            rule = f"as the study has test {number}"
            remedy = "--correct replaces it; a repeat needs the stored row beside it"
            raise invalid(new[0]["where"], rule, received, f"{remedy}; nothing was taken")
        for row in new:
            if stored:
                replaced = stored.pop(0)
                requests.discard(replaced[TEST], "corrected")
                row |= {TEST: replaced[TEST], "repeat": replaced["repeat"]}
            elif number in free:
                free.remove(number)
            else:
                row[TEST] = requests.repeat(number)
                row["repeat"] = 1 + max(repeats, default=1)
                repeats.append(row["repeat"])
        tests += new
    return tests


def _stored(requests: Requests, number: int) -> list[dict[str, Any]]:
    """Return the stored tests of a request, its repeats behind it."""
    columns = requests.tests
    stored = []
    for row, test in enumerate(columns[TEST].tolist()):
        if number in (test, requests.asked.get(test, {}).get("of")):
            cells = {name: column[row : row + 1].tolist()[0] for name, column in columns.items()}
            stored.append(cells)
    return stored


def _differences(row: Mapping[str, Any], test: Mapping[str, Any]) -> list[str]:
    """Return in what a row differs from a stored test."""
    differences = []
    for name, value in row.items():
        if name not in ("where", TEST, "repeat") and _text(value) != _text(test[name]):
            differences.append(f"{name} = {_text(value)} where it has {_text(test[name])}")
    return differences


def _columns(requests: Requests, tests: Sequence[Mapping[str, Any]], remarks: list[str]) -> Columns:
    """Return tests as a study has them, with what follows from variables and results."""
    head = requests.facts["head"]
    columns: Columns = {}
    for name in tests[0].keys() - {"where"}:
        columns[name] = np.array([test[name] for test in tests])
    failed = columns["reason"] != ""
    columns["status"] = np.where(failed, "failed", "ok")
    requested = [requests.asked[test[TEST]] for test in tests]
    rounds = np.array([request["proposal"][1] for request in requested], dtype=np.float64)
    if rounds.any():
        columns[PROPOSAL_ROUND] = rounds
    titles = []
    for test, request in zip(tests, requested, strict=True):
        title = f"Test {test[TEST]}"
        if "of" in request:
            title += f", a repeat of {request['of']}"
        titles.append(title)
        for name, value in request["design"].items():
            if test[name] != value:
                change = f"{name} = {_text(test[name])} instead of {_text(value)}"
                remarks.append(f"{title}: {change}; what was tested counts.")
    for name, expression in head.get("expressions", {}).items():
        if expression:
            columns[name] = np.where(failed, np.nan, Expression.of(expression).values(columns))
    designs = {name: columns[name] for name in head["variables"]}
    for name in head["inequalities"][head["model_inequalities"] :]:
        rule = name.rpartition(": ")[2]
        columns[name] = np.zeros(len(tests))
        if "=" not in rule:  # a function, which only the problem has
            continue
        (requirement,) = requirements_of({name: rule}, [*designs])
        amounts = columns[name] = requirement.violation(designs)
        if requirement.is_equality:
            amounts, sizes = requirement.deviation(designs)
            amounts = np.where(amounts > _ROUNDING * sizes, amounts, 0)
        for row in np.flatnonzero(amounts > 0).tolist():
            miss = f"misses {rule} by {amounts[row]:.3g}"
            remarks.append(f"{titles[row]}, {miss}; what was tested counts.")
    return columns
