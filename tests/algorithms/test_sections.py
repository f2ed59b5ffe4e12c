"""Sections through a design: what surrogates expect, against the models themselves."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from pymoo.core.variable import Choice, Integer, Real
from pymoo.problems.functional import FunctionalProblem

from pymoo_psi import investigate, lp_tau
from pymoo_psi.algorithms import RunOptions, import_tests, sections
from pymoo_psi.plots import plot_sections
from tests.helpers.draws import rarely
from tests.helpers.models import Model
from tests.helpers.refusals import refused


def bar(a, n, c):
    """Smooth in three variables of different kinds."""
    density = 1.0 if c == "oak" else 3.0
    return [density * a + 0.1 * n**2, -(np.sin(a) + 0.3 * n * density)]


@pytest.fixture(scope="module")
def table():
    model = Model(
        lambda x: {"F": bar(**x)},
        vars={
            "a": Real(bounds=(1, 3)),
            "n": Integer(bounds=(2, 6)),
            "c": Choice(options=["oak", "tin"]),
        },
    )
    told = {"names": {"f1": "mass", "f2": "gain"}, "units": {"a": "mm", "mass": "kg"}}
    return investigate(model, 96, maximize=["gain"], log=["a"], **told)


def test_sections_are_those_of_the_model_within_bands(table):
    frame = sections(table, 7)
    design = dict(zip(table.schema.variables, table.X[table.row_of(7)], strict=True))
    for line in frame.to_dict("records"):
        assert line["design"] == design[line["variable"]]
        mass, loss = bar(**design | {line["variable"]: line["value"]})
        true = {"mass": mass, "gain": -loss}[line["column"]]
        assert line["expected"] == pytest.approx(true, abs=0.1)
        assert line["lower"] <= line["expected"] <= line["upper"]
        assert line["lower"] - 0.05 <= true <= line["upper"] + 0.05
    assert (frame["error"] < 0.05).all()
    values = frame.groupby("variable", sort=False)["value"].unique()
    assert values.index.tolist() == ["a", "n", "c"]
    assert values["n"].tolist() == [2, 3, 4, 5, 6]
    assert values["a"][[0, -1]].tolist() == pytest.approx([1, 3], rel=1e-12)  # of logarithms


def test_the_design_is_the_chosen_one_or_the_best(table):
    chosen = table.under(replace(table.decision, chosen="test 9"))
    pd.testing.assert_frame_equal(sections(chosen), sections(table, 9))
    pd.testing.assert_frame_equal(sections(table), sections(table, int(table.best().numbers[0])))


def test_noise_is_not_taken_for_a_section():
    random = np.random.default_rng(1)
    noise = FunctionalProblem(2, [lambda x: random.normal(), np.sum], xl=0, xu=1)
    errors = sections(investigate(noise, 60)).groupby("column")["error"].first()
    assert errors["f2"] < 0.1 < 0.8 < errors["f1"]


def resonance(x):
    ratio, damping = 0.2 + 1.8 * x[0], 1e-3 + 0.1 * x[1]
    return 1 / np.sqrt((1 - ratio**2) ** 2 + (2 * damping * ratio) ** 2)


@pytest.mark.parametrize(
    "pole",
    [
        lambda x: (1 / (x + 1e-3)).sum(),
        lambda x: 1e3 / ((1 + 59 * x[0]) * (4 + 156 * x[1]) ** 3),  # a deflection
        resonance,
        *rarely(
            lambda x: (0.1 + 0.9 * x[0]) / (1.001 + x[1]) / (0.901 + x[1] - 0.9 * x[0]),  # a queue
            lambda x: 1 / np.maximum(1 - 0.3 * x[0] * (0.2 + 1.6 * x[1]) ** 2, 1e-4),  # buckling
            lambda x: np.tan(1.56 * x[0]) * (1 + x[1]),
            lambda x: 1 / (x[0] + 0.002) ** 3 + x[1],
        ),
    ],
)
def test_a_pole_is_learned(pole):
    table = investigate(FunctionalProblem(2, [pole, np.sum], xl=0, xu=1), 48)
    frame = sections(table, 7, columns=["f1"], n_values=21)
    assert (frame["error"] < 0.05).all()
    designs = np.repeat(lp_tau(1, 2, first=7), 42, axis=0)
    designs[np.arange(42), np.repeat([0, 1], 21)] = frame["value"]
    true = np.apply_along_axis(pole, 1, designs)
    errors = np.abs(frame["expected"] - true) / (np.abs(true) + 0.01)
    assert (np.quantile(errors, [0.5, 0.9]) < [0.01, 0.05]).all()


@pytest.mark.parametrize("place", [0.1, 0.3])
@pytest.mark.parametrize("power", [1, 2, 3])
def test_no_prediction_beside_a_pole_exceeds_all_tests(place, power):
    """On the scale of a pole predictions are unbounded; people see at most twice the worst test."""

    objectives = [lambda x: 1 / (abs(x[0] * x[1] - place) + 1e-9) ** power, np.sum]
    table = investigate(FunctionalProblem(3, objectives, xl=0, xu=1), 64)
    frame = sections(table, columns=["f1"])
    assert frame[["expected", "lower", "upper"]].abs().max(axis=None) <= 2 * table["f1"].max()


def test_tests_outside_the_bounds_are_learned_where_they_are(study_file):
    problem = FunctionalProblem(1, [lambda x: x[0] ** 2, lambda x: -x[0]], xl=0, xu=1)
    x = np.linspace(0, 4, 21)
    frame = pd.DataFrame({"x1": x, "f1": x**2, "f2": -x})
    table = import_tests(problem, frame, RunOptions(study=study_file, study_key="v1"))
    lines = sections(table, 1, columns=["f1"])
    np.testing.assert_allclose(lines["expected"], lines["value"] ** 2, atol=1e-3)
    refused("within the bounds, or at most their width outside, got test 21", sections, table, 21)


def test_panels_are_one_for_each_column_and_variable(table):
    figure = plot_sections(sections(table, 7))
    assert len(figure.axes) == 6
    for row in (figure.axes[:3], figure.axes[3:]):
        assert len({axes.get_ylim() for axes in row}) == 1
    assert (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()) == ("a [mm]", "mass [kg]")


@pytest.mark.parametrize(
    ("arguments", "n", "message"),
    [
        ({"columns": ["mas"]}, 96, "columns must be one of"),
        ({"design": 500}, 96, "design must be"),
        ({"row": 96}, 96, "row must be a row of the table, from 0 to 95, got 96"),
        ({"n_values": 1}, 96, "n_values must be"),
        ({}, 5, "8 or more with a value of"),
    ],
)
def test_what_has_no_section_is_refused(table, arguments, n, message):
    refused(message, sections, table.take(np.arange(n)), **arguments)
