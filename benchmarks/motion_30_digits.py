"""Thirty-digit reference of the sphere's motion, by Taylor series in log time.

It is independent of the NumPy kernel: there is no closed form, first integral, linear invariant or
quadrature. The equations of motion (2.17) are integrated directly, in the log time s with
dt = (rho / b) ds, in which every right-hand side is a polynomial of the unknowns:

    c'   = (1 - c^2)(tau - c)              c = cos(theta), direction of the slip
    rho' = rho (tau c - 2.5 - c^2)         speed of the slip
    y'   = -2.5 y                          y = |v_y|, from dv_y/dt = -2.5 b sin(theta)
    v'   = rho (tau - c)                   speed of the centre, from dv_C/dt = a - b cos(theta)
    t'   = rho / b,   x' = v rho / b,   D' = rho^2

So the Taylor coefficients follow from Cauchy products. The computation has 42 digits; steps have
40 terms and such a length that the first omitted term is below 1e-36 of its unknown. Slip ends at
rho < 1e-36. Rolling and straight sliding are the constant accelerations of Eq. (2.20).

To write the data of ``tests/chute/reference``, run ``python -m benchmarks.motion_30_digits`` in a
checkout; this takes a few minutes.
"""

from __future__ import annotations

import itertools
import json
import math
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from mpmath import mp, mpf

from benchmarks.machine import output, sized

mp.dps = 42

ORDER = 40
TINY = mpf(10) ** -36
NAMES = ("c", "rho", "y", "v", "t", "x", "D")
# Inputs of the paper: c, r and the spin, after u1, v_p and mu.
STANDARD = (0.3193, 0.1, 0.0, 0.0, 0.0)
OUTPUT = str(output(Path("tests/chute/reference/motion_30_digits.json")))
ABOUT = (
    "30-digit motion; made by benchmarks/motion_30_digits.py; inputs are "
    "float.hex() of u1, v_p, mu, c, r, wx0, wy0, wz0"
)


def _cauchy(p: list, q: list, n: int):
    """Return the coefficient n of the product of two series."""
    return mp.fdot((p[i], q[n - i]) for i in range(n + 1))


def _taylor(state: dict, tau, b) -> dict:
    """Return the Taylor coefficients in s of every unknown, from the values at s = 0."""
    k = {name: [mpf(state[name])] for name in NAMES}
    c = k["c"]
    rho = k["rho"]
    v = k["v"]
    c_c = []  # the coefficients of the products
    c_c_c = []
    bracket = []  # tau c - 2.5 - c^2
    v_rho = []
    rho_c = []
    rho_rho = []
    for n in range(ORDER):
        one = mpf(0)
        if n == 0:
            one = mpf(1)
        c_c.append(_cauchy(c, c, n))
        c_c_c.append(_cauchy(c_c, c, n))
        bracket.append(tau * c[n] - one * mpf("2.5") - c_c[n])
        v_rho.append(_cauchy(v, rho, n))
        rho_c.append(_cauchy(rho, c, n))
        rho_rho.append(_cauchy(rho, rho, n))
        rates = {
            "c": tau * one - c[n] - tau * c_c[n] + c_c_c[n],
            "rho": _cauchy(rho, bracket, n),
            "y": -mpf("2.5") * k["y"][n],
            "v": tau * rho[n] - rho_c[n],
            "t": rho[n] / b,
            "x": v_rho[n] / b,
            "D": rho_rho[n],
        }
        for name in NAMES:
            k[name].append(rates[name] / (n + 1))
    return k


def _at(coefficients, s):
    """Return the value of a series, by Horner's method."""
    value = mpf(0)
    for coefficient in reversed(coefficients):
        value = value * s + coefficient
    return value


def _root(coefficients, target, high):
    """Return the s in [0, high] where the series, which is monotone there, equals target."""
    low = mpf(0)
    is_above = coefficients[0] - target > 0
    for _ in range(40):
        mid = (low + high) / 2
        if (_at(coefficients, mid) - target > 0) == is_above:
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


def _step(k: dict):
    """Return the length of a step, from the last coefficients."""
    size = mpf(0)
    for name in NAMES:
        scale = abs(k[name][0])
        if name in "ct":
            scale += 1
        size = max(size, abs(k[name][-1]) / (scale + TINY))
    return min(mpf(2), (mpf(10) ** -38 / (size + mpf(10) ** -60)) ** (mpf(1) / ORDER))


