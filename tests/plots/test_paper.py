"""The paper's figures: what their axes say and hold."""

import matplotlib
import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf

from pymoo_psi import PsiError
from pymoo_psi.chute import ChuteParameters, trajectory
from pymoo_psi.paper import Reproduction, solve_case
from pymoo_psi.plots import paper_figures, plot_points, save_paper_figures
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


@pytest.mark.parametrize("number", range(2, 9))
def test_a_page_is_whole_and_names_the_model(figures, number):
    figure = figures[number]
    assert round(figure.get_figwidth() * 25.4) == 180
    assert "rolling model" in figure.get_suptitle()
    assert_whole(figure, draw=number > 6)


def test_points_are_drawn_by_rank_the_optimum_on_top(case, figures):
    whole, detail = figures[4].axes
    drawn = np.concatenate([line.get_xydata() for line in whole.lines])
    assert sorted(map(tuple, drawn)) == sorted(map(tuple, case.X))
    star = whole.lines[-1]
    assert star.get_marker() == "*"
    assert star.get_zorder() == max(line.get_zorder() for line in whole.lines)
    np.testing.assert_array_equal(star.get_xydata(), case.X[case.ranking.salukvadze])
    for line, near in zip(whole.lines[1:], detail.lines[1:], strict=True):  # all that is ranked
        np.testing.assert_array_equal(line.get_xydata(), near.get_xydata())
        assert line.get_marker() != whole.lines[0].get_marker()


def test_a_curve_of_the_motion_is_interrupted_at_the_transition(case, figures):
    way = trajectory(*case.X[case.ranking.salukvadze[0]], ChuteParameters(mu=0.4))
    for ax in figures[7].axes[:5]:
        *curves, transition = ax.lines
        assert transition.get_xdata() == [way.slip_end, way.slip_end]
        for slip, roll in zip(curves[::2], curves[1::2], strict=True):
            assert slip.get_xdata()[-1] == roll.get_xdata()[0] == way.slip_end
            assert slip.get_color() == roll.get_color()
    friction = figures[7].axes[3].lines[0]
    np.testing.assert_array_equal(friction.get_ydata(), way.friction[way.slipping, 0])


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
def test_figures_are_written_in_each_format(case, tmp_path, suffix, start):
    options = {"model": "rolling", "numbers": [4, 7], "dpi": 30, "suffix": suffix}
    paths = save_paper_figures(Reproduction(512, (case,)), tmp_path, **options)
    assert [path.name for path in paths] == [f"figure_4{suffix}", f"figure_7{suffix}"]
    assert all(path.read_bytes().startswith(start) for path in paths)
    with pytest.raises(PsiError, match=r"suffix must be .*got '\.jpg'"):
        save_paper_figures(Reproduction(512, (case,)), tmp_path, model="rolling", suffix=".jpg")


def test_the_plot_points_shows_what_is_missing_and_what_doubling_brought(case):
    reproduction = Reproduction(512, (case,))
    figure = plot_points(reproduction)
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
        plot_points(Reproduction(4, (solve_case(0.4, "rolling", 4),)))
