"""From a frame of designs to the page, as text or as a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from os import PathLike
from typing import TYPE_CHECKING, Any

from pymoo_psi.errors import PsiError
from pymoo_psi.investigation.whole_file import whole_file
from pymoo_psi.page.content import page_data

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["decision_page", "save_page"]


def decision_page(
    frame: pd.DataFrame,
    objectives: Sequence[str],
    *,
    variables: Sequence[str] = (),
    maximize: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    label: str | None = None,
    normalize: bool = True,
    prototype: pd.DataFrame | Mapping[str, Any] | None = None,
    limits: Mapping[str, float] | None = None,
    title: str = "Pareto set",
) -> str:
    """Return a page to decide on a Pareto set with, one HTML file that needs no network.

    The designs are ranked (:func:`pymoo_psi.rank_of_efficiency`). Linked plots show the criteria,
    the design variables and the geometric criteria; limits on criteria and a choice of ranks
    reduce them, the table and the parallel coordinates to what is left, which the reader exports
    as CSV. Dominated designs can be switched on. Of more than 20 000 designs the ranked ones are
    shown, and the page says so.

    Args:
        frame: One row per design, two or more.
        objectives: Names of the columns with the criteria; finite numbers.
        variables: Names of the columns with the design variables. Numbers, which may be missing,
            are plotted; texts are in the table only.
        maximize: Names of the objectives of which more is better.
        units: Units of columns by name.
        label: Name of the column with the designs' numbers or names; the frame's index unless
            given.
        normalize: Rank with each objective in units of its range.
        prototype: An existing design, or several as a frame, with a value for each objective.
            It is not ranked and stays on the page whatever the limits.
        limits: Limits on objectives that are set when the page opens and that its reader can move:
            at most this, or at least for an objective of which more is better.
        title: Heading of the page.

    Returns:
        The HTML.

    Raises:
        ArgumentValueError: A name is not a column or occurs twice; there are fewer than two
            designs; an objective is missing somewhere or infinite; a limit leaves no design.
        ArgumentTypeError: An objective is not numbers, or an argument has a wrong type.
        PsiError: Bokeh is not installed.
    """
    data = page_data(
        frame, objectives, variables=variables, maximize=maximize, units=units, label=label,
        normalize=normalize, prototype=prototype, limits=limits, title=title,
    )  # fmt: skip
    try:
        import_module("bokeh")
    except ImportError:
        raise PsiError("the page needs bokeh: pip install 'pymoo-psi[page]'") from None
    from pymoo_psi.page.document import html_of

    return html_of(data)


def save_page(
    frame: pd.DataFrame,
    objectives: Sequence[str],
    path: str | PathLike[str],
    *,
    variables: Sequence[str] = (),
    maximize: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    label: str | None = None,
    normalize: bool = True,
    prototype: pd.DataFrame | Mapping[str, Any] | None = None,
    limits: Mapping[str, float] | None = None,
    title: str = "Pareto set",
) -> None:
    """Write the page of :func:`decision_page`, whole or not at all.

    Raises:
        OSError: The file cannot be written there.
        PsiError: As for :func:`decision_page`.
    """
    html = decision_page(
        frame, objectives, variables=variables, maximize=maximize, units=units, label=label,
        normalize=normalize, prototype=prototype, limits=limits, title=title,
    )  # fmt: skip
    with whole_file(path) as written:
        written.write_text(html, encoding="utf-8")
