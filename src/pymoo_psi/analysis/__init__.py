"""Analysis of a test table: where designs are feasible, what matters, what a decision depends on.

Every function takes a :class:`~pymoo_psi.TestTable` and answers under its formulation.

- histogram (a Histogram): tested, feasible and Pareto-optimal designs over a column.
- constraint_costs: how many tests each constraint and limit rejects, and what it costs.
- sensitivities: first-order sensitivities of columns to variables, and convergence of the decision
  with the number of tests, which convergence_sentence states. Both use only tests that sample the
  bounds evenly, see even_part. :mod:`pymoo_psi.plots` draws them.
- switching_values: at which limits another design is recommended, as a frame;
  switching_sentences: the same in sentences.
- average_repeats: the designs of repeated tests; their ``confidence()`` says how sure a decision
  is.

Example:
    A cantilever of 1 m with 5 kN at its end: limits on any column, and what each costs, how many
    tests it rejects, and how many it alone rejects.

    >>> from pymoo.core.problem import Problem
    >>> from pymoo_psi import explain, investigate
    >>> from pymoo_psi.analysis import constraint_costs, switching_sentences
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
    >>> table = investigate(Beam(), 256).under(limits={"mass": 45, "stress": 60})
    >>> print(constraint_costs(table)[["rejects", "alone"]].rename_axis(None))
                rejects  alone
    slender          45     21
    mass<=45         49     48
    stress<=60      161    138
"""

from pymoo_psi._names import attach_names

# Each name at its first use: a histogram needs no sensitivities.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
