"""What a pymoo problem says of its designs and values: variables, columns, identity."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.core.variable import Binary, Choice, Integer, Real

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, collection, invalid, known_name, mapping, wrong_type
from pymoo_psi.problems._pymoo import problem_name
from pymoo_psi.problems._wrapped import layers

if TYPE_CHECKING:
    from pymoo_psi.table import Layout

Array = NDArray[np.float64]

_CLASSES = {Real: Kind.REAL, Integer: Kind.INTEGER, Binary: Kind.BINARY, Choice: Kind.CHOICE}
_LONGEST = 1000  # characters of a constant of a model that a study shows
_TYPES = {None: Kind.REAL, float: Kind.REAL, int: Kind.INTEGER, bool: Kind.BINARY}


@dataclass(frozen=True)
class Variable:
    """One design variable and how a number in [0, 1) becomes a value of it.

    Attributes:
        name: Its name.
        kind: What it is, in pymoo's words.
        lower: Lower bound; for a choice the index of the first option.
        upper: Upper bound; for a choice the index of the last option.
        options: The options of a choice; the value of a fixed variable.
        fixed: Whether it keeps one value; a design as the problem takes it is without it.
        title: What the problem calls it.
    """

    name: str
    kind: Kind
    lower: float
    upper: float
    options: tuple[Any, ...] = ()
    fixed: bool = False
    title: str = ""

    def values(self, points: Array) -> NDArray[Any]:
        """Return the values at ``(n,)`` numbers in [0, 1], every discrete value equally often."""
        if self.kind.real:
            low, high = self._on_scale(np.array([self.lower, self.upper]))
            found = low + (high - low) * points
            found = np.exp(found) if self.kind is Kind.LOG else found
            # of a point 1, which no sequence has, rounding may lie above the bound
            return np.asarray(np.clip(found, self.lower, self.upper))
        # n values share [0, 1) in n equal parts; the last one is upper, of a point 1 too
        steps = self.lower + np.floor((self.upper - self.lower + 1) * points)
        steps = np.minimum(steps, self.upper)
        if self.kind is Kind.CHOICE:
            # fromiter: options may be sequences themselves
            return np.fromiter((self.options[int(step)] for step in steps), object)
        return steps.astype(bool if self.kind is Kind.BINARY else np.int64)

    def points(self, values: NDArray[Any]) -> Array:
        """Return ``(n,)`` numbers in [0, 1] that stand for values, as :meth:`values` has them."""
        if self.kind.real:
            low, high = self._on_scale(np.array([self.lower, self.upper]))
            steps = self._on_scale(values.astype(np.float64)) - low
            return np.clip(steps / (high - low), 0, 1) if high > low else np.zeros(len(values))
        if self.kind is Kind.CHOICE:
            texts = [str(option) for option in self.options]  # as a study has them
            values = np.array([texts.index(str(value)) for value in values.tolist()])
        return (values.astype(np.float64) - self.lower + 0.5) / (self.upper - self.lower + 1)

    def _on_scale(self, values: Array) -> Array:
        """Return real values on the scale on which they are spread."""
        return np.log(values) if self.kind is Kind.LOG else values

    def between(self, least: float, greatest: float) -> tuple[float, float]:
        """Return the numbers in [0, 1] between which numbers lie that are allowed.

        The options of a choice have any order: all of them may be tried.
        """
        if self.kind is Kind.CHOICE:
            return 0.0, 1.0
        ends = np.clip([least, greatest], self.lower, self.upper)
        if not self.kind.real:
            ends = np.array([np.ceil(ends[0]), np.floor(ends[1])])
        low, high = self.points(ends).tolist()
        return low, max(low, high)


@dataclass(frozen=True)
class DesignSpace:
    """The variables of a problem, and those that :class:`Restricted` has fixed.

    A matrix has a column for each variable, as a test table; designs as the problem takes them have
    the free variables only, and points those of them that are searched.

    Attributes:
        variables: The variables in their order.
        named: Whether a design is a mapping from names to values, as in pymoo's mixed-variable
            problems, or else a vector.
    """

    variables: tuple[Variable, ...]
    named: bool

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the variables."""
        return tuple(variable.name for variable in self.variables)

    @property
    def titles(self) -> tuple[str, ...]:
        """What the problem calls the variables."""
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
        """The space of the free variables alone: of the designs as the problem takes them."""
        return replace(self, variables=tuple(v for v in self.variables if not v.fixed))

    @property
    def searched(self) -> tuple[Variable, ...]:
        """The variables of which points have a coordinate: those that can take two values."""
        return tuple(v for v, has in self._coordinates() if has)

    @property
    def finite(self) -> bool:
        """Whether no variable has more than a finite number of values, so that designs recur."""
        return all(v.fixed or not v.kind.real or v.lower == v.upper for v in self.variables)

    def matrix(self, points: Array) -> NDArray[Any]:
        """Return the designs at ``(n, n_searched)`` points of [0, 1] as an ``(n, n_var)`` matrix.

        Its dtype is that of the variables if they have one in common, else object.
        """
        given = iter(points.T)
        # 0 is the lower bound or the first option: the only one of all other variables
        zeros = np.zeros(len(points))
        columns = [v.values(next(given) if has else zeros) for v, has in self._coordinates()]
        kinds = {column.dtype for column in columns}
        # astype(object) gives Python's own int, float and bool, as one would write such a design
        dtype = kinds.pop() if len(kinds) == 1 else np.dtype(object)
        return np.column_stack([column.astype(dtype, copy=False) for column in columns])

    def points(self, matrix: NDArray[Any]) -> Array:
        """Return ``(n, n_searched)`` points of [0, 1] whose designs are the rows of such a matrix.

        A discrete value is in the middle of its part of [0, 1), a bound of a real one at an end.
        """
        columns = zip(self._coordinates(), matrix.T, strict=True)
        points = [variable.points(column) for (variable, has), column in columns if has]
        return np.column_stack(points) if points else np.zeros((len(matrix), 0))

    def designs(self, matrix: NDArray[Any]) -> NDArray[Any]:
        """Return the rows of such a matrix as the problem takes them: vectors, or dictionaries."""
        free = self._are_free()
        matrix = matrix if free.all() else matrix[:, free]
        if not self.named:
            return matrix
        names = self.free.names
        return np.fromiter((dict(zip(names, x, strict=True)) for x in matrix.tolist()), object)

    def to_matrix(self, designs: Sequence[Any] | NDArray[Any]) -> NDArray[Any]:
        """Return designs as the problem takes them as a matrix: the inverse of :meth:`designs`."""
        if self.named:
            result = np.empty((len(designs), len(self.variables)), dtype=object)
            for i, design in enumerate(designs):
                result[i] = [v.options[0] if v.fixed else design[v.name] for v in self.variables]
            return result
        free, given = self._are_free(), np.asarray(designs)
        if free.all():
            return given
        fixed = np.array([v.options[0] for v in self.variables if v.fixed])
        dtype = np.result_type(given, fixed)  # of whole numbers and 0.5, numbers
        result = np.empty((*given.shape[:-1], len(free)), dtype=dtype)
        result[..., free], result[..., ~free] = given, fixed
        return result

    def _coordinates(self) -> list[tuple[Variable, bool]]:
        """Return the variables and which of them are searched; without any, all free ones are."""
        varied = [not v.fixed and v.lower < v.upper for v in self.variables]
        has = varied if any(varied) else self._are_free().tolist()
        return list(zip(self.variables, has, strict=True))

    def _are_free(self) -> NDArray[np.bool_]:
        return np.array([not variable.fixed for variable in self.variables], dtype=bool)


