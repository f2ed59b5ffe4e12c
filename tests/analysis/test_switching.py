"""Switching values: what is recommended just before and just beyond each of them."""

import itertools
import re

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import Formulation, read_table
from pymoo_psi.analysis import (
    change_text,
    constraint_costs,
    none_left_reason,
    switching_sentences,
    switching_values,
)
from tests.helpers.draws import rarely
from tests.helpers.fronts import on_sphere

WIDE = {"price": (-1, 3), "days": (-1, 3), "gain": (-1, 3)}
NARROW = {"price": (0.5, 3), "days": (0.4, 0.4), "gain": (-1, 1)}  # many designs are better


def offers(seed, n=40):
    """Return random offers, often equal in part, and what is asked of them."""
    rng = np.random.default_rng(seed)
    F = (1.3 - on_sphere(rng, n, 3)) ** 1.5 + 0.2 * rng.random((n, 1))
    frame = pd.DataFrame(np.round(F, 2 - seed % 2), columns=["price", "days", "gain"])
    frame.insert(0, "name", [f"offer {k}" for k in range(n)])
    frame["mass"] = np.where(rng.random(n) < 0.1, np.nan, np.round(rng.random(n), 2))
    asked = Formulation(
        ["price", "days", "gain"],
        maximize=["gain"],
        limits={"price": (seed % 5 / 10, 0.9), "days": (None, 1.2), "mass": (0.2, 0.8)},
        ranges=(None, WIDE, NARROW)[seed % 3],
        normalize=seed % 4 > 0,
    )
    return frame, asked


def first(table, **limits):
    """Return the names of the optima under other limits; none where nothing is left."""
    table = table.under(limits={**table.limits, **limits})
    if not table.feasible().any():
        return []
    ranking = table.feasible_ranking()
    return [ranking.name_of(row) for row in ranking.salukvadze.tolist()]


@pytest.mark.parametrize("seed", [*range(6), *rarely(*range(6, 12))])
def test_limits_between_which_the_recommendation_stays(seed):
    """All designs are ranked again at every value: the first that changes it is reported."""
    frame, asked = offers(seed)
    table = read_table(frame, asked)
    best = first(table)[0]
    found = switching_values(table)
    assert {*found["column"]} == {"price", "days", "gain", "mass"}
    for row in found.itertuples():
        sign, end = {"lower": (-1, 0), "upper": (1, 1)}[row.end]
        pair = [*asked.limits.get(row.column, (None, None))][:2]
        pair[end] = None
        free = table.under(limits={**asked.limits, row.column: tuple(pair)})
        values = np.unique(sign * frame[row.column][free.feasible()])
        present = np.nan_to_num(sign * row.present, nan=np.inf)
        is_looser = row.direction == "looser"
        steps = values[values > present] if is_looser else values[values <= present][::-1]
        for stays, step in itertools.pairwise([np.nan, *steps]):
            pair[end] = sign * step
            optima = first(table, **{row.column: tuple(pair)})
            if best not in optima:
                changed = step if is_looser else stays
                assert (row.value * sign, row.design) == (changed, optima[0])
                break
        else:  # tighter than all values, no design is left
            assert row.design is None


@pytest.mark.parametrize(
    ("end", "direction", "value", "text"),
    [
        ("upper", "looser", 1.234565, "1.23457"),
        ("upper", "tighter", 1.234565, "1.23456"),
        ("lower", "looser", 1.234565, "1.23456"),
        ("lower", "tighter", 1.234565, "1.23457"),
        ("upper", "tighter", 10.1 - 0.3, "9.8"),
        ("upper", "looser", 1.1 * 3, "3.30001"),
        ("upper", "looser", 3_582_428_769.036, "3.58243e9"),
        ("upper", "looser", 12355.25, "12\u00a0355.25"),
    ],
)
def test_a_limit_is_rounded_so_that_it_has_the_effect(end, direction, value, text):
    row = {"end": end, "direction": direction, "value": value, "column": "f1", "design": "A"}
    table = read_table(
        pd.DataFrame({"f1": [1.0, 2.0], "f2": [2.0, 1.0]}),
        Formulation(["f1", "f2"], units={"f1": "kg"}),
    )
    assert f" {text} kg" in change_text(table, row)


