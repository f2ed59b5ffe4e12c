"""Switching values: what is recommended just before and just beyond each of them."""

import re

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import Formulation, read_table
from pymoo_psi.analysis import switching, switching_values


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


def first(frame, asked, **limits):
    """Return the names of the optima under other limits; none where nothing is left."""
    table = read_table(frame, asked).under(limits={**asked.limits, **limits})
    if not table.eligible().any():
        return []
    ranking = table.feasible_ranking()
    return [ranking.name_of(row) for row in ranking.salukvadze.tolist()]


@pytest.mark.parametrize(("seed", "share"), [(0, 0.7), (1, 0.25), (2, 0.25), (3, 0.25)])
def test_limits_between_which_the_recommendation_stays(seed, share):
    """Every value that a design has is tried: the first that changes it is the one reported."""
    frame, asked = offers(seed, share)
    best = first(frame, asked)[0]
    found = switching_values(read_table(frame, asked))
    assert (found[found["direction"] == "looser"]["value"].notna()).any() == (share < 0.5)
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


@pytest.mark.parametrize("sign", [1, -1])
def test_a_sentence_says_which_limits_change_the_proposal(sign):
    """A tighter limit changes it beyond the value of the proposed design, not at this value."""
    F = np.array([[1250.0, 4.0], [1299.0, 1.0], [1400.0, 0.5], [1500.0, 0.0]])
    frame = pd.DataFrame(F * [sign, 1], columns=["price", "days"], index=list("ABCD"))
    limit = {1: (None, 1450), -1: (-1450, None)}[sign]
    maximize = ["price"][: sign < 0]
    table = read_table(frame, Formulation([*frame], maximize=maximize, limits={"price": limit}))
    (text,) = switching(table)
    (tighter,) = re.findall(r"price (below|above) (-?[\d ]+) \(then (.)\)", text)
    assert tighter == {1: ("below", "1299", "A"), -1: ("above", "-1299", "A")}[sign]
    for value, stays in ((1299, True), (1298, False)):
        pair = {1: (None, value), -1: (-value, None)}[sign]
        ranking = table.under(limits={"price": pair}).feasible_ranking()
        assert ("B" in [ranking.name_of(row) for row in ranking.salukvadze]) == stays


def test_a_sentence_names_the_designs_that_would_be_proposed():
    table = read_table(*offers(1))
    known = switching_values(table).dropna(subset=["value", "design"])
    assert len(known)
    (text,) = switching(table)
    for name in known["design"]:
        assert f"(then {name})" in text
