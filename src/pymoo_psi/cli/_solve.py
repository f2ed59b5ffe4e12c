"""``pymoo-psi solve``, ``ask`` and ``tell``: from a problem to tests and its ranked Pareto set."""

from __future__ import annotations

import shlex
import warnings
import webbrowser
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click
import numpy as np
from pymoo.core.problem import Problem

from pymoo_psi._output import with_unit
from pymoo_psi._validation import Integers, Mask, Names, Received, counted, invalid
from pymoo_psi.algorithms import (
    Model,
    Recorded,
    Run,
    RunOptions,
    ask_tests,
    by_number,
    import_tests,
    nsga3,
    progress_bar,
    repeated_tests,
    stored_at_termination,
    tell_tests,
)
from pymoo_psi.analysis import (
    alike,
    averaged_repeats,
    counts_sentence,
    failure_sentences,
    none_left_reason,
)
from pymoo_psi.cli._app import OF_FORMULATION, Options
from pymoo_psi.cli._console import (
    command,
    require_output,
    say,
    say_ranking,
    shortened,
    write_frame,
)
from pymoo_psi.cli._documents import write_ranking
from pymoo_psi.cli._problem import load_problem, set_runner, try_program, write_example
from pymoo_psi.cli._source import (
    decision_in,
    require_free_names,
    typed_options,
)
from pymoo_psi.files import read_table, suffixes_for
from pymoo_psi.pareto import cautions_of_distances
from pymoo_psi.problems import (
    FailureTolerant,
    problem_name,
    require_model,
    with_requirements,
)
from pymoo_psi.study import Study
from pymoo_psi.table import Formulation, TestTable

_N_REASONS = 3  # most frequent reasons of failures
_LONGEST = 120  # characters of a reason, so that three of them stay readable
_POINTS = {"psi": 4096, "surrogate": 256, "nsga3": 4096}
_POINTS_OF_PROGRAM = 128
_KEYWORDS = ("sampling", "seed", "repeat", "study", "study_key", "retry", "share")
_OF_STUDY = ("share", "study_key", "retry", "from", "live")  # options that need one
_RANKED_LATER = "keep the tests by --study FILE.db, then pymoo-psi rank FILE.db"
# Algorithms, the options that the others do not use, and what to do instead.
_USED_BY = (
    (("psi",), ("share", "repeat"), ""),
    (("psi", "surrogate"), ("sampling",), ""),
    (("psi", "surrogate"), OF_FORMULATION, _RANKED_LATER),
)

Show = Callable[..., None]
"""Shows a share of 1, and a note, on a progress bar."""


@dataclass(frozen=True)
class Result:
    """The result of a search.

    Attributes:
        tests: All tests that were asked for, those of the study too.
        table: What is ranked: the tests, the means of repeated ones, or the designs that NSGA-III
            returns.
        n_evaluated: How many designs this command has evaluated.
    """

    tests: TestTable
    table: TestTable
    n_evaluated: int


def run_solve(options: Options) -> int:
    """Search, write the Pareto set if a file is named, and print the best designs.

    Returns:
        0, or 1 if no design is feasible or the trial of a program fails.
    """
    if options.new:
        return write_example(options.problem)
    formulation = decision_in(options).formulation  # before a user's model is imported
    n_points, more = options.points or (_POINTS[options.algorithm], False)
    if not options.points and options.problem.endswith(".toml"):
        n_points = _POINTS_OF_PROGRAM
    _require_effect(options, more)
    keywords = {name: getattr(options, name) for name in _KEYWORDS}
    settings = RunOptions(**keywords, more=more, formulation=formulation)
    problem = load_problem(
        options.problem,
        options.timeout,
        bounds=options.bounds,
        log=options.log,
        noisy=options.noisy,
    )
    require_model(problem)
    if getattr(options, "try"):  # a keyword of Python, as "from" is
        return try_program(options.problem, problem, n_points)
    out = options.out
    if out is not None:
        inputs = (options.study, options.decision, getattr(options, "from"))
        out = require_output(out, suffixes_for("designs"), *inputs)
    model = Model(problem, settings)  # after this only the search can fail
    require_free_names((*model.schema.names, *model.formulation.computed))
    runner = set_runner(problem, options)
    _import(problem, options, settings)
    settings = replace(settings, formulation=model.formulation, runner=runner)
    study = options.study and options.study.absolute()  # a model may change the working directory
    known = _known_tests(options.study)
    result = _search(options, problem, n_points, settings)
    subject = f"{problem_name(problem)} by {options.algorithm}"
    if study is not None:
        subject = str(options.study)
        tests = read_table(study, average_by=False)
        result = _result(problem, settings, tests, result.n_evaluated)
    is_new = ~np.isin(result.tests.numbers, known)
    reasons = _reasons(result.tests)
    if not result.table.feasible().any():
        say(
            f"{subject}: No design is left: {none_left_reason(result.table)}", *result.table.remarks
        )
        say(*reasons)
        if out is not None:
            say(f"{options.out} is not written.")
        return 1
    if out is not None:
        write_ranking(result.table, out, only_pareto=True)
    _say_result(options, subject, result, is_new, reasons)
    return 0


