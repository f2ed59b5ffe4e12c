"""What a TOML file of a program may hold: each wrong one is refused by path, rule and remedy."""

import copy
import random
import sys
from functools import reduce
from operator import getitem

import numpy as np
import pytest

from pymoo_psi import ProgramProblem, investigate
from tests.helpers.mutations import mutated, toml_file
from tests.helpers.refusals import flaw, refused

FILE = {
    "name": "beam",
    "key": "mesh 3",
    "variables": {
        "width": {"bounds": [2, 4], "unit": "mm"},
        "height": {"bounds": [1.0, 9.0], "scale": "log"},
        "n": {"bounds": [1, 5], "kind": "integer"},
        "steel": {"choices": ["S235", "S355"]},
    },
    "program": {"command": "PYTHON {width} {height} {n} {steel}", "timeout": 5, "keep": "failed", "marks": "{name}"},
    "outputs": {
        "stress": {"file": "stdout.txt", "pattern": "stress = (.+)", "row": -1, "unit": "MPa"},
        "tip": {"file": "out.json", "key": "tip.u.0"},
        "load": {"file": "table.csv", "column": "F", "row": 0},
        "mass": {"expression": "2*width*height", "unit": "kg"},
    },
    "objectives": {"minimize": ["mass", "tip"], "maximize": ["load"]},
    "limits": {"stress": "<= 60"},
    "requirements": {"slender": "height <= 4*width"},
}  # fmt: skip


@pytest.fixture
def read(tmp_path):
    """Return a function that writes a file and reads its problem."""

    def problem_of(text):
        path = tmp_path / "beam.toml"
        path.write_text(text.replace("PYTHON", sys.executable), "utf-8")
        return ProgramProblem.from_toml(path)

    return problem_of


LIST = "Expected `array`, got"
SETTINGS = "must be a mapping from settings to values"
FINITE = "must be a finite number, got"


