"""What a search on surrogates seeks, which tests they see, and what they learn from these.

Columns that a formulation computes are not learned: they follow from learned outputs and from the
variables, as do the outputs of a problem that are expressions.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from itertools import compress
from typing import NamedTuple

import numpy as np

from pymoo_psi._validation import AnyArray, Array, Mask, Names
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._surrogate_models import (
    Kernel,
    OutputFit,
    bounded,
    encoded,
    evenly_spread,
    without_penalties,
)
from pymoo_psi.table import Decision, Expression, Limit, TestTable

# A predicted equality counts as met within this many standard deviations.
_EQUALITY_TOLERANCE = 0.01


class _Output(NamedTuple):
    """An output of a formulation that surrogates learn.

    Attributes:
        least: The least value allowed, as the output is minimised.
        greatest: The greatest value allowed, as the output is minimised.
        sign: -1 if it is minimised as the negative of its column.
        is_limited: Whether it is learned for its limits only, neither objective nor constraint.
    """

    least: float
    greatest: float
    sign: float
    is_limited: bool

    def learned(self, values: Array) -> Array:
        """Return ``(n,)`` values of the output to learn; those that are NaN exceed its limits."""
        if not self.is_limited:
            return values
        finite = values[np.isfinite(values)]
        if len(finite) == 0:
            return values
        beyond = max(finite.max(), self.greatest + np.ptp(finite))
        if self.greatest == np.inf:
            beyond = min(finite.min(), self.least - np.ptp(finite))
        return np.where(np.isnan(values), beyond, values)


@dataclass(frozen=True)
class Goal:
    """What a search seeks: the objectives of a formulation, within constraints and limits.

    The outputs that surrogates learn are, in this order: the objectives; the constraints; other
    columns that have a limit; and the operands, columns as tested from which others are computed.

    Attributes:
        model: The model of the tests.
        n_obj: Number of objectives, which are the first outputs, all minimised.
        outputs: The outputs but for the operands, by name.
        operands: The names of the operands.
        expressions: The columns that are computed, in their order.
        limits: The indices of constraints, and of outputs that have limits.
        texts: The allowed texts of choices, by the index of the variable.
        low: ``(d,)`` lower limits on variables, in the unit cube.
        high: ``(d,)`` upper limits on variables, in the unit cube.
        ranges: ``(2, m)`` lower and upper values by which objectives are scaled, as these are
            minimised; ``None`` for those of the Pareto set.
        is_narrowed: Whether limits narrow the problem, which tests so far may have been far from.
    """

    model: Model
    n_obj: int
    outputs: Mapping[str, _Output]
    operands: Names
    expressions: Mapping[str, Expression]
    limits: list[int]
    texts: Mapping[int, Names]
    low: Array
    high: Array
    ranges: Array | None
    is_narrowed: bool

    @classmethod
    def of(cls, table: TestTable, model: Model) -> Goal:
        """Return the goal of a table under a formulation."""
        variables = model.schema.variables
        limits = {}
        texts = {}
        for name, limit in table.limits.items():
            if limit.texts is None:
                limits[name] = limit
            else:
                texts[variables.index(name)] = limit.texts
        allowed = _limits_of_constraints(table, model) | limits
        outputs = _outputs(table, allowed, model)
        names = [*outputs]
        expressions = {
            **getattr(model.program, "known_expressions", {}),
            **_needed(table.formulation.computed, names),
        }
        low, high = _limits_of_cube(model, limits, names)
        return cls(
            model=model,
            n_obj=len(table.schema.objectives),
            outputs=outputs,
            operands=_operands(table, outputs, expressions),
            expressions=expressions,
            limits=[names.index(name) for name in allowed if name in names],
            texts=texts,
            low=low,
            high=high,
            ranges=_ranges(table),
            is_narrowed=bool(limits),
        )

    @property
    def is_directed(self) -> bool:
        """Whether limits or ranges of a decision direct the search."""
        return self.is_narrowed or self.ranges is not None

    @property
    def is_computed(self) -> bool:
        """Whether some outputs are known functions of the variables and of others."""
        return bool(self.expressions) or not self.outputs.keys().isdisjoint(
            self.model.schema.variables
        )

    def encode(self, points: Array) -> Array:
        """Return ``(n, d)`` points as surrogates see them, ``(n, e)``."""
        return encoded(self.model.space, self.model.space.places_at(points))

    def violations(self, points: Array) -> Array:
        """Return ``(n, k)`` by how much points violate requirements, and limits on texts.

        No proposal violates one.
        """
        X = self.model.space.matrix(points)
        columns: list[AnyArray] = [self.model.violations(X)]
        for j, texts in self.texts.items():
            columns.append(~np.isin(X[:, [j]].astype(str), texts))
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
        outputs = [*self.outputs.values()]
        for j in self.limits:
            fit = learned.outputs[j]
            least, greatest, *_ = outputs[j]
            margin: Array | float = margins[:, j]
            if least == greatest:
                margin = -_EQUALITY_TOLERANCE
            unit = 1.0
            if self.is_narrowed:
                unit = np.sqrt(max(fit.error, _EQUALITY_TOLERANCE))
            for end, sign in ((least, -1), (greatest, 1)):
                if np.isfinite(end):
                    beyond = sign * (T[:, j] - fit.scale.to(end))
                    columns.append(((beyond + margin) / unit)[:, None])
        return np.hstack(columns)

    def computed(self, points: Array, Y: Array) -> Array:
        """Return ``(n, q)`` outputs of points, of which some are computed from the others.

        Args:
            points: ``(n, d)`` points of the unit cube.
            Y: ``(n, q)`` outputs as surrogates predict them.
        """
        columns: dict[str, AnyArray] = {}
        for (name, output), y in zip(self.outputs.items(), Y.T, strict=False):
            columns[name] = output.sign * y
        columns |= zip(self.operands, Y.T[len(self.outputs) :], strict=True)
        variables = self.model.schema.variables
        columns |= zip(variables, self.model.space.matrix(points).T, strict=True)
        for name, expression in self.expressions.items():
            columns[name] = expression.values(columns)
        computed = Y.copy()
        # Others are predicted, such as the absolute value of an equality that is an objective.
        for j, (name, output) in enumerate(self.outputs.items()):
            if name in variables or name in self.expressions:
                computed[:, j] = output.learned(output.sign * columns[name])
        return bounded(computed)


@dataclass(frozen=True)
class Observations:
    """What surrogates learn from: tests, and points that are being tested.

    Attributes:
        points: ``(n, d)`` points of the unit cube, from which :class:`DesignSpace` makes designs;
            those nearest to tests outside the bounds.
        Z: ``(n, e)`` the tests as surrogates see them.
        Y: ``(n, q)`` the outputs that a goal needs.
        is_eligible: ``(n,)`` whether a test keeps all constraints, limits and bounds, with finite
            objectives.
        has_failed: ``(n,)`` whether the model ran but returned no outputs.
        is_known: ``(n,)`` whether there are outputs: the model ran, and the test has not failed.
        n_uniform: How many of the tests, the first, are of the sequence or of other runs.
        pending: ``(p, d)`` points that are being tested; the predictions of the surrogates stand
            for their outputs.
    """

    points: Array
    Z: Array
    Y: Array
    is_eligible: Mask
    has_failed: Mask
    is_known: Mask
    n_uniform: int
    pending: Array

    def seen(self, goal: Goal) -> Array:
        """Return the ``(n + p, e)`` tests and pending points as surrogates see them."""
        return np.vstack([self.Z, goal.encode(self.pending)])

    @classmethod
    def of(cls, table: TestTable, goal: Goal, n_uniform: int, pending: Array) -> Observations:
        """Return the tests of a table under the formulation of a goal."""
        tested = replace(table, decision=Decision())
        space = goal.model.space
        has_failed = table.status == "failed"
        # The model does not run for a design that violates a requirement.
        requirements = tested.G[:, goal.model.n_ieq_constr :]
        is_known = ~has_failed & ~(requirements > 0).any(axis=1)
        uniform = table.F[:n_uniform][is_known[:n_uniform]]
        columns = [without_penalties(table.F, uniform)]
        for name, output in [*goal.outputs.items()][goal.n_obj :]:
            columns.append(output.learned(np.where(is_known, table.column(name), np.nan)))
        columns += [table.data[name] for name in goal.operands]
        return cls(
            space.points(tested.X),
            encoded(space, space.places(tested.X)),
            np.column_stack(columns),
            table.feasible() & space.are_near(tested.X),
            has_failed,
            is_known,
            n_uniform,
            pending,
        )


def _limits_of_constraints(table: TestTable, model: Model) -> dict[str, Limit]:
    """Return what constraints allow, by column; requirements are not learned."""
    schema = table.schema
    limits = {}
    for name in table.evaluated.of_role("inequality")[: model.n_ieq_constr]:
        if name in schema.constraints:
            limits[name] = Limit(upper=0.0)
    return limits | dict.fromkeys(schema.of_role("equality"), Limit(0.0, 0.0))


def _ranges(table: TestTable) -> Array | None:
    """Return the ``(2, m)`` ranges that a formulation gives the objectives, as minimised."""
    schema = table.schema
    ranges = table.formulation.ranges
    if not ranges:
        return None
    pairs = np.array([ranges[name] for name in schema.objectives])
    return np.sort(pairs.T * schema.sign, axis=0)


def _outputs(table: TestTable, allowed: Mapping[str, Limit], model: Model) -> dict[str, _Output]:
    """Return the outputs that surrogates learn, without operands.

    Args:
        table: All tests, under the formulation.
        allowed: What constraints allow, and limits that are numbers, by column.
        model: The model of the tests.
    """
    schema = table.schema
    outputs = {}
    for name in dict.fromkeys((*schema.objectives, *allowed)):
        is_objective = name in schema.objectives
        if name in schema.variables and not model.space.equalities:
            continue  # its limits are sides of the unit cube
        sign = 1.0
        if name in schema.maximize:
            sign = -1.0
        limit = allowed.get(name, Limit())
        least, greatest = sorted((sign * limit.lower, sign * limit.upper))
        is_limited = not is_objective and name not in schema.constraints
        outputs[name] = _Output(least, greatest, sign, is_limited)
    return outputs


def _limits_of_cube(model: Model, limits: Mapping[str, Limit], learned: Names) -> Array:
    """Return the ``(2, d)`` lower and upper limits on variables, in the unit cube.

    Args:
        model: The model, with the variables.
        limits: Limits on columns, by name.
        learned: Columns whose limits are those of learned outputs instead.
    """
    names = compress(model.schema.variables, model.space.are_searched)
    cube = []
    for variable, name in zip(model.space.searched, names, strict=True):
        ends = 0.0, 1.0
        if name in limits and name not in learned:
            ends = variable.between(limits[name].lower, limits[name].upper)
        cube.append(ends)
    return np.transpose(cube)


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


def _operands(
    table: TestTable, outputs: Collection[str], expressions: Mapping[str, Expression]
) -> list[str]:
    """Return the columns as tested that expressions need beside known and learned ones."""
    tested = table.evaluated
    operands = {name for expression in expressions.values() for name in expression.columns}
    operands &= {*tested.names}
    return sorted(operands - {*tested.variables, *expressions, *outputs})


# What is learned

LEAST_LEARNED = 4  # with fewer known tests there is no surrogate
# Failures are taken to be random if each is predicted from all other tests with an error of this
# many standard deviations or more. Those of 10 % at random have errors of 0.85 to 1.1.
_ERROR_OF_RANDOM_FAILURES = 0.9
_MOST_FAILURES = 96  # tests from which it is learned how they fail, so that it takes little time


class Learned(NamedTuple):
    """What is fitted to tests: the surrogates of further ones have the same scales and kernels.

    Attributes:
        outputs: What is fitted, for each output.
        failures: The kernel of failures: tests fail alike if they are close together in its units.
            ``None`` if failures do not follow from the design, as far as is known.
    """

    outputs: list[OutputFit]
    failures: Kernel | None

    def to(self, Y: Array) -> Array:
        """Return ``(n, k)`` values of the first k outputs on their scales."""
        columns = [output.scale.to(y) for output, y in zip(self.outputs, Y.T, strict=False)]
        return np.column_stack(columns)

    def back(self, T: Array) -> Array:
        """Return ``(n, k)`` values of the first k outputs, given on their scales."""
        columns = [output.scale.back(t) for output, t in zip(self.outputs, T.T, strict=False)]
        return np.column_stack(columns)


def learned_from(tests: Observations, goal: Goal, n_fitted: int) -> Learned | None:
    """Return what is fitted to the first tests; ``None`` if too few of them are known.

    Args:
        tests: The tests.
        goal: What is sought among them.
        n_fitted: How many tests these are.
    """
    rows = np.flatnonzero(tests.is_known[:n_fitted])
    if len(rows) < LEAST_LEARNED:
        return None
    Z = tests.Z[rows]
    Y = bounded(tests.Y[rows])
    n_uniform = max(int(np.count_nonzero(rows < tests.n_uniform)), LEAST_LEARNED)
    outputs = [
        OutputFit.of(Z, y, y[:n_uniform], constraint=j >= goal.n_obj) for j, y in enumerate(Y.T)
    ]
    return Learned(outputs, _kernel_of_failures(tests, n_fitted))


def _kernel_of_failures(tests: Observations, n_fitted: int) -> Kernel | None:
    """Return the kernel that is fitted to failures of the first tests; see :class:`Learned`."""
    rows = np.flatnonzero((tests.is_known | tests.has_failed)[:n_fitted])
    rows = rows[evenly_spread(len(rows), _MOST_FAILURES)]
    has_failed = tests.has_failed[rows].astype(float)
    if not has_failed.any():
        return None
    fit = OutputFit.of(tests.Z[rows], has_failed, has_failed, constraint=False)
    if fit.error >= _ERROR_OF_RANDOM_FAILURES:
        return None
    return fit.kernel
