"""Experiments joined: one table over all tests, each with where it is from."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymoo.problems import get_problem

from pymoo_psi import Formulation, PsiError, TestTable, investigate, rank_of_efficiency
from pymoo_psi.table import Layout

# Few values, so that designs tie, dominate each other and are equal across experiments.
DESIGNS = [0.5, 0.75, 1.0]
GRID = st.sampled_from([0.0, 1.0, 2.0, 3.0, np.nan])


@st.composite
def experiments(draw):
    """Up to four tables of one problem with other boxes, numbers, outputs and failures."""
    found = {}
    m = draw(st.integers(1, 3))
    more = draw(st.sets(st.sampled_from([f"f{j + 1}" for j in range(m)])))
    # The model: a design has the same result in every experiment.
    model = {
        x: ([draw(GRID) for _ in range(m)], draw(st.sampled_from([-1.0, 0.0, 0.5])))
        for x in DESIGNS
    }
    for name in draw(st.lists(st.sampled_from("abcd"), min_size=1, unique=True)):
        n = draw(st.integers(0, 6))
        numbers = draw(st.lists(st.integers(1, 30), min_size=n, max_size=n, unique=True))
        outputs = draw(st.lists(st.sampled_from(["heat", "cost"]), unique=True))
        low = draw(st.sampled_from([0.0, 0.5, np.nan]))
        failed = draw(st.sets(st.sampled_from(numbers))) if n else set()
        x = [draw(st.sampled_from(DESIGNS)) for _ in range(n)]
        found[name] = TestTable.of(
            np.array(numbers, dtype=int),
            np.array(x).reshape(n, 1),
            np.array([model[v][0] for v in x]).reshape(n, m),
            G=np.array([model[v][1] for v in x]).reshape(n, 1),
            outputs={o: np.array(x) + 0.5 for o in outputs},
            reasons=dict.fromkeys(failed, "it broke"),
            layout=Layout.of(1, m, 1, lower=[low], upper=[low + 2], maximize=sorted(more)),
        )
    return found


def dominates(a, b):
    return (a <= b).all() and (a < b).any()


@given(experiments=experiments(), limit=st.sampled_from([None, 1.0, 2.0]))
def test_sets_and_ranks_are_those_of_the_union(experiments, limit):
    table = TestTable.combined(experiments)
    parts = experiments.items()
    origin = [(name, int(n)) for name, t in parts for n in t.numbers]
    assert [*zip(table.column("experiment"), table.column("number"), strict=True)] == origin
    assert len({*table.numbers.tolist()}) == len(origin)
    for block in ("X", "F", "G", "status"):
        union = np.concatenate([getattr(t, block) for t in experiments.values()])
        np.testing.assert_array_equal(getattr(table, block), union)
    whys = {(name, n): why for name, t in parts for n, why in t.reasons.items()}
    by_number = dict(zip(table.numbers.tolist(), origin, strict=True))
    assert {by_number[n]: why for n, why in table.reasons.items()} == whys
    for output in table.layout.outputs:
        union = [
            t.column(output) if output in t.layout.outputs else np.full(len(t), np.nan)
            for t in experiments.values()
        ]
        np.testing.assert_array_equal(table.column(output), np.concatenate(union))
    # Sets by comparing every design with every other one.
    sign = table.layout.sign[0]
    limits = {} if limit is None else {"f1": (None, limit) if sign > 0 else (-limit, None)}
    feasible = [
        status == "ok" and (limit is None or f[0] <= limit)
        for f, status in zip(table.F, table.status, strict=True)
    ]
    front = [f for f, ok in zip(table.F, feasible, strict=True) if ok]
    seen, pareto = set(), []
    for x, f, ok in zip(table.X[:, 0], table.F, feasible, strict=True):
        best = bool(ok and not any(dominates(other, f) for other in front))
        # A design that several experiments have tested counts once.
        pareto.append(best and (len(table.experiments) == 1 or (x, *f) not in seen))
        seen |= {(x, *f)} if best else set()
    assert table.feasible(limits).tolist() == feasible
    assert table.pareto(limits).tolist() == pareto
    if any(pareto):
        ranking = rank_of_efficiency(table.F[table.pareto(limits)])
        np.testing.assert_array_equal(table.ranking(limits).rank, ranking.rank)
    bounds = [t.layout.lower[0] for t in experiments.values()]
    np.testing.assert_equal(
        table.layout.lower[0], np.nan if np.isnan(bounds).any() else min(bounds)
    )


@given(experiments=experiments())
def test_where_tests_are_from_survives_parts_files_and_formulations(experiments, tmp_path_factory):
    table = TestTable.combined(experiments)
    path = tmp_path_factory.mktemp("combined") / "all.csv"
    table.to_csv(path)
    again = TestTable.read_csv(path)
    assert again.equals(table)
    frame = pd.read_csv(path, comment="#", index_col="test_point", keep_default_na=False)
    assert frame["experiment"].tolist() == table.column("experiment").tolist()
    assert frame["number"].tolist() == table.column("number").tolist()
    rows = table.rows(table.numbers % 2 == 0)
    names = table.column("experiment")[table.numbers % 2 == 0]
    assert rows.column("experiment").tolist() == names.tolist()
    anew = table.under(Formulation(limits={"x1": (0.75, None)}))
    apart = {n: t.under(Formulation(limits={"x1": (0.75, None)})) for n, t in experiments.items()}
    assert anew.equals(TestTable.combined(apart))


def test_what_is_not_one_problem_is_refused():
    table = TestTable.of([1], [[0.1]], [[1.0]])
    other = TestTable.of([1], [[0.1]], [[1.0]], layout=Layout.of(1, ["mass"]))
    sub = table.under(Formulation(objectives=["r"], computed={"r": "f1 * 2"}))
    turned = replace(table, layout=replace(table.layout, maximize=("f1",)))
    bnh = investigate(get_problem("bnh"), 4)
    another = replace(bnh, problem={**bnh.problem, "parameters": {"c": 1}})
    for tables, message in [
        ({"a": table, "b": other}, "experiment 'b' must be .*objectives .*f1.* against .*mass"),
        ({"a": table, "b": sub}, "objectives .*f1.* against .*r"),
        ({"a": table, "b": turned}, "direction of f1 min against max"),
        ({"a": bnh, "b": another}, "parameters"),
        (
            {"a": table, "b": replace(table, F=[[2.0]])},
            "1.0 and 2.0 as f1 of test point 1 of a and test point 1 of b",
        ),
        ([table], "experiments must be tables by name"),
    ]:
        with pytest.raises(PsiError, match=message):
            TestTable.combined(tables)
    named = TestTable.of([1], [[0.1]], [[1.0]], layout=Layout.of(["number"], 1))
    with pytest.raises(
        PsiError, match="an extra column must be .* named unlike other columns, got 'number'"
    ):
        TestTable.combined({"a": named})


def test_parts_of_joined_experiments_are_put_together_again():
    part = TestTable.of([1, 2], [[0.0], [0.5]], [[3.0], [1.0]])
    both, others = (TestTable.combined({name: part, "b": part}) for name in "ac")
    assert not both.equals(others)
    with pytest.raises(PsiError, match="got a and c as experiment of"):
        both.merge(others)
    assert both.rows([3]).merge(both.rows([0, 1, 2])).equals(both)
