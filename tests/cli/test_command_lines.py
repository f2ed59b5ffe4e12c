"""Any words at all: an exit code, one clear line for a mistake, and never a traceback.

Hypothesis writes the command lines: right words, wrong ones, numbers out of range, files of every
kind, models that misbehave, terminals that know no Greek.
"""

import contextlib
import io
import os
import sys
import tempfile

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pymoo_psi.cli import main

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
    "old.json": '{"objectives": ["a", "a"], "maximized": [], "designs": [{"a": 1}]}',
    "models_of_words.py": MODELS,
    os.fsdecode(b"\xff\xe9.csv"): "a,b\n1,2\n2,1\n",
}

PATHS = [
    *FILES, "folder", "absent.csv", "", ".", "/", "/dev/null", "/proc/o.csv", "n" * 300 + ".csv", "s.db",
    "~/absent/o.csv", "out.csv", "out.json", "out.html", "out.parquet", "set.csv/out.csv",
]  # fmt: skip
MADE = (
    "Plain Named Many Equal Fails Nameless big unbounded one no_variable no_objective quits number"
)
PROBLEMS = [
    "chute", "bnh", "zdt99", "rosenbrock", "models_of_words", "absent:x", ":x", ":", "", "\udcff:a",
    *(f"models_of_words:{name}" for name in MADE.split()),
]  # fmt: skip
NAMES = ["time, s", "mass", "=x", "f1", "f2,f1", "a,b", "", ",", '"', "µ", "$$a$$", "--c", "\udcff",
         "\n", '"time, s",mass', "rank", "name", "f1,f300"]  # fmt: skip
WHOLE = ["1", "2", "7", "33", "0", "-1", "1.5", "x", "", "1e3", "1_0", "9" * 30]
REAL = ["0.4", "1", "0", "-1", "nan", "inf", "1e308", "1e-320", "x", ""]
LIMITS = ["f1<=2", "f1<=2,f2<=1", "f1>=1", "f1", "=2", "f1=nan", "f9=1", "time, s<=2", "a<=1,a<=2",
          "\udcff=1", "f1<=1e400", "a<=0"]  # fmt: skip
COMPUTED = ["r=a/b", "r=", "=a", "r", "a=1", "r=\udcff", "rank=a"]
TABLE = {
    "objectives": NAMES,
    "maximize": NAMES,
    "limits": LIMITS,
    "compute": COMPUTED,
    "out": PATHS,
}
# The subjects of each command, and values of its options, right ones and wrong ones.
COMMANDS = {
    "solve": (PROBLEMS, {
        "points": WHOLE, "algorithm": ["psi", "nsga3", "x"], "seed": WHOLE, "limits": LIMITS,
        "study": PATHS, "study-key": NAMES, "retry": ["failed", "1,2", "0", "x", "9" * 18], "out": PATHS,
        "box": ["x1=0.2:0.3", "x2=:3,x1=0", "x1=1:0", "x9=1", "x1=nan", "x1", "", "\udcff=1"],
        "mu": REAL, "c": REAL, "r": REAL, "timeout": ["nan", "-1", "x"], "jobs": ["0", "-2", "x"],
    }),
    "rank": (PATHS, TABLE | {"top": WHOLE, "decision": PATHS}),
    "page": (PATHS, TABLE | {"variables": NAMES, "prototype": PATHS, "units": ["a=kg", "=", "f1=\udcff"]}),
    "export": (PATHS, {"out": PATHS}),
    "analyze": (PATHS, TABLE | {"formulation": PATHS}),
    "compare": (PROBLEMS, {
        "evaluations": ["2", "1,4", "0", "x", ""], "algorithms": ["psi", "psi,psi", "x", "", "moead"],
        "reference": PATHS, "out": PATHS, "jobs": WHOLE,
    }),
    "reproduce": (["--points=0"], {"jobs": WHOLE, "out": PATHS}),
}  # fmt: skip
FEW = {"solve": ["--points=7"], "compare": ["--evaluations=2", "--seeds=1"]}  # unless they are said


@st.composite
def command_lines(draw):
    """A command with a few options, or any words at all."""
    if draw(st.integers(0, 9)) == 0:
        words = st.text(max_size=5) | st.sampled_from(["rank", "-h", "--version", "--"])
        return draw(st.lists(words, max_size=3))
    command = draw(st.sampled_from(sorted(COMMANDS)))
    subjects, values = COMMANDS[command]
    given = draw(st.lists(st.sampled_from(sorted(values)), max_size=4))
    options = [f"--{name}={draw(st.sampled_from(values[name]))}" for name in given]
    few = [word for word in FEW.get(command, []) if word[2:].split("=")[0] not in given]
    return [command, draw(st.sampled_from(subjects)), *few, *options]


@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
@given(command_lines(), st.sampled_from(["utf-8", "ascii"]))
def test_every_command_line_ends_well(words, encoding):
    words = [word.replace("\0", "") for word in words]  # no system passes that on
    printed, told = (io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2))
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        sys.path.insert(0, folder)
        try:
            os.mkdir("folder")
            for name, text in FILES.items():
                with open(name, "w", encoding="utf-8") as file:
                    file.write(text)
            with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(told):
                code = main(words)
        finally:
            os.chdir(before)
            sys.path.remove(folder)
    printed.flush()
    told.flush()
    lines = told.buffer.getvalue().decode(encoding).splitlines()
    lines = [line for line in lines if " in all, " not in line]  # what a comparison will cost
    assert code in (0, 1, 2, 130)
    if code == 2:
        assert len(lines) == 1
        assert lines[0].startswith("pymoo-psi: error: ")
        assert "Traceback" not in lines[0]
    else:
        assert lines == []
