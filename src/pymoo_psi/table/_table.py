"""The table of tests: every tested point, and what an investigator asks of them.

The order of work is that of Parameter Space Investigation (Sobol' and Statnikov, Choosing Optimal
Parameters in Problems with Several Criteria, 1981; Statnikov and Matusov, 1995): test the points,
look at the ordered test tables, set limits on the criteria, take the Pareto set of the designs
that are feasible then, and refine the box for the next investigation.
"""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi.table._box import box_of_feasible_set, section_of_table
from pymoo_psi.table._comparison import comparison_with_prototype, make_prototype
from pymoo_psi.table._constraints import broken_names, constraint_as_criterion, cost_of_constraints
from pymoo_psi.table._exchange import FiledRecords
from pymoo_psi.table._layout import Key, Limits
from pymoo_psi.table._merging import difference_of_tables, merged
from pymoo_psi.table._statistics import (
    Dependence,
    Histogram,
    dependence_on_variable,
    histogram_of_variable,
)

if TYPE_CHECKING:
    import pandas as pd


Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class TestTable(FiledRecords):
    """Every tested point of an investigation, in the order of testing.

    Made by :meth:`of` from arrays, by :meth:`empty` and :meth:`extended` block after block, or by
    :meth:`read_csv`. A table never changes; its arrays are read-only.

    Wherever ``limits`` are asked for, they are limits f_j <= f_j** on criteria, by name or index
    from 0: ``{"f1": 2.5, "f3": 0.1}``. They judge the tests anew and need no evaluation.

    Attributes:
        layout: Names of variables, criteria and constraints, bounds of the box, the tolerance of
            equality constraints.
        numbers: ``(n,)`` numbers of the test points, from 1, each once.
        X: ``(n, n_var)`` designs: float64; int64 or bool if all variables are integers or all
            booleans; object if they differ, or are choices.
        F: ``(n, m)`` criteria, all minimised; NaN or infinite where a design failed.
        G: ``(n, n_ieq)`` inequality constraints, met where <= 0.
        H: ``(n, n_eq)`` equality constraints, met where |h| is within the tolerance.
        status: ``(n,)`` "ok", "infeasible" (breaks a constraint) or "failed" (was not computed).
        reasons: Why designs failed, for the numbers of their test points.
        prototype: An existing design to compare with, if there is one.

    Example:
        >>> table = TestTable.of(
        ...     [1, 2, 3], X=[[0.1], [0.5], [0.9]], F=[[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]],
        ...     G=[[-1.0], [0.0], [0.5]])
        >>> table
        TestTable(3 tests: 2 ok, 1 infeasible, 0 failed; 1 variables, 2 criteria, 1 constraints)
        >>> table.feasible({"f1": 1.5}).tolist()
        [True, False, False]
    """

    __test__ = False  # not a test class, whatever its name suggests to pytest

    # Constraints and limits

    def broken(self, limits: Limits | None = None) -> dict[int, tuple[str, ...]]:
        """Return the names of the constraints, and limits, that designs break.

        Returns:
            The names for the number of every design that breaks any; failed designs are left out.

        Example:
            >>> TestTable.of([7], [[0.0]], [[1.0]], G=[[2.0, -2.0]]).broken({"f1": 0.5})
            {7: ('g1', 'f1')}
        """
        return broken_names(self, limits)

    def constraint_costs(self, limits: Limits | None = None) -> pd.DataFrame:
        """Return what each constraint and limit costs, and what relaxing it would buy.

        Returns:
            One row per constraint and then per limit. Columns: ``limit``, what its value must not
            exceed; ``rejects``, how many designs break it; ``alone``, how many it alone rejects;
            and for each criterion the best value among the feasible designs (``f1_feasible``) and
            among those it alone rejects (``f1_alone``); NaN where there are none.

        Example:
            Test 2 breaks the constraint only; without it f1 = 1 would be had instead of 2.

            >>> X, F, G = [[0.1], [0.5], [0.9]], [[2], [1], [4]], [[0.0], [0.5], [0.0]]
            >>> table = TestTable.of([1, 2, 3], X, F, G)
            >>> print(table.constraint_costs({"f1": 3}))
                        limit  rejects  alone  f1_feasible  f1_alone
            constraint
            g1            0.0        1      1          2.0       1.0
            f1            3.0        1      1          2.0       4.0
        """
        return cost_of_constraints(self, limits)

    def with_constraint_as_criterion(self, constraint: Key) -> TestTable:
        """Return the table with a constraint looked at as a criterion more, the last one.

        The criterion has the constraint's name and the value g, or |h|. The constraint is gone, so
        that designs which it alone rejected become feasible; a limit of 0 (or the tolerance) on
        the new criterion restores it, and any other relaxes or tightens it.

        Raises:
            ArgumentValueError: There is no such constraint.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[2], [1]], G=[[-1.0], [0.5]])
            >>> freed = table.with_constraint_as_criterion("g1")
            >>> freed.layout.objectives, freed.status.tolist()
            (('f1', 'g1'), ['ok', 'ok'])
            >>> freed.feasible({"g1": 0}).tolist()  # the constraint again
            [True, False]
        """
        return constraint_as_criterion(self, constraint)

    # Variables

    def histogram(
        self, variable: Key, *, bins: int = 10, limits: Limits | None = None
    ) -> Histogram:
        """Count the tested, feasible and Pareto-optimal designs over the range of a variable.

        Args:
            variable: Name or index of the variable.
            bins: Equal bins of the box of a real variable; others have one bin for each value.
            limits: Limits on criteria.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.0], [0.75], [1.0]], [[1], [2], [3]])
            >>> histogram = table.histogram("x1", bins=2, limits={"f1": 2})
            >>> histogram.edges, histogram.tested, histogram.feasible
            (array([0. , 0.5, 1. ]), array([1, 2]), array([1, 1]))
        """
        return histogram_of_variable(self, variable, bins=bins, limits=limits)

    def dependence(
        self, criterion: Key, variable: Key, *, limits: Limits | None = None
    ) -> Dependence:
        """Return the projection of all designs onto a variable and a criterion, as data to draw.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[3.0], [2.0]])
            >>> seen = table.dependence("f1", "x1", limits={"f1": 2.5})
            >>> seen.x, seen.f, seen.feasible
            (array([0.1, 0.5]), array([3., 2.]), array([False,  True]))
        """
        return dependence_on_variable(self, criterion, variable, limits=limits)

    def section_points(
        self,
        design: int | ArrayLike,
        variable: Key,
        n: int,
        lower: float | None = None,
        upper: float | None = None,
    ) -> NDArray[Any]:
        """Return the designs of a one-at-a-time section, for the problem to evaluate.

        Args:
            design: Number of the test point the section goes through, or ``(n_var,)`` a design.
            variable: Name or index of the variable that runs, a real one or an integer.
            n: Number of designs.
            lower: Where the variable starts; at the lower bound of the box unless given.
            upper: Where it ends; at the upper bound unless given.

        Returns:
            ``(n, n_var)`` designs; see :func:`pymoo_psi.table.section_points`.

        Raises:
            ArgumentValueError: The test point or variable is not there, or has no bounds, or is a
                choice or a boolean.

        Example:
            >>> table = TestTable.of([1, 2], X=[[1.0, 5.0], [2.0, 4.0]], F=[[6.0], [6.0]])
            >>> table.section_points(2, "x1", 3, lower=0, upper=4)
            array([[0., 4.], [2., 4.], [4., 4.]])
        """
        return section_of_table(self, design, variable, n, lower, upper)

    def refined_bounds(
        self, limits: Limits | None = None, *, margin: float = 0.0
    ) -> tuple[Array, Array]:
        """Return the box of the feasible set, for the next investigation.

        Args:
            limits: Limits on criteria.
            margin: Widen the box on each side by this share of its width, but not beyond the
                bounds of this table. Integers are rounded outwards.

        Returns:
            Lower and upper bounds, ``(n_var,)`` each; NaN for choices and booleans.

        Raises:
            ArgumentValueError: No design is feasible, or the margin is below 0.

        Example:
            >>> table = TestTable.of([1, 2, 3], [[0.0], [0.5], [0.7]], [[3.0], [1.0], [2.0]])
            >>> table.refined_bounds({"f1": 2.0}, margin=0.5)
            (array([0.4]), array([0.8]))
        """
        return box_of_feasible_set(self, limits=limits, margin=margin)

    # A prototype

    def with_prototype(
        self,
        x: ArrayLike,
        f: ArrayLike,
        g: ArrayLike | None = None,
        h: ArrayLike | None = None,
        *,
        name: str = "prototype",
    ) -> TestTable:
        """Return the table with an existing design carried along.

        Args:
            x: ``(n_var,)`` its variables; they may lie outside the box.
            f: ``(m,)`` its criteria, finite.
            g: ``(n_ieq,)`` its inequality constraints; not known unless given.
            h: ``(n_eq,)`` its equality constraints; not known unless given.
            name: What it is called.

        Raises:
            ArgumentValueError: A value is missing, or a criterion is not finite.
            ArgumentTypeError: A value is not a number, the name is not text.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [1.0]], [[1.0, 4.0], [2.0, 2.0]])
            >>> table.with_prototype([0.3], [3.0, 3.0], name="model of 2019").prototype.name
            'model of 2019'
        """
        return self._with(prototype=make_prototype(self, name, x, f, g, h))

    def compare_with_prototype(self, limits: Limits | None = None) -> pd.DataFrame:
        """Return what the Pareto-optimal designs gain on the prototype, the best first.

        Returns:
            Index ``test_point``; columns: the criteria; ``gain_f1`` …, the prototype's value less
            the design's, above 0 where the design is better; ``better_in``, in how many criteria
            it is; ``dominates``, nowhere worse and somewhere better; ``better_in_all``.

        Raises:
            ArgumentValueError: The table has no prototype.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [1.0]], [[1.0, 4.0], [2.0, 2.0]])
            >>> table.with_prototype([0.3], [3.0, 3.0]).compare_with_prototype().iloc[:, 2:5]
                        gain_f1  gain_f2  better_in
            test_point
            2               1.0      1.0          2
            1               2.0     -1.0          1
        """
        return comparison_with_prototype(self, limits)

    # Tables of several runs

    def merge(self, other: TestTable) -> TestTable:
        """Return the tests of this and another run of the same problem, by number of test point.

        ``PSI(1024)`` and ``PSI(3072, first=1025)`` merged are ``PSI(4096)``. A test point in both
        tables counts once.

        Raises:
            ArgumentValueError: The tables differ in names, bounds, tolerance or prototype, or
                have other results for the same test point.
            ArgumentTypeError: ``other`` is no table.

        Example:
            >>> ahead = TestTable.of([3, 4], [[0.25], [0.75]], [[1], [3]])
            >>> TestTable.of([1, 2], [[0.0], [0.5]], [[0], [2]]).merge(ahead).numbers
            array([1, 2, 3, 4])
        """
        return merged(self, other)

    def equals(self, other: TestTable) -> bool:
        """Say whether another table is the same in everything; NaN is equal to NaN.

        Example:
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]])
            >>> table.equals(table.rows([0, 1])), table.equals(table.rows([0]))
            (True, False)
        """
        return not difference_of_tables(self, other)

    @staticmethod
    def read_study(path: str | PathLike[str]) -> TestTable:
        """Read the tests of a study file, by number; the file is not changed.

        Raises:
            StudyCorruptError: The file is damaged, or no study.
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
        from pymoo_psi.storage import read_study  # which needs this module

        return read_study(path)
