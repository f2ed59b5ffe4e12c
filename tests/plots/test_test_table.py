"""Figures of a test table: what stands where, in the original units, and that it is readable."""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text

from pymoo_psi import TestTable
from pymoo_psi.algorithms import sections
from pymoo_psi.analysis import histogram
from pymoo_psi.files import read_table
from pymoo_psi.plots import (
    plot_objectives,
    plot_ranking,
    plot_sections,
    plot_table,
    save_figures,
)
from pymoo_psi.table import Schema
from tests.helpers.drawn import assert_readable, assert_whole, plane, shown, texts
from tests.helpers.draws import rarely
from tests.helpers.refusals import refused


def points(ax):
    """What is drawn in a plane, by the name of the group behind its number."""
    labels = [line for line in ax.lines if line.get_label()[0].isdigit()]
    groups = [line for line in labels if line.get_marker() not in "<>v^"]
    names = [line.get_label().partition(" ")[2].removeprefix("others ") for line in groups]
    return {name: line.get_xydata() for name, line in zip(names, groups, strict=True)}


def in_groups(table, limits):
    """The group of every test, one by one."""
    limited = table.under(limits=limits)
    groups = np.where(limited.feasible(), "dominated", "beyond the limits").astype(object)
    groups[limited.pareto()] = "not dominated"
    groups[table.status == "failed"] = ""
    return groups


def line_of(ax, label):
    """The points of the line with such a label."""
    (line,) = (line for line in ax.lines if line.get_label().startswith(label))
    return line.get_xydata()


# With wide ranges of the feasible, so that all tests are shown.
@pytest.mark.parametrize("limits", [None, {"f1": 2.9, "f4": 5.0}])
def test_every_test_is_in_its_group_in_every_plane(chute, limits):
    figure = plot_objectives(chute.under(limits=limits), objectives=["f1", "f2", "f3", "f4"])
    names = in_groups(chute, limits)
    others = chute.numbers != chute.under(limits=limits).best().numbers
    for ax, pair in zip(shown(figure), combinations(range(4), 2), strict=True):
        for name, xy in points(ax).items():
            if name in names:
                np.testing.assert_array_equal(xy, chute.F[others & (names == name)][:, pair])
    for name in {*names.tolist()}:
        n = (names == name).sum()
        assert f" {n} {name}" in figure.caption
        # The proposed one has its own mark.
        counted = f"{n - 1} others {name}" if name == "not dominated" else f"{n} {name}"
        assert not name or counted in texts(figure)  # in the key
    assert_whole(figure)


def test_a_chosen_design_is_marked(chute):
    ax = plane(chute, objectives=["f1", "f4"], design=7)
    np.testing.assert_array_equal(line_of(ax, "marked: test 7"), chute.F[[6]][:, [0, 3]])
    assert {"marked: test 7", "test 7"} <= {*texts(ax.figure)}
    beyond = chute.under(limits={"f1": chute.F[6, 0] - 0.1})  # it cannot be proposed
    assert "marked: test 7" in texts(plot_objectives(beyond, objectives=["f1", "f4"], design=7))


def test_repeated_tests_of_an_optimal_design_are_not_dominated():
    F = [[1, 3], [2, 2], [1, 3], [3, 3], [2, 2]]
    table = TestTable.of(range(1, 6), [[1], [2], [1], [3], [2]], F)
    assert "5 tests: 4 not dominated, 1 dominated." in plot_objectives(table).caption


def test_a_marked_design_hides_none_of_its_neighbours():
    frame = pd.DataFrame({"cost": [0.0, 5, 5.01, 10], "mass": [10, 5, 4.99, 0.0]})
    ax = plane(read_table(frame))
    (mark,) = (line for line in ax.lines if line.get_label().startswith("proposed"))
    (others,) = (line for line in ax.lines if line.get_label() == "3 others not dominated")
    assert mark.zorder < others.zorder
    assert not {*map(tuple, mark.get_xydata())} & {*map(tuple, others.get_xydata())}


