"""Algorithms side by side on one problem, at equal numbers of evaluations."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pymoo_psi._validation import known_name
from pymoo_psi.comparison._reference import Reference
from pymoo_psi.comparison._runs import Run
from pymoo_psi.comparison._statistics import INDICATORS, pairwise_tests

if TYPE_CHECKING:
    import pandas as pd


_KEYS = ["algorithm", "evaluations", "seed"]


@dataclass(frozen=True, eq=False)
class Comparison:
    """The runs of several algorithms on one problem, measured by the same reference.

    Attributes:
        problem: Name of the problem.
        objectives: Number of objectives.
        runs: Every run, by algorithm, budget and seed.
        assess: What is measured of a run: ``"evaluated"``, the non-dominated feasible designs
            among all that it evaluated, or ``"returned"``, those that the algorithm returned.
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
    objectives: int
    runs: tuple[Run, ...]
    assess: str
    reference: Reference
    measures: pd.DataFrame

    def __repr__(self) -> str:
        """Return problem, algorithms and the number of runs."""
        names = ", ".join(self.algorithms)
        return f"Comparison({self.problem}: {names}; {len(self.runs)} runs)"

    @property
    def algorithms(self) -> tuple[str, ...]:
        """Names of the algorithms.

        Example:
            >>> from pymoo.problems import get_problem
            >>> from pymoo_psi import compare
            >>> bnh = get_problem("bnh")
            >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
            >>> result.algorithms
            ('psi', 'nsga3')
        """
        return tuple(dict.fromkeys(run.task.algorithm for run in self.runs))

    @property
    def evaluations(self) -> tuple[int, ...]:
        """The budgets, rising.

        Example:
            >>> from pymoo.problems import get_problem
            >>> from pymoo_psi import compare
            >>> bnh = get_problem("bnh")
            >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
            >>> result.evaluations
            (32, 64)
        """
        return tuple(sorted({run.task.n_evaluations for run in self.runs}))

    def to_frame(self) -> pd.DataFrame:
        """Return one row per run.

        Returns:
            Columns ``algorithm``, ``evaluations``, ``seed`` (missing where nothing is left to
            chance), ``evaluated`` (designs, counted by the problem), ``hypervolume`` (share of the
            box from U to the reference point), ``igd_plus``, ``epsilon``, ``optimum_distance``,
            ``n_nondominated``, ``seconds``, ``evaluation_seconds``.

        Example:
            >>> from pymoo.problems import get_problem
            >>> from pymoo_psi import compare
            >>> bnh = get_problem("bnh")
            >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
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
            >>> from pymoo.problems import get_problem
            >>> from pymoo_psi import compare
            >>> bnh = get_problem("bnh")
            >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
            >>> print(result.summary()[["algorithm", "evaluations", "runs"]])
              algorithm  evaluations  runs
            0       psi           32     1
            1     nsga3           32     3
            2       psi           64     1
            3     nsga3           64     3
        """
        import pandas as pd

        rows = []
        for budget, name in itertools.product(self.evaluations, self.algorithms):
            chosen = (self.measures["evaluations"] == budget) & (self.measures["algorithm"] == name)
            group = self.measures[chosen]
            row: dict[str, Any] = {"algorithm": name, "evaluations": budget, "runs": len(group)}
            for column in group.columns.drop([*_KEYS, "evaluated"]):
                row[column] = group[column].median()
                # Values that occurred, as there is no mean of an infinite and a finite one.
                row[f"{column}_q1"] = group[column].quantile(0.25, interpolation="lower")
                row[f"{column}_q3"] = group[column].quantile(0.75, interpolation="higher")
            rows.append(row)
        return pd.DataFrame(rows)

    def tests(self, indicator: str = "hypervolume") -> pd.DataFrame:
        """Return for every pair of algorithms and every budget which is better, and how surely.

        See :mod:`pymoo_psi.comparison._statistics` for the tests.

        Args:
            indicator: ``"hypervolume"``, ``"igd_plus"``, ``"epsilon"`` or ``"optimum_distance"``.

        Returns:
            Columns ``evaluations``, ``better``, ``worse``, ``effect`` (the probability that a run
            of ``better`` is the better one, 0.5 to 1), ``p``, ``least_p`` (the smallest that so
            many runs could give), and ``p_holm``, corrected for all pairs and budgets.

        Raises:
            ArgumentValueError: The indicator is unknown.

        Example:
            >>> from pymoo.problems import get_problem
            >>> from pymoo_psi import compare
            >>> bnh = get_problem("bnh")
            >>> result = compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])
            >>> tests = result.tests("igd_plus")
            >>> bool((tests["p_holm"] >= tests["p"]).all() and (tests["effect"] >= 0.5).all())
            True
        """
        return pairwise_tests(self.measures, known_name("indicator", indicator, INDICATORS))
