"""The exact motion compared with ``solve_ivp``: first the answers, then the speed, in one run.

    python -m benchmarks.motion

The rival integrates the slip phase of every design in time with DOP853 at rtol 1e-10 and two
terminal events, the exit and the end of slip; rolling then follows from the closed form. This is
what one would write with SciPy. Both solve designs within the default bounds for μ = 0.2, 0.4 and
0.6. They are timed alternately, on one core, in processor time, so that a change of the machine's
speed affects both.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.machine import describe_machine, processor_seconds, sized
from pymoo_psi import lp_tau
from pymoo_psi.chute import ChuteParameters, criteria, motion

BATCH = sized(65_536, 4096)
SAMPLE = sized(150, 5)  # designs that the rival integrates for each μ
C = 0.3193


def rival(u1: float, v_p: float, mu: float) -> tuple[float, float]:
    """Return f1 and f2 of one design by SciPy."""
    length = math.hypot(1, u1)
    a = u1 / length
    b = mu / length

    def field(t, y):
        _, v, v_x, v_y, _ = y
        rho = math.hypot(v_x, v_y)
        cosine = v_x / rho
        sine = v_y / rho
        return v, a - b * cosine, a - 3.5 * b * cosine, -2.5 * b * sine, b * rho

    def exit_reached(t, y):
        return y[0] - length

    def slip_ended(t, y):
        return math.hypot(y[2], y[3]) - 1e-9

    exit_reached.terminal = True
    slip_ended.terminal = True
    solution = solve_ivp(
        field,
        (0, 50),
        (0, C, C, -v_p, 0),
        "DOP853",
        rtol=1e-10,
        atol=1e-12,
        events=(exit_reached, slip_ended),
    )
    x, v, _, v_y, lost = solution.y[:, -1]
    t = solution.t[-1]
    if len(solution.t_events[1]) > 0:  # it rolls for the rest of the way
        end = math.sqrt(v * v + 2 * a / 1.4 * (length - x))
        t = t + 2 * (length - x) / (end + v)
        v_y = 0.0
    return t, abs(0.4 * v_p * (v_y + v_p) - lost)


def designs(n: int, mu: float) -> np.ndarray:
    """Return the first LPτ points within the default bounds."""
    return np.array([0, 0.1]) + lp_tau(n, 2) * [3.5 * mu, 5.9]


def compare_speed(mu: float) -> float:
    """Print the figures for one μ and return how many times faster the exact motion is."""
    parameters = ChuteParameters(mu=mu)
    X = designs(BATCH, mu)
    sample = designs(SAMPLE + 1, mu)[1:]
    ours = criteria(motion(*sample.T, parameters))
    theirs = np.array([rival(*x, mu) for x in sample.tolist()])
    worst_f1 = np.abs(ours[:, 0] / theirs[:, 0] - 1).max()
    worst_f2 = np.abs(ours[:, 1] - theirs[:, 1]).max()
    assert max(worst_f1, worst_f2) < 1e-7, "the rivals do not solve the same problem"
    ratios = []
    for _ in range(3):
        slow = processor_seconds(lambda: [rival(*x, mu) for x in sample.tolist()]) / SAMPLE
        fast = processor_seconds(lambda: motion(*X.T, parameters)) / BATCH
        ratios.append(slow / fast)
    ratio = float(np.median(ratios))
    print(
        f"mu = {mu}: answers agree to {worst_f1:.0e} (f1, relative) and {worst_f2:.0e} (f2); "
        f"solve_ivp {slow * 1e3:.2f} ms, motion {fast * 1e6:.2f} µs a design; "
        f"ratio {ratio:.0f}"
    )
    return ratio


def microseconds_of_one() -> float:
    """Return the processor time of one motion at a time."""
    parameters = ChuteParameters(mu=0.4)
    X = designs(2000, 0.4)
    return processor_seconds(lambda: [motion(*x, parameters) for x in X], 5) / len(X) * 1e6


def main() -> None:
    """Print all figures."""
    print(describe_machine())
    ratios = [compare_speed(mu) for mu in (0.2, 0.4, 0.6)]
    print(f"geometric mean of the ratios: {np.exp(np.mean(np.log(ratios))):.0f}")
    print(f"one motion at a time: {microseconds_of_one():.0f} µs")


if __name__ == "__main__":
    main()
