"""Parameter Space Investigation, as a pymoo algorithm and on arrays.

PSI tests the points of a uniformly distributed sequence and keeps every test with its number. The
points do not depend on results, so that a run is the same however it is cut into blocks.
:func:`investigate` does the same without pymoo's individuals.
"""

from __future__ import annotations

import math
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.termination import TerminateIfAny, Termination
from pymoo.termination.max_eval import MaximumFunctionCallTermination
from pymoo.util.display.multi import MultiObjectiveOutput
from pymoo.util.misc import termination_from_tuple

from pymoo_psi._output import WithTable
from pymoo_psi._validation import (
    Received,
    instance,
    integer,
    invalid,
    known_name,
)
from pymoo_psi.algorithms._executor import kept_rows, needed_tests
from pymoo_psi.algorithms._individuals import assign_tests, individuals_of, tests_of
from pymoo_psi.algorithms._run import Run, by_number, progress_bar, repeated_tests, run_of_sequence
from pymoo_psi.algorithms._sources import (
    SETTINGS,
    AlgorithmSettings,
    Keep,
    Points,
    RunOptions,
    RunSettings,
)
from pymoo_psi.algorithms._store import stored_at_termination
from pymoo_psi.analysis import averaged_repeats
from pymoo_psi.parallel import Runner, runner_of_jobs
from pymoo_psi.problems import (
    FailureTolerant,
    design_space,
    require_known_keywords,
    require_problem,
    requirement_texts,
    untolerant,
    with_requirements,
)
from pymoo_psi.table import TestTable

if TYPE_CHECKING:
    from typing_extensions import Unpack

# Tests from which on those not kept are dropped during a run: as many as two pieces have, but a
# million where dominance has to be found, which takes longer than the tests. They are dropped again
# when there are twice as many as were left, so that all filtering together takes at most twice as
# long as the last one.
_WORTH_FILTERING = {"feasible": 2**17, "pareto": 2**20}


