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
from pymoo_psi.table import OPEN, Expression, Formulation, TestTable


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
    """An output that surrogates learn.

    Attributes:
        name: The column.
        role: "objective"; "constraint"; "limited", an output, or a variable whose range depends on
            others; or "operand", a column as tested from which others are computed.
        least: The least value allowed, as the output is minimised.
        greatest: The greatest value allowed, as the output is minimised.
        is_tested: Whether it is a column as tested.
        sign: -1 if it is minimised as the negative of its column.
    """

    name: str
    role: str
    least: float
    greatest: float
    is_tested: bool = True
    sign: int = 1


class LearnedOutputs:
    """The outputs that surrogates learn from tests under a formulation.

    Args:
        model: The model of the tests.
        table: All tests, under the formulation.
        asked: The formulation, whose computed columns are not learned.
    """

    def __init__(self, model: Model | TestedModel, table: TestTable, asked: Formulation) -> None:
        self._model = model
        self._table = table
        tested = table.tested.layout
        self._limits: dict[str, tuple[float, float]] = {}
        for name, limit in table.limits.items():
            if not isinstance(limit, list):
                self._limits[name] = limit
        self._outputs = self._stated()
        self._computed = _needed(asked.computed, [output.name for output in self._outputs])
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
        for expression in self._expressions.values():
            operands |= {*expression.operands} & {*tested.outputs}
        for computed in self._computed.values():
            operands |= {*computed.columns} & {*tested.columns}
        operands -= {*tested.variables}
        operands -= {*self._expressions}
        operands -= {output.name for output in self._outputs if output.is_tested}
        for name in sorted(operands):
            self._outputs.append(_Output(name, "operand", *OPEN))

    def _stated(self) -> list[_Output]:
        """Return the outputs of the formulation, without requirements; objectives come first."""
        layout = self._table.layout
        tested = self._table.tested.layout
        outputs = []
        for name in layout.objectives:
            # An equality that is an objective counts by its absolute value.
            is_tested = name in tested.columns and name not in tested.equalities
            least, greatest = self._limits.get(name, OPEN)
            output = _Output(name, "objective", least, greatest, is_tested)
            if name in layout.maximize:
                output = _Output(name, "objective", -greatest, -least, is_tested, sign=-1)
            outputs.append(output)
        for name in layout.inequalities:
            if name not in tested.inequalities[self._model.n_ieq_constr :]:
                outputs.append(_Output(name, "constraint", -np.inf, 0.0))
        for name in layout.equalities:
            outputs.append(_Output(name, "constraint", 0.0, 0.0))
        dependent = [*layout.outputs]
        if self._model.space.equalities:  # limits on variables are then no sides of the unit cube
            dependent += layout.variables
        for name, limit in self._limits.items():
            if name in dependent:
                outputs.append(_Output(name, "limited", *limit, name in tested.columns))
        return outputs

    @property
    def n_obj(self) -> int:
        """Number of objectives, which come first."""
        return len(self._table.layout.objectives)

    @property
    def goal(self) -> Goal:
        """The goal of a search for the formulation."""
        variables = self._table.tested.layout.variables
        space = self._model.space
        limits = []
        for name in [*self._table.layout.constraints, *self._limits]:
            for j, output in enumerate(self._outputs):
                if output.name == name and output.role != "operand":
                    limits.append((j, output.least, output.greatest))
        # The names of the table, which may be those of the problem or of the run.
        own_names = [variable.name for variable in space.variables]
        titles = dict(zip(own_names, variables, strict=True))
        low = np.zeros(len(space.searched))
        high = np.ones(len(space.searched))
        learned = {output.name for output in self._outputs}
        for j, variable in enumerate(space.searched):
            name = titles[variable.name]
            if name in self._limits and name not in learned:
                low[j], high[j] = variable.between(*self._limits[name])
        compute = None
        if self._computed or self._expressions or learned & {*variables}:
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
            narrowed=bool(self._limits),
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
        columns = [without_penalties(table.F, uniform)]
        for output in self._outputs[self.n_obj :]:
            if output.role == "operand":
                values = table.tested.column(output.name)
            else:
                values = table.column(output.name)
            if output.role == "constraint":
                values = np.where(unknown, np.nan, values)
            elif output.role == "limited":
                values = _known_or_beyond(values, output.least, output.greatest)
            columns.append(values)
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
        # Others are predicted, such as the absolute value of an equality that is an objective.
        exact = {*tested.variables, *self._expressions, *self._computed}
        for output, y in zip(self._outputs, Y.T, strict=True):
            if output.is_tested and output.name not in tested.variables:
                columns[output.name] = output.sign * y
        if self._expressions:
            columns |= self._model.inner.computed(columns)
        for name, expression in self._computed.items():
            columns[name] = expression.values(columns)
        for output, y in zip(self._outputs, Y.T, strict=True):
            if output.name not in exact:
                continue
            y[:] = output.sign * columns[output.name]
            if output.role == "limited":
                y[:] = _known_or_beyond(y, output.least, output.greatest)
        return bounded(Y)


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
