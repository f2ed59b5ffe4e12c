"""The motion along the way: against the solved motion, Coulomb's and Newton's laws."""

import numpy as np
import pytest

from pymoo_psi import chute
from pymoo_psi.chute import ChuteParameters
from tests.helpers.designs import solve, trajectory, wide


@pytest.mark.parametrize(
    "row",
    [
        [0.0, 0.1, 0.4, 0.3, 0.125, 0.0, -20.0, 0.0],  # it stops
        *wide(12, seed=9).tolist(),
    ],
)
def test_against_solve_and_forces(row):
    u1, v_p, mu, _, r, wx0, wy0, _ = row
    m, path = solve(*row), trajectory(*row, n=41)
    np.testing.assert_allclose(path.spin[0, :2], [wx0, wy0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(
        path.slip_velocity[:, 1], r * path.spin[:, 0] - v_p, rtol=0, atol=1e-12
    )
    assert path.eta[-1] == m.reached
    np.testing.assert_allclose(path.speed[-1], m.exit_speed, rtol=1e-11, atol=1e-6)
    if m.reached == 1.0:
        np.testing.assert_allclose(path.time[-1], m.time, rtol=1e-12)
        np.testing.assert_allclose(path.spin[-1], m.exit_spin, rtol=1e-11, atol=1e-11)
    assert np.isfinite(path.time).all()
    assert (np.diff(path.time)[np.diff(path.eta) > 0] > 0.0).all()
    size = np.hypot(*path.friction.T) / path.normal[:, 0]
    assert np.all(size <= mu * (1.0 + 1e-14))  # Coulomb's law, Eq. (2.10)
    np.testing.assert_allclose(size[path.slipping], mu, rtol=1e-13)
    np.testing.assert_array_equal(path.normal[:, 1], np.abs(path.friction[:, 1]))


def test_newtons_law():
    """dv_C/dt = sin α + f_AX and r dω/dt = 2.5 (f_AY, −f_AX), by differences in η."""
    r = 0.1
    path = trajectory(0.3, 1.0, 0.4, 0.3193, r, n=20_001)
    for i in np.searchsorted(path.eta, [0.2, 0.9]):
        dt = path.time[i + 1] - path.time[i - 1]
        push = 0.3 / np.hypot(1.0, 0.3) + path.friction[i, 0]
        np.testing.assert_allclose((path.speed[i + 1] - path.speed[i - 1]) / dt, push, rtol=1e-6)
        turn = r * (path.spin[i + 1] - path.spin[i - 1]) / dt
        f_x, f_y = path.friction[i]
        np.testing.assert_allclose(turn, [2.5 * f_y, -2.5 * f_x, 0], rtol=1e-6, atol=1e-6)


def test_the_transition_stands_twice():
    path = chute.trajectory(0.2635, 0.1072, ChuteParameters(0.4), n=51)
    twice = np.flatnonzero(path.eta == path.slip_end)
    assert len(path.eta) == 53
    assert path.slipping[twice].tolist() == [True, False]
    np.testing.assert_array_equal(path.time[twice], path.slip_time)
    np.testing.assert_array_equal(path.slip_velocity[~path.slipping], 0)
    # τ = 0.2635 / 0.4 < 1: slip dies out in the direction cos θ = τ, against the plane
    b, tau = 0.4 / np.hypot(1, 0.2635), 0.2635 / 0.4
    np.testing.assert_allclose(
        path.friction[twice[0]], [-b * tau, b * np.sqrt(1 - tau**2)], rtol=1e-12
    )
    np.testing.assert_allclose(path.friction[twice[1]], [-2 / 7 * 0.2635 / np.hypot(1, 0.2635), 0])


@pytest.mark.parametrize("tau", [0.65, 1.0, 1.5])
def test_the_direction_tends_to_the_limit_at_the_end(tau):
    path = chute.trajectory(0.4 * tau, 0.3, ChuteParameters(0.4), n=20_001)
    last = np.flatnonzero(path.slipping)[-1]
    assert path.eta[last] == path.slip_end
    gap = np.abs(path.friction[: last + 1] - path.friction[last]).max(axis=1)
    assert (np.diff(gap[-100:]) < 0).all()
