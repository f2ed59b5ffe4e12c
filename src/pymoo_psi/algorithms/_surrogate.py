"""Learning from tests: after the points of a sequence, designs that surrogates propose.

The tests of complete rounds, the seed and the number of a round determine its proposals, and a
study has them before they are tested. So a run that is killed goes on as if nothing had happened.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from pymoo_psi._validation import Received, instance, integer, invalid
from pymoo_psi.algorithms._proposals import Goal, KnownTests, Proposals, encoded, propose
from pymoo_psi.algorithms._psi import PSI
from pymoo_psi.algorithms._run import Points
from pymoo_psi.algorithms._surrogate_models import KINDS, Fit, bounded, without_penalties
from pymoo_psi.problems import design_space
from pymoo_psi.study import Proposal
from pymoo_psi.table import Limits, TestTable, bounds_of, difference, lacking

Array = NDArray[np.float64]
Method = TypeVar("Method", bound=Callable[..., Any])

# Lengths are fitted again when there are so many times as many tests, which takes as long as all
# else for some rounds. Each fit is a function of the first tests alone, so that a run that goes on
# does not depend on where it was interrupted.
_GROWTH = 1.1
_BATCH = 8  # so many share the time of the surrogates; one by one, models would wait for them
_LEAST = 4  # tests that are known, below which no surrogate is made

# Several threads would spin at matrices as small as these, ten times as long where other work is
# going on, and their sums differ in the last digits from those of one.
_one_thread: Callable[[Method], Method] = threadpool_limits.wrap(limits=1, user_api="blas")


class SurrogatePSI(PSI):
    """Few evaluations spent well: test points first, then designs that surrogates propose.

    It begins as :class:`PSI`. Then surrogates of all objectives and constraints are made from all
    tests, a search on them proposes a batch of designs, these are tested, and so on. Surrogates are
    alternating Gaussian processes and radial functions, searched everywhere and near the best tests
    in turn. Result and table are those of :class:`PSI`: every test is numbered and kept, and limits
    can be set afterwards. The tests of the sequence come first; the output ``proposal_round`` of
    the table is 0 for them and the number of the round for proposals. :meth:`predictions` has what
    was expected of each proposal and what was found: how far surrogates can be trusted.

    The run is determined by its arguments and the seed, which is 0 unless given: with a study, one
    that was interrupted or killed makes the same tests when it is called again, and a larger
    ``n_evaluations`` adds to them. Proposals are stored before they are tested.

    Where a model gives infinity, or one large number, for an objective of designs without meaning,
    surrogates take the worst value of the others for it, if several tests of the sequence show it.

    It pays where a test takes seconds or more, and where many variables leave most of the space
    empty; from some hundred tests on, proposals take longer than cheap models. It tests designs
    between and beyond the known ones, so the tests are no uniform sample any more: histograms and
    correlations of the table describe where it has searched.

    Args:
        n_evaluations: How many designs to test, the points of the sequence among them.
        n_points: How many points of the sequence come first: by default twice as many as there are
            variables and 2 more, at least 20 and at most 64.
        batch: How many designs are proposed at a time, and can be tested in parallel; 8 by
            default. A smaller one learns more from each test.
        start: Tests of the same problem to go on from, such as the table of an earlier
            :class:`PSI`; then no points of the sequence are tested, and ``n_evaluations`` counts
            the proposals only, which are numbered on.
        **options: As for :class:`PSI`, without ``share`` and ``block_size``. Proposals keep the
            ``limits``, as far as surrogates know; a ``retry`` does not change what was proposed
            before; designs near failed ones are avoided in three rounds of four.

    Raises:
        ArgumentValueError: As for :class:`PSI`; ``start`` has no tests or belongs to another
            problem.
        ArgumentTypeError: As for :class:`PSI`.
        StudyError: As for :class:`PSI`.
        EvaluationError: As for :class:`PSI`.

    Example:
        >>> from pymoo.optimize import minimize
        >>> from pymoo_psi import SphereChute
        >>> res = minimize(SphereChute(0.4, model="rolling"), SurrogatePSI(28))
        >>> len(res.algorithm.table), res.algorithm.predictions()["round"].tolist()
        (28, [1, 1, 1, 1, 1, 1, 1, 1])
    """

    # A share of the points or blocks of them have no meaning here.
    _without = ("share", "block_size", "seed")

    def __init__(
        self,
        n_evaluations: int,
        *,
        n_points: int | None = None,
        batch: int | None = None,
        start: TestTable | None = None,
        **options: Any,
    ) -> None:
        super().__init__(integer("n_evaluations", n_evaluations, minimum=1), **options)
        self.block_size = _BATCH if batch is None else integer("batch", batch, minimum=1)
        if start is not None and len(instance("start", start, TestTable)) == 0:
            raise invalid("start", "a table with tests", Received("none"))
        if start is not None and n_points is not None:
            raise invalid("n_points", "left out where there is a start", n_points)
        self._given = start
        self._asked = None if n_points is None else integer("n_points", n_points, minimum=1)
        self._rounds: list[Proposals] = []
        self._fitted: tuple[int, Fit | None] = (0, None)  # to how many of the first tests

    def _setup(self, problem: Any, **kwargs: Any) -> None:
        self.seed = self.seed or 0
        given = self._given
        if given is not None:
            given = given.rows(np.argsort(given.numbers))
            self.options = replace(self.options, first=int(given.numbers[-1]) + 1)
            size, what = 1, f", not tested, but {len(given)} tests given"
        else:
            n_var = len(design_space(problem).searched)
            # Twice as many as variables tell lengths apart; 20 are a sample that shows a heavy
            # tail; beyond 64 proposals say more than points.
            size = self._asked or min(max(2 * n_var + 2, 20), 64)
            what = f", {size} points"  # also of a run that ends among them, and may go on
            size = min(size, self.n_points)
        method = f"{what}, then proposals in batches of {self.block_size}, seed {self.seed}"
        self._engine = self._engine_of(size, further=self.n_points - size, method=method)
        self.table = self._engine.table
        first = self._engine.points
        numbers, units = first.numbers, first.units
        if given is not None:
            if other := difference(given, self.table, apart_from=("sampling", "key")):
                rule = "tests of the same problem, with this run's names, directions, units, bounds"
                raise invalid("start", rule, Received(other))
            given = replace(given, problem=self.table.problem)
            self.table = self.table.extended(given)
            self._engine.store.keep(given)
            self._blocks = [len(given)]
            numbers, units = given.numbers, self._engine.space.points(given.X)
        self._n_uniform = len(numbers)  # tests before the first round
        self._n_tests = self.n_points + (0 if given is None else len(given))
        self._engine.points = Points(numbers, first.n_dim, units, np.zeros(len(numbers)))

    def _rows(self) -> NDArray[np.intp]:
        """Return the rows of the points that are tested next; those of a round are proposed."""
        points, done = self._engine.points, self.n_tested
        if done == len(points) and (left := self._n_tests - done):
            ready = (done - self._n_uniform) // self.block_size
            numbers = points.numbers[-1] + np.arange(1, 1 + min(self.block_size, left))
            self._rounds.append(self._round(ready, int(numbers[0])))
            units = self._rounds[-1].points[: len(numbers)]
            self._engine.points = points.followed(numbers, units, ready + 1)
        return np.arange(done, len(self._engine.points))

    def _round(self, ready: int, first: int) -> Proposals:
        """Return the proposals of a round, those of the study if it has them."""
        study = self._engine.store.study
        if study is None:
            return self._proposed(ready)
        stored = study.proposals(first, self.block_size)
        if not stored:  # another process may propose the same meanwhile: one file, one truth
            stored = study.propose(_rows(self._proposed(ready), ready + 1, first))
        named = ("point", "predicted", "deviation")
        values = ([content[name] for *_, content in stored] for name in named)
        points, *outputs = (np.array(value, dtype=np.float64) for value in values)
        return Proposals(points, stored[0][2] if stored[0][2] in KINDS else "", *outputs)

    @_one_thread
    def _proposed(self, ready: int) -> Proposals:
        goal, further = self._goal()
        tests, encode = self._tests(further), partial(encoded, self._engine.space)
        # up to how many tests lengths are fitted: of rising numbers the last one that is reached
        fitted = self._n_uniform
        while (later := self._round_end(math.ceil(fitted * _GROWTH))) <= self.n_tested:
            fitted = later
        known = ~tests.failed
        if known[:fitted].sum() < _LEAST:
            fitted = self.n_tested
        if self._fitted[0] != fitted:
            rows, fit = np.flatnonzero(known[:fitted]), None
            if len(rows) >= _LEAST:
                uniform = max(int(known[: self._n_uniform].sum()), _LEAST)
                Z = encode(tests.points[rows])
                fit = Fit.of(Z, bounded(tests.Y[rows]), uniform, goal.n_obj)
            self._fitted = fitted, fit
        random = np.random.default_rng([self.seed or 0, ready])
        made = propose(tests, self._fitted[1], goal, encode, self.block_size, ready, random)
        # of outputs with limits, which may be others tomorrow, no predictions are kept
        kept = slice(len(_outputs(self.table)))
        return replace(made, predicted=made.predicted[:, kept], deviation=made.deviation[:, kept])

    def _goal(self) -> tuple[Goal, list[str]]:
        """Return what is searched for, and the further outputs that have limits."""
        layout, space = self.table.layout, self._engine.space
        names, known = [v.name for v in space.searched], len(_outputs(self.table))
        low, high = np.zeros(len(names)), np.ones(len(names))
        bounds: list[tuple[int, float, float]] = []
        further: list[str] = []
        for name, (least, greatest) in bounds_of(self._known_limits(), layout).items():
            if name in layout.objectives:
                pair = (-greatest, -least) if name in layout.maximize else (least, greatest)
                bounds.append((layout.objectives.index(name), *pair))
            elif name in layout.outputs:
                bounds.append((known + len(further), least, greatest))
                further.append(name)
            elif name in names:
                j = names.index(name)
                low[j], high[j] = space.searched[j].between(least, greatest)
        sizes = len(layout.objectives), len(layout.inequalities), len(layout.equalities)
        return Goal(*sizes, bounds, low, high), further

    def _round_end(self, n_tests: int) -> int:
        """Return how many tests there are when the round is complete that has the n-th."""
        rounds = math.ceil((n_tests - self._n_uniform) / self.block_size)
        return self._n_uniform + rounds * self.block_size

    def _tests(self, further: Sequence[str]) -> KnownTests:
        table, space = self.table, self._engine.space
        failed = table.status == "failed"
        uniform = table.F[: self._n_uniform][~failed[: self._n_uniform]]
        F = without_penalties(table.F, uniform)
        return KnownTests(
            space.points(table.X),
            np.column_stack([F, table.G, table.H, *map(table.column, further)]),
            table.eligible(self._known_limits()),
            failed,
        )

    def _known_limits(self) -> Limits | None:
        """Return the limits; none as long as all tests failed, and one is on an output.

        What the model gives is not known then, and a run is not to end for it.
        """
        unknown = (self.table.status == "failed").all() and lacking(self.limits, self.table.layout)
        return None if unknown else self.limits

    def predictions(self) -> pd.DataFrame:
        """Return what was expected of each proposal that is tested, and what was found.

        Columns: ``test_point``, ``round`` from 1, ``surrogate``, ``status``; then of each objective
        and constraint, in the original direction, what was found under its name, and with
        ``_predicted`` and ``_deviation`` behind it what was expected, and how surely: NaN where it
        is not known, as for radial functions. The surrogate is empty where too few tests were known
        to make one.

        Example:
            >>> from pymoo.optimize import minimize
            >>> from pymoo_psi import SphereChute
            >>> algorithm = minimize(SphereChute(model="rolling"), SurrogatePSI(36)).algorithm
            >>> frame = algorithm.predictions()
            >>> bool((frame["f1"] - frame["f1_predicted"]).abs().median() < frame["f1"].std())
            True
        """
        table = self.table.rows(np.arange(self._n_uniform, self.n_tested))
        n, rounds = len(table), self._rounds
        sizes = [len(made.points) for made in rounds]
        columns: dict[str, Any] = {"test_point": table.numbers}
        columns["round"] = np.repeat(np.arange(len(rounds)) + 1, sizes)[:n]
        columns["surrogate"] = np.repeat([made.kind for made in rounds], sizes)[:n]
        columns["status"] = table.status
        found = np.hstack([table.F, table.G, table.H])
        found[table.status == "failed"] = np.nan
        none = np.zeros((0, found.shape[1]))
        predicted = np.vstack([none, *(made.predicted for made in rounds)])[:n]
        deviation = np.vstack([none, *(made.deviation for made in rounds)])[:n]
        for j, (name, sign) in enumerate(zip(_outputs(table), _signs(table), strict=True)):
            columns[name] = found[:, j] * sign
            columns[f"{name}_predicted"] = predicted[:, j] * sign
            columns[f"{name}_deviation"] = deviation[:, j]
        return pd.DataFrame(columns)


def _outputs(table: TestTable) -> tuple[str, ...]:
    return table.layout.objectives + table.layout.constraints


def _signs(table: TestTable) -> Array:
    """``(q,)`` -1 for objectives that are maximised, 1 for all others."""
    return np.append(table.layout.sign, np.ones(len(table.layout.constraints)))


def _rows(made: Proposals, number: int, first: int) -> list[Proposal]:
    """Return the proposals of a round as a study has them: NaN, which JSON lacks, as None."""
    named = {"point": made.points, "predicted": made.predicted, "deviation": made.deviation}
    nothing, kind = np.array(None), made.kind or "far from all tests"
    lists = {n: np.where(np.isnan(v), nothing, v).tolist() for n, v in named.items()}
    return [
        (first + i, number, kind, {name: rows[i] for name, rows in lists.items()})
        for i in range(len(made.points))
    ]
