"""The report says what the library says, of any table, as text and nothing else."""

import dataclasses
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import (
    TestTable,
    cautions,
    explain,
    lp_tau,
    rank_of_efficiency,
    representatives,
)
from pymoo_psi._numbers import number
from pymoo_psi.analysis import constraint_costs
from pymoo_psi.files import read_table
from pymoo_psi.report import decision_report
from pymoo_psi.table import Schema


class Reader(HTMLParser):
    """What a browser finds in a document: elements, and the texts of its sections by heading.

    A paragraph, an item of a list and a row of a table are a text each.
    """

    def __init__(self, report):
        super().__init__()
        self.tags, self.attributes, self.texts, self.sections = [], [], [""], {}
        self.feed(report if isinstance(report, str) else report.html())
        self.text = " ".join(text for texts in self.sections.values() for text in texts)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        if tag in ("h1", "h2", "p", "li", "tr", "caption", "figcaption"):
            self.texts.append("")

    def handle_endtag(self, tag):
        if tag in ("h1", "h2"):
            title, self.texts = self.texts.pop(), []
            self.sections[title] = self.texts

    def handle_data(self, data):
        if data.strip() and self.tags[-1] != "style":
            row = self.tags[-1] in ("td", "th") and self.texts[-1]
            self.texts[-1] += (" | " if row else "") + data.strip().replace("\xa0%", " %")


def beams(n=96, **more):
    """Beams by width and height: light and stiff ones are wanted, some break, some have no mesh."""
    X = [20, 40] + lp_tau(n, 2) * [40, 120]
    mass, stiffness = X.prod(axis=1) / 100, X[:, 0] * X[:, 1] ** 3 / 1e4
    schema = Schema.of(
        ["width", "height"], ["mass", "stiffness"], outputs=["stress"], maximize=["stiffness"],
        units={"mass": "kg", "stress": "MPa", "width": "mm"}, lower=[20, 40], upper=[60, 160],
    )  # fmt: skip
    slender = np.flatnonzero(X[:, 1] > 4 * X[:, 0]) + 1
    return TestTable.of(
        range(1, n + 1), X, np.column_stack([mass, -stiffness]), schema=schema,
        outputs={"stress": 3e7 / (X[:, 0] * X[:, 1] ** 2)},
        reasons={int(number): "no mesh: too slender" for number in slender}, **more,
    )  # fmt: skip


LIMITS = {"mass": 55, "stress": 70}
TABLE = beams()
LIMITED = TABLE.under(limits=LIMITS)


def lines(report, title):
    return Reader(report).sections[title]


@pytest.fixture(scope="module")
def beam():
    return decision_report(LIMITED, title="Beams")


@pytest.fixture(scope="module")
def html(beam):
    return beam.html()


def test_the_choice_is_the_librarys_with_its_reasons_and_cautions(beam):
    rows = np.flatnonzero(LIMITED.feasible())
    own = pd.DataFrame(TABLE.F[rows] * [1, -1], columns=["mass", "stiffness"])
    own.index = [f"test {number}" for number in TABLE.numbers[rows]]
    optimum = int(beam.ranking.salukvadze[0])
    ranking = rank_of_efficiency(own, maximize=["stiffness"])
    standing, behind, *steps = explain(ranking, row=optimum, units={"mass": "kg"}).sentences
    said = lines(beam, "Reasons against it")
    assert standing in lines(beam, "The proposal")[1]
    assert behind in said
    assert lines(beam, "Alternatives")[1 : 1 + len(steps)] == steps
    told = [line for line in said if line.startswith("Attention: ")]
    assert told == [f"Attention: {caution}" for caution in cautions(beam.ranking)]


def test_another_design_is_explained_as_itself():
    numbers = TABLE.numbers[LIMITED.feasible()]
    best, other = numbers[LIMITED.feasible_ranking().salukvadze[0]], numbers[-1]
    assert best != other
    report = decision_report(LIMITED, design=int(other))
    said = lines(report, "The choice")
    assert said[0].startswith(f"Test {other} is chosen instead of test {best}: ")
    assert "objective | chosen | proposed | best | worst | behind best" in said
    assert str(report).startswith(f"Report on a choice: test {other} chosen of ")


def test_nothing_is_chosen_until_somebody_has(beam):
    assert "is proposed" in lines(beam, "The proposal")[0]
    assert "chosen" not in str(beam)
    chosen = LIMITED.under(
        replace(LIMITED.decision, chosen=LIMITED.best().names[0], reason="It is cheap.")
    )
    first, *others = lines(decision_report(chosen), "The choice")
    assert "is chosen" in first
    assert "Reason: It is cheap." in others


