"""Running a model on many workers, without losing a design.

:class:`JoblibRunner` is an ``elementwise_runner`` for problems that evaluate one design at a time.
It keeps its workers between generations and evaluates in place what is too cheap to send (a model
that may end its process wants ``in_process=False``); ``timeout=`` stops a design that takes too
long and replaces its worker. All designs of PSI are one stream to them: no worker waits for the
slowest design of a block. Workers end with the program, however it ends, with all that they
started.
A vectorised problem goes to many cores by ``investigate(..., n_jobs=-1)``.

Example:
    >>> from pymoo.optimize import minimize
    >>> from pymoo_psi import JoblibRunner, PSI, SphereChute
    >>> problem = SphereChute(mu=0.4, elementwise_runner=JoblibRunner(n_jobs=2))
    >>> len(minimize(problem, PSI(200)).pop)
    200

Other subpackages also use :func:`in_parallel` for tasks,
:func:`active_workers`, :func:`progress_bar`, :func:`evaluate_here`,
:func:`one_line`, :func:`same_folder` and the types ``Result``, ``Values`` and ``Waiting``.
"""

from pymoo_psi._lazy import attach_names

# Each name at its first use: a worker needs the evaluation alone.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
