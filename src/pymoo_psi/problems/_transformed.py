"""Problems with other variables for the same model: a part of the bounds, logarithms."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.variable import Binary, Choice, Integer, Real

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, boolean, finite_number, invalid, known_name, real_array
from pymoo_psi.problems._design_space import DesignSpace, Variable, design_space
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.problems._wrapped import WrappedProblem


class Transformed(WrappedProblem):
    """A problem whose designs are others for the problem within, which gives their values.

    Args:
        problem: The problem within.
        space: The variables here; each has its place in the space of the problem within.
    """

    same_front = False

    def __init__(self, problem: Any, space: DesignSpace) -> None:
        self.space, self._within, free = space, design_space(problem), space.free
        if space.named:
            changed: dict[str, Any] = {"vars": {v.name: _pymoo_variable(v) for v in free.variables}}
        elif problem.xl is None:  # of binary variables
            changed = {"n_var": len(free.variables)}
        else:
            changed = {"n_var": len(free.variables), "xl": free.lower, "xu": free.upper}
        super().__init__(problem, **changed)

    def original(self, X: Any) -> Any:
        """Return designs, or one, as the problem within takes them."""
        one = isinstance(X, Mapping) or (not self.space.named and np.ndim(X) == 1)
        matrix = self.space.to_matrix([X] if one else X)
        designs = self._within.designs(self._values_within(matrix))
        return designs[0] if one else designs

    designs_within = original

    def _values_within(self, matrix: NDArray[Any]) -> NDArray[Any]:
        return matrix

    def evaluate(self, X: Any, *args: Any, **kwargs: Any) -> Any:
        """Evaluate designs, or one, as pymoo's ``evaluate``, by that of the problem within."""
        return self.wrapped.evaluate(self.original(X), *args, **kwargs)


class LogScaled(Transformed):
    """Any pymoo problem, its logarithmic variables given by their common logarithms.

    For algorithms of pymoo, which search evenly between bounds. PSI, ``SurrogatePSI``,
    ``investigate``, samplings and ``nsga3`` take such variables as they are.

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
        >>> problem.bounds(), problem.original(np.array([[2.0]]))
        ((array([-5.]), array([5.])), array([[100.]]))
    """

    def __init__(self, problem: Any, log: Collection[str] | None = None) -> None:
        require_problem(problem)
        given = design_space(problem, log=log)
        self._log = [
            (j, v) for j, v in enumerate(given.variables) if v.kind is Kind.LOG and not v.fixed
        ]
        variables = [*given.variables]
        for j, v in self._log:
            ends = {"lower": np.log10(v.lower), "upper": np.log10(v.upper)}
            variables[j] = replace(v, kind=Kind.REAL, **ends)
        self.log = ()  # to others, these variables are plain ones
        super().__init__(problem, replace(given, variables=tuple(variables)))

    def _values_within(self, matrix: NDArray[Any]) -> NDArray[Any]:
        matrix = matrix.astype(np.result_type(matrix, np.float64))
        for j, v in self._log:
            matrix[:, j] = np.clip(10.0 ** matrix[:, j].astype(np.float64), v.lower, v.upper)
        return matrix


class Restricted(Transformed):
    """Any pymoo problem in a part of its bounds: variables between narrower bounds, or fixed.

    A variable whose bounds are equal in the problem itself is fixed, too.

    Objectives and constraints of a design are the whole problem's, bit for bit. An algorithm sees
    the free variables only, and its ``res.X`` has no others; :meth:`completed` puts the fixed ones
    in. In the table of PSI and ``investigate`` every variable keeps its column and its name, so
    that tests of several parts and of the whole stand in one table; a fixed variable takes no
    dimension of the test points.

    Constraints, runner, callback and name are the wrapped problem's, and so is every attribute not
    found here, but not its gradients and known Pareto front, which is that of the whole.

    Args:
        problem: A pymoo problem with finite bounds, elementwise or not, with variables of any
            kind; one that is restricted already is restricted further.
        box: For the names of variables (x1, x2, … of a vector, or those of the problem's attribute
            ``names``): a tuple ``(lower, upper)``, of which ``None`` keeps the bound that there
            is; or a value, at which the variable is fixed; or, of a choice, a list of the options
            to keep. What is not named stays as it is. Instead of a mapping, the two arrays that
            :meth:`~pymoo_psi.TestTable.refined_bounds` of the problem's table returns.

    Attributes:
        wrapped: The problem, not restricted.
        box: What is kept of each variable that was named, by name, as it may be given again.

    Raises:
        ArgumentValueError: There is no such variable, a bound or value lies outside the problem's
            bounds, or no variable is left free.
        ArgumentTypeError: ``problem`` is no pymoo problem, or what is given for a variable is of
            a type that it cannot have.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> chute = VectorizedSphereChute(0.4)
        >>> limits = {"f1": 2.2, "f2": 0.2}
        >>> bounds = investigate(chute, 256).refined_bounds(limits)
        >>> bounds[0].round(2), bounds[1].round(2)
        (array([0.31, 0.12]), array([1.39, 5.95]))
        >>> part = investigate(Restricted(chute, bounds), 256)

        One variable fixed, and what a table shows of it:

        >>> slope = Restricted(chute, {"x1": 0.5})
        >>> slope.n_var, investigate(slope, 3).X
        (1, array([[0.5  , 0.1  ],
               [0.5  , 3.05 ],
               [0.5  , 1.575]]))

        Of many variables the eight that explain most, the others fixed at the best design so far;
        the next eight would follow, and so on:

        >>> from pymoo.problems import get_problem
        >>> from pymoo_psi.table import sensitivities
        >>> many = get_problem("zdt2", n_var=60)
        >>> table = investigate(many, 256)
        >>> shares = sensitivities(table)["first_order"]
        >>> free = shares.groupby(level="variable").max().nlargest(8).index
        >>> best = table.X[table.pareto()][table.ranking().salukvadze[0]].tolist()
        >>> values = zip(table.layout.variables, best, strict=True)
        >>> Restricted(many, {name: x for name, x in values if name not in free}).n_var
        8
    """

    def __init__(self, problem: Any, box: Mapping[str, Any] | Sequence[Any]) -> None:
        require_problem(problem)
        space = design_space(problem)
        given = _by_name(box, space.titles)
        variables = tuple(
            _fixed(_part(v, f"{v.title} of box", given[v.title]) if v.title in given else v)
            for v in space.variables
        )
        self.box = {v.title: _kept(v) for v in variables if v.title in given}
        if isinstance(problem, Restricted):  # one layer: its space has what both of them fix
            self.box = problem.box | self.box
            problem = problem.wrapped
        if all(v.fixed for v in variables):
            raise invalid("box", "one that leaves a variable free", Received("all of them fixed"))
        super().__init__(problem, replace(space, variables=variables))

    def completed(self, X: Any) -> Any:
        """Return designs, or one, with the fixed variables in their places.

        Example:
            >>> from pymoo_psi import SphereChute
            >>> Restricted(SphereChute(), {"x1": 0.5}).completed([[3.0], [4.0]])
            array([[0.5, 3. ],
                   [0.5, 4. ]])
        """
        return self.original(X)


