r"""Algorithms: sampling, Parameter Space Investigation, surrogates, and NSGA-III.

Parameter Space Investigation, the method of Sobol' and Statnikov, tests designs spread evenly over
the bounds of all variables, the points of the LPτ sequence, and keeps every test in a table. You
read the table, set limits on the objectives as you see what they cost, and refine the bounds or
test more points. Only then do you take the feasible Pareto-optimal designs and choose one of them.

Use it to learn which limits can be met, where feasible designs lie and what each constraint costs.
It suits few variables and models that are slow or fail: tests run in parallel, can be stopped and
continued, and are never lost. It does not suit tens of variables, a front to many digits, or
problems where one design in many thousands is feasible, because its points do not depend on
results. The points of :class:`SurrogatePSI` do, as do those of an optimiser such as pymoo's
NSGA-III; :func:`nsga3` chooses its settings from the number of objectives and the budget.

``minimize(problem, PSI(n))`` works on any pymoo problem with finite bounds and real, integer,
binary or choice variables. The run ends by itself; verbose output, callbacks, terminations,
history, ask-and-tell and copies work as for pymoo's own algorithms. ``res.X`` and ``res.F`` are the
feasible Pareto-optimal designs; ``res.pop`` and ``res.algorithm.table`` hold every test.
:func:`investigate` does the same on arrays, a million designs in seconds. LPτ has 51 dimensions;
for more variables the points are SciPy's Sobol' points.

Example:
    With a study, an investigation can be stopped, continued and extended without loss; here the
    first 500 tests of the second run come from the file.

    >>> import pathlib, tempfile
    >>> from pymoo.optimize import minimize
    >>> from pymoo_psi import PSI, VectorizedSphereChute, nsga3, rank_of_efficiency, read_table
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     study = pathlib.Path(folder, "chute.db")
    ...     res = minimize(VectorizedSphereChute(mu=0.4), PSI(500, study=study))
    ...     res = minimize(VectorizedSphereChute(mu=0.4), PSI(800, study=study))
    ...     print(res.algorithm.evaluator.n_eval, len(read_table(study)))
    300 800

    The best designs of an investigation start the optimiser, already evaluated.

    >>> start = res.opt[rank_of_efficiency(res.F).rank >= 3]
    >>> res = nsga3(VectorizedSphereChute(mu=0.4), n_evaluations=1000, seed=1, sampling=start)
    >>> res.algorithm.evaluator.n_eval
    1000

A study rejects a different problem: another name, variables, number of objectives or constraints,
or other numbers, arrays, texts and names of functions that the problem was made with: arguments of
its class, given or default, that it keeps as attributes of the same name, also in lists, mappings
and data classes (or what its method ``fingerprint()`` returns). An argument that is added to the
class later, or removed, is accepted with its default value. A warning names arguments that are
other objects, a ``lambda``, or functions defined within others. A ``pathlib.Path`` is not compared,
since it says where something is; a text such as ``"/data/mesh"`` is. The study does not know other
attributes. It warns once if the file of the model has changed since tests were made, or in a script
its class, unless a ``study_key`` is given: change that when a constant in the code or the program
changes; otherwise one table mixes old and new results. Failed designs stay failed until
``PSI(..., retry="failed")`` tests them again.

Many machines can share an investigation without communication. Each tests its share of the points
and writes its own file in one folder, which is read like a study. This Slurm script starts an array
of jobs; a job that was killed continues when it is submitted again::

    #!/bin/bash
    #SBATCH --array=1-64
    #SBATCH --cpus-per-task=4
    #SBATCH --time=12:00:00
    #SBATCH --requeue
    pymoo-psi solve mymodel:beam --points 100000 --jobs "$SLURM_CPUS_PER_TASK" \
        --study runs --share "$SLURM_ARRAY_TASK_ID/64"

    pymoo-psi rank runs                    # when some or all of it is there
    pymoo-psi export runs --out study.db   # one study, which goes on by --study study.db

A problem that is evaluated one design at a time runs on all cores with
``elementwise_runner=JoblibRunner()``, and on a cluster with ``ExecutorRunner(executor)``; see the
guide "More than one machine".

Inside, a run (``_run``) joins three parts. A source (``_sources``, ``_surrogate``) returns the next
points and receives the finished tests. An executor (``_executor``) evaluates points, singly on
parallel workers or in blocks. A store (``_store``) reads tests from a study and writes them to it.
:class:`PSI` and :class:`SurrogatePSI` derive from the same adapter of a run to pymoo
(``PointAlgorithm``), each with its source; ``_individuals`` converts tests into pymoo's individuals
and back. :func:`investigate` and :class:`Recorded` use runs directly.

Public names: :class:`PSI`, :class:`SurrogatePSI`, :func:`investigate`;
:func:`sections` through a design, from surrogates of the tests; :func:`nsga3`; :class:`Recorded`;
the samplings :class:`LPTauSampling`, :class:`QMCSampling` and their base :class:`UniformSampling`.
"""

from pymoo_psi._names import attach_names

# Each name at its first use, as in the package: surrogates bring half of SciPy, for which every
# worker of an investigation would wait.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
