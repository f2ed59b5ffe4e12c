"""Quasi-random values of uncertain quantities."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, invalid
from pymoo_psi.errors import ArgumentTypeError

Array = NDArray[np.float64]


def quantiles(argument: str, distributions: Mapping[str, Any], points: Array) -> Array:
    """Take points of the unit cube through the quantile functions of distributions.

    Args:
        argument: The user's argument that holds the distributions, for messages.
        distributions: By name, from ``scipy.stats`` or anything else with the quantile function
            ``ppf`` or ``icdf``.
        points: ``(n, k)`` points, none of them on the edge of the cube, where an unbounded
            distribution has no quantile.

    Returns:
        ``(n, k)`` finite values, a column for each distribution.

    Raises:
        ArgumentTypeError: A name is no text, or what it names is no distribution.
        ArgumentValueError: A distribution gives no finite values.
    """
    values = np.empty(points.shape)
    for j, (name, distribution) in enumerate(distributions.items()):
        # SciPy has both names: ppf of its old distributions, icdf of its new ones.
        quantile = getattr(distribution, "ppf", getattr(distribution, "icdf", None))
        if not isinstance(name, str) or not callable(quantile):
            raise ArgumentTypeError(
                f"{argument}[{name!r}] must be a distribution such as "
                f"scipy.stats.uniform(0.3, 0.2), got {distribution!r:.80}"
            )
        column = np.asarray(quantile(points[:, j]), dtype=np.float64)
        if column.shape != (len(points),) or not np.isfinite(column).all():
            rule = "a distribution with finite quantiles"
            raise invalid(f"{argument}[{name!r}]", rule, Received(str(column)))
        values[:, j] = column
    return values
