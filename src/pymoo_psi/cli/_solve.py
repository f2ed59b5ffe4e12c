"""``pymoo-psi solve``: from the problem that a word names to its ranked Pareto set."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi._validation import Received, counted, integer, invalid, known_name
from pymoo_psi.algorithms import (
    Engine,
    Recorded,
    RunOptions,
    by_number,
    nsga3,
    stored_at_termination,
)
from pymoo_psi.cli._app import Solve
from pymoo_psi.cli._output import keeping, progress, require_output, say, write_frame
from pymoo_psi.cli._problem import feasible_box, load_problem, try_program, write_example
from pymoo_psi.cli._rank import designs_frame, most_violated, say_best
from pymoo_psi.cli._source import counts_in, formulation_of, require_free_names
from pymoo_psi.problems import FailureTolerant, design_space, problem_layout, problem_name, required
from pymoo_psi.sequences import MAX_DIMENSIONS
from pymoo_psi.table import Formulation, TestTable, alike

_REASONS = 3  # of failures, the most frequent ones
_LONGEST = 120  # characters of a reason, so that three of them stay readable
_POINTS = {"psi": 4096, "surrogate": 256, "nsga3": 4096}
_POINTS_OF_PROGRAM = 128

# What a search found: the tests, under what was asked (of NSGA-III the designs that it returned),
# how many designs were tested, stored before and failed, in words, and why they failed.
Found = tuple[TestTable, str, Collection[str]]


def run_solve(options: Solve) -> int:
    """Search, write the Pareto set if a file is named, and print the best-ranked designs.

    Returns:
        0, or 1 if no design is feasible, or what is tried does not work.
    """
    if options.new:
        return write_example(options.problem)
    algorithm, out = known_name("--algorithm", options.algorithm, _POINTS), options.out
    if options.points is None:
        program = options.problem.endswith(".toml")
        options = replace(options, points=_POINTS_OF_PROGRAM if program else _POINTS[algorithm])
    points = integer("--points", options.points, minimum=1)
    run = _run_options(options)  # wrong ones are refused before a model is imported
    problem = load_problem(
        options.problem, options.context, options.jobs, options.timeout, options.box, options.log
    )
    if options.trial:
        return try_program(options.problem, problem, points, options.jobs)
    target = require_output(out, (".csv", ".xlsx"), options.study, options.decision)
    asked, space = formulation_of(options), design_space(problem)
    require_free_names((*problem_layout(problem, space).columns, *asked.computed))
    find = {"psi": _by_psi, "surrogate": _by_surrogate, "nsga3": _by_nsga3}[algorithm]
    with stored_at_termination(), keeping(partial(_kept, options)):
        table, counts, reasons = find(problem, points, options, run, asked)
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
    if asked.limits and (box := feasible_box(table, problem)):
        say(f"Where the feasible designs lie: --box {shlex.quote(box)}")
    n_free = len(space.searched)
    if algorithm != "nsga3" and run.sampling is None and n_free > MAX_DIMENSIONS:
        say(f"More variables than LPτ has, {n_free}: the test points are Sobol' points of SciPy.")
    return 0


def _run_options(options: Solve) -> RunOptions:
    """Return the options of the run.

    Raises:
        ArgumentValueError: An option would have no effect, or cannot be read.
    """
    # nsga3 and surrogate search by the problem's objectives; a table can be asked anything.
    later = ("objectives", "maximize", "compute", "relax", "decision", "limits")
    for name in (*later, "share", "fill", "sampling"):
        algorithms = ("psi", "surrogate") if name in ("limits", "sampling") else ("psi",)
        given = getattr(options, name) not in (None, False, "lptau")
        if given and options.algorithm not in algorithms:
            option, rule = f"--{name}", f"used with --algorithm {' or '.join(algorithms)}"
            remedy = f"keep the tests by --study FILE.db, then pymoo-psi rank FILE.db {option}"
            raise invalid(option, rule, options.algorithm, remedy if name in later else "")
    for name in ("share", "study_key", "retry"):
        if getattr(options, name) is not None and options.study is None:
            option = f"--{name.replace('_', '-')}"
            raise invalid(option, "used with --study", Received("no --study"))
    retry: Any = options.retry or ()
    if retry and retry != "failed":
        retry = counts_in("--retry", retry, "'failed' or numbers of test points, such as 1,2,3")
    share = None
    if options.share is not None:
        found = re.fullmatch(r"([1-9][0-9]{0,8})/([1-9][0-9]{0,8})", options.share.strip())
        if not found or int(found[1]) > int(found[2]):
            raise invalid("--share", "k/n, the k-th of n parts, such as 3/64", options.share)
        share = int(found[1]), int(found[2])
    return RunOptions(
        sampling=None if options.sampling == "lptau" else options.sampling,
        seed=integer("--seed", options.seed, minimum=0),
        share=share,
        fill=options.fill,
        study=options.study,
        study_key=options.study_key,
        retry=retry,
    )


def _kept(options: Solve) -> str:
    """Say what of an interrupted run is kept, and how it goes on."""
    if options.study is None:
        return "nothing is kept; with --study FILE.db the same command continues"
    if not options.study.exists():
        return "no design was tested"
    # What is in the file is counted, not what the bar has shown.
    stored = len(TestTable.read_study(options.study))
    of = "" if options.algorithm == "nsga3" else f" of {options.points}"
    return f"{stored}{of} designs are in {options.study}; the same command continues"


def _counting(show: Callable[..., None], asked: Formulation) -> Callable[[TestTable], int]:
    """Return a function that shows more tests and returns their number so far.

    A column that they lack is refused at the first of them.
    """
    statuses: Counter[str] = Counter()

    def count(tests: TestTable) -> int:
        statuses.update(_under(tests, asked).status.tolist())
        show(statuses.total(), f"{statuses['ok']} feasible, {statuses['failed']} failed")
        return statuses.total()

    return count


def _under(tests: TestTable, asked: Formulation) -> TestTable:
    # Of tests that all failed or were not run, as the first ones may, the outputs are unknown.
    run = (tests.status != "failed") & np.isfinite(tests.F).any(axis=1)
    return tests.under(asked) if run.any() else tests


def _by_psi(
    problem: Problem, points: int, options: Solve, run: RunOptions, asked: Formulation
) -> Found:
    # On arrays, not by `PSI`: pymoo's objects for a million designs take minutes. Blocks are so
    # small that the bar moves; a problem of one design at a time has a runner with the jobs.
    run = replace(run, block_size=min(65_536, max(64, -(-points // 32))))
    engine = Engine(problem, points, run, n_jobs=1 if problem.elementwise else options.jobs)
    tables, n_new = [engine.table], 0
    with progress("psi", len(engine.points)) as show, closing(engine.tests()) as blocks:
        count = _counting(show, asked)
        for tests, called in blocks:
            count(tests)
            tables.append(tests)
            n_new += int(called.sum())
    return _found(problem, by_number(tables), asked, n_new)


def _by_surrogate(
    problem: Problem, points: int, options: Solve, run: RunOptions, asked: Formulation
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
    with progress("surrogate", points) as show:
        count, shown = _counting(show, asked), 0

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
    n_designs = n_run - np.count_nonzero(table.repeats[run])
    different = f", {n_designs} different designs" if n_designs < n_run else ""
    stored = f", {n_designs - n_new} of them from the study" if n_new < n_designs else ""
    counts = f"{n_run} tested{different}{stored}" + (f", {failed} failed" if failed else "")
    if n_run < len(table):
        each = zip(rules, unmet[:, 1:].sum(axis=0), strict=True)
        by = ", ".join(f"{rule} ({n})" for rule, n in each if n)
        counts += f", {len(table) - n_run} not run by requirements: {by}"
    return table, counts, table.reasons.values()


def _by_nsga3(
    problem: Problem, points: int, options: Solve, run: RunOptions, asked: Formulation
) -> Found:
    problem = required(problem)
    with TemporaryDirectory() as folder, progress("nsga3", points) as show:
        # A design that fails must neither end the run nor give NSGA-III a NaN to sort. Without a
        # study of the user's the tests are kept in one of their own, for the table.
        study = run.study or Path(folder, "tests.db")
        key, retry = run.study_key, run.retry
        searched: Any = Recorded(FailureTolerant(problem), study=study, study_key=key, retry=retry)

        def callback(algorithm: Any) -> None:
            show(algorithm.evaluator.n_eval)

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
    if not counts:
        return []
    top, half = counts.most_common(_REASONS), _LONGEST // 2
    # Without its middle: the error is in front, and often the cause at its end.
    shown = [
        f"{n} × {why if len(why) <= _LONGEST else f'{why[:half].rstrip()}…{why[-half:]}'}"
        for why, n in top
    ]
    if rest := counts.total() - sum(n for _, n in top):
        shown.append(f"{rest} × {counted(len(counts) - len(top), 'other reason')}")
    return [f"Failed: {'; '.join(shown)}"]
