"""The motion from the entrance to the exit, and the four criteria of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi.arguments import known_name
from pymoo_psi.chute.parameters import ChuteParameters
from pymoo_psi.chute.reference import integrate_all
from pymoo_psi.chute.rolling import roll
from pymoo_psi.chute.state import Motion, broadcast

__all__ = ["MODELS", "criteria", "motion"]

Array = NDArray[np.float64]

_SOLVERS: dict[str, Callable[..., dict[str, Any]]] = {"full": integrate_all, "rolling": roll}

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
