"""What the commands say of a choice is what the library says, in lines that a terminal holds."""

import json

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import (
    CompromiseProgramming,
    Knee,
    Lexicographic,
    ReferencePoint,
    cautions,
    explain,
    rank_of_efficiency,
    representatives,
)
from pymoo_psi.cli import main
from pymoo_psi.selection import HighTradeoff

COST = np.linspace(1, 9, 41)
CARS = pd.DataFrame({"cost, k€": COST, "range": 500 - 3000 / (COST + 1) ** 1.5})


@pytest.fixture
def rank(capsys, tmp_path):
    """Rank a frame; return the exit code, what is printed and what is complained of."""

    def run(frame, *options):
        file = tmp_path / "cars.csv"
        frame.to_csv(file, index=False)
        code = main(["rank", str(file), "--top", "2", *map(str, options)])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def joined(printed):
    return " ".join(printed.split())


@pytest.mark.parametrize("normalize", [True, False])
def test_rank_tells_the_reasons_and_cautions_of_the_library(rank, tmp_path, normalize):
    out = tmp_path / "ranked.json"
    plain = [] if normalize else ["--no-normalize"]
    code, printed, _ = rank(CARS, "--maximize", '"range"', *plain, "--out", out)
    assert code == 0
    frame = CARS.set_axis([f"row {i + 1}" for i in range(len(CARS))])
    ranking = rank_of_efficiency(frame, maximize=["range"], normalize=normalize)
    why = explain(frame, int(ranking.salukvadze[0]), maximize=["range"], normalize=normalize)
    told = [str(caution) for caution in cautions(ranking)]
    for sentence in why.sentences[:2]:
        assert sentence in joined(printed)
    assert [f"Caution: {text}" in joined(printed) for text in told] == [True] * len(told)
    assert bool(told) == (not normalize)  # a range of 957 outweighs one of 8
    assert ("Not normalised: plain distances" in printed) == (not normalize)
    lines = printed.partition("ormalised: ")[2].splitlines()
    assert max(map(len, lines[:-1])) <= 80  # the last one has the name of the file
    content = json.loads(out.read_text("utf-8"))
    assert content["reasons"] == list(why.sentences[: len(content["reasons"])])
    assert content["cautions"] == told


def test_preferences_are_the_selectors(rank):
    names = ["cost, k€", "range"]
    options = {
        "knee": Knee(),
        "tradeoff": HighTradeoff(),
        "chebyshev": CompromiseProgramming(np.inf),
        'chebyshev:"cost, k€=3",range=1': CompromiseProgramming(np.inf, weights=[3, 1]),
        'weights:"cost, k€=1",range=4': CompromiseProgramming(2, weights=[1, 4]),
        'aspire:"cost, k€=6",range=400': ReferencePoint([6, 400]),
        "order:range": Lexicographic(["range"]),
        'order:range,"cost, k€",tolerance=0.02': Lexicographic(names[::-1], tolerance=0.02),
    }
    prefer = [word for entry in options for word in ("--prefer", entry)]
    code, printed, err = rank(CARS, "--maximize", '"range"', *prefer)
    assert (code, err) == (0, "")
    said = joined(printed)
    optimum = rank_of_efficiency(CARS, maximize=["range"]).salukvadze[0]
    found = set()
    for entry, selector in options.items():
        chosen = selector.do(CARS, maximize=["range"]).tolist()
        if not chosen:
            assert f"{entry}: no design stands out." in said
        elif optimum in chosen:
            assert f"{entry}: row {optimum + 1}, the optimum itself." in said
        else:
            assert f"{entry}: row {chosen[0] + 1} against row {optimum + 1}: better in" in said
        found.add(tuple(chosen))
    assert len(found) > 4


def test_a_set_without_a_knee_and_a_tie(rank):
    straight = pd.DataFrame({"a": [0.0, 1, 2], "b": [2.0, 1, 0], "c": [0.0, 0, 0]})
    code, printed, _ = rank(straight, "--prefer", "knee", "--prefer", "order:c")
    assert code == 0
    assert "knee: no design stands out." in printed
    assert "order:c: row 2, the optimum itself. It is the first of 3 that are chosen." in joined(
        printed
    )


