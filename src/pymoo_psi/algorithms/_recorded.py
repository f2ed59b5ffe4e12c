"""Problems whose evaluations are kept: a study for any algorithm of pymoo."""

from __future__ import annotations

import copy
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from pymoo.core.algorithm import Algorithm
from pymoo.problems.dyn import DynamicProblem

from pymoo_psi._output import WithTable
from pymoo_psi._validation import Designs, FilePath, Received, Values, invalid
from pymoo_psi.algorithms._executor import Executor
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._run import Run
from pymoo_psi.algorithms._sources import ByName, PlannedPoints, Points, Retry, RunOptions
from pymoo_psi.algorithms._store import StudyStore, stored_at_termination
from pymoo_psi.errors import EvaluationError
from pymoo_psi.problems import (
    FailureTolerant,
    Robust,
    Wrapper,
    columns_of_values,
    layers,
    problem_name,
    require_problem,
    untolerant,
    with_requirements,
)
from pymoo_psi.study import Study
from pymoo_psi.table import BY_ALGORITHM, TEST, TestTable


class Recorded(WithTable, Wrapper):
    """Any pymoo problem, with every evaluation kept in a study and answered from it.

    Each evaluated design becomes a test of the study, numbered from 1 in the order of evaluation.
    It is stored before the algorithm receives its values. A design that is stored already, bit for
    bit the same, is read from the file. To continue a run that was interrupted or killed, run it
    again with the same seed: stored designs are not evaluated again, and the result is that of one
    run. More generations, another seed or another algorithm add to the same study.

    It works with every algorithm whose random numbers follow the seed: in ``minimize``, with ask
    and tell (evaluate by ``algorithm.evaluator.eval(problem, designs, algorithm=algorithm)``), and
    from a checkpoint. pymoo breaks ties of NSGA-III and U-NSGA-III without the seed; here they
    follow it. ``res.pop.get("test_point")`` gives the numbers of their tests.

    Values must depend on the design alone. The study keeps F, G, H and every other output that is
    one number per design. A design that fails is stored with its reason and ends the run with an
    error; all designs evaluated together with it are stored, too. With
    ``Recorded(FailureTolerant(problem), ...)`` the run continues, as it does for a
    :class:`~pymoo_psi.Robust` problem, which is wrapped so. A stored failure is repeated from the
    file unless ``retry`` is set.

    A copy shares the study. Worker processes receive the wrapped problem only.

    Args:
        problem: A pymoo problem, elementwise or not, with any constraints and variables with
            bounds; or a :class:`~pymoo_psi.FailureTolerant`.
        study: Name of the study file, which is created if it does not exist. One process at a time
            writes; others wait for the end of its batch and then use its tests.
        study_key, ...: The options of a study, as for :class:`PSI`. With ``retry``, a failed test
            is evaluated again when an algorithm asks for its design.

    Attributes:
        wrapped: The problem.
        returned: The numbers of the tests whose values it has returned.

    Raises:
        ArgumentTypeError: ``problem`` is no pymoo problem or has variables of another type.
        ArgumentValueError: It has no finite bounds, or its values depend on more than the design.
        StudyError: The study belongs to another model, is damaged or cannot be written; in use:
            another process is writing it.
        EvaluationError: In use: a design failed.
        KeyboardInterrupt: In use: somebody has asked to stop the run, by the page of its study.

    Example:
        >>> import tempfile
        >>> from pymoo.algorithms.moo.nsga2 import NSGA2
        >>> from pymoo.optimize import minimize
        >>> from pymoo_psi import SphereChute
        >>> study = tempfile.mkdtemp() + "/run.db"
        >>> problem = Recorded(SphereChute(0.4, model="rolling"), study=study)
        >>> res = minimize(problem, NSGA2(10), ("n_gen", 3), seed=1)
        >>> problem.table
        TestTable(30 tests: 30 ok, 0 infeasible, 0 failed; 2 variables, 4 objectives, 1 constraint)
        >>> again = Recorded(SphereChute(0.4, model="rolling"), study=study)
        >>> res = minimize(again, NSGA2(10), ("n_gen", 5), seed=1)
        >>> res.algorithm.evaluator.n_eval, again.n_evaluated
        (50, 20)
    """

    same_front = True
    same_columns = True

    def __init__(
        self,
        problem: Any,
        study: FilePath,
        *,
        study_key: str | None = None,
        study_wait: float = 10.0,
        retry: Retry | None = None,
        names: ByName | None = None,
        maximize: Collection[str] | None = None,
        units: ByName | None = None,
    ) -> None:
        options = RunOptions(
            study=Study(study).path,
            study_key=study_key,
            study_wait=study_wait,
            retry=retry,
            names=names,
            maximize=maximize,
            units=units,
        )
        require_problem(problem)
        problem = with_requirements(problem)
        evaluated = untolerant(problem)
        if evaluated is problem and any(isinstance(layer, Robust) for layer in layers(problem)):
            problem = FailureTolerant(problem)  # a design may fail in every scenario
        super().__init__(problem, replace_nan_values_by=None)  # it is replaced when it is checked
        self.tolerates_failures = evaluated is not problem
        is_noisy = getattr(evaluated, "noisy", False)
        if evaluated.requires_kwargs or isinstance(evaluated, DynamicProblem) or is_noisy:
            rule = "one whose values depend on the design alone"
            raise invalid("problem", rule, Received(problem_name(evaluated)))
        self._model = Model(evaluated, options)
        # Tests are found by their designs; only designs without one become points.
        self._store = StudyStore(
            self._model, options, lambda: f"{BY_ALGORITHM} (Recorded)", recalls=False
        )
        self._executor = Executor(self._model, options, together=True)
        self.returned: set[int] = set()
        self._evaluated: list[int] = []  # the numbers of the tests

    def __deepcopy__(self, memo: dict[int, Any]) -> Recorded:
        """Return the problem itself, as pymoo copies problems often."""
        return self

    def untolerant(self) -> Recorded:
        """Return the problem with failures as errors, which shares the study and the counts."""
        if not self.tolerates_failures:
            return self
        strict = copy.copy(self)
        strict.tolerates_failures = False
        strict.wrapped = self._model.problem
        strict.n_ieq_constr = strict.wrapped.n_ieq_constr
        return strict

    @property
    def n_evaluated(self) -> int:
        """How many designs were evaluated rather than read from the study.

        Example:
            >>> import tempfile
            >>> from pymoo_psi import SphereChute
            >>> Recorded(SphereChute(), study=tempfile.mkdtemp() + "/run.db").n_evaluated
            0
        """
        return len(self._evaluated)

    @property
    def table(self) -> TestTable:
        """All tests of the study, by number, as they are in the file now.

        Example:
            >>> import tempfile
            >>> from pymoo_psi import SphereChute
            >>> len(Recorded(SphereChute(), study=tempfile.mkdtemp() + "/run.db").table)
            0
        """
        return self._model.under_so_far(self._store.whole())

    def evaluate(self, X: Any, **kwargs: Any) -> Any:
        """Evaluate designs, as pymoo's ``evaluate``, or take their values from the study."""
        algorithm = kwargs.get("algorithm")
        if isinstance(algorithm, Algorithm):
            self._store.origin = type(algorithm).__name__
        if kwargs.get("return_as_dictionary"):
            # Algorithms ask so. Elsewhere, as in a table of tests with numbers of its own, the
            # numbers would be an output of the model.
            names = kwargs.get("return_values_of") or ["F"]
            kwargs["return_values_of"] = [*names, "test_point"]
        out = super().evaluate(X, **kwargs)
        if isinstance(out, dict):  # pymoo has made floats of the numbers
            out["test_point"] = out["test_point"].astype(np.int64)
        return out

    def do(self, X: Any, return_values_of: Any, **kwargs: Any) -> Values:
        """Return the values of designs; pymoo calls this from ``evaluate``.

        Raises:
            EvaluationError: A design failed; everything is stored.
            ArgumentValueError: What is asked for is not kept.
        """
        rows = self._values_of(self._model.space.to_matrix(X))
        out: Values = {"test_point": np.zeros(0, dtype=np.int64)}  # of no designs
        out |= columns_of_values(self._model.problem, rows)
        self.returned.update(out["test_point"].tolist())
        for name in return_values_of:  # pymoo would fill in infinity
            if name == "failure" or name not in out:
                rule = "of what Recorded keeps: F, G, H and further numbers of the model"
                remedy = "evaluate the problem within for gradients and other values"
                raise invalid("return_values_of", rule, name, remedy)
        if "test_point" not in return_values_of:
            del out["test_point"]
        if self.tolerates_failures:
            return dict(self.wrapped.tolerated(X, out, return_values_of))
        for x, reason in zip(X, out.pop("failure"), strict=True):
            if reason:
                raise EvaluationError(x, reason)
        return self.formatted(X, out, return_values_of)

    def _values_of(self, designs: Designs) -> list[Values]:
        """Return the values of each design, and its number; new designs are evaluated first."""
        keys = self._model.keys(designs)
        known = self._known(keys)
        if not known.keys() >= {*keys}:
            # The inner context has the lock, which is given back before the process ends.
            with stored_at_termination(self._store), self._store.writing():
                # another process may have stored some before this one got the lock
                known = self._known(keys)
                missing = {key: row for row, key in enumerate(keys) if key not in known}
                if missing:
                    self._evaluate(designs[[*missing.values()]])
                    known = self._known(keys, retries=False)
        return [known[key] for key in keys]

    def _known(self, keys: Sequence[str], *, retries: bool = True) -> dict[str, Values]:
        """Return what the study has of designs by their keys: the values and ``test_point``.

        Args:
            keys: The keys.
            retries: Whether tests that are to be retried are left out.
        """
        store = self._store
        with store.study.reading() as database:
            numbers = database.find(keys)
            if not numbers.any():
                return {}
            columns = database.tests_with(numbers)
        columns = store.without_unmade(columns)
        tests = store.table(columns, TEST)
        left_out: set[int] = set()
        if retries:
            left_out = {*tests.numbers[store.are_retried(tests, columns)].tolist()} - self.returned
        values = dict(zip(tests.numbers.tolist(), self._model.values(tests), strict=True))
        known = {}
        for key, number in zip(keys, numbers.tolist(), strict=True):
            if number in values and number not in left_out:
                known[key] = values[number] | {"test_point": number}
        return known

    def _evaluate(self, designs: Designs) -> None:
        """Test designs as the next points; what arrives is stored within a second."""
        with self._store.study.reading() as database:
            first = database.last_point(self._store.run) + 1
        points = Points(first + np.arange(len(designs)), 0, designs=designs)
        run = Run(self._model, PlannedPoints(points), self._executor, self._store)
        tests = run.block(len(points))
        self._evaluated += tests.numbers.tolist()[: run.n_called]
        if len(tests) < len(points):
            raise KeyboardInterrupt("stopped as asked in the study; run it again to continue")
