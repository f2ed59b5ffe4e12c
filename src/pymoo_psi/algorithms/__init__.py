r"""Algorithms: sampling, Parameter Space Investigation, NSGA-III as the alternative, refinement.

Many machines share an investigation without talking to each other: each tests its share of the
points into a file of its own in one folder, and whatever reads a study reads the folder. As an
array of Slurm, in which a job that was killed is submitted again and goes on::

    #!/bin/bash
    #SBATCH --array=1-64
    #SBATCH --cpus-per-task=4
    #SBATCH --time=12:00:00
    #SBATCH --requeue
    pymoo-psi solve mymodel:beam --points 100000 --jobs "$SLURM_CPUS_PER_TASK" \
        --study runs --share "$SLURM_ARRAY_TASK_ID/64"

    pymoo-psi rank runs                    # when some or all of it is there
    pymoo-psi merge runs --out study.db    # one study, which goes on by --study study.db

A cluster of Dask is one run; its tests come back to this process, which may keep a study::

    from dask.distributed import Client, LocalCluster
    from joblib import parallel_config
    from pymoo_psi import VectorizedSphereChute, investigate

    if __name__ == "__main__":
        # On Slurm: dask_jobqueue.SLURMCluster(cores=8, memory="16GB"), cluster.scale(jobs=16)
        with LocalCluster(n_workers=2, threads_per_worker=1) as cluster, Client(cluster):
            with parallel_config("dask"):
                table = investigate(
                    VectorizedSphereChute(0.4), 2**22, n_jobs=-1, keep="pareto",
                    limits={"f1": 2.5, "f4": 0.6},
                )
        table.to_csv("pareto.csv")

A problem that is evaluated one design at a time takes ``elementwise_runner=JoblibRunner()``
instead of ``n_jobs``.
"""

from pymoo_psi.algorithms._investigate import investigate
from pymoo_psi.algorithms._nsga3 import nsga3
from pymoo_psi.algorithms._psi import PSI
from pymoo_psi.algorithms._refinement import Refinement, refine
from pymoo_psi.algorithms._sampling import LPTauSampling, QMCSampling
from pymoo_psi.algorithms._surrogate import SurrogatePSI

__all__ = [
    "PSI",
    "LPTauSampling",
    "QMCSampling",
    "Refinement",
    "SurrogatePSI",
    "investigate",
    "nsga3",
    "refine",
]
