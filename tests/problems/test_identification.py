"""Parameters of a model found from measured series."""

import numpy as np
import pandas as pd
import pytest
from pymoo.optimize import minimize

from pymoo_psi import Identification, SurrogatePSI, investigate
from tests.refusals import refused

T = np.linspace(0, 12, 120)
TRUE = {"frequency": 2.0, "damping": 0.12}
BOX = {"frequency": (1.0, 4.0), "damping": {"bounds": (0.01, 0.5), "unit": "1/s"}}


def oscillator(parameters, data):
    """Return the free decay, and the response to a step, of a damped oscillator."""
    t, omega, zeta = data["t"], parameters["frequency"], parameters["damping"]
    damped = omega * np.sqrt(1 - zeta**2)
    swing = np.exp(-zeta * omega * t) * (
        np.cos(damped * t) + zeta * omega / damped * np.sin(damped * t)
    )
    return swing if "decay" in data else 1 - swing


def measured(noise=0.02, seed=1):
    rng = np.random.default_rng(seed)
    clean = {name: pd.DataFrame({"t": T, name: 0.0}) for name in ("decay", "step")}
    return {
        name: data.assign(**{name: oscillator(TRUE, data) + noise * rng.normal(size=len(T))})
        for name, data in clean.items()
    }


def problem(**kwargs):
    weights = {"decay": 1.0, "step": 1.0}
    return Identification(oscillator, measured(), BOX, **{"weights": weights, **kwargs})


def test_noisy_series_of_two_experiments_give_the_parameters_back():
    # 240 samples with noise of 2 % determine both to about 0.2 %; 1 % of the frequency and 5 % of
    # the damping are bands that the search must reach, too.
    table = minimize(problem(), SurrogatePSI(96), seed=1).algorithm.table
    best = dict(zip(table.layout.variables, table.best().X[0], strict=True))
    assert best["frequency"] == pytest.approx(TRUE["frequency"], rel=0.01)
    assert best["damping"] == pytest.approx(TRUE["damping"], rel=0.05)


def test_adequacy_is_what_its_name_says():
    off = {
        "y": pd.DataFrame({"t": [0.0, 1.0, 3.0], "y": [1.0, -2.0, np.nan], "z": [3.0, 4.0, 0.0]})
    }
    zero = lambda parameters, data: np.zeros((3, 2))  # noqa: E731
    weights = {"y": 1.0, "z": 2.0}
    expected = {
        "rms": (np.sqrt(5 / 2) + np.sqrt((36 + 64) / 3)) / 2,
        "max": 8.0,
        "area": (1.5 + (6 + 8) / 2 + 8.0) / 2,
    }
    for measure, value in expected.items():
        found = Identification(zero, off, {"x": (0, 1)}, measure=measure, weights=weights)
        assert investigate(found, 1).F[0, 0] == pytest.approx(value, rel=1e-14)


def test_tolerances_are_limits_and_limits_are_those_of_any_table():
    table = investigate(problem(tolerances={"step": 0.3}), 128)
    np.testing.assert_array_equal(table.status == "ok", table.column("step") <= 0.3)
    assert table.layout.objectives == ("decay", "step")
    assert table.layout.constraints == ()
    assert table.limits == {"step": (-np.inf, 0.3)}
    within = table.under(limits={"decay": 0.3, "step": 0.3}).feasible()
    np.testing.assert_array_equal(
        within, (table.column("decay") <= 0.3) & (table.column("step") <= 0.3)
    )


def test_a_study_belongs_to_its_measurements(tmp_path, study_file):
    files = {}
    for name, data in measured().items():
        files[name] = tmp_path / f"{name}.csv"
        data.to_csv(files[name], index=False)
    weights = {"decay": 1.0, "step": 1.0}
    first = investigate(
        Identification(oscillator, files, BOX, weights=weights), 4, study=study_file
    )
    np.testing.assert_array_equal(first.F, investigate(problem(), 4).F)
    other = Identification(oscillator, measured(seed=2), BOX, weights=weights)
    refused("belongs to another model", investigate, other, 4, study=study_file)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"experiments": {"a": pd.DataFrame({"t": [1.0, 0.0], "y": [1.0, 2.0]})}}, "increasing"),
        (
            {"experiments": {"a": pd.DataFrame({"t": [0.0, 1.0], "y": ["high", "low"]})}},
            "columns of numbers",
        ),
        ({"experiments": {"a": pd.DataFrame({"y": [0.0, 1.0]})}}, "two columns"),
        ({"measure": "mean"}, "measure"),
        ({"weights": None}, "weights must be given for decay, step"),
        ({"weights": {"decay": 1.0, "stop": 1.0}}, "weights must be given for decay, step"),
        ({"tolerances": {"stop": 1.0}}, "did you mean 'step'"),
        ({"tolerances": {"step": -1.0}}, "positive"),
    ],
)
def test_wrong_arguments_are_refused(change, match):
    arguments = {"experiments": measured(), "weights": {"decay": 1.0, "step": 1.0}, **change}
    refused(match, Identification, oscillator, variables=BOX, **arguments)


@pytest.mark.parametrize("result", [np.zeros(3), np.zeros((120, 2)), {"x": T}, "text", None])
def test_a_model_that_gives_another_series_fails_the_design(result):
    wrong = Identification(lambda *_: result, {"decay": measured()["decay"]}, BOX)
    assert investigate(wrong, 1).status.tolist() == ["failed"]


def test_series_are_compared_by_name(tmp_path):
    """Whatever the order of a frame's columns is; numbers of a file are those that it says."""
    data = pd.DataFrame({"t": [0.0, 1.0, 2.0], "a": [1.0, 2.0, 3.0], "b": [30.0, 20.0, 10.0]})
    path = tmp_path / "measured.csv"
    data.to_csv(path, index=False, sep=";", decimal=",")
    weights = {"a": 1.0, "b": 1.0}

    def model(answer):
        return Identification(
            lambda parameters, data: answer(data), {"run": path}, {"x": (0, 1)}, weights=weights
        )

    exact = model(lambda data: data[["b", "t", "a"]])
    assert exact.values({"x": 0.5}) == {"run": 0.0}
    labelled = model(lambda data: {"b": data["b"], "a": data["a"].set_axis([2, 1, 0])})
    assert labelled.values({"x": 0.5}) == {"run": 0.0}
    refused(
        "for 'run' must be at the values of 't'",
        model(lambda data: data.assign(t=data["t"] + 1)).values,
        {"x": 0.5},
    )
    refused(
        "for 'run' must be at the values of 't'",
        model(lambda data: data.assign(t=data["t"] + 1).set_index("t")).values,
        {"x": 0.5},
    )
    refused(
        "a measured series must be one of", model(lambda data: data[["t", "a"]]).values, {"x": 0.5}
    )
