"""The site that the README's command makes: all names, all links, all pictures."""

import inspect
import os
import re
import shlex
import subprocess
import sys
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import pymoo_psi

pytest.importorskip("pdoc", reason="the extra 'docs' is not installed")
ROOT = Path(__file__).parents[1]
SUBPACKAGES = {name for name in pymoo_psi.__all__ if inspect.ismodule(getattr(pymoo_psi, name))}


class Page(HTMLParser):
    """What a page refers to, and what can be referred to in it."""

    def __init__(self, path):
        super().__init__()
        self.references, self.anchors, self.pictures = set(), set(), []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.references |= {values[name] for name in ("href", "src") if values.get(name)}
        self.anchors |= {values["id"]} if "id" in values else set()
        self.pictures += [values["src"]] if tag == "img" else []


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site and its pages."""
    folder = tmp_path_factory.mktemp("docs") / "site"
    (command,) = re.findall(
        r"^python (-m pdoc .*) -o site$", (ROOT / "README.md").read_text("utf-8"), re.M
    )
    done = subprocess.run(
        [sys.executable, *shlex.split(command), "-o", str(folder)],
        env=os.environ | {"PYTHONPATH": str(ROOT / "src")},  # beside its README, however installed
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return folder, {path: Page(path) for path in folder.rglob("*.html")}


def test_every_link_leads_somewhere(site):
    _, pages = site
    broken = []
    for path, page in pages.items():
        for reference in map(urlsplit, page.references):
            if reference.scheme:  # of the web, or a picture within the page
                continue
            target = (path.parent / unquote(reference.path)).resolve() if reference.path else path
            anchors = pages[target].anchors if target in pages else {""}
            if not target.is_file() or unquote(reference.fragment) not in anchors | {""}:
                broken.append((path.name, reference.geturl()))
    assert broken == []


@pytest.mark.parametrize("subpackage", ["", *sorted(SUBPACKAGES)])
def test_every_public_name_is_on_the_page_of_its_subpackage_and_is_found(site, subpackage):
    folder, pages = site
    module = import_module(f"pymoo_psi.{subpackage}".rstrip("."))
    page = pages[
        folder / "pymoo_psi" / f"{subpackage}.html" if subpackage else folder / "pymoo_psi.html"
    ]
    names = [
        name
        for name, item in inspect.getmembers(module)
        if not name.startswith("_") and (inspect.isclass(item) or inspect.isfunction(item))
        if name in getattr(module, "__all__", [name]) and item.__module__.startswith("pymoo_psi")
    ]
    assert names or subpackage == "guide"
    assert set(names) <= page.anchors
    index = (folder / "search.js").read_text("utf-8")
    assert all(f'"{name}"' in index for name in names)


def test_the_readme_is_on_the_first_page_with_its_picture(site):
    folder, pages = site
    page = pages[folder / "pymoo_psi.html"]
    assert {"decide-on-your-own-table", "the-paper"} <= page.anchors
    assert any(picture.startswith("data:image/png;base64,") for picture in page.pictures)
