"""The decision page: made from a source of designs, saved as a file."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Iterable
from dataclasses import dataclass, replace
from hashlib import sha256
from html import escape
from os import PathLike
from pathlib import Path
from typing import Any

from pymoo_psi import pareto
from pymoo_psi._names import name_of, named_as
from pymoo_psi._output import Document
from pymoo_psi._validation import Entries, Names, Received, counted, invalid, known_name
from pymoo_psi.analysis import confidence_sentences, failure_sentences
from pymoo_psi.files import read_table
from pymoo_psi.page._payload import payload, roles, values_of
from pymoo_psi.pareto import cautions_with_weights, weight_shares, weights_sentence
from pymoo_psi.table import Decision, Formulation, Limit, TestTable

# A policy that forbids other scripts and styles, and requests but to a source. Its last part makes
# the browser refuse every text that a script would turn into markup: the user's names and labels
# reach the page as text or not at all.
_POLICY = (
    "default-src 'none'; connect-src {}; script-src {}; style-src {}; font-src data:; "
    "base-uri 'none'; form-action 'none'; require-trusted-types-for 'script'"
)
_PLACE = re.compile(r"\{\{(\w+)\}\}")
# The scripts of a page, each of its files a subject: those that need no document, and what is seen.
_SCRIPTS = {
    "logic": "numbers arrays data dominance ranking limits orders explanations questions decisions "
    "exports",
    "view": "dom marks scales canvas state charts rows axes names scatter verdict choosing "
    "positions preferences table files page",
    "live": "live",
}
# The numbers of the rules that Python and the scripts both apply, by their names in Python.
_NUMBERS = (
    "NOISE LAST_PLACES TIE STEP MOST_COSTS SAME CHEBYSHEV_SUM N_WEIGHTS N_OTHERS N_AVERAGED "
    "N_LIKELIEST N_ASKED SHARPNESS MISTAKES VISIBLE CERTAIN ENOUGH"
)
# What distances are measured in, by whether they are normalised.
_SCALES = {
    True: ", each objective in units of its range",
    False: ", the objectives in their own units",
}
_FURTHER = (
    "16 more tests inside these limits: save the decision where the search was run, and run there "
    "<code>{}</code>"
)


@dataclass(frozen=True, eq=False, repr=False)
class DecisionPage(Document):
    """A page for deciding on a Pareto set, made by :func:`decision_page`.

    Attributes:
        title: Heading of the page.
        table: The designs on the page.
        prototype: Existing designs to compare with; None if there are none.
        decision: The objectives, limits, choice and reason that the page opens with.
        cautions: Reasons not to rely on the optimum within the limits of the decision.
        weights: How often the optimum is the best with other weights, unless this is a caution.
        confidence: How sure it is that the optimum is the best, if errors are known.
        origin: Name of the file with the designs, for the print; empty if there is none.
        further: The command that makes further tests; empty if no command has begun the study.

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
    decision: Decision
    cautions: tuple[str, ...]
    weights: str = ""
    confidence: tuple[str, ...] = ()
    origin: str = ""
    further: str = ""

    def __repr__(self) -> str:
        """Return the title and the number of designs."""
        return f"DecisionPage({self.title!r}: {counted(len(self.table), 'design')})"

    def html(self, live: Entries | None = None) -> str:
        """Return the page as one HTML document that needs no network.

        Args:
            live: Settings of a page that a server extends; None for a file.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
            >>> html = decision_page(frame, ["cost", "mass"], title="Brackets").html()
            >>> html.startswith("<!DOCTYPE html>"), "Brackets" in html
            (True, True)
        """
        scripts = {name: _script(name) for name in _SCRIPTS}
        source = "'self'"
        if live is None:
            source = "'none'"
        style = fonts() + _asset("page.css")
        file = _file_name(self.title)
        content = {
            "title": self.title,
            "file": file,
            "origin": self.origin,
            "live": live,
            "confidence": self.confidence,
            **payload(self.table, self.prototype, self.decision),
        }
        data = json.dumps(content, allow_nan=False, separators=(",", ":"))
        further = ""
        if self.further:
            further = _FURTHER.format(escape(f"{self.further} --decision {file}-decision.json"))
        certainty = filter(None, [self.weights, *self.confidence])
        parts = {
            "title": escape(self.title),
            "remarks": _paragraphs("hint", self.table.remarks),
            "cautions": _paragraphs("caution", self.cautions) + _paragraphs("hint", certainty),
            "scale": _SCALES[self.decision.formulation.normalize],
            "further": further,
            "policy": _POLICY.format(
                source, " ".join(map(_digest, scripts.values())), _digest(style)
            ),
            "style": style,
            # Within a script element only "<" can end it or open a comment.
            "payload": data.replace("<", "\\u003c"),
            **scripts,
        }
        # In one pass, so that a text of the user that looks like a place is not filled in.
        return _PLACE.sub(lambda place: parts[place.group(1)], _asset("page.html"))


