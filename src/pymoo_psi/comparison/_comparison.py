"""Several algorithms on one problem, at equal cost: their runs, measures of these, and tests.

All runs are measured against one reference. For two random algorithms, the rank-sum test of
Wilcoxon, Mann and Whitney tests whether the runs of one tend to be better; ties share their mean
rank, and the p value is exact with ties, too. A deterministic algorithm has a single value; then
the exact sign test tests whether the median run of the other algorithm is better than this value.
The p values of all pairs and budgets are corrected together by Holm's method (Scand. J. Statist. 6,
1979), which bounds the probability of one or more false claims. The effect size is that of Vargha
and Delaney (J. Educ. Behav. Stat. 25, 2000): the probability that a run of one algorithm is better
than a run of the other, with ties counted half.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    Array,
    Entries,
    FilePath,
    Received,
    counted,
    integer,
    invalid,
    job_count,
    known_name,
    objective_matrix,
    require_shape,
)
from pymoo_psi.algorithms import progress_bar
from pymoo_psi.comparison._runs import (
    DEFAULT_ALGORITHMS,
    RunResult,
    Search,
    Task,
    perform,
    searches,
    stored_results,
)
from pymoo_psi.parallel import in_parallel
from pymoo_psi.pareto import (
    UtopianFrame,
    epsilon_additive,
    hypervolume,
    igd_plus,
    nondominated,
    rank_of_efficiency,
    spread_subset,
    unit_lengths,
)
from pymoo_psi.problems import (
    design_space,
    problem_name,
    problem_schema,
    require_problem,
    with_requirements,
)

if TYPE_CHECKING:
    import pandas as pd


Indicator = Literal["hypervolume", "igd_plus", "epsilon", "optimum_distance"]
INDICATORS: dict[Indicator, int] = {
    "hypervolume": 1,
    "igd_plus": -1,
    "epsilon": -1,
    "optimum_distance": -1,
}
"""The indicators of quality: 1 if more is better, -1 if less is better."""

_REFERENCE_POINT = 1.1
"""Each coordinate of the reference point of the hypervolume, in units of N − U.

