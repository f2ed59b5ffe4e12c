"""The contents of a report, which report.html lays out.

:class:`Choice` has what is said of the chosen or proposed design. Functions return what is said of
the table: positions, counts, failures, and what limits cost. Tables are frames of texts. At the end
are the filters by which report.html shows values, tables and figures.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from pymoo_psi import plots
from pymoo_psi._numbers import number, percent
from pymoo_psi._validation import Array, Values, counted
from pymoo_psi.analysis import alike, constraint_costs, convergence
from pymoo_psi.errors import PsiError
from pymoo_psi.page import number_formats
from pymoo_psi.pareto import (
    cautions,
    compare_designs,
    explain,
    representatives,
    within_range,
)
from pymoo_psi.table import Limit, TestTable

_REASONS = 12  # the table has the most frequent reasons of failures
_LIMITS = 6  # the table has the limits that cost most
_REPRESENTATIVES = 5  # side by side on paper
_DPI = 200  # markers too many to be drawn one by one are an image, as fine as on good paper
# A number, a share in per cent, a date, or nothing. Columns of such cells are aligned to the right.
_NUMBER = re.compile(r"[-+−]?[\d.,\u00a0]+(e[-+]?\d+)?([ \u00a0]%)?|—|∞|-?inf|nan|\d{4}-\d\d-\d\d|")


def _cell(value: Any) -> str:
    """Return a value as a report shows it: numbers with five digits."""
    if not isinstance(value, float):
        return str(value)
    if not np.isfinite(value):
        return "—"
    return number(value, 5)


class Choice:
    """The design that is chosen or, if none is, proposed among ranked tests.

    Args:
        table: The tests; their decision says which design is chosen, and why. If none is, the
            Salukvadze optimum is proposed.
        prototype: Existing designs; None if there are none.

    Attributes:
        word: "chosen" or "proposed".
        ranking: The ranking of the feasible tests.
        optimum: Row of the Salukvadze optimum in the ranking, the first of several.
        row: Row of the design in the ranking.
        is_optimum: Whether the design is a Salukvadze optimum.
        name: Name of the design.
        explanation: Why it is where it is.
        cautions: Reasons not to rely on the optimum, the most serious first.
    """

    def __init__(self, table: TestTable, prototype: TestTable | None) -> None:
        self.table = table
        self.prototype = prototype
        self.formats = number_formats(table)
        self.ranking = table.feasible_ranking()
        self.optimum = int(self.ranking.salukvadze[0])
        self.row = self.optimum
        self.word = "proposed"
        chosen = table.decision.chosen
        if chosen is not None:
            self.row = self.ranking.rows.tolist().index(table.names.index(chosen))
            self.word = "chosen"
        self.is_optimum = self.row in self.ranking.salukvadze
        self.name = self.ranking.name_of(self.row)
        self.explanation = explain(self.ranking, row=self.row)
        subject = "Attention"
        if not self.is_optimum:  # the cautions are about the optimum
            subject = f"Attention to {self.ranking.name_of(self.optimum)}, the optimum"
        self.cautions = tuple(f"{subject}: {caution}" for caution in cautions(self.ranking))

    def instead(self) -> str:
        """Return a sentence on how the design differs from the proposed one."""
        pair = compare_designs(self.ranking, rows=[self.optimum, self.row])
        return pair.sentence("instead", 1)

    def _texts(self, values: Array) -> list[str]:
        """Return ``(m,)`` objectives as the page writes them."""
        pairs = zip(self.ranking.objectives.names, values, strict=True)
        return [self.formats[name].text(value) for name, value in pairs]

    def objectives(self) -> pd.DataFrame:
        """Return the objectives of the design, and of others, between best and worst."""
        objectives = self.ranking.objectives
        present = objectives.values[self.row]
        columns = {"objective": objectives.headings(), self.word: self._texts(present)}
        if not self.is_optimum:
            columns["proposed"] = self._texts(objectives.values[self.optimum])
        if self.prototype is not None:
            for name, values in zip(self.prototype.names, self.prototype.F, strict=True):
                columns[name] = self._texts(values * objectives.sign)
                gains = values - present * objectives.sign
                columns[f"against {name}"] = [_gain(gain) for gain in gains]
        columns["best"] = self._texts(self.ranking.ideal)
        columns["worst"] = self._texts(self.ranking.nadir)
        columns["behind best"] = self._behind()
        return pd.DataFrame(columns)

    def _behind(self) -> list[str]:
        """Return how far the design is behind the best in each objective."""
        why = self.explanation
        texts = []
        pairs = zip(self.ranking.objectives.names, why.behind, why.shares, strict=True)
        for name, difference, share in pairs:
            text = _with_unit(self.table, name, float(difference))
            if within_range(share):
                text = percent(share)
            texts.append(text)
        return texts

    def values(self) -> pd.DataFrame:
        """Return name and value of the variables, outputs and texts that the design has."""
        row = self.ranking.rows[self.row]
        schema = self.table.schema
        rows = []
        for name in (*schema.variables, *schema.outputs, *schema.notes):
            if name == schema.label:
                continue
            value = self.table.column(name)[row]
            text = _cell(value)
            if name in schema.variables:
                text = str(value)
            if name in self.formats:
                text = self.formats[name].text(float(value))
            rows.append((schema[name].heading, text))
        frame = pd.DataFrame(rows, columns=["column", "value"])
        return frame[~frame["value"].isin(["", "—", "None"])]

    def representatives(self) -> tuple[pd.DataFrame, str]:
        """Return a few designs that represent the Pareto set, and a caption."""
        few = representatives(self.ranking, _REPRESENTATIVES)
        objectives = self.ranking.objectives
        columns = {"design": ["place", "stands for", *objectives.headings()]}
        for row, share in zip(few.rows.tolist(), few.shares, strict=True):
            values = self._texts(objectives.values[row])
            place = str(self.ranking.place[row])
            columns[self.ranking.name_of(row)] = [place, percent(share), *values]
        n = counted(self.ranking.pareto.sum(), "Pareto-optimal design")
        caption = (
            f"{len(few.rows)} representatives of {n}, the optimum first. Each stands for the "
            f"designs nearest to it, none farther than {number(few.radius, 3)}."
        )
        return pd.DataFrame(columns), caption


def _gain(gain: float) -> str:
    """Return by how much a design is better than another in an objective."""
    if gain == 0:
        return "0"
    word = "better" if gain > 0 else "worse"
    return f"{number(abs(gain))} {word}"


# The tests: how many there are, what limits cost, and why tests failed or designs are incomplete


def problem_facts(table: TestTable) -> Values:
    """Return facts about the problem by name."""
    problem = table.problem or {}
    facts = {"Problem": problem.get("problem"), "points": problem.get("sampling")}
    facts |= {"key": problem.get("key"), **(problem.get("parameters") or {})}
    return {
        name: fact
        for name, fact in facts.items()
        if fact is not None and not isinstance(fact, Mapping)
    }


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
    if not {"sampling", "runs"} & {*(table.problem or {})}:  # tests in an order without a meaning
        return ""
    try:
        steps = convergence(table)
    except PsiError:  # its reason is about the evenly spread tests only
        return "Not known: it takes 8 evenly spread tests or more, some of them feasible."
    if len(steps.tests) <= 1:
        return ""
    return steps.verdict()


# Limits


def limit_costs(table: TestTable) -> pd.DataFrame:
    """Return what the constraints and limits cost that cost most.

    Without a feasible design it is said how near tests come to keeping them.
    """
    costs = constraint_costs(table)
    costs["column"] = [*table.schema.constraints, *table.limits]
    last = "nearest value"
    describe = _nearest
    if table.feasible().any():
        last = "best values without it"
        describe = _best_values
    rows = []
    top = costs.sort_values("alone", ascending=False, kind="stable").head(_LIMITS)
    for text, cost in top.iterrows():
        row = {
            "constraint or limit": text,
            "rejects": number(cost["rejects"]),
            "rejects alone": number(cost["alone"]),
            last: describe(table, cost),
        }
        rows.append(row)
    return pd.DataFrame(rows)


def _nearest(table: TestTable, cost: pd.Series[Any]) -> str:
    """Return the value that comes nearest to keeping a constraint or limit."""
    if np.isnan(cost["lower"]):  # allowed texts
        return "—"
    name = cost["column"]
    limit = Limit(cost["lower"], cost["upper"])
    excess = limit.excess(name, table.column(name))
    if excess.min() == 0:
        return "kept by some"
    return _with_unit(table, name, float(table.column(name)[excess.argmin()]))


def _best_values(table: TestTable, cost: pd.Series[Any]) -> str:
    """Return the objectives in which designs that a limit alone rejects beat the feasible ones."""
    gains = []
    for name, sign in zip(table.schema.objectives, table.schema.sign, strict=True):
        now = cost[f"{name}_feasible"]
        best = cost[f"{name}_alone"]
        if (now - best) * sign > 0:
            gains.append(f"{name} {_with_unit(table, name, best)} instead of {_cell(now)}")
    return "; ".join(gains) or "no better in any objective"


def _with_unit(table: TestTable, name: str, value: float) -> str:
    unit = table.schema.units.get(name, "")
    return f"{_cell(value)} {unit}".strip()


# How values, tables and figures are shown


def printable(value: Any) -> Any:
    """Return a text without control characters, in which per cent signs stay with their numbers."""
    if not isinstance(value, str) or hasattr(value, "__html__"):
        return value
    text = re.sub(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]", "\N{REPLACEMENT CHARACTER}", value)
    return text.replace(" %", "\N{NO-BREAK SPACE}%")


def grid(frame: pd.DataFrame) -> list[list[tuple[str, str]]]:
    """Return the rows of a table, the headings first, each cell with its class, "n" for numbers."""
    classes = []
    for _, texts in frame.items():
        is_number = all(map(_NUMBER.fullmatch, texts))
        classes.append("n" if is_number else "")
    rows: list[Iterable[str]] = [frame.columns, *frame.to_numpy()]
    return [list(zip(row, classes, strict=True)) for row in rows]


def image(figure: plots.Drawing) -> str:
    """Return a figure as the address of an image that holds it.

    Nothing drawn in an image can reach the rest of the document.
    """
    data = b64encode(plots.svg_of(figure, _DPI).encode("utf-8")).decode("ascii")
    return f"data:image/svg+xml;base64,{data}"