# What can be refused before the search


def _require_effect(options: Options, more: bool) -> None:
    """Refuse options that would have no effect."""
    algorithm = options.algorithm
    for algorithms, names, remedy in _USED_BY:
        words = typed_options(names)
        if words and algorithm not in algorithms:
            rule = f"{' or '.join(algorithms)} if {words[0]} is given"
            raise invalid("--algorithm", rule, algorithm, remedy)
    if more and algorithm == "nsga3":
        raise invalid("--algorithm", "psi or surrogate for --points +N", algorithm)
    words = typed_options(_OF_STUDY)
    if words and options.study is None:
        raise invalid(words[0], "used with --study", Received("no --study"))


def _import(problem: Problem, options: Options, run: RunOptions) -> None:
    """Take the tests of ``--from`` into the study, if it is given."""
    source = getattr(options, "from")
    if source is None:
        return
    taken, *remarks = import_tests(problem, source, run).remarks
    say(f"{source}: {taken}", *remarks)


# The search


def _search(options: Options, problem: Problem, n_points: int, settings: RunOptions) -> Result:
    """Search; an interrupt says how the search continues."""
    search = {"psi": _by_psi, "surrogate": _by_surrogate, "nsga3": _by_nsga3}[options.algorithm]
    try:
        with stored_at_termination(), _watched(options), progress_bar(True) as show:
            return search(problem, n_points, settings, show)
    except KeyboardInterrupt:
        place = f"see {options.study};"
        if options.study is None:
            place = "nothing is kept; with --study FILE.db"
        raise KeyboardInterrupt(f"{place} the same command continues") from None


def _watched(options: Options) -> AbstractContextManager[Any]:
    """Show the run in the browser if that is asked for, and until it ends."""
    if not options.live:
        return nullcontext()
    from pymoo_psi.server import live  # imports the page

    view = live(options.study, steer=True)
    say(view.address)
    webbrowser.open(view.address)
    return view


def _under(tests: TestTable, settings: RunOptions) -> TestTable:
    """Return tests under the formulation of a run, as far as it can be applied."""
    # The first tests may all have failed or not been run; their outputs are then unknown.
    has_values = (tests.status != "failed") & np.isfinite(tests.F).any(axis=1)
    if not has_values.any():
        return tests
    return tests.under(settings.formulation)


