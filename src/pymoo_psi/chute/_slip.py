"""Slip: the path in closed form, and how far along it the sphere slips.

While the sphere slips, the velocity of its contact point (v_x, v_y) = ρ (cos θ, sin θ) obeys
dv_x/dt = a − 3.5 b cos θ, dv_y/dt = −2.5 b sin θ (Eqs. 2.17–2.18 in time), with a = sin α,
b = μ cos α, τ = a/b. The right-hand sides depend on the direction alone. With q = tan²(θ/2) and the
log time dλ = (1 + cos θ)(b/ρ) dt the direction is logistic,

    dq/dλ = −q ((τ − 1) + (τ + 1) q),                                                           (1)

and with D = log(q0/q), ν = (τ − 1) + (τ + 1) q0 everything has a closed form:

    (exp(D) − 1)/ν = (exp((τ−1) λ) − 1)/(τ − 1)                                                 (2)
    ρ   = ρ0 S (exp(D) + q0)/(1 + q0),  S = exp(−(2.5 λ + 1.25 D)/(1 + τ) − D/2)                (3)
    v_y = v_y0 exp(−2.5 s),  s = (λ + D/2)/(1 + τ),  ds = (b/ρ) dt                              (4)
    dt  = ρ0 S (exp(D) + q0)²/(1 + q0)/(2 b) exp(−D) dλ,  dλ = exp(D − (τ−1) λ) dD/ν            (5)

τ = 1 and ν = 0 are regular points. Only t and ∫ v_x dt are left to quadrature: the speed of the
centre follows from 1.4 v_C = A + a t + 0.4 v_x, where A = c + 0.4 r ω_Y0 does not change
(`invariant` below). A quadrature in D needs a third fewer nodes than one in λ; but where τ < 1, D
tends to a limit while λ goes on to the end of slip.

The length of the slip is found by aiming with constant accelerations, stepping along the path, and
aiming again; two steps are typical. While the sphere slips v_C is monotone, because cos θ − τ keeps
its sign; so the exit, the end of slip and a stall are simple roots. A step that goes too far is
detected and repeated at half the length.

Every formula is elementwise, for (n,) arrays and for Python's floats alike, with the functions of a
namespace `xp`: NumPy, or `NUMBERS` for one design, which takes a quarter of the time of arrays of
length 1. Both give the same bits: what `NUMBERS` does itself is correctly rounded, and exponentials
and logarithms are NumPy's in both.
"""

from __future__ import annotations

import operator
from bisect import bisect_left
from collections import namedtuple
from math import copysign, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.polynomial import Legendre

from pymoo_psi._validation import Array, Rows
from pymoo_psi.errors import PsiError

# How slip ends: with ρ = 0, whatever follows; past the exit; at rest.
ROLLS = 0
SLIPS = 1
STALLS = 2
TINY = 1e-200  # added where 0/0 has a limit, as in log1p(w)/w
# The largest slip that counts as none, in units of b: rounding of v_P − r ω_X where a sphere rolls
# from the start. Such a slip ends within a time of NONE.
NONE = 1e-14
# The `_error` below which an aim is the last one. It is a speed far below rounding; but next to
# θ = π the error is that of sin²θ, while the result depends on sin θ to the power 1.45 and more:
# the share of ρ that is left when the direction turns, (3.5 + τ)/(1 + τ) for τ <= 4.5.
EXACT = 1e-18
# The longest steps forwards and backwards, in units of 1/rate, see `_limited`.
FORTH = 12.0
BACK = -0.5
NUMBERS = SimpleNamespace(
    minimum=min,
    maximum=max,
    sqrt=sqrt,
    copysign=copysign,
    logical_not=operator.not_,
    where=lambda condition, yes, no: yes if condition else no,
    searchsorted=bisect_left,
    exp=lambda x: float(np.exp(x)),
    expm1=lambda x: float(np.expm1(x)),
    log1p=lambda x: float(np.log1p(x)),
)
POOL = 16384  # designs that are followed at a time
ROUNDS = 3  # steps before the unfinished designs of all pools are gathered
EVALUATIONS = 32768  # integrands in one quadrature, so that its arrays stay in the cache
STEPS = 200  # never reached: two are usual, some 20 from next to θ = π
ENDLESS = "the slip of a design does not end; report it"
# glibc keeps freed memory for the next array only up to the largest block ever freed. Without this
# block a third of the time would go into page faults.
np.empty(2**21)


