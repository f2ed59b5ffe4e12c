"""Criteria that are maximised, units and outputs: one meaning from the arrays to files and back."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table import Formulation, Schema, TestTable
from tests.helpers.refusals import refused

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
    schema = plain.schema.changed(maximize=dict.fromkeys(more, True))
    outputs = {"heat": plain["heat"]}
    return plain, TestTable.of(plain.numbers, X, F, G, outputs=outputs, schema=schema)


@st.composite
def mirrored_limits(draw):
    return {name: draw(FINITE) for name in draw(st.sets(st.sampled_from(["f1", "f2"])))}


def own(table, limits):
    """The same limits in the senses of a table."""
    more = table.schema.maximize
    return {n: (-limit, None) if n in more else limit for n, limit in limits.items()}


@given(mirrored(), mirrored_limits())
def test_to_maximise_a_criterion_is_to_minimise_its_negative(tables, limits):
    plain, turned = tables
    other, mine = plain.under(limits=limits), turned.under(limits=own(turned, limits))
    for ask in (TestTable.feasible, TestTable.pareto, lambda table: table.violations()[0]):
        assert np.array_equal(ask(mine), ask(other))


def test_an_output_of_a_later_table_keeps_its_unit():
    schema = Schema.of(1, ["mass"], outputs=["gain"], maximize=["gain"], units={"gain": "W"})
    new = TestTable.of([3, 4], [[0.3], [0.4]], [[1], [1]], outputs={"gain": [5, 6]}, schema=schema)
    old = TestTable.of([1, 2], [[0.1], [0.2]], [[1], [2]], schema=Schema.of(1, ["mass"]))
    for table in (old.extended(new), new.extended(old), old.merge(new), new.merge(old)):
        assert (table.schema.maximize, table.schema.units) == (("gain",), {"gain": "W"})
        judged = table.under(Formulation(objectives=["mass", "gain"]))
        assert judged.take(judged.pareto()).column("gain").tolist() == [6]
    # Two that contradict each other are refused, also beside a table that knows neither.
    other = replace(new, evaluated=schema.changed(maximize={"gain": False}))
    refused(
        "maximize of gain True against False", old.extended, new, other, error=ArgumentValueError
    )
    other = replace(new, evaluated=schema.with_units({"gain": "kW"}))
    refused("unit of gain W against kW", old.merge(new).merge, other)