class PointAlgorithm(WithTable, Algorithm):
    """An algorithm of pymoo that tests the points of a source.

    A subclass writes ``begin``, which returns the run. Beside the run, its state is the table of
    tests: pymoo's individuals are made from it when they are asked for.

    Args:
        n_points: How many points to test.
        options: The options of the run. An iteration tests ``block_size`` points; by default those
            that the source returns together.
        **kwargs: Further options of the run, which replace those, and what pymoo's constructor
            takes.

    Attributes:
        table: The table of all tests.
    """

    archive: Any  # pymoo's, as the next two
    is_initialized: bool
    seed: int | None

    def __init__(self, n_points: int, options: RunOptions, /, **kwargs: Any) -> None:
        of_run = {name: kwargs.pop(name) for name in SETTINGS & kwargs.keys()}
        owner = type(self)
        require_known_keywords(owner.__name__, owner, kwargs, taken=("options",), more=SETTINGS)
        options = replace(options, **of_run)
        self.n_points = n_points
        self.options = options
        self._tables = [TestTable.empty()]  # the tests of each iteration, joined when they are read
        self._most_evaluations = math.inf
        self._begun: Run | None = None
        self._is_free = False  # whether the last block needed no evaluation
        self._block_sizes: list[int] = []  # the number of tests of each iteration
        # the individuals of the first tests; others are made when pymoo's tools read them
        self._population = Population.empty()
        kwargs.setdefault("evaluator", _Evaluator(self))
        kwargs.setdefault("output", MultiObjectiveOutput())
        super().__init__(seed=options.seed, **kwargs)

    def begin(self, options: RunOptions) -> Run:
        """Return the run of ``self.problem``; the options have the seed of pymoo's ``minimize``."""
        raise NotImplementedError

    @property
    def _run(self) -> Run:
        if self._begun is None:
            received = Received("one without a problem")
            remedy = "call setup(problem), or minimize(problem, algorithm)"
            raise invalid(f"the algorithm {type(self).__name__}", "set up", received, remedy)
        return self._begun

    @property
    def table(self) -> TestTable:
        """All tests so far, under the limits or the formulation of the run.

        Example:
            >>> from pymoo.optimize import minimize
            >>> from pymoo_psi import PSI, SphereChute
            >>> minimize(SphereChute(), PSI(8)).algorithm.table.numbers
            array([1, 2, 3, 4, 5, 6, 7, 8])
        """
        if self.n_tested == 0:
            return self._tests
        return self._run.model.under_so_far(self._run.numbered(self._tests))

    @property
    def _tests(self) -> TestTable:
        """All tests so far, as the run has them; tables are joined when they are read."""
        first, *others = self._tables
        self._tables = [first.extended(*others)]
        return self._tables[0]

    @property
    def n_tested(self) -> int:
        """How many points are tested so far.

        Example:
            >>> from pymoo.optimize import minimize
            >>> from pymoo_psi import PSI, SphereChute
            >>> minimize(SphereChute(), PSI(8)).algorithm.n_tested
            8
        """
        return sum(self._block_sizes)

    @property
    def n_left(self) -> int:
        """How many points are to be tested.

        Example:
            >>> from pymoo_psi import PSI, SphereChute
            >>> algorithm = PSI(100, block_size=25)
            >>> algorithm.setup(SphereChute()).next()
            >>> algorithm.n_left
            75
        """
        return self._run.n_left

    def setup(self, problem: Any, **kwargs: Any) -> Any:
        """Prepare a run, as pymoo's ``setup``; an unknown keyword is an error here."""
        require_problem(problem)
        if self.is_initialized:  # pymoo's would keep termination, iterations and evaluations
            received = Received(f"one that has tested {self.n_tested} points")
            raise invalid("the algorithm", "set up before it runs", received, "make another")
        known = ("verbose", "progress", "pf")  # pf: only pymoo's examples give it
        require_known_keywords(f"{type(self).__name__}.setup", Algorithm, kwargs, more=known)
        required = with_requirements(untolerant(problem), self.options.requirements)
        if isinstance(problem, FailureTolerant):  # individuals have its constraints
            required = FailureTolerant(required, failed_as=problem.failed_as)
        termination = termination_from_tuple(kwargs.get("termination", self.termination))
        self.options = replace(self.options, may_end_early=termination is not None)
        if isinstance(termination, MaximumFunctionCallTermination):
            self._limit_evaluations(required, termination.n_max_evals)
        # instead of pymoo's default, which would stop a run before all points are tested
        ends = [_PointsTested()]
        if termination is not None:
            ends.append(termination)
        kwargs["termination"] = TerminateIfAny(*ends)
        super().setup(required, **kwargs)
        return self

    def _limit_evaluations(self, problem: Any, count: int) -> None:
        """Evaluate at most ``count`` designs; test no more points, if each is evaluated."""
        self._most_evaluations = count
        is_noisy = getattr(problem, "noisy", False)
        recurs = design_space(problem).finite and not is_noisy
        if self.options.study is None and not requirement_texts(problem) and not recurs:
            self.n_points = min(self.n_points, max(1, count * self.options.part.of))

    def _setup(self, problem: Any, **kwargs: Any) -> None:
        # It says how many points an iteration tests, not how many are evaluated together.
        options = replace(self.options, seed=self.seed, block_size=None)
        self._begun = self.begin(options)
        self._tables = [self._run.store.empty]

    def has_next(self) -> bool:
        """Whether points are left and no termination has ended the run."""
        return self._run.n_left > 0 and bool(super().has_next())

    def next(self) -> None:
        """Test the next block; meanwhile no other process can test it for the same study."""
        if self._run.n_left == 0:
            return
        self._require_own_evaluator()
        if not self.is_initialized:
            self._initialize()
        run = self._run
        n_before = run.n_called
        tests = run.block(self._size_of_block())
        n_called = run.n_called - n_before
        self._is_free = n_called == 0
        self.evaluator.n_eval += n_called
        self._add(tests)
        self.is_initialized = True
        try:
            # the rest of pymoo's `advance`, which would ask for the optimum of every block
            self._post_advance()
            if self.archive is not None:
                self.archive = self.archive.add(self.off)
            if self.termination.has_terminated():
                self.finalize()
        except BaseException:  # a callback has raised it
            run.close()
            raise

    def _require_own_evaluator(self) -> None:
        """Refuse an evaluator of a user, which would not be called."""
        evaluator = self.evaluator
        if type(evaluator) not in (Evaluator, _Evaluator) or evaluator.callback is not None:
            rule = "pymoo's own without a callback, as the run evaluates by itself"
            remedy = "give the problem or the algorithm a callback, or ask and tell"
            raise invalid("evaluator", rule, Received(type(evaluator).__name__), remedy)

    @property
    def _block_size(self) -> int | None:
        """The size of a block; ``None`` for a round, which has the size that it has."""
        return self.options.block_size

    def _size_of_block(self) -> int | None:
        """Return the size of the next block, at most the number of evaluations that are left.

        After a block that needed none, it may be twice as large.
        """
        if self._block_size is None:
            return None
        size = max(1, self._most_evaluations - self.evaluator.n_eval)
        if self._is_free:
            size = max(size, 2 * self._block_sizes[-1])
        return int(min(self._block_size, size))

    def finalize(self) -> None:
        """End the run; what is being evaluated ahead of the last block is given up."""
        self._run.close()
        # the line that calls minimize
        self._run.model.require_results(self._tests, self.n_tested, stacklevel=6)
        super().finalize()

    def _infill(self) -> Population | None:
        """Return the next designs; ``None`` when none is left.

        Those of a study are evaluated, and those that violate a requirement count as evaluated.
        """
        self._run.close()  # from here on the user evaluates
        points = self._run.next_points(self._block_size)
        if len(points) == 0:
            return None
        return self._individuals(points, self._run.known(points))

    def _advance(self, infills: Population | None = None, **kwargs: Any) -> bool:
        """Add a block that a user has evaluated."""
        if infills is None:
            return False
        points = self._run.next_points(self._block_size).at(slice(0, len(infills)))
        tests = tests_of(infills, points, self._run.model)
        violation = self._run.model.total_violation(tests)
        infills.set("CV", violation[:, None])  # pymoo's, with that of the limits
        # The block is not in the table yet, from which ``pop`` is made.
        self._population = Population.merge(self.pop, infills)
        self._run.tell(tests)
        self._add(tests)
        return True

    # The first block is a block like any other.
    _initialize_infill = _infill
    _initialize_advance = _advance

    def _add(self, tests: TestTable) -> None:
        self._tables.append(tests)
        self._block_sizes.append(len(tests))
        if self._run.n_left == 0:
            self.termination.terminate()

    def _individuals(self, points: Points, tests: TestTable) -> Population:
        """Return individuals of points, of which those that have tests are evaluated."""
        individuals = individuals_of(points, self._run.model)
        assign_tests(individuals, tests, self._run.model, self.problem)
        return individuals

    # What pymoo's tools read: individuals, made from the table when they are first asked for.
    # pymoo also assigns these attributes, which changes nothing.

    def _assign(self, value: Any) -> None:
        pass  # pymoo's base class does so in its constructor and after a block

    def _all(self) -> Population:
        """Every tested design."""
        n_known = len(self._population)
        if n_known < self.n_tested:
            tests = self._tests.take(np.arange(n_known, self.n_tested))
            block = self._individuals(Points(tests.numbers, 0, designs=tests.X), tests)
            iterations = np.repeat(np.arange(1, len(self._block_sizes) + 1), self._block_sizes)
            for individual, iteration in zip(block, iterations[n_known:].tolist(), strict=True):
                individual.data["n_gen"] = iteration
                individual.data["n_iter"] = iteration
            self._population = Population.merge(self._population, block)
        return self._population

    def _last(self) -> Population | None:
        """The designs of the last block."""
        if not self._block_sizes:
            return None
        return self._all()[-self._block_sizes[-1] :]

    def _best(self) -> Population | None:
        """The Pareto-optimal designs, or the least infeasible one; the best of one objective."""
        if self.n_tested == 0:
            return None
        rows = np.flatnonzero(self._run.model.under_so_far(self._tests).pareto())
        if len(rows) == 0:
            violation = self._run.model.total_violation(self._tests)
            rows = np.array([violation.argmin()])  # as pymoo does where nothing is feasible
        if self.problem.n_obj == 1:
            rows = rows[:1]
        return self._all()[rows]

    pop = property(_all, _assign)
    off = property(_last, _assign)
    opt = property(_best, _assign)

    def _set_optimum(self) -> None:
        pass  # `opt` is computed when it is read


