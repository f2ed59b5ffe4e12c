"""Pictures of what tables tell: sensitivities, rules of feasibility, convergence."""

import numpy as np
import pytest

from pymoo_psi import PsiError, TestTable
from pymoo_psi.plots import plot_convergence, plot_feasibility, plot_sensitivities
from pymoo_psi.table import convergence, feasibility_rules, sensitivities
from tests.plots.drawn import assert_whole, shown


def test_bars_are_the_indices_and_lines_their_bands(osy):
    found = sensitivities(osy, ["f1", "f2", "g4", "g6"], n_resamples=5)
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


def test_of_many_variables_the_largest_are_shown_and_the_rest_told(osy):
    found = sensitivities(osy, ["f1", "g5"], n_resamples=5)
    figure = plot_sensitivities(found, top=3)
    kept = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert kept == ["x1", "x3", "x4"]
    assert "3 variables with smaller ones left out" in figure.get_suptitle()


def test_a_column_that_does_not_change_is_told(osy):
    found = sensitivities(osy, ["f1", "g5"], n_resamples=5)
    found.loc["g5"] = np.nan  # as of a constant column
    assert [ax.get_title() for ax in shown(plot_sensitivities(found))] == ["f1", "g5: constant"]


def box_of(ax):
    return [patch for patch in ax.patches if patch.get_label() == "best rule"]


def test_the_best_rule_is_drawn_round_the_feasible(osy):
    (ax,) = plot_feasibility(osy, title="OSY").axes
    found = feasibility_rules(osy)
    first, second = list(found.importance)[:2]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (first, second)
    drawn = {line.get_label(): line.get_xydata() for line in ax.lines}
    feasible = osy.feasible()
    np.testing.assert_array_equal(
        drawn[f"feasible ({feasible.sum()})"],
        np.column_stack([osy.column(first), osy.column(second)])[feasible],
    )
    assert len(drawn[f"not feasible ({(~feasible).sum()})"]) == (~feasible).sum()
    (box,) = box_of(ax)
    rule = found.rules[0]
    assert box.get_x() + box.get_width() == pytest.approx(rule.box[first][1])
    assert box.get_y() + box.get_height() == pytest.approx(rule.box[second][1])
    assert " ".join(ax.figure.get_suptitle().split()) == f"OSY {rule}"
    assert_whole(ax.figure)


def test_options_and_whole_numbers_have_places(mixed):
    limits = {"f1": 5.0}
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
    metal = np.array([name != "steel" for name in mixed.column("metal").tolist()])
    G = np.where(metal, -1.0, 1.0)[:, None]
    table = TestTable.of(mixed.numbers, mixed.X, mixed.F, G, layout=mixed.layout)
    (ax,) = plot_feasibility(table).axes
    # of brass, steel and tin the first and the last: a box each
    places = sorted((box.get_x(), box.get_width()) for box in ax.patches)
    assert places == [(-0.5, 1.0), (1.5, 1.0)]
    (ax,) = plot_feasibility(mixed, limits).axes
    assert_whole(ax.figure)


def test_curves_are_the_columns_of_the_convergence(chute):
    found = convergence(chute)
    figure = plot_convergence(found, title="Chute")
    for ax, values in zip(
        figure.axes, (found.mu1, found.hypervolume, found.covering_radius), strict=True
    ):
        (line,) = ax.lines
        np.testing.assert_array_equal(line.get_xydata(), np.column_stack([found.tests, values]))
    assert " ".join(figure.get_suptitle().split()) == f"Chute {found.verdict()}"
    assert_whole(figure)


def test_what_cannot_be_drawn_is_told(osy):
    with pytest.raises(PsiError, match=r"sensitivities must be what sensitivities\(table\) gives"):
        plot_sensitivities(osy)
    with pytest.raises(PsiError, match="convergence must be a Convergence, got TestTable"):
        plot_convergence(osy)
    one = TestTable.of([1, 2], [[0.0], [1.0]], [[1.0], [2.0]])
    with pytest.raises(PsiError, match="two variables or more, got 1"):
        plot_feasibility(one)
