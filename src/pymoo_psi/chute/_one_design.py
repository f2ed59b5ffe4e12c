"""One design in plain Python: what `exact` does to thousands at once, without call overhead.

The same steps by the same rules, so that the values agree with the batch to rounding; it costs some
40 microseconds where NumPy calls on arrays of one element would cost ten times that. It is also the
readable version: every line here has its array counterpart in `exact`, `follow` or `slip`.
"""

from __future__ import annotations

from math import copysign, exp, expm1, inf, log, log1p, nan, sqrt

from pymoo_psi.chute._follow import FINE, GRIP, PASSES, ROLLS, SLIPS, STALLS, STRAIGHT
from pymoo_psi.chute._slip import LONGEST, RULES, TINY

# (node, weight) pairs, from the step's beginning to its end
_PAIRS = [
    (
        list(
            zip(
                [0.0, *rule.nodes[:, 0].tolist()], [rule.first, *rule.weights.tolist()], strict=True
            )
        ),
        rule.reach,
    )
    for rule in RULES
]


def solve_one(
    u1: float,
    v_p: float,
    mu: float,
    c: float,
    r: float,
    wx0: float = 0.0,
    wy0: float = 0.0,
    wz0: float = 0.0,
) -> tuple[float, float, float, float, tuple[float, float, float], float, float, float]:
    """The fields of `Motion` as plain numbers; arguments as in `exact.slip_then_roll`."""
    length = sqrt(1.0 + u1 * u1)
    a, b, tau = u1 / length, mu / length, u1 / mu
    invariant, vx0, vy0 = c + 0.4 * r * wy0, c - r * wy0, r * wx0 - v_p
    t, vx, y, h, how = _follow_slip(b, tau, invariant, length, vx0, abs(vy0), c)
    v = max((invariant + a * t + 0.4 * vx) / 1.4, 0.0)
    slip_end = slip_time = nan
    if how == ROLLS:  # Eq. (2.20), or for tau > 3.5 a straight slide
        steep = tau > 3.5
        if not steep:
            slip_end, slip_time = (length - h) / length, t
        h = max(h, 0.0)
        v_end = sqrt(v * v + 2.0 * (a - b if steep else a / 1.4) * h)
        dt = 2.0 * h / (v + v_end + TINY)
        if steep:
            vx = (a - 3.5 * b) * dt
        t, v = t + dt, v_end
    reached = 1.0
    if how == STALLS or (how == ROLLS and v == 0.0 < h):
        t, v, reached = inf, 0.0, min(max(1.0 - h / length, 0.0), 1.0 - 1e-16)
    vy = copysign(y, vy0)
    turned, spun, wy0 = vy - vy0, v - vx, r * wy0
    lost = a * length * reached - 0.5 * (v - c) * (v + c)
    lost -= 0.2 * ((spun - wy0) * (spun + wy0) + turned * (vy + vy0))
    spin = ((vy + v_p) / r, spun / r, wz0)
    return t, v, slip_end, slip_time, spin, 0.4 * v_p * turned, lost, reached