@pytest.mark.parametrize(
    ("where", "value", "message"),
    [
        ("variables", 5, "variables must be a mapping from names to settings, got 5"),
        ("variables", {}, "variables must be one or more"),
        ("variables width", 5, rf"variables: width {SETTINGS}, got 5"),
        ("variables width", [1], r"variables: width: .* bounds = \[lower, upper\] or choices, got"),
        ("variables width bounds", 1, r"variables: width: Expected `array`, got `int` - at `\$.bounds`"),
        ("variables width bounds", [1], r"width: a variable must be given by bounds = \[lower, u"),
        ("variables width bounds", ["a", "b"], "width: Expected `int . float`, got `str`"),
        ("variables width bounds", [float("nan"), 1], f"width: bounds {FINITE} nan"),
        ("variables width bounds", [0, 10**400], f"width: bounds {FINITE} inf"),
        ("variables width bounds", [0, float("inf")], f"width: bounds {FINITE} inf"),
        ("variables width colour", 1, "width must be one of 'bounds', 'choices', .* got 'colour'"),
        ("variables width unit", 5, "variables: width: Expected `str`, got `int`"),
        ("variables width kind", "int", "width: kind must be one of .* did you mean 'integer'"),
        ("variables steel choices", "S235", f"variables: steel: {LIST} `str`"),
        ("variables steel choices", 5, f"variables: steel: {LIST} `int`"),
        ("variables steel choices", [["S235"]], "variables: steel: Expected .*, got `array`"),

        ("outputs mass expression", "1e400*width*height", f"a number of an expression {FINITE} inf"),
        ("requirements slender", "height <= 1e400", f"a number of an expression {FINITE} inf"),
        ("program", "sh run.sh", "program must be a mapping from settings to values, got 'sh run.sh'"),
        ("program files", [5], "program: Expected `str`, got `int`"),
        ("program files", "beam.inp", f"program: {LIST} `str`"),
        ("program error", {"file": "out", "patern": "(.+)"}, "program: error must be .* did you mean 'pattern'"),
        ("program error", {"file": "out"}, "program: error: an output must be given as file with one"),
        ("program exit_codes", 1, f"program: {LIST} `int`"),
        ("program marks", "name", "marks must be 'name' between marks"),
        ("outputs stress decimal", ";", "outputs: stress: decimal must be one of"),
        ("program timeout", "x", "program: Expected `.*`, got `str`"),
        ("program timeout", float("inf"), f"program: timeout {FINITE} inf"),
        ("program timeout", 0, "program: timeout must be a positive number, got 0"),
        ("program keep", 1, "program: Expected `str`, got `int`"),
        ("outputs stress", "x", rf"outputs: stress {SETTINGS}, got 'x'"),
        ("outputs stress row", "x", "outputs: stress: Expected `int . null`, got `str`"),
        ("outputs stress row", 1.5, "outputs: stress: Expected `int . null`, got `float`"),
        ("outputs stress row", True, "outputs: stress: Expected `int . null`, got `bool`"),
        ("outputs tip key", 5, "outputs: tip: Expected `str . array`, got `int`"),
        ("outputs tip patern", "x", "outputs: tip must be one of .* did you mean 'pattern'"),
        ("objectives minimize", "mass", "objectives: minimize must be a list of names, got 'mass'"),
        ("objectives minimise", ["mass"], "of objectives must be one of .* did you mean 'minimize'"),
        ("objectives maximize", ["load", "tip"], "objectives must be minimized or maximized, got tip"),
        ("objectives", 5, "objectives must be a mapping from settings to values, got 5"),
        ("limits", 5, "limits must be a mapping from outputs to texts, as '<= 250', got 5"),
        ("limits", 0, "limits must be a mapping from outputs to texts, as '<= 250', got 0"),
        ("limits stress", 5, "the limit on stress must be such as '<= 250' or .* got 5"),
        ("limits stress", "<= 1e400", f"the limit on stress {FINITE} inf"),
        ("requirements", 5, "requirements must be rules by name, or a list of texts, got 5"),
        ("requirements", 0, "requirements must be rules by name, or a list of texts, got 0"),
        ("requirements slender", 5, "the requirement 'slender' must be an inequality as text"),
        ("section", 5, "a section must be one of 'key', 'limits', .* got 'section'"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_refused_by_path_and_rule(read, where, value, message):
    *path, key = where.split()
    content = copy.deepcopy(FILE)
    reduce(getitem, path, content)[key] = value
    refused(f"beam.toml: .*{message}", read, toml_file(content))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name = 'a'\n[limits\nstress = 5", "at line 2, column 8"),
        ("[limits]\n[limits]", "at line 2, column 8"),
        ("[variables]\nHöhe = {bounds = [1, 2]}\n", 'line 2.*a name such as "Höhe" in quotes'),
        ('name = "\\S"', r"a text with \\ stands between '…'"),
        ("", "variables must be a mapping from names to settings, got None"),
    ],
)
def test_wrong_syntax_is_refused_by_its_line(read, text, message):
    refused(message, read, text)


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        (
            {"bounds": [9, 1]},
            "bounds of height of beam must be finite and in increasing order, got 9.0 and 1",
        ),
        ({"bounds": [0.2, 0.8], "kind": "integer"}, "with an integer between them, got 0.2 and"),
        (
            {"bounds": [0, 1]},
            "height in log must be a real variable whose lower bound is above 0, got 0",
        ),
    ],
)
def test_bounds_are_refused_before_any_run(read, bounds, message):
    content = copy.deepcopy(FILE)
    content["variables"]["height"] |= bounds
    refused(message, investigate, read(toml_file(content)), 2)


def test_a_byte_order_mark_is_none_of_the_text(read):
    text = toml_file(FILE)
    assert read(f"\ufeff{text}").fingerprint() == read(text).fingerprint()


def test_odd_files_give_a_problem_or_an_error(read, draws):
    for seed in draws(200):
        text = toml_file(mutated(FILE, random.Random(seed)))
        message = flaw(read, text)
        assert message.count("beam.toml: ") == bool(message)


def test_numbers_and_arrays_of_numpy_are_values_too(read):
    content = copy.deepcopy(FILE)
    content["variables"]["width"]["bounds"] = np.array([2, 4])
    content["variables"]["steel"]["choices"] = np.array(["S235", "S355"])
    content["program"]["command"] = f"{sys.executable} {{width}} {{height}} {{n}} {{steel}}"
    made = ProgramProblem(**content)
    assert made.fingerprint() | {"command": ""} == read(toml_file(FILE)).fingerprint() | {
        "command": ""
    }


@pytest.mark.parametrize(
    ("limit", "text"),
    [
        ("<= 250", "stress<=250"),
        ("<= 1e6", "stress<=1000000"),
        ("<= 1e12", "stress<=1000000000000"),
        ("<= 0.1", "stress<=0.1"),
        ("<= 0.1234567890123", "stress<=0.1234567890123"),
        ("<= 0.1234567890124", "stress<=0.1234567890124"),
    ],
)
def test_constraints_have_all_digits_of_their_limits(read, limit, text):
    assert read(toml_file(FILE | {"limits": {"stress": limit}})).names["g1"] == text
