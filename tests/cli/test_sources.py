"""Every command opens the same sources under the same options, and ranks them as the library."""

import json
import re
import shlex
import shutil
import sys
from html import unescape
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import Decision, Formulation
from pymoo_psi.analysis import convergence, convergence_sentence, sensitivities
from pymoo_psi.cli import main
from pymoo_psi.files import read_table
from pymoo_psi.page import decision_page
from tests.cli.conftest import MODELS, joined
from tests.helpers.draws import rarely
from tests.helpers.exact_csv import EXACT
from tests.helpers.folders import write_files

pytestmark = pytest.mark.usefixtures("undrawn")

COST = np.linspace(1, 9, 41)
CARS = pd.DataFrame(
    {"cost, k€": COST, "range [km]": 500 - 3000 / (COST + 1) ** 1.5, "seats": 5.0, "km": 1 / COST}
)
OBJECTIVES = ["--objectives", '"cost, k€",range [km]']

CASES = {
    "limits": ("beam.db", ["--limits", "mass<=60,80<=height<=180"],
               Formulation(limits={"mass": (None, 60), "height": (80, 180)})),
    "computed": ("beam.db", ["--compute", "stiffness=5 / deflection", "--maximize", "stiffness",
                             "--objectives", "mass,stiffness"],
                 Formulation(["mass", "stiffness"], maximize=["stiffness"],
                             computed={"stiffness": "5 / deflection"})),
    "plain": ("beam.db", ["--no-normalize"], Formulation(normalize=False)),
    "file": ("beam.db", ["--decision", "asked.json", "--limits", "width>=60"],
             Formulation(limits={"mass": (None, 60), "width": (60, None)})),
    "variable": ("beam.db", ["--objectives", "mass,wall", "--maximize", "wall"],
                 Formulation(["mass", "wall"], maximize=["wall"])),
    "csv limits": ("cars.csv", [*OBJECTIVES, "--maximize", "range [km]",
                                "--limits", '"cost, k€<=6",km>=0.2'],
                   Formulation(["cost, k€", "range [km]"], maximize=["range [km]"],
                               limits={"cost, k€": (None, 6), "km": (0.2, None)})),
    "export": ("all.csv", ["--limits", "mass<=60"], Formulation(limits={"mass": (None, 60)})),
    "folder": ("parts", ["--limits", "mass<=60"], Formulation(limits={"mass": (None, 60)})),
}  # fmt: skip
OFTEN = ["limits", "csv limits"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a study, shares of it, an export and a file, which every test copies."""
    folder = tmp_path_factory.mktemp("sources")
    (folder / "models.py").write_text(MODELS, encoding="utf-8")
    solve = ["solve", "models:Beam", "--points", "64", "--study"]
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.syspath_prepend(str(folder))
        assert main([*solve, "beam.db"]) == 0
        for share in ("1/2", "2/2"):
            assert main([*solve, "parts", "--share", share]) == 0
        assert main(["export", "beam.db", "--out", "all.csv"]) == 0
        CARS.to_csv("cars.csv", index=False)
        Decision(Formulation(limits={"mass": (None, 60)})).to_json("asked.json")
    sys.modules.pop("models")
    return folder


@pytest.fixture
def sources(run, made, tmp_path):
    """The folder with the sources."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)


@pytest.mark.parametrize("case", [*OFTEN, *rarely(*sorted(CASES.keys() - {*OFTEN}))])
def test_every_command_gives_the_librarys_answer(sources, said, case, tmp_path):
    path, options, asked = CASES[case]
    table = read_table(path, asked)
    (best,) = table.best().names
    assert f"Proposed: {best}" in said("rank", path, *options, "--out", "ranked.csv")
    ranked = pd.read_csv("ranked.csv", **EXACT)
    number = "test" if "test" in ranked else "row"
    assert sorted(ranked[number]) == table.numbers[table.feasible()].tolist()
    assert sorted(ranked[number][ranked["pareto"]]) == table.numbers[table.pareto()].tolist()
    rows = [table.numbers.tolist().index(n) for n in ranked[number]]
    for name in table.schema.objectives:
        heading = table.schema[name].heading.removesuffix(" (max)")
        assert ranked[heading].tolist() == table.column(name)[rows].tolist()
    assert not [name for name in ranked if "=" in name]  # of limits, as mass<=60
    said("report", path, *options, "--out", "r.html")
    report = unescape((tmp_path / "r.html").read_text("utf-8"))
    assert f">Proposed: {best}</h1>" in report
    plain = re.sub("</?span>", "", report)  # of words, which are not broken
    *_, command = re.findall("<pre>pymoo-psi (.*?)</pre>", plain, re.DOTALL)
    said(*shlex.split(command.replace("\\\n", " ")))  # as a shell joins its lines
    assert unescape((tmp_path / "r.html").read_text("utf-8")) == report
    said("page", path, *options, "--out", "p.html", "--title", "Page")
    page = decision_page(path, asked, title="Page").html()
    written = (tmp_path / "p.html").read_text("utf-8")
    # Of a study, which only the command computes.
    further = re.compile(r'"further":".*?"|16 more tests inside these limits: .*?</code>')
    assert further.sub("", written) == further.sub("", page)
    said("export", path, *options, "--out", "e.csv")
    assert read_table("e.csv").under(normalize=asked.normalize).best().names == [best]
    # What was ranked ranks alike again.
    measure = [] if asked.normalize else ["--no-normalize"]
    assert f"Proposed: {best}" in said("rank", "ranked.csv", *measure)


REFUSED = {
    "ambiguous": ("a,b\n\"1,234\",1\n\"2,345\",0\n", "either 1234 or 1.234"),
    "total": ("name,a,b\nA,1,4\nB,2,3\nC,4,2\nTotal,7,9\n", "set.csv: row 4 (line 5) is named 'Total', as computed from others"),
    "gaps": ("a,b\n1,4\n,3\n3,2\n", "--drop-incomplete"),
    "one objective": ("a,b\n1,x\n2,y\n", "two columns or more must be of numbers"),
    "empty": ("", "it must hold a line of column names"),
    "named as a ranking's": ("name,rank,pareto,cost\nA,1,1,2\nB,2,0,1\n",
                             "got 'pareto'; rename it, or name others by --objectives and"),
}  # fmt: skip


@pytest.mark.parametrize("command", ["rank", "page", "report", "analyze", "export"])
@pytest.mark.parametrize("text", REFUSED)
def test_what_one_command_refuses_all_refuse(said, command, text, tmp_path):
    (tmp_path / "set.csv").write_text(REFUSED[text][0])
    err = said(command, "set.csv", *(["--out", "e.csv"] * (command == "export")), code=2)
    assert err.startswith("pymoo-psi: error: ")
    assert REFUSED[text][1] in err
    assert sorted(tmp_path.iterdir()) == [tmp_path / "models.py", tmp_path / "set.csv"]


def test_a_prototype_is_read_by_the_marks_of_its_own_file(said, tmp_path):
    files = {
        "set.csv": "name;Größe;b\nA;1.250;3\nB;980;4\n".encode("cp1252"),
        "own.csv": "name,Größe,b\nold,1100.5,5\n",
        "same.csv": "name;Größe;b\nold;1.100,5;5\n".encode("cp1252"),
    }
    write_files(tmp_path, files)
    with pd.ExcelWriter(tmp_path / "book.xlsx") as book:
        for sheet in ("cover", "data"):
            pd.read_csv(tmp_path / "own.csv").to_excel(book, sheet_name=sheet, index=False)
    options = ["--decimal", ",", "--encoding", "cp1252", "--out", "r.html", "--prototype"]
    for name in ("own.csv", "same.csv"):
        said("report", "set.csv", *options, name)
        assert ">1100,5<" in (tmp_path / "r.html").read_text("utf-8")
    message = said("report", "set.csv", *options, "book.xlsx", code=2)
    assert "or save it as a file of its own" in joined(message)
    pd.read_csv(tmp_path / "own.csv").to_excel(tmp_path / "set.xlsx", sheet_name="data")
    for name in ("own.csv", "book.xlsx"):
        said("report", "set.xlsx", "--sheet", "data", "--prototype", name, "--out", "r.html")


def decision(**more):
    """A decision as the page saves it."""
    Path("decision.json").write_text(
        json.dumps(
            {"objectives": ["mass", "deflection"], "chosen": "test 7", "reason": "in stock"} | more
        ),
        "utf-8",
    )
    return ["beam.db", "--decision", "decision.json"]


@pytest.mark.parametrize("writer", ["rank", *rarely("export")])
@pytest.mark.parametrize("suffix", ["csv", *rarely("xlsx")])
def test_the_choice_comes_back_with_the_designs(sources, said, writer, suffix):
    """Objectives, directions and units, too: the decision is not asked for again."""
    said(writer, *decision(units={"mass": "kg"}), "--out", f"c.{suffix}")
    for command in ("rank", "report", "page"):
        printed = said(command, f"c.{suffix}")
        assert "Reason: in stock" in printed
        assert "Chosen: test 7" in printed
    assert read_table(f"c.{suffix}").schema.units["mass"] == "kg"


@pytest.mark.parametrize("command", ["rank", "page"])
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"units": {"mass": "t"}}, "kg"),
        ({"units": {"wall": "mm"}}, "--units must be wall=mm, as decided"),
        ({"version": 2}, "its version must be 1"),
        ({"ranges": {"mass": [0, 9]}}, "of every objective"),
        ({"limits": {"other": ["1"]}}, "other"),
        ({"objectives": ["mass", "mass"]}, "objectives must be"),
    ],
)
def test_a_decision_that_does_not_fit_is_a_mistake(sources, said, command, changes, message):
    assert message in said(command, *decision(**changes), "--units", "wall=m", code=2)


