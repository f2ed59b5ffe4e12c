"""The table of tests: every tested point with its number, design and criteria."""

from __future__ import annotations

from dataclasses import dataclass, fields
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.pareto import nondominated

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["TestTable"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TestTable:
    """Every tested point of an investigation, in the order of testing.

    Attributes:
        numbers: ``(n,)`` numbers of the test points, from 1.
        X: ``(n, n_var)`` designs.
        F: ``(n, m)`` criteria, all minimised.
        G: ``(n, n_constr)`` inequality constraints, satisfied where <= 0.
        H: ``(n, n_eq)`` equality constraints.
        feasible: ``(n,)`` which designs satisfy all constraints.
    """

    __test__ = False  # not a test class, whatever its name suggests to pytest

    numbers: NDArray[np.int64]
    X: Array
    F: Array
    G: Array
    H: Array
    feasible: NDArray[np.bool_]

    def __len__(self) -> int:
        """Return the number of tested points."""
        return len(self.numbers)

    @classmethod
    def empty(cls) -> TestTable:
        """Return a table without any test, which takes the widths of the first block it gets."""
        none = np.zeros((0, 0))
        return cls(np.zeros(0, dtype=np.int64), none, none, none, none, np.zeros(0, dtype=bool))

    def extended(self, block: TestTable) -> TestTable:
        """Return this table with the tests of another behind its own."""
        if len(self) == 0:
            return block
        pairs = ((getattr(self, f.name), getattr(block, f.name)) for f in fields(self))
        return TestTable(*(np.concatenate(pair) for pair in pairs))

    @property
    def eligible(self) -> NDArray[np.bool_]:
        """``(n,)`` which designs are feasible and have finite criteria."""
        eligible: NDArray[np.bool_] = self.feasible & np.isfinite(self.F).all(axis=1)
        return eligible

    @property
    def pareto(self) -> NDArray[np.bool_]:
        """``(n,)`` which designs are Pareto optimal among the feasible ones."""
        mask = self.eligible
        mask[mask] = nondominated(self.F[mask])
        return mask

    def to_frame(self) -> pd.DataFrame:
        """Return the table with one row per test point.

        Returns:
            Index ``test_point``; columns x1…, f1…, g1…, h1…, ``feasible``, ``pareto``.
        """
        import pandas as pd

        blocks = {"x": self.X, "f": self.F, "g": self.G, "h": self.H}
        columns = {
            f"{letter}{j + 1}": block[:, j]
            for letter, block in blocks.items()
            for j in range(block.shape[1])
        }
        return pd.DataFrame(
            {**columns, "feasible": self.feasible, "pareto": self.pareto},
            index=pd.Index(self.numbers, name="test_point"),
        )

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table; the numbers read back are the same to the last bit."""
        self.to_frame().to_csv(path)
