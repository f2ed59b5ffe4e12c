"""The mechanics: closed form against integration, energy balance, symmetry, stalls, errors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from pymoo_psi import PsiError, SphereChute, VectorizedSphereChute, lp_tau
from pymoo_psi.chute import ChuteParameters, criteria, integrate, motion

slopes = st.floats(0, 2)
speeds = st.floats(0.1, 6)
parameters = st.builds(
    ChuteParameters,
    mu=st.floats(0.05, 2),
    c=st.floats(0.02, 3),
    r=st.floats(0.02, 0.5),
    omega0=st.tuples(*[st.floats(-20, 20)] * 3),
)


def energy(m, p):
    """ΔE = ½{w(1) − w(0) + i[ω(1)² − ω(0)²]}, the braces of Eq. (3.2), with i = 0.4 r²."""
    spin0 = sum(w**2 for w in p.omega0)
    return 0.5 * (m.exit_speed**2 - p.c**2 + 0.4 * p.r**2 * ((m.exit_spin**2).sum(-1) - spin0))


@given(u1=slopes, v_p=speeds, p=parameters)
def test_rolling_closed_form_is_the_integral_of_its_equations(u1, v_p, p):
    """Eq. (2.20) from η = 0, with dω_Y/dη in its consistent form, by solve_ivp."""

    def field(eta, y):
        sin, length = u1 / np.hypot(1, u1), np.hypot(1, u1)
        return [
            length / np.sqrt(y[1]),
            2 * length * sin / 1.4,
            length / np.sqrt(y[1]) * sin / (1.4 * p.r),
        ]

    start = [0.0, p.c**2, p.omega0[1]]
    t, w, spin = solve_ivp(field, (0, 1), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    m = motion(u1, v_p, p, model="rolling")
    np.testing.assert_allclose(m.time, t, rtol=1e-8)
    np.testing.assert_allclose(m.exit_speed, np.sqrt(w), rtol=1e-9)
    np.testing.assert_allclose(m.exit_spin, [p.omega0[0], spin, p.omega0[2]], rtol=1e-8, atol=1e-8)
    assert (m.reached, m.slip_end) == (1, 0)


@pytest.mark.parametrize("model", ["rolling", "full"])
@given(u1=slopes, v_p=speeds, p=parameters)
@settings(max_examples=60)
def test_energy_balance(model, u1, v_p, p):
    """ΔE = u1 + W − D, so that f2 = |ΔE − u1| of Eq. (3.2) is |W − D|; friction only takes."""
    m = motion(u1, v_p, p, model=model)
    if m.reached == 1:
        scale = 1 + v_p**2 + p.c**2 + sum((p.r * w) ** 2 for w in p.omega0)
        assert abs(energy(m, p) - (u1 + m.plane_work - m.dissipation)) < 1e-9 * scale
        assert abs(criteria(m)[1] - abs(energy(m, p) - u1)) < 1e-9 * scale
    if model == "full":
        assert m.dissipation >= 0


def test_rolling_without_spin_has_the_stated_balance():
    """f2 = (2/7) u1 − 0.2 (v1 − c)² for ω(0) = 0."""
    u1 = np.linspace(0, 2, 50)
    m = motion(u1, 1.0, ChuteParameters(c=0.3193), model="rolling")
    np.testing.assert_allclose(
        criteria(m)[:, 1], 2 / 7 * u1 - 0.2 * (m.exit_speed - 0.3193) ** 2, atol=1e-15
    )


@given(u1=slopes, v_p=speeds, p=parameters)
@settings(max_examples=30)
def test_mirror_symmetry(u1, v_p, p):
    """Looking from the other side turns v_P and ω_X round and changes nothing else."""
    mirrored = ChuteParameters(p.mu, p.c, p.r, (-p.omega0[0], *p.omega0[1:]))
    ours, theirs = motion(u1, v_p, p), motion(u1, -v_p, mirrored)
    np.testing.assert_allclose(ours.time, theirs.time, rtol=1e-12)
    np.testing.assert_allclose(ours.exit_spin * [-1, 1, 1], theirs.exit_spin, rtol=1e-12)
    np.testing.assert_allclose(ours.dissipation, theirs.dissipation, rtol=1e-12)


def test_a_sphere_that_rolls_from_the_start_rolls_in_both_models():
    """With r ω_X = v_P and r ω_Y = c there is no slip, and the models are one."""
    p = ChuteParameters(mu=0.4, c=0.5, r=0.1, omega0=(20.0, 5.0, 1.0))
    full, rolling = (motion([0.1, 0.7, 1.3], 2.0, p, model=m) for m in ("full", "rolling"))
    np.testing.assert_allclose(criteria(full), criteria(rolling), rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(full.exit_spin, rolling.exit_spin, rtol=1e-13)
    assert full.slip_end.tolist() == [0, 0, 0]


def test_level_chute_without_plane_speed():
    """u1 = 0, v_P = r ω_X: slip along x only, until v_C = (5/7) c + (2/7) r ω_Y0."""
    p = ChuteParameters(mu=0.5, c=1.0)
    m = motion(0.0, 0.0, p)
    slip_time = (1 - 5 / 7) / 0.5  # v_C falls at the rate μ
    np.testing.assert_allclose(m.slip_time, slip_time, rtol=1e-11)
    np.testing.assert_allclose(m.exit_speed, 5 / 7, rtol=1e-11)
    slip_way = (1 - (5 / 7) ** 2) / (2 * 0.5)
    np.testing.assert_allclose(m.time, slip_time + (1 - slip_way) / (5 / 7), rtol=1e-11)


def test_too_steep_to_roll():
    """tan α > 3.5 μ: without slip at the start the sphere slides straight down, v' = a − b."""
    p = ChuteParameters(mu=0.1, c=0.3, r=0.1, omega0=(10.0, 3.0, 0.0))
    u1 = 0.5
    m = motion(u1, 1.0, p)
    acceleration = (u1 - 0.1) / np.hypot(1, u1)
    np.testing.assert_allclose(
        m.exit_speed, np.sqrt(0.09 + 2 * acceleration * np.hypot(1, u1)), rtol=1e-11
    )
    assert np.isnan(m.slip_end)


