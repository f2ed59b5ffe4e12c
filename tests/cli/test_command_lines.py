"""Any words at all: an exit code, one clear line for a mistake, and never a traceback.

Right words, wrong ones, numbers out of range, files of every kind, models that misbehave, terminals
that know no Greek.
"""

import contextlib
import io
import os
import random

import pytest

from pymoo_psi.cli import main
from tests.helpers.draws import seeds
from tests.helpers.folders import write_files

MODELS = """
import sys
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Binary, Choice, Integer, Real

class Plain(ElementwiseProblem):
    def __init__(self, n_var=2, n_obj=2, xl=0, xu=1, **more):
        super().__init__(n_var=n_var, n_obj=n_obj, xl=xl, xu=xu, **more)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [x[0], 1 - x[-1]][:self.n_obj]

class Named(ElementwiseProblem):
    def __init__(self, **more):
        mixed = {"a": Integer(bounds=(0, 5)), "=c": Choice(options=["=x", "y"]), "d": Binary()}
        super().__init__(vars=more or mixed, n_obj=2)
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [float(x["a"]), 1.0]

class Fails(Plain):
    def _evaluate(self, x, out, *args, **kwargs):
        raise RuntimeError("no µ")

class Nameless(Plain):
    def name(self):
        raise ValueError("none")

def big(): return Named(a=Integer(bounds=(0, 2**60)))
def unbounded(): return Plain(xl=None, xu=None)
def one(): return Plain(n_var=1, n_obj=1)
def no_variable(): return Plain(n_var=0)
def no_objective(): return Plain(n_obj=0)
def quits(): sys.exit(3)
number = 3
"""

FILES = {
    "set.csv": '"time, s",mass,name,=x\n1,2,a,1\n2,1,b,2\n3,3,=c,-3\n',
    "front.csv": "x1,x2,f1,f2\n1,2,3,4\n2,1,4,3\n3,3,5,5\n",
    "huge.csv": "a,b\n1e308,-1e308\n-1e308,1e308\n99999999999999999999,0\n",
    "wide.csv": ",".join(f"f{i}" for i in range(1, 301)) + "\n" + 3 * (300 * "1,")[:-1],
    "same.csv": "a,b\n1,1\n1,1\n",
    "odd.csv": "$$a$$,<b>,--c,µ\n1,2,3,4\n2,1,3,4\n",
    "empty.csv": "",
    "one.csv": "a,b\n1,2\n",
    "nan.csv": "a,b\nnan,1\n2,inf\n1,-inf\n3,2\n",
    "nul.csv": bytes(range(256)),
    "bad.db": b"SQLite format 3\0" + bytes(100),
    "bad.xlsx": b"PK\3\4" + bytes(30),
    "bad.json": '{"pymoo_psi": NaN',
    "list.json": "[1, 2]",
    "deep.json": "[" * 9999,
    "per.csv": "name,price,yield\nA,5,80%\nB,4,70%\nµ,3,60%\n",
    "german.csv": "a;b\n1,5;2\n2,25;1\n",
    "old.json": '{"objectives": ["a", "a"], "maximized": [], "designs": [{"a": 1}]}',
    "models_of_words.py": MODELS,
    os.fsdecode(b"\xff\xe9.csv"): "a,b\n1,2\n2,1\n",
}

PATHS = [
    "front.csv", "s.db", *FILES, "folder", "absent.csv", "", ".", "/", "/dev/null", "/proc/o.csv", "n" * 300 + ".csv", "s.db",
    "~/absent/o.csv", "out.csv", "out.json", "out.html", "out.xlsx", "set.csv/out.csv",
]  # fmt: skip
PROBLEMS = [
    "bnh", "models_of_words:Plain", "chute", "zdt99", "rosenbrock", "models_of_words", "absent:x", ":x", ":", "", "\udcff:a",
    *(f"models_of_words:{name}" for name in ["Plain", "Named", "Many", "Equal", "Fails", "Nameless", "big", "unbounded", "one", "no_variable", "no_objective", "quits", "number"]),
]  # fmt: skip
NAMES = ["f1,f2", "f2", "time, s", "mass", "=x", "f1", "f2,f1", "a,b", "", ",", '"', "µ", "$$a$$", "--c", "\udcff",
         "\n", '"time, s",mass', "rank", "name", "f1,f300"]  # fmt: skip
