"""The decision page with its data, its text and its file."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from os import PathLike

from pymoo_psi.errors import PsiError
from pymoo_psi.investigation.whole_file import whole_file
from pymoo_psi.page.content import PageData
from pymoo_psi.page.groups import PROTOTYPE

__all__ = ["DecisionPage"]


@dataclass(frozen=True, eq=False, repr=False)
class DecisionPage(PageData):
    """A page to decide on a Pareto set with; :func:`decision_page` makes it.

    See :class:`PageData` for the attributes.

    Example:
        >>> import pandas as pd
        >>> from pymoo_psi.page import decision_page
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
        >>> decision_page(frame, ["cost", "mass"], title="Brackets")
        DecisionPage('Brackets': 3 of 3 designs)
    """

    def __repr__(self) -> str:
        """Return the title and how many designs are shown."""
        shown = int((self.group != PROTOTYPE).sum())
        return f"DecisionPage({self.title!r}: {shown} of {self.n_designs} designs)"

    def html(self) -> str:
        """Return the page as one HTML document that needs no network.

        Raises:
            PsiError: Bokeh is not installed.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
            >>> html = decision_page(frame, ["cost", "mass"], title="Brackets").html()
            >>> html.startswith("<!DOCTYPE html>"), "Brackets" in html
            (True, True)
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

        Example:
            >>> import pathlib, tempfile
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = pathlib.Path(folder, "page.html")
            ...     decision_page(frame, ["cost", "mass"], title="Brackets").save(path)
            ...     "Brackets" in path.read_text("utf-8")
            True
        """
        html = self.html()
        with whole_file(path) as written:
            written.write_text(html, encoding="utf-8")
