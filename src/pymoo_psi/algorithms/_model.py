"""The model of a run: its problem, the columns of its tests, and the formulation they are under.

Executors, stores and sources share it. It makes tables of what a problem returns, and the values
that a problem would return of stored tests.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    Array,
    Columns,
    Designs,
    Entries,
    Mask,
    Names,
    Values,
    counted,
    known_name,
    mapping,
    name_list,
)
from pymoo_psi.algorithms._sources import Points, RunOptions
from pymoo_psi.pareto import constraint_violation
from pymoo_psi.problems import (
    NO_OUTPUTS,
    ProgramProblem,
    columns_of_values,
    design_space,
    evaluate_designs,
    known_limits,
    problem_schema,
    untolerant,
    with_requirements,
    within_same_columns,
    without_requirements,
)
from pymoo_psi.table import (
    PROPOSAL_ROUND,
    RESERVED,
    Formulation,
    Schema,
    TestTable,
    choice_values,
    designs_of,
)


class Model:
    """The model of a run: a problem, its variables, and tests made of its values.

    Args:
        problem: A pymoo problem.
        options: The options of the run.
        repeat: Which of the tests of each design these are, from 1; 0 for tests of a noisy model
            from elsewhere.

    Attributes:
        problem: The problem with its requirements, not tolerant of failures.
        inner: The same problem without its requirements.
        space: Its variables.
        schema: The columns that the problem promises.
        default_limits: The limits of the problem, by column.
        formulation: The formulation of the run, with these limits where it says no others.
        repeat: Which of the tests of each design these are.
        noisy: Whether tests of the same design differ.
        awaited: The outputs that the formulation uses, until a test has them.
    """

    def __init__(self, problem: Any, options: RunOptions, repeat: int = 1) -> None:
        self.repeat = repeat
        self.noisy: bool = getattr(problem, "noisy", False)
        self.problem: Any = with_requirements(untolerant(problem), options.requirements)
        self.inner: Any = without_requirements(self.problem)
        names = options.names
        log = options.log
        if names is not None:
            names = mapping("names", names, "names such as f1 to your own")
            if log is not None:
                default_names = {own: name for name, own in names.items()}
                log = [default_names.get(name, name) for name in name_list("log", log)]
            if self.has_requirements:
                names = self.problem.rule_names | names
        self.space = design_space(self.problem, log=log)
        schema = problem_schema(self.problem, self.space, names, options.maximize, options.units)
        self.default_limits = known_limits(self.problem, schema)
        constraints = schema.of_role("inequality")  # a table has the limits instead
        self.schema = schema.without(constraints[: len(self.default_limits)])
        formulation = options.formulation or Formulation(limits=options.limits)
        self.formulation = self.with_default_limits(formulation)
        known = {*schema.names, *self.formulation.units}
        self.awaited = {*self.formulation.columns} - known

    def with_default_limits(self, formulation: Formulation) -> Formulation:
        """Return a formulation with the limits of the problem where it says no others.

        Raises:
            ArgumentValueError: A limit allows a choice of an option that the problem does not have.
        """
        variables = design_space(within_same_columns(self.inner)).variables
        for name, variable in zip(self.schema.variables, variables, strict=True):
            options = [*map(str, variable.options)]
            if options and name in formulation.allowed:
                for text in formulation.allowed[name].texts or ():
                    known_name(f"{name!r} in limits", text, options)
        return formulation.combine_first(Formulation(limits=self.default_limits))

    # Tests under the formulation

    def under_so_far(self, tests: TestTable, formulation: Formulation | None = None) -> TestTable:
        """Return tests of a run, perhaps not yet all of them, under its formulation or another.

        The formulation may use an output of which nothing is known before a test has run without
        failing. Until then, no test keeps a limit on it.
        """
        formulation = formulation or self.formulation
        present = (*formulation.computed, *tests.schema.names)
        names = dict.fromkeys([*formulation.columns, *formulation.units])
        missing = [name for name in names if name not in present]
        if missing:
            unknown = np.full(len(tests), np.nan)
            tests = tests.with_outputs(dict.fromkeys(missing, unknown))
        return tests.under(formulation)

    def require_outputs(self, names: Collection[str]) -> None:
        """Refuse a formulation that uses an output which the first test without failure lacks.

        Outputs that only some designs have are promised by their units.

        Args:
            names: The columns of a test.
        """
        for name in self.awaited.difference(names):
            title = "a name in the formulation"
            if name in self.formulation.allowed:
                title = "a name in limits"
            known = {*self.schema.names, *names} - {*self.schema.constraints, *NO_OUTPUTS}
            remedy = "an output that only some designs have must have a unit"
            known_name(title, name, known, remedy)
        self.awaited.clear()

    def require_results(self, tests: TestTable, n_tests: int, stacklevel: int) -> None:
        """Refuse a formulation at the end of a run that uses an output which the tests lack.

        A warning says if all tests have failed, as the front is merely empty, or if none has an
        output with a unit, which may be one that only some designs have.

        Args:
            tests: The tests, or those that are left of a run that keeps some.
            n_tests: How many there were.
            stacklevel: That of the line that is to blame.
        """
        if len(tests) > 0 and tests.failed().all():
            first = tests.reasons[int(tests.numbers[0])]
            message = f"{n_tests} of {counted(n_tests, 'test')} failed: {first}; see table.reasons"
            warnings.warn(message, stacklevel=stacklevel)
        elif np.isfinite(tests.F).any():
            self.require_outputs(tests.schema.names)
            for name in self.schema.outputs:  # promised by their units
                if np.isnan(tests.column(name)).all():
                    message = f"no test of the table has the output {name!r}, whose unit is given"
                    warnings.warn(message, stacklevel=stacklevel)

    def total_violation(self, tests: TestTable) -> Array:
        """``(n,)`` pymoo's constraint violation of designs, with that of the limits.

        It is infinite where a design failed, or a value that has a limit is none or not finite.
        """
        table = self.under_so_far(tests)
        total = constraint_violation(table.G, table.H, table.schema.eq_tolerance)
        excess = np.zeros(len(table))
        for name, limit in table.limits.items():
            excess += limit.excess(name, table.column(name))
        return np.where(table.status == "failed", np.inf, total + excess)

    # Requirements

    @property
    def has_requirements(self) -> bool:
        """Whether designs must meet requirements before the problem is evaluated."""
        return self.problem is not self.inner

    def violations(self, X: Designs) -> Array:
        """``(n, k)`` by how much n designs violate the k requirements; <= 0 where they are met."""
        if not self.has_requirements:
            return np.zeros((len(X), 0))
        violations: Array = self.problem.amounts(X)
        return violations

    def meets_requirements(self, X: Designs) -> Mask:
        """``(n,)`` which of n designs violate no requirement."""
        return np.asarray((self.violations(X) <= 0).all(axis=1))

    def designs(self, columns: Entries) -> Designs:
        """Return ``(n, n_var)`` designs of ``(n,)`` variables by name, choices as texts."""
        columns = with_options(columns, self.schema.variables, self.schema.kinds)
        return np.column_stack([columns[name].astype(object) for name in self.schema.variables])

    def keys(self, X: Designs) -> list[str]:
        """Return a key for each of ``(n, n_var)`` designs, which is that of its tests, too."""
        columns, _ = designs_of(X, self.schema.with_role("variable"))
        return self.schema.keys(columns)

    def requirement_columns(self, columns: Entries) -> dict[str, Array]:
        """Return the columns of the requirements of stored tests, by name."""
        if not self.has_requirements:
            return {}
        names = self.schema.of_role("inequality")[self.n_ieq_constr :]
        violations = self.violations(self.designs(columns))
        return dict(zip(names, violations.T, strict=True))

    def revised(self, columns: Columns) -> tuple[Mask, Columns]:
        """Return what becomes of stored tests under the requirements and expressions of now.

        Args:
            columns: The columns of the tests by name.

        Returns:
            ``(n,)`` which of them are unmade; and columns that follow from others, or from files
            that are kept.
        """
        has_run = self._have_run(columns)
        revised = self.requirement_columns(columns)
        if self.program is not None:
            options = with_options(columns, self.schema.variables, self.schema.kinds)
            unknown = np.full(len(has_run), np.nan)
            for name, cells in self.program.completed(options).items():
                revised[name] = np.where(has_run, cells, columns.get(name, unknown))
        return self.unmade(columns), revised

    def unmade(self, columns: Columns) -> Mask:
        """``(n,)`` which tests never ran, for a requirement that holds no longer.

        Args:
            columns: The columns of the tests by name, with the status that they had.
        """
        is_unmade = ~self._have_run(columns)
        for amounts in self.requirement_columns(columns).values():
            is_unmade &= amounts <= 0
        return is_unmade

    def _have_run(self, columns: Columns) -> Mask:
        """``(n,)`` whether the model ran for stored tests: a requirement may have been violated.

        If so, the objectives of that time are infinite, and the model's own constraints are 0.
        """
        names = [*self.schema.objectives]
        if self.program is not None:  # what is an output now may have been an objective
            names += self.program.outputs
        unknown = np.full(len(columns["status"]), np.nan)
        values = np.array([columns.get(name, unknown) for name in names])
        has_run: Mask = np.isfinite(values).any(axis=0) | ~np.isinf(values).any(axis=0)
        has_run |= columns["status"] != "infeasible"
        own_inequalities = self.schema.of_role("inequality")[: self.n_ieq_constr]
        for name in (*own_inequalities, *self.schema.of_role("equality")):
            has_run |= columns.get(name, unknown) != 0
        return has_run

    @property
    def program(self) -> ProgramProblem | None:
        """The problem that has the columns of the tests, and outputs that are expressions of them.

        It is ``None`` if there is none, such as within :class:`LogScaled`, or if the run has other
        names or directions, as the expressions mean the problem's own.
        """
        problem = within_same_columns(self.inner)
        if isinstance(problem, ProgramProblem):
            has_variables = self.schema.variables == tuple(problem.variables)
            if has_variables and problem.has_objectives_of(self.schema):
                return problem
        return None

    # Tests of values, and the reverse

    @property
    def n_ieq_constr(self) -> int:
        """How many inequality constraints of the model a table has, before requirements."""
        return int(self.inner.n_ieq_constr) - len(self.default_limits)

    def constraints(self, tests: TestTable) -> Array:
        """Return the ``(n, n_ieq)`` constraints of tests as the problem has them, with its limits.

        The amounts are not known where a test lacks the output.
        """
        amounts = []
        for name, limit in self.default_limits.items():
            outputs = np.full(len(tests), np.nan)
            if name in tests.schema.names:
                outputs = tests.column(name)
            amounts.append(limit.violation(outputs))
        return np.column_stack([*amounts, tests.G])

    def values(self, tests: TestTable) -> list[Values]:
        """Return the values of each test as its evaluation returned them; they may be changed."""
        names = ("F", "G", "H", *tests.schema.outputs, "failure")
        constraints = self.constraints(tests)
        has_run = np.isfinite(tests.F).all(axis=1)
        lacks_output = has_run & np.isnan(constraints).any(axis=1)
        reasons = dict(tests.reasons)
        for number in tests.numbers[lacks_output].tolist():
            reasons[number] = (
                "an output with a limit is not known; retry='incomplete' tests it again"
            )
        failures = [reasons.get(number, "") for number in tests.numbers.tolist()]
        arrays = tests.F.copy(), constraints, tests.H.copy()
        outputs = [tests.column(name).tolist() for name in tests.schema.outputs]
        rows = zip(*arrays, *outputs, failures, strict=True)
        return [dict(zip(names, row, strict=True)) for row in rows]

    def tests(self, points: Points, values: Sequence[Values]) -> TestTable:
        """Return the tests of points.

        Args:
            points: The points.
            values: The values of each, as the problem without its requirements gives them.
        """
        X = points.matrix(self.space)
        # Requirements follow the model's own constraints; they are computed, whatever happened.
        n_ieq = self.inner.n_ieq_constr
        rows = []
        for row in values:
            if row["failure"]:  # FailureTolerant gives such a design values, too
                row = {"failure": row["failure"]}
            if "G" in row:
                row = row | {"G": row["G"][:n_ieq]}
            rows.append(row)
        out = columns_of_values(self.inner, rows)
        out["G"] = np.hstack([out["G"], self.violations(X)])
        return self._table(points, X, out)

    def evaluated(self, points: Points) -> TestTable:
        """Evaluate points together; return their tests."""
        X = points.matrix(self.space)
        return self._table(points, X, evaluate_designs(self.problem, self.space.designs(X)))

    def _table(self, points: Points, X: Designs, out: Entries) -> TestTable:
        values = {**out, "G": out["G"][:, len(self.default_limits) :]}
        return table_of_values(self.schema, points, X, values)


def with_options(columns: Entries, variables: Names, kinds: Sequence[Kind]) -> Values:
    """Return columns in which choices are the options that stored texts name."""
    values = dict(columns)
    for name, kind in zip(variables, kinds, strict=True):
        if kind is Kind.CHOICE:
            values[name] = choice_values(columns[name])
    return values


def table_of_values(schema: Schema, points: Points, X: Any, out: Entries) -> TestTable:
    """Return the tests of n designs with all numbers that the model returned.

    An output that is not a single number for any design, or has the name of another column, is left
    out with a warning, as a run need not end for it. If it is a number for some designs, these keep
    it: values of one design never affect those of another.

    Args:
        schema: The columns that the problem promises.
        points: The n points of the designs.
        X: ``(n, n_var)`` the designs.
        out: Their values, as :func:`evaluate_designs` returns them.
    """
    numbers = points.numbers
    failures = out["failure"]
    has_failed = failures.astype(bool)
    reasons = dict(zip(numbers[has_failed].tolist(), failures[has_failed], strict=True))
    candidates = dict(out)
    if points.rounds is not None:
        # first, and those of the points: a repeated design has the values of another point
        candidates.pop(PROPOSAL_ROUND, None)
        candidates = {PROPOSAL_ROUND: points.rounds} | candidates
    other_columns = {*schema.names, *RESERVED} - {*schema.outputs}
    outputs = {}
    for name, values in candidates.items():
        if name in NO_OUTPUTS or name.startswith("__"):
            continue
        if name in other_columns:
            warn_of_output(name, "in the table by this name")
            continue
        column, odd = _numbers(values, len(numbers))
        if odd:
            example = f"{odd[0]!r:.40}"
            warn_of_output(name, f"in the table where it is no single number, such as {example}")
            if np.isnan(column).all():
                continue
        outputs[name] = np.where(has_failed, np.nan, column)
    return TestTable.of(
        numbers, X, out["F"], out["G"], out["H"], outputs=outputs, reasons=reasons, schema=schema
    )


def warn_of_output(name: str, where: str) -> None:
    """Warn that an output of a model is lost."""
    warnings.warn(f"out[{name!r}] is not kept {where}", stacklevel=3)


def _numbers(values: Any, n: int) -> tuple[Any, list[Any]]:
    """Return a number for each of n designs, NaN where there is none, and the other values."""
    column = np.asarray(values)
    if column.dtype.kind in "fiub" and column.size == n:
        return column.reshape(n), []
    numbers = np.full(n, np.nan)
    odd = []
    for i, value in enumerate(column):
        cell = np.asarray(value)
        if cell.size == 1 and cell.dtype.kind in "fiub":
            numbers[i] = cell.item()
        elif value is not None:
            odd.append(value)
    return numbers, odd
