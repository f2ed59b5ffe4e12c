"""What problems that wrap another one have in common."""

from __future__ import annotations

from typing import Any

from pymoo.core.problem import Problem


class WrappedProblem(Problem):
    """A problem around another one: its sizes, variables, bounds, runner, name and attributes.

    Args:
        problem: The other problem.
        **changed: Arguments of pymoo's ``Problem`` in which the two differ.

    Attributes:
        wrapped: The other problem.
    """

    def __init__(self, problem: Any, **changed: Any) -> None:
        self.wrapped = problem
        same = (
            *("n_obj", "n_ieq_constr", "n_eq_constr", "vtype", "requires_kwargs", "strict"),
            *("elementwise", "elementwise_runner", "replace_nan_values_by"),
        )
        own = {name: getattr(problem, name) for name in same}
        super().__init__(**{**own, **problem.data, **changed})
        # pymoo's constructor would turn bounds into floats: they are taken over as they are.
        self.n_var, self.xl, self.xu = problem.n_var, problem.xl, problem.xu
        if hasattr(problem, "vars"):
            self.vars = problem.vars

    def __getattr__(self, name: str) -> Any:
        """Give what only the wrapped problem has, to repairs and operators that ask for it."""
        # While it is unpickled there is no wrapped problem yet, and the search would not end.
        if name.startswith("_") or "wrapped" not in self.__dict__:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self.wrapped, name)

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
        return str(self.wrapped.name())

    # A problem that has another front than the one within says so itself.

    def _calc_pareto_front(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_front(*args, **kwargs)

    def _calc_pareto_set(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_set(*args, **kwargs)