def _by_psi(problem: Problem, n_points: int, settings: RunOptions, show: Show) -> Result:
    # On arrays, not by `PSI`: pymoo's objects for a million designs take minutes. Blocks are small
    # enough for the bar to move.
    block_size = min(65_536, max(64, -(-n_points // 32)))
    statuses: Counter[str] = Counter()
    called = []

    def tested(run: Run) -> TestTable:
        tests = _tests_of(run, settings, show, statuses)
        called.append(run.n_called)
        return tests

    run_options = replace(settings, block_size=block_size)
    _, tests = repeated_tests(tested, problem, n_points, run_options)
    return _result(problem, settings, tests, sum(called))


def _by_surrogate(problem: Problem, n_points: int, settings: RunOptions, show: Show) -> Result:
    from pymoo_psi.algorithms import SurrogatePSI  # imports half of SciPy, which takes a second

    algorithm = SurrogatePSI(n_points)
    algorithm.problem = problem
    algorithm.seed = settings.seed
    run = algorithm.begin(replace(settings, runner=None))
    tests = _tests_of(run, settings, show, Counter())
    return _result(problem, settings, tests, run.n_called)


def _tests_of(run: Run, settings: RunOptions, show: Show, statuses: Counter[str]) -> TestTable:
    """Return all tests of a run by number; show how many are done, feasible and failed.

    Args:
        run: The run.
        settings: Its options.
        show: Shows a share and a note.
        statuses: How many earlier tests have which status; those of the run are added.
    """
    tables = [run.store.empty]
    with closing(run.tests()) as blocks:
        for tests in blocks:
            tables.append(tests)
            statuses.update(_so_far(run, tests, settings).status.tolist())
            n_tests = statuses.total()
            note = f"{statuses['ok']} feasible, {statuses['failed']} failed"
            show(n_tests / max(1, n_tests + run.n_left), note)
    return by_number(tables)


def _so_far(run: Run, tests: TestTable, settings: RunOptions) -> TestTable:
    """Return some tests of a run under the formulation.

    A column that they lack is refused at once, as its name is wrong. Where designs are evaluated
    one by one it may be an output of others: if a study keeps the tests and no name is similar, a
    warning names it, and all tests decide in the end.
    """
    unknown = {*run.model.formulation.columns} - {*tests.schema.names}
    is_misspelt = any(get_close_matches(name, tests.schema.names) for name in unknown)
    may_follow = settings.study is not None and run.executor.has_designs and not is_misspelt
    if unknown and may_follow and np.isfinite(tests.F).any():
        warnings.warn(f"no test has {', '.join(sorted(unknown))} so far", stacklevel=2)
        return run.model.under_so_far(tests)
    return _under(tests, settings)


def _result(problem: Problem, settings: RunOptions, tests: TestTable, n_evaluated: int) -> Result:
    """Return the result of tests all of which are ranked."""
    under = _under(tests, settings)
    if getattr(problem, "noisy", False):
        return Result(under, _under(averaged_repeats(tests), settings), n_evaluated)
    return Result(under, under, n_evaluated)


def _by_nsga3(problem: Problem, n_points: int, settings: RunOptions, show: Show) -> Result:
    with TemporaryDirectory() as folder:
        # A design that fails must neither end the run nor give NSGA-III a NaN to sort. If the user
        # names no study, a temporary one keeps the tests for the table.
        recorded = Recorded(
            FailureTolerant(with_requirements(problem)),
            study=settings.study or Path(folder, "tests.db"),
            study_key=settings.study_key,
            retry=settings.retry,
        )

        def callback(algorithm: Any) -> None:
            show(algorithm.evaluator.n_eval / n_points)

        outcome = nsga3(recorded, n_evaluations=n_points, seed=settings.seed, callback=callback)
        table = recorded.table
    tests = table.take(np.isin(table.numbers, [*recorded.returned]))
    result = _result(problem, settings, tests, recorded.n_evaluated)
    # pymoo has no F if no design is feasible.
    designs = outcome.pop if outcome.F is None else outcome.opt
    is_returned = np.isin(tests.numbers, designs.get("test_point"))
    return replace(result, table=result.table.take(is_returned))


# The result


def _known_tests(study: Path | None) -> Integers:
    """Return the numbers of the tests that a study has, if there is one."""
    if study is None or not study.is_file():
        return np.empty(0, dtype=np.int64)
    with Study(study).reading() as database:
        return database.test_numbers()


def _say_result(
    options: Options, subject: str, result: Result, is_new: Mask, reasons: Names
) -> None:
    """Print the ranking, what this run has added to a study, why tests failed, and what is next.

    Args:
        options: The options.
        subject: The study, or the problem and the algorithm.
        result: The tests.
        is_new: ``(n,)`` which tests of the result this run has added.
        reasons: Why tests failed.
    """
    table = result.table
    ranking = table.feasible_ranking()
    found = cautions_of_distances(ranking)
    head = [*table.remarks, counts_sentence(table, subject)]
    if len(table) < len(result.tests):
        n_tests = counted(len(result.tests), "test")
        head.insert(0, f"{n_tests} in all, {counted(len(table), 'design')} ranked.")
    if not is_new.all():
        head.append(_added(result, is_new))
    notes = [*reasons]
    more = ": --out FILE.csv"
    if options.out is not None:
        more = ""
        notes.append(f"{counted(int(ranking.pareto.sum()), 'design')} written to {options.out}.")
    formulated = typed_options(OF_FORMULATION)
    if options.study is not None:
        following = command("pymoo-psi", "page", str(options.study), *formulated)
    elif options.out is not None:
        following = command("pymoo-psi", "page", str(options.out))
    else:
        typed = click.get_current_context().obj  # again, but the study keeps the tests
        following = command("pymoo-psi", *typed, "--study", "FILE.db")
    where = f"pymoo-psi rank {options.study or options.out or 'FILE'} --long"
    say_ranking(table, found, head, notes, following, all_by=where, more=more)


def _added(result: Result, is_new: Mask) -> str:
    """Return what this run has added to the tests of a study, and whether the proposal is new."""
    table = result.table
    n_new = int(is_new.sum())
    if not n_new:
        again = f", {result.n_evaluated} evaluated again" if result.n_evaluated else ""
        return f"This run: no new test{again}."
    added = np.isin(table.numbers, result.tests.numbers[is_new])
    ranking = table.feasible_ranking()
    n_optimal = (added[ranking.rows] & ranking.pareto).sum()
    verb = "is" if n_optimal == 1 else "are"
    text = f"This run: {counted(n_new, 'test')}, of which {n_optimal} {verb} not dominated"
    before = table.take(~added)
    if before.feasible().any():
        (former,) = before.best().names
        if former == ranking.name_of(ranking.salukvadze[0]):
            text += "; the proposal is as before"
        else:
            text += f"; the proposal is new (before: {former})"
    return f"{text}."


def _reasons(tests: TestTable) -> list[str]:
    """Say how many tests have failed and why, the most frequent reason first."""
    failures = Counter(alike(tests.reasons.values()))
    if not failures:
        return []
    # At the end of a reason is the folder of a failed program.
    texts = [shortened(reason, _LONGEST) for reason, _ in failures.most_common(_N_REASONS)]
    if len(failures) > _N_REASONS:
        texts.append(counted(len(failures) - _N_REASONS, "other reason"))
    text = f"Caution: {failures.total()} of {counted(len(tests), 'test')} failed"
    return [" ".join([f"{text}: {'; '.join(texts)}.", *failure_sentences(tests)])]


# Tests that people make


def run_ask(options: Options) -> int:
    """Write designs to test into a new file.

    Returns:
        0.
    """
    with_surrogates = options.algorithm == "surrogate"
    formulation = decision_in(options).formulation
    if formulation != Formulation() and not with_surrogates:
        rule = "surrogate for designs that a decision, objectives or limits direct"
        raise invalid("--algorithm", rule, options.algorithm)
    problem = load_problem(options.problem, bounds=options.bounds, log=options.log)
    out = require_output(options.out, suffixes_for("designs"), options.study)
    if options.out.exists():  # it may hold results that nobody has told yet
        raise invalid("--out", "the name of a new file", str(options.out))
    run = RunOptions(
        study=options.study,
        study_key=options.study_key,
        seed=options.seed,
        formulation=formulation,
    )
    _import(problem, options, run)
    frame = ask_tests(problem, options.points, run, with_surrogates=with_surrogates)
    for name in frame.select_dtypes("float"):  # in 15 digits, without those of rounding errors
        frame[name] = [float(f"{value:.15g}") for value in frame[name]]
    units = Study(options.study).facts().head.get("units", {})
    write_frame(frame.rename(columns=lambda name: with_unit(name, units.get(name, ""))), out)
    study = shlex.quote(str(options.study))
    file = shlex.quote(str(options.out))
    say(f"{counted(len(frame), 'design')} to test written to {options.out}.")
    say("Fill in the results, or why a test failed.")
    say(f"Next: pymoo-psi tell {file} --study {study}")
    return 0


def run_tell(options: Options) -> int:
    """Take results into a study, and cancel tests.

    Returns:
        0.
    """
    sentences = tell_tests(
        options.file,
        options.study,
        cancel=options.cancel or (),
        decimal=options.decimal,
        sheet=options.sheet,
    )
    say(*sentences)
    return 0
