"""The motion from the entrance to the exit, and the four criteria of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import known_name
from pymoo_psi.chute._exact import slip_then_roll
from pymoo_psi.chute._one_design import solve_one
from pymoo_psi.chute._parameters import ChuteParameters
from pymoo_psi.chute._rolling import roll
from pymoo_psi.chute._state import Motion, broadcast

Array = NDArray[np.float64]

_SOLVERS: dict[str, Callable[..., dict[str, Any]]] = {"full": slip_then_roll, "rolling": roll}

MODELS = tuple(_SOLVERS)
"""``"full"``: slip, then roll (Eqs. 2.16–2.21). ``"rolling"``: rolling from the start (2.20)."""


def motion(
    u1: ArrayLike,
    v_p: ArrayLike,
    parameters: ChuteParameters | None = None,
    *,
    model: str = "full",
) -> Motion:
    """Move the sphere from the entrance to the exit.

    Args:
        u1: tan α >= 0, any shape that broadcasts with the others.
        v_p: Speed of the plane, likewise.
        parameters: The parameters of the chute; :class:`ChuteParameters` () by default.
        model: ``"full"``, the paper's model MM, or ``"rolling"``, rolling from the start.

    Returns:
        The motion; its arrays have the common shape.

    Raises:
        ArgumentValueError: A value is not finite, u1 is negative, the shapes do not broadcast or
            the model is unknown.
        ArgumentTypeError: An argument is not numeric.

    Example:
        >>> m = motion(0.2635, 0.1072, ChuteParameters(mu=0.4), model="rolling")
        >>> round(float(m.time), 4), round(float(m.exit_speed), 4)
        (2.0459, 0.6917)
    """
    solve = _SOLVERS[known_name("model", model, MODELS)]
    u1, v_p, *columns = broadcast(u1, v_p, parameters)
    return Motion(u1=u1, v_p=v_p, **solve(u1, v_p, *columns))


def criteria(motion: Motion) -> Array:
    """Return the four criteria of a motion, all to be minimised, Eqs. (3.1) to (3.4).

    f1 = t(1), the time; f2 = |ΔE − u1| = |W − D|, the energy that enters from the plane or is
    lost to friction, on balance; f3 = tan α, the height; f4 = v_P, the speed of the plane.
    Where the sphere stalls before the exit f1 and f2 are infinite.

    Args:
        motion: The motion of n designs.

    Returns:
        ``(n, 4)`` array, or (..., 4) for designs of any other shape.

    Example:
        >>> criteria(motion([0.2635], [0.1072], ChuteParameters(mu=0.4), model="rolling")).round(4)
        array([[2.0459, 0.0476, 0.2635, 0.1072]])
    """
    balance = np.abs(motion.plane_work - motion.dissipation)
    f2 = np.where(motion.reached < 1, np.inf, balance)
    return np.stack([motion.time, f2, motion.u1, motion.v_p], axis=-1)


def criteria_of_one(
    u1: float, v_p: float, parameters: ChuteParameters, model: str
) -> tuple[tuple[float, float, float, float], float]:
    """Return the four criteria of one design and the η it reaches, sparing the arrays.

    The values are those of :func:`criteria` to rounding; u1, v_P and the parameters are numbers.
    """
    if model != "full" or not (u1 >= 0 and math.isfinite(u1) and math.isfinite(v_p)):
        solved = motion(u1, v_p, parameters, model=model)
        f1, f2, f3, f4 = criteria(solved).tolist()
        return (f1, f2, f3, f4), float(solved.reached)
    time, *_, work, lost, reached = solve_one(u1, v_p, *parameters.columns)
    return (time, abs(work - lost) if reached == 1 else math.inf, u1, v_p), reached
