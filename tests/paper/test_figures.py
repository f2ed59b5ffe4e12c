"""What the paper's figures show, as numbers."""

import numpy as np
import pytest

from pymoo_psi import VectorizedSphereChute, lp_tau, rank_of_efficiency
from pymoo_psi.chute import ChuteParameters, criteria, motion
from pymoo_psi.paper import criterion_surfaces, salukvadze_functions


@pytest.mark.parametrize("model", ["full", "rolling"])
def test_surfaces_are_the_criteria_on_the_box(model):
    u1, u2, f = criterion_surfaces(0.6, model, n=4)
    X = np.column_stack([u1.ravel(), u2.ravel()])
    F = VectorizedSphereChute(0.6, model=model).evaluate(X)[0]
    np.testing.assert_array_equal(f.reshape(2, -1).T, F[:, :2])
    np.testing.assert_allclose(u1[[0, -1], 0], [0, 2.1])
    np.testing.assert_allclose(u2[0, [0, -1]], [0.1, 6])


@pytest.mark.parametrize(
    ("model", "n", "speeds"), [("rolling", 300, (0.05, 0.32, 1.0)), ("full", 20, (0.3,))]
)
def test_salukvadze_functions_are_those_of_the_ranking(model, n, speeds):
    functions = salukvadze_functions(0.4, model, n, speeds)
    X = [0, 0.1] + np.array([1.4, 5.9]) * lp_tau(n, 2)
    for k, c in enumerate(speeds):
        moved = motion(*X.T, ChuteParameters(mu=0.4, c=c), model=model)
        best = rank_of_efficiency(criteria(moved), normalize=False).salukvadze
        assert functions["test_point"][k] - 1 in best
        np.testing.assert_allclose(
            functions.loc[k, "f1":"f4"], criteria(moved)[best[0]], rtol=1e-12
        )
        np.testing.assert_allclose(
            functions["exit_speed"][k], moved.exit_speed[best[0]], rtol=1e-12
        )
