"""Many spheres at once through the slip phase: to the exit, to the end of slip, or to rest.

Every design goes in steps of log time (see `slip`): as a rule one long step aimed at the exit or
at the end of slip, and a short one that corrects the aim. While the sphere slips its speed v_C is
monotone, because cos(theta) - tau keeps its sign; so the exit, the end of slip and a stall are
simple roots, and a step that went too far is recognised and taken again, shorter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.chute._landing import land, near_exit
from pymoo_psi.chute._slip import LONGEST, RULES, TINY, Array, Rule, advance, distance
from pymoo_psi.errors import PsiError

Mask = NDArray[np.bool_]

PASSES = 200  # a bound that is never met: 3 to 5 do, some 20 next to theta = pi
# (1 + tau) times the log time to the exit below which `_aim`, an expansion of third order, is exact
FINE = 1e-5
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
    end, how = np.empty((4, n)), np.full(n, ROLLS, np.int8)
    state = np.array([np.zeros(n), vx, y, length, c, b, tau, invariant, np.full(n, np.inf)])
    ids = np.arange(n)
    for _ in range(PASSES):
        rho = np.sqrt(state[VX] * state[VX] + state[Y] * state[Y]) + TINY
        dt, ds, w, c_x, c_v, stops = _aim(state, rho)
        gone = rho < GRIP * state[B]
        gone &= state[H] >= 0.0
        dt[gone] = 0.0
        straight = state[Y] < STRAIGHT * rho
        straight &= (state[VX] > 0.0) | (state[Y] < 1e-17 * rho)
        done = np.abs(ds) * (1.0 + state[TAU]) < FINE
        done |= straight
        done |= np.abs(dt) < 1e-15
        done |= np.abs(state[H]) < 1e-15
        j = np.flatnonzero(done)
        if j.size:
            last = state.take(j, axis=1, mode="clip")
            grips = gone[j] | (straight[j] & (w[j] <= -1.0))
            end[:, ids[j]], how[ids[j]] = _finish(
                last, grips, dt[j], ds[j], w[j], c_x[j], c_v[j], stops[j]
            )
            if j.size == ids.size:
                break
            j = np.flatnonzero(~done)
            ids, state = ids[j], state.take(j, axis=1, mode="clip")
            rho, ds, w = rho[j], ds[j], w[j]
        step, q, kind = _steps(state, rho, ds, w)
        order = np.argsort(kind, kind="stable")
        ids, state = ids[order], state.take(order, axis=1, mode="clip")
        rho, q, step, over = rho[order], q[order], step[order], w[order] <= -1.0
        cuts = np.searchsorted(kind[order], range(len(RULES) + 1)).tolist()
        groups = zip(RULES, map(slice, cuts[:-1], cuts[1:]), strict=True)
        parts = [_advance(state[:, k], rho[k], q[k], step[k], rule) for rule, k in groups]
        _take_steps(state, parts, step, over)
        near = near_exit(state)
        j = np.flatnonzero(near)
        last = state.take(j, axis=1, mode="clip")
        land(last)
        end[:, ids[j]], how[ids[j]] = last[: H + 1], SLIPS
        j = np.flatnonzero(~near)
        if not j.size:
            break
        ids, state = ids[j], state.take(j, axis=1, mode="clip")
    else:  # rather an error than wrong numbers
        raise PsiError(
            f"the slip of {ids.size} designs is not followed to its end in {PASSES} steps, "
            f"one with tau = {state[TAU, 0]!r} and b = {state[B, 0]!r}; please report it"
        )
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
    grips: Mask,
    dt: Array,
    ds: Array,
    w: Array,
    c_x: Array,
    c_v: Array,
    stops: Mask,
) -> tuple[Array, NDArray[np.int64]]:
    """Take the last, tiny or straight, piece of slip as it was aimed.

    Returns:
        (4, n) t, v_x, |v_y| and distance to go at the end of slip, and how it ended.
    """
    t, vx, y, h, v, b, tau, _, _ = state
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


def _steps(state: Array, rho: Array, ds: Array, w: Array) -> tuple[Array, Array, NDArray[np.int8]]:
    """Lengths of the next steps in log time lambda.

    Returns:
        the steps, q = tan^2(theta/2), and the numbers of the rules that take them.
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
    return step, q, kind


def _advance(s: Array, rho: Array, q: Array, step: Array, rule: Rule) -> tuple[Array, ...]:
    return advance(s[VX], s[Y], rho, q, s[B], s[TAU], step, rule)


def _take_steps(state: Array, parts: list[tuple[Array, ...]], step: Array, over: Mask) -> None:
    """Move the states, in place, where the step does not lead past the exit or past rest.

    Where it does the state stays and its CAP is set to a better step.

    Args:
        state: the states.
        parts: time, integral of v_x dt, v_x and |v_y| of the steps, in pieces.
        step: the steps in log time.
        over: which of them lead to the end of slip.
    """
    t, vx, y, h, v, b, tau, invariant, cap = state
    dt, slid, vx1, y1 = (np.concatenate(piece) for piece in zip(*parts, strict=True))
    a = b * tau
    v1 = (invariant + a * (t + dt) + 0.4 * vx1) / 1.4
    h1 = h - ((invariant + a * (t + 0.5 * dt)) * dt + 0.4 * slid) / 1.4
    # five per cent past the aim is harmless: the next step goes back; not from the end of slip
    slack = -0.05 * np.abs(h)
    slack[over] = 0.0
    failed = h1 < slack
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
    t += dt
    state[VX : V + 1] = vx1, y1, h1, v1
