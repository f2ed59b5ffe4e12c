"""What is asked of tests: sets of designs, their ranking, and the bounds for the next tests."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._names import Renamed, asked_under_a_formulation
from pymoo_psi._validation import Received, counted, finite_number, instance, invalid, known_name
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import (
    EfficiencyRanking,
    Explanation,
    Objectives,
    competes,
    explain,
    nondominated,
    ranking_of,
    violated_constraints,
)
from pymoo_psi.table._designs import design_matrix, real_column
from pymoo_psi.table._formulation import ATTRIBUTES, Formulation, FormulationFields, formulated
from pymoo_psi.table._head import blocks_of
from pymoo_psi.table._layout import Key, Layout
from pymoo_psi.table._limits import limit_text, limits_of, within
from pymoo_psi.table._tests import Tests, lack

if TYPE_CHECKING:
    from typing_extensions import Self, Unpack

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# What an evaluation gives to what fails: its values are not known under any formulation.
_OF_FAILED = {"F": np.inf, "G": 0.0, "H": 0.0, "outputs": np.nan}


class Questions(Tests):
    """Tests under a formulation, and what can be asked of them."""

    __test__ = False  # not a test class, whatever its name suggests to pytest

    @property
    def tested(self) -> Self:
        """The table of these tests before :meth:`under`: as they were tested, or read.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [2.0]])
            >>> table.under(limits={"f1": 1.5}).tested is table
            True
        """
        return self if self._tested is None else self._tested  # type: ignore[return-value]

    def under(
        self, formulation: Formulation | None = None, /, **fields: Unpack[FormulationFields]
    ) -> Self:
        """Return the table of the same tests under another formulation, without an evaluation.

        It is the table that the problem so formulated would give: other objectives and directions,
        other limits, and the rest among the outputs. Numbers and designs stay. A design with an
        objective that cannot be computed has failed; one that failed in its evaluation stays
        failed, as its values are not known.

        The formulation takes the place of that which the table carries, and is one of the tests as
        they were tested: limits can be loosened as well as tightened, and ``under(limits={})`` has
        none. What a formulation does not say stays as the tests have it.

        Args:
            formulation: The formulation; that of the table unless given.
            **fields: Attributes of :class:`Formulation`, in the place of those of the formulation:
                ``under(limits={"mass": 30}, normalize=False)``. Limits on objectives may be given
                by their index from 0.

        Raises:
            ArgumentValueError: A column is not there, or cannot be what it is named for.
            ArgumentTypeError: There is no such attribute, or one has a wrong type.

        Example:
            >>> layout = Layout.of(["width"], ["mass"], ["stress"], outputs=["gain"])
            >>> table = TestTable.of(
            ...     [1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]], G=[[0.2], [-0.1], [-0.3]],
            ...     outputs={"gain": [0.5, 0.7, 0.6]}, layout=layout)
            >>> free = table.under(
            ...     objectives=["mass", "gain"], maximize=["gain"], limits={"stress": 0.3},
            ...     relaxed=["stress"])
            >>> free.pareto(), table.pareto()
            (array([ True,  True, False]), array([False,  True, False]))
            >>> free.under(limits={"mass": 1.5}).pareto()
            array([ True, False, False])
        """
        if formulation is None:
            formulation = self.formulation
            if "objectives" in fields:  # fixed ranges are those of the objectives before
                formulation = replace(formulation, ranges={})
        instance("formulation", formulation, Formulation)
        for name in fields:
            known_name("an argument of under", name, ATTRIBUTES)
        if "limits" in fields:
            objectives = fields.get("objectives") or self.layout.objectives
            fields["limits"] = _by_name(fields["limits"], objectives)
        return self.tested._under(replace(formulation, **fields))

    def _under(self, formulation: Formulation) -> Self:
        columns = {name: self.column(name) for name in self.layout.columns}
        layout, columns = formulated(formulation, self.layout, columns)
        formulation = _completed(formulation, self.formulation, self.layout, layout)
        changes: dict[str, Any] = {"layout": layout, "formulation": formulation, "_tested": self}
        # Failed for an objective, a design may count under others; failed in its evaluation, it
        # has no values.
        rows, reasons = self._failed_in_evaluation()
        if formulation.without_columns() != formulation:
            changes |= blocks_of(layout, columns, len(self))
            changes["problem"] = facts_of(self.problem, "sampling")
            for name, value in _OF_FAILED.items():
                values = changes[name][rows]
                changes[name][rows] = np.where(np.isfinite(values), values, value)
        if layout.variables != self.layout.variables:
            kept = [self.layout.variables.index(name) for name in layout.variables]
            changes["X"] = design_matrix("X", self.X[:, kept])
        table = self._with(**changes)
        table._check_ranges()
        table._set_status(reasons)
        remarks = [f"The limit {limit} rejects no design." for limit in table._idle_limits()]
        return table._with(remarks=(*self.remarks, *remarks))

    def _failed_in_evaluation(self) -> tuple[list[int], dict[int, str]]:
        """Return the rows of tests that failed for more than an objective, and the reasons."""
        rows: list[int] = []
        reasons: dict[int, str] = {}
        for row in np.flatnonzero(self.status == "failed"):
            number = int(self.numbers[row])
            reason = self.reasons.get(number, "")
            if reason != lack(self, row):
                rows.append(int(row))
                reasons[number] = reason
        return rows, reasons

    def _idle_limits(self) -> list[str]:
        """Return the limits, each end by itself, that no design exceeds, as they are written."""
        tested = self.status != "failed"
        if not tested.any():
            return []
        idle = []
        for name, (low, high) in self.limits.items():
            values = real_column(name, self.column(name)[tested])
            if not np.isfinite(values).all():  # what is not finite keeps no limit
                continue
            if low > -np.inf and values.min() >= low:
                idle.append(limit_text(name, low, np.inf))
            if high < np.inf and values.max() <= high:
                idle.append(limit_text(name, -np.inf, high))
        return idle

    # Sets of designs

    @asked_under_a_formulation
    def feasible(self) -> Mask:
        """``(n,)`` which designs are "ok": they keep all constraints and limits.

        Example:
            >>> X, F, G = [[0.1], [0.5], [0.9]], [[1], [2], [3]], [[0.5], [0.0], [0.0]]
            >>> table = TestTable.of([1, 2, 3], X, F, G)
            >>> table.feasible()
            array([False,  True,  True])
            >>> table.under(limits={"f1": 2}).feasible()
            array([False,  True, False])
        """
        return np.asarray(self.status == "ok")

    @asked_under_a_formulation
    def eligible(self) -> Mask:
        """``(n,)`` which designs are feasible and have finite objectives, so that they compete.

        Example:
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("inf")]]).eligible()
            array([ True, False])
        """
        return competes(self.F, self.feasible())

    @asked_under_a_formulation
    def pareto(self) -> Mask:
        """``(n,)`` which designs are Pareto optimal among the eligible ones.

        Of tests with the same design, see :attr:`repeats`, the first stands for all.

        Example:
            Without a limit on f1 no design beats another; with one there are fewer to compare.

            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1, 3], [2, 2], [3, 3]])
            >>> table.pareto()
            array([ True,  True, False])
            >>> table.under(limits={"f1": 1.5}).pareto()
            array([ True, False, False])
        """
        mask = self.eligible()
        if self.F.shape[1] > 0:  # without objectives no design is better than another
            mask[mask] = nondominated(self.F[mask])
        mask[mask] = ~self._repeated(np.flatnonzero(mask))
        return mask

    # Rankings

    @asked_under_a_formulation
    def ranking(self) -> EfficiencyRanking:
        """Rank the Pareto-optimal designs by efficiency; see :func:`~pymoo_psi.rank_of_efficiency`.

        Returns:
            The ranking of the rows :meth:`pareto`, in that order. Its objectives have the table's
            names and directions, its labels are the numbers of the test points, so that
            ``.to_frame()`` has the index ``test_point``; ``.rows`` are the rows of the table.

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
        # All of them are optimal: the search is not done twice.
        pareto = np.ones(len(rows), dtype=bool)
        return self._ranking_of(rows, pareto, pd.Index(self.numbers[rows], name="test_point"))

    @asked_under_a_formulation
    def feasible_ranking(self) -> EfficiencyRanking:
        """Rank all feasible designs, dominated ones among them, each design once.

        What commands, page and report show: without a design of the Pareto set those that it
        dominates may come into it, which :func:`~pymoo_psi.cautions` report.

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

    def _ranking_of(self, rows: NDArray[np.intp], pareto: Mask, labels: Any) -> EfficiencyRanking:
        """Return the ranking of some rows, of which it is known which are Pareto optimal."""
        if len(rows) == 0:
            raise self._none_feasible()
        sign = self.layout.sign
        F = Objectives.of(self.F[rows]).values * sign + 0.0  # no -0.0
        numbers = self.numbers[rows]
        objectives = Objectives(F, sign, self.layout.objectives, labels, numbers)
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
        n_failed = np.sum(self.status == "failed")
        received = Received(f"none of {counted(len(self), 'test')}, of which {n_failed} failed")
        remedy = "loosen the limits, or test more points"
        if n_failed:
            remedy = "see its reasons"
        return invalid("the table", "one with a feasible design", received, remedy)

    @asked_under_a_formulation
    def best(self) -> Self:
        """Return the Salukvadze optimum, the nearest design to the ideal point, as one row.

        Raises:
            ArgumentValueError: There is no design to rank.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> table.best().names, table.best().F
            (['test point 2'], array([[1., 1.]]))
        """
        ranking = self.ranking()
        return self.rows(ranking.rows[ranking.salukvadze[:1]])

    @asked_under_a_formulation
    def explain(self, design: int | str | None = None, *, row: int | None = None) -> Explanation:
        """Say why a design: :func:`pymoo_psi.explain` among the feasible designs of the table.

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

    @asked_under_a_formulation
    def sorted_by(self, objective: Key) -> Self:
        """Return the ordered test table of an objective: the feasible designs, the best first.

        The largest value is the best one if the objective is maximised. It is a table again, for
        the next question, a frame or a file. Equal designs stay in the order of testing; those
        whose value is NaN come last.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[2, 5], [1, 6], [3, 4]])
            >>> table.sorted_by("f1").numbers
            array([2, 1, 3])
            >>> table.under(limits={"f2": 5}).sorted_by("f1").numbers
            array([1, 3])
        """
        values = self.F[:, self.layout.objective(objective)]
        rows = np.flatnonzero(self.feasible())
        # stable keeps the order of testing among equals; numpy sorts NaN behind infinity.
        return self.rows(rows[np.argsort(values[rows], kind="stable")])

    @asked_under_a_formulation
    def violations(self) -> tuple[Mask, tuple[str, ...]]:
        """Return which constraints and limits each design violates, and their names.

        Returns:
            ``(n, k)`` mask, with a column for each constraint and then for each limit, and the k
            names, of limits as they are written. Rows of failed designs are False, and limits of
            those that a requirement kept from running: what was not computed violates nothing.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[2.0], [-2.0]])
            >>> mask, names = table.under(limits={"f1": 1.5}).violations()
            >>> mask.tolist(), names
            ([[True, False], [False, True]], ('g1', 'f1<=1.5'))
        """
        constraints = violated_constraints(self.G, self.H, self.layout.eq_tolerance)
        has_run = ~constraints.any(axis=1) | np.isfinite(self.F).any(axis=1)
        masks = [constraints]
        names = list(self.layout.constraints)
        for name, ends in self.limits.items():
            exceeds = ~within({name: ends}, self.column, len(self)) & has_run
            masks.append(exceeds[:, None])
            names.append(limit_text(name, *ends))
        mask = np.hstack(masks)
        mask[self.status == "failed"] = False
        return mask, tuple(names)

    @asked_under_a_formulation
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
        lower, upper = self.layout.lower.copy(), self.layout.upper.copy()
        for j, kind in enumerate(self.kinds):
            if not kind.real and kind is not Kind.INTEGER:
                continue
            column = self.X[feasible, j].astype(np.float64)
            low, high = _widened(column.min(), column.max(), margin, kind)
            # fmax and fmin ignore a bound that is NaN, as there is none.
            lower[j] = np.fmax(low, lower[j])
            upper[j] = np.fmin(high, upper[j])
        return lower, upper

    ranked = Renamed("feasible_ranking(), whose attribute rows are the rows of the table")
    chosen = Renamed("table.formulation.chosen")