def test_stall():
    """Strong backspin on a level, rough chute stops the centre; nothing is NaN, nothing raises."""
    p = ChuteParameters(mu=1.0, c=0.1, r=0.1, omega0=(0.0, -20.0, 0.0))
    m = motion([0.0, 0.1], [0.1, 0.2], p)
    assert (m.reached < 1).all()
    assert (m.exit_speed == 0).all()
    f = criteria(m)
    assert np.isinf(f[:, :2]).all()
    np.testing.assert_array_equal(f[:, 2:], [[0.0, 0.1], [0.1, 0.2]])
    problem = SphereChute(1.0, c=0.1, omega0=(0, -20, 0))
    F, G = problem.evaluate(np.array([[0.0, 0.1], [3.0, 0.1]]))
    assert G[0, 0] > 0
    assert not np.isnan(F).any()


def test_example_of_the_full_model():
    """The design of Table 6.1 for μ = 0.4 under the full model, as integrated independently."""
    m = integrate(0.2635, 0.1072, ChuteParameters(mu=0.4))
    np.testing.assert_allclose(criteria(m), [2.3214, 0.0159, 0.2635, 0.1072], atol=5e-5)
    assert abs(m.slip_end - 0.0922) < 5e-5


def test_shapes_broadcast():
    p = ChuteParameters(mu=np.array([0.2, 0.4]), omega0=(0, np.zeros((3, 1)), 0))
    m = motion(0.3, 1.0, p, model="rolling")
    assert m.time.shape == (3, 2)
    assert m.exit_spin.shape == (3, 2, 3)
    assert criteria(m).shape == (3, 2, 4)
    empty = motion(np.zeros(0), 1.0, p.__class__())
    assert criteria(empty).shape == (0, 4)


