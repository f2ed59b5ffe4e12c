"""What is a placeholder, what is refused as it could be one, and what stays as it is."""

import random
import re

import pytest

from pymoo_psi import ProgramProblem
from tests.helpers.refusals import refused

X, WIDTH = 25.0, 3  # a real and an integer variable
VARIABLES = {"x": {"bounds": [X, X]}, "width": {"bounds": [WIDTH, WIDTH], "kind": "integer"}}


def problem_with(tmp_path, text, *, variables=None, command="true {x}{width}", **program):
    """Return a problem with a text as a file of its template."""
    (tmp_path / "template").mkdir(exist_ok=True)
    (tmp_path / "template" / "in.txt").write_bytes(text.encode())
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


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{x}", "25.0"),
        ("{x:.6g}|{x:08.3f}|{x:>8.2f}|{x:+e}", "25|0025.000|   25.00|+2.500000e+01"),
        ("{width:d} {width:03d} {width}", "3 003 3"),
        ("{x}{x} {{x}", "25.025.0 {25.0"),
        ('{"x": {x}, "of x": {"x": [{width}]}}', '{"x": 25.0, "of x": {"x": [3]}}'),
        ("{y} {101} {} { a } {maxx} {xy: 3}", "{y} {101} {} { a } {maxx} {xy: 3}"),
        ("{x\n}\n{x", "{x\n}\n{x"),  # braces on two lines
        ("a\r\nb {x}\r\n", "a\r\nb 25.0\r\n"),
        ("{{x}} ${{x}} {{x: 60}} {a: {{x: 60}}}", "{x} ${x} {x: 60} {a: {x: 60}}"),
        ('f"{{x}}" print("{x}") half"{x}"', 'f"{x}" print("25.0") half"25.0"'),
    ],
)
def test_a_placeholder_is_filled_and_other_braces_stay(tmp_path, text, expected):
    assert filled(tmp_path, text) == expected


@pytest.mark.parametrize(
    "text",
    [
        *("${x}", "${width}", "\\${x}", "${seed}"),
        *("{x: 60}", "{x:60}", "{x:1.5}", "{y: 1, x: 60}", "{ x }", "{x }", "{a: x}"),
        *("{x!r}", "{2*x}", "{x,width}", "{x:}", "{x:,}", "{x:.1%}", "{x:_}", "{x:n}"),
        *('f"{x}"', "f'{a} {x:.3f}'", 'rf"{x}"', 'f"""{x}"""', "f'{{a}} {x}'", "{x:99999f}"),
        'f"""\nsecond {x}"""',
        *("{{{x}}}", "{seed: 42}"),
        *("{x:d}", "{x:s}", "{width:s}", "{x:.2q}"),
    ],
)
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


def test_umlauts_are_quoted_in_toml(tmp_path):
    (tmp_path / "m.toml").write_text("[variables]\nHöhe = {bounds = [1, 2]}\n", "utf-8")
    refused('line 2.*stands in quotes, as "Höhe"', ProgramProblem.from_toml, tmp_path / "m.toml")


# Random files

REAL, INTEGER = ("", ":.6g", ":08.3f", ":e", ":>12.4f"), ("", ":d", ":03d", ":g")
NAMES = ("x", "width", "Höhe", "l_2", "seed_", "name")
ORDINARY = ("{y}", "{}", "{101}", '{"k": 1}', "$y", "100 %", "{ a b }", "}", "ä", "'", "a", "1e5")


class RandomFile:
    """A file of a problem and its template at random, and what is to become of them.

    Each piece of a line is known to be a placeholder, ordinary, or refused; pieces are apart.
    """

    def __init__(self, seed):
        self.rng = rng = random.Random(seed)
        self.marks = rng.choice(("{name}", "{name}", "@name@", "<<name>>", "%{name}"))
        self.before, self.after = self.marks.split("name")
        names = rng.sample(NAMES, 2)
        self.design = {names[0]: rng.uniform(-1e3, 1e3), names[1]: rng.randint(-99, 99)}
        self.formats = dict(zip(names, (REAL, INTEGER), strict=True))
        self.line_refused = 0
        lines, expected = [], []
        for number in range(1, rng.randint(2, 9)):
            pieces = [self.piece() for _ in range(rng.randint(0, 4))]
            if seed % 2 and not self.line_refused and rng.random() < 0.5:
                pieces.insert(rng.randint(0, len(pieces)), (self.refused(), ""))
                self.line_refused = number
            lines.append(" ".join(text for text, _ in pieces))
            expected.append(" ".join(text for _, text in pieces))
        end = rng.choice(("\n", "\r\n"))
        self.text, self.expected = end.join(lines), end.join(expected)

    def marked(self, text):
        return f"{self.before}{text}{self.after}"

    def piece(self):
        """Return a placeholder, doubled marks, or other text, and what becomes of it."""
        name = self.rng.choice([*self.design])
        form = self.rng.choice(self.formats[name])
        value = format(self.design[name], form[1:])
        single = self.marked(f"{name}: 6")
        others = [name, *ORDINARY]
        if "{" not in self.before:
            others += [f"${{{name}}}", f"{{{name}: 6}}", f'f"{{{name}}}"']
        filled = 2 * [(self.marked(name + form), value)] + [(self.marked(single), single)]
        return self.rng.choice([*filled, *zip(others, others, strict=True)])

    def refused(self):
        """Return what could be a placeholder."""
        real, integer = self.design
        texts = [f"{real}: 60", f"{real}:60", f" {integer} ", f"{real}!r", f"2*{real}", f"{real}:d"]
        texts = list(map(self.marked, texts))
        if self.marks == "{name}":
            texts += [f"${{{real}}}", f'f"{{{real}}}"', f"{{{{{{{real}}}}}}}"]
        return self.rng.choice(texts)

    def problem(self, folder):
        """Return the problem with the file as its template; the command has all variables."""
        kinds = zip(self.design, ("real", "integer"), strict=True)
        variables = {name: {"bounds": [-1000, 1000], "kind": kind} for name, kind in kinds}
        command = " ".join(["true", *map(self.marked, self.design)])
        return problem_with(
            folder, self.text, variables=variables, command=command, marks=self.marks
        )


def test_random_files_are_filled_or_refused_by_line(tmp_path, draws):
    """Each file is filled as by plain replacement, or refused by file and line."""
    n_refused = 0
    for seed in draws(200):
        file = RandomFile(seed)
        if file.line_refused:
            refused(
                f"in.txt, line {file.line_refused}: a placeholder must be", file.problem, tmp_path
            )
            n_refused += 1
        else:
            run = file.problem(tmp_path).run(file.design, keep=True)
            assert (run.folder / "in.txt").read_bytes().decode() == file.expected
            assert run.words == ["true", *map(str, file.design.values())]
    assert 0.25 < n_refused / len(draws(200)) < 0.75