def _widened(low: Any, high: Any, margin: float, kind: Kind) -> tuple[Any, Any]:
    """Return the ends of a range, each farther out by a share of its width."""
    if kind is Kind.LOG:
        return low / (high / low) ** margin, high * (high / low) ** margin
    low, high = low - margin * (high - low), high + margin * (high - low)
    if kind is Kind.INTEGER:
        return np.floor(low), np.ceil(high)
    return low, high


def _by_name(limits: Any, objectives: Any) -> dict[str, Any]:
    """Return limits by the names of columns; an index is that of an objective."""
    limit_by_name: dict[str, Any] = {}
    for key, limit in limits_of(limits).items():
        name = key
        if not isinstance(key, str):
            name = objectives[Layout.of(0, list(objectives)).objective(key)]
        if name in limit_by_name:
            raise invalid("limits", "given once for a column", limits)
        limit_by_name[str(name)] = limit
    return limit_by_name


def _completed(
    formulation: Formulation, former: Formulation, former_layout: Layout, layout: Layout
) -> Formulation:
    """Return a formulation with the ranges and the choice of the tests where it says nothing."""
    if formulation.ranges is None:
        same = {*layout.objectives} == {*former_layout.objectives}
        formulation = replace(formulation, ranges=(former.ranges or {}) if same else {})
    if formulation.chosen is None and former.chosen is not None:
        formulation = replace(formulation, chosen=former.chosen, reason=former.reason)
    return formulation


def facts_of(problem: Any, *names: str) -> dict[str, Any] | None:
    """Return some facts of a problem's identity, of the model or of the points of a run."""
    facts = {name: fact for name, fact in (problem or {}).items() if name in names}
    return facts or None
