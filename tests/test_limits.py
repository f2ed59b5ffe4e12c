"""A limit is the same as removing the rows that it rejects, in all that is said of the others.

Excepted is what speaks of the limits themselves: how many designs they reject, what loosening them
would change, and the ends of axes and sliders.
"""

import re
import shutil

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymoo.core.variable import Choice, Integer

from pymoo_psi import (
    Decision,
    Formulation,
    TestTable,
    acceptability,
    cautions,
    compare_designs,
    explain,
    investigate,
    representatives,
)
from pymoo_psi.analysis import average_repeats, confidence_sentences, separation_sentences
from pymoo_psi.page import decision_page
from pymoo_psi.plots import plot_ranking
from pymoo_psi.report import decision_report
from pymoo_psi.table import Schema
from tests.helpers.asked import kept_by_hand
from tests.helpers.documents import payload_of
from tests.helpers.drawn import texts
from tests.helpers.draws import examples
from tests.helpers.fronts import on_sphere
from tests.helpers.models import Model
from tests.page.test_page_logic import in_node
from tests.report.test_report import Reader

SEEDS = st.integers(0, 2**32 - 1)
# What speaks of limits, in the outputs of the commands and in the report.
OF_LIMITS = re.compile(
    r"are feasible|is feasible|is within the limits|Without the limits|^Tighter|^Looser"
    r"|^Warning|written to"
)


