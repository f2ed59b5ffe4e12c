"""What is asked of tests: objectives, directions, limits, constraints that hold, computed columns.

In Parameter Space Investigation the problem is formulated after the tests, and often anew
(Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995, Chapter 1): a limit was
too tight, an objective was forgotten, a constraint turns out to be negotiable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypedDict

import numpy as np

from pymoo_psi._validation import (
    Names,
    Values,
    boolean,
    invalid,
    known_name,
    known_names,
    mapping,
    real_array,
)
from pymoo_psi.table._expression import Expression
from pymoo_psi.table._limits import Limit, Limits, limits_of
from pymoo_psi.table._schema import (
    OBJECTIVE,
    OUTPUT,
    RESERVED,
    Column,
    Schema,
    column_names,
    unit_texts,
)


class FormulationFields(TypedDict, total=False):
    """The attributes of a :class:`Formulation`, as arguments."""

    objectives: Names
    maximize: Names
    limits: Limits | None
    omitted: Names
    computed: Mapping[str, str]
    units: Mapping[str, str]
    normalize: bool
    ranges: Mapping[str, Sequence[float]] | None


@dataclass(frozen=True)
class Formulation:
    """A formulation of a problem, applied to tests by :meth:`TestTable.under`.

    All columns are named, and all values are in the original direction. Attributes that are not
    given leave the table unchanged: its objectives, directions and constraints.

    Attributes:
        objectives: Names of the objectives, any columns of numbers; by default the table's. A
            variable or constraint named here becomes an objective only (an equality by its absolute
            value). The table's other objectives become outputs.
        maximize: Objectives to be maximised, in addition to those of the table.
        limits: Limits on objectives, variables and outputs by name, in the original direction,
            ``{"mass": 30, "width": (0.2, 0.4), "gain": (0.9, None)}``: at most 30, from 0.2 to 0.4,
            and at least 0.9. A number is the greatest value allowed; for a maximised objective it
            is refused, because it is ambiguous. On columns of texts, the allowed text or a list:
            ``{"rail": "yes", "material": ["steel", "alu"]}``; on those of true and false ``True``
            or ``False``. Or texts, ``"mass<=30, gain>=0.9, rail=yes, material in steel, alu"``.
        omitted: Constraints that are omitted and become outputs; a limit on such a column replaces
            the bound.
        computed: Further columns by name, each an expression of others, such as ``"mass /
            stress"``. Each may use those before it. Names with other characters than letters,
            digits and ``_`` are written in backquotes. An expression may contain + - * / ** and
            parentheses, abs, sqrt, exp, log (natural), log2, log10, sin, cos, tan (of radians),
            asin, acos, atan, sinh, cosh, tanh, min, max and pi.
        units: Units of columns by name, which are also those of the limits; a table with a column
            in another unit is refused.
        normalize: Whether designs are ranked in units of the objectives' ranges.
        ranges: Fixed ranges ``(lower, upper)`` of all objectives, independent of the limits. An
            empty mapping uses those of the Pareto set, None those of the table if it has the same
            objectives. A value better than its range counts as the best end; an objective with
            equal ends has no effect.

    Raises:
        ArgumentValueError: A name is given twice, or a limit or an expression cannot be read.
        ArgumentTypeError: A name is not text, or a limit is not made of numbers.

    Example:
        >>> from pymoo_psi import TestTable
        >>> table = TestTable.of([1, 2, 3], [[1.0], [2.0], [4.0]], [[3.0, 6], [2, 2], [1, 4]])
        >>> formulation = Formulation(
        ...     objectives=["f1", "ratio"], limits={"x1": (None, 3)}, computed={"ratio": "f2 / f1"})
        >>> print(table.under(formulation).to_frame()[["f1", "ratio", "status", "violated"]])
               f1  ratio      status violated
        test
        1     3.0    2.0          ok
        2     2.0    1.0          ok
        3     1.0    4.0  infeasible    x1<=3
    """

    objectives: Names = ()
    maximize: Names = ()
    limits: Limits | None = field(default_factory=dict)
    omitted: Names = ()
    computed: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    normalize: bool = True
    ranges: Mapping[str, Sequence[float]] | None = None

    def __post_init__(self) -> None:
        """Check what can be checked without a table, and take copies."""
        checked: Values = {}
        for group in ("objectives", "maximize", "omitted"):
            names = column_names(group, getattr(self, group))
            for name in names:
                if names.count(name) > 1:
                    raise invalid(group, "columns that are named once", name)
            checked[group] = names
        computed = mapping("computed", self.computed, "columns to expressions")
        column_names("computed", tuple(computed))
        for text in computed.values():
            Expression.of(text)
        checked["normalize"] = boolean("normalize", self.normalize)
        if self.ranges is not None:
            checked["ranges"] = _checked_ranges(self.ranges)
        checked |= {
            "computed": dict(computed),
            "units": unit_texts(self.units),
            "limits": limits_of(self.limits),
        }
        vars(self).update(checked)

    @property
    def allowed(self) -> dict[str, Limit]:
        """The limits by column.

        Example:
            >>> Formulation(limits="mass<=30").allowed["mass"].upper
            30.0
        """
        limits: Any = self.limits  # as they are after the check
        return dict(limits)

    def to_dict(self) -> Values:
        """Return the attributes that differ from their defaults, as values of JSON.

        Example:
            >>> Formulation(["mass"], limits="gain>=0.5").to_dict()
            {'objectives': ['mass'], 'limits': {'gain': [0.5, None]}}
        """
        stated = {}
        for attribute in fields(self):
            value = getattr(self, attribute.name)
            if value == getattr(_DEFAULT, attribute.name):
                continue
            if attribute.name == "limits":
                value = {name: limit.plain for name, limit in self.allowed.items()}
            if isinstance(value, tuple):
                value = [*value]
            stated[attribute.name] = value
        return stated

    def __repr__(self) -> str:
        """Return the call that makes it."""
        arguments = [f"{name}={value!r}" for name, value in self.to_dict().items()]
        return f"Formulation({', '.join(arguments)})"

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns of numbers that it uses, without those that it computes.

        Example:
            >>> Formulation(["mass", "r"], limits={"x1": 3}, computed={"r": "f2 / f1"}).columns
            ('mass', 'x1', 'f2', 'f1')
        """
        names = [*self.objectives, *self.maximize, *self.omitted]
        for name, limit in self.allowed.items():
            if limit.texts is None:
                names.append(name)
        for text in self.computed.values():
            names += Expression.of(text).columns
        return tuple(name for name in dict.fromkeys(names) if name not in self.computed)

    def with_objectives(self, objectives: Names) -> Formulation:
        """Return it with other objectives, without directions and ranges of former ones.

        A direction of a column that was no objective stays, and so do ranges of others than the
        former objectives: they are mistakes, which a table refuses.

        Example:
            >>> Formulation(["mass", "gain"], maximize=["gain"]).with_objectives(["mass"])
            Formulation(objectives=['mass'])
        """
        former = self.objectives or self.maximize  # where none are stated, they are the table's
        maximize = [name for name in self.maximize if name in objectives or name not in former]
        ranges = self.ranges
        if ranges and {*ranges} == {*(self.objectives or ranges)} != {*objectives}:
            ranges = None
        return replace(self, objectives=objectives, maximize=maximize, ranges=ranges)

    def combine_first(self, other: Formulation) -> Formulation:
        """Return it with what it leaves open as another one has it.

        - Objectives and their ranges are its own, unless it has none.
        - Directions, omitted constraints, limits, computed columns and units are those of both, its
          own where both state one; of its objectives, if it has any.
        - Designs are normalised if both do so.

        Example:
            >>> of_file = Formulation(limits="mass<=50, x1>=2")
            >>> Formulation(limits={"mass": 30}).combine_first(of_file).to_dict()
            {'limits': {'mass': 30, 'x1': [2, None]}}
        """
        if self.objectives:
            other = other.with_objectives(self.objectives)
        return Formulation(
            other.objectives,
            maximize=tuple(dict.fromkeys([*self.maximize, *other.maximize])),
            limits=other.allowed | self.allowed,
            omitted=tuple(dict.fromkeys([*self.omitted, *other.omitted])),
            computed={**other.computed, **self.computed},
            units={**other.units, **self.units},
            normalize=self.normalize and other.normalize,
            ranges=other.ranges if self.ranges is None else self.ranges,
        )

    def roles_in(self, schema: Schema) -> Schema:
        """Return the columns of a table in the roles that the formulation gives them.

        An objective or constraint that the formulation leaves out becomes an output.

        Args:
            schema: The columns of the tests as evaluated.

        Raises:
            ArgumentValueError: A column is unknown, or cannot be used as stated.

        Example:
            >>> schema = Schema.of(["width"], ["mass", "cost"])
            >>> Formulation(["width", "mass"]).roles_in(schema).outputs
            ('cost',)
        """
        stated = (self.objectives, self.maximize, self.omitted, self.computed, self.units)
        if not any(map(len, stated)):
            return schema
        self._require_names(schema)
        columns = {}
        # Outputs of the model stay before those that become outputs here.
        for column in (*schema.with_role(OUTPUT), *schema.columns):
            columns[column.name] = column
        for name in self.computed:
            columns[name] = Column(name, OUTPUT)
        asked = []
        for name in self.objectives or schema.objectives:
            column = columns.pop(name)
            maximize = column.maximize or name in self.maximize
            asked.append(Column(name, OBJECTIVE, unit=column.unit, maximize=maximize))
        for column in columns.values():
            if column.role == OBJECTIVE or column.name in self.omitted:
                column = column._replace(role=OUTPUT)
            asked.append(column)
        return replace(schema, columns=tuple(asked)).with_units(self.units)

    def _require_names(self, schema: Schema) -> None:
        """Refuse columns that are not there, and units that are not those of the table."""
        for name in self.computed:
            if name in schema.names or name in RESERVED:
                raise invalid("a name in computed", "unlike other columns", name)
        names = (*schema.values, *self.computed)
        objectives = self.objectives or schema.objectives
        known_names("objectives", objectives, names)
        known_names("maximize", self.maximize, objectives, "only objectives have a direction")
        known_names("omitted", self.omitted, schema.constraints)
        for name, unit in self.units.items():
            known_name("units", name, names)
            if schema.units.get(name, unit) != unit:
                raise invalid(
                    f"the unit of {name!r}",
                    f"that of the formulation, {unit}",
                    schema.units[name],
                    "convert its values",
                )


def _checked_ranges(ranges: Any) -> dict[str, list[float]]:
    """Return fixed ranges by objective, each of two finite numbers in order."""
    checked = {}
    for name, pair in mapping("ranges", ranges, "objectives to pairs (lower, upper)").items():
        argument = f"the range of {name!r}"
        rule = "a pair (lower, upper) of finite numbers in increasing order"
        ends = real_array(argument, pair, f"give {rule}")
        if ends.shape != (2,) or not np.isfinite(ends).all() or ends[0] > ends[1]:
            raise invalid(argument, rule, pair)
        checked[name] = ends.tolist()
    return checked


_DEFAULT = Formulation()
