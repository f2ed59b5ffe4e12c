"""Parameter Space Investigation as a pymoo algorithm.

PSI tests the points of a uniformly distributed sequence and keeps every one of them with its
number. It learns nothing on the way, so a run is the same however it is cut into blocks, and the
test table is all its state: pymoo's individuals are made from it when they are asked for.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import nullcontext
from functools import partial
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.termination import TerminateIfAny, Termination
from pymoo.util.display.column import Column
from pymoo.util.display.output import Output
from pymoo.util.misc import termination_from_tuple

from pymoo_psi._validation import Received, integer, invalid, known_name
from pymoo_psi.algorithms._investigate import Investigation
from pymoo_psi.algorithms._outputs import NO_OUTPUTS
from pymoo_psi.algorithms._plan import Plan
from pymoo_psi.algorithms._sampling import UniformSampling, uniform_sampling
from pymoo_psi.algorithms._store import Memory
from pymoo_psi.pareto import constraint_violation
from pymoo_psi.problems._evaluation import evaluate_designs, value_column
from pymoo_psi.problems._failures import FAILURE_ACTIONS, untolerant
from pymoo_psi.problems._pymoo import require_known_keywords, require_problem
from pymoo_psi.table import Limits, TestTable, bounds_of, excess, lacking


class PSI(Algorithm):
    """Test the points of the LPτ sequence and return the feasible Pareto-optimal ones.

    ``minimize(problem, PSI(4096))`` works on any pymoo problem with finite bounds, its variables
    real, integer, binary or choices; it ends by itself when the points are used up, or earlier if
    a termination says so. In the result, ``res.X`` and ``res.F`` are the Pareto-optimal feasible
    designs, ``res.opt.get("test_point")`` their numbers, ``res.pop`` every tested design, and
    ``res.algorithm.table`` the table of all tests.

    Asking and telling works as for every pymoo algorithm; ``ask()`` returns the same block until
    it is told, and ``None`` when no points are left. The table has the further outputs of told
    designs if the algorithm's own ``evaluator`` has evaluated them.

    Where a problem has a :class:`~pymoo_psi.JoblibRunner`, its workers do not wait for each other
    at the end of a block: while one is at the slowest design of it, the others are at the next
    points. If a termination was given, they are at most eight designs each ahead of the block
    that it has seen. What is evaluated ahead when it ends the run is in the study, if there is
    one, and not in the result. Meanwhile no other process can test points for the same study.

    The model is taken to be deterministic: a design that occurs again, which only variables that
    are not real can bring about, is not evaluated again but takes the known result, also that of
    a study (:attr:`TestTable.repeats`). Designs that a user evaluates and tells are as told.

    Every further number that the model puts into ``out``, such as ``out["temperature"]``, is a
    column of the table; ``res.pop.get("temperature")`` gives it, too.

    Args:
        n_points: How many points to test.
        first: Number of the first point, from 1, which lies at the lower bounds. ``PSI(1024)``
            and ``PSI(3072, first=1025)`` together test the points of ``PSI(4096)``.
        sampling: Where the points come from: ``LPTauSampling()`` by default, and for more than 51
            variables SciPy's points of Sobol', ``QMCSampling("sobol", scramble=False)``; or
            another :class:`~pymoo_psi.QMCSampling`, whose random points follow the ``seed`` of
            the run.
        limits: Limits on criteria, variables and outputs, ``{"mass": 30, "width": (0.2, 0.4)}``;
            see :class:`TestTable`. A design that exceeds one counts as infeasible in the result;
            the table keeps it as it is, so that other limits can be tried on the table afterwards.
            So does one without a value that has a limit; if no test has it, the limit is refused.
        share: ``(k, n)`` tests the k-th of n parts of the points only. All n parts together, on as
            many machines, are the run without it; each is spread over the whole box.
        study: Name of a study file, in which tests are stored as they arrive, about every second;
            also when an interrupt, SIGTERM or a failure ends the run. The same call continues a
            study that was interrupted, a larger ``n_points`` extends it, and no stored design is
            evaluated again. With a ``share`` it is the name of a folder,
            in which each share has a file; :meth:`TestTable.read_study` reads it as one study.
        study_key: What else the study depends on, such as a version or constants of the model; a
            study with another key is refused. The study itself compares name, variables, bounds
            and numbers of objectives and constraints, and what a method ``fingerprint()`` of the
            problem returns; it cannot see into the model.
        retry: Numbers of test points that the study holds as failed and that are to be evaluated
            once more; ``"failed"`` for all of them.
        on_failure: ``"record"`` keeps a design whose evaluation raises, gives NaN or the wrong
            shape, or is lost, as failed with its reason, and goes on; ``"raise"`` stops there,
            with everything before it stored.
        names: Names of your own for variables, criteria and constraints, by their default names:
            ``{"x1": "width", "f2": "efficiency", "g1": "stress"}``. The table, the study, files,
            plots and limits have them. Unless given, those of the problem's attribute ``names``,
            a mapping likewise, if there is one.
        maximize: The criteria of which more is better, by these names. pymoo minimises, so that
            ``out["F"]`` holds such a criterion with the sign turned; whatever is reached by name
            is in its own sense. Unless given, those of the problem's attribute ``maximize``; a list
            that leaves one of these out is refused, an empty one turns all of them off.
        units: Units of columns by these names, also of further outputs. Unless given, those of
            the problem's attribute ``units``.
        block_size: Points per iteration, after each of which display, callback and termination
            are called. By default the run has 32 iterations, of at least 64 points.
        **kwargs: pymoo's own: ``termination``, ``callback``, ``output``, ``save_history``, …

    Raises:
        ArgumentValueError: A count is out of range; at the start of a run: the problem has no
            finite bounds.
        ArgumentTypeError: A count is not an integer, a keyword is unknown; at the start of a run:
            the problem is no pymoo problem or has variables of another type.
        StudyError: The study belongs to another problem, is damaged, is being written by another
            process or cannot be written.
        EvaluationError: A design failed and ``on_failure`` is ``"raise"``.

    Example:
        >>> from pymoo.optimize import minimize
        >>> from pymoo_psi import SphereChute
        >>> res = minimize(SphereChute(0.4, model="rolling"), PSI(8))
        >>> res.opt.get("test_point")
        array([1, 2, 3, 5, 6, 7])
    """

    is_initialized: bool  # pymoo's

    def __init__(
        self,
        n_points: int,
        *,
        first: int = 1,
        block_size: int | None = None,
        sampling: UniformSampling | None = None,
        limits: Limits | None = None,
        share: tuple[int, int] | None = None,
        study: str | PathLike[str] | None = None,
        study_key: str | None = None,
        retry: str | Collection[int] = (),
        on_failure: str = "record",
        names: Mapping[str, str] | None = None,
        maximize: Collection[str] | None = None,
        units: Mapping[str, str] | None = None,
        **kwargs: Any,
    ) -> None:
        require_known_keywords("PSI", Algorithm, kwargs)
        self.n_points = integer("n_points", n_points, minimum=1)
        self.first = integer("first", first, minimum=1)
        self.memory = Memory.of(study, retry, share)
        if block_size is None:  # 32 lines of a display; below 64 designs the ways there count
            block_size = max(64, -(-self.n_points // (32 * self.memory.share.of)))
        self.block_size = integer("block_size", block_size, minimum=1)
        self.limits = limits
        # what is told of the problem and its points, which come with the run
        self._plan = partial(
            Plan.of,
            memory=self.memory,
            limits=limits,
            sampling=uniform_sampling(sampling),
            study_key=study_key,
            names=names,
            maximize=maximize,
            units=units,
        )
        self.stop = known_name("on_failure", on_failure, FAILURE_ACTIONS) == "raise"
        kwargs.setdefault("evaluator", _Evaluator(self.stop))
        kwargs.setdefault("output", _Output())
        self.table = TestTable.empty()
        self._population = Population.empty()  # of the first rows of the table, as far as asked for
        self._blocks: list[int] = []  # how many tests each iteration brought
        self._front = np.zeros(0, dtype=np.intp)  # the Pareto-optimal ones of the first rows
        self._sifted = 0  # how many rows that were
        super().__init__(**kwargs)

    @property
    def n_tested(self) -> int:
        """How many points are tested so far.

        Example:
            >>> from pymoo.optimize import minimize
            >>> from pymoo_psi import SphereChute
            >>> minimize(SphereChute(), PSI(8)).algorithm.n_tested
            8
        """
        return len(self.table)

    def setup(self, problem: Any, **kwargs: Any) -> PSI:
        """Prepare a run, as pymoo's ``setup``; an unknown keyword is an error here."""
        require_problem(problem)
        if self.is_initialized:  # pymoo's would keep termination, iterations and evaluations
            shown = Received(f"one that has tested {self.n_tested} points")
            remedy = "make another for a new run; minimize takes a copy of one that is not set up"
            raise invalid("the algorithm", "set up before it runs", shown, remedy)
        problem, self.stop = untolerant(problem, self.stop)
        known = ("verbose", "progress", "pf")  # pf: of pymoo's examples, which no longer uses it
        run_options = {k: v for k, v in kwargs.items() if k not in known}
        require_known_keywords("PSI.setup", Algorithm, run_options)
        given = termination_from_tuple(kwargs.get("termination", self.termination))
        self._whole = given is None
        # in the place of pymoo's default, which would stop a run before all points are tested
        kwargs["termination"] = (
            _PointsTested() if given is None else TerminateIfAny(_PointsTested(), given)
        )
        super().setup(problem, **kwargs)
        return self

    def _setup(self, problem: Any, **kwargs: Any) -> None:
        plan = self._plan(problem, self.n_points, first=self.first, seed=self.seed)
        self.table = plan.table
        self._investigation = Investigation(plan, self.stop, whole=self._whole)

    def has_next(self) -> bool:
        """Say whether points are left; a later termination does not bring more of them."""
        return self.n_tested < self._n_tests() and bool(super().has_next())

    def next(self) -> None:
        """Test the next block; another process cannot test it meanwhile for the same study."""
        size = self._block()  # before the numbers are looked at, of which it may make more
        numbers = self._investigation.numbers[self.n_tested :][:size]
        if len(numbers) == 0:
            return
        if self.archive is not None or not isinstance(self.evaluator, _Evaluator):
            # where all are stored there is nothing to test, and the study is not even locked
            known = len(self.memory.recall(self.table.layout, numbers)) == len(numbers)
            with nullcontext() if known else self.memory.writing():
                super().next()  # these take pymoo's populations
            return
        if not self.is_initialized:
            self._initialize()
        tests, n_evaluated = self._investigation.tested(self.n_tested, len(numbers))
        self.evaluator.n_eval += n_evaluated
        self._add(tests)
        self.is_initialized = True
        try:
            # the rest of pymoo's `advance`, which would ask for the optimum of every block
            self._post_advance()
            if self.termination.has_terminated():
                self.finalize()
        except BaseException:  # of a callback
            self._investigation.close()
            raise

    def finalize(self) -> None:
        """End the run; what is being evaluated ahead of the last block is given up."""
        self._investigation.close()
        super().finalize()

    def _n_tests(self) -> int:
        """Return how many tests the table has in the end."""
        return len(self._investigation.numbers)

    def _block(self) -> int:
        """Return how many points are tested next, at most; they are known from here on."""
        return self.block_size

    def _infill(self) -> Population | None:
        """Return the next designs, those of a study evaluated; ``None`` when all are told."""
        self._investigation.close()  # from here on the user evaluates
        start, size = self.n_tested, self._block()
        points = self._investigation.points[start : start + size]
        if len(points) == 0:
            return None
        numbers = self._investigation.numbers[start : start + size]
        space = self._investigation.space
        block = Population.new("X", space.designs(space.matrix(points)))
        block.set("test_point", numbers)
        stored = self.memory.recall(self.table.layout, numbers)
        self._give_values(block[np.searchsorted(numbers, stored.numbers)], stored)
        return block

    def _advance(self, infills: Population | None = None, **kwargs: Any) -> bool:
        """Add a block that a user tells."""
        if infills is None:
            return False
        tests = self._told(infills)
        self.memory.keep(tests)
        before = self.pop  # of the table without the block, so asked for before it grows
        for individual, violation in zip(infills, self._violation(tests), strict=True):
            individual.CV = np.array([violation])  # pymoo's, with that of the limits
        self._population = Population.merge(before, infills)
        self._add(tests)
        return True

    # The first block is a block like any other.
    _initialize_infill, _initialize_advance = _infill, _advance

    def _add(self, tests: TestTable) -> None:
        self.table = self.table.extended(tests)
        self._blocks.append(len(tests))
        if self.n_tested == self._n_tests():
            self.termination.terminate()

    def _told(self, infills: Population) -> TestTable:
        """Return the tests of individuals, which must be evaluated and the next ones in order."""
        layout, numbers = self.table.layout, infills.get("test_point")
        asked = self._investigation.numbers[self.n_tested :][: len(infills)]
        if not np.array_equal(numbers, asked):
            which = f"from number {asked[0]}" if len(asked) else "of which none is left"
            raise invalid(
                "infills",
                f"the test points asked for, {which}, in their order",
                Received(str(numbers.tolist())),
                "tell the population that ask() returned",
            )
        groups = {"F": layout.objectives, "G": layout.inequalities, "H": layout.equalities}
        for name, columns in groups.items():
            values = infills.get(name)
            if values.shape != (len(infills), len(columns)):
                raise invalid(
                    f"{name} of infills",
                    f"{len(columns)} values for each design",
                    Received(f"an array of shape {values.shape}"),
                    "evaluate the population before it is told",
                )
        # What else an individual carries may be a mark of the user's.
        names = {name: None for i in infills for name in i.data.get("outputs", ())}
        out = {name: value_column([i.data.get(name) for i in infills]) for name in names}
        out |= {name: infills.get(name) for name in ("F", "G", "H", "failure")}
        X = self._investigation.space.to_matrix(infills.get("X"))
        rows = np.arange(self.n_tested, self.n_tested + len(infills))
        return self._investigation.table(rows, X, out)

    def _violation(self, tests: TestTable) -> NDArray[np.float64]:
        """``(n,)`` pymoo's constraint violation of designs, with that of the limits.

        It is infinite where a design failed, or a value that has a limit is none or not finite.
        """
        total = constraint_violation(tests.G, tests.H, tests.layout.eq_tolerance)
        failed = tests.status == "failed"
        if lacking(self.limits, tests.layout):
            total[:] = np.inf
        elif not failed.all():
            total += excess(bounds_of(self.limits, tests.layout), tests.column, len(tests))
        return np.where(failed, np.inf, total)

    def _give_values(self, block: Population, tests: TestTable) -> None:
        """Give individuals the values of their tests; pymoo then does not evaluate them."""
        names = tests.layout.outputs
        values = zip(
            block,
            tests.numbers.tolist(),
            # Copies, as individuals may be changed; one of each array, as a row takes a while.
            *(values.copy() for values in (tests.F, tests.G, tests.H)),
            self._violation(tests)[:, None],
            tests.outputs.tolist(),
            strict=True,
        )
        for individual, number, f, g, h, violation, outputs in values:
            individual.F, individual.G, individual.H, individual.CV = f, g, h, violation
            individual.data.update(zip(names, outputs, strict=True))
            individual.data |= {"failure": tests.reasons.get(number, ""), "outputs": names}
            individual.evaluated.update("FGH")

    # What pymoo's tools read: individuals made from the table when they are first asked for.
    # pymoo assigns these names on its way, which changes nothing.

    def _assign(self, value: Any) -> None:
        pass  # pymoo's base class sets them in its constructor and after a block

    def _all(self) -> Population:
        """Every tested design."""
        known = len(self._population)
        if known < self.n_tested:
            tests = self.table.rows(np.arange(known, self.n_tested))
            designs = self._investigation.space.designs(tests.X.copy())
            block = Population.empty(len(tests))
            iterations = np.repeat(np.arange(1, len(self._blocks) + 1), self._blocks)[known:]
            rows = zip(block, designs, tests.numbers.tolist(), iterations.tolist(), strict=True)
            for individual, x, number, iteration in rows:
                individual.X = x
                individual.data = {"test_point": number, "n_gen": iteration, "n_iter": iteration}
            self._give_values(block, tests)
            self._population = Population.merge(self._population, block)
        return self._population

    def _last(self) -> Population | None:
        """The designs of the last block."""
        return self._all()[-self._blocks[-1] :] if self._blocks else None

    def _best(self) -> Population | None:
        """The Pareto-optimal designs, or the least infeasible one; the best of one objective."""
        if self.n_tested == 0:
            return None
        rows = self._optimal_rows()
        if len(rows) == 0:
            violation = np.nan_to_num(self._violation(self.table), nan=np.inf)
            rows = np.array([violation.argmin()])  # as pymoo does where nothing is feasible
        return self._all()[rows if self.problem.n_obj > 1 else rows[:1]]

    def _optimal_rows(self) -> NDArray[np.intp]:
        """Return the rows of the table that no feasible one dominates."""
        if self._sifted < self.n_tested:
            # What the last front dominates, no later design makes optimal again.
            if self._none_feasible():
                return self._front
            rows = np.concatenate([self._front, np.arange(self._sifted, self.n_tested)])
            self._front = rows[self.table.rows(rows).pareto(self.limits)]
            self._sifted = self.n_tested
        return self._front

    def _none_feasible(self) -> bool:
        """Whether tests go on, and none so far keeps the limits as an output is still unknown."""
        return lacking(self.limits, self.table.layout) and not self.termination.has_terminated()

    pop = property(_all, _assign)
    off = property(_last, _assign)
    opt = property(_best, _assign)

    def _set_optimum(self) -> None:
        pass  # `opt` is found when it is read


