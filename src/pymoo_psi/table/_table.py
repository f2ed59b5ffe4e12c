"""The test table: every tested point, and what an investigator asks of them.

The order of work is that of Parameter Space Investigation (Sobol' and Statnikov, Choosing Optimal
Parameters in Problems with Several Criteria, 1981; Statnikov and Matusov, 1995): test the points,
look at the ordered test tables, set limits on the objectives, take the Pareto set of the designs
that are feasible then, and refine the bounds for the next investigation.
"""

from __future__ import annotations

import csv
import os
import re
import warnings
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from io import StringIO
from itertools import compress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    Received,
    counted,
    finite_number,
    instance,
    invalid,
    known_name,
    mapping,
    real_array,
    wrong_type,
)
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
from pymoo_psi.table._designs import column_kinds, design_matrix, first_rows
from pymoo_psi.table._formats import CSV, STUDY, WORKBOOK
from pymoo_psi.table._formats._csv import split_head, written_text
from pymoo_psi.table._formulation import Formulation, formulated
from pymoo_psi.table._head import (
    Columns,
    blocks_of,
    columns_of,
    described,
    table_of,
    tests_of_rows,
)
from pymoo_psi.table._joining import blank, difference, require_one_result, stacked, unequal
from pymoo_psi.table._layout import ORIGIN, RESERVED, Key, Layout, Limits, bounds_of, within

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# _status takes them by index: 0 and 1 for constraints met and violated, 2 for a failure.
STATUSES = ("ok", "infeasible", "failed")
_ARRAYS = ("X", "F", "G", "H", "outputs", "status")  # with a row for each test


