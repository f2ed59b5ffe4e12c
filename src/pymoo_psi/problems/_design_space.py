"""The design space of a pymoo problem, the columns of its tests, and its identity."""

from __future__ import annotations

import hashlib
import inspect
import os
import re
import warnings
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import compress
from types import ModuleType
from typing import Any

import numpy as np
from pymoo.core.problem import Problem
from pymoo.core.variable import Binary, Choice, Integer, Real

from pymoo_psi._kinds import DTYPES, Kind, matrix_of, option_text
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Mask,
    Received,
    Values,
    invalid,
    known_names,
    mapping,
    name_list,
    wrong_type,
)
from pymoo_psi.parallel import Runner
from pymoo_psi.problems._equalities import Polytope, polytope
from pymoo_psi.problems._pymoo import problem_name
from pymoo_psi.problems._wrapped import WrappedProblem, layers, within_same_columns
from pymoo_psi.table import OUTPUT, Column, Schema, unit_texts

_LONGEST = 1000  # characters of a constant of a model that a study shows
_PERMUTATIONS = {"TravelingSalesman", "FlowshopScheduling"}  # pymoo's, whatever their bounds
_LEAST_PERMUTED = 4  # fewer integers have such bounds by chance
_UNKNOWN = object()  # what a study does not compare, such as paths
_LEAST = np.finfo(np.float64).tiny  # stands for 0 and negative values on a logarithmic scale
_TYPES = {None: Real, float: Real, int: Integer, bool: Binary}  # types that a vector may have
# A text that looks like a path, whatever is on the disk: /data, ./a, ~/a, C:\a, meshes/ or a/b.msh.
# Units are none: a suffix of one letter, or of such a letter with a power, may be a factor, as in
# W/m.K and kg/m.s2.
_PATH = re.compile(
    r"""(?:/ | \\\\ | \.{1,2}[/\\] | ~[^/\\]*[/\\] | [a-z]:[/\\]) .*  # its beginning,
    | .*[/\\]  # its end,
    | .*[/\\][^/\\]+\.(?![mska]\d\Z)[a-z]\w+  # or its suffix""",
    re.ASCII | re.DOTALL | re.IGNORECASE | re.VERBOSE,
)


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
        key: Its key in a design that is a mapping; anything that has the name as its text.
    """

    name: str
    kind: Kind
    lower: float
    upper: float
    options: tuple[Any, ...] = ()
    fixed: bool = False
    title: str = ""
    key: Any = None

    def values(self, points: Array) -> AnyArray:
        """Return the values at ``(n,)`` numbers in [0, 1], every discrete value equally often."""
        if self.kind.real:
            low, high = self._ends
            values = low + (high - low) * points
            if self.kind is Kind.LOG:
                values = np.exp(values)
            # A point 1, which no sequence has, may be rounded to a value above the bound.
            return np.asarray(np.clip(values, self.lower, self.upper))
        # n values share [0, 1) in n equal parts; a point 1 gives upper, the last one
        count = self.upper - self.lower + 1
        steps = self.lower + np.floor(count * points)
        steps = np.minimum(steps, self.upper)
        if self.kind is Kind.CHOICE:
            # fromiter: options may be sequences themselves
            return np.fromiter((self.options[int(step)] for step in steps), object)
        return steps.astype(DTYPES[self.kind])

    def places(self, values: AnyArray) -> Array:
        """Return ``(n,)`` numbers that stand for values, in [0, 1] for those within the bounds."""
        if self.kind.real:
            low, high = self._ends
            if high <= low:
                return np.zeros(len(values))
            steps = self._on_scale(values.astype(np.float64)) - low
            return np.asarray(steps / (high - low))
        if self.kind is Kind.CHOICE:
            texts = list(map(option_text, self.options))
            values = np.array([texts.index(option_text(value)) for value in values.tolist()])
        count = self.upper - self.lower + 1
        return (values.astype(np.float64) - self.lower + 0.5) / count

    def are_near(self, values: AnyArray, reach: float) -> Mask:
        """Return ``(n,)`` whether values are options, or within the bounds.

        Args:
            values: The values.
            reach: By how many widths of the bounds they may be outside.
        """
        if self.kind is Kind.CHOICE:
            return np.isin([*map(option_text, values)], [*map(option_text, self.options)])
        low, high = self._ends
        beyond = reach * (high - low)
        numbers = self._on_scale(values.astype(np.float64))
        return np.asarray((numbers >= low - beyond) & (numbers <= high + beyond))

    @property
    def _ends(self) -> Array:
        """The bounds on the scale."""
        return self._on_scale(np.array([self.lower, self.upper]))

    def _on_scale(self, values: Array) -> Array:
        """Return real values on the scale on which they are evenly distributed."""
        return np.log(np.maximum(values, _LEAST)) if self.kind is Kind.LOG else values

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
    def searched(self) -> tuple[Variable, ...]:
        """The variables for which points have a coordinate: those with two values or more."""
        return tuple(compress(self.variables, self._are_searched()))

    @property
    def finite(self) -> bool:
        """Whether every variable has a finite number of values, so that designs may recur."""
        return not any(v.kind.real and v.lower < v.upper for v in self.searched)

    def matrix(self, points: Array) -> AnyArray:
        """Return the designs at ``(n, n_searched)`` points of [0, 1] as an ``(n, n_var)`` matrix.

        Its type is that of the variables if they have one in common, else object.
        """
        pairs = zip(self.variables, self._places_at(points).T, strict=True)
        columns = [variable.values(places) for variable, places in pairs]
        return matrix_of(columns, len(points))

    def points(self, matrix: AnyArray) -> Array:
        """Return ``(n, n_searched)`` points of [0, 1] whose designs are the rows of a matrix.

        A discrete value gives the middle of its part of [0, 1), a bound of a real one an end. A
        value outside the bounds gives the nearest end.
        """
        points = np.clip(self._places(matrix), 0, 1)
        if self.equalities:
            points = self._polytope.points(points)
        return points[:, self._are_searched()]

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
        """Return ``(n, n_searched)`` places of designs between the bounds of their variables.

        They are 0 and 1 at the bounds, and less or more outside.
        """
        return self._places(matrix)[:, self._are_searched()]

    def places_at(self, points: Array) -> Array:
        """Return the ``(n, n_searched)`` places of the designs at points.

        They differ from the points where the range of a variable depends on others.
        """
        return self._places_at(points)[:, self._are_searched()]

    def _places(self, matrix: AnyArray) -> Array:
        """Return ``(n, n_var)`` places of designs between the bounds of all variables."""
        pairs = zip(self.variables, matrix.T, strict=True)
        return np.column_stack([variable.places(values) for variable, values in pairs])

    def _places_at(self, points: Array) -> Array:
        """Return ``(n, n_var)`` places of designs between the bounds of all variables."""
        # 0 is the lower bound or the first option: the only value of variables without coordinate
        places = np.zeros((len(points), len(self.variables)))
        places[:, self._are_searched()] = points
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
        keys = [variable.key for variable in self.free.variables]
        designs = (dict(zip(keys, row, strict=True)) for row in matrix.tolist())
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
                column = np.fromiter((design[variable.key] for design in designs), object)
            else:
                column = next(vectors)
            columns.append(column)
        return np.column_stack(columns)

    def _are_searched(self) -> Mask:
        """Return which variables are searched: all free ones if none has two values."""
        free = self._are_free()
        varied = free & (self.lower < self.upper)
        if self.equalities:
            varied[self._polytope.dependent] = False
        return varied if varied.any() else free

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
    own_names = space.variable_names
    names = {*own_names, *[titles.get(name, name) for name in own_names]}
    if log is None:
        log = _own_log(problem, names)
    known_names("log", log, names)
    variables = []
    for variable in space.variables:
        variable = replace(variable, title=titles.get(variable.name, variable.name))
        if variable.name in log or variable.title in log:
            variable = _logarithmic(variable)
        variables.append(variable)
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


def column_titles(problem: Any) -> dict[str, str]:
    """Return the problem's own names for columns, by their default names.

    They are in its attribute ``names``, a mapping; a method or text has another purpose.

    Raises:
        ArgumentTypeError: The names are in a list, which does not say of which columns.
    """
    titles = getattr(problem, "names", None)
    if isinstance(titles, (list, tuple)):
        mapping("the attribute names of a problem", titles, "f1, x1, … to names")
    if not isinstance(titles, Mapping):
        return {}
    return {str(name): str(title) for name, title in titles.items()}


def column_units(problem: Any) -> dict[str, str]:
    """Return the units in a problem's attribute, by its own names for columns."""
    titles = column_titles(problem)
    units = unit_texts(getattr(problem, "units", None) or {})
    return {titles.get(name, name): unit for name, unit in units.items()}


