"""The parameters of the chute-conveyor, dimensionless as in Eq. (2.15) of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, finite_array, invalid


@dataclass(frozen=True, eq=False)
class ChuteParameters:
    """Everything that is given besides the two design variables.

    Each entry is a number, or an array where it varies from design to design; arrays broadcast
    against each other and against the designs.

    Attributes:
        mu: Friction coefficient μ > 0.
        c: Initial speed of the centre, V_C(0) / sqrt(L g) > 0 (0.3193 is 1 m/s for L = 1 m).
        r: Radius R / L > 0.
        omega0: The three initial spins (ω_X0, ω_Y0, ω_Z0), each a number or an array.

    Raises:
        ArgumentValueError: μ, c or r is not positive, or a value is not finite.
        ArgumentTypeError: A value is not a number.

    Example:
        >>> ChuteParameters(mu=0.4).c
        0.3193
    """

    mu: Any = 0.2
    c: Any = 0.3193
    r: Any = 0.1
    omega0: Sequence[Any] | NDArray[np.float64] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Check every entry; arrays are kept as copies."""
        for name in ("mu", "c", "r"):
            array = finite_array(name, getattr(self, name))
            if (array <= 0).any():
                raise invalid(name, "positive", Received(str(array[array <= 0].flat[0])))
            object.__setattr__(self, name, _kept(array))
        spins = tuple(self.omega0) if np.iterable(self.omega0) else ()
        if len(spins) != 3:
            rule = "three initial spins (omega_X0, omega_Y0, omega_Z0)"
            raise invalid("omega0", rule, self.omega0)
        kept = tuple(_kept(finite_array(f"omega0[{k}]", spin)) for k, spin in enumerate(spins))
        object.__setattr__(self, "omega0", kept)

    @property
    def columns(self) -> tuple[Any, ...]:
        """The six entries in the order μ, c, r, ω_X0, ω_Y0, ω_Z0.

        Example:
            >>> ChuteParameters(mu=0.4, c=0.5, r=0.1, omega0=(0, 1, 0)).columns
            (0.4, 0.5, 0.1, 0.0, 1.0, 0.0)
        """
        return (self.mu, self.c, self.r, *self.omega0)


def _kept(array: NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Return a number as such, and a copy of an array."""
    return array.copy() if array.ndim else float(array)
