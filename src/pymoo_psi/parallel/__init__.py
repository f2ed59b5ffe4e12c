"""Evaluation on many workers, without losing a design.

Three runners, each an ``elementwise_runner`` for problems that evaluate one design at a time:

- :class:`JoblibRunner`: joblib evaluates, with whatever ``joblib.parallel_config`` says.
- :class:`ProcessRunner`: guarded processes of this machine, for models that may hang or crash;
  ``timeout=`` stops a design that takes too long and replaces its worker.
- :class:`ExecutorRunner`: any ``concurrent.futures.Executor``, such as that of a cluster.

The guide "Which runner?" compares them. A vectorised problem runs on many cores by
``investigate(..., n_jobs=-1)``.

Example:
    >>> from pymoo.optimize import minimize
    >>> from pymoo_psi import JoblibRunner, PSI, SphereChute
    >>> problem = SphereChute(mu=0.4, elementwise_runner=JoblibRunner(n_jobs=2))
    >>> len(minimize(problem, PSI(200)).pop)
    200

Inside, whatever is evaluated is put into a :class:`Queue` (``_runner``). A runner takes jobs from
it, each of which has some designs, or a piece of the points of a vectorised problem. The last two
runners are given jobs by ``submit``, which returns a future (``_engine``); joblib asks for them by
itself (``_joblib``). Guarded processes do the jobs of the last two (``_pool``, ``_worker``).

Other subpackages also use :class:`Runner`, which all three are, :class:`Queue`,
:func:`runner_of_jobs`, :func:`in_parallel` for tasks, :func:`raise_original`, :func:`run_program`,
:func:`one_line` and :func:`same_folder`.
"""

from pymoo_psi._names import attach_names

# Each name at its first use: a worker needs the evaluation alone.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
