"""The outputs that surrogates learn under a formulation, and the task of a search on them.

Columns that a formulation computes are not learned: they follow from learned outputs and from the
variables, as do the outputs of a problem that are expressions.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from pymoo_psi._validation import AnyArray, Array, Mask
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._surrogate_models import Learned, bounded, encoded, without_penalties
from pymoo_psi.problems import DesignSpace, known_expressions
from pymoo_psi.table import Decision, Expression, Limit, Schema, TestTable

# A predicted equality counts as met within this many standard deviations.
_EQUALITY_TOLERANCE = 0.01

_Limits = Mapping[str, Limit]


class _Output(NamedTuple):
    """An output of a formulation that surrogates learn.

    Attributes:
        name: The column.
        least: The least value allowed, as the output is minimised.
        greatest: The greatest value allowed, as the output is minimised.
        is_tested: Whether it is a column as tested.
        sign: -1 if it is minimised as the negative of its column.
        is_limited: Whether it is learned for its limits only, neither objective nor constraint.
    """

    name: str
    least: float
    greatest: float
    is_tested: bool = True
    sign: float = 1.0
    is_limited: bool = False

    def known_or_beyond(self, values: Array) -> Array:
        """Return ``(n,)`` values of the output; beyond its limits where a design has none."""
        finite = values[np.isfinite(values)]
        if len(finite) == 0:
            return values
        beyond = max(finite.max(), self.greatest + np.ptp(finite))
        if self.greatest == np.inf:
            beyond = min(finite.min(), self.least - np.ptp(finite))
        return np.where(np.isnan(values), beyond, values)


class Task:
    """The task of a search: the tests so far, and the objectives and limits of a formulation.

    The outputs that surrogates learn are, in this order: the objectives; the constraints; other
    columns that have a limit; and the operands, columns as tested from which others are computed.

    Args:
        table: All tests, under the formulation.
        model: The model of the tests.
        n_uniform: How many of the tests, the first, are of the sequence or of other runs.
        pending: ``(p, d)`` points that are being tested; the predictions of the surrogates stand
            for their outputs.

    Attributes:
        n_uniform: How many of the tests are uniform.
        pending: The points that are being tested.
        numbers: ``(n,)`` the numbers of the tests, increasing.
        points: ``(n, d)`` points of the unit cube, from which :class:`DesignSpace` makes designs.
        Y: ``(n, q)`` their outputs.
        eligible: ``(n,)`` whether a test keeps all constraints and limits, with finite objectives.
        failed: ``(n,)`` whether the model ran but returned no outputs.
        unknown: ``(n,)`` whether there are no outputs: the test failed, or the model did not run.
        n_obj: Number of objectives, which are the first outputs, all minimised.
        limits: ``(column, least, greatest)`` for constraints, and for outputs that have limits;
            infinite where there is none.
        low: ``(d,)`` lower limits on variables, in the unit cube.
        high: ``(d,)`` upper limits on variables, in the unit cube.
        ranges: ``(2, m)`` lower and upper values by which objectives are scaled, as these are
            minimised; ``None`` for those of the Pareto set.
        is_narrowed: Whether limits narrow the problem, which tests so far may have been far from.
        is_directed: Whether limits or ranges of a decision direct the search.
        is_computed: Whether some outputs are known functions of the variables and of others.
    """

    def __init__(
        self,
        table: TestTable,
        model: Model,
        n_uniform: int,
        pending: Array,
    ) -> None:
        tested = replace(table, decision=Decision())
        problem = model.inner
        space = model.space
        variables = tested.schema.variables
        numeric_limits = {}
        self._options = {}  # allowed texts, by the column of a variable
        for name, limit in table.limits.items():
            if limit.texts is None:
                numeric_limits[name] = limit
            elif name in variables:
                self._options[variables.index(name)] = limit.texts
        outputs = _outputs(table, space, numeric_limits, model.n_ieq_constr)
        names = {output.name for output in outputs}
        expressions = _expressions(problem, tested.schema)
        computed = _needed(table.formulation.computed, names)
        operands = _operands(tested.schema, outputs, {**expressions, **computed})
        self.failed = table.status == "failed"
        # The model does not run for a design that violates a requirement.
        self.unknown = self.failed | (tested.G[:, model.n_ieq_constr :] > 0).any(axis=1)

        self._variables = variables
        self._model = model
        self._outputs = outputs
        self._expressions = expressions
        self._computed = computed
        self._operands = operands
        self.n_uniform = n_uniform
        self.pending = pending
        self.numbers = table.numbers
        self.points = space.points(tested.X)
        self.Y = _learned_values(table, outputs, operands, n_uniform, self.unknown)
        self.eligible = table.eligible()
        self.n_obj = len(table.schema.objectives)
        self.limits = []
        for name in (*table.schema.constraints, *numeric_limits):
            for j, output in enumerate(outputs):
                if output.name == name:
                    self.limits.append((j, output.least, output.greatest))
        self.low, self.high = _limits_of_cube(variables, space, numeric_limits, names)
        self.ranges = _ranges(table)
        self.is_narrowed = bool(numeric_limits)
        self.is_directed = self.is_narrowed or self.ranges is not None
        has_variables = not names.isdisjoint(variables)
        self.is_computed = has_variables or bool(expressions or computed)

    def encode(self, points: Array) -> Array:
        """Return ``(n, d)`` points as surrogates see them, ``(n, e)``."""
        return encoded(self._model.space, points)

    def violations(self, points: Array) -> Array:
        """Return ``(n, k)`` by how much points violate requirements, and limits on texts.

        No proposal violates one.
        """
        X = self._model.space.matrix(points)
        columns: list[AnyArray] = [self._model.violations(X)]
        for j, options in self._options.items():
            columns.append(~np.isin(X[:, [j]].astype(str), options))
        return np.hstack(columns)

    def excess(self, T: Array, learned: Learned, margins: Array) -> Array:
        """Return ``(n, c)`` by how much outputs, on their scales, exceed each limit.

        Where limits narrow a problem, an excess counts less if surrogates predict the output badly:
        otherwise a search would avoid what they wrongly take for infeasible.

        Args:
            T: ``(n, q)`` outputs on their scales.
            learned: The scales, and the errors of surrogates.
            margins: ``(n, q)`` how far from its limits an output has to be.
        """
        columns = [np.zeros((len(T), 0))]
        for j, least, greatest in self.limits:
            output = learned.outputs[j]
            margin = margins[:, j]
            if least == greatest:
                margin = np.full(len(T), -_EQUALITY_TOLERANCE)
            unit = 1.0
            if self.is_narrowed:
                unit = np.sqrt(max(output.error, _EQUALITY_TOLERANCE))
            for end, sign in ((least, -1), (greatest, 1)):
                if np.isfinite(end):
                    beyond = sign * (T[:, j] - output.scale.to(end))
                    columns.append(((beyond + margin) / unit)[:, None])
        return np.hstack(columns)

    def computed(self, points: Array, Y: Array) -> Array:
        """Return ``(n, q)`` outputs of points, of which some are computed from the others.

        Args:
            points: ``(n, d)`` points of the unit cube.
            Y: ``(n, q)`` outputs as surrogates predict them.
        """
        variables = self._variables
        columns = dict(zip(variables, self._model.space.matrix(points).T, strict=True))
        for output, y in zip(self._outputs, Y.T, strict=False):
            if output.is_tested and output.name not in variables:
                columns[output.name] = output.sign * y
        columns |= zip(self._operands, Y.T[len(self._outputs) :], strict=True)
        if self._expressions:
            columns |= self._model.inner.computed(columns)
        for name, expression in self._computed.items():
            columns[name] = expression.values(columns)
        computed = Y.copy()
        # Others are predicted, such as the absolute value of an equality that is an objective.
        exact = {*variables, *self._expressions, *self._computed}
        for j, output in enumerate(self._outputs):
            if output.name in exact:
                values = output.sign * columns[output.name]
                if output.is_limited:
                    values = output.known_or_beyond(values)
                computed[:, j] = values
        return bounded(computed)


def _outputs(
    table: TestTable,
    space: DesignSpace,
    limits: _Limits,
    n_ieq_constr: int,
) -> list[_Output]:
    """Return the outputs that surrogates learn, without operands.

    Args:
        table: All tests, under the formulation.
        space: The variables.
        limits: The limits that are numbers, by column.
        n_ieq_constr: The number of inequalities before requirements, which are not learned.
    """
    tested = table.evaluated
    schema = table.schema
    outputs = []
    for name, sign in zip(schema.objectives, schema.sign.tolist(), strict=True):
        # An equality that is an objective counts by its absolute value.
        is_tested = name in tested.names and name not in tested.of_role("equality")
        limit = limits.get(name, Limit())
        least, greatest = sorted((sign * limit.low, sign * limit.high))
        outputs.append(_Output(name, least, greatest, is_tested, sign))
    requirements = tested.of_role("inequality")[n_ieq_constr:]
    for name in schema.of_role("inequality"):
        if name not in requirements:
            outputs.append(_Output(name, -np.inf, 0.0))
    for name in schema.of_role("equality"):
        outputs.append(_Output(name, 0.0, 0.0))
    for name, limit in limits.items():
        # Under equalities, limits on variables are no sides of the unit cube.
        if name in schema.outputs or (space.equalities and name in schema.variables):
            is_tested = name in tested.names
            outputs.append(_Output(name, limit.low, limit.high, is_tested, is_limited=True))
    return outputs


def _limits_of_cube(
    variables: Sequence[str],
    space: DesignSpace,
    limits: _Limits,
    learned: Collection[str],
) -> Array:
    """Return the ``(2, d)`` lower and upper limits on variables, in the unit cube.

    Args:
        variables: The names of the variables in the table, which may be those of the problem or of
            the run.
        space: The variables.
        limits: Limits on columns, by name.
        learned: Columns whose limits are those of learned outputs instead.
    """
    cube = np.zeros((2, len(space.searched)))
    cube[1] = 1.0
    names = dict(zip(space.variable_names, variables, strict=True))
    for j, variable in enumerate(space.searched):
        name = names[variable.name]
        if name in limits and name not in learned:
            cube[:, j] = variable.between(limits[name].low, limits[name].high)
    return cube


def _ranges(table: TestTable) -> Array | None:
    """Return the ``(2, m)`` ranges of a formulation, in which all objectives are minimised."""
    ranges = table.formulation.ranges
    if not ranges:
        return None
    pairs = [ranges[name] for name in table.schema.objectives]
    return np.sort(np.array(pairs).T * table.schema.sign, axis=0)


def _learned_values(
    table: TestTable,
    outputs: Sequence[_Output],
    operands: Sequence[str],
    n_uniform: int,
    unknown: Mask,
) -> Array:
    """Return the ``(n, q)`` values of outputs and operands; the arguments are those of a task."""
    uniform = table.F[:n_uniform][~unknown[:n_uniform]]
    columns = [without_penalties(table.F, uniform)]
    for output in outputs[table.F.shape[1] :]:
        column = table.column(output.name)
        if output.is_limited:
            columns.append(output.known_or_beyond(column))
        else:
            columns.append(np.where(unknown, np.nan, column))
    for name in operands:
        columns.append(table.data[name])
    return np.column_stack(columns)


def _needed(computed: Mapping[str, str], names: Collection[str]) -> dict[str, Expression]:
    """Return the expressions, in their order, from which columns of these names follow."""
    needed = {*names}
    expressions: dict[str, Expression] = {}
    for name, text in reversed([*computed.items()]):  # an expression uses columns before it
        if name in needed:
            expression = Expression.of(text)
            needed |= {*expression.columns}
            expressions = {name: expression, **expressions}
    return expressions


def _expressions(problem: Any, tested: Schema) -> Mapping[str, Any]:
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
    tested: Schema, outputs: Sequence[_Output], expressions: Mapping[str, Expression]
) -> list[str]:
    """Return the columns as tested that expressions need beside known and learned ones."""
    operands: set[str] = set()
    for expression in expressions.values():
        operands.update(expression.columns)
    learned = {output.name for output in outputs if output.is_tested}
    return sorted((operands & {*tested.names}) - {*tested.variables} - {*expressions} - learned)