def decision_page(
    source: Any,
    formulation: Formulation | Decision | Names | None = None,
    *,
    prototype: Any = None,
    title: str = "Pareto set",
) -> DecisionPage:
    """Return a page for deciding on a Pareto set, to be saved as one HTML file.

    The reader sets limits. The page proposes the best compromise among the designs within these
    limits (see :func:`pymoo_psi.rank_of_efficiency`) and states why it is the best and what others
    would cost, until the reader chooses a design. Linked plots and a table show the designs within
    the limits; the reader can compare them and export them as CSV. A saved page and a decision file
    contain limits, choice and reason.

    Designs that failed or violate constraints are left out; the page says how many.

    Args:
        source: Anything that :func:`~pymoo_psi.read_table` opens: a test table, a data frame
            with one row for each design, an array of objectives, a result of pymoo, a study, a
            file.
        formulation: Objectives, directions, computed columns, and the limits, choice and reason
            that the page opens with, such as ``Decision.read_json`` of a decision file. Or names
            of the objectives, all minimised. By default that of the source.
        prototype: Existing designs to compare with, a source as above. They are not ranked and
            stay on the page under any limits.
        title: Heading of the page.

    Returns:
        The page, with ``.html()`` and ``.save(path)``.

    Raises:
        ArgumentValueError: The source cannot be read or ranked, has no feasible design, or lacks
            columns that the formulation names.
        ArgumentTypeError: An objective is not numbers, or an argument has a wrong type.
        OSError: A file cannot be opened.

    Example:
        >>> import pandas as pd
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]}, index=["A", "B", "C"])
        >>> page = decision_page(frame, ["cost", "mass"], title="Brackets")
        >>> page, page.table.best().names
        (DecisionPage('Brackets': 3 designs), ['B'])
    """
    if formulation is not None and not isinstance(formulation, (Formulation, Decision)):
        formulation = Formulation(formulation)
    table = _limited_by_name(read_table(source, formulation, drop_incomplete=True))
    designs = designs_of_page(table)
    if len(designs) == 0:
        received = Received(f"none in {counted(len(table), 'design')}")
        raise invalid("source", "of one feasible design or more", received)
    if not table.feasible().any():
        received = Received(f"none of {len(designs)}")
        remedy = "loosen them, or leave them to the reader of the page"
        raise invalid("limits", "kept by one design or more", received, remedy)
    if len(designs) < len(table):
        row = table.schema.words["row"]
        counts = table.under(limits={}).status_counts()
        remark = f"{len(designs)} of {counted(len(table), row)} are on the page ({counts})."
        designs = replace(designs, remarks=(*designs.remarks, remark, *failure_sentences(table)))
    prototype = existing_designs(prototype, table)
    origin = ""
    if isinstance(source, (str, PathLike)):
        origin = Path(source).name
    return page_of_tests(table, designs, title, origin, prototype)


def _limited_by_name(table: TestTable) -> TestTable:
    """Return the rows that a limit on names keeps, for which the page has no control."""
    label = str(table.schema.label)
    limits = dict(table.limits)
    limit = limits.pop(label, None)
    if limit is None:
        return table
    is_kept = limit.excess(label, table.column(label)) == 0
    remark = f"{counted(int((~is_kept).sum()), 'row')} left out by {limit.written(label)}."
    kept = table.take(is_kept).under(limits=limits)
    return replace(kept, remarks=(*kept.remarks, remark))


