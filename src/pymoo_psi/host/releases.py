"""Where the supported releases of pymoo differ."""

from __future__ import annotations

import numpy as np

__all__ = ["random_generator"]


def random_generator(handed: np.random.Generator | None) -> np.random.Generator:
    """Return the generator that pymoo hands to an operator, so that its seed decides.

    Before 0.6.1.6 pymoo hands none, and seeds NumPy's global generator instead.
    """
    if handed is not None:
        return handed
    return np.random.default_rng(np.random.randint(2**31))  # noqa: NPY002 - that global one
