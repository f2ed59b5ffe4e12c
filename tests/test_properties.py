"""What holds for any table, formulation, interruption and file of designs."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import Formulation, SurrogatePSI, TestTable, investigate
from pymoo_psi.files import read_table
from pymoo_psi.table import Schema

SEEDS = st.integers(0, 2**32 - 1)


def smooth_table(rng, n=40):
    F, G, heat = rng.normal(size=(n, 2)), rng.normal(size=(n, 2)) - 1, rng.normal(size=n)
    schema = Schema.of(
        ["x"], ["mass", "gain"], ["stress", "bend"], outputs=["heat"], maximize=["gain"]
    )
    outputs = {"heat": heat}
    return TestTable.of(
        np.arange(1, n + 1), rng.random((n, 1)), F, G, outputs=outputs, schema=schema
    )


LIMITS = {"gain": (-1.5, None), "heat": 1.0, "x": (0.1, 0.9)}


@given(seed=SEEDS, data=st.data())
def test_a_formulation_takes_the_place_of_the_one_before(seed, data):
    """Whatever was asked before; attributes given alone take the place of those attributes."""
    table = smooth_table(np.random.default_rng(seed))
    some = lambda names, most: data.draw(  # noqa: E731
        st.lists(st.sampled_from(names), unique=True, max_size=most)
    )
    columns = ["mass", "gain", "heat"]
    first = Formulation(
        some([*columns, "both"], 3),
        limits={name: LIMITS[name] for name in some(["gain", "heat"], 2)},
        omitted=some(["stress", "bend"], 2),
        computed={"both": "mass + heat"},
    )
    second = Formulation(
        some([*columns, "ratio"], 3),
        limits={name: LIMITS[name] for name in some(["x", "heat"], 2)},
        omitted=some(["stress", "bend"], 2),
        computed={"ratio": "heat / (3 + gain ** 2)"},
        normalize=data.draw(st.booleans()),
    )
    before = table.under(first)
    assert before.under(second).equals(table.under(second))
    assert before.under(Formulation()).data is table.data
    assert before.under(Formulation()).equals(table)
    limits, normalize = second.limits, second.normalize
    loosened = before.under(limits=limits).under(normalize=normalize)
    whole = table.under(replace(first, limits=limits, normalize=normalize))
    assert loosened.equals(whole)
    assert loosened.formulation == whole.formulation


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
