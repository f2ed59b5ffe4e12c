"""The contents of a report, which report.html lays out: the design, the tests, the limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from pymoo_psi._validation import Array, Values, counted
from pymoo_psi.errors import PsiError
from pymoo_psi.page import notations, written
from pymoo_psi.pareto import (
    alternative,
    capital,
    cautions,
    compare_designs,
    explain,
    number,
    percent,
    representatives,
    sentence,
    weights_sentence,
)
from pymoo_psi.selection import (
    CompromiseProgramming,
    Knee,
    SalukvadzeOptimum,
    compare_selectors,
)
from pymoo_psi.table import (
    Allowed,
    TestTable,
    alike,
    confidence_sentence,
    constraint_costs,
    convergence,
    latest_positions,
    limit_text,
)

if TYPE_CHECKING:
    import pandas as pd

_REASONS = 12  # of failures in the table, the most frequent ones
_LIMITS = 6  # in the table, those that cost most
_IDLE = 3  # limits that cost nothing, by name
_EXACT = 15  # digits of limits, which are as they were given
_REPRESENTATIVES = 5  # side by side on paper

Cells: TypeAlias = dict[str, list[str]]
"""Cells of texts by their headings."""


def cell(value: Any) -> str:
    """Return a value as a report shows it: numbers with five digits."""
    if not isinstance(value, float):
        return str(value)
    if not np.isfinite(value):
        return "—"
    return number(value, 5)


def _limit(table: TestTable, name: str, limit: Allowed) -> str:
    """Return a limit with its unit: ``20 ≤ mass ≤ 55 kg``."""
    if isinstance(limit, list):
        return limit_text(name, limit)
    lower, upper = limit
    unit = table.layout.units.get(name, "")
    if np.isinf(upper):
        return f"{name} ≥ {number(lower, _EXACT)} {unit}".strip()
    text = f"{name} ≤ {number(upper, _EXACT)} {unit}".strip()
    if np.isfinite(lower):
        text = f"{number(lower, _EXACT)} ≤ {text}"
    return text


def _with_unit(table: TestTable, name: str, value: float) -> str:
    unit = table.layout.units.get(name, "")
    return f"{cell(value)} {unit}".strip()


class Choice:
    """The design that is chosen or, if none is, proposed among ranked tests.

    Args:
        table: The tests; their formulation says which design is chosen, and why. If none is, the
            Salukvadze optimum is proposed.
        prototype: Existing designs; None if there are none.

    Attributes:
        word: "chosen" or "proposed".
        ranking: The ranking of the feasible tests.
        optimum: Row of the Salukvadze optimum in the ranking, the first of several.
        row: Row of the design in the ranking.
        is_optimum: Whether the design is a Salukvadze optimum.
        name: Name of the design.
        reason: Why it was chosen.
        explanation: Why it is where it is.
        cautions: Reasons not to rely on the optimum, the most serious first.
        alternatives: Sentences on the designs that selectors choose.
    """

    def __init__(self, table: TestTable, prototype: TestTable | None) -> None:
        self.table = table
        self.prototype = prototype
        self.notations = notations(table)
        self.layout = table.layout
        self.ranking = table.feasible_ranking()
        self.optimum = int(self.ranking.salukvadze[0])
        self.row = self.optimum
        self.word = "proposed"
        chosen = table.formulation.chosen
        if chosen is not None:
            self.row = self.ranking.rows.tolist().index(table.names.index(chosen))
            self.word = "chosen"
        self.reason = table.formulation.reason
        self.is_optimum = self.row in self.ranking.salukvadze
        self.name = self.ranking.name_of(self.row)
        self.explanation = explain(self.ranking, row=self.row)
        subject = "Attention"
        if not self.is_optimum:  # which the cautions are about
            subject = f"Attention to {self.ranking.name_of(self.optimum)}, the optimum"
        self.cautions = tuple(f"{subject}: {caution}" for caution in cautions(self.ranking))
        self.alternatives = self._alternatives()

    def _alternatives(self) -> list[str]:
        """Return a sentence on what each of a few selectors would choose instead."""
        normalize = self.ranking.frame.normalize
        other = "distances in units of the ranges"
        if normalize:
            other = "plain distances"
        selectors = {
            "knee": Knee(),
            "chebyshev": CompromiseProgramming(np.inf, normalize=normalize),
            other: SalukvadzeOptimum(normalize=not normalize),
        }
        selected = {}
        if not self.is_optimum:
            selected["Salukvadze optimum"] = self.ranking.salukvadze
        selected |= compare_selectors(self.ranking, selectors)
        sentences = []
        for name, rows in selected.items():
            sentences.append(f"{name}: {alternative(self.ranking, rows, self.row)}")
        weights = weights_sentence(self.ranking, self.row)
        if weights:
            sentences.append(f"weights: {weights}")
        sure = confidence_sentence(self.table, self.row)
        if sure:
            sentences.append(f"noise: {sure}")
        return sentences

    def instead(self) -> str:
        """Return a sentence on how the design differs from the proposed one."""
        pair = compare_designs(self.ranking, rows=[self.optimum, self.row])
        optimum = self.ranking.name_of(self.optimum)
        difference = pair.difference(1)
        return sentence("instead", design=capital(self.name), other=optimum, difference=difference)

    def _texts(self, values: Array) -> list[str]:
        """Return ``(m,)`` objectives as the page writes them."""
        pairs = zip(self.layout.objectives, values, strict=True)
        return [written(self.notations[name], value) for name, value in pairs]

    def objectives(self) -> Cells:
        """Return the objectives of the design, and of others, between best and worst."""
        values = self.ranking.objectives.values
        columns = {
            "objective": [self.layout.label_of(name) for name in self.layout.objectives],
            self.word: self._texts(values[self.row]),
        }
        if not self.is_optimum:
            columns["proposed"] = self._texts(values[self.optimum])
        if self.prototype is not None:
            for row, name in enumerate(self.prototype.names):
                sign = self.ranking.objectives.sign
                present = self.prototype.F[row] * sign
                columns[name] = self._texts(present)
                columns[f"against {name}"] = self._gains(present)
        columns["best"] = self._texts(self.ranking.ideal)
        columns["worst"] = self._texts(self.ranking.nadir)
        behind = []
        for share in self.explanation.shares:
            if np.isnan(share):
                behind.append("—")
            else:
                behind.append(percent(share))
        columns["behind best"] = behind
        return columns

    def _gains(self, present: Array) -> list[str]:
        """Return by how much the design is better or worse than ``(m,)`` other values."""
        objectives = self.ranking.objectives
        gains = (present - objectives.values[self.row]) * objectives.sign
        words = {1.0: "better", -1.0: "worse", 0.0: ""}
        return [f"{number(abs(gain))} {words.get(np.sign(gain), '')}".strip() for gain in gains]

    def values(self) -> list[tuple[str, str]]:
        """Return name and value of the variables, outputs and texts that the design has."""
        row = self.ranking.rows[self.row]
        pairs = []
        for name in (*self.layout.variables, *self.layout.outputs):
            value = self.table.column(name)[row]
            text = str(value)
            if name in self.notations:
                text = written(self.notations[name], float(value))
            pairs.append((self.layout.label_of(name), text))
        for name, texts in self.table.extra.items():
            if name != self.layout.label:
                pairs.append((name, cell(texts[row])))
        return [(name, text) for name, text in pairs if text not in ("", "—", "None")]

    def representatives(self) -> tuple[Cells, str]:
        """Return a few designs that represent the Pareto set, and a caption."""
        few = representatives(self.ranking, _REPRESENTATIVES)
        labels = [self.layout.label_of(name) for name in self.layout.objectives]
        columns = {"design": ["place", "stands for", *labels]}
        for row, share in zip(few.rows.tolist(), few.shares, strict=True):
            values = self._texts(self.ranking.objectives.values[row])
            place = str(self.ranking.place[row])
            columns[self.ranking.name_of(row)] = [place, percent(share), *values]
        n = counted(self.ranking.pareto.sum(), "Pareto-optimal design")
        caption = (
            f"{len(few.rows)} representatives of {n}, the optimum first. "
            "Each stands for the designs nearest to it"
        )
        if few.radius:
            caption += f", none farther than {few.radius:.3g}"
        return columns, f"{caption}."


def positions(table: TestTable) -> Cells:
    """Return who holds which design since when, under which limits and weights, and why."""
    rows = []
    for position in latest_positions(table.formulation.positions):
        name = position["name"]
        history = [one for one in table.formulation.positions if one["name"] == name]
        before = [f"{one['chosen'] or 'none'} ({one['date'][:10]})" for one in history[:-1]]
        under = written_limits(table.under(limits=position["limits"]))
        for key in ("weights", "aspiration"):
            word = key.removesuffix("s")
            values = position[key].items()
            under += [f"{word} of {objective} {number(value)}" for objective, value in values]
        row = {
            "name": name,
            "since": position["date"][:10],
            "choice": position["chosen"] or "none",
            "before": ", ".join(before),
            "under": "; ".join(under),
            "why": position["reason"],
        }
        rows.append(row)
    return {heading: texts for heading, texts in _cells(rows).items() if any(texts)}


def _cells(rows: Sequence[Mapping[str, str]]) -> Cells:
    """Return rows of texts by their headings as columns."""
    cells: Cells = {}
    for row in rows:
        for heading, text in row.items():
            cells.setdefault(heading, []).append(text)
    return cells


# The tests: how many there are, what limits cost, and why tests failed or designs are incomplete


def problem_facts(table: TestTable) -> Values:
    """Return facts about the problem by name."""
    problem = table.problem or {}
    facts = {
        "Problem": problem.get("problem"),
        "points": problem.get("sampling"),
        "key": problem.get("key"),
    }
    facts |= problem.get("parameters") or {}
    return {
        str(name): fact
        for name, fact in facts.items()
        if fact is not None and not isinstance(fact, dict)
    }


def test_counts(table: TestTable) -> str:
    """Return a sentence on how many rows failed, are feasible and are Pareto optimal."""
    failed = table.status == "failed"
    feasible = table.feasible()
    masks = {
        table.layout.words.failed: failed,
        "beyond a constraint or a limit": ~failed & ~feasible,
        "feasible": feasible,
        "Pareto optimal": table.pareto(),
    }
    n = len(table)
    parts = []
    for name, mask in masks.items():
        count = mask.sum()
        if count:
            parts.append(f"{number(count)} {name} ({percent(count / n)})")
    return f"{counted(n, 'design')}: {', '.join(parts)}."


def failures(table: TestTable) -> Cells:
    """Return the reasons why rows have no values, the most frequent first."""
    reasons = list(table.reasons.values())
    if table.layout.words.row == "design":
        reasons = [reason.replace(" is nan", " is missing") for reason in reasons]
    failed: dict[str, list[int]] = {}  # numbers of tests by reason
    for test, reason in zip(table.reasons, alike(reasons), strict=True):
        failed.setdefault(reason, []).append(test)
    most_frequent = sorted(failed, key=lambda reason: -len(failed[reason]))
    rows = []
    for reason in most_frequent[:_REASONS]:
        tests = failed[reason]
        first = table.names[table.numbers.tolist().index(tests[0])]
        rows.append({"designs": str(len(tests)), "reason": reason[:400], "first": first})
    return _cells(rows)


def verdict(table: TestTable) -> str:
    """Return whether more tests would change the choice; empty if nothing is known of it."""
    if not {"sampling", "runs"} & {*(table.problem or {})}:  # tests in an order without a meaning
        return ""
    try:
        steps = convergence(table)
    except PsiError:  # whose reason is about the evenly spread tests only
        return "Not known: it takes 8 evenly spread tests or more, some of them feasible."
    if len(steps.tests) <= 1:
        return ""
    return steps.verdict()


# Limits


def written_limits(table: TestTable) -> list[str]:
    """Return the limits as they are written."""
    return [_limit(table, name, limit) for name, limit in table.limits.items()]


def limit_costs(table: TestTable) -> tuple[Cells, list[str]]:
    """Return what the constraints and limits cost that cost most, and some that cost nothing.

    Without a feasible design it is said how near tests come to keeping them.
    """
    limited = {limit_text(name, limit): name for name, limit in table.limits.items()}
    costs = constraint_costs(table)
    idle = []
    last = "nearest value"
    describe = _nearest
    if table.eligible().any():
        idle = costs.index[costs["alone"] == 0].tolist()
        costs = costs[costs["alone"] > 0]
        last = "best values without it"
        describe = _gain
    if costs.empty:
        return {}, []
    rows = []
    top = costs.sort_values("alone", ascending=False, kind="stable").head(_LIMITS)
    for text, cost in top.iterrows():
        column = limited.get(str(text), str(text))
        title = column
        if column in table.limits:
            title = _limit(table, column, table.limits[column])
        row = {
            "constraint or limit": title,
            "rejects": number(cost["rejects"]),
            "rejects alone": number(cost["alone"]),
            last: describe(table, column, cost),
        }
        rows.append(row)
    return _cells(rows), [limited.get(text, text) for text in idle[:_IDLE]]


def _nearest(table: TestTable, name: str, cost: pd.Series[Any], /) -> str:
    """Return the value that comes nearest to keeping a constraint or limit on a column."""
    if isinstance(table.limits.get(name), list):
        return "—"
    # Variables of several kinds are a matrix of objects.
    values = table.column(name).astype(np.float64)
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return "—"
    excess = np.maximum(cost["lower"] - values, values - cost["upper"])
    if excess.min() <= 0:
        return "kept by some"
    return _with_unit(table, name, values[excess.argmin()])


def _gain(table: TestTable, _: str, cost: pd.Series[Any], /) -> str:
    """Return the objectives in which designs that a limit alone rejects beat the feasible ones."""
    gains = []
    for name, sign in zip(table.layout.objectives, table.layout.sign, strict=True):
        now = cost[f"{name}_feasible"]
        best = cost[f"{name}_alone"]
        if (now - best) * sign > 0:
            gains.append(f"{name} {_with_unit(table, name, best)} instead of {cell(now)}")
    return "; ".join(gains) or "no better in any objective"
