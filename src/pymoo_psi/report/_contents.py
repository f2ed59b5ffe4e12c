"""The sections of a report, from the tests, their ranking and the chosen design."""

from __future__ import annotations

import io
import re
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from matplotlib import rc_context
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from pymoo_psi._validation import boolean, counted, integer, invalid
from pymoo_psi.errors import PsiError
from pymoo_psi.pareto import (
    EfficiencyRanking,
    alternative,
    capital,
    cautions,
    compare_designs,
    explain,
    listed,
    measured_in,
    number,
    percent,
    representatives,
    sentence,
)
from pymoo_psi.plots import (
    Drawing,
    plot_feasibility,
    plot_objectives,
    plot_ranking,
    plot_sensitivities,
    plot_table,
)
from pymoo_psi.selection import CompromiseProgramming, Knee, SalukvadzeOptimum, compare_selectors
from pymoo_psi.table import (
    Limits,
    TestTable,
    alike,
    bounds_of,
    constraint_costs,
    convergence,
    even_part,
    feasibility_rules,
    sensitivities,
    value_ranks,
)

_REASONS = 12  # of failures that are listed one by one
_LIMITS = 6  # that cost most
_SHORT = 10  # rows of a table that stands beside another
_HISTOGRAM, _COLUMNS = 30, 24  # designs that make a histogram, and histograms on a page
_PAIRS = 5  # objectives in pairs of which axes on paper are still readable
_FEW = 5  # representatives, side by side on paper
# Sensitivities and rules of more tests say the same and take long; the first points of a sequence
# are an investigation of their own.
_ENOUGH = 8192
_MARKS = 1000  # of a line that are drawn as an image, or they would fill the file
_DPI = 200  # of the marks that are too many for a drawing of each, as on good paper
# A number, with or without its share: columns of such cells stand to the right.
_NUMBER = re.compile(r"[-+−]?[\d.,\u00a0]+(e[-+]?\d+)?([ \u00a0]%)?|—|∞|-?inf|nan|")


class Table(NamedTuple):
    """A table of texts: its head, its rows, and what it shows."""

    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    caption: str = ""

    @property
    def numeric(self) -> list[bool]:
        """Which columns hold numbers."""
        return [all(map(_NUMBER.fullmatch, column)) for column in zip(*self.rows, strict=True)]


class Items(NamedTuple):
    """A list of texts."""

    lines: Sequence[str]
    cautions: bool = False


class Picture(NamedTuple):
    """What draws a figure, whose caption stands below it."""

    draw: Callable[[], Drawing]

    def image(self) -> tuple[str, str]:
        """Return the picture as the address of an image that holds it, and its caption.

        As an image of its own nothing drawn in it can reach the rest of the document.
        """
        figure = self.draw()
        for line in figure.findobj(Line2D):
            if np.size(line.get_xdata()) > _MARKS:
                line.set_rasterized(True)
        drawn = io.StringIO()
        with rc_context({"svg.fonttype": "path"}):  # whatever fonts the reader has
            figure.savefig(drawn, format="svg", dpi=_DPI, metadata={"Date": None})
        # Texts are drawn; their comments could hold what no XML may.
        svg = re.sub(r"<!--.*?-->", "", drawn.getvalue(), flags=re.DOTALL)
        data = b64encode(svg.encode("utf-8")).decode("ascii")
        return f"data:image/svg+xml;base64,{data}", figure.caption


class Lead(NamedTuple):
    """The sentence that is read first."""

    lead: str


Part: TypeAlias = str | Lead | Table | Items | Picture


class Section(NamedTuple):
    """A heading and what stands below it."""

    title: str
    parts: tuple[Part, ...]


