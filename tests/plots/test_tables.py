"""The pictures of a test table: their data as numbers, what stands where, and that it is readable."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from pymoo_psi import PsiError, TestTable
from pymoo_psi.plots import criteria_page, draw_histogram, section_page, table_page
from pymoo_psi.plots._designs import (
    BEYOND,
    FEASIBLE,
    GROUPS,
    INFEASIBLE,
    PARETO,
    criteria_plane,
    design_groups,
    draw_plane,
    members_of,
    variable_plane,
)
from pymoo_psi.plots._section import section_of
from pymoo_psi.table import Layout, histogram, section_points
from tests.plots.drawn import assert_whole, shown, texts

LIMITS = {"f1": 2.2, "f4": 1.0}
OPEN = (-np.inf, np.inf)


def plane_of(table, pair, limits=None):
    """The plane of two criteria, as 11, or of a variable and a criterion, as "x0 1"."""
    group = design_groups(table, limits)
    criteria = table.layout.objectives
    if str(pair[0]).startswith("x"):
        return variable_plane(table, int(pair[0][1:]), criteria[pair[1]], limits, group)
    return criteria_plane(table, *(criteria[j] for j in pair), limits, group)


def drawn(plane):
    ax = Figure().add_subplot()
    draw_plane(ax, plane, 1)
    return ax


def labelled(ax, start):
    (line,) = (line for line in ax.lines if line.get_label().startswith(start))
    return line


def by_status(table, limits=None):
    """The groups, told slowly."""
    ok, pareto = table.feasible(limits), table.pareto(limits)
    for status, feasible, best in zip(table.status, ok, pareto, strict=True):
        if status == "infeasible":
            yield INFEASIBLE
        else:
            yield PARETO if best else FEASIBLE if feasible else BEYOND


def test_groups_differ_in_shape_and_neighbours_in_lightness():
    assert len({marker.shape for marker in GROUPS.values()}) == len(GROUPS)
    light = {
        name: np.dot(to_rgb(marker.colour), [0.299, 0.587, 0.114])
        for name, marker in GROUPS.items()
    }
    assert light[INFEASIBLE] - light[FEASIBLE] > 0.2
    assert light[PARETO] - light[FEASIBLE] > 0.2


# Histograms


def test_bars_are_shares_of_each_group(osy):
    counted = histogram(osy, "x1", bins=8)
    ax = draw_histogram(osy, "x1", bins=8)
    tested, feasible, pareto = (
        np.array([bar.get_height() for bar in bars]) for bars in ax.containers
    )
    np.testing.assert_allclose(tested, counted.tested / 1024 * 100)
    np.testing.assert_allclose(feasible, counted.feasible / osy.feasible().sum() * 100)
    np.testing.assert_allclose(pareto, counted.pareto / osy.pareto().sum() * 100)
    for bars in ax.containers:  # inside their bins
        for bar, low, high in zip(bars, counted.edges[:-1], counted.edges[1:], strict=True):
            assert low - 1e-9 <= bar.get_x() <= bar.get_x() + bar.get_width() <= high + 1e-9
    assert texts(ax) == [
        "tested (1024)",
        f"feasible ({osy.feasible().sum()})",
        f"Pareto optimal ({osy.pareto().sum()})",
    ]
    written = [int(text.get_text() or 0) for text in ax.texts]
    assert sum(written) == osy.feasible().sum() + osy.pareto().sum()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x1", "% of each group")
    assert_whole(ax.figure)


def test_bars_are_of_the_designs_within_the_limits(osy):
    limits = {"f1": -50}
    ax = draw_histogram(osy, "x1", limits)
    assert f"Pareto optimal ({osy.pareto(limits).sum()})" in texts(ax)


def test_a_group_without_designs_has_no_bars(osy):
    ax = draw_histogram(osy, "x1", {"f1": -1e9})
    assert [bar.get_height() for bars in ax.containers[1:] for bar in bars] == [0] * 20


def test_numbers_are_written_where_there_is_room(osy):
    assert draw_histogram(osy, "x1", bins=12).texts
    assert not draw_histogram(osy, "x1", bins=13).texts
    assert not draw_histogram(osy, "x1", numbers=False).texts


@pytest.mark.parametrize(
    ("variable", "names"),
    [("count", list("34567")), ("hollow", ["False", "True"]), ("metal", ["brass", "steel", "tin"])],
)
def test_single_values_are_named(mixed, variable, names):
    ax = draw_histogram(mixed, variable)
    assert [label.get_text() for label in ax.get_xticklabels()] == names


def test_of_many_values_some_are_named():
    X = np.arange(100)[:, None]
    ax = draw_histogram(TestTable.of(1 + X[:, 0], X, X * 1.0), 0)
    names = [int(label.get_text()) for label in ax.get_xticklabels()]
    assert 6 <= len(names) <= 12
    assert names == list(ax.get_xticks())


# Planes


@pytest.mark.parametrize("limits", [None, LIMITS, {"f1": -1.0}])
def test_a_plane_holds_every_design_in_its_group(chute, limits):
    plane = plane_of(chute, ("x1", 0), limits)
    np.testing.assert_array_equal(plane.values, np.column_stack([chute.X[:, 1], chute.F[:, 0]]))
    assert plane.group.tolist() == list(by_status(chute, limits))
    assert plane.names == ("x2", "f1")
    assert plane.box == (0.1, 6.0)
    assert plane.limits == (OPEN, (-np.inf, (limits or {}).get("f1", np.inf)))
    np.testing.assert_array_equal(plane.prototype, [[0.9, 1.9]])


def test_a_plane_of_criteria_holds_both(chute, osy):
    plane = plane_of(chute, (3, 0), LIMITS)
    np.testing.assert_array_equal(plane.values, chute.F[:, [3, 0]])
    assert plane.limits == ((-np.inf, 1.0), (-np.inf, 2.2))
    assert plane.group.tolist() == list(by_status(chute, LIMITS))
    np.testing.assert_array_equal(plane.prototype, [[0.9, 1.9]])
    limits = {"f1": -50}
    groups = {name: len(rows) for name, rows in members_of(design_groups(osy, limits)).items()}
    assert groups[INFEASIBLE] == np.sum(osy.status == "infeasible")
    assert groups[BEYOND] == np.sum((osy.status == "ok") & (osy.F[:, 0] > -50))
    assert groups[PARETO] == osy.pareto(limits).sum()
    assert sum(groups.values()) == len(osy)


def test_failed_designs_are_counted_and_not_drawn():
    F = [[1.0, 2.0], [np.nan, 1.0], [2.0, np.inf], [2.0, 1.0], [1e308, -1e308]]
    table = TestTable.of([1, 2, 3, 4, 5], np.arange(5.0)[:, None], F)
    for pair in ((0, 1), ("x0", 0)):
        assert plane_of(table, pair).numbers.tolist() == [1, 4]
    told = "5 designs tested, 2 failed, unknown values and those beyond 1e300 not drawn"
    assert criteria_page(table).get_suptitle() == told
    assert criteria_page(table.rows(np.arange(4))).get_suptitle() == "4 designs tested, 2 failed"


def test_options_have_seats_and_the_prototype_one_too(mixed):
    plane = plane_of(mixed, ("x3", 0))
    assert plane.options == ("brass", "gold", "steel", "tin")
    assert [plane.options[int(x)] for x in plane.values[:, 0]] == mixed.X[:, 3].tolist()
    assert plane.prototype.tolist() == [[1.0, 3.0]]
    ax = drawn(plane)
    assert [label.get_text() for label in ax.get_xticklabels()] == list(plane.options)
    assert ax.get_xlim() == (-0.5, 3.5)


@pytest.mark.parametrize(("variable", "spread"), [("x0", False), ("x1", True), ("x2", True)])
def test_single_values_are_spread_about_their_place(mixed, variable, spread):
    plane = plane_of(mixed, (variable, 1))
    shift = plane.places() - plane.values
    assert (shift[:, 1] == 0).all()
    assert np.abs(shift[:, 0]).max() <= 0.3
    assert shift[:, 0].any() == spread
    np.testing.assert_array_equal(plane.places(), plane.places())


def test_nearby_keeps_the_feasible_and_what_is_around_them(osy):
    whole = plane_of(osy, (0, 1))
    near = whole.nearby(0.5)
    ok = osy.feasible()
    low, high = osy.F[ok].min(axis=0), osy.F[ok].max(axis=0)
    pad = 0.5 * (high - low)
    inside = (np.maximum(low - pad - osy.F, osy.F - high - pad) <= 0).all(axis=1)
    assert near.numbers.tolist() == osy.numbers[inside].tolist()
    assert not inside.all()
    assert len(whole.nearby(np.inf).values) == len(osy)
    assert np.sum(near.group == PARETO) == osy.pareto().sum()
    assert plane_of(osy, ("x0", 0)).nearby(0.0).values[:, 1].min() == low[0]
    assert len(plane_of(osy, (0, 1), {"f1": -1e9}).nearby(0).values) == len(osy)


def test_a_plane_is_drawn_group_by_group_the_rarer_on_top(chute):
    plane = plane_of(chute, (0, 3), LIMITS)
    ax = drawn(plane)
    counts = {name: len(rows) for name, rows in members_of(plane.group).items()}
    lines = {name: labelled(ax, f"{name} ({count})") for name, count in counts.items()}
    for name, line in lines.items():
        np.testing.assert_array_equal(line.get_xydata(), plane.values[plane.group == name])
    levels = [lines[name].get_zorder() for name in sorted(counts, key=counts.get, reverse=True)]
    assert levels == sorted(levels)
    star = labelled(ax, "prototype")
    assert star.get_zorder() > max(levels)
    np.testing.assert_array_equal(star.get_xydata(), [[1.9, 0.9]])


def test_what_is_beyond_the_limits_is_shaded(chute):
    ax = drawn(plane_of(chute, (0, 3), LIMITS))
    right, top = (patch.get_extents().transformed(ax.transData.inverted()) for patch in ax.patches)
    np.testing.assert_allclose([right.x0, right.x1], [2.2, ax.get_xlim()[1]])
    np.testing.assert_allclose([top.y0, top.y1], [1.0, ax.get_ylim()[1]])
    assert set(labelled(ax, "limit f1 ≤ 2.2").get_xdata()) == {2.2}
    assert set(labelled(ax, "limit f4 ≤ 1").get_ydata()) == {1.0}
    styles = {labelled(ax, f"limit {name}").get_linestyle() for name in LIMITS}
    assert len(styles) == 2


def test_a_limit_near_the_designs_widens_the_view_and_one_far_off_is_told(chute):
    near = drawn(plane_of(chute, ("x0", 3), {"f4": 7.0}))
    assert near.get_ylim()[1] > 7
    far = drawn(plane_of(chute, ("x0", 3), {"f4": 700.0}))
    assert far.get_ylim()[1] < 7
    assert labelled(far, "limit").get_label() == "limit f4 ≤ 700, outside the axes"
    assert not far.patches
    none = drawn(plane_of(chute, ("x0", 3), {"f4": np.inf}))
    assert not [line for line in none.lines if line.get_label().startswith("limit")]


# Sections


def sphere(x):
    return np.column_stack([(x**2).sum(axis=1), ((x - 1) ** 2).sum(axis=1)])


@pytest.fixture
def cut():
    """The arguments of a section in which the design with x1 = 0 failed."""
    tested = np.array([[0.0, 0.5], [0.25, 0.75]])
    table = TestTable.of([1, 2], tested, sphere(tested))
    X = section_points(table, 2, "x1", 5, lower=0, upper=1)[[3, 0, 4, 1, 2]]
    F = sphere(X)
    F[1] = np.nan
    return table, 2, "x1", X, F


def test_a_section_is_in_order_and_knows_what_is_feasible(cut):
    curves = section_of(*cut, None, None, {"f2": 0.35})
    assert curves.x.tolist() == [0, 0.25, 0.5, 0.75, 1]
    np.testing.assert_allclose(curves.F[1:, 0], curves.x[1:] ** 2 + 0.75**2)
    assert curves.feasible.tolist() == [False, False, True, True, True]
    assert (curves.variable, curves.at) == ("x1", 0.25)
    assert curves.limits == {"f2": (-np.inf, 0.35)}


def test_a_section_shows_the_feasible_part_the_design_and_the_limit(cut):
    figure = section_page(*cut, limits={"f2": 0.35}, title="Sphere")
    assert texts(figure) == [
        "not feasible (1)", "feasible (3)", "test point 2: x1 = 0.25", "limit f2 ≤ 0.35",
    ]  # fmt: skip
    first, second = shown(figure)
    assert (second.get_xlabel(), second.get_ylabel()) == ("x1", "f2")
    assert [len(ax.patches) for ax in (first, second)] == [0, 1]
    curve, *_ = second.lines
    assert np.isfinite(curve.get_ydata()).tolist() == [False, True, True, True, True]
    feasible = labelled(second, "feasible")
    assert np.isfinite(feasible.get_ydata()).tolist() == [False, False, True, True, True]
    assert set(labelled(second, "test point 2").get_xdata()) == {0.25}
    assert figure.get_suptitle() == "Sphere\nsection through test point 2: 5 designs, 1 failed"
    assert_whole(figure, draw=True)


def test_a_section_through_a_design_of_ones_own():
    table = TestTable.of([1], [[0.0, 0.5]], [[1.0]])
    X = section_points(table, [0.3, 0.1], "x2", 3, 0, 1)
    figure = section_page(table, [0.3, 0.1], "x2", X, X.sum(axis=1, keepdims=True))
    assert "the design: x2 = 0.1" in texts(figure)


def test_a_section_of_the_count(mixed):
    X = section_points(mixed, 7, "count", 5)
    curves = section_of(mixed, 7, "count", X, np.ones((5, 2)), np.zeros((5, 1)), None, None)
    assert curves.x.tolist() == [3, 4, 5, 6, 7]
    assert curves.feasible.all()


@pytest.mark.parametrize(
    ("design", "variable", "n_criteria", "message"),
    [
        (7, "length", 2, "X must be the design's in every variable but 'length', got another 'count' in row 0"),
        (70, "count", 2, "design must be a tested point's number, or a design, got 70"),
        (7, "metal", 2, "variable must be a real number or an integer, got one that is a"),
        (7, "count", 1, "F must be of shape"),
    ],
)  # fmt: skip
def test_what_is_no_section_is_refused(mixed, design, variable, n_criteria, message):
    X = section_points(mixed, 7, "count", 5)
    with pytest.raises(PsiError, match=message):
        section_page(mixed, design, variable, X, np.ones((5, n_criteria)), np.zeros((5, 1)))


# Whole pages


def test_the_page_of_a_table_is_a_matrix(osy):
    figure = table_page(osy, {"f1": -50}, title="OSY")
    assert len(shown(figure)) == 6 + 2 * 6
    assert [ax.get_xlabel() for ax in shown(figure)[-6:]] == [f"x{j}" for j in range(1, 7)]
    assert [ax.get_ylabel() for ax in shown(figure)[::6]] == ["% of each group", "f1", "f2"]
    legend = texts(figure)
    for name, members in members_of(design_groups(osy, {"f1": -50})).items():
        assert f"{name} ({len(members)})" in legend
    assert {"tested (1024)", "limit f1 ≤ -50"} <= set(legend)
    assert figure.get_suptitle().startswith("OSY\n1024 designs tested, those far")
    assert round(figure.get_figwidth() * 25.4) == 180
    assert_whole(figure)


def test_the_axes_of_a_column_and_of_a_row_agree(mixed):
    figure = table_page(mixed, {"f1": 5.0})
    grid = np.array(shown(figure)).reshape(3, 4)
    for j in (0, 2):  # a real variable and a boolean
        assert len({ax.get_xlim() for ax in grid[:, j]}) == 1
    for row in grid:
        assert len({ax.get_ylim() for ax in row}) == 1
    assert "prototype" in texts(figure)
    assert_whole(figure)


@pytest.mark.parametrize(
    ("n_var", "n_obj", "axes"), [(2, 6, 14), (7, 2, 7), (2, 7, 2), (13, 1, 13), (1, 1, 2)]
)
def test_of_many_variables_or_criteria_there_are_the_histograms(n_var, n_obj, axes):
    values = np.random.default_rng(1).random((20, n_var + n_obj))
    figure = table_page(TestTable.of(1 + np.arange(20), values[:, :n_var], values[:, n_var:]))
    assert len(shown(figure)) == axes
    if n_var == 13:
        assert_whole(figure)


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
    grid = np.array(figure.axes).reshape(3, 3)
    for k in range(3):
        assert len({ax.get_ylim() for ax in grid[k, : k + 1]}) == 1
        assert len({ax.get_xlim() for ax in grid[k:, k]}) == 1
    assert grid[1, 0].get_ylim() == grid[2, 2].get_xlim()  # f3 upright and lying
    assert_whole(figure)


@pytest.mark.parametrize(("n", "feasible"), [(0, True), (1, True), (1, False)])
def test_little_is_drawn_as_well(n, feasible):
    X, F = np.full((n, 2), 0.5), np.ones((n, 2))
    G = np.full((n, 1), -1.0 if feasible else 1.0)
    table = TestTable.of(1 + np.arange(n), X, F, G, layout=Layout.of(2, 2, 1))
    page = table_page(table)
    assert f"{PARETO} ({n if feasible else 0})" in texts(page)
    assert page.get_suptitle() == ("1 design tested" if n else "0 designs tested")
    assert_whole(page)
    if feasible:
        assert_whole(criteria_page(table, {0: 0.5}))


def test_any_name_can_be_drawn():
    names = ["cost $ of $ all_{", "_hidden\nname", "w" * 200, "a%b^c\\d"]
    X = [[0.1, "$x^{$", 3, True], [0.2, "a long option that goes on", 4, False]]
    layout = Layout.of(names, ["$\\frac$", "_f" * 60])
    table = TestTable.of([1, 2], X, [[1.0, 2.0], [2.0, 1.0]], layout=layout)
    table = table.with_prototype([0.1, "$x^{$", 3, True], [1, 1], name="_$proto$_ type")
    figure = table_page(table, {0: 1.5}, title="Names")
    assert r"prototype: _\$proto\$_ type" in texts(figure)
    assert r"limit \$\frac\$ ≤ 1.5" in texts(figure)
    assert_whole(figure)
    assert_whole(draw_histogram(table, 1).figure)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda t: draw_histogram(t, "x9"), "variable must be one of .*got 'x9'"),
        (lambda t: draw_histogram(t, "x1", legend="no"), "legend must be True or False"),
        (lambda t: table_page(t, criteria=["f9"]), "criterion must be one of .*got 'f9'"),
        (lambda t: table_page(t, variables=["x9"]), "variable must be one of .*got 'x9'"),
        (lambda t: criteria_page(t, criteria=[0, 7]), "criterion must be .* from 0 to 3, got 7"),
        (lambda t: criteria_page(t, {"f1": np.nan}), "limit on 'f1' must be a number"),
        (lambda t: table_page(t, variables=[]), "variables must be one or more, got none"),
        (lambda t: table_page(t, margin=-1.0), "margin must be 0 or more, got -1"),
        (lambda t: criteria_page(t, criteria=["f1"]), "criteria must be from 2 to 7 to draw in pairs, got 1"),
    ],
)  # fmt: skip
def test_what_is_not_there_is_named(chute, call, message):
    with pytest.raises(PsiError, match=message):
        call(chute)


@pytest.mark.parametrize(
    "call",
    [
        table_page,
        criteria_page,
        lambda t: draw_histogram(t, 0),
        lambda t: section_page(t, 1, 0, [[0.1]], [[1.0]]),
    ],
)
def test_what_is_no_table_is_refused(call):
    message = "table must be a TestTable, got str; PSI and investigate give one"
    with pytest.raises(PsiError, match=message) as info:
        call("table.csv")
    assert isinstance(info.value, TypeError)


# Names, senses, units


@pytest.fixture
def beam():
    """Three designs of a criterion to be maximised, with units and an output."""
    layout = Layout.of(
        ["width"], ["mass", "stiffness"], maximize=["stiffness"], lower=[0], upper=[10],
        units={"width": "mm", "stiffness": "N/mm", "heat": "K"},
    )  # fmt: skip
    F = [[1.0, -10.0], [2.0, -30.0], [3.0, -20.0]]
    X, outputs = [[1.0], [5.0], [9.0]], {"heat": [300.0, 310.0, np.nan]}
    table = TestTable.of([1, 2, 3], X, F, outputs=outputs, layout=layout)
    return table.with_prototype([4.0], [2.5, 15.0])


def test_a_maximised_criterion_is_drawn_in_its_own_sense(beam):
    limits = {"stiffness": (15.0, None), "width": (2.0, 8.0)}
    plane = variable_plane(beam, 0, "stiffness", limits, design_groups(beam, limits))
    assert plane.values.tolist() == [[1, 10], [5, 30], [9, 20]]
    assert plane.prototype.tolist() == [[4, 15]]
    assert plane.limits == ((2.0, 8.0), (15.0, np.inf))
    assert plane.group.tolist() == [BEYOND, PARETO, BEYOND]
    ax = drawn(plane)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("width [mm]", "stiffness\n[N/mm] (max)")
    assert set(labelled(ax, "limit stiffness ≥ 15").get_ydata()) == {15.0}
    shaded = [patch.get_extents().transformed(ax.transData.inverted()) for patch in ax.patches]
    # What is beyond a lower limit lies below it.
    assert [(round(box.y0), round(box.y1)) for box in shaded][-1][1] == 15
    assert {line.get_label() for line in ax.lines} >= {"limit width ≥ 2", "limit width ≤ 8"}


def test_outputs_are_drawn_where_they_are_named(beam):
    figure = table_page(beam, criteria=["stiffness", "heat"])
    assert [ax.get_ylabel() for ax in figure.axes][1:] == ["stiffness\n[N/mm] (max)", "heat [K]"]
    # A design without the value, and the prototype, of which none is known, are left out.
    plane = criteria_plane(beam, "mass", "heat", None, design_groups(beam, None))
    assert plane.values.tolist() == [[1, 300], [2, 310]]
    assert len(plane.prototype) == 0
    assert_whole(figure)


def test_a_section_is_in_the_criterias_own_senses(beam):
    X, F = [[1.0], [5.0], [9.0]], [[1, -10], [2, -30], [3, -20]]
    curves = section_of(beam, 2, "width", X, F, None, None, {"stiffness": (15, None)})
    assert curves.F.tolist() == [[1, 10], [2, 30], [3, 20]]
    assert curves.feasible.tolist() == [False, True, True]
