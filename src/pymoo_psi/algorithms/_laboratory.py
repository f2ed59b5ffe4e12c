"""Tests that people make: they are assigned designs, and tell the results.

An assignment is a proposal of a run in a study. Each row of results belongs to one of them by the
number of the test. A further row with this number is a repeat: another assignment of the same
design, with a number of its own.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import compress, zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._kinds import Kind, named_option
from pymoo_psi._output import with_unit
from pymoo_psi._validation import (
    Columns,
    Designs,
    Entries,
    FilePath,
    Head,
    Names,
    Received,
    Values,
    counted,
    invalid,
    known_name,
)
from pymoo_psi.algorithms._model import Model, with_options
from pymoo_psi.algorithms._sources import RunOptions, unit_points
from pymoo_psi.algorithms._store import StudyStore
from pymoo_psi.files import is_blank, source_columns
from pymoo_psi.problems import require_no_permutation, requirements_of
from pymoo_psi.study import Database, Proposal, Study
from pymoo_psi.table import (
    POINT,
    PROPOSAL_ROUND,
    Expression,
    columns_of_designs,
)

if TYPE_CHECKING:
    import pandas as pd

_Result = tuple[int, str, Values]  # see _results_in
_NewResult = tuple[int | None, _Result]  # see _new_results
_Mark = tuple[str, ...]  # see mark_of
TEST, FAILURE = "test", "failure"  # columns of a file beside those of the problem
_POINTS = 20  # how many points of the sequence come before proposals of surrogates
ROUNDED = 1e-3  # relative difference up to which a given value is a rounded one
_TRIED = 200  # points that are tried for each new design
_TRUTH_VALUES = {"false": False, "true": True, "0": False, "1": True, "0.0": False, "1.0": True}


class _Laboratory:
    """The tests of a study, and those that people are asked for.

    Args:
        database: The study, open.

    Attributes:
        head: Its head.
        choices: The texts of the options of variables that are choices, by name.
        results: The columns that people measure: objectives and others that no expression computes.
        compared: The columns by which a result is recognised.
        tests: What is compared of stored tests, by number: see :meth:`texts`.
        proposals: What was assigned, by the number of the test: its run, and what the study keeps.
        pending: The numbers of those without a result.
    """

    def __init__(self, database: Database) -> None:
        head = database.facts.head
        self.head = head
        self.choices = _choices(head)
        self.results = _measured(head)
        self.compared = [*head["variables"], *self.results, "reason"]
        self.tests = _texts_of_tests(database.tests(), self.compared)
        self.proposals: dict[int, tuple[int, Proposal]] = {}
        for run, test, proposal in database.assigned():
            if "design" in proposal.content:
                self.proposals[test] = run, proposal
        self.pending: list[int] = []
        for test in self.proposals:
            if self.original(test) == test and test not in self.tests:
                self.pending.append(test)

    @property
    def left(self) -> str:
        """Which tests are pending."""
        return f"pending tests: {', '.join(map(str, self.pending)) or 'none'}"

    def design(self, test: int) -> Values:
        """Return the assigned values of the variables by name; choices as texts."""
        _, proposal = self.proposals[test]
        design: Values = proposal.content["design"]
        return design

    def as_tested(self, test: int, values: Values) -> Values:
        """Return values by name with the assigned ones where these are blank or only rounded."""
        assigned = {}
        for name, value in self.design(test).items():
            if _text(values.get(name, value)) == _text(value):
                assigned[name] = value
        return values | assigned

    def original(self, test: int) -> int:
        """Return the number of the test that an assigned one repeats, or its own."""
        _, proposal = self.proposals[test]
        return int(proposal.content.get("of", test))

    def texts(self, values: Entries) -> dict[str, str]:
        """Return what is compared of values by name, in the digits that spreadsheets keep."""
        return {name: _text(values[name]) for name in self.compared}

    def assign(self, database: Database, run: int, proposal: Proposal) -> int:
        """Ask people for a test, the next point of a run; return its number."""
        test, proposal = database.assign(run, proposal)
        self.proposals[test] = run, proposal
        return test

    def take_pending(self, database: Database, test: int) -> int:
        """Let a test be made; return its number, or that of a repeat if it is made already."""
        if test in self.pending:
            self.pending.remove(test)
            return test
        run, proposal = self.proposals[test]
        content = proposal.content | {"of": test}
        return self.assign(database, run, proposal._replace(content=content))

    def frame(self, tests: Sequence[int]) -> pd.DataFrame:
        """Return assigned tests as a table to be filled in."""
        import pandas as pd

        frame = pd.DataFrame([self.design(test) for test in tests])
        frame.insert(0, TEST, tests)
        frame[self.results] = None
        frame.insert(frame.shape[1], FAILURE, None)
        return frame

    def marks(self) -> set[_Mark]:
        """Return the marks of the designs that are tested or assigned; see :func:`mark_of`."""
        variables = self.head["variables"]
        marks = {tuple(texts[name] for name in variables) for texts in self.tests.values()}
        return marks | {mark_of(self.design(test).values()) for test in self.proposals}


def _texts_of_tests(columns: Columns, names: Names) -> dict[int, dict[str, str]]:
    """Return the texts of cells of stored tests by name, by the number of the test."""
    unknown = np.full(len(columns[TEST]), np.nan)  # of an output before its first value
    texts = {name: [*map(_text, columns.get(name, unknown).tolist())] for name in names}
    rows = zip(*texts.values(), strict=True)
    tests = {}
    for test, row in zip(columns[TEST].tolist(), rows, strict=True):
        tests[test] = dict(zip(names, row, strict=True))
    return tests


def _choices(head: Head) -> dict[str, Names]:
    """Return the texts of the options of variables that are choices, by name."""
    is_choice = [kind == Kind.CHOICE.value for kind in head["kinds"]]
    options = head["problem"]["choices"].values()
    return dict(zip(compress(head["variables"], is_choice), options, strict=True))


def _measured(head: Head) -> list[str]:
    """Return the objectives, constraints and further outputs that no expression computes."""
    constraints = head["inequalities"][: head["problem"].get("inequalities", 0)]
    expressions = head.get("expressions", {})
    names = [*head["objectives"], *constraints, *head["equalities"], *expressions]
    return [name for name in dict.fromkeys(names) if not expressions.get(name)]


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
        ArgumentValueError: There are not so many new designs, or ``options`` have no study.
        StudyError: The study belongs to another model, or cannot be written.

    Example:
        >>> import tempfile
        >>> from pymoo.core.problem import Problem
        >>> study = tempfile.mkdtemp() + "/lab.db"
        >>> frame = ask_tests(Problem(n_var=1, n_obj=1, xl=0, xu=1), 3, RunOptions(study=study))
        >>> frame["x1"].tolist()
        [0.0, 0.5, 0.25]
        >>> tell_tests(frame.assign(f1=[3, 2, None]), study)
        ['2 tests taken, 0 known already.', 'Pending tests: 3.']
    """
    require_no_permutation(problem)
    model = Model(problem, options)
    if FAILURE in model.schema.variables:
        raise invalid("a variable", f"named unlike the column {FAILURE}", FAILURE, "rename it")
    sampling = options.sampling_in(len(model.space.searched))

    def identity() -> str:
        return sampling.identity(_TRIED, options.seed) + ", then proposals on request"

    store = StudyStore(model, options, identity)
    with store.writing():
        with store.study.reading() as database:
            laboratory = _Laboratory(database)
        if n_tests == 0:
            return laboratory.frame(laboratory.pending)
        n_surrogates = 0
        if with_surrogates:
            n_known = len(laboratory.tests) + len(laboratory.pending)
            n_surrogates = max(0, n_tests - max(0, _POINTS - n_known))
        proposals = _proposals(model, options, store, laboratory, n_tests, n_surrogates)
        with store.study.changes() as database:
            tests = [laboratory.assign(database, store.run, proposal) for proposal in proposals]
        return laboratory.frame(tests)