@dataclass(frozen=True, eq=False)
class Case:
    """A table with its ranking and the chosen design.

    Attributes:
        table: The tests.
        limits: Limits on their columns.
        rows: ``(k,)`` which of them are feasible with finite objectives, each design once.
        ranking: The ranking of these; ``None`` if there are none.
        chosen: Which of them is chosen or, if none is, proposed.
        decided: Whether one is chosen.
        reason: Why it was chosen.
        choices: What selectors choose of them, by name.
        cautions: What speaks against relying on the optimum, the gravest first.
    """

    table: TestTable
    limits: Limits
    rows: NDArray[np.intp]
    ranking: EfficiencyRanking | None
    chosen: int
    decided: bool
    reason: str
    choices: Mapping[str, NDArray[np.intp]]
    cautions: tuple[str, ...]

    @classmethod
    def of(
        cls,
        table: TestTable,
        limits: Limits,
        normalize: bool,
        design: int | None,
        reason: str,
        selectors: Mapping[str, Any] | None,
    ) -> Case:
        """Rank the feasible designs, ask the selectors, and find the chosen design."""
        normalize, rows = boolean("normalize", normalize), np.zeros(0, dtype=np.intp)
        ranking, chosen = None, 0
        if table.eligible(limits).any():
            rows, ranking = table.ranked(limits, normalize=normalize)
            chosen = int(ranking.salukvadze[0])
        if design is not None:
            at = np.flatnonzero(table.numbers[rows] == integer("design", design, minimum=1))
            if len(at) == 0:
                raise invalid("design", "the number of a feasible test", design)
            chosen = int(at[0])
        if ranking is None:
            return cls(table, limits, rows, None, 0, False, "", {}, ())
        if selectors is None:
            other = "plain distances" if normalize else "distances in units of the ranges"
            selectors = {
                "knee": Knee(),
                "chebyshev": CompromiseProgramming(np.inf, normalize=normalize),
                other: SalukvadzeOptimum(normalize=not normalize),
            }
        choices = compare_selectors(ranking, selectors) if selectors else {}
        # They are about the optimum, which need not be what was chosen.
        optimum = ranking.name_of(int(ranking.salukvadze[0]))
        what = "" if chosen in ranking.salukvadze else f" to {optimum}, the optimum"
        found = tuple(f"Attention{what}: {caution}" for caution in cautions(ranking))
        decided = design is not None
        return cls(table, limits, rows, ranking, chosen, decided, reason, choices, found)

    @property
    def word(self) -> str:
        """What the design is: nothing is chosen until somebody has."""
        return "chosen" if self.decided else "proposed"

    @property
    def point(self) -> int:
        """The number of its test point."""
        return int(self.table.numbers[self.rows[self.chosen]])

    @property
    def units(self) -> dict[str, str]:
        """Units of the objectives."""
        layout = self.table.layout
        return {name: layout.units[name] for name in layout.objectives if name in layout.units}

    def amount(self, name: str, value: float) -> str:
        """Return a value of a column with its unit."""
        return f"{_cell(value)} {self.table.layout.units.get(name, '')}".strip()


def sections_of(case: Case) -> tuple[Section, ...]:
    """Return all sections that have something to say; the first three are the first page."""
    makers: dict[str, Callable[[Case], Iterator[Part]]] = {
        "The choice" if case.decided else "The proposal": _choice,
        "What speaks against it": _against,
        "What limits cost": _limits,
        "The Pareto set": _pareto,
        "What else could be chosen": _alternatives,
        "What was tested": _tests,
        "Whether more tests would change the choice": _enough,
        "Where the designs lie": _places,
        "First-order sensitivities, and where designs are feasible": _drives,
    }
    found = [Section(title, tuple(make(case))) for title, make in makers.items()]
    return tuple(section for section in found if section.parts)


def _cell(value: Any) -> str:
    """Return a value as a report shows it: numbers with five digits."""
    if isinstance(value, (float, np.floating)):
        return number(float(value), 5) if np.isfinite(value) else "—"
    return str(value)


