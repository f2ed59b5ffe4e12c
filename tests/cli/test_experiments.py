"""``pymoo-psi reproduce`` and ``compare``: what they write is the library's."""

import pandas as pd
import pytest
from pymoo.problems import get_problem

from pymoo_psi import compare
from pymoo_psi._numbers import number

pytestmark = pytest.mark.usefixtures("unplotted")


def test_a_comparison_is_the_librarys_and_goes_on(said, tmp_path):
    words = ["compare", "bnh", "--evaluations", "16,32", "--seeds", 2, "--out", "tables"]
    said(*words, "--algorithms", "psi,nsga3")
    result = compare(
        get_problem("bnh"), n_evaluations=[16, 32], seeds=2, algorithms=["psi", "nsga3"]
    )
    kept = ["algorithm", "evaluations", "hypervolume", "igd_plus", "epsilon"]
    runs = pd.read_csv(tmp_path / "tables" / "runs.csv")
    pd.testing.assert_frame_equal(runs[kept], result.to_frame()[kept], check_dtype=False, rtol=1e-9)
    said(*words, "--algorithms", "psi,nsga3,psi-scrambled")
    assert len(pd.read_csv(tmp_path / "tables" / "runs.csv")) == len(runs) + 4


@pytest.mark.parametrize(("words", "out"), [([], "comparison_BNH"), (["--out", "t"], "t")])
def test_an_interrupted_comparison_says_how_to_go_on(run, monkeypatch, words, out):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("pymoo_psi.comparison._comparison.in_parallel", interrupted)
    code, printed, err = run("compare", "bnh", "--evaluations", 16, "--seeds", 1, *words)
    assert (code, printed) == (130, "")
    kept = f"finished runs are kept in {out}; the same command continues"
    assert err.splitlines()[-1] == f"pymoo-psi: interrupted; {kept}"


@pytest.mark.slow
def test_small_probabilities_of_tests_are_not_zero(said, tmp_path):
    """Two algorithms of which every run differs."""
    words = ["zdt1", "--evaluations", 256, "--seeds", 9, "--algorithms", "psi-scrambled,nsga3"]
    printed = said("compare", *words, "--out", "out")
    p = pd.read_csv(tmp_path / "out" / "tests.csv", index_col="indicator").loc[
        "hypervolume", "p_holm"
    ]
    assert 0 < p < 0.0005
    assert number(p) in printed
