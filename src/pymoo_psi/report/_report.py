"""A report on a test table as one HTML document."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from hashlib import sha256
from html import escape, unescape
from importlib.metadata import version
from itertools import zip_longest
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader

from pymoo_psi import plots
from pymoo_psi._output import Framed, write_document
from pymoo_psi._validation import Entries, Names, Received, Values, counted, instance, invalid
from pymoo_psi.page import NOTHING_KNOWN, FurtherTests, existing_designs
from pymoo_psi.pareto import (
    EfficiencyRanking,
    capital,
    decimal_mark,
    measured_in,
    number,
)
from pymoo_psi.report import _contents
from pymoo_psi.report._contents import Choice
from pymoo_psi.table import (
    Formulation,
    TestTable,
    certainty_sentences,
    decision_sentences,
    difference,
    latest_positions,
    positions_frame,
    read_table,
    separation_sentences,
    written_limits,
)

# Where a report keeps what it is made from, and the addresses of its pictures, which hold them.
_RECORD = re.compile(r'<meta id="record" content="([^"]*)">')
_PICTURE = re.compile(r'<img src="([^"]*)"')


@dataclass(frozen=True, eq=False, repr=False)
class DecisionReport(Framed):
    """A report on the choice among tested designs, made by :func:`decision_report`.

    Attributes:
        title: Heading of the report.
        about: Lines below the heading.
        ranking: The ranking of the feasible designs; None if none is feasible.
        cautions: Reasons not to rely on the optimum, the most serious first.
        further: What is known of further tests.

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
    _choice: Choice | None = None
    _prototype: TestTable | None = None
    further: FurtherTests = NOTHING_KNOWN

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
            finalize=_contents.printable,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        filters = {"grid": _contents.grid, "image": _contents.image, "capital": capital}
        environment.filters |= filters
        formulation = self._table.formulation
        record = self._record()
        with decimal_mark(self._table.decimal):
            text = environment.get_template("report.html").render(
                fingerprint=_fingerprint(record),
                separation=separation_sentences(self._table),
                positions=positions_frame(self._table),
                limits=written_limits(self._table),
                decided=decision_sentences(formulation.decided),
                names=[position["name"] for position in latest_positions(formulation.positions)],
                title=self.title,
                about=self.about,
                data=self._table,
                further=self.further,
                contents=_contents,
                choice=self._choice,
                certainty_sentences=certainty_sentences,
                counted=counted,
                measured_in=measured_in,
                number=number,
                plots=plots,
            )
        # Pictures of the same are not the same text in another run: their hashes are kept.
        record["pictures"] = _pictures(text)
        meta = f'<meta id="record" content="{escape(json.dumps(record))}">'
        return text.replace("<!-- record -->", meta, 1)

    def _record(self) -> Values:
        """Return all that the report is made from, as values that JSON can hold."""
        table = self._table
        prototype = None
        if self._prototype is not None:
            columns = {name: self._prototype.column(name) for name in table.layout.objectives}
            prototype = pd.DataFrame(columns, self._prototype.names).to_dict()
        with TemporaryDirectory() as folder:
            path = Path(folder, "data.csv")
            table.tested.to_csv(path)
            data = path.read_text("utf-8")
            head = Path(folder, "data.csv-metadata.json").read_text("utf-8")
        return {
            "version": version("pymoo-psi"),
            "title": self.title,
            "about": self.about,
            "formulation": vars(table.formulation),
            "prototype": prototype,
            "decimal": table.decimal,
            "further": self.further,
            "data": data,
            "head": head,
        }

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


def decision_report(
    table: TestTable,
    *,
    design: int | str | None = None,
    title: str = "Report on a choice",
    about: Names = (),
    prototype: Any = None,
) -> DecisionReport:
    """Report on tests and on the design that is chosen or proposed among them.

    The first page is for the decision; the others show the evidence.

    Args:
        table: The tests, with names, directions and units; :func:`~pymoo_psi.table.read_table`
            opens any file. The report says what each limit of its formulation costs.
        design: Number or label of the chosen design, a feasible one. By default that of the table's
            formulation, which also has the reason for it; if none is chosen, or it is not feasible,
            the Salukvadze optimum is proposed.
        title: Heading of the report.
        about: Lines below the heading, such as the origin of the tests.
        prototype: Existing designs, from any source, to compare the design with.

    Raises:
        ArgumentValueError: The table has no test or no objective, or the design is not feasible.
        ArgumentTypeError: ``table`` is not a test table.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[0, 4], [1, 1], [4, 0]])
        >>> report = decision_report(table.under(limits={"f1": 2}), title="Brackets")
        >>> print(report)
        Brackets: test point 1 proposed of 2 Pareto-optimal designs
        >>> "What limits cost</h2>" in report.html()
        True
    """
    remedy = "PSI and investigate return one, read_table opens any file"
    instance("table", table, TestTable, remedy)
    if len(table) == 0 or not table.layout.objectives:
        raise invalid("the table", "one with tests and objectives", Received(repr(table)))
    eligible = table.eligible()
    chosen = table.formulation.chosen
    if design is not None:
        row = table.row_of(design)
        if not eligible[row]:
            raise invalid("design", "the number or label of a feasible test", design)
        if table.names[row] != chosen:
            table = table.under(chosen=table.names[row], reason="")
    elif chosen not in table.names or not eligible[table.names.index(chosen)]:
        table = table.under(chosen=None, reason="")
    if not eligible.any():
        return DecisionReport(title, tuple(about), None, (), table)
    prototype = existing_designs(prototype, table)
    with decimal_mark(table.decimal):
        choice = Choice(table, prototype)
    return DecisionReport(
        title, tuple(about), choice.ranking, choice.cautions, table, choice, prototype
    )


