"""Algorithms side by side on one problem, at equal cost: the runs and their measures."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    Received,
    counted,
    instance,
    integer,
    invalid,
    job_count,
    known_name,
    objective_matrix,
)
from pymoo_psi.comparison._algorithms import DEFAULT_ALGORITHMS, SEARCHES, searches
from pymoo_psi.comparison._quality import INDICATORS, Reference, pairwise_tests
from pymoo_psi.comparison._runs import Run, Task, perform, stored_runs
from pymoo_psi.parallel import in_parallel, progress_bar
from pymoo_psi.pareto import listed
from pymoo_psi.problems import design_space, problem_layout, problem_name, require_problem, required

if TYPE_CHECKING:
    import pandas as pd

# Powers of 2, after which LPτ points are complete nets.
DEFAULT_EVALUATIONS = (256, 1024, 4096)
# Where surrogates take part: with 4096 evaluations one run of theirs takes minutes.
FEW_EVALUATIONS = (64, 128, 256)
_LEARNING = (SEARCHES["surrogate"], SEARCHES["surrogate-scrambled"])
SIGNIFICANCE = 0.05
"""A difference is claimed where the corrected p value is below this, the customary level."""

_NAMES = {
    "hypervolume": "the largest hypervolume",
    "igd_plus": "the smallest IGD+",
    "epsilon": "the smallest additive epsilon",
    "optimum_distance": "the Salukvadze optimum nearest to the best known",
}
_MEASURES = ["algorithm", "evaluations", "seed", "evaluated", *INDICATORS, "n_nondominated",
             "seconds", "evaluation_seconds"]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Comparison(Shown):
    """The runs of several algorithms on one problem, measured by the same reference.

    Attributes:
        problem: Name of the problem.
        runs: Every run, by algorithm, budget and seed.
        reference: What it is measured against.
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
            Of the result in the example of :class:`Comparison`:

            >>> result.algorithms
            ('psi', 'nsga3')
        """
        return tuple(dict.fromkeys(run.task.algorithm for run in self.runs))

    @property
    def evaluations(self) -> tuple[int, ...]:
        """The budgets, increasing.

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
        keys = ["algorithm", "evaluations"]
        groups = self.measures.groupby(keys, sort=False)
        frame = groups.size().to_frame("runs")
        for column in self.measures.columns.drop([*keys, "seed", "evaluated"]):
            frame[column] = groups[column].median()
            # Values that occurred, as there is no mean of an infinite and a finite one.
            frame[f"{column}_q1"] = groups[column].quantile(0.25, interpolation="lower")
            frame[f"{column}_q3"] = groups[column].quantile(0.75, interpolation="higher")
        return frame.reset_index().sort_values("evaluations", kind="stable", ignore_index=True)

    def tests(self, indicator: str = "hypervolume") -> pd.DataFrame:
        """Return for every pair of algorithms and every budget which is better, and how surely.

        By Mann-Whitney's rank-sum test, or by the sign test where one of the two is deterministic,
        with exact p values, ties or not.

        Args:
            indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.

        Returns:
            Columns ``evaluations``, ``better``, ``worse``, ``effect`` (the probability that a run
            of ``better`` is the better one, 0.5 to 1), ``p``, and ``p_holm``, corrected for all
            pairs and budgets.

        Raises:
            ArgumentValueError: The indicator is unknown.

        Example:
            Of the result in the example of :class:`Comparison`:

            >>> tests = result.tests("igd_plus")
            >>> bool((tests["p_holm"] >= tests["p"]).all() and (tests["effect"] >= 0.5).all())
            True
        """
        return pairwise_tests(self.measures, known_name("indicator", indicator, INDICATORS))

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        medians = self.summary()
        shown = ["evaluations", "algorithm", "runs", *INDICATORS, "n_nondominated", "seconds"]
        return medians[shown].head(n), len(medians)


