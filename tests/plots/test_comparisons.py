"""The pages of a comparison: their data against slow ways to them, and what the pages say."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import Problem
from pymoo.problems import get_problem

from pymoo_psi import PsiError, VectorizedSphereChute
from pymoo_psi.comparison import INDICATORS, compare
from pymoo_psi.pareto import attainment_surfaces
from pymoo_psi.plots import (
    _comparison,
    attainment_page,
    differences_page,
    draw_indicator,
    fronts_page,
    indicators_page,
    save_comparison,
    time_page,
)
from pymoo_psi.plots._comparison import (
    attained_surfaces,
    difference_curves,
    indicator_curves,
    looks,
    median_runs,
    reference_front,
    steps,
)
from tests.plots.drawn import assert_whole, texts

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
def four():
    """Of a problem with four objectives."""
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
    frame = comparison.to_frame()
    chosen = (frame["algorithm"] == name) & (frame["evaluations"] == budget)
    return frame[column][chosen].to_numpy()


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
        draw_indicator(bnh, "epsilom")


def test_only_positive_distances_have_a_logarithmic_axis(bnh):
    curves = indicator_curves(bnh, "igd_plus")
    everywhere = dict.fromkeys(("lower", "median", "upper"), curves.median + np.inf)
    assert curves.logarithmic
    assert not dataclasses.replace(curves, lower=0 * curves.lower).logarithmic
    assert not dataclasses.replace(curves, **everywhere).logarithmic
    assert not indicator_curves(bnh, "hypervolume").logarithmic
    assert draw_indicator(bnh, "igd_plus").get_yscale() == "log"
    assert draw_indicator(bnh, "hypervolume").get_yscale() == "linear"


def test_infinite_values_are_left_out_and_said_so(sparse):
    curves = indicator_curves(sparse, "epsilon")
    assert np.isinf(curves.median[:, 0]).all()
    assert np.isfinite(curves.lower[:, 1]).all()
    ax = draw_indicator(sparse, "epsilon")
    for line, median in zip(ax.lines, curves.median, strict=True):
        drawn = line.get_ydata()
        assert np.isnan(drawn[0])
        assert drawn[1] == median[1] or np.isinf(median[1])
    medians = int(np.isinf(curves.median).sum())
    quartiles = int(np.isinf([curves.lower, curves.upper]).sum())
    said = f"infinite, not drawn: {medians} medians, {quartiles} quartiles"
    assert ax.get_title(loc="right") == said
    assert draw_indicator(sparse, "hypervolume").get_title(loc="right") == ""


def segments(ax):
    """The whiskers of each algorithm, ``(algorithms, budgets, 2 ends, 2)``."""
    return np.array([c.get_segments() for c in ax.collections if isinstance(c, LineCollection)])


def test_whiskers_join_the_quartiles_beside_each_other(bnh):
    curves = indicator_curves(bnh, "epsilon")
    ax = draw_indicator(bnh, "epsilon")
    whiskers = segments(ax)
    np.testing.assert_array_equal(whiskers[..., 0, 1], curves.lower)
    np.testing.assert_array_equal(whiskers[..., 1, 1], curves.upper)
    x = whiskers[..., 0, 0]
    assert (x[:-1] < x[1:]).all()
    assert (x[-1, :-1] < x[0, 1:]).all()  # and apart from those of the next budget
    low, high = ax.get_xlim()
    assert low < x.min() < x.max() < high
    for line, k in zip(ax.lines, range(3), strict=True):
        np.testing.assert_array_equal(line.get_xydata(), np.transpose([x[k], curves.median[k]]))


# The differences


def test_differences_are_the_medians_of_all_pairs_of_runs(bnh):
    for indicator in INDICATORS:
        curves = difference_curves(bnh, indicator, "nsga3")
        ratio = curves.shown == "ratio"
        assert curves.algorithms == ("psi", "psi-scrambled")
        assert ratio == (indicator != "hypervolume")
        for i, name in enumerate(curves.algorithms):
            for j, budget in enumerate(curves.evaluations):
                a, b = (values(bnh, which, budget, indicator) for which in ("nsga3", name))
                pairs = np.array([y / x if ratio else y - x for x in a for y in b])
                expected = np.exp(np.median(np.log(pairs))) if ratio else np.median(pairs)
                assert curves.median[i, j] == pytest.approx(expected)


def test_differences_are_drawn_in_the_colours_of_the_other_pages(bnh):
    figure = differences_page(bnh, "psi-scrambled")
    assert texts(figure)[:3] == ["psi", "nsga3", "no difference from psi-scrambled"]
    colours = [looks(bnh.algorithms)[name]["color"] for name in ("psi", "nsga3")]
    for ax in figure.axes:
        assert [line.get_color() for line in ax.lines[:2]] == colours
        assert set(ax.lines[2].get_ydata()) == {0 if "difference" in ax.get_ylabel() else 1}
    with pytest.raises(PsiError, match="to must be one of .*got 'psy'; did you mean 'psi'"):
        differences_page(bnh, "psy")


def test_infinite_values_have_differences_and_no_ratios(sparse):
    curves = difference_curves(sparse, "igd_plus", "nsga3")
    assert curves.shown == "difference"
    assert np.isnan(curves.median[0, 0])  # neither found anything: no difference is known
    lost = int((~np.isfinite(curves.median)).sum())
    assert curves.left_out.startswith(f"infinite, not drawn: {lost} difference")
    assert "quartile" not in curves.left_out
    assert_whole(differences_page(sparse))


@pytest.mark.parametrize("least", [0.56, 0.06, 1.1])
def test_a_narrow_range_of_a_logarithmic_axis_has_ticks(bnh, least):
    measures = bnh.measures.assign(epsilon=np.linspace(least, 2.4 * least, len(bnh.measures)))
    ax = draw_indicator(dataclasses.replace(bnh, measures=measures), "epsilon")
    low, high = ax.get_ylim()
    assert ax.get_yscale() == "log"
    assert sum(low <= tick <= high for tick in ax.get_yticks()) >= 2


def test_differences_that_are_all_above_0_keep_the_line_of_none(bnh):
    measures = bnh.measures.assign(
        igd_plus=np.where(bnh.measures["algorithm"] == "psi", 0.0, 0.5 + bnh.measures["igd_plus"])
    )
    worse = dataclasses.replace(bnh, measures=measures)
    assert (difference_curves(worse, "igd_plus", "psi").median > 0).all()
    ax = differences_page(worse, "psi").axes[1]
    assert ax.get_yscale() == "linear"
    assert ax.get_ylim()[0] <= 0


def test_ticks_stand_at_the_budgets_and_crowded_ones_have_no_text(bnh):
    budgets = (16, 17, 64, 1024)
    runs = tuple(
        dataclasses.replace(run, task=dataclasses.replace(run.task, n_evaluations=n))
        for run, n in zip(bnh.runs[:1] * 4, budgets, strict=True)
    )
    measures = pd.concat([bnh.measures.iloc[:1]] * 4).assign(evaluations=budgets)
    ax = draw_indicator(dataclasses.replace(bnh, runs=runs, measures=measures), "hypervolume")
    assert ax.get_xticks().tolist() == list(budgets)
    assert [text.get_text() for text in ax.get_xticklabels()] == ["16", "", "64", "1024"]


def test_of_one_budget_the_algorithms_stand_beside_each_other(four):
    ax = draw_indicator(four, "hypervolume")
    places = [line.get_xdata()[0] for line in ax.lines]
    low, high = ax.get_xlim()
    assert low < places[0] < 32 < places[1] < high
    assert [text.get_text() for text in ax.get_xticklabels()] == ["32"]


# The fronts


@pytest.mark.parametrize("budget", [32, 64])
def test_fronts_are_of_the_run_of_median_hypervolume(bnh, budget):
    for name, row in zip(bnh.algorithms, median_runs(bnh, budget), strict=True):
        task = bnh.runs[row].task
        assert (task.algorithm, task.n_evaluations) == (name, budget)
        quality = values(bnh, name, budget, "hypervolume")
        expected = np.quantile(quality, 0.5, method="lower")
        assert bnh.measures["hypervolume"].iloc[row] == expected


@pytest.mark.parametrize("assess", ["evaluated", "returned"])
def test_fronts_are_what_is_assessed_over_the_reference(bnh, assess):
    comparison = dataclasses.replace(bnh, assess=assess)
    for ax, row in zip(fronts_page(comparison).axes, median_runs(bnh, 64), strict=True):
        run = bnh.runs[row]
        reference, front = (line.get_xydata() for line in ax.lines)
        np.testing.assert_array_equal(reference, reference_front(bnh))
        np.testing.assert_array_equal(front, run.F if assess == "evaluated" else run.returned)
        name, found = ax.get_title(loc="left").split("\n")
        seed = "" if run.task.seed is None else f", seed {run.task.seed}"
        assert name == f"{run.task.algorithm}{seed}"
        assert found.startswith(f"{len(front)} design")


def test_the_reference_is_in_the_units_of_the_objectives(bnh, four):
    for comparison in (bnh, four):
        union = {tuple(f) for run in comparison.runs for f in run.F.round(9).tolist()}
        front = reference_front(comparison)
        assert len(front) > 10
        assert {tuple(f) for f in front.round(9).tolist()} <= union


def test_an_objective_that_is_the_same_everywhere_has_a_place(bnh):
    flat = dataclasses.replace(bnh.reference.frame, nadir=bnh.reference.frame.ideal)
    reference = dataclasses.replace(bnh.reference, frame=flat)
    assert (reference_front(dataclasses.replace(bnh, reference=reference)) == flat.ideal).all()


def test_fronts_have_common_axes_that_show_all_of_them(bnh):
    axes = fronts_page(bnh).axes
    assert len(axes) == len(bnh.algorithms)
    assert len({(ax.get_xlim(), ax.get_ylim()) for ax in axes}) == 1
    (low, high), (bottom, top) = axes[0].get_xlim(), axes[0].get_ylim()
    for ax in axes:
        for line in ax.lines:
            x, y = line.get_data()
            assert ((low < x) & (x < high) & (bottom < y) & (y < top)).all()


def test_of_more_objectives_each_algorithm_has_a_row(four):
    figure = fronts_page(four)
    axes = figure.axes
    assert [ax.get_ylabel() for ax in axes] == ["f2", "f3", "f4"] * 2
    assert {ax.get_xlabel() for ax in axes} == {"f1"}
    for column in range(3):
        assert axes[column].get_ylim() == axes[column + 3].get_ylim()
    second = four.runs[median_runs(four, 32)[1]].F
    np.testing.assert_array_equal(axes[4].lines[-1].get_xydata(), second[:, [0, 2]])
    assert_whole(figure)


# The attainment surfaces


def test_surfaces_are_those_of_the_runs_of_an_algorithm(sparse):
    surfaces = attained_surfaces(sparse, 40)
    for name in sparse.algorithms:
        tasks = [run.task for run in sparse.runs]
        fronts = [
            run.F for run, task in zip(sparse.runs, tasks, strict=True)
            if (task.algorithm, task.n_evaluations) == (name, 40)
        ]  # fmt: skip
        assert len(fronts) == 5
        for percent, surface in attainment_surfaces(fronts, [25.0, 50.0, 75.0]).items():
            np.testing.assert_array_equal(surfaces[name][percent], surface)


def test_steps_are_the_edge_of_what_is_attained():
    surface = np.array([[1.0, 4.0], [2.0, 3.0], [5.0, 1.0]])
    edge = steps(surface, 6.0, 7.0)
    assert edge.tolist() == [[1, 7], [1, 4], [2, 4], [2, 3], [5, 3], [5, 1], [6, 1]]
    assert steps(np.zeros((0, 2)), 6.0, 7.0).tolist() == [[6, 7]]


def test_a_band_says_how_far_the_runs_are_from_the_reference_set(bnh):
    """At a place of the front the reference set, both objectives made worse by the distance."""
    ax = attainment_page(bnh).axes[-1]
    assert ax.get_title(loc="left") == "nsga3"
    place, median = ax.lines[0].get_data()
    frame = bnh.reference.frame
    fronts = [frame.scaled(run.F) for run in bnh.runs if str(run.task).startswith("nsga3, 64")]
    assert len(fronts) == 4

    def reached(points, t):
        """How far along the diagonal through (t/2, -t/2) a point of the set is attained."""
        return min(max(a - t / 2, b + t / 2) for a, b in points)

    for t, distance in list(zip(place, median, strict=True))[::20]:
        of_runs = sorted(reached(front, t) for front in fronts)
        # half of four runs attain what the second best of them does
        assert distance == pytest.approx(of_runs[1] - reached(bnh.reference.points, t))


def test_names_senses_and_units_of_the_problem_are_on_the_axes():
    beam = get_problem("bnh")
    beam.names, beam.maximize, beam.units = {"f1": "cost", "f2": "gain"}, ["gain"], {"cost": "€"}
    comparison = compare(beam, n_evaluations=32, seeds=3, algorithms=["psi", "nsga3"], polish=False)
    for page in (fronts_page, attainment_page):
        ax = page(comparison).axes[0]
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("cost [€]", "gain (max)")
        reference = ax.lines[0].get_xydata()
        union = {tuple(f) for run in comparison.runs for f in (run.F * [1, -1]).round(9).tolist()}
        assert {tuple(f) for f in reference.round(9).tolist()} <= union
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        assert ((left < reference[:, 0]) & (reference[:, 0] < right)).all()
        assert ((low < reference[:, 1]) & (reference[:, 1] < high)).all()
    edge = attainment_page(comparison).axes[0].lines[1].get_xydata()
    assert (np.diff(edge[:, 0]) >= 0).all()  # from the least cost
    assert (np.diff(edge[:, 1]) >= 0).all()  # and the least gain, to more of both


def test_other_numbers_of_objectives_have_no_surfaces(four):
    message = (
        "comparison must be of a problem with two objectives, got 4 objectives; "
        "fronts_page shows any number"
    )
    with pytest.raises(PsiError, match=message):
        attainment_page(four)


# The times


def test_times_are_those_of_the_runs(bnh):
    lines = iter(time_page(bnh).axes[0].lines)
    for name in bnh.algorithms:
        runs, medians = next(lines), next(lines)
        seconds = [run.seconds for run in bnh.runs if run.task.algorithm == name]
        assert runs.get_xdata().tolist() == seconds
        for j, budget in enumerate(bnh.evaluations):
            for data, column in zip(medians.get_data(), ("seconds", "hypervolume"), strict=True):
                assert data[j] == np.median(values(bnh, name, budget, column))


# All pages


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_whole_and_names_problem_runs_and_what_is_assessed(bnh, page):
    figure = page(bnh)
    assert_whole(figure)
    what, runs, assessed = figure.get_suptitle().split("\n")
    assert what.startswith("BNH: ")
    budgets = "32 and 64" if page in (indicators_page, time_page) else "64"
    assert runs == f"{budgets} evaluations, 4 seeds (one run of psi)"
    assert assessed == "assessed: all feasible designs that a run evaluated"


def test_a_page_says_that_only_returned_designs_are_assessed(bnh):
    heading = time_page(dataclasses.replace(bnh, assess="returned")).get_suptitle()
    assert heading.endswith("\nassessed: the designs that a run returned")


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
    """The names of the algorithms are odd, and stand as they are."""
    figure = page(barren)
    assert_whole(figure)
    said = [text.get_text() for ax in figure.axes for text in ax.texts]
    if page is fronts_page:
        assert said == ["nothing found"] * 3
    else:
        assert texts(figure)[:3] == ["_under", r"a\$b\$ c \alpha", f"{'x' * 15}…{'x' * 14}"]
    if page is attainment_page:
        assert said == ["fewer than half of\nthe runs found any"] * 3
    if page is indicators_page:
        notes = [ax.get_title(loc="right") for ax in figure.axes]
        assert notes == ["", *["infinite, not drawn: 3 medians, 6 quartiles"] * 3]


def test_one_algorithm_and_one_budget_are_enough():
    comparison = compare(
        get_problem("bnh"), n_evaluations=32, algorithms={"only": "psi"}, polish=False
    )
    for page in PAGES:
        figure = page(comparison)
        assert_whole(figure)
        assert len(figure.axes) == {indicators_page: 4, attainment_page: 2}.get(page, 1)
        assert "32 evaluations, one run each" in figure.get_suptitle()


def test_twenty_algorithms_look_different():
    chosen = looks([str(k) for k in range(20)]).values()
    assert len({(look["color"], look["marker"]) for look in chosen}) == 20
    first = list(chosen)[:4]
    for part in ("color", "linestyle", "marker"):
        assert len({look[part] for look in first}) == 4


def test_algorithms_of_the_users_have_the_users_names_also_where_they_begin_alike():
    names = ["n" * 40 + end for end in ("1", "2")]
    comparison = compare(
        get_problem("bnh"), n_evaluations=32, seeds=2, polish=False,
        algorithms=dict.fromkeys(names, lambda n: NSGA2(pop_size=8)),
    )  # fmt: skip
    page = time_page(comparison)
    assert texts(page) == [f"{'n' * 15}…{'n' * 13}{end}" for end in "12"] + ["small: single runs"]
    assert "32 evaluations, 2 seeds\n" in page.get_suptitle()


def test_pages_of_more_objectives_are_saved_without_attainment(four, tmp_path, monkeypatch):
    for page in ("indicators_page", "differences_page", "fronts_page", "time_page"):
        monkeypatch.setattr(_comparison, page, lambda *args: Figure(figsize=(1, 1)))
    paths = save_comparison(four, tmp_path, dpi=20, suffix=".svg")
    names = ["indicators", "differences", "fronts", "time"]
    assert [path.name for path in paths] == [f"{name}.svg" for name in names]
    assert sorted(tmp_path.iterdir()) == sorted(paths)
