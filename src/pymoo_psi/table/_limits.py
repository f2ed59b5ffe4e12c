"""Limits on criteria, f_j <= f_j**, which are set after the tests and change none of them.

A limit is given in the criterion's own sense: the least value allowed of one that is maximised.
"""

from __future__ import annotations

import numbers
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.table._layout import Layout, Limits

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def limit_vector(limits: Limits | None, layout: Layout) -> dict[int, float]:
    """Return the limits on F by index of the criterion, in the order of the criteria.

    Raises:
        ArgumentValueError: A criterion is not known or named twice, a limit is NaN.
        ArgumentTypeError: The limits are no mapping, a limit is no number.
    """
    if limits is None:
        return {}
    if not isinstance(limits, Mapping):
        raise ArgumentTypeError(
            f"limits must map criteria to numbers, such as {{'f1': 2.5}}, got {limits!r:.80}"
        )
    result: dict[int, float] = {}
    for key, limit in limits.items():
        j = layout.objective(key)
        if j in result:
            raise invalid("limits", "given once a criterion", limits)
        if isinstance(limit, (bool, np.bool_)) or not isinstance(limit, numbers.Real):
            raise ArgumentTypeError(f"the limit on {key!r} must be a number, got {limit!r:.80}")
        if isinstance(limit, int) and abs(limit) >= 2**1023:
            raise invalid(f"the limit on {key!r}", "within what float64 reaches", limit)
        # Infinity is a limit that every computed value keeps; NaN would reject all designs unsaid.
        if np.isnan(float(limit)):
            hint = "leave the criterion out where it has no limit"
            raise invalid(f"the limit on {key!r}", "a number", Received("nan"), hint)
        result[j] = float(limit) * float(layout.sign[j])
    # The order of the criteria, not of the mapping: columns of violations stand in it.
    return dict(sorted(result.items()))


def within_limits(F: Array, limits: Mapping[int, float]) -> Mask:
    """``(n,)`` which rows of the ``(n, m)`` criteria keep every limit; NaN keeps none."""
    mask = np.ones(len(F), dtype=bool)  # <= and not >: NaN must keep none
    for j, limit in limits.items():
        mask &= F[:, j] <= limit
    return mask
