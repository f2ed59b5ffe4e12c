"""The design space of a pymoo problem: its variables, and the designs at points."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any

import numpy as np
from pymoo.core.variable import Binary, Choice, Integer, Real

from pymoo_psi._kinds import DTYPES, Kind, matrix_of, option_text
from pymoo_psi._validation import AnyArray, Array, Mask, Received, invalid, known_names, wrong_type
from pymoo_psi.problems._equalities import Polytope, polytope
from pymoo_psi.problems._pymoo import column_titles, numbered, problem_name
from pymoo_psi.problems._wrapped import layers

_PERMUTATIONS = {"TravelingSalesman", "FlowshopScheduling"}  # pymoo's, whatever their bounds
_LEAST_PERMUTED = 4  # fewer integers have such bounds by chance
_LEAST = np.finfo(np.float64).tiny  # stands for 0 and negative values on a logarithmic scale
_TYPES = {None: Real, float: Real, int: Integer, bool: Binary}  # types that a vector may have


@dataclass(frozen=True)
class Variable:
    """A design variable, and the mapping from numbers in [0, 1) to its values.

    Attributes:
        name: Its name.
        kind: Real, logarithmic, integer, binary or a choice.
        lower: Lower bound; for a choice the index of the first option.
        upper: Upper bound; for a choice the index of the last option.
        options: The options of a choice.
        fixed: Whether it has one value; a design as the problem takes it does not include it.
        title: The problem's own name for it.
    """

    name: str
    kind: Kind
    lower: float
    upper: float
    options: tuple[Any, ...] = ()
    fixed: bool = False
    title: str = ""

    def values(self, points: Array) -> AnyArray:
        """Return the values at ``(n,)`` numbers in [0, 1], every discrete value equally often."""
        low, high = self._ends
        if self.kind.real:
            values = low + (high - low) * points
            if self.kind is Kind.LOG:
                values = np.exp(values)
            # exp(log(lower)) is rounded, as is the value of a point 1, which no sequence has.
            values = np.select([points <= 0, points >= 1], [self.lower, self.upper], values)
            return np.asarray(np.clip(values, self.lower, self.upper))
        # n values share [0, 1) in n equal parts; a point 1 gives upper, the last one
        steps = np.minimum(low + np.floor((high - low + 1) * points), high)
        if self.kind is Kind.CHOICE:
            # fromiter: options may be sequences themselves
            return np.fromiter((self.options[int(step)] for step in steps), object)
        return steps.astype(DTYPES[self.kind])

    def places(self, values: AnyArray) -> Array:
        """Return ``(n,)`` numbers that stand for values, in [0, 1] for those within the bounds."""
        low, high = self._ends
        numbers = self._numbers(values)
        if not self.kind.real:
            return (numbers - low + 0.5) / (high - low + 1)
        if high <= low:
            return np.zeros(len(values))
        return (numbers - low) / (high - low)

    def are_near(self, values: AnyArray, reach: float) -> Mask:
        """Return ``(n,)`` whether values are options, or within the bounds.

        Args:
            values: The values.
            reach: By how many widths of the bounds they may be outside.
        """
        low, high = self._ends
        beyond = reach * (high - low)
        numbers = self._numbers(values)
        return np.asarray((numbers >= low - beyond) & (numbers <= high + beyond))

    @property
    def _ends(self) -> tuple[float, float]:
        """The bounds on the scale."""
        low, high = self._on_scale(np.array([self.lower, self.upper])).tolist()
        return low, high

    def _on_scale(self, numbers: Array) -> Array:
        """Return numbers on the scale on which values are evenly distributed."""
        return np.log(np.maximum(numbers, _LEAST)) if self.kind is Kind.LOG else numbers

    def _numbers(self, values: AnyArray) -> Array:
        """Return ``(n,)`` values on the scale; for a choice the indices of options, NaN if none."""
        if self.kind is not Kind.CHOICE:
            return self._on_scale(values.astype(np.float64))
        indices = {option_text(option): float(j) for j, option in enumerate(self.options)}
        return np.array([indices.get(option_text(value), np.nan) for value in values.tolist()])

    def between(self, least: float, greatest: float) -> tuple[float, float]:
        """Return the part of [0, 1] whose values lie between two limits.

        The options of a choice have no order: it is all of [0, 1].
        """
        if self.kind is Kind.CHOICE:
            return 0.0, 1.0
        ends = np.clip([least, greatest], self.lower, self.upper)
        if not self.kind.real:
            ends = np.array([np.ceil(ends[0]), np.floor(ends[1])])
        low, high = self.places(ends).tolist()
        first, last = self.values(np.array([low, high]))
        step = np.finfo(np.float64).eps
        while first < ends[0] or last > ends[1]:  # the value of a place is rounded
            if first < ends[0]:
                low += step
            if last > ends[1]:
                high -= step
            step *= 2
            first, last = self.values(np.array([low, high]))
        return low, max(low, high)


@dataclass(frozen=True)
class DesignSpace:
    """The variables of a problem, including those that :class:`Restricted` has fixed.

    A matrix has a column for each variable, like a test table. Designs as the problem takes them
    have the free variables only, and points have a coordinate for each variable that is searched.

    Attributes:
        variables: The variables in their order.
        named: Whether a design is a mapping from names to values, as in pymoo's mixed-variable
            problems, or else a vector.
        equalities: Linear equalities that the designs of points meet: the coefficients of the
            variables, and the constant that they add up to. A variable of each is not searched.
    """

    variables: tuple[Variable, ...]
    named: bool
    equalities: tuple[tuple[float, ...], ...] = ()

    @property
    def variable_names(self) -> tuple[str, ...]:
        """The names of the variables in pymoo: x1, x2, … or the keys of named designs."""
        return tuple(variable.name for variable in self.variables)

    @property
    def titles(self) -> tuple[str, ...]:
        """The problem's own names for the variables."""
        return tuple(variable.title for variable in self.variables)

    @property
    def lower(self) -> Array:
        """``(n_var,)`` lower bounds."""
        return np.array([variable.lower for variable in self.variables])

    @property
    def upper(self) -> Array:
        """``(n_var,)`` upper bounds."""
        return np.array([variable.upper for variable in self.variables])

    @property
    def free(self) -> DesignSpace:
        """The space of the free variables alone, those of designs as the problem takes them."""
        free = tuple(compress(self.variables, self._are_free()))
        return replace(self, variables=free, equalities=())

    @property
    def are_searched(self) -> Mask:
        """``(n_var,)`` for which variables points have a coordinate: those with two values or more.

        If none of the free ones has two values, it is all of these.
        """
        free = self._are_free()
        varied = free & (self.lower < self.upper)
        if self.equalities:
            varied[self._polytope.dependent] = False
        return varied if varied.any() else free

    @property
    def searched(self) -> tuple[Variable, ...]:
        """The variables for which points have a coordinate."""
        return tuple(compress(self.variables, self.are_searched))

    @property
    def finite(self) -> bool:
        """Whether every variable has a finite number of values, so that designs may recur."""
        return not any(v.kind.real and v.lower < v.upper for v in self.searched)

    def matrix(self, points: Array) -> AnyArray:
        """Return the designs at ``(n, n_searched)`` points of [0, 1] as an ``(n, n_var)`` matrix.

        Its type is that of the variables if they have one in common, else object.
        """
        pairs = zip(self.variables, self.places_at(points).T, strict=True)
        columns = [variable.values(places) for variable, places in pairs]
        return matrix_of(columns, len(points))

    def points(self, matrix: AnyArray) -> Array:
        """Return ``(n, n_searched)`` points of [0, 1] whose designs are the rows of a matrix.

        A discrete value gives the middle of its part of [0, 1), a bound of a real one an end. A
        value outside the bounds gives the nearest end.
        """
        points = np.clip(self.places(matrix), 0, 1)
        if self.equalities:
            points = self._polytope.points(points)
        return points[:, self.are_searched]

    def are_near(self, matrix: AnyArray, reach: float = 0.0) -> Mask:
        """Return ``(n,)`` whether the rows of a matrix are designs within the bounds.

        Designs of wider bounds may have other options, or other values of a variable that has one
        value here.

        Args:
            matrix: The designs.
            reach: By how many widths of its bounds each variable may be outside.
        """
        are_near = np.ones(len(matrix), dtype=bool)
        for variable, values in zip(self.variables, matrix.T, strict=True):
            are_near &= variable.are_near(values, reach)
        return are_near

    def places(self, matrix: AnyArray) -> Array:
        """Return ``(n, n_var)`` places of designs between the bounds of their variables.

        They are 0 and 1 at the bounds, and less or more outside.
        """
        pairs = zip(self.variables, matrix.T, strict=True)
        return np.column_stack([variable.places(values) for variable, values in pairs])

    def places_at(self, points: Array) -> Array:
        """Return the ``(n, n_var)`` places of the designs at points.

        They differ from the points where the range of a variable depends on others.
        """
        # 0 is the lower bound or the first option: the only value of variables without coordinate
        places = np.zeros((len(points), len(self.variables)))
        places[:, self.are_searched] = points
        if self.equalities:
            places = self._polytope.positions(places)
        return places

    def designs(self, matrix: AnyArray) -> AnyArray:
        """Return the rows of a matrix as the problem takes them: vectors, or dictionaries."""
        free = self._are_free()
        if not free.all():  # a copy has another layout, for which sums of a model differ in bits
            matrix = matrix[:, free]
        if not self.named:
            return matrix
        names = self.free.variable_names
        designs = (dict(zip(names, row, strict=True)) for row in matrix.tolist())
        return np.fromiter(designs, object)

    def to_matrix(self, designs: Sequence[Any] | AnyArray) -> AnyArray:
        """Return designs as the problem takes them as a matrix: the inverse of :meth:`designs`."""
        vectors = iter(np.asarray(designs).T)
        columns = []
        for variable in self.variables:
            if variable.fixed:
                column = variable.values(np.zeros(len(designs)))
            elif self.named:
                # fromiter: options may be sequences themselves
                column = np.fromiter((design[variable.name] for design in designs), object)
            else:
                column = next(vectors)
            columns.append(column)
        return np.column_stack(columns)

    @property
    def _polytope(self) -> Polytope:
        return polytope(self.equalities, tuple(self.lower.tolist()), tuple(self.upper.tolist()))

    def _are_free(self) -> Mask:
        return np.array([not variable.fixed for variable in self.variables], dtype=bool)


