"""Slip: the path in closed form, and how far along it the sphere slips.

While the sphere slips, the velocity of its contact point (v_x, v_y) = ρ (cos θ, sin θ) obeys
dv_x/dt = a − 3.5 b cos θ, dv_y/dt = −2.5 b sin θ (Eqs. 2.17–2.18 in time), with a = sin α,
b = μ cos α, τ = a/b. The right-hand sides depend on the direction alone. With q = tan²(θ/2) and the
log time dλ = (1 + cos θ)(b/ρ) dt the direction is logistic,

    dq/dλ = −q ((τ − 1) + (τ + 1) q),                                                           (1)

and with D = log(q0/q), ν = (τ − 1) + (τ + 1) q0 all of it is closed:

    (exp(D) − 1)/ν = (exp((τ−1) λ) − 1)/(τ − 1)                                                 (2)
    ρ   = ρ0 S (exp(D) + q0)/(1 + q0),  S = exp(−(2.5 λ + 1.25 D)/(1 + τ) − D/2)                (3)
    v_y = v_y0 exp(−2.5 s),  s = (λ + D/2)/(1 + τ),  ds = (b/ρ) dt                              (4)
    dt  = ρ0 S (exp(D) + q0)²/(1 + q0)/(2 b) exp(−D) dλ,  dλ = exp(D − (τ−1) λ) dD/ν            (5)

τ = 1 and ν = 0 are regular points. Only t and ∫ v_x dt are left to quadrature: the centre follows
from 1.4 v_C = A + a t + 0.4 v_x, where A = c + 0.4 r ω_Y0 does not change (`invariant` below).
In D a quadrature needs a third fewer nodes than in λ; but D tends to a limit where τ < 1, and λ
goes on to the end of slip.

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
FORTH, BACK = 12.0, -0.5  # longest steps, in units of 1/rate, see `_next`
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
# Designs that are followed at a time, and how often before all are gathered.
POOL, ROUNDS = 16384, 3
EVALUATIONS = 32768  # of integrands in one quadrature: its arrays stay in the cache
STEPS = 200  # never reached: two are usual, some 20 from next to θ = π
ENDLESS = "the slip of a design does not end; report it"
# From here on glibc keeps what is freed for the next array, as the largest block ever given back is
# its measure for that; without it a third of the time goes into faults of pages.
np.empty(2**21)


def _quadrature(m: int, crowding: float = 0.0, fall: float = 1e-9) -> tuple[Array, Array]:
    """Gauss–Radau in a variable x of the step that may crowd its nodes and follow a decay.

    The share of the step is −log(1 − z)/fall with z = (1 − exp(−fall)) (x + crowding x²)/(1 +
    crowding): with a fall of nearly 0 it is that quotient.

    Returns:
        (m,) shares of the step, the last one 1, and their weights.
    """
    p = Legendre.basis(m - 1) - Legendre.basis(m)
    x = np.sort(p.roots().real)  # all are real; NumPy 2.5 gives them a complex type
    for _ in range(3):  # the roots lack three digits
        x -= p(x) / p.deriv()(x)
    weights, x = (1.0 + x) / (2.0 * m * m * Legendre.basis(m - 1)(x) ** 2), 0.5 * (1.0 + x)
    scale = np.expm1(-fall) / (1.0 + crowding)
    z = scale * x * (1.0 + crowding * x)
    shares = -np.log1p(z) / fall
    return shares / shares[-1], -scale * weights * (1.0 + 2.0 * crowding * x) / (fall * (1.0 + z))


# The quadratures, and for each but the last the longest step, in units of `_along`. Measured over
# τ in [0, 10⁴] and all θ, to and fro: dt and v_x dt err by 1e-13 of themselves. From LONG on they
# are in λ: steps as long as FORTH (2e-14 of ρ/b and ρ²/b), and the whole way to the end of slip,
# where ρ falls by exp(-40), for the τ and q named in `_next` (1e-14). Half of all steps take 3
# nodes or 5.
QUADRATURES = (*map(_quadrature, (3, 5, 7, 10)), _quadrature(24, 8.0), _quadrature(26, 4.0, 3.7))
LONGEST, LONG = (0.0045, 0.1, 0.4, 0.75, 1e300), 4


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
        raise PsiError(ENDLESS)
    end, ids = np.empty((5, b.size)), np.arange(b.size)
    for _ in range(STEPS):
        left = [
            _follow(m, ids[i : i + POOL], Slip(*(entry[i : i + POOL] for entry in slip)), end)
            for i in range(0, ids.size, POOL)
        ]
        if not left:
            return end[0], end[1], end[2], end[3], end[4]
        ids = np.concatenate([each[0] for each in left])
        slip = Slip(*np.concatenate([each[1] for each in left], axis=1))
    raise PsiError(ENDLESS)


def _follow(m: Any, ids: NDArray[np.intp], slip: Slip, end: Array) -> tuple[NDArray[np.intp], Slip]:
    """Follow some designs for some steps, note the `end` of those that are there, return others.

    The few designs that need more steps then go on together, those of all pools.
    """
    for _ in range(ROUNDS):
        aim = _aim(m, slip)
        exact = _error(m, aim) < EXACT
        if exact.any():
            j = np.flatnonzero(exact)
            for field, values in zip(end, _finish(m, _of(slip, j), _of(aim, j)), strict=True):
                field[ids[j]] = values
            j = np.flatnonzero(~exact)
            ids, slip, aim = ids[j], _of(slip, j), _of(aim, j)
        if not ids.size:
            break
        slip = _next(m, slip, aim)
    return ids, slip


def _of(entries: Any, chosen: NDArray[np.intp]) -> Any:
    """Return the Slip or Aim of the chosen designs."""
    return type(entries)(*(entry.take(chosen) for entry in entries))


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


def _next(m: Any, slip: Slip, aim: Aim) -> Slip:
    """Step along the path as far as aimed, or stay where that led too far."""
    t, vx, y, left, v, b, tau, invariant, longest = slip
    q = (aim.rho - vx) / y
    q = q * q
    # λ(s), exact to second order and for θ near π, from dλ = (1 + cos θ) ds = 2 ds/(1 + q)
    bend = 2.0 * (tau - vx / aim.rho) * aim.ds + TINY
    step = m.minimum(2.0 * aim.ds / (1.0 + q * bend / m.expm1(bend)), longest)
    # What limits a quadrature in λ: backwards the direction reaches θ = π, a singularity, after
    # λ = 1/((1+τ) q) or more; complex ones lie π/|τ−1| off the axis; ρ decays over λ of order 1.
    rate = (1.0 + tau) * q + 1.2 * abs(tau - 1.0) + 0.5
    step = m.maximum(m.minimum(step, FORTH / rate), BACK / rate)
    whole = (aim.w <= -1.0) & (longest == np.inf) & (q > 0.2) & (q < 2.0) & (tau < 1.6)
    step = m.where(whole, 16.0 * (1.0 + tau), step)
    dt, slid, vx1, y1 = _along(m, vx, y, aim.rho, q, b, tau, step, whole)
    a = b * tau
    v1 = (invariant + a * (t + dt) + 0.4 * vx1) / 1.4
    left1 = left - ((invariant + a * (t + 0.5 * dt)) * dt + 0.4 * slid) / 1.4
    # Five per cent past the exit or past rest is harmless, the next step goes back; not so on the
    # way to the end of slip: from ρ = 0 there is no way back.
    fits = (left1 >= -0.05 * left * (aim.w > -1.0)) & (v1 >= -0.05 * v) | (aim.ds < 0.0)
    moved = (t + dt, vx1, y1, left1, v1, np.inf + t)
    stays = (t, vx, y, left, v, 0.5 * step)
    t, vx, y, left, v, longest = (m.where(fits, *pair) for pair in zip(moved, stays, strict=True))
    return Slip(t, vx, y, left, v, b, tau, invariant, longest)


def _along(
    m: Any, vx: Any, y: Any, rho: Any, q: Any, b: Any, tau: Any, step: Any, whole: Any
) -> tuple[Any, Any, Any, Any]:
    """Follow the slip over a step of log time λ, Eqs. (2) to (5).

    Each design takes the quadrature with the fewest nodes that its step allows.

    Args:
        m: NumPy for arrays, `NUMBERS` for floats.
        vx: (n,) array or float, v_x at the step's beginning; so are all others.
        y: |v_y| there.
        rho: speed of the contact point there.
        q: tan²(θ/2) there.
        b: μ cos α.
        tau: u1/μ.
        step: the step, may be negative.
        whole: whether it goes to the end of slip.

    Returns:
        Time taken, integral of v_x dt, v_x and |v_y| at the step's end.
    """
    slope, q1 = tau - 1.0 + TINY, q * (tau + 1.0)
    nu = slope + q1 + TINY
    turn = m.log1p(m.expm1(slope * step) * (nu / slope))  # D
    share = turn / nu
    reach = abs(share) * m.sqrt(1.0 + 0.5 * q1 * q1 + 0.05 * slope * slope)
    kind = m.where(whole, len(LONGEST), m.searchsorted(LONGEST, reach))
    by_step, by_turn = -2.5 / (tau + 1.0), -1.25 / (tau + 1.0) - 0.5
    columns = (turn, slope * step, slope / nu, by_turn, by_step / slope, q)
    if m is NUMBERS:
        nodes, weights = QUADRATURES[int(kind)]
        found: Any = map(float, _quadrature_of(nodes, weights, kind >= LONG, columns))
    else:
        order = np.argsort(kind.astype(np.int8), kind="stable")
        ordered, found = np.take(columns, order, axis=1), np.empty((3, step.size))
        i = 0
        for k, n in enumerate(np.bincount(kind).tolist()):
            nodes, weights = (column[:, None] for column in QUADRATURES[k])
            block = EVALUATIONS // nodes.size
            for first in range(i, i + n, block):  # nodes along the first axis, designs the second
                part = slice(first, min(first + block, i + n))
                found[:, part] = _quadrature_of(nodes, weights, k >= LONG, ordered[:, part])
            i += n
        back = np.empty_like(order)
        back[order] = np.arange(order.size)
        found = np.take(found, back, axis=1)
    dt, slid, v_x = found
    scale = rho / (1.0 + q)
    unit = 0.5 * scale / b * m.where(kind >= LONG, step, share)
    v_y = y * m.exp(by_step * (step + 0.5 * turn))
    return dt * unit, slid * (unit * scale), v_x * scale, v_y


def _quadrature_of(nodes: Array, weights: Array, long: bool, columns: Any) -> tuple[Any, Any, Any]:
    """Return the sums of dt and v_x dt, and the last v_x, in the units of `_along`.

    Args:
        nodes: shares of the step.
        weights: their weights.
        long: whether they are shares of λ, not of D.
        columns: D and (τ − 1) λ of the step, (τ − 1)/ν, log S per D and per (τ − 1) λ, and q at the
            step's beginning.
    """
    turn, slide, ratio, by_turn, by_slide, q = columns
    if long:
        turn, ratio, by_turn, by_slide = slide, 1.0 / ratio, by_slide, by_turn
    first = nodes * turn
    shape = first * by_turn
    np.expm1(first, out=first)
    second = first * ratio
    shape += np.log1p(second) * by_slide
    np.exp(shape, out=shape)
    grown = second if long else first
    vx = grown + (1.0 - q)
    vx *= shape
    dt = grown + (1.0 + q)
    dt *= dt
    dt *= shape
    second += 1.0
    dt /= second
    dt *= weights
    total = _sum(dt)
    dt *= vx
    return total, _sum(dt), vx[-1]


def _sum(rows: Array) -> Any:
    """Return the sums of (m, n) values over m, or of (m,) values, added up one after the other.

    A matrix product, or NumPy's sum of one column, would add in another order, and a design's last
    bits would depend on the batch.
    """
    if rows.size == len(rows):
        return np.add.accumulate(rows, axis=0)[-1]
    return np.add.reduce(rows, axis=0)
