"""A part of the bounds gives the whole problem's values, to any algorithm and in every table."""

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.mixed import (
    MixedVariableDuplicateElimination,
    MixedVariableMating,
    MixedVariableSampling,
)
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Binary, Choice, Integer, Real
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import (
    FailureTolerant,
    LPTauSampling,
    Restricted,
    SphereChute,
    VectorizedSphereChute,
    investigate,
)
from pymoo_psi.study import Study
from tests.helpers.refusals import refused

DENSITY = {"iron": 7.8, "steel": 7.7, "wood": 0.6}


class Beam(ElementwiseProblem):
    """A mixed problem, whose model gives more than it must and fails for thick beams of wood."""

    def __init__(self, **kwargs):
        super().__init__(
            vars={
                "width": Real(bounds=(0.1, 2.0)),
                "ribs": Integer(bounds=(1, 9)),
                "metal": Choice(options=list(DENSITY)),
                "hollow": Binary(),
            },
            n_obj=2,
            n_ieq_constr=1,
            **kwargs,
        )

    def _evaluate(self, x, out, *args, **kwargs):
        if x["metal"] == "wood" and x["width"] > 1.5:
            raise ValueError("does not grow")
        mass = x["width"] * (x["ribs"] - 0.5 * x["hollow"]) * DENSITY[x["metal"]]
        out["F"], out["G"] = [mass, 1 / mass + x["hollow"]], [x["ribs"] - 7]


class Knapsack(Problem):
    """Things to take or to leave, or how many of each."""

    def __init__(self, vtype):
        super().__init__(n_var=6, n_obj=2, n_ieq_constr=1, xl=0, xu=3, vtype=vtype)

    def _evaluate(self, x, out, *args, **kwargs):
        weight = x @ np.array([1.1, 2.3, 3.1, 4.7, 5.9, 6.1])
        out["F"], out["G"] = np.column_stack([weight, -x.sum(axis=1)]), weight[:, None] - 30


def bnh():
    return get_problem("bnh")


CASES = [
    (lambda: SphereChute(0.4), {"x1": (0.2, 0.4)}),
    (lambda: VectorizedSphereChute(0.4), {"x2": 1.7}),
    (bnh, {"x1": (None, 1.0), "x2": (0.5, None)}),
    (lambda: Knapsack(bool), {"x3": True, "x5": False}),
    (lambda: Knapsack(int), {"x3": 1, "x5": (0, 2)}),
    (Beam, {"width": (0.5, 1.0), "metal": ["wood", "iron"], "hollow": True}),
    (Beam, {"ribs": (2, 4), "width": 0.7}),
    (Beam, {"ribs": 3, "metal": "steel"}),
]


def given(table, problem):
    """The designs of a table as the whole problem takes them."""
    if not getattr(problem, "vars", None):
        return table.X
    names = table.schema.variables
    return np.array([dict(zip(names, row, strict=True)) for row in table.X.tolist()], dtype=object)


@pytest.mark.parametrize(("make", "bounds"), CASES)
def test_a_table_has_the_whole_problems_columns_and_values(make, bounds):
    whole = make()
    table = investigate(Restricted(whole, bounds), 32)
    assert table.schema.variables == investigate(whole, 1).schema.variables
    F = whole.evaluate(given(table, whole), return_as_dictionary=True)
    np.testing.assert_array_equal(table.F, F["F"])
    np.testing.assert_array_equal(table.G, F.get("G", table.G))
    for name, kept in bounds.items():
        column = table[name].tolist()
        if isinstance(kept, tuple):
            assert min(column) >= (-np.inf if kept[0] is None else kept[0])
            assert max(column) <= (np.inf if kept[1] is None else kept[1])
        else:
            assert set(column) == set(kept if isinstance(kept, list) else [kept])


MIXED = {
    "sampling": MixedVariableSampling(),
    "mating": MixedVariableMating(eliminate_duplicates=MixedVariableDuplicateElimination()),
    "eliminate_duplicates": MixedVariableDuplicateElimination(),
}


@pytest.mark.parametrize("tolerant", [False, True])
@pytest.mark.parametrize(
    ("make", "bounds", "is_inside"),
    [
        (bnh, {"x1": (None, 1.0)}, lambda x: x[0] <= 1),
        (Beam, {"ribs": (2, 4), "width": 0.7}, lambda x: 2 <= x["ribs"] <= 4 and x["width"] == 0.7),
    ],
)
def test_another_algorithm_stays_in_the_part(make, bounds, is_inside, tolerant):
    whole = make()
    part = Restricted(whole, bounds)
    problem = FailureTolerant(part) if tolerant else part
    options = MIXED if make is Beam else {"sampling": LPTauSampling()}
    result = minimize(problem, NSGA2(pop_size=10, **options), ("n_gen", 3), seed=1)
    designs = part.original(result.X)
    np.testing.assert_array_equal(whole.evaluate(designs, return_as_dictionary=True)["F"], result.F)
    assert all(map(is_inside, designs))


@pytest.mark.parametrize("width", [1.5, (1.25, 1.75)])
def test_parts_of_parts_are_the_part_by_both(width):
    outer, inner = {"width": (1.0, 2.0), "metal": "steel"}, {"width": width, "ribs": (None, 4)}
    twice = Restricted(Restricted(Beam(), outer), inner)
    assert investigate(twice, 16).equals(investigate(Restricted(Beam(), outer | inner), 16))
    refused("from 1.0 to 2.0", Restricted, Restricted(Beam(), outer), {"width": 0.5})
    refused("FailureTolerant around Restricted", Restricted, FailureTolerant(Beam()), inner)


@pytest.mark.parametrize(
    "bounds", [{"hollow": True}, {"metal": "wood"}, {"ribs": 2}, {"ribs": (1, 8)}]
)
def test_another_part_is_another_run_of_a_study(study_file, bounds):
    investigate(Restricted(Beam(), {"width": (0.1, 2.0)}), 4, study=study_file)
    investigate(Beam(), 4, study=study_file)  # the whole, however it is said
    assert len(Study(study_file).facts().runs) == 1
    investigate(Restricted(Beam(), bounds), 4, study=study_file)
    assert len(Study(study_file).facts().runs) == 2


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ({"width": (0.05, 1)}, r"width of bounds must be a value, or .* from 0.1 to 2.0, real, got"),
        ({"width": (1, 0.5)}, r"in increasing order, .*, got \(1, 0.5\)"),
        ({"widht": 1}, "did you mean 'width'"),
        ({"ribs": (1.5, 3)}, "from 1.0 to 9.0, integer"),
        ({"metal": ["iron", "gold"]}, "one of 'iron', 'steel', 'wood', or a list of some, got"),
        ({"width": 1, "ribs": 2, "metal": "iron", "hollow": True}, "such that a variable is free"),
    ],
)  # fmt: skip
def test_what_is_no_part_is_refused(bounds, message):
    refused(message, Restricted, Beam(), bounds)
