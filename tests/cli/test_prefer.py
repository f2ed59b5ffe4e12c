"""``pymoo-psi prefer``: questions in a terminal and without one, and the file of the answers."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from pymoo_psi import Decision, Formulation, Preferences, read_table
from tests.helpers.processes import LONG

CARS = """\
car,mass,price,range,trunk
"Lane, North",1200,31,420,small
Town,900,22,210,small
Coast,1500,36,560,large
Country,1350,30.5,430,large
A>B,1700,45,640,large
Old,1800,46,600,small
"""
OPTIONS = ("--maximize", "range", "--units", "mass=kg,price=k€")


@pytest.fixture(autouse=True)
def cars(in_folder):
    Path("cars.csv").write_text(CARS, "utf-8")


def test_answers_without_a_dialogue_are_those_of_python(said, undrawn):
    answers = ["--answers", '"Lane, North>Town", Coast = Country', "--answers", "A>B?Town"]
    printed = said("prefer", "cars.csv", *OPTIONS, *answers, "--out", "d.json")
    decision = Decision.read_json("d.json")
    person = Preferences(read_table("cars.csv", decision))
    person.answer("Lane, North", "Town")
    person.equal("Coast", "Country")
    person.add("A>B", "?", "Town")
    assert f"Proposed after 2 answers: {person.best}" in printed
    assert decision.chosen == person.best
    first = decision.positions[0]
    assert [tuple(answer) for answer in first["answers"]] == person.answers
    assert (first["name"], first["chosen"]) == ("me", person.best)


def test_answers_of_several_people_stay_apart(said):
    for name, answer, read in (("Ada", "Town>Coast", ()), ("Bo", "A>B>Town", ["d.json"])):
        person = ["--as", name, "--answers", answer, "--out", "d.json"]
        source = [word for path in read for word in ("--decision", path)]
        said("prefer", "cars.csv", *OPTIONS, *person, *source)
    decision = Decision.read_json("d.json")
    chosen = {position["name"]: position["chosen"] for position in decision.positions}
    assert chosen["Ada"] == decision.chosen  # nobody has decided for both
    assert chosen["Bo"] != chosen["Ada"]
    again = ["--decision", "d.json", "--answers", "Town>Coast"]
    assert "several positions, got Ada, Bo" in said("prefer", "cars.csv", *again, code=2)


def test_answers_that_fit_no_longer_stay_in_the_file(said):
    given = ["--answers", "Town>Coast, Country>Coast", "--out", "d.json"]
    said("prefer", "cars.csv", *OPTIONS, *given)
    more = ["--decision", "d.json", "--limits", "mass<=1400", "--answers", "Country>Town"]
    printed = said("prefer", "cars.csv", *more, "--out", "e.json")
    assert "designs: Town>Coast, Country>Coast." in printed
    [*_, last] = Decision.read_json("e.json").positions
    assert ["".join(answer) for answer in last["answers"]] == [
        "Town>Coast",
        "Country>Coast",
        "Country>Town",
    ]
    assert last["limits"] == {"mass": [None, 1400]}


def test_answers_change_nothing_else_of_a_position(said):
    """What a person gave on the page stays; choice and reason change by an answer, not by a skip."""
    asked = Formulation(["mass", "price", "range"], maximize=["range"])
    reason = {"chosen": "Coast", "reason": "It is quiet."}
    held = {"name": "Ann", "weights": {"mass": 5.0}, "aspiration": {"price": 20.0}, **reason}
    Decision(asked, positions=[held], decided={"chosen": "Coast"}, **reason).to_json("d.json")
    first = Decision.read_json("d.json")
    words = ["prefer", "cars.csv", "--decision", "d.json", "--out", "d.json", "--answers"]
    assert "Proposed" not in said(*words, "Town?Country")
    skipped = Decision.read_json("d.json")
    changed = {"date": skipped.positions[1]["date"], "answers": [("Town", "?", "Country")]}
    assert skipped == replace(first, positions=[*first.positions, skipped.positions[1]])
    assert skipped.positions[1] == first.positions[0] | changed
    said(*words, "Town>Country")
    answered = Decision.read_json("d.json")
    last = answered.positions[-1]
    assert (last["weights"], last["aspiration"]) == (held["weights"], held["aspiration"])
    assert answered.chosen == last["chosen"] == "Town"
    assert answered.reason == last["reason"] != held["reason"]
    assert answered.decided is None  # of another design


def test_a_skipped_question_chooses_nothing(said):
    said("prefer", "cars.csv", *OPTIONS, "--answers", "Town?Country", "--out", "d.json")
    decision = Decision.read_json("d.json")
    assert decision.chosen is decision.positions[0]["chosen"] is None
    assert decision.reason == decision.positions[0]["reason"] == ""


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--answers", "Lane>Town"], "got 'Lane'"),
        (["--answers", "Town"], "pairs of designs such as A>B"),
        (["--answers", "Town>Town"], "two different ones"),
        (["--answers", "Old>Town"], "Pareto optimal"),
        (["--answers", "Coast>Town", "--limits", "price<=35"], "got Coast, which is infeasible"),
        (["--answers", ""], "pairs of designs such as A>B"),
        (["--answers", "Town>Coast", "--out", "d.txt"], ".json"),
        (["--answers", "Town>Coast", "--out", "other.json"], "--out must be a new file"),
        (["--answers", "Town>Coast", "--limits", "mass<=1"], "with a feasible design"),
    ],
)
def test_what_cannot_be_done_is_refused_and_writes_nothing(words, message, run):
    Path("other.json").write_text('{"mine": 1}')
    code, _, err = run("prefer", "cars.csv", *OPTIONS, *words)
    assert code == 2
    assert message in err
    assert {*os.listdir()} == {"cars.csv", "models.py", "other.json"}
    assert Path("other.json").read_text() == '{"mine": 1}'


class Terminal:
    """The command in a terminal, whose keys are pressed when it asks."""

    def __init__(self, *words):
        self.keyboard, terminal = os.openpty()
        command = [sys.executable, "-m", "pymoo_psi", "prefer", "cars.csv", *OPTIONS, *words]
        self.process = subprocess.Popen(
            command, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        os.close(terminal)

    def press(self, keys):
        for key in keys:
            for line in self.process.stdout:
                if line.startswith("a or b: "):
                    break
            while self.process.poll() is None and not self._is_raw():
                pass
            os.write(self.keyboard, key.encode())

    def _is_raw(self):
        import termios

        return not termios.tcgetattr(self.keyboard)[3] & termios.ICANON

    def end(self):
        out, err = self.process.communicate(timeout=LONG)
        os.close(self.keyboard)
        return self.process.returncode, out, err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")
def test_one_key_answers_takes_back_and_ends():
    terminal = Terminal("--out", "d.json")
    terminal.press("abuxsq")
    code, out, _ = terminal.end()
    assert code == 0
    assert "2 answers by me written to d.json" in out
    [position] = Decision.read_json("d.json").positions
    first, second = position["answers"]
    assert (first[1], second[1]) == (">", "?")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")
@pytest.mark.parametrize("key", ["\x03", "\x04"])
def test_an_interruption_loses_no_answer(key):
    terminal = Terminal()
    terminal.press(["a", "e", key])
    code, out, err = terminal.end()
    assert code == (130 if key == "\x03" else 0)
    assert "2 answers by me written to decision.json" in out + err
    assert len(Decision.read_json("decision.json").positions[0]["answers"]) == 2