def _follow_slip(
    b: float, tau: float, invariant: float, length: float, vx: float, y: float, v: float
) -> tuple[float, float, float, float, int]:
    """Follow the slip of one sphere; see `follow.follow_slip` for the result."""
    t, h, cap = 0.0, length, inf
    for _ in range(PASSES):
        rho = sqrt(vx * vx + y * y)
        if rho <= GRIP * b and h >= 0.0:
            return t, 0.0, 0.0, h, ROLLS
        dt, ds, w, c_x, c_v, stops = _aim(vx, y, rho, h, v, b, tau)
        straight = y < STRAIGHT * rho and (vx > 0.0 or y < 1e-17 * rho)
        if straight or abs(ds) * (1.0 + tau) < FINE or abs(dt) < 1e-15 or abs(h) < 1e-15:
            grips = straight and w <= -1.0
            if grips:
                dt /= -w
            h -= dt * (v + 0.5 * dt * b * (tau - c_x))
            if grips:
                return t + dt, 0.0, 0.0, h, ROLLS
            vx += dt * b * (tau - 3.5 * c_v)
            return t + dt, vx, y * exp(-2.5 * ds), h, STALLS if stops else SLIPS
        q = ((rho - vx) / y) ** 2
        slope = abs(tau - 1.0) + TINY
        decay = 2.5 / (1.0 + tau) if tau < 1.0 else max(1.75 - 0.5 * tau, 1e-3)
        if w <= -1.0:
            step = log(2.0 / GRIP * rho / b) / decay
        else:
            bend = min(2.0 * (tau - vx / rho) * ds + TINY, 600.0)
            step = 2.0 * ds / (1.0 + q * bend / expm1(bend))
        room = min(min(log1p(slope / ((1.0 + tau) * q)) if q else inf, 0.83) / slope, 2.0)
        step = min(step, cap, RULES[-1].reach * room, LONGEST / slope)
        pairs = next((p for p, reach in _PAIRS[:-1] if abs(step) <= reach * room), _PAIRS[-1][0])
        spent, slid, vx1, y1 = _advance(vx, y, rho, q, b, tau, step, pairs)
        push = invariant + b * tau * t
        v1 = (push + b * tau * spent + 0.4 * vx1) / 1.4
        h1 = h - ((push + 0.5 * b * tau * spent) * spent + 0.4 * slid) / 1.4
        if h1 < (0.0 if w <= -1.0 else -0.05 * abs(h)) or v1 < -0.05 * v:
            share = 0.5 if v1 < 0.0 else h / (h - h1)
            cap = min(-log1p(share * expm1(-decay * step)) / decay, 0.9 * step)
        else:
            t, vx, y, h, v, cap = t + spent, vx1, y1, h1, v1, inf
    return t, vx, y, h, ROLLS


def _aim(
    vx: float, y: float, rho: float, h: float, v: float, b: float, tau: float
) -> tuple[float, float, float, float, float, bool]:
    """As `follow._aim`."""
    rate = b / rho

    def reach(c_x: float, c_v: float) -> tuple[float, float, float, bool]:
        push = b * (tau - c_x)
        root = v * v + 2.0 * push * h
        stops = root < 0.0
        dt = v / -push if stops else 2.0 * h / (v + sqrt(root) + TINY)
        return dt, rate * dt, ((tau - c_v) * c_v - 2.5) * rate * dt, stops

    c = vx / rho
    _, z, w, _ = reach(c, c)
    turn = (y / rho) ** 2 * (tau - c) * z / (1.0 + 0.5 * max(w, -1.0))
    limit = abs(min(tau, 1.0) - c)
    turn = max(min(turn, limit), -limit)
    c_x, c_v = c + turn / 3.0, c + 0.5 * turn
    dt, z, w, stops = reach(c_x, c_v)
    w += TINY
    return dt, log1p(max(w, -1.0 + 1e-16)) / w * z, w, c_x, c_v, stops


def _advance(
    vx: float,
    y: float,
    rho: float,
    q: float,
    b: float,
    tau: float,
    length: float,
    pairs: list[tuple[float, float]],
) -> tuple[float, float, float, float]:
    """As `slip.advance`."""
    slope, tau1 = tau - 1.0 + TINY, tau + 1.0
    kappa = q * tau1 / slope
    scale = rho / (1.0 + q)
    power, rate = 0.5 - 1.25 / tau1, (0.5 * slope - 1.25) * length
    fade = -slope * length

    time = slid = vx_end = z = 0.0
    for node, weight in pairs:
        e = expm1(node * fade)
        z = -kappa * e
        ratio = q * (1.0 + e) / (1.0 + z)
        g = exp(node * rate + power * log1p(z))
        part = weight * g * (1.0 + ratio) ** 2
        vx_end = g * (1.0 - ratio)
        time += part
        slid += part * vx_end
    s = 0.5 * (length + log1p(z) / tau1)
    unit = 0.5 * scale * length / b
    return time * unit, slid * unit * scale, scale * vx_end, y * exp(-2.5 * s)
