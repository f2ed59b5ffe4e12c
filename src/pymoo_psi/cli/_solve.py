"""``pymoo-psi solve``: from the problem that a word names to its ranked Pareto set."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.algorithms import (
    Engine,
    Recorded,
    RunOptions,
    by_number,
    nsga3,
    stored_at_termination,
)
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._output import require_output, say, write_frame
from pymoo_psi.cli._problem import load_problem, try_program, write_example
from pymoo_psi.cli._rank import designs_frame, most_violated, say_best
from pymoo_psi.cli._source import counts_in, formulation_of, require_free_names
from pymoo_psi.parallel import progress_bar
from pymoo_psi.problems import FailureTolerant, design_space, problem_layout, problem_name, required
from pymoo_psi.sequences import MAX_DIMENSIONS
from pymoo_psi.table import Formulation, TestTable, alike

_REASONS = 3  # of failures, the most frequent ones
_LONGEST = 120  # characters of a reason, so that three of them stay readable
_POINTS = {"psi": 4096, "surrogate": 256, "nsga3": 4096}
_POINTS_OF_PROGRAM = 128

Show = Callable[..., None]
# What a search found: the tests, under what was asked (of NSGA-III the designs that it returned),
# how many designs were tested, stored before and failed, in words, and why they failed.
Found = tuple[TestTable, str, Collection[str]]


def run_solve(options: Options) -> int:
    """Search, write the Pareto set if a file is named, and print the best-ranked designs.

    Returns:
        0, or 1 if no design is feasible, or what is tried does not work.
    """
    if options.new:
        return write_example(options.problem)
    algorithm, out = options.algorithm, options.out
    program = options.problem.endswith(".toml")
    points = options.points or (_POINTS_OF_PROGRAM if program else _POINTS[algorithm])
    run = _run_options(options)  # wrong ones are refused before a model is imported
    problem = load_problem(
        options.problem, options.jobs, options.timeout, box=options.box, log=options.log
    )
    if vars(options)["try"]:  # a word of Python
        return try_program(options.problem, problem, points)
    target = require_output(out, (".csv", ".xlsx"), options.study, options.decision)
    asked, space = formulation_of(options), design_space(problem)
    require_free_names((*problem_layout(problem, space).columns, *asked.computed))
    find = {"psi": _by_psi, "surrogate": _by_surrogate, "nsga3": _by_nsga3}[algorithm]
    try:
        with stored_at_termination(), progress_bar(True) as show:
            table, counts, reasons = find(problem, points, options.jobs, run, asked, show)
    except KeyboardInterrupt:
        kept = "nothing is kept; with --study FILE.db" if run.study is None else f"see {run.study};"
        raise KeyboardInterrupt(f"{kept} the same command continues") from None
    if not table.eligible().any():
        say(f"{problem_name(problem)}: no feasible design, {counts}")
        say(f"{most_violated(table)}.")
        for line in _failures(reasons):
            say(line)
        if out is not None:
            say(f"{out} is not written.")
        return 1
    rows, ranking = table.ranked(normalize=asked.normalize)
    designs = table.rows(rows)
    frame = designs_frame(designs, ranking)
    frame = frame[frame["pareto"]]
    if target is not None:  # before anything is printed, which may fail
        write_frame(frame.drop(columns="pareto"), target, designs.layout)
    size = counted(len(frame), "Pareto-optimal design")
    title = f"{problem_name(problem)} by {algorithm}: {size}, {counts}, best compromises first"
    shown = frame.rename(columns=designs.layout.label_of)
    say_best(shown, title, ranking, designs.layout.units, out)
    for line in (*table.remarks, *_failures(reasons)):
        say(line)
    ends = zip(table.layout.variables, *table.refined_bounds(), strict=True)
    # Not of choices, where the bounds are NaN, and of fixed variables.
    box = ",".join(f"{name}={low}:{high}" for name, low, high in ends if low < high)
    if asked.limits and box and not options.box:
        say(f"Where the feasible designs lie: --box {shlex.quote(box)}")
    n_free = len(space.searched)
    if algorithm != "nsga3" and run.sampling is None and n_free > MAX_DIMENSIONS:
        say(f"More variables than LPτ has, {n_free}: the test points are Sobol' points of SciPy.")
    return 0


def _run_options(options: Options) -> RunOptions:
    """Return the options of the run.

    Raises:
        ArgumentValueError: An option would have no effect, or cannot be read.
    """
    # nsga3 and surrogate search by the problem's objectives; a table can be asked anything.
    later = ("objectives", "maximize", "compute", "decision", "limits")
    for name in (*later, "share", "fill", "sampling"):
        algorithms = ("psi", "surrogate") if name in ("limits", "sampling") else ("psi",)
        if getattr(options, name) not in (None, (), False, "lptau") and (
            options.algorithm not in algorithms
        ):
            option, rule = f"--{name}", f"used with --algorithm {' or '.join(algorithms)}"
            remedy = f"keep the tests by --study FILE.db, then pymoo-psi rank FILE.db {option}"
            raise invalid(option, rule, options.algorithm, remedy if name in later else "")
    for name in ("share", "study_key", "retry"):
        if getattr(options, name) is not None and options.study is None:
            option = f"--{name.replace('_', '-')}"
            raise invalid(option, "used with --study", Received("no --study"))
    share: Any = counts_in("--share", options.share, "k/n, the k-th of n parts", mark="/")
    return RunOptions(
        sampling=None if options.sampling == "lptau" else options.sampling,
        seed=options.seed,
        share=share or None,
        fill=options.fill,
        study=options.study,
        study_key=options.study_key,
        retry=options.retry,
    )


def _counting(show: Show, points: int, asked: Formulation) -> Callable[[TestTable], int]:
    """Return a function that shows more tests and returns their number so far.

    A column that they lack is refused at the first of them.
    """
    statuses: Counter[str] = Counter()

    def count(tests: TestTable) -> int:
        statuses.update(_under(tests, asked).status.tolist())
        done = statuses.total()
        show(done / points, f"{statuses['ok']} feasible, {statuses['failed']} failed")
        return done

    return count


def _under(tests: TestTable, asked: Formulation) -> TestTable:
    # Of tests that all failed or were not run, as the first ones may, the outputs are unknown.
    run = (tests.status != "failed") & np.isfinite(tests.F).any(axis=1)
    return tests.under(asked) if run.any() else tests


def _by_psi(
    problem: Problem, points: int, jobs: int, run: RunOptions, asked: Formulation, show: Show
) -> Found:
    # On arrays, not by `PSI`: pymoo's objects for a million designs take minutes. Blocks are so
    # small that the bar moves; a problem of one design at a time has a runner with the jobs.
    run = replace(run, block_size=min(65_536, max(64, -(-points // 32))))
    engine = Engine(problem, points, run, n_jobs=1 if problem.elementwise else jobs)
    tables, n_new, count = [engine.table], 0, _counting(show, len(engine.points), asked)
    with closing(engine.tests()) as blocks:
        for tests, called in blocks:
            count(tests)
            tables.append(tests)
            n_new += int(called.sum())
    return _found(problem, by_number(tables), asked, n_new)


def _by_surrogate(
    problem: Problem, points: int, _: int, run: RunOptions, asked: Formulation, show: Show
) -> Found:
    from pymoo_psi.algorithms import SurrogatePSI  # brings half of SciPy, a second

    algorithm = SurrogatePSI(
        points,
        limits=asked.limits,
        sampling=run.sampling,
        study=run.study,
        study_key=run.study_key,
        retry=run.retry,
    )
    count, shown = _counting(show, points, asked), 0

    def callback(now: SurrogatePSI) -> None:
        nonlocal shown
        shown = count(now.table.rows(np.arange(shown, now.n_tested)))

    done = minimize(problem, algorithm, seed=run.seed, callback=callback).algorithm
    return _found(problem, done.table, asked, done.evaluator.n_eval)


def _found(problem: Problem, tests: TestTable, asked: Formulation, n_new: int) -> Found:
    """Return what tests give, of which ``n_new`` were evaluated now, the others before."""
    rules = [each.text for each in getattr(required(problem), "required", ())]
    unmet = np.column_stack([np.zeros(len(tests)), *map(tests.column, rules)]) > 0
    run, table = ~unmet.any(axis=1), _under(tests, asked)
    failed = int((table.status == "failed").sum())
    n_run = np.count_nonzero(run)
    n_stored = n_run - np.count_nonzero(table.repeats[run]) - n_new
    stored = f", {n_stored} of them from the study" if n_stored else ""
    counts = f"{n_run} tested{stored}" + (f", {failed} failed" if failed else "")
    if n_run < len(table):
        each = zip(rules, unmet[:, 1:].sum(axis=0), strict=True)
        by = ", ".join(f"{rule} ({n})" for rule, n in each if n)
        counts += f", {len(table) - n_run} not run by requirements: {by}"
    return table, counts, table.reasons.values()


def _by_nsga3(
    problem: Problem, points: int, _: int, run: RunOptions, asked: Formulation, show: Show
) -> Found:
    problem = required(problem)
    with TemporaryDirectory() as folder:
        # A design that fails must neither end the run nor give NSGA-III a NaN to sort. Without a
        # study of the user's the tests are kept in one of their own, for the table.
        study = run.study or Path(folder, "tests.db")
        key, retry = run.study_key, run.retry
        searched: Any = Recorded(FailureTolerant(problem), study=study, study_key=key, retry=retry)

        def callback(algorithm: Any) -> None:
            show(algorithm.evaluator.n_eval / points)

        result = nsga3(searched, n_evaluations=points, seed=run.seed, callback=callback)
        table = searched.table
    reasons = tuple(failure.reason for failure in searched.failures)
    unmet: int = getattr(problem, "n_not_run", 0)
    stored = 0 if run.study is None else points - searched.n_evaluated - unmet
    counts = f"{points - unmet} evaluated"
    counts += f", {stored} of them from the study" if stored else ""
    counts += f", {unmet} not run by requirements" if unmet else ""
    counts += f", {len(reasons)} failed" if reasons else ""
    # pymoo has no F where no design is feasible.
    last = result.pop if result.F is None else result.opt
    return table.rows(np.isin(table.numbers, last.get("test_point"))), counts, reasons


def _failures(reasons: Iterable[str]) -> list[str]:
    """Say in a line why designs failed, the most frequent reason first; nothing if none did."""
    counts = Counter(alike(reasons))
    shown = [f"{n} × {why:.{_LONGEST}}" for why, n in counts.most_common(_REASONS)]
    if len(counts) > _REASONS:
        shown.append(counted(len(counts) - _REASONS, "other reason"))
    return [f"Failed: {'; '.join(shown)}"] if shown else []