WHOLE = ["1", "2", "7", "33", "0", "-1", "1.5", "x", "", "1e3", "1_0", "9" * 30]
REAL = ["0.4", "0.2", "1", "0", "-1", "nan", "inf", "1e308", "1e-320", "x", ""]
LIMITS = ["f1<=9", "f2>=0.5", "yield>=65", "a<=5.000", "b<=9", "price<=1e9,price>=4", "f1<=2", "f1<=2,f2<=1", "f1>=1", "f1", "=2", "f1=nan", "f9=1", "time, s<=2", "a<=1,a<=2",
          "\udcff=1", "f1<=1e400", "a<=0"]  # fmt: skip
OUTS = ["out.csv", "out.html", *PATHS]
TABLE = {
    "objectives": NAMES,
    "maximize": NAMES,
    "limits": LIMITS,
    "compute": ["r=f1/f2", "s=f1+f2", "r=a/b", "r=", "=a", "r", "a=1", "r=\udcff", "rank=a"],
    "out": OUTS,
}
OPENING = {
    "variables": NAMES, "units": ["f1=kg", "f2=µ", "a=kg", "=", "f1=\udcff"], "decimal": [".", ",", "x", ""],
    "encoding": ["utf-8", "cp1252", "utf-16", "x", ""],
    "skip-rows": ["4", "3", "1", "2,3", "0", "x", ""], "sheet": ["x", ""],
}  # fmt: skip
# The subjects of each command, and values of its options, right ones and wrong ones.
COMMANDS = {
    "solve": (PROBLEMS, {
        "points": WHOLE, "algorithm": ["psi", "surrogate", "nsga3", "x"], "seed": WHOLE, "limits": LIMITS,
        "study": ["s.db", "t.db", *PATHS], "study-key": NAMES, "retry": ["failed", "x"], "out": OUTS,
        "bounds": ["x1=0.2:0.3", "x2=0.5", "x2=:3,x1=0", "x1=1:0", "x9=1", "x1=nan", "x1", "", "\udcff=1"],
        "mu": REAL, "c": REAL, "r": REAL, "timeout": ["nan", "-1", "x"], "jobs": ["0", "-2", "x"],
        "share": ["1/2", "3/2", "x", ""], "sampling": ["lhs", "sobol", "x"],
    }),
    "rank": (PATHS, TABLE | OPENING | {"decision": PATHS}),
    "report": (PATHS, TABLE | OPENING | {"design": ["1", "row 2", *WHOLE], "title": NAMES}),
    "page": (PATHS, TABLE | OPENING | {"prototype": PATHS, "title": NAMES}),
    "export": (PATHS, TABLE | OPENING),
    "analyze": (PATHS, TABLE | OPENING | {"decision": PATHS}),
    "compare": (PROBLEMS, {
        "evaluations": ["2", "1,4", "0", "x", ""], "algorithms": ["psi", "psi,psi", "x", "", "moead"],
        "out": OUTS, "jobs": WHOLE,
    }),
    "reproduce": (["--points=0"], {"jobs": WHOLE, "out": OUTS}),
}  # fmt: skip
FEW = {"solve": ["--points=7"], "compare": ["--evaluations=2", "--seeds=1"]}  # unless they are said


def command_line(rng):
    """A command with a few options, right ones and wrong ones, or any words at all."""
    if rng.random() < 0.1:
        words = ["rank", "-h", "--version", "--", "", "µ", "\udcff", "=", "--out", "set.csv", "\n"]
        return rng.choices(words, k=rng.randrange(4))
    command = rng.choice(sorted(COMMANDS))
    subjects, values = COMMANDS[command]
    given = rng.sample(sorted(values), k=min(rng.randrange(4), len(values)))
    right = rng.random() < 0.6  # mostly: right words come first in the lists
    subject, *words = (
        rng.choice(each[:2] if right else each) for each in (subjects, *map(values.get, given))
    )
    options = [f"--{name}={word}" for name, word in zip(given, words, strict=True)]
    few = [word for word in FEW.get(command, []) if word[2:].split("=")[0] not in given]
    return [command, subject, *few, *options]


@pytest.mark.parametrize("seed", seeds(4))
def test_every_command_line_ends_well(seed, tmp_path, monkeypatch, undrawn, in_folder):
    """Fifty lines in one folder, with what those before have left there."""
    rng = random.Random(seed)
    monkeypatch.syspath_prepend(str(tmp_path))
    os.mkdir("folder")
    write_files("", FILES)
    for _ in range(50):
        words, encoding = command_line(rng), rng.choice(["utf-8", "ascii"])
        out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main(words)
        out.flush()
        err.flush()
        lines = err.buffer.getvalue().decode(encoding).splitlines()
        assert code in (0, 1, 2), words
        assert sum(line.startswith("pymoo-psi: error: ") for line in lines) == (code == 2), words
        assert "Traceback" not in "".join(lines)
        assert len(lines) <= 1 or words[0] == "compare", (words, lines)