It lies beyond N, where the extreme points of a front would dominate no volume; 1.1 is the customary
choice (Ishibuchi et al., Evol. Comput. 26, 2018, discuss it).
"""
_REFERENCE_SIZE = 1000
"""Points to which the reference set is thinned, as IGD+ takes all distances to each of them."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The reference of a comparison.

    It consists of the non-dominated points among the designs of all runs and the points of a known
    front, if there is one. They define the scale: U and N are their best and worst values, and
    every objective is measured in units of N − U. If they all have the same value of an objective,
    up to rounding, this objective is measured up to the worst value of any run. The reference set
    of IGD+ and of the additive epsilon indicator consists of 1000 of them, evenly spread; the
    reference point of the hypervolume is U + 1.1 (N − U).

    Attributes:
        frame: U, N and the scale.
        points: ``(k, m)`` the reference set, in the scale; empty if no run has a feasible design.
        optimum: ``(m,)`` objectives, all minimised, of the best known Salukvadze optimum: the point
            nearest to U.

    Example:
        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi import compare
        >>> bnh = get_problem("bnh")
        >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
        >>> reference = result.reference
        >>> bool((reference.points >= 0).all() and (reference.points <= 1).all())
        True
    """

    frame: UtopianFrame
    points: Array = field(repr=False)
    optimum: Array

    @classmethod
    def of(cls, fronts: Sequence[Array]) -> Reference:
        """Return the reference of sets of ``(n, m)`` objectives, all minimised.

        Example:
            Of the result in the example of :class:`Reference`:

            >>> reference = Reference.of([run.F for run in result.runs])
            >>> np.array_equal(reference.points, result.reference.points)
            True
        """
        # Unique and sorted, so that the order of the runs does not decide which points are kept.
        F = np.unique(np.vstack(fronts), axis=0)
        if len(F) == 0:
            nowhere = np.full(F.shape[1], np.nan)
            return cls(UtopianFrame(nowhere, nowhere, normalize=True), F, nowhere)
        worst = F.max(axis=0)
        F = F[nondominated(F)]
        U = F.min(axis=0)
        N = F.max(axis=0)
        # An objective without a range would count for nothing, and runs that are worse in it would
        # look equal: with a single best point, all runs would be alike.
        N = np.where(np.isfinite(unit_lengths(U, N)), N, worst)
        frame = UtopianFrame(U, N, normalize=True)
        scaled = frame.scaled(F)
        points = scaled[spread_subset(scaled, _REFERENCE_SIZE)]
        nearest = frame.distances(F).argmin()
        return cls(frame, points, F[nearest])

    def measure(self, F: Array) -> dict[str, float]:
        """Return the quality of the ``(n, m)`` non-dominated objectives of a run.

        The hypervolume is a share of the box from U to the reference point (Zitzler and Thiele
        1998), IGD+ that of Ishibuchi et al. (2015), epsilon that of Zitzler et al. (2003).
        ``optimum_distance`` is the distance, in the scale, from the Salukvadze optimum of the run
        to the best known one. The former is determined with U and N of the run, as a user would do.

        Raises:
            ArgumentValueError: An objective that is constant in all runs has another value here.

        Example:
            Of the result in the example of :class:`Reference`:

            >>> result.reference.measure(np.zeros((0, 2)))["hypervolume"]
            0.0
        """
        if len(F) == 0:
            worst: dict[str, float] = dict.fromkeys(INDICATORS, np.inf)
            return {**worst, "hypervolume": 0.0, "n_nondominated": 0}
        # Without a range nothing tells how much worse, or better, another value is.
        constant = np.isinf(self.frame.lengths)
        ends = np.array([self.frame.ideal, *F])[:, constant]
        if np.isfinite(unit_lengths(ends.min(axis=0), ends.max(axis=0))).any():
            rule = "objectives of runs of the reference, where one of them is constant"
            raise invalid("F", rule, F, "include these in Reference.of")
        scaled = self.frame.scaled(F)
        optimum = F[rank_of_efficiency(F).salukvadze[:1]]
        distance = self.frame.scaled(optimum) - self.frame.scaled(self.optimum)
        return {
            "hypervolume": hypervolume(scaled, _REFERENCE_POINT)[0],
            "igd_plus": float(igd_plus(scaled, ref=self.points)),
            "epsilon": float(epsilon_additive(scaled, ref=self.points)),
            "optimum_distance": float(np.linalg.norm(distance)),
            "n_nondominated": len(F),
        }


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
    runs: tuple[RunResult, ...]
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
            Columns ``algorithm``, ``evaluations``, ``seed`` (missing if the result
            does not depend on it), ``evaluated`` (number of designs, counted by the problem),
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

    def tests(self, indicator: Indicator = "hypervolume") -> pd.DataFrame:
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
        import pandas as pd

        known_name("indicator", indicator, INDICATORS)
        rows = []
        for budget, runs_of_budget in self.measures.groupby("evaluations", sort=True):
            by_name = dict(iter(runs_of_budget.groupby("algorithm", sort=False)))
            for better, worse in itertools.combinations(by_name, 2):
                a = _values(by_name[better], indicator)
                b = _values(by_name[worse], indicator)
                effect = effect_size(a, b)
                if effect < 0.5:
                    better, worse = worse, better
                    effect = 1 - effect
                rows.append((budget, better, worse, effect, p_value(a, b)))
        frame = pd.DataFrame(rows, columns=["evaluations", "better", "worse", "effect", "p"])
        return frame.assign(p_holm=holm(frame["p"].to_numpy(float)))

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
            bounds, where many test problems have optimal designs. All of these search variables in
            the problem's ``log`` on a logarithmic scale; for an algorithm of pymoo, compare on
            :class:`pymoo_psi.LogScaled`.
        reference_front: ``(k, m)`` points known to be attainable, such as the true Pareto front;
            they are added to the union.
        folder: A folder for the finished runs, each a study of all its tests. After an interruption
            or an error, the same call continues; further budgets, seeds or algorithms are added.
            Without a folder nothing is stored. Runs are identified by the name of their algorithm,
            so give a changed algorithm a new name. Use a new folder for other versions of pymoo or
            of this package, because a seed may give other designs there.
        n_jobs: Number of processes, -1 for one per core; each performs whole runs. Times are
            comparable if there are no more processes than idle cores.
        progress: Show a progress bar.

    Returns:
        The comparison.

    Raises:
        ArgumentValueError: A number is out of range, a name is unknown, or the problem has a single
            objective.
        ArgumentTypeError: An argument has the wrong type.
        PsiError: The problem or an algorithm raised an exception; finished runs stay in ``folder``.
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
    if getattr(problem, "noisy", False):
        rule = "one whose tests of a design do not differ"
        raise invalid("the problem of a comparison", rule, Received("a noisy one"))
    problem_schema(problem, design_space(problem))  # reports flaws before any run
    front = np.empty((0, problem.n_obj))
    if reference_front is not None:
        front = objective_matrix("reference_front", reference_front)
        require_shape("reference_front", front, (len(front), problem.n_obj))
    n_jobs = job_count("n_jobs", n_jobs)
    by_name = searches(algorithms)
    tasks = _tasks(by_name, n_evaluations, seeds)
    path = None if folder is None else Path(folder)
    with progress_bar(progress) as bar:
        runs = tuple(_independent(_results(problem, by_name, tasks, path, n_jobs, bar)))
    reference = Reference.of([*(run.F for run in runs), front])
    measures = _measures(runs, reference, n_jobs)
    return Comparison(problem_name(problem), runs, reference, measures)


def _results(
    problem: Any,
    by_name: Mapping[str, Search],
    tasks: Sequence[Task],
    folder: Path | None,
    n_jobs: int,
    show: Callable[[float], object],
) -> list[RunResult]:
    """Return the results of tasks; those that a folder has are not performed again."""
    results = {}
    if folder is not None:
        for result in stored_results(folder, problem):
            results[result.task] = result
    missing = [task for task in tasks if task not in results]
    # The longest first, so that all processes end at about the same time; and one of each
    # algorithm, so that one that does not suit the problem is found early.
    missing.sort(key=lambda task: (-task.n_evaluations, task.seed or 0))
    # The process that performs a run stores it, even if its parent process ends before.
    performed = partial(perform, problem, by_name, folder)
    n_known = len(tasks) - len(missing)
    show(n_known / len(tasks))
    for n, (_, result) in enumerate(in_parallel(performed, missing, n_jobs), n_known + 1):
        results[result.task] = result
        show(n / len(tasks))
    return [results[task] for task in tasks]


def _tasks(
    by_name: Mapping[str, Search],
    n_evaluations: int | Sequence[int] | None,
    seeds: int | Sequence[int],
) -> list[Task]:
    """Return the runs of a comparison: all algorithms with all budgets and seeds."""
    if isinstance(seeds, Integral):
        seeds = range(1, 1 + integer("seeds", seeds, minimum=1))
    if n_evaluations is None:
        n_evaluations = min((search.budgets for search in by_name.values()), key=max)
    budgets = _integers("n_evaluations", n_evaluations, minimum=1)
    several = _integers("seeds", seeds, minimum=0)
    tasks = []
    for name, search in by_name.items():
        seeds_of_search: list[int | None] = [None]
        if search.is_random:
            seeds_of_search = [*several]
        for budget, seed in itertools.product(budgets, seeds_of_search):
            tasks.append(Task(name, budget, seed))
    return tasks


def _integers(name: str, values: Any, *, minimum: int) -> list[int]:
    """Return one integer or several, without repeats, in increasing order."""
    several = np.atleast_1d(np.asarray(values, dtype=object)).tolist()
    if not several:
        raise invalid(name, "one or more integers", values)
    return sorted({integer(name, value, minimum=minimum) for value in several})


def _independent(results: Sequence[RunResult]) -> Iterator[RunResult]:
    """Yield results, but one of an algorithm and a budget if they do not depend on the seed.

    The tests assume that runs are independent: with eleven copies of one run, any difference would
    be significant. Surrogates have no seed before the first points of the sequence are spent; runs
    that first differ and then find the same are independent at all budgets.
    """
    with_seeds = set()  # algorithms whose runs differ at a smaller budget
    for _, group in itertools.groupby(results, lambda result: replace(result.task, seed=None)):
        runs = list(group)
        first = runs[0]
        algorithm = first.task.algorithm
        if not all(np.array_equal(run.F, first.F) for run in runs):
            with_seeds.add(algorithm)
        # Results without any feasible design are equal but show nothing.
        if len(runs) > 1 and len(first.F) and algorithm not in with_seeds:
            yield replace(first, task=replace(first.task, seed=None))
        else:
            yield from runs


def _measures(runs: Sequence[RunResult], reference: Reference, n_jobs: int) -> pd.DataFrame:
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


# Tests whether one algorithm is better than another

_EXACT_RUNS = 40
"""Number of runs of an algorithm up to which p values are exact; such a test takes 0.05 s.