class _Evaluator(Evaluator):
    """pymoo's evaluator for those who ask and tell: designs that fail are kept as failed."""

    def __init__(self, stop: bool) -> None:
        super().__init__()
        self.stop = stop

    def _eval(self, problem: Any, pop: Population, values: Any, **kwargs: Any) -> None:
        wrapped, stop = untolerant(problem, self.stop)
        out = evaluate_designs(wrapped, pop.get("X"), stop=stop)
        for name, values in out.items():
            pop.set(name, values)
        outputs = tuple(name for name in out if name not in NO_OUTPUTS)
        for individual in pop:
            individual.data["outputs"] = outputs
            individual.evaluated.update("FGH")


class _PointsTested(Termination):
    """Terminate when every test point is tested; the progress is the share of them."""

    def _update(self, algorithm: Any) -> float:
        progress: float = algorithm.n_tested / algorithm._n_tests()
        return progress


class _Output(Output):
    """The columns shown by ``verbose=True``.

    Evaluations of this run, tested points (with those of a study), failed, feasible and
    Pareto-optimal designs.
    """

    def __init__(self) -> None:
        super().__init__()
        self.counts = [Column(name, width=8) for name in ("tested", "failed", "feasible", "n_nds")]
        self.columns += self.counts

    def update(self, algorithm: PSI) -> None:
        super().update(algorithm)
        table, optimal = algorithm.table, len(algorithm._optimal_rows())
        failed = int((table.status == "failed").sum())
        feasible = int(table.feasible(algorithm.limits).sum()) if optimal else 0
        for column, value in zip(self.counts, (len(table), failed, feasible, optimal), strict=True):
            column.set(value)
