"""What every figure keeps to: names as they are written, matplotlib as it was, whole files."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from pymoo_psi import plots
from pymoo_psi.plots import save_figures
from tests.helpers.refusals import refused


def test_a_notebook_shows_figures_in_their_size(mixed):
    figure = plots.plot_objectives(mixed)
    picture, size = figure._repr_png_()
    pixels = [int.from_bytes(picture[k : k + 4], "big") for k in (16, 20)]  # of the PNG's head
    wide, high = figure.get_size_inches() * 96
    assert size == {"width": round(wide), "height": round(high)}
    np.testing.assert_allclose(pixels, [2 * wide, 2 * high], atol=1)


def test_figures_are_saved_all_or_none(tmp_path):
    def figures(*, failing):
        for name in ("one", "two"):
            yield name, Figure(figsize=(1, 1))
        if failing:
            raise RuntimeError("no third figure")

    (tmp_path / "two.png").write_text("old")
    with pytest.raises(RuntimeError, match="no third figure"):
        plots.save_figures(figures(failing=True), tmp_path, dpi=20)
    assert [path.name for path in tmp_path.iterdir()] == ["two.png"]
    assert (tmp_path / "two.png").read_text() == "old"
    paths = plots.save_figures(figures(failing=False), tmp_path, dpi=20)
    assert sorted(tmp_path.iterdir()) == sorted(paths)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)
    never = (pytest.fail("a figure was drawn in vain") for _ in range(1))
    with pytest.raises(OSError, match="two.png"):
        plots.save_figures(never, tmp_path / "two.png", dpi=20)
    refused("suffix must be one of ", plots.save_figures, never, tmp_path, dpi=20, suffix=".mp3")


def test_figures_for_journals(tmp_path):
    """TrueType fonts in PDF, the width in mm, and the figure as it was."""
    figure = Figure(figsize=(7.0, 3.5))
    figure.add_subplot().set_title("Title")
    (path,) = save_figures([("one", figure)], tmp_path / "new" / "folder", suffix=".pdf", width=90)
    content = path.read_bytes()
    assert (b"/Type0" in content, b"/Type3" in content) == (True, False)
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+)", content)
    assert float(box[1]) / 72 * 25.4 == pytest.approx(90, abs=0.1)
    assert figure.get_size_inches().tolist() == [7.0, 3.5]
    assert figure.axes[0].title.get_fontsize() == Figure().add_subplot().title.get_fontsize()