class _Evaluator(Evaluator):
    """pymoo's evaluator for asking and telling: it evaluates the designs of a run as the run does.

    Args:
        algorithm: The algorithm that is asked.
    """

    def __init__(self, algorithm: PointAlgorithm) -> None:
        super().__init__()
        self.algorithm = algorithm

    def _eval(self, problem: Any, pop: Population, values: Any, **kwargs: Any) -> None:
        model = self.algorithm._run.model
        numbers = pop.get("test_point").astype(np.int64)
        order = np.argsort(numbers)
        X = model.space.to_matrix(pop.get("X"))
        points = Points(numbers[order], 0, designs=X[order])
        blocks = self.algorithm._run.executor.evaluate(points)
        for block in blocks:
            if not block.is_called:
                self.n_eval -= len(block.numbers)
        tests = by_number([block.tests for block in blocks])
        assign_tests(pop, tests, model, self.algorithm.problem)


class _PointsTested(Termination):
    """Terminate when every point is tested; the progress is the share of tested points."""

    def _update(self, algorithm: Any) -> float:
        progress: float = algorithm.n_tested / (algorithm.n_tested + algorithm.n_left)
        return progress


class PSI(PointAlgorithm):
    """Test the points of the LPτ sequence and return the feasible Pareto-optimal ones.

    ``minimize(problem, PSI(4096))`` works on any pymoo problem with finite bounds and real,
    integer, binary or choice variables. It ends when all points are tested, or earlier by a
    termination: after so many evaluations for ``("n_eval", 100)``; where points may need none, as
    with a study, requirements or discrete variables, perhaps some later, at the end of a block. In
    the result, ``res.X`` and ``res.F`` are the Pareto-optimal feasible designs,
    ``res.opt.get("test_point")`` the numbers of their points, ``res.pop`` every tested design, and
    ``res.algorithm.table`` the table of all tests. A test has the number of its point; but in a
    study with other runs it has another one, and the column ``test_point`` of the table that of the
    point.

    Ask and tell works as for every pymoo algorithm. ``ask()`` returns the same block until
    ``tell()`` receives its values, and ``None`` when no points are left. Evaluate with the
    algorithm's own ``evaluator`` to keep further outputs in the table.

    With a runner of this package, such as :class:`~pymoo_psi.JoblibRunner`, parallel
    workers do not wait at the end of a block: while one evaluates the slowest design, the others
    evaluate the next points. If a termination was given, each worker is at most eight designs
    ahead. Designs evaluated ahead when the run ends are kept in the study, if there is one, but are
    not in the result. Only one process at a time tests points for a run of a study.

    The model is assumed to be deterministic: a discrete design that occurs again gets its known
    result (:attr:`TestTable.repeats`); with a study the table has it once. Values passed to
    ``tell()`` are not changed.

    Every further number that the model puts into ``out``, such as ``out["temperature"]``, is a
    column of the table; ``res.pop.get("temperature")`` gives it, too.

    Args:
        n_points: How many points to test.
        share: ``(k, n)`` tests only the k-th of n parts of the points. The n parts together equal
            the run without ``share``; each part covers all bounds.
        block_size: Points per iteration; display, callback and termination are called after each
            iteration. By default at least 64: without a termination as many as make 32 iterations,
            with one up to a sixteenth of those evaluated so far.
        first: Number of the first point, from 1, which lies at the lower bounds. ``PSI(1024)``
            and ``PSI(3072, first=1025)`` together test the points of ``PSI(4096)``.
        sampling: Where the points come from: ``"lptau"`` by default, and for more than 51 variables
            the Sobol' points of SciPy, ``QMCSampling("sobol", scramble=False)``; or, as on the
            command line, ``"sobol"``, ``"halton"`` or ``"lhs"``, whose random points follow the
            seed; or another :class:`~pymoo_psi.UniformSampling`, such as
            :class:`~pymoo_psi.QMCSampling` or a sequence of your own.
        seed: Seed of a randomised sampling; in ``minimize``, pymoo's ``seed``.
        limits: Limits on objectives, variables and outputs, ``{"mass": 30, "width": (0.2, 0.4)}``;
            see :class:`TestTable`. A design that exceeds a limit, or has no value for it, counts as
            infeasible. The table keeps the design, so that other limits can be tried afterwards. A
            limit on an unknown column is an error, at the latest after the first design that does
            not fail; an output that only some designs have must have one of the ``units``.
        formulation: Used instead of ``limits`` to change objectives, directions, limits, computed
            columns and constraints. The study keeps the original values; the table shows them under
            the formulation.
        study: Name of a study file. Tests are stored about every second, so that a kill costs the
            results of the last one, and also when an interrupt, SIGTERM or a failure ends the run.
            The table has the tests of this run, the file those of all runs. The same call continues
            an interrupted study, and a larger ``n_points`` extends it; no stored design is
            evaluated again. With a ``share`` it is the name of a folder with a file for each share,
            which :func:`~pymoo_psi.read_table` reads as one study.
        study_key: A version or constants of the model; a study rejects a changed key. The study
            itself compares name, variables, choices and number of objectives, and the numbers,
            texts, arrays and names of functions that the problem was made with, or what its method
            ``fingerprint()`` returns. These are arguments of its class, given or default, that it
            keeps as attributes of the same name, also in lists, mappings and data classes, but no
            ``pathlib.Path``; a warning names those that are other objects, or functions without a
            name of their own. An argument that is added to the class later, or removed, is accepted
            with its default value. The study does not know other attributes or the code of the
            model. Other bounds, samplings or requirements start another run in the same study.
        more: Whether ``n_points`` counts additional points of a study. If an interrupted run left
            points untested, the call tests only these.
        study_wait: Seconds to wait for other processes that are writing the study, 10 by default.
        retry: ``"failed"`` evaluates failed tests again; ``"incomplete"`` evaluates tests that lack
            a newer objective, or a newer output that the limits or the formulation use.
        names: Names for variables, objectives and constraints, by their default names: ``{"x1":
            "width", "f2": "efficiency", "g1": "stress"}``. Tables, studies, files, plots and limits
            use them. By default those of the problem's attribute ``names``.
        maximize: The objectives to maximize, by these names. pymoo minimizes, so ``out["F"]`` holds
            their negatives; columns in tables have the original values. By default the problem's
            attribute ``maximize``; a list that omits one of these is an error, and an empty list
            minimizes all.
        units: Units of columns by these names, also of further outputs. By default those of the
            problem's attribute ``units``.
        log: Variables with a logarithmic scale: points are spread evenly, and surrogates measure
            distances, in the logarithm. By default those of the problem's attribute ``log``.
        requirements: Rules on variables, ``{"slender": "height <= 4*width"}`` or ``{"mix": "a + b +
            c = 1"}``, by the problem's own names; see :class:`Required`. The model never runs for a
            design that violates one: it counts as infeasible. Those of the problem's attribute
            ``requirements`` hold, too, unless one has the same name.
        **options: The options from ``first`` on, and those of pymoo's algorithms:
            ``termination``, ``callback``, ``output``, ``save_history``, …

    Raises:
        ArgumentValueError: A count is out of range; at the start of a run: the problem has no
            finite bounds.
        ArgumentTypeError: A count is not an integer, a keyword is unknown; at the start of a run:
            the problem is no pymoo problem or has variables of another type.
        StudyError: The study belongs to another problem, is damaged, is being written by another
            process or cannot be written.

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
        share: tuple[int, int] | None = None,
        block_size: int | None = None,
        **options: Unpack[AlgorithmSettings],
    ) -> None:
        integer("n_points", n_points, minimum=1)
        super().__init__(n_points, RunOptions(share=share, block_size=block_size), **options)

    @property
    def _block_size(self) -> int:
        size = self.options.block_size
        if size is not None:
            return size
        if self.options.may_end_early:
            # a time limit is exceeded by little, and long runs have few blocks
            return max(64, int(self.evaluator.n_eval) // 16)
        return max(64, -(-self.n_points // (32 * self.options.part.of)))  # 32 lines of a display

    def begin(self, options: RunOptions) -> Run:
        """Return the run of ``self.problem``; see :class:`PointAlgorithm`."""
        return run_of_sequence(self.problem, self.n_points, options)


def investigate(
    problem: Any,
    n_points: int,
    *,
    keep: Keep = "all",
    n_jobs: int = 1,
    runner: Runner | None = None,
    progress: bool = False,
    repeat: int = 1,
    share: tuple[int, int] | None = None,
    block_size: int | None = None,
    **options: Unpack[RunSettings],
) -> TestTable:
    """Test the points of a uniform sequence and return the table of tests.

    The result equals ``minimize(problem, PSI(n_points)).algorithm.table``. A vectorised problem is
    evaluated at millions of points in seconds, on ``n_jobs`` cores or the workers of a ``runner``.
    Memory grows with the number of kept tests, the size of a block and the number of workers. As in
    :class:`PSI`, a design that occurs again is not evaluated again, unless other processes evaluate
    a vectorised problem.

    Args:
        problem: A pymoo problem with finite bounds.
        n_points: How many points to test.
        keep: ``"all"`` tests, the ``"feasible"`` ones or the ``"pareto"`` set of these.
        n_jobs: Processes for a vectorised problem; -1 for as many as there are cores. The table
            does not depend on it. For a problem that is evaluated one design at a time, use a
            :class:`~pymoo_psi.JoblibRunner`.
        runner: Evaluates a vectorised problem instead of these, such as an
            :class:`~pymoo_psi.ExecutorRunner` on a cluster. Each worker generates, evaluates and
            filters ranges of points.
        progress: Show a progress bar in a terminal or a notebook; elsewhere print one line per
            minute to standard error.
        repeat: Number of tests for each design if the problem is ``noisy``; designs are compared by
            their means. A larger number continues a study.
        share: ``(k, n)`` tests only the k-th of n parts of the points; see :class:`PSI`.
        block_size: The most points that are evaluated together.
        first: Number of the first point; see :class:`PSI` for this and all that follow.
        sampling: Where the points come from.
        seed: Seed of a randomised sampling.
        limits: Limits on objectives, variables and outputs.
        formulation: Used instead of ``limits`` to change what is asked.
        study: Name of a study file, or of a folder with a ``share``.
        study_key: A version or constants of the model.
        study_wait: Seconds to wait for other processes that are writing the study.
        more: Whether ``n_points`` counts additional points of a study.
        retry: Which stored tests are evaluated again, ``"failed"`` or ``"incomplete"`` ones.
        names: Names for variables, objectives and constraints, by their default names.
        maximize: The objectives to maximize.
        units: Units of columns.
        log: Variables with a logarithmic scale.
        requirements: Rules on variables.
        **options: The options from ``first`` on.

    Returns:
        The table of the tests kept, by number.

    Raises:
        ArgumentValueError: A count is out of range, ``keep`` or a limit is unknown, or the
            problem does not fit, as for :class:`PSI`.
        ArgumentTypeError: An argument has the wrong type.
        StudyError: As for :class:`PSI`.
        WorkerError: The problem cannot be sent to processes, or one of them was lost.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 10_000, keep="pareto")
        >>> bool(table.pareto().all())
        True
    """
    require_problem(problem)
    require_known_keywords("investigate", object, options, more=SETTINGS)
    known_name("keep", keep, ("all", "feasible", "pareto"))
    is_noisy = getattr(problem, "noisy", False)
    needed = keep
    if is_noisy:  # all, until they are averaged
        needed = "all"
    run_options = RunOptions(
        keep=needed,
        runner=_runner_of_pieces(problem, n_jobs, runner),
        repeat=repeat,
        share=share,
        block_size=block_size,
        **options,
    )
    tested = partial(_kept_tests, keep=needed, progress=progress)
    run, table = repeated_tests(tested, problem, n_points, run_options)
    model = run.model
    if is_noisy:
        table = averaged_repeats(table)
    table = run.numbered(table)
    model.require_results(table, run.n_taken, stacklevel=3)
    table = model.under_so_far(table)
    return table.take(kept_rows(table, keep))


def _kept_tests(run: Run, keep: str, progress: bool) -> TestTable:
    """Return the tests of a run that are kept, by number."""
    tables = [run.store.empty]  # the first one is what the last filter has left
    with (
        progress_bar(progress) as show_progress,
        stored_at_termination(run.store),
        closing(run.tests()) as blocks,
    ):
        for tests in blocks:
            tables.append(tests)
            show_progress(run.n_taken / max(1, run.n_taken + run.n_left))
            n_rows = sum(map(len, tables))
            if keep != "all" and n_rows > max(2 * len(tables[0]), _WORTH_FILTERING[keep]):
                tests = by_number(tables)
                tables = [needed_tests(run.model, tests, keep)]
    return by_number(tables)


def _runner_of_pieces(problem: Any, n_jobs: int, runner: Runner | None) -> Runner | None:
    """Return what evaluates a vectorised problem in other processes, if they are asked for.

    Raises:
        ArgumentValueError: The problem is evaluated one design at a time.
        ArgumentTypeError: An argument has the wrong type.
    """
    if runner is None:
        if n_jobs == 1:
            return None
        runner = runner_of_jobs(n_jobs)
    instance("runner", runner, Runner)
    if problem.elementwise:
        received = Received("one that is evaluated one design at a time")
        remedy = "give the problem elementwise_runner=JoblibRunner(n_jobs), or this runner"
        raise invalid("the problem of n_jobs or a runner", "vectorised", received, remedy)
    return runner
