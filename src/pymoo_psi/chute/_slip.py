"""Slip: the path in closed form, and how far along it the sphere slips.

While the sphere slips, the velocity of its contact point (v_x, v_y) = ρ (cos θ, sin θ) obeys
dv_x/dt = a − 3.5 b cos θ, dv_y/dt = −2.5 b sin θ (Eqs. 2.17–2.18 in time), with a = sin α,
b = μ cos α, τ = a/b. The right-hand sides depend on the direction alone. With q = tan²(θ/2) and the
log time dλ = (1 + cos θ)(b/ρ) dt the direction is logistic,

    dq/dλ = −q ((τ − 1) + (τ + 1) q),                                                           (1)

and with E = (1 − exp(−(τ−1) λ))/(τ − 1), z = q0 (1 + τ) E all of it is closed:

    q   = q0 exp(−(τ−1) λ)/(1 + z)                                                              (2)
    ρ   = ρ0 (1 + q)/(1 + q0) G,  G = exp(((τ−1)/2 − 1.25) λ) (1 + z)^(1/2 − 1.25/(1+τ))        (3)
    v_y = v_y0 exp(−2.5 s),       s = λ/2 + log(1 + z)/(2 (1 + τ)),  ds = (b/ρ) dt              (4)
    dt  = ρ (1 + q)/(2 b) dλ                                                                    (5)

Every term of z is positive, so nothing cancels; τ = 1 is a regular point of E. Only t and ∫ v_x dt
are left to quadrature: the centre follows from 1.4 v_C = A + a t + 0.4 v_x, where
A = c + 0.4 r ω_Y0 does not change (`invariant` below).

How far the sphere slips is found by aiming with constant accelerations, stepping along the path,
and aiming again: two steps as a rule. While the sphere slips v_C is monotone, because cos θ − τ
keeps its sign; so the exit, the end of slip and a stall are simple roots, and a step that went too
far shows and is taken again, half as long.

Every formula is elementwise, for (n,) arrays and for Python's floats alike, with the functions of a
namespace: NumPy, or `NUMBERS` for one design, which costs a quarter of what it costs as arrays of
length 1. Both give the same bits, as what they do themselves is correctly rounded, and exponentials
and logarithms are NumPy's in either.
"""

from __future__ import annotations

from bisect import bisect_left
from math import copysign, sqrt
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import NDArray

from pymoo_psi.errors import PsiError

Array = NDArray[np.float64]

ROLLS, SLIPS, STALLS = 0, 1, 2  # how slip ends; ROLLS is ρ = 0, whatever follows
TINY = 1e-200  # added where 0/0 has a limit, as in log1p(w)/w
# Slip that is none, in units of b: rounding of v_P − r ω_X where a sphere is to roll from the
# start. What is left of such a slip takes less time than that.
NONE = 1e-14
# An aim with a smaller `_error` is the last. As a speed that is far below rounding; but next to
# θ = π the error is that of sin²θ, while what counts is sin θ to the power 1.45 and more: the
# share of ρ that is left when the direction turns, (3.5 + τ)/(1 + τ) for τ <= 4.5.
EXACT = 1e-18
# Longest step, in units of 1/`_rate`. Measured over τ in [0, 4.5] and all θ: the quadratures of
# dt and v_x dt then err by 5e-14 of their scales ρ/b and ρ²/b; at 16 it is 5e-12.
REACH = 12.0
NUMBERS = SimpleNamespace(
    minimum=min,
    maximum=max,
    sqrt=sqrt,
    copysign=copysign,
    where=lambda condition, yes, no: yes if condition else no,
    searchsorted=bisect_left,
    exp=lambda x: float(np.exp(x)),
    expm1=lambda x: float(np.expm1(x)),
    log1p=lambda x: float(np.log1p(x)),
)
BLOCK = 1024  # designs in one quadrature: its arrays, 24 nodes each at most, stay in the cache
STEPS = 200  # never reached: two are usual, some 20 from next to θ = π