def _proposals(
    model: Model,
    options: RunOptions,
    store: StudyStore,
    laboratory: _Laboratory,
    n: int,
    n_surrogates: int,
) -> list[Proposal]:
    """Return n designs that are neither tested nor pending, of which surrogates propose the last.

    Args:
        model: The model.
        options: The options of the run.
        store: The study.
        laboratory: Its tests.
        n: How many designs.
        n_surrogates: How many of these surrogates propose; the others are points of the sequence.
    """
    known = laboratory.marks()
    designs = _points_of_sequence(model, options, known, n - n_surrogates)
    proposals = [Proposal(0, 0, store.origin, {"design": design}) for design in designs]
    if n_surrogates > 0:
        from pymoo_psi.algorithms._surrogate import proposed_now  # imports half of SciPy

        pending = [*map(laboratory.design, laboratory.pending), *designs]
        rounds = [proposal.round for _, proposal in laboratory.proposals.values()]
        last = max(rounds, default=0)
        X = proposed_now(model, store.whole(), pending, n_surrogates, options.seed or 0, last)
        for design in _unknown_designs(model, X, known, n_surrogates):
            proposals.append(Proposal(0, last + 1, "surrogates", {"design": design}))
    return proposals


def _points_of_sequence(
    model: Model, options: RunOptions, known: set[_Mark], n: int
) -> list[Values]:
    """Return the first n unknown points of the sequence that meet the requirements."""
    space = model.space
    n_points = len(known) + n * _TRIED
    X = unit_points(options, n_points, len(space.searched)).matrix(space)
    designs = _unknown_designs(model, X[model.meets_requirements(X)], known, n)
    if len(designs) < n:
        others = f"all others up to point {n_points} are known or violate requirements"
        rule = f"at most {len(designs)}, as {others}"
        remedy = "ask for fewer, widen the bounds, or loosen the requirements"
        raise invalid("the number of designs", rule, n, remedy)
    return designs


