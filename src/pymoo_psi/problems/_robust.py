"""Problems with statistics over scenarios as objectives, whose optima are robust."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection
from numbers import Real
from typing import Any

import numpy as np

from pymoo_psi._validation import (
    AnyArray,
    Array,
    Entries,
    Mask,
    Names,
    Rows,
    Values,
    finite_array,
    finite_number,
    integer,
    invalid,
    known_name,
    wrong_type,
)
from pymoo_psi.pareto import competes, meets_constraints
from pymoo_psi.problems._design_space import DesignSpace, design_space
from pymoo_psi.problems._evaluation import evaluate_designs
from pymoo_psi.problems._model import problem_schema
from pymoo_psi.problems._pymoo import numbered, problem_name, require_problem
from pymoo_psi.problems._requirements import requirement_texts, with_requirements
from pymoo_psi.problems._wrapped import Wrapper, untolerant
from pymoo_psi.sequences import lp_tau


class Robust(Wrapper):
    """Any pymoo problem, with statistics over scenarios as its objectives.

    In each scenario the variables of a design differ from their nominal values within tolerances,
    and parameters of the problem have other values. Each objective becomes a statistic over the
    scenarios. All constraints together become one: the share of scenarios that violate any is at
    most ``failure_probability``. PSI, NSGA-III or any other algorithm then optimises these
    statistics.

    The scenarios are LPτ points mapped by quantile functions. They are the same for all designs, so
    that results are comparable and repeatable. In the first scenario all quantities have their
    medians. Designs are evaluated in all scenarios by as few calls as possible: a vectorised model
    stays fast, and an elementwise one uses its runner.

    A scenario in which the model fails, or an objective is not finite, counts as violated; the
    statistics are those of the other scenarios. A design that fails in all of them has failed. The
    requirements of the problem hold in every scenario; those given to PSI, or to a
    :class:`Required` around this problem, hold for the designs themselves. Designs near a bound are
    evaluated beyond it, within the tolerances. If the model does not allow this, narrow the bounds
    by :class:`~pymoo_psi.Restricted`. Further outputs of a model are not kept.

    Args:
        problem: A pymoo problem of any kind; with ``uncertainty`` a function that is called with
            the uncertain parameters by name and returns one. Variables, bounds and names are those
            of the problem with the parameters at their medians.
        tolerances: For the names of real variables (x1, x2, … of a vector, or those of the
            problem's attribute ``names``) a number, by which the value may be larger or smaller,
            with a uniform distribution; or the distribution of the deviation from the value, such
            as ``scipy.stats.norm(0, 0.01)``.
        uncertainty: For each parameter its distribution, as for :func:`pymoo_psi.robustness`. All
            tolerances and parameters are independent.
        n_scenarios: How many scenarios.
        statistics: ``"mean"``; ``"cvar:0.9"``, the mean of the worst tenth; or ``"worst"``, the
            worst of all. One text for all objectives or a list with one for each. They apply to the
            minimised values, so that low values of an objective to be maximised are the bad ones.
        failure_probability: The share of scenarios in which a design may violate constraints, 0
            to below 1. It is known in steps of ``1 / n_scenarios``.

    Attributes:
        wrapped: The problem in the first scenario.
        offsets: ``(n_scenarios, t)`` deviations within the t tolerances.
        parameters: ``(n_scenarios, k)`` the values of the k parameters.
        problems: The problem of each scenario; a single one if no parameter is uncertain.

    Raises:
        ArgumentValueError: There is no such variable or statistic, a variable with a tolerance is
            not real, a number is out of range, or nothing is uncertain.
        ArgumentTypeError: ``problem`` is no pymoo problem, or no function of what is uncertain, or
            a number or a distribution has the wrong type.

    Example:
        A cliff beside the nominal optimum: with a tolerance the best design keeps away from it.

        >>> import numpy as np
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from pymoo_psi import investigate
        >>> def cost(x):
        ...     return 1 - x[0] if x[0] <= 0.8 else 2.0
        >>> problem = FunctionalProblem(1, [cost], xl=0, xu=1)
        >>> within = {"x1": 0.1}
        >>> robust = Robust(problem, tolerances=within, statistics="worst", n_scenarios=31)
        >>> for p in (problem, robust):
        ...     table = investigate(p, 128)
        ...     print(table.X[table.F.argmin()].round(2))
        [0.8]
        [0.7]

        Parameters of the chute that are not known exactly, and a speed that is not kept exactly:

        >>> from scipy.stats import norm, uniform
        >>> from pymoo_psi import VectorizedSphereChute
        >>> chute = Robust(
        ...     lambda mu: VectorizedSphereChute(mu),
        ...     tolerances={"x2": norm(0, 0.01)},
        ...     uncertainty={"mu": uniform(0.35, 0.1)},
        ...     statistics="cvar:0.9",
        ... )
        >>> chute.evaluate(np.array([[0.26, 0.5]]))[0].round(3)
        array([[2.312, 0.031, 0.26 , 0.516]])
    """

    has_named_outputs = False
    gives_reasons = True
    offsets: Array
    parameters: Array

    def __init__(
        self,
        problem: Any,
        *,
        tolerances: Entries | None = None,
        uncertainty: Entries | None = None,
        n_scenarios: int = 64,
        statistics: str | Names = "mean",
        failure_probability: float = 0.0,
    ) -> None:
        tolerances = tolerances or {}
        uncertainty = uncertainty or {}
        if not tolerances and not uncertainty:
            raise invalid("uncertainty or tolerances", "given", uncertainty)
        scenarios = _scenarios(n_scenarios, tolerances, uncertainty)
        self.offsets, self.parameters = np.split(scenarios, [len(tolerances)], axis=1)
        self.problems: list[Any] = _problems(problem, uncertainty, self.parameters.tolist())
        nominal = self.problems[0]
        self.space: DesignSpace = design_space(nominal)
        self._columns = [_column(self.space, title) for title in tolerances]
        self.statistics: list[str] = np.broadcast_to(statistics, nominal.n_obj).tolist()
        self._shares = [_share(str(statistic)) for statistic in self.statistics]
        self.failure_probability = finite_number("failure_probability", failure_probability)
        if not 0 <= self.failure_probability < 1:
            raise invalid("failure_probability", "from 0 to below 1", self.failure_probability)
        super().__init__(nominal, n_ieq_constr=1, n_eq_constr=0, elementwise=False)
        # Names and units are those of the variables and objectives of the problem.
        schema = problem_schema(nominal, self.space)
        self._constraints = schema.constraints
        schema = schema.without((*schema.constraints, *schema.outputs))
        self.names = dict(zip(self.space.variable_names, schema.variables, strict=True))
        self.names |= numbered("f", schema.objectives)
        self.units = schema.units

    def name(self) -> str:
        """Return the name of the wrapped problem, marked as robust.

        Example:
            >>> from pymoo_psi import SphereChute
            >>> Robust(SphereChute(), tolerances={"x1": 0.01}).name()
            'robust SphereChute'
        """
        return f"robust {problem_name(self.wrapped)}"

    def fingerprint(self) -> Values:
        """Return what a study of this problem depends on besides the wrapped problem and bounds.

        Example:
            >>> from pymoo_psi import SphereChute
            >>> Robust(SphereChute(), tolerances={"x1": 0.01}).fingerprint()["statistics"]
            ['mean', 'mean', 'mean', 'mean']
        """
        # a hash, as scenarios have many numbers
        numbers = hashlib.sha256(self.offsets.tobytes() + self.parameters.tobytes()).hexdigest()
        names = self.space.variable_names
        return {
            "tolerances": [names[j] for j in self._columns],
            "scenarios": f"{len(self.offsets)} {numbers[:16]}",
            "statistics": self.statistics,
            "failure_probability": self.failure_probability,
            "requirements": requirement_texts(self.wrapped),
            "constraints": [*self._constraints],  # those of a program say their limits
        }

    def _evaluate(self, X: Any, out: Values, **kwargs: Any) -> None:
        F, valid, failure = self.in_scenarios(self.space.to_matrix(X), **kwargs)
        out["failure"] = np.where((failure == "").any(axis=0), "", failure[0])
        out["F"] = self._statistics(F)
        # not 1 - valid.mean(), which is above 0.3 where 3 of 10 are violated
        out["G"] = (~valid).mean(axis=0)[:, None] - self.failure_probability

    def in_scenarios(self, designs: AnyArray, **kwargs: Any) -> tuple[Array, Mask, AnyArray]:
        """Evaluate n designs, given as rows of a test table, in all S scenarios.

        Returns:
            ``(S, n, m)`` objectives; ``(S, n)`` whether a design is feasible with finite
            objectives; and ``(S, n)`` reasons of failures, empty where a design did not fail.
        """
        moved = np.repeat(designs[None], len(self.offsets), axis=0)
        if self._columns:  # an array of whole numbers would cut off the offsets
            moved = moved.astype(np.result_type(designs, np.float64))
            moved[..., self._columns] += self.offsets[:, None]
        if len(self.problems) == 1:  # the same in all scenarios: it is called once for all
            moved = moved.reshape(1, -1, designs.shape[1])
        parts = []
        for problem, rows in zip(self.problems, moved, strict=True):
            problem.elementwise_runner = self.wrapped.elementwise_runner
            # what FailureTolerant gives a failed design does not count
            out = evaluate_designs(untolerant(problem), self.space.designs(rows), **kwargs)
            parts.append([out[name] for name in ("F", "G", "H", "failure")])
        F, G, H, failure = map(np.concatenate, zip(*parts, strict=True))
        valid = competes(F, meets_constraints(G, H) & (failure == ""))
        size = (len(self.offsets), len(designs))
        return F.reshape(*size, -1), valid.reshape(size), failure.reshape(size)

    def _statistics(self, F: Array) -> Array:
        """Return ``(n, m)`` statistics of ``(S, n, m)`` objectives, which are changed."""
        finite = np.isfinite(F).all(axis=2)
        F[~finite] = np.inf  # such a scenario is last in order and is not counted
        F.sort(axis=0)
        counts = finite.sum(axis=0)
        columns = [mean_of_worst(share, F[..., j], counts) for j, share in enumerate(self._shares)]
        return np.column_stack(columns)


@np.errstate(over="ignore", invalid="ignore")  # a design may be valid in no scenario
def mean_of_worst(share: float, ordered: Array, counts: Rows) -> Array:
    """Return the mean of the worst scenarios, all of them equally likely.

    Args:
        share: The share of them that counts; at least one does.
        ordered: ``(s, n)`` the values of n designs, increasing along the scenarios.
        counts: ``(n,)`` numbers of valid scenarios; the result is infinite where there are none.
    """
    from_worst = np.maximum(counts, 1) - 1 - np.arange(len(ordered))[:, None]
    # the last scenario counts in part
    weights = np.clip(np.maximum(share * counts, 1.0) - from_worst, 0.0, 1.0)
    weights = weights * (from_worst >= 0)
    values = np.where(weights > 0, ordered, 0.0)
    mean = (weights * values).sum(axis=0) / weights.sum(axis=0)
    return np.where(counts > 0, mean, np.inf)


def _column(space: DesignSpace, title: str) -> int:
    """Return the column of a variable with a tolerance."""
    known_name("a variable of tolerances", title, space.titles)
    j = space.titles.index(title)
    variable = space.variables[j]
    is_in_equality = any(row[j] for row in space.equalities)  # which no scenario would meet
    if variable.fixed or not variable.kind.real or is_in_equality:
        raise invalid(
            "tolerances",
            "of real variables that are neither fixed nor in an equality",
            title,
            "fix it or give the rule outside, as Required(Robust(problem, ...), rule)",
        )
    return j


def _share(statistic: str) -> float:
    """Return the share of the scenarios, from the worst one, whose mean is the statistic."""
    if statistic == "mean":
        return 1.0
    if statistic == "worst":
        return 0.0
    if not re.fullmatch(r"cvar:0?\.\d*[1-9]\d*", statistic):
        raise invalid("statistics", "'mean', 'worst' or 'cvar:q' with 0 < q < 1", statistic)
    return 1 - float(statistic.removeprefix("cvar:"))


def _scenarios(n_scenarios: int, tolerances: Entries, uncertainty: Entries) -> Array:
    """Return ``(n_scenarios, k)`` quasi-random values of k independent uncertain quantities.

    They are LPτ points mapped by the quantile functions. The first point is the centre, with all
    quantities at their medians: an unbounded distribution has no quantile at the origin.
    """
    integer("n_scenarios", n_scenarios, minimum=1)
    scenarios = lp_tau(n_scenarios, len(tolerances) + len(uncertainty), first=2)
    for column, (title, tolerance) in zip(scenarios.T, tolerances.items(), strict=False):
        argument = f"tolerances[{title!r}]"
        if isinstance(tolerance, Real):
            column[:] = finite_number(argument, tolerance) * (2 * column - 1)
        else:
            column[:] = _quantiles(argument, tolerance, column)
    uncertain = scenarios.T[len(tolerances) :]
    for column, (parameter, distribution) in zip(uncertain, uncertainty.items(), strict=True):
        column[:] = _quantiles(f"uncertainty[{parameter!r}]", distribution, column)
    return scenarios


def _quantiles(argument: str, distribution: Any, probabilities: Array) -> Array:
    """Return the quantiles of a distribution of SciPy, finite ones."""
    # SciPy has both names: ppf for its old distributions, icdf for its new ones
    quantile = getattr(distribution, "ppf", getattr(distribution, "icdf", None))
    if quantile is None:
        raise wrong_type(
            argument, "a distribution such as scipy.stats.uniform(0.3, 0.2)", distribution
        )
    return finite_array(argument, quantile(probabilities))  # NaN for a scale of 0 or below


def _problems(problem: Any, parameters: Collection[str], rows: list[list[float]]) -> list[Any]:
    """Return the problem of each scenario, or a single one if no parameter is uncertain."""
    if not parameters:
        require_problem(problem)
        return [with_requirements(problem)]
    if not callable(problem):
        raise wrong_type(
            "problem",
            f"a function of {', '.join(parameters)} that returns a pymoo problem",
            problem,
        )
    problems = []
    for row in rows:
        of_row = problem(**dict(zip(parameters, row, strict=True)))
        require_problem(of_row)
        for name in parameters:
            # pymoo puts keywords that it does not know there: a misspelt one would change nothing.
            if isinstance(of_row.data, dict) and name in of_row.data:
                raise invalid(
                    "uncertainty",
                    f"of parameters that {type(of_row).__name__} takes",
                    name,
                    "pymoo only keeps it; name an argument so, or correct the name",
                )
        problems.append(with_requirements(of_row))
    return problems
