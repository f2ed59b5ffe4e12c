"""What --help says holds: its examples can be pasted, and it fits a terminal of 80 columns."""

import re
import shlex
import sys
from functools import partial

import pytest
from matplotlib.figure import Figure

from pymoo_psi.cli import _analyze, _compare, _reproduce, main
from pymoo_psi.cli._app import app
from pymoo_psi.report._parts import Picture

DRAWING = {
    _reproduce: ["save_figures", "save_pages", "points_page"],
    _analyze: ["save_pages", "sensitivity_page", "convergence_page", "draw_feasibility"],
    _compare: ["save_comparison"],
}
COMMANDS = [command.callback.__name__ for command in app.registered_commands]


def shown(capsys, *words):
    assert main([*words, "--help"]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_every_example_runs_as_printed(command, capsys, tmp_path, monkeypatch, coarse):
    monkeypatch.chdir(tmp_path)
    # Drawing is tested with the plots, and takes most of the time; so do the paper's points and
    # the continuous optimum of ten variables.
    for module, draws in DRAWING.items():
        for name in draws:
            monkeypatch.setattr(module, name, lambda *args, **options: Figure())
    monkeypatch.setattr(Picture, "image", lambda picture: "")
    reproduce, compare = _reproduce.reproduce, _compare.compare
    monkeypatch.setattr(_reproduce, "reproduce", lambda n, **more: reproduce(min(n, 16), **more))
    monkeypatch.setattr(_compare, "compare", partial(compare, polish=False))
    text = shown(capsys, *command.split())
    examples = re.findall(r"^ +(pymoo-psi .*)$", text.partition("Examples:")[2], re.MULTILINE)
    assert examples
    assert command in examples[-1]
    for example in examples:
        _, *words = shlex.split(example)
        assert main(words) == 0, (example, capsys.readouterr().err)
        assert capsys.readouterr().err.count("error") == 0


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_fits_80_columns_and_tells_each_command_whole(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    text = shown(capsys, *command.split())
    assert max(map(len, text.splitlines())) <= 80
    assert "..." not in text.partition("Commands:")[2]


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["solv", "bnh"], "did you mean solve?"),
        (["reproduce", "--pionts", "4"], "did you mean --points?"),
        (["rank", "--maximise", "f1", "x.csv"], "did you mean --maximize?"),
        (["solve", "bnh", "--pionts", "4"], "did you mean --points?"),
        (["solve", "--no-normalise", "bnh"], "did you mean --no-normalize?"),
        (["solve", "bhn"], "did you mean 'bnh'?"),
        (["solve", "zdt99"], "did you mean 'zdt"),
        (["solve", "models.py"], "of a class Beam in it say models:Beam"),
        (["solve", "tests/beams.py:Beam"], "say beams:Beam in the folder tests"),
        (["solve", "chute", "--mu", "0.2", "--mu=0.3"], "--mu must be given once"),
        (["solve", "bnh", "--limits", "f1<=2 and f2<=3"], "join limits by commas"),
        (["solve", "dtlz2", "--n-ob", "4"], "did you mean --n-obj?"),
        (["solve", "pymoo_psi:SphereCute"], "did you mean 'SphereChute'?"),
        (["solve", "bnh", "--limits", "F1=2.5"], "did you mean 'f1'?"),
    ],
)
def test_a_near_miss_is_pointed_out(words, meant, capsys):
    assert main(words) == 2
    told = capsys.readouterr().err
    assert meant in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["solve", "bnh", "--points", "0"], "--points must be an integer >= 1, got 0"),
        (["solve", "bnh", "--points", "8", "--retry", "9", "--study", "s.db"], "--retry must be"),
        (["solve", "chute", "--mu", "-1"], "--mu must be a positive number, got -1"),
        (["compare", "bnh", "--algorithms", "psy"], "--algorithms must be one of"),
        (["reproduce", "--mu", "-1", "--out", "r"], "--mu must be a positive number"),
    ],
)
def test_a_message_speaks_of_the_option_that_was_typed(words, told, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    assert capsys.readouterr().err.startswith(f"pymoo-psi: error: {told}")


MODELS = """
from pymoo.core.problem import ElementwiseProblem

class Beam(ElementwiseProblem):
    def __init__(self, length, *, n_ribs=2, **more):
        super().__init__(n_var=n_ribs, n_obj=2, xl=0, xu=length, **more)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [x.sum(), -x.sum()]

class Long(Beam):
    def __init__(self, steel=True, **more):
        super().__init__(100 if steel else 50, **more)
"""


def test_a_problem_is_made_of_options(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "models_of_help.py").write_text(MODELS)

    def largest(*words):
        assert main(["solve", *words, "--points", "64", "--out", "o.csv"]) == 0, capsys.readouterr()
        columns = (tmp_path / "o.csv").read_text().splitlines()[0].split(",")
        return [name for name in columns if name[0] == "x"], [n for n in columns if n[0] == "f"]

    assert largest("dtlz2", "--n-obj", "4", "--n-var=7") == (
        [f"x{i}" for i in range(1, 8)],
        ["f1", "f2", "f3", "f4"],
    )
    assert largest("--n-obj", "2", "dtlz2", "--n-var", "3")[1] == ["f1", "f2"]
    assert len(largest("models_of_help:Beam", "--length", "2.5")[0]) == 2
    assert len(largest("models_of_help:Long", "--steel", "False", "--n-ribs", "5")[0]) == 5
    for words, told in [
        (["models_of_help:Beam"], "its arguments: --length, --n-ribs"),
        (["models_of_help:Long", "--lenth", "1"], "did you mean --length?"),
        (["bnh", "--n-obj", "3"], "No such option: --n-obj; arguments of bnh: none"),
    ]:
        assert main(["solve", *words]) == 2
        assert told in capsys.readouterr().err
    sys.modules.pop("models_of_help", None)
