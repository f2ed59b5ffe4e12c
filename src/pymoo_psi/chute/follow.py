"""Many spheres at once through the slip phase: to the exit, to the end of slip, or to rest.

Every design goes in steps of log time (see `slip`): as a rule one long step aimed at the exit or
at the end of slip, and a short one that corrects the aim. While the sphere slips its speed v_C is
monotone, because cos(theta) - tau keeps its sign; so the exit, the end of slip and a stall are
simple roots, and a step that went too far is recognised and taken again, shorter.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.chute.slip import LONGEST, RULES, TINY, Array, Rule, advance, distance

Mask = NDArray[np.bool_]

PASSES = 200  # a bound that is never met: 3 to 5 do, some 20 next to theta = pi
NEAR = 0.03  # (1 + tau) times the log time to the exit below which `_close_in` takes over
FINE = 1e-5  # the same below which `_aim`, an expansion of third order, is exact to rounding
GRIP = 1e-13  # slip is over when it would last less time than this
STRAIGHT = 6e-9  # below this y/rho the direction theta = 0 differs from 0 by less than rounding
ROLLS, SLIPS, STALLS = 0, 1, 2  # how the motion ends
T, VX, Y, H, V, B, TAU, A, CAP = range(9)  # rows of the state; H: distance to go, CAP: longest step


def follow_slip(
    b: Array, tau: Array, invariant: Array, length: Array, vx: Array, y: Array, c: Array
) -> tuple[Array, Array, Array, Array, NDArray[np.int8]]:
    """Follow the slip of (n,) designs to its end.

    Returns:
        t, v_x, |v_y|, the distance still to go, and how slip ended: SLIPS (on, past the way),
        ROLLS (or slides straight down from rho = 0) or STALLS.
    """
    n = vx.size
    end = np.array([np.zeros(n), vx, y, length])
    how = np.zeros(n, np.int8)
    moving = vx * vx + y * y > (GRIP * b) ** 2
    end[VX : Y + 1] *= moving
    ids = np.flatnonzero(moving)
    state = np.array([end[T], vx, y, length, c, b, tau, invariant, np.full(n, np.inf)])
    if ids.size < n:
        state = state[:, ids]
    for _ in range(PASSES):
        if not ids.size:
            break
        rho = np.sqrt(state[VX] * state[VX] + state[Y] * state[Y])
        dt, ds, w, c3, c2, stops = _aim(state, rho)
        straight = state[Y] < STRAIGHT * rho
        straight &= (state[VX] > 0.0) | (state[Y] < 1e-17 * rho)
        done = np.abs(ds) * (1.0 + state[TAU]) < FINE
        done |= straight
        done |= np.abs(dt) < 1e-15
        done |= np.abs(state[H]) < 1e-15
        j = np.flatnonzero(done)
        if j.size:
            end[:, ids[j]], how[ids[j]] = _finish(
                state.take(j, axis=1), dt[j], ds[j], w[j], c3[j], c2[j], straight[j], stops[j]
            )
            j = np.flatnonzero(~done)
            ids, state = ids[j], state.take(j, axis=1, mode="clip")
            rho, ds, w = rho[j], ds[j], w[j]
        parts = []
        for group, step, q, rule in _steps(state, rho, ds, w):
            s, left = state.take(group, axis=1, mode="clip"), ids[group]
            failed = _take_step(s, rho[group], q, step, rule, w[group] <= -1.0)
            gone, how[left] = _settle(s, failed)
            j = np.flatnonzero(gone)
            if j.size:
                end[:, left[j]] = s[: H + 1, j]
                j = np.flatnonzero(~gone)
                s, left = s.take(j, axis=1, mode="clip"), left[j]
            parts.append((left, s))
        if not parts:
            break
        ids = np.concatenate([p[0] for p in parts])
        state = np.concatenate([p[1] for p in parts], axis=1)
    return end[T], end[VX], end[Y], end[H], how


def _aim(state: Array, rho: Array) -> tuple[Array, Array, Array, Array, Array, Mask]:
    """Time and log time from the state to the exit, or to rest where the sphere stalls before it.

    Constant acceleration and constant decay of rho, both taken at the mean direction of the way
    ahead, which makes the result exact to third order: d cos(theta)/ds = sin^2 (tau - cos).

    Returns:
        dt, ds, w (<= -1 where slip would end first), cos(theta) averaged for the position and for
        the velocity, and whether the aim is rest instead of the exit.
    """
    _, vx, y, h, v, b, tau, _, _ = state
    rate = b / rho

    def reach(c_x: Array, c_v: Array) -> tuple[Array, Array, Array, Mask]:
        push = b * (tau - c_x)  # dv_C/dt
        root = v * v + 2.0 * push * h
        stops = root < 0.0
        np.maximum(root, 0.0, out=root)
        np.sqrt(root, out=root)
        root += v
        root += TINY
        dt = 2.0 * h / root
        np.divide(v, -push, out=dt, where=stops)
        w = (tau - c_v) * c_v
        w -= 2.5  # d log(rho)/ds
        z = rate * dt
        w *= z
        return dt, z, w, stops

    c = vx / rho
    _, z, w, _ = reach(c, c)
    turn = y / rho
    turn *= turn
    turn *= tau - c
    turn *= z
    turn /= 1.0 + 0.5 * np.maximum(w, -1.0)  # z/(1 + w/2): ds to second order
    limit = np.abs(np.minimum(tau, 1.0) - c)  # the direction cannot turn further than this
    np.minimum(turn, limit, out=turn)
    np.maximum(turn, -limit, out=turn)
    c_x = c + turn / 3.0
    turn *= 0.5
    c_v = c + turn
    dt, z, w, stops = reach(c_x, c_v)
    w += TINY
    ds = np.log1p(np.maximum(w, -1.0 + 1e-16))
    ds /= w
    ds *= z
    return dt, ds, w, c_x, c_v, stops


def _finish(
    state: Array,
    dt: Array,
    ds: Array,
    w: Array,
    c_x: Array,
    c_v: Array,
    straight: Mask,
    stops: Mask,
) -> tuple[Array, NDArray[np.int64]]:
    """Take the last, tiny or straight, piece of slip as it was aimed.

    Returns:
        (4, n) t, v_x, |v_y| and distance to go at the end of slip, and how it ended.
    """
    t, vx, y, h, v, b, tau, _, _ = state
    grips = straight & (w <= -1.0)
    np.divide(dt, -w, out=dt, where=grips)  # rho decays linearly in t: w = -1 where it is zero
    end = np.empty((4, t.size))
    end[T] = t + dt
    end[VX] = vx + dt * b * (tau - 3.5 * c_v)
    end[Y] = y * np.exp(-2.5 * ds)
    end[H] = h - dt * (v + 0.5 * dt * b * (tau - c_x))
    end[VX : Y + 1, grips] = 0.0
    how = np.where(stops, STALLS, SLIPS)
    how[grips] = ROLLS
    return end, how


def _decay(tau: Array) -> Array:
    """Rate at which rho decays at last, per log time lambda."""
    return np.where(tau < 1.0, 2.5 / (1.0 + tau), np.maximum(1.75 - 0.5 * tau, 1e-3))


def _steps(
    state: Array, rho: Array, ds: Array, w: Array
) -> Iterator[tuple[NDArray[np.intp], Array, Array, Rule]]:
    """Lengths of the next steps, grouped by the rule that takes them.

    Yields:
        indices of the group, the steps in log time lambda, q = tan^2(theta/2), and the rule.
    """
    _, vx, y, _, _, b, tau, _, cap = state
    q = (rho - vx) / y
    q *= q
    # lambda(s), exact to second order and for theta near pi, from dlambda = (1 + cos theta) ds
    bend = 2.0 * (tau - vx / rho) * ds + TINY
    step = 2.0 * ds / (1.0 + q * bend / np.expm1(bend))
    j = np.flatnonzero(w <= -1.0)
    if j.size:  # to the end of slip
        step[j] = np.log(2.0 / GRIP * rho[j] / b[j]) / _decay(tau[j])
    np.minimum(step, cap, out=step)
    room = distance(tau, q)
    np.minimum(step, RULES[-1].reach * room, out=step)
    np.minimum(step, LONGEST / (np.abs(tau - 1.0) + TINY), out=step)
    room = np.abs(step) / room
    kind = np.zeros(step.size, np.int8)
    for rule in RULES[:-1]:
        kind += room > rule.reach
    for k, rule in enumerate(RULES):
        group = np.flatnonzero(kind == k)
        if group.size:
            yield group, step[group], q[group], rule


def _take_step(s: Array, rho: Array, q: Array, step: Array, rule: Rule, over: Mask) -> Mask:
    """Advance the states, in place, where the step does not lead past the exit or past rest.

    Returns:
        Where it does; there the state stays and its CAP is set to a better step.
    """
    t, vx, y, h, v, b, tau, invariant, cap = s
    dt, slid, vx1, y1 = advance(vx, y, rho, q, b, tau, step, rule)
    a = b * tau
    v1 = (invariant + a * (t + dt) + 0.4 * vx1) / 1.4
    h1 = h - ((invariant + a * (t + 0.5 * dt)) * dt + 0.4 * slid) / 1.4
    # five per cent past the aim is harmless: the next step goes back; not from the end of slip
    slack = -0.05 * np.abs(h)
    slack[over] = 0.0
    failed: Mask = h1 < slack
    failed |= v1 < -0.05 * v
    cap.fill(np.inf)
    j = np.flatnonzero(failed)
    if j.size:
        share = np.where(v1[j] < 0.0, 0.5, h[j] / (h[j] - h1[j]))
        decay = _decay(tau[j])
        guess = -np.log1p(share * np.expm1(-decay * step[j])) / decay
        cap[j] = np.minimum(guess, 0.9 * step[j])
        for new, old in zip((dt, vx1, y1, h1, v1), (0.0, vx, y, h, v), strict=True):
            new[j] = 0.0 if new is dt else old[j]
    s[T] += dt
    s[VX], s[Y], s[H], s[V] = vx1, y1, h1, v1
    return failed


def _settle(s: Array, failed: Mask) -> tuple[Mask, Mask]:
    """Find the states whose slip is over; in place: v_A = 0, or onto the exit where it is near.

    Returns:
        Whether slip is over, and whether it ended at the exit (SLIPS) rather than by ROLLS.
    """
    rho = np.sqrt(s[VX] * s[VX] + s[Y] * s[Y])
    grips = rho < GRIP * s[B]
    grips &= ~failed
    grips &= s[H] >= 0.0
    s[VX : Y + 1] *= ~grips
    ahead = np.abs(s[B] * s[H])
    near = ahead * (1.0 + s[TAU]) < NEAR * s[V] * rho
    near &= ahead < 0.2 * s[V] * s[V]  # far from a stall
    near &= s[VX] > 0.0  # where `distance` cannot be short
    near &= ~grips
    j = np.flatnonzero(near)
    if j.size:
        chosen = s.take(j, axis=1, mode="clip")
        near[j] = _close_in(chosen)
        s[:, j] = chosen
    return grips | near, near


def _close_in(s: Array) -> Mask:
    """Move states next to the exit onto it, in place: one short step and one expansion.

    Both aim by series of second order in the time to the exit; the expansion is then exact to the
    third power of FINE.

    Returns:
        Where that much was reached.
    """
    _, _, _, _, _, b, tau, invariant, _ = s
    close: Mask = np.empty(s.shape[1], bool)
    for last in (False, True):
        t, vx, y, h, v = s[: V + 1]
        rho = np.sqrt(vx * vx + y * y)
        c, rate = vx / rho, b / rho
        lead = tau - c
        dt = h / v
        bend = 0.5 * b * lead * dt / v
        dt *= 1.0 - bend
        z = rate * dt
        ds = z * (1.0 - 0.5 * (c * lead - 2.5) * z)
        half_turn = 0.5 * (y / rho) ** 2 * lead * ds
        if last:
            np.less(np.abs(z) * (1.0 + tau), FINE, out=close)
            dt *= close
            ds *= close
            h -= dt * (v + 0.5 * b * lead * dt)
            t += dt
            vx += b * (tau - 3.5 * (c + half_turn)) * dt
            y *= np.exp(-2.5 * ds)
        else:
            q = (rho - vx) / y
            q *= q
            step = (1.0 + c + half_turn) * ds
            spent, slid, vx[:], y[:] = advance(vx, y, rho, q, b, tau, step, RULES[0])
            push = invariant + b * tau * t
            h -= ((push + 0.5 * b * tau * spent) * spent + 0.4 * slid) / 1.4
            v[:] = (push + b * tau * spent + 0.4 * vx) / 1.4
            t += spent
    return close
