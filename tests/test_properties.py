"""What holds for any interruption of a run."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import SurrogatePSI, investigate
from pymoo_psi.files import read_table


class Beam(ElementwiseProblem):
    """Interrupted in one evaluation, as by Ctrl-C; some designs fail."""

    left = np.inf

    def __init__(self):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=-1.0, xu=1.0)

    def _evaluate(self, x, out, *args, **kwargs):
        Beam.left -= 1
        if Beam.left < 0:
            raise KeyboardInterrupt
        if x[0] < -0.8:
            raise ValueError("no licence")
        out["F"], out["G"] = [x[0], (x[1] - x[0]) ** 2], [x[0] + x[1] - 1]
        out["area"] = x[0] * x[1]


def by_surrogates(n, **options):
    options.pop("block_size", None)
    return minimize(Beam(), SurrogatePSI(n, batch=4, **options), seed=3).algorithm.table


def at_once(n, **options):
    return investigate(Beam(), n, **options)


@pytest.mark.parametrize("run", [at_once, by_surrogates])
@given(stops=st.lists(st.integers(0, 14), min_size=1, max_size=3), block=st.integers(1, 20))
def test_an_interrupted_run_that_is_continued_is_one_run(tmp_path_factory, run, stops, block):
    study = tmp_path_factory.mktemp("run") / "run.db"
    try:
        for Beam.left in stops:
            try:
                run(18, study=study, block_size=block)
            except KeyboardInterrupt:
                continue
    finally:
        Beam.left = np.inf
    table = run(18, study=study, block_size=block)
    assert table.equals(run(18))
    assert read_table(study).take(np.arange(18)).equals(table)
