"""A part of the bounds gives the whole problem's values, to any algorithm and in every table."""

import numpy as np
import pandas as pd
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.mixed import (
    MixedVariableDuplicateElimination,
    MixedVariableMating,
    MixedVariableSampling,
)
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
from tests.helpers.models import Model
from tests.helpers.refusals import refused

DENSITY = {"iron": 7.8, "steel": 7.7, "wood": 0.6}


VARIABLES = {
    "width": Real(bounds=(0.1, 2.0)),
    "ribs": Integer(bounds=(1, 9)),
    "metal": Choice(options=list(DENSITY)),
    "hollow": Binary(),
}


def beam(width, ribs, metal, hollow):
    """Fails for thick beams of wood."""
    if metal == "wood" and width > 1.5:
        raise ValueError("does not grow")
    mass = width * (ribs - 0.5 * hollow) * DENSITY[metal]
    return {"F": [mass, 1 / mass + hollow], "G": [ribs - 7]}


def knapsack(x):
    """Things to take or to leave, or how many of each."""
    weight = x @ np.array([1.1, 2.3, 3.1, 4.7, 5.9, 6.1])
    return {"F": [weight, -x.sum()], "G": weight - 30}


BNH = get_problem("bnh")
BEAM = Model(lambda x: beam(**x), vars=VARIABLES, n_ieq_constr=1)
KNAPSACK = {"n_var": 6, "n_ieq_constr": 1, "xu": 3}


@pytest.mark.parametrize(
    ("whole", "bounds"),
    [
        (SphereChute(0.4), {"x1": (0.2, 0.4)}),
        (VectorizedSphereChute(0.4), {"x2": 1.7}),
        (BNH, {"x1": (None, 1.0), "x2": (0.5, None)}),
        (Model(knapsack, vtype=bool, **KNAPSACK), {"x3": True, "x5": False}),
        (Model(knapsack, vtype=int, **KNAPSACK), {"x3": 1, "x5": (0, 2)}),
        (BEAM, {"width": (0.5, 1.0), "metal": ["wood", "iron"], "hollow": True}),
        (BEAM, {"ribs": (2, 4), "width": 0.7}),
        (BEAM, {"ribs": 3, "metal": "steel"}),
    ],
)
def test_a_table_has_the_whole_problems_columns_and_values(whole, bounds):
    table = investigate(Restricted(whole, bounds), 32)
    assert table.schema.variables == investigate(whole, 1).schema.variables
    designs = table.X
    if whole is BEAM:
        named = [dict(zip(VARIABLES, row, strict=True)) for row in table.X.tolist()]
        designs = np.array(named, dtype=object)
    F = whole.evaluate(designs, return_as_dictionary=True)
    np.testing.assert_array_equal(table.F, F["F"])
    np.testing.assert_array_equal(table.G, F.get("G", table.G))
    for name, kept in bounds.items():
        if isinstance(kept, tuple):
            low, high = (end if end is None else float(end) for end in kept)
            assert pd.Series(table[name]).between(low or 0.0, high or np.inf).all()
        else:
            assert set(table[name].tolist()) == set(kept if isinstance(kept, list) else [kept])


@pytest.mark.parametrize("tolerant", [False, True])
@pytest.mark.parametrize(
    ("whole", "bounds", "is_inside", "options"),
    [
        (BNH, {"x1": (None, 1.0)}, lambda x: x[0] <= 1, {"sampling": LPTauSampling()}),
        (
            BEAM,
            {"ribs": (2, 4), "width": 0.7},
            lambda x: 2 <= x["ribs"] <= 4 and x["width"] == 0.7,
            {
                "sampling": MixedVariableSampling(),
                "mating": MixedVariableMating(
                    eliminate_duplicates=MixedVariableDuplicateElimination()
                ),
                "eliminate_duplicates": MixedVariableDuplicateElimination(),
            },
        ),
    ],
)
def test_another_algorithm_stays_in_the_part(whole, bounds, is_inside, options, tolerant):
    part = Restricted(whole, bounds)
    result = minimize(
        FailureTolerant(part) if tolerant else part,
        NSGA2(pop_size=10, **options),
        ("n_gen", 3),
        seed=1,
    )
    designs = part.original(result.X)
    np.testing.assert_array_equal(whole.evaluate(designs, return_as_dictionary=True)["F"], result.F)
    assert all(map(is_inside, designs))


@pytest.mark.parametrize("width", [1.5, (1.25, 1.75)])
def test_parts_of_parts_are_the_part_by_both(width):
    outer, inner = {"width": (1.0, 2.0), "metal": "steel"}, {"width": width, "ribs": (None, 4)}
    twice = Restricted(Restricted(BEAM, outer), inner)
    assert investigate(twice, 16).equals(investigate(Restricted(BEAM, outer | inner), 16))
    refused("from 1.0 to 2.0", Restricted, Restricted(BEAM, outer), {"width": 0.5})
    refused(r"say FailureTolerant\(Restricted\(", Restricted, FailureTolerant(BEAM), inner)


@pytest.mark.parametrize(
    "bounds", [{"hollow": True}, {"metal": "wood"}, {"ribs": 2}, {"ribs": (1, 8)}]
)
def test_another_part_is_another_run_of_a_study(study_file, bounds):
    investigate(Restricted(BEAM, {"width": (0.1, 2.0)}), 4, study=study_file)
    investigate(BEAM, 4, study=study_file)  # the whole, however it is said
    assert len(Study(study_file).facts().runs) == 1
    investigate(Restricted(BEAM, bounds), 4, study=study_file)
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
    refused(message, Restricted, BEAM, bounds)


def test_limits_may_name_options_beyond_the_part():
    part = Restricted(BEAM, {"metal": ["iron"]})
    assert set(investigate(part, 4, limits="metal=steel").status) == {"infeasible"}
    assert "ok" in investigate(part, 4, limits="metal in iron, steel").status
