"""The layers of the package, read off its imports, and the promises of its front door."""

import ast
import dataclasses
import importlib
import inspect
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import pymoo_psi

ROOT = Path(pymoo_psi.__file__).parent

# Each layer may import the ones before it. A name stands for a module or a package.
LAYERS = [
    ("ground", {"errors", "_validation", "_files", "_kinds", "_tables"}),
    ("mathematics", {"sequences", "chute", "pareto"}),
    ("method", {"table", "study"}),
    (
        "pymoo",
        {"problems", "parallel", "algorithms", "selection"},
    ),
    ("experiments", {"comparison", "paper"}),
    ("faces", {"plots", "page", "report", "cli", "__main__"}),
]
LEVEL = {room: level for level, (_, rooms) in enumerate(LAYERS) for room in rooms}
# Outside packages that belong to some layers only.
ONLY = {
    "pymoo": {"pymoo", "experiments", "faces"},
    "matplotlib": {"faces"},
    "sqlite3": {"method"},
    "moocore": {"mathematics"},
    "rich": {"faces"},
    "typer": {"faces"},
    "joblib": {"pymoo", "experiments", "faces"},
}


def nodes(tree, *, inside_functions):
    for node in ast.iter_child_nodes(tree):
        if inside_functions or not isinstance(node, ast.FunctionDef):
            yield node
            yield from nodes(node, inside_functions=inside_functions)


@cache
def tree(path):
    return ast.parse(path.read_text("utf-8"))


@cache
def import_statements(path, *, inside_functions):
    return [
        node
        for node in nodes(tree(path), inside_functions=inside_functions)
        if isinstance(node, (ast.Import, ast.ImportFrom))
    ]


def imports(path, *, inside_functions=True, files=()):
    """All modules a file imports, those under TYPE_CHECKING too; ``files`` are known modules."""
    for node in import_statements(path, inside_functions=inside_functions):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        else:
            assert node.level == 0, f"{path}: imports are absolute"
            inside = {f"{node.module}.{alias.name}" for alias in node.names}.intersection(files)
            yield from inside or {node.module}


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


def test_each_layer_imports_only_downwards():
    """Also inside functions, where an import is hidden from the reader."""
    assert [
        rule
        for path in FILES
        for rule in broken_rules(path.relative_to(ROOT).parts[0].removesuffix(".py"), imports(path))
    ] == []


def test_the_rule_can_be_broken():
    assert list(broken_rules("pareto", ["pymoo_psi.problems._sphere_chute"]))
    assert list(broken_rules("chute", ["pymoo.core.problem"]))
    assert not list(broken_rules("cli", ["pymoo_psi.pareto", "typer"]))


def circles(graph):
    """Return the nodes of a graph from which a way leads back to them."""

    def reachable(start):
        found, ahead = set(), list(graph.get(start, ()))
        while ahead:
            node = ahead.pop()
            if node not in found:
                found.add(node)
                ahead += graph.get(node, ())
        return found

    return [node for node in graph if node in reachable(node)]


def test_circles_are_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == ["a", "b", "c"]
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_no_rooms_import_each_other():
    graph = {}
    for path in FILES:
        room = path.relative_to(ROOT).parts[0].removesuffix(".py")
        rooms = {m.split(".")[1] for m in imports(path) if m.startswith("pymoo_psi.")}
        graph.setdefault(room, set()).update(rooms - {room})
    assert circles(graph) == []


def test_no_files_import_each_other():
    """Not even for type checkers. What a function imports when it is called does not count."""
    names = {
        path: ".".join(("pymoo_psi", *path.relative_to(ROOT).with_suffix("").parts))
        for path in FILES
    }
    names = {path: name.removesuffix(".__init__") for path, name in names.items()}
    graph = {
        name: set(imports(path, inside_functions=False, files=names.values()))
        for path, name in names.items()
    }
    assert circles(graph) == []


def test_every_module_of_a_room_is_private():
    """A room's ``__init__`` is its index."""
    modules = {path.relative_to(ROOT).as_posix() for path in FILES if len(path.parts) > 1}
    open_doors = {name for name in modules if "/" in name and "/_" not in name}
    assert open_doors == set()


def test_every_public_name_is_there():
    assert all(hasattr(pymoo_psi, name) for name in pymoo_psi.__all__)
    assert set(pymoo_psi.__all__) <= set(dir(pymoo_psi))
    with pytest.raises(AttributeError, match="absent"):
        pymoo_psi.absent  # noqa: B018


def documented(module):
    """The public classes and functions of a module, and what results of ours can be asked."""
    for name in module.__all__:
        item = getattr(module, name)
        if inspect.isclass(item) or inspect.isfunction(item):
            yield name, item
        if dataclasses.is_dataclass(item):
            for part in dir(item):
                member = inspect.getattr_static(item, part)
                asked = isinstance(member, (property, staticmethod, classmethod))
                if not part.startswith("_") and (asked or inspect.isfunction(member)):
                    yield f"{name}.{part}", member


@pytest.mark.parametrize(
    "room", ["", ".chute", ".plots", ".page", ".report", ".paper", ".comparison"]
)
def test_every_public_name_has_an_example(room):
    """What the examples show is tested by running them: pytest takes the doctests of ``src``."""
    items = list(documented(importlib.import_module(f"pymoo_psi{room}")))
    assert len(items) > 3
    assert [name for name, item in items if ">>> " not in (item.__doc__ or "")] == []


@pytest.mark.parametrize(
    "names",
    [
        {
            "": ("pymoo", "pandas", "scipy", "matplotlib", "typer", "joblib"),
            "rank_of_efficiency": ("pymoo", "pandas", "scipy"),
            "TestTable": ("pymoo", "pandas", "scipy", "sqlite3"),
        },
        {
            "SalukvadzeOptimum": ("pymcdm", "pandas", "scipy", "joblib", "pymoo_psi.table"),
            "SphereChute": ("pandas", "scipy", "pymoo_psi.table"),
            "FailureTolerant": ("pandas", "scipy"),
            "investigate": ("pandas", "scipy", "joblib"),
            "PSI": ("pandas", "scipy"),
            "nsga3": ("scipy",),
        },
    ],
    ids=" ".join,
)
def test_a_name_brings_what_it_needs_only(names):
    """The names are taken one after the other: none could bring what is absent after it."""
    code = "import sys, pymoo_psi\n" + "".join(
        f"pymoo_psi{'.' * bool(name)}{name}\n"
        f"print({name!r}, [m for m in {needless!r} if m in sys.modules])\n"
        for name, needless in names.items()
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == [f"{name} []" for name in names]
    assert done.stderr == ""


def test_version_is_the_distributions():
    from importlib.metadata import version

    assert pymoo_psi.__version__ == version("pymoo-psi")
