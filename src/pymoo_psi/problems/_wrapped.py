"""Wrappers of problems: what they share, and those whose values come from the wrapped problem."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from pymoo.core.problem import Problem

from pymoo_psi._validation import Received, Values, invalid
from pymoo_psi.errors import PsiError
from pymoo_psi.problems._pymoo import (
    for_individuals,
    leave_failed_out,
    problem_name,
    require_inequalities,
)

Evaluate = Callable[[Any], Values]


class Wrapper(Problem):
    """A problem around another one, which evaluates designs by ``do`` or ``_evaluate`` as in pymoo.

    Otherwise it is as :class:`WrappedProblem` describes. The rest of the package knows no classes
    of wrappers: it asks for the attributes there and below, and for ``fingerprint()``.

    Attributes:
        gives_reasons: Whether ``out["failure"]`` has the reasons of failures, empty where there is
            none.
    """

    same_front = False
    same_columns = False
    gives_reasons = False

    def __init__(self, problem: Any, **changed: Any) -> None:
        self.wrapped = problem
        # without replace_nan_values_by: pymoo would look for NaN in the reasons of failures, too
        same = ["n_obj", "n_ieq_constr", "n_eq_constr", "elementwise", "elementwise_runner"]
        variables = ["n_var", "xl", "xu", "vtype"]
        if getattr(problem, "vars", None):
            variables = ["vars"]
        for name in (*same, "requires_kwargs", *variables):
            changed.setdefault(name, getattr(problem, name))
        super().__init__(**changed)
        self.data: Any = problem.data  # pymoo's further arguments, or what the model has called so

    def __getattr__(self, name: str) -> Any:
        """Return an attribute that only the wrapped problem has, for repairs and operators."""
        # While it is unpickled there is no wrapped problem yet, and the search would not end.
        if name.startswith("_") or "wrapped" not in self.__dict__:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self.wrapped, name)

    def untolerant(self) -> Any:
        """Return the problem without :class:`FailureTolerant`."""
        return self

    @property
    def elementwise_runner(self) -> Any:
        """The runner of the wrapped problem; assigning another one changes both."""
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

    def evaluate(self, X: Any, **kwargs: Any) -> Any:
        """Evaluate designs like pymoo's ``evaluate``, and keep failed ones out of the optimum."""
        algorithm = kwargs.get("algorithm")
        require_inequalities(algorithm)
        leave_failed_out(algorithm)
        return super().evaluate(X, **kwargs)

    def formatted(self, X: Any, out: Values, return_values_of: Any) -> Values:
        """Return values of designs as pymoo's ``do`` returns them."""
        out = dict.fromkeys(return_values_of) | for_individuals(out)
        return dict(self._format_dict(out, len(X), return_values_of))

    def _calc_pareto_front(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_front(*args, **kwargs) if self.same_front else None

    def _calc_pareto_set(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_set(*args, **kwargs) if self.same_front else None


class WrappedProblem(Wrapper):
    """A problem whose values come from those of another one; the base class of new wrappers.

    It has the wrapped problem's sizes, variables, bounds, runner and name. Attributes that it does
    not have, such as ``names``, ``units``, ``maximize`` and ``log``, are the wrapped problem's. A
    new wrapper overrides what differs:

    - ``designs_within(X)`` if the wrapped problem takes other designs. If variables differ in more
      than their values, an attribute ``space`` is the :class:`DesignSpace` of a table's columns.
      It wraps ``Required(problem)``, so that requirements of the problem hold for its own designs.
    - ``values_from(X, evaluate)`` if values differ, or if some designs are not evaluated.
    - ``fingerprint()`` if values depend on arguments of the wrapper: a study compares them.

    Args:
        problem: The other problem.
        **changed: Arguments of pymoo's ``Problem`` in which the two differ.

    Attributes:
        wrapped: The other problem.
        same_front: Whether the Pareto front and set are those of the wrapped problem; by default
            they are unknown.
        same_columns: Whether variables, objectives and outputs in a table are the wrapped
            problem's, so that expressions between them hold, too.

    Raises:
        ArgumentValueError: The other problem is :class:`FailureTolerant`, or the wrapper evaluates
            designs by ``do`` or ``_evaluate``, which a table would not call.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> class Priced(WrappedProblem):
        ...     def values_from(self, X, evaluate):
        ...         values = evaluate(X)
        ...         return values | {"F": values["F"] * 3}
        >>> chute = VectorizedSphereChute(0.4)
        >>> bool((investigate(Priced(chute), 64).F == investigate(chute, 64).F * 3).all())
        True
    """

    def __init__(self, problem: Any, **changed: Any) -> None:
        kind = type(self)
        outer = type(problem).__name__
        if untolerant(problem) is not problem:
            rule = "without FailureTolerant, whose failed designs have values"
            raise invalid("problem", rule, Received(outer), f"say {outer}({kind.__name__}(...))")
        if kind.do is not WrappedProblem.do or kind._evaluate is not Problem._evaluate:
            rule = "without do and _evaluate of its own"
            raise invalid(kind.__name__, rule, Received("one of them"), "override values_from")
        super().__init__(problem, **changed)

    def designs_within(self, X: Any) -> Any:
        """Return designs, or one, as the wrapped problem takes them."""
        return X

    def values_from(self, X: Any, evaluate: Evaluate) -> Values:
        """Return the values of designs from those of the wrapped problem.

        Args:
            X: n designs.
            evaluate: Returns the wrapped problem's values of designs by name: ``F`` ``(n, m)``,
                ``G``, ``H`` and others, like :func:`evaluate_designs` or pymoo's ``do``.
        """
        return evaluate(self.designs_within(X))

    def do(self, X: Any, return_values_of: Any, **kwargs: Any) -> Values:
        """Evaluate designs; pymoo calls this for every batch."""
        # its evaluate, as its do neither calls its callback nor replaces NaN
        kwargs |= {"return_values_of": ["F", "G", "H"], "return_as_dictionary": True}
        evaluate = partial(self.wrapped.evaluate, **kwargs)
        return self.formatted(X, self.values_from(X, evaluate), return_values_of)


def untolerant(problem: Any) -> Any:
    """Return a problem without the ``FailureTolerant`` around it, or in a ``Recorded``.

    Tables record failures themselves: there no constraint is to be added for them.
    """
    return problem.untolerant() if isinstance(problem, Wrapper) else problem


def layers(problem: Any) -> list[Any]:
    """Return a problem and those within it, the innermost last."""
    if not isinstance(problem, Wrapper):
        return [problem]
    return [problem, *layers(problem.wrapped)]


def require_model(problem: Any) -> None:
    """Refuse to evaluate a problem whose tests are made by people.

    Raises:
        PsiError: It is one.
    """
    if getattr(layers(problem)[-1], "by_people", False):
        raise PsiError(
            "people make the tests of this problem, as it has no [program]: ask for designs by "
            "'pymoo-psi ask FILE.toml --study FILE.db --out next.csv', and give the results by "
            "'pymoo-psi tell next.csv --study FILE.db'"
        )


def uses_wrapped_values(problem: Any) -> bool:
    """Whether a problem is a wrapper whose values come from those of the wrapped problem.

    Wrappers of pymoo, such as ``ConstraintsAsPenalty``, are of the class of the problem that they
    wrap, too, with a ``do`` of their own.
    """
    return isinstance(problem, WrappedProblem) and type(problem).do is WrappedProblem.do


def has_same_values(problem: Any) -> bool:
    """Whether a problem is a wrapper that has the wrapped problem's values for other designs."""
    if not uses_wrapped_values(problem):
        return False
    return type(problem).values_from is WrappedProblem.values_from


def within_same_columns(problem: Any) -> Any:
    """Return the innermost problem that has the columns of a problem, without wrappers of these."""
    while isinstance(problem, Wrapper) and problem.same_columns:
        problem = problem.wrapped
    return problem