def test_what_is_far_is_left_out_and_reported(osy):
    ax = plane(osy)
    low, high = np.transpose([ax.get_xlim(), ax.get_ylim()])
    inside = ((low <= osy.F) & (high >= osy.F)).all(axis=1)
    assert inside[osy.feasible()].all()
    assert (high - low < 3.5 * np.ptp(osy.F[osy.feasible()], axis=0)).all()
    assert 1 + sum(map(len, points(ax).values())) == inside.sum() < len(osy)
    assert f" {len(osy) - inside.sum()} designs outside the axes." in ax.figure.caption


def test_limits_are_shaded_or_named(chute):
    ax = plane(chute.under(limits={"f1": 2.2, "f4": (None, 60)}), objectives=["f1", "f4"])
    shade = ax.patches[0]
    assert (shade.get_x(), shade.get_x() + shade.get_width()) == (2.2, ax.get_xlim()[1])
    assert ax.get_ylim()[1] < 60
    end = "Limits, dashed where an axis shows them: f1<=2.2, f4<=60."
    assert ax.figure.caption.endswith(end)
    assert "limit 2.2" in texts(ax.figure)
    assert "limit 60" not in texts(ax.figure)


@pytest.mark.parametrize("limits", [(0.02, None), (0.15, None), (None, 0.85), (None, 1.05)])
def test_the_name_of_a_limit_hides_no_design_and_no_axis(limits):
    x = np.append(np.linspace(0, 1, 40), 0.5)
    table = read_table(pd.DataFrame({"f1": x, "f2": np.append(1 - x[:-1], 1.1)}))
    ax = plane(table.under(limits={"f2": limits}), width=90)
    assert_readable(ax.figure)
    (name,) = (text for text in ax.texts if text.get_text().startswith("limit "))
    assert name.get_bbox_patch() is None
    box = Text.get_window_extent(name)
    assert ax.bbox.y0 < box.y0
    assert box.y1 < ax.bbox.y1


def test_the_proposed_design_is_in_all_axes():
    x = np.linspace(0, 1, 30)
    ax = plane(read_table(pd.DataFrame({"f1": x, "f2": np.append(-50, 1 - x[1:])})))
    assert_readable(ax.figure)
    assert line_of(ax, "proposed: 1. row 1").tolist() == [[0, -50]]
    assert ax.get_ylim()[0] < -50
    assert "1. row 1" in [text.get_text() for text in ax.texts if text.get_visible()]


def test_the_key_has_the_marks_of_all_panels():
    x = np.linspace(0, 1, 30)
    table = TestTable.of(range(1, 31), x[:, None], np.column_stack([x, 1 - x]))
    assert "30 in all" in texts(plot_table(table, variables=["f1", "x1"]))
    F = np.where(x[:, None] < 0.5, table.F, np.nan)  # tests fail
    failing = TestTable.of(range(1, 31), x[:, None], F)
    assert "15 not failed" in texts(plot_table(failing))
    figure = plot_objectives(table, objectives=["x1", "f1", "f2"])
    assert texts(figure).count("best trade-offs of the two") == 1


def test_designs_outside_the_axes_are_arrows_at_their_edge():
    """No design vanishes, and none is hidden by the line of a limit."""
    frame = pd.DataFrame({"cost": [1.0, 2, 3, 3.3, 90], "mass": [5.0, 4, 2, 1, 3.5]})
    ax = plane(read_table(frame).under(limits={"cost": 3}))
    assert ax.get_xlim()[1] < 90
    F = [[50.0, 6], [2.0, 4], [3, 2], [3.3, 1], [1e9, 0.5]]  # the last one is beyond the edge
    stairs = line_of(plane(read_table(pd.DataFrame(F))), "best trade-offs")
    assert stairs[-1].tolist() == [1e9, 0.5]
    (arrow,) = (line for line in ax.lines if line.get_marker() == ">")
    np.testing.assert_array_equal(arrow.get_xydata(), [[ax.get_xlim()[1], 3.5]])
    assert sum(map(len, [*points(ax).values(), line_of(ax, "proposed")])) == 4
    assert {"2 beyond the limit", "1 design outside the axes"} < {
        *ax.get_legend_handles_labels()[1]
    }
    lines = [line for line in ax.lines if line.get_linestyle() == "--"]
    groups = [line for line in ax.lines if line.get_linestyle() == "None"]
    assert max(line.zorder for line in lines) < min(line.zorder for line in groups)