def test_a_design_is_chosen_by_its_number(said, tmp_path):
    words = ["report", "set.csv", "--design"]
    (tmp_path / "set.csv").write_text("number,f,g\n3,1,2\n1,2,1\n2,1.5,1.5\n", "utf-8")
    for number, name in ((1, 1), (3, "number 3")):
        assert f"number {number} chosen" in said(*words, name)
    assert "the name of one design" in said(*words, 4, code=2)


def test_tests_are_analyzed_as_by_the_library(sources, said):
    words = ["beam.db", "--limits", "mass<=60"]
    printed = said("analyze", *words, "--out", "analysis")
    table = read_table("beam.db", Formulation(limits={"mass": 60}))
    assert joined(convergence_sentence(convergence(table))) in joined(printed)
    expected = sensitivities(table, ["mass", "deflection", "overstress", "stress"]).reset_index()
    written = pd.read_csv("analysis/sensitivities.csv")
    pd.testing.assert_frame_equal(written, expected, check_dtype=False)


@pytest.mark.parametrize("suffix", ["xlsx", "db"])
def test_export_changes_nothing(sources, said, suffix):
    table = read_table("beam.db")
    for source in ("beam.db", "parts", "all.csv"):
        assert "64 tests (" in said("export", source, "--out", f"o-{source}.{suffix}")
        assert read_table(f"o-{source}.{suffix}").equals(table)


YIELDS = "name,price,yield\nA,5,80\nB,4,70\nC,3,60\n"
COMMAS = "name;price;yield\nA;5,5;80\nB;4;70\nC;3;60\n"


@pytest.mark.parametrize(
    ("text", "limits", "code", "sentence"),
    [
        (YIELDS, "yield>=65", 0, "2 of 3 designs are within the limit (yield at least 65)"),
        (YIELDS, "60 <= yield<=70", 0, "2 of 3 designs are within the limit (yield from 60 to 70)"),
        (YIELDS, "price>=4.125", 0, "1 of 3 designs is within the limit (price at least 4.125)"),
        (
            COMMAS,
            "price>=4.125",
            2,
            "beside decimal commas, got price>=4.125; write 4125 or 4.1250",
        ),
        (COMMAS, "price>=4.1250", 0, "1 of 3 designs is within the limit (price at least 4,125)"),
        (YIELDS, "price<=80%", 2, "and no units"),
    ],
)
def test_limits_are_read_as_the_numbers_of_a_file(said, tmp_path, text, limits, code, sentence):
    (tmp_path / "set.csv").write_text(text)
    for command in (("rank", "--long"), ("report",)):
        assert sentence in joined(said(*command, "set.csv", "--limits", limits, code=code))
