"""Problems with other variables for the same model: a part of the bounds, logarithms."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pymoo.core.variable import Binary, Choice, Integer, Real

from pymoo_psi._kinds import Kind, option_text
from pymoo_psi._validation import (
    AnyArray,
    Entries,
    Names,
    Received,
    Values,
    boolean,
    finite_number,
    invalid,
    known_names,
    real_array,
)
from pymoo_psi.problems._design_space import DesignSpace, Variable, design_space
from pymoo_psi.problems._pymoo import column_titles, require_problem
from pymoo_psi.problems._requirements import with_requirements
from pymoo_psi.problems._wrapped import WrappedProblem

_ROUNDING = 1e-12  # the relative error of 10**log10(x)


class Transformed(WrappedProblem):
    """A problem with other variables for the model of another one.

    Args:
        problem: The other problem.
        space: Its variables.
        variables: Those here, in the same order.
    """

    def __init__(self, problem: Any, space: DesignSpace, variables: Iterable[Variable]) -> None:
        self._space_within = space
        self.space = replace(space, variables=tuple(variables))
        free = self.space.free
        changed: Values = {"n_var": len(free.variables)}
        if space.named:
            changed = {"vars": {v.name: _pymoo_variable(v) for v in free.variables}}
        elif problem.xl is not None:  # binary variables have no bounds
            changed |= {"xl": free.lower, "xu": free.upper}
        super().__init__(problem, **changed)

    def original(self, X: Any) -> Any:
        """Return designs, or one, as the wrapped problem takes them."""
        if self._is_single(X):
            return self.original([X])[0]
        matrix = self._values_within(self.space.to_matrix(X))
        return self._space_within.designs(matrix)

    designs_within = original

    def _is_single(self, X: Any) -> bool:
        return isinstance(X, Mapping) or (not self.space.named and np.ndim(X) == 1)

    def _values_within(self, matrix: AnyArray) -> AnyArray:
        """Return the wrapped problem's values of variables for a matrix of values here."""
        return matrix


class LogScaled(Transformed):
    """Any pymoo problem, with common logarithms in place of its logarithmic variables.

    Use it for algorithms of pymoo, which search evenly between bounds. PSI, ``SurrogatePSI``,
    ``investigate``, samplings and ``nsga3`` do not need it. Requirements of the problem hold for
    the values themselves, not for their logarithms. In a table or study, a variable ``area`` is the
    column ``log10 area``, without its unit.

    Args:
        problem: A pymoo problem.
        log: Names of variables whose bounds are above 0; those of the problem's attribute ``log``
            unless given.

    Raises:
        ArgumentValueError: There is no such variable, it is not real, or its bounds are not above
            0.
        ArgumentTypeError: ``problem`` is no pymoo problem.

    Example:
        >>> from pymoo.problems.functional import FunctionalProblem
        >>> import numpy as np
        >>> wide = FunctionalProblem(1, [lambda x: x[0], lambda x: 1 / x[0]], xl=1e-5, xu=1e5)
        >>> problem = LogScaled(wide, ["x1"])
        >>> problem.bounds(), problem.original(np.array([[2.0]])), problem.scaled(np.array([10.0]))
        ((array([-5.]), array([5.])), array([[100.]]), array([1.]))
    """

    def __init__(self, problem: Any, log: Collection[str] | None = None) -> None:
        require_problem(problem)
        problem = with_requirements(problem)
        space = design_space(problem, log=log)
        variables = [*space.variables]
        self.names = column_titles(problem)
        self.units = {**(getattr(problem, "units", None) or {})}
        self._log: dict[int, Variable] = {}
        for j, variable in enumerate(space.variables):
            if variable.kind is Kind.LOG and not variable.fixed:
                self._log[j] = variable
                lower = np.log10(variable.lower)
                upper = np.log10(variable.upper)
                variables[j] = replace(variable, kind=Kind.REAL, lower=lower, upper=upper)
                self.names[variable.name] = f"log10 {variable.title}"
                for name in (variable.name, variable.title):
                    self.units.pop(name, None)
        self.logarithms = [variable.title for variable in self._log.values()]
        self.log: Collection[str] = ()  # for other wrappers, these variables are plain ones
        super().__init__(problem, space, variables)

    def scaled(self, X: Any) -> Any:
        """Return designs of the wrapped problem, or one, as they are here.

        It is the inverse of :meth:`original` within the bounds; a value outside becomes the nearest
        bound.
        """
        if self._is_single(X):
            return self.scaled([X])[0]
        columns = [*self._space_within.to_matrix(X).T]
        for j, variable in self._log.items():
            values = columns[j].astype(np.float64)
            columns[j] = np.log10(np.clip(values, variable.lower, variable.upper))
        return self.space.designs(np.column_stack(columns))

    def _values_within(self, matrix: AnyArray) -> AnyArray:
        columns = [*matrix.T]
        for j, variable in self._log.items():
            values = 10.0 ** columns[j].astype(np.float64)
            inner = np.clip(values, variable.lower, variable.upper)
            # A bound is rounded on its way; a scenario of Robust may lie outside the bounds.
            columns[j] = np.where(np.isclose(values, inner, rtol=_ROUNDING, atol=0), inner, values)
        return np.column_stack(columns)


