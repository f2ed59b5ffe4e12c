"""Tests made elsewhere: designs that people are asked to test, their results, and other tables."""

from __future__ import annotations

import hashlib
import math
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    AnyArray,
    Designs,
    Entries,
    FilePath,
    Received,
    Values,
    counted,
    invalid,
    known_name,
)
from pymoo_psi.algorithms._asked import under_known
from pymoo_psi.algorithms._executor import Model
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._run import table_of_run
from pymoo_psi.algorithms._sources import unit_points
from pymoo_psi.algorithms._store import StudyStore
from pymoo_psi.problems import Variable, requirements_of
from pymoo_psi.study import Columns, Database, Proposal, Study
from pymoo_psi.table import (
    PROPOSAL_ROUND,
    Expression,
    Formulation,
    TestTable,
    choice_texts,
    choice_values,
    columns_of_designs,
    design_matrix,
    is_blank,
    read_table,
    source_columns,
)

if TYPE_CHECKING:
    import pandas as pd

TEST, FAILURE = "test", "failure"  # columns of a file beside those of the problem
_POINTS = 20  # of the sequence, which come before proposals of surrogates
_TRIED = 200  # points for each design, of which one may be new
_DISCRETE = (Kind.CHOICE, Kind.BINARY)


class _Request(NamedTuple):
    """A test that people are asked for.

    Attributes:
        run: Its run.
        proposal: How it is stored.
        design: The design, values by name.
        of: The number of the test that it is, or repeats.
    """

    run: int
    proposal: Proposal
    design: Values
    of: int


class _Row(NamedTuple):
    """A row of a file, with the results of a test or the reason why it failed.

    Attributes:
        test: The number of the test.
        values: The variables and results by name; NaN for the results of a failed test.
        reason: Why the test failed, or "".
        place: Where the row is, for messages.
    """

    test: int
    values: Values
    reason: str
    place: str

    def texts(self, names: Sequence[str]) -> list[str]:
        """Return some of the values, and of ``reason``, as texts."""
        cells = self.values | {"reason": self.reason}
        return [_text(cells[name]) for name in names]


class _Requests:
    """The tests of a study, and those that people are asked for.

    Args:
        database: The study in a transaction.

    Attributes:
        head: Its head.
        tests: All tests, by number.
        asked: The requests by the number of the test.
        options: The options of choices and binary variables, as they are stored, by their texts.
    """

    def __init__(self, database: Database) -> None:
        import pandas as pd

        self.head = database.facts.head
        self.tests = pd.DataFrame(database.tests()).set_index(TEST, drop=False)
        self.asked: dict[int, _Request] = {}
        self.options: Values = {}
        for run in database.facts.runs:
            self.options |= run.record.get("options", {})
            for proposal in database.proposals(run.number):
                content = proposal.content
                if "design" in content:
                    number = run.start + proposal.test_point
                    of = content.get("of", number)
                    self.asked[number] = _Request(run.number, proposal, content["design"], of)

    @property
    def pending(self) -> list[int]:
        """The numbers of the tests that were asked for and have no result."""
        pending = []
        for number, request in self.asked.items():
            if request.of == number and number not in self.tests.index:
                pending.append(number)
        return pending

    def frame(self, numbers: Sequence[int]) -> pd.DataFrame:
        """Return requests as a table to be filled in."""
        import pandas as pd

        frame = pd.DataFrame([self.asked[number].design for number in numbers])
        for name, kind in zip(self.head["variables"], self.head["kinds"], strict=True):
            if kind == Kind.CHOICE.value:
                frame[name] = choice_values(frame[name])
        frame.insert(0, TEST, numbers)
        frame[[*_results(self.head), FAILURE]] = None
        return frame


def _add(database: Database, run: int, requests: Sequence[tuple[int, str, Any]]) -> list[int]:
    """Ask for tests, given by round, origin and content; return their numbers."""
    stored = database.facts.run(run)
    numbers: list[int] = []
    for proposed_in, origin, content in requests:
        test_point = stored.last + len(numbers) + 1
        database.add_proposals(run, [Proposal(test_point, proposed_in, origin, content)])
        numbers.append(stored.start + test_point)
    database.plan(run, stored.last + len(numbers))
    return numbers


