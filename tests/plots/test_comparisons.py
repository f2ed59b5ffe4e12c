"""The figure of a comparison: its data against slow ways to them, and what it says."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from pymoo_psi.comparison import INDICATORS, compare
from pymoo_psi.plots import plot_indicator, plot_indicators
from tests.helpers.drawn import assert_readable, assert_whole
from tests.helpers.models import Model

INFEASIBLE = Model(lambda x: {"F": [x[0], 1 - x[0]], "G": 1.0}, n_var=2, n_ieq_constr=1)
ODD = {"a$b$\nc \\alpha": "psi-scrambled", "x" * 80: "nsga3"}


def values(comparison, name, budget, column):
    frame = comparison.to_frame()
    chosen = (frame["algorithm"] == name) & (frame["evaluations"] == budget)
    return frame[column][chosen].to_numpy()


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
            for q, method in ((0.25, "lower"), (0.75, "higher")):
                assert (budget, np.quantile(of_runs, q, method=method)) in band


def test_a_page_is_whole_and_names_problem_and_runs(bnh):
    figure = plot_indicators(bnh)
    assert_whole(figure)
    assert_readable(figure)
    assert re.fullmatch(r"BNH: .*\. 32, 64 evaluations, 4 seeds\.", figure.caption)


def test_where_nothing_was_found_the_page_says_so():
    """The names of the algorithms are odd, and stand as they are."""
    figure = plot_indicators(compare(INFEASIBLE, n_evaluations=4, seeds=2, algorithms=ODD))
    assert_whole(figure)
    names = {r"a\$b\$ c \alpha", f"{'x' * 15}…{'x' * 14}"}
    assert {line.get_label() for line in figure.axes[0].lines} == names
    assert figure.axes[1].get_title(loc="right") == "infinite values are not drawn"
