"""pymoo's individuals of the points of a run, and the two conversions between them and tests.

====================================  ==================================================
field of an individual                of its test
====================================  ==================================================
``X``, ``F``, ``G``, ``H``            design, objectives and constraints as the problem has them
``CV``                                the violation of constraints and of limits
``data["test_point"]``                its number
``data["failure"]``                   the reason of a failure, or ""
``data["outputs"]``                   the names of the further outputs
``data[name]`` for each of these      their values
====================================  ==================================================
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from pymoo.core.individual import Individual
from pymoo.core.population import Population

from pymoo_psi._validation import Received, Values, invalid
from pymoo_psi.algorithms._model import Model
from pymoo_psi.algorithms._sources import Points
from pymoo_psi.problems import untolerant
from pymoo_psi.table import TestTable


def individuals_of(points: Points, model: Model) -> Population:
    """Return the individuals of points, which are not evaluated."""
    config = Individual.default_config()  # one for all, which takes less time
    X = points.matrix(model.space)
    individuals = []
    for number, x in zip(points.numbers.tolist(), model.space.designs(X.copy()), strict=True):
        individual = Individual(config)
        individual.X = x
        individual.data["test_point"] = number
        individuals.append(individual)
    return Population.create(*individuals)


def assign_tests(individuals: Population, tests: TestTable, model: Model, problem: Any) -> None:
    """Give individuals the values of their tests, so that pymoo does not evaluate them.

    Args:
        individuals: The individuals; those without a test stay as they are.
        tests: The tests.
        model: The model of the run.
        problem: The problem as pymoo has it.
    """
    values_by_number = dict(
        zip(tests.numbers.tolist(), _values(tests, model, problem), strict=True)
    )
    for individual in individuals:
        number = individual.data["test_point"]
        if number in values_by_number:
            values = values_by_number[number]
            for name in ("F", "G", "H", "CV"):
                setattr(individual, name, values.pop(name))
            # `set` takes twice as long, and would take an output named f, x or data for an
            # attribute; nor does an output replace the number
            individual.data |= values | {"test_point": number}
            individual.evaluated.update("FGH")


def _values(tests: TestTable, model: Model, problem: Any) -> list[Values]:
    """Return the values of each test as its individual has them, by name."""
    values_of_tests = model.values(tests)
    if untolerant(problem) is not problem:  # failed ones have other values for pymoo
        failures = np.array([values["failure"] for values in values_of_tests], dtype=object)
        out = {"F": tests.F.copy(), "G": model.constraints(tests), "H": tests.H}
        X = model.space.designs(tests.X.copy())
        out = problem.tolerated(X, out | {"failure": failures}, ["F", "G"])
        for values, F, G in zip(values_of_tests, out["F"], out["G"], strict=True):
            values |= {"F": F, "G": G}
    violation = model.total_violation(tests)[:, None]
    reasons = tests.reasons
    for number, cv, values in zip(tests.numbers.tolist(), violation, values_of_tests, strict=True):
        values["CV"] = cv
        values["failure"] = reasons.get(number, "")
        values["outputs"] = tests.schema.outputs
    return values_of_tests


def tests_of(individuals: Population, points: Points, model: Model) -> TestTable:
    """Return the tests of points from their individuals.

    Raises:
        ArgumentValueError: The individuals are of other points, or are not evaluated.
    """
    numbers = individuals.get("test_point")
    if not np.array_equal(numbers, points.numbers):
        rule = f"the next test points in their order, {points.numbers.tolist()}"
        raise invalid("infills", rule, Received(str(numbers.tolist())))
    values = [_values_of(individual, model) for individual in individuals]
    X = model.space.to_matrix(individuals.get("X"))
    return model.tests(replace(points, designs=X), values)


def _values_of(individual: Individual, model: Model) -> Values:
    """Return the values of an individual, which must be evaluated."""
    problem = model.inner
    values = {"failure": individual.get("failure")}
    sizes = {"F": problem.n_obj, "G": problem.n_ieq_constr, "H": problem.n_eq_constr}
    for name, size in sizes.items():
        # constraints of requirements and failures may follow those of the model
        values[name] = individual.get(name)[:size]
        if len(values[name]) != size:
            rule = f"evaluated, with {name} of shape {(size,)} for each"
            raise invalid("infills", rule, Received(f"shape {np.shape(values[name])}"))
    for name in individual.data.get("outputs", ()):
        values[name] = individual.data[name]
    if np.isfinite(individual.F).all():
        model.require_outputs(values)
    return values
