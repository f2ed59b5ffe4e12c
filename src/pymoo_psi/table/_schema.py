"""What the columns of a table are, and which designs are the same.

A :class:`Schema` is a list of columns, each with its name, role, kind, unit, direction and bounds.
:meth:`Schema.keys` is the one rule for whether two designs are the same.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from pymoo_psi._kinds import Kind as Kind  # public here
from pymoo_psi._kinds import keys_of_designs, option_text
from pymoo_psi._output import with_unit
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Names,
    Received,
    finite_number,
    instance,
    integer,
    invalid,
    known_name,
    known_names,
    mapping,
    wrong_type,
)
from pymoo_psi.pareto import EQ_TOLERANCE

VARIABLE, OBJECTIVE, INEQUALITY, EQUALITY = "variable", "objective", "inequality", "equality"
OUTPUT, LABEL, NOTE = "output", "label", "note"
ROLES = (VARIABLE, OBJECTIVE, INEQUALITY, EQUALITY, OUTPUT, LABEL, NOTE)
"""What a column may be, in the order of the columns: a label names the designs, and a note has
other content, such as the texts of a file."""
NUMBERS_ROLES = (OBJECTIVE, INEQUALITY, EQUALITY, OUTPUT)  # columns of float64

TEST = "test"
"""The name of the numbers of tests in frames and files."""
# Names that a column of a model cannot have: what a frame says of a test.
RESULTS = ("status", "violated", "reason", "pareto")
RESERVED = (TEST, *RESULTS)
# Notes on tests of several runs: the run for which each was made, and its test point there.
RUN, POINT = "run", "test_point"
ROW = "row"
"""The name of the column that numbers the rows of a file."""
NOT_OF_DESIGNS = {RUN, POINT, ROW}  # notes that tell tests apart, not designs
PROPOSAL_ROUND = "proposal_round"
"""Name of the output that tells points of the sequence, 0, from proposals, by their round."""
N_TESTS = "tests"
"""Name of the output of a design that is the mean of several tests: how many they are."""

# Samplings that follow no sequence begin so: an algorithm or people have chosen the points.
BY_ALGORITHM = "an algorithm"
BY_PEOPLE = "tests of"

# What sentences call the rows of a table, and those without values.
_OF_TESTS = {"row": "test", "failed": "failed"}
_OF_MEANS = {"row": "design", "failed": "failed"}
_OF_FILE = {"row": "design", "failed": "incomplete"}


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        name: Its name.
        role: What it is, one of :data:`ROLES`.
        kind: The kind of its values; None of a variable until a design shows it.
        unit: Its unit.
        maximize: Whether it is to be maximised; of an output, if it were an objective.
        lower: The lower bound of a variable, None where there is none or it is not known.
        upper: The upper bound.

    Example:
        >>> Column("area", "variable", Kind.LOG, "mm2", lower=1.0).heading
        'area [mm2]'
    """

    name: str
    role: str
    kind: Kind | None = Kind.REAL
    unit: str = ""
    maximize: bool = False
    lower: float | None = None
    upper: float | None = None

    @property
    def heading(self) -> str:
        """The name with its unit, and "(max)" if it is to be maximised, for axes and headings."""
        heading = with_unit(self.name, self.unit)
        if self.maximize:
            return f"{heading} (max)"
        return heading

    def checked(self) -> Column:
        """Return the column with values of the right types.

        Raises:
            ArgumentValueError: A name cannot be written, the bounds do not fit.
            ArgumentTypeError: A name or unit is not text, a bound not a number.
        """
        place = f"the name of a column ({self.role})"
        if not instance(place, self.name, str):
            raise invalid(place, "at least one character", self.name)
        unit = instance(f"the unit of {self.name!r}", self.unit, str).strip()
        kind = self.kind
        if kind is not None:
            kind = Kind(kind)
        lower = _bound(self.lower)
        upper = _bound(self.upper)
        if lower is not None and upper is not None and lower > upper:
            received = Received(f"{lower:g} and {upper:g}")
            raise invalid(f"the bounds of {self.name!r}", "in increasing order", received)
        if kind is Kind.LOG and lower is not None and lower <= 0:
            raise invalid(f"the lower bound of {self.name!r}", "above 0 on a log scale", lower)
        return self._replace(kind=kind, unit=unit, lower=lower, upper=upper)


_NAME = attrgetter("name")
_checked = lru_cache(Column.checked)  # a schema is made of another one's columns, as a rule


