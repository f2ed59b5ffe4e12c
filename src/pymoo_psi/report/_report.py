"""From a test table to the report: ranked, explained, one HTML document."""

from __future__ import annotations

import io
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

from jinja2 import Environment, PackageLoader
from matplotlib import rc_context

from pymoo_psi import plots
from pymoo_psi._output import whole_file
from pymoo_psi._renamed import asked_under_a_formulation
from pymoo_psi._validation import Received, counted, instance, invalid
from pymoo_psi.pareto import EfficiencyRanking, capital, measured_in, number
from pymoo_psi.report._contents import Case, Columns
from pymoo_psi.table import TestTable

_DPI = 200  # of the marks that are too many for a drawing of each, as on good paper
# A number, with or without its share: columns of such cells stand to the right.
_NUMBER = re.compile(r"[-+−]?[\d.,\u00a0]+(e[-+]?\d+)?([ \u00a0]%)?|—|∞|-?inf|nan|")


@dataclass(frozen=True, eq=False, repr=False)
class DecisionReport:
    """A report on a choice, or a proposal, among tested designs, of :func:`decision_report`.

    Attributes:
        title: Its heading.
        about: Lines below the heading.
        ranking: The ranking of the feasible designs; ``None`` if none is feasible.
        cautions: What speaks against relying on the optimum, the gravest first.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> decision_report(table, title="Brackets")
        DecisionReport('Brackets: test point 2 proposed of 3 Pareto-optimal designs')
    """

    title: str
    about: tuple[str, ...]
    ranking: EfficiencyRanking | None
    cautions: tuple[str, ...]
    _case: Case

    def __str__(self) -> str:
        """Return the title and what is chosen."""
        if self.ranking is None:
            return f"{self.title}: no feasible design"
        front = counted(int(self.ranking.pareto.sum()), "Pareto-optimal design")
        return f"{self.title}: {self._case.name} {self._case.word} of {front}"

    def __repr__(self) -> str:
        """Return the title and what is chosen, as an object."""
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
            case=self._case,
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
        html = self.html()
        with whole_file(path) as written:
            # A title may be the name of a file that is no Unicode.
            written.write_text(html, encoding="utf-8", errors="replace")


def _printable(value: Any) -> Any:
    """Return a text without control characters, its numbers not apart from their per cent."""
    if not isinstance(value, str) or hasattr(value, "__html__"):
        return value
    shown = re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]", "\N{REPLACEMENT CHARACTER}", value)
    return shown.replace(" %", "\N{NO-BREAK SPACE}%")


def _grid(columns: Columns) -> list[list[tuple[str, str]]]:
    """Return the head and the rows of a table, each cell with its class, "n" among numbers."""
    kinds = ["n" if all(map(_NUMBER.fullmatch, texts)) else "" for texts in columns.values()]
    rows = [[*columns], *zip(*columns.values(), strict=True)]
    return [[*zip(row, kinds, strict=True)] for row in rows]


def _image(figure: plots.Drawing) -> str:
    """Return a picture as the address of an image that holds it.

    As an image of its own nothing drawn in it can reach the rest of the document.
    """
    drawn = io.StringIO()
    with rc_context({"svg.fonttype": "path"}):  # whatever fonts the reader has
        figure.savefig(drawn, format="svg", dpi=_DPI, metadata={"Date": None})
    # Texts are drawn; their comments could hold what no XML may.
    svg = re.sub(r"<!--.*?-->", "", drawn.getvalue(), flags=re.DOTALL)
    return f"data:image/svg+xml;base64,{b64encode(svg.encode('utf-8')).decode('ascii')}"


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

    The first page says all that a decision needs; what follows says what it is based on.

    Args:
        table: The tests, with names, directions and units; :func:`~pymoo_psi.table.read_table`
            gives one of any file. What each limit of its formulation costs is reported.
        design: Number or label of the design that is chosen, a feasible one. Unless given none is,
            and the Salukvadze optimum is proposed.
        reason: Why it was chosen.
        selectors: What else could choose, by name, as for
            :func:`pymoo_psi.selection.compare_selectors`; the knee, the least bad worst objective,
            and the optimum by the other distances unless given.
        title: Heading of the report.
        about: Lines below it, such as where the tests are from.

    Raises:
        ArgumentValueError: The table has no test or no objective, a limit or a selector does not
            fit, or the design chosen is not feasible.
        ArgumentTypeError: ``table`` is no test table.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> report = decision_report(table.under(limits={"f1": 2}), title="Brackets")
        >>> print(report)
        Brackets: test point 1 proposed of 2 Pareto-optimal designs
        >>> "<h2>What limits cost</h2>" in report.html()
        True
    """
    instance("table", table, TestTable, "PSI and investigate give one, read_table opens any file")
    if len(table) == 0 or not table.layout.objectives:
        raise invalid("the table", "one with tests and objectives", Received(repr(table)))
    case = Case(table, design, reason, selectors)
    return DecisionReport(title, tuple(about), case.ranking, case.cautions, case)
