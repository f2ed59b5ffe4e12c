"""The page of designs under uncertainty: the data of the most robust designs, by name."""

import dataclasses

import numpy as np
import pytest

from pymoo_psi import PsiError
from pymoo_psi.plots import plot_robustness
from tests.plots.drawn import assert_whole


def test_the_page_shows_the_most_robust_designs_the_best_on_top(result):
    labels = [f"no. {i}" for i in range(40)]
    figure = plot_robustness(result, top=4, labels=labels, title="Forty chutes")
    best = result.order[:4]
    shares, regret = figure.axes
    for ax in (shares, regret):
        assert [text.get_text() for text in ax.get_yticklabels()] == [labels[i] for i in best]
        assert ax.get_ylim()[0] > ax.get_ylim()[1]
    assert "32 scenarios (%)" in shares.get_xlabel()
    widths = {bars.get_label(): [bar.get_width() for bar in bars] for bars in shares.containers}
    np.testing.assert_allclose(widths["Salukvadze optimum"], 100 * result.optimum_share[best])
    np.testing.assert_allclose(widths["rank 5 or 6"], 100 * result.efficient_share[best])
    np.testing.assert_allclose(widths["infeasible"], 100 * result.infeasible_share[best])
    drawn = {line.get_label(): line.get_xdata() for line in regret.lines}
    np.testing.assert_array_equal(drawn["mean"], result.mean_regret[best])
    np.testing.assert_array_equal(drawn["worst scenario"], result.worst_regret[best])
    title = figure.get_suptitle()
    assert title.startswith("Forty chutes\nuncertain: mu from 0.3")
    assert ", c from 0.2" in title
    assert_whole(figure, draw=True)


def test_all_designs_stand_under_their_rows_if_there_are_no_more(result):
    shares, _ = plot_robustness(result, top=1000).axes
    names = [text.get_text() for text in shares.get_yticklabels()]
    assert names == [str(i) for i in result.order]


def test_designs_that_are_never_feasible_have_no_regret_to_draw(result):
    nan, one = np.full(40, np.nan), np.ones(40)
    none = dataclasses.replace(
        result, optimum_share=0 * one, efficient_share=0 * one, infeasible_share=one,
        mean_regret=nan, worst_regret=nan,
    )  # fmt: skip
    assert_whole(plot_robustness(none, top=3))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"labels": ["a"]}, "labels must be 40 names, got 1"),
        ({"top": 0}, "top must be an integer >= 1"),
    ],
)
def test_what_cannot_be_drawn_is_told(result, options, message):
    with pytest.raises(PsiError, match=message):
        plot_robustness(result, **options)
    with pytest.raises(PsiError, match="robustness must be a Robustness, got DataFrame"):
        plot_robustness(result.to_frame())


def test_names_are_literal_and_many_parameters_stay_on_the_page(result):
    parameters = [f"load$_{j}$ of {{a}}" for j in range(8)]
    many = dataclasses.replace(result, parameters=parameters, scenarios=np.ones((32, 8)))
    labels = [f"$x_$ {i} of forty designs" for i in range(40)]
    figure = plot_robustness(many, top=2, labels=labels)
    for text, i in zip(figure.axes[0].get_yticklabels(), many.order, strict=False):
        assert text.get_text().startswith(rf"\$x_\$ {i}")
    assert r"load\$_7\$ of {a} from 1 to 1" in " ".join(figure.get_suptitle().split())
    assert_whole(figure, draw=True)
