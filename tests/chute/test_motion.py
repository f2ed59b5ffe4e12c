"""The motion: a 30-digit reference, an integrator, mechanics, corners, any batch, errors."""

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import simpson, solve_ivp

from benchmarks.motion import rival
from pymoo_psi.chute import ChuteParameters, Motion, criteria, motion
from tests.helpers import designs
from tests.helpers.designs import design, solve, wide
from tests.helpers.draws import examples
from tests.helpers.refusals import refused

FIELDS = tuple(field.name for field in fields(Motion) if field.name not in ("u1", "v_p"))


def fields_of(motion):
    return [(name, getattr(motion, name)) for name in FIELDS]


def energy(speed, spin, r):
    return 0.5 * (speed**2 + 0.4 * r**2 * np.sum(spin**2, axis=-1))


@pytest.fixture(scope="session")
def reference():
    """Inputs (n, 8), expected fields by name, and the sets' names."""
    cases = json.loads((Path(__file__).parent / "reference" / "motion_30_digits.json").read_text())[
        "cases"
    ]
    inputs = np.array([[float.fromhex(q) for q in case["inputs"]] for case in cases])
    names = [name for name in FIELDS if name != "exit_spin"]
    fields = {name: np.array([float(case[name]) for case in cases]) for name in names}
    fields["exit_spin"] = np.array([[float(q) for q in case["exit_spin"]] for case in cases])
    return inputs, fields, np.array([case["set"] for case in cases])


class TestReference:
    def test_thirty_digits(self, reference):
        inputs, expected, sets = reference
        got = dict(fields_of(solve(*inputs.T)))
        # where slip ends within rounding of the exit, either answer is right
        edge = (sets == "slip end at exit") & ~(expected["slip_end"] < 1.0 - 2e-13)
        assert np.all((got["slip_end"][edge] > 1.0 - 1e-12) | np.isnan(got["slip_end"][edge]))
        for name, value in expected.items():
            keep = ~edge if name.startswith("slip") else np.ones(len(edge), bool)
            np.testing.assert_allclose(
                got[name][keep], value[keep], rtol=1e-12, atol=2e-12, err_msg=name
            )