def _slip(state: dict, tau, b, length) -> tuple[dict, str]:
    """Return the state at the end of slip, and ``"exit"`` or ``"stall"`` if the motion ends there.

    Args:
        state: The unknowns at the start.
        tau: The slope divided by the friction.
        b: The deceleration by friction.
        length: The length of the way.
    """
    while state["rho"] >= TINY:
        ended = ""
        k = _taylor(state, tau, b)
        step = _step(k)
        x = _at(k["x"], step)
        # v is monotone while the sphere slips: x turns only where v = 0
        if _at(k["v"], step) <= 0:
            ended = "stall"
            step = _root(k["v"], mpf(0), step)
            x = _at(k["x"], step)
        if x >= length:
            ended = "exit"
            step = _root(k["x"], length, step)
        state = {name: _at(k[name], step) for name in NAMES}
        if ended:
            return state, ended
    return state, ""


def reference(u1, v_p, mu, c, r, wx0, wy0, wz0) -> dict:
    """Return all result fields of one design as mpf numbers; the inputs are exact doubles."""
    u1, v_p, mu, c, r, wx0, wy0, wz0 = (mpf(q) for q in (u1, v_p, mu, c, r, wx0, wy0, wz0))
    length = mp.sqrt(1 + u1 * u1)
    a = u1 / length
    b = mu / length
    tau = u1 / mu
    vx = c - r * wy0
    vy = r * wx0 - v_p
    sign = 1
    if vy < 0:
        sign = -1
    rho = mp.sqrt(vx * vx + vy * vy)
    cosine = mpf(1)
    if rho:
        cosine = vx / rho
    start = {"c": cosine, "rho": rho, "y": abs(vy), "v": c, "t": mpf(0), "x": mpf(0), "D": mpf(0)}
    s, ended = _slip(start, tau, b, length)
    slip_end = None
    slip_time = None
    vx = s["rho"] * s["c"]
    vy = sign * s["y"]
    if not ended:
        vx = mpf(0)
        vy = mpf(0)
        rolls = u1 * 2 <= 7 * mu
        acceleration = a - b
        if rolls:
            acceleration = a / mpf("1.4")
            slip_end = s["x"] / length
            slip_time = s["t"]
        v1 = s["v"]
        rest = length - s["x"]
        v2 = mp.sqrt(v1 * v1 + 2 * acceleration * rest)
        ended = "stall"
        if v2 != 0:
            ended = "exit"
            dt = 2 * rest / (v1 + v2)
            if not rolls:  # a straight slide from rho = 0: theta = 0
                vx = (a - mpf("3.5") * b) * dt
                s["D"] += b * vx * dt / 2
            s["t"] += dt
            s["v"] = v2
            s["x"] = length
    time = s["t"]
    reached = mpf(1)
    if ended == "stall":
        s["v"] = mpf(0)
        time = mp.inf
        reached = s["x"] / length
    return {
        "time": time,
        "exit_speed": s["v"],
        "slip_end": slip_end,
        "slip_time": slip_time,
        "exit_spin": [(vy + v_p) / r, (s["v"] - vx) / r, wz0],
        "plane_work": mpf("0.4") * v_p * (vy + v_p - r * wx0),
        "dissipation": s["D"],
        "reached": reached,
    }


def _bisect_u(f, low, high):
    """Return the neighbouring doubles between which f changes sign."""
    positive = f(low) > 0
    while True:
        mid = 0.5 * (low + high)
        if mid in (low, high):
            return low, high
        if (f(mid) > 0) == positive:
            low = mid
        else:
            high = mid


Case = tuple[str, tuple[float, ...]]  # the name of its set, and its eight inputs


def designs() -> list[Case]:
    """Return all cases of the data file; the inputs are exact doubles."""
    rng = np.random.default_rng(20120632)
    cases = itertools.chain(
        _within_bounds(rng),
        _special_slopes(),
        _slip_end_at_exit(),
        _along_one_line(),
        _backspin(),
        _nearly_straight(),
        _wide(rng),
    )
    some = itertools.islice(cases, sized(None, 2))
    return [(name, tuple(float(q) for q in inputs)) for name, inputs in some]


def _within_bounds(rng: np.random.Generator) -> Iterator[Case]:
    """Yield designs within the default bounds, and at their corners."""
    for mu in (0.2, 0.4, 0.6):
        for _ in range(8):
            yield "box", (rng.uniform(0, 3.5 * mu), rng.uniform(0.1, 6.0), mu, *STANDARD)
        for u1 in (0.0, 3.5 * mu):
            for v_p in (0.1, 6.0):
                yield "bounds", (u1, v_p, mu, *STANDARD)


