"""A ranked set as parallel coordinates."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import LineCollection
from matplotlib.text import Text

from pymoo_psi import TestTable, explain, rank_of_efficiency
from pymoo_psi._numbers import number
from pymoo_psi.files import read_table
from pymoo_psi.plots import plot_objectives, plot_ranking, plot_table, save_figures
from tests.helpers.drawn import assert_readable, assert_whole, plane, shown, texts
from tests.helpers.draws import rarely
from tests.helpers.refusals import refused


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


def lines_of(figure):
    (ax,) = figure.axes
    groups = [c for c in ax.collections if isinstance(c, LineCollection)]
    return [line for group in groups for line in group.get_segments()], ax


def rows_of(figure):
    """The texts of each row, and above all of them."""
    lines, ax = lines_of(figure)
    names = [text.get_text() for text in ax.texts if text.get_ha() != "center"]  # not "better"
    return [names[4 * k : 4 * k + 4] for k in range(1 + len(lines[0]))]


@pytest.mark.parametrize("width", [90, *rarely(180)])
@pytest.mark.parametrize(("n", "last"), [(8, 3), (9, 9), (40, 10)])
def test_few_lines_have_names_and_the_first_are_darker(n, last, width):
    x = np.linspace(0, 1, n)
    ranking = rank_of_efficiency(pd.DataFrame({"a": x, "b": (1 - x) ** 2.3}))
    figure = plot_ranking(ranking, width=width)
    assert_readable(figure)
    (ax,) = figure.axes
    if n > 8 and width == 90:
        last = 3
    near, *_ = [c for c in ax.collections if isinstance(c, LineCollection)]
    assert len(near.get_segments()) == last
    names = {f"{ranking.place[k]}. {ranking.name_of(k)}" for k in range(n)}
    named = {text.get_text() for text in ax.texts if text.get_visible()} & names
    assert len(named) == (n if n <= 8 else 3)


@pytest.mark.parametrize(
    ("n", "key"),
    [
        (21, ["proposed", "places 2 to 10", "10 more not dominated"]),
        (9, []),
        (5, ["proposed", "place 2", "2 more not dominated"]),
    ],
)
def test_the_key_tells_places_and_not_how_many_designs_have_them(n, key):
    x = np.linspace(0, 1, n)
    figure = plot_ranking(np.column_stack([x, 1 - x]))
    assert [text.get_text() for legend in figure.legends for text in legend.get_texts()] == key


def test_a_great_many_lines_are_drawn_as_their_density():
    x = np.linspace(0, 1, 1001)  # all lines cross half way between the two rows
    figure = plot_ranking(np.column_stack([x, 1 - x]))
    lines, ax = lines_of(figure)
    assert len(lines) == 11  # two are of place 10
    (image,) = ax.images
    density = image.get_array()
    densest = np.argwhere(density == density.max())
    np.testing.assert_allclose(densest.mean(axis=0) + 0.5, np.array(density.shape) / 2, atol=1)
    assert "990 more not dominated, as a density" in texts(figure)
    lines, ax = lines_of(plot_ranking(np.ones((1001, 2))))  # all are of the first place
    assert (len(lines), len(ax.images)) == (1001, 0)


def test_lines_go_from_worst_to_best_values(ranking, page):
    lines, ax = lines_of(page)
    drawn = np.array([line[:, 0] for line in lines])
    assert len(drawn) == ranking.pareto.sum()
    # the ends of the range are reached, and the optimum's line is what its values say
    np.testing.assert_allclose([drawn.min(axis=0), drawn.max(axis=0)], [[0] * 3, [1] * 3])
    best = ranking.objectives.values[ranking.salukvadze[0]]
    place = (best - ranking.nadir) / (ranking.ideal - ranking.nadir)
    np.testing.assert_allclose(lines[-1][:, 0], place)
    (proposed,) = (line for line in ax.lines if line.get_linewidth() == 2)
    np.testing.assert_allclose(proposed.get_xdata(), place)
    head, *rows = rows_of(page)
    assert head == ["", "worst", "best", "proposed"]
    for j, (name, *values) in enumerate(rows):
        assert name == ["c0 [kg]", "c1", "c2"][j]
        for text, value in zip(values, (ranking.nadir[j], ranking.ideal[j], best[j]), strict=True):
            decimals = len(text.partition(".")[2])
            assert abs(float(text) - value) <= 0.5000001 * 10.0**-decimals


def test_a_figure_by_fixed_ranges_says_so():
    table = read_table(pd.DataFrame({"cost": [1.0, 2.0], "mass": [2.0, 1.0]}))
    figure = plot_ranking(table.under(ranges={"cost": (0.5, 4), "mass": (0, 4.25)}).ranking())
    assert "in the fixed range" in figure.caption
    assert rows_of(figure)[1:] == [["cost", "4.0", "0.5", "2.0"], ["mass", "4.25", "0.00", "1.00"]]
    frame = pd.DataFrame(np.random.default_rng(11).random((40, 2)), columns=["cost", "mass"])
    worse = plot_ranking(read_table(frame).under(ranges={"cost": (0, 0.05), "mass": (0, 0.1)}))
    assert_readable(worse)  # lines begin on the left of the worst values


def test_values_over_decades_have_a_logarithmic_axis():
    frame = pd.DataFrame({"life": [1e2, 1e4, 1e6], "cost": [1.0, 2.0, 3.0]})
    figure = plot_ranking(rank_of_efficiency(frame, maximize=["life"]))
    assert [row[0] for row in rows_of(figure)[1:]] == ["life, log", "cost"]
    assert rows_of(figure)[1][1:] == ["100", "1\u00a0000\u00a0000", "100"]
    assert "not by their logarithms" in figure.caption
    lines, _ = lines_of(figure)
    assert sorted(line[0, 0] for line in lines) == pytest.approx([0, 0.5, 1])
    axes = shown(plot_objectives(read_table(frame)))[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "linear")
    assert axes.get_xlabel() == "life, log, less is better"
    axes = shown(plot_table(read_table(frame)))[0]
    assert (axes.get_xscale(), axes.get_xlabel()) == ("log", "life, log")
    np.testing.assert_allclose(axes.patches[0].get_data().edges, np.geomspace(1e2, 1e6, 11))
    even = np.append(1e-5, np.linspace(0.01, 1, 100))  # over decades, but evenly
    table = read_table(pd.DataFrame({"a": even, "b": 1 - even}))
    assert rows_of(plot_ranking(table))[1][:3] == ["a", "1.000", "0.000"]
    assert shown(plot_objectives(table))[0].get_xscale() == "linear"
    far = np.append(np.geomspace(1, 50, 96), [5000] * 4)  # outliers of a plane, not of a histogram
    frame = pd.DataFrame({"a": far, "b": 1 / far})
    top, plane = shown(plot_table(frame, variables=["a"], objectives=["b"]))
    assert [top.get_xlabel(), top.get_xscale(), plane.get_xscale()] == ["a, log", "log", "linear"]


def test_the_figure_of_what_has_no_variables_has_a_column_for_each_objective():
    assert [ax.get_xlabel() for ax in plot_table(np.eye(2)).axes] == ["f1", "f2"]


def test_one_far_value_flattens_no_axis():
    costs = [1200, 1350, 2100, 2250, 1800, 1500, 1290, 1990, 45000]
    frame = pd.DataFrame({"cost": costs, "mass": [9, 8, 4, 3, 5, 7, 8.5, 4.5, 2]})
    assert rows_of(plot_ranking(rank_of_efficiency(frame)))[1][1] == number(45000)  # as ranked
    table = TestTable.of(range(1, 10), np.ones((9, 1)), frame.to_numpy(float))
    assert 2250 < shown(plot_objectives(table))[0].get_xlim()[1] < 5000
    assert shown(plot_objectives(table, design=9))[0].get_xlim()[1] > 45000


@pytest.mark.parametrize("m", [1, 8, *rarely(2, 40)])
def test_any_number_of_objectives_has_a_whole_page(m):
    """A design that is marked has its name, as the optimum has."""
    ranking = ranked(m)
    figure = plot_ranking(ranking, row=3)
    for row in (3, ranking.salukvadze[0]):
        name = f"{ranking.place[row]}. {ranking.name_of(row)}"
        if not ranking.pareto[row]:
            name = f"{ranking.name_of(row)}, dominated"
        assert name in texts(figure)
    assert_whole(figure, draw=True)
    assert_readable(figure)


def test_a_row_is_that_of_the_table():
    table = TestTable.of([1, 2, 3, 4], np.zeros((4, 0)), [[9, 9], [0, 3], [1, 1], [3, 0]])
    table = table.under(limits={"f1": 8})
    assert "2. test 2" in texts(plot_ranking(table, row=1))
    dominated = plot_ranking(table.under(limits={}), row=0)  # and far worse than the others
    assert "test 1, dominated" in texts(dominated)
    lines = [line.get_xdata() for line in dominated.axes[0].lines if len(line.get_xdata())]
    assert min(map(min, lines)) == dominated.axes[0].get_xlim()[0] == -0.5  # others have room
    assert dominated.caption.endswith("An arrow marks a value worse than its axis shows.")
    single = plot_ranking([[1, 1], [2, 1]], row=1)  # one optimal design, and so no range
    assert single.axes[0].lines[2].get_xdata().tolist() == [-0.5, 1]
    refused("a feasible design", plot_ranking, table, row=0)
    refused("from 0 to 3", plot_ranking, table, row=4)


def test_a_row_that_repeats_a_design_is_that_of_its_first_test():
    """The design is ranked once, by its first feasible test."""
    table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.1]], [[0, 4], [1, 1], [0, 4]])
    assert texts(plot_ranking(table, row=2)) == texts(plot_ranking(table, row=0))
    assert str(explain(table, design=3)) == str(explain(table, design=1))


@pytest.mark.parametrize("width", [90, *rarely(180)])
@pytest.mark.parametrize("n", [5, *rarely(1, 400)])
def test_names_are_beside_points_and_none_is_over_another(width, n, tmp_path):
    random = np.random.default_rng(n)
    F = random.random((n, 3))
    labels = [f"a long name, number {k}" for k in range(n)]
    table = read_table(pd.DataFrame(F, labels, ["cost", "mass", "noise"]))
    figure = plot_objectives(table)
    for one in (figure, plot_ranking(table)):
        assert_readable(one)
    save_figures({"pairs": figure}, tmp_path, width=width, dpi=20)
    ranking = rank_of_efficiency(table)
    place = "1. " * (n <= 8)
    assert f"proposed: {place}{ranking.name_of(ranking.salukvadze[0])}" in texts(figure)
    if n <= 8:  # each has its place beside it in all panels, and its name below
        front = ranking.by_place[: ranking.pareto.sum()]
        assert {f"{ranking.place[k]}. {ranking.name_of(k)}" for k in front} <= {*texts(figure)}
        for ax in figure.axes:
            shown_texts = [name.get_text() for name in ax.texts if name.get_visible()]
            places = sorted(text.partition(".")[0] for text in shown_texts)
            assert places == [str(k + 1) for k in range(len(front))]


@pytest.mark.parametrize(("width", "n_names"), [(180, 7), (30, 0)])
def test_names_stand_beside_points_or_at_the_end_of_a_line_where_they_have_room(width, n_names):
    """Not all have room beside designs that are so near to each other."""
    x = np.array([0, 1, 1.04, 1.08, 1.12, 1.16, 2])
    frame = pd.DataFrame({"cost": x, "mass": 2 - x}, [15 * letter for letter in "abcdefg"])
    ax = plane(read_table(frame), width=width)
    assert_readable(ax.figure)  # it is drawn
    written = [text for text in ax.texts if text.get_visible()]
    assert sum("." in text.get_text() for text in written) == n_names
    assert len(written) == 7
    # Numbers are so short that they may all be beside their points.
    assert not n_names or any(text.arrow_patch.get_visible() for text in written)


def test_long_names_leave_room_for_short_ones_beside_their_points():
    """A line to one of these names would pass over the point of another."""
    x = np.array([1, 1.02, 1.04, 1.06, 2, 2.02, 2.04, 3])
    labels = [
        n * letter for n, letter in zip((26, 21, 26, 7, 26, 18, 23, 16), "abcdefgh", strict=True)
    ]
    ax = plane(read_table(pd.DataFrame({"cost": x, "mass": 4 - x}, labels)))
    assert_readable(ax.figure)  # it is drawn
    assert len(ax.texts) == 8
    assert all(name.get_visible() and not name.arrow_patch.get_visible() for name in ax.texts)


def test_names_are_not_on_the_front_or_a_limit():
    x = np.linspace(0, 1, 12)
    frame = pd.DataFrame(
        {"cost": x, "mass": (1 - x) ** 3}, [f"a name, number {k}" for k in range(12)]
    )
    ax = plane(read_table(frame).under(limits={"cost": 0.5}))
    assert_readable(ax.figure)
    lines = [line for line in ax.lines if line.get_linestyle() != "None"]
    paths = [line.get_transform().transform_path(line.get_path()) for line in lines]
    names = [name for name in ax.texts if name.get_visible()]
    assert len(paths) == 2 < len(names)
    for name in names:
        box = Text.get_window_extent(name)
        assert not any(path.intersects_bbox(box, filled=False) for path in paths), name
