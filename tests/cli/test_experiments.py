"""``pymoo-psi reproduce`` and ``compare``: what they write is the library's."""

import pandas as pd
import pytest
from pymoo.problems import get_problem

from pymoo_psi import compare
from pymoo_psi.cli import _experiments


@pytest.fixture(autouse=True)
def drawn(monkeypatch):
    """Where figures would be drawn: drawing is tested with the plots, and takes most of the time."""
    drawn = []
    monkeypatch.setattr(
        _experiments, "save_figures", lambda figures, out, *_, **options: drawn.append(out.name)
    )
    return drawn


def test_the_papers_tables_are_written_and_printed(said, drawn, tmp_path):
    printed = said("reproduce", "--out", "new/folder", "--points", 64)
    assert sorted(drawn) == ["folder", "rolling"]
    out = tmp_path / "new" / "folder"
    assert sorted(path.name for path in out.glob("*.csv")) == ["table_6_1.csv", "table_6_2.csv"]
    table = pd.read_csv(out / "table_6_1.csv")
    assert table.loc[table["model"] == "rolling", "paper_f1"].tolist() == [1.9829, 2.0454, 2.0454]
    assert list(pd.read_csv(out / "table_6_2.csv").columns) == list(table.columns)
    assert printed.count("1.9829") == (table["paper_f1"] == 1.9829).sum()


def test_a_comparison_is_the_librarys_and_goes_on(run, said, tmp_path):
    words = ["compare", "bnh", "--evaluations", "16,32", "--seeds", 2, "--out", "tables"]
    code, printed, err = run(*words, "--algorithms", "psi,nsga3")
    assert (code, err) == (0, "")
    result = compare(
        get_problem("bnh"), n_evaluations=[16, 32], seeds=2, algorithms=["psi", "nsga3"]
    )
    kept = ["algorithm", "evaluations", "hypervolume", "igd_plus", "epsilon"]
    runs = pd.read_csv(tmp_path / "tables" / "runs.csv")
    expected = result.to_frame()[kept]
    pd.testing.assert_frame_equal(runs[kept], expected, check_dtype=False, rtol=1e-9)
    assert "BNH: medians over the runs" in printed
    for name in ("summary.csv", "tests.csv", "runs"):
        assert (tmp_path / "tables" / name).exists()
    said(*words, "--algorithms", "psi,nsga3,psi-scrambled")
    assert len(pd.read_csv(tmp_path / "tables" / "runs.csv")) == len(runs) + 4


@pytest.mark.parametrize(("words", "out"), [([], "comparison_BNH"), (["--out", "t"], "t")])
def test_an_interrupted_comparison_says_how_to_go_on(run, monkeypatch, words, out):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("pymoo_psi.comparison._comparison.in_parallel", interrupted)
    code, printed, err = run("compare", "bnh", "--evaluations", 16, "--seeds", 1, *words)
    assert (code, printed) == (130, "")
    line = err.splitlines()[-1]
    assert line == (
        f"pymoo-psi: interrupted; finished runs are kept in {out}; the same command continues"
    )


def test_small_probabilities_of_tests_are_not_zero(said, tmp_path):
    """Two algorithms of which every run differs; what the columns are is said."""
    words = ["zdt1", "--evaluations", 256, "--seeds", 9, "--algorithms", "psi-scrambled,nsga3"]
    printed = said("compare", *words, "--out", "out")
    table = pd.read_csv(tmp_path / "out" / "tests.csv")
    p = table.loc[table["indicator"] == "hypervolume", "p_holm"].item()
    assert 0 < p < 0.0005
    assert f"{p:.2g}" in printed
    assert "rank-sum test" in printed
    assert "of all evaluated designs" in printed
