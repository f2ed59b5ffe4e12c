"""``pymoo-psi prefer``: questions in a terminal and without one, and the file of the answers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pymoo_psi import Decision, Preferences, read_table
from tests.helpers.processes import LONG, posix

CARS = """\
car,mass,price,range,trunk
"Lane, North",1200,31,420,small
Town,900,22,210,small
Coast,1500,36,560,large
Country,1350,30.5,430,large
Tour,1700,45,640,large
Old,1800,46,600,small
"""
OPTIONS = ("--maximize", "range", "--units", "mass=kg,price=k€")


@pytest.fixture(autouse=True)
def cars(in_folder):
    Path("cars.csv").write_text(CARS, "utf-8")


def test_answers_without_a_dialogue_are_those_of_python(said, undrawn):
    answers = ["--answers", '"Lane, North>Town", Coast = Country', "--answers", "Coast?Town"]
    printed = said("prefer", "cars.csv", *OPTIONS, *answers, "--out", "d.json")
    decision = Decision.read_json("d.json")
    person = Preferences(read_table("cars.csv", decision))
    person.answer("Lane, North", "Town")
    person.equal("Coast", "Country")
    person.add("Coast", "?", "Town")
    assert f"Proposed after 2 answers: {person.best}" in printed
    assert decision.chosen == person.best
    first = decision.positions[0]
    assert [tuple(answer) for answer in first["answers"]] == person.answers
    assert (first["name"], first["chosen"]) == ("me", person.best)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--answers", "Lane>Town"], "in --answers must be the name of one design"),
        (["--answers", "Town"], "pairs of designs such as A>B"),
        (["--answers", "Town>Town"], "two different ones"),
        (["--answers", "Old>Town"], "Pareto optimal"),
        (["--answers", "Coast>Town", "--limits", "price<=35"], "a design within the limits"),
        (["--answers", ""], "pairs of designs such as A>B"),
        (["--answers", "Town>Coast", "--out", "d.txt"], ".json"),
        (
            ["--answers", "Town>Coast", "--out", "other.json"],
            "continue it by --decision other.json, or name",
        ),
        (
            ["--answers", "Town>Coast", "--limits", "mass<=1"],
            "cars.csv: No design is left: none of 6",
        ),
    ],
)
def test_what_cannot_be_done_is_refused_and_writes_nothing(words, message, run):
    Path("other.json").write_text('{"mine": 1}')
    code, _, err = run("prefer", "cars.csv", *OPTIONS, *words)
    assert code == 2
    assert message in err
    assert {*os.listdir()} == {"cars.csv", "models.py", "other.json"}
    assert Path("other.json").read_text() == '{"mine": 1}'


@posix
def test_without_a_terminal_questions_are_refused():
    command = [sys.executable, "-m", "pymoo_psi", "prefer", "cars.csv", *OPTIONS]
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, start_new_session=True
    )
    assert b"prefer asks in a terminal; without one, use --answers" in done.stderr


def is_raw(terminal):
    """Whether a key has its effect at once."""
    import termios

    return not termios.tcgetattr(terminal)[3] & termios.ICANON


def pressed(keys, *words):
    """Press keys in a terminal when the command asks; return its code, output and errors."""
    keyboard, terminal = os.openpty()
    command = [sys.executable, "-m", "pymoo_psi", "prefer", "cars.csv", *OPTIONS, *words]
    process = subprocess.Popen(
        command, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    os.close(terminal)
    for key in keys:
        for line in process.stdout:
            if line.startswith("a or b: "):
                break
        while process.poll() is None and not is_raw(keyboard):
            pass
        os.write(keyboard, key.encode())
    printed = process.communicate(timeout=LONG)
    os.close(keyboard)
    return process.returncode, *printed


@posix
def test_one_key_answers_takes_back_and_ends():
    code, printed, _ = pressed("abuxsq", "--out", "d.json")
    assert code == 0
    assert "2 answers by me written to d.json" in printed
    [position] = Decision.read_json("d.json").positions
    first, second = position["answers"]
    assert (first[1], second[1]) == (">", "?")


@pytest.mark.slow
@posix
def test_a_choice_of_ones_own_outlasts_answers_that_are_taken_back(said):
    own = {"name": "Ann", "chosen": "Town", "reason": "the bridge"}
    position = own | {"answers": [["Town", ">", "Coast"]]}
    Decision(chosen="Town", reason="the bridge", positions=[position]).to_json("d.json")
    code, *_ = pressed("uq", "--decision", "d.json", "--out", "d.json")
    assert code == 0
    decision = Decision.read_json("d.json")
    assert (decision.chosen, decision.reason) == ("Town", "the bridge")
    assert decision.positions[-1]["answers"] == []


@pytest.mark.slow
@posix
@pytest.mark.parametrize("key", ["\x03", "\x04"])
def test_an_interruption_loses_no_answer(key):
    code, out, err = pressed(["a", "e", key])
    assert code == (130 if key == "\x03" else 0)
    assert "2 answers by me written to decision.json" in out + err
    assert len(Decision.read_json("decision.json").positions[0]["answers"]) == 2
