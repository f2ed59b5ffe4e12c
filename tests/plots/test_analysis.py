"""Figures of sensitivities, feasibility, convergence, predictions and robustness."""

import numpy as np
import pytest

from pymoo_psi import TestTable
from pymoo_psi.plots import plot_convergence, plot_feasibility, plot_sensitivities
from pymoo_psi.table import convergence, feasibility_rules, sensitivities
from tests.plots.drawn import assert_whole, shown


def test_bars_are_the_indices_and_lines_their_bands(osy):
    found = sensitivities(osy, ["f1", "f2", "g4", "g6"])
    figure = plot_sensitivities(found, title="OSY")
    assert [ax.get_title() for ax in shown(figure)] == ["f1", "f2", "g4", "g6"]
    names = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    for ax in shown(figure):
        part = found.loc[ax.get_title()]
        assert names == part.index.tolist()
        assert ax.get_ylim() == figure.axes[0].get_ylim()  # one name, at the left, for all beside
        widths = [bar.get_width() for bar in ax.containers[0]]
        np.testing.assert_allclose(widths, np.maximum(part["first_order"], 0))
        (bands,) = ax.collections
        ends = np.array([segment[:, 0] for segment in bands.get_segments()])
        np.testing.assert_allclose(ends, part[["lower", "upper"]].clip(0, 1))
    assert_whole(figure)


def box_of(ax):
    return [patch for patch in ax.patches if patch.get_label() == "best rule"]


def test_the_best_rule_is_drawn_round_the_feasible(osy):
    (ax,) = plot_feasibility(osy, title="OSY").axes
    found = feasibility_rules(osy)
    first, second = list(found.importance)[:2]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (first, second)
    drawn = {line.get_label(): line.get_xydata() for line in ax.lines}
    best = osy.pareto()
    np.testing.assert_array_equal(
        drawn[f"Pareto optimal ({best.sum()})"],
        np.column_stack([osy.column(first), osy.column(second)])[best],
    )
    assert sum(map(len, drawn.values())) == len(osy)
    (box,) = box_of(ax)
    rule = found.rules[0]
    assert box.get_x() + box.get_width() == pytest.approx(rule.box[first][1])
    assert box.get_y() + box.get_height() == pytest.approx(rule.box[second][1])
    assert ax.figure.caption.startswith("OSY. ")
    assert f" {rule}. " in ax.figure.caption
    assert_whole(ax.figure)


def test_options_and_whole_numbers_have_places(mixed):
    whole = TestTable.of(
        mixed.numbers,
        mixed.X,
        mixed.F,
        (mixed.column("count").astype(float) - 4.5)[:, None],
        layout=mixed.layout,
    )
    (ax,) = plot_feasibility(whole).axes
    (box,) = box_of(ax)
    assert ax.get_xlabel() == "count"
    assert box.get_x() + box.get_width() == 4.5  # whole numbers up to 4 are inside
    assert_whole(ax.figure)
    metal = np.array([name == "tin" for name in mixed.column("metal").tolist()])
    table = TestTable.of(
        mixed.numbers, mixed.X, mixed.F, np.where(metal, -1.0, 1.0)[:, None], layout=mixed.layout
    )
    (ax,) = plot_feasibility(table).axes
    assert ax.get_xlabel() == "metal"
    assert [text.get_text() for text in ax.get_xticklabels()] == ["brass", "steel", "tin"]
    (box,) = box_of(ax)
    assert (box.get_x(), box.get_width()) == (1.5, 1.0)
    assert_whole(ax.figure)


def test_curves_are_the_columns_of_the_convergence(chute):
    found = convergence(chute)
    figure = plot_convergence(found, title="Chute")
    for ax, values in zip(figure.axes, (found.mu1, found.hypervolume), strict=True):
        (line,) = ax.lines
        np.testing.assert_array_equal(line.get_xydata(), np.column_stack([found.tests, values]))
    assert figure.caption == f"Chute. {found.verdict()}"
    assert_whole(figure)