def design_space(problem: Any, *, log: Collection[str] | None = None) -> DesignSpace:
    """Return the design space of a pymoo problem.

    Args:
        problem: The problem.
        log: Names of the variables whose scale is logarithmic; those of the problem's attribute
            ``log`` unless given. An attribute that is no text, list, tuple or set, such as a
            logger, has another purpose.

    Raises:
        ArgumentTypeError: A variable is of a type that has no uniform points.
        ArgumentValueError: A bound is missing, infinite or above the other one, or a logarithmic
            scale does not begin above 0; or there is no such variable.
    """
    space = getattr(problem, "space", None)  # a wrapper with other variables has its own
    if not isinstance(space, DesignSpace):
        space = DesignSpace(tuple(_variables(problem)), bool(getattr(problem, "vars", None)))
    titles = column_titles(problem)
    variables = [replace(v, title=titles.get(v.name, v.name)) for v in space.variables]
    names = {*space.variable_names, *[variable.title for variable in variables]}
    if log is None:
        log = _own_log(problem, names)
    known_names("log", log, names)
    for j, variable in enumerate(variables):
        if variable.name in log or variable.title in log:
            variables[j] = _logarithmic(variable)
    for row in space.equalities:
        for variable in compress(variables, row):
            if variable.kind is not Kind.REAL:
                raise invalid(
                    variable.title,
                    "real and on a linear scale, as it is in an equality of requirements",
                    Received(variable.kind.value),
                    "change either",
                )
    return replace(space, variables=tuple(variables))


