"""Which designs are the same: in a run, in a study, and in several runs of one."""

import numpy as np
import pytest
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Choice, Integer, Real
from pymoo.optimize import minimize

from pymoo_psi import PSI, Recorded, Restricted, investigate, read_table
from pymoo_psi.errors import ArgumentValueError, StudyMismatchError

OPTIONS = [12, "12", 12.0, True, 1, 1.0, "true", "True", "oak"]
"""Different options, some of which are equal in Python, or are printed alike."""


class Typed(ElementwiseProblem):
    """A choice whose options differ in their types; the objective says which one it was."""

    calls = 0

    def __init__(self, options=OPTIONS, more=()):
        variables = {"a": Choice(options=options), **dict(more)}
        super().__init__(vars=variables, n_obj=1)

    def _evaluate(self, x, out, *args, **kwargs):
        Typed.calls += 1
        out["F"] = [value(x["a"]) + 100 * x.get("b", 0)]


def value(option):
    return [*map(repr, OPTIONS)].index(repr(option))


def options_of(table):
    return [*map(repr, table.X[:, 0])]


@pytest.mark.parametrize("stored", [False, True])
def test_options_of_several_types_are_different_designs(stored, study_file):
    options = {"study": study_file} if stored else {}
    problem = Typed(more={"b": Integer(bounds=(0, 1))})
    Typed.calls = 0
    table = investigate(problem, 64, **options)
    assert Typed.calls == len(OPTIONS) * 2
    assert table.F[:, 0].tolist() == [value(a) + 100 * b for a, b in table.X]
    if stored:
        again = investigate(Restricted(problem, {"b": (0, 0)}), 16, **options)
        assert Typed.calls == len(OPTIONS) * 2
        assert again.F[:, 0].tolist() == [value(a) for a, _ in again.X]
        whole = read_table(study_file)
        assert whole.F[:, 0].tolist() == [value(a) + 100 * b for a, b in whole.X]


def test_runs_of_options_that_look_alike_are_different(study_file):
    problem = Typed(more={"x": Real(bounds=(0, 1))})
    for number, option in enumerate(OPTIONS, 1):
        table = investigate(Restricted(problem, {"a": option}), 3, study=study_file)
        assert {*options_of(table)} == {repr(option)}
        assert len(read_table(study_file)) == 3 * number


def test_models_of_options_that_look_alike_are_different(study_file):
    investigate(Typed([12, "oak"]), 4, study=study_file)
    with pytest.raises(StudyMismatchError, match="another model.*choices"):
        investigate(Typed(["12", "oak"]), 4, study=study_file)


def test_an_option_is_restricted_by_its_type():
    with pytest.raises(ArgumentValueError, match="one of 12, '12', 'oak'"):
        Restricted(Typed([12, "12", "oak"]), {"a": 12.0})


class OneOver(ElementwiseProblem):
    """A model that sees the sign of zero."""

    def __init__(self):
        super().__init__(n_var=1, n_obj=1, xl=-1.0, xu=1.0)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = [np.copysign(1.0, x[0])]


def test_zero_and_negative_zero_are_different_in_every_run(study_file):
    investigate(OneOver(), 2, study=study_file)  # tests -1 and 0
    recorded = Recorded(OneOver(), study=study_file)
    assert recorded.evaluate(np.array([[-0.0], [0.0]])).tolist() == [[-1.0], [1.0]]
    assert recorded.n_evaluated == 1
    table = read_table(study_file)
    assert np.array_equal(np.copysign(1.0, table.X), table.F)


class Grid(ElementwiseProblem):
    """A hundred designs."""

    designs = ()

    def __init__(self):
        variables = {"a": Integer(bounds=(0, 9)), "b": Integer(bounds=(0, 9))}
        super().__init__(vars=variables, n_obj=2)

    def _evaluate(self, x, out, *args, **kwargs):
        Grid.designs = (*Grid.designs, (x["a"], x["b"]))
        out["F"] = [x["a"] + x["b"], (x["a"] - 5) ** 2 - x["b"]]


def psi(problem, n_points, **options):
    return minimize(problem, PSI(n_points, **options)).algorithm.table


@pytest.mark.parametrize("by", [investigate, psi])
def test_a_finite_set_has_several_runs_in_one_study(by, study_file):
    Grid.designs = ()
    runs = [
        (Grid(), 40, {}),
        (Restricted(Grid(), {"a": (0, 4)}), 40, {}),
        (Grid(), 60, {"first": 30}),
        (Restricted(Grid(), {"b": 3}), 30, {}),
    ]
    for problem, n_points, options in runs:
        alone = investigate(problem, n_points, **options)
        Grid.designs = Grid.designs[: -len({*map(tuple, alone.X.tolist())})]
        table = by(problem, n_points, study=study_file, **options)
        assert sorted(table.X.tolist()) == sorted(alone.X.tolist())
    assert len({*Grid.designs}) == len(Grid.designs)
    whole = read_table(study_file)
    assert {*map(tuple, whole.X.tolist())} == {*Grid.designs}


@pytest.mark.parametrize("suffix", ["-journal", "-wal", "-SHM", ".pymoo-psi-lock"])
def test_files_that_belong_to_a_study_are_refused(suffix, study_file):
    name = f"{study_file}{suffix}"
    with pytest.raises(ArgumentValueError, match="study must be named unlike files beside"):
        investigate(Grid(), 4, study=name)
