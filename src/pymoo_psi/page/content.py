"""The decision page as data: designs in the order of drawing, columns, counts, remarks."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.errors import PsiError
from pymoo_psi.investigation.whole_file import whole_file
from pymoo_psi.page.columns import Column, Role, text_column
from pymoo_psi.page.groups import DOMINATED, OPTIMUM, PROTOTYPE, group_name

__all__ = ["DecisionPage"]


@dataclass(frozen=True, eq=False, repr=False)
class DecisionPage:
    """What a page shows, the best design drawn last; made by :func:`decision_page`.

    Attributes:
        title: Heading of the page.
        columns: Criteria, then variables, then μ1, μ2, μ3; each with ``(n,)`` values.
        label_name: What the designs' labels are called, such as "test_point".
        labels: ``(n,)`` labels of the designs, integers or texts.
        rank: ``(n,)`` ranks of efficiency; -1 for prototypes.
        group: ``(n,)`` groups of drawing (:mod:`pymoo_psi.page.groups`).
        n_designs: How many designs there are, shown or not, without prototypes.
        remarks: What a reader must know, in short sentences.
    """

    title: str
    columns: tuple[Column, ...]
    label_name: str
    labels: NDArray[Any]
    rank: NDArray[np.int32]
    group: NDArray[np.int32]
    n_designs: int
    remarks: tuple[str, ...]

    def having(self, *roles: Role) -> list[Column]:
        """Return the columns with one of these roles."""
        return [column for column in self.columns if column.role in roles]

    @property
    def marks(self) -> NDArray[np.object_]:
        """``(n,)`` what is special about a design; empty for most."""
        special = (PROTOTYPE, OPTIMUM, DOMINATED)
        return text_column([group_name(g) if g in special else "" for g in self.group.tolist()])

    @property
    def optima(self) -> list[str]:
        """The labels of the Salukvadze optimum."""
        return [str(label) for label in self.labels[self.group == OPTIMUM]]

    def __repr__(self) -> str:
        """Return the title and how many designs are shown."""
        shown = int((self.group != PROTOTYPE).sum())
        return f"DecisionPage({self.title!r}: {shown} of {self.n_designs} designs)"

    def html(self) -> str:
        """Return the page as one HTML document that needs no network.

        Raises:
            PsiError: Bokeh is not installed.
        """
        try:
            import_module("bokeh")
        except ImportError:
            raise PsiError("the page needs bokeh: pip install 'pymoo-psi[page]'") from None
        from pymoo_psi.page.document import html_of

        return html_of(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the page, whole or not at all.

        Raises:
            OSError: The file cannot be written there.
            PsiError: Bokeh is not installed.
        """
        html = self.html()
        with whole_file(path) as written:
            written.write_text(html, encoding="utf-8")
