"""The ranking in the terminal: every number against slow loops in exact fractions, and its size."""

import json
import random
import re
import shlex
from fractions import Fraction
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pymoo_psi.files import read_table
from pymoo_psi.page import decision_page
from pymoo_psi.table import Decision
from tests.helpers.processes import posix
from tests.helpers.ranked import Ranked

COST = re.compile(r"(\S+) in (\w+) \((\S+) %")


def random_table(seed):
    """Names, objectives with at most two decimals, which of them are maximised, and a limit."""
    dice = random.Random(seed)
    n, m = dice.randint(2, 14), dice.randint(2, 4)
    objectives = [f"f{j}" for j in range(m)]
    rows = {}
    for i in range(n):
        values = [Fraction(dice.randint(0, 10 ** dice.randint(2, 4)), 100) for _ in range(m)]
        rows[f"D{i}"] = dict(zip(objectives, values, strict=True))
    maximize = [name for name in objectives if dice.random() < 0.4]
    limit = sorted(values["f0"] for values in rows.values())[dice.randint(n // 2, n - 1)]
    return rows, objectives, maximize, limit


@pytest.mark.parametrize("seed", range(40))
def test_all_numbers_are_those_of_the_definition(seed, said, tmp_path):
    rows, objectives, maximize, limit = random_table(seed)
    pd.DataFrame(rows).T.astype(float).to_csv(tmp_path / "set.csv", index_label="name")
    words = ["rank", "set.csv", "--limits", f"f0<={float(limit)}"]
    printed = said(*words, *(["--maximize", ",".join(maximize)] if maximize else []))
    signs = {name: -1 if name in maximize else 1 for name in objectives}
    within = {name: row for name, row in rows.items() if row["f0"] <= limit}
    oracle = Ranked(within, signs)
    order, distance = oracle.front, oracle.distance

    head, table, sentences = printed.split("\n\n")
    counts = re.findall(r"\d+ of \d+|; \w+ of them", " ".join(head.split()))
    assert counts[0] == f"{len(within)} of {len(rows)}"
    optimal = "none" if len(order) == len(within) else len(order)
    assert counts[1:] == ([f"; {optimal} of them"] if len(within) > 1 else [])
    heading, *cells = [line.split() for line in table.splitlines()]
    arrows = ["↑" if sign < 0 else "↓" for sign in signs.values()]
    assert heading[2:] == [w for pair in zip(objectives, arrows, strict=True) for w in pair]
    shown = [line for line in cells if line[0].isdigit()]
    for place, name, *values in shown:
        assert list(map(Fraction, values)) == [*rows[name].values()]
        nearer = [other for other in order if distance(other) < distance(name)]
        assert int(place) == 1 + len(nearer)
    assert shown[0][1] in order
    hidden = len(order) - len(shown)
    assert [line[1] for line in cells if line[0] == "…"] == ([str(hidden)] if hidden else [])
    ends = {"best": oracle.best, "worst": oracle.worst}
    for word, *values in cells[-2:]:
        assert list(map(Fraction, values)) == [*ends.pop(word).values()]

    said_of = " ".join(sentences.split())
    proposed = re.match(r"Proposed: (\w+)", said_of)[1]
    assert distance(proposed) == distance(order[0])
    costs = COST.findall(
        said_of.partition("What it costs against the best: ")[2].partition(". ")[0]
    )
    shares = oracle.shares(proposed)
    expected = sorted((name for name in objectives if shares[name]), key=shares.get, reverse=True)
    assert sorted(name for _, name, _ in costs) == sorted(expected[:4])
    for amount, name, share in costs:
        assert float(amount) == pytest.approx(float(oracle.lost(proposed, name)), rel=6e-3)
        assert float(share) == pytest.approx(float(100 * shares[name]), abs=0.5)
    leading = re.search(r"the best in ([^.]*?)\.", said_of)
    named = re.split(", | and ", leading[1]) if leading else []
    if len(order) > 1:
        assert named == [n for n in objectives if not shares[n] and oracle.range(n)]
    assert max(map(len, printed.splitlines())) <= 80


@pytest.mark.parametrize("columns", [40, 60, 80, 200])
def test_texts_are_cut_to_the_terminal_but_no_number(columns, said, tmp_path, monkeypatch):
    rng = np.random.default_rng(columns)
    names = [f"objective with a very long name {j}" for j in range(9)]
    F = rng.uniform(size=(30, 9)) * 10.0 ** rng.integers(-8, 9, 9)
    offers = [f"{'a name of many letters ' * 4}{i}" for i in range(30)]
    pd.DataFrame(F, offers, names).to_csv(tmp_path / "wide.csv", index_label="offer")
    monkeypatch.setenv("COLUMNS", str(columns))
    printed = said("rank", "wide.csv")
    assert max(map(len, printed.splitlines())) <= columns
    table = printed.split("\n\n")[1].splitlines()
    n_shown = table[0].count("↓")
    folded = re.search(r"… (\d+) more objectives?: --long", printed)
    assert n_shown + (int(folded[1]) if folded else 0) == 9
    for line in table:
        if line.split()[0].isdigit():
            row = int(re.search(r"(\d+)  ", line[7:])[1])
            values = re.split(" +", line.replace("\N{NO-BREAK SPACE}", ""))[-n_shown:]
            np.testing.assert_allclose(np.array(values, float), F[row, :n_shown], rtol=0.05)
    assert said("rank", "wide.csv", "--long").count("↓") == 9


def test_a_test_has_one_name_everywhere_and_keeps_it_while_its_study_grows(said, undrawn):
    words = ["solve", "bnh", "--study", "s.db"]
    said(*words, "--points", "16")
    first = read_table("s.db")
    Decision(chosen=first.best().names[0]).to_json("chosen.json")
    said(*words, "--points", "+8", "--algorithm", "surrogate")
    table = read_table("s.db")
    assert table.names[:16] == first.names
    places = zip(table["run"], table["test_point"], strict=True)
    later = [f"test {run}.{point}" for run, point in places if run == 2]
    assert table.names[16:] == later == [f"test 2.{point}" for point in range(1, 9)]
    for row, (name, number) in enumerate(zip(table.names, table.numbers.tolist(), strict=True)):
        for design in (name, name.removeprefix("test "), number):
            assert table.row_of(design) == row

    texts = [
        said("rank", "s.db", "--long", "--decision", "chosen.json", "--out", "ranked.csv"),
        said("rank", "ranked.csv", "--long"),
        said("report", "s.db", "--design", "2.4", "--out", "report.html"),
        Path("report.html").read_text("utf-8"),
        decision_page(table, title="s").html(),
    ]
    assert f"Chosen: {first.best().names[0]}." in texts[0]
    assert all("2.4" in text for text in texts)
    assert "100000" not in "".join(texts[:4])
    assert "s.db: test 2.4 chosen of" in texts[2]


def test_a_decision_of_other_directions_is_refused(said):
    """Of a page that minimised what a ranking maximised."""
    Path("cars.csv").write_text("car,price,range\nTown,20,200\nLane,24,310\nCountry,30,400\n")
    said("rank", "cars.csv", "--maximize", "range", "--out", "ranked.csv")
    page = {"objectives": ["price", "range"], "chosen": "Town", "page": {"values": {}}}
    Path("d.json").write_text(json.dumps(page))
    refusal = said("rank", "ranked.csv", "--decision", "d.json", code=2)
    assert "the same directions as the designs, got range maximized" in refusal


NAMES = {
    "an objective": ("row,cost,mass\n5,1,4\n3,2,2\n9,3,1\n", "row,cost", {"row": [3, 5, 9]}),
    "a text": ("name,row,cost,mass\nA,upper,1,4\nB,lower,2,2\nC,upper,3,1\n", "cost,mass",
               {"row": ["lower", "upper", "upper"]}),
    "two columns": ("name,mu1,mu1 (source),a,b\nA,1,5,1,2\nB,2,6,2,1\n", "a,b",
                    {"mu1 (source) (source)": [1, 2], "mu1 (source)": [5, 6]}),
    "a town": ("place,cost,mass\nBonn,1,4\nUlm,1.5,2\nBern,3,1\n", "cost,mass",
               {"row": [1, 2, 3], "place (source)": ["Bonn", "Ulm", "Bern"]}),
    "a rank": ("name,rank,pareto,cost\nA,1,1,2\nB,2,0,1\n", "rank,cost", {"rank": [1, 2]}),
    "decimals": ("name,a,b\nA,1.125,4.125\nB,2.375,3.125\nC,3.125,2.375\n", "a,b",
                 {"a": [1.125, 2.375, 3.125]}),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_no_column_takes_the_name_of_another_and_the_ranking_comes_back(said, name):
    text, objectives, columns = NAMES[name]
    first, *_ = columns
    Path("set.csv").write_text(text)
    printed = said("rank", "set.csv", "--objectives", objectives, "--long", "--out", "o.csv")
    assert pd.read_csv("o.csv")[[*columns]].sort_values(first).to_dict("list") == columns
    again = said("rank", "o.csv", "--long")
    assert re.findall("Proposed: .*", again) == re.findall("Proposed: .*", printed)


ODD_NAMES = ['"a" $HOME.csv', "a\\b.csv"]  # Windows has no such names


@pytest.mark.parametrize(
    "name",
    ["a b.csv", "it's.csv", *(pytest.param(name, marks=posix) for name in ODD_NAMES)],
)
def test_the_next_command_runs_as_it_is_printed(in_folder, said, name):
    Path(name).write_text("car,range, price\nA,1,2\nB,2,4\n")
    asked = ["--limits", "range<=9, price<=9", "--compute", "cost=price*2", "--maximize", "range"]
    _, following = said("rank", f"./{name}", *asked).split("Next: ")
    assert said(*shlex.split(following.replace("\\\n", ""))[1:]).endswith("in a browser.\n")


def test_designs_that_share_a_label_are_called_alike_in_all_lines(in_folder, said):
    Path("dup.csv").write_text("name,cost,mass\nA,2,4\nB,1,5\nA,4,1\nname C,3,3\nB,9,9\n")
    printed = said("rank", "dup.csv", "--limits", "cost<=3", "--long")
    assert "\nA #1  " in printed
    assert "name C  " in printed
    assert "Proposed: A #1" in printed
    Path("codes.csv").write_text("id,cost,mass\n01067,2,4\n01069,1,5\n")
    assert "\n    1  01067  " in said("rank", "codes.csv")
