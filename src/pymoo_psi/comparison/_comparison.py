"""Several algorithms on one problem, at equal cost: the runs and their measures."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    Entries,
    FilePath,
    counted,
    integer,
    invalid,
    job_count,
    known_name,
    objective_matrix,
    require_shape,
)
from pymoo_psi.comparison._quality import INDICATORS, Reference, pairwise_tests
from pymoo_psi.comparison._runs import (
    DEFAULT_ALGORITHMS,
    SEARCHES,
    Run,
    Search,
    Task,
    perform,
    searches,
    stored_runs,
)
from pymoo_psi.parallel import in_parallel, progress_bar
from pymoo_psi.problems import (
    design_space,
    problem_layout,
    problem_name,
    require_problem,
    with_requirements,
)

if TYPE_CHECKING:
    import pandas as pd


# Powers of 2: so many LPτ points form complete nets.
DEFAULT_EVALUATIONS = (256, 1024, 4096)
# With surrogates: a run with 4096 evaluations would take minutes.
FEW_EVALUATIONS = (64, 128, 256)
_WITH_SURROGATES = (SEARCHES["surrogate"], SEARCHES["surrogate-scrambled"])
_DETERMINISTIC = SEARCHES["psi"]


@dataclass(frozen=True, eq=False)
class Comparison(Shown):
    """The runs of several algorithms on one problem, measured by the same reference.

    Attributes:
        problem: Name of the problem.
        runs: All runs, ordered by algorithm, budget and seed.
        reference: The reference against which they are measured.
        measures: One row per run, see :meth:`to_frame`.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> bnh = get_problem("bnh")
        >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
        >>> result, len(result.runs)  # psi needs no seeds
        (Comparison(BNH: psi, nsga3; 8 runs), 8)
    """

    problem: str
    runs: tuple[Run, ...]
    reference: Reference
    measures: pd.DataFrame

    def __repr__(self) -> str:
        """Return problem, algorithms and the number of runs."""
        names = ", ".join(self.algorithms)
        return f"Comparison({self.problem}: {names}; {counted(len(self.runs), 'run')})"

    @property
    def algorithms(self) -> tuple[str, ...]:
        """Names of the algorithms.

        Example:
            With the result of the example of :class:`Comparison`:

            >>> result.algorithms
            ('psi', 'nsga3')
        """
        return tuple(dict.fromkeys(run.task.algorithm for run in self.runs))

    @property
    def evaluations(self) -> tuple[int, ...]:
        """The budgets, increasing.

        Example:
            With the result of the example of :class:`Comparison`:

            >>> result.evaluations
            (32, 64)
        """
        return tuple(sorted({run.task.n_evaluations for run in self.runs}))

    def to_frame(self) -> pd.DataFrame:
        """Return one row per run.

        Returns:
            Columns ``algorithm``, ``evaluations``, ``seed`` (missing if the algorithm is
            deterministic), ``evaluated`` (number of designs, counted by the problem),
            ``hypervolume`` (share of the box from U to the reference point), ``igd_plus``,
            ``epsilon``, ``optimum_distance``, ``n_nondominated``, ``seconds``,
            ``evaluation_seconds``.

        Example:
            With the result of the example of :class:`Comparison`:

            >>> runs = result.to_frame()
            >>> bool((runs["evaluated"] == runs["evaluations"]).all())
            True
        """
        return self.measures.copy()

    def summary(self) -> pd.DataFrame:
        """Return median and quartiles of every measure.

        Returns:
            One row per algorithm and budget, with columns ``algorithm``, ``evaluations`` and
            ``runs``. Each measure has its median under its own name, such as ``hypervolume``, and
            its quartiles as ``hypervolume_q1`` and ``hypervolume_q3``.

        Example:
            With the result of the example of :class:`Comparison`:

            >>> print(result.summary()[["algorithm", "evaluations", "runs"]])
              algorithm  evaluations  runs
            0       psi           32     1
            1     nsga3           32     3
            2       psi           64     1
            3     nsga3           64     3
        """
        keys = ["algorithm", "evaluations"]
        groups = self.measures.groupby(keys, sort=False)
        frame = groups.size().to_frame("runs")
        for column in self.measures.columns.drop([*keys, "seed", "evaluated"]):
            frame[column] = groups[column].median()
            # Quartiles are values of runs, as an infinite and a finite value have no mean.
            frame[f"{column}_q1"] = groups[column].quantile(0.25, interpolation="lower")
            frame[f"{column}_q3"] = groups[column].quantile(0.75, interpolation="higher")
        return frame.reset_index().sort_values("evaluations", kind="stable", ignore_index=True)

    def tests(self, indicator: str = "hypervolume") -> pd.DataFrame:
        """Return a test of every pair of algorithms at every budget.

        It is the rank-sum test of Mann and Whitney, or the sign test if one of the two algorithms
        is deterministic. The p values are exact, with or without ties.

        Args:
            indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.

        Returns:
            Columns ``evaluations``, ``better``, ``worse``, ``effect`` (the probability that a run
            of ``better`` is the better one, 0.5 to 1), ``p``, and ``p_holm``, which is corrected
            for all pairs and budgets.

        Raises:
            ArgumentValueError: The indicator is unknown.

        Example:
            With the result of the example of :class:`Comparison`:

            >>> tests = result.tests("igd_plus")
            >>> bool((tests["p_holm"] >= tests["p"]).all() and (tests["effect"] >= 0.5).all())
            True
        """
        return pairwise_tests(self.measures, known_name("indicator", indicator, INDICATORS))

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        medians = self.summary()
        columns = ["evaluations", "algorithm", "runs", *INDICATORS, "n_nondominated", "seconds"]
        return medians[columns].head(n), len(medians)


def compare(
    problem: Any,
    *,
    n_evaluations: int | Sequence[int] | None = None,
    seeds: int | Sequence[int] = 11,
    algorithms: Collection[str] | Entries = DEFAULT_ALGORITHMS,
    reference_front: ArrayLike | None = None,
    folder: FilePath | None = None,
    n_jobs: int = 1,
    progress: bool = True,
) -> Comparison:
    """Run algorithms on a problem with equal numbers of evaluations and measure the results.

    Every algorithm works on the same problem with the same bounds. The problem counts the
    evaluations and ends a run that exceeds its budget. Each budget has separate runs, because
    algorithms may adapt their settings to it. Default terminations of pymoo's algorithms are
    ignored; those that you set are kept. All runs are measured against one reference, built from
    the union of their designs (:class:`Reference`). The measures use the non-dominated feasible
    designs among all that a run evaluated, even if the algorithm returns only its last population.
    A run without a feasible design has hypervolume 0 and infinite distances.

    Args:
        problem: A pymoo problem with two or more objectives and finite bounds. If designs may fail,
            pass ``FailureTolerant(problem)``.
        n_evaluations: The budgets, each 1 or more; by default 256, 1024 and 4096, with
            ``"surrogate"`` 64, 128 and 256.
        seeds: The seeds, or their number n for 1 to n; fewer than about six cannot show a
            difference between two algorithms. A deterministic algorithm, such as ``"psi"``, has one
            run; so has your own algorithm if every seed returns the same result.
        algorithms: Names, or a mapping from your own names to such names, to pymoo algorithms, or
            to functions that take the number of evaluations and return an algorithm: ``{"psi":
            "psi", "a": NSGA2(pop_size=20), "b": lambda n: NSGA2(pop_size=n // 9)}``. An algorithm
            is copied for each run. The names are ``"psi"``, ``"surrogate"``
            (:class:`pymoo_psi.SurrogatePSI`, for a few hundred evaluations), ``"nsga3"``,
            ``"nsga2"`` and ``"psi+nsga3"`` (half the budget for PSI, whose best designs start
            NSGA-III). ``"psi-scrambled"``, ``"surrogate-scrambled"`` and ``"psi-scrambled+nsga3"``
            use scrambled Sobol' points. LPτ points begin with the corner and the middle of the
            bounds, where many test problems have optimal designs.
        reference_front: ``(k, m)`` points known to be attainable, such as the true Pareto front;
            they are added to the union.
        folder: A folder for the finished runs, each a study of all its tests. After an interruption
            or an error, the same call continues; further budgets, seeds or algorithms are added.
            Without a folder nothing is stored. Runs are identified by the name of their algorithm,
            so give a changed algorithm a new name. Use a new folder for other versions of pymoo or
            of this package, because a seed may give other designs there.
        n_jobs: Number of processes, -1 for one per core; each performs whole runs. Times are
            comparable if there are no more processes than idle cores.
        progress: Print the number of runs before the first one, then show a progress bar.

    Returns:
        The comparison.

    Raises:
        ArgumentValueError: A number is out of range, a name is unknown, or the problem has a single
            objective.
        ArgumentTypeError: An argument has the wrong type.
        RunError: The problem or an algorithm raised an exception; finished runs stay in ``folder``.
        StudyError: The folder contains runs on another problem, or a damaged file.
        OSError: The folder cannot be created or written to.

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
    problem = with_requirements(problem)
    if problem.n_obj < 2:
        raise invalid("the number of objectives of problem", "at least 2", problem.n_obj)
    problem_layout(problem, design_space(problem))  # what it lacks is reported before any run
    fronts = []
    if reference_front is not None:
        front = objective_matrix("reference_front", reference_front)
        require_shape("reference_front", front, (len(front), problem.n_obj))
        fronts.append(front)
    n_jobs = job_count("n_jobs", n_jobs)
    by_name = searches(algorithms)
    tasks = _tasks(by_name, n_evaluations, seeds)
    runs = {}
    path = None
    if folder is not None:
        path = Path(folder)
        for run in stored_runs(path, problem):
            if run.task in tasks:
                runs[run.task] = run
    missing = [task for task in tasks if task not in runs]
    # The longest first, so that all processes end at about the same time; and one of each
    # algorithm, so that one that does not suit the problem is found early.
    missing.sort(key=lambda task: (-task.n_evaluations, task.seed or 0))
    name = problem_name(problem)
    if progress and missing:
        n_missing = sum(task.n_evaluations for task in missing)
        work = f"{counted(len(missing), 'run')} of {counted(n_missing, 'evaluation')} in all"
        print(f"{name}: {work}", file=sys.stderr, flush=True)

    def performed(task: Task) -> Run:
        # The process that performs a run stores it, even if its parent process ends before.
        return perform(problem, by_name[task.algorithm], task, path)

    with progress_bar(progress) as bar:
        bar(len(runs) / len(tasks))
        for _, run in in_parallel(performed, missing, n_jobs):
            runs[run.task] = run
            bar(len(runs) / len(tasks))
    counted_runs = tuple(_without_repeats([runs[task] for task in tasks]))
    reference = Reference.of([*(run.F for run in counted_runs), *fronts])
    return Comparison(name, counted_runs, reference, _measures(counted_runs, reference, n_jobs))


def _tasks(
    by_name: Mapping[str, Search],
    n_evaluations: int | Sequence[int] | None,
    seeds: int | Sequence[int],
) -> list[Task]:
    """Return the runs of a comparison: all algorithms with all budgets and seeds."""
    if isinstance(seeds, Integral):
        seeds = range(1, 1 + integer("seeds", seeds, minimum=1))
    if n_evaluations is None:
        n_evaluations = DEFAULT_EVALUATIONS
        if any(search in _WITH_SURROGATES for search in by_name.values()):
            n_evaluations = FEW_EVALUATIONS
    budgets = _integers("n_evaluations", n_evaluations, minimum=1)
    several: list[int | None] = [*_integers("seeds", seeds, minimum=0)]
    tasks = []
    for name, search in by_name.items():
        seeds_of_search = several
        if search is _DETERMINISTIC:
            seeds_of_search = [None]  # the tests know it by that
        for budget in budgets:
            for seed in seeds_of_search:
                tasks.append(Task(name, budget, seed))
    return tasks


def _integers(name: str, values: Any, *, minimum: int) -> list[int]:
    """Return one integer or several, without repeats, in increasing order."""
    several = np.atleast_1d(np.asarray(values, dtype=object)).tolist()
    if not several:
        raise invalid(name, "one or more integers", values)
    return sorted({integer(name, value, minimum=minimum) for value in several})


def _without_repeats(runs: Sequence[Run]) -> Iterator[Run]:
    """Yield the runs, but one per budget for an algorithm whose runs do not depend on the seed.

    The tests assume that runs are independent: with eleven copies of one run, any difference would
    be significant.
    """
    for _, group in itertools.groupby(runs, lambda run: run.task.algorithm):
        runs_of_algorithm = list(group)
        by_budget = {run.task.n_evaluations: run for run in runs_of_algorithm}
        results = {(run.task.n_evaluations, run.F.tobytes()) for run in runs_of_algorithm}
        is_repeated = len(results) == len(by_budget) < len(runs_of_algorithm)
        # Runs without any feasible design are equal but show nothing.
        if not is_repeated or not any(len(run.F) for run in runs_of_algorithm):
            yield from runs_of_algorithm
            continue
        for run in by_budget.values():
            yield replace(run, task=replace(run.task, seed=None))


def _measures(runs: Sequence[Run], reference: Reference, n_jobs: int) -> pd.DataFrame:
    """Return the table of :meth:`Comparison.to_frame`."""
    import pandas as pd

    quality = dict(in_parallel(reference.measure, [run.F for run in runs], n_jobs))
    rows = []
    for number, run in enumerate(runs):
        row = {
            "algorithm": run.task.algorithm,
            "evaluations": run.task.n_evaluations,
            "seed": run.task.seed,
            "evaluated": run.n_evaluated,
            **quality[number],
            "seconds": run.seconds,
            "evaluation_seconds": run.evaluation_seconds,
        }
        rows.append(row)
    # Integers of pandas, which may be missing; NumPy would make floats of the seeds.
    return pd.DataFrame(rows).astype({"seed": "Int64"})
