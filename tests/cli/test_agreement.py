"""solve, rank, page and report propose the same design, and give the same places."""

import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import page
from pymoo_psi.table import read_table

LOGIC = Path(page.__file__).with_name("logic.js")
RANKED = """
const Logic = require(process.argv[1])
const data = Logic.decode(JSON.parse(require("fs").readFileSync(0, "utf-8")))
const {state} = Logic.initial(data)
const ranking = Logic.ranked(data, Logic.left(data, state).mask)
const {place, rank, best} = ranking
const order = [...Logic.order(data, ranking, state)]
console.log(JSON.stringify({order, place: [...place].slice(0, data.n), rank: [...rank].slice(0, data.n), best}))
"""


def a_source(rng):
    """A study and the command that made it, or a file; and options for all commands."""
    if rng.random() < 0.4:
        name, limit = [("bnh", "f1<=70"), ("osy", "f2<=90"), ("models:Mixed", "n<=7")][
            rng.integers(3)
        ]
        options = ["--limits", limit] if rng.random() < 0.5 else []
        options += ["--no-normalize"] if rng.random() < 0.3 else []
        solve = ["solve", name, "--points", rng.integers(2, 200), "--study", "s.db", *options]
        return "s.db", [*solve, "--out", "s.csv"], options
    n, m = int(rng.integers(1, 60)), int(rng.integers(2, 5))
    F = rng.random((n, m)) * 10.0 ** rng.integers(-9, 9, m)
    if rng.random() < 0.4:  # ties, and equal designs
        F = np.ceil(rng.random((n, m)) * 4)
    if rng.random() < 0.2:
        F[:, 0] = F[0, 0]
    frame = pd.DataFrame(F, columns=[f"f{j + 1}" for j in range(m)])
    frame.insert(0, "name", [f"D{i}" for i in rng.permutation(n)])
    frame["more"] = rng.random(n)
    frame.to_csv("s.csv", index=False)
    options = ["--objectives", ",".join(frame.columns[1 : m + 1])]
    options += ["--maximize", "f2"] if rng.random() < 0.5 else []
    options += ["--limits", f"more<={rng.uniform(0.3, 1):.4f}"] if rng.random() < 0.5 else []
    options += ["--no-normalize"] if rng.random() < 0.3 else []
    return "s.csv", None, options


def placed(path):
    """The designs of a file by number, in their order; 0 for those without a place."""
    frame = pd.read_csv(path).fillna({"place": 0}).astype({"place": int})
    return frame.set_index("test_point" if "test_point" in frame else "row")


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
@pytest.mark.parametrize("seed", [*range(4), 518])  # its first half has no hypervolume
def test_all_commands_agree(run, tmp_path, undrawn, seed):
    path, solve, options = a_source(np.random.default_rng(seed))
    solved = 0 if solve is None else run(*solve)[0]
    code, _, err = run("rank", path, *options, "--out", "r.csv")
    if solved == 1 or code == 2:  # then no command has anything to propose
        assert (code, "no feasible design" in err) == (2, True)
        assert run("report", path, *options)[0] == 1
        return
    assert (solved, code, err) == (0, 0, "")
    ranked = placed("r.csv")
    assert ranked["place"].gt(0).tolist() == ranked["pareto"].tolist()
    front = ranked[ranked["pareto"]]
    assert front["place"].tolist() == front["mu1"].round(12).rank(method="min").tolist()
    best, names = ranked.index[ranked["place"] == 1].tolist(), read_table(path)
    names = dict(zip(names.numbers.tolist(), names.names, strict=True))
    if solve is not None:
        columns = ["place", "efficiency_rank"]
        assert placed("s.csv")[columns].equals(front[columns])
    assert run("page", path, *options)[0] == 0
    text = re.search('id="payload">(.*?)</script>', (tmp_path / "page.html").read_text("utf-8"))[1]
    done = subprocess.run(
        ["node", "-e", RANKED, LOGIC], input=text, text=True, capture_output=True, check=True
    )
    found, shown = json.loads(done.stdout), json.loads(text)["names"]
    on_page = {}
    for row, name in enumerate(shown):
        if found["rank"][row] >= 0:
            on_page[name] = (found["place"][row], found["rank"][row])
    pairs = zip(ranked["place"], ranked["efficiency_rank"], strict=True)
    assert on_page == dict(zip([names[n] for n in ranked.index], pairs, strict=True))
    assert [shown[row] for row in found["order"]] == [names[n] for n in front.index]
    assert {shown[i] for i in found["best"]} == {names[n] for n in best}
    assert run("report", path, *options)[0] == 0
    report = unescape((tmp_path / "report.html").read_text("utf-8"))
    assert f"{names[best[0]].capitalize()} is proposed; no design is chosen." in report
    # A design that is chosen instead is called by its place.
    last, tied = front.index[-1], front["place"].value_counts()
    if front["place"].iloc[-1] > 1:
        assert run("report", path, *options, "--design", names[last])[0] == 0
        report = unescape((tmp_path / "report.html").read_text("utf-8"))
        place = len(front) + 1 - tied[front["place"].iloc[-1]]
        words = f"has place {place} of {len(front)} Pareto-optimal designs"
        assert f"{names[last].capitalize()} {words}".lower() in report.lower()
