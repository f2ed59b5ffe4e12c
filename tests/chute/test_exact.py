"""The exact motion against a 30-digit reference, the integrator and the mathematics."""

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from pymoo_psi import PsiError, chute
from pymoo_psi.chute import ChuteParameters, Motion, _motion

HERE = Path(__file__).parent / "reference"
FIELDS = tuple(field.name for field in fields(Motion) if field.name not in ("u1", "v_p"))


def parameters(mu, c, r, wx0=0.0, wy0=0.0, wz0=0.0):
    return ChuteParameters(mu, c, r, (wx0, wy0, wz0))


def solve(u1, v_p, *rest):
    return chute.motion(u1, v_p, parameters(*rest))


def integrate(u1, v_p, *rest):
    return chute.integrate(u1, v_p, parameters(*rest))


def trajectory(u1, v_p, *rest, eta):
    return chute.trajectory(u1, v_p, parameters(*rest), eta=eta)


@pytest.fixture(scope="session")
def reference():
    """Inputs (n, 8), expected fields by name, and the sets' names."""
    cases = json.loads((HERE / "motion_30_digits.json").read_text())["cases"]
    inputs = np.array([[float.fromhex(q) for q in case["inputs"]] for case in cases])
    names = [name for name in FIELDS if name != "exit_spin"]
    fields = {name: np.array([float(case[name]) for case in cases]) for name in names}
    fields["exit_spin"] = np.array([[float(q) for q in case["exit_spin"]] for case in cases])
    return inputs, fields, np.array([case["set"] for case in cases])


def wide(n, seed=0):
    """(n, 8) designs over the widest ranges."""
    rng = np.random.default_rng(seed)
    mu = np.exp(rng.uniform(np.log(0.05), np.log(2.0), n))
    return np.column_stack(
        [
            rng.uniform(0.0, 4.5, n) * mu,
            rng.uniform(-6.0, 6.0, n),
            mu,
            rng.uniform(0.02, 3.0, n),
            np.exp(rng.uniform(np.log(0.01), np.log(0.5), n)),
            *rng.uniform(-20.0, 20.0, (3, n)),
        ]
    )


def fields_of(motion):
    return [(name, getattr(motion, name)) for name in FIELDS]


def energy(speed, spin, r):
    return 0.5 * (speed**2 + 0.4 * r**2 * np.sum(spin**2, axis=-1))


@st.composite
def design(draw):
    number = lambda a, b: st.floats(a, b, allow_subnormal=False)  # noqa: E731
    mu = draw(number(0.05, 2.0))
    # 0, 1 and 3.5 are the corners of tau, and a spin may make v_AX or v_AY vanish exactly
    tau = draw(st.sampled_from([0.0, 1.0, 3.5]) | number(0.0, 6.0))
    r = draw(st.sampled_from([0.125, 0.25]) | number(0.01, 0.5))
    c = draw(st.sampled_from([0.25, 1.0]) | number(0.02, 3.0))
    v_p = draw(st.sampled_from([0.0, 0.5, -1.0]) | number(-6.0, 6.0))
    wx = draw(st.sampled_from([0.0, v_p / r]) | number(-20.0, 20.0))
    wy = draw(st.sampled_from([0.0, c / r]) | number(-20.0, 20.0))
    return tau * mu, v_p, mu, c, r, wx, wy, draw(number(-20.0, 20.0))


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

    def test_integrator_thirty_digits(self, reference):
        inputs, expected, _ = reference
        for i in range(0, len(inputs), 4):
            motion = integrate(*inputs[i])
            for name in ("time", "exit_speed", "plane_work", "dissipation", "reached"):
                np.testing.assert_allclose(getattr(motion, name), expected[name][i], 1e-10, 1e-10)

    def test_random_designs_against_integrator(self):
        rows = wide(150, seed=5)
        motion = solve(*rows.T)
        for i, row in enumerate(rows):
            other = integrate(*row)
            for name, field in fields_of(motion):
                np.testing.assert_allclose(
                    field[i], getattr(other, name), rtol=1e-10, atol=1e-10, err_msg=f"{name} {row}"
                )