def numbered(letter: str, titles: Iterable[str], first: int = 1) -> dict[str, str]:
    """Return titles of columns by the default names of these, a letter and a number."""
    return {f"{letter}{j}": title for j, title in enumerate(titles, first)}


def problem_schema(
    problem: Any,
    space: DesignSpace,
    names: Mapping[str, str] | None = None,
    maximize: Collection[str] | None = None,
    units: Mapping[str, str] | None = None,
) -> Schema:
    """Return the columns of a problem's tests, under the user's names.

    Args:
        problem: A pymoo problem, which may have attributes ``names``, ``maximize`` and ``units``.
        space: Its variables.
        names: The user's names of columns by their default names, instead of the attribute.
        maximize: The objectives that ``out["F"]`` has with the opposite sign, by the user's names;
            they include those of the attribute, unless ``names`` are given.
        units: Units by the user's names, instead of the attribute; also for further outputs.

    Raises:
        ArgumentValueError: There is no such column, or two would have the same name.
        ArgumentTypeError: A name or unit is not text, or an argument has the wrong type.
    """
    titles = column_titles(problem)
    new_names = titles if names is None else names
    renamed = dict(new_names)  # by the default names, and by the problem's own
    for name, title in titles.items():
        renamed[title] = new_names.get(name, name)
    stated = name_list("maximize", getattr(problem, "maximize", None) or ())
    own_maximize = [renamed.get(title, title) for title in stated]
    if maximize is None:
        maximize = own_maximize
    name_list("maximize", maximize)
    if maximize and names is None and not {*own_maximize} <= {*maximize}:
        raise invalid(
            "maximize",
            f"a list that includes the problem's own, {', '.join(own_maximize)}",
            maximize,
            "or change the problem's attribute",
        )
    if units is None:
        own_units = column_units(problem).items()
        units = {renamed.get(title, title): unit for title, unit in own_units}

    schema = _default_schema(problem, space)
    known_names("names", new_names, schema.names)
    schema = schema.changed(name=new_names)
    # A further output with a unit is promised by that.
    outputs = [Column(name, OUTPUT) for name in unit_texts(units) if name not in schema.names]
    schema = schema.with_columns(*outputs).with_units(units)
    known_names("maximize", maximize, (*schema.objectives, *schema.outputs))
    return schema.changed(maximize=dict.fromkeys(maximize, True))


