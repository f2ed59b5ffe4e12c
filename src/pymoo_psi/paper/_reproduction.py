"""The paper's results computed anew, and compared with what it prints.

For each friction coefficient the LPτ points of the box are tested, the Pareto set is ranked by
efficiency with plain Euclidean distances, and the tables are read off: Table 6.1 lists the
Salukvadze optimum, Table 6.2 the designs of rank 5 whose f4 is below the optimum's.

The printed values are those of Cheshankov, Bozduganova, Ivanov, Vitliemov: Multi-objective Motion
Synthesis of a Rolling Sphere in a Rectilinear Chute-conveyor with Transformed Dry Friction,
Technische Mechanik 32(6), 2012, 684–697. The test point that Table 6.2 calls 1356 is number 2571 by
its f3 and f4.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import resources

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pymoo.optimize import minimize

from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    counted,
    integer,
    invalid,
    job_count,
)
from pymoo_psi.algorithms import PSI, Refinement, refine
from pymoo_psi.chute import MODELS, criteria, motion
from pymoo_psi.parallel import in_order, in_parallel
from pymoo_psi.pareto import EfficiencyRanking, rank_of_efficiency
from pymoo_psi.problems import VectorizedSphereChute
from pymoo_psi.sequences import lp_tau
from pymoo_psi.table import Convergence, TestTable, convergence

Array = NDArray[np.float64]

PAPER_MU = (0.2, 0.4, 0.6)
PAPER_POINTS = 4096
# Test points per case from which on workers are started: the six cases take two and a half
# seconds with the paper's 4096, which is what it takes to start a worker.
_WORTH_WORKERS = 16_384

# The columns of the CSV files, which users have.
_CRITERIA = [f"f{j}" for j in range(1, 5)]
_PRINTED = [f"paper_f{j}" for j in range(1, 5)]
_COLUMNS = ["model", "mu", "test_point", *_CRITERIA, *_PRINTED]

INITIAL_SPEEDS = tuple(np.linspace(0.05, 1.0, 39).tolist())  # around the paper's c = 0.3193
_FINE = 201  # lines on which is seen where the criteria of Figure 2 change fast


def published_table(number: str) -> pd.DataFrame:
    """Return a printed table.

    Args:
        number: ``"6.1"`` (Salukvadze optima) or ``"6.2"`` (selected designs of rank 5).

    Returns:
        One row per printed row; columns ``mu``, ``test_point``, ``paper_f1`` … ``paper_f4``.

    Example:
        >>> print(published_table("6.1"))
            mu  test_point  paper_f1  paper_f2  paper_f3  paper_f4
        0  0.2        3599    1.9829    0.0532    0.3074    0.1130
        1  0.4        3085    2.0454    0.0476    0.2635    0.1072
        2  0.6        1029    2.0454    0.0476    0.2635    0.1144
    """
    text = resources.files(__package__).joinpath("published.json").read_text("utf-8")
    rows = json.loads(text)[f"table_{number.replace('.', '_')}"]
    lines = [(row["mu"], row["test_point"], *row["f"]) for row in rows]
    return pd.DataFrame(lines, columns=["mu", "test_point", *_PRINTED])


@dataclass(frozen=True, eq=False, repr=False)
class Case:
    """One friction coefficient under one model.

    Attributes:
        model: ``"full"`` or ``"rolling"``.
        mu: Friction coefficient.
        test_point: ``(n,)`` numbers of the Pareto-optimal test points.
        X: ``(n, 2)`` their designs.
        F: ``(n, 4)`` their criteria.
        ranking: Their ranks of efficiency, labelled by their test points.
        refined: The continuous Salukvadze optimum, against the same U and N.
        table: All tests, by number.

    Example:
        >>> case = solve_case(0.4, "rolling", 4096)
        >>> case.test_point[case.ranking.salukvadze]  # the paper's design for mu = 0.4
        array([3085])
        >>> case
        Case(rolling model, mu = 0.4: 2160 Pareto optimal of 4096 test points, the best no. 3085)
    """

    model: str
    mu: float
    test_point: NDArray[np.int64]
    X: NDArray[np.float64]
    F: NDArray[np.float64]
    ranking: EfficiencyRanking
    refined: Refinement
    table: TestTable

    def __repr__(self) -> str:
        """Return which case it is and what was found."""
        best = ", ".join(map(str, self.test_point[self.ranking.salukvadze]))
        tests = counted(len(self.table), "test point")
        return (
            f"Case({self.model} model, mu = {self.mu:g}: {len(self.F)} Pareto optimal of {tests}, "
            f"the best no. {best})"
        )

    def cheaper(self, rank: int) -> NDArray[np.intp]:
        """Return the rows of this rank whose f4 is below the Salukvadze optimum's.

        Example:
            Of the case in the example of :class:`Case`:

            >>> case.test_point[case.cheaper(5)]  # the row of Table 6.2 for mu = 0.4
            array([2571])
        """
        # Of several optima, equally near to U, the cheapest is the limit.
        members = self.ranking.subset(rank)
        limit = self.F[self.ranking.salukvadze, 3].min()
        cheaper: NDArray[np.intp] = members[self.F[members, 3] < limit]
        return cheaper

    def rows(self, indices: NDArray[np.intp]) -> pd.DataFrame:
        """Return designs as rows of the paper's tables, ordered by test point.

        Example:
            Of the case in the example of :class:`Case`:

            >>> print(case.rows(case.ranking.salukvadze).round(4))
                 model   mu  test_point      f1      f2      f3      f4
            0  rolling  0.4        3085  2.0458  0.0476  0.2635  0.1072
        """
        chosen = indices[np.argsort(self.test_point[indices])]
        frame = pd.DataFrame(self.F[chosen], columns=_CRITERIA)
        frame.insert(0, "test_point", self.test_point[chosen])
        frame.insert(0, "mu", self.mu)
        frame.insert(0, "model", self.model)
        return frame


@dataclass(frozen=True, eq=False, repr=False)
class Reproduction(Shown):
    """All cases of the paper, computed with ``n_points`` test points each.

    Example:
        >>> cases = [solve_case(0.4, model, 64) for model in ("rolling", "full")]
        >>> [case.model for case in Reproduction(64, tuple(cases)).cases]
        ['rolling', 'full']
    """

    n_points: int
    cases: tuple[Case, ...]

    def __repr__(self) -> str:
        """Return how many points and which cases."""
        cases = ", ".join(f"{case.model} {case.mu:g}" for case in self.cases)
        return f"Reproduction({self.n_points} test points: {cases})"

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        return self.table_6_1().head(n), len(self.cases)

    def table_6_1(self) -> pd.DataFrame:
        """Return the Salukvadze optima, with the printed one of the same μ beside each.

        Returns:
            Columns ``model, mu, test_point, f1 … f4, paper_f1 … paper_f4``.

        Example:
            Of the case in the example of :class:`Case`:

            >>> one = Reproduction(4096, (case,))
            >>> print(one.table_6_1()[["test_point", "f1", "paper_f1", "f2", "paper_f2"]].round(4))
               test_point      f1  paper_f1      f2  paper_f2
            0        3085  2.0458    2.0454  0.0476    0.0476
        """
        computed = pd.concat([case.rows(case.ranking.salukvadze) for case in self.cases])
        # Beside another test point too: the paper's optimum is what the computed one is against.
        printed = published_table("6.1").drop(columns="test_point")
        return computed.merge(printed, on="mu", how="left")[_COLUMNS]

    def table_6_2(self) -> pd.DataFrame:
        """Return the designs of rank 5 with f4 below the optimum's.

        A printed row stands beside the same test point of the same μ; elsewhere the columns
        ``paper_f1`` … ``paper_f4`` are empty.

        Example:
            Of the case in the example of :class:`Case`:

            >>> one = Reproduction(4096, (case,))
            >>> print(one.table_6_2()[["test_point", "f2", "paper_f2", "f4", "paper_f4"]].round(4))
               test_point      f2  paper_f2      f4  paper_f4
            0        2571  0.0683    0.0683  0.1043    0.1043
        """
        computed = pd.concat([case.rows(case.cheaper(5)) for case in self.cases])
        return computed.merge(published_table("6.2"), on=["mu", "test_point"], how="left")[_COLUMNS]

    def continuous_optima(self) -> pd.DataFrame:
        """Return the continuous Salukvadze optimum of every case.

        Returns:
            Columns ``model, mu, f1 … f4``; ``distance`` to U, and ``best_point_distance``, how
            far the best of the test points was from U.

        Example:
            No test point is nearer to U than the continuous optimum.

            >>> one = Reproduction(64, (solve_case(0.4, "rolling", 64),))
            >>> optimum = one.continuous_optima().iloc[0]
            >>> bool(optimum["distance"] < optimum["best_point_distance"])
            True
        """
        rows = []
        for case in self.cases:
            found = case.refined
            rows.append((case.model, case.mu, *found.f, found.distance, found.start_distance))
        columns = ["model", "mu", *_CRITERIA, "distance", "best_point_distance"]
        return pd.DataFrame(rows, columns=columns)

    @cached_property
    def convergences(self) -> tuple[Convergence, ...]:
        """For each case, what a half, a quarter, … of its points would have decided.

        Raises:
            ArgumentValueError: There are fewer than eight points.

        Example:
            >>> one = Reproduction(1024, (solve_case(0.4, "rolling", 1024),))
            >>> one.convergences[0].optimum[-4:]
            array([  35,  205,  205, 1021])
        """
        return tuple(convergence(case.table, normalize=False) for case in self.cases)

    def agreement(self) -> dict[str, bool]:
        """Compare what was computed under the rolling model with what the paper prints.

        Returns:
            Each statement with whether it holds; none where a case of the paper is missing, or the
            test points are not as many, which says nothing about the paper.

        Example:
            >>> Reproduction(64, (solve_case(0.4, "rolling", 64),)).agreement()
            {}
        """
        cases = [case for case in self.cases if case.model == "rolling" and case.mu in PAPER_MU]
        if self.n_points != PAPER_POINTS or {case.mu for case in cases} != {*PAPER_MU}:
            return {}
        paper = Reproduction(self.n_points, tuple(cases))
        ours = pd.concat([paper.table_6_1(), paper.table_6_2()])
        theirs = pd.concat([published_table(number) for number in ("6.1", "6.2")])
        same = sorted(zip(ours["mu"], ours["test_point"], strict=True)) == sorted(
            zip(theirs["mu"], theirs["test_point"], strict=True)
        )
        difference = ours[_CRITERIA].round(4).to_numpy() - ours[_PRINTED].to_numpy()
        # The printed f1 is 4e-4 to 6e-4 below the exact value in every row, by an error of its
        # solver; f2 to f4 agree to all four printed decimals.
        f1 = ours["f1"] - ours["paper_f1"]
        last = next(case for case in cases if case.mu == PAPER_MU[-1])
        return {
            "the same seven designs": same,
            # 1e-9: both sides are rounded, to four decimals, and differ by representation only.
            "f2, f3, f4 equal at four decimals": same
            and bool((abs(difference[:, 1:]) < 1e-9).all()),
            "f1 within 6e-4 of print": same and bool((abs(f1) <= 6e-4).all()),
            "no design of rank 5 for mu = 0.6": len(last.ranking.subset(5)) == 0,
            "none of rank 4 with a smaller f4 for mu = 0.6": len(last.cheaper(4)) == 0,
        }


def solve_case(mu: float, model: str, n_points: int) -> Case:
    """Investigate the chute for one μ under one model and rank its Pareto set.

    Args:
        mu: Friction coefficient.
        model: ``"full"`` or ``"rolling"``.
        n_points: Test points.

    Raises:
        ArgumentValueError: A number is out of range, or there is no such model.

    Example:
        >>> case = solve_case(0.2, "full", 64)
        >>> case.refined.distance <= case.refined.start_distance
        True
    """
    problem = VectorizedSphereChute(mu, model=model)
    result = minimize(problem, PSI(n_points))
    # The paper measures distances in the criteria's own units, which are dimensionless.
    ranking = result.algorithm.table.ranking(normalize=False)
    refined = refine(problem, result.X[ranking.salukvadze[0]], ranking)
    numbers, table = result.opt.get("test_point"), result.algorithm.table
    return Case(model, mu, numbers, result.X, result.F, ranking, refined, table)


def reproduce(
    n_points: int = PAPER_POINTS,
    *,
    mu: Sequence[float] = PAPER_MU,
    models: Sequence[str] = MODELS,
    n_jobs: int = 1,
    on_case: Callable[[Case], object] = lambda case: None,
) -> Reproduction:
    """Solve every case of the paper under both models, or cases of another friction coefficient.

    Args:
        n_points: Test points per case; the paper has 4096.
        mu: Friction coefficients.
        models: ``"full"``, ``"rolling"`` or both.
        n_jobs: Processes to work in, -1 for one per core, if there are so many points that
            starting them is worth it.
        on_case: Called with each case as soon as it is ready, to show progress.

    Raises:
        ArgumentValueError: A number is out of range, μ or the models are none, or there is no such
            model.
        ArgumentTypeError: A count is not an integer.

    Example:
        >>> few = reproduce(64, mu=[0.2, 0.4], models=["rolling"])
        >>> few.table_6_1()[["model", "mu", "test_point"]]
             model   mu  test_point
        0  rolling  0.2          18
        1  rolling  0.4          35
    """
    n_points = integer("n_points", n_points, minimum=1)
    n_jobs = job_count("n_jobs", n_jobs)
    if len(mu) == 0 or len(models) == 0:
        raise invalid("mu and models", "one or more each", [list(mu), list(models)])
    # Rolling first, as the paper's tables follow from it.
    wanted = [
        (value, model) for model in sorted(set(models), reverse=True) for value in dict.fromkeys(mu)
    ]

    def solved(task: tuple[float, str]) -> Case:
        return solve_case(*task, n_points)

    cases = []
    for case in in_order(in_parallel(solved, wanted, n_jobs if n_points >= _WORTH_WORKERS else 1)):
        on_case(case)
        cases.append(case)
    return Reproduction(n_points, tuple(cases))


# What figures 2 and 8 show, as numbers.


def criterion_surfaces(mu: float, model: str, *, n: int = 61) -> tuple[Array, Array, Array]:
    """Compute f1 and f2 on a grid of n × n designs over the box [0, 3.5 μ] × [0.1, 6].

    The grid's lines are dense where a criterion changes fast: near the level chute, where the time
    grows by half within a fortieth of the box. f3 = u1 and f4 = u2 need no figure.

    Returns:
        ``(n, n)`` slopes u1, increasing along the first axis; ``(n, n)`` speeds u2 of the plane,
        increasing along the second; ``(2, n, n)`` the criteria, NaN where the sphere stalls.

    Example:
        >>> u1, u2, f = criterion_surfaces(0.4, "rolling", n=5)
        >>> f.shape
        (2, 5, 5)
    """
    problem = VectorizedSphereChute(mu, model=model)
    sides = [
        np.linspace(low, high, _FINE) for low, high in zip(problem.xl, problem.xu, strict=True)
    ]
    f = _on_grid(problem, *sides)[2]
    graded = []
    for axis, side in enumerate(sides):
        # The change of either criterion from line to line, as a share of the whole way; as much
        # again is spread evenly over the box, so that flat parts keep lines too.
        change = np.abs(np.diff(np.moveaxis(f, axis + 1, 1), axis=1))
        change = np.nanmax(change, axis=2, initial=0.0)
        whole = change.sum(axis=1, keepdims=True)
        whole[whole == 0] = 1.0  # rolling from the start, the time does not depend on u2
        weight = (change / whole).mean(axis=0) + 1 / (_FINE - 1)
        reached = np.concatenate([[0.0], np.cumsum(weight)])
        graded.append(np.interp(np.linspace(0, reached[-1], n), reached, side))
    return _on_grid(problem, *graded)


def _on_grid(problem: VectorizedSphereChute, *sides: Array) -> tuple[Array, Array, Array]:
    """Return u1, u2 and the first two criteria on the grid of these lines."""
    u1, u2 = np.meshgrid(*sides, indexing="ij")
    F = problem.evaluate(np.column_stack([u1.ravel(), u2.ravel()]), return_values_of=["F"])
    # Infinite where the sphere stalls; NaN leaves a hole in a surface.
    return u1, u2, np.where(np.isfinite(F), F, np.nan).T[:2].reshape(2, *u1.shape)


def salukvadze_functions(
    mu: float,
    model: str,
    n_points: int,
    c: Sequence[float] = INITIAL_SPEEDS,
    *,
    refined: bool = False,
) -> pd.DataFrame:
    """Evaluate the first ``n_points`` LPτ points at every c and take the one nearest to U.

    As c grows, one test point after the other is the nearest: the functions are staircases. Where
    the steps come from is seen beside ``refined`` optima, each polished from its test point against
    the U of all of them.

    Returns:
        One row per initial speed: columns ``c``, ``test_point`` (the optimal one, or that which was
        refined), ``f1`` … ``f4``, of which f3 and f4 are the design, and ``exit_speed``.

    Example:
        >>> salukvadze_functions(0.4, "rolling", 4096, [0.3193])["test_point"].item()  # Table 6.1
        3085
    """
    points, rows = lp_tau(n_points, 2), []
    for speed in c:
        problem = VectorizedSphereChute(mu, c=speed, model=model)
        X = problem.xl + (problem.xu - problem.xl) * points
        # The same points for every c, so that a jump of the curves is one of the optimum.
        f = criteria(motion(X[:, 0], X[:, 1], problem.parameters, model=model))
        best, ideal, nadir = _nearest_to_ideal(f)
        x = X[best]
        if refined:
            ranking = rank_of_efficiency(f[[best]], normalize=False, ideal=ideal, nadir=nadir)
            # To a thousandth of what a picture resolves.
            x = refine(problem, x, ranking, tolerance=1e-6).x
        moved = motion(x[:1], x[1:], problem.parameters, model=model)
        rows.append((speed, 1 + best, *criteria(moved)[0], moved.exit_speed[0]))
    return pd.DataFrame(rows, columns=["c", "test_point", *_CRITERIA, "exit_speed"])


def _nearest_to_ideal(f: Array) -> tuple[int, Array, Array]:
    """Return the row of ``f``, ``(n, 4)``, that reaches the exit and is nearest to U; U; a nadir.

    The Pareto set is not needed for that. The componentwise minimum over it is that over all
    feasible points, since some point that has the least f_j is Pareto optimal; and with f ≥ U
    a point that dominates another is nearer to U, so that the nearest of all is Pareto optimal.
    Of the nadir, plain distances to U do not depend.
    """
    exits = np.flatnonzero(np.isfinite(f).all(axis=1))  # test point 1, the level chute, always
    ideal, nadir = f[exits].min(axis=0), f[exits].max(axis=0)
    distance = np.linalg.norm(f[exits] - ideal, axis=1)
    return int(exits[distance.argmin()]), ideal, nadir