class TestIdentities:
    def test_energy_ledger(self):
        rows = wide(20_000)
        u1, v_p, mu, c, r, wx0, wy0, wz0 = rows.T
        m = solve(*rows.T)
        start = energy(c, np.stack([wx0, wy0, wz0], -1), r)
        change = energy(m.exit_speed, m.exit_spin, r) - start
        ledger = u1 * m.reached + m.plane_work - m.dissipation
        np.testing.assert_allclose(change, ledger, rtol=0, atol=1e-12)
        assert np.all(m.dissipation > -1e-13)

    def test_dissipation_is_the_integral_of_b_rho(self):
        # along the exact trajectory, an integral that the kernel never takes
        x, weight = np.polynomial.legendre.leggauss(60)
        eta = 0.5 * (x + 1.0)
        design = (0.6, 3.0, 0.4, 0.3193, 0.1)
        path = trajectory(*design, eta=eta)
        rho, length = np.hypot(*path.slip_velocity.T), np.hypot(1.0, 0.6)
        lost = 0.4 / length * np.sum(0.5 * weight * rho * length / path.speed)
        np.testing.assert_allclose(solve(*design).dissipation, lost, rtol=1e-13)

    def test_linear_invariant(self):
        rows = wide(20_000, seed=1)
        u1, _, _, c, r, _, wy0, _ = rows.T
        m = solve(*rows.T)
        slips = np.isnan(m.slip_end) & (m.reached == 1.0)
        vx = m.exit_speed - r * m.exit_spin[:, 1]
        a = u1 / np.hypot(1.0, u1)
        with np.errstate(invalid="ignore"):
            v = (c + 0.4 * r * wy0 + a * m.time + 0.4 * vx) / 1.4
        assert slips.sum() > 1000
        np.testing.assert_allclose(m.exit_speed[slips], v[slips], rtol=0, atol=1e-12)

    def test_mirror(self):
        rows = wide(2000, seed=2)
        mirrored = rows * np.array([1, -1, 1, 1, 1, -1, 1, 1])
        m, n = solve(*rows.T), solve(*mirrored.T)
        for name, field in fields_of(m):
            sign = np.array([-1.0, 1.0, 1.0]) if name == "exit_spin" else 1.0
            np.testing.assert_array_equal(getattr(n, name) * sign, field)

    def test_spin_about_the_normal_changes_nothing(self):
        rows = wide(100, seed=3)
        m = solve(*rows.T)
        np.testing.assert_array_equal(m.exit_spin[:, 2], rows[:, 7])
        np.testing.assert_array_equal(solve(*rows[:, :7].T, 0.0).time, m.time)

    def test_rolls_at_once(self):
        m = solve(0.3, 0.5, 0.4, 0.5, 0.125, 4.0, 4.0)
        final = np.sqrt(0.25 + 0.6 / 1.4)  # w(1) = c^2 + (10/7) u1
        np.testing.assert_allclose(m.exit_speed, final, rtol=1e-15)
        np.testing.assert_allclose(m.time, 2 * np.hypot(1, 0.3) / (0.5 + final), rtol=1e-15)
        assert (m.slip_end, m.slip_time, m.dissipation) == (0.0, 0.0, pytest.approx(0, abs=1e-15))

    @pytest.mark.parametrize("corner", [1.0, 3.5])
    def test_continuous_across_tau(self, corner):
        tau = corner * (1.0 + np.array([-1e-9, -1e-13, 0.0, 1e-13, 1e-9]))
        m = solve(0.4 * tau, 0.5, 0.4, 0.3193, 0.1, 3.0, -2.0)
        for name in ("time", "exit_speed", "plane_work", "dissipation"):
            field = getattr(m, name)
            np.testing.assert_allclose(field, field[2], rtol=2e-8)
            np.testing.assert_allclose(field[1:4], field[2], rtol=3e-12)


