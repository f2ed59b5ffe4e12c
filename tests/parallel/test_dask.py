"""A cluster of Dask, two workers in processes of their own: joblib and the command evaluate on it."""

import os

import joblib
import pytest

from pymoo_psi import JoblibRunner, VectorizedSphereChute, investigate
from pymoo_psi.files import read_table
from tests.helpers.models import Sum
from tests.helpers.processes import posix

pytestmark = posix


class Located(Sum):
    """The output ``elsewhere`` is 1 in a worker of the cluster."""

    def _evaluate(self, x, out, *args, **kwargs):
        super()._evaluate(x, out)
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
        table = investigate(Located(elementwise_runner=JoblibRunner()), 40)
        chute = investigate(VectorizedSphereChute(0.4), 2000, runner=JoblibRunner())
    assert (table.column("elsewhere") == 1).all()
    assert chute.equals(investigate(VectorizedSphereChute(0.4), 2000))
    arguments = ["solve", f"{__name__}:Located", "--points", "40", "--study", "s.db"]
    said(*arguments, "--cluster", client.scheduler.address)
    assert read_table("s.db").equals(table)