def _default_schema(problem: Any, space: DesignSpace) -> Schema:
    """Return the columns of a problem's tests under default names."""
    kinds = [variable.kind for variable in space.variables]
    unbounded = [kind in (Kind.BINARY, Kind.CHOICE) for kind in kinds]
    return Schema.of(
        space.variable_names,
        problem.n_obj,
        problem.n_ieq_constr,
        problem.n_eq_constr,
        lower=np.where(unbounded, np.nan, space.lower),
        upper=np.where(unbounded, np.nan, space.upper),
        kinds=kinds,
    )


def problem_identity(problem: Any, others: list[str] | None = None) -> Values:
    """Return what identifies the model of a problem for a study, as plain values.

    The names and kinds of the variables belong to it as well; bounds, requirements, names of
    objectives and limits do not, so that all of these may be changed.

    The name is not enough, as a model has constants. So numbers and texts that the problem was made
    with are included, or else what its method ``fingerprint()`` returns, such as the chute's; for a
    wrapper with such a method, that of the wrapped problem, too. Wrappers that have other columns,
    or other values in them, are named by their classes. Two identities are compared by
    :func:`identity_facts`.

    Args:
        problem: The problem.
        others: As for :func:`own_parameters`.
    """
    parameters, defaults = own_parameters(problem, [] if others is None else others)
    model = within_same_columns(problem)
    choices = {}
    for variable in design_space(model, log=()).variables:
        if variable.kind is Kind.CHOICE:
            choices[variable.title] = [*map(option_text, variable.options)]
    expressions = getattr(problem, "known_expressions", {}).items()
    identity: Values = {
        "problem": problem_name(problem),
        "choices": choices,
        "parameters": parameters,
        "defaults": defaults,
        "wrappers": [type(p).__name__ for p in layers(problem)[:-1] if not p.same_columns],
        "expressions": {name: known.text for name, known in expressions},
        "logarithms": [*getattr(problem, "logarithms", ())],
    }
    if not getattr(model, "has_named_outputs", False):
        # int, as JSON has no NumPy integers, which OpenMDAO's problems have
        identity["objectives"] = int(model.n_obj)
    return identity


