"""What is installed: names and words known to type checkers, dependencies with floors."""

import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import metadata, requires

import pytest

HEAVY = ("click", "matplotlib", "pymoo", "numpy", "pandas")


# Calls with a word, and what one may type instead of it.
WORDS = {
    "investigate(bnh, 8, keep={})": ("pareto", "parto"),
    "investigate(bnh, 8, sampling={})": ("sobol", "sobool"),
    "investigate(bnh, 8, retry={})": ("failed", "fail"),
    "PSI(8, sampling={})": ("lptau", "lp_tau"),
    "PSI(8, retry={})": ("incomplete", "all"),
    "SurrogatePSI(16, sampling={})": ("lhs", "LHS"),
    "QMCSampling({})": ("halton", "hamilton"),
    "FailureTolerant(bnh, failed_as={})": ("penalty", "penalties"),
    "SphereChute(0.4, model={})": ("rolling", "rollin"),
}


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """What mypy reports under its strict rules, of all public names and of right and wrong words.

    What the package itself imports is left out: its types take ten times as long to read.
    """
    names = []
    for module in ("pymoo_psi", "pymoo_psi.chute", "pymoo_psi.plots", "pymoo_psi.page"):
        names += [f"from {module} import {name}" for name in import_module(module).__all__]
    words = ["from typing import Any", "bnh: Any = None"]
    words += [f"from pymoo_psi import {call.partition('(')[0]}" for call in WORDS]
    words += [call.format(repr(right)) for call, (right, _) in WORDS.items()]
    words += [call.format(repr(wrong)) for call, (_, wrong) in WORDS.items()]
    folder = tmp_path_factory.mktemp("types")
    rules = (
        "[mypy]\nstrict = True\nfollow_imports = silent\n"
        f"[mypy-{','.join(f'{name}.*' for name in HEAVY)}]\n"
        "follow_imports = skip\nfollow_imports_for_stubs = True\n"
    )
    files = {"names.py": "\n".join(names), "words.py": "\n".join(words), "mypy.ini": rules}
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "names.py", "words.py"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    assert not done.stderr
    return done.stdout


@pytest.mark.slow
def test_type_checkers_find_every_public_name(reported):
    """Names must be public explicitly, with a py.typed."""
    assert "names.py" not in reported


@pytest.mark.slow
def test_type_checkers_know_the_words_of_arguments(reported):
    last = 2 + 3 * len(WORDS)
    for line in range(last - len(WORDS) + 1, last + 1):
        assert f"words.py:{line}: error: Argument" in reported
    assert f"Found {len(WORDS)} errors" in reported


def test_every_dependency_has_a_floor():
    """The oldest releases of the matrix are these floors."""
    own = metadata("pymoo-psi")["Name"]
    for requirement in requires("pymoo-psi"):
        assert requirement.startswith(own) or re.match(r"[\w-]+(\[\w+\])?>=\d", requirement)
