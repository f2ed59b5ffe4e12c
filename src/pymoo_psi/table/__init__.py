"""The test table: tested points under limits, their analysis, and their files.

The dialogue of PSI: test points, look, set limits on what you see, find that a criterion was
forgotten, test a part of the box, and only then take the Pareto set. The question may change after
the tests; nothing of it costs an evaluation.

Example:
    A cantilever of 1 m with 5 kN at its end. Names, units and senses come from the problem; any
    further number of a model is kept as a column.

    >>> from pymoo.core.problem import Problem
    >>> from pymoo_psi import Formulation, Restricted, TestTable, explain, investigate
    >>> from pymoo_psi.table import constraint_costs
    >>> class Beam(Problem):
    ...     names = {"x1": "width", "x2": "height", "f1": "mass", "f2": "stiffness",
    ...              "g1": "slender"}
    ...     units = {"width": "mm", "height": "mm", "mass": "kg", "stiffness": "N/mm"}
    ...     maximize = ["stiffness"]
    ...     def __init__(self):
    ...         super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=[20, 40], xu=[60, 160])
    ...     def _evaluate(self, X, out, *args, **kwargs):
    ...         width, height = X.T
    ...         out["F"] = [7.85e-3 * width * height, -52.5e-6 * width * height**3]
    ...         out["G"] = height - 4 * width
    ...         out["stress"] = 3e7 / (width * height**2)
    >>> table = investigate(Beam(), 256)
    >>> best = table.sorted_by("stiffness").to_frame()
    >>> print(best[["width", "mass", "stiffness"]].head(2).round(1))
                width  mass  stiffness
    test_point
    128          59.7  74.5    12610.9
    248          57.3  68.9    10775.9

    Limits on any column, ``(lower, upper)`` for both ends, and what each of them costs: how many
    tests it rejects, and how many it alone.

    >>> limits = {"mass": 45, "stress": 60}
    >>> print(constraint_costs(table, limits)[["rejects", "alone"]])
                rejects  alone
    constraint
    slender          45     21
    mass             49     48
    stress          161    138

    More points where designs are feasible, the tests of both experiments in one table, and the
    stress a criterion from now on:

    >>> part = Restricted(Beam(), table.refined_bounds(limits, margin=0.1))
    >>> both = TestTable.combined({"whole": table, "part": investigate(part, 256)})
    >>> asked = Formulation(objectives=["mass", "stiffness", "stress"], limits=limits)
    >>> judged = both.under(asked)
    >>> judged
    TestTable(512 tests: 106 ok, 406 infeasible, 0 failed; 2 variables, 3 objectives, 3 constraints)
    >>> front = judged.rows(judged.pareto()).to_frame()[["mass", "stiffness", "stress"]]
    >>> best = int(judged.ranking().salukvadze[0])
    >>> print(explain(front, best, maximize=["stiffness"]).sentences[1])
    Behind the best in mass by 7.321 (64 % of its range), stiffness by 831.8 (30 %), stress by 4.744
    (22 %); weakest in mass.

A :class:`Formulation` says which columns are criteria and in which sense, limits on any column,
constraints relaxed or turned into criteria, and columns computed from others
(``computed={"ratio": "mass / stress"}``; arithmetic of columns, never Python code). ``to_json`` and
the command's ``--formulation`` keep it. The same day from the command line, the class above in
``beam.py``:

    pymoo-psi solve beam:Beam --points 256 --study whole.db --limits "mass<=45, stress<=60"
    pymoo-psi rank whole.db --limits "mass<=45, stress<=60" --criterion stress
    pymoo-psi solve beam:Beam --points 256 --study part.db --box "width=33:43, height=115:149"
    pymoo-psi combine whole=whole.db part=part.db --out all.csv
    pymoo-psi rank all.csv --limits "mass<=45, stress<=60" --criterion stress
    pymoo-psi analyze whole.db

Further functions of a table: first-order :func:`sensitivities` with bands and
:func:`feasibility_rules` (extra ``sensitivity``), :func:`convergence` of the decision with the
number of tests, histograms, dependences, one-at-a-time sections, what is gained on an existing
design; :mod:`pymoo_psi.plots` draws them.

Files: ``to_csv`` and ``read_csv`` change nothing. pandas reads the file by
``pd.read_csv(path, comment="#")``; before 3.1 it wants ``float_precision="round_trip"`` for the
last digit. :func:`read_table` opens any source: a study, a folder of shares, a CSV or other text
whose first line names the columns, a workbook (extra ``xlsx``), a frame, and what the command and
the page write. A number that can be read in two ways is refused, with its row, its column and the
option that settles it; so are rows that summarise others (Total, Mean, Max), and workbooks that
hide rows. An apostrophe leads an exported text that a spreadsheet would run as a formula.
"""

from pymoo_psi._kinds import Kind
from pymoo_psi.table._analysis import (
    Histogram,
    alike,
    compare_with_prototype,
    constraint_costs,
    design_of,
    histogram,
    section_points,
)
from pymoo_psi.table._convergence import Convergence, convergence
from pymoo_psi.table._design_file import DesignFile
from pymoo_psi.table._designs import (
    column_kinds,
    design_keys,
    design_matrix,
    real_column,
    value_ranks,
    values_in_order,
)
from pymoo_psi.table._files import columns_of, head_of, kinds_of_columns, table_of
from pymoo_psi.table._formulation import Formulation
from pymoo_psi.table._layout import RESERVED, Key, Layout, Limit, Limits, is_writable
from pymoo_psi.table._limits import Bounds, bounds_of, ends, excess, lacking, within
from pymoo_psi.table._rules import FeasibilityRules, Rule, feasibility_rules
from pymoo_psi.table._sensitivity import sensitivities
from pymoo_psi.table._source import designs_head, read_table
from pymoo_psi.table._sources import read_designs
from pymoo_psi.table._table import STATUSES, TestTable, other_problem, read_tests

__all__ = [
    "RESERVED",
    "STATUSES",
    "Bounds",
    "Convergence",
    "DesignFile",
    "FeasibilityRules",
    "Formulation",
    "Histogram",
    "Key",
    "Kind",
    "Layout",
    "Limit",
    "Limits",
    "Rule",
    "TestTable",
    "alike",
    "bounds_of",
    "column_kinds",
    "columns_of",
    "compare_with_prototype",
    "constraint_costs",
    "convergence",
    "design_keys",
    "design_matrix",
    "design_of",
    "designs_head",
    "ends",
    "excess",
    "feasibility_rules",
    "head_of",
    "histogram",
    "is_writable",
    "kinds_of_columns",
    "lacking",
    "other_problem",
    "read_designs",
    "read_table",
    "read_tests",
    "real_column",
    "section_points",
    "sensitivities",
    "table_of",
    "value_ranks",
    "values_in_order",
    "within",
]