def _own_log(problem: Any, names: Collection[str]) -> Collection[str]:
    """Return the names in a problem's attribute ``log``; none if it has another purpose."""
    log = getattr(problem, "log", None)
    if isinstance(log, str) and log in names:
        raise wrong_type(
            "log of the problem", "a list of variables", log, "or an attribute of another name"
        )
    if not isinstance(log, (list, tuple, set, frozenset)):
        return ()
    return log


def _logarithmic(variable: Variable) -> Variable:
    """Return a variable with a logarithmic scale."""
    if not variable.kind.real or variable.lower <= 0:
        raise invalid(
            f"{variable.title} in log",
            "a real variable whose lower bound is above 0",
            Received(f"{variable.lower:g} of a {variable.kind.value} variable"),
        )
    return replace(variable, kind=Kind.LOG)


def is_permutation(problem: Any) -> bool:
    """Whether the designs of a problem are permutations of its variables.

    An attribute ``permutation`` of the problem says so. Without it, these are pymoo's travelling
    salesman and flow shop alone, as bounds do not show whether integers may be equal.
    """
    stated = getattr(problem, "permutation", None)
    if isinstance(stated, bool):
        return stated
    return any(cls.__name__ in _PERMUTATIONS for cls in type(layers(problem)[-1]).__mro__)


