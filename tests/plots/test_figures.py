"""The paper's figures: their data as numbers, and what their axes say and hold."""

import dataclasses
import os
import subprocess
import sys
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pymoo_psi import PsiError, lp_tau, rank_of_efficiency
from pymoo_psi.chute import ChuteParameters, criteria, motion, trajectory
from pymoo_psi.paper import Reproduction, solve_case
from pymoo_psi.plots import (
    criterion_surfaces,
    design_points,
    draw_motion_panel,
    draw_points,
    draw_salukvadze_functions,
    draw_surface,
    geometric_points,
    motion_panels,
    objective_points,
    paper_figures,
    salukvadze_functions,
    save_figures,
)
from pymoo_psi.plots._style import MARKERS, quantity
from pymoo_psi.problems import VectorizedSphereChute

HEADLESS = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "MPLBACKEND")}


@pytest.fixture(scope="module")
def case():
    return solve_case(0.4, "rolling", 512)


def fallen(u1, v_p, parameters=None, *, slip_end=0.25, n=5):
    """A stand-in for a trajectory: any motion that slips up to slip_end, and then rolls."""
    slip = np.linspace(0, slip_end, n)
    eta = np.concatenate([slip, np.linspace(slip_end, 1, n)])
    slipping = np.arange(2 * n) < n
    zero, one = np.zeros(2 * n), np.ones(2 * n)
    return SimpleNamespace(
        eta=eta,
        time=2 * eta,
        speed=0.3 + eta,
        spin=np.column_stack([eta, 3 * eta, zero]),
        slip_velocity=np.where(slipping, slip_end - eta, 0.0)[:, None] * [1.0, -0.5],
        friction=np.where(slipping[:, None], [-0.3, 0.1], [-0.1, 0.0]),
        normal=np.column_stack([one, np.where(slipping, 0.1, 0.0)]),
        slipping=slipping,
        slip_end=slip_end,
        slip_time=2 * slip_end,
    )


