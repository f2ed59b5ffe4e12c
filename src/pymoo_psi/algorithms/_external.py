"""Tests made outside of runs: by people, who ask for designs and tell results, and other tables.

The tests that people are asked for are proposals of a run in a study. Each row of results belongs
to one of them by its number. A further row with this number is a repeat, which becomes a proposal
of the same design with a number of its own.
"""

from __future__ import annotations

import hashlib
import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    AnyArray,
    Columns,
    Designs,
    Entries,
    FilePath,
    Names,
    Received,
    Values,
    counted,
    invalid,
    known_name,
)
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._options import RunOptions
from pymoo_psi.algorithms._run import table_of_run
from pymoo_psi.algorithms._sources import unit_points
from pymoo_psi.algorithms._store import StudyStore
from pymoo_psi.problems import Variable, requirements_of
from pymoo_psi.study import Database, Proposal, Study
from pymoo_psi.table import (
    PROPOSAL_ROUND,
    Expression,
    Formulation,
    TestTable,
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
_OF_LOG = "above 0, as its scale is logarithmic"
_TRUTH_VALUES = {"false": False, "true": True, "0": False, "1": True, "0.0": False, "1.0": True}


@dataclass(frozen=True)
class _Request:
    """A test that people are asked for.

    Attributes:
        number: The number of the test.
        run: Its run.
        proposal: What the study keeps of it.
        original: The number of the test that it repeats, or its own.
    """

    number: int
    run: int
    proposal: Proposal
    original: int

    @property
    def design(self) -> Values:
        """The values of the variables by name; choices as texts."""
        design: Values = self.proposal.content["design"]
        return design


class _Requests:
    """The tests of a study, and those that people are asked for.

    Args:
        database: The study, open.

    Attributes:
        head: Its head.
        tests: All tests, by number.
        by_number: The requests by the number of the test.
        choices: The options of each choice, as texts.
    """

    def __init__(self, database: Database) -> None:
        import pandas as pd

        self.head = database.facts.head
        self.tests = pd.DataFrame(database.tests()).set_index(TEST, drop=False)
        self.by_number: dict[int, _Request] = {}
        is_choice = [kind == Kind.CHOICE.value for kind in self.head["kinds"]]
        names = compress(self.head["variables"], is_choice)
        options = self.head["problem"]["choices"].values()
        self.choices: dict[str, list[str]] = dict(zip(names, options, strict=True))
        for run in database.facts.runs:
            for proposal in database.proposals(run.number):
                if "design" in proposal.content:
                    number = run.start + proposal.test_point
                    original = proposal.content.get("of", number)
                    self.by_number[number] = _Request(number, run.number, proposal, original)

    @property
    def pending(self) -> dict[int, _Request]:
        """The requests without a result, by number."""
        pending = {}
        for number, request in self.by_number.items():
            if request.original == number and number not in self.tests.index:
                pending[number] = request
        return pending

    @property
    def results(self) -> list[str]:
        """The columns that people measure: objectives and others that no expression computes."""
        head = self.head
        expressions = head.get("expressions", {})
        constraints = head["inequalities"][: head.get("model_inequalities", 0)]
        names = [*head["objectives"], *constraints, *head["equalities"], *expressions]
        return [name for name in dict.fromkeys(names) if not expressions.get(name)]

    def frame(self, requests: Sequence[_Request]) -> pd.DataFrame:
        """Return requests as a table to be filled in."""
        import pandas as pd

        frame = pd.DataFrame([request.design for request in requests])
        frame.insert(0, TEST, [request.number for request in requests])
        frame[[*self.results, FAILURE]] = None
        return frame


def _add(database: Database, run: int, round_number: int, origin: str, content: Values) -> int:
    """Ask people for a test of a run; return its number."""
    stored = database.facts.run(run)
    test_point = stored.last + 1
    database.add_proposals(run, [Proposal(test_point, round_number, origin, content)])
    database.plan(run, test_point)
    return stored.start + test_point


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
            remedy = "rename the column"
            raise invalid("the columns", f"named unlike {TEST} and {FAILURE}", name, remedy)
    sampling = options.sampling_in(len(model.space.searched))

    def identity() -> str:
        return sampling.identity(_TRIED, options.seed) + ", then proposals on request"

    store = StudyStore(table_of_run(model, options, identity), options, model)
    with store.writing():
        with store.study.reading() as database:
            requests = _Requests(database)
        if n_tests == 0:
            return requests.frame([*requests.pending.values()])
        n_proposed = 0
        if with_surrogates:
            n_known = len(requests.tests) + len(requests.pending)
            n_proposed = max(0, n_tests - max(0, _POINTS - n_known))
        new = _NewDesigns(model, requests)
        points = new.of_sequence(options, n_tests - n_proposed)
        proposals = new.of_surrogates(options, store, n_proposed)
        with store.study.changes() as database:
            numbers = []
            for design in points:
                numbers.append(_add(database, store.run, 0, store.origin, {"design": design}))
            for design in proposals:
                content = {"design": design}
                number = _add(database, store.run, new.round_number, "surrogates", content)
                numbers.append(number)
            requests = _Requests(database)
            return requests.frame([requests.by_number[number] for number in numbers])


class _NewDesigns:
    """Designs that are neither tested nor asked for.

    Args:
        model: The model.
        requests: What is tested and asked for.

    Attributes:
        round_number: The round of the next proposals.
    """

    def __init__(self, model: Model, requests: _Requests) -> None:
        self._model = model
        self._pending = [request.design for request in requests.pending.values()]
        designs = requests.tests[[*model.layout.variables]]
        self._known = {*designs.itertuples(index=False, name=None)}
        self.round_number = 1
        for request in requests.by_number.values():
            self._known.add(tuple(request.design.values()))
            self.round_number = max(self.round_number, request.proposal.round + 1)

    def of_sequence(self, options: RunOptions, n: int) -> list[Values]:
        """Return the first n new points of the sequence that meet the requirements."""
        if n == 0:
            return []
        space = self._model.space
        n_points = len(self._known) + n * _TRIED
        X = unit_points(options, n_points, len(space.searched)).matrix(space)
        is_met = (self._model.violations(X) <= 0).all(axis=1)
        designs = self._first(X[is_met], n)
        if len(designs) < n:
            rule = f"at most {len(designs)}, the new designs up to point {n_points}"
            remedy = "ask for fewer, or loosen the requirements"
            raise invalid("the number of designs", rule, n, remedy)
        return designs

    def of_surrogates(self, options: RunOptions, store: StudyStore, n: int) -> list[Values]:
        """Return up to n designs that surrogates propose, one or more."""
        if n == 0:
            return []
        from pymoo_psi.algorithms._surrogate import proposed_now  # imports half of SciPy

        model = self._model
        space = model.space
        columns = {}
        for name in model.layout.variables:
            columns[name] = np.array([design[name] for design in self._pending])
        designs = model.designs(columns)
        pending = space.points(designs[space.has_options(designs)])
        table = store.whole()
        table = model.under(table.rows(space.has_options(table.X)))
        seed = options.seed or 0
        points = proposed_now(model, table, pending, n, seed, self.round_number - 1)
        proposals = self._first(space.matrix(points), n)
        if not proposals:
            remedy = "tell the results of pending tests, or ask for points of the sequence"
            raise invalid("the number of designs", "0, as surrogates find no new one", n, remedy)
        return proposals

    def _first(self, X: Designs, n: int) -> list[Values]:
        """Return the first n of designs that are new, which are known and pending from now on."""
        layout = self._model.layout
        columns = columns_of_designs(layout.variables, layout.kinds, X)
        designs: list[Values] = []
        for values in zip(*(column.tolist() for column in columns.values()), strict=True):
            if values not in self._known and len(designs) < n:
                self._known.add(values)
                designs.append(dict(zip(columns, values, strict=True)))
        self._pending += designs
        return designs


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
        withdraw: Tests whose results are withdrawn before others are added. A proposed test is then
            pending again; a repeat is not, as nobody has asked for it.
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
        tests = [*map(str, _Requests(database).tests.index)]
        for test in withdraw:
            known_name("a test to withdraw", str(test), tests)
            database.discard("tests", {TEST: test}, test, "withdrawn")
        pending = _Requests(database).pending
        for test in cancel:
            known_name("a test to cancel", str(test), [*map(str, pending)])
            request = pending[test]
            key = {"run": request.run, "test_point": request.proposal.test_point}
            database.discard("proposals", key, test, "cancelled")
        if source is not None:
            requests = _Requests(database)
            units = requests.head.get("units", {})
            cells, columns = source_columns(source, units, decimal=decimal, sheet=sheet)
            rows = [*_rows_of(cells, columns, requests, sentences)]
            new = _new_rows(requests, rows)
            if new:
                sentences += _keep(database, requests, new)
            n_known = len(rows) - len(new)
            sentences.insert(0, f"{counted(len(new), 'test')} taken, {n_known} known already.")
        left = ", ".join(map(str, _Requests(database).pending)) or "none"
    return [*sentences, f"Pending tests: {left}."]


@dataclass(frozen=True)
class _Row:
    """A row of a file, with the results of a test or the reason why it failed.

    Attributes:
        request: The test that people were asked for.
        values: The variables, the results and ``reason``, by name. The results of a failed test are
            NaN, the reason of another one is "".
        place: Where the row is, for messages.
    """

    request: _Request
    values: Values
    place: str

    def texts(self, names: Names) -> list[str]:
        """Return some of the values as texts."""
        return [_text(self.values[name]) for name in names]


def _text(value: Any) -> str:
    """Return a value as a text, a number in the 15 digits that spreadsheets keep."""
    if isinstance(value, str):
        return value
    return f"{value:.15g}"


def _rows_of(
    cells: Any, columns: Entries, requests: _Requests, remarks: list[str]
) -> Iterator[_Row]:
    """Yield the rows with all results or the reason of a failure; remark on those with some."""
    head = requests.head
    kinds = {TEST: Kind.INTEGER, FAILURE: Kind.CHOICE}
    kinds |= dict.fromkeys(requests.results, Kind.REAL)
    kinds |= zip(head["variables"], map(Kind, head["kinds"]), strict=True)
    values_by_name = {}
    for name, kind in kinds.items():
        if name not in columns:
            rule = "those of the file that was written for these tests"
            remedy = "'ask --points 0' writes pending tests again"
            raise invalid("the columns", rule, Received(f"none named {name!r}"), remedy)
        values_by_name[name] = _read(cells, columns[name], kind, requests.choices.get(name))
    for i in range(len(values_by_name[TEST])):
        values = {}
        for name, column in values_by_name.items():
            if column[i] is not None:
                values[name] = column[i]
        yield from _row(values, cells.where(i), requests, remarks)


def _row(values: Values, place: str, requests: _Requests, remarks: list[str]) -> Iterator[_Row]:
    """Yield the row of some values, if it has all results or the reason of a failure."""
    test = values.pop(TEST, None)
    reason = values.pop(FAILURE, "")
    measured = values.keys() & {*requests.results}
    if not measured and not reason:
        return
    if measured and reason:
        rule = "either results or the reason of a failure"
        raise invalid(place, rule, Received(reason), "leave one of them blank")
    request = requests.by_number.get(test)
    if request is None or request.original != test:
        rule = "that of a test that was asked for and is not cancelled"
        raise invalid(f"{place}, {TEST}", rule, test)
    if len(measured) < len(requests.results) and not reason:
        remarks.append(f"Test {test} stays pending, as it lacks some results.")
        return
    for name, value in request.design.items():
        if _text(values.get(name, value)) == _text(value):
            values[name] = value  # with all its digits
    unknown = dict.fromkeys(requests.results, np.nan)
    yield _Row(request, unknown | values | {"reason": reason}, place)


def _read(cells: Any, column: Any, kind: Kind, choices: Names | None) -> list[Any]:
    """Return the values of a column, ``None`` where a cell is blank."""
    values: list[Any] = []
    for i, cell in enumerate(column.cells):
        place = f"{cells.where(i)}, {column.name}"
        value: Any = str(cell).strip()
        if is_blank(cell):
            value = None
        elif kind is Kind.BINARY:
            value = _TRUTH_VALUES[known_name(place, value.lower(), _TRUTH_VALUES)]
        elif choices is not None:
            (option,) = choice_values([value])
            known_name(place, str(option), choices)
        elif kind is not Kind.CHOICE:
            value = column.require_numbers()[i].item()
            if not math.isfinite(value) or (kind is Kind.INTEGER and value % 1):
                raise invalid(place, f"one {kind.value} number", cell)
            if kind is Kind.LOG and value <= 0:
                raise invalid(place, _OF_LOG, cell)
            if kind is Kind.INTEGER:
                value = int(value)
        values.append(value)
    return values


def _new_rows(requests: _Requests, rows: Sequence[_Row]) -> list[_Row]:
    """Return the rows that the study does not have.

    Raises:
        ArgumentValueError: A row has other results than the study.
    """
    names = [*requests.head["variables"], *requests.results, "reason"]
    stored: dict[int, list[list[str]]] = defaultdict(list)  # by the number of the original test
    for number, request in requests.by_number.items():
        if number in requests.tests.index:
            stored[request.original].append([*map(_text, requests.tests.loc[number, names])])
    new = []
    for row in rows:
        texts = row.texts(names)
        if texts in stored[row.request.number]:
            stored[row.request.number].remove(texts)
        else:
            new.append(row)
    for row in new:
        test = row.request.number
        if not stored[test]:
            continue
        differences = []
        for name, text, other in zip(names, row.texts(names), stored[test][0], strict=True):
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


def _keep(database: Database, requests: _Requests, rows: Sequence[_Row]) -> list[str]:
    """Write the tests of rows; return sentences on designs that were changed."""
    import pandas as pd

    pending = requests.pending
    tests = []
    sentences = []
    for row in rows:
        request = row.request
        number = request.number
        _, round_number, origin, _ = request.proposal
        title = f"Test {number}"
        if pending.pop(number, None) is None:  # it has a result already
            content = {"design": request.design, "of": number}
            number = _add(database, request.run, round_number, origin, content)
            title = f"Test {number}, a repeat of {request.number}"
        for name, value in request.design.items():
            if row.values[name] != value:
                change = f"{name} = {_text(row.values[name])} instead of {_text(value)}"
                sentences.append(f"{title}: {change}; what was tested counts.")
        of_request = {TEST: number, "origin": origin, PROPOSAL_ROUND: round_number}
        tests.append(row.values | of_request)
    frame = pd.DataFrame(tests)
    if not frame[PROPOSAL_ROUND].any():
        del frame[PROPOSAL_ROUND]
    columns: Columns = {str(name): frame[name].to_numpy() for name in frame}
    columns["seconds"] = np.full(len(tests), np.nan)
    columns |= _computed(database.facts.head, columns)
    database.widen(columns)
    database.insert(columns | database.numbered(columns[TEST]))
    return sentences


def _computed(head: Entries, columns: Columns) -> Columns:
    """Return what follows from variables and results: status, expressions and requirements."""
    has_failed = columns["reason"] != ""
    columns = columns | {"status": np.where(has_failed, "failed", "ok")}
    for name, expression in head.get("expressions", {}).items():
        if expression:
            values = Expression.of(expression).values(columns)
            columns[name] = np.where(has_failed, np.nan, values)
    designs = {name: columns[name] for name in head["variables"]}
    for name in head["inequalities"][head["model_inequalities"] :]:
        rule = name.rpartition(": ")[2]
        columns[name] = np.zeros(len(has_failed))
        if "=" in rule:  # otherwise it is a function, which only the problem has
            (requirement,) = requirements_of({name: rule}, [*designs])
            columns[name] = requirement.violation(designs)
    return columns


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
    needed = _needed(model)
    names = {name: name for name in (*needed, *getattr(model.inner, "outputs", ()))}
    for name, column in (columns or {}).items():
        names[known_name("a name of the problem", name, names)] = column
    objectives = [names[name] for name in model.layout.objectives]
    table = read_table(source, Formulation(objectives=objectives), drop_incomplete=True)
    for name in needed:
        if names[name] not in (*table.layout.columns, *table.extra):
            rule = "a table with a column for each variable, objective and constraint"
            remedy = f"name the column that is {name}, as {{{name!r}: 'column'}}"
            raise invalid("the tests", rule, Received(f"none named {names[name]!r}"), remedy)
    for name, unit in model.layout.units.items():
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


def _needed(model: Model) -> list[str]:
    """Return the columns without which a row is no test of a model."""
    layout = model.layout
    names = [*layout.variables, *layout.objectives, *layout.inequalities[: model.n_ieq_constr]]
    names += layout.equalities
    names += [name for name in model.default_limits if name not in layout.columns]
    return names


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
            raise invalid(name, _OF_LOG, float(results[name].min()))
    results |= {"test": numbers, "test_point": numbers}
    results |= {"reason": np.full(len(X), "", object), "status": np.full(len(X), "ok", object)}
    for name, column in names.items():
        if name not in results and column in table.layout.columns:
            results[name] = table.column(column)
    return results


def _identity(source: Any, results: Columns) -> str:
    """Return by what a study recognises the run of tests from a source."""
    origin = "a table"
    if isinstance(source, (str, PathLike)):
        origin = Path(source).name
    text = repr({name: cells.tolist() for name, cells in results.items()})
    return f"tests of {origin} ({hashlib.sha256(text.encode()).hexdigest()[:8]})"


def _values_of(variable: Variable, name: str, cells: AnyArray) -> AnyArray:
    """Return cells as values of a variable."""
    if variable.kind is Kind.BINARY:
        value_by_text: Values = _TRUTH_VALUES
        cells = np.array([str(cell).lower() for cell in cells])
    elif variable.kind is Kind.CHOICE:
        value_by_text = {str(option): option for option in variable.options}
    else:
        return cells.astype(object)
    values = np.empty(len(cells), dtype=object)
    for row, cell in enumerate(cells.tolist()):
        values[row] = value_by_text[known_name(name, str(cell), value_by_text)]
    return values
