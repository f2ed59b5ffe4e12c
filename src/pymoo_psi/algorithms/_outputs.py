"""The outputs that surrogates learn under a formulation, and the goal of a search on them.

Columns that a formulation computes are not learned: they follow from learned outputs and from the
variables, as do the outputs of a problem that are expressions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from pymoo_psi._validation import AnyArray, Array, Designs
from pymoo_psi.algorithms._executor import Model
from pymoo_psi.algorithms._proposals import Goal, KnownTests, encoded
from pymoo_psi.algorithms._surrogate_models import bounded, without_penalties
from pymoo_psi.problems import DesignSpace, known_expressions
from pymoo_psi.table import Expression, Formulation, TestTable


@dataclass(frozen=True)
class TestedModel:
    """What a table says of the model of its tests.

    Attributes:
        space: The variables.
        n_ieq_constr: Number of inequality constraints, requirements among them.
    """

    space: DesignSpace
    n_ieq_constr: int
    inner: Any = None

    def violations(self, X: Designs) -> Array:
        """Return ``(n, 0)`` violations of requirements, which a table does not know."""
        return np.zeros((len(X), 0))


class LearnedOutputs:
    """The outputs that surrogates learn from tests under a formulation.

    Args:
        model: The model of the tests.
        table: All tests, under the formulation.
        asked: The formulation, whose computed columns are not learned.

    Attributes:
        names: The columns of the formulation: objectives, constraints without requirements, and
            outputs that have limits, or variables where their ranges depend on each other.
        operands: The names of columns as tested from which others are computed, beside ``names``.
    """

    def __init__(self, model: Model | TestedModel, table: TestTable, asked: Formulation) -> None:
        self._model = model
        self._table = table
        layout = table.layout
        tested = table.tested.layout
        requirements = tested.inequalities[model.n_ieq_constr :]
        self.inequalities = [name for name in layout.inequalities if name not in requirements]
        outputs = [*layout.outputs]
        if model.space.equalities:  # limits on variables are then no sides of the unit cube
            outputs += layout.variables
        self._ends: dict[str, tuple[float, float]] = {}
        for name, limit in table.limits.items():
            if not isinstance(limit, list):
                self._ends[name] = limit
        limited = [name for name in self._ends if name in outputs]
        self.names = [*layout.objectives, *self.inequalities, *layout.equalities, *limited]
        self._n_constraints = len(self.inequalities) + len(layout.equalities)
        self._computed = _needed(asked.computed, self.names)
        self._expressions = known_expressions(model.inner)
        problem = model.inner
        if self._expressions and (
            tested.variables != tuple(problem.variables)
            or tested.objectives != tuple(problem.objectives)
            or {*tested.maximize} != {*problem.maximize}
        ):
            self._expressions = {}  # they mean other names and signs than those of the run
        # Expressions are not learned, but what they are made of.
        operands = set()
        for output in self._expressions.values():
            operands |= {*output.operands}
        names = operands & {*tested.outputs}
        for expression in self._computed.values():
            results = {*tested.columns} - {*tested.variables}
            names |= {*expression.columns} & results
        names -= {*self._expressions}
        self._places = {}
        self.operands: list[str] = []
        for j, name in enumerate(self.names):
            # An equality that is an objective counts by its absolute value.
            if name in tested.columns and not (j < self.n_obj and name in tested.equalities):
                self._places[name] = j
        for name in sorted(names):
            if name not in self._places:
                self._places[name] = len(self.names) + len(self.operands)
                self.operands.append(name)

    @property
    def n_obj(self) -> int:
        """Number of objectives, which come first."""
        return len(self._table.layout.objectives)

    @property
    def goal(self) -> Goal:
        """The goal of a search for the formulation."""
        table = self._table
        layout = table.layout
        space = self._model.space
        limits = []
        for name in self.inequalities:
            limits.append((self.names.index(name), -np.inf, 0.0))
        for name in layout.equalities:
            limits.append((self.names.index(name), 0.0, 0.0))
        # The names of the table, which may be those of the problem or of the run.
        own_names = [variable.name for variable in space.variables]
        titles = dict(zip(own_names, table.tested.layout.variables, strict=True))
        variables = [titles[variable.name] for variable in space.searched]
        low = np.zeros(len(variables))
        high = np.ones(len(variables))
        for name, (least, greatest) in self._ends.items():
            if name in layout.maximize and name in layout.objectives:
                limits.append((self.names.index(name), -greatest, -least))
            elif name in self.names:
                limits.append((self.names.index(name), least, greatest))
            elif name in variables:
                j = variables.index(name)
                low[j], high[j] = space.searched[j].between(least, greatest)
        compute = None
        if self._computed or self._expressions or {*self.names} & {*table.tested.layout.variables}:
            compute = self.computed
        return Goal(
            self.n_obj,
            limits,
            low,
            high,
            required=self.violations,
            encode=partial(encoded, space),
            compute=compute,
            ranges=self._ranges(),
            narrowed=bool(self._ends),
        )

    def violations(self, points: Array) -> Array:
        """Return ``(n, k)`` by how much points violate requirements, and limits on texts."""
        X = self._model.space.matrix(points)
        columns = [self._model.violations(X)]
        variables = self._table.tested.layout.variables
        for name, limit in self._table.limits.items():
            if name in variables and isinstance(limit, list):
                values = X[:, variables.index(name)].astype(str)
                is_other = ~np.isin(values, limit)
                columns.append(is_other[:, None].astype(float))
        return np.hstack(columns)

    def _ranges(self) -> Array | None:
        """Return the ``(2, m)`` fixed ranges of the objectives, as these are minimised."""
        layout = self._table.layout
        ranges = self._table.formulation.ranges
        if not ranges:
            return None
        ends = []
        for name in layout.objectives:
            low, high = ranges[name]
            if name in layout.maximize:
                low, high = -high, -low
            ends.append((low, high))
        return np.array(ends).T

    def known_tests(self, n_uniform: int, pending: Array) -> KnownTests:
        """Return what surrogates learn from.

        Args:
            n_uniform: How many of the tests, the first, are of the sequence.
            pending: ``(p, d)`` the points that are being tested.
        """
        table = self._table
        failed = table.status == "failed"
        n_ieq = self._model.n_ieq_constr
        # The model does not run for a design that violates a requirement.
        unmet = (table.tested.G[:, n_ieq:] > 0).any(axis=1)
        unknown = failed | unmet
        uniform = table.F[:n_uniform][~unknown[:n_uniform]]
        F = without_penalties(table.F, uniform)
        columns = [F]
        for name in self.inequalities:
            columns.append(np.where(unknown, np.nan, table.column(name)))
        columns.append(table.H)
        for name in self.names[self.n_obj + self._n_constraints :]:
            columns.append(_known_or_beyond(table.column(name), *self._ends[name]))
        for name in self.operands:
            columns.append(table.tested.column(name))
        points = self._model.space.points(table.tested.X)
        eligible = table.eligible()
        Y = np.column_stack(columns)
        return KnownTests(table.numbers, points, Y, eligible, failed, unknown, pending)

    def computed(self, points: Array, Y: Array) -> Array:
        """Return ``(n, q)`` outputs of points, of which some are computed from the others.

        Args:
            points: ``(n, d)`` points of the unit cube.
            Y: ``(n, q)`` outputs as surrogates predict them; it is changed.
        """
        tested = self._table.tested.layout
        columns = dict(zip(tested.variables, self._model.space.matrix(points).T, strict=True))
        for name, j in self._places.items():
            columns[name] = self._turned(j, Y[:, j])
        if self._expressions:
            columns |= self._model.inner.computed(columns)
        for name, expression in self._computed.items():
            columns[name] = expression.values(columns)
        for j, name in enumerate(self.names):
            if name not in columns:
                continue
            values = self._turned(j, columns[name])
            if name in self._table.layout.outputs:
                values = _known_or_beyond(values, *self._ends[name])
            Y[:, j] = values
        return bounded(Y)

    def _turned(self, j: int, values: AnyArray) -> Array:
        """Return an output as it is minimised, or back in its original direction."""
        if j < self.n_obj and self.names[j] in self._table.layout.maximize:
            return np.asarray(-values)
        return np.asarray(values)


def _needed(computed: Mapping[str, str], names: Sequence[str]) -> dict[str, Expression]:
    """Return the expressions, in their order, from which columns of these names follow."""
    needed = {*names}
    expressions = {}
    for name, text in reversed([*computed.items()]):
        if name in needed:
            expressions[name] = Expression.of(text)
            needed |= {*expressions[name].columns}
    return dict(reversed([*expressions.items()]))


def _known_or_beyond(values: Array, least: float, greatest: float) -> Array:
    """Return ``(n,)`` values of an output; beyond its limits where a design has none."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return values
    beyond = max(finite.max(), greatest + np.ptp(finite))
    if greatest == np.inf:
        beyond = min(finite.min(), least - np.ptp(finite))
    return np.where(np.isnan(values), beyond, values)