def _quadrature(m: int) -> tuple[Array, Array]:
    """Gauss–Lobatto in the root of λ/step, which crowds the nodes where the step begins.

    Returns:
        (m,) shares of the step, the last one 1, and their weights. Share 0 has weight 0.
    """
    p = Legendre.basis(m)
    roots = p.deriv().roots().real  # all are real; NumPy 2.5 gives them a complex type
    x = np.array([*roots, 1.0])
    root = 0.5 * (x + 1.0)
    return root**2, 2.0 * root / (m * (m + 1) * p(x) ** 2)


# Of each quadrature the longest step, in units of 1/`_rate`, and its nodes. Measured as REACH, and
# with the same error: 3e-14, 6e-14, 3e-14 and 5e-14. Half of all steps need ten nodes or fewer.
LONGEST, QUADRATURES = (0.05, 0.5, 3.0), tuple(map(_quadrature, (6, 10, 16, 24)))
# A step back comes nearer to the singularity: it counts so many times.
BACK = 8.0


class Slip(NamedTuple):
    """A slipping sphere; every entry is an (n,) array or a float.

    Attributes:
        t: time so far.
        vx: v_x, of the contact point.
        y: |v_y|.
        left: distance to go; negative a little past the exit.
        v: speed v_C of the centre.
        b: μ cos α.
        tau: u1/μ.
        invariant: c + 0.4 r ω_Y0.
        longest: no step beyond it: half the last one if that went too far, else infinite.
    """

    t: Any
    vx: Any
    y: Any
    left: Any
    v: Any
    b: Any
    tau: Any
    invariant: Any
    longest: Any


class Aim(NamedTuple):
    """Where the slip leads in constant acceleration; every entry is an (n,) array or a float.

    Attributes:
        rho: speed of the contact point now.
        dt: time to the exit, to rest or to the end of slip, whichever comes first.
        ds: log time s to there.
        w: relative change of ρ until the exit or rest; <= -1 where slip ends before that.
        turn: change of cos θ on the way there.
        stops: whether the sphere comes to rest before the exit.
    """

    rho: Any
    dt: Any
    ds: Any
    w: Any
    turn: Any
    stops: Any


def follow_slip(
    m: Any, b: Any, tau: Any, invariant: Any, way: Any, vx: Any, y: Any, c: Any
) -> tuple[Any, Any, Any, Any, Any]:
    """Follow the slip to the exit, to its end or to rest.

    Args:
        m: NumPy for arrays, `NUMBERS` for floats.
        b: (n,) array or float, μ cos α; so are all others.
        tau: u1/μ.
        invariant: c + 0.4 r ω_Y0.
        way: distance to the exit.
        vx: v_x at the start.
        y: |v_y| at the start.
        c: v_C at the start.

    Returns:
        t, v_x, |v_y|, distance to go, and how slip ended: ROLLS, SLIPS (on, past the exit) or
        STALLS.
    """
    slip = Slip(0.0 * b, vx, y, way, c, b, tau, invariant, np.inf + b)
    if m is NUMBERS:
        for _ in range(STEPS):
            aim = _aim(m, slip)
            if _error(m, aim) < EXACT:
                return _finish(m, slip, aim)
            slip = _next(m, slip, aim)
        raise _endless(slip)
    end, ids = np.empty((5, b.size)), np.arange(b.size)
    for _ in range(STEPS):
        aim = _aim(m, slip)
        exact = _error(m, aim) < EXACT
        if exact.any():
            j = np.flatnonzero(exact)
            end[:, ids[j]] = _finish(m, _of(slip, j), _of(aim, j))
            j = np.flatnonzero(~exact)
            ids, slip, aim = ids[j], _of(slip, j), _of(aim, j)
        if not ids.size:
            return end[0], end[1], end[2], end[3], end[4]
        slip = _next(m, slip, aim)
    raise _endless(slip)


def _of(entries: Any, chosen: NDArray[np.intp]) -> Any:
    """Return the Slip or Aim of the chosen designs."""
    return type(entries)(*(entry[chosen] for entry in entries))


def _endless(slip: Slip) -> PsiError:
    """Return the error for a slip that does not end."""
    n, tau = np.size(slip.t), np.ravel(slip.tau)[0]
    return PsiError(f"the slip of {n} designs, one with tau = {tau:.17g}, does not end; report it")