def _choice(case: Case) -> Iterator[Part]:
    table, ranking, layout = case.table, case.ranking, case.table.layout
    if ranking is None:
        failed = counted(len(table.reasons), "failure")
        yield (
            f"None of {counted(len(table), 'design')} is feasible, with {failed}, so that there is "
            "nothing to choose. What each limit rejects, and how near designs come, is below."
        )
        return
    chosen, best = ranking.name_of(case.chosen), int(ranking.salukvadze[0])
    why, other = explain(ranking, case.chosen, units=case.units), ranking.name_of(best)
    if not case.decided:
        yield Lead(f"Proposed is {chosen}; nobody has chosen yet.")
    elif case.chosen in ranking.salukvadze:
        yield Lead(f"Chosen is {chosen}, as is proposed.")
    else:
        pair = compare_designs(ranking, [best, case.chosen], units=case.units)
        said = sentence("instead", design=chosen, other=other, difference=pair.difference(1))
        yield Lead(f"Chosen is {said}")
    if case.reason:
        yield f"Reason: {case.reason}"
    yield f"{why.sentences[0]} {measured_in(ranking)}."
    values = ranking.objectives.values
    columns = {"objective": [*map(layout.label_of, layout.objectives)]}
    columns[case.word] = [*map(_cell, values[case.chosen])]
    if case.chosen not in ranking.salukvadze:
        columns["proposed"] = [*map(_cell, values[best])]
    columns |= {"best": [*map(_cell, ranking.ideal)], "worst": [*map(_cell, ranking.nadir)]}
    columns["of range"] = ["—" if np.isnan(share) else percent(share) for share in why.shares]
    rows = [*zip(*columns.values(), strict=True)]
    yield Table(tuple(columns), rows, f"{capital(chosen)} among the Pareto-optimal designs.")
    row = case.rows[case.chosen]
    cells = [(layout.label_of(name), table.column(name)[row])
             for name in (*layout.variables, *layout.outputs)]  # fmt: skip
    cells += [(name, texts[row]) for name, texts in table.extra.items() if name != layout.label]
    known = [(name, text) for name, cell in cells if (text := _cell(cell)) not in ("", "—", "None")]
    for start in range(0, len(known), _SHORT):  # beside each other where there is room
        what = "Its values." if start == 0 else "\N{NO-BREAK SPACE}"
        yield Table(("column", "value"), known[start : start + _SHORT], what)
    if len(layout.objectives) == 2:
        yield Picture(partial(plot_objectives, table, case.limits, design=case.point))
    elif len(layout.objectives) > 2:
        yield Picture(
            partial(plot_ranking, ranking, units=case.units, pairs=False, row=case.chosen)
        )


def _against(case: Case) -> Iterator[Part]:
    if case.ranking is None:
        return
    if case.cautions:
        yield Items(case.cautions, cautions=True)
    yield explain(case.ranking, case.chosen, units=case.units).sentences[1]


def _tests(case: Case) -> Iterator[Part]:
    table, layout, problem = case.table, case.table.layout, case.table.problem
    if problem is not None:
        parameters = problem.get("parameters") or {}
        lines = [("Problem", problem.get("problem")), ("points", problem.get("sampling")),
                ("key", problem.get("key"))]  # fmt: skip
        lines += [(str(name), value) for name, value in parameters.items()]
        yield "; ".join(f"{name}: {value}" for name, value in lines if value is not None) + "."
    if case.table.experiments:
        yield f"Experiments: {', '.join(case.table.experiments)}."
    feasible, n = table.feasible(case.limits), len(table)
    steps = {
        "failed": (table.status == "failed").sum(),
        "beyond a constraint or a limit": ((table.status != "failed") & ~feasible).sum(),
        "feasible": feasible.sum(),
        "Pareto optimal": 0 if case.ranking is None else case.ranking.pareto.sum(),
    }
    counts = [f"{number(k)} {name} ({percent(k / n)})" for name, k in steps.items() if k]
    yield f"{counted(n, 'design')}: {', '.join(counts)}."
    yield from _failures(case)
    if layout.variables:
        bounds = np.column_stack([layout.lower, layout.upper])
        rows = [
            (layout.label_of(name), *map(_range, (ends[np.isfinite(ends)], x, x[feasible])))
            for name, ends, x in zip(layout.variables, bounds, table.X.T, strict=True)
        ]
        head = ("variable", "bounds", "tested", "feasible")
        yield Table(head, rows, "Where variables lie: from the least to the greatest value.")


