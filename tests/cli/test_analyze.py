"""``pymoo-psi analyze`` prints and writes what the functions give."""

import numpy as np
import pandas as pd
import pytest
from pymoo.problems import get_problem

from pymoo_psi import Restricted, TestTable, investigate, lp_tau
from pymoo_psi.cli import main
from pymoo_psi.errors import PsiError
from pymoo_psi.table import Formulation, convergence, feasibility_rules, sensitivities


@pytest.mark.parametrize("suffix", [".db", ".parquet"])
def test_all_tests_are_analyzed(tmp_path, capsys, suffix):
    # a name that would be no formula of matplotlib's
    study, file = tmp_path / "$bnh_$.db", tmp_path / f"$bnh_${suffix}"
    table = investigate(get_problem("bnh"), 64, study=study)
    if suffix != ".db":
        assert main(["export", str(study), "--out", str(file)]) == 0
        file = file.rename(tmp_path / "bnh.tests")  # by its content, as rank reads it
        capsys.readouterr()
    words = ["analyze", str(file), "--limits", "f2=25"]
    out = tmp_path / "new" / "folder"
    assert main(words if suffix == ".parquet" else [*words, "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    for rule in feasibility_rules(table, {"f2": 25}).rules:
        assert f"  {rule}\n" in printed
    assert convergence(table, {"f2": 25}).verdict() in " ".join(printed.split())
    found = sensitivities(table)
    row = next(line for line in printed.splitlines() if line.startswith("x1  "))
    index = found.loc[("f1", "x1"), "first_order"]
    assert row.removeprefix("x1").strip().startswith(f"{index:.2f} ± ")
    if suffix == ".parquet":
        return
    names = [
        "convergence.csv",
        "convergence.png",
        "feasibility.png",
        "sensitivities.csv",
        "sensitivities.png",
    ]
    assert sorted(path.name for path in out.iterdir()) == names
    written = pd.read_csv(out / "sensitivities.csv", index_col=["column", "variable"])
    pd.testing.assert_frame_equal(written, found, rtol=1e-12)


def test_tests_are_analyzed_under_a_formulation(tmp_path, capsys):
    table = investigate(get_problem("bnh"), 64)
    table.to_csv(tmp_path / "bnh.csv")
    words = [
        "analyze",
        str(tmp_path / "bnh.csv"),
        "--criterion",
        "ratio=f1/f2",
        "--limits",
        "x1<=2",
    ]
    assert main(words) == 0
    printed = capsys.readouterr().out
    asked = Formulation(
        objectives=["f1", "f2", "ratio"], computed={"ratio": "f1/f2"}, limits={"x1": 2}
    )
    under = table.under(asked)
    assert convergence(under).verdict() in " ".join(printed.split())
    for rule in feasibility_rules(under).rules:
        assert f"  {rule}\n" in printed
    heads = printed.splitlines()[1].split()
    assert heads == ["variable", "f1", "f2", "ratio", "g1", "g2"]


def test_mistakes_are_told_in_a_line(tmp_path, capsys):
    TestTable.of([1, 2], [[0.0], [1.0]], [[1.0], [2.0]]).to_csv(tmp_path / "few.csv")
    (tmp_path / "front.csv").write_text("f1,f2\n1,2\n2,1\n")
    for words, message in (
        (["few.csv"], "f1 must be known of 44 tests or more, got 2 finite values"),
        (["few.csv", "--limits", "f9=1"], "--limits must be one of 'f1', 'x1', got 'f9'"),
        (["absent.db"], "absent.db: No such file or directory"),  # as by rank
        (["front.csv"], "a table of tests, of solve --study or export, got designs without"),
    ):
        assert main(["analyze", str(tmp_path / words[0]), *words[1:]]) == 2
        assert message in capsys.readouterr().err


def test_combined_tests_are_no_longer_investigation(tmp_path, capsys):
    """Half of them are another box, so that nothing follows from the first half."""
    whole = investigate(get_problem("bnh"), 64)
    part = investigate(Restricted(get_problem("bnh"), {"x1": (0, 2)}), 64)
    TestTable.combined({"whole": whole, "part": part}).to_csv(tmp_path / "all.csv")
    words = ["analyze", str(tmp_path / "all.csv"), "--out", str(tmp_path / "out")]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert "2 experiments, whole, part" in printed
    assert "more tests are" not in printed.lower()
    assert not list((tmp_path / "out").glob("convergence*"))
    with pytest.raises(PsiError, match="of one experiment, got whole, part"):
        convergence(TestTable.read_csv(tmp_path / "all.csv"))


def test_of_many_criteria_no_hypervolume_is_waited_for(tmp_path, capsys):
    points = lp_tau(64, 3)
    F = np.abs(points[:, [0]] - np.linspace(0, 1, 12))  # no test dominates another
    file = tmp_path / "many.csv"
    TestTable.of(np.arange(1, 65), points, F).to_csv(file)
    assert main(["analyze", str(file), "--out", str(tmp_path / "out")]) == 0
    assert "is not told: with more than 7 criteria the hypervolume" in capsys.readouterr().out
    assert sorted(path.name for path in (tmp_path / "out").glob("*.png")) == [
        "feasibility.png", "sensitivities.png",
    ]  # fmt: skip
