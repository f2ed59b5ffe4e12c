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
from numpy.polynomial import Legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]

TINY = 1e-200  # added where 0/0 has a limit, as in log1p(w)/w
BLOCK = 16384  # doubles per temporary array of nodes x designs: stays in the cache


class Rule(NamedTuple):
    """Gauss-Lobatto quadrature of a step of log time.

    Attributes:
        nodes: (m, 1) fractions of the step after 0, which costs nothing; the last one is 1.
        weights: (m,) their weights.
        first: the weight of 0.
        reach: longest step, in units of `distance`, that is exact to about 1e-14.
    """

    nodes: Array
    weights: Array
    first: float
    reach: float


def _rule(m: int, power: int, reach: float) -> Rule:
    """Gauss-Lobatto in zeta, lambda = length zeta**power; power 2 crowds the step's beginning."""
    p = Legendre.basis(m)
    roots = p.deriv().roots().real  # all are real; NumPy 2.5 gives them a complex type
    x = np.array([-1.0, *roots, 1.0])
    zeta, weight = 0.5 * (x + 1.0), 1.0 / (m * (m + 1) * p(x) ** 2)
    weight *= power * zeta ** (power - 1)
    return Rule(zeta[1:, None] ** power, weight[1:], float(weight[0]), reach)


# An m-point rule errs like B**(-2m), B the sum of the half-axes of the ellipse around the step that
# passes through the nearest singularity. The reaches are measured: time and distance err by less
# than 2e-13 of their scales rho/b and rho**2/b over tau in [0, 4.5], theta in [0, 1.8].
RULES = (
    _rule(4, 1, 0.06),
    _rule(7, 1, 0.38),
    _rule(10, 1, 0.95),
    _rule(16, 1, 2.7),
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
    u = np.expm1(rule.nodes * (-slope * length))
    u *= -q * tau1 / slope
    u += 1.0  # 1 + z
    log = np.log(u)
    s = 0.5 * (length + log[-1] / tau1)
    # shape = G/(1 + z)^2, so that rho ~ (1+z)(1+q) shape (1+z) needs no division
    log *= -1.5 - 1.25 / tau1
    log += rule.nodes * (length * (0.5 * slope - 1.25))
    shape = np.exp(log, out=log)
    shift = 0.5 * (q * tau1 + slope)
    plus = u + shift  # (1 + z)(1 + q) (1 + tau)/2
    vx1 = u * tau
    vx1 -= shift  # (1 + z)(1 - q) (1 + tau)/2
    vx1 *= shape
    vx1 *= u  # v_x, apart from rho0/(1 + q0)
    plus *= plus
    plus *= shape  # dt/dlambda, apart from rho0/(1 + q0)/(2 b)
    plus *= rule.weights[:, None]
    scale = rho / (1.0 + shift)
    unit = scale * length / (tau1 * b)
    first = rule.first * (1.0 + shift) ** 2
    dt = (_sum(plus) + first) * unit
    plus *= vx1
    slid = (_sum(plus) + first * (tau - shift)) * (unit * scale)
    return dt, slid, vx1[-1] * scale, y * np.exp(-2.5 * s)


def _sum(rows: Array) -> Array:
    """Return the (n,) sums of the columns of (m, n) values, added up row after row.

    So the sum of a column does not depend on the columns beside it, as it does in a matrix
    product: a design has the same motion, to the last bit, in whatever batch. A column alone
    would be added up in pairs, therefore it gets company.
    """
    alone = rows.shape[1] == 1
    sums: Array = np.add.reduce(np.repeat(rows, 2, axis=1) if alone else rows, axis=0)
    return sums[:1] if alone else sums
