"""``pymoo-psi solve``: from a problem to its ranked Pareto set."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, counted, integer, invalid
from pymoo_psi.algorithms import (
    Engine,
    QMCSampling,
    Recorded,
    RunOptions,
    UniformSampling,
    by_number,
    nsga3,
    stored_at_termination,
)
from pymoo_psi.cli._choice import say_choice
from pymoo_psi.cli._groups import ColumnOptions
from pymoo_psi.cli._options import box_text, formulation_of, judged, numbers_in, share_in
from pymoo_psi.cli._output import (
    print_frame,
    require_output,
    require_study,
    run_bar,
    say,
    write_csv,
)
from pymoo_psi.pareto import RANKING_COLUMNS, EfficiencyRanking, listed, rank_of_efficiency
from pymoo_psi.problems import FailureTolerant
from pymoo_psi.problems._design_space import design_space
from pymoo_psi.problems._identity import problem_layout
from pymoo_psi.sequences import MAX_DIMENSIONS
from pymoo_psi.table import Formulation, Layout, TestTable, alike, read_tests
from pymoo_psi.table._roles import Roles

_NEAR_END = 0.05  # of a variable's range
_SHOWN = 12  # designs printed; all are in the file
_REASONS = 3  # of failures, the most frequent ones
_LONGEST = 120  # characters of a reason, so that three of them stay readable


@dataclass(frozen=True)
class Search:
    """How ``solve`` searches: its options as they are typed.

    Raises:
        ArgumentValueError: An option does not go with the algorithm, or without a study.
    """

    algorithm: str
    points: int
    seed: int
    columns: ColumnOptions
    study: Path | None
    study_key: str | None
    retry: str | None
    share: str | None
    jobs: int
    sampling: str

    def __post_init__(self) -> None:
        """Refuse options that would have no effect, before a problem is loaded."""
        if self.study is not None:
            require_study(self.study, "--study")
        # Where these search depends on the criteria; a table of tests can be asked anything.
        for name in (column.name for column in fields(ColumnOptions)):
            takes = ("psi", "surrogate") if name == "limits" else ("psi",)
            if getattr(self.columns, name) and self.algorithm not in takes:
                option, rule = f"--{name}", f"used with --algorithm {' or '.join(takes)}"
                remedy = f"keep the tests by --study FILE.db, then pymoo-psi rank FILE.db {option}"
                remedy += "; --box searches within limits on variables" * (name == "limits")
                raise invalid(option, rule, self.algorithm, remedy)
        if self.sampling != "lptau" and self.algorithm == "nsga3":
            raise invalid("--sampling", "used with --algorithm psi or surrogate", self.algorithm)
        if self.share and self.algorithm != "psi":
            raise invalid("--share", "used with --algorithm psi", self.algorithm)
        for option, text in (("--study-key", self.study_key), ("--retry", self.retry)):
            if text is not None and self.study is None:
                raise invalid(option, "used with --study FILE.db", Received("no --study"))
        if self.share is not None and self.study is None:
            raise invalid("--share", "used with --study FOLDER", Received("no --study"))
        # Only to refuse here, not when the run begins, what is no number.
        self.points_to_retry()
        self.part()

    def source(self) -> UniformSampling | None:
        """Return what ``PSI(sampling=...)`` takes."""
        return None if self.sampling == "lptau" else QMCSampling(self.sampling)

    def part(self) -> tuple[int, int] | None:
        """Return what ``PSI(share=...)`` takes."""
        return None if self.share is None else share_in(self.share)

    def points_to_retry(self) -> str | tuple[int, ...]:
        """Return what ``PSI(retry=...)`` takes."""
        if self.retry is None:
            return ()
        if self.retry.strip() == "failed":
            return "failed"
        rule = "'failed' or numbers of test points, such as 1,2,3"
        return numbers_in("--retry", self.retry, rule)


@dataclass(frozen=True, eq=False)
class SolveResult:
    """What a search ended with.

    Attributes:
        front: The Pareto-optimal designs.
        numbered: Whether their numbers are those of test points, of PSI or a study.
        counts: How many designs were tested, stored before, and failed.
        remarks: Lines to tell: why no design is feasible if none is, why designs failed.
        dominated: The tests that are feasible and dominated, where all of them are known: without
            a design of the Pareto set they may come into it.
    """

    front: TestTable
    numbered: bool
    counts: str
    remarks: tuple[str, ...]
    dominated: TestTable | None = None

    def ranking(self, *, normalize: bool) -> EfficiencyRanking:
        """Return the ranking of the Pareto set, the objectives in their own sense."""
        return self._ranked(self.front.F, normalize)

    def ranking_of_all(self, ranking: EfficiencyRanking) -> EfficiencyRanking:
        """Return that ranking with the dominated designs behind it, and what all are called."""
        labels, F = self.labels(ranking), self.front.F
        if self.dominated is not None:
            labels += [f"test point {number}" for number in self.dominated.numbers]
            F = np.vstack([F, self.dominated.F])
        return self._ranked(F, ranking.frame.normalize).with_labels(labels)

    def _ranked(self, F: NDArray[np.float64], normalize: bool) -> EfficiencyRanking:
        layout = self.front.layout
        own = pd.DataFrame(F * layout.sign, columns=list(layout.objectives))
        more = [name for name in layout.objectives if name in layout.maximize]
        return rank_of_efficiency(own, normalize=normalize, maximize=more)

    def labels(self, ranking: EfficiencyRanking) -> list[str]:
        """Return what the designs are called: by test point, or by row of what is written."""
        if self.numbered:
            return [f"test point {number}" for number in self.front.numbers]
        return [f"row {place + 1}" for place in ranking.order.argsort()]

    def ranked(self, ranking: EfficiencyRanking) -> pd.DataFrame:
        """Return the Pareto set, the best rank of efficiency first.

        Columns: ``test_point`` of PSI or a study, the variables, the objectives in their own
        sense, the outputs, ``mu1``, ``mu2``, ``mu3``, ``rank``.
        """
        front, ranked = self.front, ranking.to_frame()
        names = list(front.layout.objectives)
        designs = {"test_point": front.numbers} if self.numbered else {}
        designs |= dict(zip(front.layout.variables, front.X.T, strict=True))
        outputs = pd.DataFrame({name: front.column(name) for name in self.roles.outputs})
        mu = ranked.drop(columns=[*names, "pareto"])
        frames = [pd.DataFrame(designs), ranked[names], outputs, mu]
        return pd.concat(frames, axis=1).loc[ranked.index]

    @property
    def roles(self) -> Roles:
        """What the columns are."""
        layout = self.front.layout
        outputs = tuple(name for name in layout.outputs if name not in RANKING_COLUMNS)
        more = tuple(name for name in layout.maximize if name in {*layout.objectives, *outputs})
        label = "test_point" if self.numbered else None
        return Roles(layout.objectives, layout.variables, label, more, outputs)


def run_solve(
    problem: Problem, search: Search, out: Path | None, *, normalize: bool, force: bool
) -> int:
    """Search, write the Pareto set if a file is named, and print the best-ranked designs.

    Returns:
        0, or 1 if no design is feasible.
    """
    integer("--seed", search.seed, minimum=0)
    target = None
    if out is not None:
        target = require_output(out, (".csv",), search.study, by="solve", force=force)
    layout = problem_layout(problem, design_space(problem))
    if taken := [name for name in layout.columns if name in RANKING_COLUMNS]:
        rule = "named unlike the columns of a ranking"
        raise invalid("the columns", rule, taken[0], "give it another name by problem.names")
    # The columns that the problem promises; what else it gives is known after the first tests.
    groups = (layout.columns, layout.objectives, layout.maximize, layout.constraints)
    asked = formulation_of(search.columns, *groups, complete=False)
    if taken := [name for name in asked.objectives if name in RANKING_COLUMNS]:
        raise invalid("--criterion", "named unlike the columns of a ranking", taken[0])
    if search.algorithm == "nsga3":
        found = _by_nsga3(problem, search, layout)
    elif search.algorithm == "surrogate":
        found = _by_surrogate(problem, search, asked)
    else:
        found = _by_psi(problem, search, asked)

    layout = found.front.layout
    if len(found.front) == 0:
        say(f"{problem.name()}: no feasible design, {found.counts}")
        for line in found.remarks:
            say(line)
        if out is not None:
            say(f"{out} is not written.")
        return 1
    ranking = found.ranking(normalize=normalize)
    frame = found.ranked(ranking)
    if target is not None:  # before anything is printed, which may fail
        numbers = list(frame.select_dtypes("number").columns)
        units = {name: unit for name, unit in layout.units.items() if name in frame}
        write_csv(frame, target, found.roles, units, numbers)
    size = counted(len(frame), "Pareto-optimal design")
    title = f"{problem.name()} by {search.algorithm}: {size}, {found.counts}, best ranks first"
    label = layout.label_of
    roles, distances = found.roles, ["mu1", "mu2", "mu3"]
    plain = [label(name) for name in (*roles.variables, *roles.objectives, *roles.outputs)]
    spare = [label(name) for name in (*roles.variables, *roles.outputs)]
    shown = frame.head(_SHOWN)
    shown = shown[[*shown.columns.drop(["rank", *distances]), "rank", *distances]]
    shown = shown.rename(columns=label)
    print_frame(shown, title, plain=plain, spare=[distances, spare])
    if out is None and len(frame) > _SHOWN:
        say(f"({len(frame) - _SHOWN} more; --out FILE.csv writes all)")
    say_choice(found.ranking_of_all(ranking), layout.units)
    for line in found.remarks:
        say(line)
    for name in layout.outputs:
        if name not in roles.outputs:
            say(f"out[{name!r}] is left out: a column of the ranking is so called")
    n_free = len(design_space(problem).free.variables)
    lptau = search.algorithm != "nsga3" and search.sampling == "lptau"
    if lptau and n_free > MAX_DIMENSIONS:
        say(f"More variables than LPτ has, {n_free}: the test points are Sobol' points of SciPy.")
    if out is not None:
        say(f"All {len(frame)} written to {out}")
    return 0


def _by_nsga3(problem: Problem, search: Search, layout: Layout) -> SolveResult:
    n = search.points
    # A design that fails must neither end the run nor give NSGA-III a NaN to sort.
    searched: Any = FailureTolerant(problem)
    if search.study is not None:
        again = search.points_to_retry()
        key = search.study_key
        searched = Recorded(searched, study=search.study, study_key=key, retry=again)
    with _told_if_stopped(search), run_bar("nsga3", n) as show:
        result = nsga3(searched, n_evaluations=n, seed=search.seed, callback=show.evaluations)
    reasons = [failure.reason for failure in searched.failures]
    stored = 0 if search.study is None else n - searched.n_evaluated
    counts = f"{n} evaluated" + (f", {stored} of them from the study" if stored else "")
    counts += f", {len(reasons)} failed" if reasons else ""
    failures = _failures(reasons)
    if result.F is None:  # so pymoo says that no design is feasible
        last = _tests_of(result.pop, problem, layout)
        remarks = (*_most_violated(last, "the last {}"), *failures)
        return SolveResult(last.rows(last.pareto()), False, counts, remarks)
    if search.study is None:
        return SolveResult(_tests_of(result.opt, problem, layout), False, counts, failures)
    table = searched.table
    rows = np.searchsorted(table.numbers, result.opt.get("test_point"))
    return SolveResult(table.rows(rows), True, counts, failures)


@contextmanager
def _told_if_stopped(search: Search) -> Iterator[None]:
    """Say how a study continues if the user, or SIGTERM, stops the body."""
    if search.study is None:
        yield
        return
    with stored_at_termination():
        try:
            yield
        except KeyboardInterrupt:
            # There may be no file yet. What is in it is counted, not what the bar has shown.
            stored = len(read_tests(search.study)[0]) if search.study.exists() else 0
            # runs with other seeds may be in the same study
            of = "" if search.algorithm == "nsga3" else f" of {search.points}"
            say(f"{stored}{of} designs are in {search.study}; the same command continues.")
            raise


def _tests_of(population: Any, problem: Problem, layout: Layout) -> TestTable:
    """Return a population of a ``FailureTolerant`` as a table."""
    X, F, G, H, failures = population.get("X", "F", "G", "H", "failure")
    numbers = np.arange(1, len(F) + 1)
    reasons = {n: reason for n, reason in zip(numbers.tolist(), failures, strict=True) if reason}
    # The last constraint is the one that FailureTolerant has added.
    X = design_space(problem).to_matrix(X)
    return TestTable.of(numbers, X, F, G[:, :-1], H, reasons=reasons, layout=layout)


def _by_psi(problem: Problem, search: Search, asked: Formulation) -> SolveResult:
    # On arrays, not by `PSI`: pymoo's objects for a million designs take minutes.
    run = RunOptions(
        sampling=search.source(),
        seed=search.seed,
        study=search.study,
        share=search.part(),
        retry=search.points_to_retry(),
        study_key=search.study_key,
        # so small that the bar moves
        block_size=min(65_536, max(64, -(-search.points // 32))),
    )
    # A problem of one design at a time has a runner with the jobs.
    jobs = 1 if problem.elementwise else search.jobs
    engine = Engine(problem, integer("--points", search.points, minimum=1), run, n_jobs=jobs)
    tables, n_new = [engine.table], 0
    with (
        _told_if_stopped(search),
        run_bar("psi", len(engine.points), asked) as bar,
        closing(engine.tests()) as blocks,
    ):
        for tests, called in blocks:
            bar.block(tests)
            tables.append(tests)
            n_new += int(called.sum())
    return _of_table(problem, by_number(tables), asked, n_new)


def _by_surrogate(problem: Problem, search: Search, asked: Formulation) -> SolveResult:
    from pymoo_psi.algorithms import SurrogatePSI  # brings half of SciPy, a second

    algorithm = SurrogatePSI(
        integer("--points", search.points, minimum=1),
        limits=asked.limits,
        sampling=search.source(),
        study=search.study,
        study_key=search.study_key,
        retry=search.points_to_retry(),
    )
    with _told_if_stopped(search), run_bar("surrogate", search.points, asked) as bar:

        def show(run: SurrogatePSI) -> None:
            bar.block(run.table.rows(np.arange(bar.tested, run.n_tested)))

        run = minimize(problem, algorithm, seed=search.seed, callback=show).algorithm
    return _of_table(problem, run.table, asked, run.evaluator.n_eval)


def _of_table(problem: Problem, tests: TestTable, asked: Formulation, n_new: int) -> SolveResult:
    """Return what tests give, of which ``n_new`` were evaluated now, the others before."""
    table = judged(tests, asked)
    pareto = table.pareto()
    rows = np.flatnonzero(pareto)
    if table.F.shape[1] == 1:
        rows = rows[:1]  # as pymoo does
    front = table.rows(rows)
    failed = int((table.status == "failed").sum())
    n_designs = len(table) - np.count_nonzero(table.repeats)
    different = f", {n_designs} different designs" if n_designs < len(table) else ""
    stored = f", {n_designs - n_new} of them from the study" if n_new < n_designs else ""
    counts = f"{len(table)} tested{different}{stored}" + (f", {failed} failed" if failed else "")
    remarks = _failures(table.reasons.values())
    if len(rows) == 0:
        remarks = (*_most_violated(table, "{} that were computed"), *remarks)
    elif len(rows) == 1 and table.F.shape[1] > 1:
        remarks = (*remarks, _alone(problem, front))
    elif asked.limits and (box := box_text(table, {}, problem)):
        remarks = (*remarks, f"Where the feasible designs lie: --box {shlex.quote(box)}")
    dominated = table.rows(np.flatnonzero(table.eligible() & ~pareto & (table.repeats == 0)))
    return SolveResult(front, True, counts, remarks, dominated)


def _alone(problem: Problem, front: TestTable) -> str:
    """Say that one design dominates all others, and at which ends of the box it lies."""
    ends = []
    for name, variable, value in zip(
        front.layout.variables, design_space(problem).variables, front.X[0], strict=True
    ):
        if variable.kind in (Kind.REAL, Kind.INTEGER) and variable.lower < variable.upper:
            place = (value - variable.lower) / (variable.upper - variable.lower)
            # No point lies at the upper end, but one of a few hundred this near.
            side = "lower" if place <= _NEAR_END else "upper" if place >= 1 - _NEAR_END else ""
            ends += [f"the {side} end of {name}"] if side else []
    corner = "in a corner of the box: " if len(ends) == len(front.layout.variables) else "at "
    where = f" It lies {corner}{listed(ends)}." if ends else ""
    return (
        f"Test point {front.numbers[0]} dominates all other feasible tests: the criteria do not "
        f"conflict here, and there is nothing to choose.{where}"
    )


def _most_violated(table: TestTable, of: str) -> tuple[str, ...]:
    """Say which constraint or limit most designs violate, and how many violate it alone."""
    violated, names = table.violations()
    if not violated.any():
        return ()
    rejects = violated.sum(axis=0)
    j = int(rejects.argmax())
    alone = int((violated[:, j] & (violated.sum(axis=1) == 1)).sum())
    known = of.format(int((table.status != "failed").sum()))
    return (f"Infeasible: {int(violated.any(axis=1).sum())} of {known}; {names[j]} rejects most: "
            f"{int(rejects[j])}, {alone} of them alone.",)  # fmt: skip


def _failures(reasons: Iterable[str]) -> tuple[str, ...]:
    """Say in a line why designs failed, the most frequent reason first; nothing if none did."""
    counts = Counter(alike(reasons))
    if not counts:
        return ()
    top = counts.most_common(_REASONS)
    told = [f"{n} × {_shortened(reason)}" for reason, n in top]
    rest = sum(counts.values()) - sum(n for _, n in top)
    told += [f"{rest} × {counted(len(counts) - len(top), 'other reason')}"] if rest else []
    return (f"Failed: {'; '.join(told)}",)


def _shortened(reason: str) -> str:
    """Return a reason without its middle: the error is in front, and often the cause at its end."""
    half = _LONGEST // 2
    return reason if len(reason) <= _LONGEST else f"{reason[:half].rstrip()}…{reason[-half:]}"