def _aim(m: Any, slip: Slip) -> Aim:
    """Aim with the direction at its mean over the way ahead, exact to third order in ds.

    Constant direction means constant acceleration of the centre and constant decay of ρ. It
    turns by d cos θ/ds = sin²θ (τ − cos θ), over the way ahead a third of it counts for the
    position and half of it for the velocities.
    """
    _, vx, y, left, v, b, tau, _, _ = slip
    rho = m.sqrt(vx * vx + y * y) + TINY
    rate, c, sine = b / rho, vx / rho, y / rho

    def reach(c_x: Any, c_v: Any) -> tuple[Any, Any, Any]:
        """Time to the exit or to rest, relative change w of ρ until then, and whether to rest."""
        push = b * (tau - c_x)  # dv_C/dt
        root = v * v + 2.0 * push * left
        stops = root < 0.0
        dt = m.where(stops, -v / (push + TINY), 2.0 * left / (v + m.sqrt(abs(root)) + TINY))
        return dt, ((tau - c_v) * c_v - 2.5) * rate * dt + TINY, stops

    dt, w, _ = reach(c, c)
    turn = sine * sine * (tau - c) * rate * dt / (1.0 + 0.5 * m.maximum(w, -1.0))
    limit = abs(m.minimum(tau, 1.0) - c)  # to the direction in which the slip ends
    turn = m.maximum(m.minimum(turn, limit), -limit)  # far from the exit the order does not hold
    dt, w, stops = reach(c + turn / 3.0, c + turn / 2.0)
    w = m.where(rho > NONE * b, w, -np.inf)
    held = m.maximum(w, -1.0 + 1e-16)  # ρ = 0 is at w = -1, ds infinite: let it be 37
    dt = dt * (held / w)
    return Aim(rho, dt, m.log1p(held) / held * rate * dt, w, turn, stops)


def _error(m: Any, aim: Aim) -> Any:
    """Error of an aim, as a speed: third order in ds (`turn` is first), times ρ at its largest."""
    ahead = m.minimum(abs(aim.ds), 1.0)
    return abs(aim.turn) * ahead * ahead * aim.rho * m.maximum(1.0 + aim.w, 1.0)


def _finish(m: Any, slip: Slip, aim: Aim) -> tuple[Any, Any, Any, Any, Any]:
    """Take the last, tiny or straight, piece of slip as it was aimed; see `follow_slip`."""
    t, vx, y, left, v, b, tau, _, _ = slip
    c, slips = vx / aim.rho, aim.w > -1.0
    return (
        t + aim.dt,
        slips * (vx + aim.dt * b * (tau - 3.5 * (c + aim.turn / 2.0))),
        slips * (y * m.exp(-2.5 * aim.ds)),
        left - aim.dt * (v + 0.5 * aim.dt * b * (tau - c - aim.turn / 3.0)),
        slips * (SLIPS + (STALLS - SLIPS) * aim.stops),  # ROLLS is 0
    )


def _rate(tau: Any, q: Any) -> Any:
    """Rate per log time λ at which the motion changes its shape: what limits a quadrature.

    Backwards the direction reaches θ = π, a singularity, after λ = 1/((1+τ) q) or more; complex
    ones lie π/|τ−1| off the axis; and ρ decays over λ of order 1. With the factors 1.2 and 0.5 one
    REACH serves all three.
    """
    return (1.0 + tau) * q + 1.2 * abs(tau - 1.0) + 0.5


def _next(m: Any, slip: Slip, aim: Aim) -> Slip:
    """Step along the path as far as aimed, or stay where that led too far."""
    t, vx, y, left, v, b, tau, invariant, longest = slip
    q = (aim.rho - vx) / y
    q = q * q
    # λ(s), exact to second order and for θ near π, from dλ = (1 + cos θ) ds = 2 ds/(1 + q)
    bend = 2.0 * (tau - vx / aim.rho) * aim.ds + TINY
    step = m.minimum(2.0 * aim.ds / (1.0 + q * bend / m.expm1(bend)), longest)
    step = m.minimum(step, REACH / _rate(tau, q))  # back past the exit steps are short
    dt, slid, vx1, y1 = _along(m, vx, y, aim.rho, q, b, tau, step)
    a = b * tau
    v1 = (invariant + a * (t + dt) + 0.4 * vx1) / 1.4
    left1 = left - ((invariant + a * (t + 0.5 * dt)) * dt + 0.4 * slid) / 1.4
    # Five per cent past the exit or past rest is harmless, the next step goes back; not so on the
    # way to the end of slip: from ρ = 0 there is no way back.
    fits = (left1 >= -0.05 * abs(left) * (aim.w > -1.0)) & (v1 >= -0.05 * v)
    moved = (t + dt, vx1, y1, left1, v1, np.inf + t)
    stays = (t, vx, y, left, v, 0.5 * step)
    t, vx, y, left, v, longest = (m.where(fits, *pair) for pair in zip(moved, stays, strict=True))
    return Slip(t, vx, y, left, v, b, tau, invariant, longest)


