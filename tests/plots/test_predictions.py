"""The page of predictions: every proposal of a surrogate at what was expected and found."""

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import PsiError
from pymoo_psi.plots import plot_predictions
from tests.plots.drawn import assert_whole, shown, texts


@pytest.fixture
def frame():
    random = np.random.default_rng(0)
    columns = {"test_point": np.arange(21, 41), "round": np.repeat([1, 2], 10)}
    columns["surrogate"] = ["gaussian process"] * 10 + ["radial functions"] * 9 + [""]
    columns["status"] = ["ok"] * 19 + ["failed"]
    for name in ("f1", "f$2", "g1", "a very long name of a criterion that goes on and on"):
        columns[name] = random.normal(size=20)
        columns[f"{name}_predicted"] = columns[name] + 0.1
        columns[f"{name}_deviation"] = 0.1
    return pd.DataFrame(columns)


def test_every_proposal_is_where_it_was_expected_and_found(frame):
    figure = plot_predictions(frame, title="Beams")
    panels = shown(figure)
    assert [ax.get_title() for ax in panels[:2]] == ["f1", r"f\$2"]
    assert len(panels) == 4
    drawn = np.vstack([dots.get_offsets() for dots in panels[0].collections])
    np.testing.assert_array_equal(drawn, frame[["f1_predicted", "f1"]][:19])
    assert texts(figure) == ["gaussian process", "radial functions"]
    assert figure.get_suptitle() == "Beams\n19 proposals in 2 rounds, the later the darker"
    assert_whole(figure, draw=True)


def test_values_that_no_axis_holds_are_left_out(frame):
    frame.loc[2:4, "f1"] = [np.nan, np.inf, -1.7e308]
    frame["f$2"], frame["g1_predicted"] = np.nan, 1.7e308
    figure = plot_predictions(frame)
    dots = np.vstack([dots.get_offsets() for dots in shown(figure)[0].collections])
    assert np.isfinite(dots).all(axis=1).sum() == 16
    assert_whole(figure, draw=True)


def test_what_cannot_be_drawn_is_told(frame):
    for wrong in (frame[:0], frame[["round"]], frame[19:]):
        with pytest.raises(PsiError, match="predictions must be of at least one tested proposal"):
            plot_predictions(wrong)
    with pytest.raises(PsiError, match="predictions must be a DataFrame"):
        plot_predictions(None)
