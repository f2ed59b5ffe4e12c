"""The outputs that surrogates learn under a formulation, and the goal of a search on them.

Columns that a formulation computes are not learned: they follow from learned outputs and from the
variables, as do the outputs of a problem that are expressions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from pymoo_psi._validation import Array, Designs
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._proposals import Goal, KnownTests, encoded
from pymoo_psi.algorithms._surrogate_models import bounded, without_penalties
from pymoo_psi.problems import DesignSpace, known_expressions
from pymoo_psi.table import OPEN, Expression, Layout, TestTable


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


class _Output(NamedTuple):
    """An output of a formulation that surrogates learn.

    Attributes:
        name: The column.
        least: The least value allowed, as the output is minimised.
        greatest: The greatest value allowed, as the output is minimised.
        is_tested: Whether it is a column as tested.
        sign: -1 if it is minimised as the negative of its column.
    """

    name: str
    least: float
    greatest: float
    is_tested: bool = True
    sign: int = 1

    def known_or_beyond(self, values: Array) -> Array:
        """Return ``(n,)`` values of the output; beyond its limits where a design has none."""
        finite = values[np.isfinite(values)]
        if len(finite) == 0:
            return values
        beyond = max(finite.max(), self.greatest + np.ptp(finite))
        if self.greatest == np.inf:
            beyond = min(finite.min(), self.least - np.ptp(finite))
        return np.where(np.isnan(values), beyond, values)


@dataclass(frozen=True)
class LearnedOutputs:
    """The outputs that surrogates learn from tests under a formulation.

    They are, in this order: the objectives; the constraints; the limited columns; and the operands.

    Attributes:
        model: The model of the tests.
        table: All tests, under the formulation.
        limits: The limits on numbers, by column.
        objectives: The objectives.
        constraints: The constraints, without requirements.
        limited: Other columns that have a limit.
        computed_columns: Columns of the formulation that are computed, not learned, in their order.
        expressions: Outputs of the problem that are expressions.
        operands: Columns as tested from which others are computed.
    """

    model: Model | TestedModel
    table: TestTable
    limits: Mapping[str, tuple[float, float]]
    objectives: Sequence[_Output]
    constraints: Sequence[_Output]
    limited: Sequence[_Output]
    computed_columns: Mapping[str, Expression]
    expressions: Mapping[str, Any]
    operands: Sequence[str]

    @property
    def outputs(self) -> list[_Output]:
        """All outputs but the operands."""
        return [*self.objectives, *self.constraints, *self.limited]

    @property
    def goal(self) -> Goal:
        """The goal of a search for the formulation."""
        variables = self.table.tested.layout.variables
        space = self.model.space
        limits = []
        for name in [*self.table.layout.constraints, *self.limits]:
            for j, output in enumerate(self.outputs):
                if output.name == name:
                    limits.append((j, output.least, output.greatest))
        # The names of the table, which may be those of the problem or of the run.
        own_names = [variable.name for variable in space.variables]
        titles = dict(zip(own_names, variables, strict=True))
        low = np.zeros(len(space.searched))
        high = np.ones(len(space.searched))
        learned = {output.name for output in self.outputs}.union(self.operands)
        for j, variable in enumerate(space.searched):
            name = titles[variable.name]
            if name in self.limits and name not in learned:
                low[j], high[j] = variable.between(*self.limits[name])
        compute = None
        if self.computed_columns or self.expressions or learned & {*variables}:
            compute = self.computed
        return Goal(
            len(self.objectives),
            limits,
            low,
            high,
            required=self.violations,
            encode=partial(encoded, space),
            compute=compute,
            ranges=self._ranges(),
            narrowed=bool(self.limits),
        )

    def violations(self, points: Array) -> Array:
        """Return ``(n, k)`` by how much points violate requirements, and limits on texts."""
        X = self.model.space.matrix(points)
        columns = [self.model.violations(X)]
        variables = self.table.tested.layout.variables
        for name, limit in self.table.limits.items():
            if name in variables and isinstance(limit, list):
                values = X[:, variables.index(name)].astype(str)
                is_other = ~np.isin(values, limit)
                columns.append(is_other[:, None].astype(float))
        return np.hstack(columns)

    def _ranges(self) -> Array | None:
        """Return the ``(2, m)`` fixed ranges of the objectives, as these are minimised."""
        layout = self.table.layout
        ranges = self.table.formulation.ranges
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
        table = self.table
        failed = table.status == "failed"
        n_ieq = self.model.n_ieq_constr
        # The model does not run for a design that violates a requirement.
        unmet = (table.tested.G[:, n_ieq:] > 0).any(axis=1)
        unknown = failed | unmet
        uniform = table.F[:n_uniform][~unknown[:n_uniform]]
        columns = [without_penalties(table.F, uniform)]
        for output in self.constraints:
            columns.append(np.where(unknown, np.nan, table.column(output.name)))
        for output in self.limited:
            columns.append(output.known_or_beyond(table.column(output.name)))
        for name in self.operands:
            columns.append(table.tested.column(name))
        points = self.model.space.points(table.tested.X)
        eligible = table.eligible()
        Y = np.column_stack(columns)
        return KnownTests(table.numbers, points, Y, eligible, failed, unknown, pending)

    def computed(self, points: Array, Y: Array) -> Array:
        """Return ``(n, q)`` outputs of points, of which some are computed from the others.

        Args:
            points: ``(n, d)`` points of the unit cube.
            Y: ``(n, q)`` outputs as surrogates predict them.
        """
        columns = self._columns(points, Y)
        computed = Y.copy()
        # Others are predicted, such as the absolute value of an equality that is an objective.
        exact = {*self.table.tested.layout.variables, *self.expressions, *self.computed_columns}
        for j, output in enumerate(self.outputs):
            if output.name in exact:
                values = output.sign * columns[output.name]
                if output in self.limited:
                    values = output.known_or_beyond(values)
                computed[:, j] = values
        return bounded(computed)

    def _columns(self, points: Array, Y: Array) -> dict[str, Any]:
        """Return the columns of points by name, those that are computed after their operands."""
        variables = self.table.tested.layout.variables
        columns = dict(zip(variables, self.model.space.matrix(points).T, strict=True))
        of_outputs, of_operands = np.split(Y.T, [len(self.outputs)])
        for output, y in zip(self.outputs, of_outputs, strict=True):
            if output.is_tested and output.name not in variables:
                columns[output.name] = output.sign * y
        columns |= zip(self.operands, of_operands, strict=True)
        if self.expressions:
            columns |= self.model.inner.computed(columns)
        for name, expression in self.computed_columns.items():
            columns[name] = expression.values(columns)
        return columns


def learned_outputs(model: Model | TestedModel, table: TestTable) -> LearnedOutputs:
    """Return the outputs that surrogates learn.

    Args:
        model: The model of the tests.
        table: All tests, under a formulation, whose computed columns are not learned.
    """
    limits = {}
    for name, limit in table.limits.items():
        if not isinstance(limit, list):
            limits[name] = limit
    objectives = _objectives(table, limits)
    constraints = _constraints(table, model.n_ieq_constr)
    names = [*table.layout.outputs]
    if model.space.equalities:  # limits on variables are then no sides of the unit cube
        names += table.layout.variables
    limited = []
    for name, limit in limits.items():
        if name in names:
            limited.append(_Output(name, *limit, name in table.tested.layout.columns))
    outputs = [*objectives, *constraints, *limited]
    computed = _needed(table.formulation.computed, [output.name for output in outputs])
    expressions = _known_expressions(model.inner, table.tested.layout)
    operands = _operands(table.tested.layout, outputs, computed, expressions)
    return LearnedOutputs(
        model, table, limits, objectives, constraints, limited, computed, expressions, operands
    )


def _objectives(table: TestTable, limits: Mapping[str, tuple[float, float]]) -> list[_Output]:
    tested = table.tested.layout
    outputs = []
    for name in table.layout.objectives:
        # An equality that is an objective counts by its absolute value.
        is_tested = name in tested.columns and name not in tested.equalities
        least, greatest = limits.get(name, OPEN)
        output = _Output(name, least, greatest, is_tested)
        if name in table.layout.maximize:
            output = _Output(name, -greatest, -least, is_tested, sign=-1)
        outputs.append(output)
    return outputs


def _constraints(table: TestTable, n_ieq_constr: int) -> list[_Output]:
    requirements = table.tested.layout.inequalities[n_ieq_constr:]
    outputs = []
    for name in table.layout.inequalities:
        if name not in requirements:
            outputs.append(_Output(name, -np.inf, 0.0))
    for name in table.layout.equalities:
        outputs.append(_Output(name, 0.0, 0.0))
    return outputs


def _needed(computed: Mapping[str, str], names: Sequence[str]) -> dict[str, Expression]:
    """Return the expressions, in their order, from which columns of these names follow."""
    needed = {*names}
    expressions: dict[str, Expression] = {}
    for name, text in reversed([*computed.items()]):  # an expression uses columns before it
        if name in needed:
            expression = Expression.of(text)
            needed |= {*expression.columns}
            expressions = {name: expression, **expressions}
    return expressions


def _known_expressions(problem: Any, tested: Layout) -> Mapping[str, Any]:
    """Return the outputs of a problem that are expressions, if they mean the tested columns."""
    expressions = known_expressions(problem)
    if expressions and (
        tested.variables != tuple(problem.variables)
        or tested.objectives != tuple(problem.objectives)
        or {*tested.maximize} != {*problem.maximize}
    ):
        return {}  # they mean other names and signs than those of the run
    return expressions


def _operands(
    tested: Layout,
    outputs: Sequence[_Output],
    computed: Mapping[str, Expression],
    expressions: Mapping[str, Any],
) -> list[str]:
    """Return the columns as tested from which others are computed, without learned outputs."""
    operands = set()
    for output_expression in expressions.values():
        operands |= {*output_expression.operands} & {*tested.outputs}
    for expression in computed.values():
        operands |= {*expression.columns} & {*tested.columns}
    operands -= {*tested.variables}
    operands -= {*expressions}
    operands -= {output.name for output in outputs if output.is_tested}
    return sorted(operands)
