"""Problems of other people: every problem of pymoo."""

import contextlib
import inspect
import math
import subprocess
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pymoo.problems
import pytest
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.problems.functional import FunctionalProblem

from pymoo_psi import FailureTolerant, Restricted, Robust, investigate
from pymoo_psi.errors import StudyMismatchError
from pymoo_psi.problems import WrappedProblem
from tests.helpers.parts import parts
from tests.helpers.refusals import refused, warned


def made(kind):
    """A problem that has bounds and that pymoo itself evaluates; nothing of others."""
    for options in ({}, {"n_var": 10, "n_obj": 3}):
        with contextlib.suppress(Exception), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            problem = kind(**options)
            problem.evaluate((np.array(problem.xl) + problem.xu)[None] / 2)
            return problem
    return None


@pytest.mark.filterwarnings("ignore")  # of the models
def test_every_problem_gives_its_own_values():
    found = [*filter(None, map(made, parts(pymoo.problems, Problem)))]
    assert len(found) > 60
    for problem in found:
        table = investigate(problem, 4)
        ok = table.status != "failed"
        F = problem.evaluate(table.X, return_values_of=["F"])
        np.testing.assert_array_equal(table.F[ok], F[ok], err_msg=str(type(problem)))


class Model(ElementwiseProblem):
    """A problem with a text for a name, and constants that it keeps in several ways."""

    def __init__(self, k=1, weights=(1.0, 2.0), title="model", **kwargs):
        super().__init__(n_var=2, n_obj=1, xl=0, xu=1, **kwargs)
        self._k, self.weights, self.title = k, weights, title
        self.name, self.calls = "own name", 0
        self.names = {"x1": "width", "x2": "height"}

    def _evaluate(self, x, out, *args, **kwargs):
        self.calls += 1
        out["F"] = self._k * x.sum()


@pytest.mark.parametrize(
    "problem", [Model(), FailureTolerant(Model()), Restricted(Model(), {"width": (0, 0.5)})]
)
def test_the_name_may_be_a_text(problem):
    assert investigate(problem, 4).schema.variables == ("width", "height")
    assert Robust(Model(), tolerances={"height": 0.1}).name() == "robust own name"


ANOTHER, UNKNOWN = "belongs to another model", "does not compare what the problem's title is made"


class Heir(Model):
    def __init__(self, data=(), **kwargs):
        super().__init__(**kwargs)
        self.data = np.array(data)


@pytest.mark.parametrize(
    "changed",
    [{"k": 3}, {"weights": (1.0, 2.5)}, {"data": range(1, 1001)}, {"title": "kN/mm2"}],
    ids=str,
)
def test_constants_of_base_classes_belong_to_a_study(tmp_path, changed):
    """What counts evaluations, or is a path, is not."""
    study, given = tmp_path / "model.db", {"k": 2, "data": range(1000)}
    for title in (Path("runs/one.csv"), tmp_path):
        investigate(FailureTolerant(Heir(title=title, **given)), 4, study=study)
    assert study.stat().st_size < 100_000
    refused(ANOTHER, investigate, Heir(**given | changed), 4, error=StudyMismatchError, study=study)


def test_labels_of_pandas_belong_to_a_constant(study_file):
    densities = pd.Series({"steel": 7.8, "alu": 2.7})
    investigate(Model(title=densities), 4, study=study_file)
    other = Model(title=densities.rename({"steel": "alu", "alu": "steel"}))
    refused(ANOTHER, investigate, other, 4, error=StudyMismatchError, study=study_file)


@dataclass
class Steel:
    E: float


class Mesh:
    """An object that counts."""

    def __init__(self, calls=0):
        self.calls = calls


def test_objects_that_a_study_does_not_compare_are_named(study_file):
    """They may change while it runs."""
    circle = []
    circle.append(circle)
    for mesh in ([Mesh(1)], {"mesh": Mesh(2), "self": None}, circle, {(0, 1): 2.0}):
        assert len(warned(UNKNOWN, investigate, Model(title=mesh), 4, study=study_file)) == 4
        study_file.unlink()
    investigate(Model(title=Mesh(1)), 4)  # without a study there is nothing to compare


@pytest.mark.parametrize(
    "made",
    [
        lambda E: Model(weights={"E": E, "solve": print}),
        lambda E: Model(weights=Steel(E)),
        lambda E: Model(weights=range(int(E))),
        lambda E: Model(weights=[None, E]),
        lambda E: Model(weights=pd.Series([E, 2.0])),
        lambda E: Model(weights=(np.array([1, E]), np.float64(3))),
        lambda E: Model(weights=np.ma.array([1.0, 2.0], mask=[False, E > 1])),
    ],
)
def test_constants_in_objects_belong_to_a_study(study_file, made):
    for _ in range(2):
        investigate(made(1.0), 4, study=study_file)
    refused(ANOTHER, investigate, made(210.0), 4, error=StudyMismatchError, study=study_file)