class Restricted(Transformed):
    """Any pymoo problem in a part of its bounds: variables between narrower bounds, or fixed.

    A variable whose bounds are equal in the problem itself is fixed, too.

    Objectives and constraints of a design are bit-identical to those of the whole problem. An
    algorithm searches the free variables only, and ``res.X`` contains only these; :meth:`original`
    adds the fixed ones. In the table of PSI and ``investigate`` every variable keeps its column and
    name, so that one table can hold tests of several parts and of the whole. A fixed variable uses
    no dimension of the test points.

    Constraints, runner, callback, name and all other attributes are those of the wrapped problem.
    Gradients and the known Pareto front are not, because they belong to the whole problem.

    Args:
        problem: A pymoo problem with finite bounds, elementwise or not, with variables of any
            kind; it may be restricted already.
        bounds: For names of variables (x1, x2, … of a vector, or those of the problem's attribute
            ``names``): a tuple ``(lower, upper)``, in which ``None`` keeps the problem's bound; or
            a value, at which the variable is fixed; or, for a choice, a list of the options to
            keep. Other variables are unchanged. Instead of a mapping, the two arrays that
            :meth:`~pymoo_psi.TestTable.refined_bounds` of the problem's table returns.

    Attributes:
        wrapped: The problem.

    Raises:
        ArgumentValueError: There is no such variable, a bound or value lies outside the problem's
            bounds, or no variable is left free.
        ArgumentTypeError: ``problem`` is no pymoo problem, or a bound or value has a type that the
            variable cannot have.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> chute = VectorizedSphereChute(0.4)
        >>> limits = {"f1": 2.2, "f2": 0.2}
        >>> bounds = investigate(chute, 256).under(limits=limits).refined_bounds()
        >>> bounds[0].round(2), bounds[1].round(2)
        (array([0.31, 0.12]), array([1.39, 5.95]))
        >>> part = investigate(Restricted(chute, bounds), 256)

        A fixed variable in a table:

        >>> slope = Restricted(chute, {"x1": 0.5})
        >>> slope.n_var, investigate(slope, 3).X
        (1, array([[0.5  , 0.1  ],
               [0.5  , 3.05 ],
               [0.5  , 1.575]]))

        The eight most important of many variables, with the others fixed at the best design so
        far; the next eight would follow, and so on:

        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi.analysis import sensitivities
        >>> many = get_problem("zdt2", n_var=60)
        >>> table = investigate(many, 256)
        >>> shares = sensitivities(table)["first_order"]
        >>> free = shares.groupby(level="variable").max().nlargest(8).index
        >>> best = table.X[table.pareto()][table.ranking().salukvadze[0]].tolist()
        >>> values = zip(table.schema.variables, best, strict=True)
        >>> Restricted(many, {name: x for name, x in values if name not in free}).n_var
        8
    """

    same_columns = True

    def __init__(self, problem: Any, bounds: Entries | Sequence[Any]) -> None:
        require_problem(problem)
        space = design_space(problem)
        parts = _parts_by_title(bounds, space.titles)
        variables = []
        for variable in space.variables:
            title = variable.title
            if title in parts:
                variable = _part(variable, f"{title} of bounds", parts[title])
            variables.append(replace(variable, fixed=variable.lower == variable.upper))
        if all(variable.fixed for variable in variables):
            raise invalid("bounds", "such that a variable is free", Received("all of them fixed"))
        super().__init__(problem, space, variables)


def _parts_by_title(bounds: Any, titles: Names) -> Values:
    """Return the bounds, values or options by the titles of variables; pairs with NaN are none."""
    if isinstance(bounds, Mapping):
        known_names("a variable of bounds", bounds, titles)
        return dict(bounds)
    pairs = real_array("bounds", bounds, "or a mapping from variables to bounds or values")
    parts = {}
    for title, pair in zip(titles, pairs.T.tolist(), strict=True):
        if not np.isnan(pair).any():  # bounds of choices are NaN
            parts[title] = tuple(pair)
    return parts


def _part(variable: Variable, where: str, part: Any) -> Variable:
    """Return a variable restricted to a part of its values.

    Args:
        variable: The whole variable.
        where: Its name for messages.
        part: A tuple of bounds, a value, or a list of options.
    """
    if variable.kind is Kind.CHOICE:
        return _choice_of(variable, where, part)
    if variable.kind is Kind.BINARY:
        part = int(boolean(where, part))
    if isinstance(part, tuple) and len(part) == 2:
        lower, upper = part
    else:
        lower = upper = part
    lower = variable.lower if lower is None else finite_number(where, lower)
    upper = variable.upper if upper is None else finite_number(where, upper)
    fits = variable.lower <= lower <= upper <= variable.upper
    if not variable.kind.real:
        fits = fits and lower.is_integer() and upper.is_integer()
    if not fits:
        ends = f"{variable.lower} to {variable.upper}, {variable.kind.value}"
        raise invalid(where, f"a value, or (lower, upper) in increasing order, from {ends}", part)
    return replace(variable, lower=lower, upper=upper)


def _choice_of(variable: Variable, where: str, part: Any) -> Variable:
    """Return a choice with some of its options, a list or a single one."""
    chosen = part if isinstance(part, list) else [part]
    texts = [*map(option_text, chosen)]
    options = tuple(option for option in variable.options if option_text(option) in texts)
    if not options or len(options) != len(chosen):
        raise invalid(
            where, f"one of {', '.join(map(repr, variable.options))}, or a list of some", part
        )
    return replace(variable, upper=len(options) - 1.0, options=options)


def _pymoo_variable(variable: Variable) -> Any:
    """Return pymoo's variable."""
    if variable.kind is Kind.CHOICE:
        return Choice(options=list(variable.options))
    if variable.kind is Kind.BINARY:
        return Binary()
    if variable.kind is Kind.INTEGER:
        return Integer(bounds=(int(variable.lower), int(variable.upper)))
    return Real(bounds=(variable.lower, variable.upper))
