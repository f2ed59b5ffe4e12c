"""A report on a test table as one HTML document."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

from jinja2 import Environment, PackageLoader

from pymoo_psi import plots
from pymoo_psi._names import asked_under_a_formulation
from pymoo_psi._output import write_document
from pymoo_psi._validation import Received, counted, instance, invalid
from pymoo_psi.pareto import EfficiencyRanking, capital, measured_in, number
from pymoo_psi.report import _contents
from pymoo_psi.report._contents import Choice, Columns
from pymoo_psi.table import TestTable

_DPI = 200  # of markers that are too many to be drawn one by one; as on good paper
# A number, or a share in per cent, or nothing. Columns of such cells are aligned to the right.
_NUMBER = re.compile(r"[-+−]?[\d.,\u00a0]+(e[-+]?\d+)?([ \u00a0]%)?|—|∞|-?inf|nan|")


@dataclass(frozen=True, eq=False, repr=False)
class DecisionReport:
    """A report on the choice among tested designs, made by :func:`decision_report`.

    Attributes:
        title: Heading of the report.
        about: Lines below the heading.
        ranking: The ranking of the feasible designs; None if none is feasible.
        cautions: Reasons not to rely on the optimum, the gravest first.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> decision_report(table, title="Brackets")
        DecisionReport('Brackets: test point 2 proposed of 3 Pareto-optimal designs')
    """

    title: str
    about: tuple[str, ...]
    ranking: EfficiencyRanking | None
    cautions: tuple[str, ...]
    _table: TestTable
    _choice: Choice | None

    def __str__(self) -> str:
        """Return the title and the design that is chosen or proposed."""
        choice = self._choice
        if choice is None:
            return f"{self.title}: no feasible design"
        n = counted(choice.ranking.pareto.sum(), "Pareto-optimal design")
        return f"{self.title}: {choice.name} {choice.word} of {n}"

    def __repr__(self) -> str:
        """Return the title and the design as an object's text."""
        return f"DecisionReport({str(self)!r})"

    def html(self) -> str:
        """Return the report as one HTML document that needs no network and runs no script.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[0, 4], [1, 1]])
            >>> "<script" in decision_report(table, title="A < B").html()
            False
        """
        environment = Environment(
            loader=PackageLoader("pymoo_psi.report", ""),
            autoescape=True,
            finalize=_printable,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        environment.filters |= {"grid": _grid, "image": _image, "capital": capital}
        return environment.get_template("report.html").render(
            title=self.title,
            about=self.about,
            data=self._table,
            contents=_contents,
            choice=self._choice,
            counted=counted,
            measured_in=measured_in,
            number=number,
            plots=plots,
        )

    def save(self, path: str | PathLike[str]) -> None:
        """Write the report, whole or not at all.

        Raises:
            OSError: The file cannot be written there.

        Example:
            >>> import pathlib, tempfile
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[0, 4], [1, 1]])
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = pathlib.Path(folder, "report.html")
            ...     decision_report(table, title="Brackets").save(path)
            ...     "Brackets" in path.read_text("utf-8")
            True
        """
        write_document(path, self.html())


def _printable(value: Any) -> Any:
    """Return a text without control characters, in which per cent signs stay with their numbers."""
    if not isinstance(value, str) or hasattr(value, "__html__"):
        return value
    text = re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]", "\N{REPLACEMENT CHARACTER}", value)
    return text.replace(" %", "\N{NO-BREAK SPACE}%")


def _grid(columns: Columns) -> list[list[tuple[str, str]]]:
    """Return the rows of a table, the headings first, each cell with its class, "n" for numbers."""
    classes = []
    for texts in columns.values():
        if all(map(_NUMBER.fullmatch, texts)):
            classes.append("n")
        else:
            classes.append("")
    rows = [tuple(columns), *zip(*columns.values(), strict=True)]
    return [list(zip(row, classes, strict=True)) for row in rows]


def _image(figure: plots.Drawing) -> str:
    """Return a figure as the address of an image that holds it.

    Nothing drawn in an image can reach the rest of the document.
    """
    data = b64encode(plots.svg_of(figure, _DPI).encode("utf-8")).decode("ascii")
    return f"data:image/svg+xml;base64,{data}"


@asked_under_a_formulation
def decision_report(
    table: TestTable,
    *,
    design: int | str | None = None,
    reason: str = "",
    selectors: Mapping[str, Any] | None = None,
    title: str = "Report on a choice",
    about: Sequence[str] = (),
) -> DecisionReport:
    """Report on tests and on the design that is chosen or proposed among them.

    The first page has all that a decision needs, the others what it is based on.

    Args:
        table: The tests, with names, directions and units; :func:`~pymoo_psi.table.read_table`
            opens any file. The report says what each limit of its formulation costs.
        design: Number or label of the chosen design, a feasible one. By default none is chosen, and
            the Salukvadze optimum is proposed.
        reason: Reason for the choice.
        selectors: Further selectors by name, as for
            :func:`pymoo_psi.selection.compare_selectors`. By default the knee, the least bad worst
            objective, and the optimum in the other distances.
        title: Heading of the report.
        about: Lines below the heading, such as the origin of the tests.

    Raises:
        ArgumentValueError: The table has no test or no objective, a selector does not fit, or the
            design is not feasible.
        ArgumentTypeError: ``table`` is not a test table.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> report = decision_report(table.under(limits={"f1": 2}), title="Brackets")
        >>> print(report)
        Brackets: test point 1 proposed of 2 Pareto-optimal designs
        >>> "<h2>What limits cost</h2>" in report.html()
        True
    """
    remedy = "PSI and investigate return one, read_table opens any file"
    instance("table", table, TestTable, remedy)
    if len(table) == 0 or not table.layout.objectives:
        raise invalid("the table", "one with tests and objectives", Received(repr(table)))
    eligible = table.eligible()
    row = None
    if design is not None:
        row = table.row_of(design)
        if not eligible[row]:
            raise invalid("design", "the number or label of a feasible test", design)
    if not eligible.any():
        return DecisionReport(title, tuple(about), None, (), table, None)
    ranking = table.feasible_ranking()
    choice = Choice(table, ranking, row, reason, selectors)
    return DecisionReport(title, tuple(about), ranking, choice.cautions, table, choice)
