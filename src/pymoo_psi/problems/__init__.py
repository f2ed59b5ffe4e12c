"""pymoo problems: design spaces, wrappers of problems, and the sphere in the chute-conveyor.

To add a problem, write its computation as functions of arrays, without pymoo, in a subpackage
beside ``chute``. Then write a thin ``Problem`` here that checks its arguments, sets bounds and
fills ``out["F"]`` and ``out["G"]``. It has attributes ``names``, ``units`` and ``maximize``, and a
method ``fingerprint()`` that returns its constants for studies. Test it against independent values:
a limiting case, an identity, another solver. ``pymoo-psi solve pymoo_psi:YourProblem --points
1024`` runs it.

To add a wrapper of problems, derive it from :class:`WrappedProblem` in a file of its own and add
its name to ``__init__.pyi``.

A design whose evaluation raises, gives NaN or the wrong shape is kept as failed, with its reason,
and the run continues. PSI does this itself. Other algorithms of pymoo, for which NaN means wrong
results, take a :class:`FailureTolerant` problem. Failed designs are never in ``res.F``. A model
gets a copy of its designs, and its values count only if they have exactly the shape that the
problem promises.

With many variables, screen first: :func:`pymoo_psi.analysis.sensitivities` of some tests shows
which variables matter, and :class:`Restricted` fixes the others.

Two subsystems that share a variable can be investigated separately, with few variables each. Pairs
of their feasible designs that agree on this variable are then designs of the whole.

Example:
    >>> import pandas as pd
    >>> from pymoo.problems.functional import FunctionalProblem
    >>> from pymoo_psi import investigate, rank_of_efficiency
    >>> arm = FunctionalProblem(2, [lambda x: x[0] + x[1] ** 2, lambda x: 1 / x[1]], xl=1, xu=3)
    >>> foot = FunctionalProblem(2, [lambda x: 2 * x[0] + x[1], lambda x: 1 / x[0]], xl=1, xu=3)
    >>> arms, feet = (investigate(part, 64).to_frame().query("status == 'ok'")
    ...               for part in (arm, foot))
    >>> pairs = arms.merge(feet, how="cross", suffixes=(" arm", " foot"))
    >>> pairs = pairs[(pairs["x1 arm"] - pairs["x1 foot"]).abs() < 0.05]
    >>> mass, sag = (pairs[f"{f} arm"] + pairs[f"{f} foot"] for f in ("f1", "f2"))
    >>> ranking = rank_of_efficiency(pd.DataFrame({"mass": mass, "sag": sag}))
    >>> len(pairs), int(ranking.pareto.sum())
    (190, 30)

Example:
    >>> import math
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems.functional import FunctionalProblem
    >>> from pymoo_psi import PSI
    >>> root = FunctionalProblem(1, [lambda x: math.sqrt(x[0]), lambda x: -x[0]], xl=-1, xu=1)
    >>> table = minimize(root, PSI(8)).algorithm.table
    >>> table
    TestTable(8 tests: 4 ok, 0 infeasible, 4 failed; 1 variable, 2 objectives, 0 constraints)
    >>> print(table.reasons[1])
    ValueError: ...

Public names: the models :class:`SphereChute`, :class:`VectorizedSphereChute`,
:class:`ProgramProblem`; the wrappers :class:`FailureTolerant`, :class:`Restricted`,
:class:`LogScaled`, :class:`Required`, :class:`Robust`; and :class:`WrappedProblem`, the base of new
ones.
"""

from pymoo_psi._names import attach_names

# Each name is imported at its first use: the chute alone needs neither workers nor tables.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
