"""Algorithms side by side on one problem, at equal numbers of evaluations."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Integral
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._tables import Shown, latex_table
from pymoo_psi._validation import (
    Received,
    boolean,
    counted,
    instance,
    integer,
    invalid,
    job_count,
    known_name,
)
from pymoo_psi.comparison._algorithms import (
    DEFAULT_ALGORITHMS,
    NamedAlgorithm,
    named_algorithms,
)
from pymoo_psi.comparison._reference import Reference
from pymoo_psi.comparison._runs import Run, Task, perform, problem_text, stored_runs
from pymoo_psi.comparison._statistics import INDICATORS, pairwise_tests
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.parallel import in_order, in_parallel, progress_bar
from pymoo_psi.problems import design_space, problem_layout, require_problem
from pymoo_psi.table import Layout

if TYPE_CHECKING:
    import pandas as pd

# Powers of 2, after which LPτ points are complete nets.
DEFAULT_EVALUATIONS = (256, 1024, 4096)
ASSESSED = ("evaluated", "returned")
_HEADINGS = {"igd_plus": "IGD+", "optimum_distance": "optimum distance",
             "n_nondominated": "designs", "seconds": "time [s]"}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Comparison(Shown):
    """The runs of several algorithms on one problem, measured by the same reference.

    Attributes:
        problem: Name of the problem.
        objectives: Number of objectives.
        runs: Every run, by algorithm, budget and seed.
        assess: What is measured of a run: ``"evaluated"``, the non-dominated feasible designs
            among all that it evaluated, or ``"returned"``, those that the algorithm returned.
        reference: What it is measured against.
        measures: One row per run, see :meth:`to_frame`.
        layout: Names, senses and units of the objectives, as the problem tells them.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> bnh = get_problem("bnh")
        >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
        >>> result, len(result.runs)  # psi needs no seeds
        (Comparison(BNH: psi, nsga3; 8 runs), 8)
    """

    problem: str
    objectives: int
    runs: tuple[Run, ...]
    assess: str
    reference: Reference
    measures: pd.DataFrame
    layout: Layout

    def __repr__(self) -> str:
        """Return problem, algorithms and the number of runs."""
        names = ", ".join(self.algorithms)
        return f"Comparison({self.problem}: {names}; {counted(len(self.runs), 'run')})"

    @property
    def algorithms(self) -> tuple[str, ...]:
        """Names of the algorithms.

        Example:
            Of the result in the example of :class:`Comparison`:

            >>> result.algorithms
            ('psi', 'nsga3')
        """
        return tuple(dict.fromkeys(run.task.algorithm for run in self.runs))

    @property
    def evaluations(self) -> tuple[int, ...]:
        """The budgets, rising.

        Example:
            Of the result in the example of :class:`Comparison`:

            >>> result.evaluations
            (32, 64)
        """
        return tuple(sorted({run.task.n_evaluations for run in self.runs}))

    def to_frame(self) -> pd.DataFrame:
        """Return one row per run.

        Returns:
            Columns ``algorithm``, ``evaluations``, ``seed`` (missing where the
            algorithm is deterministic), ``evaluated`` (designs, counted by the problem),
            ``hypervolume`` (share of the box from U to the reference point), ``igd_plus``,
            ``epsilon``, ``optimum_distance``, ``n_nondominated``, ``seconds``,
            ``evaluation_seconds``.

        Example:
            Of the result in the example of :class:`Comparison`:

            >>> runs = result.to_frame()
            >>> bool((runs["evaluated"] == runs["evaluations"]).all())
            True
        """
        return self.measures.copy()

    def summary(self) -> pd.DataFrame:
        """Return median and quartiles of every measure.

        Returns:
            One row per algorithm and budget: ``algorithm``, ``evaluations``, ``runs``, and of each
            measure, such as ``hypervolume``, its median under its own name and its quartiles as
            ``hypervolume_q1`` and ``hypervolume_q3``.

        Example:
            Of the result in the example of :class:`Comparison`:

            >>> print(result.summary()[["algorithm", "evaluations", "runs"]])
              algorithm  evaluations  runs
            0       psi           32     1
            1     nsga3           32     3
            2       psi           64     1
            3     nsga3           64     3
        """
        return self._summary.copy()

    def tests(self, indicator: str = "hypervolume") -> pd.DataFrame:
        """Return for every pair of algorithms and every budget which is better, and how surely.

        By Mann-Whitney's rank-sum test, or by the sign test where one of the two is deterministic,
        with exact p values, ties or not.

        Args:
            indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.

        Returns:
            Columns ``evaluations``, ``better``, ``worse``, ``effect`` (the probability that a run
            of ``better`` is the better one, 0.5 to 1), ``p``, ``least_p`` (the smallest that so
            many runs could give), and ``p_holm``, corrected for all pairs and budgets.

        Raises:
            ArgumentValueError: The indicator is unknown.

        Example:
            Of the result in the example of :class:`Comparison`:

            >>> tests = result.tests("igd_plus")
            >>> bool((tests["p_holm"] >= tests["p"]).all() and (tests["effect"] >= 0.5).all())
            True
        """
        return self._tests[known_name("indicator", indicator, INDICATORS)].copy()

    def to_latex(self) -> str:
        """Return medians and quartiles as a table of LaTeX.

        It is a ``tabular`` with the rules of the package booktabs.

        Example:
            Of the result in the example of :class:`Comparison`:

            >>> print(result.to_latex().splitlines()[2])
            evaluations & algorithm & runs & hypervolume & IGD+ & epsilon & optimum distance & ...
        """
        frame = self._for_readers()
        return latex_table([(name, frame[name].tolist()) for name in frame.columns])

    def _for_readers(self) -> pd.DataFrame:
        """Return the summary as texts: each median with its quartiles in brackets."""
        summary = self._summary
        frame = summary[["evaluations", "algorithm", "runs"]].copy()
        for name in (*INDICATORS, "n_nondominated", "seconds"):
            columns = summary[[name, f"{name}_q1", f"{name}_q3"]].to_numpy(float)
            digits = 10 if name == "n_nondominated" else 4  # 12345 designs, not 1.234e+04
            texts = [[f"{value:.{digits}g}" for value in row] for row in columns]
            frame[_HEADINGS.get(name, name)] = [
                median if runs == 1 else f"{median} ({low} to {high})"
                for runs, (median, low, high) in zip(summary["runs"], texts, strict=True)
            ]
        return frame

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        return self._for_readers().head(n), len(self._summary)

    # Computed once, as the printed table, the report and every figure ask for them.

    @cached_property
    def _summary(self) -> pd.DataFrame:
        import pandas as pd

        rows = []
        for budget, name in itertools.product(self.evaluations, self.algorithms):
            chosen = (self.measures["evaluations"] == budget) & (self.measures["algorithm"] == name)
            group = self.measures[chosen]
            row: dict[str, Any] = {"algorithm": name, "evaluations": budget, "runs": len(group)}
            for column in group.columns.drop(["algorithm", "evaluations", "seed", "evaluated"]):
                row[column] = group[column].median()
                # Values that occurred, as there is no mean of an infinite and a finite one.
                row[f"{column}_q1"] = group[column].quantile(0.25, interpolation="lower")
                row[f"{column}_q3"] = group[column].quantile(0.75, interpolation="higher")
            rows.append(row)
        return pd.DataFrame(rows)

    @cached_property
    def _tests(self) -> dict[str, pd.DataFrame]:
        return {name: pairwise_tests(self.measures, name) for name in INDICATORS}


def compare(
    problem: Any,
    *,
    n_evaluations: int | Sequence[int] = DEFAULT_EVALUATIONS,
    seeds: int | Sequence[int] = 11,
    algorithms: Collection[str] | Mapping[str, Any] = DEFAULT_ALGORITHMS,
    assess: str = "evaluated",
    reference_front: ArrayLike | None = None,
    polish: bool = True,
    reference: Reference | None = None,
    folder: str | PathLike[str] | None = None,
    n_jobs: int = 1,
    progress: bool = False,
    on_run: Callable[[Run, int, int], object] | None = None,
) -> Comparison:
    """Run algorithms on a problem at equal numbers of evaluations and measure what they find.

    Every algorithm works on the same problem with the same bounds; the problem itself counts the
    evaluations and ends a run that exceeds its budget. Each budget has runs of its own, so that
    an algorithm may suit its settings to it; criteria by which pymoo's algorithms end by default
    are set aside, those that you set count. All runs are measured against one reference, built
    from the union of what they found (:class:`Reference`). An algorithm that finds nothing
    feasible has hypervolume 0 and infinite distances.

    Args:
        problem: A pymoo problem with two or more objectives and finite bounds. One whose designs
            may fail goes as ``FailureTolerant(problem)``.
        n_evaluations: The budgets, each 1 or more.
        seeds: The seeds, or their number n for 1 to n. A deterministic algorithm, such as
            ``"psi"``, runs once; of one of your own that finds the same with every seed, one run
            counts.
        algorithms: Names, or a mapping from names of your own to such names, to pymoo algorithms,
            or to functions that take the number of evaluations and return one:
            ``{"psi": "psi", "a": NSGA2(pop_size=20), "b": lambda n: NSGA2(pop_size=n // 9)}``. An
            algorithm is copied for each run. The names are ``"psi"``, ``"surrogate"``
            (:class:`pymoo_psi.SurrogatePSI`, for some hundred evaluations), ``"nsga3"``,
            ``"psi+nsga3"`` (half the budget for PSI, whose best designs start NSGA-III); these but
            ``"nsga3"`` with ``-scrambled`` behind ``psi`` or ``surrogate`` (scrambled Sobol' points
            for the LPτ points, which begin with the corner and the middle of the box, where many
            test problems have optimal designs); and pymoo's ``"nsga2"``, ``"unsga3"``,
            ``"moead"``, ``"sms"`` and ``"spea2"``.
        assess: What is measured. ``"evaluated"``: the non-dominated feasible designs among all
            that a run evaluated, for every algorithm alike, which gives one that returns only its
            last population the benefit of all it has seen; ``"returned"``: what it returned, which
            is nothing where it asked for more than its budget.
        reference_front: ``(k, m)`` points known to be attainable, such as the true Pareto front;
            they join the union.
        polish: Search the continuous Salukvadze optimum by :func:`pymoo_psi.algorithms.refine`,
            which takes some hundred evaluations per variable; without, the best design of all
            runs stands for it.
        reference: Measure against this one, such as ``Reference.load(path)``, and not against the
            union of these runs; so some rows of a larger comparison can be repeated.
        folder: A folder in which every finished run is kept, as a study of all that it tested; the
            same call continues after an interruption, and further budgets, seeds or algorithms add
            to it.
            Runs go by the name of their algorithm: a changed algorithm wants a new name, and other
            versions of pymoo or this package, under which the same seed may give other designs, a
            new folder.
        n_jobs: Processes, -1 for one per core; each does whole runs. Times are fair if there are
            no more than idle cores.
        progress: Show a progress bar, in a terminal or a notebook.
        on_run: Called with each run as it is ready, the number of runs ready and of all.

    Returns:
        The comparison.

    Raises:
        ArgumentValueError: A number is out of range, a name unknown, or the problem has one
            objective.
        ArgumentTypeError: An argument has the wrong type.
        RunError: The problem or an algorithm raised; finished runs stay in ``folder``.
        StudyError: The folder holds runs on another problem, or a damaged file.
        OSError: The folder cannot be made or written to.

    Example:
        >>> from pymoo.problems import get_problem
        >>> result = compare(
        ...     get_problem("bnh"), n_evaluations=64, seeds=2, algorithms=["psi", "nsga3"]
        ... )
        >>> result
        Comparison(BNH: psi, nsga3; 3 runs)
        >>> result.to_frame()["evaluated"].tolist()
        [64, 64, 64]
    """
    require_problem(problem)
    if problem.n_obj < 2:
        raise invalid("the number of objectives of problem", "at least 2", problem.n_obj)
    # What the problem lacks, and what a reference cannot hold, is reported before any run.
    layout, _ = problem_layout(problem, design_space(problem)), problem_text(problem)
    budgets = _integers("n_evaluations", n_evaluations, minimum=1)
    if isinstance(seeds, Integral):
        seeds = range(1, 1 + integer("seeds", seeds, minimum=1))
    seeds = _integers("seeds", seeds, minimum=0)
    assess = known_name("assess", assess, ASSESSED)
    polish, n_jobs = boolean("polish", polish), job_count("n_jobs", n_jobs)
    if reference is not None:
        instance("reference", reference, Reference, "Reference.load(path) reads one")
        if reference.problem != problem_text(problem):
            name = json.loads(reference.problem).get("problem")
            shown = Received(f"one for {name}, or for other bounds or constants")
            raise invalid("reference", f"one for {problem.name()}", shown)
    by_name = {algorithm.name: algorithm for algorithm in named_algorithms(algorithms)}
    tasks = [
        Task(algorithm.name, budget, seed)
        for algorithm in by_name.values()
        for budget in budgets
        # A deterministic algorithm has one value a budget, and the tests know it by that.
        for seed in (seeds if algorithm.seeded else [None])
    ]
    place = None if folder is None else Path(folder)
    known = {} if place is None else {run.task: run for run in stored_runs(place, problem)}
    missing = [task for task in tasks if task not in known]
    # The longest first, so that no process begins one when the others have done their last.
    missing.sort(key=lambda task: -task.n_evaluations)

    def performed(task: Task) -> Run:
        # Kept by the process that does it, whatever becomes of the one that waits for it.
        return perform(problem, by_name[task.algorithm], task, place)

    runs: dict[Task, Run] = {}
    with progress_bar(progress) as bar:
        done_now = (run for _, run in in_parallel(performed, missing, n_jobs))
        for run in itertools.chain((known[task] for task in tasks if task in known), done_now):
            runs[run.task] = run
            bar(len(runs) / len(tasks))
            if on_run is not None:
                on_run(run, len(runs), len(tasks))
    done = tuple(_counted_once([runs[task] for task in tasks], by_name))
    if reference is None:
        reference = Reference.of(problem, done, reference_front, polish=polish)
    measures = _measures(done, reference, assess, n_jobs)
    return Comparison(problem.name(), problem.n_obj, done, assess, reference, measures, layout)


def _integers(name: str, values: Any, *, minimum: int) -> list[int]:
    """Return one integer or several, each once, in rising order."""
    several = [values] if isinstance(values, Integral) else values
    if isinstance(several, str) or not isinstance(several, Iterable):
        raise ArgumentTypeError(f"{name} must be integers, got {values!r:.80}")
    if not (checked := sorted({integer(name, value, minimum=minimum) for value in several})):
        raise invalid(name, "one or more integers", values)
    return checked


def _counted_once(runs: Sequence[Run], by_name: Mapping[str, NamedAlgorithm]) -> Iterator[Run]:
    """Give the runs, of an algorithm of the user's that leaves nothing to chance one a budget.

    The tests take runs for independent: eleven times the same one would make them sure of
    anything. Nothing found tells nothing.
    """
    for name, own in itertools.groupby(runs, lambda run: run.task.algorithm):
        groups = [
            list(group) for _, group in itertools.groupby(own, lambda run: run.task.n_evaluations)
        ]
        fixed = (
            not by_name[name].known
            and any(len(first.F) and others for first, *others in groups)
            and all(_same(first, run) for first, *others in groups for run in others)
        )
        for group in groups:
            first = group[0]
            yield from [replace(first, task=replace(first.task, seed=None))] if fixed else group


def _same(a: Run, b: Run) -> bool:
    found = ((a.X, b.X), (a.F, b.F), (a.returned, b.returned))
    return all(np.array_equal(*pair) for pair in found)


def _measures(runs: Sequence[Run], reference: Reference, assess: str, n_jobs: int) -> pd.DataFrame:
    """Return the table of :meth:`Comparison.to_frame`."""
    import pandas as pd

    found = [run.found(assess) for run in runs]
    quality = in_order(in_parallel(reference.measure, found, n_jobs))
    rows = [
        {
            "algorithm": run.task.algorithm,
            "evaluations": run.task.n_evaluations,
            "seed": run.task.seed,
            "evaluated": run.n_evaluated,
            **measured,
            "seconds": run.seconds,
            "evaluation_seconds": run.evaluation_seconds,
        }
        for run, measured in zip(runs, quality, strict=True)
    ]
    # Integers of pandas, which may be missing; NumPy would make the seeds floats.
    return pd.DataFrame(rows).astype({"seed": "Int64"})
