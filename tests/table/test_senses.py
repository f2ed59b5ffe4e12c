"""Criteria that are maximised, units and outputs: one meaning from the arrays to files and back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table import Formulation, Layout, TestTable, constraint_costs, histogram

# Few values, so that designs are equal in a criterion and limits are met exactly.
VALUES = st.sampled_from([-2.0, -1.0, -0.0, 0.0, 0.5, 1.0, 3.0, np.inf, -np.inf, np.nan])
FINITE = st.sampled_from([-2.0, -0.0, 0.0, 0.5, 3.0])


@st.composite
def mirrored(draw):
    """A table of two criteria, and the same tests with some of them said to be maximised."""
    n = draw(st.integers(1, 7))
    F = [[draw(VALUES), draw(VALUES)] for _ in range(n)]
    G = [[draw(FINITE)] for _ in range(n)]
    more = draw(st.sets(st.sampled_from(["f1", "f2"]), min_size=1))
    X = np.arange(2.0 * n).reshape(n, 2) % 5
    plain = TestTable.of(range(1, n + 1), X, F, G, outputs={"heat": np.sqrt(np.arange(n))})
    return plain, replace(plain, layout=replace(plain.layout, maximize=tuple(more)))


@st.composite
def mirrored_limits(draw):
    return {name: draw(FINITE) for name in draw(st.sets(st.sampled_from(["f1", "f2"])))}


def own(table, limits):
    """The same limits in the senses of a table."""
    more = table.layout.maximize
    return {n: (-limit, None) if n in more else limit for n, limit in limits.items()}


@given(mirrored(), mirrored_limits())
def test_to_maximise_a_criterion_is_to_minimise_its_negative(tables, limits):
    plain, turned = tables
    turned_limits = own(turned, limits)
    assert np.array_equal(turned.feasible(turned_limits), plain.feasible(limits))
    assert np.array_equal(turned.pareto(turned_limits), plain.pareto(limits))
    for mine, its in zip(turned.violations(turned_limits), plain.violations(limits), strict=True):
        assert np.array_equal(mine, its)
    for name in ("f1", "f2"):
        order = turned.sorted_by(name, turned_limits)
        assert np.array_equal(order.numbers, plain.sorted_by(name, limits).numbers)
        # The best is first, in the criterion's own sense.
        steps = np.diff(order.column(name)[np.isfinite(order.column(name))])
        assert ((steps <= 0) if name in turned.layout.maximize else (steps >= 0)).all()
    counts = histogram(turned, "x1", limits=turned_limits).pareto
    assert np.array_equal(counts, histogram(plain, "x1", limits=limits).pareto)
    signs = {**dict.fromkeys(("lower", "upper", "rejects", "alone"), 1.0)}
    costs, its = constraint_costs(turned, turned_limits), constraint_costs(plain, limits)
    for name, sign in zip(("f1", "f2"), turned.layout.sign, strict=True):
        signs |= {f"{name}_feasible": sign, f"{name}_alone": sign}
        if name in limits and sign < 0:
            costs.loc[name, ["lower", "upper"]] = -costs.loc[name, ["upper", "lower"]].to_numpy()
    for name, sign in signs.items():
        assert np.array_equal(costs[name] * sign, its[name], equal_nan=True)
    if plain.feasible(limits).any():
        for mine, its in zip(
            turned.refined_bounds(turned_limits), plain.refined_bounds(limits), strict=True
        ):
            assert np.array_equal(mine, its)
    if plain.pareto(limits).any():
        ranking, its = turned.ranking(turned_limits), plain.ranking(limits)
        assert np.array_equal(ranking.rank, its.rank)
        assert np.array_equal(ranking.criteria, its.criteria)
        assert np.array_equal(ranking.salukvadze, its.salukvadze)
        assert np.array_equal(ranking.ideal, its.ideal * turned.layout.sign)


def test_an_output_that_only_a_later_table_has_keeps_its_sense_and_unit():
    layout = Layout.of(1, ["mass"], outputs=["gain"], maximize=["gain"], units={"gain": "W"})
    new = TestTable.of([3, 4], [[0.3], [0.4]], [[1], [1]], outputs={"gain": [5, 6]}, layout=layout)
    old = TestTable.of([1, 2], [[0.1], [0.2]], [[1], [2]], layout=Layout.of(1, ["mass"]))
    combined = TestTable.combined({"old": old, "new": new})
    for table in (old.extended(new), new.extended(old), old.merge(new), new.merge(old), combined):
        assert (table.layout.maximize, table.layout.units) == (("gain",), {"gain": "W"})
        judged = table.under(Formulation(objectives=["mass", "gain"]))
        assert judged.rows(judged.pareto()).column("gain").tolist() == [6]
    # Two that contradict each other are refused, also beside a table that knows neither.
    other = replace(new, numbers=[5, 6], layout=replace(layout, maximize=()))
    with pytest.raises(ArgumentValueError, match="direction of gain max against min"):
        old.extended(new, other)
    other = replace(new, layout=replace(layout, units={"gain": "kW"}))
    with pytest.raises(ArgumentValueError, match="unit of gain W against kW"):
        TestTable.combined({"a": old, "b": new, "c": other})