def _range(values: NDArray[Any]) -> str:
    """Return the least and the greatest value, of choices all."""
    if len(values) == 0:
        return "—"
    if isinstance(values[0], (str, bool, np.bool_)):
        return ", ".join(map(str, value_ranks(values)[0]))
    return f"{_cell(values.min())} to {_cell(values.max())}"


def _failures(case: Case) -> Iterator[Part]:
    reasons = case.table.reasons
    if not reasons:
        return
    at = dict(zip(case.table.numbers.tolist(), case.table.names, strict=True))
    found = pd.DataFrame(
        {"reason": alike(reasons.values()), "first": [at[number] for number in reasons]}
    )
    groups = found.groupby("reason", sort=False)["first"].agg(["size", "first"])
    top = groups.sort_values("size", ascending=False, kind="stable").head(_REASONS).itertuples()
    rows = [(f"{n}", reason[:400], first) for reason, n, first in top]
    yield Table(("designs", "reason", "first"), rows, "Failures, which count as infeasible.")


def _limits(case: Case) -> Iterator[Part]:
    table, layout = case.table, case.table.layout
    costs = constraint_costs(table, case.limits)
    m, none = len(layout.objectives), case.ranking is None
    found = costs if none else costs[costs["alone"] > 0]
    rows, shown = [], found.sort_values("alone", ascending=False, kind="stable").head(_LIMITS)
    for name, lower, upper, rejects, alone, *best in shown.itertuples(name=None):
        text = name if name in layout.constraints else _limit(case, name, lower, upper)
        last = _reached(case, name, lower, upper) if none else _gain(case, best[: 2 * m])
        rows.append((text, number(rejects), number(alone), last))
    if not rows:
        return
    last = "nearest value" if none else "without it the best values would be"
    yield Table(("constraint or limit", "rejects", "it alone", last), rows)
    notes = []
    if idle := [str(name) for name in costs.index if name not in found.index]:
        notes.append(f"No design is rejected by {listed(idle[:_REASONS], 'or')} alone.")
    if layout.inequalities:
        notes.append("A constraint is met where its value is 0 or less.")
    if layout.equalities:
        notes.append(f"An equality is met within {layout.eq_tolerance:g}.")
    if notes:
        yield " ".join(notes)


def _limit(case: Case, name: str, lower: float, upper: float) -> str:
    """Return a limit as one writes it."""
    low = f"{_cell(lower)} ≤ " if np.isfinite(lower) and np.isfinite(upper) else ""
    if np.isfinite(upper):
        return f"{low}{name} ≤ {case.amount(name, upper)}"
    return f"{name} ≥ {case.amount(name, lower)}"


def _reached(case: Case, name: str, lower: float, upper: float) -> str:
    """Return the value of a column that comes nearest to a limit."""
    values = case.table.column(name)
    values = values[np.isfinite(values)].astype(np.float64)
    if not len(values):
        return "—"
    over = np.maximum(np.maximum(lower - values, values - upper), 0)
    return case.amount(name, float(values[over.argmin()])) if over.min() else "kept by some"


def _gain(case: Case, best: Sequence[float]) -> str:
    """Return in which objectives designs that a limit alone rejects are better than the feasible.

    Args:
        case: The case.
        best: For each objective the best value of the feasible designs, and of those rejected.
    """
    layout, gains = case.table.layout, []
    for j, name in enumerate(layout.objectives):
        now, then = best[2 * j : 2 * j + 2]
        if (now - then) * layout.sign[j] > 0:
            gains.append(f"{name} {case.amount(name, then)} instead of {_cell(now)}")
    return "; ".join(gains) or "no better in any objective"


def _places(case: Case) -> Iterator[Part]:
    layout = case.table.layout
    names = [*layout.variables, *layout.objectives]
    if case.ranking is not None and len(case.table) >= _HISTOGRAM and len(names) <= _COLUMNS:
        yield Picture(partial(plot_table, case.table, case.limits, variables=names, objectives=()))


