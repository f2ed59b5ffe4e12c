"""What a stranger installs: metadata, types, a light import, a command that completes."""

import re
import subprocess
import sys
from importlib import import_module
from importlib.metadata import metadata, requires

import pytest

from pymoo_psi.cli import main

HEAVY = ("typer", "matplotlib", "pymoo", "numpy", "pandas")


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
    assert loaded(code, ("matplotlib.pyplot", "typer")) == "[]"


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
    assert loaded(code, HEAVY) == "['typer']"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell, monkeypatch, capsys):
    def command(**environment):
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        with pytest.raises(SystemExit) as end:
            main([])
        assert end.value.code in (0, None)
        return capsys.readouterr().out

    assert "_PYMOO_PSI_COMPLETE" in command(_PYMOO_PSI_COMPLETE=f"source_{shell}")
    completed = command(
        _PYMOO_PSI_COMPLETE=f"complete_{shell}",
        COMP_WORDS="pymoo-psi repr",
        COMP_CWORD="1",
        _TYPER_COMPLETE_ARGS="pymoo-psi repr",
        _TYPER_COMPLETE_FISH_ACTION="get-args",
    )
    assert "reproduce" in completed
    assert "solve" not in completed


def test_every_dependency_has_a_floor():
    """The oldest releases of the matrix are these floors."""
    own = metadata("pymoo-psi")["Name"]
    for requirement in requires("pymoo-psi"):
        assert requirement.startswith(own) or re.match(r"[\w-]+(\[\w+\])?>=\d", requirement)