class TestAnyDesign:
    @settings(max_examples=400, deadline=None)
    @given(design())
    @example((0.4, 0.5, 0.4, 0.25, 0.125, 4.0, -20.0, 0.0))
    def test_sound(self, row):
        u1, v_p, _, c, r, wx0, wy0, wz0 = row
        m = solve(*row)
        assert 0.0 <= m.reached <= 1.0
        assert (m.reached < 1.0) == np.isinf(m.time) == (m.exit_speed == 0.0)
        assert not any(np.isnan(f).any() for k, f in fields_of(m) if "slip" not in k)
        assert np.isnan(m.slip_end) or 0.0 <= m.slip_end <= 1.0
        start = energy(c, np.array([wx0, wy0, wz0]), r)
        change = energy(m.exit_speed, m.exit_spin, r) - start
        ledger = u1 * m.reached + m.plane_work - m.dissipation
        np.testing.assert_allclose(change, ledger, rtol=0, atol=1e-12)

    @settings(max_examples=50, deadline=None)
    @given(design())
    def test_against_the_integrator(self, row):
        m, other = solve(*row), integrate(*row)
        # At an exit almost at rest the time hangs on the last digits of the speed.
        assume(not any(0 <= s.exit_speed < 1e-3 and s.time < np.inf for s in (m, other)))
        for name in ("time", "exit_speed", "plane_work", "dissipation", "reached"):
            np.testing.assert_allclose(
                getattr(m, name), getattr(other, name), rtol=1e-10, atol=1e-9, err_msg=name
            )

    def test_a_sphere_whose_backspin_uses_up_its_speed_stops(self):
        # It would roll with (5 c + 2 r ω_y) / 7 = 0.
        m = solve(0.0, 0.0, 1.0, 0.25, 0.125, 0.0, -5.0, 0.0)
        assert m.time == np.inf
        assert m.reached == pytest.approx(0.25**2 / 2)  # decelerated by μ = 1 all the way

    def test_company_changes_no_bit(self):
        """A design has the same motion in whatever batch, in whatever place."""
        box = wide(1500, seed=7)
        box[:, 2:] = [0.4, 0.3193, 0.1, 0, 0, 0]
        box[:, 0], box[:, 1] = box[:, 0] % 1.4, 0.1 + np.abs(box[:, 1]) % 5.9
        rows = np.vstack([box, wide(1500, seed=8)])
        whole, rng = solve(*rows.T), np.random.default_rng(0)
        for size in (1, 2, 3, 7, 64, 500, 2999):
            chosen = rng.permutation(len(rows))[:size]
            for name, field in fields_of(solve(*rows[chosen].T)):
                np.testing.assert_array_equal(field, getattr(whole, name)[chosen], err_msg=name)


class TestShapes:
    def test_broadcasting(self):
        m = solve(np.linspace(0, 1, 3)[:, None], np.array([0.5, 1.0, 2.0, 3.0]), 0.4, 0.3193, 0.1)
        assert m.time.shape == (3, 4)
        assert m.exit_spin.shape == (3, 4, 3)
        one = solve(0.5, 2.0, 0.4, 0.3193, 0.1)
        assert one.time.shape == ()
        np.testing.assert_allclose(m.time[1, 2], one.time, rtol=1e-14)

    def test_empty(self):
        m = solve(np.empty((0, 2)), 1.0, 0.4, 0.3193, 0.1)
        assert isinstance(m, Motion)
        assert m.time.shape == (0, 2)
        assert m.exit_spin.shape == (0, 2, 3)

    def test_chunks_do_not_show(self, monkeypatch):
        rows = wide(3000, seed=4)
        whole = solve(*rows.T)
        monkeypatch.setattr(_motion, "_CHUNK", 257)
        for name, field in fields_of(solve(*rows.T)):
            np.testing.assert_array_equal(field, getattr(whole, name))