def _unknown_designs(model: Model, X: Designs, known: set[_Mark], n: int) -> list[Values]:
    """Return the first n designs whose marks are not known; from now on they are."""
    schema = model.schema
    columns = columns_of_designs(schema.variables, schema.kinds, X)
    designs: list[Values] = []
    for values in zip(*(column.tolist() for column in columns.values()), strict=True):
        mark = mark_of(values)
        if mark not in known and len(designs) < n:
            known.add(mark)
            designs.append(dict(zip(columns, values, strict=True)))
    return designs


def mark_of(values: Iterable[Any]) -> _Mark:
    """Return what tells designs apart by their values, in the digits that files keep."""
    return tuple(map(_text, values))


# Telling


def tell_tests(
    source: Any,
    study: FilePath,
    *,
    cancel: Collection[int] = (),
    decimal: str | None = None,
    sheet: str | None = None,
) -> list[str]:
    """Add the results of tests that people made to their study, all of them or none.

    The number of a row identifies its test; several rows of one test are repeats. A row without all
    results is not taken; a sentence says so if it has some. If a variable differs in 15 digits from
    the proposed value, its new value is what was tested. Results that the study has already change
    nothing; other ones correct them.

    Args:
        source: The table of :func:`ask_tests` with results, as a file or a data frame; or ``None``.
        study: The study.
        cancel: Pending tests that will not be made.
        decimal: The decimal mark of a text, if it is not clear.
        sheet: The sheet of a workbook, if it has several.

    Returns:
        Sentences on what was added or corrected, and what is pending. The table ``log`` of the
        study keeps what was replaced or cancelled.

    Raises:
        ArgumentValueError: A row cannot be read, belongs to no proposed test, or may correct any of
            several results.
        StudyError: The study is damaged or cannot be written.
    """
    sentences: list[str] = []
    with Study(study).changes() as database:
        laboratory = _Laboratory(database)
        for test in cancel:
            if test not in laboratory.pending:
                raise invalid("cancel", "the number of a pending test", test, laboratory.left)
            run, proposal = laboratory.proposals.pop(test)
            laboratory.pending.remove(test)
            database.cancel(run, test, proposal.test_point)
        if source is not None:
            units = laboratory.head.get("units", {})
            cells, columns = source_columns(source, units, decimal=decimal, sheet=sheet)
            results = [*_results_in(cells, columns, laboratory, sentences)]
            new = _new_results(laboratory, results)
            if new:
                _keep(database, laboratory, new, sentences)
            n_known = len(results) - len(new)
            sentences.insert(0, f"{counted(len(new), 'test')} taken, {n_known} known already.")
        return [*sentences, f"{laboratory.left.capitalize()}."]


def _text(value: Any) -> str:
    """Return a value as a text, a number in the 15 digits that spreadsheets keep."""
    if isinstance(value, str):
        return value
    return f"{value:.15g}"