@dataclass(frozen=True, eq=False, repr=False)
class TestTable(Shown):
    """Every tested point of an investigation, in the order of testing.

    Made by :meth:`of` from arrays, by :meth:`empty` and :meth:`extended` block after block, or by
    :func:`read_table`. A table never changes; its arrays are read-only.

    Wherever ``limits`` are asked for, they are limits on objectives, variables and outputs by name,
    in the original direction: ``{"mass": 30, "width": (0.2, 0.4), "gain": (0.9, None)}``, that is
    at most 30, from 0.2 to 0.4, and at least 0.9; objectives also go by their index from 0. A
    number is the greatest value allowed; for a maximised objective it is refused, as it could mean
    either. They are set on the tests there are and need no evaluation; to ask for more, see
    :meth:`under`.

    ``F`` is pymoo's: all objectives minimised, those that are maximised (``layout.maximize``) with
    the sign turned. Whatever is reached by an objective's name is in the original direction:
    :meth:`column`, limits, frames, files, plots.

    Attributes:
        layout: Names and units of all columns, directions of the objectives, kinds and bounds of
            the variables, the tolerance of equality constraints.
        numbers: ``(n,)`` numbers of the test points, from 1, each once.
        X: ``(n, n_var)`` designs: float64; int64 or bool if all variables are integers or all
            binary; object if they differ, or are choices.
        F: ``(n, m)`` objectives, all minimised; NaN or infinite where a design failed.
        G: ``(n, n_ieq)`` inequality constraints, met where <= 0.
        H: ``(n, n_eq)`` equality constraints, met where |h| is within the tolerance.
        status: ``(n,)`` "ok", "infeasible" (violates a constraint) or "failed" (not computed).
            Given as None, it follows from the other arrays, as in :meth:`of`.
        reasons: Why designs failed, for the numbers of their test points.
        outputs: ``(n, k)`` what else the model gave, under the names ``layout.outputs``; NaN where
            a design failed, or an earlier version of the model did not give it.
        problem: What the tests are of: name, parameters, sampling and key, by which studies tell
            one problem from another; ``None`` if unknown.
        extra: ``(n,)`` columns carried along that are neither, such as texts of a foreign file.
        remarks: What a reader must know about the rows, in sentences; they are not written.
        chosen: Name of the chosen design, as in :attr:`names`, and why; empty if none is chosen.

    Example:
        >>> table = TestTable.of(
        ...     [1, 2, 3], X=[[0.1], [0.5], [0.9]], F=[[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]],
        ...     G=[[-1.0], [0.0], [0.5]])
        >>> table
        TestTable(3 tests: 2 ok, 1 infeasible, 0 failed; 1 variable, 2 objectives, 1 constraint)
        >>> table.feasible({"f1": 1.5}).tolist()
        [True, False, False]
    """

    __test__ = False  # not a test class, whatever its name suggests to pytest

    layout: Layout
    numbers: NDArray[np.int64]
    X: NDArray[Any]
    F: Array
    G: Array
    H: Array
    status: NDArray[np.str_] = None  # type: ignore[assignment]
    reasons: Mapping[int, str] = field(default_factory=dict)
    outputs: Array = None  # type: ignore[assignment]  # (n, 0) unless given
    problem: Mapping[str, Any] | None = None
    extra: Mapping[str, NDArray[np.object_]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    chosen: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Bring the arrays into their normal form and check that they belong together."""
        layout, numbers = self.layout, _point_numbers(self.numbers)
        n = len(numbers)
        values: dict[str, Any] = {
            "numbers": numbers,
            "X": design_matrix("X", self.X, layout.variables, layout.kinds),
            "extra": _extra_columns(self.extra, layout, n),
        }
        for name in ("F", "G", "H", "outputs"):
            given = getattr(self, name)
            given = np.zeros((n, 0)) if given is None else real_array(name, given)
            values[name] = np.array(given, order="C")
        for name, names in layout.blocks.items():
            if values[name].shape != (shape := (n, len(names))):
                raise invalid(name, f"of shape {shape}", Received(f"shape {values[name].shape}"))
        if len(self.chosen) not in (0, 2):
            raise invalid("chosen", "a name and a reason", self.chosen)
        self._set(values)
        given = None if self.status is None else np.array(self.status, dtype=str)
        self._set(self._status(self.reasons, given))
        # What failed is believed; the rest must follow from the constraints, so that no two
        # places of the table can disagree on what is feasible.
        for i in np.flatnonzero(given != self.status) if given is not None else ():
            rule = "ok where the constraints are met, infeasible where not, or failed"
            found = Received(f"{str(given[i])!r} for test point {numbers[i]}")
            raise invalid("status", rule, found)
        # Which outputs a model gives is known as soon as it has run for a test without failing.
        run = (self.status != "failed") & np.isfinite(self.F).any(axis=1)
        for name in layout.units if run.any() else ():
            known_name("units", name, layout.columns)

    @classmethod
    def of(
        cls,
        numbers: ArrayLike,
        X: Any,
        F: ArrayLike,
        G: ArrayLike | None = None,
        H: ArrayLike | None = None,
        *,
        outputs: Mapping[str, ArrayLike] | None = None,
        reasons: Mapping[int, str] | None = None,
        layout: Layout | None = None,
        extra: Mapping[str, Any] | None = None,
    ) -> TestTable:
        """Return a table of evaluated designs; their status follows from the constraints.

        A design with a reason has failed. A design that meets its constraints but whose objectives
        are not all finite has failed as well, for that reason.

        Args:
            numbers: ``(n,)`` numbers of the test points, from 1, each once.
            X: ``(n, n_var)`` designs, or n mappings from variable to value.
            F: ``(n, m)`` objectives, all minimised, those that the layout says are maximised with
                the sign turned; NaN and infinity are allowed.
            G: ``(n, n_ieq)`` inequality constraints, met where <= 0.
            H: ``(n, n_eq)`` equality constraints, met within the tolerance.
            outputs: ``(n,)`` values of what else the model gives, by name; they follow those
                that the layout names, which are NaN where they are not given.
            reasons: Why designs failed, for their numbers.
            layout: Names, directions, units, kinds, bounds and tolerance; default names, all
                objectives minimised and no bounds unless given.
            extra: ``(n,)`` columns carried along that are neither, by name.

        Raises:
            ArgumentValueError: The arrays do not fit each other or the layout.
            ArgumentTypeError: An array holds what it cannot.

        Example:
            >>> table = TestTable.of([1, 2], X=[[0.0], [0.5]], F=[[3.0], [4.0]], G=[[0.0], [0.1]])
            >>> table.status.tolist()
            ['ok', 'infeasible']
        """
        F = real_array("F", F)
        n = len(F) if F.ndim else 0
        none = np.zeros((n, 0))
        G, H = (none if v is None else real_array(name, v) for name, v in (("G", G), ("H", H)))
        if layout is None:
            X = design_matrix("X", X)
            layout = Layout.of(X.shape[1], *(v.shape[1] if v.ndim == 2 else 0 for v in (F, G, H)))
        columns = mapping("outputs", {} if outputs is None else outputs, "names to values")
        names = tuple(dict.fromkeys((*layout.outputs, *columns)))
        layout = layout if names == layout.outputs else replace(layout, outputs=names)
        further = np.full((n, len(names)), np.nan)
        for name, column in columns.items():
            values = real_array(f"the output {name!r}", column)
            if values.shape != (n,):
                found = Received(f"shape {values.shape}")
                raise invalid(f"the output {name!r}", f"of shape {(n,)}", found)
            further[:, names.index(name)] = values
        more: Any = {"reasons": reasons or {}, "extra": extra or {}, "outputs": further}
        return cls(layout, numbers, X, F, G, H, **more)  # type: ignore[arg-type]

    @classmethod
    def empty(cls, layout: Layout | None = None) -> TestTable:
        """Return a table without any test.

        Args:
            layout: Names, kinds, bounds and tolerance. Without one the table takes the layout of
                the first block it is extended by.

        Example:
            >>> table = TestTable.empty()
            >>> len(table), len(table.extended(TestTable.of([1], [[0.5]], [[2.0]])))
            (0, 1)
        """
        layout = Layout.of() if layout is None else layout
        blocks: Any = {name: np.zeros((0, len(names))) for name, names in layout.blocks.items()}
        return cls(layout, np.zeros(0, dtype=np.int64), **blocks)

    def __repr__(self) -> str:
        """Return the size of the table."""
        counts = ", ".join(f"{np.sum(self.status == status)} {status}" for status in STATUSES)
        layout, tests = self.layout, counted(len(self), "test")
        groups = {w: getattr(layout, f"{w}s") for w in ("variable", "objective", "constraint")}
        groups |= {"output": layout.outputs} if layout.outputs else {}
        sizes = [counted(len(names), word) for word, names in groups.items()]
        if again := int(np.count_nonzero(self.repeats)):
            tests += f" of {counted(len(self) - again, 'design')}"
        return f"TestTable({tests}: {counts}; {', '.join(sizes)})"

    def __len__(self) -> int:
        """Return the number of tested points."""
        return len(self.numbers)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """What each variable is: as the layout says, or as the values of the designs.

        Example:
            >>> table = TestTable.of([1], [{"width": 0.5, "teeth": 12, "metal": "iron"}], [[1.0]])
            >>> [kind.value for kind in table.kinds]
            ['real', 'integer', 'choice']
        """
        return self.layout.kinds or column_kinds(self.X)

    @property
    def names(self) -> list[str]:
        """What sentences call the n designs, each another: by the label, else by test point.

        Of designs with the same label each has its number behind it; a label that is a number has
        the name of its column before it.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]])
            >>> table.names
            ['test point 1', 'test point 2', 'test point 3']
            >>> from dataclasses import replace
            >>> layout = replace(table.layout, label="row_no")
            >>> replace(table, layout=layout, extra={"row_no": ["A", "A", 7]}).names
            ['A #1', 'A #2', 'row no 7']
        """
        label, numbers = self.layout.label, self.numbers.tolist()
        if label is None:
            return [f"test point {number}" for number in numbers]
        texts = [str(cell) for cell in self.extra[label].tolist()]
        count, word = Counter(texts), label.replace("_", " ")
        pairs = zip(texts, numbers, strict=True)
        texts = [text if count[text] == 1 else f"{text} #{number}" for text, number in pairs]
        return [f"{word} {t}" if re.fullmatch(r"\d+( #\d+)?", t) else t for t in texts]

    @property
    def repeats(self) -> Mask:
        """``(n,)`` which tests repeat the design and the objectives of one before.

        PSI calls the model once for each design, and in a Pareto set the first test of a design
        stands for all.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[4], [5], [4]], [[0.3], [0.2], [0.3]])
            >>> table.repeats
            array([False, False,  True])
        """
        return self._repeated(np.arange(len(self)))

    def _repeated(self, rows: NDArray[np.intp]) -> Mask:
        # In one experiment a real variable that is free never has a value twice; of several, two
        # may begin with the same points.
        bounds = zip(self.kinds, self.layout.lower, self.layout.upper, strict=True)
        free = any(kind.real and low != high for kind, low, high in bounds)
        if free and len(self.experiments) < 2:
            return np.zeros(len(rows), dtype=bool)
        return np.asarray(first_rows(self.X[rows], self.F[rows]) < np.arange(len(rows)))

    @property
    def experiments(self) -> tuple[str, ...]:
        """Names of the experiments that :meth:`combined` has joined; empty for other tests.

        Example:
            >>> table = TestTable.of([1], [[0.0]], [[3.0]])
            >>> TestTable.combined({"old": table, "new": table}).experiments
            ('old', 'new')
        """
        joined = {*ORIGIN} <= {*self.extra}
        return tuple(dict.fromkeys(self.extra["experiment"].tolist())) if joined else ()

    def column(self, name: str) -> NDArray[Any]:
        """``(n,)`` values of a variable, objective, constraint, output or extra column.

        Objectives are in the original direction.

        Raises:
            ArgumentValueError: There is no such column.
            ArgumentTypeError: The name is not text.

        Example:
            >>> layout = Layout.of(["width"], ["mass", "gain"], maximize=["gain"])
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[3, -0.8], [4, -0.9]], layout=layout)
            >>> table.column("width"), table.column("gain")
            (array([0.1, 0.5]), array([0.8, 0.9]))
        """
        layout = self.layout
        if known_name("column", name, (*layout.columns, *self.extra)) in self.extra:
            return self.extra[name]
        block, names = next(pair for pair in layout.blocks.items() if name in pair[1])
        values: NDArray[Any] = getattr(self, block)[:, names.index(name)]
        return -values if name in layout.objectives and name in layout.maximize else values

    # Sets of designs under limits

    def feasible(self, limits: Limits | None = None) -> Mask:
        """``(n,)`` which designs are "ok" and keep the limits.

        Raises:
            ArgumentValueError: A column is not known, or a limit is NaN or on a constraint.
            ArgumentTypeError: The limits are no mapping to numbers or pairs of them.

        Example:
            >>> X, F, G = [[0.1], [0.5], [0.9]], [[1], [2], [3]], [[0.5], [0.0], [0.0]]
            >>> table = TestTable.of([1, 2, 3], X, F, G)
            >>> table.feasible()
            array([False,  True,  True])
            >>> table.feasible({"f1": 2})
            array([False,  True, False])
        """
        ok: Mask = self.status == "ok"
        # Of tests that all failed, as the first ones may, it is unknown which outputs they have.
        if (self.status == "failed").all():
            return ok
        return ok & within(bounds_of(limits, self.layout), self.column, len(self))

    def eligible(self, limits: Limits | None = None) -> Mask:
        """``(n,)`` which designs are feasible and have finite objectives, so that they compete.

        Example:
            >>> TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [float("inf")]]).eligible()
            array([ True, False])
        """
        return competes(self.F, self.feasible(limits))

    def pareto(self, limits: Limits | None = None) -> Mask:
        """``(n,)`` which designs are Pareto optimal among the eligible ones.

        Of tests with the same design, see :attr:`repeats`, the first stands for all.

        Example:
            Without a limit on f1 no design beats another; with one there are fewer to compare.

            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1, 3], [2, 2], [3, 3]])
            >>> table.pareto()
            array([ True,  True, False])
            >>> table.pareto({"f1": 1.5})
            array([ True, False, False])
        """
        mask = self.eligible(limits)
        if self.F.shape[1] > 0:  # without objectives no design is better than another
            mask[mask] = nondominated(self.F[mask])
        mask[mask] = ~self._repeated(np.flatnonzero(mask))
        return mask

    def ranking(self, limits: Limits | None = None, *, normalize: bool = True) -> EfficiencyRanking:
        """Rank the Pareto-optimal designs by efficiency; see :func:`~pymoo_psi.rank_of_efficiency`.

        Returns:
            The ranking of the rows ``self.pareto(limits)``, in that order, without another search
            for the Pareto set; its objectives have the table's names and directions, and its rows
            the numbers of their test points as labels: ``.to_frame()`` has the index
            ``test_point``.

        Raises:
            ArgumentValueError: There is no design to rank, or a limit does not fit.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> front = table.rows(table.pareto())
            >>> front.numbers[table.ranking().salukvadze]
            array([2])
        """
        import pandas as pd

        rows = np.flatnonzero(self.pareto(limits))
        # All of them are optimal: the search is not done twice.
        known = np.ones(len(rows), dtype=bool)
        labels = pd.Index(self.numbers[rows], name="test_point")
        fixed = self.layout.fixed_ends()
        return ranking_of(self._objectives(rows, labels), known, normalize=normalize, **fixed)

    def ranked(
        self, limits: Limits | None = None, *, normalize: bool = True
    ) -> tuple[NDArray[np.intp], EfficiencyRanking]:
        """Rank all feasible designs, dominated ones among them, each design once.

        What commands, page and report show: without a design of the Pareto set those that it
        dominates may come into it, which :func:`~pymoo_psi.cautions` report.

        Returns:
            ``(k,)`` the rows of the table that are ranked, and their ranking in that order, its
            labels the designs' :attr:`names`.

        Raises:
            ArgumentValueError: As :meth:`ranking`.

        Example:
            >>> table = TestTable.of([4, 5, 6], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [2, 2]])
            >>> rows, ranking = table.ranked()
            >>> rows, ranking.rank, ranking.name_of(1)
            (array([0, 1, 2]), array([6, 6, 0]), 'test point 5')
        """
        rows = np.flatnonzero(self.eligible(limits))
        rows = rows[~self._repeated(rows)]
        names = self.names
        objectives = self._objectives(rows, [names[row] for row in rows])
        known, fixed = self.pareto(limits)[rows], self.layout.fixed_ends()
        return rows, ranking_of(objectives, known, normalize=normalize, **fixed)

    def _objectives(self, rows: NDArray[np.intp], labels: Any) -> Objectives:
        """Return the objectives of some rows, in the original direction; there must be one."""
        if len(rows) == 0:
            raise self._none_feasible()
        sign = self.layout.sign
        F = Objectives.of(self.F[rows]).values * sign + 0.0  # no -0.0
        return Objectives(F, sign, self.layout.objectives, labels)

    def _none_feasible(self) -> ArgumentValueError:
        failed = np.sum(self.status == "failed")
        found = Received(f"none of {counted(len(self), 'test')}, of which {failed} failed")
        remedy = "see its reasons" if failed else "loosen the limits, or test more points"
        return invalid("the table", "one with a feasible design", found, remedy)

    def best(self, limits: Limits | None = None, *, normalize: bool = True) -> TestTable:
        """Return the Salukvadze optimum, the nearest design to the ideal point, as one row.

        Raises:
            ArgumentValueError: As :meth:`ranking`.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> table.best().names, table.best().F
            (['test point 2'], array([[1., 1.]]))
        """
        first = self.ranking(limits, normalize=normalize).salukvadze[0]
        return self.rows(np.flatnonzero(self.pareto(limits))[[first]])

    def explain(
        self, test_point: int | None = None, limits: Limits | None = None, *, normalize: bool = True
    ) -> Explanation:
        """Say why a design: :func:`pymoo_psi.explain` among the feasible designs of the table.

        Names, directions and units are the table's.

        Args:
            test_point: Its number; the Salukvadze optimum unless given.
            limits: Limits that a feasible design must keep.
            normalize: As for :meth:`ranking`.

        Raises:
            ArgumentValueError: There is no such feasible design, or a limit does not fit.

        Example:
            >>> table = TestTable.of([4, 5, 6], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
            >>> print(table.explain().sentences[0])
            Test point 5 is the Salukvadze optimum: the nearest of 3 Pareto-optimal designs to the
            ideal point.
        """
        rows, ranking = self.ranked(limits, normalize=normalize)
        i, numbers = int(ranking.salukvadze[0]), self.numbers[rows].tolist()
        if test_point is not None:
            if test_point not in numbers:
                raise invalid("test_point", "the number of a feasible design", test_point)
            i = numbers.index(test_point)
        units = {n: unit for n, unit in self.layout.units.items() if n in self.layout.objectives}
        return explain(ranking, i, units=units)

    def sorted_by(self, objective: Key, limits: Limits | None = None) -> TestTable:
        """Return the ordered test table of an objective: the feasible designs, the best first.

        The largest value is the best one if the objective is maximised. It is a table again, for
        the next question, a frame or a file. Equal designs stay in the order of testing; those
        whose value is NaN come last.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[2, 5], [1, 6], [3, 4]])
            >>> table.sorted_by("f1").numbers, table.sorted_by("f1", {"f2": 5}).numbers
            (array([2, 1, 3]), array([1, 3]))
        """
        values = self.F[:, self.layout.objective(objective)]
        rows = np.flatnonzero(self.feasible(limits))
        # stable keeps the order of testing among equals; numpy sorts NaN behind infinity.
        return self.rows(rows[np.argsort(values[rows], kind="stable")])

    def violations(self, limits: Limits | None = None) -> tuple[Mask, tuple[str, ...]]:
        """Return which constraint and limit each design violates, and their names.

        Returns:
            ``(n, k)`` mask, with a column for each constraint and then for each limit, and the k
            names. Rows of failed designs are False, and limits of those that a requirement kept
            from running: what was not computed violates nothing.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[2.0], [-2.0]])
            >>> mask, names = table.violations({"f1": 1.5})
            >>> mask.tolist(), names
            ([[True, False], [False, True]], ('g1', 'f1'))
        """
        chosen = bounds_of(limits, self.layout)
        over = [
            ~within({name: ends}, self.column, len(self))[:, None] for name, ends in chosen.items()
        ]
        own = violated_constraints(self.G, self.H, self.layout.eq_tolerance)
        known = np.asarray(~own.any(axis=1) | np.isfinite(self.F).any(axis=1))
        mask = np.hstack([own, *(np.where(known[:, None], each, False) for each in over)])
        mask[self.status == "failed"] = False
        return mask, self.layout.constraints + tuple(chosen)

    def under(self, formulation: Formulation) -> TestTable:
        """Return the table of the same tests under another formulation, without an evaluation.

        It is the table that the problem so formulated would give: other objectives and directions,
        with the limits among the constraints, and the rest among the outputs. Numbers and designs
        stay. A design with an objective that cannot be computed has failed; one that failed in its
        evaluation stays failed, as its values are not known.

        Raises:
            ArgumentValueError: A column is not there, or cannot be what is asked of it.

        Example:
            >>> from pymoo_psi import Formulation
            >>> layout = Layout.of(["width"], ["mass"], ["stress"], outputs=["gain"])
            >>> table = TestTable.of(
            ...     [1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]], G=[[0.2], [-0.1], [-0.3]],
            ...     outputs={"gain": [0.5, 0.7, 0.6]}, layout=layout)
            >>> asked = Formulation(
            ...     objectives=["mass", "gain"], maximize=["gain"], limits={"stress": 0.3},
            ...     relaxed=["stress"])
            >>> table.under(asked).pareto(), table.pareto()
            (array([ True,  True, False]), array([False,  True, False]))
        """
        instance("formulation", formulation, Formulation)
        columns = {name: self.column(name) for name in self.layout.columns}
        layout, columns, limits = formulated(formulation, self.layout, columns)
        blocks = blocks_of(layout, columns, len(self))
        # Failed for an objective, such a design may count under others; failed in its evaluation,
        # it has no values, and gets those that an evaluation gives to what fails.
        reasons, rows = {}, []
        for i in np.flatnonzero(self.status == "failed"):
            reason = self.reasons.get(int(self.numbers[i]), "")
            if reason != _lack(self, i):
                reasons[int(self.numbers[i])] = reason
                rows.append(i)
        for name, value in (("F", np.inf), ("G", 0.0), ("H", 0.0), ("outputs", np.nan)):
            known = blocks[name][rows]
            blocks[name][rows] = np.where(np.isfinite(known), known, value)
        former, X = self.layout.variables, self.X
        if layout.variables != former:
            X = design_matrix("X", X[:, [former.index(name) for name in layout.variables]])
        problem = _facts_of(self.problem, "sampling")
        chosen = self.chosen
        if formulation.chosen is not None:
            chosen = (formulation.chosen, formulation.reason)
        table = self._with(layout=layout, X=X, **blocks, problem=problem, chosen=chosen)
        table._set(table._status(reasons))
        tested = table.status != "failed"
        idle = [n for n in limits if tested.any() and (columns[n][tested] <= 0).all()]
        said = [f"The limit {name} rejects no design." for name in idle]
        return table._with(remarks=(*self.remarks, *said))

    def refined_bounds(
        self, limits: Limits | None = None, *, margin: float = 0.0
    ) -> tuple[Array, Array]:
        """Return the bounds of the feasible set, for the next investigation.

        Args:
            limits: Limits on columns.
            margin: Widen them on each side by this share of their width, but not beyond the
                bounds of this table. Integers are rounded outwards.

        Returns:
            Lower and upper bounds, ``(n_var,)`` each; NaN for choices and binary variables.

        Raises:
            ArgumentValueError: No design is feasible, or the margin is below 0.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.0], [0.5], [0.7]], [[3.0], [1.0], [2.0]])
            >>> table.refined_bounds({"f1": 2.0}, margin=0.5)
            (array([0.4]), array([0.8]))
        """
        if finite_number("margin", margin) < 0:
            raise invalid("margin", "0 or more", margin)
        feasible = self.feasible(limits)
        if not feasible.any():
            raise self._none_feasible()
        lower, upper = self.layout.lower.copy(), self.layout.upper.copy()
        for j, kind in enumerate(self.kinds):
            if not kind.real and kind is not Kind.INTEGER:
                continue
            column = self.X[feasible, j].astype(np.float64)
            low, high = column.min(), column.max()
            if kind is Kind.LOG:
                low, high = low / (high / low) ** margin, high * (high / low) ** margin
            else:
                low, high = low - margin * (high - low), high + margin * (high - low)
            if kind is Kind.INTEGER:
                low, high = np.floor(low), np.ceil(high)
            # fmax and fmin ignore a bound that is NaN, as there is none.
            lower[j], upper[j] = np.fmax(low, lower[j]), np.fmin(high, upper[j])
        return lower, upper

    # Parts of tables, and tables put together

    def rows(self, selection: ArrayLike) -> TestTable:
        """Return the table of some rows.

        Args:
            selection: ``(n,)`` mask, or ``(k,)`` indices of rows in the wanted order.

        Raises:
            ArgumentValueError: A mask of another length, an index out of range or twice.
            ArgumentTypeError: The selection is neither mask nor indices.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]])
            >>> table.rows([2, 0]).numbers, table.rows(table.F[:, 0] > 1).numbers
            (array([3, 1]), array([2, 3]))
        """
        chosen = np.asarray(selection)
        # numpy makes float64 of [], which selects no row and is no mistake.
        if chosen.size == 0 and chosen.dtype != bool:
            chosen = chosen.astype(np.intp)
        if chosen.dtype.kind not in "biu" or chosen.ndim != 1:
            raise wrong_type("selection", "a mask or indices", Received(f"dtype {chosen.dtype}"))
        try:
            numbers = self.numbers[chosen]
        except IndexError as error:
            raise invalid("selection", "a mask or indices of rows", Received(error)) from error
        # Rows of a right table are right, unless one that is selected twice.
        _require_distinct(numbers)
        cut: dict[str, Any] = {name: getattr(self, name)[chosen] for name in _ARRAYS}
        cut["extra"] = {name: column[chosen] for name, column in self.extra.items()}
        kept = {*numbers.tolist()} if self.reasons else ()
        reasons = {n: text for n, text in self.reasons.items() if n in kept}
        return self._with(numbers=numbers, reasons=reasons, **cut)

    def extended(self, *blocks: TestTable) -> TestTable:
        """Return this table with the tests of others behind its own, in their order.

        Joining many blocks in one call copies the rows once. An output that one of them does not
        have is NaN for its tests.

        Raises:
            ArgumentValueError: A block has another layout, or a test point occurs twice.
            ArgumentTypeError: A block is no table.

        Example:
            >>> first, second = (TestTable.of([n], [[0.1 * n]], [[1.0]]) for n in (1, 2))
            >>> first.extended(second).numbers
            array([1, 2])
        """
        for block in blocks:
            instance("block", block, TestTable)
        whole = stacked([self, *blocks])
        _require_distinct(whole.numbers)
        return whole

    def merge(self, other: TestTable) -> TestTable:
        """Return the tests of this and another run of the same problem, by number of test point.

        ``PSI(1024)`` and ``PSI(3072, first=1025)`` merged are ``PSI(4096)``. A test point in both
        tables counts once, with the outputs and extra columns of both.

        Raises:
            ArgumentValueError: The tables differ in names, directions, units, bounds, tolerance or
                problem, or in results of a test point or design by more than rounding.
            ArgumentTypeError: ``other`` is no table.

        Example:
            >>> ahead = TestTable.of([3, 4], [[0.25], [0.75]], [[1], [3]])
            >>> TestTable.of([1, 2], [[0.0], [0.5]], [[0], [2]]).merge(ahead).numbers
            array([1, 2, 3, 4])
        """
        whole = stacked([self, instance("other", other, TestTable)])
        _, rows, inverse = np.unique(whole.numbers, return_index=True, return_inverse=True)
        first = rows[inverse]
        require_one_result(whole, first)
        again = np.flatnonzero(first != np.arange(len(whole)))
        before = first[again]
        outputs = whole.outputs.copy()
        outputs[before] = np.where(np.isnan(outputs[before]), outputs[again], outputs[before])
        extra = {name: column.copy() for name, column in whole.extra.items()}
        for column in extra.values():
            unknown = blank(column[before])
            column[before[unknown]] = column[again[unknown]]
        table = whole._with(outputs=outputs, extra=extra).rows(rows)
        require_one_result(table)
        return table

    @classmethod
    def combined(cls, experiments: Mapping[str, TestTable]) -> TestTable:
        """Return the tests of several experiments on one problem: other bounds, sequences, methods.

        Test points are numbered on from experiment to experiment; the extra columns ``experiment``
        and ``number`` say where each is from. Sets, ranks and plots are over all. The bounds hold
        those of all, and are unknown where one has none; an output that an experiment lacks is NaN
        for its tests.

        Args:
            experiments: The tables by a name for each.

        Raises:
            ArgumentValueError: The tables differ in names, directions, units, kinds, tolerance or
                problem, or in the results of a design.
            ArgumentTypeError: The experiments are no mapping of one table or more.

        Example:
            >>> coarse = TestTable.of([1, 2], [[0.0], [0.5]], [[3.0], [1.0]])
            >>> refined = TestTable.of([1, 2], [[0.4], [0.6]], [[0.9], [2.0]])
            >>> table = TestTable.combined({"coarse": coarse, "refined": refined})
            >>> print(table.to_frame()[["experiment", "number", "f1", "pareto"]])
                       experiment number   f1  pareto
            test_point
            1              coarse      1  3.0   False
            2              coarse      2  1.0   False
            3             refined      1  0.9    True
            4             refined      2  2.0   False
        """
        if not isinstance(experiments, Mapping) or not experiments:
            rule = "tables by name, such as {'coarse': a, 'refined': b}"
            raise wrong_type("experiments", rule, experiments)
        tables = [instance(f"{n!r}", table, TestTable) for n, table in experiments.items()]
        bounds = {}
        if len({table.layout.variables for table in tables}) == 1:
            # NaN, where there is no bound, is passed on.
            bounds["lower"] = np.minimum.reduce([table.layout.lower for table in tables])
            bounds["upper"] = np.maximum.reduce([table.layout.upper for table in tables])
        blocks, last = list[TestTable](), 0
        for name, table in zip(experiments, tables, strict=True):
            origin = dict(zip(ORIGIN, ([name] * len(table), table.numbers.tolist()), strict=True))
            block = table._with(
                layout=replace(table.layout, **bounds),
                numbers=table.numbers + last,
                extra=_extra_columns({**table.extra, **origin}, table.layout, len(table)),
                reasons={n + last: text for n, text in table.reasons.items()},
                problem=_facts_of(table.problem, "problem", "parameters", "key"),
            )
            blocks.append(block)
            last = int(block.numbers.max(initial=last))
        whole = stacked(blocks)
        require_one_result(whole)
        return whole

    def equals(self, other: object) -> bool:
        """Say whether another table has the same tests in everything; NaN is equal to NaN.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]])
            >>> table.equals(table.rows([0, 1])), table.equals(table.rows([0]))
            (True, False)
        """
        if not isinstance(other, TestTable) or len(self) != len(other):
            return False
        one, two = columns_of(self), columns_of(other)
        return (
            not difference(self._with(problem=None), other)
            and [*one] == [*two]
            and not any(unequal(one[name], two[name]).any() for name in one)
        )

    # Frames and files

    def to_frame(self) -> pd.DataFrame:
        """Return the table with one row per test point.

        Returns:
            Index ``test_point``; a column for each variable, objective, constraint, output and
            extra column under its name, objectives in the original direction; ``status``;
            ``violated``, the names of the constraints a design violates; ``reason``, why it
            failed; ``pareto``.

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
        return pd.DataFrame(columns).set_index("test_point")

    def _first_rows(self, n: int) -> tuple[pd.DataFrame, int]:
        # The Pareto set of a million tests is not needed for ten rows.
        frame = self.rows(np.arange(min(n, len(self)))).to_frame().drop(columns="pareto")
        empty = [name for name in ("violated", "reason") if not frame[name].any()]
        headings = {name: self.layout.label_of(name) for name in self.layout.columns}
        return frame.drop(columns=empty).rename(columns=headings), len(self)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table; :meth:`read_csv` reads it back without a change.

        The columns are those of :meth:`to_frame`. Below the rows, a comment holds names,
        directions, units, bounds and tolerance as JSON. Before 3.1 pandas wants
        ``float_precision="round_trip"`` to read the last digit. An interrupted writing leaves the
        old file as it was.

        Raises:
            OSError: The file cannot be written.

        Example:
            >>> import os, tempfile
            >>> import pandas as pd
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = os.path.join(folder, "table.csv")
            ...     table.to_csv(path)
            ...     print(pd.read_csv(path, comment="#", index_col="test_point")[["x1", "f1"]])
                         x1   f1
            test_point
            1           0.0  3.0
            2           0.5  4.0
        """
        CSV.save_tests(path, self)

    def to_xlsx(self, path: str | PathLike[str]) -> None:
        """Write the table as a workbook, which :func:`read_table` reads back without a change.

        The tests are on the first sheet, the columns those of :meth:`to_frame`; what they mean and
        which design is chosen is on the second.

        Args:
            path: A file with the suffix ``.xlsx``.

        Raises:
            PsiError: openpyxl is not installed.
            ArgumentValueError: The file has another suffix.
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

    @classmethod
    def read_csv(cls, path: str | PathLike[str]) -> TestTable:
        """Read a table that :meth:`to_csv` wrote.

        Rows may stand in any order, and further columns are not read; ``violated`` and ``pareto``
        follow from the others.

        Raises:
            ArgumentValueError: The file is not such a table, or is damaged.
            OSError: The file cannot be opened.

        Example:
            >>> import os, tempfile
            >>> table = TestTable.of([1, 2], [[0.0], [0.1]], [[1 / 3], [4]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     table.to_csv(os.path.join(folder, "table.csv"))
            ...     TestTable.read_csv(os.path.join(folder, "table.csv")).equals(table)
            True
        """
        content = Path(path).read_bytes()
        with described(path):
            head, text = split_head(content.decode("utf-8-sig"))
            rows = csv.reader(StringIO(text.removeprefix("#\n"), newline=""))
            tests = tests_of_rows(head, rows, written_text)
        return table_of(tests.head, tests.columns, path, cls)

    @classmethod
    def read_study(cls, path: str | PathLike[str]) -> TestTable:
        """Read the tests of a study file, or of a folder of them, by number; none is changed.

        The studies in a folder are read as one, as runs with ``share=`` fill it. If test points
        of those runs are missing, a warning says which.

        Raises:
            StudyMismatchError: The studies of a folder belong to different problems.
            StudyCorruptError: A file is damaged, or no study.
            StudyVersionError: A later version of the package wrote it.
            StudyAccessError: It does not exist or cannot be read.

        Example:
            >>> import os, tempfile
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     study = os.path.join(folder, "chute.db")
            ...     table = investigate(VectorizedSphereChute(), 8, study=study)
            ...     TestTable.read_study(study).equals(table)
            True
        """
        table = read_tests(path)
        for remark in table.remarks:
            warnings.warn(f"{os.fspath(path)}: {remark}", stacklevel=2)
        return table

    def to_study(self, path: str | PathLike[str]) -> None:
        """Write the table as a new study, which a run continues, whole or not at all.

        So tests of several tables go on as one: ``a.merge(b).to_study("all.db")``, then
        ``minimize(problem, PSI(n, study="all.db"))``. A table whose problem is unknown, as one made
        by :meth:`of`, can be read again, but no run continues it. What evaluations took and where
        designs come from, ``seconds`` and ``origin`` of a study, are no columns of a table and
        stay in the studies that it was read from; ``extra`` columns are not written.

        Raises:
            StudyAccessError: There is a file of that name, or none can be written.

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

    # Inside

    def _status(
        self, reasons: Mapping[int, str], given: NDArray[np.str_] | None = None
    ) -> dict[str, Any]:
        """Return the status that follows from the constraints, and the reasons of failures.

        What failed is that with a reason and, unless the status is given, what meets its
        constraints without finite objectives.
        """
        # Without what no file can hold: reasons are only to be read.
        texts = {n: str(text).encode("utf-8", "backslashreplace") for n, text in reasons.items()}
        whys = {n: text.decode("utf-8").replace("\0", "␀") for n, text in texts.items()}
        reasons = {n: why or "no reason given" for n, why in whys.items()}
        broken = violated_constraints(self.G, self.H, self.layout.eq_tolerance)
        violates = broken.any(axis=1)
        if given is not None:
            failed = given == "failed"
        else:
            failed = np.isin(self.numbers, list(reasons))
            lost = ~failed & ~violates & ~np.isfinite(self.F).all(axis=1)
            reasons |= {int(self.numbers[i]): _lack(self, i) for i in np.flatnonzero(lost)}
            failed |= lost
        status = np.array(STATUSES)[np.where(failed, 2, violates)]
        return {"status": status, "reasons": reasons}

    def _shown_columns(self) -> Columns:
        """Return the columns of frame and file: two follow from the others, for the reader."""
        mask, names = self.violations()
        texts = (", ".join(compress(names, row)) for row in mask.tolist())
        violated = np.fromiter(texts, object)
        columns = columns_of(self)
        for name, cells in self.extra.items():  # 7 is a number to a spreadsheet, "7" is a text
            pairs = zip(cells.tolist(), columns[name], strict=True)
            columns[name] = np.fromiter((c if type(c) is int else t for c, t in pairs), object)
        reason = columns.pop("reason")
        return columns | {"violated": violated, "reason": reason, "pareto": self.pareto()}

    def __deepcopy__(self, memo: dict[int, Any]) -> TestTable:
        """Return the table itself, which never changes; pymoo copies its algorithms often."""
        return self

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a pickled table with its arrays read-only."""
        # numpy's arrays come back writable from a pickle.
        self._set(state)

    def _with(self, **changes: Any) -> TestTable:
        """Return the table with new arrays that are known to be right."""
        # Past __post_init__: parts of checked arrays are right, callers vouch for the rest.
        table = object.__new__(TestTable)
        table._set({f.name: getattr(self, f.name) for f in fields(self)} | changes)
        return table

    def _set(self, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)