def _quadrature(m: int, crowding: float = 0.0, fall: float = 1e-9) -> tuple[Array, Array]:
    """Return the Gauss–Radau rule in a variable x that may crowd its nodes and follow a decay.

    The share of the step is −log(1 − z)/fall with z = (1 − exp(−fall)) (x + crowding x²)/(1 +
    crowding): with a fall of nearly 0 it is that quotient.

    Returns:
        (m,) shares of the step, the last one 1, and their weights.
    """
    p = Legendre.basis(m - 1) - Legendre.basis(m)
    slope = p.deriv()
    x = np.sort(p.roots().real)  # all are real; NumPy 2.5 gives them a complex type
    for _ in range(3):  # the roots lack three digits
        x -= p(x) / slope(x)
    weights = (1.0 + x) / (2.0 * m * m * Legendre.basis(m - 1)(x) ** 2)
    x = 0.5 * (1.0 + x)
    scale = np.expm1(-fall) / (1.0 + crowding)
    z = scale * x * (1.0 + crowding * x)
    shares = -np.log1p(z) / fall
    stretch = 1.0 + 2.0 * crowding * x
    return shares / shares[-1], -scale * weights * stretch / (fall * (1.0 + z))


# Measured over τ in [0, 10⁴] and all θ, in both directions: dt and v_x dt have a relative error of
# 1e-13. The rules from LONG on are in λ: one for steps as long as FORTH (error 2e-14 of ρ/b and
# ρ²/b), one for the whole way to the end of slip, where ρ falls by exp(-40), for the τ and q named
# in `_next` (1e-14). Half of all steps take 3 nodes or 5.
QUADRATURES = (
    _quadrature(3),
    _quadrature(5),
    _quadrature(7),
    _quadrature(10),
    _quadrature(24, crowding=8.0),
    _quadrature(26, crowding=4.0, fall=3.7),
)
# The longest step of each quadrature but the last, in units of `_advance`.
LONGEST = (0.0045, 0.1, 0.4, 0.75, 1e300)
LONG = 4


Slip = namedtuple("Slip", "t vx y left v b tau invariant longest")
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
    longest: the longest step allowed: half the last one if that went too far, else infinite.
"""


Aim = namedtuple("Aim", "rho dt ds w turn stops")
"""Where the slip leads in constant acceleration; every entry is an (n,) array or a float.

Attributes:
    rho: speed of the contact point now.
    dt: time to the exit, to rest or to the end of slip, whichever comes first.
    ds: log time s to there.
    w: relative change of ρ until the exit or rest; <= -1 where slip ends before that.
    turn: change of cos θ on the way there.
    stops: whether the sphere comes to rest before the exit.