@dataclass(frozen=True)
class Schema:
    """The columns of a table.

    Attributes:
        columns: The columns, in the order of their roles.
        eq_tolerance: How far an equality constraint may be from 0.

    Raises:
        ArgumentValueError: A name occurs twice, or a column does not fit its role.

    Example:
        >>> schema = Schema.of(["width"], ["mass", "gain"], maximize=["gain"], lower=[1], upper=[2])
        >>> schema["gain"].maximize, schema.objectives, schema.sign
        (True, ('mass', 'gain'), array([ 1., -1.]))
    """

    columns: tuple[Column, ...] = ()
    eq_tolerance: float = EQ_TOLERANCE

    def __post_init__(self) -> None:
        """Check the columns, and put them into the order of their roles."""
        columns = [*map(_checked, self.columns)]
        columns.sort(key=lambda column: min(ROLES.index(column.role), ROLES.index(LABEL)))
        tolerance = finite_number("eq_tolerance", self.eq_tolerance)
        vars(self).update(columns=tuple(columns), eq_tolerance=tolerance)
        for name, count in Counter([TEST, *self.names]).items():
            if count > 1:
                rule = f"distinct, and none of {TEST}"
                raise invalid("the names of a table", rule, name, "give it another name")

    @classmethod
    def of(
        cls,
        variables: int | Names = 0,
        objectives: int | Names = 0,
        inequalities: int | Names = 0,
        equalities: int | Names = 0,
        *,
        lower: Iterable[float | None] | None = None,
        upper: Iterable[float | None] | None = None,
        eq_tolerance: float = EQ_TOLERANCE,
        kinds: Sequence[Kind | str] = (),
        outputs: Names = (),
        maximize: Names = (),
        units: Mapping[str, str] | None = None,
    ) -> Schema:
        """Return a schema with these names; a number stands for as many default names.

        Args:
            variables: Names of the variables, or how many: x1, x2, …
            objectives: Names of the objectives, or how many: f1, f2, …
            inequalities: Names of the inequality constraints, or how many: g1, g2, …; met where
                <= 0.
            equalities: Names of the equality constraints, or how many: h1, h2, …; met where their
                absolute value is within the tolerance.
            lower: ``(n_var,)`` lower bounds, NaN or None where there is none; unknown unless given.
            upper: ``(n_var,)`` upper bounds, as for ``lower``.
            eq_tolerance: How far an equality constraint may be from 0.
            kinds: What each variable is, "real", "log" (real, on a logarithmic scale), "integer",
                "binary" or "choice"; as the values of the designs unless given.
            outputs: Names of what else the model gives.
            maximize: The objectives to be maximised, and outputs that would be such objectives.
            units: Units of columns by name.

        Raises:
            ArgumentValueError: A name occurs twice, is reserved or not known; bounds or kinds do
                not fit.
            ArgumentTypeError: A name is not text, a bound not a number.

        Example:
            >>> schema = Schema.of(2, ["mass", "gain"], maximize=["gain"], units={"mass": "kg"})
            >>> schema["x1"].heading, schema["mass"].heading, schema.sign
            ('x1', 'mass [kg]', array([ 1., -1.]))
        """
        groups = {
            VARIABLE: column_names("variables", variables, "x"),
            OBJECTIVE: column_names("objectives", objectives, "f"),
            INEQUALITY: column_names("inequalities", inequalities, "g"),
            EQUALITY: column_names("equalities", equalities, "h"),
            OUTPUT: column_names("outputs", outputs),
        }
        columns = []
        for role, names in groups.items():
            kind = None if role == VARIABLE else Kind.REAL
            columns += [Column(name, role, kind, maximize=name in maximize) for name in names]
        known_names("maximize", maximize, (*groups[OBJECTIVE], *groups[OUTPUT]))
        stated: dict[str, Any] = {"lower": lower, "upper": upper, "kind": kinds or None}
        changes: dict[str, Mapping[str, Any]] = {"unit": unit_texts(units or {})}
        for attribute, values in stated.items():
            if values is not None:
                changes[attribute] = dict(zip(groups[VARIABLE], values, strict=True))
        return cls(tuple(columns), eq_tolerance).changed(**changes)

    # Columns

    @cached_property
    def _by_name(self) -> dict[str, Column]:
        return {column.name: column for column in self.columns}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of all columns."""
        return tuple(map(_NAME, self.columns))

    def __getitem__(self, name: str) -> Column:
        """Return a column by its name.

        Raises:
            ArgumentValueError: There is no such column.
        """
        return self._by_name[known_name("column", name, self._by_name)]

    def with_role(self, *roles: str) -> tuple[Column, ...]:
        """Return the columns of some roles, in the order of the columns."""
        return tuple([column for column in self.columns if column.role in roles])

    def of_role(self, *roles: str) -> tuple[str, ...]:
        """Return the names of the columns of some roles, in the order of the columns."""
        return tuple(map(_NAME, self.with_role(*roles)))

    @cached_property
    def variables(self) -> tuple[str, ...]:
        """The names of the variables."""
        return self.of_role(VARIABLE)

    @cached_property
    def objectives(self) -> tuple[str, ...]:
        """The names of the objectives."""
        return self.of_role(OBJECTIVE)

    @cached_property
    def constraints(self) -> tuple[str, ...]:
        """The names of all constraints, the inequalities first."""
        return self.of_role(INEQUALITY, EQUALITY)

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """The names of further outputs of the model, neither objectives nor constraints."""
        return self.of_role(OUTPUT)

    @cached_property
    def values(self) -> tuple[str, ...]:
        """The names of variables, objectives, constraints and outputs: all but labels and notes."""
        return self.of_role(VARIABLE, *NUMBERS_ROLES)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """The names of label and notes: columns of texts, and whatever else a file has."""
        return self.of_role(LABEL, NOTE)

    @cached_property
    def label(self) -> str | None:
        """The name of the column that names the designs, or None."""
        return next(iter(self.of_role(LABEL)), None)

    @cached_property
    def maximize(self) -> tuple[str, ...]:
        """The names of what is to be maximised."""
        return tuple(column.name for column in self.columns if column.maximize)

    @cached_property
    def units(self) -> dict[str, str]:
        """The units of the columns that have one."""
        return {column.name: column.unit for column in self.columns if column.unit}

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """The kinds of the variables; real where it is not known yet."""
        return tuple(column.kind or Kind.REAL for column in self.with_role(VARIABLE))

    @cached_property
    def lower(self) -> Array:
        """``(n_var,)`` lower bounds; NaN where there is none."""
        return _frozen(np.array([c.lower for c in self.with_role(VARIABLE)], dtype=np.float64))

    @cached_property
    def upper(self) -> Array:
        """``(n_var,)`` upper bounds; NaN where there is none."""
        return _frozen(np.array([c.upper for c in self.with_role(VARIABLE)], dtype=np.float64))

    @cached_property
    def sign(self) -> Array:
        """``(m,)`` 1 for an objective to be minimised, -1 for one to be maximised.

        ``F * sign`` are the objectives in the original direction, and these times ``sign`` are F.
        """
        signs = [-1.0 if column.maximize else 1.0 for column in self.with_role(OBJECTIVE)]
        return _frozen(np.array(signs))

    @property
    def are_means(self) -> bool:
        """Whether rows are means of several tests, as the numbers of tests and errors show."""
        errors = map(error_column, self.values)
        return N_TESTS in self.outputs and not {*errors}.isdisjoint(self.outputs)

    @property
    def words(self) -> dict[str, str]:
        """The words for rows in sentences: tests of a model, their means, or designs of a file.

        Designs of a file have a column of names and no bounds; they may be incomplete.

        Example:
            >>> Schema.of(["width"], ["mass"], lower=[1], upper=[2]).words["failed"]
            'failed'
        """
        if self.label is not None and not np.isfinite(self.lower).any():
            return _OF_FILE
        if self.are_means:
            return _OF_MEANS
        return _OF_TESTS

    # Other schemas

    def changed(self, **changes: Mapping[str, Any]) -> Schema:
        """Return it with attributes of columns by name.

        Example:
            >>> Schema.of(["width"], ["mass"]).changed(unit={"mass": "kg"})["mass"].heading
            'mass [kg]'
        """
        by_name = dict(self._by_name)
        for attribute, values in changes.items():
            for name, value in values.items():
                column = by_name.get(name, self[name])
                by_name[name] = column._replace(**{attribute: value})
        return self._having(by_name)

    def with_units(self, units: Mapping[str, str]) -> Schema:
        """Return it with units of some columns.

        Raises:
            ArgumentValueError: There is no such column.
        """
        return self.changed(unit=unit_texts(units))

    def with_columns(self, *columns: Column) -> Schema:
        """Return it with further columns, or other ones in the place of those with their names.

        Example:
            >>> Schema.of(["width"], ["mass"]).with_columns(Column("heat", "output")).outputs
            ('heat',)
        """
        by_name = dict(self._by_name)
        for column in columns:
            by_name[column.name] = column
        return self._having(by_name)

    def _having(self, by_name: Mapping[str, Column]) -> Schema:
        """Return it with these columns; itself if it has them, as columns need not be checked."""
        columns = tuple(by_name.values())
        return self if columns == self.columns else replace(self, columns=columns)

    def without(self, names: Collection[str]) -> Schema:
        """Return it without some columns."""
        kept = tuple(column for column in self.columns if column.name not in names)
        return replace(self, columns=kept)

    def joined(self, other: Schema) -> Schema:
        """Return it with the outputs and notes that only another one has, and its kinds.

        A variable of integers in one and of real numbers in the other one is real.
        """
        columns = []
        for column in other.columns:
            if column.name not in self.names and column.role == LABEL:
                column = column._replace(role=NOTE)
            present = self._by_name.get(column.name, column)
            kind = present.kind or column.kind
            if {kind, column.kind} == {Kind.INTEGER, Kind.REAL}:
                kind = Kind.REAL
            columns.append(present._replace(kind=kind))
        return self.with_columns(*columns)

    # Designs

    def bounds_around(self, data: Mapping[str, AnyArray], margin: float) -> tuple[Array, Array]:
        """Return ``(n_var,)`` lower and upper bounds; see :meth:`TestTable.refined_bounds`.

        Args:
            data: ``(n,)`` columns of the variables, n >= 1.
            margin: By which share of their width they are wider on each side.
        """
        lower = self.lower.copy()
        upper = self.upper.copy()
        for j, column in enumerate(self.with_role(VARIABLE)):
            if column.kind in (Kind.BINARY, Kind.CHOICE):
                continue
            cells = data[column.name]
            low, high = _widened(float(cells.min()), float(cells.max()), margin, column.kind)
            # fmax and fmin ignore a bound that is NaN, as there is none.
            lower[j] = np.fmax(low, lower[j])
            upper[j] = np.fmin(high, upper[j])
        return lower, upper

    def keys(self, data: Mapping[str, AnyArray]) -> list[str]:
        """Return a key for each of n designs: two are the same if their keys are equal.

        They are those of :func:`~pymoo_psi._kinds.keys_of_designs`, which studies have, too.

        Args:
            data: ``(n,)`` columns of the variables.
        """
        columns = []
        for name, kind in zip(self.variables, self.kinds, strict=True):
            cells = data[name]
            columns.append(choice_texts(cells) if kind is Kind.CHOICE else cells)
        return keys_of_designs(columns, self.kinds)


def _widened(low: float, high: float, margin: float, kind: Kind | None) -> tuple[float, float]:
    """Return the ends of a range that is wider on each side by a share of its width."""
    if kind is Kind.LOG:
        growth = (high / low) ** margin
        return low / growth, high * growth
    step = margin * (high - low)
    if kind is Kind.INTEGER:
        return float(np.floor(low - step)), float(np.ceil(high + step))
    return low - step, high + step


def choice_texts(cells: AnyArray) -> AnyArray:
    """Return the texts of the options that designs have chosen, see :func:`option_text`."""
    return np.fromiter(map(option_text, cells.tolist()), object)


def error_column(objective: str) -> str:
    """Return the name of the output with the standard errors of an objective."""
    return f"{objective} standard error"


def column_names(group: str, names: Any, letter: str = "") -> tuple[str, ...]:
    """Return a list of names; with a letter, a number gives as many."""
    if letter and not isinstance(names, (str, Sequence)):
        count = integer(f"the number of {group}", names, minimum=0)
        return tuple(f"{letter}{j + 1}" for j in range(count))
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise wrong_type(group, "a list of names", names, "one goes into a list too")
    return tuple(names)


def unit_texts(units: Any) -> dict[str, str]:
    """Return units by column as texts, without those that are empty."""
    texts = {}
    for name, unit in mapping("units", units, "columns to units, such as {'mass': 'kg'}").items():
        text = instance(f"the unit of {name!r}", unit, str).strip()
        if text:
            texts[name] = text
    return texts


def _bound(bound: Any) -> float | None:
    """Return a bound as a float; None for NaN."""
    if bound is None or bound != bound:
        return None
    return float(bound)


def _frozen(array: AnyArray) -> AnyArray:
    array.setflags(write=False)
    return array
