"""The figures of a comparison: their data against slow ways to them, and what the pages say."""

import dataclasses

import matplotlib
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib._pylab_helpers import Gcf
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.problems import get_problem

from pymoo_psi import PsiError, VectorizedSphereChute
from pymoo_psi.comparison import INDICATORS, compare
from pymoo_psi.pareto._indicators import attainment_surfaces
from pymoo_psi.plots import (
    attainment,
    attainment_page,
    draw_attainment,
    draw_front,
    draw_indicator,
    draw_times,
    fronts_page,
    indicator_curves,
    indicators_page,
    median_fronts,
    run_times,
    save_comparison,
    time_page,
)
from pymoo_psi.plots._comparison_fronts import steps
from pymoo_psi.plots._comparison_style import looks
from tests.plots.drawn import render, texts

PAGES = [indicators_page, fronts_page, time_page, attainment_page]
ODD = {"_under": "psi", "a$b$\nc \\alpha": "psi-scrambled", "x" * 80: "nsga3"}


class Narrow(Problem):
    """Two objectives, and hardly anything feasible; of a share of 0 nothing at all."""

    def __init__(self, share):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0.0, xu=1.0)
        self.share = share

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = np.column_stack([x[:, 0], (1 - x).sum(axis=1)])
        out["G"] = (1 - self.share - x.min(axis=1))[:, None]


