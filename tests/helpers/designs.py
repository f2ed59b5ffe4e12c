"""Designs of the chute as rows: u1, v_P, μ, c, r, ω_X0, ω_Y0, ω_Z0 (the last three may lack)."""

import numpy as np
from hypothesis import strategies as st

from pymoo_psi import chute
from pymoo_psi.chute import ChuteParameters


def parameters(mu, c, r, wx0=0.0, wy0=0.0, wz0=0.0):
    return ChuteParameters(mu, c, r, (wx0, wy0, wz0))


def solve(u1, v_p, *rest):
    return chute.motion(u1, v_p, parameters(*rest))


def trajectory(u1, v_p, *rest, n):
    return chute.trajectory(u1, v_p, parameters(*rest), n=n)


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


@st.composite
def design(draw):
    """One design of the wide ranges or at their corners."""
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
