"""The decision page as data: designs in the order of drawing, columns, counts, remarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.page.columns import Column, Role, text_column
from pymoo_psi.page.groups import DOMINATED, OPTIMUM, PROTOTYPE, group_name

__all__ = ["PageData"]


@dataclass(frozen=True, eq=False)
class PageData:
    """What a page shows, the best design drawn last.

    Attributes:
        title: Heading of the page.
        columns: Criteria, then variables, then μ1, μ2, μ3; each with ``(n,)`` values.
        label_name: What the designs' labels are called, such as "test_point".
        labels: ``(n,)`` labels of the designs, integers or texts.
        rank: ``(n,)`` ranks of efficiency; -1 for prototypes.
        group: ``(n,)`` groups of drawing (:mod:`pymoo_psi.page.groups`).
        n_designs: How many designs there are, shown or not, without prototypes.
        remarks: What a reader must know, in short sentences.
        normalize: Whether the criteria are measured in units of their ranges.
        limits: Limits the page opens with, by name of the criterion.

    Example:
        >>> import pandas as pd
        >>> from pymoo_psi.page import decision_page
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]}, index=["A", "B", "C"])
        >>> data = decision_page(frame, ["cost", "mass"])
        >>> data.labels.tolist(), data.rank.tolist()
        (['A', 'C', 'B'], [0, 0, 6])
    """

    title: str
    columns: tuple[Column, ...]
    label_name: str
    labels: NDArray[Any]
    rank: NDArray[np.int32]
    group: NDArray[np.int32]
    n_designs: int
    remarks: tuple[str, ...]
    normalize: bool = True
    limits: Mapping[str, float] = field(default_factory=dict)

    def having(self, *roles: Role) -> list[Column]:
        """Return the columns with one of these roles.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0], "width": [1, 2, 3]})
            >>> data = decision_page(frame, ["cost", "mass"], variables=["width"])
            >>> [column.name for column in data.having("criterion", "variable")]
            ['cost', 'mass', 'width']
        """
        return [column for column in self.columns if column.role in roles]

    @property
    def marks(self) -> NDArray[np.object_]:
        """``(n,)`` what is special about a design; empty for most.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4, 5], "mass": [4, 1, 0, 5]})
            >>> decision_page(frame, ["cost", "mass"]).marks.tolist()
            ['dominated', '', '', 'Salukvadze optimum']
        """
        special = (PROTOTYPE, OPTIMUM, DOMINATED)
        return text_column([group_name(g) if g in special else "" for g in self.group.tolist()])

    @property
    def optima(self) -> list[str]:
        """The labels of the Salukvadze optimum.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]}, index=["A", "B", "C"])
            >>> decision_page(frame, ["cost", "mass"]).optima
            ['B']
        """
        return [str(label) for label in self.labels[self.group == OPTIMUM]]
