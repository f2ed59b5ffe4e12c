"""What the columns of a test table mean, from names to bounds; limits on them."""

from __future__ import annotations

import numbers
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._kinds import Kind as Kind  # public here
from pymoo_psi._validation import (
    Received,
    finite_number,
    integer,
    invalid,
    known_name,
    mapping,
    real_array,
    wrong_type,
)
from pymoo_psi.pareto import EQ_TOLERANCE
from pymoo_psi.table._designs import is_writable, real_column

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Key: TypeAlias = str | int
"""A variable or objective: its name, or its index from 0."""
Limit: TypeAlias = float | Sequence[float | None]
"""The greatest value allowed, or a pair (lower, upper) with None for an end that is open."""
Limits: TypeAlias = Mapping[str, Limit] | Mapping[int, Limit] | Mapping[str | int, Limit]
"""Limits on objectives, variables and outputs by name; on objectives also by index from 0."""

Bounds: TypeAlias = dict[str, tuple[float, float]]
"""The least and the greatest value of columns by name, in the original direction; infinite if
open."""

RESERVED = ("test_point", "status", "violated", "reason", "pareto")  # further columns of a frame
ORIGIN = ("experiment", "number")  # extra columns of joined experiments
_GROUPS = ("variables", "objectives", "inequalities", "equalities", "outputs")
BLOCKS = ("X", "F", "G", "H", "outputs")  # the arrays of a table with these columns