class Example:
    """A random table, and limits on it: ``limited`` is under them, ``left`` lacks the rows."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(8, 50))
        m = int(rng.integers(1, 5))
        X = [
            {
                "x": float(x),
                "k": int(k),
                "steel": str(rng.choice(["S", "T"])),
            }
            for x, k in zip(rng.random(n).round(2), rng.integers(1, 9, n), strict=True)
        ]
        F = rng.random((n, m)).round(int(rng.choice([1, 3]))) * 10.0 ** rng.integers(-3, 4, m)
        if rng.random() < 0.5 and m > 1:  # a front, its first row far from the others
            F = (1.3 - on_sphere(rng, n, m)) ** 2
            F[0] *= 50
        if rng.random() < 0.2:
            F[:, 0] = 3.0
        F[rng.random(n) < 0.1, -1] = np.nan
        G = rng.normal(-1.0, 1.0, (n, int(rng.integers(0, 2))))
        heat = np.where(rng.random(n) < 0.1, np.nan, rng.random(n).round(2))
        rail = rng.choice(["yes", "no", ""], n)
        for row in range(1, n):  # tests that repeat an earlier one, some with another text
            if rng.random() < 0.15:
                before = int(rng.integers(0, row))
                X[row], F[row], G[row], heat[row] = X[before], F[before], G[before], heat[before]
                if rng.random() < 0.5:
                    rail[row] = rail[before]
        names = [f"f{j + 1}" for j in range(m)]
        maximize = [name for name in names if rng.random() < 0.4]
        schema = Schema.of(
            ["x", "k", "steel"],
            names,
            ["g"][: G.shape[1]],
            maximize=maximize,
            units={names[0]: "kg"},
            outputs=["heat"],
        )
        label = "name" if rng.random() < 0.5 else None
        tests = TestTable.of(
            np.arange(1, n + 1),
            X,
            F,
            G,
            outputs={"heat": heat},
            schema=schema,
            notes={"rail": rail, "name": [f"offer {k}" for k in rng.permutation(n)]},
            label=label,
        )
        self.limits = self.drawn(rng, tests)
        computed = {"sum": " + ".join(["x", *names])} if rng.random() < 0.4 else {}
        table = tests.under(
            Formulation(
                [*names, *computed],
                maximize=maximize,
                computed=computed,
                normalize=bool(rng.random() < 0.8),
            )
        )
        if rng.random() < 0.25:
            table = fixed(table)
        self.limited = table.under(limits=self.limits)
        self.left = table.take(kept_by_hand(n, tests.column, self.limits))
        self.is_empty = not self.left.feasible().any()

    def drawn(self, rng, tests):
        """Return limits on columns of any kind, such that some rows are left, as a rule."""
        limits = {}
        for name in rng.choice([*tests.schema.objectives, "x", "k", "heat"], 2, replace=False):
            values = np.sort(tests.column(name).astype(float))
            low, high = np.quantile(values[np.isfinite(values)], [0.1, rng.uniform(0.5, 1.0)])
            limits[str(name)] = [(None, float(high)), (float(low), float(high))][rng.integers(2)]
        for name, allowed in (("rail", ["yes", ""]), ("steel", ["T"])):
            if rng.random() < 0.25 and {*allowed} & {*tests.column(name)}:
                limits[name] = allowed
        return limits


def fixed(table):
    """Return a table under fixed ranges, in which not all designs are."""
    designs = table.take(table.feasible())
    if len(designs) == 0:
        return table
    ranges = {}
    for name in table.schema.objectives:
        ends = np.quantile(designs.column(name), [0, 0.5, 1])
        ranges[name] = ends[1:] if name in table.schema.maximize else ends[:2]
        if not (np.diff(ends) > 0).all():
            return table
    return table.under(ranges=ranges)


def of_ranking(ranking):
    """All that a ranking holds and shows."""
    names = ("criteria", "place", "rank", "pareto", "salukvadze", "lengths", "ideal", "nadir")
    return {
        **{name: getattr(ranking, name) for name in names},
        "frame": ranking.to_frame().to_dict("split"),
        "text": repr(ranking),
        "labels": [*ranking.objectives.labels],
    }


def said_of(table):
    """All that is said of the feasible designs of a table."""
    ranking = table.feasible_ranking()
    names = [*ranking.objectives.labels]
    few = representatives(table, 4)
    explained = [explain(table, name) for name in names]
    compared = [compare_designs(table, [names[0], name]) for name in names[1:]]
    return {
        "best": table.best().names,
        "bounds": table.refined_bounds(margin=0.1),
        "rankings": [of_ranking(one) for one in (table.ranking(), ranking)],
        "cautions": cautions(table),
        "weights": acceptability(table),
        "representatives": (few.rows, few.shares, few.radius),
        "explained": [(one.sentences, one.behind, one.shares) for one in explained],
        "certainty": [confidence_sentences(table, row) for row in range(len(names))],
        "compared": [(pair.sentences, pair.shares) for pair in compared],
        "separations": separations(table, names),
    }


@given(seed=SEEDS)
def test_limits_leave_what_removed_rows_leave(seed):
    example = Example(seed)
    limited, left = example.limited, example.left
    assert limited.numbers[limited.feasible()].tolist() == left.numbers[left.feasible()].tolist()
    if not example.is_empty:
        np.testing.assert_equal(said_of(limited), said_of(left))


def separations(table, names):
    """Return how far the choices of two people are apart, and what both regret least."""
    positions = [{"name": "Ann", "chosen": names[0]}, {"name": "Ben", "chosen": names[-1]}]
    return separation_sentences(table.under(Decision(table.formulation, positions=positions)))


@examples(0.1)
@given(seed=SEEDS)
def test_rejected_designs_change_no_certainty_of_means(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 12))
    X = np.repeat(rng.random((n, 1)), rng.integers(2, 5, n), axis=0)
    F = np.column_stack([X[:, 0], (1 - X[:, 0]) ** 2]) + rng.normal(0, 0.05, (len(X), 2))
    designs = average_repeats(TestTable.of(np.arange(1, len(X) + 1), X, F))
    limit = float(np.quantile(designs["f1"], 0.7))
    limited = designs.under(limits={"f1": limit})
    left = designs.take(designs["f1"] <= limit)
    pd.testing.assert_frame_equal(limited.confidence(), left.confidence())
    assert confidence_sentences(limited, 0) == confidence_sentences(left, 0)


def drawn_lines(figure):
    (ax,) = (ax for ax in figure.axes if ax.lines or ax.collections)
    return [segment.tolist() for lines in ax.collections for segment in lines.get_segments()]


def left_of_report(sections, title):
    """Return what a section says, but of limits, other sections and the whole table."""
    return [
        re.sub(" within the limits?", "", text)
        for text in sections.get(title, [])
        if not OF_LIMITS.search(text) and text not in sections
    ]


def test_figures_and_reports_speak_of_the_designs_left(draws, undrawn):
    compared = 0
    for example in map(Example, draws(4)):
        assert not example.is_empty
        limited, left = decision_report(example.limited), decision_report(example.left)
        assert limited.cautions == left.cautions
        assert str(limited) == str(left)
        reports = [Reader(report).sections for report in (limited, left)]
        assert [*reports[0]][1:2] == ["Values"]
        for title in ("sheet", "Values", "One step away", "Where each design stands"):
            said, expected = (left_of_report(report, title) for report in reports)
            assert said == expected
            compared += len(said)
        one, other = (
            plot_ranking(table.feasible_ranking()) for table in (example.limited, example.left)
        )
        assert drawn_lines(one) == drawn_lines(other)
        assert texts(one) == texts(other)
    assert compared > 10


GEARED = Model(
    lambda x: {"F": [x["gear"] + x["teeth"], (5 - x["teeth"]) ** 2 - x["gear"]]},
    vars={"gear": Choice(options=[12, 16, 20]), "teeth": Integer(bounds=(1, 4))},
)


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
def test_page_report_and_ranking_count_the_same_designs():
    """Tests repeat designs, and numbers that are options are texts on the page."""
    table = investigate(GEARED, 64).under(limits={"gear": 16})
    ranking = table.feasible_ranking()
    assert len(ranking.rows) == 8 < table.feasible().sum()
    payload = payload_of(decision_page(table))
    limits = payload["opens_with"]["limits"]
    asked = {"names": [], "rows": [[]], "pins": [[]], "texts": [], "typed": [], "thorough": [False]}
    asked["states"] = [{"limits": limits, "fixed": False, "dominated": True}]
    (answer,) = in_node([asked | {"payload": payload}])
    (found,) = answer["states"]
    told = (found["count"], len(found["front"]), found["remarks"])
    assert told == (8, ranking.pareto.sum(), [])
    assert "among the 8 designs within the limit" in Reader(decision_report(table)).text