def test_the_front_of_two_objectives_is_a_staircase():
    """Every point of it is reached by a design that is as good in both objectives."""
    F = np.random.default_rng(3).random((30, 2))
    table = read_table(pd.DataFrame(F * [1, -1], columns=["cost", "gain"]))
    corners = line_of(plane(table.under(maximize=["gain"])), "best trade-offs") * [1, -1]
    assert (np.diff(corners, axis=0) == 0).any(axis=1).all()
    for point in corners:
        assert (point >= F).all(axis=1).any()
    F[7] = -0.1  # the best in both, and so the only corner
    frame = pd.DataFrame({"a": F[:, 0], "b": F[:, 1], "c": -F.sum(axis=1)})
    ax, *_ = shown(plot_objectives(read_table(frame), objectives=["a", "b", "c"]))
    a, b = F.max(axis=0)
    corners = [[-0.1, b], [-0.1, -0.1], [a, -0.1]]
    np.testing.assert_array_equal(line_of(ax, "best trade-offs"), corners)


def test_the_pairs_that_conflict_most_are_drawn():
    x, noise = np.linspace(0, 1, 20), np.random.default_rng(1).random(20)
    frame = pd.DataFrame({"a": x, "b": x**2, "c": 1 - x, "d": (1 - x) ** 3, "e": noise})
    axes = shown(plot_objectives(read_table(frame)))
    pairs = [(ax.get_xlabel()[0], ax.get_ylabel()[0]) for ax in axes]
    assert pairs == [("a", "c"), ("a", "d"), ("b", "c"), ("b", "d")]
    assert axes[0].figure.legends[0].get_title().get_text().startswith("4 of 10 pairs")
    assert len(shown(plot_objectives(read_table(frame), objectives=[*frame]))) == 10
    assert axes[0].format_coord(0.5, 0.5)  # a window says what is below its pointer


@pytest.mark.parametrize(
    "case",
    [
        (plot_objectives, 180),
        *rarely(
            (plot_ranking, 90),
            (plot_objectives, 90),
            (plot_ranking, 180),
            (plot_table, 90),
            (plot_table, 180),
        ),
    ],
)
def test_figures_have_the_width_that_is_asked_for(chute, case, tmp_path):
    plot, width = case
    figure = plot(chute, width=width)
    assert figure.get_figwidth() * 25.4 == pytest.approx(width)
    assert_readable(figure)
    save_figures({"same": figure}, tmp_path, width=width, dpi=20, suffix=".svg")
    assert figure.caption[:20] in (tmp_path / "same.txt").read_text()
    if plot is plot_objectives:
        assert len({round(ax.get_position().x0, 1) for ax in shown(figure)}) == width // 90
    refused("width must be 10 to 1000 mm", plot, chute, width=3.5)


def test_values_are_in_the_original_direction_and_units():
    schema = Schema.of(
        ["width"], ["mass", "gain"], outputs=["heat"], maximize=["gain"], units={"mass": "kg"},
        lower=[0], upper=[1],
    )  # fmt: skip
    table = TestTable.of(
        [1, 2, 3], [[0.1], [0.5], [0.9]], [[1, -3], [2, -4], [3, -1]],
        outputs={"heat": [5, 6, 7]}, schema=schema,
    )  # fmt: skip
    ax = plane(table)
    drawn = np.concatenate([*points(ax).values(), line_of(ax, "proposed")])
    assert sorted(map(tuple, drawn)) == [(1, 3), (2, 4), (3, 1)]
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        "mass [kg], less is better",
        "gain, more is better",
    )
    assert plane(table, objectives=["mass", "heat"]).get_ylabel() == "heat"


def test_the_figure_of_a_table_is_a_matrix(osy):
    table = osy.under(limits={"f1": -50})
    figure = plot_table(table, title="OSY")
    assert len(figure.axes) == 3 * 6
    assert [ax.get_xlabel() for ax in figure.axes[-6:]] == [f"x{j}" for j in range(1, 7)]
    assert [ax.get_ylabel() for ax in figure.axes[::6]] == [
        "share [%]",
        "f1, less is better",
        "f2, less is better",
    ]
    assert figure.caption.startswith("OSY. ")
    key = [text.get_text() for text in figure.legends[0].get_texts()]
    assert len({*key}) == len(key)
    for column in zip(*(figure.axes[k : k + 6] for k in (0, 6, 12)), strict=True):
        assert len({ax.get_xlim() for ax in column}) == 1
    found = histogram(table, "x1")
    stairs = [patch.get_data() for patch in figure.axes[0].patches]
    for drawn, counts in zip(stairs, (found.tested, found.feasible, found.pareto), strict=True):
        np.testing.assert_allclose(drawn.values, 100 * counts / counts.sum())
        np.testing.assert_array_equal(drawn.edges, found.edges)
    assert_whole(figure)


