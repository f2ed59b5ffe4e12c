"""The README: its Python blocks run as printed in an empty folder, its commands and numbers hold."""

import doctest
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pymoo_psi
from pymoo_psi import VectorizedSphereChute, investigate, paper
from pymoo_psi.chute import ChuteParameters, criteria, motion
from pymoo_psi.cli import main
from pymoo_psi.paper import published_table

README = Path(__file__).parents[1] / "README.md"


SECTIONS = re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", README.read_text("utf-8"), re.M | re.S)
DIALOGUES = {title: text for title, text in SECTIONS if "\n>>> " in text}
SCRIPT = r"```python\n(?!>>> )(.*?)```\n\n```text\n(.*?)```"
SCRIPTS = {title: found for title, text in SECTIONS if (found := re.findall(SCRIPT, text, re.S))}


@pytest.mark.parametrize("title", DIALOGUES)
def test_each_section_runs_alone_as_printed(title, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    dialogue = doctest.DocTestParser().get_doctest(DIALOGUES[title], {}, title, "README.md", 0)
    failed, tried = doctest.DocTestRunner(optionflags=flags).run(dialogue)
    assert (failed, tried > 1) == (0, True)


@pytest.mark.parametrize("title", SCRIPTS)
def test_scripts_print_what_stands_below_them(title, tmp_path):
    for script, printed in SCRIPTS[title]:
        (tmp_path / "script.py").write_text(script, "utf-8")
        command = [sys.executable, "-W", "error", "script.py"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.stdout.split(), done.stderr) == (printed.split(), "")


def test_every_python_block_is_one_that_runs():
    text = README.read_text("utf-8")
    scripts = sum(len(found) for found in SCRIPTS.values())
    assert len(SCRIPTS) > 1
    assert text.count("```python") == text.count("```python\n>>> ") + scripts


def test_commands_and_options_are_real(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")

    def shown(*words):
        assert main([*words, "--help"]) == 0
        return capsys.readouterr().out

    text = README.read_text("utf-8")
    section = re.search(r"## The command\n(.*?)\n## ", text, re.DOTALL)[1]
    listed = set(re.findall(r"[a-z]+", " ".join(re.findall(r"^\| (`.*?) \|", section, re.M))))
    commands = set(re.findall(r"^  ([a-z]+)  ", shown().partition("Commands:")[2], re.M))
    assert commands == listed - {"pymoo", "psi"}
    for line in re.findall(r"pymoo-psi [a-z]+ .*--.*", text.replace("\\\n", "")):
        known = shown(line.split()[1])
        assert set(re.findall(r"--[a-z-]+", line)) <= set(re.findall(r"--[a-z-]+", known)), line


@pytest.mark.parametrize("mu", [0.2, 0.4, 0.6])
def test_both_optima_are_as_in_the_tables(mu):
    def row(text):
        cells = re.search(rf"^\| {mu} \|(.*)\|$", text, re.MULTILINE)[1].split("|")
        return [[float(number) for number in re.findall(r"[\d.]+", cell)] for cell in cells]

    optimum = {}
    for model in ("rolling", "full"):
        table = investigate(VectorizedSphereChute(mu, model=model), 4096)
        best = table.rows(table.pareto()).rows(table.ranking(normalize=False).salukvadze)
        optimum[model] = [*best.numbers.tolist(), *best.F[0].round(4).tolist()]
        if model == "rolling":
            moved = criteria(motion(*best.X.T, ChuteParameters(mu=mu)))[0, :2].round(4).tolist()
    printed = published_table("6.1").set_index("mu").loc[mu, "paper_f1":].tolist()
    assert row(paper.__doc__) == [printed, optimum["rolling"], moved, optimum["full"]]
    of_criteria = [printed, optimum["rolling"][1:], optimum["full"][1:]]
    assert row(README.read_text("utf-8")) == of_criteria


def test_the_citation_is_of_this_version():
    assert f"version = {{{pymoo_psi.__version__}}}" in README.read_text("utf-8")


def test_there_are_two_commands_for_a_fresh_machine():
    text = README.read_text("utf-8")
    assert len(re.findall(r"^pip install .*&& ", text, re.MULTILINE)) == 2