def _special_slopes() -> Iterator[Case]:
    """Yield slopes near tau = 1 and 3.5, those of a steady slip, and steep ones."""
    slopes = [1.0, 3.5]
    for epsilon in (1e-6, 1e-9, 1e-13):
        slopes += [1 + epsilon, 1 - epsilon]
    for tau in slopes:
        for v_p in (0.3, 3.0):
            yield "tau", (0.4 * tau, v_p, 0.4, *STANDARD)
    for v_p in (0.2, 2.0):  # the slip direction is steady: tau = cos(theta0)
        cosine = 0.3193 / math.hypot(0.3193, v_p)
        for factor in (1.0, 1 + 1e-11, 1 - 1e-11):
            yield "steady", (0.4 * cosine * factor, v_p, 0.4, *STANDARD)
    for tau in (3.5 - 1e-9, 3.5 + 1e-9, 3.6, 5.0, 9.0, 40.0):
        yield "steep", (0.4 * tau, 1.0, 0.4, *STANDARD)
        yield "steep", (0.1 * tau, 0.02, 0.1, 0.02, 0.05, 0.1, -0.3, 2.0)


def _slip_end_at_exit() -> Iterator[Case]:
    """Yield designs whose slip ends at the exit, with v_p to the last bit."""
    for u1, mu in ((0.3, 0.4), (0.1, 0.3)):
        low, high = _bisect_u(partial(_exit_excess, u1, mu), 0.1, 6.0)
        for v_p in (low, high, low * (1 - 1e-13), high * (1 + 1e-13), high * (1 + 1e-9)):
            yield "slip end at exit", (u1, v_p, mu, *STANDARD)


def _exit_excess(u1, mu, v_p) -> float:
    """Return a negative number if slip ends before the exit, else a positive one."""
    if reference(u1, v_p, mu, 0.3193, 0.1, 0, 0, 0)["slip_end"] is None:
        return 1.0
    return -1.0


def _along_one_line() -> Iterator[Case]:
    """Yield one-dimensional slip in both directions, with v_y = 0 exactly, and no slip."""
    for wy in (-20.0, 20.0, -3.0, 3.0):
        for u1 in (0.0, 0.2, 0.9, 2.0):
            yield "one-dimensional", (u1, 0.5, 0.4, 0.6, 0.125, 4.0, wy, 1.0)
    for u1 in (0.3, 1.4, 3.0):
        yield "no slip", (u1, 0.5, 0.4, 0.5, 0.125, 4.0, 4.0, -1.0)


def _backspin() -> Iterator[Case]:
    """Yield strong backspin: the sphere stalls, or slows down without stopping."""
    for u1, v_p, wx, wy in (
        (0.0, 0.1, 0.0, -20.0),
        (0.02, 1.0, 5.0, -15.0),
        (0.1, 3.0, -8.0, -20.0),
        (0.3, 0.1, 0.0, -20.0),
        (0.05, 0.1, 0.0, -7.0),
        (0.1, 0.3, 0.0, -6.0),
        (0.0, 0.5, 4.0, -12.0),
    ):
        yield "backspin", (u1, v_p, 0.4, 0.3, 0.125, wx, wy, 0.5)


def _nearly_straight() -> Iterator[Case]:
    """Yield slip that is almost straight: theta near pi, and near 0."""
    for y in (1e-3, 1e-9, 1e-14):
        for wy in (12.0, -12.0):
            for u1 in (0.1, 0.9, 1.8):
                yield "nearly straight", (u1, 0.5 + y, 0.4, 0.6, 0.125, 4.0, wy, 0.0)


def _wide(rng: np.random.Generator) -> Iterator[Case]:
    """Yield random designs in wide ranges."""
    for _ in range(30):
        mu = math.exp(rng.uniform(math.log(0.05), math.log(2.0)))
        u1 = rng.uniform(0, 4.5 * mu)
        v_p = rng.uniform(-6, 6)
        c = rng.uniform(0.02, 3.0)
        r = rng.uniform(0.01, 0.5)
        yield "wide", (u1, v_p, mu, c, r, *rng.uniform(-20, 20, 3))


def as_text(value):
    """Return a result with 30 digits, ``"nan"`` for None."""
    if value is None:
        return "nan"
    if isinstance(value, list):
        return [as_text(q) for q in value]
    return mp.nstr(value, 30)


def main(path: str = OUTPUT) -> None:
    """Write the data file."""
    cases = []
    for name, inputs in designs():
        case = {"set": name, "inputs": [q.hex() for q in inputs]}
        for key, value in reference(*inputs).items():
            case[key] = as_text(value)
        cases.append(case)
        print(name, inputs, case["time"], case["slip_end"], file=sys.stderr, flush=True)
    text = json.dumps({"about": ABOUT, "cases": cases}, indent=1)
    Path(path).write_text(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
