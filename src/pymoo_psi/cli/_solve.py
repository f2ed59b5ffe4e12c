"""``pymoo-psi solve``, ``ask`` and ``tell``: from a problem to tests and its ranked Pareto set."""

from __future__ import annotations

import webbrowser
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from pymoo.core.problem import Problem

from pymoo_psi._kinds import Kind
from pymoo_psi._output import with_unit
from pymoo_psi._validation import Received, counted, invalid
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
    say_next,
    say_ranking,
    shortened,
    write_frame,
)
from pymoo_psi.cli._documents import write_ranking
from pymoo_psi.cli._problem import load_problem, runner_of, try_program, write_example
from pymoo_psi.cli._source import (
    decision_in,
    require_free_names,
    typed_options,
)
from pymoo_psi.files import read_table, suffixes_for
from pymoo_psi.pareto import cautions_of_distances
from pymoo_psi.problems import (
    FailureTolerant,
    design_space,
    problem_name,
    require_model,
    with_requirements,
)
from pymoo_psi.study import Study
from pymoo_psi.table import Formulation, Limit, TestTable

if TYPE_CHECKING:
    import pandas as pd

_N_REASONS = 3  # most frequent reasons of failures
_LONGEST = 120  # characters of a reason, so that three of them stay readable
_POINTS = {"psi": 4096, "surrogate": 256, "nsga3": 4096}
_POINTS_OF_PROGRAM = 128
_KEYWORDS = ("sampling", "seed", "repeat", "study", "study_key", "retry", "share")
_OF_STUDY = ("share", "study_key", "retry", "source", "live")  # options that need one
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
        former: The same of the tests that the study had before, if there were any.
    """

    tests: TestTable
    table: TestTable
    n_evaluated: int
    former: Result | None = None


def run_solve(options: Options) -> int:
    """Search, write the Pareto set if a file is named, and print the best designs.

    Returns:
        0, or 1 if no design is feasible or the trial of a program fails.
    """
    if options.new:
        return write_example(options.problem)
    n_points, settings = _settings(options)  # before a user's model is imported
    problem = load_problem(
        options,
        options.timeout,
        bounds=options.bounds,
        log=options.log,
        noisy=options.noisy,
    )
    require_model(problem)
    if options.trial:
        return try_program(problem, options)
    out = options.out
    if out is not None:
        inputs = (options.study, options.decision, options.source)
        out = require_output(out, suffixes_for("designs"), *inputs)
    settings = _prepared(options, problem, settings)  # after this only the search can fail
    subject = str(options.study or f"{problem_name(problem)} by {options.algorithm}")
    study = options.study and options.study.absolute()  # a model may change the working directory
    known = _known_tests(options.study)
    result = _search(options, problem, n_points, settings)
    if study is not None:
        result = _with_all_tests(result, problem, settings, study, known)
    if not result.table.feasible().any():
        say(f"{subject}: No design is left: {none_left_reason(result.table)}")
        say(*result.table.remarks, *_reasons(result.tests))
        if out is not None:
            say(f"{options.out} is not written.")
        return 1
    if out is not None:
        write_ranking(result.table, out, only_pareto=True)
    _say_result(options, problem, subject, result)
    return 0


# What can be refused before the search


def _settings(options: Options) -> tuple[int, RunOptions]:
    """Return how many points are asked for, and how; refuse options that have no effect."""
    settings = _run_options(options)
    algorithm = options.algorithm
    for algorithms, names, remedy in _USED_BY:
        words = typed_options(options, names)
        if words and algorithm not in algorithms:
            rule = f"{' or '.join(algorithms)} if {words[0]} is given"
            raise invalid("--algorithm", rule, algorithm, remedy)
    default = _POINTS[algorithm]
    if options.problem.endswith(".toml"):
        default = _POINTS_OF_PROGRAM
    n_points, more = options.points or (default, False)
    if more and algorithm == "nsga3":
        raise invalid("--algorithm", "psi or surrogate for --points +N", algorithm)
    words = typed_options(options, _OF_STUDY)
    if words and options.study is None:
        raise invalid(words[0], "used with --study", Received("no --study"))
    return n_points, replace(settings, more=more)


def _run_options(options: Options) -> RunOptions:
    """Return the options of a run that a command has, with the formulation of the others."""
    keywords = {name: value for name, value in vars(options).items() if name in _KEYWORDS}
    return RunOptions(**keywords, formulation=decision_in(options).formulation)


def _prepared(options: Options, problem: Problem, settings: RunOptions) -> RunOptions:
    """Return the settings with formulation and runner, once the tests of ``--from`` are there."""
    model = Model(problem, settings)
    require_free_names((*model.schema.names, *model.formulation.computed))
    runner = runner_of(problem, options)
    if problem.elementwise and runner is not None:
        problem.elementwise_runner = runner  # pymoo's place for it
        runner = None
    _import(problem, options, settings)
    return replace(settings, formulation=model.formulation, runner=runner)


def _import(problem: Problem, options: Options, run: RunOptions) -> None:
    """Take the tests of ``--from`` into the study, if it is given."""
    if options.source is not None:
        taken, *remarks = import_tests(problem, options.source, run).remarks
        say(f"{options.source}: {taken}", *remarks)


# The search


def _search(options: Options, problem: Problem, n_points: int, settings: RunOptions) -> Result:
    """Search, and show the progress; an interrupt says how the search continues."""
    search = {"psi": _by_psi, "surrogate": _by_surrogate, "nsga3": _by_nsga3}[options.algorithm]
    try:
        with stored_at_termination(), _watched(options), progress_bar(True) as show:
            return search(problem, n_points, settings, show)
    except KeyboardInterrupt:
        place = f"see {options.study};"
        if options.study is None:
            place = "nothing is kept; with --study FILE.db"
        raise KeyboardInterrupt(f"{place} the same command continues") from None


def _with_all_tests(
    result: Result, problem: Problem, settings: RunOptions, study: Path, known: list[int]
) -> Result:
    """Return the result of all tests of a study, and that of those which it had before."""
    tests = read_table(study, average_by=False)
    result = _result(problem, settings, tests, result.n_evaluated)
    is_known = np.isin(tests.numbers, known)
    if is_known.any():
        former = _result(problem, settings, tests.take(is_known), 0)
        result = replace(result, former=former)
    return result


def _known_tests(study: Path | None) -> list[int]:
    """Return the numbers of the tests that a study has, if there is one."""
    if study is None or not study.is_file():
        return []
    with Study(study).reading() as database:
        return [*database.test_numbers()]


def _watched(options: Options) -> AbstractContextManager[Any]:
    """Show the run in the browser if that is asked for, and until it ends."""
    if not options.live:
        return nullcontext()
    from pymoo_psi.server import live  # imports the page

    view = live(options.study, steer=True)
    say(view.address)
    webbrowser.open(view.address)
    return view


def _by_psi(problem: Problem, n_points: int, settings: RunOptions, show: Show) -> Result:
    # On arrays, not by `PSI`: pymoo's objects for a million designs take minutes. Blocks are small
    # enough for the bar to move.
    block_size = min(65_536, max(64, -(-n_points // 32)))
    statuses: Counter[str] = Counter()
    called = []

    def tested(run: Run) -> TestTable:
        tests = _tests_of(run, show, statuses)
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
    tests = _tests_of(run, show, Counter())
    return _result(problem, settings, tests, run.n_called)


def _tests_of(run: Run, show: Show, statuses: Counter[str]) -> TestTable:
    """Return all tests of a run by number; show how many are done, feasible and failed.

    Args:
        run: The run.
        show: Shows a share and a note.
        statuses: How many earlier tests have which status; those of the run are added.
    """
    tables = [run.store.empty]
    with closing(run.tests()) as blocks:
        for tests in blocks:
            tables.append(tests)
            statuses.update(run.model.under_so_far(tests).status.tolist())
            n_tests = statuses.total()
            note = f"{statuses['ok']} feasible, {statuses['failed']} failed"
            show(n_tests / max(1, n_tests + run.n_left), note)
    return by_number(tables)


def _result(problem: Problem, settings: RunOptions, tests: TestTable, n_evaluated: int) -> Result:
    """Return the result of tests all of which are ranked."""
    model = Model(problem, settings)
    tests = model.under_so_far(tests)
    table = tests
    if getattr(problem, "noisy", False):
        table = model.under_so_far(averaged_repeats(tests))
    return Result(tests, table, n_evaluated)


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
    table = result.table.take(is_returned)
    n_tests = counted(len(tests), "test")
    remark = f"{n_tests} in all, {counted(len(table), 'design')} ranked."
    return replace(result, table=replace(table, remarks=(remark, *table.remarks)))


# The result


def _say_result(options: Options, problem: Problem, subject: str, result: Result) -> None:
    """Print the ranking, what this run has added to a study, why tests failed, and what is next.

    Args:
        options: The options.
        problem: The problem.
        subject: The study, or the problem and the algorithm.
        result: The tests.
    """
    table = result.table
    ranking = table.feasible_ranking()
    head = [*table.remarks, counts_sentence(table, subject)]
    if result.former is not None:
        head.append(_added(result, result.former))
    proposed = int(ranking.rows[ranking.salukvadze[0]])
    notes = _beyond_bounds(problem, table.take([proposed]))
    notes += _reasons(result.tests)
    if options.out is not None:
        notes.append(f"{counted(int(ranking.pareto.sum()), 'design')} written to {options.out}.")
    source = _source_of(options)
    following = command("pymoo-psi", "page", *source)
    if options.study is None and options.out is None:
        first, *others = command("pymoo-psi", *options.context.obj, "--study", source[0])
        following = [f"keep every test by {first}", *others]
    say_ranking(
        table,
        cautions_of_distances(ranking),
        head,
        notes,
        following,
        all_by=" ".join(command("pymoo-psi", "rank", *source, "--long")),
        out=options.out,
    )


def _source_of(options: Options) -> list[str]:
    """Return the words by which other commands open the result: a study keeps no formulation."""
    if options.study is None and options.out is not None:
        return [str(options.out)]
    return [str(options.study or "FILE.db"), *typed_options(options, OF_FORMULATION)]


def _added(result: Result, former: Result) -> str:
    """Return what this run has added to the tests of a study, and whether the proposal is new."""
    table = result.table
    n_new = len(result.tests) - len(former.tests)
    if not n_new and result.n_evaluated:
        return f"This run: no new test, {result.n_evaluated} evaluated again."
    if not n_new:
        return "This run: no new test."
    ranking = table.feasible_ranking()
    text = f"This run: {counted(n_new, 'test')}"
    if len(table) == len(result.tests):  # no means of several tests
        is_new = ~np.isin(table.numbers[ranking.rows], former.tests.numbers)
        text += f", {(is_new & ranking.pareto).sum()} of them not dominated"
    n_again = result.n_evaluated - n_new
    if n_again > 0:  # the former tests are no longer as they were
        text += f"; {n_again} evaluated again"
    elif former.table.feasible().any():
        before = former.table.feasible_ranking()
        proposed = before.name_of(before.salukvadze[0])
        if proposed == ranking.name_of(ranking.salukvadze[0]):
            text += "; the proposal is as before"
        else:
            text += f"; the proposal is new (before: {proposed})"
    return f"{text}."


def _beyond_bounds(problem: Problem, proposed: TestTable) -> list[str]:
    """Say that the proposal, a test of a former run, is outside the bounds; say the remedy."""
    limits = []
    for variable in design_space(problem).variables:
        if variable.kind is Kind.CHOICE or variable.title not in proposed.columns:
            continue
        value = proposed.column(variable.title)[0]
        rounding = 1e-9 * (abs(variable.lower) + abs(variable.upper))
        if value > variable.upper + rounding:
            limits.append(Limit(upper=variable.upper).written(variable.title))
        elif value < variable.lower - rounding:
            limits.append(Limit(lower=variable.lower).written(variable.title))
    if not limits:
        return []
    texts = f'--limits "{", ".join(limits)}"'
    return [f"Caution: The proposal is outside the bounds of the problem; exclude it by {texts}."]


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
    run = _run_options(options)
    if run.formulation != Formulation() and not with_surrogates:
        rule = "surrogate for designs that a decision, objectives or limits direct"
        raise invalid("--algorithm", rule, options.algorithm)
    problem = load_problem(options, bounds=options.bounds, log=options.log)
    if options.out.exists():
        remedy = "it may hold results: add them by 'pymoo-psi tell', or choose another name"
        raise invalid("--out", "the name of a new file", str(options.out), remedy)
    out = require_output(options.out, suffixes_for("designs"), options.study)
    _import(problem, options, run)
    frame = ask_tests(problem, options.points, run, with_surrogates=with_surrogates)
    write_frame(_to_fill_in(frame, options.study), out)
    say(f"{counted(len(frame), 'design')} to test written to {options.out}.")
    say("Fill in the results, or why a test failed.")
    say_next(command("pymoo-psi", "tell", str(options.out), "--study", str(options.study)))
    return 0


def _to_fill_in(designs: pd.DataFrame, study: Path) -> pd.DataFrame:
    """Return designs to test with the units of their study, in 15 digits: no rounding errors."""
    for name in designs.select_dtypes("float"):
        designs[name] = [float(f"{value:.15g}") for value in designs[name]]
    units = Study(study).facts().head.get("units", {})
    return designs.rename(columns=lambda name: with_unit(name, units.get(name, "")))


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