def _pareto(case: Case) -> Iterator[Part]:
    names = case.table.layout.objectives
    if case.ranking is not None and 2 < len(names) <= _PAIRS:  # of two it is on the first page
        yield Picture(partial(plot_objectives, case.table, case.limits, design=case.point))


def _alternatives(case: Case) -> Iterator[Part]:
    ranking = case.ranking
    if ranking is None or ranking.pareto.sum() < 2 or len(case.table.layout.objectives) < 2:
        return
    steps = explain(ranking, case.chosen, units=case.units).sentences[2:]
    if steps:
        yield "Designs that are better in an objective and give up least:"
        yield Items(steps)
    lines = [
        f"{name}: {alternative(ranking, chosen, case.chosen, case.units)}"
        for name, chosen in case.choices.items()
    ]
    if case.chosen not in ranking.salukvadze:
        optimum = alternative(ranking, ranking.salukvadze, case.chosen, case.units)
        lines.insert(0, f"Salukvadze optimum: {optimum}")
    if lines:
        yield "By other preferences:"
        yield Items(lines)
    few = representatives(ranking, _FEW)
    if len(few.rows) < 2:
        return
    names = [ranking.name_of(int(row)) for row in few.rows]
    shares = ("stands for", *map(percent, few.shares))
    rows = [
        (case.table.layout.label_of(name), *map(_cell, values))
        for name, values in zip(
            case.table.layout.objectives, ranking.objectives.values[few.rows].T, strict=True
        )
    ]
    n = counted(int(ranking.pareto.sum()), "Pareto-optimal design")
    what = f"{len(few.rows)} for {n}, the optimum first: each stands for those nearest to it"
    what += f", none of which is farther than {few.radius:.3g}." if few.radius else "."
    yield Table(("", *names), (shares, *rows), what)


def _enough(case: Case) -> Iterator[Part]:
    table, ranking = case.table, case.ranking
    if ranking is None:
        return
    try:
        steps = convergence(table, case.limits, normalize=ranking.frame.normalize)
    except PsiError as error:
        yield f"Not available: {error}."
        return
    if len(steps.tests) < 2:
        return
    yield steps.verdict()
    at = dict(zip(table.numbers.tolist(), table.names, strict=True))
    best = [at.get(found, "—") for found in steps.optimum.tolist()]
    counts = (
        map(number, column.tolist()) for column in (steps.tests, steps.feasible, steps.pareto)
    )
    volumes = (percent(v) if np.isfinite(v) else "—" for v in steps.hypervolume)
    ends = map(_cell, steps.mu1), volumes
    yield Table(
        ("tests", "feasible", "Pareto optimal", "best design", "distance to U", "volume"),
        [*zip(*counts, best, *ends, strict=True)],
        "What the first tests would have chosen; the volume that their Pareto set dominates.",
    )


def _drives(case: Case) -> Iterator[Part]:
    table, layout = case.table, case.table.layout
    if not layout.variables:
        return
    if len(table) > _ENOUGH:
        table = table.rows(np.arange(_ENOUGH))
        yield f"By the first {_ENOUGH} of {len(case.table)} tests, which suffice for it."
    limited = [name for name in bounds_of(case.limits, layout) if name not in layout.variables]
    names = dict.fromkeys((*layout.objectives, *layout.constraints, *limited))
    try:
        yield from even_part(table)[1]
        found = sensitivities(table, list(names))
        yield Picture(partial(plot_sensitivities, found))
    except PsiError as error:
        yield f"No sensitivities: {error}."
    try:
        rules = feasibility_rules(table, case.limits)
    except PsiError as error:
        yield f"No rules of feasibility: {error}."
        return
    if rules.importance:
        yield "Where designs are feasible:"
        yield Items([*map(str, rules.rules)])
    else:
        yield "No condition on few variables separates feasible designs from others."
    if rules.importance and len(layout.variables) > 1:
        yield Picture(partial(plot_feasibility, table, case.limits))
