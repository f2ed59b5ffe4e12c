"""What a stranger installs: metadata, types, a light import, a command that completes."""

import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import metadata, requires

HEAVY = ("click", "matplotlib", "pymoo", "numpy", "pandas")


def loaded(code, modules):
    """Which of the modules a bare interpreter with warnings as errors has after the code."""
    ask = f"import sys; print([m for m in {modules!r} if m in sys.modules], file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", f"{code}\n{ask}"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stderr.strip()


def test_no_public_name_brings_a_face():
    code = "import pymoo_psi\nfor name in pymoo_psi.__all__: getattr(pymoo_psi, name)"
    assert loaded(code, ("matplotlib.pyplot", "click")) == "[]"


def test_type_checkers_find_every_public_name(tmp_path):
    """Under mypy's strict rules, which want names to be public explicitly, and a py.typed.

    What the package itself imports is left out: its types take ten times as long to read.
    """
    names = [
        f"from {module} import {name}"
        for module in ("pymoo_psi", "pymoo_psi.chute", "pymoo_psi.plots", "pymoo_psi.page")
        for name in import_module(module).__all__
    ]
    (tmp_path / "names.py").write_text("\n".join(names))
    (tmp_path / "mypy.ini").write_text(
        "[mypy]\nstrict = True\nfollow_imports = silent\n"
        f"[mypy-{','.join(f'{name}.*' for name in HEAVY)}]\n"
        "follow_imports = skip\nfollow_imports_for_stubs = True\n"
    )
    command = [sys.executable, "-m", "mypy", "names.py"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout


def test_help_loads_nothing_heavy():
    code = "from pymoo_psi.cli import main\nassert main(['--help']) == 0"
    assert loaded(code, HEAVY) == "['click']"


def test_every_dependency_has_a_floor():
    """The oldest releases of the matrix are these floors."""
    own = metadata("pymoo-psi")["Name"]
    for requirement in requires("pymoo-psi"):
        assert requirement.startswith(own) or re.match(r"[\w-]+(\[\w+\])?>=\d", requirement)
