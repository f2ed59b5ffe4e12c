"""The decision page: from a source of designs to the file, and what a decision file keeps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._output import whole_file
from pymoo_psi._renamed import asked_under_a_formulation
from pymoo_psi._validation import Received, counted, instance, invalid, known_name, mapping
from pymoo_psi.page._document import html_of
from pymoo_psi.page._payload import payload, values_of
from pymoo_psi.pareto import EfficiencyRanking, Objectives, cautions
from pymoo_psi.table import Bounds, Formulation, TestTable, bounds_of, read_table

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False, repr=False)
class DecisionPage:
    """A page to decide on a Pareto set with; :func:`decision_page` makes it.

    Attributes:
        title: Heading of the page.
        table: The designs that are on the page.
        prototype: Existing designs to compare with; None if there are none.
        formulation: The objectives, limits, choice and reason that the page opens with.
        cautions: Reasons not to rely on the optimum of all designs, whatever the limits.
        origin: The file that the designs are from, for the print; empty if there is none.

    Example:
        >>> import pandas as pd
        >>> from pymoo_psi.page import decision_page
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
        >>> decision_page(frame, ["cost", "mass"], title="Brackets")
        DecisionPage('Brackets': 3 designs)
    """

    title: str
    table: TestTable
    prototype: TestTable | None
    formulation: Formulation
    cautions: tuple[str, ...]
    origin: str = ""

    def __repr__(self) -> str:
        """Return the title and how many designs there are."""
        return f"DecisionPage({self.title!r}: {counted(len(self.table), 'design')})"

    def html(self) -> str:
        """Return the page as one HTML document that needs no network.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
            >>> html = decision_page(frame, ["cost", "mass"], title="Brackets").html()
            >>> html.startswith("<!DOCTYPE html>"), "Brackets" in html
            (True, True)
        """
        asked, layout = self.formulation, self.table.layout
        # What a decision file repeats, so that the commands compute the same columns.
        opens_with = {f.name: getattr(asked, f.name) for f in fields(asked)} | {
            "objectives": list(layout.objectives),
            "maximize": [name for name in layout.objectives if name in layout.maximize],
            "limits": _json_limits(bounds_of(asked.limits, layout)),
            "ranges": dict(self.table.formulation.ranges or {}),
        }
        content = payload(self.title, self.table, self.prototype, opens_with, self.cautions)
        return html_of(self.title, content | {"origin": self.origin})

    def _repr_html_(self) -> str:
        """Return the page as a notebook shows it: in a frame that reaches nothing outside."""
        # What a notebook stores is UTF-8, which the name of a file need not be; see save.
        text = self.html().encode("utf-8", "replace").decode()
        # Without allow-same-origin the scripts of the page see neither notebook nor cookies.
        return (
            f'<iframe srcdoc="{escape(text)}" sandbox="allow-scripts allow-downloads allow-modals" '
            'style="width: 100%; height: 90vh; min-height: 600px; border: 0"></iframe>'
        )

    def save(self, path: str | PathLike[str]) -> None:
        """Write the page, whole or not at all.

        Raises:
            OSError: The file cannot be written there.

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
            # A title may be the name of a file that is no Unicode.
            written.write_text(html, encoding="utf-8", errors="replace")


