"""``pymoo-psi solve``: from a problem to its ranked Pareto set."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi._validation import Received, counted, integer, invalid
from pymoo_psi.algorithms import (
    Engine,
    QMCSampling,
    Recorded,
    RunOptions,
    by_number,
    nsga3,
    stored_at_termination,
)
from pymoo_psi.cli._options import Asked
from pymoo_psi.cli._output import print_frame, progress, require_output, say, write_csv
from pymoo_psi.cli._problem import feasible_box
from pymoo_psi.cli._rank import best_designs, designs_frame, require_free_names, say_choice
from pymoo_psi.cli._text import counts_in, share_in
from pymoo_psi.problems import FailureTolerant, design_space, problem_layout
from pymoo_psi.sequences import MAX_DIMENSIONS
from pymoo_psi.table import Formulation, Layout, TestTable, alike

_SHOWN = 12  # designs printed; all are in the file
_REASONS = 3  # of failures, the most frequent ones
_LONGEST = 120  # characters of a reason, so that three of them stay readable


@dataclass(frozen=True)
class Search:
    """How ``solve`` searches: its options as they are typed."""

    algorithm: str
    points: int
    sampling: str
    seed: int
    jobs: int
    study: Path | None
    study_key: str | None
    share: str | None
    retry: str | None

    def run_options(self, asked: Asked) -> RunOptions:
        """Return the options of the run.

        Raises:
            ArgumentValueError: An option would have no effect, or cannot be read.
        """
        # nsga3 and surrogate search by the problem's objectives; a table can be asked anything.
        formulated = ("objectives", "maximize", "compute", "relax", "formulation")
        for name in (*formulated, "limits"):
            algorithms = ("psi", "surrogate") if name == "limits" else ("psi",)
            if getattr(asked, name) and self.algorithm not in algorithms:
                option, rule = f"--{name}", f"used with --algorithm {' or '.join(algorithms)}"
                remedy = f"keep the tests by --study FILE.db, then pymoo-psi rank FILE.db {option}"
                raise invalid(option, rule, self.algorithm, remedy)
        if self.sampling != "lptau" and self.algorithm == "nsga3":
            raise invalid("--sampling", "used with --algorithm psi or surrogate", self.algorithm)
        if self.share and self.algorithm != "psi":
            raise invalid("--share", "used with --algorithm psi", self.algorithm)
        of_study = {"--share": self.share, "--study-key": self.study_key, "--retry": self.retry}
        for option, text in of_study.items():
            if text is not None and self.study is None:
                raise invalid(option, "used with --study", Received("no --study"))
        retry: Any = ()
        if self.retry is not None:
            rule = "'failed' or numbers of test points, such as 1,2,3"
            failed = self.retry.strip() == "failed"
            retry = "failed" if failed else counts_in("--retry", self.retry, rule)
        return RunOptions(
            sampling=None if self.sampling == "lptau" else QMCSampling(self.sampling),
            seed=integer("--seed", self.seed, minimum=0),
            share=None if self.share is None else share_in(self.share),
            study=self.study,
            study_key=self.study_key,
            retry=retry,
        )


@dataclass(frozen=True)
class Found:
    """What a search found.

    Attributes:
        table: The tests, of NSGA-III the designs that it returned, under what was asked.
        counts: How many designs were tested, stored before, and failed.
        reasons: Why designs failed.
    """

    table: TestTable
    counts: str
    reasons: tuple[str, ...]


def run_solve(
    problem: Problem, search: Search, asked: Asked, out: Path | None, *, force: bool
) -> int:
    """Search, write the Pareto set if a file is named, and print the best-ranked designs.

    Returns:
        0, or 1 if no design is feasible.
    """
    integer("--points", search.points, minimum=1)
    target = require_output(out, (".csv",), search.study, by="solve", force=force)
    formulation, run = asked.read(), search.run_options(asked)
    layout = problem_layout(problem, design_space(problem))
    require_free_names((*layout.columns, *formulation.computed))
    find = {"psi": _by_psi, "surrogate": _by_surrogate, "nsga3": _by_nsga3}[search.algorithm]
    with _continued(search):
        found = find(problem, search, run, formulation)
    table = found.table
    if not table.eligible().any():
        say(f"{problem.name()}: no feasible design, {found.counts}")
        for line in (*_most_violated(table), *_failures(found.reasons)):
            say(line)
        if out is not None:
            say(f"{out} is not written.")
        return 1
    rows, ranking = table.ranked(normalize=formulation.normalize)
    designs = table.rows(rows)
    frame = designs_frame(designs, ranking, formulation)
    constraints = [name for name in designs.layout.constraints if name in frame]
    frame = frame[frame["pareto"]].drop(columns=["pareto", *constraints])
    if target is not None:  # before anything is printed, which may fail
        write_csv(frame, target, designs.layout)
    size = counted(len(frame), "Pareto-optimal design")
    title = f"{problem.name()} by {search.algorithm}: {size}, {found.counts}, best ranks first"
    print_frame(best_designs(frame, _SHOWN).rename(columns=designs.layout.label_of), title)
    if out is None and len(frame) > _SHOWN:
        say(f"({len(frame) - _SHOWN} more; --out FILE.csv writes all)")
    say_choice(ranking, designs.layout.units)
    for line in _failures(found.reasons):
        say(line)
    if formulation.limits and (box := feasible_box(table, problem)):
        say(f"Where the feasible designs lie: --box {shlex.quote(box)}")
    n_free = len(design_space(problem).searched)
    if search.algorithm != "nsga3" and run.sampling is None and n_free > MAX_DIMENSIONS:
        say(f"More variables than LPτ has, {n_free}: the test points are Sobol' points of SciPy.")
    if out is not None:
        say(f"All {len(frame)} written to {out}")
    return 0


@contextmanager
def _continued(search: Search) -> Iterator[None]:
    """Say how a study continues if the user, or SIGTERM, stops the body."""
    with stored_at_termination():
        try:
            yield
        except KeyboardInterrupt:
            # There may be no file yet. What is in it is counted, not what the bar has shown.
            if search.study is not None and search.study.exists():
                stored = len(TestTable.read_study(search.study))
                of = "" if search.algorithm == "nsga3" else f" of {search.points}"
                say(f"{stored}{of} designs are in {search.study}; the same command continues.")
            raise


class _Display:
    """The progress of a run, and a column that its tests lack refused at the first of them."""

    def __init__(self, show: Any, asked: Formulation) -> None:
        self.show, self.asked = show, asked
        self.tested = self.feasible = self.failed = 0

    def tests(self, tests: TestTable) -> None:
        """Show more tests that have arrived."""
        table = _under(tests, self.asked)
        self.tested += len(table)
        self.feasible += int(table.feasible().sum())
        self.failed += int((table.status == "failed").sum())
        self.show(self.tested, f"{self.feasible} feasible, {self.failed} failed")


def _under(tests: TestTable, asked: Formulation) -> TestTable:
    # Of tests that all failed, as the first ones may, it is unknown which outputs they have.
    return tests if (tests.status == "failed").all() else tests.under(asked)


def _by_psi(problem: Problem, search: Search, run: RunOptions, asked: Formulation) -> Found:
    # On arrays, not by `PSI`: pymoo's objects for a million designs take minutes. Blocks are so
    # small that the bar moves; a problem of one design at a time has a runner with the jobs.
    run = replace(run, block_size=min(65_536, max(64, -(-search.points // 32))))
    jobs = 1 if problem.elementwise else search.jobs
    engine = Engine(problem, search.points, run, n_jobs=jobs)
    tables, n_new = [engine.table], 0
    with progress("psi", len(engine.points)) as show, closing(engine.tests()) as blocks:
        display = _Display(show, asked)
        for tests, called in blocks:
            display.tests(tests)
            tables.append(tests)
            n_new += int(called.sum())
    return _found(by_number(tables), asked, n_new)


def _by_surrogate(problem: Problem, search: Search, run: RunOptions, asked: Formulation) -> Found:
    from pymoo_psi.algorithms import SurrogatePSI  # brings half of SciPy, a second

    algorithm = SurrogatePSI(
        search.points,
        limits=asked.limits,
        sampling=run.sampling,
        study=run.study,
        study_key=run.study_key,
        retry=run.retry,
    )
    with progress("surrogate", search.points) as show:
        display = _Display(show, asked)

        def callback(now: SurrogatePSI) -> None:
            display.tests(now.table.rows(np.arange(display.tested, now.n_tested)))

        done = minimize(problem, algorithm, seed=run.seed, callback=callback).algorithm
    return _found(done.table, asked, done.evaluator.n_eval)


def _found(tests: TestTable, asked: Formulation, n_new: int) -> Found:
    """Return what tests give, of which ``n_new`` were evaluated now, the others before."""
    table = _under(tests, asked)
    failed = int((table.status == "failed").sum())
    n_designs = len(table) - np.count_nonzero(table.repeats)
    different = f", {n_designs} different designs" if n_designs < len(table) else ""
    stored = f", {n_designs - n_new} of them from the study" if n_new < n_designs else ""
    counts = f"{len(table)} tested{different}{stored}" + (f", {failed} failed" if failed else "")
    return Found(table, counts, tuple(table.reasons.values()))


def _by_nsga3(problem: Problem, search: Search, run: RunOptions, asked: Formulation) -> Found:
    n = search.points
    # A design that fails must neither end the run nor give NSGA-III a NaN to sort.
    searched: Any = FailureTolerant(problem)
    if run.study is not None:
        searched = Recorded(searched, study=run.study, study_key=run.study_key, retry=run.retry)
    with progress("nsga3", n) as show:

        def callback(algorithm: Any) -> None:
            show(algorithm.evaluator.n_eval)

        result = nsga3(searched, n_evaluations=n, seed=run.seed, callback=callback)
    reasons = tuple(failure.reason for failure in searched.failures)
    stored = 0 if run.study is None else n - searched.n_evaluated
    counts = f"{n} evaluated" + (f", {stored} of them from the study" if stored else "")
    counts += f", {len(reasons)} failed" if reasons else ""
    if result.F is None or run.study is None:  # pymoo has no F where no design is feasible
        last = result.pop if result.F is None else result.opt
        table = _table_of(last, problem, problem_layout(problem, design_space(problem)))
    else:
        table = searched.table
        table = table.rows(np.searchsorted(table.numbers, result.opt.get("test_point")))
    return Found(table, counts, reasons)


def _table_of(population: Any, problem: Problem, layout: Layout) -> TestTable:
    """Return a population of a ``FailureTolerant`` as a table, its designs numbered as rows."""
    X, F, G, H, failures = population.get("X", "F", "G", "H", "failure")
    numbers = np.arange(1, len(F) + 1)
    reasons = {n: reason for n, reason in zip(numbers.tolist(), failures, strict=True) if reason}
    X = design_space(problem).to_matrix(X)
    # The last constraint is the one that FailureTolerant has added.
    return TestTable.of(
        numbers, X, F, G[:, :-1], H, reasons=reasons, layout=replace(layout, label="row"),
        extra={"row": numbers.astype(object)},
    )  # fmt: skip


def _most_violated(table: TestTable) -> list[str]:
    """Say which constraint or limit most designs violate, and how many violate it alone."""
    violated, names = table.violations()
    if not violated.any():
        return []
    rejects = violated.sum(axis=0)
    j = int(rejects.argmax())
    alone = int((violated[:, j] & (violated.sum(axis=1) == 1)).sum())
    computed = int((table.status != "failed").sum())
    return [
        f"Infeasible: {int(violated.any(axis=1).sum())} of {computed} that were computed; "
        f"{names[j]} rejects most: {int(rejects[j])}, {alone} of them alone."
    ]


def _failures(reasons: Iterable[str]) -> list[str]:
    """Say in a line why designs failed, the most frequent reason first; nothing if none did."""
    counts = Counter(alike(reasons))
    if not counts:
        return []
    top = counts.most_common(_REASONS)
    shown = [f"{n} × {_shortened(reason)}" for reason, n in top]
    if rest := counts.total() - sum(n for _, n in top):
        shown.append(f"{rest} × {counted(len(counts) - len(top), 'other reason')}")
    return [f"Failed: {'; '.join(shown)}"]


def _shortened(reason: str) -> str:
    """Return a reason without its middle: the error is in front, and often the cause at its end."""
    half = _LONGEST // 2
    return reason if len(reason) <= _LONGEST else f"{reason[:half].rstrip()}…{reason[-half:]}"
