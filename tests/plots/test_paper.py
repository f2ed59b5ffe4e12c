"""The paper's figures: what their axes say and hold."""

import matplotlib
import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf

from pymoo_psi.chute import ChuteParameters, trajectory
from pymoo_psi.paper import Reproduction, solve_case
from pymoo_psi.plots import paper_figures
from tests.helpers.drawn import assert_whole
from tests.helpers.draws import rarely


@pytest.fixture(scope="module")
def case():
    return solve_case(0.4, "rolling", 512)


@pytest.fixture(scope="module")
def figures(case):
    before, found = dict(matplotlib.rcParams), {}
    for name, figure in paper_figures(Reproduction(512, (case,)), model="rolling"):
        assert dict(matplotlib.rcParams) == before  # also between two of them
        found[int(name.removeprefix("figure_"))] = figure
    assert Gcf.get_all_fig_managers() == []
    return found


@pytest.mark.parametrize("number", [4, *rarely(2, 3, 5, 6, 7, 8)])
def test_a_page_is_whole_and_names_the_model(figures, number):
    figure = figures[number]
    assert round(figure.get_figwidth() * 25.4) == 180
    assert "rolling model" in figure.caption
    assert_whole(figure, draw=number > 2)


def test_points_are_drawn_by_rank_the_optimum_on_top(case, figures):
    whole, detail = figures[4].axes
    drawn = np.concatenate([line.get_xydata() for line in whole.lines])
    assert sorted(map(tuple, drawn)) == sorted(map(tuple, case.designs.X))
    assert {ax.get_xlabel() for ax in figures[4].axes} == {r"$u_1$, slope $\tan\,\alpha$"}
    star = whole.lines[-1]
    assert star.get_zorder() == max(line.get_zorder() for line in whole.lines)
    np.testing.assert_array_equal(star.get_xydata(), case.designs.X[case.ranking.salukvadze])
    for line, near in zip(whole.lines[1:], detail.lines[1:], strict=True):  # all that is ranked
        np.testing.assert_array_equal(line.get_xydata(), near.get_xydata())


def test_curves_of_motion_stop_at_the_transition(case, figures):
    way = trajectory(*case.designs.X[case.ranking.salukvadze[0]], ChuteParameters(mu=0.4))
    for ax in figures[7].axes[:5]:
        *curves, transition = ax.lines
        assert transition.get_xdata() == [way.slip_end, way.slip_end]
        for curve in curves:
            (gap,) = np.flatnonzero(np.isnan(curve.get_xdata()))
            assert curve.get_xdata()[gap - 1] == curve.get_xdata()[gap + 1] == way.slip_end
    friction = figures[7].axes[3].lines[0].get_ydata()[: way.slipping.sum()]
    np.testing.assert_array_equal(friction, way.friction[way.slipping, 0])
