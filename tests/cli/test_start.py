"""A command imports what it needs: what a small table does not need would take most of its time."""

import json
import sys

import pytest

from tests.helpers.draws import rarely
from tests.helpers.processes import printed_by

# What `rank` of a CSV may import of other packages, and of this one.
OTHERS = {"click", "lazy_loader", "msgspec", "numpy", "typing_extensions"}
OURS = {"analysis", "cli", "errors", "files", "guide", "pareto", "sequences", "table"}
# Parts of the standard library that take long, and that it does not need.
SLOW = {
    "asyncio",
    "concurrent.futures",
    "email",
    "importlib.metadata",
    "logging",
    "multiprocessing",
    "sqlite3",
    "ssl",
    "subprocess",
    "urllib.request",
}

PROGRAM = """
import json, sys
before = {*sys.modules}
from pymoo_psi.cli import main
code = main(sys.argv[1:])
print(json.dumps([code, *({*sys.modules} - before)]))
"""


def imported(folder, *words):
    """Return the modules that a command imports in a process of its own."""
    printed = printed_by(sys.executable, "-c", PROGRAM, *words, cwd=folder)
    code, *modules = json.loads(printed.splitlines()[-1])
    assert code == 0, printed
    # NumPy 1.25 has some of Cython's, which are no files.
    return {name for name in modules if "cython" not in name}


@pytest.mark.parametrize(
    "text",
    [
        "Auto;Preis;Reichweite\nA;20000,5;200\nB;24000;310,25\nC;45000;470\n",
        *rarely(
            "car,price,range\nTown,20000,200\nLane,24000,310\nCoast,45000,470\nTour,60000,460\n",
            "".join(f"{x},{(1 - x / 99) ** 2}\n" for x in range(100)).join(["f1,f2\n", ""]),
        ),
    ],
)
def test_a_ranking_of_a_small_table_needs_neither_pandas_nor_pymoo(text, tmp_path):
    (tmp_path / "cars.csv").write_text(text)
    modules = imported(tmp_path, "rank", "cars.csv")
    packages = {name.partition(".")[0] for name in modules} - {*sys.stdlib_module_names}
    assert packages - {"pymoo_psi"} <= OTHERS
    ours = {name.split(".")[1] for name in modules if name.startswith("pymoo_psi.")}
    assert {name for name in ours if not name.startswith("_")} <= OURS
    code = "import click, json, msgspec, numpy, sys; print(json.dumps([*sys.modules]))"
    printed = printed_by(sys.executable, "-c", code)
    assert not (modules & SLOW) - set(json.loads(printed))  # what NumPy of 2023 needs itself


NUMBERS = {"numpy", "scipy", "pandas", "pymoo", "matplotlib", "msgspec"}


@pytest.mark.parametrize(
    ("words", "others"),
    [
        ("rank --help", NUMBERS),
        pytest.param("solve bnh --points 64", {"pandas", "matplotlib"}, marks=pytest.mark.slow),
        pytest.param("--help", NUMBERS, marks=pytest.mark.slow),
        pytest.param("--version", NUMBERS, marks=pytest.mark.slow),
    ],
)
def test_help_needs_no_numbers_and_a_test_problem_no_frames(words, others, tmp_path):
    assert not others & imported(tmp_path, *words.split())
