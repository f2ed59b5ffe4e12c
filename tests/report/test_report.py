"""The report says what the library says, of any table, as text and nothing else."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import Decision, Formulation, TestTable, cautions, lp_tau, representatives
from pymoo_psi.analysis import separation_sentences
from pymoo_psi.files import read_table
from pymoo_psi.report import decision_report
from pymoo_psi.table import Schema
from tests.helpers.draws import rarely, seeds
from tests.helpers.ranked import Ranked
from tests.helpers.refusals import refused


class Reader(HTMLParser):
    """What a browser finds in a document: elements, and the texts of its sections by heading.

    A paragraph, an item and a row of a table are a text each. The first sheet has the title
    "sheet" until its first heading.
    """

    def __init__(self, report):
        super().__init__()
        self.tags, self.attributes, self.texts, self.sections = [], [], [""], {}
        self.sections["sheet"] = self.texts
        self.feed(report if isinstance(report, str) else report.html())
        self.text = " ".join(text for texts in self.sections.values() for text in texts)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        self.role = dict(attrs).get("role", "")
        if tag in ("h1", "h2", "h3", "p", "tr", "caption", "figcaption") or self.role == "row":
            self.texts.append("")
        elif self.texts[-1:] > [""] and (tag in ("td", "th") or self.role in CELLS):
            self.texts[-1] += " | "

    def handle_endtag(self, tag):
        if tag == "h2":
            title, self.texts = self.texts.pop(), []
            self.sections[title] = self.texts

    def handle_data(self, data):
        if data.strip() and self.texts and self.tags[-1] != "style":
            self.texts[-1] += re.sub(r"\s+", " ", data)


CELLS = ("cell", "columnheader", "rowheader")


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


undrawn = pytest.mark.usefixtures("undrawn")

TABLE = beams()
LIMITED = TABLE.under(limits={"mass": 55, "stress": 70})


def lines(report, title):
    return Reader(report).sections[title]


@pytest.fixture(scope="module")
def beam():
    return decision_report(LIMITED, title="Beams")


@pytest.fixture(scope="module")
def html(beam):
    return beam.html()


LARGER = ("battery", "speed")  # of these more is better
NAMES = ("price", "battery", "speed")


def offers(seed, n=14):
    rng = np.random.default_rng(seed)
    frame = pd.DataFrame(
        {
            "price": rng.integers(800, 2000, n),
            "battery": rng.uniform(8, 16, n).round(1),
            "speed": rng.integers(1, 9999, n),
        },
        [f"P{i}" for i in range(n)],
    )
    return frame[~frame.duplicated()]


def ranked(frame, most=np.inf, **least):
    """The designs of a frame with a price of at most a limit, and at least other values, ranked."""
    within = frame[frame["price"] <= most]
    for column, value in least.items():
        within = within[within[column] >= value]
    return Ranked(within.to_dict("index"), {name: 1 - 2 * (name in LARGER) for name in NAMES})


def is_written(text, value):
    """Whether a text is a number, rounded to its last digit."""
    text = "".join(text.split()).replace("−", "-").rstrip("%")
    factor, _, power = text.partition("e")
    unit = 10.0 ** (int(power or 0) - len(factor.partition(".")[2]))
    return abs(float(text) - value) <= 0.5000001 * unit


@pytest.mark.parametrize("seed", seeds(12))
@undrawn
def test_the_sheet_says_what_a_slow_oracle_finds(seed):
    frame = offers(seed)
    most = int(frame["price"].quantile(0.7))
    table = read_table(frame, Formulation(list(NAMES), maximize=LARGER, limits={"price": most}))
    oracle = ranked(frame, most)
    proposed, shares = oracle.front[0], oracle.shares(oracle.front[0])
    sections = Reader(decision_report(table, question="Which?")).sections
    # What it costs is the sentence of the terminal, see cli/test_ranking.py.
    assert sections["sheet"][1:3] == ["Which?", f"Proposed: {proposed}"]
    assert f"among the {len(oracle.rows)} designs within the limit." in sections["sheet"][3]
    rows = [row.split(" | ") for row in sections["Values"][1:4]]
    for name, (heads, worst, _, best, value, share) in zip(NAMES, rows, strict=True):
        assert heads.startswith(name)
        assert ("more" if name in LARGER else "less") in heads
        expected = oracle.worst[name], oracle.best[name], oracle.rows[proposed][name]
        assert all(map(is_written, (worst, best, value), expected))
        assert is_written(share, 100 * shares[name])
    others = len(oracle.front) - 1
    ticks = re.search(r"the other(?: (\d+) designs| design) that no other", sections["Values"][4])
    assert others == (int(ticks[1] or 1) if ticks else 0)
    # A step: every difference of the two designs is named, in its direction.
    texts = sections.get("One step away", [])
    for title, text in zip(texts[::2], texts[1::2], strict=True):
        other = title.partition(":")[0]
        better, worse = re.findall(CHANGE, title), re.findall(CHANGE, text)
        assert len(better + worse) == sum(frame.loc[other] != frame.loc[proposed])
        for k, (name, amount, word) in enumerate(better + worse):
            difference = frame.loc[other, name] - frame.loc[proposed, name]
            assert is_written(amount, abs(difference))
            assert (word == "higher") == (difference > 0)
            assert (k < len(better)) == ((word == "higher") == (name in LARGER))
    # The limit: what it rejects, what is proposed without it, and at which value another one is.
    (title, text, *_) = [t for key in sections for t in sections[key] if "Limits" in key]
    assert title == f"price at most {most}"
    assert text.startswith(f"Rejects {len(frame) - len(oracle.rows)} of {len(frame)} designs.")
    free = ranked(frame)
    then = "the proposal is the same" if free.front[0] == proposed else f"{free.front[0]} is"
    assert f"Without it {then}" in text
    lower = sorted({row["price"] for row in oracle.rows.values()})
    tighter = [
        price for price in lower if price < most and ranked(frame, price).front[0] != proposed
    ]
    edge = lower[lower.index(tighter[-1]) + 1] if tighter else lower[0]
    then = f"{ranked(frame, tighter[-1]).front[0]} is proposed" if tighter else "no design is left"
    # Limits on the others: which of them no design can exceed.
    said = sections.get("The proposal changes with a limit", [])
    best = []
    for name in ("battery", "speed"):
        values = {row[name] for row in oracle.rows.values()}
        if all(ranked(frame, most, **{name: value}).front[0] == proposed for value in values):
            best.append(name)
    ends = f"If {' or '.join(best)} must be better, no design is left."
    assert (ends in said) == any(row.startswith("If ") for row in said) == bool(best)
    assert f"price below | {edge} | {then.removesuffix(' is proposed')}" in said
    # All designs, by place.
    (table_title,) = [key for key in sections if key.startswith("All ")]
    designs = [row.split(" | ") for row in sections[table_title][1:]]
    assert [row[1] for row in designs[: len(oracle.front)]] == oracle.front
    assert {row[1] for row in designs} == {*frame.index}
    for row in designs:
        assert all(map(is_written, row[2:5], frame.loc[row[1]]))
        assert (row[1] in oracle.rows) == (row[5] != "beyond limit: price")
        assert (row[0] == "–") == (row[1] not in oracle.front)


@pytest.mark.parametrize("seed", seeds(6))
@undrawn
def test_limits_are_written_as_the_column_and_have_their_effect(seed):
    rng = np.random.default_rng(seed)
    a = rng.random(20) * 100
    frame = pd.DataFrame({"a": a, "b": 1e3 / (1 + a) + rng.random(20)})
    table = read_table(frame, Formulation(["a", "b"]))
    said = lines(decision_report(table), "The proposal changes with a limit")
    rows = [row.split(" | ") for row in said if " below | " in row]
    assert rows
    for limit, value, design in rows:
        name = limit.partition(" ")[0]
        below = np.nextafter(float(value.replace("\N{NO-BREAK SPACE}", "")), -np.inf)
        assert table.under(limits={name: below}).best().names == [design]
        assert len(value.partition(".")[2]) <= 2


CHANGE = re.compile(r"(price|battery|speed) ([\d. ]+?) (higher|lower)")


@pytest.mark.parametrize("seed", seeds(8))
@undrawn
def test_the_least_regret_of_positions_is_that_of_a_slow_loop(seed):
    """What a design costs whom at worst, in shares of the ranges."""
    frame = offers(seed)
    most = int(frame["price"].quantile(0.7))
    oracle = ranked(frame, most)
    rejected = [name for name in frame.index if name not in oracle.rows]
    holders = {"Ann": oracle.front[0], "Ben": oracle.front[-1], "Cleo": rejected[0]}
    positions = [{"name": name, "chosen": design} for name, design in holders.items()]
    formulation = Formulation(list(NAMES), maximize=LARGER, limits={"price": most})
    report = decision_report(read_table(frame, Decision(formulation, positions=positions)))
    costs = {}
    for design in oracle.front:
        for name, held in holders.items():
            for column in NAMES:
                loss = frame.loc[design, column] - frame.loc[held, column]
                loss /= oracle.worst[column] - oracle.best[column]
                costs[design, name, column] = loss
    greatest = [max(v for key, v in costs.items() if key[0] == design) for design in oracle.front]
    (text,) = [line for line in lines(report, "Positions") if line.startswith("At worst")]
    found = re.fullmatch(
        r"At worst (\w+) costs (\w+) ([\d.]+) % in (\w+); every other design that is not "
        r"dominated costs someone ([\d.]+) % or more\.",
        text.replace("\N{NO-BREAK SPACE}", " "),
    )
    least, following, *_ = sorted(greatest)
    assert costs[found[1], found[2], found[4]] == pytest.approx(least)
    assert is_written(found[3], 100 * least)
    assert is_written(found[5], 100 * following)


@undrawn
def test_a_choice_has_its_cautions(beam):
    said = Reader(beam).text.split("Attention: ")[1:]
    expected = [*map(str, cautions(beam.ranking))]
    assert [line[: len(text)] for line, text in zip(said, expected, strict=True)] == expected != []


@undrawn
def test_what_is_known_of_the_design_is_shown():
    """Texts and outputs; the cell of another design is empty."""
    table = TestTable.of([1, 2, 3], [[1], [2], [3]], [[0.0, 4.0], [1.0, 1.0], [4.0, 0.0]])
    table = table.with_notes({"maker": ["", "Smith", ""]})
    assert any("maker Smith" in t for t in lines(decision_report(table), "Values"))
    assert not [t for t in lines(decision_report(table, design=1), "Values") if "maker" in t]


@undrawn
def test_no_line_ends_between_a_number_and_its_unit(html):
    assert len(re.findall("\\d\N{NO-BREAK SPACE}(kg|MPa|%)", html)) > 20
    assert not re.search(r"\d (kg|MPa|mm|%)", html[html.index("<body") :])


@undrawn
def test_failures_have_their_reason_and_a_rule(beam):
    *_, failed_as, rule = lines(beam, "What was tested")
    failed = len(TABLE.reasons)
    assert failed_as == f"{failed} | no mesh: too slender | test {min(TABLE.reasons)}"
    assert f" height / width <= 4 would have avoided {failed} of {failed} failures" in rule


@undrawn
def test_many_designs_have_representatives():
    few = representatives(LIMITED, 5)
    said = lines(decision_report(LIMITED), "Representatives")
    assert " | ".join(["design", *map(LIMITED.feasible_ranking().name_of, few.rows)]) in said
    (radius,) = re.findall(r"none farther than ([\d.]+)\.", " ".join(said))
    assert few.radius <= float(radius) <= 1.01 * few.radius


@undrawn
def test_many_objectives_are_folded_but_complete():
    rng = np.random.default_rng(1)
    names = [f"o{i}" for i in range(40)]
    report = decision_report(read_table(pd.DataFrame(rng.random((60, 40)), columns=names)))
    rows = lines(report, "Values")[1:9] + lines(report, "Further objectives")[1:33]
    assert [re.match(r"o\d+", row)[0] for row in rows] == names
    frame = pd.DataFrame(rng.random((5_000, 2)), columns=["a", "b"])
    assert "The first 20 of 5000 designs" in Reader(decision_report(read_table(frame))).sections


@pytest.mark.parametrize(
    ("table", "options", "message"),
    [
        (
            LIMITED,
            {"design": 96},
            "design must be a feasible design, got test 96, which is infeasible",
        ),
        (TABLE.under(limits={"stress": 0.0}), {"design": 96}, "none of .* is feasible"),
        (TABLE, {"about": "A note"}, "about must be a list of lines, got .A note.; one goes into"),
    ],
)
def test_mistakes(table, options, message):
    refused(message, decision_report, table, **options)


EVIL = "<script>alert(1)</script> & \"'$x_{$ <u>"


def test_names_reasons_and_titles_are_text():
    schema = Schema.of(
        [f"v {EVIL}"], [f"a {EVIL}", f"b {EVIL}"], [f"g {EVIL}"], units={f"a {EVIL}": EVIL}
    )
    X, F = lp_tau(16, 1), np.column_stack([lp_tau(16, 1)[:, 0], (1 - lp_tau(16, 1)[:, 0]) ** 2])
    table = TestTable.of(range(1, 17), X, F, X - 0.9, reasons={3: f"{EVIL} \x01"}, schema=schema)
    html = decision_report(table.under(limits={f"a {EVIL}": 0.8}), title=EVIL, about=[EVIL]).html()
    found = Reader(html)
    text = found.text + " ".join(found.sections)
    assert not {"script", "u"} & {*found.tags}
    assert text.count("<script>alert(1)</script> & \"'$x_{$ <u>") > 9
    assert "\x01" not in html
    assert f"{EVIL} \N{REPLACEMENT CHARACTER}" in text


@undrawn
@pytest.mark.filterwarnings("ignore:Glyph 1 ")
def test_control_characters_of_names_are_replaced():
    html = decision_report(pd.DataFrame({"a\x01b": [1, 2, 4], "c": [4, 2, 1]})).html()
    assert "<b>1 in a\N{REPLACEMENT CHARACTER}b</b> (33\N{NO-BREAK SPACE}% of its range)" in html


def test_nothing_is_loaded_and_nothing_runs(html):
    found = Reader(html)
    assert not {"script", "link", "iframe", "object"} & {*found.tags}
    for name, value in found.attributes:
        assert name[:2] != "on"
        assert name not in ("src", "href", "srcset") or value.startswith("data:image/svg+xml,")
    assert (
        "content",
        "default-src 'none'; font-src data:; img-src data:; style-src 'unsafe-inline'; base-uri 'none'",
    ) in found.attributes
    assert not re.search(r"url\((?!data:)|@import", html)


def heavy(value, limit):
    frame = pd.DataFrame({"mass": [value, value] * 16, "cost": [2.0, 1.0] * 16})
    return read_table(frame, Formulation(["mass", "cost"], limits={"mass": limit}))


@undrawn
@pytest.mark.parametrize(
    ("table", "nearest"),
    [
        (heavy(4.000001, 4), "4.000001"),
        (heavy(1234567.4, 1234567.2), "1 234 567.4"),
        (heavy(123444.8, (123444.9, None)), "123 444.8"),
        (heavy(1e9 + 1, 1e9), "1 000 000 001"),
        (
            TestTable.of(
                [1, 2],
                np.array([[0.5, 2], [0.25, 3]], dtype=object),
                [[2.0], [1.0]],
                schema=Schema.of(2, 1, kinds=["real", "integer"]),
            ).under(limits={"x2": 1}),
            "2",
        ),
    ],
)
def test_the_nearest_value_is_beyond_the_limit(table, nearest):
    sections = Reader(decision_report(table)).sections
    assert f"The nearest value is {nearest}." in sections["What limits do"][1]
    assert sections.keys().isdisjoint({"The designs", "What was tested"})  # nothing is left to say


@pytest.mark.parametrize(
    "values",
    [
        ([[0.1]], [[2.0]]),  # one design, one objective
        ([{"m": "iron", "n": 3, "on": True}, {"m": "wood", "n": 4, "on": False}], [[1, 2], [2, 1]]),
        *rarely(
            (
                [[0.1], [0.2], [0.3]],
                [[1.0, 3.0, 0.0], [2.0, 2.0, 0.0], [3.0, 1.0, 0.0]],
            ),  # constant
            ([[0.1], [0.2], [0.3]], [[2.0], [1.0], [1.0]]),  # one objective, a tie
            ([[0.1], [0.2]], [[1.0, 2.0], [1.0, 2.0]]),  # equal
            (np.empty((3, 0)), [[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]]),  # no variables
        ),
    ],
)
def test_small_and_odd_tables(values):
    text = Reader(decision_report(TestTable.of(range(1, len(values[1]) + 1), *values))).text
    assert "test" in text
    assert "nan" not in text.replace("dominan", "")


@undrawn
def test_rows_of_two_files_are_not_the_same_designs():
    frames = [pd.DataFrame({"a": [a, 2, 4], "b": [4.0, 2, 1]}) for a in (1.0, 3.0)]
    _, *rows = lines(decision_report(frames[0], prototype=frames[1]), "All 3 designs")
    assert [row.split("|")[-1].strip() for row in rows] == ["proposed", "", "present design"]


@undrawn
@pytest.mark.parametrize("label", ["place", "status"])
def test_headings_and_designs_can_have_any_name(label):
    x = np.linspace(0, 1, 40)
    names = ["design", *map("n{}".format, range(39))]
    table = read_table(pd.DataFrame({label: names, "a": x, "b": (1 - x) ** 2}))
    sections = Reader(decision_report(table)).sections
    rows = [row.split(" | ") for row in sections["The first 20 of 40 designs"]]
    assert [row[0] for row in rows if row[-1] != "status"] == [*map(str, range(1, 21))]
    heads = {row.split(" | ")[0] for row in sections["Representatives"]}
    assert heads >= {"design", "place", "stands for", "a", "b"}


DATE = '<span class="date"><span class="rule"></span><span>date</span><span class="rule"></span></span>'


@undrawn
@pytest.mark.parametrize(
    ("chosen", "warning"), [("B", "violates the limits"), ("Z", "is not among these designs")]
)
def test_a_choice_that_does_not_count_is_said(chosen, warning):
    frame = pd.DataFrame({"name": ["A", "B"], "cost": [2.0, 1.0], "mass": [3.0, 9.0]})
    decision = Decision(Formulation(["cost", "mass"], limits={"mass": 5}), chosen=chosen)
    html = decision_report(read_table(frame, decision)).html()
    assert f"{chosen}, the chosen design, {warning}." in html


@undrawn
def test_the_sheet_has_the_decision_of_the_group():
    names = [f"test {number}" for number in LIMITED.take(LIMITED.pareto()).numbers]
    positions = [
        {"name": "Ann", "date": "2026-01-02", "chosen": names[0], "reason": "light"},
        {"name": "Ben", "date": "2026-01-01", "chosen": names[1], "weights": {"mass": 2.0}},
        {"name": "Ben", "date": "2026-01-03", "chosen": names[2]},
    ]
    table = LIMITED.under(
        replace(
            LIMITED.decision,
            positions=positions,
            decided={
                "date": "2026-01-04",
                "chosen": names[2],
                "agree": ["Ben"],
                "dissent": ["Ann"],
            },
            chosen=names[2],
            reason="So be it.",
        )
    )
    html = decision_report(table, title="Beams", prototype=TABLE.take([5])).html()
    sheet = html[: html.index('class="appendix')]
    # Word and rule stay together where lines wrap.
    assert sheet.count("<span>date</span>") == sheet.count(DATE) == 2
    head, row, *_ = Reader(html).sections["Values"]
    assert head.endswith("proposed | present design")
    assert is_written(row.split(" | ")[-1], table.column("mass")[5])
    assert sheet.count("<b>Ann</b>") == sheet.count("<b>Ben</b>") == 1


@pytest.mark.parametrize(
    ("limits", "regret"),
    [
        (
            {"h": (4, 8)},
            "At worst A costs Ann 100 % in h.",
        ),  # all designs left are equal in it
        ({"f": (1, 1)}, "At worst A costs Ann 100 % in h."),  # one design is left
    ],
)
def test_designs_left_that_are_equal_may_cost_somebody_something(limits, regret):
    frame = pd.DataFrame({"f": [1, 3, 2], "g": [5, 6, 2], "h": [5, 1, 9]}, ["A", "Z", "X"])
    held = [{"name": "Ann", "chosen": "Z"}, {"name": "Ben", "chosen": "A"}]
    table = read_table(frame, Decision(Formulation([*frame], limits=limits), positions=held))
    assert separation_sentences(table)[0] == regret


@undrawn
def test_a_report_opens_what_a_page_opens(tmp_path):
    (tmp_path / "set.csv").write_text("car,price,range\nA,1,9\nB,2,5\nB,4,\n")
    text = Reader(decision_report(tmp_path / "set.csv")).text
    assert "1 incomplete design left out, the first in row 3" in text


@undrawn
def test_distances_are_from_the_best_of_fixed_ranges_as_they_are_written():
    frame = pd.DataFrame({"cost": [12, 16, 22], "noise": [61, 55, 50]}, index=["A", "C", "F"])
    asked = Formulation(["cost", "noise"], ranges={"cost": [10.5, 22.5], "noise": [45, 65]})
    sections = Reader(decision_report(read_table(frame, asked))).sections
    rows = [row.split(" | ")[1:] for row in sections["Values"][1:3]]
    assert rows == [["22.5", "", "10.5", "16.0", "46 %"], ["65", "", "45", "55", "50 %"]]
    assert sections["sheet"][2].endswith("10 in noise (50 % of its range) and 5.5 in cost (46 %).")


@undrawn
def test_beside_a_single_optimal_design_a_dominated_one_is_at_the_worst_end():
    table = TestTable.of([1, 2], [[0.1], [0.5]], [[1, 1], [2, 1]])
    assert '<i class="dot" style="left: 0%">' in decision_report(table, design=2).html()


@undrawn
def test_a_repeated_test_is_the_design_of_its_first_one():
    """Each design is ranked once; a decision may name any of its tests."""
    table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.1]], [[0, 4], [1, 1], [0, 4]])
    assert decision_report(table, design=3).html() == decision_report(table, design=1).html()
    positions = [
        {"name": name, "chosen": chosen} for name, chosen in [("A", "test 1"), ("B", "test 3")]
    ]
    table = table.under(Decision(chosen="test 3", reason="measured twice", positions=positions))
    assert "Reason: measured twice" in lines(decision_report(table), "sheet")
    assert separation_sentences(table) == []  # both want one design
    others = [positions[1], {"name": "C", "chosen": "test 2"}]
    _, apart = separation_sentences(table.under(replace(table.decision, positions=others)))
    assert apart == "C (test 2) against B (test 1): f2 3 lower. But f1 1 higher."
