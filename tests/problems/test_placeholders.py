"""What is a placeholder, what is refused as it could be one, and what stays as it is."""

import random
import re

import pytest

from pymoo_psi import ProgramProblem
from pymoo_psi.errors import ArgumentValueError
from tests.helpers.folders import write_files
from tests.helpers.refusals import refused

X, WIDTH = 25.0, 3  # a real and an integer variable
VARIABLES = {"x": {"bounds": [X, X]}, "width": {"bounds": [WIDTH, WIDTH], "kind": "integer"}}


def problem_with(tmp_path, text, *, variables=None, command="true {x}{width}", **program):
    """Return a problem with a text as a file of its template."""
    write_files(tmp_path, {"template/in.txt": text})
    return ProgramProblem(
        variables or VARIABLES,
        {"command": command, "template": "template", "files": ["in.txt"], **program},
        {"m": {"file": "stdout.txt", "pattern": "(.+)"}},
        {"minimize": ["m"]},
        base=tmp_path,
    )


def filled(tmp_path, text, **program):
    """Return what a run makes of a text."""
    run = problem_with(tmp_path, text, **program).run({"x": X, "width": WIDTH}, keep=True)
    return (run.folder / "in.txt").read_bytes().decode()


FILLED = [
    ("{x}", "25.0"),
    ("{x:.6g}|{x:08.3f}|{x:>8.2f}|{x:+e}", "25|0025.000|   25.00|+2.500000e+01"),
    ("{width:d} {width:03d} {width}", "3 003 3"),
    ("{x}{x} {{x}", "25.025.0 {25.0"),
    ('{"x": {x}, "of x": {"x": [{width}]}}', '{"x": 25.0, "of x": {"x": [3]}}'),
    ("{y} {101} {} { a } {maxx} {xy: 3}", "{y} {101} {} { a } {maxx} {xy: 3}"),
    ('$y 100 % } ä \' a 1e5 {"k": 1}', '$y 100 % } ä \' a 1e5 {"k": 1}'),
    ("{x\n}\n{x", "{x\n}\n{x"),  # braces on two lines
    ("a\r\nb {x}\r\n", "a\r\nb 25.0\r\n"),
    ("{{x}} ${{x}} {{x: 60}} {a: {{x: 60}}}", "{x} ${x} {x: 60} {a: {x: 60}}"),
    ('f"{{x}}" print("{x}") half"{x}"', 'f"{x}" print("25.0") half"25.0"'),
]
REFUSED = [
    *("${x}", "${width}", "\\${x}", "${seed}"),
    *("{x: 60}", "{x:60}", "{x:1.5}", "{y: 1, x: 60}", "{ x }", "{x }", "{a: x}"),
    *("{x!r}", "{2*x}", "{x,width}", "{x:}", "{x:,}", "{x:.1%}", "{x:_}", "{x:n}"),
    *('f"{x}"', "f'{a} {x:.3f}'", 'rf"{x}"', 'f"""{x}"""', "f'{{a}} {x}'", "{x:99999f}"),
    'f"""\nsecond {x}"""',
    *("{{{x}}}", "{seed: 42}"),
    *("{x:d}", "{x:s}", "{width:s}", "{x:.2q}"),
]


@pytest.mark.parametrize(("text", "expected"), FILLED)
def test_a_placeholder_is_filled_and_other_braces_stay(tmp_path, text, expected):
    assert filled(tmp_path, text) == expected


@pytest.mark.parametrize("text", REFUSED)
def test_what_could_be_a_placeholder_is_refused(tmp_path, text):
    refused(
        r"in\.txt, line 2: a placeholder must be \{name\} or \{name:FORMAT\}.*marks = '@name@'",
        problem_with,
        tmp_path,
        text if "\n" in text else f"first {{x}}\nsecond {text} end\n",
    )
    refused(
        r"command, line \d: a placeholder must be",
        problem_with,
        tmp_path,
        "{x}{width}",
        command=f"true '{text}'" if "'" not in text else f'true "{text}"',
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{x:d}", "Unknown format code 'd' for object of type 'float'"),
        ("{steel:.6g}", "Unknown format code 'g' for object of type 'str'"),
    ],
)
def test_a_wrong_format_is_named_with_its_placeholder(tmp_path, text, reason):
    variables = VARIABLES | {"steel": {"choices": ["S235", "S355"]}}
    refused(
        f"in.txt, line 1.*{re.escape(f'got {text!r} ({reason})')}",
        problem_with,
        tmp_path,
        text,
        variables=variables,
    )