def compare(
    problem: Any,
    *,
    n_evaluations: int | Sequence[int] | None = None,
    seeds: int | Sequence[int] = 11,
    algorithms: Collection[str] | Mapping[str, Any] = DEFAULT_ALGORITHMS,
    reference_front: ArrayLike | None = None,
    folder: str | PathLike[str] | None = None,
    n_jobs: int = 1,
    progress: bool = True,
) -> Comparison:
    """Run algorithms on a problem at equal numbers of evaluations and measure what they find.

    Every algorithm works on the same problem with the same bounds; the problem itself counts the
    evaluations and ends a run that exceeds its budget. Each budget has runs of its own, so that
    an algorithm may suit its settings to it; criteria by which pymoo's algorithms end by default
    are set aside, those that you set count. All runs are measured against one reference, built
    from the union of what they found (:class:`Reference`). Measured are the non-dominated feasible
    designs among all that a run evaluated, which gives an algorithm that returns only its last
    population the benefit of all it has seen; one that finds nothing feasible has hypervolume 0 and
    infinite distances.

    Args:
        problem: A pymoo problem with two or more objectives and finite bounds. One whose designs
            may fail goes as ``FailureTolerant(problem)``.
        n_evaluations: The budgets, each 1 or more; by default 256, 1024 and 4096, or where
            ``"surrogate"`` takes part 64, 128 and 256.
        seeds: The seeds, or their number n for 1 to n; fewer than six or so cannot tell any two
            algorithms apart. A deterministic algorithm, such as ``"psi"``, runs once; of one of
            your own that finds the same with every seed, one run counts.
        algorithms: Names, or a mapping from names of your own to such names, to pymoo algorithms,
            or to functions that take the number of evaluations and return one:
            ``{"psi": "psi", "a": NSGA2(pop_size=20), "b": lambda n: NSGA2(pop_size=n // 9)}``. An
            algorithm is copied for each run. The names are ``"psi"``, ``"surrogate"``
            (:class:`pymoo_psi.SurrogatePSI`, for some hundred evaluations), ``"nsga3"``,
            ``"psi+nsga3"`` (half the budget for PSI, whose best designs start NSGA-III); these but
            ``"nsga3"`` with ``-scrambled`` behind ``psi`` or ``surrogate`` (scrambled Sobol' points
            for the LPτ points, which begin with the corner and the middle of the box, where many
            test problems have optimal designs); and ``"nsga2"``.
        reference_front: ``(k, m)`` points known to be attainable, such as the true Pareto front;
            they join the union.
        folder: A folder in which every finished run is kept, as a study of all that it tested; the
            same call continues after an interruption or an error, and further budgets, seeds or
            algorithms add to it. Without one nothing is kept. Runs go by the name of their
            algorithm: a changed algorithm wants a new name, and other versions of pymoo or this
            package, under which the same seed may give other designs, a new folder.
        n_jobs: Processes, -1 for one per core; each does whole runs. Times are fair if there are
            no more than idle cores.
        progress: Show before the first run what there is to do, then a progress bar.

    Returns:
        The comparison.

    Raises:
        ArgumentValueError: A number is out of range, a name unknown, or the problem has one
            objective.
        ArgumentTypeError: An argument has the wrong type.
        RunError: The problem or an algorithm raised, as one that does not suit the problem does
            in its first run; finished runs stay in ``folder``.
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
    problem, m = required(problem), problem.n_obj
    if m < 2:
        raise invalid("the number of objectives of problem", "at least 2", m)
    problem_layout(problem, design_space(problem))  # what it lacks is reported before any run
    known = np.zeros((0, m))
    if reference_front is not None:
        known = objective_matrix("reference_front", reference_front)
    if known.shape[1] != m:
        raise invalid("reference_front", f"of {m} objectives", Received(f"{known.shape[1]}"))
    if isinstance(seeds, Integral):
        seeds = range(1, 1 + integer("seeds", seeds, minimum=1))
    seeds, n_jobs = _integers("seeds", seeds, minimum=0), job_count("n_jobs", n_jobs)
    by_name = searches(algorithms)
    if n_evaluations is None:
        learns = any(search in _LEARNING for search in by_name.values())
        n_evaluations = FEW_EVALUATIONS if learns else DEFAULT_EVALUATIONS
    tasks = [
        Task(name, budget, seed)
        for name, search in by_name.items()
        for budget in _integers("n_evaluations", n_evaluations, minimum=1)
        # A deterministic algorithm has one value a budget, and the tests know it by that.
        for seed in ([None] if search is SEARCHES["psi"] else seeds)
    ]
    place = None if folder is None else Path(folder)
    stored = stored_runs(place, problem) if place else ()
    runs = {run.task: run for run in stored if run.task in tasks}
    # The longest first, so that no process begins one when the others have done their last; and of
    # each algorithm one, so that one that does not suit the problem is found out early.
    missing = [task for task in tasks if task not in runs]
    missing.sort(key=lambda task: (-task.n_evaluations, task.seed or 0))
    name, n = problem_name(problem), sum(task.n_evaluations for task in missing)
    if progress and missing:
        work = f"{counted(len(missing), 'run')} of {counted(n, 'evaluation')} in all"
        print(f"{name}: {work}", file=sys.stderr, flush=True)

    def performed(task: Task) -> Run:
        # Kept by the process that does it, whatever becomes of the one that waits for it.
        return perform(problem, by_name[task.algorithm], task, place)

    with progress_bar(progress) as bar:
        bar(len(runs) / len(tasks))
        for _, run in in_parallel(performed, missing, n_jobs):
            runs[run.task] = run
            bar(len(runs) / len(tasks))
    done = tuple(_counted_once([runs[task] for task in tasks]))
    reference = Reference.of([*(run.F for run in done), known])
    return Comparison(name, done, reference, _measures(done, reference, n_jobs))


def _integers(name: str, values: Any, *, minimum: int) -> list[int]:
    """Return one integer or several, each once, in increasing order."""
    several = np.atleast_1d(np.asarray(values, dtype=object)).tolist()
    if not (checked := sorted({integer(name, value, minimum=minimum) for value in several})):
        raise invalid(name, "one or more integers", values)
    return checked


def _counted_once(runs: Sequence[Run]) -> Iterator[Run]:
    """Give the runs, of an algorithm that leaves nothing to chance one a budget.

    The tests take runs for independent: eleven times the same one would make them sure of
    anything. Nothing found tells nothing.
    """
    for _, own in itertools.groupby(runs, lambda run: run.task.algorithm):
        several = list(own)
        one = {run.task.n_evaluations: run for run in several}
        same = (np.array_equal(run.F, one[run.task.n_evaluations].F) for run in several)
        if len(one) < len(several) and any(len(run.F) for run in several) and all(same):
            several = [replace(run, task=replace(run.task, seed=None)) for run in one.values()]
        yield from several


def _measures(runs: Sequence[Run], reference: Reference, n_jobs: int) -> pd.DataFrame:
    """Return the table of :meth:`Comparison.to_frame`."""
    import pandas as pd

    quality = dict(in_parallel(reference.measure, [run.F for run in runs], n_jobs))
    rows = [
        (run.task.algorithm, run.task.n_evaluations, run.task.seed, run.n_evaluated,
         *quality[number].values(), run.seconds, run.evaluation_seconds)
        for number, run in enumerate(runs)
    ]  # fmt: skip
    # Integers of pandas, which may be missing; NumPy would make the seeds floats.
    return pd.DataFrame(rows, columns=_MEASURES).astype({"seed": "Int64"})


def conclusions(comparison: Comparison, indicator: str = "hypervolume") -> tuple[str, ...]:
    """Return for every budget which algorithm is the best, and than which it surely is.

    They name the algorithm with the best median, the algorithms that it is better than, with the
    effect size and the corrected p value, and those from which no difference can be claimed.

    Args:
        comparison: The comparison.
        indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.

    Raises:
        ArgumentValueError: The indicator is unknown.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> result = compare(
        ...     get_problem("osy"), n_evaluations=512, seeds=6, algorithms=["psi", "nsga3"]
        ... )
        >>> print(conclusions(result)[0])
        512 evaluations: nsga3 has the largest hypervolume (median 0...). It is better than psi
        (effect 1.00, p = 0.031).
    """
    instance("comparison", comparison, Comparison, "compare(...) gives one")
    tests, summary = comparison.tests(indicator), comparison.summary()
    sentences = []
    for budget in comparison.evaluations:
        medians = summary[summary["evaluations"] == budget].set_index("algorithm")[indicator]
        at = tests[tests["evaluations"] == budget]
        sentences.append(f"{counted(budget, 'evaluation')}: {_conclusion(indicator, medians, at)}")
    return tuple(sentences)


def _conclusion(indicator: str, medians: pd.Series, tests: pd.DataFrame) -> str:
    ordered = medians.sort_values(ascending=INDICATORS[indicator] < 0, kind="stable")
    best, value = ordered.index[0], ordered.iloc[0]
    if value == (0.0 if indicator == "hypervolume" else np.inf):
        return f"every algorithm has the worst possible median, {value:g}."
    # The best median may lose more often than not: then the test names the other one.
    leads = ("It is better than", "But more often than not a run is beaten by one of",
             "No difference can be claimed from")  # fmt: skip
    groups: dict[str, list[str]] = {lead: [] for lead in leads}
    for pair in tests[(tests["better"] == best) | (tests["worse"] == best)].itertuples():
        won = pair.better == best
        name, effect = (pair.worse, pair.effect) if won else (pair.better, 1 - pair.effect)
        p = pair.p_holm  # NaN of two deterministic algorithms
        sure = f"p = {p:.3f}" if p >= 0.001 else "p < 0.001" if p >= 0 else "one value each"
        lead = leads[2] if not p < SIGNIFICANCE else leads[0] if won else leads[1]
        groups[lead].append(f"{name} (effect {effect:.2f}, {sure})")
    claims = [f"{lead} {listed(names)}." for lead, names in groups.items() if names]
    return " ".join([f"{best} has {_NAMES[indicator]} (median {value:.4g}).", *claims])
