"""Figures of sensitivities."""

import numpy as np

from pymoo_psi.analysis import sensitivities
from pymoo_psi.plots import plot_sensitivities
from tests.helpers.drawn import assert_whole, shown


def test_bars_are_the_indices_and_lines_their_bands(osy):
    found = sensitivities(osy, ["f1", "f2", "g4", "g6"])
    figure = plot_sensitivities(found, title="OSY")
    assert [ax.get_title(loc="left") for ax in shown(figure)] == ["f1", "f2", "g4", "g6"]
    names = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    for ax in shown(figure):
        part = found.loc[ax.get_title(loc="left")]
        assert names == part.index.tolist()
        assert ax.get_ylim() == figure.axes[0].get_ylim()  # one name, at the left, for all beside
        widths = [bar.get_width() for bar in ax.containers[0]]
        np.testing.assert_allclose(widths, np.maximum(part["first_order"], 0))
        (bands,) = ax.collections
        ends = np.array(bands.get_segments())[..., 0]
        np.testing.assert_allclose(ends, part[["lower", "upper"]].clip(0, 1))
    assert_whole(figure)
