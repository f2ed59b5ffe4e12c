"""The site of the documentation: complete, without a dead link, and without a network."""

import inspect
import os
import re
import shlex
import sys
from dataclasses import fields
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import pymoo_psi
from pymoo_psi import Decision, Formulation, problems
from pymoo_psi.cli._app import app
from tests.helpers.processes import printed_by

pytest.importorskip("sphinx", reason="the extra 'docs' is not installed")
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # the first of them builds the site
ROOT = Path(__file__).parents[1]


class Page(HTMLParser):
    """What a page loads and refers to, and what can be referred to in it."""

    def __init__(self, path):
        super().__init__()
        self.references, self.loaded, self.anchors = set(), set(), set()
        self.text = path.read_text("utf-8")
        self.feed(self.text)

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.references |= {values[name] for name in ("href", "src") if values.get(name)}
        self.loaded |= {values[name] for name in ("href", "src") if tag != "a" and values.get(name)}
        self.anchors |= {values["id"]} if "id" in values else set()


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site and its pages, as the command for contributors builds it."""
    folder = tmp_path_factory.mktemp("docs") / "site"
    text = (ROOT / ".github" / "CONTRIBUTING.md").read_text("utf-8")
    (command,) = re.findall(r"^sphinx-build (.*) site$", text, re.M)
    printed_by(
        *(sys.executable, "-m", "sphinx", *shlex.split(command), folder),  # -W: no warning
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT / "src")},
    )
    paths = [path for path in folder.rglob("*.html") if "_static" not in path.parts]
    return folder, {path: Page(path) for path in paths}


@pytest.fixture(scope="module")
def folder(site):
    return site[0]


@pytest.fixture(scope="module")
def pages(site):
    return site[1]


def test_no_link_is_dead_and_nothing_is_loaded(pages):
    broken = []
    for path, page in pages.items():
        assert not [url for url in page.loaded if urlsplit(url).scheme in ("http", "https")], path
        for reference in map(urlsplit, page.references):
            if reference.scheme:  # of the web, or a picture within the page
                continue
            target = (path.parent / unquote(reference.path)).resolve() if reference.path else path
            anchors = pages[target].anchors if target in pages else {""}
            if not target.is_file() or unquote(reference.fragment) not in anchors | {""}:
                broken.append((path.name, reference.geturl()))
    assert broken == []


@pytest.mark.parametrize(
    "subpackage",
    sorted(
        {name for name in pymoo_psi.__all__ if inspect.ismodule(getattr(pymoo_psi, name))}
        - {"guide"}
    ),
)
def test_every_public_name_is_in_the_reference(folder, pages, subpackage):
    """Figures and classes of errors are among them."""
    module = import_module(f"pymoo_psi.{subpackage}")
    names = getattr(module, "__all__", None) or [
        name for name, item in vars(module).items() if inspect.isclass(item) and name[0] != "_"
    ]
    described = {f"pymoo_psi.{subpackage}.{name}" for name in names if name != "Any"}
    assert described <= pages[folder / "reference" / f"{subpackage}.html"].anchors


def test_every_figure_is_in_the_gallery(folder, pages):
    links = set().union(*(pages[path].references for path in folder.glob("gallery/*.html")))
    names = {link.partition("#pymoo_psi.")[2] for link in links}
    figures = {f"plots.{name}" for name in pymoo_psi.plots.__all__ if name.startswith("plot_")}
    assert (
        figures | {"plots.paper_figures", "page.decision_page", "report.decision_report"} <= names
    )


def test_every_command_and_option_is_in_the_reference(folder, pages):
    anchors = pages[folder / "reference" / "commands.html"].anchors
    for name, command in app.commands.items():
        assert f"pymoo-psi-{name}" in anchors
        for option in command.params:
            if option.param_type_name == "option" and not option.hidden:
                assert f"cmdoption-pymoo-psi-{name}-{option.opts[0].lstrip('-')}" in anchors


def test_every_key_of_a_file_is_in_the_reference(folder, pages):
    shown = set(re.findall(r'<span class="pre">([^<]*)</span>', pages[folder / "files.html"].text))
    example = Path(problems.__file__).with_name("program.toml").read_text("utf-8")
    sections = set(re.findall(r"^(\[\w+\])", example, re.M))
    keys = set(re.findall(r"(\w+)\s*= ", re.sub(r'"[^"]*"', "", example)))
    of_users = {"width", "height", "area", "teeth", "steel", "stress", "tip", "load", "mass"}
    assert sections | (keys - of_users - {"slender", "minimize", "maximize"}) <= shown
    assert {field.name for field in (*fields(Formulation), *fields(Decision)[1:])} <= shown
