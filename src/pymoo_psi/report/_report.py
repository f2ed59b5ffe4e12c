"""From a test table to the report: judged, ranked, explained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._files import whole_file
from pymoo_psi._validation import Received, boolean, counted, instance, integer, invalid
from pymoo_psi.pareto import EfficiencyRanking, listed
from pymoo_psi.report._contents import Case, sections_of
from pymoo_psi.report._document import Section, html_of
from pymoo_psi.table import Limits, TestTable


@dataclass(frozen=True, eq=False, repr=False)
class DecisionReport:
    """A report on a choice among tested designs; :func:`decision_report` makes it.

    Attributes:
        title: Its heading.
        about: Lines below the heading.
        sections: What it says, under headings: texts, tables and pictures.
        ranking: The ranking of the feasible designs; ``None`` if none is feasible.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> decision_report(table, title="Brackets")
        DecisionReport('Brackets: test point 2 chosen of 3 Pareto-optimal designs')
    """

    title: str
    about: tuple[str, ...]
    sections: tuple[Section, ...]
    ranking: EfficiencyRanking | None
    _chosen: str

    def __str__(self) -> str:
        """Return the title and what is chosen."""
        found = "no feasible design"
        if self.ranking is not None:
            front = counted(int(self.ranking.pareto.sum()), "Pareto-optimal design")
            found = f"{self._chosen} chosen of {front}"
        return f"{self.title}: {found}"

    def __repr__(self) -> str:
        """Return the same, as an object."""
        return f"DecisionReport({str(self)!r})"

    def html(self) -> str:
        """Return the report as one HTML document that needs no network and runs no script.

        Example:
            >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[0, 4], [1, 1]])
            >>> "<script" in decision_report(table, title="A < B").html()
            False
        """
        return html_of(self.title, self.about, self.sections)

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


def decision_report(
    table: TestTable,
    limits: Limits | None = None,
    *,
    normalize: bool = True,
    design: int | None = None,
    selectors: Mapping[str, Any] | None = None,
    labels: Sequence[str] | None = None,
    title: str = "Report on a choice",
    about: Sequence[str] = (),
) -> DecisionReport:
    """Report on tests and on the design that is chosen among them.

    Args:
        table: The tests; names, senses and units are those of its layout.
        limits: Limits on columns, as for ``table.pareto``; what each of them costs is told.
        normalize: Measure distances with each criterion in units of its range.
        design: Number of the test point that is chosen, a feasible one; the Salukvadze optimum
            unless given.
        selectors: What else could choose, by name, as for
            :func:`pymoo_psi.selection.compare_selectors`; the knee, the least bad worst criterion,
            and the optimum in the other scale unless given.
        labels: ``(n,)`` what the designs are called; "test point 7" and so on unless given.
        title: Heading of the report.
        about: Lines below it, such as where the tests are from.

    Raises:
        ArgumentValueError: The table has no test or no criterion, a limit or a selector does not
            fit, or the design chosen is not feasible.
        ArgumentTypeError: ``table`` is no test table.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> report = decision_report(table, {"f1": 2}, title="Brackets")
        >>> for section in report.sections[:4]:
        ...     print(section.title)
        The choice
        What was tested
        Limits and what each costs
        Where the designs lie
    """
    instance("table", table, TestTable, "PSI and investigate give one")
    normalize = boolean("normalize", normalize)
    if len(table) == 0 or not table.layout.objectives:
        raise invalid("the table", "one with tests and criteria", Received(repr(table)))
    if labels is None:
        labels = [f"test point {number}" for number in table.numbers]
    if len(labels) != len(table):
        raise invalid("labels", f"{len(table)}, one for each test", Received(len(labels)))
    case = Case.of(table, limits or {}, labels, normalize, selectors)
    if design is not None:
        number = integer("design", design, minimum=1)
        at = np.flatnonzero(table.numbers[case.rows] == number)
        if len(at) == 0:
            there = np.flatnonzero(table.numbers == number)
            # By its name: whoever has typed it need not know that it goes by its row here.
            received = Received(labels[there[0]]) if len(there) else number
            remedy = _why_not(case, there)
            raise invalid("design", "the number, or row, of a feasible test", received, remedy)
        case = replace(case, chosen=int(at[0]))
    chosen = labels[case.rows[case.chosen]] if len(case.rows) else ""
    return DecisionReport(title, tuple(about), sections_of(case), case.ranking, chosen)


def _why_not(case: Case, at: NDArray[np.intp]) -> str:
    """Return why the test in a row cannot be chosen; empty if there is no row."""
    if len(at) == 0:
        return ""
    one = case.table.rows(at)
    violated, names = one.violations(case.limits)
    if violated.any():
        kept = [name for name, over in zip(names, violated[0], strict=True) if over]
        return f"it violates {listed(kept)}"
    if one.status[0] == "failed":
        return f"it failed: {one.reasons.get(int(one.numbers[0])) or 'no reason is known'}"
    if first := case.table.repeats[at[0]]:
        return f"it tested design {first} once more"
    return "its criteria are not finite"