def _along(
    m: Any, vx: Any, y: Any, rho: Any, q: Any, b: Any, tau: Any, step: Any
) -> tuple[Any, Any, Any, Any]:
    """Follow the slip over a step of log time λ, Eqs. (2) to (5).

    Args:
        m: NumPy for arrays, `NUMBERS` for floats.
        vx: (n,) array or float, v_x at the step's beginning; so are all others.
        y: |v_y| there.
        rho: speed of the contact point there.
        q: tan²(θ/2) there.
        b: μ cos α.
        tau: u1/μ.
        step: the step, may be negative.

    Returns:
        Time taken, integral of v_x dt, v_x and |v_y| at the step's end.
    """
    reach = step * _rate(tau, q)
    kind = m.searchsorted(LONGEST, m.maximum(reach, -BACK * reach))
    if m is NUMBERS:
        nodes, weights = QUADRATURES[kind]
        dt, slid, vx, y = _quadrature_of(nodes, weights, vx, y, rho, q, b, tau, step)
        return float(dt), float(slid), float(vx), float(y)
    columns, found = np.array([vx, y, rho, q, b, tau, step]), np.empty((4, step.size))
    for k, (nodes, weights) in enumerate(QUADRATURES):
        chosen = np.flatnonzero(kind == k)
        for i in range(0, chosen.size, BLOCK):  # nodes along the first axis, designs the second
            j = chosen[i : i + BLOCK]
            found[:, j] = _quadrature_of(nodes[:, None], weights[:, None], *columns[:, j])
    return found[0], found[1], found[2], found[3]


def _quadrature_of(
    nodes: Array, weights: Array, vx: Any, y: Any, rho: Any, q: Any, b: Any, tau: Any, step: Any
) -> tuple[Any, Any, Any, Any]:
    """Follow the slip as `_along`, by the nodes and weights of one quadrature."""
    slope, tau1 = tau - 1.0 + TINY, tau + 1.0
    u = np.expm1(nodes * (-slope * step))
    u *= -q * tau1 / slope
    u += 1.0  # 1 + z
    log = np.log(u)
    s = 0.5 * (step + log[-1] / tau1)
    # shape = G/(1 + z)², so that ρ ~ (1+z)(1+q) shape (1+z) needs no division
    log *= -1.5 - 1.25 / tau1
    log += nodes * (step * (0.5 * slope - 1.25))
    shape = np.exp(log, out=log)
    shift = 0.5 * (q * tau1 + slope)
    plus = u + shift  # (1 + z)(1 + q) (1 + τ)/2
    vx1 = u * tau
    vx1 -= shift  # (1 + z)(1 − q) (1 + τ)/2
    vx1 *= shape
    vx1 *= u  # v_x, apart from ρ0/(1 + q0)
    plus *= plus
    plus *= shape  # dt/dλ, apart from ρ0/(1 + q0)/(2 b)
    plus *= weights
    scale = rho / (1.0 + shift)
    unit = scale * step / (tau1 * b)
    dt = _sum(plus) * unit
    plus *= vx1
    slid = _sum(plus) * (unit * scale)
    return dt, slid, vx1[-1] * scale, y * np.exp(-2.5 * s)


def _sum(rows: Array) -> Any:
    """Return the sums of (m, n) values over m, or of (m,) values, added up one after the other.

    A matrix product, or NumPy's sum of one column, would add in another order, and a design's last
    bits would depend on the batch.
    """
    if rows.size == len(rows):
        return np.add.accumulate(rows, axis=0)[-1]
    return np.add.reduce(rows, axis=0)
