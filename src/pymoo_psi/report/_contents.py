"""What a report says of the tests, their ranking and the chosen design; report.html puts it down.

A table is a dictionary of columns of texts, by their headings.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pymoo_psi._validation import counted, invalid
from pymoo_psi.errors import PsiError
from pymoo_psi.pareto import (
    alternative,
    cautions,
    compare_designs,
    explain,
    listed,
    number,
    percent,
    representatives,
    sentence,
)
from pymoo_psi.selection import CompromiseProgramming, Knee, SalukvadzeOptimum, compare_selectors
from pymoo_psi.table import TestTable, alike, constraint_costs, convergence, limit_text

_REASONS = 12  # of failures that are listed one by one
_LIMITS = 6  # that cost most
_IDLE = 3  # limits that cost nothing, by name
_FEW = 5  # representatives, side by side on paper

Columns: TypeAlias = dict[str, list[str]]


def cell(value: Any) -> str:
    """Return a value as a report shows it: numbers with five digits."""
    if isinstance(value, (float, np.floating)):
        return number(float(value), 5) if np.isfinite(value) else "—"
    return str(value)


class Case:
    """A table with its ranking and the chosen design.

    Args:
        table: The tests.
        design: Number of the test that is chosen; None if none is.
        reason: Why it was chosen.
        selectors: What else could choose, by name; None for a few.

    Attributes:
        rows: ``(k,)`` which tests are feasible with finite objectives, each design once.
        ranking: The ranking of these; None if there are none, and then only :meth:`limit_costs`
            and :meth:`tests` have something to say, and what follows in this list is not there.
        cautions: What speaks against relying on the optimum, the gravest first.
        decided, word: Whether one is chosen; what the design is.
        best, optimum: Which of them is the Salukvadze optimum, the first of several; its name.
        chosen, name, point: Which is chosen or, if none is, proposed; its name, its test point.
        agrees: Whether this is an optimum.
        why: Why it is where it is.
        choices: What selectors choose, by name.
    """

    def __init__(
        self,
        table: TestTable,
        design: int | str | None,
        reason: str,
        selectors: Mapping[str, Any] | None,
    ) -> None:
        self.table, self.layout, self.reason = table, table.layout, reason
        self.decided = design is not None
        # Nothing is chosen until somebody has.
        self.word = "chosen" if self.decided else "proposed"
        self.units = {n: u for n, u in self.layout.units.items() if n in self.layout.objectives}
        self.ranking: Any = None
        self.rows: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        self.cautions: tuple[str, ...] = ()
        if table.eligible().any():
            self.ranking = table.feasible_ranking()
            self.rows = self.ranking.rows
        at = self.ranking.salukvadze if self.ranking else self.rows
        if design is not None:
            at = np.flatnonzero(self.rows == table.row_of(design))
            if len(at) == 0:
                raise invalid("design", "the number or label of a feasible test", design)
        if not self.ranking:
            return
        self.best, self.chosen = int(self.ranking.salukvadze[0]), int(at[0])
        self.optimum, self.name = map(self.ranking.name_of, (self.best, self.chosen))
        self.point = int(table.numbers[self.rows[self.chosen]])
        self.agrees = self.chosen in self.ranking.salukvadze
        self.why = explain(self.ranking, self.chosen, units=self.units)
        self.choices = self._choices(selectors)
        # They are about the optimum, which need not be what was chosen.
        what = "" if self.agrees else f" to {self.optimum}, the optimum"
        self.cautions = tuple(f"Attention{what}: {each}" for each in cautions(self.ranking))

    def asked(self) -> list[str]:
        """Return the limits as one writes them."""
        return [self._limit(n, *pair) for n, pair in self.table.limits.items()]

    def instead(self) -> str:
        """Return what the design is chosen instead of, and how they differ."""
        pair = compare_designs(self.ranking, [self.best, self.chosen], units=self.units)
        names = {"design": self.name, "other": self.optimum}
        return sentence("instead", **names, difference=pair.difference(1))

    def standing(self) -> Columns:
        """Return the objectives of the design, and of the optimum, between best and worst."""
        ranking = self.ranking
        columns = {"objective": [*map(self.layout.label_of, self.layout.objectives)]}
        columns[self.word] = [*map(cell, ranking.objectives.values[self.chosen])]
        if not self.agrees:
            columns["proposed"] = [*map(cell, ranking.objectives.values[self.best])]
        columns |= {"best": [*map(cell, ranking.ideal)], "worst": [*map(cell, ranking.nadir)]}
        shares = ["—" if np.isnan(share) else percent(share) for share in self.why.shares]
        return columns | {"behind, of range": shares}

    def known(self) -> list[tuple[str, str]]:
        """Return what else is known of the design, though others may lack it."""
        table, layout, row = self.table, self.layout, self.rows[self.chosen]
        names = (*layout.variables, *layout.outputs)
        found = [(layout.label_of(name), cell(table.column(name)[row])) for name in names]
        texts = [(n, cell(texts[row])) for n, texts in table.extra.items() if n != layout.label]
        return [(n, text) for n, text in found + texts if text not in ("", "—", "None")]

    def limit_costs(self) -> tuple[Columns, list[str]]:
        """Return what constraints and limits cost, those that cost most, and notes on them.

        Of a table without a feasible design, how near tests come to keep them.
        """
        costs, constraints = constraint_costs(self.table), self.layout.constraints
        found = costs[costs["alone"] > 0] if self.ranking else costs
        shown = found.sort_values("alone", ascending=False, kind="stable").head(_LIMITS)
        limited = {limit_text(name, *ends): name for name, ends in self.table.limits.items()}
        names = [limited.get(text, text) for text in shown.index]
        ends = list(zip(names, shown["lower"], shown["upper"], strict=True))
        columns = {
            "constraint or limit": [e[0] if e[0] in constraints else self._limit(*e) for e in ends],
            "rejects": [*map(number, shown["rejects"].tolist())],
            "it alone": [*map(number, shown["alone"].tolist())],
        }
        if self.ranking:
            gains = [self._gain(row) for _, row in shown.iterrows()]
            columns["without it the best values would be"] = gains
        else:
            columns["nearest value"] = [self._reached(*each) for each in ends]
        notes = []
        if idle := [str(name) for name in costs.index if name not in found.index]:
            notes.append(f"No design is rejected by {listed(idle[:_IDLE], 'or')} alone.")
        if self.layout.inequalities:
            notes.append("A constraint is met where its value is 0 or less.")
        if self.layout.equalities:
            notes.append(f"An equality is met within {self.layout.eq_tolerance:g}.")
        return columns if ends else {}, notes

    def _amount(self, name: str, value: float) -> str:
        return f"{cell(value)} {self.layout.units.get(name, '')}".strip()

    def _limit(self, name: str, lower: float, upper: float) -> str:
        """Return a limit as one writes it."""
        if np.isinf(upper):
            return f"{name} ≥ {self._amount(name, lower)}"
        low = f"{cell(lower)} ≤ " if np.isfinite(lower) else ""
        return f"{low}{name} ≤ {self._amount(name, upper)}"

    def _reached(self, name: str, lower: float, upper: float) -> str:
        """Return the value of a column that comes nearest to a limit."""
        values = self.table.column(name)
        values = values[np.isfinite(values)].astype(np.float64)
        over = np.maximum(np.maximum(lower - values, values - upper), 0)
        if len(over) and over.min() == 0:
            return "kept by some"
        return self._amount(name, float(values[over.argmin()])) if len(over) else "—"

    def _gain(self, costs: pd.Series[Any]) -> str:
        """Return in which objectives designs that a limit alone rejects beat the feasible ones."""
        gains = []
        for name, sign in zip(self.layout.objectives, self.layout.sign, strict=True):
            now, then = costs[f"{name}_feasible"], costs[f"{name}_alone"]
            if (now - then) * sign > 0:
                gains.append(f"{name} {self._amount(name, then)} instead of {cell(now)}")
        return "; ".join(gains) or "no better in any objective"

    def _choices(self, selectors: Mapping[str, Any] | None) -> dict[str, NDArray[np.intp]]:
        if selectors is None:
            normalize = self.table.formulation.normalize
            other = "plain distances" if normalize else "distances in units of the ranges"
            chebyshev = CompromiseProgramming(np.inf, normalize=normalize)
            selectors = {"knee": Knee(), "chebyshev": chebyshev}
            if not self.table.formulation.ranges:  # which only the ranking itself knows
                selectors[other] = SalukvadzeOptimum(normalize=not normalize)
        optimum = {} if self.agrees else {"Salukvadze optimum": self.ranking.salukvadze}
        return optimum | (compare_selectors(self.ranking, selectors) if selectors else {})

    def others(self) -> list[str]:
        """Return what other preferences choose."""
        return [
            f"{name}: {alternative(self.ranking, chosen, self.chosen, self.units)}"
            for name, chosen in self.choices.items()
        ]

    def few(self) -> tuple[Columns, str]:
        """Return a few designs that stand for all, and what they are."""
        few, ranking = representatives(self.ranking, _FEW), self.ranking
        columns = {"": ["stands for", *map(self.layout.label_of, self.layout.objectives)]}
        for row, share in zip(few.rows.tolist(), few.shares, strict=True):
            values = map(cell, ranking.objectives.values[row])
            columns[ranking.name_of(row)] = [percent(share), *values]
        n = counted(int(ranking.pareto.sum()), "Pareto-optimal design")
        what = f"{len(few.rows)} for {n}, the optimum first: each stands for those nearest to it"
        return columns, what + (f", none farther than {few.radius:.3g}." if few.radius else ".")

    def facts(self) -> dict[str, Any]:
        """Return what is known of the problem."""
        known = self.table.problem or {}
        facts = {"Problem": known.get("problem"), "points": known.get("sampling")}
        facts |= {"key": known.get("key")} | (known.get("parameters") or {})
        return {str(name): value for name, value in facts.items() if value is not None}

    def tests(self) -> str:
        """Return how many tests there are, and what became of them."""
        failed, feasible = self.table.status == "failed", self.table.feasible()
        steps = {
            "failed": failed.sum(),
            "beyond a constraint or a limit": (~failed & ~feasible).sum(),
            "feasible": feasible.sum(),
            "Pareto optimal": self.ranking.pareto.sum() if self.ranking else 0,
        }
        n = len(self.table)
        counts = [f"{number(k)} {name} ({percent(k / n)})" for name, k in steps.items() if k]
        return f"{counted(n, 'design')}: {', '.join(counts)}."

    def failures(self) -> Columns:
        """Return why tests failed, the most frequent reason first."""
        at = dict(zip(self.table.numbers.tolist(), self.table.names, strict=True))
        reasons = self.table.reasons
        found = pd.DataFrame({"reason": alike(reasons.values()), "first": [at[n] for n in reasons]})
        groups = found.groupby("reason", sort=False)["first"].agg(["size", "first"])
        top = groups.sort_values("size", ascending=False, kind="stable").head(_REASONS)
        shown = [str(reason)[:400] for reason in top.index]
        return {"designs": [*map(str, top["size"])], "reason": shown, "first": [*top["first"]]}

    def verdict(self) -> str:
        """Return whether more tests would change the choice; empty if nothing is known of it."""
        if "sampling" not in (self.table.problem or {}):  # rows in an order that says nothing
            return ""
        try:
            steps = convergence(self.table)
        except PsiError:  # its reason is of the evenly spread part alone
            return "Not known: it takes 8 evenly spread tests or more, some of them feasible."
        return steps.verdict() if len(steps.tests) > 1 else ""
