"""The paper's tables, computed and then compared with the printed values."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

from pymoo_psi.chute import ChuteParameters, criteria, motion
from pymoo_psi.paper import PAPER_MU, Reproduction, published_table, reproduce, solve_case


@pytest.fixture(scope="module")
def rolling():
    return Reproduction(4096, tuple(solve_case(mu, "rolling", 4096) for mu in PAPER_MU))


@pytest.fixture(scope="module")
def small():
    return reproduce(128)


def test_everything_the_paper_says_holds_under_rolling(rolling):
    agreement = rolling.agreement()
    assert len(agreement) == 5
    assert all(agreement.values()), agreement


def test_printed_tables_are_the_papers():
    """Seven rows, as in the text of the article."""
    first, second = published_table("6.1"), published_table("6.2")
    assert first["paper_f1"].tolist() == [1.9829, 2.0454, 2.0454]
    assert second["test_point"].tolist() == [258, 1286, 2314, 2571]
    assert second["paper_f4"].tolist() == [0.1115, 0.1029, 0.1101, 0.1043]


@pytest.mark.parametrize("model", ["full", "rolling"])
def test_tables_hold_what_the_model_gives_at_their_designs(model, rolling, small):
    result = rolling if model == "rolling" else small
    for table in (result.table_6_1(), result.table_6_2()):
        rows = table[table["model"] == model]
        assert len(rows) > 0
        p = ChuteParameters(mu=rows["mu"].to_numpy())
        expected = criteria(motion(rows["f3"].to_numpy(), rows["f4"].to_numpy(), p, model=model))
        np.testing.assert_allclose(rows[["f1", "f2", "f3", "f4"]], expected, rtol=1e-12)


def test_a_deviation_is_found(rolling):
    """The comparison can fail: other designs, other values, a filled M5."""
    wrong = [dataclasses.replace(case, F=case.F + 1e-3) for case in rolling.cases]
    agreement = Reproduction(4096, tuple(wrong)).agreement()
    assert agreement["the same seven designs"]
    assert not agreement["f2, f3, f4 equal at four decimals"]
    assert not agreement["f1 within 6e-4 of print"]
    other = dataclasses.replace(rolling.cases[0], test_point=rolling.cases[0].test_point + 1)
    swapped = Reproduction(4096, (other, *rolling.cases[1:])).agreement()
    assert not swapped["the same seven designs"]
    assert Reproduction(512, rolling.cases).agreement() == {}


def test_processes_change_nothing(small):
    shared = reproduce(128, models=["rolling"], n_jobs=2).table_6_1()
    alone = small.table_6_1().query("model == 'rolling'")
    pd.testing.assert_frame_equal(alone.reset_index(drop=True), shared)


def test_continuous_optima_are_nearer_than_the_best_test_points(rolling):
    table = rolling.continuous_optima()
    assert (table["distance"] < table["best_point_distance"]).all()
    for case, row in zip(rolling.cases, table.itertuples(), strict=True):
        f = np.array([row.f1, row.f2, row.f3, row.f4])
        np.testing.assert_allclose(np.linalg.norm(f - case.ranking.ideal), row.distance)
        m = motion(row.f3, row.f4, ChuteParameters(mu=row.mu), model="rolling")
        np.testing.assert_allclose(criteria(m), f)