def render(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas.get_renderer()


def texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


# Figure 2


def test_surfaces_are_the_criteria_on_the_box():
    surfaces = criterion_surfaces(0.6, model="rolling", n=4)
    X = np.column_stack([surfaces.u1.ravel(), surfaces.u2.ravel()])
    F = VectorizedSphereChute(0.6, model="rolling").evaluate(X)[0]
    np.testing.assert_array_equal(surfaces.f1.ravel(), F[:, 0])
    np.testing.assert_array_equal(surfaces.f2.ravel(), F[:, 1])
    np.testing.assert_allclose(surfaces.u1[[0, -1], 0], [0, 2.1])
    np.testing.assert_allclose(surfaces.u2[0, [0, -1]], [0.1, 6])


def test_surfaces_of_the_full_model_are_its_own():
    full, rolling = (criterion_surfaces(0.2, model=model, n=2) for model in ("full", "rolling"))
    expected = criteria(motion(full.u1, full.u2, ChuteParameters(mu=0.2)))
    np.testing.assert_allclose(full.f1, expected[..., 0], rtol=1e-8)
    assert (full.f1 != rolling.f1).any()


@pytest.mark.parametrize("criterion", ["f1", "f2"])
def test_a_surface_names_its_axes_its_model_and_its_friction(criterion):
    surfaces = criterion_surfaces(0.2, model="rolling", n=5)
    ax = draw_surface(surfaces, criterion)
    labels = [ax.get_xlabel(), ax.get_ylabel(), ax.get_zlabel()]
    for label, name in zip(labels, ["u1", "u2", criterion], strict=True):
        assert all(part in label for part in quantity(name))
    assert "dimensionless" in ax.get_title()
    assert "rolling model" in ax.get_title()
    assert r"$\mu$ = 0.2" in ax.get_title()
    assert len(ax.collections) == 1
    render(ax.figure)


def test_a_surface_leaves_a_hole_where_the_sphere_stalls():
    surfaces = criterion_surfaces(0.2, model="rolling", n=6)
    f2 = surfaces.f2.copy()
    f2[0, :2] = np.nan
    ax = draw_surface(dataclasses.replace(surfaces, f2=f2), "f2")
    render(ax.figure)
    assert np.isfinite(ax.get_zlim()).all()


def test_a_surface_exists_of_f1_and_f2_only():
    with pytest.raises(PsiError, match="criterion must be one of 'f1', 'f2', got 'f3'"):
        draw_surface(criterion_surfaces(0.2, model="rolling", n=2), "f3")


# Figures 3 to 6


def test_points_are_the_case_in_four_spaces(case):
    np.testing.assert_array_equal(geometric_points(case).values, case.ranking.criteria)
    np.testing.assert_array_equal(design_points(case).values, case.X)
    np.testing.assert_array_equal(objective_points(case).values, case.F[:, :3])
    points = objective_points(case, ("f1", "f2", "f4"))
    np.testing.assert_array_equal(points.values, case.F[:, [0, 1, 3]])
    assert (points.model, points.mu, points.names) == ("rolling", 0.4, ("f1", "f2", "f4"))


def test_the_marked_optimum_is_that_of_the_ranking(case):
    points = geometric_points(case)
    assert np.flatnonzero(points.optimum).tolist() == case.ranking.salukvadze.tolist()
    assert points.values[points.optimum, 0].max() == points.values[:, 0].min()


def test_every_point_is_in_one_group(case):
    points = design_points(case)
    groups = points.groups()
    together = np.concatenate(list(groups.values()))
    assert sorted(together) == list(range(len(case.X)))
    assert all(
        (points.rank[m] == int(name[-1])).all() for name, m in groups.items() if name[-1].isdigit()
    )
    assert next(iter(groups)) == "unranked"
    assert list(groups)[-1].startswith("Salukvadze optimum")


def test_nearby_keeps_all_ranked_points_and_what_is_between_them(case):
    points = design_points(case)
    near = points.nearby(0.0)
    ranked = points.values[points.distinguished]
    assert (near.values.min(axis=0) == ranked.min(axis=0)).all()
    assert (near.values.max(axis=0) == ranked.max(axis=0)).all()
    assert near.distinguished.sum() == len(ranked)
    assert len(near.values) < len(points.nearby(0.5).values) < len(points.values)


@pytest.mark.parametrize("space", [geometric_points, design_points, objective_points])
def test_points_are_drawn_group_by_group(case, space):
    points = space(case)
    ax = draw_points(points, title="All of them")
    groups = points.groups()
    assert texts(ax) == [f"{name} ({len(members)})" for name, members in groups.items()]
    assert len(ax.lines) == len(groups)
    looks = {(line.get_marker(), line.get_markerfacecolor()) for line in ax.lines}
    assert (
        len({marker for marker, _ in looks}) == len({colour for _, colour in looks}) == len(groups)
    )
    star = ax.lines[-1]
    assert star.get_marker() == MARKERS[6].shape == "*"
    assert star.get_zorder() == max(line.get_zorder() for line in ax.lines)
    drawn = np.column_stack(star.get_data_3d() if len(points.names) == 3 else star.get_data())
    np.testing.assert_array_equal(drawn, points.values[points.optimum])
    assert ax.get_title().splitlines()[0] == "All of them"
    assert "rolling model" in ax.get_title()
    for letter, name in zip("xyz", points.names, strict=False):
        label = getattr(ax, f"get_{letter}label")()
        assert all(part in label for part in quantity(name))
    render(ax.figure)


def test_drawing_uses_the_axes_it_is_given(case):
    ax = Figure().add_subplot()
    assert draw_points(design_points(case), ax=ax, legend=False) is ax
    assert ax.get_legend() is None


def test_an_unknown_objective_is_named(case):
    with pytest.raises(PsiError, match="names must be one of 'f1', 'f2', 'f3', 'f4', got 'f5'"):
        objective_points(case, ("f1", "f5"))


# Figure 7


def test_panels_hold_the_trajectory():
    way = fallen(0.3, 0.1)
    panels = motion_panels(way)
    assert [panel.letter for panel in panels] == list("abcde")
    a, b, c, d, e = (panel.values for panel in panels)
    np.testing.assert_array_equal(a, np.column_stack([way.speed, way.time]))
    for values, expected in zip(
        (b, c, d, e), (way.spin, way.slip_velocity, way.friction, way.normal), strict=True
    ):
        np.testing.assert_array_equal(values, expected)
    for panel in panels:
        assert panel.values.shape == (len(panel.eta), len(panel.symbols))
        assert (panel.slip_end, panel.slip_time) == (0.25, 0.5)


@pytest.mark.parametrize("panel", motion_panels(fallen(0.3, 0.1)), ids=lambda p: p.letter)
def test_a_panel_interrupts_its_curves_at_the_transition(panel):
    ax = draw_motion_panel(panel)
    *curves, transition = ax.lines
    assert len(curves) == 2 * len(panel.symbols)
    for slip, roll in zip(curves[::2], curves[1::2], strict=True):
        assert slip.get_xdata()[-1] == roll.get_xdata()[0] == 0.25
        assert slip.get_color() == roll.get_color()
    assert transition.get_xdata() == [0.25, 0.25]
    assert texts(ax) == [*panel.symbols, r"$\eta_1$ = 0.250, $t_1$ = 0.500"]
    assert f"({panel.letter}) {panel.title}" in ax.get_title(loc="left")
    assert "full model" in ax.get_title(loc="left")
    assert r"$\eta$" in ax.get_xlabel()
    assert "dimensionless" in ax.get_xlabel()
    assert "dimensionless" in ax.get_ylabel()
    styles = [line.get_linestyle() for line in curves[::2]]
    assert len(set(styles)) == len(styles)
    render(ax.figure)


@pytest.mark.parametrize(("slip_end", "shaded"), [(np.nan, 1), (0.0, 0)])
def test_a_motion_without_transition_has_none_marked(slip_end, shaded):
    way = fallen(0.3, 0.1)
    way.slip_end = way.slip_time = slip_end
    way.slipping = np.full(len(way.eta), bool(shaded))
    ax = draw_motion_panel(motion_panels(way)[3])
    assert len(ax.lines) == 2
    assert len(ax.patches) == shaded
    assert len(texts(ax)) == 2


# Figure 8


@pytest.mark.parametrize(
    ("model", "n", "speeds"), [("rolling", 300, (0.05, 0.32, 1)), ("full", 20, (0.3,))]
)
def test_salukvadze_functions_are_those_of_the_ranking(model, n, speeds):
    functions = salukvadze_functions(0.4, speeds, model=model, n_points=n)
    X = [0, 0.1] + np.array([1.4, 5.9]) * lp_tau(n, 2)
    for k, c in enumerate(speeds):
        moved = motion(*X.T, ChuteParameters(mu=0.4, c=c), model=model)
        best = rank_of_efficiency(criteria(moved), normalize=False).salukvadze
        assert functions.test_point[k] - 1 in best
        np.testing.assert_allclose(functions.F[k], criteria(moved)[best[0]], rtol=1e-12)
        np.testing.assert_allclose(functions.exit_speed[k], moved.exit_speed[best[0]], rtol=1e-12)
    np.testing.assert_array_equal(functions.curve("f4S"), functions.F[:, 3])
    np.testing.assert_array_equal(functions.curve("vCfS"), functions.exit_speed)


def test_salukvadze_functions_pass_through_the_case(case):
    functions = salukvadze_functions(0.4, [0.3193], model="rolling", n_points=512)
    best = case.ranking.salukvadze
    assert functions.test_point.tolist() == case.test_point[best].tolist()
    np.testing.assert_allclose(functions.F, case.F[best], rtol=1e-14)


def test_functions_are_drawn_by_name():
    functions = salukvadze_functions(0.4, [0.2, 0.4, 0.6], model="rolling", n_points=32)
    ax = draw_salukvadze_functions(functions, ("f1S", "vCfS"))
    assert texts(ax) == ["$f_1^S$, time", "$v_{Cf}^S$, exit speed", "$c$ = 0.3193"]
    np.testing.assert_array_equal(
        ax.lines[0].get_xydata(), np.column_stack([functions.c, functions.F[:, 0]])
    )
    assert ax.get_xlabel() == "$c$, initial speed of the centre (dimensionless)"
    assert ax.get_ylabel() == "$f_1^S$, $v_{Cf}^S$ (dimensionless)"
    assert "rolling model" in ax.get_title(loc="left")
    render(ax.figure)


@pytest.mark.parametrize(
    ("c", "message"),
    [
        ([[0.1]], r"c must be a list of speeds, got shape \(1, 1\)"),
        ([0.1, 0.0], "c must be .*positive.*, got 0.0"),
        ([np.nan], "c must be finite"),
    ],
)
def test_speeds_are_checked(c, message):
    with pytest.raises(PsiError, match=message):
        salukvadze_functions(0.4, c, model="rolling", n_points=4)


@pytest.mark.parametrize(("names", "message"), [
    (("f1S", "f9S"), "names must be one of .*, got 'f9S'"),
    (("f1S", "f2S", "f3S", "f4S"), "names must be one to three functions, got 4"),
])  # fmt: skip
def test_names_of_functions_are_checked(names, message):
    functions = salukvadze_functions(0.4, [0.2], model="rolling", n_points=4)
    with pytest.raises(PsiError, match=message):
        draw_salukvadze_functions(functions, names)


# Whole pages


def test_pages_keep_every_text_inside_and_name_the_model(case):
    for number, figure in paper_figures(Reproduction(512, (case,)), model="rolling"):
        renderer = render(figure)
        page = figure.bbox
        assert round(figure.get_figwidth() * 25.4) == 180
        artists = [*figure.legends, *figure.texts]
        for ax in figure.axes:
            artists += ax.texts
            if ax.axison:
                artists += [ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label]
                artists += [ax.zaxis.label] if hasattr(ax, "zaxis") else []
                artists += [ax.get_legend()] if ax.get_legend() else []
        for artist in artists:
            box = artist.get_window_extent(renderer)
            assert page.x0 <= box.x0 <= box.x1 <= page.x1, (number, artist)
            assert page.y0 <= box.y0 <= box.y1 <= page.y1, (number, artist)
        assert "rolling model" in figure.get_suptitle()


def test_the_page_of_the_motion_tells_the_design(case):
    figures = dict(paper_figures(Reproduction(512, (case,)), model="rolling"))
    best = case.ranking.salukvadze[0]
    way = trajectory(*case.X[best], ChuteParameters(mu=0.4))
    assert "motion under the full model" in figures[7].get_suptitle()
    facts = figures[7].axes[-1].texts[0].get_text()
    assert f"test point {case.test_point[best]}" in facts
    assert f"{way.slip_end:.1%} of the way" in facts


def test_files_are_written_for_one_model(case, tmp_path):
    (tmp_path / "figure_2.png").write_text("old")
    paths = save_figures(Reproduction(64, (case,)), tmp_path, model="rolling", dpi=50)
    assert [path.name for path in paths] == [f"figure_{number}.png" for number in range(2, 9)]
    assert sorted(paths) == sorted(tmp_path.iterdir())
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


def test_no_file_is_written_if_a_figure_cannot_be_made(case, tmp_path, monkeypatch):
    def failing(*arguments):
        raise RuntimeError("no motion")

    monkeypatch.setattr("pymoo_psi.plots._paper.trajectory", failing)
    (tmp_path / "figure_2.png").write_text("old")
    with pytest.raises(RuntimeError, match="no motion"):
        save_figures(Reproduction(64, (case,)), tmp_path, model="rolling", dpi=50)
    assert [path.name for path in tmp_path.iterdir()] == ["figure_2.png"]
    assert (tmp_path / "figure_2.png").read_text() == "old"


@pytest.mark.parametrize(("model", "message"), [
    ("full", "reproduction must be one with the case full 0.4, got the cases rolling 0.4"),
    ("rollin", "model must be .*did you mean 'rolling'"),
])  # fmt: skip
def test_a_missing_case_is_named(case, tmp_path, model, message):
    with pytest.raises(PsiError, match=message):
        save_figures(Reproduction(64, (case,)), tmp_path, model=model)
    assert list(tmp_path.iterdir()) == []


def test_settings_and_windows_of_matplotlib_are_left_alone(case):
    before = dict(matplotlib.rcParams)
    for _ in paper_figures(Reproduction(16, (case,)), model="rolling"):
        assert dict(matplotlib.rcParams) == before
    render(draw_points(design_points(case)).figure)
    assert dict(matplotlib.rcParams) == before
    assert Gcf.get_all_fig_managers() == []


def test_no_window_system_is_needed():
    code = (
        "from pymoo_psi.plots import *;"
        "draw_surface(criterion_surfaces(0.2, model='rolling', n=3)).figure.savefig(open(1, 'wb'))"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, check=True, env=HEADLESS
    )
    assert done.stdout.startswith(b"\x89PNG")
