"""The paper's results, computed again and compared with its printed values.

``pymoo-psi reproduce``, or :func:`reproduce`, computes Tables 6.1 and 6.2 under both models of
:mod:`pymoo_psi.chute`, compares them with the printed ones, and draws Figures 2 to 8. Under
``rolling`` it finds the same seven designs. f2, f3 and f4 agree to all four printed decimals; f1 is
4e-4 to 6e-4 above the printed values, because of an error of the paper's solver. For μ = 0.6
no design has the rank of efficiency 5. The test point that Table 6.2 prints as 1356 is number 2571,
as its f3 and f4 show.

For each friction coefficient the LPτ points within the bounds are tested, and the Pareto set is
ranked by efficiency with plain Euclidean distances. Table 6.1 contains the Salukvadze optimum,
Table 6.2 the designs of rank 5 whose f4 is below the optimum's. The printed values are those of
Technische Mechanik 32(6), 2012, 684–697; :mod:`pymoo_psi.chute` names title and authors.

The Salukvadze optima of 4096 test points by plain distances, with their numbers:

=== ========================= ==== ==============================
μ   optimum                   test f1, f2, f3, f4
=== ========================= ==== ==============================
0.2 printed                   –    1.9829, 0.0532, 0.3074, 0.1130
0.2 under ``rolling``         3599 1.9834, 0.0532, 0.3074, 0.1130
0.2 that one under ``full``   3599 2.1918, 0.0244, 0.3074, 0.1130
0.2 under ``full``            4006 1.9684, 0.0407, 0.4537, 0.1706
0.4 printed                   –    2.0454, 0.0476, 0.2635, 0.1072
0.4 under ``rolling``         3085 2.0458, 0.0476, 0.2635, 0.1072
0.4 that one under ``full``   3085 2.3214, 0.0159, 0.2635, 0.1072
0.4 under ``full``            2571 2.0541, 0.0195, 0.4392, 0.1043
0.6 printed                   –    2.0454, 0.0476, 0.2635, 0.1144
0.6 under ``rolling``         1029 2.0458, 0.0476, 0.2635, 0.1144
0.6 that one under ``full``   1029 2.3296, 0.0142, 0.2635, 0.1144
0.6 under ``full``            1709 2.0630, 0.0129, 0.4378, 0.1778
=== ========================= ==== ==============================

Example:
    The paper's optimum for μ = 0.4, by its own procedure: 4096 test points, plain distances.

    >>> from pymoo.optimize import minimize
    >>> from pymoo_psi import PSI, VectorizedSphereChute, rank_of_efficiency
    >>> res = minimize(VectorizedSphereChute(mu=0.4, model="rolling"), PSI(4096))
    >>> best = rank_of_efficiency(res.F, normalize=False).salukvadze
    >>> print(res.opt.get("test_point")[best], res.F[best].round(4))
    [3085] [[2.0458 0.0476 0.2635 0.1072]]

Public names: :func:`reproduce` and its :class:`Reproduction`; :func:`solve_case` and its
:class:`Case`; :func:`published_table`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from pymoo_psi._validation import (
    Array,
    Rows,
    job_count,
    known_names,
)
from pymoo_psi.algorithms import investigate
from pymoo_psi.chute import MODELS, ModelName, criteria, motion
from pymoo_psi.parallel import in_parallel
from pymoo_psi.pareto import EfficiencyRanking
from pymoo_psi.problems import VectorizedSphereChute
from pymoo_psi.sequences import lp_tau
from pymoo_psi.table import TestTable

__all__ = ["Case", "Reproduction", "published_table", "reproduce", "solve_case"]

PAPER_MU = (0.2, 0.4, 0.6)
PAPER_POINTS = 4096

_CRITERIA = ["f1", "f2", "f3", "f4"]  # columns of the CSV files that users have

_SPEEDS = tuple(np.linspace(0.05, 1.0, 96).tolist())  # around the paper's c = 0.3193


def published_table(number: Literal["6.1", "6.2"]) -> pd.DataFrame:
    """Return a printed table.

    Args:
        number: ``"6.1"`` (Salukvadze optima) or ``"6.2"`` (selected designs whose rank is 5).

    Returns:
        One row per printed row; columns ``mu``, ``test_point``, ``paper_f1`` … ``paper_f4``.

    Example:
        >>> print(published_table("6.1"))
            mu  test_point  paper_f1  paper_f2  paper_f3  paper_f4
        0  0.2        3599    1.9829    0.0532    0.3074    0.1130
        1  0.4        3085    2.0454    0.0476    0.2635    0.1072
        2  0.6        1029    2.0454    0.0476    0.2635    0.1144
    """
    text = Path(__file__).with_name("published.json").read_text("utf-8")
    return pd.DataFrame(json.loads(text)[f"table_{number.replace('.', '_')}"])


@dataclass(frozen=True, eq=False)
class Case:
    """One friction coefficient under one model.

    Attributes:
        model: ``"full"`` or ``"rolling"``.
        mu: Friction coefficient.
        table: All tests, by number.
        designs: The Pareto-optimal ones.
        ranking: Their ranks of efficiency, by plain distances.

    Example:
        >>> case = solve_case(0.4, "rolling", 4096)
        >>> case.designs.numbers[case.ranking.salukvadze]  # the paper's design for mu = 0.4
        array([3085])
    """

    model: ModelName
    mu: float
    table: TestTable
    designs: TestTable
    ranking: EfficiencyRanking

    def rows(self, indices: Rows) -> pd.DataFrame:
        """Return some of the designs as rows of the paper's tables, ordered by test point.

        Example:
            For the case in the example of :class:`Case`:

            >>> print(case.rows(case.ranking.salukvadze).round(4))
                 model   mu  test_point      f1      f2      f3      f4
            0  rolling  0.4        3085  2.0458  0.0476  0.2635  0.1072
        """
        designs = self.designs.take(np.sort(indices))
        columns = {"model": self.model, "mu": self.mu, "test_point": designs.numbers}
        columns |= zip(_CRITERIA, designs.F.T, strict=True)
        return pd.DataFrame(columns)


@dataclass(frozen=True, eq=False)
class Reproduction:
    """All cases of the paper, computed with ``n_points`` test points each.

    Example:
        >>> cases = [solve_case(0.4, model, 64) for model in ("rolling", "full")]
        >>> [case.model for case in Reproduction(64, tuple(cases)).cases]
        ['rolling', 'full']
    """

    n_points: int
    cases: tuple[Case, ...]

    def table_6_1(self) -> pd.DataFrame:
        """Return the Salukvadze optima, each with the printed one of the same μ.

        Returns:
            Columns ``model, mu, test_point, f1 … f4, paper_f1 … paper_f4``.

        Example:
            For the case in the example of :class:`Case`:

            >>> one = Reproduction(4096, (case,))
            >>> print(one.table_6_1()[["test_point", "f1", "paper_f1", "f2", "paper_f2"]].round(4))
               test_point      f1  paper_f1      f2  paper_f2
            0        3085  2.0458    2.0454  0.0476    0.0476
        """
        optima = pd.concat([case.rows(case.ranking.salukvadze) for case in self.cases])
        # The printed optimum is there for comparison, even if it is another test point.
        printed = published_table("6.1").drop(columns="test_point")
        return optima.merge(printed, on="mu", how="left")

    def table_6_2(self) -> pd.DataFrame:
        """Return the designs whose rank of efficiency is 5, with f4 below the optimum's.

        A printed row is joined to the same test point of the same μ; elsewhere the columns
        ``paper_f1`` … ``paper_f4`` are empty.

        Example:
            For the case in the example of :class:`Case`:

            >>> one = Reproduction(4096, (case,))
            >>> print(one.table_6_2()[["test_point", "f2", "paper_f2", "f4", "paper_f4"]].round(4))
               test_point      f2  paper_f2      f4  paper_f4
            0        2571  0.0683    0.0683  0.1043    0.1043
        """
        tables = []
        for case in self.cases:
            f4 = case.designs.F[:, 3]
            # Of several optima, equally near to U, the one with the least f4 is the limit.
            limit = f4[case.ranking.salukvadze].min()
            fifth = case.ranking.subset(5)
            tables.append(case.rows(fifth[f4[fifth] < limit]))
        printed = published_table("6.2")
        return pd.concat(tables).merge(printed, on=["mu", "test_point"], how="left")


def solve_case(mu: float, model: ModelName, n_points: int) -> Case:
    """Investigate the chute for one μ under one model and rank its Pareto set.

    Args:
        mu: Friction coefficient.
        model: ``"full"`` or ``"rolling"``.
        n_points: Test points.

    Raises:
        ArgumentValueError: A number is out of range, or there is no such model.

    Example:
        >>> case = solve_case(0.2, "full", 64)
        >>> len(case.designs), case.designs.numbers[case.ranking.salukvadze]
        (64, array([18]))
    """
    table = investigate(VectorizedSphereChute(mu, model=model), n_points)
    # The paper measures distances in the criteria's own units, which are dimensionless.
    ranking = table.under(normalize=False).ranking()
    return Case(model, mu, table, table.take(table.pareto()), ranking)


def reproduce(
    n_points: int = PAPER_POINTS,
    *,
    mu: Sequence[float] = PAPER_MU,
    models: Sequence[ModelName] = ("rolling", "full"),
    n_jobs: int = 1,
    callback: Callable[[Case], object] = lambda case: None,
) -> Reproduction:
    """Solve the cases of the paper under both models, or those of other friction coefficients.

    Args:
        n_points: Test points per case; the paper has 4096.
        mu: Friction coefficients.
        models: ``"rolling"``, from which the printed tables follow, ``"full"``, or both.
        n_jobs: Number of processes, -1 for one per core.
        callback: Called with each case as soon as it is ready, to show progress.

    Raises:
        ArgumentValueError: A number is out of range, or a model is unknown.
        ArgumentTypeError: A count is not an integer.

    Example:
        >>> few = reproduce(64, mu=[0.2, 0.4], models=["rolling"])
        >>> few.table_6_1()[["model", "mu", "test_point"]]
             model   mu  test_point
        0  rolling  0.2          18
        1  rolling  0.4          35
    """
    n_jobs = job_count("n_jobs", n_jobs)
    known_names("models", models, MODELS)
    pairs = [*product(dict.fromkeys(models), dict.fromkeys(mu))]

    def solved(pair: tuple[ModelName, float]) -> Case:
        model, value = pair
        return solve_case(value, model, n_points)

    cases = {}
    for number, case in in_parallel(solved, pairs, n_jobs):
        callback(case)
        cases[number] = case
    every_case = tuple(cases[number] for number in range(len(pairs)))
    return Reproduction(n_points, every_case)


# The numbers behind figures 2 and 8


def criterion_surfaces(mu: float, model: ModelName, *, n: int = 101) -> tuple[Array, Array, Array]:
    """Compute f1 and f2 on a grid of n × n designs within the bounds [0, 3.5 μ] × [0.1, 6].

    The grid is dense near the level chute, where the time grows by half within a fortieth of the
    range of u1. f3 = u1 and f4 = u2 need no figure.

    Returns:
        ``(n, n)`` slopes u1, increasing along the first axis; ``(n, n)`` speeds u2 of the plane,
        increasing along the second; ``(2, n, n)`` the criteria, NaN where the sphere stalls.

    Example:
        >>> u1, u2, f = criterion_surfaces(0.4, "rolling", n=5)
        >>> f.shape
        (2, 5, 5)
    """
    problem = VectorizedSphereChute(mu, model=model)
    s = np.linspace(0.0, 1.0, n)
    shares = np.column_stack([s**2, s])
    sides = problem.xl + (problem.xu - problem.xl) * shares
    u1, u2 = np.meshgrid(*sides.T, indexing="ij")
    f = criteria(motion(u1, u2, problem.parameters, model=model))
    f[np.isinf(f)] = np.nan  # the sphere stalls: a hole in the surface
    return u1, u2, np.moveaxis(f, -1, 0)[:2]


def salukvadze_functions(
    mu: float, model: ModelName, n_points: int, c: Sequence[float] = _SPEEDS
) -> pd.DataFrame:
    """Return the Salukvadze optimum of the first ``n_points`` LPτ points at every initial speed c.

    As c grows, one test point after another is the optimum: the functions are staircases.

    Returns:
        One row per initial speed: columns ``c``, ``test_point``, ``f1`` … ``f4``, of which f3 and
        f4 are the design, and ``exit_speed``.

    Example:
        >>> salukvadze_functions(0.4, "rolling", 4096, [0.3193])["test_point"].item()  # Table 6.1
        3085
    """
    points = lp_tau(n_points, 2)
    rows = []
    for speed in c:
        problem = VectorizedSphereChute(mu, c=speed, model=model)
        # The same points for every c, so that a jump of the curves is one of the optimum.
        X = problem.xl + (problem.xu - problem.xl) * points
        moved = motion(X[:, 0], X[:, 1], problem.parameters, model=model)
        f = criteria(moved)
        # U needs no Pareto set: some point that has the least f_j is Pareto optimal; and with f ≥ U
        # a point that dominates another is nearer to U. f is infinite where the sphere stalls; in
        # test point 1, the level chute, it does not.
        best = int(np.linalg.norm(f - f.min(axis=0), axis=1).argmin())
        rows.append((speed, 1 + best, *f[best], moved.exit_speed[best]))
    return pd.DataFrame(rows, columns=["c", "test_point", *_CRITERIA, "exit_speed"])