def test_what_is_known_of_the_design_is_shown_though_others_lack_it():
    """Texts and outputs; the cell of another design is empty."""
    table = TestTable.of([1, 2, 3], [[1], [2], [3]], [[0.0, 4.0], [1.0, 1.0], [4.0, 0.0]])
    table = table.with_notes({"maker": ["", "Smith", ""]})
    assert any("maker: Smith" in t for t in lines(decision_report(table), "The proposal"))
    assert not [t for t in lines(decision_report(table, design=1), "The choice") if "maker" in t]


def test_cautions_say_that_they_are_about_the_optimum():
    """Where another design is chosen they would be taken for its own, and so would their lack."""
    F = [[0.0, 4.0], [1.0, 1.0], [0.5, 1.33], [4.0, 0.0]]
    table = read_table(pd.DataFrame(F, ["V1", "V2", "V3", "V4"], ["a", "b"]))
    own = decision_report(table)
    (best,) = table.best().names
    against = "Reasons against it"
    cautions = [line for line in lines(own, against) if line.startswith("Attention: ")]
    other = lines(decision_report(table, design="V1"), against)
    mark = f"Attention to {best}, the optimum: "
    assert [line.replace(mark, "Attention: ") for line in other if mark in line] == cautions != []


def test_numbers_have_the_decimal_mark_of_their_file(tmp_path):
    path = tmp_path / "offers.csv"
    path.write_text("offer;price;days\nA;4748,36;10\nB;3085,5;39,25\nC;5200,25;8\n", "utf-8")
    report = decision_report(read_table(path))
    assert any(
        line.startswith("price | 4748,36 | 3085,50 |") for line in lines(report, "The proposal")
    )
    assert "days 29,2 higher" in " ".join(lines(report, "Alternatives"))


def test_counts_add_up(beam):
    said, _, _, failures, *_ = lines(beam, "What was tested")
    designs, ok, beyond, failed, front = map(int, re.findall(r"(\d+) [a-zA-Z]", said))
    assert designs == len(TABLE) == failed + beyond + ok
    assert failed == len(TABLE.reasons) > 0
    assert front == LIMITED.pareto().sum()
    assert failures == f"{failed} | no mesh: too slender | test {min(TABLE.reasons)}"


def test_a_limit_costs_what_would_be_had_without_it(beam):
    """The best of all designs that keep the others: what a ranking without the limit has."""
    costs = constraint_costs(LIMITED)
    free = TABLE.under(limits={"stress": 70}).feasible()
    now, then = (TABLE.column("stiffness")[mask].max() for mask in (LIMITED.feasible(), free))
    assert then > now
    assert (
        f"mass<=55 | {costs['rejects']['mass<=55']} | {costs['alone']['mass<=55']} | "
        f"stiffness {number(then, 5)} instead of {number(now, 5)}"
    ) in lines(beam, "What limits cost")


def test_alternatives_are_representatives(beam):
    own = pd.DataFrame(TABLE.F * [1, -1], columns=["mass", "stiffness"], index=TABLE.numbers)
    own = own[LIMITED.feasible()]
    few = representatives(own, 5, maximize=["stiffness"])
    head = " | ".join(f"test {own.index[row]}" for row in few.rows)
    assert f"design | {head}" in lines(beam, "Alternatives")


EVIL = "<script>alert(1)</script> & \"'$x_{$ <b>"


def test_names_reasons_and_titles_are_text():
    schema = Schema.of(
        [f"v {EVIL}"], [f"a {EVIL}", f"b {EVIL}"], [f"g {EVIL}"], units={f"a {EVIL}": EVIL}
    )
    X, F = lp_tau(16, 1), np.column_stack([lp_tau(16, 1)[:, 0], (1 - lp_tau(16, 1)[:, 0]) ** 2])
    reasons = {3: f"{EVIL} \x01"}
    table = TestTable.of(range(1, 17), X, F, X - 0.9, reasons=reasons, schema=schema)
    html = decision_report(table.under(limits={f"a {EVIL}": 0.8}), title=EVIL, about=[EVIL]).html()
    found = Reader(html)
    text = found.text + " ".join(found.sections)
    assert not {"script", "b"} & {*found.tags}
    assert text.count("<script>alert(1)</script> & \"'$x_{$ <b>") > 9
    assert "\x01" not in html
    assert f"{EVIL} \N{REPLACEMENT CHARACTER}" in text