def own_parameters(problem: Any, others: list[str]) -> tuple[Values, Values]:
    """Return what a problem's ``fingerprint()`` returns, or the constants that it was made with.

    These are numbers, texts, arrays and names of functions and classes, also in lists, mappings and
    data classes. They are the arguments of its classes that it keeps as attributes of the same
    name, or with an underscore before it, except what pymoo's ``Problem`` takes and does not change
    values. A text that looks like a path is left out: it says where something is, not what.

    Args:
        problem: The problem.
        others: The names of arguments, to which those are added that hold other objects.

    Returns:
        The parameters; and the arguments that have their default values, by their paths among the
        parameters, which do not include them.
    """
    while isinstance(problem, WrappedProblem) and not hasattr(type(problem), "fingerprint"):
        problem = problem.wrapped  # whose fingerprint the wrapper seems to have
    fingerprint = getattr(problem, "fingerprint", None)
    if not callable(fingerprint):
        return _own_constants(layers(problem)[-1], others)
    parameters = dict(fingerprint())
    defaults = {}
    if hasattr(type(problem), "fingerprint") and isinstance(problem, WrappedProblem):
        parameters["wrapped"], defaults_within = own_parameters(problem.wrapped, others)
        for name, value in defaults_within.items():
            defaults[f"wrapped.{name}"] = value
    return parameters, defaults


def _own_constants(model: Any, others: list[str]) -> tuple[Values, Values]:
    """Return the constants of a model that is no wrapper; see :func:`own_parameters`."""
    parameters = {}
    defaults = {}
    for name, default in _arguments(type(model)).items():
        kept = _kept(model, name, default)
        if kept is inspect.Parameter.empty:
            continue
        objects: list[Any] = []
        constant = _constant_of(model, kept, objects)
        if objects:
            others.append(name)
        default_constant = constant
        if kept is not default:
            default_constant = _constant_of(model, default, [])
        if constant is _UNKNOWN:
            continue
        if constant is default_constant or constant == default_constant:  # NaN is not equal
            defaults[name] = default_constant  # 1 is kept as 1.0 if that is the default
        else:
            parameters[name] = constant
    return parameters, defaults


def _kept(model: Any, name: str, default: Any) -> Any:
    """Return what a model keeps of an argument, no method of the same name; or its default."""
    for attribute in (name, f"_{name}"):
        value = getattr(model, attribute, _UNKNOWN)
        if value is not _UNKNOWN and getattr(value, "__self__", None) is not model:
            return value
    return default


def _arguments(kind: type) -> Values:
    """Return the default values of the arguments of a problem's classes.

    Of pymoo's own arguments there is only the one that changes values.
    """
    defaults = {}
    for base in reversed(kind.__mro__):
        if issubclass(base, Problem):
            for name, argument in inspect.signature(base).parameters.items():
                defaults[name] = argument.default
    for name in {*inspect.signature(Problem).parameters} - {"replace_nan_values_by"}:
        del defaults[name]
    return defaults


def _constant_of(model: Any, value: Any, objects: list[Any]) -> Any:
    """Return a constant of a model, which may hold the model itself; see :func:`_constant`."""
    try:
        return _constant(value, {id(model): (model, _UNKNOWN)}, objects)
    except RecursionError:  # a long chain of objects, of which each holds the next one
        objects.append(value)
        return _UNKNOWN


def _constant(value: Any, described: dict[int, tuple[Any, Any]], objects: list[Any]) -> Any:
    """Return a constant as numbers, texts, lists and mappings, or a hash; or ``_UNKNOWN``.

    Args:
        value: The constant.
        described: By their ids, the objects that were met before, each with its description. While
            one is being described, it stands for itself by its number: objects may hold each other.
        objects: Objects of other kinds, to which those in it are added; they may change.
    """
    plain = _plain(value)
    if plain is None or plain is _UNKNOWN or isinstance(plain, (bool, int, float)):
        return plain
    if isinstance(plain, str):
        return _shortened(plain)
    if id(value) not in described:
        described[id(value)] = value, f"object {len(described)}"
        described[id(value)] = value, _contents(plain, described, objects)
    return described[id(value)][1]