With more runs, the normal approximation with its correction for ties has an error of a few per cent
at the usual levels of significance; far below them its p values are too large.
"""


def holm(p: Array) -> Array:
    """Return p values corrected by Holm's method; NaN stays NaN and is not counted.

    Args:
        p: ``(n,)`` p values.

    Example:
        >>> print(holm(np.array([0.01, 0.04, 0.03])))
        [0.03 0.06 0.06]
    """
    import pandas as pd

    increasing = pd.Series(p).dropna().sort_values(kind="stable")
    # The smallest of k p values is multiplied by k, the next by k - 1, and so on; none becomes
    # smaller than the one before it.
    factors = np.arange(len(increasing), 0, -1)
    corrected = (increasing * factors).cummax().clip(upper=1.0)
    return np.asarray(corrected.reindex(range(len(p))), dtype=np.float64)


def effect_size(a: Array, b: Array) -> float:
    """Return the probability that a value of ``a`` is above one of ``b``; ties count half.

    Example:
        >>> effect_size(np.array([1.0, 3.0]), np.array([1.0, 2.0]))
        0.625
    """
    above = np.greater.outer(a, b).mean()
    equal = np.equal.outer(a, b).mean()
    return float(above + 0.5 * equal)


def p_value(a: Array, b: Array) -> float:
    """Return the two-sided p value for the hypothesis that two algorithms do not differ.

    Args:
        a: ``(k,)`` values of the runs of one; of a deterministic algorithm ``()`` its value.
        b: The same of the other. If both are deterministic, NaN is returned.

    Example:
        >>> round(p_value(np.arange(5.0), np.arange(5.0) + 10), 4)  # 2 / 252
        0.0079
    """
    if a.ndim == b.ndim == 0:
        return np.nan
    if a.ndim == 0:
        return _sign_test(b, float(a))
    if b.ndim == 0:
        return _sign_test(a, float(b))
    return _rank_sum_test(a, b)


def _sign_test(runs: Array, value: float) -> float:
    """Return the p value for the hypothesis that a value is the median of runs."""
    from scipy.stats import binomtest  # heavy to import

    above = int((runs > value).sum())
    different = int((runs != value).sum())  # the sign test ignores ties
    if different == 0:
        return 1.0
    return float(binomtest(above, different).pvalue)


def _rank_sum_test(a: Array, b: Array) -> float:
    """Return the p value of the rank-sum test; it is exact for few runs, with or without ties."""
    from scipy.stats import mannwhitneyu, rankdata  # heavy to import

    # Ranks replace the values, as infinite values have no differences. Ties share their mean rank;
    # twice the mean rank is an integer.
    k = len(a)
    ranks = (2 * rankdata(np.concatenate([a, b]))).astype(int)
    if max(k, len(b)) > _EXACT_RUNS:
        return float(mannwhitneyu(ranks[:k], ranks[k:], method="asymptotic").pvalue)
    # If the algorithms do not differ, any k of all runs are equally likely to be those of the
    # first. ways[j, t] is the number of ways to choose j runs with ranks that sum to t. Floats hold
    # integers up to 2^53 and lose only the last digits beyond.
    ways = np.zeros((k + 1, int(ranks.sum()) + 1))
    ways[0, 0] = 1
    for rank in ranks:
        ways[1:, rank:] += ways[:-1, :-rank].copy()  # without this run, and with it
    observed = int(ranks[:k].sum())
    # Two-sided: twice the smaller tail, which exceeds 1 if both tails include the observed sum.
    lower_tail = ways[k, : observed + 1].sum()
    upper_tail = ways[k, observed:].sum()
    share = float(min(lower_tail, upper_tail) / ways[k].sum())
    return min(1.0, 2.0 * share)


def _values(runs: pd.DataFrame, indicator: Indicator) -> Array:
    """Return an indicator of the runs of an algorithm, of which more is better, for `p_value`."""
    values: Array = INDICATORS[indicator] * runs[indicator].to_numpy(float)
    if runs["seed"].isna().all():  # a single run, that of any seed
        return values[0, ...]
    return values
