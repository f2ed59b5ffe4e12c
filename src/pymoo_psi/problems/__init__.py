"""pymoo problems: their design spaces and parts of them, and the sphere in the chute-conveyor.

A problem of your own that belongs here: write what it computes as functions of arrays, without
pymoo, in a subpackage beside ``chute``; then a thin ``Problem`` here that checks its arguments,
sets bounds and fills ``out["F"]`` and ``out["G"]``, with ``names``, ``units`` and ``maximize`` as
attributes and ``fingerprint()``, which returns its constants for studies. Test it against values
known otherwise: a limiting case, an identity, an independent solver.
``pymoo-psi solve pymoo_psi:YourProblem --points 1024`` runs it.

A design whose evaluation raises, gives NaN or the wrong shape is kept as failed, with its reason,
and the run goes on. PSI does so by itself; any other algorithm of pymoo, which NaN would mislead,
takes a :class:`FailureTolerant` problem. Failed designs are in no algorithm's ``res.F``. A model
gets a copy of its designs, and its values count only if they have exactly the shape that the
problem promises.

With many variables, screen: :func:`pymoo_psi.table.sensitivities` of the first tests says which
variables matter, and :class:`Restricted` fixes the others.

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
"""

import lazy_loader

# Each name at its first use: the chute alone needs neither workers nor tables.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