def read_tests(path: str | PathLike[str]) -> TestTable:
    """Return the tests of a study or a folder of studies, a remark says which are missing."""
    from pymoo_psi.study import Study, read_folder

    if os.path.isdir(path):
        head, columns, missing = read_folder(path)
    else:
        (facts, columns), missing = Study(path).contents(), ""
        head = facts["head"]
    table = table_of(head, columns, path, TestTable)
    return table._with(remarks=(f"{missing}.",)) if missing else table


def _lack(table: TestTable, row: np.intp) -> str:
    """Say which objective of a test is not finite; empty if all are."""
    for j in np.flatnonzero(~np.isfinite(table.F[row])):
        return f"{table.layout.objectives[j]} is {table.F[row, j] * table.layout.sign[j]}"
    return ""


def _point_numbers(value: ArrayLike) -> NDArray[np.int64]:
    """Return numbers of test points as an array of its own: integers from 1, each once."""
    array = real_array("numbers", value)
    # Beyond 2^53 not every integer is a float64.
    if array.ndim != 1 or not ((array >= 1) & (array < 2**53) & (array == np.floor(array))).all():
        raise invalid("numbers", "one-dimensional, of integers from 1", value)
    numbers = array.astype(np.int64)
    _require_distinct(numbers)
    return numbers