@pytest.fixture(scope="module")
def bnh():
    return compare(
        get_problem("bnh"), n_evaluations=(32, 64), seeds=4,
        algorithms=["psi", "psi-scrambled", "nsga3"], polish=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def chute():
    return compare(
        VectorizedSphereChute(0.4, model="rolling"), n_evaluations=32, seeds=2,
        algorithms=["psi", "nsga3"], polish=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def sparse():
    """Some runs find something, some nothing, and with 4 evaluations none does."""
    return compare(
        Narrow(0.15), n_evaluations=(4, 40), seeds=5, algorithms=["psi-scrambled", "nsga3"],
        polish=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def barren():
    return compare(Narrow(0.0), n_evaluations=4, seeds=2, algorithms=ODD, polish=False)


def values(comparison, name, budget, column):
    return np.array(
        [
            row[column]
            for row in comparison.to_frame().to_dict("records")
            if (row["algorithm"], row["evaluations"]) == (name, budget)
        ]
    )


# The indicators


@pytest.mark.parametrize("indicator", INDICATORS)
def test_medians_and_quartiles_are_numpys(bnh, indicator):
    curves = indicator_curves(bnh, indicator)
    for i, name in enumerate(curves.algorithms):
        for j, budget in enumerate(curves.evaluations):
            of_runs = values(bnh, name, budget, indicator)
            assert len(of_runs) == (1 if name == "psi" else 4)
            assert curves.median[i, j] == np.median(of_runs)
            assert curves.lower[i, j] == np.quantile(of_runs, 0.25, method="lower")
            assert curves.upper[i, j] == np.quantile(of_runs, 0.75, method="higher")


def test_an_unknown_indicator_is_named(bnh):
    with pytest.raises(PsiError, match="indicator must be one of .*did you mean 'epsilon'"):
        indicator_curves(bnh, "epsilom")


def test_only_positive_distances_have_a_logarithmic_axis(bnh):
    curves = indicator_curves(bnh, "igd_plus")
    touching = dataclasses.replace(curves, lower=0 * curves.lower)
    nowhere = dataclasses.replace(
        curves, **dict.fromkeys(("lower", "median", "upper"), curves.median + np.inf)
    )
    assert draw_indicator(curves).get_yscale() == "log"
    assert draw_indicator(touching).get_yscale() == "linear"
    assert draw_indicator(nowhere).get_yscale() == "linear"
    assert draw_indicator(indicator_curves(bnh, "hypervolume")).get_yscale() == "linear"


def test_infinite_values_are_left_out_and_said_so(sparse):
    curves = indicator_curves(sparse, "epsilon")
    assert np.isinf(curves.median[:, 0]).all()
    assert np.isfinite(curves.lower[:, 1]).all()
    ax = draw_indicator(curves)
    for line, median in zip(ax.lines, curves.median, strict=True):
        drawn = line.get_ydata()
        assert np.isnan(drawn[0])
        assert drawn[1] == median[1] or np.isinf(median[1])
    medians = int(np.isinf(curves.median).sum())
    quartiles = int(np.isinf([curves.lower, curves.upper]).sum())
    assert ax.get_title(loc="right").startswith(f"infinite, not drawn: {medians} medians, ")
    assert ax.get_title(loc="right").endswith(f" {quartiles} quartiles")
    assert draw_indicator(indicator_curves(sparse, "hypervolume")).get_title(loc="right") == ""


def test_bands_lie_between_the_quartiles(bnh):
    curves = indicator_curves(bnh, "epsilon")
    ax = draw_indicator(curves)
    bands = [c for c in ax.collections if isinstance(c, PolyCollection)]
    assert len(bands) == len(curves.algorithms)
    for k, band in enumerate(bands):
        (path,) = band.get_paths()
        corners = {tuple(corner) for corner in path.vertices.tolist()}
        for edge in (curves.lower[k], curves.upper[k]):
            assert set(zip(curves.evaluations, edge.tolist(), strict=True)) <= corners


def test_ticks_stand_at_the_budgets_and_crowded_ones_have_no_text(bnh):
    runs = bnh.runs[:1] * 4
    budgets = (16, 17, 64, 1024)
    runs = tuple(
        dataclasses.replace(run, task=dataclasses.replace(run.task, n_evaluations=n))
        for run, n in zip(runs, budgets, strict=True)
    )
    measures = pd.concat([bnh.measures.iloc[:1]] * 4).assign(evaluations=budgets)
    several = dataclasses.replace(bnh, runs=runs, measures=measures)
    ax = draw_indicator(indicator_curves(several, "hypervolume"))
    assert ax.get_xticks().tolist() == list(budgets)
    assert [text.get_text() for text in ax.get_xticklabels()] == ["16", "", "64", "1024"]


def test_of_one_budget_the_algorithms_stand_beside_each_other(chute):
    ax = draw_indicator(indicator_curves(chute, "hypervolume"))
    places = [line.get_xdata()[0] for line in ax.lines]
    low, high = ax.get_xlim()
    assert low < places[0] < 32 < places[1] < high
    assert [text.get_text() for text in ax.get_xticklabels()] == ["32"]


# The fronts


@pytest.mark.parametrize("budget", [32, 64])
@pytest.mark.parametrize("assess", ["evaluated", "returned"])
def test_fronts_are_of_the_run_of_median_hypervolume(bnh, budget, assess):
    fronts = median_fronts(dataclasses.replace(bnh, assess=assess), budget)
    for k, name in enumerate(bnh.algorithms):
        quality = values(bnh, name, budget, "hypervolume")
        assert fronts.hypervolume[k] == np.quantile(quality, 0.5, method="lower")
        (run,) = [
            run for run, volume in zip(bnh.runs, bnh.measures["hypervolume"], strict=True)
            if volume == fronts.hypervolume[k]
            and (run.task.algorithm, run.task.n_evaluations) == (name, budget)
        ]  # fmt: skip
        assert fronts.seeds[k] == run.task.seed
        np.testing.assert_array_equal(
            fronts.fronts[k], run.F if assess == "evaluated" else run.returned
        )


def test_the_reference_is_in_the_units_of_the_objectives(bnh, chute):
    for comparison in (bnh, chute):
        union = {tuple(f) for run in comparison.runs for f in run.F.round(9).tolist()}
        front = median_fronts(comparison).reference
        assert len(front) > 10
        assert {tuple(f) for f in front.round(9).tolist()} <= union


def test_an_objective_that_is_the_same_everywhere_has_a_place(bnh):
    flat = dataclasses.replace(bnh.reference.frame, nadir=bnh.reference.frame.ideal)
    reference = dataclasses.replace(bnh.reference, frame=flat)
    front = median_fronts(dataclasses.replace(bnh, reference=reference)).reference
    assert (front == flat.ideal).all()


def test_fronts_have_common_axes_and_one_plane_each_for_two_objectives(bnh):
    axes = fronts_page(bnh).axes
    assert [ax.get_title(loc="left").split("\n")[0].split(",")[0] for ax in axes] == [
        *bnh.algorithms
    ]
    assert len({(ax.get_xlim(), ax.get_ylim()) for ax in axes}) == 1
    (low, high), (bottom, top) = axes[0].get_xlim(), axes[0].get_ylim()
    for ax in axes:
        for line in ax.lines:
            x, y = line.get_data()
            assert ((low < x) & (x < high) & (bottom < y) & (y < top)).all()


def test_of_more_objectives_each_algorithm_has_a_row(chute):
    axes = fronts_page(chute).axes
    assert [ax.get_ylabel() for ax in axes] == ["$f_{2}$", "$f_{3}$", "$f_{4}$"] * 2
    assert {ax.get_xlabel() for ax in axes} == {"$f_{1}$"}
    for column in range(3):
        assert axes[column].get_ylim() == axes[column + 3].get_ylim()
    fronts = median_fronts(chute)
    np.testing.assert_array_equal(
        np.transpose(axes[4].lines[-1].get_data()), fronts.fronts[1][:, [0, 2]]
    )


@pytest.mark.parametrize(
    ("algorithm", "objectives", "message"),
    [
        ("psy", ("f1", "f2"), "algorithm must be one of .*did you mean 'psi'"),
        ("psi", ("f1", "f3"), "objectives must be one of 'f1', 'f2', got 'f3'"),
        ("psi", ("f1",), "objectives must be two, got 1"),
    ],
)
def test_what_cannot_be_drawn_of_a_front_is_named(bnh, algorithm, objectives, message):
    with pytest.raises(PsiError, match=message):
        draw_front(median_fronts(bnh), algorithm, objectives)


# The attainment surfaces


def attained(fronts, point):
    """The share of the runs, in percent, that have a point no worse than this one."""
    return 100 * sum(any((f <= point).all() for f in front) for front in fronts) / len(fronts)


def slow_surface(fronts, percent):
    """The grid points that so many runs attain, without those that another of them dominates."""
    f1, f2 = (sorted({f[j] for front in fronts for f in front.tolist()}) for j in (0, 1))
    reached = [(a, b) for a in f1 for b in f2 if attained(fronts, (a, b)) >= percent - 1e-9]
    return [
        (a, b) for a, b in reached
        if not any(c <= a and d <= b and (c, d) != (a, b) for c, d in reached)
    ]  # fmt: skip


POINTS = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), max_size=5)


@given(st.lists(POINTS, min_size=1, max_size=9))
def test_surfaces_are_those_of_the_definition(runs):
    fronts = [np.array(points, float).reshape(-1, 2) for points in runs]
    percentiles = [10.0, 25.0, 100 / 3, 50.0, 200 / 3, 75.0, 100.0]
    surfaces = attainment_surfaces(fronts, percentiles)
    assert list(surfaces) == percentiles
    for percent, surface in surfaces.items():
        assert surface.shape == (len(surface), 2)
        assert [tuple(corner) for corner in surface.tolist()] == slow_surface(fronts, percent)


def test_surfaces_of_a_comparison_are_those_of_its_runs(sparse):
    surfaces = attainment(sparse, 40)
    named = ((25, "quarter"), (50, "median"), (75, "three_quarters"))
    for k, name in enumerate(sparse.algorithms):
        fronts = [
            run.F for run in sparse.runs
            if (run.task.algorithm, run.task.n_evaluations) == (name, 40)
        ]  # fmt: skip
        assert len(fronts) == 5
        for percent, attribute in named:
            corners = [tuple(f) for f in getattr(surfaces, attribute)[k].tolist()]
            assert corners == slow_surface(fronts, percent)


def test_one_run_attains_what_it_found(bnh):
    surfaces = attainment(bnh)
    found = bnh.runs[1].F
    assert bnh.runs[1].task.n_evaluations == 64
    for surface in (surfaces.quarter[0], surfaces.median[0], surfaces.three_quarters[0]):
        np.testing.assert_array_equal(surface, found[found[:, 0].argsort()])


def test_steps_are_the_edge_of_what_is_attained():
    surface = np.array([[1.0, 4.0], [2.0, 3.0], [5.0, 1.0]])
    edge = steps(surface, 6.0, 7.0)
    assert edge.tolist() == [[1, 7], [1, 4], [2, 4], [2, 3], [5, 3], [5, 1], [6, 1]]
    assert steps(np.zeros((0, 2)), 6.0, 7.0).tolist() == [[6, 7]]


def test_bands_hold_what_a_quarter_attains_but_not_three(bnh):
    surfaces = attainment(bnh)
    ax = draw_attainment(surfaces, ["nsga3"])
    band = ax.patches[0].get_path()
    fronts = [run.F for run in bnh.runs if str(run.task).startswith("nsga3, 64")]
    points = np.random.default_rng(1).uniform(*np.transpose(surfaces.limits()), (2000, 2))
    inside = band.contains_points(points)
    assert inside.any()
    assert inside.tolist() == [25 <= attained(fronts, point) < 75 for point in points]


def test_other_numbers_of_objectives_have_no_surfaces(chute):
    message = (
        "comparison must be of a problem with two objectives, got 4 objectives; "
        "fronts_page shows any number"
    )
    with pytest.raises(PsiError, match=message):
        attainment_page(chute)


# The times


def test_times_are_those_of_the_runs(bnh):
    times = run_times(bnh)
    for i, name in enumerate(bnh.algorithms):
        every = [run.seconds for run in bnh.runs if run.task.algorithm == name]
        assert times.seconds[i].tolist() == every
        for j, budget in enumerate(bnh.evaluations):
            assert times.median_seconds[i, j] == np.median(values(bnh, name, budget, "seconds"))
            assert times.median_hypervolume[i, j] == np.median(
                values(bnh, name, budget, "hypervolume")
            )
    ax = draw_times(times)
    assert [len(line.get_xdata()) for line in ax.lines] == [2, 2, 8, 2, 8, 2]


# All pages


@pytest.mark.parametrize("page", PAGES)
def test_the_heading_names_problem_runs_and_what_is_assessed(bnh, page):
    def heading(comparison):
        return page(comparison).get_suptitle().split("\n")

    what, runs, assessed = heading(bnh)
    assert what.startswith("BNH: ")
    budgets = "32 and 64" if page in (indicators_page, time_page) else "64"
    assert runs == f"{budgets} evaluations, 4 seeds (one run of psi)"
    assert assessed == "assessed: all feasible designs that a run evaluated"
    *_, assessed = heading(dataclasses.replace(bnh, assess="returned"))
    assert assessed == "assessed: the designs that a run returned"


@pytest.mark.parametrize("page", [fronts_page, attainment_page])
def test_a_budget_is_chosen_and_a_missing_one_named(bnh, page):
    assert "\n32 evaluations" in page(bnh, 32).get_suptitle()
    with pytest.raises(PsiError, match="evaluations must be one of the budgets 32, 64, got 48"):
        page(bnh, 48)


@pytest.mark.parametrize("page", PAGES)
def test_something_else_than_a_comparison_is_refused(page):
    with pytest.raises(PsiError, match="comparison must be a Comparison, got list; compare"):
        page([])


@pytest.mark.parametrize("page", PAGES)
def test_where_nothing_was_found_the_pages_say_so(barren, page):
    figure = page(barren)
    render(figure)
    said = [text.get_text() for ax in figure.axes for text in ax.texts]
    if page is fronts_page:
        assert said == ["nothing found"] * 3
    if page is attainment_page:
        assert said == ["fewer than half of\nthe runs found any"] * 3
    if page is indicators_page:
        notes = [ax.get_title(loc="right") for ax in figure.axes]
        assert notes == ["", *["infinite, not drawn: 3 medians, 6 quartiles"] * 3]


@pytest.mark.parametrize("page", [indicators_page, time_page, attainment_page])
def test_odd_names_are_written_as_they_are(barren, page):
    names = texts(page(barren))[:3]
    assert names == ["_under", r"a\$b\$ c \alpha", f"{'x' * 29}…"]


@pytest.mark.parametrize("page", PAGES)
def test_nothing_is_cut_off_and_no_legend_lies_on_axes(bnh, page):
    figure = page(bnh)
    renderer = render(figure)
    width, height = figure.canvas.get_width_height()
    parts = [*figure.legends, *figure.texts, *figure.axes]
    for part in parts:
        box = part.get_tightbbox(renderer)
        assert box.x0 >= -1
        assert box.y0 >= -1
        assert box.x1 <= width + 1
        assert box.y1 <= height + 1
    (legend,) = figure.legends
    for ax in figure.axes:
        assert not legend.get_window_extent(renderer).overlaps(ax.get_tightbbox(renderer))


@pytest.mark.parametrize("page", PAGES)
def test_one_algorithm_and_one_budget_are_enough(page):
    comparison = compare(
        get_problem("bnh"), n_evaluations=32, algorithms={"only": "psi"}, polish=False
    )
    figure = page(comparison)
    render(figure)
    assert len(figure.axes) == (4 if page is indicators_page else 1)
    assert "32 evaluations, one run each" in figure.get_suptitle()


def test_twenty_algorithms_look_different():
    chosen = looks([str(k) for k in range(20)]).values()
    assert len({(look["color"], look["marker"]) for look in chosen}) == 20
    first = list(chosen)[:4]
    for part in ("color", "linestyle", "marker"):
        assert len({look[part] for look in first}) == 4


def test_algorithms_of_the_users_have_the_users_names():
    comparison = compare(
        get_problem("bnh"), n_evaluations=32, seeds=2, polish=False,
        algorithms={"small": lambda n: NSGA2(pop_size=8), "large": lambda n: NSGA2(pop_size=16)},
    )  # fmt: skip
    assert texts(time_page(comparison)) == ["small", "large", "small: single runs"]
    assert "32 evaluations, 2 seeds\n" in time_page(comparison).get_suptitle()


def test_drawing_on_given_axes_leaves_the_settings_alone(bnh):
    before = dict(matplotlib.rcParams)
    ax = Figure().subplots()
    for draw, data in (
        (draw_indicator, indicator_curves(bnh, "epsilon")),
        (draw_times, run_times(bnh)),
        (draw_attainment, attainment(bnh)),
    ):
        ax = Figure().subplots()
        assert draw(data, ax=ax) is ax
        assert len(ax.get_legend().get_texts()) == 3
        assert draw(data, ax=Figure().subplots(), legend=False).get_legend() is None
    ax = Figure().subplots()
    assert draw_front(median_fronts(bnh), "psi", ax=ax) is ax
    for page in PAGES:
        page(bnh)
    assert dict(matplotlib.rcParams) == before
    assert Gcf.get_all_fig_managers() == []


# Files


def test_pages_are_saved(bnh, chute, tmp_path):
    two, four = tmp_path / "two", tmp_path / "four"
    for folder in (two, four):
        folder.mkdir()
    names = ["indicators.png", "fronts.png", "time.png"]
    assert save_comparison(chute, four, dpi=30) == tuple(four / name for name in names)
    names.append("attainment.png")
    assert save_comparison(bnh, two, dpi=30) == tuple(two / name for name in names)
    assert sorted(path.name for path in two.iterdir()) == sorted(names)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in two.iterdir())


def test_no_page_is_saved_if_one_cannot_be_made(bnh, tmp_path, monkeypatch):
    def failing(*arguments):
        raise RuntimeError("no surfaces")

    monkeypatch.setattr("pymoo_psi.plots._comparison_fronts.attainment_surfaces", failing)
    (tmp_path / "fronts.png").write_text("old")
    with pytest.raises(RuntimeError, match="no surfaces"):
        save_comparison(bnh, tmp_path, dpi=30)
    assert [path.name for path in tmp_path.iterdir()] == ["fronts.png"]
    assert (tmp_path / "fronts.png").read_text() == "old"


def test_a_missing_folder_is_told(bnh, tmp_path):
    with pytest.raises(OSError, match="absent"):
        save_comparison(bnh, tmp_path / "absent")
    with pytest.raises(PsiError, match="dpi must be an integer >= 1, got 0"):
        save_comparison(bnh, tmp_path, dpi=0)
