"""What every picture keeps to: names as they are written, matplotlib as it was, whole files."""

import subprocess
import sys

import matplotlib
import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf
from matplotlib.figure import Figure

from pymoo_psi import PsiError, plots
from pymoo_psi.plots._style import literal, save_pages, view
from pymoo_psi.table import section_points


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("f1", "f1"),
        ("a\n b", "a b"),
        ("$x$", r"\$x\$"),
        (0.1 + 0.2, "0.3"),
        ("w" * 49 + "1", "w" * 20 + "…" + "w" * 18 + "1"),
    ],
)
def test_names_are_literal(name, text):
    assert literal(name) == text


@pytest.mark.parametrize(
    ("values", "ends"),
    [
        ([], (0, 1)),
        ([0], (-0.5, 0.5)),
        ([4], (3.8, 4.2)),
        ([-2, 0], (-2.1, 0.1)),
        ([np.inf], (0, 1)),
        ([-1.7e308, -2, 0, 1.7e308], (-2.1, 0.1)),
    ],
)
def test_the_view_holds_the_values(values, ends):
    np.testing.assert_allclose(view(np.array(values, dtype=float)), ends)


def test_settings_and_windows_of_matplotlib_are_left_alone(chute, bnh, result):
    before = dict(matplotlib.rcParams)
    X = section_points(chute, 1, "x1", 3)
    pictures = [
        plots.table_page(chute), plots.criteria_page(chute),
        plots.section_page(chute, 1, "x1", X, np.ones((3, 4)), np.zeros((3, 1))),
        plots.draw_histogram(chute, 0), plots.robustness_page(result),
        plots.indicators_page(bnh), plots.draw_indicator(bnh, "epsilon"), plots.time_page(bnh),
        plots.fronts_page(bnh), plots.attainment_page(bnh),
    ]  # fmt: skip
    assert pictures
    assert dict(matplotlib.rcParams) == before
    assert Gcf.get_all_fig_managers() == []


def test_drawing_uses_the_axes_it_is_given(chute, bnh):
    for draw, arguments in (
        (plots.draw_histogram, (chute, 0)),
        (plots.draw_indicator, (bnh, "epsilon")),
    ):
        ax = Figure().add_subplot()
        assert draw(*arguments, ax=ax) is ax
        assert len(ax.get_legend().get_texts()) == 3
        assert draw(*arguments, ax=Figure().add_subplot(), legend=False).get_legend() is None


def test_no_window_system_and_no_pyplot_is_needed():
    code = (
        "import sys; from pymoo_psi import TestTable; from pymoo_psi.plots import table_page;"
        "page = table_page(TestTable.of([1, 2], [[0.1], [0.2]], [[1.0], [2.0]]));"
        "page.savefig(sys.stdout.buffer, format='png'); sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.startswith(b"\x89PNG")


def test_a_notebook_shows_pages_and_axes_of_their_own_in_their_size(mixed):
    page, ax = plots.criteria_page(mixed), plots.draw_histogram(mixed, 0)
    for shown, figure in ((page, page), (ax, ax.figure)):
        picture, size = shown._repr_png_()
        pixels = [int.from_bytes(picture[k : k + 4], "big") for k in (16, 20)]  # of the PNG's head
        wide, high = figure.get_size_inches() * 96
        assert size == {"width": round(wide), "height": round(high)}
        np.testing.assert_allclose(pixels, [2 * wide, 2 * high], atol=1)
    # axes of a figure of the user's are pyplot's to show
    assert not hasattr(plots.draw_histogram(mixed, 0, ax=Figure().add_subplot()), "_repr_png_")


def test_pages_are_saved_all_or_none(tmp_path):
    def pages(*, failing):
        for name in ("one.png", "two.png"):
            yield name, Figure(figsize=(1, 1))
        if failing:
            raise RuntimeError("no third page")

    (tmp_path / "two.png").write_text("old")
    with pytest.raises(RuntimeError, match="no third page"):
        save_pages(pages(failing=True), tmp_path, 20)
    assert [path.name for path in tmp_path.iterdir()] == ["two.png"]
    assert (tmp_path / "two.png").read_text() == "old"
    paths = save_pages(pages(failing=False), tmp_path, 20)
    assert paths == (tmp_path / "one.png", tmp_path / "two.png")
    assert sorted(tmp_path.iterdir()) == sorted(paths)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


def test_a_missing_folder_is_told(tmp_path):
    with pytest.raises(OSError, match="absent"):
        save_pages([], tmp_path / "absent", 20)
    with pytest.raises(PsiError, match="dpi must be an integer >= 1, got 0"):
        save_pages([], tmp_path, 0)