@pytest.mark.parametrize(
    ("setting", "text", "value"),
    [
        ({"bounds": [0.1, 0.3]}, "{x:.2f}", 0.2),
        ({"bounds": [10, 12]}, "{x:.2f}", 10.004),
        ({"bounds": [1e-6, 1], "scale": "log"}, "{x:.6f}", 1.4e-6),
        ({"choices": [0.25, 0.5]}, "{x:.1f}", 0.25),
    ],
)
def test_a_format_that_rounds_runs_no_other_design(tmp_path, setting, text, value):
    """Before any run if it rounds usual values, else for the design whose value it rounds."""
    reason = rf"in.txt: the placeholder {re.escape(text)} must .* got .* more digits, such as {{x"
    variables = {"x": setting, "width": VARIABLES["width"]}
    try:
        problem = problem_with(tmp_path, text, variables=variables, command="echo {x} {width}")
    except ArgumentValueError as error:
        flaw = str(error)
    else:
        (flaw,) = problem.run({"x": value, "width": WIDTH}).flaws
    assert re.search(reason, flaw)


@pytest.mark.parametrize(
    ("marks", "text", "expected"),
    [
        ("@name@", "@x@ @x:.3f@ ${x} {x: 60} @@x@@ me@y", "25.0 25.000 ${x} {x: 60} @x@ me@y"),
        ("@name@", "a@b, @x@", "a@b, 25.0"),
        ("<<name>>", "<<x>> <x> <<<<x>>>> $<<x>>", "25.0 <x> <<x>> $25.0"),
        ("${name}", "${x} {x} ${${x}}", "25.0 {x} ${x}"),
        ("{{name}}", "{{x}} {x} ${x}", "25.0 {x} ${x}"),
    ],
)
def test_other_marks_leave_braces_to_the_text(tmp_path, marks, text, expected):
    command = f"true {marks}".replace("name", "x")
    text += f"\n{marks}".replace("name", "width")
    assert filled(tmp_path, text, marks=marks, command=command) == f"{expected}\n{WIDTH}"


@pytest.mark.parametrize("marks", ["", "name", "@", "@name", "name@", "a name b", "@x@", "@name:"])
def test_marks_are_on_both_sides_of_a_name(tmp_path, marks):
    refused("marks must be 'name' between marks", problem_with, tmp_path, "{x}", marks=marks)
    refused("in.txt, line 1.*got '@x 3@'", problem_with, tmp_path, "@x 3@", marks="@name@")


@pytest.mark.parametrize("name", ["t-web", "2d", "a b", "x.y", "", "{x}"])
def test_a_variable_has_a_plain_name(tmp_path, name):
    refused(
        "the name of a variable must be letters, digits and _ .* rename it, such as t_web",
        problem_with,
        tmp_path,
        "",
        variables={name: [1, 2]},
        command="true",
    )


def test_lines_in_any_order_are_filled_or_refused_by_their_number(tmp_path, draws):
    """Each line as alone: none hides or makes a placeholder of another line."""
    known = [pair for pair in FILLED if "\n" not in pair[0]]
    for seed in draws(200):
        rng = random.Random(seed)
        lines = rng.choices(known, k=rng.randint(2, 9))
        assert filled(tmp_path, "\n".join(text for text, _ in lines)) == "\n".join(
            expected for _, expected in lines
        )
        number = rng.randint(1, len(lines))
        lines[number - 1] = (rng.choice([text for text in REFUSED if "\n" not in text]), "")
        message = f"in.txt, line {number}: a placeholder must be"
        refused(message, problem_with, tmp_path, "\n".join(text for text, _ in lines))
