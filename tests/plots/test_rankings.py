"""A ranked set as parallel coordinates."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import LineCollection
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import TestTable, rank_of_efficiency
from pymoo_psi._numbers import number
from pymoo_psi.plots import plot_objectives, plot_ranking, plot_table
from tests.plots.drawn import assert_whole, shown, texts


def ranked(m, n=60, name="an objective with a long name, the {}th", **options):
    F = np.random.default_rng(5).random((n, m)) * 10.0 ** np.arange(m)
    frame = pd.DataFrame(F, columns=[name.format(j) for j in range(m)])
    return rank_of_efficiency(frame, **options)


@pytest.fixture(scope="module")
def ranking():
    return ranked(3, name="c{}", maximize=["c1"])


@pytest.fixture(scope="module")
def page(ranking):
    return plot_ranking(ranking, units={"c0": "kg"}, title="Cranes")


def test_the_legend_counts_the_front_by_place_and_the_best_has_its_name(ranking, page):
    near = ((ranking.place > 1) & (ranking.place <= 10)).sum()
    best = ranking.name_of(ranking.salukvadze[0])
    assert {f"places 2 to 10 ({near})", f"place 1: {best} (1)"} <= {*texts(page)}
    assert page.caption.startswith(f"Cranes. {ranking.pareto.sum()} Pareto-optimal designs of 60")


def test_a_line_goes_from_the_best_to_the_worst_value_of_each_objective(ranking, page):
    ax = shown(page)[-1]
    lines = [c for c in ax.collections if isinstance(c, LineCollection)]
    drawn = np.array([line[:, 1] for group in lines for line in group.get_segments()])
    assert len(drawn) == ranking.pareto.sum()
    # the ends of the range are reached, and the optimum's line is what its values say
    np.testing.assert_allclose([drawn.min(axis=0), drawn.max(axis=0)], [[0] * 3, [1] * 3])
    best = ranking.objectives.values[ranking.salukvadze[0]]
    share = (best - ranking.ideal) / (ranking.nadir - ranking.ideal)
    np.testing.assert_allclose(lines[-1].get_segments()[0][:, 1], share)
    below = [text.get_text().split("\n") for text in ax.get_xticklabels()]
    above = [text.get_text() for text in ax.child_axes[0].get_xticklabels()]
    for j, name in enumerate(["c0 [kg]", "c1 (max)", "c2"]):
        assert below[j] == [number(ranking.ideal[j]), name]
        assert above[j] == number(ranking.nadir[j])


def test_figures_take_what_is_ranked_or_read():
    result = minimize(get_problem("bnh"), NSGA2(pop_size=20), ("n_gen", 4), seed=1)
    frame = pd.DataFrame(result.F, columns=["f1", "f2"])
    table = TestTable.of(range(1, len(frame) + 1), result.X, result.F)
    arrays = [result.F, frame]
    for plot, others in ((plot_ranking, arrays), (plot_objectives, arrays), (plot_table, [])):
        expected = plot(table)
        for figure in map(plot, [result, *others]):
            assert figure.caption == expected.caption
            for ax, first in zip(shown(figure), shown(expected), strict=True):
                assert ax.dataLim.bounds == first.dataLim.bounds


def test_one_value_far_from_all_others_does_not_flatten_the_axes():
    costs = [1200, 1350, 2100, 2250, 1800, 1500, 1290, 1990, 45000]
    frame = pd.DataFrame({"cost": costs, "mass": [9, 8, 4, 3, 5, 7, 8.5, 4.5, 2]})
    (lines,) = shown(plot_ranking(rank_of_efficiency(frame)))
    assert lines.child_axes[0].get_xticklabels()[0].get_text() == number(45000)  # as ranked
    table = TestTable.of(range(1, 10), np.ones((9, 1)), frame.to_numpy(float))
    figure = plot_objectives(table)
    assert 2250 < shown(figure)[0].get_xlim()[1] < 5000
    assert figure.caption.endswith("1 design outside the axes.")
    assert shown(plot_objectives(table, design=9))[0].get_xlim()[1] > 45000


@pytest.mark.parametrize("m", [1, 2, 8, 12])
def test_any_number_of_objectives_has_a_whole_page(m):
    """A design that is marked has its name only."""
    ranking = ranked(m)
    figure = plot_ranking(ranking, row=3)
    assert ranking.name_of(3) in texts(figure)
    assert len(shown(figure)) == 1
    assert_whole(figure)
