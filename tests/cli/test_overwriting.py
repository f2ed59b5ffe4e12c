"""Nothing is overwritten but what the same command wrote, unless --force says so."""

import shutil

import pytest
from matplotlib.figure import Figure

from pymoo_psi import plots
from pymoo_psi.cli import main
from pymoo_psi.report._parts import Picture

FRONT = "a,b\n1,2\n2,1\n3,0\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "set.csv").write_text(FRONT)
    assert main(["solve", "bnh", "--points", "32", "--study", "s.db"]) == 0
    return tmp_path


WRITERS = {
    "solve": ("solve bnh --points 32", "o.csv"),
    "solve named": ("solve bnh --points 32 --maximize f2", "o.csv"),
    "rank": ("rank set.csv", "o.csv"),
    "rank maximize": ("rank set.csv --maximize b", "o.csv"),
    "rank json": ("rank set.csv", "o.json"),
    "export": ("export s.db", "o.csv"),
    "export parquet": ("export s.db", "o.parquet"),
    "combine": ("combine a=s.db b=s.db", "o.csv"),
    "combine parquet": ("combine a=s.db b=s.db", "o.parquet"),
    "page": ("page set.csv", "o.html"),
    "report": ("report s.db", "o.html"),
}


def written(writer, out):
    return main([*WRITERS[writer][0].split(), "--out", str(out)])


def test_a_command_overwrites_its_own_results_only(folder, capsys, monkeypatch):
    monkeypatch.setattr(Picture, "image", lambda picture: "")  # pictures take most of the time
    kept = {}
    for writer, (_, name) in WRITERS.items():
        assert written(writer, name) == 0
        assert written(writer, name) == 0, writer
        kept[writer] = folder / f"{writer}.kept"
        shutil.move(name, kept[writer])
    for writer, (words, name) in WRITERS.items():
        command = words.split()[0]
        others = {w: kept[w] for w in WRITERS if w.split()[0] != command and WRITERS[w][1] == name}
        (folder / "mine").write_text(FRONT)
        for file in ({"": folder / "mine"} | others).values():
            shutil.copy(file, name)
            before = (folder / name).read_bytes()
            capsys.readouterr()
            assert written(writer, name) == 2, (writer, file)
            assert "--out must be a new file, or one that this command wrote" in (
                told := capsys.readouterr().err
            )
            assert told.endswith("--force overwrites it\n")
            assert (folder / name).read_bytes() == before
    assert main(["rank", "set.csv", "--out", "o.csv", "--force"]) == 0


def test_the_input_is_never_overwritten(folder, capsys):
    for words in ("rank set.csv --out set.csv", "rank set.csv --figure set.csv --force"):
        assert main([*words.split(), "--force"]) == 2
        assert "must be another file than the one that is read" in capsys.readouterr().err
    assert (folder / "set.csv").read_text() == FRONT


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_a_figure_is_known_by_its_maker(folder, suffix, capsys, monkeypatch):
    monkeypatch.setattr(plots, "ranking_page", lambda *args, **options: Figure())
    words = ["rank", "set.csv", "--figure", f"f.{suffix}"]
    assert main(words) == main(words) == 0
    (folder / f"f.{suffix}").write_bytes(b"a drawing of mine")
    assert main(words) == 2
    assert "--figure must be a new file" in capsys.readouterr().err


def test_a_folder_with_results_of_others_is_left_alone(folder, capsys):
    for words, name in (
        ("analyze s.db", "convergence.csv"),
        ("compare bnh --evaluations 4 --seeds 1", "tests.csv"),
        ("reproduce --points 4", "figure_2.png"),
    ):
        out = folder / words.split()[0]
        out.mkdir()
        (out / name).write_text(FRONT)
        assert main([*words.split(), "--out", str(out)]) == 2
        assert name in capsys.readouterr().err
        assert [path.name for path in out.iterdir()] == [name]
