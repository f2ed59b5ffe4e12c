"""Objectives as statistics over scenarios: a problem whose optima are robust."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Mapping, Sequence
from numbers import Real
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_psi._validation import finite_number, integer, invalid, known_name, mapping, wrong_type
from pymoo_psi.pareto import competes, meets_constraints
from pymoo_psi.problems._design_space import design_space, given_names, own_parameters
from pymoo_psi.problems._evaluation import evaluate_designs
from pymoo_psi.problems._pymoo import problem_name, require_problem
from pymoo_psi.problems._wrapped import WrappedProblem
from pymoo_psi.sequences import lp_tau

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Designs in scenarios that are held at a time. A vectorised model is at its full speed long before,
# and ten objectives and variables of so many take 40 MB.
_AT_A_TIME = 2**18


class Robust(WrappedProblem):
    """Any pymoo problem with its objectives taken as statistics over scenarios.

    In each scenario the variables of a design differ from their nominal values within tolerances,
    and parameters of the problem have other values. Each objective of a design becomes a statistic
    over the scenarios, and all constraints together become one: the share of the scenarios in
    which any is violated is at most ``failure_probability``. PSI, NSGA-III or any other algorithm
    then searches for designs that are good by these statistics.

    The scenarios are LPτ points taken through quantile functions, the same for all designs, so
    that designs are compared under the same conditions and no chance is in the result. The first
    scenario is the one with all quantities at their medians. Designs are evaluated in all
    scenarios by as few calls as possible: a vectorised model stays fast, an elementwise one is run
    by its runner.

    A scenario in which the model fails, or an objective is not finite, counts as violated, and the
    statistics are of the others. Designs within tolerances of a bound are evaluated beyond it: if
    the model must not be, give :class:`~pymoo_psi.Restricted` bounds to this problem that leave
    a margin. What else a model gives is not kept.

    Args:
        problem: A pymoo problem of any kind; with ``uncertainty`` a function that is called with
            the uncertain parameters by name and returns one. Variables, bounds and names are those
            of the problem with the parameters at their medians.
        tolerances: For the names of real variables (x1, x2, … of a vector, or those of the
            problem's attribute ``names``) a number, by which the value may be larger or smaller,
            all values in between equally likely; or the distribution of what is added to the
            value, such as ``scipy.stats.norm(0, 0.01)``.
        uncertainty: For each parameter its distribution, as for :func:`pymoo_psi.robustness`. All
            tolerances and parameters are independent.
        n_scenarios: How many scenarios.
        criteria: ``"mean"``; ``"cvar:0.9"``, the mean of the worst tenth; or ``"worst"``, the worst
            of all. One text for all objectives or a list with one for each. They are of the
            minimised values, so that of an objective to be maximised the low ones are the bad ones.
        failure_probability: The share of scenarios in which a design may violate constraints, 0
            to below 1. It is known in steps of ``1 / n_scenarios``.

    Attributes:
        wrapped: The problem in the first scenario.
        offsets: ``(n_scenarios, t)`` what the t tolerances add.
        parameters: ``(n_scenarios, k)`` the values of the k parameters.
        problems: The problem of each scenario; of all of them if no parameter is uncertain.

    Raises:
        ArgumentValueError: There is no such variable or statistic, a number is out of range, or
            nothing is uncertain.
        ArgumentTypeError: ``problem`` is no pymoo problem or function, a variable with a tolerance
            is not real, or an argument is of another type.

    Example:
        A cliff beside the nominal optimum: with a tolerance the best design keeps away from it.

        >>> import numpy as np
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> from pymoo_psi import investigate
        >>> def cost(x):
        ...     return 1 - x[0] if x[0] <= 0.8 else 2.0
        >>> problem = FunctionalProblem(1, [cost], xl=0, xu=1)
        >>> within = {"x1": 0.1}
        >>> robust = Robust(problem, tolerances=within, criteria="worst", n_scenarios=31)
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
        ...     criteria="cvar:0.9",
        ... )
        >>> chute.evaluate(np.array([[0.26, 0.5]]))[0].round(3)
        array([[2.312, 0.031, 0.26 , 0.516]])
    """

    same_front = False
    do = Problem.do  # of scenarios, not of the wrapped problem's values

    def __init__(
        self,
        problem: Any,
        *,
        tolerances: Mapping[str, Any] | None = None,
        uncertainty: Mapping[str, Any] | None = None,
        n_scenarios: int = 64,
        criteria: str | Sequence[str] = "mean",
        failure_probability: float = 0.0,
    ) -> None:
        tolerances = mapping("tolerances", tolerances or {}, "names to tolerances")
        uncertainty = mapping("uncertainty", uncertainty or {}, "names to distributions")
        if not tolerances and not uncertainty:
            raise invalid("uncertainty or tolerances", "given", uncertainty)
        given = {f"tolerances[{n!r}]": _distribution(n, d) for n, d in tolerances.items()}
        given |= {f"uncertainty[{n!r}]": d for n, d in uncertainty.items()}
        values = _quantiles(integer("n_scenarios", n_scenarios, minimum=1), given)
        self.offsets, self.parameters = np.split(values, [len(tolerances)], axis=1)
        self.problems = _problems(problem, uncertainty, self.parameters.tolist())
        nominal = self.problems[0]
        self.space = design_space(nominal)
        self._columns = [self._column(name) for name in tolerances]
        self.criteria = [*criteria]
        if isinstance(criteria, str):
            self.criteria = [criteria] * nominal.n_obj
        self._shares = [_share(str(criterion)) for criterion in self.criteria]
        if len(self._shares) != nominal.n_obj:
            rule = f"one for all or each of {nominal.n_obj} objectives"
            raise invalid("criteria", rule, criteria)
        self.failure_probability = finite_number("failure_probability", failure_probability)
        if not 0 <= self.failure_probability < 1:
            raise invalid("failure_probability", "from 0 to below 1", self.failure_probability)
        super().__init__(nominal, n_ieq_constr=1, n_eq_constr=0, elementwise=False)
        # The wrapped problem's names, without those of constraints that there are no more.
        objectives = [f"f{j + 1}" for j in range(nominal.n_obj)]
        given = given_names(nominal, self.space)
        self.names = names = {v.name: v.title for v in self.space.variables}
        names |= {name: given.get(name, name) for name in objectives}
        units = getattr(nominal, "units", None) or {}
        self.units = {name: unit for name, unit in units.items() if name in names.values()}

    def _column(self, name: str) -> int:
        """Return the place of a variable with a tolerance."""
        titles = self.space.titles
        j = titles.index(known_name("a variable of tolerances", name, titles))
        if not self.space.variables[j].kind.real or self.space.variables[j].fixed:
            remedy = "to fix one, give Restricted(Robust(problem, ...), box)"
            raise invalid("tolerances", "of real variables that are not fixed", name, remedy)
        return j

    def name(self) -> str:
        """Return the name of the wrapped problem, and that it is robust.

        Example:
            >>> from pymoo_psi import SphereChute
            >>> Robust(SphereChute(), tolerances={"x1": 0.01}).name()
            'robust SphereChute'
        """
        return f"robust {problem_name(self.wrapped)}"

    def fingerprint(self) -> dict[str, Any]:
        """Return what a study of this problem depends on besides the problem's name and bounds.

        Example:
            >>> from pymoo_psi import SphereChute
            >>> Robust(SphereChute(), tolerances={"x1": 0.01}).fingerprint()["criteria"]
            ['mean', 'mean', 'mean', 'mean']
        """
        # One text for all numbers of the scenarios: these are many.
        numbers = hashlib.sha256(self.offsets.tobytes() + self.parameters.tobytes()).hexdigest()
        return {
            "wrapped": own_parameters(self.wrapped),
            "tolerances": [self.space.names[j] for j in self._columns],
            "scenarios": f"{len(self.offsets)} {numbers[:16]}",
            "criteria": self.criteria,
            "failure_probability": self.failure_probability,
        }

    def _evaluate(self, X: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        designs = self.space.to_matrix(X)
        size = max(1, _AT_A_TIME // len(self.offsets))
        starts = range(0, len(designs), size)
        parts = [self._statistics(designs[i : i + size], args, kwargs) for i in starts]
        F, violated = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        out["F"], out["G"] = F, (violated - self.failure_probability)[:, None]

    def in_scenarios(
        self, designs: NDArray[Any], *args: Any, **kwargs: Any
    ) -> tuple[Array, Mask, NDArray[Any]]:
        """Evaluate the n rows of a test table's designs in all S scenarios.

        Returns:
            ``(S, n, m)`` their objectives; ``(S, n)`` which are feasible with finite objectives,
            and ``(S, n)`` why others failed, empty for those that did not.
        """
        moved = np.repeat(designs[None], len(self.offsets), axis=0)
        if self._columns:  # of whole numbers, an array would cut off what is added
            moved = moved.astype(np.result_type(designs, np.float64))
            values = designs[:, self._columns].astype(np.float64)
            moved[..., self._columns] = values + self.offsets[:, None]
        if len(self.problems) == 1:  # the same in all scenarios: it is called once for all
            moved = moved.reshape(1, -1, designs.shape[1])
        found = []
        for problem, rows in zip(self.problems, moved, strict=True):
            problem.elementwise_runner = self.wrapped.elementwise_runner
            out = evaluate_designs(problem, self.space.designs(rows), *args, **kwargs)
            feasible = meets_constraints(out["G"], out["H"]) & (out["failure"] == "")
            found.append((out["F"], competes(out["F"], feasible), out["failure"]))
        F, valid, reasons = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
        size = len(self.offsets), len(designs)
        return F.reshape(*size, -1), valid.reshape(size), reasons.reshape(size)

    def _statistics(self, designs: NDArray[Any], args: Any, kwargs: Any) -> tuple[Array, Array]:
        """Return ``(n, m)`` statistics, and in what share of scenarios constraints are violated."""
        F, valid, _ = self.in_scenarios(designs, *args, **kwargs)
        finite = np.isfinite(F).all(axis=2)
        F[~finite] = np.inf  # last in order, where it is not counted
        F.sort(axis=0)
        counts = finite.sum(axis=0)
        columns = [mean_of_worst(s, F[..., j], counts) for j, s in enumerate(self._shares)]
        # Not 1 - valid.mean(), which is above 0.3 where 3 of 10 are violated.
        return np.column_stack(columns), (~valid).mean(axis=0)


@np.errstate(over="ignore", invalid="ignore")  # a design that is valid in no scenario
def mean_of_worst(share: float, ordered: Array, counts: NDArray[np.intp]) -> Array:
    """Return the mean of the worst scenarios, all of them equally likely.

    Args:
        share: Which share of them counts; at least one does.
        ordered: ``(s, n)`` the values of n designs, increasing along the scenarios.
        counts: ``(n,)`` how many of them are valid; infinite for a design without any.
    """
    from_worst = np.maximum(counts, 1) - 1 - np.arange(len(ordered))[:, None]
    # part of a scenario counts for that part
    weights = np.clip(np.maximum(share * counts, 1.0) - from_worst, 0.0, 1.0) * (from_worst >= 0)
    value = (weights * np.where(weights > 0, ordered, 0.0)).sum(axis=0) / weights.sum(axis=0)
    return np.where(counts > 0, value, np.inf)


def _distribution(name: str, given: Any) -> Any:
    """Return a tolerance as a distribution; a number stands for the uniform one to both sides."""
    if not isinstance(given, Real):
        return given
    half = finite_number(f"tolerances[{name!r}]", given)
    return SimpleNamespace(ppf=lambda q: half * (2 * q - 1))


def _share(criterion: str) -> float:
    """Return the share of the worst scenarios that a criterion is the mean of."""
    if not re.fullmatch(r"mean|worst|cvar:0?\.\d+", criterion):
        raise invalid("criteria", "'mean', 'worst' or 'cvar:q' with 0 < q < 1", criterion)
    named = {"mean": 1.0, "worst": 0.0}
    return named[criterion] if criterion in named else 1 - float(criterion.removeprefix("cvar:"))


def _quantiles(n_scenarios: int, distributions: Mapping[str, Any]) -> Array:
    """Return ``(n_scenarios, k)`` quasi-random values of k independent uncertain quantities.

    They are LPτ points taken through the quantile functions. The first point is the centre, with
    all quantities at their medians: the origin has no quantile under an unbounded distribution.
    """
    values = lp_tau(n_scenarios, len(distributions), first=2)
    for j, (name, distribution) in enumerate(distributions.items()):
        # SciPy has both names: ppf of its old distributions, icdf of its new ones.
        quantile = getattr(distribution, "ppf", getattr(distribution, "icdf", None))
        if quantile is None:
            rule = "a distribution such as scipy.stats.uniform(0.3, 0.2)"
            raise wrong_type(name, rule, distribution)
        values[:, j] = quantile(values[:, j])
        if not np.isfinite(values[:, j]).all():
            raise invalid(name, "a distribution with finite quantiles", values[:, j])
    return values


def _problems(problem: Any, names: Collection[str], rows: list[list[float]]) -> list[Any]:
    """Return the problem of each scenario, or the one of all if no parameter is uncertain."""
    if names and not callable(problem):
        rule = f"a function of {', '.join(names)} that returns a pymoo problem"
        raise wrong_type("problem", rule, problem)
    problems = [problem(**dict(zip(names, row, strict=True))) for row in rows if names] or [problem]
    for each in problems:
        require_problem(each, names)
    return problems
