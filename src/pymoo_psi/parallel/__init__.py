"""Evaluation on many workers, without losing a design.

:class:`JoblibRunner` is an ``elementwise_runner`` for problems that evaluate one design at a time.
Its workers are kept between generations, and for some minutes for the next call. Very cheap designs
are evaluated in this process; use ``in_process=False`` for a model that may end its process.
``timeout=`` stops a design that takes too long and replaces its worker. With PSI, no worker waits
for the slowest design of a block. Workers, and all processes that they started, end with the
program. A vectorised problem runs on many cores by ``investigate(..., n_jobs=-1)``.

Example:
    >>> from pymoo.optimize import minimize
    >>> from pymoo_psi import JoblibRunner, PSI, SphereChute
    >>> problem = SphereChute(mu=0.4, elementwise_runner=JoblibRunner(n_jobs=2))
    >>> len(minimize(problem, PSI(200)).pop)
    200

:class:`ExecutorRunner` does the same on the workers of a cluster.

Both send tasks by one engine, to guarded processes of this machine or of the workers of an
executor.

Other subpackages also use :class:`Runner`, which both are, :func:`in_parallel` for tasks,
:func:`progress_bar`, :func:`evaluate_here`, :func:`one_line`,
:func:`same_folder` and the types ``Result``, ``Values`` and ``Waiting``.
"""

from pymoo_psi._names import attach_names

# Each name at its first use: a worker needs the evaluation alone.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
