"""What shows a run of PSI and what ends it.

Blocks of test points: pymoo's populations on the one side, the test table on the other.

Parameter Space Investigation as a pymoo algorithm.

PSI tests the points of a uniformly distributed sequence and keeps every one of them with its
number. It learns nothing on the way, so a run is the same however it is cut into blocks.
"""

from __future__ import annotations

from collections.abc import Collection
from os import PathLike
from typing import Any

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.population import Population
from pymoo.core.termination import TerminateIfAny, Termination
from pymoo.util.display.column import Column
from pymoo.util.display.output import Output
from pymoo.util.misc import termination_from_tuple
from pymoo.util.optimum import filter_optimum

from pymoo_psi._validation import Received, integer, invalid
from pymoo_psi.algorithms._memory import Memory, fingerprint
from pymoo_psi.algorithms._sampling import LPTauSampling, UniformSampling, require_uniform
from pymoo_psi.evaluation._evaluator import GuardedEvaluator, failure_action
from pymoo_psi.evaluation._failures import unguarded
from pymoo_psi.pareto import nondominated
from pymoo_psi.problems import DesignSpace, design_space
from pymoo_psi.problems._pymoo import require_known_keywords, require_problem
from pymoo_psi.table import Layout, TestTable
from pymoo_psi.table._layout import Limits
from pymoo_psi.table._limits import limit_vector


class PointsTested(Termination):
    """Terminate when every test point has been told; the progress is the share of them."""

    def _update(self, algorithm: Any) -> float:
        progress: float = algorithm.n_tested / algorithm.n_points
        return progress


def _n_tested(algorithm: Any) -> int:
    return int(algorithm.n_tested)


def _n_failed(algorithm: Any) -> int:
    return int((algorithm.table.status == "failed").sum())


def _n_feasible(algorithm: Any) -> int:
    return int(algorithm.table.feasible(algorithm.limits).sum())


def _n_pareto(algorithm: Any) -> int:
    return len(algorithm.opt)


class PSIOutput(Output):
    """The columns shown by ``verbose=True``.

    Evaluations of this run, tested points (with those of a study), failed, feasible and
    Pareto-optimal designs.
    """

    def __init__(self) -> None:
        super().__init__()
        self.columns += [
            Column("tested", width=8, func=_n_tested),
            Column("failed", width=8, func=_n_failed),
            Column("feasible", width=8, func=_n_feasible),
            Column("n_nds", width=6, func=_n_pareto),
        ]


def problem_layout(problem: Any, space: DesignSpace) -> Layout:
    """Return the columns of the test table of a problem: names and bounds."""
    discrete = np.array([variable.kind in ("binary", "choice") for variable in space.variables])
    return Layout.of(
        space.names,
        problem.n_obj,
        problem.n_ieq_constr,
        problem.n_eq_constr,
        lower=np.where(discrete, np.nan, space.lower),
        upper=np.where(discrete, np.nan, space.upper),
    )


def recall(block: Population, stored: TestTable) -> None:
    """Give designs of a block their stored values; pymoo then evaluates only the others.

    Args:
        block: Consecutive test points.
        stored: Some of them, evaluated.
    """
    if len(stored) == 0:
        return
    known = block[stored.numbers - block[0].get("test_point")]
    reasons = [stored.reasons.get(number, "") for number in stored.numbers.tolist()]
    known.set("F", stored.F, "G", stored.G, "H", stored.H, "failure", reasons)
    for individual in known:
        individual.evaluated.update("FGH")
        if individual.get("failure"):
            individual.CV = np.array([np.inf])


def require_next(block: Population, first: int) -> None:
    """Refuse a block that a user tells and that does not continue where the last one ended."""
    numbers = block.get("test_point").tolist()
    if numbers != list(range(first, first + len(numbers))):
        raise invalid(
            "infills",
            f"the test points asked for, from number {first}, in their order",
            Received(str(numbers)),
            "tell the population that ask() returned",
        )


