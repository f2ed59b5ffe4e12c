"""Evaluation on many workers, without losing a design.

:class:`JoblibRunner` is an ``elementwise_runner`` for problems that evaluate one design at a time.
Its workers are kept between generations, and some minutes for the next call. Designs that are too
cheap to send are evaluated in this process; use ``in_process=False`` for a model that may end its
process. ``timeout=`` stops a design that takes too long and replaces its worker. All designs of PSI
are one stream to the workers: none waits for the slowest design of a block. Workers end with the
program, however it ends, with all that they started. A vectorised problem runs on many cores by
``investigate(..., n_jobs=-1)``.

Example:
    >>> from pymoo.optimize import minimize
    >>> from pymoo_psi import JoblibRunner, PSI, SphereChute
    >>> problem = SphereChute(mu=0.4, elementwise_runner=JoblibRunner(n_jobs=2))
    >>> len(minimize(problem, PSI(200)).pop)
    200

:class:`ExecutorRunner` does the same on the workers of a cluster.

Both send tasks by one engine. What evaluates them is a process of this machine with a guard, or an
executor whose workers each have such a process.

Other subpackages also use :class:`Runner`, which both are, :func:`in_parallel` for tasks,
:func:`worker_count`, :func:`progress_bar`, :func:`evaluate_here`, :func:`one_line`,
:func:`same_folder` and the types ``Result``, ``Values`` and ``Waiting``.
"""

from pymoo_psi._names import attach_names

# Each name at its first use: a worker needs the evaluation alone.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
