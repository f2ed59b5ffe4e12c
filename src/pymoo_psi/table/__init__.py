"""The test table: tested designs under limits, their analysis, and their files.

A :class:`TestTable` holds tests or designs: arrays, and a :class:`Layout` that says which column is
a variable, objective, constraint or output, with its unit and direction. :func:`read_table` reads
any source into a table; :func:`pymoo_psi.investigate` tests a problem. A :class:`Formulation`
states objectives, directions, limits, omitted constraints and computed columns. Every table has
one, which its methods use; ``table.under(...)`` returns the same tests under another one.

Example:
    A cantilever of 1 m with 5 kN at its end. Names, units and directions come from the problem;
    any further number of a model is kept as a column.

    >>> from pymoo.core.problem import Problem
    >>> from pymoo_psi import Restricted, investigate
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

    Limits on any column, ``(lower, upper)`` for both ends, and what each costs: how many tests it
    rejects, and how many it alone rejects.

    >>> limited = table.under(limits={"mass": 45, "stress": 60})
    >>> print(constraint_costs(limited)[["rejects", "alone"]].rename_axis(None))
                rejects  alone
    slender          45     21
    mass<=45         49     48
    stress<=60      161    138

    Test more points where designs are feasible, and make the stress an objective; a study given to
    both investigations would hold the tests of both:

    >>> part = investigate(Restricted(Beam(), limited.refined_bounds(margin=0.1)), 256)
    >>> heavy = part.under(
    ...     objectives=["mass", "stiffness", "stress"], limits=limited.formulation.limits)
    >>> heavy
    TestTable(256 tests: 81 ok, 175 infeasible, 0 failed; 2 variables, 3 objectives, 1 constraint)
    >>> print(heavy.explain().sentences[1])
    Behind the best in mass by 7.321 kg (64 % of its range), stiffness by 831.8 N/mm (30 %), stress
    by 4.744 (22 %); weakest in mass.

Tables and formulations: TestTable, Layout, Kind, Formulation, read_table.

Analysis: histogram (a Histogram), constraint_costs, first-order sensitivities, and convergence (a
Convergence) of the decision with the number of tests. The last two use only tests that sample the
bounds evenly, see even_part. :mod:`pymoo_psi.plots` draws sensitivities.
switching_values: at which limits another design is recommended.

Files: ``to_csv``, ``to_xlsx`` and ``to_study`` write what :func:`read_table` reads back without a
change. ``pd.read_csv(path)`` and ``pd.read_excel(path)`` read the first two without the metadata of
``FILE.csv-metadata.json`` and of the second sheet.

File formats: FORMATS is the registry; a FileFormat reads a file into columns and a head.
"""

from pymoo_psi._names import attach_names

# Each name at its first use: who opens a table needs no analysis of it.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
