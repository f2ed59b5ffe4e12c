"""Figures of sensitivities, feasibility, convergence, predictions and robustness."""

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import TestTable
from pymoo_psi.plots import (
    plot_convergence,
    plot_feasibility,
    plot_predictions,
    plot_robustness,
    plot_sensitivities,
)
from pymoo_psi.table import convergence, feasibility_rules, sensitivities
from tests.plots.drawn import assert_whole, shown, texts


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
    assert " ".join(figure.get_suptitle().split()) == f"Chute {found.verdict()}"
    assert_whole(figure)


@pytest.fixture
def frame():
    random = np.random.default_rng(0)
    columns = {"test_point": np.arange(21, 41), "round": np.repeat([1, 2], 10)}
    columns["surrogate"] = ["gaussian process"] * 10 + ["radial functions"] * 9 + [""]
    columns["status"] = ["ok"] * 19 + ["failed"]
    for name in ("f1", "f$2", "g1", "a very long name of an objective that goes on and on"):
        columns[name] = random.normal(size=20)
        columns[f"{name}_predicted"] = columns[name] + 0.1
        columns[f"{name}_deviation"] = 0.1
    return pd.DataFrame(columns)


def test_every_proposal_is_where_it_was_expected_and_found(frame):
    figure = plot_predictions(frame, title="Beams")
    panels = shown(figure)
    assert [ax.get_title() for ax in panels[:2]] == ["f1", r"f\$2"]
    assert len(panels) == 4
    drawn = np.vstack([dots.get_offsets() for dots in panels[0].collections])
    np.testing.assert_array_equal(drawn, frame[["f1_predicted", "f1"]][:19])
    assert texts(figure) == ["gaussian process", "radial functions"]
    assert figure.get_suptitle() == "Beams\n19 proposals in 2 rounds, the later the darker"
    assert_whole(figure, draw=True)


def test_values_that_no_axis_holds_are_left_out(frame):
    frame.loc[2:4, "f1"] = [np.nan, np.inf, -1.7e308]
    frame["f$2"], frame["g1_predicted"] = np.nan, 1.7e308
    figure = plot_predictions(frame)
    dots = np.vstack([dots.get_offsets() for dots in shown(figure)[0].collections])
    assert np.isfinite(dots).all(axis=1).sum() == 16
    assert_whole(figure, draw=True)


def test_the_page_shows_the_most_robust_designs_the_best_on_top(result):
    labels = [f"no. {i}" for i in range(40)]
    figure = plot_robustness(result, top=4, labels=labels, title="Forty chutes")
    best = result.order[:4]
    shares, regret = figure.axes
    for ax in (shares, regret):
        assert [text.get_text() for text in ax.get_yticklabels()] == [labels[i] for i in best]
        assert ax.get_ylim()[0] > ax.get_ylim()[1]
    assert "32 scenarios (%)" in shares.get_xlabel()
    widths = {bars.get_label(): [bar.get_width() for bar in bars] for bars in shares.containers}
    np.testing.assert_allclose(widths["Salukvadze optimum"], 100 * result.optimum_share[best])
    np.testing.assert_allclose(widths["rank 5 or 6"], 100 * result.efficient_share[best])
    np.testing.assert_allclose(widths["infeasible"], 100 * result.infeasible_share[best])
    drawn = {line.get_label(): line.get_xdata() for line in regret.lines}
    np.testing.assert_array_equal(drawn["mean"], result.mean_regret[best])
    np.testing.assert_array_equal(drawn["worst scenario"], result.worst_regret[best])
    title = figure.get_suptitle()
    assert title.startswith("Forty chutes\nuncertain: mu from 0.3")
    assert ", c from 0.2" in title
    assert_whole(figure, draw=True)