# The check of a report that was written


def check_report(
    path: str | PathLike[str], source: TestTable | None = None
) -> tuple[list[str], str]:
    """Make a report again from the data in it and compare every text and number.

    It detects a change by hand or of the source, not a forgery: who changes the data and all that
    follows from them makes another report, which is right by itself.

    Args:
        path: The report.
        source: The tests as they are now, to be compared with the data before any formulation.

    Returns:
        Warnings, such as of another version; and the first claim that no longer holds, "" if all
        hold.

    Raises:
        ArgumentValueError: The file is no report.
        OSError: The file cannot be opened.
    """
    html = Path(path).read_text("utf-8")
    try:
        (record,) = map(json.loads, map(unescape, _RECORD.findall(html)))
        table = _table_of(record)
        prototype = record["prototype"]
        if prototype is not None:
            prototype = pd.DataFrame(prototype)
        further = FurtherTests(*record["further"])
        title = record["title"]
        about = record["about"]
        made_by = record["version"]
        pictures = record["pictures"]
    except (ValueError, TypeError, KeyError):
        raise _no_report(path) from None
    warnings = []
    if made_by != version("pymoo-psi"):
        warnings.append(f"made by pymoo-psi {made_by}, checked by {version('pymoo-psi')}")
    if pictures != _pictures(html):
        return warnings, "a picture, which is another one"
    report = decision_report(table, title=title, about=about, prototype=prototype)
    expected = _claims(replace(report, further=further).html())
    for claim, truth in zip_longest(_claims(html), expected, fillvalue="nothing"):
        if claim != truth:
            return warnings, f"{_text(claim)!r} should be {_text(truth)!r}"
    if source is not None:
        return warnings, _first_difference(table.tested, source.tested)
    return warnings, ""


def reported_tests(path: str | PathLike[str]) -> TestTable:
    """Return the tests in a report, before any formulation.

    Raises:
        ArgumentValueError: The file is no report.
        OSError: The file cannot be opened.
    """
    try:
        (record,) = map(json.loads, map(unescape, _RECORD.findall(Path(path).read_text("utf-8"))))
        return _table_of(record).tested
    except (ValueError, TypeError, KeyError):
        raise _no_report(path) from None


def _no_report(path: str | PathLike[str]) -> Exception:
    rule = "a report with its data, as the command report writes it"
    return invalid(f"{path}", rule, Received("no report, or changed data"))


def _table_of(record: Entries) -> TestTable:
    """Return the table in a record, under its formulation."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "data.csv")
        path.write_text(record["data"], "utf-8", newline="")
        Path(folder, "data.csv-metadata.json").write_text(record["head"], "utf-8")
        table = read_table(path)
    return replace(table, decimal=record["decimal"]).under(Formulation(**record["formulation"]))


def _first_difference(table: TestTable, source: TestTable) -> str:
    """Return the first fact or value of a source that is not in the data of a report, or ""."""
    if len(source) != len(table):
        return f"{len(table)} designs; the source has {len(source)}"
    facts = difference(table, source)
    if facts:
        return f"{facts} in the source"
    for name in table.columns:
        if name not in source.columns:
            return f"the column {name}, which the source lacks"
        before = pd.Series(table.column(name), table.names)
        now = pd.Series(source.column(name), source.names).reindex(before.index)
        is_other = (before != now) & ~(before.isna() & now.isna())
        for design in before.index[is_other][:1]:
            return f"{name} of {design} was {before[design]} and is {now[design]} in the source"
    return ""


def _pictures(html: str) -> list[str]:
    """Return the hashes of the pictures in a report."""
    return [sha256(picture.encode()).hexdigest() for picture in _PICTURE.findall(html)]


def _claims(html: str) -> list[str]:
    """Return the lines of a report without its record and pictures."""
    return _PICTURE.sub("<img", _RECORD.sub("", html)).splitlines()


def _text(line: str) -> str:
    """Return the text of a line, or without one its markup."""
    return unescape(re.sub("<[^>]*>", " ", line)).strip() or line


def _fingerprint(record: Entries) -> str:
    """Return the first digits of the hash of a record's data."""
    return sha256(f"{record['head']}{record['data']}".encode()).hexdigest()[:16]
