"""A part of a problem's box, for any algorithm."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pymoo.core.problem import Problem
from pymoo.core.variable import Choice

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    Received,
    boolean,
    finite_number,
    invalid,
    known_name,
    real_array,
    wrong_type,
)
from pymoo_psi.problems._design_space import Variable, design_space, own_names
from pymoo_psi.problems._pymoo import require_problem
from pymoo_psi.problems._wrapped import WrappedProblem


class Restricted(WrappedProblem):
    """Any pymoo problem in a part of its box: variables between narrower bounds, or fixed.

    Criteria and constraints of a design are the whole problem's, bit for bit. An algorithm sees
    the free variables only, and its ``res.X`` has no others; :meth:`completed` puts the fixed ones
    in. In the table of PSI and ``investigate`` every variable keeps its column and its name, so
    that tests of several parts and of the whole stand in one table; a fixed variable takes no
    dimension of the test points.

    Constraints, runner and name are the wrapped problem's, and so is every attribute not found
    here. A known Pareto front is not: it is that of the whole box.

    Args:
        problem: A pymoo problem with finite bounds, elementwise or not, with variables of any
            kind; one that is restricted already is restricted further.
        box: For the names of variables (x1, x2, … of a vector, or those of the problem's attribute
            ``names``): a tuple ``(lower, upper)``, of
            which ``None`` keeps the bound that there is; or a value, at which the variable is
            fixed; or, of a choice, a list of the options to keep. What is not named stays as it
            is. Instead of all this, the two arrays that
            :meth:`~pymoo_psi.TestTable.refined_bounds` of the problem's table returns.

    Attributes:
        wrapped: The problem, not restricted.
        box: What is kept of each variable that was named, by name, as it may be given again.

    Raises:
        ArgumentValueError: There is no such variable, a bound or value lies outside the problem's
            box, or no variable is left free.
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
        >>> shares = sensitivities(table, n_resamples=2)["first_order"]
        >>> free = shares.groupby(level="variable").max().nlargest(8).index
        >>> best = table.X[table.pareto()][table.ranking().salukvadze[0]].tolist()
        >>> values = zip(table.layout.variables, best, strict=True)
        >>> Restricted(many, {name: x for name, x in values if name not in free}).n_var
        8
    """

    def __init__(self, problem: Any, box: Mapping[str, Any] | Sequence[Any]) -> None:
        require_problem(problem)
        space = design_space(problem)
        own = own_names(problem, space)
        given = _by_name(box, tuple(own.values()))
        # Messages and the box have the names that the user has.
        parts = {
            v.name: _part(v, own[v.name], given[own[v.name]])
            for v in space.variables
            if own[v.name] in given
        }
        variables = tuple(parts.get(v.name, v) for v in space.variables)
        self.space = replace(space, variables=variables)
        self.box = {own[name]: _told(part) for name, part in parts.items()}
        if isinstance(problem, Restricted):  # one layer: its space has what both of them fix
            self.box = problem.box | self.box
            problem = problem.wrapped
        free = self.space.free
        if not free.variables:
            raise invalid("box", "one that leaves a variable free", Received("all of them fixed"))
        super().__init__(
            problem,
            # A problem with a `do` of its own is evaluated as a whole, since it transforms designs
            # or values on the way, or runs its model itself as FailureTolerant does.
            elementwise=problem.elementwise and type(problem).do is Problem.do,
            callback=self._call_back if problem.callback is not None else None,
        )
        self.n_var = len(free.variables)
        if space.named:
            self.vars = {v.name: _pymoo_variable(problem.vars[v.name], v) for v in free.variables}
            self.xl, self.xu = (
                {name: getattr(v, side, None) for name, v in self.vars.items()}
                for side in ("lb", "ub")
            )
        else:
            self.xl = None if problem.xl is None else free.lower
            self.xu = None if problem.xu is None else free.upper

    def completed(self, X: Any) -> Any:
        """Return designs, or one, with the fixed variables in their places.

        Example:
            >>> from pymoo_psi import SphereChute
            >>> Restricted(SphereChute(), {"x1": 0.5}).completed([[3.0], [4.0]])
            array([[0.5, 3. ],
                   [0.5, 4. ]])
        """
        if isinstance(X, Mapping):
            variables = self.space.variables
            return {v.name: v.options[0] if v.fixed else X[v.name] for v in variables}
        if not self.space.named:
            return self.space.to_matrix(X)
        return np.fromiter((self.completed(x) for x in X), object)

    def evaluate(self, X: Any, *args: Any, **kwargs: Any) -> Any:
        """Evaluate designs of the free variables, as pymoo's ``evaluate``."""
        if type(self.wrapped).evaluate is Problem.evaluate:
            return super().evaluate(X, *args, **kwargs)
        return self.wrapped.evaluate(self.completed(X), *args, **kwargs)

    def _evaluate(self, X: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        wrapped, designs = self.wrapped, self.completed(X)
        if self.elementwise:
            out.update(wrapped.elementwise_func(wrapped, args, kwargs)(designs))
        elif type(wrapped).do is Problem.do:
            wrapped._evaluate_vectorized(designs, out, *args, **kwargs)
        else:
            out.update(wrapped.do(designs, list(out), *args, **kwargs))
        if not self.space.named:  # gradients by all variables
            free = [not variable.fixed for variable in self.space.variables]
            for name in {"dF", "dG", "dH"}.intersection(out):
                out[name] = out[name] if out[name] is None else np.asarray(out[name])[..., free]

    def _call_back(self, X: Any, out: Any) -> None:
        self.wrapped.callback(self.completed(X), out)

    def _calc_pareto_front(self, *args: Any, **kwargs: Any) -> None:
        pass

    _calc_pareto_set = _calc_pareto_front


def _by_name(box: Any, variables: Sequence[str]) -> dict[str, Any]:
    """Return what is given for each variable by name; of two arrays, where they are not NaN."""
    if isinstance(box, Mapping):
        return {known_name("a variable of box", name, variables): box[name] for name in box}
    if not isinstance(box, Sequence) or isinstance(box, str) or len(box) != 2:
        rule = "a mapping from variables to bounds or values, or the two arrays of refined_bounds"
        raise wrong_type("box", rule, box)
    lower, upper = (
        real_array(f"{side} bounds of box", b)
        for side, b in zip(("lower", "upper"), box, strict=True)
    )
    n_var = len(variables)
    for bounds in (lower, upper):
        if bounds.shape != (n_var,):
            found = Received(f"shape {bounds.shape}")
            raise invalid("bounds of box", f"of shape {(n_var,)}, one for each variable", found)
    ends = [
        tuple(None if np.isnan(end) else end for end in pair)
        for pair in zip(lower.tolist(), upper.tolist(), strict=True)
    ]
    return {name: pair for name, pair in zip(variables, ends, strict=True) if pair != (None, None)}


def _part(variable: Variable, called: str, given: Any) -> Variable:
    """Return what is left of a variable.

    Args:
        variable: The whole of it.
        called: Its name for messages.
        given: A tuple of bounds, a value, or a list of options.
    """
    if variable.kind is Kind.CHOICE:
        return _some_options(variable, called, given)
    name, fixed = f"{called} of box", not isinstance(given, tuple)
    if variable.kind is Kind.BINARY:
        value = boolean(name, given)
        if not variable.lower <= value <= variable.upper:
            raise invalid(name, f"{variable.options[0]}, at which it is fixed", value)
        return _fixed(variable, value)
    if isinstance(given, (list, set, frozenset)) or (not fixed and len(given) != 2):
        # a list of an integer's values might be meant as its bounds, or as just these values
        raise invalid(name, "a value or a tuple (lower, upper)", given)
    whole = (variable.lower, variable.upper)
    ends = [
        end if value is None else finite_number(name, value)
        for value, end in zip((given, given) if fixed else given, whole, strict=True)
    ]
    shown = Received(f"{given}")
    if variable.kind is Kind.INTEGER and not all(end.is_integer() for end in ends):
        raise invalid(name, "of whole numbers, as the variable is an integer", shown)
    if not variable.lower <= min(ends) <= max(ends) <= variable.upper:
        rule = f"within the problem's box, {variable.lower} to {variable.upper}"
        raise invalid(name, rule, shown)
    lower, upper = ends
    if lower > upper:
        raise invalid(name, "(lower, upper) in rising order", shown)
    if lower == upper:
        return _fixed(variable, int(lower) if variable.kind is Kind.INTEGER else lower)
    return replace(variable, lower=lower, upper=upper)


def _some_options(variable: Variable, called: str, given: Any) -> Variable:
    """Return a choice among a list of its options, in their own order, or fixed at one of them."""
    wanted = given if isinstance(given, (list, set, frozenset)) else [given]
    # By type, too: 1, 1.0 and True are equal, and options all the same.
    pairs = [(type(option), option) for option in variable.options]
    for option in wanted:
        if (type(option), option) not in pairs:
            rule = f"one of {', '.join(map(repr, variable.options))}, or a list of some"
            raise invalid(f"{called} of box", rule, option)
    kept = tuple(o for kind, o in pairs if any(type(w) is kind and w == o for w in wanted))
    if not kept:
        raise invalid(f"{called} of box", "of one option or more", given)
    if len(kept) == 1:
        return _fixed(variable, kept[0])
    return replace(variable, upper=len(kept) - 1.0, options=kept)


def _fixed(variable: Variable, value: Any) -> Variable:
    end = 0.0 if variable.kind is Kind.CHOICE else float(value)
    return replace(variable, lower=end, upper=end, options=(value,), fixed=True)


def _told(part: Variable) -> Any:
    """Return a part of a variable as it is given in a box."""
    if part.fixed:
        return part.options[0]
    return list(part.options) if part.kind is Kind.CHOICE else (part.lower, part.upper)


def _pymoo_variable(whole: Any, part: Variable) -> Any:
    """Return pymoo's variable for a part of another."""
    variable = copy.copy(whole)
    if isinstance(whole, Choice):
        variable.options = variable.all = list(part.options)
    elif part.kind is not Kind.BINARY:
        ends = (part.lower, part.upper)
        variable.bounds = ends if part.kind is Kind.REAL else tuple(int(end) for end in ends)
        variable.strict = variable.bounds
    return variable