@pytest.mark.parametrize("model", ["rolling", "full"])
def test_both_problems_give_the_same_values(model):
    X = lp_tau(20, 2, first=3) * [1.4, 5.9] + [0, 0.1]
    options = {"model": model, "c": 0.4, "omega0": (1.0, -2.0, 3.0)}
    F, G = VectorizedSphereChute(0.4, **options).evaluate(X)
    F1, G1 = SphereChute(0.4, **options).evaluate(X)
    np.testing.assert_allclose(F1, F, rtol=1e-13)
    np.testing.assert_allclose(G1, G, atol=1e-13)


def test_problem_defaults_are_the_papers():
    problem = SphereChute(0.4)
    np.testing.assert_allclose(problem.xl, [0, 0.1])
    np.testing.assert_allclose(problem.xu, [1.4, 6])
    assert (problem.n_var, problem.n_obj, problem.n_ieq_constr) == (2, 4, 1)


@pytest.mark.parametrize("make", [SphereChute, VectorizedSphereChute])
@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"mu": 0}, ValueError, "mu must be a positive number, got 0.0"),
        ({"mu": "0.2"}, TypeError, "mu must be a finite number, got '0.2'"),
        ({"mu": np.nan}, ValueError, "mu must be a finite number, got nan"),
        ({"c": -0.3}, ValueError, "c must be a positive number, got -0.3"),
        ({"r": np.inf}, ValueError, "r must be a finite number, got inf"),
        ({"omega0": (0, np.nan, 0)}, ValueError, "omega0 must be finite, got nan at index 1"),
        ({"omega0": (0, 0)}, ValueError, r"omega0 must be 3 numbers, got \(0, 0\)"),
        (
            {"model": "ful"},
            ValueError,
            "model must be one of 'full', 'rolling', got 'ful'; did you mean 'full'",
        ),
        ({"model": None}, TypeError, "model must be one of 'full', 'rolling', got None"),
        (
            {"lower": (1, 0.1)},
            ValueError,
            r"lower must be at most upper .* lower=\[1.0, 0.1\], upper=",
        ),
        ({"lower": (-0.1, 0.1)}, ValueError, "lower must be >= 0, got"),
        ({"upper": (1, 2, 3)}, ValueError, "upper must be 2 numbers"),
        ({"omega": (0, 0, 0)}, TypeError, "unknown keyword argument 'omega'"),
        ({"elementwise_runer": 1}, TypeError, "did you mean 'elementwise_runner'"),
    ],
)
def test_bad_problem_arguments(make, options, kind, message):
    with pytest.raises(kind, match=message) as caught:
        make(**options)
    assert isinstance(caught.value, PsiError)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([-0.1], [1.0]), "u1 must be tan α >= 0, got -0.1"),
        (([np.nan], [1.0]), "u1 must be finite, got nan at index 0"),
        (([0.1, 0.2], [1.0, 2.0, 3.0]), "must be of shapes that broadcast together"),
        ((0.1, 1.0, 0.4), "parameters must be ChuteParameters, got 0.4"),
        ((["a"], 1.0), "u1 must be an array of real numbers"),
    ],
)
def test_bad_motion_arguments(arguments, message):
    for function in (motion, integrate):
        with pytest.raises(PsiError, match=message):
            function(*arguments)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"mu": [0.2, -1.0]}, "mu must be positive, got -1.0"),
        ({"c": np.nan}, "c must be finite, got nan"),
        ({"omega0": 3}, "omega0 must be three initial spins"),
        ({"omega0": (1, 2)}, "omega0 must be three initial spins"),
        ({"omega0": (1, np.inf, 2)}, r"omega0\[1\] must be finite, got inf"),
    ],
)
def test_bad_parameters(options, message):
    with pytest.raises(ValueError, match=message):
        ChuteParameters(**options)


def test_parameters_cannot_be_changed():
    spins = np.zeros(3)
    p = ChuteParameters(mu=np.array([0.2, 0.3]), omega0=(spins, 0, 0))
    spins[0] = 7
    assert p.omega0[0].tolist() == [0, 0, 0]
    with pytest.raises(ValueError, match="read-only"):
        p.mu[0] = 1