def design_space(problem: Any, *, log: Collection[str] | None = None) -> DesignSpace:
    """Return the design space of a pymoo problem.

    Args:
        problem: The problem.
        log: Names of the variables whose scale is logarithmic; those of the problem's attribute
            ``log`` unless given.

    Raises:
        ArgumentTypeError: A variable is of a type that has no uniform points.
        ArgumentValueError: A bound is missing, infinite or above the other one, or a logarithmic
            scale does not begin above 0.
    """
    space = getattr(problem, "space", None)  # a restricted problem's, also through a wrapper
    if not isinstance(space, DesignSpace):
        space = DesignSpace(tuple(_variables(problem)), bool(getattr(problem, "vars", None)))
    titles = given_names(problem, space)
    variables = [replace(v, title=titles.get(v.name, v.name)) for v in space.variables]
    if log is None:  # an attribute of another type is a logger or a file
        log = getattr(problem, "log", None)
        log = log if isinstance(log, (list, tuple)) and all(isinstance(n, str) for n in log) else ()
    for name in collection("log", log, "a list of variables", "one goes into a list too"):
        known_name("log", name, {n for v in variables for n in (v.name, v.title)})
    scaled = [_logarithmic(v) if {v.name, v.title} & {*log} else v for v in variables]
    return replace(space, variables=tuple(scaled))