def beam(**defaults):
    """Return a class that keeps its arguments, whose default values are these."""

    class Beam(ElementwiseProblem):
        def __init__(self, **given):
            super().__init__(n_var=2, n_obj=2, xl=0, xu=1)
            vars(self).update(defaults | given)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = [x[0], self.load * x[1]]

    named = inspect.Parameter.KEYWORD_ONLY
    parameters = [inspect.Parameter(name, named, default=v) for name, v in defaults.items()]
    Beam.__signature__ = inspect.Signature(parameters)
    return Beam


def robust(problem):
    """Within a wrapper without a fingerprint of its own."""
    inner = Robust(problem, tolerances={"x1": 0.1}, n_scenarios=2)
    return Restricted(inner, [[0.1, 0.0], [0.9, 1.0]])


@pytest.mark.parametrize("wrap", [lambda problem: problem, lambda p: Weighed(p, 2.0), robust])
def test_an_edited_default_is_another_model(study_file, wrap):
    """Its value counts, given or not; an argument that only one class has counts if it differs."""
    table = investigate(wrap(beam(load=1.0)()), 4, study=study_file)
    same = [
        (beam(load=1.0), {"load": 1}),
        (beam(load=2.0), {"load": 1.0}),
        (beam(load=1.0, rates=(1, 2)), {"rates": np.array([1, 2])}),  # added, kept as an array
        (beam(load=1.0), {}),  # removed
        (beam(load=1.0, loss=0.5), {}),  # added
        (beam(load=1.0), {}),  # removed
    ]
    for kind, given in same:
        again = investigate(wrap(kind(**given)), 4, study=study_file)
        assert again.equals(table)
        assert table.merge(again).equals(table)
    others = [
        (beam(load=2.0), {}, r"load is 1.0 in the study, 2.0 asked"),
        (beam(load=1.0), {"load": 2.0}, r"load is 1.0 in the study, 2.0 asked"),
        (beam(load=[1.0]), {}, r"load.0 is absent in the study, 1.0 asked"),
        (beam(load=[]), {}, r"load is 1.0 in the study, absent asked"),
        (beam(load=1.0, loss=0.5), {"loss": 0.4}, r"loss is absent in the study, 0.4 asked"),
        (beam(force=1.0), {"load": 1.0}, r"load is 1.0 in the study, absent asked.*force"),
    ]
    for kind, given, said in others:
        problem = wrap(kind(**given))
        refused(said, investigate, problem, 4, study=study_file, error=StudyMismatchError)
        refused("of one problem", table.merge, investigate(problem, 4))


class Weighed(WrappedProblem):
    """A wrapper whose values depend on an argument of its own."""

    def __init__(self, problem, weight):
        super().__init__(problem)
        self.weight = weight

    def fingerprint(self):
        return {"weight": self.weight}


def heavy(x):
    return 2 * x[0]


@pytest.mark.parametrize("other", [heavy, np.mean, len, "heavy", Model().evaluate.__func__])
def test_functions_are_compared_by_their_names(study_file, other):
    for _ in range(2):
        investigate(Model(title={"law": [math.sin, math]}), 4, study=study_file)
    refused(ANOTHER, investigate, Model(title={"law": [other, math]}), 4, study=study_file)


@pytest.mark.parametrize("law", [lambda x: x[0], (lambda c: lambda x: c * x[0])(2)])
def test_functions_without_a_name_of_their_own_are_named(study_file, law):
    for problem in (Model(title=law), FunctionalProblem(2, [law, heavy], xl=0, xu=1)):
        with pytest.warns(UserWarning, match="problem's (title|objs) is made of; give a study_key"):
            investigate(problem, 4, study=study_file)
        study_file.unlink()
        # a key says what a study does not see
        investigate(problem, 4, study=study_file, study_key="v1")
        study_file.unlink()


def test_a_method_is_no_argument_of_its_name(study_file):
    """The argument ``name`` is kept elsewhere, where pymoo has a method; ``_k`` is no argument."""

    class Named(ElementwiseProblem):
        def __init__(self, name="beam", k=1):
            super().__init__(n_var=2, n_obj=1, xl=0, xu=1)
            self._name, self.k = name, k
            self._k = object()

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = x.sum()

    for _ in range(2):
        investigate(Named(), 4, study=study_file)
    refused(ANOTHER, investigate, Named("bar"), 4, study=study_file)


def test_functions_have_the_same_names_in_another_process(tmp_path):
    """As a script, or imported by another one; also after a copy by pickle."""
    text = """
import pickle, sys
from pathlib import Path
import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo_psi import investigate
def mass(x):
    return x[0] * x[1]
class Beam(ElementwiseProblem):
    def __init__(self, mass=mass, tables=((1, None),), loads=np.array([1.0, 2.0])):
        super().__init__(n_var=2, n_obj=1, xl=1, xu=2)
        self.mass, self.tables, self.loads = mass, tables, loads
    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = self.mass(x)
def run():
    for problem in (Beam(mass), pickle.loads(pickle.dumps(Beam()))):
        investigate(problem, 4, study=Path(__file__).with_suffix(".db"))
"""
    (tmp_path / "beams.py").write_text(text + "if __name__ == '__main__':\n    run()\n")
    for call in (["beams.py"], ["-c", "import beams; beams.run()"]):
        subprocess.run([sys.executable, "-W", "error", *call], cwd=tmp_path, check=True)
