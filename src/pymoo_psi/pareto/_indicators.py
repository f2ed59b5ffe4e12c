"""Quality indicators of a set of points.

All objectives are minimised. IGD+ (Ishibuchi et al. 2015), the additive epsilon indicator (Zitzler
et al. 2003) and the ranks of nondominated sorting are moocore's own functions.
"""

from __future__ import annotations

import moocore
import numpy as np
from moocore import epsilon_additive as epsilon_additive
from moocore import igd_plus as igd_plus
from moocore import pareto_rank as pareto_rank
from numpy.typing import ArrayLike

from pymoo_psi._validation import positive_number, real_array
from pymoo_psi.sequences import lp_tau

# By number of objectives, the number of points whose volume moocore (0.3) computes within half a
# second on a slow machine.
_EXACT = (0, *[10**6] * 4, 7000, 600, 190, 95, 60, 44, 36, 25, 20, 17, 15, 13)
_SHIFTS = 16
_PROBES = 2**11  # the number of points of each shift


def hypervolume(F: ArrayLike, reference_point: float) -> tuple[float, float]:
    """Return the share of a cube that a set dominates, 0 to 1, and its standard error.

    The value is exact, with error 0, if it takes about a second at most (Zitzler and Thiele 1998):
    for up to four objectives always, for eight objectives up to 95 points. The time grows with a
    power of the number of points about as high as the number of objectives. For larger sets it is
    the share of 2^15 LPτ points that are dominated, in 16 shifts of 2^11 points modulo 1 (Cranley
    and Patterson 1976), the same for all sets.

    Args:
        F: ``(n, m)`` points, n >= 0; only those below the reference point count.
        reference_point: r > 0; the cube is 0 to r in every objective. A point below 0 counts as
            one at 0.

    Raises:
        ArgumentValueError: The reference point is not above 0.
        ArgumentTypeError: An argument does not hold real numbers.
    """
    F = real_array("F", F)
    reference_point = positive_number("reference_point", reference_point)
    inside = (reference_point > F).all(axis=1)
    points = np.maximum(F[inside], 0.0) / reference_point
    n, m = points.shape
    if n == 0:
        return 0.0, 0.0
    if m < len(_EXACT) and n <= _EXACT[m]:
        return float(moocore.hypervolume(points, ref=1.0)), 0.0
    low = points.min(axis=0)  # no point below it is dominated
    shares = []
    probes = lp_tau(_PROBES, m)
    for shift in np.random.default_rng(0).random((_SHIFTS, m)):
        free = low + (1 - low) * ((probes + shift) % 1)
        for point in points:
            free = free[~(point <= free).all(axis=1)]
        shares.append(1 - len(free) / _PROBES)
    volumes = np.array(shares) * np.prod(1 - low)
    return float(volumes.mean()), float(volumes.std(ddof=1) / np.sqrt(_SHIFTS))