def test_representatives(rank):
    code, printed, _ = rank(CARS, "--maximize", '"range"', "--representatives", 3)
    assert code == 0
    few = representatives(CARS, 3, maximize=["range"])
    table = printed.partition("3 for 41 Pareto-optimal designs")[2]
    rows = [line[:6].strip() for line in table.splitlines() if line.startswith("row ")]
    assert rows == [f"row {row + 1}" for row in few.rows]
    assert f"none farther than {few.radius:.3g} from its own" in table


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--prefer", "cheap"], "--prefer must be one of 'aspire', 'chebyshev', 'knee'"),
        (["--prefer", 'aspire:"cost, k€=1",range=400,5'], "range=400,5; decimals have a point"),
        (["--prefer", "weights"], """with a number for every objective, such as weights:"cost, k€=1",range=1, got weights"""),
        (["--prefer", "knee:range"], "--prefer must be just knee, got knee:range"),
        (["--prefer", "weights:range=1"], 'with a number for every objective, such as weights:"cost, k€=1",range=1, got weights:range=1; cost, k€ has none'),
        (["--prefer", 'aspire:"cost, k€=1",range=x'], "--prefer must be with finite numbers, decimals by a point"),
        (["--prefer", 'aspire:"cost, k€=1",range=1_0'], "--prefer must be with finite numbers"),
        (["--prefer", "aspire:range=1,range=2"], "with each objective once"),
        (["--prefer", "aspire:rang=1"], "did you mean 'range'?"),
        (["--prefer", "order:"], "--prefer must be one of"),
        (["--prefer", "order:range,tolerance=3"], "tolerance must be a share from 0 to 1"),
        (["--prefer", 'weights:"cost, k€=-1",range=1'], "weights must be a list of numbers >= 0"),
        (["--representatives", "0"], "--representatives must be an integer >= 1"),
    ],
)  # fmt: skip
def test_mistakes(rank, options, message):
    code, printed, err = rank(CARS, *options)
    assert (code, printed) == (2, "")
    assert message in err


def test_solve_says_in_what_it_measures_and_finds_the_papers_optimum_in_plain_distances(capsys):
    """Table 6.1 has u = (0.2635, 0.1072) for μ = 0.4, which is the test point 3085."""
    assert main(["solve", "chute", "--mu", "0.4", "--model", "rolling", "--no-normalize"]) == 0
    printed = joined(capsys.readouterr().out)
    assert "Not normalised: plain distances, as in the paper" in printed
    assert "Test point 3085 is the Salukvadze optimum" in printed
    assert main(["solve", "chute", "--mu", "0.4", "--model", "rolling"]) == 0
    printed = joined(capsys.readouterr().out)
    assert "Normalised: distances in units of the ranges" in printed
    assert "Test point 3749 is the Salukvadze optimum" in printed


def test_solve_names_designs_without_numbers_by_their_rows(capsys, tmp_path):
    out = tmp_path / "front.csv"
    words = ["solve", "bnh", "--algorithm", "nsga3", "--points", "300", "--out", str(out)]
    assert main(words) == 0
    printed = joined(capsys.readouterr().out)
    assert "Row 1 is the Salukvadze optimum" in printed
    front = pd.read_csv(out)
    why = explain(front[["f1", "f2"]].set_axis([f"row {i + 1}" for i in range(len(front))]), 0)
    assert why.sentences[1] in printed


@pytest.mark.parametrize("problem", ["srn", "kursawe"])
def test_solve_and_rank_have_the_same_reasons_and_cautions(capsys, tmp_path, problem):
    """Without a design of the Pareto set those come into it that it alone dominates."""
    study = str(tmp_path / "tests.db")
    told = []
    for words in (["solve", problem, "--points", "128", "--study", study], ["rank", study]):
        assert main(words) == 0
        text = joined(capsys.readouterr().out)
        start = text.index("Normalised:")
        told.append(text[start:])
    assert told[0] == told[1]
