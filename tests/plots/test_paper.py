"""The paper's figures: what their axes say and hold."""

from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf
from matplotlib.figure import Figure

from pymoo_psi import PsiError
from pymoo_psi._markers import MARKERS
from pymoo_psi.chute import ChuteParameters, trajectory
from pymoo_psi.paper import Reproduction, reproduce, solve_case
from pymoo_psi.paper._figures import criterion_surfaces, ranked_points
from pymoo_psi.plots import paper_figures, points_page, save_figures
from pymoo_psi.plots._paper import (
    QUANTITIES,
    draw_functions,
    draw_motion,
    draw_surface,
)
from pymoo_psi.plots._ranking import draw_points
from tests.plots.drawn import assert_whole, texts


@pytest.fixture(scope="module")
def case():
    return solve_case(0.4, "rolling", 512)


@pytest.fixture(scope="module")
def figures(case):
    before, found = dict(matplotlib.rcParams), {}
    for number, figure in paper_figures(Reproduction(512, (case,)), model="rolling"):
        assert dict(matplotlib.rcParams) == before  # also between two of them
        found[number] = figure
    assert Gcf.get_all_fig_managers() == []
    return found


def fallen(*, slip_end=0.25, n=5):
    """A stand-in for a trajectory: any motion that slips up to slip_end, and then rolls."""
    end = 1.0 if np.isnan(slip_end) else slip_end
    eta = np.concatenate([np.linspace(0, end, n), np.linspace(end, 1, n)])
    slipping = np.arange(2 * n) < n if 0 < slip_end < 1 else np.full(2 * n, np.isnan(slip_end))
    return SimpleNamespace(
        eta=eta,
        time=2 * eta,
        speed=0.3 + eta,
        spin=np.column_stack([eta, 3 * eta, 0 * eta]),
        slip_velocity=np.where(slipping, end - eta, 0.0)[:, None] * [1.0, -0.5],
        friction=np.where(slipping[:, None], [-0.3, 0.1], [-0.1, 0.0]),
        normal=np.column_stack([1 + 0 * eta, np.where(slipping, 0.1, 0.0)]),
        slipping=slipping,
        slip_end=slip_end,
        slip_time=2 * slip_end,
    )


@pytest.mark.parametrize("number", range(2, 9))
def test_a_page_is_whole_and_names_the_model(figures, number):
    figure = figures[number]
    assert round(figure.get_figwidth() * 25.4) == 180
    assert "rolling model" in figure.get_suptitle()
    assert_whole(figure, draw=number > 6)


def test_a_surface_leaves_a_hole_where_the_sphere_stalls():
    surfaces = criterion_surfaces(0.2, "rolling", n=6)
    f = surfaces.f[1].copy()
    f[0, :2] = np.nan
    ax = Figure().add_subplot(projection="3d")
    draw_surface(ax, surfaces.u1, surfaces.u2, f)
    assert np.isfinite(ax.get_zlim()).all()
    np.testing.assert_allclose(ax.get_zlim()[0], np.nanmin(f), atol=0.05 * np.nanmax(f))


def test_each_surface_has_its_axes_named(figures):
    axes = figures[2].axes[:4]
    assert [bar.get_ylabel() for bar in figures[2].axes[4:]] == [
        ", ".join(QUANTITIES[q]) for q in ["f1", "f2"] * 2
    ]
    assert len({(ax.elev, ax.azim) for ax in axes}) == 1
    for ax, name in zip(axes, ["f1", "f2"] * 2, strict=True):
        labels = [ax.get_xlabel(), ax.get_ylabel(), ax.get_title().split(": ")[1]]
        assert labels == [", ".join(QUANTITIES[q]) for q in ("u1", "u2", name)]
        assert len(ax.collections) == 1
    assert [ax.get_title().split(":")[0] for ax in axes[::2]] == [
        r"(a) $\mu$ = 0.2", r"(b) $\mu$ = 0.6",
    ]  # fmt: skip


