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


class LearnedOutputs:
    """The outputs that surrogates learn from tests under a formulation.

    They are, in this order: the objectives; the constraints, without requirements; other columns
    that have a limit; and operands, columns as tested from which others are computed.

    Args:
        model: The model of the tests.
        table: All tests, under the formulation.
        formulation: The formulation, whose computed columns are not learned.
    """

    def __init__(
        self, model: Model | TestedModel, table: TestTable, formulation: Formulation
    ) -> None:
        self._model = model
        self._table = table
        self._limits: dict[str, tuple[float, float]] = {}
        for name, limit in table.limits.items():
            if not isinstance(limit, list):
                self._limits[name] = limit
        self._objectives = self._objective_outputs()
        self._constraints = self._constraint_outputs()
        self._limited = self._limited_outputs()
        self._outputs = [*self._objectives, *self._constraints, *self._limited]
        self._computed = _needed(formulation.computed, [output.name for output in self._outputs])
        self._expressions = self._expressions_of_model()
        self._operands = self._operand_names()

    def _objective_outputs(self) -> list[_Output]:
        layout = self._table.layout
        tested = self._table.tested.layout
        outputs = []
        for name in layout.objectives:
            # An equality that is an objective counts by its absolute value.
            is_tested = name in tested.columns and name not in tested.equalities
            least, greatest = self._limits.get(name, OPEN)
            output = _Output(name, least, greatest, is_tested)
            if name in layout.maximize:
                output = _Output(name, -greatest, -least, is_tested, sign=-1)
            outputs.append(output)
        return outputs

    def _constraint_outputs(self) -> list[_Output]:
        layout = self._table.layout
        requirements = self._table.tested.layout.inequalities[self._model.n_ieq_constr :]
        outputs = []
        for name in layout.inequalities:
            if name not in requirements:
                outputs.append(_Output(name, -np.inf, 0.0))
        for name in layout.equalities:
            outputs.append(_Output(name, 0.0, 0.0))
        return outputs

    def _limited_outputs(self) -> list[_Output]:
        layout = self._table.layout
        names = [*layout.outputs]
        if self._model.space.equalities:  # limits on variables are then no sides of the unit cube
            names += layout.variables
        outputs = []
        for name, limit in self._limits.items():
            if name in names:
                outputs.append(_Output(name, *limit, name in self._table.tested.layout.columns))
        return outputs

    def _expressions_of_model(self) -> Mapping[str, Any]:
        """Return the outputs of the problem that are expressions, if they mean these columns."""
        tested = self._table.tested.layout
        problem = self._model.inner
        expressions = known_expressions(problem)
        if expressions and (
            tested.variables != tuple(problem.variables)
            or tested.objectives != tuple(problem.objectives)
            or {*tested.maximize} != {*problem.maximize}
        ):
            return {}  # they mean other names and signs than those of the run
        return expressions

    def _operand_names(self) -> list[str]:
        tested = self._table.tested.layout
        operands = set()
        for expression in self._expressions.values():
            operands |= {*expression.operands} & {*tested.outputs}
        for computed in self._computed.values():
            operands |= {*computed.columns} & {*tested.columns}
        operands -= {*tested.variables}
        operands -= {*self._expressions}
        operands -= {output.name for output in self._outputs if output.is_tested}
        return sorted(operands)

    @property
    def n_obj(self) -> int:
        """Number of objectives, which come first."""
        return len(self._objectives)

    @property
    def goal(self) -> Goal:
        """The goal of a search for the formulation."""
        variables = self._table.tested.layout.variables
        space = self._model.space
        limits = []
        for name in [*self._table.layout.constraints, *self._limits]:
            for j, output in enumerate(self._outputs):
                if output.name == name:
                    limits.append((j, output.least, output.greatest))
        # The names of the table, which may be those of the problem or of the run.
        own_names = [variable.name for variable in space.variables]
        titles = dict(zip(own_names, variables, strict=True))
        low = np.zeros(len(space.searched))
        high = np.ones(len(space.searched))
        learned = {output.name for output in self._outputs}.union(self._operands)
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
        for output in self._constraints:
            columns.append(np.where(unknown, np.nan, table.column(output.name)))
        for output in self._limited:
            columns.append(output.known_or_beyond(table.column(output.name)))
        for name in self._operands:
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
        variables = self._table.tested.layout.variables
        columns = dict(zip(variables, self._model.space.matrix(points).T, strict=True))
        of_outputs, of_operands = np.split(Y.T, [len(self._outputs)])
        for output, y in zip(self._outputs, of_outputs, strict=True):
            if output.is_tested and output.name not in variables:
                columns[output.name] = output.sign * y
        columns |= zip(self._operands, of_operands, strict=True)
        if self._expressions:
            columns |= self._model.inner.computed(columns)
        for name, expression in self._computed.items():
            columns[name] = expression.values(columns)
        # Others are predicted, such as the absolute value of an equality that is an objective.
        exact = {*variables, *self._expressions, *self._computed}
        for output, y in zip(self._outputs, of_outputs, strict=True):
            if output.name in exact:
                y[:] = output.sign * columns[output.name]
                if output in self._limited:
                    y[:] = output.known_or_beyond(y)
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