def test_nothing_is_loaded_and_nothing_runs(html):
    found = Reader(html)
    assert not {"script", "link", "iframe", "object"} & {*found.tags}
    for name, value in found.attributes:
        assert name[:2] != "on"
        is_address = name in ("src", "href", "srcset")
        assert not is_address or value.startswith(("data:image/svg+xml;base64,", "#part-"))
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'"
    assert ("content", policy) in found.attributes
    assert not re.search(r"url\(|@import", html)


def test_no_feasible_design_reports_what_stands_in_the_way():
    report = decision_report(beams().under(limits={"mass": 5.0, "stress": 70}))
    assert report.ranking is None
    assert lines(report, "The proposal")[0].startswith("None of 96 tests is feasible")
    least = TABLE.column("mass")[TABLE.status == "ok"].min()
    _, *rows = lines(report, "What limits cost")
    assert [row.rpartition("| ")[2] for row in rows[:2]] == [f"{least:.5g} kg", "kept by some"]


def test_a_limit_on_an_integer_among_variables_of_several_kinds_is_reported():
    X = np.array([[0.5, 2], [0.25, 3]], dtype=object)
    schema = Schema.of(2, 1, kinds=["real", "integer"])
    table = TestTable.of([1, 2], X, [[2.0], [1.0]], schema=schema).under(limits={"x2": 1})
    rows = lines(decision_report(table), "What limits cost")
    assert rows[1].endswith("| 2")


@pytest.mark.parametrize(
    ("X", "F"),
    [
        ([[0.1]], [[2.0]]),  # one design, one objective
        ([[0.1], [0.2], [0.3]], [[2.0], [1.0], [1.0]]),  # one objective, a tie
        ([[0.1], [0.2]], [[1.0, 2.0], [1.0, 2.0]]),  # equal
        ([[0.1], [0.2], [0.3]], [[1.0, 3.0, 0.0], [2.0, 2.0, 0.0], [3.0, 1.0, 0.0]]),  # constant
        (np.empty((3, 0)), [[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]]),  # no variables
        ([{"m": "iron", "n": 3, "on": True}, {"m": "wood", "n": 4, "on": False}], [[1, 2], [2, 1]]),
        ([[1e300], [-1e300]], [[1e300, 0.0], [-1e300, 1e-300]]),
    ],
)
def test_small_and_odd_tables(X, F):
    report = decision_report(TestTable.of(range(1, len(F) + 1), X, F))
    text = Reader(report.html()).text
    assert "Test" in text
    assert "nan" not in text.replace("dominan", "")


@pytest.fixture
def written(tmp_path):
    """A report on a decision of a group, as a file, and the table."""
    names = [f"test {number}" for number in LIMITED.take(LIMITED.pareto()).numbers]
    positions = [
        {"name": "Ann", "date": "2026-01-02", "chosen": names[0], "reason": "light"},
        {"name": "Ben", "date": "2026-01-01", "chosen": names[1], "weights": {"mass": 2.0}},
        {"name": "Ben", "date": "2026-01-03", "chosen": names[2]},
    ]
    decided = {"date": "2026-01-04", "chosen": names[2], "agree": ["Ben"], "dissent": ["Ann"]}
    table = LIMITED.under(
        dataclasses.replace(
            LIMITED.decision,
            positions=positions,
            decided=decided,
            chosen=names[2],
            reason="So be it.",
        )
    )
    report = decision_report(table, title="Beams", prototype=TABLE.take([5]))
    report.save(tmp_path / "report.html")
    return tmp_path / "report.html", table


def test_the_sheet_has_the_decision_of_the_group(written):
    path, table = written
    html = path.read_text("utf-8")
    sheet = html[: html.index("<nav")]
    chosen = table.decision.chosen
    mass, present = table.column("mass")[[table.names.index(chosen), 5]]
    word = "better" if mass < present else "worse"
    for text in (
        f"Decided on 2026-01-04 for {chosen} by Ben.",
        *("Dissent: Ann.", "So be it.", "least greatest regret"),
        f">{float(f'{abs(mass - present):.4g}'):g} {word}<",
    ):
        assert text in sheet
    assert sheet.count("date, signature") == 2
    links = re.findall(r'href="#(part-\d+)"', html)
    assert links == re.findall(r'<h2 id="(part-\d+)"', html)