@pytest.mark.parametrize("offset", [1_000_000, 1_234_567.5, 123_456_789_012])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_limit_keeps_the_digits_that_tell_designs_apart(offset, sign):
    frame = pd.DataFrame({"f": np.arange(1.0, 5) * sign + offset, "g": [9, 5, 1, 0.9]})
    table = read_table(frame, Formulation(["f", "g"], maximize=["f"][: sign < 0]))
    text = switching_sentences(table)[0].replace("\u00a0", "")
    limit, design = re.findall(r"if f must be (?:below|above) (\S+), (row \d) is", text)[0]
    pair = {1: (None, float(limit) - 0.25), -1: (float(limit) + 0.25, None)}[sign]
    assert design in table.under(limits={"f": pair}).best().names


@pytest.mark.parametrize("sign", [1, -1])
def test_a_looser_limit_keeps_the_digits_that_leave_designs_out(sign):
    """Designs beyond the present limit count: the limit as rounded lets in no further one."""
    frame = pd.DataFrame({"f": np.arange(1.0, 5) * sign / 7 + 10_000_000, "g": [9, 5, 1, 0.9]})
    limit = {1: (None, 10_000_000.2), -1: (9_999_999.8, None)}[sign]
    asked = Formulation(["f", "g"], maximize=["f"][: sign < 0], limits={"f": limit})
    table = read_table(frame, asked)
    (row,) = switching_values(table).query("direction == 'looser'").to_dict("records")
    assert (row["value"], row["design"]) == (frame["f"][2], "row 2")
    assert f"{10_000_000 + sign / 2:,}".replace(",", "\u00a0") in change_text(table, row)


@pytest.mark.parametrize("values", [[100.24, 110], [1.1 * 3], [1.23456789], [1234567.891234] * 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_limit_at_the_nearest_value_that_is_named_leaves_a_design(values, sign):
    frame = pd.DataFrame({"f": sign * np.array(values), "g": range(len(values))})
    table = read_table(frame, Formulation(["f", "g"], limits={"f": (None, 1)[::sign]}))
    nearest = re.search(r"has f (.*)\.$", none_left_reason(table))[1].replace("\u00a0", "")
    assert table.under(limits={"f": (None, float(nearest))[::sign]}).feasible().any()


@pytest.mark.parametrize(
    ("values", "text"),
    [([12345.1341, 12345.9], "12\u00a0345.135"), ([101540.93063, 9.5e8], "101\u00a0541")],
)
def test_a_value_beyond_a_limit_has_the_digits_of_the_table(values, text):
    table = read_table(
        pd.DataFrame({"f": values, "g": [2, 1]}), Formulation(limits={"f": (None, 1)})
    )
    assert none_left_reason(table).endswith(f"the nearest has f {text}.")


def test_a_limit_on_texts_has_no_bounds():
    frame = pd.DataFrame({"rail": ["yes", "no"], "cost": [1.0, 2.0], "mass": [2.0, 1.0]})
    table = read_table(frame, Formulation(["cost", "mass"], limits={"rail": ["yes"], "cost": 1.5}))
    costs = constraint_costs(table)
    np.testing.assert_array_equal(costs[["lower", "upper"]], [[-np.inf, 1.5], [np.nan, np.nan]])
    assert costs["rejects"].tolist() == table.violations()[0].sum(axis=0).tolist() == [1, 1]
    none = none_left_reason(table.under(limits={"rail": ["yes", "on"], "cost": 0.5}))
    assert "; no design has on as rail. Without the limit on cost, 1 is left;" in none
    frame["force"] = [np.nan, 3.0]
    none = none_left_reason(
        read_table(frame, table.formulation).under(limits={"force": 2, "cost": 1})
    )
    assert "Without the limit on force, 1 is left; none of them has a value of force." in none
