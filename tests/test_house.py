"""The layers of the package, read off its imports, and the promises of its front door."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import pymoo_psi

ROOT = Path(pymoo_psi.__file__).parent

# Each layer may import the ones before it. A name stands for a module or a package.
LAYERS = [
    ("ground", {"errors", "arguments"}),
    ("mathematics", {"sequences", "chute", "pareto"}),
    ("method", {"investigation"}),
    (
        "pymoo",
        {
            *("host", "design_space", "problems", "sampling", "algorithms", "selectors"),
            *("mcdm", "agreement", "uncertainty", "runners", "guard", "failures"),
        },
    ),
    ("studies", {"studies"}),
    ("faces", {"figures", "page", "cli", "__main__"}),
]
LEVEL = {room: level for level, (_, rooms) in enumerate(LAYERS) for room in rooms}
# Outside packages that belong to some layers only.
ONLY = {
    "pymoo": {"pymoo", "studies", "faces"},
    "matplotlib": {"faces"},
    "bokeh": {"faces"},
    "sqlite3": {"method"},
    "moocore": {"mathematics"},
    "rich": {"faces"},
    "typer": {"faces"},
    "joblib": {"pymoo", "studies", "faces"},
}


def imports(path):
    """All modules a file imports, those inside functions and under TYPE_CHECKING too."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            yield node.module


def broken_rules(room, modules):
    level = LEVEL[room]
    for module in modules:
        top, _, rest = module.partition(".")
        if top == "pymoo_psi":
            other = rest.partition(".")[0]
            if LEVEL.get(other, 99) > level:
                yield f"{room} ({LAYERS[level][0]}) imports {module}"
        elif LAYERS[level][0] not in ONLY.get(top, {LAYERS[level][0]}):
            yield f"{room} ({LAYERS[level][0]}) imports {module}"


FILES = sorted(path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py")


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_each_layer_imports_only_downwards(path):
    room = path.relative_to(ROOT).parts[0].removesuffix(".py")
    assert list(broken_rules(room, imports(path))) == []


def test_the_rule_can_be_broken():
    assert list(broken_rules("pareto", ["pymoo_psi.problems.sphere_chute"]))
    assert list(broken_rules("chute", ["pymoo.core.problem"]))
    assert not list(broken_rules("cli", ["pymoo_psi.pareto", "typer"]))


def test_no_circles():
    graph = {}
    for path in FILES:
        room = path.relative_to(ROOT).parts[0].removesuffix(".py")
        rooms = {m.split(".")[1] for m in imports(path) if m.startswith("pymoo_psi.")}
        graph.setdefault(room, set()).update(rooms - {room})

    def reachable(start, seen=()):
        return {start} | {
            r for n in graph.get(start, ()) if n not in seen for r in reachable(n, (*seen, start))
        }

    for room, others in graph.items():
        for other in others:
            assert room not in reachable(other), f"{room} and {other} import each other"


def test_every_public_name_is_there_and_documented():
    for name in pymoo_psi.__all__:
        assert getattr(pymoo_psi, name).__doc__, name
    assert set(pymoo_psi.__all__) <= set(dir(pymoo_psi))
    with pytest.raises(AttributeError, match="no attribute 'absent'"):
        pymoo_psi.absent  # noqa: B018


def test_the_index_for_type_checkers_is_the_real_one():
    tree = ast.parse((ROOT / "__init__.py").read_text("utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    listed = {
        alias.name
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert listed == set(pymoo_psi.__all__)


def test_importing_the_package_is_light():
    """Neither the host nor any heavy library comes with the bare import."""
    code = (
        "import sys, pymoo_psi; "
        "print([m for m in ('pymoo', 'pandas', 'scipy', 'matplotlib', 'typer', 'joblib') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
    assert done.stderr == ""


def test_version_is_the_distributions():
    from importlib.metadata import version

    assert pymoo_psi.__version__ == version("pymoo-psi")
