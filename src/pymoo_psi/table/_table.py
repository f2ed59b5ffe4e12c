"""The test table: every tested point, and what an investigator asks of them.

The order of work is that of Parameter Space Investigation (Sobol' and Statnikov, Choosing Optimal
Parameters in Problems with Several Criteria, 1981; Statnikov and Matusov, 1995): test the points,
look at the ordered test tables, set limits on the objectives, take the Pareto set of the designs
that are feasible then, and refine the bounds for the next investigation.

:class:`Tests` has the data, and takes rows and columns of them. :class:`TestTable` adds what is
asked: another formulation, sets of designs, rankings, repeated tests, joining, frames and files.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    Array,
    Columns,
    FilePath,
    Mask,
    Received,
    Rows,
    Values,
    counted,
    finite_number,
    instance,
    invalid,
    known_name,
)
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import (
    EfficiencyRanking,
    Explanation,
    Objectives,
    competes,
    decimal_mark,
    explain,
    nondominated,
    ranking_of,
)
from pymoo_psi.table._formats import CSV, STUDY, WORKBOOK
from pymoo_psi.table._formulation import (
    ATTRIBUTES,
    Formulation,
    FormulationFields,
    formulated,
    limit_text,
)
from pymoo_psi.table._head import blocks_of, columns_of, units_of
from pymoo_psi.table._joining import (
    difference,
    merged,
    require_one_formulation,
    stacked,
    unequal,
)
from pymoo_psi.table._layout import design_matrix, number_column, result_columns
from pymoo_psi.table._repeats import averaged, confidence
from pymoo_psi.table._switching import switching_sentences
from pymoo_psi.table._tests import (
    STATUSES,
    Tests,
    nonfinite_objective,
    require_distinct,
)

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Unpack


# Values of a test that failed in its evaluation, under any formulation.
_OF_FAILED = {"F": np.inf, "G": 0.0, "H": 0.0, "outputs": np.nan}


class TestTable(Tests, Shown):
    __doc__ = Tests.__doc__
    __test__ = False  # not a test class, whatever its name suggests to pytest

    def __post_init__(self) -> None:
        """Check the arrays; ``dataclasses.replace`` also changes the tests before :meth:`under`."""
        super().__post_init__()
        if self._tested is not None:
            self._set({"_tested": self._replaced_tests(self.tested)})

    def _replaced_tests(self, tested: TestTable) -> TestTable:
        """Return the tests with what has been replaced in this table, which is them under its own.

        Raises:
            ArgumentValueError: That cannot be told apart from what the formulation makes of them.
        """
        former = tested._under(self.formulation)
        if not self._is_of_same_values(former):
            raise invalid(
                "columns, values and directions of a table under a formulation",
                "those of its tests",
                Received("others"),
                "replace them in table.tested, and then use .under(table.formulation)",
            )
        bounds = {}
        rows = [tested.layout.variable(name) for name in self.layout.variables]
        for side in ("lower", "upper"):
            bounds[side] = getattr(tested.layout, side).copy()
            bounds[side][rows] = getattr(self.layout, side)
        units = tested.layout.units
        if self.layout.units != former.layout.units:
            units = units_of(tested.columns, self.layout.units)
        problem = tested.problem
        if self.problem != former.problem:
            problem = self.problem
        idle = former.remarks[len(tested.remarks) :]  # on limits of this formulation
        layout = replace(
            tested.layout,
            label=self.layout.label,
            eq_tolerance=self.layout.eq_tolerance,
            units=units,
            **bounds,
        )
        return replace(
            tested,
            layout=layout,
            reasons=self._failed_in_evaluation(),
            problem=problem,
            extra=self.extra,
            remarks=tuple(remark for remark in self.remarks if remark not in idle),
            decimal=self.decimal,
            separator=self.separator,
        )

    def _is_of_same_values(self, other: TestTable) -> bool:
        """Whether another table has the same columns and values, whatever else it has."""
        for name in ("blocks", "maximize", "kinds"):
            if getattr(self.layout, name) != getattr(other.layout, name):
                return False
        for name in ("numbers", "X", "F", "G", "H", "outputs"):
            values = getattr(self, name)
            others = getattr(other, name)
            if values.shape != others.shape or unequal(values.ravel(), others.ravel()).any():
                return False
        return True

    @property
    def tested(self) -> TestTable:
        """The table of these tests before :meth:`under`: as they were tested, or read.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [2.0]])
            >>> table.under(limits={"f1": 1.5}).tested is table
            True
        """
        return self if self._tested is None else self._tested  # type: ignore[return-value]

    def under(
        self, formulation: Formulation | None = None, /, **fields: Unpack[FormulationFields]
    ) -> TestTable:
        """Return the table of the same tests under another formulation, without an evaluation.

        The result is the table of a problem with these objectives, directions and limits; other
        columns become outputs. Numbers and designs stay the same. A design fails if an objective
        cannot be computed, and stays failed if its evaluation failed.

        The formulation replaces that of the table and applies to the tests as evaluated: limits can
        be loosened as well as tightened, and ``under(limits={})`` has none. What a formulation does
        not state stays as the tests have it.

        A limit is the same as removing the rows that it rejects: sets, rankings, explanations,
        cautions and shares are those of the table without these rows. Fixed ranges stay.

        Args:
            formulation: The formulation; that of the table unless given.
            **fields: Attributes of :class:`Formulation`, which replace those of the formulation:
                ``under(limits={"mass": 30}, normalize=False)``.

        Raises:
            ArgumentValueError: A column is unknown, or cannot be used as stated.
            ArgumentTypeError: There is no such attribute, or one has a wrong type.

        Example:
            >>> from pymoo_psi.table import Layout
            >>> layout = Layout.of(["width"], ["mass"], ["stress"], outputs=["gain"])
            >>> table = TestTable.of(
            ...     [1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]], G=[[0.2], [-0.1], [-0.3]],
            ...     outputs={"gain": [0.5, 0.7, 0.6]}, layout=layout)
            >>> free = table.under(
            ...     objectives=["mass", "gain"], maximize=["gain"], limits={"stress": 0.3},
            ...     omitted=["stress"])
            >>> free.pareto(), table.pareto()
            (array([ True,  True, False]), array([False,  True, False]))
            >>> free.under(limits={"mass": 1.5}).pareto()
            array([ True, False, False])
        """
        if formulation is None:
            formulation = self.formulation
            if "objectives" in fields:  # the fixed ranges are of the former objectives
                formulation = replace(formulation, ranges={})
        instance("formulation", formulation, Formulation)
        for name in fields:
            known_name("an argument of under", name, ATTRIBUTES)
        tested = self.tested
        stated = replace(formulation, **fields)
        complete = stated.completed(tested.formulation, tested.layout.objectives)
        if "chosen" in fields:  # None clears the choice of a file
            complete = replace(complete, chosen=stated.chosen, reason=stated.reason)
        return tested._under(complete)

    def _under(self, formulation: Formulation) -> TestTable:
        """Return these tests, which are as they were tested, under a complete formulation."""
        reasons = self._failed_in_evaluation()
        changes: Values = {}
        if formulation.without_columns() != formulation:
            changes = self._rearranged(formulation, [*reasons])
        table = self._with(formulation=formulation, _tested=self, **changes)
        table._check_ranges()
        table._set_status(reasons)
        table._require_ranges()
        return table._with(remarks=(*self.remarks, *table._idle_limits()))

    def _rearranged(self, formulation: Formulation, failed: list[int]) -> Values:
        """Return the layout and the arrays of these tests as a formulation names their columns.

        Args:
            formulation: Objectives, omitted constraints, computed columns.
            failed: Numbers of the tests that failed in their evaluation, which have no values.
        """
        columns = {name: self.column(name) for name in self.layout.columns}
        layout, columns = formulated(formulation, self.layout, columns)
        arrays = blocks_of(layout, columns, len(self))
        rows = np.isin(self.numbers, failed)
        for name, value in _OF_FAILED.items():
            values = arrays[name][rows]
            arrays[name][rows] = np.where(np.isfinite(values), values, value)
        variables = [self.layout.variables.index(name) for name in layout.variables]
        arrays["X"] = design_matrix("X", self.X[:, variables])
        # The points of the run stay known, the model with these objectives is another.
        facts = dict(self.problem or {})
        points = {name: facts[name] for name in ("sampling", "runs") if name in facts}
        return {"layout": layout, "problem": points or None, **arrays}

    def _require_ranges(self) -> None:
        """Refuse fixed ranges by which an objective would not count, though designs differ."""
        candidates = self.eligible()
        for name, (low, high) in (self.formulation.ranges or {}).items():
            if low == high and (self.column(name)[candidates] != low).any():
                raise invalid(
                    f"the fixed range of {name!r}",
                    "of two different numbers, as designs differ in it",
                    [low, high],
                    "leave ranges out to use those of the Pareto set",
                )

    def _failed_in_evaluation(self) -> dict[int, str]:
        """Return the reasons of tests that failed for more than an objective, by number."""
        reasons = {}
        for row in np.flatnonzero(self.failed()):
            number = int(self.numbers[row])
            reason = self.reasons.get(number, "")
            if reason != nonfinite_objective(self, row):
                reasons[number] = reason
        return reasons

    def _idle_limits(self) -> list[str]:
        """Return remarks on limits that no design exceeds."""
        tested = ~self.failed()
        idle = []
        for name, limit in self.limits.items():
            if tested.any() and not self.excess(name, limit)[tested].any():
                idle.append(f"The limit {limit_text(name, limit)} rejects no design.")
        return idle

    # Sets of designs

    def feasible(self) -> Mask:
        """``(n,)`` which designs are "ok": they meet all constraints and limits.

        Example:
            >>> X, F, G = [[0.1], [0.5], [0.9]], [[1], [2], [3]], [[0.5], [0.0], [0.0]]
            >>> table = TestTable.of([1, 2, 3], X, F, G)
            >>> table.feasible()
            array([False,  True,  True])
            >>> table.under(limits={"f1": 2}).feasible()
            array([False,  True, False])
        """
        return np.asarray(self._codes == STATUSES.index("ok"))

    def eligible(self) -> Mask:
        """``(n,)`` which designs are feasible and have finite objectives, so that they compete.

        Example:
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("inf")]]).eligible()
            array([ True, False])
        """
        return competes(self.F, self.feasible())

    def pareto(self) -> Mask:
        """``(n,)`` which designs are Pareto optimal among the eligible ones.

        Tests of the same design count once, by the first of them; see :attr:`repeats`.

        Example:
            Without a limit on f1 no design beats another; with one there are fewer to compare.

            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1, 3], [2, 2], [3, 3]])
            >>> table.pareto()
            array([ True,  True, False])
            >>> table.under(limits={"f1": 1.5}).pareto()
            array([ True, False, False])
        """
        if self._pareto is None:
            mask = self.eligible()
            if self.F.shape[1] > 0:  # without objectives no design is better than another
                mask[mask] = nondominated(self.F[mask])
            mask[mask] = ~self._repeated(np.flatnonzero(mask))
            self.know_pareto(mask)
        return np.array(self._pareto)

    def know_pareto(self, mask: Mask) -> None:
        """Set the result of :meth:`pareto` if it is known already.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [2.0]])
            >>> table.know_pareto(np.array([True, False]))
            >>> table.pareto()
            array([ True, False])
        """
        self._set({"_pareto": mask})

    # Rankings

    def ranking(self) -> EfficiencyRanking:
        """Rank the Pareto-optimal designs by efficiency; see :func:`~pymoo_psi.rank_of_efficiency`.

        Returns:
            The ranking of the rows :meth:`pareto`, in that order. Its objectives have the table's
            names and directions, its labels are the designs' :attr:`names` if the table has labels,
            else the numbers of the test points, so that ``.to_frame()`` has the index
            ``test_point``; ``.rows`` are the rows of the table.

        Raises:
            ArgumentValueError: There is no design to rank.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> ranking = table.ranking()
            >>> table.numbers[ranking.rows[ranking.salukvadze]]
            array([2])
        """
        import pandas as pd

        rows = np.flatnonzero(self.pareto())
        labels = pd.Index(self.numbers[rows], name=number_column(self.extra))
        if self.layout.label is not None:
            labels = pd.Index(np.array(self.names)[rows], name=self.layout.label)
        # All of them are optimal: the search is not done twice.
        pareto = np.ones(len(rows), dtype=bool)
        return self._ranking_of(rows, pareto, labels)

    def feasible_ranking(self) -> EfficiencyRanking:
        """Rank all feasible designs, dominated ones among them, each design once.

        Commands, page and report show this ranking. It includes dominated designs because they may
        become optimal if another design is dropped, which :func:`~pymoo_psi.cautions` report.

        Returns:
            The ranking of the eligible designs, as that of :meth:`ranking`; its labels are the
            designs' :attr:`names`.

        Raises:
            ArgumentValueError: There is no design to rank.

        Example:
            >>> table = TestTable.of([4, 5, 6], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [2, 2]])
            >>> ranking = table.feasible_ranking()
            >>> ranking.rows, ranking.rank, ranking.name_of(1)
            (array([0, 1, 2]), array([6, 6, 0]), 'test point 5')
        """
        rows = np.flatnonzero(self.eligible())
        rows = rows[~self._repeated(rows)]
        names = self.names
        return self._ranking_of(rows, self.pareto()[rows], [names[row] for row in rows])

    def _ranking_of(self, rows: Rows, pareto: Mask, labels: Any) -> EfficiencyRanking:
        """Return the ranking of some rows; ``pareto`` marks the Pareto-optimal ones of them."""
        if len(rows) == 0:
            raise self._none_feasible()
        sign = self.layout.sign
        F = Objectives.of(self.F[rows]).values * sign + 0.0  # no -0.0
        numbers = self.numbers[rows].tolist()
        objectives = Objectives(F, sign, self.layout.objectives, labels, numbers, self.layout.units)
        normalize = self.formulation.normalize
        ends = self._fixed_ends()
        return ranking_of(objectives, pareto, rows, normalize=normalize, **ends)

    def _fixed_ends(self) -> dict[str, Array]:
        """Return the points ``ideal`` and ``nadir`` of the ranges; empty if none are fixed."""
        ranges = self.formulation.ranges
        if not ranges:
            return {}
        sign = self.layout.sign
        pairs = np.array([ranges[name] for name in self.layout.objectives], dtype=float).T
        ideal, nadir = np.sort(pairs * sign, axis=0) * sign
        return {"ideal": ideal, "nadir": nadir}

    def _none_feasible(self) -> ArgumentValueError:
        words = self.layout.words
        n_failed = self.failed().sum()
        size = counted(len(self), words["row"])
        received = Received(f"none of {size}, of which {n_failed} {words['failed']}")
        remedy = "loosen the limits, test more points, or see the reasons of failures"
        return invalid("the table", "one with a feasible design", received, remedy)

    def best(self) -> TestTable:
        """Return the Salukvadze optimum, the nearest design to the ideal point, as one row.

        Raises:
            ArgumentValueError: There is no design to rank.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> table.best().names, table.best().F
            (['test point 2'], array([[1., 1.]]))
        """
        ranking = self.ranking()
        return self.take(ranking.rows[ranking.salukvadze[:1]])

    def explain(self, design: int | str | None = None, *, row: int | None = None) -> Explanation:
        """Explain a design by comparison with the feasible ones; see :func:`pymoo_psi.explain`.

        Names, directions and units are the table's.

        Args:
            design: The number of its test, or its label; the Salukvadze optimum unless given.
            row: Its row in the table, from 0, instead of ``design``.

        Raises:
            ArgumentValueError: There is no such feasible design.

        Example:
            >>> table = TestTable.of([4, 5, 6], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> print(table.explain().sentences[0])
            Test point 5 is the Salukvadze optimum: the nearest of 3 Pareto-optimal designs to the
            ideal point.
        """
        return explain(self, design, row=row)

    def switching(self) -> list[str]:
        """Return a sentence on the limits up to which the best design stays the best.

        :func:`switching_values` returns the numbers. The list is empty if more than 500 designs are
        Pareto optimal, or if no limit changes the best design.

        Raises:
            ArgumentValueError: There is no design to rank.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> table.switching()[0]
            'Test point 2 stays proposed until f1 below 1 (then test point 1) or f2 below 1
            (then test point 3).'
        """
        with decimal_mark(self.decimal):
            return switching_sentences(self)

    def sorted_by(self, objective: str) -> TestTable:
        """Return the feasible designs ordered by an objective, the best first: PSI's test table.

        The largest value is the best one if the objective is maximised. Equal designs stay in the
        order of testing; NaN comes last.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[2, 5], [1, 6], [3, 4]])
            >>> table.sorted_by("f1").numbers
            array([2, 1, 3])
            >>> table.under(limits={"f2": 5}).sorted_by("f1").numbers
            array([1, 3])
        """
        names = self.layout.objectives
        values = self.F[:, names.index(known_name("objective", objective, names))]
        rows = np.flatnonzero(self.feasible())
        # stable keeps the order of testing among equals; numpy sorts NaN behind infinity.
        return self.take(rows[np.argsort(values[rows], kind="stable")])

    def violations(self) -> tuple[Mask, tuple[str, ...]]:
        """Return which constraints and limits each design violates, and their names.

        Returns:
            ``(n, k)`` mask, with a column for each constraint and then for each limit, and the k
            names, of limits as they are written. Rows of failed designs are False, and so are the
            limits of designs that did not run because of a requirement.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[2.0], [-2.0]])
            >>> mask, names = table.under(limits={"f1": 1.5}).violations()
            >>> mask.tolist(), names
            ([[True, False], [False, True]], ('g1', 'f1<=1.5'))
        """
        limits = self.limits
        texts = [limit_text(name, limit) for name, limit in limits.items()]
        mask = self._violated(limits)
        mask[self.failed()] = False
        return mask, (*self.layout.constraints, *texts)

    def refined_bounds(self, *, margin: float = 0.0) -> tuple[Array, Array]:
        """Return the bounds of the feasible set, for the next investigation.

        Args:
            margin: Widen them on each side by this share of their width, but not beyond the
                bounds of this table. Integers are rounded outwards.

        Returns:
            Lower and upper bounds, ``(n_var,)`` each; NaN for choices and binary variables.

        Raises:
            ArgumentValueError: No design is feasible, or the margin is below 0.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.0], [0.5], [0.7]], [[3.0], [1.0], [2.0]])
            >>> table.under(limits={"f1": 2.0}).refined_bounds(margin=0.5)
            (array([0.4]), array([0.8]))
        """
        if finite_number("margin", margin) < 0:
            raise invalid("margin", "0 or more", margin)
        feasible = self.feasible()
        if not feasible.any():
            raise self._none_feasible()
        lower = self.layout.lower.copy()
        upper = self.layout.upper.copy()
        for j, kind in enumerate(self.kinds):
            if not kind.real and kind is not Kind.INTEGER:
                continue
            column = self.X[feasible, j].astype(np.float64)
            low = column.min()
            high = column.max()
            if kind is Kind.LOG:
                growth = (high / low) ** margin
                low /= growth
                high *= growth
            else:
                step = margin * (high - low)
                low -= step
                high += step
            if kind is Kind.INTEGER:
                low = np.floor(low)
                high = np.ceil(high)
            # fmax and fmin ignore a bound that is NaN, as there is none.
            lower[j] = np.fmax(low, lower[j])
            upper[j] = np.fmin(high, upper[j])
        return lower, upper

    # Repeated tests

    def averaged(self, by: str | None = None) -> TestTable:
        """Return the table of designs, each the mean of its tests.

        Tests with the same value in a column are tests of one design. Further outputs are
        ``tests``, their number, and the standard error of each objective. Failed tests do not
        count. Extra columns in which tests of a design differ are omitted.

        Args:
            by: Name of the column; by default, and for ``"variables"``, all variables.

        Raises:
            ArgumentValueError: There is no such column, it has gaps, no value recurs in it, or
                tests with the same value have different variables.

        Example:
            >>> tests = TestTable.of(range(1, 6), np.zeros((5, 0)), [[1], [2], [3], [5], [7]],
            ...                      extra={"rail": ["A", "A", "B", "B", "B"]})
            >>> designs = tests.averaged("rail")
            >>> designs.names, designs["f1"], designs["tests"]
            (['A', 'B'], array([1.5, 5. ]), array([2., 3.]))
            >>> designs["f1 standard error"].round(2)
            array([1.19, 0.97])
        """
        return averaged(self, by)

    def confidence(self) -> pd.DataFrame:
        """Return how probable it is that each design is Pareto optimal, the best, or near it.

        The probabilities come from samples of the true values, given the means and standard errors
        of :meth:`averaged`, or of columns such as ``f1 standard error``. Noise is assumed to be
        normal and independent. With five designs or more for each objective, means are shrunk
        towards those of all designs. All designs are assumed to meet the limits.

        Returns:
            Index: the names of the feasible designs. Columns: the expected true values of the
            objectives; ``pareto``, ``best``, the nearest to the ideal point, and ``near_best``, at
            most 5 % farther: probabilities, to about 0.02. Designs that tie are all the best.

        Raises:
            ArgumentValueError: There is no feasible design, or no standard error of an objective.

        Example:
            >>> F = [[0, 4], [0.1, 4.1], [1, 1], [1.1, 0.9], [4, 0], [3.9, 0.1]]
            >>> tests = TestTable.of(range(1, 7), [[1], [1], [2], [2], [3], [3]], F)
            >>> tests.averaged().confidence()["best"].round(2).tolist()
            [0.0, 1.0, 0.0]
        """
        return self._confidence.copy()

    @cached_property
    def _confidence(self) -> pd.DataFrame:
        return confidence(self)

    # Tables put together

    def extended(self, *blocks: TestTable) -> TestTable:
        """Return this table with the tests of others appended, in their order.

        Joining many blocks in one call copies the rows once. An output that one of them does not
        have is NaN for its tests.

        Raises:
            ArgumentValueError: A block has another layout, or a test point occurs twice.

        Example:
            >>> first, second = (TestTable.of([n], [[0.1 * n]], [[1.0]]) for n in (1, 2))
            >>> first.extended(second).numbers
            array([1, 2])
        """
        if not blocks:
            return self
        tables = [self, *blocks]
        require_one_formulation(tables)
        tested = stacked([table.tested for table in tables])
        require_distinct(tested.numbers)
        return self._asked_as_before(tested)

    def _asked_as_before(self, tested: TestTable) -> TestTable:
        """Return other tests under the formulation of these."""
        if self.tested is self:
            return tested
        return tested.under(self.formulation)

    def merge(self, other: TestTable) -> TestTable:
        """Return the tests of this and another run of the same problem, ordered by test point.

        ``PSI(1024)`` and ``PSI(3072, first=1025)`` merged are ``PSI(4096)``. A test point in both
        tables counts once, with the outputs and extra columns of both.

        Raises:
            ArgumentValueError: The tables differ in names, directions, units, bounds, tolerance or
                problem, or in results of a test point by more than rounding.

        Example:
            >>> ahead = TestTable.of([3, 4], [[0.25], [0.75]], [[1], [3]])
            >>> TestTable.of([1, 2], [[0.0], [0.5]], [[0], [2]]).merge(ahead).numbers
            array([1, 2, 3, 4])
        """
        return self._asked_as_before(merged(self, other))

    def equals(self, other: object) -> bool:
        """Whether another table is equal in every value and attribute; NaN is equal to NaN.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]])
            >>> table.equals(table.take([0, 1])), table.equals(table.take([0]))
            (True, False)
        """
        if not isinstance(other, TestTable) or len(self) != len(other):
            return False
        if difference(self._with(problem=None), other):
            return False
        for name in ("normalize", "chosen", "reason", "positions", "decided"):
            if getattr(self.formulation, name) != getattr(other.formulation, name):
                return False
        columns = columns_of(self)
        others = columns_of(other)
        if list(columns) != list(others):
            return False
        return not any(unequal(columns[name], others[name]).any() for name in columns)

    # Frames and files

    def to_frame(self) -> pd.DataFrame:
        """Return the table with one row per test point.

        Returns:
            Index ``test_point``; a column for each variable, objective, constraint, output and
            extra column under its name, objectives in the original direction; ``status``;
            ``violated``, the names of the constraints a design violates; ``reason``, why it
            failed; ``pareto``. Beside a column of another program's file with such a name they
            are called ``status (pymoo-psi)`` and so on.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[0.0], [0.1]])
            >>> print(table.to_frame().drop(columns="reason"))
                         x1   f1   g1      status violated  pareto
            test_point
            1           0.0  1.0  0.0          ok             True
            2           0.5  2.0  0.1  infeasible       g1   False
        """
        import pandas as pd

        columns = self._shown_columns()
        for name, column, kind in zip(self.layout.variables, self.X.T, self.kinds, strict=True):
            if kind is Kind.CHOICE:  # the options themselves, not texts
                columns[name] = column
        return pd.DataFrame(columns).set_index(number_column(self.extra))

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        # The Pareto set of a million tests is not needed for ten rows.
        results = result_columns(self.columns)
        frame = self.take(np.arange(min(n, len(self)))).to_frame().drop(columns=results["pareto"])
        headings = {name: self.layout.label_of(name) for name in self.layout.columns}
        texts = (results["violated"], results["reason"])
        empty = [name for name in texts if not frame[name].any()]
        return frame.drop(columns=empty).rename(columns=headings), len(self)

    def _shown_columns(self) -> Columns:
        """Return the columns of frame and file: two follow from the others, for the reader."""
        mask, names = self.violations()
        violated = [", ".join(compress(names, row)) for row in mask.tolist()]
        columns = columns_of(self)
        results = result_columns(self.columns)
        reason = columns.pop(results["reason"])
        columns[results["violated"]] = np.fromiter(violated, object)
        columns[results["reason"]] = reason
        columns[results["pareto"]] = self.pareto()
        return columns

    def to_csv(self, path: FilePath) -> None:
        """Write the table; :func:`read_table` reads it back without a change.

        The columns are those of :meth:`to_frame`, with units in the header, such as ``mass [kg]``.
        ``FILE.csv-metadata.json`` beside the file holds names, directions, units, bounds and
        tolerance, in the W3C's vocabulary for tabular data (CSVW); keep both together. Before
        version 3.1 pandas needs ``float_precision="round_trip"`` to read the last digit. If writing
        is interrupted, the old files stay as they were.

        Raises:
            ArgumentValueError: Another program has written metadata of the file.
            OSError: A file cannot be written.

        Example:
            >>> import os, tempfile
            >>> import pandas as pd
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = os.path.join(folder, "table.csv")
            ...     table.to_csv(path)
            ...     print(pd.read_csv(path, index_col="test_point")[["x1", "f1"]])
                         x1   f1
            test_point
            1           0.0  3.0
            2           0.5  4.0
        """
        CSV.save_tests(path, self)

    def to_xlsx(self, path: FilePath) -> None:
        """Write the table as a workbook, which :func:`read_table` reads back without a change.

        The first sheet has the tests, in the columns of :meth:`to_frame` with units in the header.
        The second describes the columns and the chosen design.

        Args:
            path: A file; spreadsheets only open it with the suffix ``.xlsx``.

        Raises:
            PsiError: openpyxl is not installed.
            OSError: The file cannot be written.

        Example:
            >>> import os, tempfile
            >>> from pymoo_psi.table import read_table
            >>> table = TestTable.of([1, 2], [[0.0], [0.1]], [[1 / 3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     table.to_xlsx(os.path.join(folder, "table.xlsx"))
            ...     read_table(os.path.join(folder, "table.xlsx")).equals(table)
            True
        """
        WORKBOOK.save_tests(path, self)

    def to_study(self, path: FilePath) -> None:
        """Write the table as a new study that a run can continue, whole or not at all.

        To continue several tables in one run, use ``a.merge(b).to_study("all.db")``, then
        ``minimize(problem, PSI(n, study="all.db"))``. A table whose problem is unknown, such as one
        made by :meth:`of`, can be read again, but not continued. ``extra`` columns and the columns
        ``seconds`` and ``origin`` of an original study are not written.

        Raises:
            StudyAccessError: The file exists already, or cannot be written.

        Example:
            >>> import os, tempfile
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> problem = VectorizedSphereChute()
            >>> parts = [investigate(problem, 100, share=(k, 2)) for k in (1, 2)]
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     study = os.path.join(folder, "chute.db")
            ...     parts[0].merge(parts[1]).to_study(study)
            ...     table = investigate(problem, 200, study=study)  # 100 of them are stored
            >>> len(table)
            200
        """
        STUDY.save_tests(path, self)
