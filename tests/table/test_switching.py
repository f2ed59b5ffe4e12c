"""Switching values: what is recommended just before and just beyond each of them."""

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import (
    Formulation,
    ReferencePoint,
    TestTable,
    explain,
    read_table,
    switching_values,
)
from tests.refusals import refused


def offers(seed, share=0.7, n=40):
    rng = np.random.default_rng(seed)
    F = np.abs(rng.normal(size=(n, 3)))
    F = (1.3 - F / np.linalg.norm(F, axis=1)[:, None]) ** 1.5 + 0.2 * rng.random((n, 1))
    frame = pd.DataFrame(np.round(F, 2), columns=["price", "days", "gain"])
    frame.insert(0, "name", [f"offer {k}" for k in range(n)])
    limit = float(frame["price"].quantile(share))
    asked = Formulation(
        ["price", "days", "gain"],
        maximize=["gain"],
        limits={"price": limit, "days": (None, 1.2)},
        ranges=None if seed % 2 else {"price": (0, 3), "days": (0, 3), "gain": (0, 3)},
    )
    return frame, asked


def switching(table, kind, **preference):
    changes = switching_values(table, **preference)
    return changes[changes["kind"] == kind].reset_index(drop=True)


def first(frame, asked, **limits):
    """Return the names of the optima under other limits; none where nothing is left."""
    ends = {**asked.limits, **limits}
    table = read_table(frame, asked).under(
        limits={k: v for k, v in ends.items() if v != (None, None)}
    )
    if not table.eligible().any():
        return []
    ranking = table.feasible_ranking()
    return [ranking.name_of(row) for row in ranking.salukvadze.tolist()]


@pytest.mark.parametrize(("seed", "share"), [(0, 0.7), (1, 0.25), (2, 0.25), (3, 0.25)])
def test_limits_between_which_the_recommendation_stays(seed, share):
    """Every value that a design has is tried: the first that changes it is the one reported."""
    frame, asked = offers(seed, share)
    best = first(frame, asked)[0]
    found = switching(read_table(frame, asked), "limit")
    assert (found[found["direction"] == "looser"]["value"].notna()).any() == (share < 0.5)
    assert found["exact"].all()
    assert {*found["column"]} == {"price", "days", "gain"}
    for row in found.itertuples():
        sign = -1 if row.end == "lower" else 1
        values = np.unique(sign * frame[row.column])
        present = sign * row.present if row.present == row.present else np.inf
        steps = (
            values[values > present]
            if row.direction == "looser"
            else values[values < present][::-1]
        )
        changed = None
        stays = steps[0] if len(steps) else None
        for step in steps:
            pair = (None, step) if row.end == "upper" else (-step, None)
            optima = first(frame, asked, **{row.column: pair})
            if best not in optima:
                changed = (step if row.direction == "looser" else stays), [*optima, None][0]
                break
            stays = step
        if changed is None:
            assert np.isnan(row.value) or row.design is None
        else:
            assert (row.value * sign, row.design) == changed


def test_values_and_weights_at_which_it_changes():
    frame, asked = offers(1)
    table = read_table(frame, asked)
    best = first(frame, asked)[0]
    found = switching_values(table, weights={"price": 2.0}, aspiration={"days": 0.3})
    ranking = table.feasible_ranking()
    compared = 0
    for row in found[found["value"].notna()].itertuples():
        if row.kind == "value":
            for share, stays in ((0.999, True), (1.001, False)):
                other = frame.copy()
                value = row.present + share * (row.value - row.present)
                other.loc[other["name"] == best, row.column] = value
                assert (best in first(other, asked)) == stays
        if row.kind == "weight":
            point = [ranking.ideal[0], 0.3, ranking.ideal[2]]
            for share, stays in ((0.999, True), (1.001, False)):
                weights = {"price": 2.0, "days": 1.0, "gain": 1.0}
                before = ReferencePoint(point, weights=[*weights.values()]).do(ranking)[0]
                weights[row.column] = row.present + share * (row.value - row.present)
                now = ReferencePoint(point, weights=[*weights.values()]).do(ranking)
                assert (before in now) == stays
        compared += row.kind != "limit"
    assert compared > 4


def test_another_test_of_the_recommended_design_is_no_other_design():
    X, F = [[1], [2], [3]], [[0.0, 4.0], [1.0, 1.0], [4.0, 0.0]]
    once = switching(TestTable.of([1, 2, 3], X, F), "value")
    repeated = TestTable.of([1, 2, 3, 4], [*X, X[1]], [*F, F[1]])
    pd.testing.assert_frame_equal(switching(repeated, "value"), once)


def test_an_explanation_of_the_optimum_says_until_when_it_stays():
    table = read_table(*offers(1))
    ranking = table.feasible_ranking()
    why = explain(table)
    assert list(why.switching) == table.switching()
    changes = switching(table, "limit")
    known = changes.dropna(subset=["value", "design"])
    assert len(known)
    for name in known["design"]:
        assert f"(then {name})" in why.switching[0]
    assert str(why).replace("\n", " ").endswith(" ".join(why.switching))
    other = ranking.name_of(ranking.by_place[1])
    assert explain(table, other).switching == ()


def test_a_weight_of_0_only_grows():
    table = read_table(*offers(1))
    found = switching(table, "weight", weights={"price": 0.0})
    assert found[found["column"] == "price"]["direction"].tolist() == ["more"]


def test_wrong_arguments():
    table = read_table(*offers(1))
    refused("must be", switching_values, table, weights={"mass": 2})
