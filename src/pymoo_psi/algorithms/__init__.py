r"""Algorithms: sampling, Parameter Space Investigation, NSGA-III as the alternative, refinement.

Parameter Space Investigation, the method of Sobol' and Statnikov, tests designs spread evenly over
all bounds of the variables, the points of the LPτ sequence, and keeps every test in a table. You
read the table, set limits on the objectives as you see what they cost, and refine the bounds or
test more points. Only then the feasible Pareto-optimal designs are taken, and one of them chosen.

Use it where you do not know yet what can be had: to learn which limits can be met, where feasible
designs lie, and which constraint costs what; with few variables; with a model that is slow or
fails, since tests run side by side, stop and go on, and are never lost. Do not use it to pin down
a front to many digits, with tens of variables, or where feasible designs are one in many
thousands: the points learn nothing from results. :class:`SurrogatePSI` does, and so does an
optimiser such as pymoo's NSGA-III, here with settings chosen from the number of objectives and the
budget, which it keeps exactly.

``minimize(problem, PSI(n))`` works on any pymoo problem with finite bounds, its variables real,
integer, binary or choices; of a discrete design that occurs again the known result is taken. It
ends by itself; verbose output, callbacks, terminations, history, ask-and-tell and copies work as
for pymoo's own algorithms. ``res.X`` and ``res.F`` are the feasible Pareto-optimal designs,
``res.pop`` and ``res.algorithm.table`` hold every tested one. :func:`investigate` does the same on
arrays, a million designs in seconds. Beyond the 51 variables of LPτ the points are SciPy's Sobol'
points, and a line says so.

Example:
    With a study, an investigation can be stopped, continued and extended with no loss; the first
    500 tests come from the file.

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

A study refuses another problem: another name, bounds, number of objectives or constraints, or
other numbers and texts as arguments that the problem keeps as attributes (a method
``fingerprint()`` of it may return another dictionary of what counts). What it cannot see is the
inside of the model: after a change of a constant or of the program it wants another ``study_key``,
or old and new results would stand in one table. Failed designs stay failed until
``PSI(..., retry="failed")`` tries them once more.

Many machines share an investigation without talking to each other: each tests its share of the
points into a file of its own in one folder, and whatever reads a study reads the folder. As an
array of Slurm, in which a job that was killed is submitted again and goes on:

    #!/bin/bash
    #SBATCH --array=1-64
    #SBATCH --cpus-per-task=4
    #SBATCH --time=12:00:00
    #SBATCH --requeue
    pymoo-psi solve mymodel:beam --points 100000 --jobs "$SLURM_CPUS_PER_TASK" \
        --study runs --share "$SLURM_ARRAY_TASK_ID/64"

    pymoo-psi rank runs                    # when some or all of it is there
    pymoo-psi export runs --out study.db   # one study, which goes on by --study study.db

A problem that is evaluated one design at a time runs on all cores by
``elementwise_runner=JoblibRunner()``, and on a cluster of Dask or Ray by pymoo's runners for them.

Public names: :class:`PSI`, :class:`SurrogatePSI`, :func:`investigate` and their
:class:`RunOptions`; :func:`nsga3`; :class:`Recorded`; the samplings :class:`LPTauSampling`,
:class:`QMCSampling` and their base :class:`UniformSampling`.
"""

from pymoo_psi._lazy import attach_names

# Each name at its first use, as in the package: surrogates bring half of SciPy, for which every
# worker of an investigation would wait.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
