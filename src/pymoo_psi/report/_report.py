"""A report on a test table as one HTML document."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, Template

from pymoo_psi import __version__, analysis, pareto, plots
from pymoo_psi._numbers import number
from pymoo_psi._output import Document
from pymoo_psi._validation import Names, collection, counted
from pymoo_psi.files import read_table
from pymoo_psi.page import existing_designs, fonts
from pymoo_psi.pareto import EfficiencyRanking, ranked_row
from pymoo_psi.report import _contents
from pymoo_psi.report._contents import Choice
from pymoo_psi.table import TestTable


@dataclass(frozen=True, eq=False, repr=False)
class DecisionReport(Document):
    """A report on the choice among tested designs, made by :func:`decision_report`.

    Attributes:
        title: Subject of the report.
        question: The question that the report answers; empty if it is not stated.
        about: Lines below the heading.
        ranking: The ranking of the feasible designs; None if none is feasible.
        cautions: Reasons not to rely on the optimum, the most serious first.
        command: The command that makes the report again; empty if none has made it.
        further: The command that makes further tests; empty if no command has begun the study.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> decision_report(table, title="Brackets")
        DecisionReport('Brackets: test 2 proposed of 3 Pareto-optimal designs')
    """

    title: str
    question: str
    about: tuple[str, ...]
    ranking: EfficiencyRanking | None
    cautions: tuple[str, ...]
    _table: TestTable
    _choice: Choice | None = None
    command: str = ""
    further: str = ""

    def __str__(self) -> str:
        """Return the title and the design that is chosen or proposed."""
        choice = self._choice
        if choice is None:
            return f"{self.title}: no feasible design"
        n = counted(choice.ranking.pareto.sum(), "Pareto-optimal design")
        if choice.explanation.dominated_by >= 0:
            n = counted(len(choice.ranking.rows), "design")
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
        return _template().render(
            report=self,
            fonts=fonts(),
            data=self._table,
            contents=_contents,
            choice=self._choice,
            analysis=analysis,
            pareto=pareto,
            version=__version__,
            counted=counted,
            number=number,
            plots=plots,
        )


@cache
def _template() -> Template:
    """Return the template of a report, which takes longer to compile than to fill."""
    environment = Environment(
        loader=PackageLoader("pymoo_psi.report", ""),
        autoescape=True,
        finalize=_contents.printable,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"grid": _contents.grid, "image": _contents.image}
    environment.filters["printable"] = _contents.printable
    return environment.get_template("report.html")


def decision_report(
    table: Any,
    *,
    design: int | str | None = None,
    title: str = "Report on a choice",
    question: str = "",
    about: Names = (),
    prototype: Any = None,
) -> DecisionReport:
    """Report on tests and on the design that is chosen or proposed among them.

    The first page is for the decision; the others show the evidence.

    Args:
        table: The tests, with names, directions and units, or anything that
            :func:`~pymoo_psi.read_table` opens, as for :func:`~pymoo_psi.decision_page`. The report
            says what each limit of its formulation costs.
        design: Number or label of the chosen design, a feasible one. By default that of the table's
            decision, which also has the reason for it; if none is chosen, or it is not feasible,
            the Salukvadze optimum is proposed.
        title: Subject of the report.
        question: The question that the report answers, in words.
        about: Lines below the heading, such as the origin of the tests.
        prototype: Existing designs, from any source, to compare the design with.

    Raises:
        ArgumentValueError: The source cannot be read, or the design is not feasible.
        OSError: A file cannot be opened.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> report = decision_report(table.under(limits={"f1": 2}), title="Brackets")
        >>> print(report)
        Brackets: test 1 proposed of 2 Pareto-optimal designs
        >>> "f1 at most 2</h3>" in report.html()
        True
    """
    about = tuple(collection("about", about, "a list of lines", "one goes into a list too"))
    if not isinstance(table, TestTable):
        table = read_table(table, drop_incomplete=True)
        about = (*about, *table.remarks)
    chosen = table.decision.chosen
    warning = _warning(table)
    if design is not None:
        ranking = table.feasible_ranking()
        row = ranked_row("design", table.row_of(design), table, ranking)
        chosen = table.names[ranking.rows[row]]
    elif warning:
        chosen = None
        about = (*[line for line in about if line != warning], warning)  # a command has said it
    if chosen is None or chosen != table.decision.chosen:  # the reason is that of another design
        table = table.under(replace(table.decision, chosen=chosen, reason=""))
    if not table.feasible().any():
        return DecisionReport(title, question, about, None, (), table)
    choice = Choice(table, existing_designs(prototype, table))
    return DecisionReport(title, question, about, choice.ranking, choice.cautions, table, choice)


def _warning(table: TestTable) -> str:
    """Return why the chosen design of a decision does not count; empty if it does."""
    chosen = table.decision.chosen
    if chosen is None:
        return ""
    if chosen not in table.names:
        return f"Warning: {chosen}, the chosen design, is not among these designs."
    if not table.feasible()[table.names.index(chosen)]:
        return f"Warning: {chosen}, the chosen design, violates the limits."
    return ""