def table_of_block(block: Population, space: DesignSpace, layout: Layout) -> TestTable:
    """Return evaluated designs as a table.

    Raises:
        ArgumentValueError: The block is not evaluated.
    """
    groups = {"F": layout.objectives, "G": layout.inequalities, "H": layout.equalities}
    for name, columns in groups.items():
        values = block.get(name)
        if values.shape != (len(block), len(columns)):
            raise invalid(
                f"{name} of infills",
                f"{len(columns)} values for each design",
                Received(f"an array of shape {values.shape}"),
                "evaluate the population before it is told",
            )
    numbers, X, failures = block.get("test_point", "X", "failure")
    reasons = {n: r for n, r in zip(numbers.tolist(), failures, strict=True) if r}
    return TestTable.of(
        numbers, space.to_matrix(X), *block.get("F", "G", "H"), reasons=reasons, layout=layout
    )


class PSI(Algorithm):
    """Test the points of the LPτ sequence and return the feasible Pareto-optimal ones.

    ``minimize(problem, PSI(4096))`` works on any pymoo problem with finite bounds, its variables
    real, integer, binary or choices; it ends by itself when the points are used up, or earlier if
    a termination says so. In the result, ``res.X`` and ``res.F`` are the Pareto-optimal feasible
    designs, ``res.opt.get("test_point")`` their numbers, ``res.pop`` every tested design, and
    ``res.algorithm.table`` the table of all tests.

    Asking and telling works as for every pymoo algorithm; ``ask()`` returns the same block until
    it is told, and ``None`` when no points are left.

    Args:
        n_points: How many points to test.
        first: Number of the first point, from 1, which lies at the lower bounds. ``PSI(1024)``
            and ``PSI(3072, first=1025)`` together test the points of ``PSI(4096)``.
        sampling: Where the points come from: ``LPTauSampling()`` by default;
            :class:`~pymoo_psi.QMCSampling` for more than 51 variables or for randomised points,
            which then follow the ``seed`` of the run.
        limits: Limits on criteria, f_j <= limit, by name or index from 0: ``{"f1": 2.5}``. A
            design that exceeds one counts as infeasible in the result; the table keeps it as it
            is, so that other limits can be tried on the table afterwards.
        study: Name of a study file, in which every block is stored as soon as it is tested; of a
            model that evaluates one design at a time, every few seconds of work. The
            same call continues a study that was interrupted, a larger ``n_points`` extends it,
            and no stored design is evaluated again.
        study_key: What else the study depends on, such as a version or constants of the model; a
            study with another key is refused. The study itself compares name, variables, bounds
            and numbers of objectives and constraints, and what a method ``fingerprint()`` of the
            problem returns; it cannot see into the model.
        retry: Numbers of test points that the study holds as failed and that are to be evaluated
            once more; ``"failed"`` for all of them.
        on_failure: ``"record"`` keeps a design whose evaluation raises, gives NaN or the wrong
            shape, or is lost, as failed with its reason, and goes on; ``"raise"`` stops there,
            with everything before it stored.
        block_size: Points per iteration, after each of which display, callback and termination
            are called. By default the run has 32 iterations, of at least 64 points.
        **kwargs: pymoo's own: ``termination``, ``callback``, ``output``, ``save_history``, …

    Raises:
        ArgumentValueError: A count is out of range; at the start of a run: the problem has no
            finite bounds, or more than 51 variables.
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

    def __init__(
        self,
        n_points: int,
        *,
        first: int = 1,
        block_size: int | None = None,
        sampling: UniformSampling | None = None,
        limits: Limits | None = None,
        study: str | PathLike[str] | None = None,
        study_key: str | None = None,
        retry: str | Collection[int] = (),
        on_failure: str = "record",
        **kwargs: Any,
    ) -> None:
        require_known_keywords("PSI", Algorithm, kwargs)
        self.limits = limits
        self.study_key = study_key
        self.memory = Memory.of(study, retry)
        kwargs.setdefault("evaluator", GuardedEvaluator(failure_action("on_failure", on_failure)))
        self.sampling = require_uniform(LPTauSampling() if sampling is None else sampling)
        kwargs.setdefault("output", PSIOutput())
        super().__init__(**kwargs)
        self.n_points = integer("n_points", n_points, minimum=1)
        self.first = integer("first", first, minimum=1)
        if block_size is None:
            block_size = max(64, -(-self.n_points // 32))
        self.block_size = integer("block_size", block_size, minimum=1)
        self.table = TestTable.empty()
        self._pareto = np.zeros(0, dtype=np.intp)  # rows of the table, and of the population

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
        problem = unguarded(problem)
        run_options = {k: v for k, v in kwargs.items() if k not in ("verbose", "progress")}
        require_known_keywords("PSI.setup", Algorithm, run_options)
        given = termination_from_tuple(kwargs.get("termination", self.termination))
        kwargs["termination"] = (
            PointsTested() if given is None else TerminateIfAny(PointsTested(), given)
        )
        super().setup(problem, **kwargs)
        return self

    def _setup(self, problem: Any, **kwargs: Any) -> None:
        self.space = design_space(problem)
        self.table = TestTable.empty(problem_layout(problem, self.space))
        self._limits = limit_vector(self.limits, self.table.layout)
        if self.memory.study is not None:
            identity = fingerprint(
                problem, self.space, self.sampling, self.n_points, self.seed, self.study_key
            )
            self.memory.study.begin(self.table.layout, identity)
        self._points = self.sampling.unit_points(
            self.n_points,
            len(self.space.variables),
            first=self.first,
            random_state=np.random.default_rng(self.seed),
        )

    def next(self) -> None:
        """Test the next block; another process cannot test it meanwhile for the same study."""
        with self.memory.writing():
            super().next()

    @property
    def remembers(self) -> bool:
        """Whether there is a study.

        Example:
            >>> PSI(8).remembers, PSI(8, study="chute.db").remembers  # the file is made by a run
            (False, True)
        """
        return self.memory.study is not None

    def keep(self, evaluated: Population) -> None:
        """Store evaluated designs of a block that is not finished yet."""
        self.memory.keep(table_of_block(evaluated, self.space, self.table.layout))

    def _initialize_infill(self) -> Population:
        return self._next_block()

    def _infill(self) -> Population | None:
        return self._next_block()

    def _next_block(self) -> Population | None:
        """Return the next points to test; ``None`` when all are told."""
        count = min(self.block_size, self.n_points - self.n_tested)
        if count == 0:
            return None
        first = self.first + self.n_tested
        points = self._points[self.n_tested : self.n_tested + count]
        block = Population.new("X", self.space.designs(self.space.matrix(points)))
        block.set("test_point", np.arange(first, first + count))
        recall(block, self.memory.recall(self.table.layout, first, count))
        return block

    def _initialize_advance(self, infills: Population | None = None, **kwargs: Any) -> None:
        self.pop = Population.empty()
        self._advance(infills=infills, **kwargs)

    def _advance(self, infills: Population | None = None, **kwargs: Any) -> bool:
        if infills is None:
            return False
        require_next(infills, self.first + self.n_tested)
        block = table_of_block(infills, self.space, self.table.layout)
        self.memory.keep(block)
        rows = np.concatenate(
            [self._pareto, self.n_tested + np.flatnonzero(block.eligible(self.limits))]
        )
        self.table = self.table.extended(block)
        self._pareto = rows[nondominated(self.table.F[rows])]
        if self._limits:
            within = np.array(list(self._limits.values()))
            over = np.maximum(block.F[:, list(self._limits)], within) - within
            excess = np.where(np.isfinite(over), over, 0).sum(axis=1, keepdims=True)
            infills.set("CV", infills.get("CV") + excess)
        self.pop = Population.merge(self.pop, infills)
        return True

    def _set_optimum(self) -> None:
        if len(self._pareto) == 0:
            self.opt = filter_optimum(self.pop, least_infeasible=True)
        elif self.problem.n_obj == 1:
            self.opt = self.pop[self._pareto[:1]]  # pymoo returns one design here
        else:
            self.opt = self.pop[self._pareto]