def _results(head: Entries) -> list[str]:
    """Return the columns that are told of a test, as they do not follow from others."""
    expressions = head.get("expressions", {})
    n_constraints = head.get("model_inequalities", 0)
    names = [*head["objectives"], *head["inequalities"][:n_constraints], *head["equalities"]]
    return [name for name in dict.fromkeys([*names, *expressions]) if not expressions.get(name)]


# Asking


def ask_tests(
    problem: Any, n_tests: int, options: RunOptions, *, with_surrogates: bool = False
) -> pd.DataFrame:
    """Return designs for people to test, and record them as pending in the study.

    Designs that are tested or pending are not proposed again.

    Args:
        problem: A pymoo problem; it is not evaluated.
        n_tests: How many designs; 0 for all that are pending.
        options: The options of the run, with a study.
        with_surrogates: Whether surrogates of all tests propose the designs, taking pending ones
            into account; the first 20 are points of the sequence.

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
    sampling = options.sampling_in(len(model.space.searched))

    def identity() -> str:
        return sampling.identity(_TRIED, options.seed) + ", then proposals on request"

    store = StudyStore(table_of_run(model, options, identity), options, model)
    texts = {}
    for name, variable in zip(model.layout.variables, model.space.variables, strict=True):
        if variable.kind in _DISCRETE:
            option_by_text = _option_by_text(variable)
            stored: list[Any] = [*option_by_text.values()]
            if variable.kind is Kind.CHOICE:
                stored = choice_texts(stored).tolist()
            texts[name] = dict(zip(option_by_text, stored, strict=True))
    store.remembered("options", texts)
    with store.writing():
        with store.study.changes() as database:
            requests = _Requests(database)
        if n_tests == 0:
            return requests.frame(requests.pending)
        new = _NewDesigns(model, requests)
        n_first = n_tests
        if with_surrogates:
            n_known = len(requests.tests) + len(requests.pending)
            n_first = min(n_tests, max(0, _POINTS - n_known))
        if n_first:
            new.add_points(options, store.origin, n_first)
        if n_first < n_tests:
            new.add_proposals(options, store, n_tests - n_first)
        with store.study.changes() as database:
            numbers = _add(database, store.run, new.requests)
            return _Requests(database).frame(numbers)


class _NewDesigns:
    """Designs that are neither tested nor pending.

    Args:
        model: The model.
        known: What is tested and asked for.

    Attributes:
        requests: For each new design its round, its origin, and what the study keeps of it.
    """

    def __init__(self, model: Model, known: _Requests) -> None:
        self.requests: list[tuple[int, str, Any]] = []
        self._model = model
        self._pending = [known.asked[number].design for number in known.pending]
        self._round = max((request.proposal.round for request in known.asked.values()), default=0)
        designs = known.tests[[*model.layout.variables]]
        self._seen = {*designs.itertuples(index=False, name=None)}
        for request in known.asked.values():
            self._seen.add(tuple(request.design.values()))

    def add_points(self, options: RunOptions, origin: str, n: int) -> None:
        """Add the first n points of the sequence that are new and meet the requirements."""
        space = self._model.space
        n_points = len(self._seen) + n * _TRIED
        X = unit_points(options, n_points, len(space.searched)).matrix(space)
        is_met = (self._model.violations(X) <= 0).all(axis=1)
        n_added = self._add(X[is_met], 0, origin, n)
        if n_added < n:
            rule = f"at most {n_added}, the new designs up to point {n_points}"
            raise invalid("the number of designs", rule, n)

    def add_proposals(self, options: RunOptions, store: StudyStore, n: int) -> None:
        """Add up to n designs that surrogates propose, one or more."""
        from pymoo_psi.algorithms._surrogate import proposed_now  # imports half of SciPy

        model = self._model
        columns = {}
        for name in model.layout.variables:
            columns[name] = np.array([design[name] for design in self._pending])
        designs = model.designs(columns)
        pending = model.space.points(designs[model.space.has_options(designs)])
        table = store.whole()
        table = under_known(table.rows(model.space.has_options(table.X)), model.asked)
        points = proposed_now(model, table, pending, n, options.seed or 0, self._round)
        if not self._add(model.space.matrix(points), self._round + 1, "surrogates", n):
            raise invalid("the number of designs", "0, as surrogates find no new one", n)

    def _add(self, X: Designs, proposed_in: int, origin: str, n: int) -> int:
        """Add the first n of designs that are new, if there are so many; return how many."""
        layout = self._model.layout
        columns = columns_of_designs(layout.variables, layout.kinds, X)
        n_added = 0
        for values in zip(*(column.tolist() for column in columns.values()), strict=True):
            if values not in self._seen and n_added < n:
                n_added += 1
                self._seen.add(values)
                design = dict(zip(columns, values, strict=True))
                self._pending.append(design)
                self.requests.append((proposed_in, origin, {"design": design}))
        return n_added


# Telling


def tell_tests(
    source: Any,
    study: FilePath,
    *,
    withdraw: Collection[int] = (),
    cancel: Collection[int] = (),
    decimal: str | None = None,
    sheet: str | None = None,
) -> list[str]:
    """Add the results of tests that people made to their study, all of them or none.

    The number of a row identifies its test; several rows of one test are repeats. Rows without
    results stay pending. If a variable differs in 15 digits from the proposed value, its new value
    is what was tested. Results that the study has already change nothing.

    Args:
        source: The table of :func:`ask_tests` with results, as a file or a data frame; or ``None``.
        study: The study.
        withdraw: Tests whose results are withdrawn before others are added; proposed tests are then
            pending again.
        cancel: Pending tests that will not be made.
        decimal: The decimal mark of a text, if it is not clear.
        sheet: The sheet of a workbook, if it has several.

    Returns:
        Sentences on what was added, and what is pending. The table ``history`` of the study keeps
        what was withdrawn or cancelled.

    Raises:
        ArgumentValueError: A row cannot be read, or belongs to no proposed test; or the study has
            other results.
        StudyError: The study is damaged or cannot be written.
    """
    sentences: list[str] = []
    with Study(study).changes() as database:
        stored = [*map(str, _Requests(database).tests.index)]
        for test in withdraw:
            known_name("a test to withdraw", str(test), stored)
            database.discard("tests", {TEST: test}, test, "withdrawn")
        requests = _Requests(database)
        pending = [*map(str, requests.pending)]
        for test in cancel:
            known_name("a test to cancel", str(test), pending)
            run, proposal, *_ = requests.asked[test]
            key = {"run": run, "test_point": proposal.test_point}
            database.discard("proposals", key, test, "cancelled")
        requests = _Requests(database)
        if source is not None:
            units = requests.head.get("units", {})
            cells, columns = source_columns(source, units, decimal=decimal, sheet=sheet)
            rows = _rows_of(cells, columns, requests, sentences)
            new = _new_rows(requests, rows)
            if new:
                _keep(database, requests, new, sentences)
            n_known = len(rows) - len(new)
            sentences.insert(0, f"{counted(len(new), 'test')} taken, {n_known} known already.")
        left = ", ".join(map(str, _Requests(database).pending)) or "none"
    return [*sentences, f"Pending tests: {left}."]


def _rows_of(cells: Any, columns: Entries, requests: _Requests, remarks: list[str]) -> list[_Row]:
    """Return the rows with results or the reason of a failure."""
    head = requests.head
    results = _results(head)
    kinds = {TEST: Kind.INTEGER, FAILURE: Kind.CHOICE} | dict.fromkeys(results, Kind.REAL)
    kinds |= zip(head["variables"], map(Kind, head["kinds"]), strict=True)
    by_column = []
    for name, kind in kinds.items():
        if name not in columns:
            rule = "those of the file that was written for these tests"
            raise invalid("the columns", rule, Received(f"none named {name!r}"))
        by_column.append(_read(cells, columns[name], kind, requests.options.get(name)))
    rows = []
    for i, row_values in enumerate(zip(*by_column, strict=True)):
        values = {name: v for name, v in zip(kinds, row_values, strict=True) if v is not None}
        test = values.pop(TEST, None)
        reason = values.pop(FAILURE, "")
        place = cells.where(i)
        n_results = len(values.keys() & {*results})
        if n_results == 0 and not reason:
            continue
        if n_results and reason:
            raise invalid(place, "either results or the reason of a failure", Received(reason))
        if test not in requests.asked or requests.asked[test].of != test:
            rule = "that of a test that was asked for and is not cancelled"
            raise invalid(f"{place}, {TEST}", rule, test)
        if n_results < len(results) and not reason:
            remarks.append(f"Test {test} stays pending, as it lacks some results.")
            continue
        for name, value in requests.asked[test].design.items():
            if _text(values.get(name, value)) == _text(value):
                values[name] = value  # with all its digits
        rows.append(_Row(test, dict.fromkeys(results, np.nan) | values, reason, place))
    return rows


def _read(cells: Any, column: Any, kind: Kind, options: Entries | None) -> list[Any]:
    """Return the values of a column, ``None`` where a cell is blank."""
    values: list[Any] = []
    for i, cell in enumerate(column.cells):
        place = f"{cells.where(i)}, {column.name}"
        value: Any = str(cell).strip()
        if is_blank(cell):
            value = None
        elif options is not None:
            if kind is Kind.BINARY:  # TRUE in spreadsheets
                value = value.capitalize()
            value = options[known_name(place, value, options)]
        elif kind is not Kind.CHOICE:
            value = column.require_numbers()[i].item()
            if not math.isfinite(value) or (kind is Kind.INTEGER and value % 1):
                raise invalid(place, f"one {kind.value} number", cell)
            if kind is Kind.INTEGER:
                value = int(value)
        values.append(value)
    return values


def _text(value: Any) -> str:
    """Return a value as a text, a number in the 15 digits that spreadsheets keep."""
    if isinstance(value, str):
        return value
    return f"{value:.15g}"


def _new_rows(requests: _Requests, rows: Sequence[_Row]) -> list[_Row]:
    """Return the rows that the study does not have.

    Raises:
        ArgumentValueError: A row has other results than the study.
    """
    names = [*requests.head["variables"], *_results(requests.head), "reason"]
    stored: dict[int, list[list[str]]] = defaultdict(list)
    for number, request in requests.asked.items():
        if number in requests.tests.index:
            stored[request.of].append([*map(_text, requests.tests.loc[number, names])])
    new = []
    for row in rows:
        texts = row.texts(names)
        if texts in stored[row.test]:
            stored[row.test].remove(texts)
        else:
            new.append(row)
    for row in new:
        test = row.test
        for stored_texts in stored[test]:
            differences = []
            for name, text, other in zip(names, row.texts(names), stored_texts, strict=True):
                if text != other:
                    differences.append(f"{name} = {text} where it has {other}")
            raise invalid(
                row.place,
                f"as the study has test {test}",
                Received("; ".join(differences)),
                f"--withdraw {test} with this file replaces it; a repeat needs the stored row "
                "beside it; nothing was taken",
            )
    return new


def _keep(
    database: Database,
    requests: _Requests,
    rows: Sequence[_Row],
    remarks: list[str],
) -> None:
    """Write the tests of rows, with what follows from variables and results."""
    head = database.facts.head
    pending = {*requests.pending}
    tests = []
    for row in rows:
        number = row.test
        run, (_, proposed_in, origin, _), design, _ = requests.asked[number]
        title = f"Test {number}"
        if number in pending:
            pending.remove(number)
        else:  # a repeat
            content = {"design": design, "of": number}
            (number,) = _add(database, run, [(proposed_in, origin, content)])
            title = f"Test {number}, a repeat of {row.test}"
        for name, value in design.items():
            if row.values[name] != value:
                change = f"{name} = {_text(row.values[name])} instead of {_text(value)}"
                remarks.append(f"{title}: {change}; what was tested counts.")
        tests.append(
            row.values
            | {
                TEST: number,
                "reason": row.reason,
                "origin": origin,
                "seconds": np.nan,
                PROPOSAL_ROUND: float(proposed_in),
            }
        )
    columns: Columns = {}
    for name in tests[0]:
        columns[name] = np.array([test[name] for test in tests])
    if not columns[PROPOSAL_ROUND].any():
        del columns[PROPOSAL_ROUND]
    has_failed = columns["reason"] != ""
    columns["status"] = np.where(has_failed, "failed", "ok")
    for name, expression in head.get("expressions", {}).items():
        if expression:
            values = Expression.of(expression).values(columns)
            columns[name] = np.where(has_failed, np.nan, values)
    designs = {name: columns[name] for name in head["variables"]}
    for name in head["inequalities"][head["model_inequalities"] :]:
        rule = name.rpartition(": ")[2]
        columns[name] = np.zeros(len(tests))
        if "=" in rule:  # otherwise it is a function, which only the problem has
            (requirement,) = requirements_of({name: rule}, [*designs])
            columns[name] = requirement.violation(designs)
    database.widen(columns)
    database.insert(columns | database.numbered(columns[TEST]))


# Tests from elsewhere


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
        ArgumentValueError: A column is missing, or a variable cannot have a value.
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
    inequalities = layout.inequalities[: model.n_ieq_constr]
    limited = [name for name in model.default_limits if name not in layout.columns]
    needed = (*layout.variables, *layout.objectives, *inequalities, *layout.equalities, *limited)
    names = {name: name for name in (*needed, *getattr(model.inner, "outputs", ()))}
    for name, column in (columns or {}).items():
        names[known_name("a name of the problem", name, names)] = column
    objectives = [names[name] for name in layout.objectives]
    table = read_table(source, Formulation(objectives=objectives), drop_incomplete=True)
    for name in needed:
        if names[name] not in (*table.layout.columns, *table.extra):
            rule = "a table with a column for each variable, objective and constraint"
            remedy = f"name the column that is {name}, as {{{name!r}: 'column'}}"
            raise invalid("the tests", rule, Received(f"none named {names[name]!r}"), remedy)
    table = table.rows(table.status != "failed")
    designs = []
    for variable, name in zip(model.space.variables, layout.variables, strict=True):
        designs.append(_values_of(variable, name, table.column(names[name])))
    X = design_matrix("X", np.column_stack(designs), layout.variables, layout.kinds)
    numbers = np.arange(1, len(table) + 1)
    results: Columns = columns_of_designs(layout.variables, layout.kinds, X)
    results |= {"test": numbers, "test_point": numbers}
    results |= {"reason": np.full(len(X), "", object), "status": np.full(len(X), "ok", object)}
    for name, column in names.items():
        if name not in results and column in table.layout.columns:
            results[name] = table.column(column)
    origin = "a table"
    if isinstance(source, (str, PathLike)):
        origin = Path(source).name
    text = repr({name: cells.tolist() for name, cells in results.items()})
    fingerprint = hashlib.sha256(text.encode()).hexdigest()[:8]
    identity = f"tests of {origin} ({fingerprint})"
    store = StudyStore(table_of_run(model, options, lambda: identity), options, model)
    tests = store.table(results, "test")
    store.keep(tests)
    return replace(tests, remarks=table.remarks)


def _option_by_text(variable: Variable) -> Values:
    """Return the values of a choice or a binary variable by their texts."""
    return {str(option): option for option in variable.options or (False, True)}


def _values_of(variable: Variable, name: str, cells: AnyArray) -> AnyArray:
    """Return cells as values of a variable."""
    if variable.kind not in _DISCRETE:
        return cells.astype(object)
    option_by_text = _option_by_text(variable)
    if variable.kind is Kind.BINARY:
        option_by_text |= {"0": False, "1": True, "0.0": False, "1.0": True}
    values = np.empty(len(cells), dtype=object)
    for row, cell in enumerate(cells.tolist()):
        values[row] = option_by_text[known_name(name, str(cell), option_by_text)]
    return values
