"""The figures of a test table: their data as numbers, and what their axes say and hold."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from pymoo_psi import PsiError, TestTable
from pymoo_psi.plots import (
    criteria_page,
    criteria_plane,
    dependence_plane,
    draw_histogram,
    draw_plane,
    draw_section,
    section,
    section_page,
    table_page,
    variable_plane,
)
from pymoo_psi.plots._designs import BEYOND, FEASIBLE, GROUPS, INFEASIBLE, PARETO, literal, view
from pymoo_psi.plots._histogram import shares
from pymoo_psi.table import dependence, histogram, section_points
from tests.plots.drawn import LIMITS, render, texts


def labelled(ax, start):
    (line,) = (line for line in ax.lines if line.get_label().startswith(start))
    return line


def by_status(table, limits=None):
    """The groups, told slowly."""
    ok, pareto = table.feasible(limits), table.pareto(limits)
    for status, feasible, best in zip(table.status, ok, pareto, strict=True):
        if status == "failed":
            continue
        if status == "infeasible":
            yield INFEASIBLE
        else:
            yield PARETO if best else FEASIBLE if feasible else BEYOND


# What all have in common


def test_groups_differ_in_shape_and_neighbours_in_lightness():
    assert len({marker.shape for marker in GROUPS.values()}) == len(GROUPS)
    light = {
        name: np.dot(to_rgb(marker.colour), [0.299, 0.587, 0.114])
        for name, marker in GROUPS.items()
    }
    assert light[INFEASIBLE] - light[FEASIBLE] > 0.2
    assert light[PARETO] - light[FEASIBLE] > 0.2


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("f1", "f1"),
        ("a\n b", "a b"),
        ("$x$", r"\$x\$"),
        (0.1 + 0.2, "0.3"),
        ("w" * 50, "w" * 39 + "…"),
    ],
)
def test_names_are_literal(name, text):
    assert literal(name) == text


@pytest.mark.parametrize(
    ("values", "ends"),
    [
        ([], (0, 1)),
        ([0], (-0.5, 0.5)),
        ([4], (3.8, 4.2)),
        ([-2, 0], (-2.1, 0.1)),
        ([np.inf], (0, 1)),
    ],
)
def test_the_view_holds_the_values(values, ends):
    np.testing.assert_allclose(view(np.array(values, dtype=float)), ends)


# Histograms


def test_bars_are_shares_of_each_group(osy):
    counts = histogram(osy, "x1", bins=8)
    ax = draw_histogram(counts)
    tested, feasible, pareto = (
        np.array([bar.get_height() for bar in bars]) for bars in ax.containers
    )
    np.testing.assert_allclose(tested, counts.tested / 1024 * 100)
    np.testing.assert_allclose(feasible, counts.feasible / osy.feasible().sum() * 100)
    np.testing.assert_allclose(pareto, counts.pareto / osy.pareto().sum() * 100)
    for bars in ax.containers:  # inside their bins
        for bar, low, high in zip(bars, counts.edges[:-1], counts.edges[1:], strict=True):
            assert low - 1e-9 <= bar.get_x() <= bar.get_x() + bar.get_width() <= high + 1e-9
    assert texts(ax) == [
        "tested (1024)",
        f"feasible ({osy.feasible().sum()})",
        f"Pareto optimal ({osy.pareto().sum()})",
    ]
    written = [int(text.get_text()) for text in ax.texts]
    assert sum(written) == osy.feasible().sum() + osy.pareto().sum()
    assert min(written) > 0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x1", "% of each group")
    render(ax.figure)


def test_shares_of_nothing_are_nothing():
    assert shares(np.zeros(3, dtype=np.int64)).tolist() == [0, 0, 0]


def test_numbers_are_written_where_there_is_room(osy):
    assert draw_histogram(histogram(osy, "x1", bins=12)).texts
    assert not draw_histogram(histogram(osy, "x1", bins=13)).texts
    assert not draw_histogram(histogram(osy, "x1"), numbers=False).texts


@pytest.mark.parametrize(
    ("variable", "names"),
    [("count", list("34567")), ("hollow", ["False", "True"]), ("metal", ["brass", "steel", "tin"])],
)
def test_single_values_are_named(mixed, variable, names):
    ax = draw_histogram(histogram(mixed, variable))
    assert [label.get_text() for label in ax.get_xticklabels()] == names
    render(ax.figure)


def test_of_many_values_some_are_named():
    X = np.arange(100)[:, None]
    ax = draw_histogram(histogram(TestTable.of(1 + X[:, 0], X, X * 1.0), 0))
    names = [int(label.get_text()) for label in ax.get_xticklabels()]
    assert 6 <= len(names) <= 12
    assert names == list(ax.get_xticks())


# Planes


@pytest.mark.parametrize("limits", [None, LIMITS, {"f1": -1.0}])
def test_a_plane_holds_every_design_in_its_group(chute, limits):
    plane = variable_plane(chute, "f1", "x2", limits=limits)
    np.testing.assert_array_equal(plane.values, np.column_stack([chute.X[:, 1], chute.F[:, 0]]))
    assert plane.group.tolist() == list(by_status(chute, limits))
    assert plane.names == ("x2", "f1")
    assert plane.box == (0.1, 6.0)
    assert plane.limits == (np.inf, (limits or {}).get("f1", np.inf))
    np.testing.assert_array_equal(plane.prototype, [[0.9, 1.9]])


def test_criteria_are_taken_by_name_or_index(chute):
    plane, same = (criteria_plane(chute, *pair, limits=LIMITS) for pair in (("f4", "f1"), (3, 0)))
    np.testing.assert_array_equal(plane.values, chute.F[:, [3, 0]])
    np.testing.assert_array_equal(plane.values, same.values)
    assert plane.limits == (1.0, 2.2)
    assert plane.group.tolist() == list(by_status(chute, LIMITS))
    np.testing.assert_array_equal(plane.prototype, [[0.9, 1.9]])


def test_infeasible_designs_and_those_beyond_a_limit_are_told_apart(osy):
    plane = criteria_plane(osy, 0, 1, limits={"f1": -50})
    groups = {name: len(members) for name, members in plane.groups().items()}
    assert groups[INFEASIBLE] == np.sum(osy.status == "infeasible")
    assert groups[BEYOND] == np.sum((osy.status == "ok") & (osy.F[:, 0] > -50))
    assert groups[PARETO] == osy.pareto({"f1": -50}).sum()
    assert sum(groups.values()) == len(osy)


def test_a_dependence_is_a_plane_without_prototype(chute):
    plane = dependence_plane(dependence(chute, "f1", "x2", limits=LIMITS))
    whole = variable_plane(chute, "f1", "x2", limits=LIMITS)
    np.testing.assert_array_equal(plane.values, whole.values)
    assert set(plane.group) == {INFEASIBLE, FEASIBLE, PARETO}
    assert (plane.group == PARETO).tolist() == (whole.group == PARETO).tolist()
    assert len(plane.prototype) == 0
    render(draw_plane(plane).figure)


def test_failed_designs_are_counted_and_not_drawn():
    F = [[1.0, 2.0], [np.nan, 1.0], [2.0, np.inf], [2.0, 1.0], [1e308, -1e308]]
    table = TestTable.of([1, 2, 3, 4, 5], np.arange(5.0)[:, None], F)
    for plane in (criteria_plane(table, 0, 1), variable_plane(table, 0, 0)):
        assert plane.numbers.tolist() == [1, 4]
        assert plane.not_drawn == 3
        ax = draw_plane(plane)
        assert ax.get_title() == "5 designs tested, 3 not drawn"
        render(ax.figure)


def test_options_have_seats_and_the_prototype_one_too(mixed):
    plane = variable_plane(mixed, "f1", "metal")
    assert plane.options == ("brass", "gold", "steel", "tin")
    assert [plane.options[int(x)] for x in plane.values[:, 0]] == mixed.X[:, 3].tolist()
    assert plane.prototype.tolist() == [[1.0, 3.0]]
    ax = draw_plane(plane)
    assert [label.get_text() for label in ax.get_xticklabels()] == list(plane.options)
    assert ax.get_xlim() == (-0.5, 3.5)


@pytest.mark.parametrize(
    ("variable", "spread"), [("length", False), ("count", True), ("hollow", True)]
)
def test_single_values_are_spread_about_their_place(mixed, variable, spread):
    plane = variable_plane(mixed, "f2", variable)
    shift = plane.spread() - plane.values
    assert (shift[:, 1] == 0).all()
    assert np.abs(shift[:, 0]).max() <= 0.3
    assert shift[:, 0].any() == spread
    np.testing.assert_array_equal(plane.spread(), plane.spread())
    ax = draw_plane(plane)
    assert ax.get_xlabel() == variable + (" (points spread sideways)" if spread else "")


def test_nearby_keeps_the_feasible_and_what_is_around_them(osy):
    whole = criteria_plane(osy, 0, 1)
    near = whole.nearby(0.5)
    ok = osy.feasible()
    low, high = osy.F[ok].min(axis=0), osy.F[ok].max(axis=0)
    pad = 0.5 * (high - low)
    inside = (np.maximum(low - pad - osy.F, osy.F - high - pad) <= 0).all(axis=1)
    assert near.numbers.tolist() == osy.numbers[inside].tolist()
    assert near.not_drawn == np.sum(~inside) > 0
    assert len(whole.nearby(np.inf).values) == len(osy)
    assert len(near.groups()[PARETO]) == osy.pareto().sum()
    over_variable = variable_plane(osy, 0, 0).nearby(0.0)
    assert over_variable.values[:, 1].min() == low[0]


def test_nearby_keeps_all_where_nothing_is_feasible(osy):
    plane = criteria_plane(osy, 0, 1, limits={"f1": -1e9})
    assert len(plane.nearby(0).values) == len(osy)
    with pytest.raises(PsiError, match="margin must be 0 or more, got -1"):
        plane.nearby(-1)


def test_a_plane_is_drawn_group_by_group_the_rarer_on_top(chute):
    plane = criteria_plane(chute, "f1", "f4", limits=LIMITS)
    ax = draw_plane(plane, title="The chute")
    counts = {name: len(members) for name, members in plane.groups().items()}
    assert texts(ax) == [
        *(f"{name} ({count})" for name, count in counts.items()),
        "prototype: old chute", "limit f1 ≤ 2.2", "limit f4 ≤ 1",
    ]  # fmt: skip
    lines = {name: labelled(ax, f"{name} (") for name in counts}
    for name, line in lines.items():
        np.testing.assert_array_equal(line.get_xydata(), plane.values[plane.group == name])
    levels = [lines[name].get_zorder() for name in sorted(counts, key=counts.get, reverse=True)]
    assert levels == sorted(levels)
    star = labelled(ax, "prototype")
    assert star.get_zorder() > max(levels)
    np.testing.assert_array_equal(star.get_xydata(), [[1.9, 0.9]])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("f1", "f4")
    assert ax.get_title() == "The chute\n512 designs tested"
    render(ax.figure)


def test_markers_shrink_as_a_group_grows():
    def size(n):
        F = np.column_stack([np.arange(n), -np.arange(n)]) * 1.0
        table = TestTable.of(1 + np.arange(n), F[:, :1], F)
        return labelled(draw_plane(criteria_plane(table, 0, 1)), PARETO).get_markersize()

    assert size(10) == size(200) > size(1000) > size(5000) > 1.5


def test_what_is_beyond_the_limits_is_shaded(chute):
    ax = draw_plane(criteria_plane(chute, "f1", "f4", limits=LIMITS))
    right, top = (patch.get_extents().transformed(ax.transData.inverted()) for patch in ax.patches)
    np.testing.assert_allclose([right.x0, right.x1], [2.2, ax.get_xlim()[1]])
    np.testing.assert_allclose([top.y0, top.y1], [1.0, ax.get_ylim()[1]])
    assert set(labelled(ax, "limit f1").get_xdata()) == {2.2}
    assert set(labelled(ax, "limit f4").get_ydata()) == {1.0}
    styles = {labelled(ax, f"limit {name}").get_linestyle() for name in LIMITS}
    assert len(styles) == 2


def test_a_limit_near_the_designs_widens_the_view_and_one_far_off_is_told(chute):
    near = draw_plane(variable_plane(chute, "f4", "x1", limits={"f4": 7.0}))
    assert near.get_ylim()[1] > 7
    far = draw_plane(variable_plane(chute, "f4", "x1", limits={"f4": 700.0}))
    assert far.get_ylim()[1] < 7
    assert texts(far)[-1] == "limit f4 ≤ 700, outside the axes"
    assert not far.patches
    none = draw_plane(variable_plane(chute, "f4", "x1", limits={"f4": np.inf}))
    assert not any("limit" in text for text in texts(none))


def test_drawing_uses_the_axes_it_is_given(chute):
    ax = Figure().add_subplot()
    assert draw_plane(criteria_plane(chute, 0, 1), ax=ax, legend=False) is ax
    assert ax.get_legend() is None
    with pytest.raises(PsiError, match="legend must be True or False"):
        draw_plane(criteria_plane(chute, 0, 1), legend="no")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda t: variable_plane(t, "f9", "x1"), "criterion must be one of .*got 'f9'"),
        (lambda t: variable_plane(t, "f1", "x9"), "variable must be one of .*got 'x9'"),
        (lambda t: criteria_plane(t, 0, 7), "criterion must be .* from 0 to 3, got 7"),
        (lambda t: criteria_plane(t, 0, 1, limits={"f1": np.nan}), "limit on 'f1' must be a number"),
        (lambda t: table_page(t, variables=[]), "variables must be one or more, got none"),
        (lambda t: table_page(t, margin=-1.0), "margin must be 0 or more"),
        (lambda t: criteria_page(t, criteria=["f1"]), "criteria must be from 2 to 7 to draw in pairs, got 1"),
    ],
)  # fmt: skip
def test_what_is_not_there_is_named(chute, call, message):
    with pytest.raises(PsiError, match=message):
        call(chute)


@pytest.mark.parametrize("table", [np.zeros((3, 2)), None, "table.csv"])
@pytest.mark.parametrize(
    "call",
    [
        table_page,
        criteria_page,
        lambda t: variable_plane(t, 0, 0),
        lambda t: criteria_plane(t, 0, 1),
        lambda t: section(t, 1, 0, [[0.1]], [[1.0]]),
    ],
)
def test_what_is_no_table_is_refused(table, call):
    with pytest.raises(
        PsiError,
        match=f"table must be a TestTable, got {'None' if table is None else type(table).__name__}; PSI and investigate give one",
    ) as info:
        call(table)
    assert isinstance(info.value, TypeError)


def test_what_is_no_section_or_dependence_is_refused(chute):
    with pytest.raises(
        PsiError, match=r"curves must be a Section, got TestTable; section\(...\) makes one"
    ):
        section_page(chute)
    with pytest.raises(
        PsiError, match="dependence must be a Dependence, got Histogram; take that of a TestTable"
    ):
        dependence_plane(histogram(chute, 0))


# Sections


def test_a_section_is_in_order_and_judged(curves):
    assert curves.x.tolist() == [0, 0.25, 0.5, 0.75, 1]
    np.testing.assert_allclose(curves.F[1:, 0], curves.x[1:] ** 2 + 0.75**2)
    assert curves.feasible.tolist() == [False, False, True, True, True]
    assert (curves.variable, curves.design, curves.at) == ("x1", 2, 0.25)
    assert curves.limits.tolist() == [np.inf, 0.35]
    assert curves.runs(0) == [slice(1, 5)]


def test_a_section_shows_the_feasible_part_the_design_and_the_limit(curves):
    ax = draw_section(curves, "f2", title="Sphere")
    assert texts(ax) == [
        "not feasible (1)",
        "feasible (3)",
        "test point 2: x1 = 0.25",
        "limit f2 ≤ 0.35",
    ]
    feasible = labelled(ax, "feasible")
    assert np.isfinite(feasible.get_ydata()).tolist() == curves.feasible.tolist()
    assert set(labelled(ax, "test point 2").get_xdata()) == {0.25}
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x1", "f2")
    assert ax.get_title() == "Sphere\nsection through test point 2: 5 designs, 1 failed"
    assert len(draw_section(curves, "f1").patches) == 0
    render(ax.figure)


def test_a_section_through_a_design_of_ones_own():
    table = TestTable.of([1], [[0.0, 0.5]], [[1.0]])
    X = section_points(table, [0.3, 0.1], "x2", 3, 0, 1)
    curves = section(table, [0.3, 0.1], "x2", X, X.sum(axis=1, keepdims=True))
    assert (curves.design, curves.at) == (0, 0.1)
    assert "the design: x2 = 0.1" in texts(draw_section(curves))


def test_a_section_of_the_count(mixed):
    X = section_points(mixed, 7, "count", 5)
    curves = section(mixed, 7, "count", X, np.ones((5, 2)), np.zeros((5, 1)))
    assert curves.x.tolist() == [3, 4, 5, 6, 7]
    assert curves.feasible.all()
    render(section_page(curves))


@pytest.mark.parametrize(
    ("design", "variable", "change", "message"),
    [
        (7, "length", "", "X must be the design's in every variable but 'length', got another 'count' in row 0"),
        (70, "count", "", "design must be a tested point's number, or a design, got 70"),
        (7, "metal", "", "variable must be a real number or an integer, got one that is a choice"),
        (7, "count", "short", "F must be of shape"),
    ],
)  # fmt: skip
def test_what_is_no_section_is_refused(mixed, design, variable, change, message):
    X = section_points(mixed, 7, "count", 5)
    F = np.ones((5, 1 if change else 2))
    with pytest.raises(PsiError, match=message):
        section(mixed, design, variable, X, F, np.zeros((5, 1)))