class TestStall:
    def test_strong_backspin(self):
        m = solve([0.0, 0.02, 0.1], [0.1, 1.0, 3.0], 0.4, 0.3, 0.125, [0, 5, -8], [-20, -15, -20])
        assert np.all(np.isinf(m.time))
        assert np.all(m.exit_speed == 0.0)
        assert np.all((m.reached > 0.0) & (m.reached < 1.0))
        assert np.all(np.isnan(m.slip_end))

    def test_slows_down_and_recovers(self):
        m = solve(0.1, 0.3, 0.4, 0.3, 0.125, 0.0, -5.0)
        path = trajectory(0.1, 0.3, 0.4, 0.3, 0.125, 0.0, -5.0, eta=np.linspace(0, 1, 101))
        assert m.reached == 1.0
        assert path.speed.min() < 0.2 < 0.3 < m.exit_speed

    def test_no_slope_no_speed_left(self):
        # A = c + 0.4 r w = 0: the sphere comes to rest as it stops slipping
        m = solve(0.0, 0.5, 0.4, 0.25, 0.125, 4.0, -5.0)
        assert np.isinf(m.time)
        np.testing.assert_allclose(m.reached, 0.25**2 / 0.8, rtol=1e-9)


class TestTrajectory:
    eta = np.linspace(0.0, 1.0, 41)

    @pytest.mark.parametrize("row", wide(12, seed=9).tolist())
    def test_against_solve_and_forces(self, row):
        u1, v_p, mu, _, r, wx0, wy0, _ = row
        m, path = solve(*row), trajectory(*row, eta=self.eta)
        np.testing.assert_allclose(path.spin[0, :2], [wx0, wy0], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(
            path.slip_velocity[:, 1], r * path.spin[:, 0] - v_p, rtol=0, atol=1e-12
        )
        if m.reached == 1.0:
            np.testing.assert_allclose(path.time[-1], m.time, rtol=1e-12)
            np.testing.assert_allclose(path.spin[-1], m.exit_spin, rtol=1e-11, atol=1e-11)
        else:
            assert path.eta[-1] == self.eta[self.eta <= m.reached][-1]
        assert np.isfinite(path.time).all()
        assert (np.diff(path.time)[np.diff(path.eta) > 0] > 0.0).all()
        size = np.hypot(*path.friction.T) / path.normal[:, 0]
        assert np.all(size <= mu * (1.0 + 1e-14))  # Coulomb's law, Eq. (2.10)
        np.testing.assert_allclose(size[path.slipping], mu, rtol=1e-13)
        np.testing.assert_array_equal(path.normal[:, 1], np.abs(path.friction[:, 1]))

    def test_newtons_law(self):
        """dv_C/dt = sin α + f_AX and r dω/dt = 2.5 (f_AY, −f_AX), by differences in η."""
        r, h = 0.1, 1e-5
        for eta in (0.2, 0.9):
            path = trajectory(0.3, 1.0, 0.4, 0.3193, r, eta=np.array([eta - h, eta, eta + h]))
            dt = path.time[2] - path.time[0]
            push = 0.3 / np.hypot(1.0, 0.3) + path.friction[1, 0]
            np.testing.assert_allclose((path.speed[2] - path.speed[0]) / dt, push, rtol=1e-7)
            turn = r * (path.spin[2] - path.spin[0]) / dt
            f_x, f_y = path.friction[1]
            np.testing.assert_allclose(turn, [2.5 * f_y, -2.5 * f_x, 0], rtol=1e-7, atol=1e-7)

    def test_the_transition_stands_twice(self):
        path = chute.trajectory(0.2635, 0.1072, ChuteParameters(0.4), n=51)
        twice = np.flatnonzero(path.eta == path.slip_end)
        assert len(path.eta) == 53
        assert path.slipping[twice].tolist() == [True, False]
        assert path.slipping.tolist() == sorted(path.slipping, reverse=True)
        np.testing.assert_array_equal(path.time[twice], path.slip_time)
        np.testing.assert_array_equal(path.slip_velocity[twice], 0)
        np.testing.assert_array_equal(path.slip_velocity[~path.slipping], 0)
        # τ = 0.2635 / 0.4 < 1: slip dies out in the direction cos θ = τ, against the plane
        b, tau = 0.4 / np.hypot(1, 0.2635), 0.2635 / 0.4
        np.testing.assert_allclose(
            path.friction[twice[0]], [-b * tau, b * np.sqrt(1 - tau**2)], rtol=1e-12
        )
        np.testing.assert_allclose(
            path.friction[twice[1]], [-2 / 7 * 0.2635 / np.hypot(1, 0.2635), 0]
        )

    @pytest.mark.parametrize("tau", [0.65, 1.0, 1.5])
    def test_the_direction_tends_to_the_limit_at_the_end(self, tau):
        whole = chute.trajectory(0.4 * tau, 0.3, ChuteParameters(0.4))
        eta = whole.slip_end * (1 - np.array([1e-3, 1e-6, 1e-9, 1e-12]))
        path = chute.trajectory(0.4 * tau, 0.3, ChuteParameters(0.4), eta=eta)
        assert path.eta[4] == path.slip_end
        gap = np.abs(path.friction[:5] - path.friction[4]).max(axis=1)
        assert (np.diff(gap) < 0).all()

    def test_no_transition(self):
        slips = chute.trajectory(0.3, 5.0, ChuteParameters(0.2), n=11)
        assert np.isnan(slips.slip_end)
        assert slips.slipping.all()
        rolls = chute.trajectory(0.3, 0.5, parameters(0.4, 0.5, 0.125, 4.0, 4.0), n=11)
        assert (rolls.slip_end, rolls.slipping.any()) == (0, False)
        np.testing.assert_allclose(rolls.friction, [[-2 / 7 * 0.3 / np.hypot(1, 0.3), 0]] * 11)

    def test_a_stall_ends_it(self):
        p = parameters(0.4, 0.3, 0.125, 0.0, -20.0)
        path = chute.trajectory(0.0, 0.1, p, n=21)
        np.testing.assert_allclose(path.eta[-1], chute.motion(0.0, 0.1, p).reached)
        np.testing.assert_allclose(path.speed[-1], 0, atol=1e-6)
        assert np.isfinite(path.time).all()

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"n": 1}, "n must be an integer >= 2, got 1"),
            ({"eta": [0.5, 0.2]}, "eta must be one-dimensional, rising and within"),
            ({"eta": [0.0, 1.2]}, "eta must be one-dimensional, rising and within"),
            ({"eta": [0.0, np.nan]}, "eta must be finite, got nan at index 1"),
        ],
    )
    def test_bad_points(self, options, message):
        with pytest.raises(PsiError, match=message):
            chute.trajectory(0.3, 1.0, ChuteParameters(0.4), **options)

    def test_one_design_only(self):
        with pytest.raises(PsiError, match="must be numbers, for one design, got"):
            chute.trajectory([0.3, 0.4], 1.0, ChuteParameters(0.4))


def test_the_reference_can_be_made_again(reference, monkeypatch):
    """A few of its cases, computed anew with mpmath."""
    monkeypatch.syspath_prepend(str(HERE))
    import motion_30_digits

    cases = json.loads((HERE / "motion_30_digits.json").read_text())["cases"]
    for case in cases[::40]:
        again = motion_30_digits.reference(*(float.fromhex(q) for q in case["inputs"]))
        for name in FIELDS:
            assert motion_30_digits.as_text(again[name]) == case[name], name
