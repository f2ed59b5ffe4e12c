"""The contents of a report, which report.html lays out.

:class:`Choice` has what is said of the chosen or proposed design. Functions return what is said of
the table: limits, failures, convergence. Tables are frames of texts. At the end are the filters by
which report.html shows texts, tables and figures.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from decimal import ROUND_CEILING, Context
from typing import Any
from urllib.parse import quote

import numpy as np
import pandas as pd
from jinja2 import pass_context, runtime

from pymoo_psi import plots
from pymoo_psi._numbers import number, percent, percents
from pymoo_psi._output import with_unit
from pymoo_psi._validation import Values, counted
from pymoo_psi.analysis import (
    alike,
    beyond_limits,
    changed_limit,
    constraint_costs,
    convergence,
    convergence_sentence,
    is_best,
    limit_words,
    positions_frame,
    ranking_without_limits,
    rows_by_name,
    switching_values,
    text_beyond,
    within_limits,
)
from pymoo_psi.errors import PsiError
from pymoo_psi.page import number_formats
from pymoo_psi.pareto import (
    cautions_with_weights,
    compare_designs,
    explain,
    listed,
    ranked_row,
    representatives,
    weight_shares,
    within_range,
)
from pymoo_psi.table import Limit, TestTable, error_column, has_errors

_REASONS = 12  # the table has the most frequent reasons of failures
_REPRESENTATIVES = 5  # side by side on paper
_DESIGNS = 30  # more of them are not all listed
_LISTED = 20  # of them
_CHANGES = 4  # a sentence has the largest ones
_WEIGHTED = 5  # bars
# How a table names limits on a column.
_LIMIT_WORDS = {
    ("upper", "tighter"): "below",
    ("lower", "tighter"): "above",
    ("upper", "looser"): "up to",
    ("lower", "looser"): "down to",
}
_KEPT = "/:;,=+"  # characters of a drawing that an address may have
_DPI = 200  # markers too many to be drawn one by one are an image, as fine as on good paper
_DIGITS = 6
_TICKS = 1000  # places on an axis that can be told apart
# A number, its unit, a date, or nothing. Columns of such cells are aligned to the right.
_NUMBER = re.compile(
    r"[-+−]?[\d.,\u00a0]*\d(e[-+−]?\d+)?([ \u00a0]\S+)?|[–—∞]|[-−]?inf|nan|\d{4}-\d\d-\d\d|"
)


class Choice:
    """The design that is chosen or, if none is, proposed among ranked tests.

    Args:
        table: The tests; their decision says which design is chosen, and why. If none is, the
            Salukvadze optimum is proposed.
        prototype: Existing designs; None if there are none.

    Attributes:
        word: "chosen" or "proposed".
        noun: "choice" or "proposal".
        ranking: The ranking of the feasible tests.
        optimum: Row of the Salukvadze optimum in the ranking, the first of several.
        row: Row of the design in the ranking.
        is_optimum: Whether the design is a Salukvadze optimum.
        name: Name of the design.
        explanation: Why it is where it is.
        shares: For which share of the weights each design is the best.
        cautions: Reasons not to rely on the optimum, the most serious first.
    """

    def __init__(self, table: TestTable, prototype: TestTable | None) -> None:
        self.table = table
        self.ranking = table.feasible_ranking()
        self.optimum = int(self.ranking.salukvadze[0])
        self.row = self.optimum
        self.word, self.noun = "proposed", "proposal"
        chosen = table.decision.chosen
        if chosen is not None:
            self.row = ranked_row("design", table.names.index(chosen), table, self.ranking)
            self.word, self.noun = "chosen", "choice"
        self.is_optimum = self.row in self.ranking.salukvadze
        self.name = self.ranking.name_of(self.row)
        self.explanation = explain(self.ranking, row=self.row)
        subject = "Attention"
        self._beside: list[tuple[str, str, TestTable]] = []  # marks, words and designs
        if not self.is_optimum:  # the cautions are about the optimum
            subject = f"Attention to {self.ranking.name_of(self.optimum)}, the proposal"
            self._beside.append(("ring", "proposed", table.take(self.ranking.rows[[self.optimum]])))
        self.shares = weight_shares(self.ranking)
        reasons = cautions_with_weights(self.ranking, self.shares)
        self.cautions = tuple(f"{subject}: {reason}" for reason in reasons)
        written = [table.take(~table.feasible() & ~table.failed())]
        self._existing: list[Any] = []  # names and values: rows of two files have the same names
        if prototype is not None:
            self._existing = [*zip(prototype.names, prototype.F.tolist(), strict=True)]
            written.append(prototype)
            self._beside.append(("diamond", "present design", prototype))
        formats = number_formats(table, *written)
        self.formats = {name: replace(of, minus="−") for name, of in formats.items()}

    # The first sentences

    def standing(self) -> str:
        """Return in which objectives the design is the best, or how it differs from the optimum."""
        if not self.is_optimum:
            if self.explanation.dominated_by >= 0:
                return self.explanation.standing
            pair = compare_designs(self.ranking, rows=[self.optimum, self.row])
            return pair.sentence("instead", 1)
        n = len(self.ranking.rows)
        limits = within_limits(self.table)
        if n == 1:
            return f"The only design{limits}."
        text = "The nearest to the best values of all objectives"
        if (self.explanation.neighbours < 0).all():
            text = "The best in every objective"
        elif self.explanation.best_in:
            text = f"The best in {_few(self.explanation.best_in)}"
        return f"{text} among the {counted(n, 'design')}{limits}. {self.explanation.ties}".strip()

    def costs(self, form: str) -> str:
        """Return how far the design is from the best values, with its amounts in a form."""
        if not self.explanation.behind.any():  # which has been said
            return ""
        return self.explanation.costs_with(form)

    def amount(self, name: str, value: float) -> str:
        """Return a value of a column, or a difference of values, with its unit."""
        return _with_unit(self.table, name, self.formats[name].text(value))

    # The values

    def values(self) -> Iterator[Values]:
        """Yield the objectives in their order: texts, and places from the worst to the best."""
        objectives = self.ranking.objectives
        for j, name in enumerate(objectives.names):
            column = objectives.values[:, j]
            marks = [column[self.row]]
            for *_, designs in self._beside:
                marks += designs.column(name).astype(float).tolist()
            ends = (self.ranking.nadir[j], self.ranking.ideal[j])
            shown = [*marks, *column[self.ranking.pareto]]
            places, is_log = plots.places_in_row(self.ranking, j, shown)
            write = self.formats[name].text
            (value, place), *others = zip(map(write, marks), places.tolist(), strict=False)
            behind = percent(self.explanation.shares[j], self.table.decimal)
            if not within_range(self.explanation.shares[j]):
                behind = self.amount(name, self.explanation.behind[j])
            error = ""
            if has_errors(self.table):
                errors = self.table.column(error_column(name))
                error = errors[self.ranking.rows[self.row]]
                error = number(error, 2, mark=self.table.decimal)
            # Of places on an axis those that can be told apart, but for that of the design.
            ticks = {*np.round(_TICKS * np.clip(places[len(marks) :], 0.0, 1.0)).tolist()}
            yield {
                "name": name,
                "is_maximized": objectives.sign[j] < 0,
                "is_log": is_log,
                "value": value,
                "worst": write(ends[0]),
                "best": write(ends[1]),
                "behind": behind,
                "place": place,
                "ticks": sorted(ticks - {np.round(_TICKS * place)}),
                "others": others,
                "error": error,
            }

    def others(self) -> list[tuple[str, str]]:
        """Return marks and names of the proposed design, if it is another, and of existing ones."""
        others = []
        for mark, word, designs in self._beside:
            others += [(mark, f"{word}: {name}") for name in designs.names]
        return others

    # Differences

    def steps(self) -> Iterator[tuple[str, str]]:
        """Yield the designs that give up least for an objective: what is better, what worse."""
        pairs = self.explanation.steps
        for k in self.explanation.step_order():
            better, worse = pairs.changes(k)
            text = "Nothing is worse."
            if worse:
                text = f"But {_few(worse)}."
            yield f"{self.ranking.name_of(pairs.rows[k])}: {_few(better)}", text

    # Positions

    def positions(self) -> Iterator[Values]:
        """Yield what each person holds, and what the design costs them."""
        table = self.table
        free = ranking_without_limits(table)
        rows = rows_by_name(table, free)
        records: Any = positions_frame(table).to_dict("records")
        for record in records:
            name = record["choice"]
            if name not in rows:
                text = "No choice." if name == "none" else "Not among the designs."
            elif rows[name] == rows[self.name]:
                text = f"The {self.noun}."
            else:
                pair = compare_designs(free, rows=[rows[name], rows[self.name]])
                costs = _few(pair.losses(1) or ["nothing is worse"])
                names = np.array(free.objectives.names)[pair.gains[1] > 0].tolist()
                text = f"The {self.noun}: {costs}; better in {_few(names or ['nothing'])}."
            beyond: list[str] = []
            if name in table.names:
                beyond = [*beyond_limits(table, table.names.index(name)).values()]
            yield {**record, "text": text, "beyond": beyond}

    # The appendix

    def weighted(self) -> list[tuple[str, float, str]]:
        """Return the designs that are the best for most weights, and for which share of them."""
        shares = self.shares
        texts = percents(shares)
        rows = np.argsort(-shares, kind="stable")[:_WEIGHTED]
        rows = rows[shares[rows] > 0]
        return [(self.ranking.name_of(row), shares[row], texts[row]) for row in rows]

    def new_limits(self) -> tuple[pd.DataFrame, str]:
        """Return at which limits another design is proposed, and where none would be left."""
        rows = []
        best = []  # objectives in which no design is better
        changes = switching_values(self.table).dropna(subset="value").to_dict("records")
        for change in changes:
            name = change["column"]
            if is_best(change):
                best.append(name)
                continue
            word = _LIMIT_WORDS[change["end"], change["direction"]]
            digits = _DIGITS  # of a column that is no property of designs, such as a run
            if name in self.formats:
                digits = self.formats[name].digits(change["value"])
            limit = changed_limit(self.table, change, digits)
            rows.append((f"{name} {word}", limit, change["design"] or "no design is left"))
        note = ""
        if best:
            note = f"If {listed(best, 'or')} must be better, no design is left."
        return pd.DataFrame(rows, columns=["limit", "value", "new proposal"]), note

    def designs(self) -> tuple[pd.DataFrame, int]:
        """Return the designs by place, then those beyond limits, and how many there are in all."""
        schema = self.table.schema
        order = self.ranking.by_place
        rejected = np.flatnonzero(~self.table.feasible() & (self.table.status != "failed"))
        n = len(order) + len(rejected)
        n_listed = n
        if n > _DESIGNS:
            n_listed = _LISTED
        places = [str(place or "–") for place in self.ranking.place[order].tolist()]
        places += ["–"] * len(rejected)
        rows = np.append(self.ranking.rows[order], rejected)[:n_listed]
        designs = self.table.take(rows)
        columns: list[tuple[str, Sequence[str]]] = [("place", places[:n_listed])]
        columns.append((schema.label or schema.words["row"], designs.names))
        for name, maximized in zip(schema.objectives, schema.sign < 0, strict=True):
            arrow = "↑" if maximized else "↓"
            heading = f"{with_unit(name, schema.units.get(name, ''))}\N{NO-BREAK SPACE}{arrow}"
            columns.append((heading, list(map(self.formats[name].text, designs.column(name)))))
        columns.append(("status", list(map(self._status, rows.tolist()))))
        return _frame(columns), n

    def _status(self, row: int) -> str:
        """Return what the table of designs says of a test."""
        if row not in self.ranking.rows:
            return f"beyond limit: {', '.join(beyond_limits(self.table, row))}"
        ranked = int(np.flatnonzero(self.ranking.rows == row)[0])
        if ranked == self.row:
            return self.word
        if (self.table.names[row], self.table.F[row].tolist()) in self._existing:
            return "present design"
        if self.ranking.pareto[ranked]:
            return ""
        other = explain(self.ranking, row=ranked).dominated_by
        return f"dominated by {self.ranking.name_of(other)}"

    def properties(self) -> pd.DataFrame:
        """Return name and value of the variables, outputs and texts that the design has."""
        row = self.ranking.rows[self.row]
        schema = self.table.schema
        left_out = {schema.label, *map(error_column, schema.objectives)}
        rows = []
        for name in (*schema.variables, *schema.outputs, *schema.notes):
            value = self.table.column(name)[row]
            text = _cell(value, self.table.decimal)
            if name in self.formats:
                text = self.formats[name].text(float(value))
            if name not in left_out and text not in ("", "—", "None"):
                rows.append((schema[name].heading, text))
        return pd.DataFrame(rows, columns=["column", "value"])

    def representatives(self) -> tuple[pd.DataFrame, str]:
        """Return a few designs that represent the Pareto set, and how far others are from them."""
        few = representatives(self.ranking, _REPRESENTATIVES)
        objectives = self.ranking.objectives
        columns: list[tuple[str, Sequence[str]]] = []
        columns.append(("design", ["place", "stands for", *objectives.headings()]))
        for row, share in zip(few.rows.tolist(), percents(few.shares), strict=True):
            values = zip(objectives.names, objectives.values[row], strict=True)
            texts = [self.formats[name].text(value) for name, value in values]
            place = str(self.ranking.place[row])
            columns.append((self.ranking.name_of(row), [place, share, *texts]))
        up = Context(prec=3, rounding=ROUND_CEILING)
        radius = up.create_decimal(f"{few.radius:.12g}")  # but for rounding errors
        return _frame(columns), number(float(radius), 3, mark=self.table.decimal)


def _frame(columns: list[tuple[str, Sequence[str]]]) -> pd.DataFrame:
    """Return a frame of columns, some of which may have the same heading."""
    headings, texts = zip(*columns, strict=True)
    return pd.DataFrame(dict(enumerate(texts))).set_axis(headings, axis="columns")


def _few(texts: list[str]) -> str:
    """Return texts as a sentence lists them: the first ones, and how many more there are."""
    n = len(texts) - _CHANGES
    if n > 1:  # a single one takes no more room than its count
        return listed([*texts[:_CHANGES], f"{n} more"])
    return listed(texts)


# Limits


def limit_effects(table: TestTable, choice: Choice | None) -> Iterator[tuple[str, str]]:
    """Yield each limit and constraint and what it does, the most costly one first.

    Args:
        table: The tests.
        choice: The choice among them; None if no design is left. Then it is said how near tests
            come to the limit.
    """
    costs = constraint_costs(table)
    costs["column"] = [*table.schema.constraints, *table.limits]
    costs["words"] = limit_words(table)
    word = table.schema.words["row"]
    for _, cost in costs.sort_values("alone", ascending=False, kind="stable").iterrows():
        sentences = [_rejects(cost, counted(len(table), word))]
        if choice is None:
            sentences.append(_nearest(table, cost))
        else:
            sentences += _without(choice, cost)
        yield cost["words"], " ".join(filter(None, sentences))


def _rejects(cost: pd.Series[Any], designs: str) -> str:
    """Return how many designs a limit rejects, and how many of them nothing else rejects."""
    rejects = int(cost["rejects"])
    if rejects == 0:
        return f"Rejects none of {designs}."
    text = f"Rejects {number(rejects)} of {designs}"
    if cost["alone"] == rejects:
        return f"{text}."
    return f"{text}, {int(cost['alone']) or 'none'} of them as the only limit."


def _nearest(table: TestTable, cost: pd.Series[Any]) -> str:
    """Return the value that comes nearest to a limit."""
    if np.isnan(cost["lower"]):  # allowed texts
        return ""
    name = cost["column"]
    limit = Limit(cost["lower"], cost["upper"])
    excess = limit.excess(name, table.column(name))
    if excess.min() == 0:  # some are within it
        return ""
    nearest = text_beyond(table, name, limit, table.column(name)[excess.argmin()])
    return f"The nearest value is {_with_unit(table, name, nearest)}."


def _without(choice: Choice, cost: pd.Series[Any]) -> Iterator[str]:
    """Yield which design would be proposed without a limit, and the best values then."""
    table = choice.table
    name = cost["column"]
    if cost["alone"] == 0:  # all that it rejects is rejected by others, too
        if cost["rejects"] > 0:
            yield "Without it the proposal is the same."
        return
    limits = {column: limit for column, limit in table.limits.items() if column != name}
    omitted = [*table.formulation.omitted]
    if name in table.schema.constraints:
        omitted.append(name)
    ranking = table.under(limits=limits, omitted=omitted).feasible_ranking()
    if choice.ranking.rows[choice.optimum] in ranking.rows[ranking.salukvadze]:
        yield "Without it the proposal is the same."
    else:
        yield f"Without it {ranking.name_of(ranking.salukvadze[0])} is proposed."
    gains = []
    for objective, sign in zip(table.schema.objectives, table.schema.sign, strict=True):
        now = cost[f"{objective}_feasible"]
        free = cost[f"{objective}_alone"]
        if (now - free) * sign > 0:
            best = choice.amount(objective, free)
            gains.append(
                f"the best {objective} is {best} instead of {choice.amount(objective, now)}"
            )
    if gains:
        yield f"Without it {_few(gains)}."


def _with_unit(table: TestTable, name: str, text: str) -> str:
    """Return a number of a column with its unit, on one line."""
    unit = table.schema.units.get(name, "")
    return f"{text}\N{NO-BREAK SPACE}{unit}".strip()


def _cell(value: Any, mark: str) -> str:
    """Return a value as a report shows it: numbers with five digits and a decimal mark."""
    if not isinstance(value, float):
        return str(value)
    if not np.isfinite(value):
        return "—"
    return number(value, 5, mark=mark)


# The tests: how many there are, why they failed or are incomplete, whether more would help


def problem_facts(table: TestTable) -> Values:
    """Return what is known of the problem that a table is about, by name."""
    problem = table.problem or {}
    facts = {"Problem": problem.get("problem"), "points": problem.get("sampling")}
    return facts | {"key": problem.get("key"), **(problem.get("parameters") or {})}


def failures(table: TestTable) -> pd.DataFrame:
    """Return the reasons why rows have no values, the most frequent first."""
    tests = [*table.reasons]
    reasons = alike(table.reasons.values())
    if table.schema.words["row"] == "design":
        reasons = [reason.replace(" is nan", " is missing") for reason in reasons]
    rows = []
    for reason, count in Counter(reasons).most_common(_REASONS):
        first = tests[reasons.index(reason)]
        name = table.names[table.numbers.tolist().index(first)]
        rows.append({"designs": str(count), "reason": reason[:400], "first": name})
    return pd.DataFrame(rows)


def verdict(table: TestTable) -> str:
    """Return whether more tests would change the choice; empty if nothing is known of it."""
    if not table.schema.variables:  # such as offers, which do not sample a space
        return ""
    if not {"sampling", "runs"} & {*(table.problem or {})}:  # tests in an order without a meaning
        return ""
    try:
        steps = convergence(table)
    except PsiError:  # its reason is about the evenly spread tests only
        return "Unknown: this takes 8 evenly spread tests or more, some of them within the limits."
    if len(steps) <= 1:
        return ""
    return convergence_sentence(steps)


# How texts, tables and figures are shown


@pass_context
def printable(report: runtime.Context, value: Any) -> Any:
    """Return a text without control characters, in which units and % stay with their numbers."""
    if not isinstance(value, str) or hasattr(value, "__html__"):
        return value
    text = re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]", "\N{REPLACEMENT CHARACTER}", value)
    words = "|".join(map(re.escape, ["%", *report["data"].schema.units.values()]))
    return re.sub(rf"(?<=\d) (?=({words})(?!\w))", "\N{NO-BREAK SPACE}", text)


def grid(frame: pd.DataFrame) -> list[list[tuple[str, str]]]:
    """Return the rows of a table, the headings first, each cell with its class, "n" for numbers."""
    classes = []
    for _, texts in frame.items():
        is_number = all(map(_NUMBER.fullmatch, texts)) and any(texts)
        classes.append("n" if is_number else "")
    rows: list[Iterable[str]] = [frame.columns, *frame.to_numpy()]
    return [list(zip(row, classes, strict=True)) for row in rows]


def image(figure: plots.Drawing, width: float | None = None) -> str:
    """Return a figure as the address of an image that holds it.

    Nothing drawn in an image can reach the rest of the document.

    Args:
        figure: The figure.
        width: Its width from now on in mm; by default that which it has.
    """
    if width is not None:
        figure.resize(width)
    # Quoted, most characters stay one; between the tags of a drawing nothing is to be kept.
    drawing = re.sub(r"\s+", " ", plots.svg_of(figure, _DPI)).replace("> <", "><")
    return f"data:image/svg+xml,{quote(drawing, safe=_KEPT)}"
