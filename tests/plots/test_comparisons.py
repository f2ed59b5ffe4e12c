"""The pages of a comparison: their data against slow ways to them, and what the pages say."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from pymoo.core.problem import Problem
from pymoo.problems import get_problem

from pymoo_psi import VectorizedSphereChute
from pymoo_psi.comparison import INDICATORS, compare
from pymoo_psi.plots import (
    plot_fronts,
    plot_indicator,
    plot_indicators,
    save_comparison,
)
from tests.plots.drawn import assert_whole, texts

FIGURES = [plot_indicators, plot_fronts]
ODD = {"a$b$\nc \\alpha": "psi-scrambled", "x" * 80: "nsga3"}


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
def barren():
    return compare(Narrow(0.0), n_evaluations=4, seeds=2, algorithms=ODD, polish=False)


def values(comparison, name, budget, column):
    frame = comparison.to_frame()
    chosen = (frame["algorithm"] == name) & (frame["evaluations"] == budget)
    return frame[column][chosen].to_numpy()


# The indicators


@pytest.mark.parametrize("indicator", INDICATORS)
def test_lines_are_numpys_medians_and_bands_the_quartiles(bnh, indicator):
    ax = Figure().add_subplot()
    plot_indicator(bnh, indicator, ax)
    assert ax.get_yscale() == ("linear" if indicator == "hypervolume" else "log")
    for k, name in enumerate(bnh.algorithms):
        np.testing.assert_array_equal(ax.lines[k].get_xdata(), bnh.evaluations)
        band = {tuple(place) for place in ax.collections[k].get_paths()[0].vertices}
        for j, budget in enumerate(bnh.evaluations):
            of_runs = values(bnh, name, budget, indicator)
            assert len(of_runs) == (1 if name == "psi" else 4)
            assert ax.lines[k].get_ydata()[j] == np.median(of_runs)
            ends = ((0.25, "lower"), (0.75, "higher"))
            assert {(budget, np.quantile(of_runs, q, method=m)) for q, m in ends} <= band


# The fronts


def median_run(comparison, name, budget):
    """The run of median hypervolume, of an even number the lower in the middle."""
    quality = comparison.measures["hypervolume"].tolist()
    mine = [
        (quality[k], k) for k, run in enumerate(comparison.runs)
        if (run.task.algorithm, run.task.n_evaluations) == (name, budget)
    ]  # fmt: skip
    return comparison.runs[sorted(mine)[(len(mine) - 1) // 2][1]]


@pytest.mark.parametrize("budget", [32, 64])
def test_fronts_are_of_the_run_of_median_hypervolume_over_the_reference(bnh, budget):
    union = {tuple(f) for run in bnh.runs for f in run.F.round(9).tolist()}
    axes = plot_fronts(bnh, budget).axes
    for letter, ax, name in zip("abc", axes, bnh.algorithms, strict=True):
        run = median_run(bnh, name, budget)
        reference, front = (line.get_xydata() for line in ax.lines)
        assert len(reference) > 10
        assert {tuple(f) for f in reference.round(9).tolist()} <= union
        np.testing.assert_array_equal(front, run.F)
        seed = "" if run.task.seed is None else f", seed {run.task.seed}"
        assert ax.get_title(loc="left").startswith(f"({letter}) {name}{seed}\n{len(front)} design")


def test_of_more_objectives_each_algorithm_has_a_row(four, tmp_path):
    figure = plot_fronts(four)
    axes = figure.axes
    assert [ax.get_ylabel() for ax in axes] == ["f2", "f3", "f4"] * 2
    assert {ax.get_xlabel() for ax in axes} == {"f1"}
    for column in range(3):
        assert axes[column].get_ylim() == axes[column + 3].get_ylim()
    second = median_run(four, "nsga3", 32).F
    np.testing.assert_array_equal(axes[4].lines[-1].get_xydata(), second[:, [0, 2]])
    assert_whole(figure)
    paths = save_comparison(four, tmp_path, dpi=20, suffix=".svg")
    names = ["indicators", "fronts"]
    assert [path.name for path in paths] == [f"{name}.svg" for name in names]


def test_names_senses_and_units_of_the_problem_are_on_the_axes():
    beam = get_problem("bnh")
    beam.names, beam.maximize, beam.units = {"f1": "cost", "f2": "gain"}, ["gain"], {"cost": "€"}
    comparison = compare(beam, n_evaluations=32, seeds=3, algorithms=["psi", "nsga3"], polish=False)
    for ax in plot_fronts(comparison).axes:
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("cost [€]", "gain (max)")
        reference = ax.lines[0].get_xydata()
        union = {tuple(f) for run in comparison.runs for f in (run.F * [1, -1]).round(9).tolist()}
        assert {tuple(f) for f in reference.round(9).tolist()} <= union
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        assert ((left < reference[:, 0]) & (reference[:, 0] < right)).all()
        assert ((low < reference[:, 1]) & (reference[:, 1] < high)).all()


# All pages


@pytest.mark.parametrize("page", FIGURES)
def test_a_page_is_whole_and_names_problem_and_runs(bnh, page):
    figure = page(bnh)
    assert_whole(figure)
    budgets = "32, 64" if page is plot_indicators else "64"
    assert figure.caption.startswith("BNH: ")
    assert figure.caption.endswith(f". {budgets} evaluations, 4 seeds.")


@pytest.mark.parametrize("page", FIGURES)
def test_where_nothing_was_found_the_pages_say_so(barren, page):
    """The names of the algorithms are odd, and stand as they are."""
    figure = page(barren)
    assert_whole(figure)
    assert texts(figure)[:2] == [r"a\$b\$ c \alpha", f"{'x' * 15}…{'x' * 14}"]
