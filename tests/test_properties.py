"""What holds for any table, formulation, interruption and file of designs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import PSI, Formulation, SurrogatePSI, TestTable, investigate
from pymoo_psi.table import Layout

SEEDS = st.integers(0, 2**32 - 1)


def smooth_table(rng, n=40):
    F, G, heat = rng.normal(size=(n, 2)), rng.normal(size=(n, 2)) - 1, rng.normal(size=n)
    layout = Layout.of(
        ["x"], ["mass", "gain"], ["stress", "bend"], outputs=["heat"], maximize=["gain"]
    )
    outputs = {"heat": heat}
    return TestTable.of(
        np.arange(1, n + 1), rng.random((n, 1)), F, G, outputs=outputs, layout=layout
    )


LIMITS = {"gain": (-1.5, None), "heat": 1.0, "x": (0.1, 0.9)}


@given(seed=SEEDS, data=st.data())
def test_a_formulation_of_a_formulated_table_is_one_formulation(seed, data):
    """Limits, relaxed constraints and computed columns add up; objectives are the last ones named."""
    table = smooth_table(np.random.default_rng(seed))
    some = lambda names, most: data.draw(  # noqa: E731
        st.lists(st.sampled_from(names), unique=True, max_size=most)
    )
    columns = ["mass", "gain", "heat", "both"]
    first, second = some(columns, 3), some([*columns, "quotient"], 3)
    relaxed = some(["stress", "bend"], 2)
    again = [name for name in some(["stress", "bend"], 2) if name not in relaxed]
    limits, others = some(["gain", "heat"], 2), some(["x"], 1)
    both, quotient = {"both": "mass + heat"}, {"quotient": "both / (3 + gain ** 2)"}
    a = Formulation(
        first, limits={name: LIMITS[name] for name in limits}, relaxed=relaxed, computed=both
    )
    b = Formulation(
        second, limits={name: LIMITS[name] for name in others}, relaxed=again, computed=quotient
    )
    c = Formulation(
        second or first, limits={name: LIMITS[name] for name in [*limits, *others]},
        relaxed=[*relaxed, *again], computed=both | quotient,
    )  # fmt: skip
    twice, once = table.under(a).under(b), table.under(c)
    assert twice.layout.objectives == once.layout.objectives
    np.testing.assert_array_equal(twice.layout.sign, once.layout.sign)
    np.testing.assert_array_equal(twice.F, once.F)
    np.testing.assert_array_equal(twice.status, once.status)
    np.testing.assert_array_equal(twice.pareto(), once.pareto())


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


def by_psi(n, **options):
    return minimize(Beam(), PSI(n, **options)).algorithm.table


def by_surrogates(n, **options):
    options.pop("block_size", None)
    return minimize(Beam(), SurrogatePSI(n, batch=4, **options), seed=3).algorithm.table


def at_once(n, **options):
    return investigate(Beam(), n, **options)


@pytest.mark.parametrize("run", [at_once, by_psi, by_surrogates])
@settings(max_examples=10)
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
    assert TestTable.read_study(study).rows(np.arange(18)).equals(table)
