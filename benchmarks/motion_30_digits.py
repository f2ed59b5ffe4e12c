"""Thirty-digit reference of the sphere's motion, by Taylor series in log time.

Independent of the NumPy kernel: no closed form, no first integral, no linear invariant, no
quadrature. The equations of motion (2.17) are integrated as they stand, in the log time s with
dt = (rho / b) ds, in which every right-hand side is a polynomial of the unknowns:

    c'   = (1 - c^2)(tau - c)              c = cos(theta), direction of the slip
    rho' = rho (tau c - 2.5 - c^2)         speed of the slip
    y'   = -2.5 y                          y = |v_y|, from dv_y/dt = -2.5 b sin(theta)
    v'   = rho (tau - c)                   speed of the centre, from dv_C/dt = a - b cos(theta)
    t'   = rho / b,   x' = v rho / b,   D' = rho^2

so that the Taylor coefficients follow from Cauchy products. 40 digits are carried and steps are
taken with 40 terms such that the first term left out is below 1e-36 of its unknown. Slip is over
when rho < 1e-36. Rolling and straight sliding are the constant accelerations of Eq. (2.20).

Write the data of ``tests/chute/reference`` again by ``python -m benchmarks.motion_30_digits``, in a
checkout; it takes some minutes.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
from mpmath import mp, mpf

mp.dps = 42
ORDER = 40
TINY = mpf(10) ** -36
NAMES = ("c", "rho", "y", "v", "t", "x", "D")


def _taylor(state: dict, tau, b) -> dict:
    """Taylor coefficients in s of every unknown, from their values at s = 0."""
    k = {name: [mpf(state[name])] for name in NAMES}
    cc, ccc, g, vr, rc, rr = [], [], [], [], [], []

    def conv(p, q, n):
        return mp.fdot((p[i], q[n - i]) for i in range(n + 1))

    for n in range(ORDER):
        c, rho, v = k["c"], k["rho"], k["v"]
        cc.append(conv(c, c, n))
        ccc.append(conv(cc, c, n))
        one = mpf(1 if n == 0 else 0)
        g.append(tau * c[n] - one * mpf("2.5") - cc[n])
        vr.append(conv(v, rho, n))
        rc.append(conv(rho, c, n))
        rr.append(conv(rho, rho, n))
        dc = tau * one - c[n] - tau * cc[n] + ccc[n]
        rates = {
            "c": dc,
            "rho": conv(rho, g, n),
            "y": -mpf("2.5") * k["y"][n],
            "v": tau * rho[n] - rc[n],
            "t": rho[n] / b,
            "x": vr[n] / b,
            "D": rr[n],
        }
        for name in NAMES:
            k[name].append(rates[name] / (n + 1))
    return k


def _at(coefficients, s):
    value = mpf(0)
    for coefficient in reversed(coefficients):  # Horner
        value = value * s + coefficient
    return value


def _root(coefficients, target, high):
    """The s in [0, high] where the series, monotone there, equals target."""
    low, f_low = mpf(0), coefficients[0] - target
    for _ in range(40):
        mid = (low + high) / 2
        if (_at(coefficients, mid) - target > 0) == (f_low > 0):
            low = mid
        else:
            high = mid
    s = (low + high) / 2
    slope = [n * q for n, q in enumerate(coefficients)][1:]
    for _ in range(6):
        d = _at(slope, s)
        if d == 0:
            break
        s -= (_at(coefficients, s) - target) / d
    return s


def reference(u1, v_p, mu, c, r, wx0, wy0, wz0) -> dict:
    """All result fields of one design as mpf numbers; the inputs are taken as exact doubles."""
    u1, v_p, mu, c, r, wx0, wy0, wz0 = (mpf(q) for q in (u1, v_p, mu, c, r, wx0, wy0, wz0))
    X = mp.sqrt(1 + u1 * u1)
    a, b, tau = u1 / X, mu / X, u1 / mu
    vx, vy = c - r * wy0, r * wx0 - v_p
    sign = -1 if vy < 0 else 1
    rho = mp.sqrt(vx * vx + vy * vy)
    s = {"c": vx / rho if rho else mpf(1), "rho": rho, "y": abs(vy), "v": c}
    s.update(t=mpf(0), x=mpf(0), D=mpf(0))
    can_roll = u1 * 2 <= 7 * mu
    ended = ""
    while not ended and s["rho"] >= TINY:
        k = _taylor(s, tau, b)
        size = max(abs(k[n][-1]) / (abs(k[n][0]) + (1 if n in "ct" else 0) + TINY) for n in NAMES)
        step = min(mpf(2), (mpf(10) ** -38 / (size + mpf(10) ** -60)) ** (mpf(1) / ORDER))
        v_new, x_new = _at(k["v"], step), _at(k["x"], step)
        # v is monotone while the sphere slips: x turns only where v = 0
        if v_new <= 0:
            at = _root(k["v"], mpf(0), step)
            ended, step = "stall", at
            x_new = _at(k["x"], at)
        if x_new >= X:
            ended, step = "exit", _root(k["x"], X, step)
        s = {n: _at(k[n], step) for n in NAMES}
    slip_end = slip_time = None
    vx, vy = s["rho"] * s["c"], sign * s["y"]
    if not ended:
        vx = vy = mpf(0)
        acceleration = a / mpf("1.4") if can_roll else a - b
        if can_roll:
            slip_end, slip_time = s["x"] / X, s["t"]
        v1, rest = s["v"], X - s["x"]
        v2 = mp.sqrt(v1 * v1 + 2 * acceleration * rest)
        if v2 == 0:
            ended = "stall"
        else:
            ended, dt = "exit", 2 * rest / (v1 + v2)
            if not can_roll:  # straight slide from rho = 0: theta = 0
                vx = (a - mpf("3.5") * b) * dt
                s["D"] += b * vx * dt / 2
            s["t"] += dt
            s["v"], s["x"] = v2, X
    if ended == "stall":
        s["v"] = mpf(0)
    return {
        "time": s["t"] if ended == "exit" else mp.inf,
        "exit_speed": s["v"],
        "slip_end": slip_end,
        "slip_time": slip_time,
        "exit_spin": [(vy + v_p) / r, (s["v"] - vx) / r, wz0],
        "plane_work": mpf("0.4") * v_p * (vy + v_p - r * wx0),
        "dissipation": s["D"],
        "reached": mpf(1) if ended == "exit" else s["x"] / X,
    }


def _bisect_u(f, low, high):
    """The double where f changes sign, to the last bit (neighbours differ in sign)."""
    positive = f(low) > 0
    while True:
        mid = 0.5 * (low + high)
        if mid in (low, high):
            return low, high
        if (f(mid) > 0) == positive:
            low = mid
        else:
            high = mid


def designs() -> list[tuple[str, tuple[float, ...]]]:
    """Every case of the data file: its set's name and its eight inputs (exact doubles)."""
    box: list[tuple[str, tuple[float, ...]]] = []
    rng = np.random.default_rng(20120632)
    std = (0.3193, 0.1, 0.0, 0.0, 0.0)
    for mu in (0.2, 0.4, 0.6):
        for _ in range(8):
            box.append(("box", (rng.uniform(0, 3.5 * mu), rng.uniform(0.1, 6.0), mu, *std)))
        for u1 in (0.0, 3.5 * mu):
            for v_p in (0.1, 6.0):
                box.append(("bounds", (u1, v_p, mu, *std)))
    for tau in (1.0, 3.5, *(1 + s * e for e in (1e-6, 1e-9, 1e-13) for s in (1, -1))):
        for v_p in (0.3, 3.0):
            box.append(("tau", (0.4 * tau, v_p, 0.4, *std)))
    for v_p in (0.2, 2.0):  # the slip direction is steady: tau = cos(theta0)
        cosine = 0.3193 / math.hypot(0.3193, v_p)
        for factor in (1.0, 1 + 1e-11, 1 - 1e-11):
            box.append(("steady", (0.4 * cosine * factor, v_p, 0.4, *std)))
    for tau in (3.5 - 1e-9, 3.5 + 1e-9, 3.6, 5.0, 9.0, 40.0):
        box.append(("steep", (0.4 * tau, 1.0, 0.4, *std)))
        box.append(("steep", (0.1 * tau, 0.02, 0.1, 0.02, 0.05, 0.1, -0.3, 2.0)))
    for u1, mu in ((0.3, 0.4), (0.1, 0.3)):  # slip ends at the exit: v_p to the last bit
        d = lambda v: _exit_excess(u1, v, mu)  # noqa: B023, E731 - used at once
        low, high = _bisect_u(d, 0.1, 6.0)
        for k in (low, high, low * (1 - 1e-13), high * (1 + 1e-13), high * (1 + 1e-9)):
            box.append(("slip end at exit", (u1, k, mu, *std)))
    for wy in (-20.0, 20.0, -3.0, 3.0):  # one-dimensional slip, both directions, v_y = 0 exactly
        for u1 in (0.0, 0.2, 0.9, 2.0):
            box.append(("one-dimensional", (u1, 0.5, 0.4, 0.6, 0.125, 4.0, wy, 1.0)))
    for u1 in (0.3, 1.4, 3.0):  # no slip at the start
        box.append(("no slip", (u1, 0.5, 0.4, 0.5, 0.125, 4.0, 4.0, -1.0)))
    for u1, v_p, wx, wy in (  # strong backspin: stall, and v_C falling without reaching zero
        (0.0, 0.1, 0.0, -20.0),
        (0.02, 1.0, 5.0, -15.0),
        (0.1, 3.0, -8.0, -20.0),
        (0.3, 0.1, 0.0, -20.0),
        (0.05, 0.1, 0.0, -7.0),
        (0.1, 0.3, 0.0, -6.0),
        (0.0, 0.5, 4.0, -12.0),
    ):
        box.append(("backspin", (u1, v_p, 0.4, 0.3, 0.125, wx, wy, 0.5)))
    for y in (1e-3, 1e-9, 1e-14):  # almost straight: theta near pi, and near 0
        for wy in (12.0, -12.0):
            for u1 in (0.1, 0.9, 1.8):
                box.append(("nearly straight", (u1, 0.5 + y, 0.4, 0.6, 0.125, 4.0, wy, 0.0)))
    for _ in range(30):
        mu = math.exp(rng.uniform(math.log(0.05), math.log(2.0)))
        box.append(
            (
                "wide",
                (
                    rng.uniform(0, 4.5 * mu),
                    rng.uniform(-6, 6),
                    mu,
                    rng.uniform(0.02, 3.0),
                    rng.uniform(0.01, 0.5),
                    *rng.uniform(-20, 20, 3),
                ),
            )
        )
    return [(name, tuple(float(q) for q in row)) for name, row in box]


def _exit_excess(u1, v_p, mu) -> float:
    """Negative where slip ends before the exit."""
    return -1.0 if reference(u1, v_p, mu, 0.3193, 0.1, 0, 0, 0)["slip_end"] is not None else 1.0


def as_text(value):
    if value is None:
        return "nan"
    if isinstance(value, list):
        return [as_text(q) for q in value]
    return mp.nstr(value, 30)


def main(path: str = "tests/chute/reference/motion_30_digits.json") -> int:
    cases = []
    for name, row in designs():
        values = {key: as_text(value) for key, value in reference(*row).items()}
        cases.append({"set": name, "inputs": [q.hex() for q in row], **values})
        print(name, row, values["time"], values["slip_end"], file=sys.stderr, flush=True)
    Path(path).write_text(
        json.dumps(
            {
                "about": "30-digit motion; made by benchmarks/motion_30_digits.py; inputs are "
                "float.hex() of u1, v_p, mu, c, r, wx0, wy0, wz0",
                "cases": cases,
            },
            indent=1,
        )
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main(*sys.argv[1:]))
