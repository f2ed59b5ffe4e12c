"""The design space of a pymoo problem: from points of the unit cube to designs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.variable import Binary, Choice, Integer, Real

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, invalid
from pymoo_psi.errors import ArgumentTypeError

Array = NDArray[np.float64]

# Of the integers from here on float64 holds some only, and pymoo keeps a vector's bounds in it.
_LARGEST = 2**53


@dataclass(frozen=True)
class Variable:
    """One design variable and how a number in [0, 1) becomes a value of it.

    Attributes:
        name: Its name.
        kind: What it is, in pymoo's words.
        lower: Lower bound; for a choice the index of the first option.
        upper: Upper bound; for a choice the index of the last option.
        options: The options of a choice.
    """

    name: str
    kind: Kind
    lower: float
    upper: float
    options: tuple[Any, ...] = ()

    def values(self, points: Array) -> NDArray[Any]:
        """Return the values at ``(n,)`` numbers in [0, 1), every discrete value equally often."""
        if self.kind is Kind.REAL:
            return self.lower + (self.upper - self.lower) * points
        # n values share [0, 1) in n equal parts; as a point is below 1, the last one is upper
        steps = self.lower + np.floor((self.upper - self.lower + 1) * points)
        if self.kind is Kind.CHOICE:
            chosen = np.empty(len(points), dtype=object)  # options may be sequences themselves
            chosen[:] = [self.options[int(step)] for step in steps]
            return chosen
        return steps.astype(bool if self.kind is Kind.BINARY else np.int64)


@dataclass(frozen=True)
class DesignSpace:
    """The variables of a problem.

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
    def lower(self) -> Array:
        """``(n_var,)`` lower bounds."""
        return np.array([variable.lower for variable in self.variables])

    @property
    def upper(self) -> Array:
        """``(n_var,)`` upper bounds."""
        return np.array([variable.upper for variable in self.variables])

    @property
    def continuous(self) -> bool:
        """Whether all variables are real and a design is a vector."""
        return not self.named and all(variable.kind is Kind.REAL for variable in self.variables)

    def matrix(self, points: Array) -> NDArray[Any]:
        """Return the designs at ``(n, n_var)`` points of [0, 1) as an ``(n, n_var)`` matrix.

        Its dtype is that of the variables if they have one in common, else object.
        """
        if self.continuous:
            return self.lower + (self.upper - self.lower) * points
        columns = [v.values(column) for v, column in zip(self.variables, points.T, strict=True)]
        kinds = {column.dtype for column in columns}
        result = np.empty(points.shape, dtype=kinds.pop() if len(kinds) == 1 else object)
        for j, column in enumerate(columns):
            # a list holds Python's own int, float and bool, as one would write such a design
            result[:, j] = column.tolist() if result.dtype == object else column
        return result

    def designs(self, matrix: NDArray[Any]) -> NDArray[Any]:
        """Return the rows of such a matrix as the problem takes them: vectors, or dictionaries."""
        if not self.named:
            return matrix
        designs = np.empty(len(matrix), dtype=object)
        designs[:] = [dict(zip(self.names, row, strict=True)) for row in matrix.tolist()]
        return designs

    def to_matrix(self, designs: Sequence[Any] | NDArray[Any]) -> NDArray[Any]:
        """Return designs as the problem takes them as a matrix: the inverse of :meth:`designs`."""
        if not self.named:
            return np.asarray(designs)
        result = np.empty((len(designs), len(self.variables)), dtype=object)
        for i, design in enumerate(designs):
            result[i] = [design[name] for name in self.names]
        return result


def design_space(problem: Any, *, continuous: bool = False) -> DesignSpace:
    """Return the design space of a pymoo problem.

    Args:
        problem: The problem.
        continuous: Accept only a box of continuous variables.

    Raises:
        ArgumentTypeError: A variable is of a type that has no uniform points, or is not continuous
            where it must be.
        ArgumentValueError: A bound is missing, infinite or the wrong way round.
    """
    space = _named_space(problem) if getattr(problem, "vars", None) else _vector_space(problem)
    if continuous and not space.continuous:
        kinds = ", ".join(sorted({variable.kind.value for variable in space.variables}))
        raise ArgumentTypeError(f"{problem.name()} must have continuous variables, got {kinds}")
    return space


def _vector_space(problem: Any) -> DesignSpace:
    kinds = {None: Kind.REAL, float: Kind.REAL, int: Kind.INTEGER, bool: Kind.BINARY}
    if problem.vtype not in kinds:
        raise ArgumentTypeError(
            f"vtype of {problem.name()} must be float, int or bool, got {problem.vtype!r}"
        )
    kind = kinds[problem.vtype]
    ends = []
    for end, default in ((problem.xl, 0.0), (problem.xu, 1.0)):
        if end is None and kind is Kind.BINARY:  # pymoo asks for no bounds there
            end = default
        # as objects: a float array would round large integers before _bounded can refuse them
        ends.append(np.broadcast_to(np.array(end, dtype=object), (problem.n_var,)))
    variables = [
        _bounded(problem, f"x{j + 1}", kind, low, high)
        for j, (low, high) in enumerate(zip(*ends, strict=True))
    ]
    return DesignSpace(tuple(variables), named=False)


def _named_space(problem: Any) -> DesignSpace:
    variables = []
    for name, variable in problem.vars.items():
        if isinstance(variable, Real):
            variables.append(_bounded(problem, name, Kind.REAL, *variable.bounds))
        elif isinstance(variable, Integer):
            variables.append(_bounded(problem, name, Kind.INTEGER, *variable.bounds))
        elif isinstance(variable, Binary):
            variables.append(Variable(str(name), Kind.BINARY, 0.0, 1.0))
        elif isinstance(variable, Choice) and len(variable.options):
            options = tuple(variable.options)
            variables.append(Variable(str(name), Kind.CHOICE, 0.0, len(options) - 1.0, options))
        else:
            raise ArgumentTypeError(
                f"variable {name!r} of {problem.name()} must be Real, Integer, Binary or a Choice "
                f"with options, got {variable!r:.80}"
            )
    return DesignSpace(tuple(variables), named=True)


def _bounded(problem: Any, name: str, kind: Kind, lower: Any, upper: Any) -> Variable:
    """Return a real or integer variable with its bounds checked."""
    where = f"bounds of {name} of {problem.name()}"
    shown = Received(f"{lower} and {upper}")
    try:
        low, high = float(lower), float(upper)
    except (TypeError, ValueError, OverflowError):  # None, a text, an integer beyond all floats
        low = high = np.nan
    if not np.isfinite([low, high]).all():
        raise invalid(where, "finite", shown, "test points are laid out in a box")
    if kind is Kind.INTEGER:
        if max(abs(lower), abs(upper)) >= _LARGEST:
            remedy = "float64 does not have every integer from there on; count from another origin"
            raise invalid(where, "below 2^53 in size for an integer variable", shown, remedy)
        low, high = float(np.ceil(low)), float(np.floor(high))  # the integers in between
    if not np.isfinite(high - low):  # points are lower + (upper - lower) * u
        raise invalid(where, "of finite range", shown)
    if low > high:
        raise invalid(where, "in rising order", shown)
    return Variable(str(name), kind, low, high)
