"""A cluster of Dask, two workers in processes of their own: joblib and the command evaluate on it."""

import os

import joblib
import pytest
from pymoo.core.problem import ElementwiseProblem

from pymoo_psi import JoblibRunner, VectorizedSphereChute, investigate
from pymoo_psi.files import read_table
from tests.helpers.processes import posix

pytestmark = posix


class Sum(ElementwiseProblem):
    """Two objectives; the output ``elsewhere`` is 1 in a worker of the cluster."""

    def __init__(self, **kwargs):
        super().__init__(n_var=2, n_obj=2, xl=0, xu=1, **kwargs)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [x[0] + x[1] ** 2, 1 - x[0] * x[1]]
        out["elsewhere"] = float(os.environ.get("CLUSTER", 0))


@pytest.fixture
def client():
    distributed = pytest.importorskip("distributed")  # which takes long, for slow tests only
    options = {"threads_per_worker": 1, "dashboard_address": None, "env": {"CLUSTER": "1"}}
    with (
        distributed.LocalCluster(2, **options) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client


@pytest.mark.slow
def test_clusters_of_dask_evaluate(client, in_folder, said):
    with joblib.parallel_config("dask", client=client):
        table = investigate(Sum(elementwise_runner=JoblibRunner()), 40)
        chute = investigate(VectorizedSphereChute(0.4), 2000, runner=JoblibRunner())
    assert (table.column("elsewhere") == 1).all()
    assert chute.equals(investigate(VectorizedSphereChute(0.4), 2000))
    arguments = ["solve", f"{__name__}:Sum", "--points", "40", "--study", "s.db"]
    said(*arguments, "--cluster", client.scheduler.address)
    assert read_table("s.db").equals(table)
