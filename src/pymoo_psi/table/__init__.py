"""The test table: tests or designs as columns, what is asked of them, and what is decided.

A :class:`TestTable` has columns, and a :class:`Schema` that says what each :class:`Column` is: a
variable, objective, constraint, output, label or note, with its :class:`Kind`, unit, direction and
bounds. :func:`pymoo_psi.read_table` reads any source into a table; :func:`pymoo_psi.investigate`
tests a problem. A :class:`Formulation` states objectives, directions, limits (each a
:class:`Limit`), omitted constraints and computed columns. Every table has one, which its methods
use; ``table.under(...)`` returns the same tests under another one. A :class:`Decision` is a
formulation with the chosen design, the reason and positions of people: the file that a page saves.

Example:
    A cantilever of 1 m with 5 kN at its end. Names, units and directions come from the problem;
    any further number of a model is kept as a column.

    >>> from pymoo.core.problem import Problem
    >>> from pymoo_psi import Restricted, explain, investigate
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

    Set limits on any column, ``(lower, upper)`` for both ends, and test more points where designs
    are feasible, with the stress as an objective; a study given to both investigations would hold
    the tests of both:

    >>> limited = table.under(limits={"mass": 45, "stress": 60})
    >>> part = investigate(Restricted(Beam(), limited.refined_bounds(margin=0.1)), 256)
    >>> heavy = part.under(
    ...     objectives=["mass", "stiffness", "stress"], limits=limited.formulation.limits)
    >>> heavy
    TestTable(256 tests: 81 ok, 175 infeasible, 0 failed; 2 variables, 3 objectives, 1 constraint)
    >>> print(explain(heavy).sentences[1])
    What it costs against the best: 7.32 kg in mass (64 % of its range), 832 N/mm in stiffness
    (30 %) and 4.74 in stress (22 %).

:mod:`pymoo_psi.analysis` has histograms, costs of constraints, sensitivities, convergence and
switching values of tables; :mod:`pymoo_psi.files` reads and writes them.
"""

from pymoo_psi._names import attach_names

# The modules, each of which imports only those before it: _schema, what the columns are; _cells,
# what is in them; _limits; _expression, for computed columns; _formulation, what is asked;
# _decision; _view, rows, columns, arrays and the Pareto set; _designs, their names and ranking;
# _storage, the head and the columns that files and studies hold; _joining, of several tables;
# _table, which has a method for each of these. Where a change belongs:
#
# - a kind of variable: Kind in pymoo_psi/_kinds, with its dtype, its cells and its key; as a column
#   of SQL in study/_database, as a variable of pymoo in problems/_design_space;
# - an attribute of a column: Column in _schema; schema_head and schema_of in _storage keep it;
# - a limit on other values, such as dates: Limit in _limits reads, writes and applies it;
# - a format of files: a class of its own, and an entry of FORMATS in files/_formats.
#
# Each name at its first use: limits need no tables.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