def _by_name(box: Any, variables: Sequence[str]) -> dict[str, Any]:
    """Return what is given for each variable by name; of two arrays, where they are not NaN."""
    if isinstance(box, Mapping):
        return {known_name("a variable of box", name, variables): box[name] for name in box}
    bounds = real_array("box", box)
    if bounds.shape != (2, len(variables)):
        rule = "a mapping from variables to bounds or values, or the two arrays of refined_bounds"
        raise invalid("box", rule, Received(f"shape {bounds.shape}"))
    pairs = [tuple(None if np.isnan(end) else end for end in pair) for pair in bounds.T.tolist()]
    return {name: pair for name, pair in zip(variables, pairs, strict=True) if pair != (None, None)}


def _part(variable: Variable, where: str, given: Any) -> Variable:
    """Return what is left of a variable.

    Args:
        variable: The whole of it.
        where: Its name for messages.
        given: A tuple of bounds, a value, or a list of options.
    """
    if variable.kind is Kind.CHOICE:
        wanted = given if isinstance(given, list) else [given]
        if not wanted or not all(option in variable.options for option in wanted):
            rule = f"one of {', '.join(map(repr, variable.options))}, or a list of some"
            raise invalid(where, rule, given)
        kept = tuple(option for option in variable.options if option in wanted)
        return replace(variable, upper=len(kept) - 1.0, options=kept)
    whole = (variable.lower, variable.upper)
    if variable.kind is Kind.BINARY:
        given = int(boolean(where, given))
    pair = given if isinstance(given, tuple) and len(given) == 2 else (given, given)
    lower, upper = (
        end if value is None else finite_number(where, value)
        for value, end in zip(pair, whole, strict=True)
    )
    fits = variable.kind.real or (lower.is_integer() and upper.is_integer())
    if not whole[0] <= lower <= upper <= whole[1] or not fits:
        rule = f"a value, or (lower, upper) in increasing order, from {whole[0]} to {whole[1]}"
        rule += ", of whole numbers" if variable.kind is Kind.INTEGER else ""
        raise invalid(where, rule, Received(f"{given}"))
    return replace(variable, lower=lower, upper=upper)


def _fixed(part: Variable) -> Variable:
    """Return a variable as fixed if it has one value only."""
    if part.lower < part.upper or part.fixed:
        return part
    types = {Kind.REAL: float, Kind.LOG: float, Kind.INTEGER: int, Kind.BINARY: bool}
    options = part.options or (types[part.kind](part.lower),)
    return replace(part, options=options, fixed=True)


def _kept(part: Variable) -> Any:
    """Return a part of a variable as it is given in a box."""
    if part.fixed:
        return part.options[0]
    return list(part.options) if part.kind is Kind.CHOICE else (part.lower, part.upper)


def _pymoo_variable(variable: Variable) -> Any:
    """Return pymoo's variable."""
    if variable.kind is Kind.CHOICE:
        return Choice(options=list(variable.options))
    if variable.kind is Kind.BINARY:
        return Binary()
    ends = (variable.lower, variable.upper)
    if variable.kind is Kind.INTEGER:
        return Integer(bounds=tuple(map(int, ends)))
    return Real(bounds=ends)
