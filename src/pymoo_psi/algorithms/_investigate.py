"""Parameter Space Investigation on arrays, for many cheap designs.

``minimize(problem, PSI(n))`` goes in blocks small enough to be watched. Here the points pass
through the problem in large blocks, and only what is wanted is kept.
"""

from __future__ import annotations

from contextlib import closing
from typing import Any

from pymoo_psi._validation import invalid, job_count, known_name
from pymoo_psi.algorithms._engine import Engine, by_number, kept_tests
from pymoo_psi.algorithms._run import run_options, with_options
from pymoo_psi.algorithms._store import stored_at_termination
from pymoo_psi.parallel import progress_bar
from pymoo_psi.problems import require_problem
from pymoo_psi.table import TestTable, bounds_of

# Rows from which on a Pareto set is filtered on the way. Each time there are twice as many rows as
# were left, so that all filtering together takes as long as the last one, or twice that.
_WORTH_FILTERING = 2**17


@with_options()
def investigate(
    problem: Any,
    n_points: int,
    *,
    keep: str = "all",
    n_jobs: int = 1,
    progress: bool = False,
    **options: Any,
) -> TestTable:
    """Test the points of a uniform sequence and return the table of tests.

    The result is that of ``minimize(problem, PSI(n_points)).algorithm.table``; a vectorised
    problem is evaluated at millions of points in seconds, on as many cores as are asked for.
    Memory grows with what is kept, and with the size of a block and the number of cores. A design
    that occurs again is not evaluated again, as in :class:`PSI`, except where ``n_jobs`` is not 1.

    Args:
        problem: A pymoo problem with finite bounds.
        n_points: How many points to test.
        keep: ``"all"`` tests, the ``"feasible"`` ones or the ``"pareto"`` set of these.
        n_jobs: Processes for a vectorised problem, or workers of the cluster that
            ``joblib.parallel_config`` names; -1 for as many as there are. The table does not
            depend on it. A problem that is evaluated one design at a time has a runner of its own,
            :class:`~pymoo_psi.JoblibRunner`.
        progress: Show a progress bar, in a terminal or a notebook.
        **options: ``first``, ``sampling``, ``seed``, ``limits``, ``share``, ``study``,
            ``study_key``, ``retry``, ``on_failure``, ``names``, ``maximize``, ``units``,
            ``block_size``: see :class:`RunOptions`.

    Returns:
        The table of the tests kept, by number.

    Raises:
        ArgumentValueError: A count is out of range, ``keep`` or a limit is unknown, or the
            problem does not fit, as for :class:`PSI`.
        ArgumentTypeError: An argument has the wrong type.
        StudyError: As for :class:`PSI`.
        EvaluationError: A design failed and ``on_failure`` is ``"raise"``.
        WorkerError: The problem cannot be sent to processes, or one of them was lost.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 10_000, keep="pareto")
        >>> bool(table.pareto().all())
        True
    """
    run, _ = run_options("investigate", options)
    require_problem(problem)
    if job_count("n_jobs", n_jobs) != 1 and problem.elementwise:
        rule = "1 for a problem that is evaluated one design at a time"
        remedy = "give the problem elementwise_runner=JoblibRunner(n_jobs)"
        raise invalid("n_jobs", rule, n_jobs, remedy)
    known_name("keep", keep, ("all", "feasible", "pareto"))
    engine = Engine(problem, n_points, run, keep=keep, n_jobs=n_jobs)
    n = len(engine.points)
    tables, done = [engine.table], 0
    size = least = 0  # how many rows there are, and had been left when they were filtered last
    with (
        progress_bar(progress) as bar,
        stored_at_termination(),
        closing(engine.tests()) as blocks,
    ):
        for tests, called in blocks:
            tables.append(tests)
            size, done = size + len(tests), done + len(called)
            bar(done / n)
            if keep == "pareto" and size > max(2 * least, _WORTH_FILTERING):
                tables = [kept_tests(keep, run.limits, by_number(tables))]
                size = least = len(tables[0])
    found = by_number(tables)
    if keep == "pareto":
        found = kept_tests(keep, run.limits, found)
    # A limit on what no test gives is refused; of failed tests alone it is unknown what they give.
    if keep != "all" or (found.status != "failed").any():
        bounds_of(run.limits, found.layout)
    return found