def _results_in(
    cells: Any, columns: Entries, laboratory: _Laboratory, remarks: list[str]
) -> Iterator[_Result]:
    """Yield the rows with all results or the reason of a failure.

    Of each: the number of the test; the place in the file, for messages; and the variables and the
    results by name. Outputs that are expressions may be among these. Results of a failed test are
    NaN. ``reason`` is that of a failure, or "".
    """
    kinds = _kinds_of_columns(columns, laboratory, remarks)
    unknown = dict.fromkeys(laboratory.results, np.nan)
    for i in range(len(columns[TEST].cells)):
        place = cells.where(i)
        values = _values_of_row(i, place, columns, kinds, laboratory.choices)
        test = values.pop(TEST, None)
        reason = values.pop(FAILURE, "")
        missing = [name for name in laboratory.results if name not in values]
        has_results = len(missing) < len(laboratory.results)
        if not has_results and not reason:
            continue  # it stays pending
        if has_results and reason:
            rule = "either results or the reason of a failure"
            raise invalid(place, rule, Received(reason), "leave one of them blank")
        # The number of a repeat belongs to the study.
        if test not in laboratory.proposals or laboratory.original(test) != test:
            rule = "that of a test that was asked for and is not cancelled"
            raise invalid(f"{place}, {TEST}", rule, test)
        if missing and not reason:
            remarks.append(f"A row of test {test} is not taken: {', '.join(missing)} is blank.")
            continue
        yield test, place, unknown | laboratory.as_tested(test, values) | {"reason": reason}


def _values_of_row(
    i: int, place: str, columns: Entries, kinds: Mapping[str, Kind], choices: Mapping[str, Names]
) -> Values:
    """Return the values of the i-th row by name, without blank ones."""
    values = {}
    for name, kind in kinds.items():
        cell = columns[name].cells[i]
        if is_blank(cell):
            continue
        if kind not in (Kind.BINARY, Kind.CHOICE):
            cell = columns[name].require_numbers()[i].item()
        values[name] = design_value(cell, f"{place}, {name}", kind, choices.get(name))
    return values


def _kinds_of_columns(
    columns: Entries, laboratory: _Laboratory, remarks: list[str]
) -> dict[str, Kind]:
    """Return the kinds of the columns that are read; a remark names the others.

    Raises:
        ArgumentValueError: A column is missing.
    """
    head = laboratory.head
    kinds = {TEST: Kind.INTEGER, FAILURE: Kind.CHOICE}
    kinds |= dict.fromkeys(laboratory.results, Kind.REAL)
    kinds |= zip(head["variables"], map(Kind, head["kinds"]), strict=True)
    units = head.get("units", {})
    for name in kinds:
        if name not in columns:
            rule = f"one with the column {with_unit(name, units.get(name, ''))}"
            remedy = "'ask --points 0' writes pending tests again"
            raise invalid("the table of results", rule, Received(", ".join(columns)), remedy)
    for name in head.get("expressions", {}):
        if name in columns:  # what people give is compared with what is computed
            kinds.setdefault(name, Kind.REAL)
    others = [name for name in columns if name not in (*kinds, "index")]  # that of a frame
    if others:
        remarks.append(f"Not taken, as they are no outputs of the study: {', '.join(others)}.")
    return kinds


def design_value(cell: Any, place: str, kind: Kind, choices: Names | None) -> Any:
    """Return a cell, which is not blank, as a value of a kind.

    Args:
        cell: The cell; text where the kind is one of numbers is refused.
        place: Where it is, for messages.
        kind: The kind.
        choices: The texts of the options of a choice.
    """
    text = str(cell).strip()
    if kind is Kind.BINARY:
        return _TRUTH_VALUES[known_name(place, text.lower(), _TRUTH_VALUES)]
    if choices is not None:
        return named_option(place, text, choices)
    if kind is Kind.CHOICE:
        return text
    is_number = isinstance(cell, (int, float)) and math.isfinite(cell)
    if not is_number or (kind is Kind.INTEGER and cell % 1):
        raise invalid(place, f"one {kind.value} number", cell)
    if kind is Kind.LOG and cell <= 0:
        raise invalid(place, "above 0, as its scale is logarithmic", cell)
    if kind is Kind.INTEGER:
        return int(cell)
    return cell


def _new_results(laboratory: _Laboratory, results: Sequence[_Result]) -> list[_NewResult]:
    """Return the results that the study does not have, each with the number of what it corrects.

    A row is known if a stored test of its design has the same results; each counts once. Other rows
    correct the stored tests of their design that have no row; the number is ``None`` where there
    are none.

    Raises:
        ArgumentValueError: A test has more results that may be corrected than there are rows.
    """
    former: dict[int, list[int]] = defaultdict(list)  # stored tests without a row, by the original
    for number in laboratory.proposals:
        if number in laboratory.tests:
            former[laboratory.original(number)].append(number)
    unknown: dict[int, list[_Result]] = defaultdict(list)
    for result in results:
        test, _, values = result
        texts = laboratory.texts(values)
        same = [number for number in former[test] if laboratory.tests[number] == texts]
        if same:
            former[test].remove(same[0])
        else:
            unknown[test].append(result)
    new: list[_NewResult] = []
    for test, rows in unknown.items():
        numbers = former[test]
        if len(numbers) > len(rows):
            rule = f"given with all other results of test {test}"
            received = Received(f"a file without those of tests {', '.join(map(str, numbers))}")
            remedy = "add a row for each of them; nothing was taken"
            raise invalid(rows[0][1], rule, received, remedy)
        new += zip_longest(numbers, rows)
    return new


