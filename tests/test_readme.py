"""The README and the guides: all that they print is run, in an empty folder, and prints that."""

import doctest
import os
import re
import shlex
import subprocess
import sys
import webbrowser
from pathlib import Path

import pytest

import pymoo_psi
from pymoo_psi import VectorizedSphereChute, guide, investigate, paper
from pymoo_psi.chute import ChuteParameters, criteria, motion
from pymoo_psi.cli import main
from pymoo_psi.files import FORMATS
from pymoo_psi.paper import published_table

README = Path(__file__).parents[1] / "README.md"
# A block, with the name of the file that it is to be saved as above it.
BLOCK = re.compile(r"(?:^<!-- (\S+) -->\n)?^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SECTIONS = dict(
    re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", README.read_text("utf-8"), re.MULTILINE | re.DOTALL)
)
GUIDES = {
    path.stem: path.read_text("utf-8")
    for path in (Path(pymoo_psi.__file__).parent / "guide").glob("*.md")
}
TEXTS = {title: text for title, text in (SECTIONS | GUIDES).items() if BLOCK.search(text)}

# Their clusters, processes, figures and whole programs take most of the time.
WHOLE = {
    "A program",
    "analyst",
    "board",
    "changing_a_study",
    "cluster",
    "engineer_python",
    "figures",
    "live",
    "mixtures",
    "noise",
    "programs",
    "pymoo_user",
    "researcher",
    "tutorial",
    "which_runner",
}


@pytest.fixture
def formats():
    """The registry of file formats, as it was after a guide has added one."""
    before = [*FORMATS]
    yield
    FORMATS[:] = before


@pytest.mark.usefixtures("formats")
@pytest.mark.parametrize(
    "title",
    [pytest.param(title, marks=pytest.mark.slow if title in WHOLE else ()) for title in TEXTS],
)
def test_each_text_runs_alone_as_printed(title, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)  # this file runs without the fixtures of the others, too
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    # A worker of Dask may report an error of its heartbeat while its cluster is closed.
    monkeypatch.setenv("DASK_LOGGING__DISTRIBUTED", "critical")
    blocks, printed, names = BLOCK.findall(TEXTS[title]), "", {}
    following = [*(kind for _, kind, _ in blocks[1:]), ""]
    for (name, kind, text), after in zip(blocks, following, strict=True):
        if name:
            Path(name).parent.mkdir(exist_ok=True)
            Path(name).write_text(text, "utf-8")
        if kind == "python" and text.startswith(">>> "):
            flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
            dialogue = doctest.DocTestParser().get_doctest(text, names, title, title, 0)
            runner = doctest.DocTestRunner(optionflags=flags)
            assert runner.run(dialogue, clear_globs=False).failed == 0
            names = dialogue.globs
        elif kind == "python" and after == "text":
            command = [sys.executable, "-W", "error", *([name] if name else ["-c", text])]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert (done.returncode, done.stderr) == (0, "")
            printed = done.stdout
        elif kind == "sh":
            capsys.readouterr()
            for line in re.findall(r"^pymoo-psi (.*)$", text, re.MULTILINE):
                assert main(shlex.split(line, comments=True)) == 0, capsys.readouterr().err
            printed = capsys.readouterr().out
            for file in re.findall(r"^python (\w+\.py)$", text, re.MULTILINE):
                subprocess.run([sys.executable, "-W", "error", file], check=True)
        elif kind == "text":
            assert " ".join(text.split()) in " ".join(printed.split())
        else:
            assert name, f"a block of {kind} that is neither run nor saved"


def test_commands_and_options_are_real(capsys, monkeypatch):
    """Also those within sentences, which nothing runs."""
    monkeypatch.setenv("COLUMNS", "200")
    known = {}
    for text in (README.read_text("utf-8"), *GUIDES.values()):
        text = text.replace("\\\n", "")
        for command, words in re.findall(r"pymoo-psi ([a-z]+)([^`\n]* --[^`\n]*)", text):
            if command not in known:
                assert main([command, "--help"]) == 0
                known[command] = set(re.findall(r"--[a-z-]+", capsys.readouterr().out))
            assert set(re.findall(r"(?<= )--[a-z-]+", words)) <= known[command], words
    assert len(known) > 8