@asked_under_a_formulation
def decision_page(
    source: Any,
    formulation: Formulation | Sequence[str] | None = None,
    *,
    variables: Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    prototype: Any = None,
    title: str = "Pareto set",
) -> DecisionPage:
    """Return a page to decide on a Pareto set with, to be saved as one HTML file.

    On top stands the best compromise (:func:`pymoo_psi.rank_of_efficiency`) among the designs that
    are left under the limits that the reader sets, proposed until one is chosen, why it is that,
    and what others would cost. Linked plots and a table show what is left, which is compared,
    chosen from and exported as CSV. Limits, choice and reason are kept in the page as its reader
    saves it, and in a decision file. Designs that failed or violate
    constraints are left out and counted.

    Args:
        source: Anything that :func:`~pymoo_psi.table.read_table` opens: a test table, a data frame
            with one row for each design, an array of objectives, a study, a file. Or a ranking, or
            a result of pymoo: its ``F``, minimised, beside its ``X`` where these are numbers.
        formulation: Objectives, directions, computed columns; the page opens with its limits, which
            its reader can move, its choice and its reason, such as those of a decision file that
            the page saved (``Formulation.read_json``). Or names of the objectives, all minimised.
            That of the source unless given.
        variables: Names of the columns with design variables; as the source tells unless given.
        units: Units of columns by name, beside those that the source tells.
        prototype: Existing designs to compare with, a source as above. They are not ranked and
            stay on the page whatever the limits.
        title: Heading of the page.

    Returns:
        The page: ``.html()`` and ``.save(path)``.

    Raises:
        ArgumentValueError: The source cannot be read, cannot be ranked, has no feasible design, or
            does not have the columns that the formulation or the limits name.
        ArgumentTypeError: An objective is not numbers, or an argument has a wrong type.
        OSError: A file cannot be opened.

    Example:
        >>> import pandas as pd
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]}, index=["A", "B", "C"])
        >>> page = decision_page(frame, ["cost", "mass"], units={"mass": "kg"}, title="Brackets")
        >>> page, page.table.best().names
        (DecisionPage('Brackets': 3 designs), ['B'])
    """
    if formulation is not None and not isinstance(formulation, Formulation):
        formulation = Formulation(formulation)
    if isinstance(source, EfficiencyRanking) or hasattr(source, "opt"):
        source, formulation = _framed(source, formulation or Formulation())
    table = read_table(source, formulation, variables=variables, drop_incomplete=True)
    # Limits are set on the page, where their reader can move them.
    free = table.under(limits={})
    designs = free.rows(free.feasible())
    if len(designs) == 0:
        rule = "of one feasible design or more"
        raise invalid("source", rule, Received(f"none in {counted(len(free), 'design')}"))
    layout = designs.layout
    for name in units or {}:
        known_name("units", name, layout.columns)
    layout = replace(layout, units={**layout.units, **(units or {})})
    designs = replace(designs, layout=layout, remarks=(*free.remarks, *_left_out(free)))
    if not designs.under(limits=table.formulation.limits).feasible().any():
        raise invalid("limits", "kept by one design or more", Received(f"none of {len(designs)}"))
    existing = None
    if prototype is not None:
        question = replace(table.formulation, limits={}, ranges=None, page={})
        existing = read_table(prototype, question)
    origin = ""
    if isinstance(source, (str, PathLike)):
        origin = Path(source).name
    return DecisionPage(
        title=str(title),
        table=designs,
        prototype=existing,
        formulation=replace(table.formulation, limits=_json_limits(table.limits)),
        cautions=tuple(map(str, cautions(designs.feasible_ranking()))),
        origin=origin,
    )


def _framed(source: Any, asked: Formulation) -> tuple[pd.DataFrame, Formulation]:
    """Return the designs of a ranking or a result of pymoo as a frame, with what is asked of it."""
    import pandas as pd

    found = Objectives.of(source)
    names = list(map(str, found.names))
    frame = pd.DataFrame(found.values, list(found.labels), names)
    X = getattr(source, "X", None)
    if isinstance(X, np.ndarray) and X.dtype.kind in "biuf":
        X = np.atleast_2d(X)
        frame[[f"x{j + 1}" for j in range(X.shape[1])]] = X
    if not asked.objectives:
        more = [name for name, sign in zip(names, found.sign, strict=True) if sign < 0]
        asked = replace(asked, objectives=names, maximize=[*asked.maximize, *more])
    return frame, asked


def kept_designs(table: TestTable, formulation: Formulation) -> NDArray[np.bool_]:
    """``(n,)`` which designs the page keeps by ticked texts, as its decision file says.

    Limits on numbers are the formulation's, see :meth:`TestTable.under`.

    Raises:
        ArgumentValueError: There is no such column.
        ArgumentTypeError: What is kept of a column is no list of texts.

    Example:
        >>> table = TestTable.of([1, 2], [["oak"], ["tin"]], [[1.0], [2.0]])
        >>> decided = Formulation(page={"state": {"categories": {"x1": ["tin"]}}})
        >>> kept_designs(table, decided).tolist()
        [False, True]
    """
    state, mask = formulation.page.get("state", {}), np.full(len(table), True)
    kept = mapping("page.state.categories", state.get("categories", {}), "columns to lists")
    for name, texts in kept.items():
        known_name("categories", name, [*table.layout.columns, *table.extra])
        instance(f"page.state.categories[{name!r}]", texts, list, "it holds the texts kept")
        mask &= np.isin(values_of(name, table).astype(str), texts)
    return mask


def _json_limits(bounds: Bounds) -> dict[str, Any]:
    return {
        name: [float(end) if np.isfinite(end) else None for end in pair]
        for name, pair in bounds.items()
    }


def _left_out(table: TestTable) -> list[str]:
    """Say how many designs of a table are not on the page, and why."""
    numbers = {"failed": 0, "infeasible": 0} | Counter(table.status.tolist())
    # What a file of offers lacks has been said.
    if any("incomplete design" in remark for remark in table.remarks):
        numbers["failed"] = 0
    why = {"failed": "that failed", "infeasible": "with violated constraints"}
    return [
        f"Not on the page: {counted(numbers[status], 'design')} {text}."
        for status, text in why.items()
        if numbers[status]
    ]