def _logarithmic(variable: Variable) -> Variable:
    if not variable.kind.real or variable.lower <= 0:
        found = f"{variable.lower:g}" if variable.kind.real else f"a {variable.kind.value} variable"
        rule = "that of a real variable and above 0 on a logarithmic scale"
        raise invalid(f"the lower bound of {variable.title}", rule, Received(found))
    return replace(variable, kind=Kind.LOG)


def given_names(problem: Any, space: DesignSpace) -> dict[str, str]:
    """Return what a problem's attribute ``names`` calls columns, by their default names.

    A list with a text for each variable names these; anything else is not meant for us.
    """
    own = getattr(problem, "names", None)
    if isinstance(own, (list, tuple, np.ndarray)) and len(own) == len(space.names):
        return dict(zip(space.names, map(str, own), strict=True))
    return {str(name): str(own[name]) for name in own} if isinstance(own, Mapping) else {}


def problem_layout(
    problem: Any,
    space: DesignSpace,
    names: Mapping[str, str] | None = None,
    maximize: Collection[str] | None = None,
    units: Mapping[str, str] | None = None,
) -> Layout:
    """Return the columns of a problem's tests, under the user's names.

    Args:
        problem: A pymoo problem, which may have attributes ``names``, ``maximize`` and ``units``.
        space: Its variables.
        names: The user's names of columns by their default names, instead of the attribute.
        maximize: The objectives that ``out["F"]`` holds with the sign turned, by the user's names;
            all that the attribute has, unless ``names`` are given.
        units: Units by the user's names, as for ``names``; also of further outputs.

    Raises:
        ArgumentValueError: There is no such column, or two would have one name.
        ArgumentTypeError: A name or unit is not text, or an argument of another type.
    """
    from pymoo_psi.table import Layout  # pandas, for which selectors would wait

    own = getattr(problem, "maximize", None) or ()
    maximize = own if maximize is None else maximize
    collection("maximize", maximize, "a list of objectives", "one goes into a list too")
    if maximize and names is None and not set(own) <= set(maximize):
        rule = f"a list with what the problem says itself, {', '.join(own)}"
        raise invalid("maximize", rule, maximize, "or change the problem's attribute")
    names = given_names(problem, space) if names is None else names
    units = getattr(problem, "units", None) or {} if units is None else units
    mapping("names", names, "names to texts")
    mapping("units", units, "names to texts", "also as an attribute of the problem")
    kinds = [variable.kind for variable in space.variables]
    unbounded = [kind in (Kind.BINARY, Kind.CHOICE) for kind in kinds]
    plain = Layout.of(space.names, problem.n_obj, problem.n_ieq_constr, problem.n_eq_constr)
    for name in names:
        known_name("names", name, plain.columns)
    groups = (plain.variables, plain.objectives, plain.inequalities, plain.equalities)
    return Layout.of(
        *([names.get(name, name) for name in group] for group in groups),
        maximize=list(maximize),
        units=units,
        lower=np.where(unbounded, np.nan, space.lower),
        upper=np.where(unbounded, np.nan, space.upper),
        kinds=kinds,
    )