@pytest.mark.parametrize("mu", [0.2, 0.4, 0.6])
def test_both_optima_are_as_in_the_tables(mu):
    def numbers(text):
        return [float(number) for number in re.findall(r"[\d.]+", text)]

    optimum = {}
    for model in ("rolling", "full"):
        table = investigate(VectorizedSphereChute(mu, model=model), 4096)
        best = table.take(table.pareto()).take(table.under(normalize=False).ranking().salukvadze)
        optimum[model] = [*best.numbers.tolist(), *best.F[0].round(4).tolist()]
        if model == "rolling":
            moved = criteria(motion(*best.X.T, ChuteParameters(mu=mu)))[0, :2].round(4).tolist()
    printed = published_table("6.1").set_index("mu").loc[mu, "paper_f1":].tolist()
    rolling, full = optimum.values()
    lines = re.findall(rf"^{mu} \D*(.*)$", paper.__doc__, re.MULTILINE)
    rows = [printed, rolling, [rolling[0], *moved, *rolling[3:]], full]
    assert [numbers(line) for line in lines] == rows
    cells = re.search(rf"^\| {mu} \|(.*)\|$", TEXTS["researcher"], re.MULTILINE)[1].split("|")
    assert [numbers(cell) for cell in cells] == [printed, rolling[1:], full[1:]]


def test_the_citation_is_that_of_this_version(capsys):
    assert main(["--cite"]) == 0
    entries = capsys.readouterr().out
    assert entries == pymoo_psi.__citation__
    file = README.parent / "CITATION.cff"
    if not file.exists():
        pytest.skip("no checkout")
    cited = file.read_text("utf-8")
    assert f"\nversion: {pymoo_psi.__version__}\n" in cited
    for title in re.findall(r'title: "(.*)"', cited):
        assert title in " ".join(entries.split())


def test_guides_are_listed_printed_and_opened(capsys, tmp_path, monkeypatch):
    def printed(*words, code=0):
        assert main(["guide", *words]) == code
        return "".join(capsys.readouterr())

    monkeypatch.chdir(tmp_path)
    assert {line.split()[0] for line in printed().splitlines()[:-1]} == {*GUIDES} - {"index"}
    assert printed("index") == printed()
    assert printed("tutorial").rstrip() == GUIDES["tutorial"].rstrip()
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    page = Path("site", "board.html").absolute()
    page.parent.mkdir()
    page.touch()
    printed("board", "--open")
    assert opened == [page.as_uri()]
    checkout = tmp_path / "src/pymoo_psi/guide"
    checkout.mkdir(parents=True)
    (checkout / "noise.md").touch()
    monkeypatch.setattr(guide, "__file__", str(checkout / "__init__.py"))
    assert "neither this folder nor a checkout has" in printed("noise", "--open", code=2)


def test_on_a_package_index_no_link_leads_nowhere():
    """An index has the README without its repository: the picture, a file of it, is left out."""
    tomllib = pytest.importorskip("tomllib", reason="Python 3.10 reads no TOML")
    if not (project := README.parent / "pyproject.toml").exists():
        pytest.skip("no checkout")
    hooks = tomllib.loads(project.read_text("utf-8"))["tool"]["hatch"]["metadata"]["hooks"]
    text = README.read_text("utf-8")
    for change in hooks["fancy-pypi-readme"]["substitutions"]:
        text = re.sub(change["pattern"], change["replacement"], text)
    targets = re.findall(r"\]\(([^)]*)\)|(?:src|href)=\"([^\"]*)\"", text)
    assert all(re.match("https://|#", "".join(target)) for target in targets)