class TestMechanics:
    def test_dissipation_is_the_integral_of_b_rho(self):
        # along the exact trajectory, an integral that the kernel never takes
        sphere = (0.6, 3.0, 0.4, 0.3193, 0.1)
        path = designs.trajectory(*sphere, n=2001)
        lost = 0.4 * simpson(np.hypot(*path.slip_velocity.T) / path.speed, x=path.eta)
        np.testing.assert_allclose(solve(*sphere).dissipation, lost, rtol=1e-10)

    def test_mirror(self):
        rows = wide(2000, seed=2)
        m, n = solve(*rows.T), solve(*(rows * np.array([1, -1, 1, 1, 1, -1, 1, 1])).T)
        for name, field in fields_of(m):
            sign = np.array([-1.0, 1.0, 1.0]) if name == "exit_spin" else 1.0
            np.testing.assert_array_equal(getattr(n, name) * sign, field)

    def test_a_sphere_that_starts_rolling_rolls_in_both_models(self):
        """With r ω_X = v_P and r ω_Y = c there is no slip, and the models are one."""
        p = ChuteParameters(mu=0.4, c=0.5, r=0.1, omega0=(20.0, 5.0, 1.0))
        full, rolling = (motion([0.1, 0.7, 1.3], 2.0, p, model=m) for m in ("full", "rolling"))
        np.testing.assert_allclose(criteria(full), criteria(rolling), rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(full.exit_spin, rolling.exit_spin, rtol=1e-13)
        np.testing.assert_array_equal([full.slip_end, full.slip_time], np.zeros((2, 3)))
        np.testing.assert_allclose(full.dissipation, 0, atol=1e-15)


class TestAnyDesign:
    @examples(4)
    @given(design())
    @example((0.4, 0.5, 0.4, 0.25, 0.125, 4.0, -20.0, 0.0))
    def test_sound(self, row):
        u1, v_p, _, c, r, wx0, wy0, wz0 = row
        m = solve(*row)
        assert 0.0 <= m.reached <= 1.0
        assert (m.reached < 1.0) == np.isinf(m.time) == (m.exit_speed == 0.0)
        assert not any(np.isnan(f).any() for k, f in fields_of(m) if "slip" not in k)
        assert np.isnan(m.slip_end) or 0.0 <= m.slip_end <= 1.0
        change = energy(m.exit_speed, m.exit_spin, r) - energy(c, np.array([wx0, wy0, wz0]), r)
        assert change == pytest.approx(
            u1 * m.reached + m.plane_work - m.dissipation, rel=0, abs=1e-12
        )
        assert m.dissipation > -1e-13

    @given(u1=st.floats(0, 1.4), v_p=st.floats(0.1, 6), mu=st.sampled_from([0.2, 0.4, 0.6]))
    def test_against_an_integration_of_the_slip_in_time(self, u1, v_p, mu):
        found = criteria(solve(u1, v_p, mu, 0.3193, 0.1))[:2]
        # f2 is a difference of energies, of which the integration knows nine decimals.
        np.testing.assert_allclose(found, rival(u1, v_p, mu), rtol=1e-7, atol=1e-9)

    def test_a_sphere_whose_backspin_uses_up_its_speed_stops(self):
        # It would roll with (5 c + 2 r ω_y) / 7 = 0.
        m = solve(0.0, 0.0, 1.0, 0.25, 0.125, 0.0, -5.0, 0.0)
        assert m.time == np.inf
        assert m.reached == pytest.approx(0.25**2 / 2)  # decelerated by μ = 1 all the way

    def test_a_motion_is_bit_identical_in_any_batch(self):
        """More designs than are solved together, in any order."""
        box = wide(1500, seed=7)
        box[:, 2:] = [0.4, 0.3193, 0.1, 0, 0, 0]
        box[:, 0], box[:, 1] = box[:, 0] % 1.4, 0.1 + np.abs(box[:, 1]) % 5.9
        rows = np.vstack([box, wide(8000, seed=8)])
        whole, rng = solve(*rows.T), np.random.default_rng(0)
        for size in (1, 2, 3, 7, 64, 500, 8999):
            chosen = rng.permutation(len(rows))[:size]
            for name, field in fields_of(solve(*rows[chosen].T)):
                np.testing.assert_array_equal(field, getattr(whole, name)[chosen], err_msg=name)


class TestShapes:
    @pytest.mark.parametrize("model", ["rolling", "full"])
    def test_broadcasting(self, model):
        p = ChuteParameters(mu=np.array([0.2, 0.4]), omega0=(0, np.zeros((3, 1)), 0))
        m = motion(0.3, 1.0, p, model=model)
        shapes = [values.shape for values in (m.time, m.exit_spin, criteria(m))]
        assert shapes == [(3, 2), (3, 2, 3), (3, 2, 4)]
        assert m.time[1, 1] == motion(0.3, 1.0, ChuteParameters(mu=0.4), model=model).time


@given(
    u1=st.floats(0, 2),
    v_p=st.floats(0.1, 6),
    p=st.builds(
        ChuteParameters,
        mu=st.floats(0.05, 2),
        c=st.floats(0.02, 3),
        r=st.floats(0.02, 0.5),
        omega0=st.tuples(*[st.floats(-20, 20)] * 3),
    ),
)
def test_rolling_closed_form_is_the_integral_of_its_equations(u1, v_p, p):
    """Eq. (2.20) from η = 0, with dω_Y/dη in its consistent form, by solve_ivp."""

    def field(eta, y):
        sin, length = u1 / np.hypot(1, u1), np.hypot(1, u1)
        return [
            length / np.sqrt(y[1]),
            2 * length * sin / 1.4,
            length / np.sqrt(y[1]) * sin / (1.4 * p.r),
        ]

    t, w, spin = solve_ivp(
        field, (0, 1), [0.0, p.c**2, p.omega0[1]], "DOP853", rtol=1e-11, atol=1e-12
    ).y[:, -1]
    m = motion(u1, v_p, p, model="rolling")
    np.testing.assert_allclose(m.time, t, rtol=1e-8)
    np.testing.assert_allclose(m.exit_speed, np.sqrt(w), rtol=1e-9)
    np.testing.assert_allclose(m.exit_spin, [p.omega0[0], spin, p.omega0[2]], rtol=1e-8, atol=1e-8)
    assert (m.reached, m.slip_end) == (1, 0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"mu": [0.2, -1.0]}, "mu must be positive, got -1.0"),
        ({"c": np.nan}, "c must be finite, got nan"),
        ({"omega0": (1, np.inf, 2)}, r"omega0\[1\] must be finite, got inf"),
    ],
)
def test_bad_parameters(options, message):
    refused(message, ChuteParameters, error=ValueError, **options)