def problem_identity(problem: Any, space: DesignSpace) -> dict[str, Any]:
    """Return what is known of a problem without its bounds, as plain values.

    Name, variables, sizes and bounds are not everything, such as a constant of the model: numbers
    and texts that the problem was made with count too, or else what a method ``fingerprint()`` of
    it returns, as the chute's does.
    """
    return {
        "problem": problem_name(problem),
        "variables": [[v.name, v.kind.value, *map(str, v.options)] for v in space.variables],
        "objectives": int(problem.n_obj),  # NumPy's integers, as of OpenMDAO, are none of JSON
        "inequality constraints": int(problem.n_ieq_constr),
        "equality constraints": int(problem.n_eq_constr),
        "parameters": own_parameters(problem),
    }


def own_parameters(problem: Any) -> dict[str, Any]:
    """Return what ``fingerprint()`` of a problem returns, or numbers and texts it was made with.

    These are the arguments of its classes that it keeps as attributes of the same name, or with an
    underscore before it, but for default values and what pymoo's ``Problem`` takes. A text that is
    a path says where, not what.
    """
    if callable(own := getattr(problem, "fingerprint", None)):
        return dict(own())
    problem = layers(problem)[-1]
    classes = [c for c in reversed(type(problem).__mro__) if issubclass(c, Problem)]
    parameters = {n: p for c in classes for n, p in inspect.signature(c).parameters.items()}
    found = {}
    for name in [n for n in parameters if n not in inspect.signature(Problem).parameters]:
        default = parameters[name].default
        value = getattr(problem, name, getattr(problem, f"_{name}", default))
        value = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
        if _is_plain(value) and value != default:
            text = repr(value)
            long = len(text) > _LONGEST
            found[name] = hashlib.sha256(text.encode()).hexdigest()[:16] if long else value
    return found


def _is_plain(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return all(map(_is_plain, value))
    return isinstance(value, (bool, int, float)) or (
        isinstance(value, str) and not {"/", "\\"} & {*value}
    )


def _variables(problem: Any) -> Iterator[Variable]:
    """Give the variables of a problem, of a mixed one or of vectors, checked."""
    if named := getattr(problem, "vars", None):
        for name, given in named.items():
            kind = next((kind for cls, kind in _CLASSES.items() if isinstance(given, cls)), None)
            bounds, options = getattr(given, "bounds", ()), tuple(getattr(given, "options", ()))
            yield _variable(problem, str(name), given, kind, bounds, options)
        return
    ends = [np.broadcast_to(end, problem.n_var) for end in problem.bounds()]
    for j, bounds in enumerate(zip(*ends, strict=True)):
        yield _variable(problem, f"x{j + 1}", problem.vtype, _TYPES.get(problem.vtype), bounds, ())


def _variable(
    problem: Any, name: str, given: Any, kind: Kind | None, bounds: Any, options: tuple[Any, ...]
) -> Variable:
    where = f"{name} of {problem_name(problem)}"
    if kind is None or (kind is Kind.CHOICE and not options):
        raise wrong_type(f"variable {where}", "real, integer, binary or a choice of some", given)
    if kind in (Kind.BINARY, Kind.CHOICE):
        bounds = (0, len(options) - 1 if options else 1)
    try:
        low, high = map(float, bounds)
    except (TypeError, ValueError):  # None, a text
        low = high = np.nan
    if kind is Kind.INTEGER:
        low, high = float(np.ceil(low)), float(np.floor(high))  # the integers in between
    # points are lower + (upper - lower) * u
    if not np.isfinite(high - low) or low > high:
        found = Received(" and ".join(map(str, bounds)))
        raise invalid(f"bounds of {where}", "finite and in increasing order", found)
    return Variable(name, kind, low, high, options)
