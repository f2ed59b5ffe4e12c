"""Every Python block of the README runs as printed, in an empty folder; the commands exist."""

import doctest
import re
from pathlib import Path

from typer.testing import CliRunner

from pymoo_psi.cli.app import app

README = Path(__file__).parents[1] / "README.md"


def test_blocks_run_as_printed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    failed, tried = doctest.testfile(str(README), module_relative=False, optionflags=flags)
    assert (failed, tried > 20) == (0, True)


def test_every_python_block_is_one_that_runs():
    blocks = re.findall(r"```python\n(.*?)```", README.read_text("utf-8"), re.DOTALL)
    assert len(blocks) > 5
    assert all(block.startswith(">>> ") for block in blocks)


def test_commands_and_options_are_real():
    """What the README prints in its list of commands is known to the command line."""
    usage = re.search(r"## The command\n\n```\n(.*?)```", README.read_text("utf-8"), re.DOTALL)[1]
    for line in re.sub(r"\n +", " ", usage).splitlines():
        _, command, *_ = line.split()
        known = CliRunner().invoke(app, [command, "--help"]).output
        for option in re.findall(r"--[a-z-]+", line):
            assert option in known, (command, option)


def test_every_option_is_named():
    """What the command line knows is in the README's section on it."""
    section = re.search(r"## The command\n(.*?)\n## ", README.read_text("utf-8"), re.DOTALL)[1]
    usage = re.sub(r"\n +", " ", section.split("```")[1])
    words = set(re.findall(r"--[a-z-]+", section.split("```")[2]))
    listed = {line.split()[1]: line for line in usage.strip().splitlines()}
    commands = {command.name or command.callback.__name__ for command in app.registered_commands}
    assert commands == set(listed)
    for command, line in listed.items():
        known = CliRunner().invoke(app, [command, "--help"], terminal_width=200).output
        options = set(re.findall(r"^ +(?:-h, )?(--[a-z-]+)", known, re.MULTILINE)) - {"--help"}
        assert len(options) > 0
        missing = options - set(re.findall(r"--[a-z-]+", line)) - words
        assert not missing, (command, missing)


def test_there_are_two_commands_for_a_fresh_machine():
    text = README.read_text("utf-8")
    assert len(re.findall(r"^pip install .*&& ", text, re.MULTILINE)) == 2