"""


def follow_slip(
    xp: Any, b: Any, tau: Any, invariant: Any, way: Any, vx: Any, y: Any, c: Any
) -> tuple[Any, ...]:
    """Follow the slip to the exit, to its end or to rest.

    Args:
        xp: NumPy for arrays, `NUMBERS` for floats.
        b: (n,) array or float, μ cos α; so are all others.
        tau: u1/μ.
        invariant: c + 0.4 r ω_Y0.
        way: distance to the exit.
        vx: v_x at the start.
        y: |v_y| at the start.
        c: v_C at the start.

    Returns:
        t, v_x, |v_y|, distance to go, and how slip ends: ROLLS, SLIPS or STALLS.
    """
    slip = Slip(0.0 * b, vx, y, way, c, b, tau, invariant, np.inf + b)
    if xp is NUMBERS:
        return _follow_one(slip)
    return _follow_all(slip)


def _follow_one(slip: Slip) -> tuple[Any, ...]:
    """Return the end of the slip of one design, a Slip of floats; see `follow_slip`."""
    for _ in range(STEPS):
        aim = _aim(NUMBERS, slip)
        if _error(NUMBERS, aim) < EXACT:
            return _finish(NUMBERS, slip, aim)
        slip = _next(NUMBERS, slip, aim)
    raise PsiError(ENDLESS)


def _follow_all(slip: Slip) -> tuple[Any, ...]:
    """Return the ends of the slip of n designs; see `follow_slip`.

    Designs are followed in pools that fit into the cache. The few of all pools that need more than
    `ROUNDS` steps then go on together.
    """
    end = np.empty((5, slip.b.size))
    ids = np.arange(slip.b.size)
    for _ in range(STEPS):
        if not ids.size:
            return tuple(end)
        unfinished = []
        for start in range(0, ids.size, POOL):
            pool = slice(start, start + POOL)
            part = Slip._make(entry[pool] for entry in slip)
            unfinished.append(_follow_pool(ids[pool], part, end))
        ids = np.concatenate([pool_ids for pool_ids, _ in unfinished])
        slip = Slip(*np.concatenate([part for _, part in unfinished], axis=1))
    raise PsiError(ENDLESS)


def _follow_pool(ids: Rows, slip: Slip, end: Array) -> tuple[Rows, Slip]:
    """Follow k designs for `ROUNDS` steps.

    Args:
        ids: (k,) columns of `end` that are these designs.
        slip: Their slip.
        end: (5, n) results of `follow_slip`, which receive those of the designs that are finished.

    Returns:
        The ids and the slip of the designs that are not finished.
    """
    for _ in range(ROUNDS):
        aim = _aim(np, slip)
        exact = _error(np, aim) < EXACT
        if exact.any():
            done = np.flatnonzero(exact)
            end[:, ids[done]] = _finish(np, _rows_of(slip, done), _rows_of(aim, done))
            rest = np.flatnonzero(~exact)
            ids = ids[rest]
            slip = _rows_of(slip, rest)
            aim = _rows_of(aim, rest)
        if not ids.size:
            break
        slip = _next(np, slip, aim)
    return ids, slip


def _rows_of(entries: Any, rows: Rows) -> Any:
    """Return the Slip or Aim of some designs."""
    return entries._make(entry.take(rows) for entry in entries)


def _aim(xp: Any, slip: Slip) -> Aim:
    """Aim with the mean direction over the way ahead, exact to third order in ds.

    The direction turns by d cos θ/ds = sin²θ (τ − cos θ). Of the turn over the way ahead a third
    counts for the position and half for the velocities.
    """
    tau = slip.tau
    rho = xp.sqrt(slip.vx * slip.vx + slip.y * slip.y) + TINY
    rate = slip.b / rho
    cosine = slip.vx / rho
    sine = slip.y / rho
    dt, w, _ = _reach(xp, slip, rate, cosine, cosine)
    turn = sine * sine * (tau - cosine) * rate * dt
    turn = turn / (1.0 + 0.5 * xp.maximum(w, -1.0))
    limit = abs(xp.minimum(tau, 1.0) - cosine)  # the slip cannot turn beyond its last direction
    turn = xp.maximum(xp.minimum(turn, limit), -limit)  # far from the exit the order does not hold
    dt, w, stops = _reach(xp, slip, rate, cosine + turn / 3.0, cosine + turn / 2.0)
    w = xp.where(rho > NONE * slip.b, w, -np.inf)
    clipped = xp.maximum(w, -1.0 + 1e-16)  # at w = -1, ρ = 0 and ds would be infinite: 37 is enough
    dt = dt * (clipped / w)
    ds = xp.log1p(clipped) / clipped * rate * dt
    return Aim(rho, dt, ds, w, turn, stops)


def _reach(xp: Any, slip: Slip, rate: Any, c_x: Any, c_v: Any) -> tuple[Any, Any, Any]:
    """Move in a constant direction: constant acceleration of the centre, constant decay of ρ.

    Args:
        xp: NumPy for arrays, `NUMBERS` for floats.
        slip: The slip.
        rate: b/ρ.
        c_x: cos θ that counts for the position.
        c_v: cos θ that counts for the velocities.

    Returns:
        Time to the exit or to rest, relative change w of ρ until then, and whether it is to rest.
    """
    push = slip.b * (slip.tau - c_x)  # dv_C/dt
    square = slip.v * slip.v + 2.0 * push * slip.left  # v_C² at the exit
    stops = square < 0.0
    to_rest = -slip.v / (push + TINY)
    to_exit = 2.0 * slip.left / (slip.v + xp.sqrt(abs(square)) + TINY)
    dt = xp.where(stops, to_rest, to_exit)
    w = ((slip.tau - c_v) * c_v - 2.5) * rate * dt + TINY
    return dt, w, stops


def _error(xp: Any, aim: Aim) -> Any:
    """Error of an aim, as a speed: third order in ds (`turn` is first), times ρ at its largest."""
    ahead = xp.minimum(abs(aim.ds), 1.0)
    return abs(aim.turn) * ahead * ahead * aim.rho * xp.maximum(1.0 + aim.w, 1.0)


def _finish(xp: Any, slip: Slip, aim: Aim) -> tuple[Any, ...]:
    """Return the state after the last, tiny or straight, piece of slip; see `follow_slip`."""
    cosine = slip.vx / aim.rho
    push = aim.dt * slip.b * (slip.tau - 3.5 * (cosine + aim.turn / 2.0))
    y = slip.y * xp.exp(-2.5 * aim.ds)
    gain = 0.5 * aim.dt * slip.b * (slip.tau - cosine - aim.turn / 3.0)
    left = slip.left - aim.dt * (slip.v + gain)
    slips = aim.w > -1.0
    vx = xp.where(slips, slip.vx + push, 0.0)
    y = xp.where(slips, y, 0.0)
    ending = xp.where(slips, xp.where(aim.stops, STALLS, SLIPS), ROLLS)
    return slip.t + aim.dt, vx, y, left, ending


def _next(xp: Any, slip: Slip, aim: Aim) -> Slip:
    """Step along the path as far as aimed, or stay where that led too far."""
    t, vx, y, left, v, b, tau, invariant, longest = slip
    tangent = (aim.rho - vx) / y
    q = tangent * tangent
    step = _limited(xp, _log_time(xp, slip, aim, q), slip, q)
    ends = aim.w <= -1.0
    whole = ends & (longest == np.inf) & (q > 0.2) & (q < 2.0) & (tau < 1.6)
    step = xp.where(whole, 16.0 * (1.0 + tau), step)
    dt, slid, vx1, y1 = _advance(xp, slip, aim.rho, q, step, whole)
    a = b * tau
    t1 = t + dt
    v1 = (invariant + a * t1 + 0.4 * vx1) / 1.4
    travelled = (invariant + a * (t + 0.5 * dt)) * dt + 0.4 * slid
    left1 = left - travelled / 1.4
    # Five per cent past the exit or past rest is harmless, the next step goes back; but not on the
    # way to the end of slip: from ρ = 0 there is no way back.
    inside = left1 >= xp.where(ends, 0.0, -0.05 * left)
    moving = v1 >= -0.05 * v
    fits = inside & moving | (aim.ds < 0.0)
    state = []
    for before, after in zip(slip[:5], (t1, vx1, y1, left1, v1), strict=True):
        state.append(xp.where(fits, after, before))
    longest = xp.where(fits, np.inf, 0.5 * step)
    return Slip._make((*state, b, tau, invariant, longest))


def _log_time(xp: Any, slip: Slip, aim: Aim, q: Any) -> Any:
    """Return λ of the log time s of an aim, exact to second order and for θ near π.

    From dλ = (1 + cos θ) ds = 2 ds/(1 + q).
    """
    bend = 2.0 * (slip.tau - slip.vx / aim.rho) * aim.ds + TINY
    return 2.0 * aim.ds / (1.0 + q * bend / xp.expm1(bend))


def _limited(xp: Any, step: Any, slip: Slip, q: Any) -> Any:
    """Return a step of λ that is no longer than a quadrature in λ allows.

    Backwards the direction reaches θ = π, a singularity, after λ = 1/((1+τ) q) or more; complex
    singularities lie π/|τ−1| off the axis; ρ decays over λ of order 1.
    """
    rate = (1.0 + slip.tau) * q + 1.2 * abs(slip.tau - 1.0) + 0.5
    step = xp.minimum(step, slip.longest)
    return xp.maximum(xp.minimum(step, FORTH / rate), BACK / rate)


def _advance(
    xp: Any, slip: Slip, rho: Any, q: Any, step: Any, whole: Any
) -> tuple[Any, Any, Any, Any]:
    """Follow the slip over a step of log time λ, Eqs. (2) to (5).

    Each design takes the quadrature with the fewest nodes that its step allows.

    Args:
        xp: NumPy for arrays, `NUMBERS` for floats.
        slip: The slip at the step's beginning.
        rho: (n,) array or float, speed of the contact point there; so are all others.
        q: tan²(θ/2) there.
        step: the step, may be negative.
        whole: whether it goes to the end of slip.

    Returns:
        Duration, integral of v_x dt, v_x and |v_y| at the step's end.
    """
    tau_minus = slip.tau - 1.0 + TINY
    tau_plus = slip.tau + 1.0
    q1 = q * tau_plus
    nu = tau_minus + q1 + TINY
    slide = tau_minus * step
    turn = xp.log1p(xp.expm1(slide) * (nu / tau_minus))  # D
    share = turn / nu
    reach = abs(share) * xp.sqrt(1.0 + 0.5 * q1 * q1 + 0.05 * tau_minus * tau_minus)
    kind = xp.where(whole, len(LONGEST), xp.searchsorted(LONGEST, reach))
    by_step = -2.5 / tau_plus
    by_turn = -1.25 / tau_plus - 0.5
    columns = (turn, slide, tau_minus / nu, by_turn, by_step / tau_minus, q)
    if xp is NUMBERS:
        nodes, weights = QUADRATURES[kind]
        time, slid, vx = map(float, _integrals(nodes, weights, kind >= LONG, columns))
    else:
        time, slid, vx = _integrals_by_kind(kind, columns)
    scale = rho / (1.0 + q)
    unit = 0.5 * scale / slip.b * xp.where(kind >= LONG, step, share)
    y = slip.y * xp.exp(by_step * (step + 0.5 * turn))
    return time * unit, slid * (unit * scale), vx * scale, y


def _integrals_by_kind(kind: Rows, columns: Any) -> Array:
    """Return the (3, n) `_integrals` of n designs, those with the same quadrature together.

    Args:
        kind: (n,) index of the quadrature of each design.
        columns: Six (n,) arrays as for `_integrals`.
    """
    order = np.argsort(kind.astype(np.int8), kind="stable")
    ordered = np.take(columns, order, axis=1)
    integrals = np.empty((3, kind.size))
    begin = 0
    for k, count in enumerate(np.bincount(kind).tolist()):
        # Nodes along the first axis, designs along the second.
        nodes, weights = (column[:, None] for column in QUADRATURES[k])
        end = begin + count
        block = EVALUATIONS // nodes.size
        for first in range(begin, end, block):
            part = slice(first, min(first + block, end))
            integrals[:, part] = _integrals(nodes, weights, k >= LONG, ordered[:, part])
        begin = end
    back = np.empty_like(order)
    back[order] = np.arange(order.size)
    return np.take(integrals, back, axis=1)


def _integrals(nodes: Array, weights: Array, long: bool, columns: Any) -> tuple[Any, Any, Any]:
    """Return the sums of dt and v_x dt, and the last v_x, in the units of `_advance`.

    Args:
        nodes: Shares of the step.
        weights: Their weights.
        long: Whether they are shares of λ, not of D.
        columns: D and (τ − 1) λ of the step, (τ − 1)/ν, log S per D and per (τ − 1) λ, and q at the
            step's beginning.
    """
    turn, slide, ratio, by_turn, by_slide, q = columns
    # exp(D) − 1 and exp((τ−1) λ) − 1 at the nodes, one from the other by Eq. (2), and log S.
    if long:
        slides = nodes * slide
        shape = slides * by_slide
        np.expm1(slides, out=slides)
        grown = slides * (1.0 / ratio)
        shape += np.log1p(grown) * by_turn
        divisor = grown
    else:
        grown = nodes * turn
        shape = grown * by_turn
        np.expm1(grown, out=grown)
        divisor = grown * ratio
        shape += np.log1p(divisor) * by_slide
    np.exp(shape, out=shape)
    vx = grown + (1.0 - q)
    vx *= shape
    # Eq. (5): exp(−D) in λ; in D exp(−(τ−1) λ), where exp(D) cancels.
    dt = grown + (1.0 + q)
    dt *= dt
    dt *= shape
    divisor += 1.0
    dt /= divisor
    dt *= weights
    time = _sum(dt)
    dt *= vx
    return time, _sum(dt), vx[-1]


def _sum(rows: Array) -> Any:
    """Return the sums of (m, n) values over m, or of (m,) values, added up one after the other.

    A matrix product, or NumPy's sum of one column, would add in another order, and a design's last
    bits would depend on the batch.
    """
    if rows.size == len(rows):
        return np.add.accumulate(rows, axis=0)[-1]
    return np.add.reduce(rows, axis=0)