def _require_distinct(numbers: NDArray[np.int64]) -> None:
    """Refuse numbers of test points of which one occurs twice."""
    # Numbers mostly ascend, and then one comparison does without the sorting of unique.
    if (numbers[1:] > numbers[:-1]).all():
        return
    values, counts = np.unique(numbers, return_counts=True)
    if (counts > 1).any():
        twice = Received(f"test point {values[counts > 1][0]} twice")
        raise invalid("the test points of a table", "distinct", twice)


def _extra_columns(extra: Any, layout: Layout, n: int) -> dict[str, NDArray[np.object_]]:
    """Return further columns as arrays of objects, which must be n long and named distinctly."""
    columns = {name: np.fromiter(cells, object) for name, cells in extra.items()}
    for name, column in columns.items():
        if name in (*layout.columns, *RESERVED) or column.shape != (n,):
            rule = f"{n} cells long and named unlike other columns"
            raise invalid("an extra column", rule, Received(f"{name!r} of {len(column)}"))
        column.setflags(write=False)
    if layout.label is not None:
        known_name("label", layout.label, columns)
    return columns


def _facts_of(problem: Mapping[str, Any] | None, *names: str) -> dict[str, Any] | None:
    """Return some facts of a problem's identity, of the model or of the points of a run."""
    return {name: fact for name, fact in (problem or {}).items() if name in names} or None
