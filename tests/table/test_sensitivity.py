"""Sensitivities against exact indices, and rules against what they say."""

import numpy as np
import pytest
from pymoo.problems import get_problem

from pymoo_psi import Restricted, TestTable, investigate, lp_tau
from pymoo_psi.table import Layout, feasibility_rules, sensitivities


def table_of(X, F, G=None, **names):
    layout = Layout.of(X.shape[1], F.shape[1], 0 if G is None else G.shape[1], **names)
    return TestTable.of(range(1, len(X) + 1), X, F, G, layout=layout)


# Exact first-order indices: Ishigami and Homma 1990 with a = 7, b = 0.1.
A, B = 7.0, 0.1
VARIANCE = A**2 / 8 + B * np.pi**4 / 5 + B**2 * np.pi**8 / 18 + 0.5
ISHIGAMI = [0.5 * (1 + B * np.pi**4 / 5) ** 2 / VARIANCE, A**2 / 8 / VARIANCE, 0.0]


def ishigami(n):
    x = np.pi * (2 * lp_tau(n, 3) - 1)
    y = np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])
    return table_of(x, y[:, None])


def test_ishigami():
    found = sensitivities(ishigami(1024))
    error = np.abs(found["first_order"].to_numpy() - ISHIGAMI)
    assert error.max() < 0.05
    assert (found["lower"] <= ISHIGAMI).all()
    assert (found["upper"] >= ISHIGAMI).all()


@pytest.mark.parametrize("options", [2, 3, 7, 15])
def test_options_and_whole_numbers_count_as_what_they_do(options):
    """y is an effect of a choice, with options in no order, and of an integer: half and half."""
    u = lp_tau(1024, 3)
    rng = np.random.default_rng(options)
    effect = rng.permutation(np.linspace(-1, 1, options))
    number = (u[:, 0] * options).astype(int)
    whole = (u[:, 1] * 4).astype(int)
    X = np.empty((1024, 3), dtype=object)
    for j, column in enumerate(([f"option {k}" for k in number], whole.tolist(), u[:, 2].tolist())):
        X[:, j] = column
    parts = effect[number] / effect[number].std(), whole / whole.std()
    found = sensitivities(TestTable.of(range(1, 1025), X, (parts[0] + parts[1])[:, None]))
    np.testing.assert_allclose(found["first_order"], [0.5, 0.5, 0.0], atol=0.05)


def test_columns_by_name_in_any_sense_and_failures_left_out():
    X = lp_tau(512, 3) * [1, 1, 0] + [0, 0, 0.5]  # the third is fixed
    F = np.column_stack([-X[:, 0], X[:, 1] - X[:, 0], np.ones(512)])
    F[::50] = np.nan
    table = TestTable.of(
        range(1, 513), X, F, outputs={"heat": X[:, 1]},
        layout=Layout.of(["width", "height", "depth"], ["gain", "mass", "one"], maximize=["gain"]),
    )  # fmt: skip
    found = sensitivities(table)
    assert found.index.unique("column").tolist() == ["gain", "mass", "one", "heat"]
    assert found.index.unique("variable").tolist() == ["width", "height"]
    index = found["first_order"].unstack()
    np.testing.assert_allclose(index.loc["gain", ["width", "height"]], [1, 0], atol=0.05)
    np.testing.assert_allclose(index.loc["mass", ["width", "height"]], [0.5, 0.5], atol=0.05)
    np.testing.assert_allclose(index.loc["heat", ["width", "height"]], [0, 1], atol=0.05)
    assert index.loc["one"].isna().all()


def test_the_same_bands_each_time_and_no_other_generator_disturbed():
    table = ishigami(256)
    np.random.seed(7)  # noqa: NPY002 - the global one, that a user may count on
    first = sensitivities(table)
    drawn = np.random.random()  # noqa: NPY002
    np.random.seed(7)  # noqa: NPY002
    assert drawn == np.random.random()  # noqa: NPY002
    assert sensitivities(table).equals(first)
    assert not sensitivities(table, seed=2).equals(first)


def inside(table, box):
    """Which tests a rule's box holds; its lower bounds of real numbers do not belong to it."""
    held = np.ones(len(table), dtype=bool)
    for name, part in box.items():
        column = table.column(name)
        if isinstance(part, tuple):
            low, high = part
            held &= True if high is None else column <= high
            whole = table.kinds[table.layout.variable(name)].value == "integer"
            held &= True if low is None else (column >= low if whole else column > low)
        else:
            kept = part if isinstance(part, list) else [part]
            held &= np.array([value in kept for value in column.tolist()])
    return held


@pytest.mark.parametrize("name", ["osy", "welded_beam", "tnk"])
def test_rules_share_out_the_tests_and_count_them_right(name):
    table = investigate(get_problem(name), 1024)
    found = feasibility_rules(table)
    held = np.array([inside(table, rule.box) for rule in found.rules])
    assert (held.sum(axis=0) == 1).all()
    for mask, rule in zip(held, found.rules, strict=True):
        assert rule.n_tests == mask.sum()
        assert rule.n_feasible == (mask & table.feasible()).sum()
    shares = [rule.share for rule in found.rules]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] > 2 * table.feasible().mean()
    assert sum(found.importance.values()) == pytest.approx(1)
    assert {n for rule in found.rules for n in rule.box} == set(found.importance)
    # and the best one leads to feasible designs
    fresh = investigate(Restricted(get_problem(name), found.rules[0].box), 512).feasible().mean()
    assert fresh == pytest.approx(shares[0], abs=0.1)


def test_rules_of_options_whole_numbers_and_limits():
    u = lp_tau(512, 4)
    X = np.empty((512, 4), dtype=object)
    columns = (
        u[:, 0],
        (u[:, 1] * 6).astype(int),
        u[:, 2] < 0.5,
        np.array(["iron", "tin", "wood"])[(u[:, 3] * 3).astype(int)],
    )
    for j, column in enumerate(columns):
        X[:, j] = column.tolist()
    good = (columns[1] >= 2) & columns[2] & (columns[3] != "tin")
    layout = Layout.of(["width", "ribs", "hollow", "metal"], ["mass"])
    table = TestTable.of(range(1, 513), X, np.where(good, 0.0, 1.0)[:, None], layout=layout)
    rules = feasibility_rules(table, {"mass": 0.5}, depth=3).rules
    best = rules[0]
    assert best.box == {"ribs": (2, None), "hollow": True, "metal": ["iron", "wood"]}
    assert set(best.text.split(" and ")) == {"ribs >= 2", "hollow = True", "metal in iron, wood"}
    assert (best.n_tests, best.n_feasible) == (good.sum(), good.sum())


@pytest.mark.parametrize("share", [0.0, 0.004, 0.3, 1.0])
def test_noise_has_no_rules(share):
    X = lp_tau(512, 4)
    G = np.where(np.random.default_rng(3).random((512, 1)) < share, -1.0, 1.0)
    (rule,) = feasibility_rules(table_of(X, X[:, :1], G)).rules
    assert rule.text == "everywhere"
    assert (rule.n_tests, rule.n_feasible) == (512, (G < 0).sum())