def test_one_outlier_flattens_no_histogram():
    random = np.random.default_rng(0)
    heat = random.random(200)
    heat[7] = 1e6
    X, F = random.random((200, 1)), random.random((200, 2))
    table = TestTable.of(range(1, 201), X, F, outputs={"heat": heat})
    figure = plot_table(table, variables=["x1", "heat"], objectives=())
    assert [ax.get_xlabel() for ax in shown(figure)] == ["x1", "heat"]
    heights = figure.axes[1].patches[0].get_data().values
    assert figure.axes[1].get_xlim()[1] < 1.1
    assert heights.max() < 25
    assert heights.sum() == pytest.approx(99.5)
    assert figure.caption.endswith(" Outside the histograms: 1 value of heat.")


def test_options_and_whole_numbers_have_places_of_their_own(mixed):
    figure = plot_table(mixed)
    length, count, hollow, metal = figure.axes[-4:]
    names = [[t.get_text() for t in ax.get_xticklabels()] for ax in (hollow, metal)]
    assert names == [["False", "True"], ["brass", "steel", "tin"]]
    assert count.get_xlim() == (2.5, 7.5)
    x = {ax: np.concatenate([*points(ax).values()])[:, 0] for ax in (length, count, metal)}
    for ax, name in ((count, "count"), (length, "length")):
        np.testing.assert_array_equal(np.sort(x[ax]), np.sort(mixed[name].astype(float)))
    assert len({*x[metal]}) == len(x[metal])  # tests of one option stand side by side
    assert_whole(figure)
    lines = plot_sections(sections(mixed, columns=["f1"])).axes[-2:]
    assert names == [[text.get_text() for text in ax.get_xticklabels()] for ax in lines]


@pytest.mark.parametrize("ends", [(3.0, 4.0), (2.0, 8.0), (2.0, 30.0), (1.0, 1e6)])
def test_logarithmic_axes_of_any_length_have_ticks(ends):
    x = np.geomspace(*ends, 9)
    schema = Schema.of(1, 1, kinds=["log"], lower=ends[:1], upper=ends[1:])
    for ax in plot_table(TestTable.of(range(1, 10), x[:, None], x[:, None], schema=schema)).axes:
        low, high = ax.get_xlim()
        assert 2 <= sum(low <= tick <= high for tick in ax.get_xticks()) <= 8


@pytest.mark.parametrize("n", [0, 1])
@pytest.mark.parametrize("plot", [plot_table, plot_objectives])
def test_little_is_drawn_as_well(n, plot):
    X = np.ones((n, 2))
    table = TestTable.of(range(1, n + 1), X, X, schema=Schema.of(2, 2))
    figure = plot(table)
    assert_whole(figure)
    assert "best trade-offs of the two" not in texts(figure)  # a point has no line


def test_any_name_can_be_drawn():
    names = ["$x\n 1$", "_under", "a very long name of a variable that goes on and on and on"]
    values = np.random.default_rng(1).random((5, 5))
    table = TestTable.of(
        range(1, 6), values[:, :3], values[:, 3:], schema=Schema.of(names, ["$f$", "_g"])
    )
    figure = plot_table(table.under(limits={"_g": 0.5}))
    assert r"\$x 1\$" in [ax.get_xlabel() for ax in figure.axes]
    assert_whole(figure, draw=True)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda t: plot_table(t, variables=["x9"]), "variables must be one of .*'x9'"),
        (lambda t: plot_objectives(t, objectives=["f1", "test"]), "objectives must be one of"),
        (lambda t: plot_objectives(t, objectives=["f1"]), "objectives must be from 2 to 7"),
        (lambda t: plot_objectives(t, design=0), "design must be the name of one design .*, got 0"),
    ],
)
def test_what_cannot_be_drawn_is_refused(chute, call, message):
    refused(message, call, chute)
