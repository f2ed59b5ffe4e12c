"""Slip in log time: the closed form of the slip velocity and the two quadratures that remain.

While the sphere slips, the velocity of its contact point (v_x, v_y) = rho (cos theta, sin theta)
obeys dv_x/dt = a - 3.5 b cos theta, dv_y/dt = -2.5 b sin theta (Eqs. 2.17-2.18 in time), with
a = sin alpha, b = mu cos alpha, tau = a/b. The field depends on the direction alone. With
q = tan^2(theta/2) and the log time dlambda = (1 + cos theta)(b/rho) dt, the direction is logistic,

    dq/dlambda = -q ((tau - 1) + (tau + 1) q),

and with E = (1 - exp(-(tau-1) lambda))/(tau - 1), z = q0 (1 + tau) E everything is closed:

    q   = q0 exp(-(tau-1) lambda)/(1 + z)
    rho = rho0 (1 + q)/(1 + q0) G,  G = exp(((tau-1)/2 - 1.25) lambda) (1 + z)^(1/2 - 1.25/(1+tau))
    v_y = v_y0 exp(-2.5 s),         s = lambda/2 + log(1 + z)/(2 (1 + tau))
    dt  = rho (1 + q)/(2 b) dlambda

All terms of z are positive, so nothing cancels; tau = 1 is a regular point of E. Only t and the
integral of v_x are left to quadrature: the centre follows from the invariant
1.4 v_C = A + a t + 0.4 v_x, A = c + 0.4 r omega_Y0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

Array = NDArray[np.float64]

TINY = 1e-200  # added where 0/0 has a limit, as in log1p(w)/w
BLOCK = 32768  # doubles per temporary array of nodes x designs: stays in the cache


class Rule(NamedTuple):
    """Gauss-Legendre quadrature of a step of log time; the step's end is the last node.

    Attributes:
        nodes: (m + 1, 1) fractions of the step; the last one is 1.
        weights: (m + 1,) weights; the last one is 0.
        reach: longest step, in units of `distance`, that is exact to about 1e-14.
    """

    nodes: Array
    weights: Array
    reach: float


def _rule(m: int, power: int, reach: float) -> Rule:
    """Gauss-Legendre in zeta, lambda = length zeta**power; power 2 crowds the step's beginning."""
    zeta, weight = leggauss(m)
    zeta, weight = 0.5 * (zeta + 1.0), 0.5 * weight
    nodes = np.append(zeta**power, 1.0)[:, None]
    return Rule(nodes, np.append(weight * power * zeta ** (power - 1), 0.0), reach)


# An m-point rule errs like B**(-2m), B the sum of the half-axes of the ellipse around the step that
# passes through the nearest singularity. The reaches are measured: time and distance err by less
# than 2e-13 of their scales rho/b and rho**2/b over tau in [0, 4.5], theta in [0, 1.8].
RULES = (
    _rule(4, 1, 0.07),
    _rule(8, 1, 0.6),
    _rule(12, 1, 1.5),
    _rule(20, 1, 4.5),
    _rule(32, 2, 60.0),
)
LONGEST = 14.0  # no step beyond this many times 1/|tau - 1|


def distance(tau: Array, q: Array) -> Array:
    """Log time over which the motion changes its shape: the unit of a rule's reach.

    Backwards the direction reaches theta = pi, a singularity, after log(1 + z)/|tau-1| or more,
    z = |tau-1|/((1+tau) q); complex singularities lie pi/|tau-1| off the axis (0.83 instead of pi,
    so that one reach serves both); and rho decays over a log time of order 1.
    """
    slope = np.abs(tau - 1.0) + TINY
    room = np.log1p(slope / ((1.0 + tau) * q))
    np.minimum(room, 0.83, out=room)
    room /= slope
    return np.minimum(room, 2.0, out=room)


def advance(
    vx: Array, y: Array, rho: Array, q: Array, b: Array, tau: Array, length: Array, rule: Rule
) -> tuple[Array, Array, Array, Array]:
    """Follow the slip over a step of log time.

    Args:
        vx: (n,) v_x at the step's beginning.
        y: (n,) |v_y| there.
        rho: (n,) speed of the contact point there.
        q: (n,) tan^2(theta/2) there.
        b: (n,) mu cos alpha.
        tau: (n,) u1/mu.
        length: (n,) the step, may be negative.
        rule: the quadrature.

    Returns:
        (n,) arrays: time taken, integral of v_x dt, v_x and |v_y| at the step's end.
    """
    n, width = vx.size, BLOCK // len(rule.weights)
    if n > width:
        cuts = [slice(i, i + width) for i in range(0, n, width)]
        parts = [advance(vx[k], y[k], rho[k], q[k], b[k], tau[k], length[k], rule) for k in cuts]
        dt, slid, vx_end, y_end = (np.concatenate(g) for g in zip(*parts, strict=True))
        return dt, slid, vx_end, y_end
    slope, tau1 = tau - 1.0 + TINY, tau + 1.0
    kappa = q * tau1 / slope
    e = np.expm1(rule.nodes * (-slope * length))
    z = e * -kappa
    log = np.log1p(z)
    s = 0.5 * (length + log[-1] / tau1)
    # shape = G/(1 + z)^2, so that rho ~ (1+z)(1+q) shape (1+z) needs no division
    log *= -1.5 - 1.25 / tau1
    log += rule.nodes * (length * (0.5 * slope - 1.25))
    shape = np.exp(log, out=log)
    z += 1.0
    plus = e * (q - kappa)
    plus += 1.0 + q  # (1 + z)(1 + q)
    e *= -(q + kappa)
    e += 1.0 - q  # (1 + z)(1 - q)
    e *= shape
    e *= z  # v_x, apart from rho0/(1 + q0)
    plus *= plus
    plus *= shape  # dt/dlambda, apart from rho0/(1 + q0)/(2 b)
    scale = rho / (1.0 + q)
    unit = 0.5 * scale * length / b
    dt = (rule.weights @ plus) * unit
    vx_end = e[-1] * scale
    plus *= e
    slid = (rule.weights @ plus) * (unit * scale)
    return dt, slid, vx_end, y * np.exp(-2.5 * s)