def _contents(plain: Any, described: dict[int, tuple[Any, Any]], objects: list[Any]) -> Any:
    """Return the constants in a list or a mapping; see :func:`_constant`."""
    if isinstance(plain, Mapping):
        items = plain.items()
    elif isinstance(plain, list):
        items = dict(enumerate(plain)).items()
    else:
        objects.append(plain)
        return _UNKNOWN
    constants = {}
    for name, item in items:
        constant = _constant(item, described, objects)
        if constant is not _UNKNOWN:
            constants[str(name)] = constant
    if isinstance(plain, Mapping):
        return _shortened(dict(sorted(constants.items())))
    if plain and not constants:
        return _UNKNOWN
    return _shortened([*constants.values()])


def _shortened(constant: Any) -> Any:
    """Return a constant, or the hash of one that is too long for a study to show."""
    text = repr(constant)
    if len(text) <= _LONGEST:
        return constant
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _plain(value: Any) -> Any:
    """Return a value as one of Python's own types, if it stands for one.

    Paths and runners are ``_UNKNOWN``.
    """
    if isinstance(value, (os.PathLike, Runner)):
        return _UNKNOWN
    if isinstance(value, (type, ModuleType)) or inspect.isroutine(value):
        return _code(value)
    if isinstance(value, str) and _PATH.fullmatch(value):
        return _UNKNOWN
    if hasattr(value, "to_numpy"):  # of pandas and polars
        value = value.to_numpy()
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, (tuple, range)):
        return [*value]
    if is_dataclass(value):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    return value


def _code(value: Any) -> Any:
    """Return the name of a function, class or module; that of a method is beside its object.

    A lambda, what was defined within a function, and a function that holds values of another one
    are returned as they are: others of the same name may do something else.
    """
    name = getattr(value, "__qualname__", "")
    owner = getattr(value, "__self__", None)
    if owner is not None and not isinstance(owner, ModuleType):
        return [name, owner]
    if "<" in name or getattr(value, "__closure__", None):
        return value
    if isinstance(value, ModuleType):
        return value.__name__.rpartition(".")[2]
    # Without the module, which is another one for a script, a worker process, or who imports it.
    return name


def _variables(problem: Any) -> Iterator[Variable]:
    """Yield the variables of a problem, as x1, x2, … those of a vector, checked."""
    variables = getattr(problem, "vars", None)
    if not variables:
        if problem.vtype not in _TYPES:
            raise wrong_type("vtype of the problem", "float, int or bool", problem.vtype)
        lower, upper = (np.broadcast_to(ends, problem.n_var) for ends in problem.bounds())
        variables = {}
        for j, bounds in enumerate(zip(lower, upper, strict=True), 1):
            variables[f"x{j}"] = _TYPES[problem.vtype](bounds=bounds)
    for name, variable in variables.items():
        checked = _variable(str(name), f"{name} of {problem_name(problem)}", variable)
        yield replace(checked, key=name)


def _variable(name: str, where: str, variable: Any) -> Variable:
    """Return a variable of pymoo, checked.

    Args:
        name: Its name.
        where: Its name for messages.
        variable: The variable.
    """
    options = tuple(getattr(variable, "options", ()))
    if isinstance(variable, Binary):
        return Variable(name, Kind.BINARY, 0.0, 1.0)
    if isinstance(variable, Choice) and options:
        return Variable(name, Kind.CHOICE, 0.0, len(options) - 1.0, options)
    if not isinstance(variable, (Real, Integer)):
        raise wrong_type(f"variable {where}", "real, integer, binary or a choice of some", variable)
    kind = Kind.REAL
    low, high = np.array(variable.bounds, dtype=np.float64).tolist()  # NaN for None
    if isinstance(variable, Integer):  # the integers in between
        kind = Kind.INTEGER
        low = float(np.ceil(low))
        high = float(np.floor(high))
    # points are lower + (upper - lower) * u
    if not np.isfinite(high - low) or low > high:
        raise invalid(
            f"bounds of {where}",
            "finite and in increasing order",
            Received(" and ".join(map(str, variable.bounds))),
            "give the problem bounds within which to search",
        )
    return Variable(name, kind, low, high)