@dataclass(frozen=True, eq=False)
class Layout:
    """The columns of a test table.

    Attributes:
        variables: ``n_var`` names of the design variables.
        objectives: ``m`` names of the objectives.
        inequalities: ``n_ieq`` names of the inequality constraints, met where g <= 0.
        equalities: ``n_eq`` names of the equality constraints, met where |h| <= eq_tolerance.
        lower: ``(n_var,)`` lower bounds; NaN where there is none or it is not known.
        upper: ``(n_var,)`` upper bounds, as for ``lower``.
        eq_tolerance: How far an equality constraint may be from 0.
        kinds: ``n_var`` kinds of the variables; empty where they follow from the designs.
        outputs: ``k`` names of what else the model gives, numbers that are neither objectives nor
            constraints.
        maximize: The objectives to be maximised, and outputs that would be such objectives.
            ``F`` holds these objectives with the sign turned, as pymoo minimises; whatever is
            reached by their names is in the original direction.
        units: Units of columns by name, also of outputs that no test has brought yet.
        ranges: The best and the worst value of every objective between which distances are
            measured, as ``(lower, upper)``; those of the Pareto set unless given.
        label: Name of the column in ``extra`` that names the designs, or None.

    Example:
        >>> layout = Layout.of(["width", "height"], ["mass"], lower=[1, 1], upper=[2, 5])
        >>> layout.variables, layout.upper
        (('width', 'height'), array([2., 5.]))
    """

    variables: tuple[str, ...]
    objectives: tuple[str, ...]
    inequalities: tuple[str, ...]
    equalities: tuple[str, ...]
    lower: Array
    upper: Array
    eq_tolerance: float
    kinds: tuple[Kind, ...] = ()
    outputs: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    label: str | None = None
    ranges: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the names are distinct, and directions, units, kinds and bounds fit."""
        values: dict[str, Any] = {
            group: column_names(group, getattr(self, group)) for group in (*_GROUPS, "maximize")
        }
        n, words = len(self.variables), [kind.value for kind in Kind]
        values["kinds"] = tuple(Kind(known_name("kinds", kind, words)) for kind in self.kinds)
        if len(self.kinds) not in (0, n):
            raise invalid("kinds", f"{n} kinds, one for each variable", Received(len(self.kinds)))
        values["units"] = unit_texts(self.units)
        values["ranges"] = {name: ends(name, pair) for name, pair in self.ranges.items()}
        if self.ranges and {*self.ranges} != {*self.objectives}:
            raise invalid("ranges", "of every objective, or of none", Received([*self.ranges]))
        values["eq_tolerance"] = finite_number("eq_tolerance", self.eq_tolerance)
        if values["eq_tolerance"] < 0:
            raise invalid("eq_tolerance", "0 or more", self.eq_tolerance)
        for side in ("lower", "upper"):
            # A copy, as it is made read-only and the caller's array is the caller's.
            values[side] = bounds = real_array(side, getattr(self, side)).copy()
            if bounds.shape != (n,):
                rule = f"{n} bounds, one for each variable"
                raise invalid(side, rule, Received(f"shape {bounds.shape}"))
            bounds.setflags(write=False)
        if (values["lower"] > values["upper"]).any():  # false with NaN, a bound that is not known
            raise invalid("lower", "at most upper", Received(f"{self.lower} and {self.upper}"))
        for name, kind, low in zip(
            values["variables"], values["kinds"], values["lower"], strict=False
        ):
            if kind is Kind.LOG and low <= 0:
                raise invalid(f"the lower bound of {name!r}", "above 0 on a log scale", low)
        columns = values["objectives"] + values["outputs"]
        for name in values["maximize"]:
            known_name("maximize", name, columns)
        # In the order of the columns, so that layouts of one meaning are equal.
        values["maximize"] = tuple(name for name in columns if name in values["maximize"])
        for name, value in values.items():
            object.__setattr__(self, name, value)
        counts = Counter((*RESERVED, *self.columns))
        if twice := [name for name, count in counts.items() if count > 1]:
            rule = f"distinct, and none of {', '.join(RESERVED)}"
            raise invalid("the names of a test table", rule, twice[0])

    @classmethod
    def of(
        cls,
        variables: int | Sequence[str] = 0,
        objectives: int | Sequence[str] = 0,
        inequalities: int | Sequence[str] = 0,
        equalities: int | Sequence[str] = 0,
        *,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        eq_tolerance: float = EQ_TOLERANCE,
        kinds: Sequence[Kind | str] = (),
        outputs: Sequence[str] = (),
        maximize: Sequence[str] = (),
        units: Mapping[str, str] | None = None,
    ) -> Layout:
        """Return the layout with these names; a number stands for as many default names.

        Args:
            variables: Names of the variables, or how many: x1, x2, …
            objectives: Names of the objectives, or how many: f1, f2, …
            inequalities: Names of the inequality constraints, or how many: g1, g2, …
            equalities: Names of the equality constraints, or how many: h1, h2, …
            lower: ``(n_var,)`` lower bounds, NaN where there is none; unknown unless given.
            upper: ``(n_var,)`` upper bounds, as for ``lower``.
            eq_tolerance: How far an equality constraint may be from 0.
            kinds: What each variable is, "real", "log" (real, on a logarithmic scale), "integer",
                "binary" or "choice"; as the values of the designs unless given.
            outputs: Names of what else the model gives.
            maximize: The objectives to be maximised.
            units: Units of columns by name.

        Raises:
            ArgumentValueError: A name occurs twice, is reserved or not known; bounds or kinds do
                not fit.
            ArgumentTypeError: A name is not text, a bound not a number.

        Example:
            >>> layout = Layout.of(2, ["mass", "gain"], maximize=["gain"], units={"mass": "kg"})
            >>> layout.label_of("x1"), layout.label_of("mass"), layout.sign
            ('x1', 'mass [kg]', array([ 1., -1.]))
        """
        given = (variables, objectives, inequalities, equalities)
        names = [*map(column_names, _GROUPS, given, "xfgh")]
        ends = [np.full(len(names[0]), np.nan) if end is None else end for end in (lower, upper)]
        more: Any = (*names, *ends, eq_tolerance, kinds, outputs, maximize, units or {})
        return cls(*more)

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of all constraints, the inequalities first.

        Example:
            >>> Layout.of(1, 1, ["stress"], ["volume"]).constraints
            ('stress', 'volume')
        """
        return self.inequalities + self.equalities

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns: variables, objectives, constraints, outputs.

        Example:
            >>> Layout.of(1, ["mass"], ["stress"], outputs=["heat"]).columns
            ('x1', 'mass', 'stress', 'heat')
        """
        return self.variables + self.objectives + self.constraints + self.outputs

    @property
    def blocks(self) -> dict[str, tuple[str, ...]]:
        """Names of the columns of each array of a table: X, F, G, H, outputs.

        Example:
            >>> Layout.of(1, ["mass"], ["stress"]).blocks["G"]
            ('stress',)
        """
        return {k: getattr(self, g) for k, g in zip(BLOCKS, _GROUPS, strict=True)}

    @property
    def sign(self) -> Array:
        """``(m,)`` 1 for an objective to be minimised, -1 for one to be maximised.

        ``F * sign`` are the objectives in the original direction, and these times ``sign`` are F.

        Example:
            >>> Layout.of(1, ["mass", "gain"], maximize=["gain"]).sign
            array([ 1., -1.])
        """
        return np.array([-1.0 if name in self.maximize else 1.0 for name in self.objectives])

    def fixed_ends(self) -> dict[str, Array]:
        """Return the points ``ideal`` and ``nadir`` of the ranges; empty if none are given."""
        if not self.ranges:
            return {}
        pairs = np.array([self.ranges[name] for name in self.objectives], dtype=float).T
        best, worst = np.sort(pairs * self.sign, axis=0) * self.sign
        return {"ideal": best, "nadir": worst}

    def label_of(self, name: str) -> str:
        """Return the name of a column with its unit, and "(max)" if it is to be maximised.

        For axes and headings, as the decision page has them.

        Example:
            >>> Layout.of(1, ["mass"], units={"mass": "kg"}).label_of("mass")
            'mass [kg]'
        """
        unit = self.units.get(name, "")
        text = f"{name} [{unit}]" if unit and not name.endswith(f"[{unit}]") else name
        return f"{text} (max)" if name in self.maximize else text

    def is_log(self, name: str) -> bool:
        """Whether a column is a variable on a logarithmic scale.

        Example:
            >>> Layout.of(["width", "area"], 1, kinds=["real", "log"]).is_log("area")
            True
        """
        return (name, Kind.LOG) in zip(self.variables, self.kinds, strict=False)

    def variable(self, key: Key) -> int:
        """Return the index of a variable given by name or index.

        Example:
            >>> Layout.of(["width", "height"], 1).variable("height")
            1
        """
        return _index("variable", key, self.variables)

    def objective(self, key: Key) -> int:
        """Return the index of an objective given by name or index.

        Example:
            >>> Layout.of(1, ["mass", "cost"]).objective("cost")
            1
        """
        return _index("objective", key, self.objectives)


def joined_layout(layout: Layout, other: Layout) -> Layout:
    """Return a layout with the outputs of another that agrees, their directions and units."""
    outputs = tuple(dict.fromkeys((*layout.outputs, *other.outputs)))
    # The unit of a column is that of the layout that has the column.
    own = {name: unit for name, unit in layout.units.items() if name in layout.columns}
    units, kinds = {**layout.units, **other.units, **own}, layout.kinds or other.kinds
    if (outputs, units, kinds) == (layout.outputs, layout.units, layout.kinds):
        return layout
    more = tuple(dict.fromkeys((*layout.maximize, *other.maximize)))
    return replace(layout, outputs=outputs, maximize=more, units=units, kinds=kinds)


def column_names(group: str, names: Any, letter: str = "") -> tuple[str, ...]:
    """Return names as texts that every file can hold; with a letter, a number gives as many."""
    if letter and not isinstance(names, (str, Sequence)):
        count = integer(f"the number of {group}", names, minimum=0)
        return tuple(f"{letter}{j + 1}" for j in range(count))
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise wrong_type(group, "a list of names", names)
    for name in names:
        if not isinstance(name, str):
            raise wrong_type(group, "names", name)
        if not name or not is_writable(name):
            raise invalid(group, "names of at least one Unicode character", name)
    return tuple(map(str, names))


def unit_texts(units: Any) -> dict[str, str]:
    """Return units as texts that every file can hold, without those that are empty."""
    for name, unit in mapping("units", units, "columns to units, such as {'mass': 'kg'}").items():
        if not isinstance(name, str) or not isinstance(unit, str):
            raise wrong_type("units", "names to texts", units)
        if not is_writable(name) or not unit.isprintable():
            raise invalid(f"the unit of {name!r}", "one line of Unicode text", unit)
    return {str(name): text for name, unit in units.items() if (text := str(unit).strip())}


def _index(kind: str, key: Key, names: tuple[str, ...]) -> int:
    # Stricter than Python, where -1 is the last one and True is 1.
    if isinstance(key, (int, np.integer)) and not isinstance(key, bool):
        if not 0 <= key < len(names):
            raise invalid(kind, f"a name or an index from 0 to {len(names) - 1}", int(key))
        return int(key)
    return names.index(known_name(kind, key, names))


def bounds_of(limits: Limits | None, layout: Layout) -> Bounds:
    """Return what limits say, in the order of the table's columns.

    Raises:
        ArgumentValueError: A column is not known, is named twice, or is a constraint; a limit is
            NaN, its lower end above the upper one, or which end it is remains open.
        ArgumentTypeError: The limits are no mapping, a limit is neither number nor pair.
    """
    found: Bounds = {}
    free = [name for name in layout.columns if name not in layout.constraints]
    rule = "columns to numbers, such as {'f1': 2.5}"
    for key, limit in mapping("limits", {} if limits is None else limits, rule).items():
        name = key if isinstance(key, str) else layout.objectives[layout.objective(key)]
        remedy = ""
        if name in layout.constraints:
            remedy = "leave the constraint out by Formulation(relaxed=...) to give it other limits"
        known_name("a limit", name, free, remedy)
        if name in found:
            raise invalid("limits", "given once for a column", limits)
        found[name] = ends(name, limit)
        if name in layout.maximize and not isinstance(limit, (tuple, list)):
            which = f"the limit on {name!r}, which is maximised,"
            remedy = f"say ({limit}, None) for at least or (None, {limit}) for at most"
            raise invalid(which, "a pair (lower, upper)", limit, remedy)
    # The order of the columns, not of the mapping: columns of violations stand in it.
    return {name: found[name] for name in layout.columns if name in found}


def lacking(limits: Limits | None, layout: Layout) -> bool:
    """Whether a limit is on no column so far: on an output that only later tests may have.

    A test without a value keeps no limit, so no test so far keeps this one. Whether the name is a
    mistake is known when all tests are there, however they were cut into blocks.
    """
    names = limits if isinstance(limits, Mapping) else ()
    return any(isinstance(name, str) and name not in layout.columns for name in names)


def ends(name: str, limit: Any) -> tuple[float, float]:
    """Return the least and the greatest value that a limit allows; a number is the greatest.

    Args:
        name: The column.
        limit: A number, or a pair of numbers or None.

    Raises:
        ArgumentValueError: A number is NaN, or the lower one is above the upper one.
        ArgumentTypeError: It is neither a number nor a pair of numbers or None.
    """
    pair = tuple(limit) if isinstance(limit, (tuple, list)) else (None, limit)
    values = [np.inf * (2 * k - 1) if end is None else end for k, end in enumerate(pair)]
    plain = all(isinstance(v, numbers.Real) and not isinstance(v, (bool, np.bool_)) for v in values)
    if len(pair) != 2 or limit is None or not plain:
        raise wrong_type(f"the limit on {name!r}", "a number or a pair (lower, upper)", limit)
    low, high = values
    if not low <= high:  # of NaN, too
        raise invalid(f"the limit on {name!r}", "(lower, upper) in increasing order", limit)
    return float(low), float(high)


def within(bounds: Bounds, column: Callable[[str], NDArray[Any]], n: int) -> Mask:
    """``(n,)`` which rows keep every limit; what is not finite keeps none.

    Args:
        bounds: The limits.
        column: Gives the ``(n,)`` values of a column by its name, in the original direction.
        n: How many rows there are.
    """
    # Differences of float64 have the sign of the comparison: gradual underflow sees to it.
    return np.asarray(excess(bounds, column, n) == 0)


def excess(bounds: Bounds, column: Callable[[str], NDArray[Any]], n: int) -> Array:
    """``(n,)`` by how much rows exceed limits, summed; infinite where a value is not finite."""
    total = np.zeros(n)
    for name, (low, high) in bounds.items():
        if low > -np.inf or high < np.inf:
            values = real_column(name, column(name))
            # Infinity is what a division by zero leaves: nothing that is known to be large enough.
            values = np.where(np.isfinite(values), values, np.nan)
            with np.errstate(over="ignore"):
                over = np.maximum(low - values, 0) + np.maximum(values - high, 0)
            total += np.where(np.isnan(over), np.inf, over)
    return total
