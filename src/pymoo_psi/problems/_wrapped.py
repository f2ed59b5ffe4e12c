"""Problems around other problems: what a wrapper has to say, with a default for all of it."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any

from pymoo.core.problem import Problem

from pymoo_psi.problems._pymoo import problem_name

Evaluate = Callable[[Any], dict[str, Any]]


class WrappedProblem(Problem):
    """A problem around another one, and the protocol of all wrappers.

    A wrapper has the wrapped problem's sizes, variables, bounds, runner and name, and every
    attribute that is not found in itself, such as ``names``, ``units``, ``maximize`` and ``log``.
    A new one overrides what differs:

    - ``designs_within(X)``, if its designs are others for the wrapped problem. If its variables
      differ too, it has an attribute ``space``, the :class:`DesignSpace` of a table's columns.
    - ``values_from(X, evaluate)``, if its values are others, or some designs need no evaluation.
      They are values of ``evaluate_designs``: a design that failed has its reason as ``failure``.
    - ``do`` or ``_evaluate``, with ``do = Problem.do``, if it evaluates in its own way; the
      package then calls it as it calls a model.
    - ``fingerprint()``, if the values depend on arguments of its own: a study compares them.
    - ``around(problem)``, if a copy around another problem takes more than a new ``wrapped``.

    The rest of the package asks wrappers for nothing else and knows none of their classes.

    Args:
        problem: The other problem.
        **changed: Arguments of pymoo's ``Problem`` in which the two differ.

    Attributes:
        wrapped: The other problem.
        same_front: Whether the Pareto front and set are the wrapped problem's.
        checks_requirements: Whether it has ``amounts(matrix)``, by how much rows of a table
            violate requirements, and adds these to the constraints, without further effect on
            designs that meet them; and ``n_not_run``, a count of the others.
        tolerates_failures: Whether it has ``tolerated(X, out, names)``, which gives values to
            designs that failed.
    """

    same_front = True
    checks_requirements = False
    tolerates_failures = False

    def __init__(self, problem: Any, **changed: Any) -> None:
        self.wrapped = problem
        # without replace_nan_values_by: pymoo would look for NaN in the reasons of failures, too
        same = ["n_obj", "n_ieq_constr", "n_eq_constr", "elementwise", "elementwise_runner"]
        if getattr(problem, "vars", None):
            same += ["vars"]
        else:
            same += ["n_var", "xl", "xu", "vtype"]
        arguments = {name: getattr(problem, name) for name in [*same, "requires_kwargs"]}
        super().__init__(**{**arguments, **changed})
        self.data = problem.data  # pymoo's further arguments, or what the model has called so

    def __getattr__(self, name: str) -> Any:
        """Return an attribute that only the wrapped problem has, for repairs and operators."""
        # While it is unpickled there is no wrapped problem yet, and the search would not end.
        if name.startswith("_") or "wrapped" not in self.__dict__:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self.wrapped, name)

    def designs_within(self, X: Any) -> Any:
        """Return designs, or one, as the wrapped problem takes them."""
        return X

    def values_from(self, X: Any, evaluate: Evaluate) -> dict[str, Any]:
        """Return the values of n designs by name: ``F`` ``(n, m)``, ``G``, ``H`` and others.

        Args:
            X: The designs.
            evaluate: Returns the values of designs of the wrapped problem.
        """
        return evaluate(self.designs_within(X))

    def around(self, problem: Any) -> Any:
        """Return a copy of this wrapper around another problem, with the same variables."""
        other = copy.copy(self)
        other.wrapped = problem
        other.n_ieq_constr += problem.n_ieq_constr - self.wrapped.n_ieq_constr
        return other

    @property
    def known_expressions(self) -> Mapping[str, Any]:
        """Outputs that are expressions of a table's columns; see :func:`known_expressions`.

        A wrapper whose tables hold the wrapped problem's columns returns those of that problem.
        """
        return {}

    @property
    def elementwise_runner(self) -> Any:
        """What runs the evaluations: the wrapped problem's, also where it is changed here."""
        return self.wrapped.elementwise_runner

    @elementwise_runner.setter
    def elementwise_runner(self, runner: Any) -> None:
        self.wrapped.elementwise_runner = runner

    def name(self) -> str:
        """Return the name of the wrapped problem.

        Example:
            >>> from pymoo_psi import FailureTolerant, SphereChute
            >>> FailureTolerant(SphereChute()).name()
            'SphereChute'
        """
        return problem_name(self.wrapped)

    def do(self, X: Any, return_values_of: Any, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Evaluate designs; pymoo calls this from ``evaluate``."""

        def evaluate(designs: Any) -> dict[str, Any]:
            return dict(self.wrapped.do(designs, ["F", "G", "H"], *args, **kwargs))

        return self.formatted(X, self.values_from(X, evaluate), return_values_of)

    def formatted(self, X: Any, out: dict[str, Any], names: Any) -> dict[str, Any]:
        """Return values of designs as pymoo's ``do`` returns them."""
        out = dict.fromkeys(names) | out
        return dict(self._format_dict(out, len(X), names))

    def _calc_pareto_front(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_front(*args, **kwargs) if self.same_front else None

    def _calc_pareto_set(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_set(*args, **kwargs) if self.same_front else None


def layers(problem: Any) -> list[Any]:
    """Return a problem and those within it, the innermost last."""
    found = [problem]
    while isinstance(found[-1], WrappedProblem):
        found.append(found[-1].wrapped)
    return found


def uses_wrapped_values(problem: Any) -> bool:
    """Whether a problem is a wrapper whose values come from those of the wrapped problem."""
    return isinstance(problem, WrappedProblem) and type(problem).do is WrappedProblem.do


def changes_designs_only(problem: Any) -> bool:
    """Whether a problem is a wrapper that has the wrapped problem's values for other designs."""
    own = type(problem)
    return uses_wrapped_values(problem) and own.values_from is WrappedProblem.values_from


def checks_requirements(problem: Any) -> bool:
    """Whether a problem is a wrapper that checks requirements."""
    return isinstance(problem, WrappedProblem) and problem.checks_requirements


def tolerates_failures(problem: Any) -> bool:
    """Whether a problem is a wrapper that gives values to designs that failed."""
    return isinstance(problem, WrappedProblem) and problem.tolerates_failures


def known_expressions(problem: Any) -> Mapping[str, Any]:
    """Return the outputs of a problem that are expressions of other columns, by name.

    A problem that has some also has ``computed(columns)``, as :class:`ProgramProblem`.
    """
    expressions: Mapping[str, Any] = getattr(problem, "known_expressions", {})
    return expressions