def _keep(
    database: Database,
    laboratory: _Laboratory,
    results: Sequence[_NewResult],
    sentences: list[str],
) -> None:
    """Write the tests of new results, and sentences on what changes."""
    import pandas as pd

    places = []
    rows = []
    for corrected, (test, place, values) in results:
        own = corrected or laboratory.take_pending(database, test)
        sentences += _changes(laboratory, test, own, values)
        if corrected:
            database.correct(corrected, "corrected")
        run, proposal = laboratory.proposals[own]
        facts = {"run": run, "origin": proposal.origin, "seconds": np.nan}
        facts |= {PROPOSAL_ROUND: proposal.round, POINT: proposal.test_point}
        places.append(place)
        rows.append(values | facts)
    frame = pd.DataFrame(rows)
    runs = frame.pop("run").to_numpy()
    if not frame[PROPOSAL_ROUND].any():
        del frame[PROPOSAL_ROUND]
    columns: Columns = {str(name): frame[name].to_numpy() for name in frame}
    columns = with_computed(database.head, columns, places, sentences)
    for run in np.unique(runs).tolist():
        database.append(run, {name: cells[runs == run] for name, cells in columns.items()}, 0)


def _changes(laboratory: _Laboratory, test: int, own: int, values: Values) -> list[str]:
    """Return a sentence on a row that corrects a stored test or has another design than was asked.

    Args:
        laboratory: The tests.
        test: The number in the row.
        own: The number of the test that the row becomes: that one, or a repeat of it.
        values: The values of the row by name.
    """
    former = laboratory.tests.get(own)
    title = f"Test {own} corrected"
    end = "."
    if former is None:
        former = {name: _text(value) for name, value in laboratory.design(test).items()}
        title = f"Test {own}"
        if own != test:
            title += f", a repeat of {test}"
        end = "; what was tested counts."
    changes = []
    texts = laboratory.texts(values)
    for name, text in former.items():
        if texts[name] != text and "nan" not in (texts[name], text):  # those of a failed test
            changes.append(f"{name} = {texts[name] or 'none'} instead of {text or 'none'}")
    if not changes:
        return []
    return [f"{title}: {'; '.join(changes)}{end}"]


def with_computed(
    head: Entries, columns: Columns, places: Sequence[str], remarks: list[str]
) -> Columns:
    """Return variables and results with what follows from them.

    This is the status, the outputs that are expressions, and the requirements.

    Args:
        head: The head of the study.
        columns: The variables, the results and ``reason``. Outputs that are expressions may be
            given; a remark says where they differ from the computed ones, which count.
        places: Where the tests are in their source.
        remarks: The remarks, to which some are added.
    """
    has_failed = columns["reason"] != ""
    columns = columns | {"status": np.where(has_failed, "failed", "ok")}
    variables = head["variables"]
    operands = with_options(columns, variables, [*map(Kind, head["kinds"])])
    for name, expression in head.get("expressions", {}).items():
        if not expression:
            continue
        values = np.where(has_failed, np.nan, Expression.of(expression).values(operands))
        given = columns.get(name, values)
        differs = ~np.isclose(given, values, rtol=ROUNDED, atol=0) & ~np.isnan(given)
        if differs.any():
            row = int(differs.argmax())  # the first one
            remarks.append(
                f"{name} of {counted(differs.sum(), 'test')} is given otherwise than computed from "
                f"{expression}, which counts: {given[row]:.6g} in {places[row]}, computed "
                f"{values[row]:.6g}."
            )
        columns[name] = values
        operands[name] = values
    if "requirements" in head:
        names = head["requirements"]["variables"]
        designs = {name: operands[column] for name, column in zip(names, variables, strict=True)}
        for requirement in requirements_of(head["requirements"]["rules"], names):
            columns[requirement.name] = requirement.violation(designs)
    return columns
