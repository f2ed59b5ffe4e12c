"""Questions on the page: answered by keys, kept with positions, continued by the command."""

import json

import pandas as pd
import pytest

from pymoo_psi import Decision, Preferences, read_table
from pymoo_psi._numbers import percents
from pymoo_psi.cli import main
from pymoo_psi.page import decision_page
from pymoo_psi.table import Formulation

CARS = pd.DataFrame(
    {
        "price": [20.0, 24.0, 30.0, 45.0, 60.0, 30.5],
        "range": [200.0, 310.0, 400.0, 470.0, 500.0, 390.0],
        "noise": [70.0, 66.0, 69.0, 64.0, 67.0, 72.0],
    },
    ["Town", "Lane", "Country", "Coast", "Tour", "Old"],
)

ASKED = Formulation(["price", "range", "noise"], maximize=["range"])


def page_of(frame):
    return decision_page(read_table(frame, ASKED), title="Cars")


def asked(reader):
    """The two designs of the question on the page."""
    return tuple(name.text_content()[1:].strip() for name in reader.page.locator("#pair h3").all())


def test_keys_answer_and_the_command_goes_on(show, tmp_path, capsys):
    person = Preferences(read_table(CARS, ASKED))
    reader = show(page_of(CARS))
    reader.press("Enter", on=reader.page.get_by_role("button", name="Help me choose"))
    for key in "a", "b", "s", "e", "u":
        pair = person.question()
        assert asked(reader) == (pair or ())
        if pair is None:
            break
        reader.press(key)
        if key == "u":
            person.undo()
        else:
            one, other = reversed(pair) if key == "b" else pair
            person.add(one, {"s": "?", "e": "="}.get(key, ">"), other)
        assert reader.text("#answer-words p") == person.sentences[0]
    assert [tuple(answer) for answer in reader.state["answers"]] == person.answers
    reader.press("Escape")
    assert not reader.page.is_visible("#questions")
    reader.keep_position("Ann")
    path = reader.save(tmp_path / "d.json")
    decision = Decision.read_json(path)
    assert [tuple(answer) for answer in decision.positions[0]["answers"]] == person.answers
    CARS.to_csv(tmp_path / "cars.csv", index_label="car")
    words = ["prefer", str(tmp_path / "cars.csv"), "--decision", str(path)]
    assert main([*words, "--answers", "Tour>Town", "--out", str(path)]) == 0
    assert "Proposed after" in capsys.readouterr().out
    kept = Decision.read_json(path).positions[-1]
    assert kept["answers"][:-1] == decision.positions[0]["answers"]
    reader.page.locator("#file").set_input_files(path)
    reader.until("D.state().positions.length === 2")
    assert reader.state["positions"][-1]["answers"] == json.loads(json.dumps(kept["answers"]))


def test_people_take_turns_on_one_page(show):
    reader = show(page_of(CARS))
    of_ann = {
        "answers": [["Town", ">", "Coast"]],
        "weights": {"noise": 5},
        "aspiration": {"price": 22},
        "reason": "It is quiet.",
    }
    nobody = {key: reader.state[key] for key in of_ann}
    reader.set(chosen="Lane", **of_ann)
    reader.keep_position("Ann")
    reader.keep_position("Ben")
    ann, ben = reader.state["positions"]
    assert ann == ann | of_ann
    assert ben == ben | nobody
    assert ann["chosen"] == ben["chosen"] == "Lane"
    # The same words are a person's own where this person has typed them.
    reader.page.fill("#reason", of_ann["reason"])
    reader.keep_position("Cy")
    assert reader.state["positions"][-1] == ben | {"reason": of_ann["reason"]} | {
        key: reader.state["positions"][-1][key] for key in ("name", "date")
    }
    reader.click(reader.page.get_by_label("Show: Ann"))
    reader.keep_position("Dan")
    assert reader.state["positions"][-1] == reader.state["positions"][-1] | nobody
    reader.set(positions=reader.state["positions"][:2])
    # The decision of the group ends with its choice, also where another position is shown.
    reader.set(chosen="Coast")
    reader.click("#decide")
    assert reader.state["decided"]["chosen"] == "Coast"
    reader.page.get_by_role("button", name="Tour", exact=True).first.click()
    reader.click(reader.page.get_by_label("Show: Ann"))
    assert reader.text("#verdict-title") == "Chosen: Lane"
    assert reader.state == reader.state | of_ann | {"chosen": "Lane", "decided": None}
    # All positions of a person go.
    reader.keep_position("Ann")
    reader.click(reader.page.get_by_role("button", name="Remove: Ann"))
    assert [one["name"] for one in reader.state["positions"]] == ["Ben"]


@pytest.mark.slow
def test_shares_of_two_people_and_what_suits_both(show):
    reader = show(page_of(CARS))
    shares, written = {}, []
    for name, answers in (
        ("Ann", [["Town", ">", "Coast"], ["Lane", ">", "Country"]]),
        ("Ben", [["Coast", ">", "Town"], ["Tour", ">", "Lane"], ["Gone", ">", "Town"]]),
    ):
        reader.set(answers=answers)
        reader.keep_position(name)
        person = Preferences(read_table(CARS, ASKED))
        for one, _, other in answers[:2]:
            person.answer(one, other)
        shares[name] = dict(zip(CARS.index, person.shares, strict=True))
        written.append(dict(zip(CARS.index, percents(person.shares), strict=True)))
    common = max(CARS.index, key=lambda car: min(of[car] for of in shares.values()))
    assert reader.text("#shares-words").startswith(f"{common} has a share of ")
    for line in reader.page.locator("#shares-table tbody tr").all_inner_texts():
        car, *texts = line.replace("\N{NO-BREAK SPACE}", " ").split("\t")
        assert texts == [of[car] for of in written]
    assert len(reader.state["positions"][1]["answers"]) == 3  # the design may come back


@pytest.mark.slow
@pytest.mark.parametrize(("frame", "n_buttons"), [(CARS[:1], 0), (CARS * 0 + 1, 1), (CARS[:2], 1)])
def test_few_or_equal_designs_leave_nothing_to_ask(show, frame, n_buttons):
    reader = show(page_of(frame))
    button = reader.page.get_by_role("button", name="Help me choose")
    assert button.count() == n_buttons
    for _ in range(n_buttons):
        reader.click(button)
        reader.press("a")
        assert reader.text("#questions-title") == "No more questions"