@pytest.mark.parametrize("names", [("mu1", "mu3"), ("u1", "u2")])
def test_points_are_drawn_group_by_group_the_optimum_on_top(case, names):
    points = ranked_points(case, names)
    ax = Figure().add_subplot()
    draw_points(ax, points)
    groups = points.groups()
    labels = [f"{name} ({len(members)})" for name, members in groups.items()]
    assert [line.get_label() for line in ax.lines] == labels
    assert len({line.get_marker() for line in ax.lines}) == len(groups)
    assert len({line.get_markerfacecolor() for line in ax.lines}) == len(groups)
    star = ax.lines[-1]
    assert star.get_marker() == MARKERS[6].shape == "*"
    assert star.get_zorder() == max(line.get_zorder() for line in ax.lines)
    np.testing.assert_array_equal(star.get_xydata(), points.values[points.optimum])


@pytest.mark.parametrize("number", [3, 5, 6])
def test_every_pair_of_three_coordinates_is_drawn_twice(figures, number):
    axes = figures[number].axes
    pairs = [(ax.get_xlabel(), ax.get_ylabel()) for ax in axes]
    assert len(axes) == 6
    assert pairs[:3] == pairs[3:]
    assert len({frozenset(pair) for pair in pairs}) == 3
    assert len({name for pair in pairs for name in pair}) == 3
    assert {name for pair in pairs for name in pair} <= {", ".join(q) for q in QUANTITIES.values()}


def test_a_curve_of_the_motion_is_interrupted_at_the_transition():
    way = fallen()
    axes = Figure().subplots(1, 5)
    draw_motion(axes, way)
    columns = ([way.speed, way.time], way.spin.T, way.slip_velocity.T, way.friction.T, way.normal.T)
    for ax, values in zip(axes, columns, strict=True):
        *curves, transition = ax.lines
        assert len(curves) == 2 * len(values)
        for slip, roll, expected in zip(curves[::2], curves[1::2], values, strict=True):
            assert slip.get_xdata()[-1] == roll.get_xdata()[0] == 0.25
            assert slip.get_color() == roll.get_color()
            drawn = np.concatenate([slip.get_ydata(), roll.get_ydata()])
            np.testing.assert_array_equal(drawn, expected)
        assert len({line.get_linestyle() for line in curves[::2]}) == len(values)
        assert transition.get_xdata() == [0.25, 0.25]
        assert len(texts(ax)) == len(values)  # what the line is stands beside the panels, once


@pytest.mark.parametrize(("slip_end", "shaded"), [(np.nan, 1), (0.0, 0)])
def test_a_motion_without_transition_has_none_marked(slip_end, shaded):
    axes = Figure().subplots(1, 5)
    draw_motion(axes, fallen(slip_end=slip_end))
    assert len(axes[3].lines) == 2
    assert len(axes[3].patches) == shaded
    assert len(texts(axes[3])) == 2


def test_the_page_of_the_motion_tells_the_design(case, figures):
    best = case.ranking.salukvadze[0]
    way = trajectory(*case.X[best], ChuteParameters(mu=0.4))
    assert "motion under the full model" in figures[7].get_suptitle()
    facts = figures[7].axes[-1].texts[0].get_text()
    assert f"test point {case.test_point[best]}" in facts
    assert rf"$\eta_1$ = {way.slip_end:.3f}, {way.slip_end:.1%} of the way" in facts


def test_functions_are_drawn_by_name():
    ax = Figure().add_subplot()
    c, fine = np.array([0.2, 0.4]), np.array([0.1, 0.3, 0.5])
    curves = {("$a$", "time"): (2 * c, 5 * fine), ("$b$", "speed"): (3 * c, 7 * fine)}
    draw_functions(ax, c, fine, curves, 0.3193)
    assert texts(ax) == ["$a$, time", "$b$, speed", "$c$ = 0.3193"]
    drawn = [line.get_xydata() for line in ax.lines[:4]]
    expected = [(fine, 5 * fine), (c, 2 * c), (fine, 7 * fine), (c, 3 * c)]
    for points, columns in zip(drawn, expected, strict=True):
        np.testing.assert_array_equal(points, np.column_stack(columns))
    assert ax.get_ylabel() == "$a$, $b$ (dimensionless)"


