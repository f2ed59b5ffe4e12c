"""Evaluations: designs that fail, a study of whatever is evaluated, criteria over scenarios.

A design whose evaluation raises, gives NaN or the wrong shape is kept as failed, with its reason,
and the run goes on. PSI does so by itself; any other algorithm of pymoo, which NaN would mislead,
takes a :class:`FailureTolerant` problem. Failed designs are in no algorithm's ``res.F``. A model
gets a copy of its designs, and its values count only if they have exactly the shape that the
problem promises.

Example:
    >>> import math
    >>> from pymoo.optimize import minimize
    >>> from pymoo.problems.functional import FunctionalProblem
    >>> from pymoo_psi import PSI
    >>> root = FunctionalProblem(1, [lambda x: math.sqrt(x[0]), lambda x: -x[0]], xl=-1, xu=1)
    >>> table = minimize(root, PSI(8)).algorithm.table
    >>> table
    TestTable(8 tests: 4 ok, 0 infeasible, 4 failed; 1 variable, 2 criteria, 0 constraints)
    >>> print(table.reasons[1])
    ValueError: ...

    Every algorithm has a study by :class:`Recorded`: a run with a seed that was killed goes on when
    it is called again.

    >>> import pathlib, tempfile
    >>> from pymoo.algorithms.moo.nsga2 import NSGA2
    >>> from pymoo_psi import Recorded, SphereChute
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     study = pathlib.Path(folder, "nsga2.db")
    ...     problem = Recorded(SphereChute(mu=0.4), study=study)
    ...     res = minimize(problem, NSGA2(40), ("n_gen", 5), seed=1)
    ...     again = Recorded(SphereChute(mu=0.4), study=study)
    ...     res = minimize(again, NSGA2(40), ("n_gen", 8), seed=1)
    ...     len(again.table), again.n_evaluated  # the first five generations came from the file
    (320, 120)
"""

from pymoo_psi.evaluation._failures import FailureTolerant
from pymoo_psi.evaluation._recorded import Recorded
from pymoo_psi.evaluation._robust import Robust

__all__ = ["FailureTolerant", "Recorded", "Robust"]