def require_no_permutation(problem: Any) -> None:
    """Refuse a problem of permutations, where a value is chosen for each variable alone.

    A warning says if it has the bounds of one and does not say what it is.

    Raises:
        ArgumentValueError: It is one.
    """
    if is_permutation(problem):
        raise invalid(
            "problem",
            "one whose variables are chosen independently",
            Received(f"{problem_name(problem)} of permutations"),
            "search permutations by nsga3(problem, n, sampling=PermutationRandomSampling()), or, "
            "also for a single objective, by another algorithm of pymoo with such operators, on "
            "Recorded(problem, study)",
        )
    if _may_be_permutation(problem):
        warnings.warn(
            f"{problem_name(problem)} has as many integers as each of them has values, as "
            "permutations have; here each is chosen alone, so that values repeat. Say by an "
            "attribute permutation of the problem, True or False, what its designs are",
            stacklevel=3,
        )


def _may_be_permutation(problem: Any) -> bool:
    """Whether the bounds are those of permutations, and the problem does not say what it is.

    Variables with names of their own are no places in a permutation.
    """
    if isinstance(getattr(problem, "permutation", None), bool) or problem.vtype is not int:
        return False
    if problem.n_var < _LEAST_PERMUTED or not problem.has_bounds():
        return False
    lower, upper = problem.bounds()
    if not numbered("x", lower).keys().isdisjoint(column_titles(problem)):
        return False
    return np.ptp(lower) == 0 and bool(np.all(upper - lower == problem.n_var - 1))


def _variables(problem: Any) -> Iterator[Variable]:
    """Yield the variables of a problem, as x1, x2, … those of a vector, checked."""
    variables = getattr(problem, "vars", None)
    if not variables:
        lower, upper = (np.broadcast_to(ends, problem.n_var) for ends in problem.bounds())
        variables = {}
        for j, bounds in enumerate(zip(lower, upper, strict=True), 1):
            variables[f"x{j}"] = _TYPES[problem.vtype](bounds=bounds)
    titles = column_titles(problem)
    for name, variable in variables.items():
        yield _variable(name, f"{titles.get(name, name)} of {problem_name(problem)}", variable)


def _variable(name: str, where: str, variable: Any) -> Variable:
    """Return a variable of pymoo, checked.

    Args:
        name: Its name.
        where: Its name for messages.
        variable: The variable.
    """
    if isinstance(variable, Binary):
        return Variable(name, Kind.BINARY, 0.0, 1.0)
    if isinstance(variable, Choice):
        options = tuple(variable.options)
        return Variable(name, Kind.CHOICE, 0.0, len(options) - 1.0, options)
    kind = Kind.REAL
    rule = "finite and in increasing order"
    low, high = np.array(variable.bounds, dtype=np.float64).tolist()  # NaN for None
    if isinstance(variable, Integer):  # the integers in between
        kind = Kind.INTEGER
        rule += ", with an integer between them"
        low = float(np.ceil(low))
        high = float(np.floor(high))
    # points are lower + (upper - lower) * u
    if not np.isfinite(high - low) or low > high:
        raise invalid(
            f"bounds of {where}",
            rule,
            Received(" and ".join(map(str, variable.bounds))),
            "give the problem bounds within which to search",
        )
    return Variable(name, kind, low, high)
