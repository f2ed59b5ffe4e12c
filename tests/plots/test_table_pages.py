"""Whole pages of a test table: what stands where, and that all of it is readable."""

import subprocess
import sys

import matplotlib
import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf

from pymoo_psi import TestTable
from pymoo_psi.plots import (
    criteria_page,
    criteria_plane,
    draw_histogram,
    draw_plane,
    section_page,
    table_page,
    variable_plane,
)
from pymoo_psi.plots._designs import PARETO
from pymoo_psi.table import Layout, histogram
from tests.plots.drawn import LIMITS, render, texts


def inside(figure):
    """Draw the figure and check that no text leaves it."""
    renderer, page = render(figure), figure.bbox
    artists = [*figure.legends, *figure.texts]
    for ax in figure.axes:
        if ax.axison:
            artists += [ax.title, ax.xaxis.label, ax.yaxis.label]
    for artist in artists:
        box = artist.get_window_extent(renderer)
        assert page.x0 <= box.x0 <= box.x1 <= page.x1, artist
        assert page.y0 <= box.y0 <= box.y1 <= page.y1, artist


def shown(figure):
    return [ax for ax in figure.axes if ax.axison]


def test_the_page_of_a_table_is_a_matrix(osy):
    figure = table_page(osy, {"f1": -50}, title="OSY")
    assert len(shown(figure)) == 6 + 2 * 6
    assert [ax.get_xlabel() for ax in shown(figure)[-6:]] == [f"x{j}" for j in range(1, 7)]
    assert [ax.get_ylabel() for ax in shown(figure)[::6]] == ["% of each group", "f1", "f2"]
    legend = texts(figure)
    plane = variable_plane(osy, 0, 0, limits={"f1": -50})
    for name, members in plane.groups().items():
        assert f"{name} ({len(members)})" in legend
    assert {"tested (1024)", "limit f1 ≤ -50"} <= set(legend)
    assert figure.get_suptitle().startswith("OSY\n1024 designs tested, those far")
    assert round(figure.get_figwidth() * 25.4) == 180
    inside(figure)


def test_the_axes_of_a_column_and_of_a_row_agree(mixed):
    figure = table_page(mixed, {"f1": 5.0})
    grid = np.array(shown(figure)).reshape(3, 4)
    for j in (0, 2):  # a real variable and a boolean
        assert len({ax.get_xlim() for ax in grid[:, j]}) == 1
    for row in grid:
        assert len({ax.get_ylim() for ax in row}) == 1
    assert "prototype" in texts(figure)
    inside(figure)


@pytest.mark.parametrize(
    ("n_var", "n_obj", "axes"), [(6, 6, 42), (7, 2, 7), (2, 7, 2), (13, 2, 13), (1, 1, 2)]
)
def test_of_many_variables_or_criteria_there_are_the_histograms(n_var, n_obj, axes):
    values = np.random.default_rng(1).random((20, n_var + n_obj))
    table = TestTable.of(1 + np.arange(20), values[:, :n_var], values[:, n_var:])
    figure = table_page(table)
    assert len(shown(figure)) == axes
    if n_var == 13:
        inside(figure)


def test_a_choice_of_many_is_a_matrix():
    values = np.random.default_rng(2).random((20, 30))
    table = TestTable.of(1 + np.arange(20), values[:, :20], values[:, 20:])
    figure = table_page(table, variables=["x20", 0], criteria=[9])
    assert [ax.get_xlabel() for ax in shown(figure)[-2:]] == ["x20", "x1"]
    assert shown(figure)[2].get_ylabel() == "f10"
    assert len(shown(table_page(table, variables=["x20", 0], criteria=[]))) == 2


def test_each_pair_of_criteria_is_drawn_once(chute):
    figure = criteria_page(chute, LIMITS, title="Chute")
    assert len(shown(figure)) == 6
    assert [ax.get_xlabel() for ax in shown(figure)[3:]] == ["f1", "f2", "f3"]
    assert [ax.get_ylabel() for ax in (shown(figure)[i] for i in (0, 1, 3))] == ["f2", "f3", "f4"]
    assert {"limit f1 ≤ 2.2", "limit f4 ≤ 1", "prototype: old chute"} <= set(texts(figure))
    inside(figure)


def test_the_page_of_a_section_has_every_criterion(curves):
    figure = section_page(curves, title="Sphere")
    assert [ax.get_ylabel() for ax in shown(figure)] == ["f1", "f2"]
    assert figure.get_suptitle() == "Sphere\nsection through test point 2: 5 designs, 1 failed"
    inside(figure)


@pytest.mark.parametrize("n", [0, 1])
@pytest.mark.parametrize("feasible", [True, False])
def test_little_is_drawn_as_well(n, feasible):
    X, F = np.full((n, 2), 0.5), np.ones((n, 2))
    G = np.full((n, 1), -1.0 if feasible else 1.0)
    table = TestTable.of(1 + np.arange(n), X, F, G, layout=Layout.of(2, 2, 1))
    for page in (table_page(table), criteria_page(table, {0: 0.5})):
        inside(page)
    for ax in (draw_histogram(histogram(table, 0)), draw_plane(variable_plane(table, 0, 0))):
        render(ax.figure)
    assert f"{PARETO} ({n if feasible else 0})" in texts(ax)


def test_any_name_can_be_drawn():
    names = ["cost $ of $ all_{", "_hidden\nname", "w" * 200, "a%b^c\\d"]
    X = [[0.1, "$x^{$", 3, True], [0.2, "a long option that goes on", 4, False]]
    layout = Layout.of(names, ["$\\frac$", "_f" * 60])
    table = TestTable.of([1, 2], X, [[1.0, 2.0], [2.0, 1.0]], layout=layout)
    table = table.with_prototype([0.1, "$x^{$", 3, True], [1, 1], name="_$proto$_ type")
    inside(table_page(table, {0: 1.5}, title="Names"))
    inside(criteria_page(table, {0: 1.5}))
    for j in range(4):
        ax = draw_plane(variable_plane(table, 0, j, limits={0: 1.5}))
        render(ax.figure)
        render(draw_histogram(histogram(table, j)).figure)
    assert r"prototype: _\$proto\$_ type" in texts(ax)


def test_settings_and_windows_of_matplotlib_are_left_alone(chute, curves):
    before = dict(matplotlib.rcParams)
    for figure in (table_page(chute, LIMITS), criteria_page(chute), section_page(curves)):
        render(figure)
    for ax in (draw_plane(criteria_plane(chute, 0, 1)), draw_histogram(histogram(chute, 0))):
        render(ax.figure)
    assert dict(matplotlib.rcParams) == before
    assert Gcf.get_all_fig_managers() == []


def test_no_window_system_and_no_pyplot_is_needed():
    code = (
        "import sys; from pymoo_psi import TestTable; from pymoo_psi.plots import table_page;"
        "page = table_page(TestTable.of([1, 2], [[0.1], [0.2]], [[1.0], [2.0]]));"
        "page.savefig(sys.stdout.buffer, format='png'); sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.startswith(b"\x89PNG")
