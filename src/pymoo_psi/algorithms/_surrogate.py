"""Learning from tests: after the points of a sequence, designs that surrogates propose.

The tests known before it, the seed and the number of a round determine its proposals, and a study
has them before they are tested. So a run that is killed goes on as if nothing had happened.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from pymoo_psi._validation import boolean, integer
from pymoo_psi.algorithms._engine import by_number
from pymoo_psi.algorithms._proposals import Goal, KnownTests, encoded, propose
from pymoo_psi.algorithms._psi import PSI
from pymoo_psi.algorithms._run import Points
from pymoo_psi.algorithms._surrogate_models import Fit, below_zero, bounded, without_penalties
from pymoo_psi.problems import known_expressions
from pymoo_psi.study import LAST
from pymoo_psi.table import TestTable

Array = NDArray[np.float64]

# Lengths are fitted again when there are so many times as many tests, which takes as long as all
# else for some rounds. Each fit is a function of the first tests alone, so that a run that goes on
# does not depend on where it was interrupted.
_GROWTH = 1.1
# A round of so many designs shares the time of the surrogates. Small rounds learn more from each
# test: they pay most while little is known.
_BATCH, _FEW, _LITTLE = 8, 4, 64
_POINTS = 20  # a sample that shows a heavy tail; more tell less than as many proposals
_LEAST = 4  # tests that are known, below which no surrogate is made


class SurrogatePSI(PSI):
    """Few evaluations spent well: test points first, then designs that surrogates propose.

    It begins as :class:`PSI`. Then surrogates of all objectives and constraints are made from all
    tests, a search on them proposes a batch of designs, these are tested, and so on. Surrogates are
    Gaussian processes, searched everywhere and, in every third round, near the best tests. The
    outputs of a :class:`~pymoo_psi.ProgramProblem` that are expressions are computed from the
    variables and from surrogates of its other outputs.

    Result and table are those of :class:`PSI`: every test is numbered and kept, and limits can be
    set afterwards. The tests of the sequence come first; the output ``proposal_round`` of the table
    is 0 for them and the number of the round for proposals.

    The run is determined by its arguments and the seed, which is 0 unless given, if it is not
    asynchronous: with a study, one that was interrupted or killed makes the same tests when it is
    called again, and a larger ``n_evaluations`` adds to them. Proposals are stored before they are
    tested, in any case, and no stored test is made again.

    Where a model gives infinity, or one large number, for an objective of designs without meaning,
    surrogates take the worst value of the others for it, if several tests of the sequence show it.
    A constraint may be the amount of a violation, 0 where it is met; others are learned better.

    To learn from the tests of an earlier :class:`PSI`, run both on one
    :class:`~pymoo_psi.Recorded` problem: the first ``n_points`` are then answered by its study.

    It pays where a test takes seconds or more, and where many variables leave most of the space
    empty; from some hundred tests on, proposals take longer than cheap models. It tests designs
    between and beyond the known ones, so the tests are no uniform sample any more: histograms and
    correlations of the table describe where it has searched.

    Args:
        n_evaluations: How many designs to test, the points of the sequence among them.
        n_points: How many points of the sequence come first, 20 by default.
        batch: How many designs are proposed at a time, a round; by default 4 while fewer than 64
            tests are known, then 8. A smaller one learns more from each test.
        asynchronous: Whether a :class:`~pymoo_psi.JoblibRunner`'s workers do not wait for the end
            of a round: while one has nothing to do, the next round is proposed, as far as possible
            from designs that are being tested. Then proposals depend on what was done first, and
            the study has with each which tests before it were ``pending``. By default where there
            are more workers than ``batch``, or 8.
        **options: As for :class:`PSI`, without ``share`` and ``block_size``. Proposals keep the
            ``limits``, as far as surrogates know; a ``retry`` does not change what was proposed
            before; designs near failed ones are avoided in three rounds of four.

    Raises:
        ArgumentValueError: As for :class:`PSI`.
        ArgumentTypeError: As for :class:`PSI`.
        StudyError: As for :class:`PSI`.

    Example:
        >>> from pymoo.optimize import minimize
        >>> from pymoo_psi import SphereChute
        >>> res = minimize(SphereChute(0.4, model="rolling"), SurrogatePSI(28))
        >>> res.algorithm.table.column("proposal_round")[20:].tolist()
        [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0]
    """

    # A share of the points or blocks of them have no meaning here.
    _without = ("share", "block_size", "seed")

    def __init__(
        self,
        n_evaluations: int,
        *,
        n_points: int | None = None,
        batch: int | None = None,
        asynchronous: bool | None = None,
        **options: Any,
    ) -> None:
        super().__init__(integer("n_evaluations", n_evaluations, minimum=1), **options)
        self._batch = None if batch is None else integer("batch", batch, minimum=1)
        self._asynchronous = None if asynchronous is None else boolean("asynchronous", asynchronous)
        self._asked = _POINTS if n_points is None else integer("n_points", n_points, minimum=1)
        self._ends: list[int] = []  # how many tests there are at the start, after each round
        self._fitted: tuple[int, Fit | None] = (0, None)  # to how many of the first tests

    def _setup(self, problem: Any, **kwargs: Any) -> None:
        self.seed = self.seed or 0
        batches = self._batch or f"{_FEW}, from {_LITTLE} tests on {_BATCH}"
        # of the points all, also where a run ends among them, as it may go on
        what = f", {self._asked} points, then proposals in batches of {batches}"
        size = min(self._asked, self.n_points)
        self._engine = self._engine_of(size, method=f"{what}, seed {self.seed}")
        workers, overlap = self._engine.n_workers, self._asynchronous
        if overlap is None:
            overlap = workers > (self._batch or _BATCH)
        self._engine.extend = self._extend if overlap and workers else None
        points = self._engine.points
        self._engine.points = replace(points, given=points.units, rounds=np.zeros(len(points)))
        self._tests = self._engine.table
        self._ends = [len(points)]
        self._n_tests = self.n_points - size + len(points)  # more by `fill`, not evaluated

    def _rows(self) -> NDArray[np.intp]:
        """Return the rows of the points that are tested next; those of a round are proposed."""
        if self.n_tested == len(self._engine.points):
            self._extend()
        return np.arange(self.n_tested, len(self._engine.points))

    def _extend(self) -> None:
        """Add the designs of a round to the points, as many as are left."""
        points = self._engine.points
        if left := self._n_tests - len(points):
            size = self._engine.n_idle or (_FEW if len(points) < _LITTLE else _BATCH)
            first = int(points.numbers[-1]) + 1
            made = self._round(first, self._batch or size)
            self._ends.append(len(points) + len(made))
            units, turn = made[:left], len(self._ends) - 1
            self._engine.points = points.followed(first + np.arange(len(units)), units, turn)

    def _round(self, first: int, size: int) -> Array:
        """Return the points that a round proposes, those of the study if it has them."""
        # Of asynchronous rounds some designs before have no test yet.
        study, points = self._engine.store.study, self._engine.points
        table = by_number([self._tests, self._engine.arrived()])
        pending = points.at(np.flatnonzero(~np.isin(points.numbers, table.numbers)))
        turn = len(self._ends)
        stored = [] if study is None else study.proposals(first, LAST - first)
        if not stored:
            # Several threads would spin at matrices as small as these, ten times as long where
            # other work is going on, and their sums differ in the last digits from those of one.
            with threadpool_limits(limits=1, user_api="blas"):
                made = self._proposed(size, table, pending)
            if study is None:
                return made
            # All tests before them were known but these.
            more = {"pending": pending.numbers.tolist()} if len(pending) else {}
            contents = [{"point": point} | more for point in made.tolist()]
            rows = [(n, turn, "surrogates", content) for n, content in enumerate(contents, first)]
            # Another process may have proposed the same meanwhile: one file, one truth.
            stored = study.propose(rows)
        return np.array([content["point"] for _, n, _, content in stored if n == turn])

    def _proposed(self, size: int, table: TestTable, pending: Points) -> Array:
        goal, further = self._goal(table)
        last = self._engine.points.numbers[self._ends[0] - 1]
        n_uniform = int(np.searchsorted(table.numbers, last, "right"))
        tests = self._known_tests(table, n_uniform, further, pending)
        # up to how many tests lengths are fitted: of rising numbers the last one that is reached
        fitted = n_uniform
        for end in self._ends:
            if fitted * _GROWTH <= end <= len(table):
                fitted = end
        known = ~tests.unknown
        if known[:fitted].sum() < _LEAST:
            fitted = len(table)
        if self._fitted[0] != fitted:
            rows, fit = np.flatnonzero(known[:fitted]), None
            if len(rows) >= _LEAST:
                uniform = max(int(known[:n_uniform].sum()), _LEAST)
                Z = goal.encode(tests.points[rows])
                fit = Fit.of(Z, bounded(tests.Y[rows]), uniform, goal.n_obj)
            self._fitted = fitted, fit
        turn = len(self._ends) - 1
        random = np.random.default_rng([self.seed or 0, turn])
        return propose(tests, self._fitted[1], goal, size, turn, random)

    def _goal(self, table: TestTable) -> tuple[Goal, list[str]]:
        """Return what is searched for, and the further outputs that have limits."""
        layout, space, problem = table.layout, self._engine.space, self._engine.model
        names = [v.name for v in space.searched]
        low, high = np.zeros(len(names)), np.ones(len(names))
        n_obj, n_ieq = problem.n_obj, problem.n_ieq_constr
        known = n_obj + n_ieq + problem.n_eq_constr
        bounds = [(j, -np.inf if j < n_obj + n_ieq else 0.0, 0.0) for j in range(n_obj, known)]
        further: list[str] = []
        for name, (least, greatest) in table.under(limits=self.limits).limits.items():
            if name in layout.objectives:
                pair = (-greatest, -least) if name in layout.maximize else (least, greatest)
                bounds.append((layout.objectives.index(name), *pair))
            elif name in layout.outputs:
                bounds.append((known + len(further), least, greatest))
                further.append(name)
            elif name in names:
                j = names.index(name)
                low[j], high[j] = space.searched[j].between(least, greatest)
        goal = Goal(n_obj, bounds, low, high, self._required, partial(encoded, space))
        expressions = known_expressions(problem)
        # Expressions are not learned, but the outputs of the program that they are made of.
        used = {name for output in expressions.values() for name in output.operands}
        if not used:
            return goal, further
        made = [n for n in used if n in layout.outputs and n not in expressions]
        places = {n: known + len(further) + j for j, n in enumerate(sorted(made))}
        places |= {n: j for j, n in enumerate(problem.objectives)}

        def compute(points: Array, Y: Array) -> Array:
            columns = dict(zip(problem.variables, space.matrix(points).T, strict=True))
            turned = {n: -1 if n in problem.maximize else 1 for n in places}
            columns |= {n: Y[:, j] * turned[n] for n, j in places.items()}
            for j, values in problem.computed(columns).items():
                Y[:, j] = values
            return bounded(Y)

        return replace(goal, compute=compute), further + sorted(made)

    def _required(self, points: Array) -> Array:
        """Return ``(n, k)`` by how much points violate requirements."""
        return self._engine.amounts(self._engine.space.matrix(points))

    def _known_tests(
        self, table: TestTable, n_uniform: int, further: Sequence[str], pending: Points
    ) -> KnownTests:
        failed, n_ieq = table.status == "failed", self._engine.model.n_ieq_constr
        required = table.G[:, n_ieq:]  # behind the model's own
        unknown = failed | (required > 0).any(axis=1)
        uniform = table.F[:n_uniform][~unknown[:n_uniform]]
        F = without_penalties(table.F, uniform)
        G = below_zero(np.where(unknown[:, None], np.nan, table.G[:, :n_ieq]), n_uniform)
        return KnownTests(
            self._engine.space.points(table.X),
            np.column_stack([F, G, table.H, *map(table.column, further)]),
            table.under(limits=self.limits).eligible(),
            failed,
            unknown,
            pending.units,
        )