def test_the_figures_of_another_chute_say_which_and_mark_its_speed():
    other = Reproduction(64, (solve_case(0.3, "rolling", 64, c=1.5, r=0.2),))
    pages = dict(paper_figures(other, model="rolling", numbers=[2, 4, 8]))
    for number in (2, 4):
        assert "$c$ = 1.5, $r$ = 0.2" in pages[number].get_suptitle()
    assert r"$\mu$ = 0.3, $r$ = 0.2" in pages[8].get_suptitle()
    for ax in pages[8].axes:
        assert ax.lines[-1].get_xdata() == [1.5, 1.5]
        assert min(ax.lines[0].get_xdata()) < 1.5 < max(ax.lines[0].get_xdata())
        assert texts(ax)[-1] == "$c$ = 1.5"
    assert "The paper" not in pages[8].texts[-1].get_text()


@pytest.mark.parametrize(
    ("suffix", "start"), [(".png", b"\x89PNG"), (".pdf", b"%PDF-"), (".svg", b"<?xml")]
)
def test_all_figures_are_written_in_each_format(case, tmp_path, monkeypatch, suffix, start):
    def empty(reproduction, *, model, numbers):
        assert model == "rolling"
        return ((number, Figure()) for number in numbers)

    monkeypatch.setattr("pymoo_psi.plots._paper.paper_figures", empty)
    paths = save_figures(Reproduction(512, (case,)), tmp_path, model="rolling", suffix=suffix)
    assert [path.name for path in paths] == [f"figure_{number}{suffix}" for number in range(2, 9)]
    assert all(path.read_bytes().startswith(start) for path in paths)


def test_other_formats_are_refused(case, tmp_path):
    with pytest.raises(PsiError, match=r"suffix must be .*got '\.jpg'"):
        save_figures(Reproduction(512, (case,)), tmp_path, model="rolling", suffix=".jpg")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "reproduction must be one with cases of the full model, got the cases rolling 0.4"),
        ({"model": "rollin"}, "model must be .*did you mean 'rolling'"),
        ({"model": "rolling", "numbers": [9]}, "numbers must be of figures, 2 to 8, got 9"),
    ],
)
def test_what_is_not_there_is_named(case, options, message):
    with pytest.raises(PsiError, match=message):
        list(paper_figures(Reproduction(64, (case,)), **options))


def test_the_points_page_shows_what_is_missing_and_what_doubling_brought(case):
    reproduction = Reproduction(512, (case,))
    figure = points_page(reproduction)
    (rows,) = reproduction.convergences
    above, below = (ax.lines[0].get_xydata() for ax in figure.axes)
    np.testing.assert_array_equal(above[:, 0], rows.tests)
    assert above[-1, 1] == pytest.approx(
        100 * (case.refined.start_distance / case.refined.distance - 1)
    )
    # the hypervolume of each row follows from the gains, back from the last one, which is 1
    volumes = np.cumprod(np.append(1, 1 - below[::-1, 1] / 100))[::-1]
    np.testing.assert_allclose(volumes, rows.hypervolume)
    assert_whole(figure)
    with pytest.raises(PsiError, match="of 8 tests or more, got 4 tests"):
        points_page(Reproduction(4, (solve_case(0.4, "rolling", 4),)))


def test_every_coefficient_has_a_curve_of_its_own_look_on_the_points_page():
    mu = [0.2, 0.3, 0.4, 0.5, 0.6]
    figure = points_page(reproduce(16, mu=mu, models=["rolling"]))
    names = [rf"$\mu$ = {value:g}" for value in mu]
    assert texts(figure) == names
    for ax in figure.axes:
        *curves, _ = ax.lines
        looks = {(curve.get_color(), curve.get_marker(), curve.get_linestyle()) for curve in curves}
        assert len(curves) == len(looks) == len(mu)
    assert_whole(figure)


def test_the_points_page_is_drawn_where_there_is_nothing_to_compare_with():
    halves = reproduce(8, mu=[0.4], models=["rolling"])  # none
    assert_whole(points_page(halves), draw=True)
    # So much friction that of the test points only the level chute is Pareto optimal: U itself.
    nearest = reproduce(9, mu=[1e9], models=["full"])
    assert nearest.cases[0].refined.distance == 0
    assert_whole(points_page(nearest), draw=True)
