"""The layers of the package, read off its imports, and the promises of its public names."""

import ast
import dataclasses
import inspect
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import pymoo_psi
from tests.helpers.draws import rarely
from tests.helpers.folders import write_files
from tests.helpers.processes import printed_by

ROOT = Path(pymoo_psi.__file__).parent
PROJECT = Path(__file__).parents[1]

# A layer imports only the ones before it; a subpackage of a layer only those before it, too.
LAYERS = {
    "base": [
        "errors",
        "guide",
        "_names",
        "_validation",
        "_kinds",
        "_numbers",
        "_output",
        "_modules",
    ],
    "mathematics": ["sequences", "chute", "pareto"],
    "data": ["table", "analysis", "study", "files"],
    "pymoo": ["parallel", "problems", "algorithms", "selection"],
    "experiments": ["comparison", "paper"],
    "presentation": ["page", "plots", "report", "server", "cli", "__main__"],
}
LEVEL = {name: k for k, name in enumerate(name for names in LAYERS.values() for name in names)}
LAYER = {name: layer for layer, names in LAYERS.items() for name in names}
# Outside packages that belong to some layers or subpackages only.
ONLY = {
    "pymoo": {"pymoo", "experiments", "presentation"},
    "joblib": {"pymoo", "experiments", "presentation"},
    "matplotlib": {"plots"},
    "sqlite3": {"study"},
    "moocore": {"mathematics"},
    "click": {"cli"},
    "starlette": {"server"},
    "uvicorn": {"server"},
}
FILES = sorted(path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py")


def subpackage_of(path):
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


@cache
def imports(path):
    """The modules that a file imports, and the names from them, also inside functions."""
    found = []
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found += [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            found += [(node.module, alias.name) for alias in node.names]
    return found


def modules_of(path):
    return {f"{m}.{name}" if m == "pymoo_psi" and name else m for m, name in imports(path)}


def broken_rules(subpackage, modules):
    for module in modules:
        top, *rest = module.split(".")
        if top == "pymoo_psi" and rest and rest[0] in LEVEL:
            if LEVEL[rest[0]] > LEVEL[subpackage]:
                yield f"{subpackage} imports {module}, which comes later"
            if len(rest) > 1 and rest[0] != subpackage:
                yield f"{subpackage} imports {module}, which is private to {rest[0]}"
        elif not {subpackage, LAYER[subpackage]} & ONLY.get(top, {subpackage}):
            yield f"{subpackage} imports {top}"


def test_layers_import_downwards_and_subpackages_public_names_only():
    assert [
        rule for path in FILES for rule in broken_rules(subpackage_of(path), modules_of(path))
    ] == []


def file_of(module):
    """The file of a module of the package, or of the module of a name."""
    parts = module.split(".")[1:]
    for n in (len(parts), len(parts) - 1):
        path = ROOT.joinpath(*parts[:n])
        for file in (path.with_suffix(".py"), path / "__init__.py"):
            if n and file.exists():
                return file
    return None


def imported_files(path):
    """The files of the package that a file imports, also those of names that it imports."""
    own = [(m, name) for m, name in imports(path) if m.split(".")[0] == "pymoo_psi"]
    return {file_of(f"{m}.{name}".rstrip(".")) for m, name in own} - {None, path}


def test_no_files_import_each_other_in_a_circle():
    """Imports in functions and those for types count."""
    left = {path: imported_files(path) for path in FILES}
    while free := {path for path, files in left.items() if not files & left.keys()}:
        left = {path: files for path, files in left.items() if path not in free}
    assert sorted(path.relative_to(ROOT).as_posix() for path in left) == []


# The files of tests that use private names of subpackages, and why.
PRIVATE = {
    "algorithms/test_psi.py": "only so does a small run drop tests between many pieces",
    "algorithms/test_stream.py": "only so is nothing stored before a run ends",
    "algorithms/test_surrogate_models.py": "no proposal shows the linear algebra of surrogates",
    "cli/conftest.py": "drawing takes most of the time",
    "cli/test_experiments.py": "an interrupt has its moment",
    "cli/test_files.py": "a log has a line a minute",
    "cli/test_help.py": "the options of every command; the paper's points take most of the time",
    "test_site.py": "the options of every command",
}


def test_tests_use_public_names():
    """But for the base layer, which has tests of its own."""
    private = re.compile(r"pymoo_psi(\.\w+)+\._[a-z]|from pymoo_psi(\.\w+)+ import _[a-z]")
    tests = Path(__file__).parent
    found = {path for path in tests.rglob("*.py") if private.search(path.read_text("utf-8"))}
    assert found == {tests / name for name in PRIVATE}


def test_every_module_of_a_subpackage_is_private():
    """The ``__init__`` is the index of the public names."""
    modules = {path.relative_to(ROOT).as_posix() for path in FILES}
    assert {name for name in modules if "/" in name and "/_" not in name} == set()


def declared(requirements):
    names = (re.match("[A-Za-z0-9-]+", text)[0] for text in requirements)
    return {name.lower().replace("-", "_") for name in names}


def outside(modules):
    tops = {module.split(".")[0].lower() for module in modules}
    return tops - {"pymoo_psi"} - {name.lower() for name in sys.stdlib_module_names}


@pytest.fixture
def project():
    tomllib = pytest.importorskip("tomllib", reason="Python 3.10 reads no TOML")
    return tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]


def test_what_is_imported_is_declared_and_the_reverse(project):
    """An extra is imported in functions only; those for tests and documents are of no use here."""
    needed = declared(project["dependencies"])
    optional = project["optional-dependencies"]
    extras = declared(
        text for name in optional if name not in ("test", "docs") for text in optional[name]
    )
    everywhere = outside(module for path in FILES for module in modules_of(path))
    # A notebook brings IPython itself, a type checker typing_extensions.
    assert everywhere - needed - extras <= {"ipython", "typing_extensions"}
    assert needed <= everywhere
    at_once = {
        alias.name if isinstance(node, ast.Import) else node.module
        for path in FILES
        for node in ast.parse(path.read_text("utf-8")).body
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for alias in node.names
    }
    assert outside(at_once) <= needed


@pytest.mark.slow
def test_the_extra_for_tests_is_enough(project):
    """But for the site, whose tests are skipped without Sphinx."""
    needed = declared(project["dependencies"])
    for name in ("test", "xlsx", "cluster", "live"):
        needed |= declared(project["optional-dependencies"][name])
    modules = set().union(*map(modules_of, (PROJECT / "tests").rglob("*.py")))
    own = {"benchmarks", "models", "tests"}  # the second is a module that tests write
    assert outside(modules) - own <= needed


SUBPACKAGES = [name for name in pymoo_psi.__all__ if inspect.ismodule(getattr(pymoo_psi, name))]
OVERVIEWS = [pymoo_psi, *(getattr(pymoo_psi, name) for name in SUBPACKAGES)]


def test_every_public_name_is_in_an_overview():
    """Some ninety names are a promise to users; what subpackages share beside them is none."""
    public = set(pymoo_psi.__all__) - set(SUBPACKAGES)
    assert public < set(dir(pymoo_psi))
    missing = {}
    for module in OVERVIEWS:
        names = set(getattr(module, "__all__", ()))
        missing[module.__name__] = names - set(re.findall(r"\w+", module.__doc__))
        public |= names - set(SUBPACKAGES)
    assert not any(missing.values()), f"not in the docstrings: {missing}"
    assert len(public) <= 97


def refers(module, reference):
    """Whether a name of an overview is in its module or in the package."""
    item = module if hasattr(module, reference.split(".")[0]) else pymoo_psi
    for part in reference.split("."):
        item = getattr(item, part, None)
    return item is not None


def test_every_name_in_an_overview_can_be_imported():
    """The reverse of the test above: an overview refers to nothing that is not there."""
    for module in OVERVIEWS:
        for name in re.findall(r":(?:class|func|mod|meth):`[~.]*([\w.]+)`", module.__doc__):
            assert refers(module, name.removeprefix("pymoo_psi.")), module.__name__


# Where an example of the guide is in the package, and the file.
EXAMPLE = re.compile(r"in the\s+package\s+`(\w+/_\w+\.py)`.*?^```python\n(.*?)^```$", re.M | re.S)


@pytest.fixture
def examples(tmp_path):
    """The examples for contributors, each in the folder in which the package would have it."""
    text = (ROOT / "guide" / "extending.md").read_text("utf-8")
    examples = dict(EXAMPLE.findall(text))
    write_files(tmp_path, examples)
    return [tmp_path / place for place in examples]


def test_examples_for_contributors_keep_the_layers(examples):
    assert len(examples) == 6
    assert [
        rule for path in examples for rule in broken_rules(path.parent.name, modules_of(path))
    ] == []


@pytest.mark.parametrize(
    "command",
    [
        ["ruff", "check", "--config"],
        ["ruff", "format", "--check", "--config"],
        # Without its cache, mypy reads NumPy, pandas and pymoo first.
        pytest.param(["mypy", "--config-file"], marks=[pytest.mark.slow, pytest.mark.timeout(900)]),
    ],
)
def test_examples_for_contributors_pass_as_they_are(examples, command):
    pytest.importorskip(command[0])
    words = [sys.executable, "-m", *command, "pyproject.toml", *map(str, examples)]
    printed_by(*words, cwd=PROJECT)


@pytest.mark.parametrize(
    ("owner", "name", "instead"),
    [
        (pymoo_psi.TestTable.of([1], [[0.1]], [[1, 2]]), "page", "decision_page"),
        (pymoo_psi.rank_of_efficiency([[1, 2]]), "best", "salukvadze"),
        (pymoo_psi, "minimize", "pymoo.optimize.minimize"),
        (pymoo_psi, "absent", "absent"),
        (pymoo_psi.TestTable.of([1], [[0.1]], [[1, 2]]), "parato", "object has no attribute"),
    ],
)
def test_names_of_other_packages_lead_to_ours(owner, name, instead):
    with pytest.raises(AttributeError, match=instead):
        getattr(owner, name)


def documented(module):
    """The public classes and functions of a module, and methods of results."""
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


def test_every_name_of_the_package_has_an_example():
    """The examples are tested by running them: pytest takes the doctests of ``src``."""
    items = list(documented(pymoo_psi))
    assert len(items) > 30
    assert [name for name, item in items if ">>> " not in (item.__doc__ or "")] == []


@pytest.mark.parametrize(
    "needless",
    [
        {
            "import pymoo_psi": ("pymoo", "pandas", "scipy", "matplotlib", "click", "joblib"),
            "pymoo_psi.rank_of_efficiency": ("pymoo", "pandas", "scipy"),
            "pymoo_psi.TestTable": ("pymoo", "pandas", "scipy", "sqlite3"),
        },
        *rarely(
            {
                "from pymoo_psi import SalukvadzeOptimum": (
                    *("pandas", "scipy", "joblib", "pymoo_psi.table"),
                ),
                "from pymoo_psi import SphereChute": ("pandas", "scipy", "pymoo_psi.table"),
                "from pymoo_psi import FailureTolerant": ("pandas", "scipy"),
                "from pymoo_psi import investigate": ("pandas", "scipy", "joblib"),
                "from pymoo_psi import PSI": ("pandas", "scipy"),
                "from pymoo_psi import nsga3": ("scipy",),
                "from pymoo_psi import *": ("matplotlib.pyplot", "click"),
            },
        ),
    ],
    ids=["what is ranked", "what is run"],
)
def test_a_name_imports_what_it_needs_only(needless):
    """The steps are taken one after the other: none could bring what is absent after it."""
    code = "import sys\n" + "".join(
        f"{step}\nprint([m for m in {modules!r} if m in sys.modules], file=sys.stderr)\n"
        for step, modules in needless.items()
    )
    unmeasured = {name: text for name, text in os.environ.items() if not name.startswith("COV")}
    command = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=unmeasured)
    assert done.stderr.splitlines() == ["[]"] * len(needless)


def test_version_is_the_distributions():
    from importlib.metadata import version

    installed = version("pymoo-psi")
    assert pymoo_psi.__version__ == installed, "the version has changed: pip install -e . once more"


def test_scripts_of_the_page_share_no_names():
    """They are one script in the page, where the later one of two functions replaces the other."""
    names = []
    for path in (ROOT / "page").glob("*.js"):
        names += re.findall(r"^(?:async )?function\*? (\w+)", path.read_text("utf-8"), re.M)
    assert sorted(names) == sorted({*names})