def page_of_tests(
    table: TestTable,
    designs: TestTable,
    title: str,
    origin: str,
    prototype: TestTable | None = None,
) -> DecisionPage:
    """Return the page of tests, whose limits no design needs to keep.

    Args:
        table: The tests, under the formulation that the page opens with.
        designs: Those of them that are feasible without limits.
        title: Heading of the page.
        origin: Name of the file with the tests.
        prototype: Existing designs to compare with.
    """
    reasons: list[str] = []
    weights = ""
    confidence: list[str] = []
    if table.feasible().any():
        ranking = table.feasible_ranking()
        best = int(ranking.salukvadze[0])
        shares = weight_shares(ranking)
        reasons += map(str, cautions_with_weights(ranking, shares))
        weights = weights_sentence(ranking, best, shares)
        if weights in reasons:
            weights = ""
        confidence += confidence_sentences(table, best)
    formulation = replace(table.formulation, limits=_limits_of_page(table))
    return DecisionPage(
        title=title,
        table=designs,
        prototype=prototype,
        decision=replace(table.decision, formulation=formulation),
        cautions=tuple(reasons),
        weights=weights,
        confidence=tuple(confidence),
        origin=origin,
    )


def _limits_of_page(table: TestTable) -> dict[str, Limit]:
    """Return the limits of a table as the page has them: on options, those that are allowed.

    Raises:
        ArgumentValueError: A limit is on a column that the page does not have.
    """
    limits = {}
    for name, limit in table.limits.items():
        columns = [column for _, column in roles(table)]
        known_name("a limit of a page", name, columns, "leave out the rows that it rejects")
        cells = values_of(name, table)
        if cells.dtype == object and limit.texts is None:
            is_allowed = limit.excess(name, table.column(name)) == 0
            limit = Limit(texts=tuple(sorted({*cells[is_allowed]})))
        limits[name] = limit
    return limits


def existing_designs(source: Any, table: TestTable, **reading: Any) -> TestTable | None:
    """Return designs from any source with the objectives of a table; None if there is no source.

    Args:
        source: The source.
        table: The table.
        **reading: Arguments of :func:`read_table`.
    """
    if source is None:
        return None
    schema = table.schema
    maximize = [name for name in schema.objectives if name in schema.maximize]
    units = {}
    for name in schema.objectives:
        if name in schema.units:
            units[name] = schema.units[name]
    asked = Formulation(
        schema.objectives,
        maximize=maximize,
        computed=table.formulation.computed,
        units=units,
    )
    with named_as({"source": name_of("prototype")}):
        return read_table(source, asked, **reading)


def designs_of_page(tests: TestTable) -> TestTable:
    """Return the designs that are feasible without limits, which the reader of the page sets.

    Tests of the same design with the same results are one design.
    """
    tests = tests.under(limits={})
    designs = tests.take(tests.feasible())
    return designs.take(~designs.repeats)


# The document


def fonts() -> str:
    """Return the style that holds the typeface and names those that stand in for it."""
    style = _asset("fonts.css")
    for weight in ("inter-400.woff2", "inter-650.woff2"):
        data = b64encode(Path(__file__).with_name(weight).read_bytes()).decode("ascii")
        style = style.replace("{{" + weight + "}}", data)
    return style


def _file_name(title: str) -> str:
    """Return a title as a file name of letters, digits and underscores."""
    words = re.findall(r"[^\W_]+", title)
    return "_".join(words)[:60] or "page"


def _paragraphs(kind: str, texts: Iterable[str]) -> str:
    """Return texts as paragraphs of HTML."""
    return "".join(f'<p class="{kind}">{escape(text)}</p>' for text in texts)


def _digest(text: str) -> str:
    """Return the hash of a script or style, as a policy names it."""
    digest = sha256(text.encode("utf-8")).digest()
    return f"'sha256-{b64encode(digest).decode('ascii')}'"


def _script(name: str) -> str:
    """Return the files of a script as one, in which the names of all are known."""
    parts = ['"use strict"']
    if name == "logic":
        numbers = [f"{name} = {float(getattr(pareto, name))!r}" for name in _NUMBERS.split()]
        parts.append(f"const {', '.join(numbers)}")
    parts += [_asset(f"{file}.js") for file in _SCRIPTS[name].split()]
    return "\n".join(parts)


def _asset(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")
