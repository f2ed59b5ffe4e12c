"""Positions of several people on a decision: who holds what, and what separates them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._numbers import number, percent
from pymoo_psi._validation import Array, Entries, Names
from pymoo_psi.analysis._costs import all_limits, limit_words, text_beyond
from pymoo_psi.pareto import (
    EfficiencyRanking,
    capital,
    compare_designs,
    listed,
    measured_as,
    sentence,
    unit_lengths,
    without_rounding,
)
from pymoo_psi.table import Limit, TestTable, limits_of

if TYPE_CHECKING:
    import pandas as pd

_TIE = 1e-9  # regrets that differ by less are equal


def latest_positions(positions: Sequence[Entries]) -> list[Entries]:
    """Return what each name holds last, in the order in which the names first occur.

    Args:
        positions: Those of a :class:`~pymoo_psi.Decision`, in the order of their dates.
    """
    return [*{one["name"]: one for one in positions}.values()]


def positions_frame(table: TestTable) -> pd.DataFrame:
    """Return who holds which design, under which limits and weights, and why.

    Returns:
        Texts, one row for each name; empty columns are omitted.
    """
    import pandas as pd

    rows = []
    for position in latest_positions(table.decision.positions):
        # As they are: the table may have other columns or texts now.
        under = written_limits(limits_of(position["limits"]), table.schema.units)
        for word, key in (("weights", "weights"), ("aspirations", "aspiration")):
            texts = []
            for name, value in position[key].items():
                texts.append(f"{name} {number(value, mark=table.decimal)}")
            if texts:
                under.append(f"{word}: {', '.join(texts)}")
        named = {**position["limits"], **position["weights"], **position["aspiration"]}
        unknown = [name for name in named if name not in table.columns]
        if unknown:
            under.append(f"not a column here: {', '.join(unknown)}")
        row = {
            "name": position["name"],
            "choice": position["chosen"] or "none",
            "under": "; ".join(under),
            "why": position["reason"],
        }
        rows.append(row)
    frame = pd.DataFrame(rows)
    return frame.loc[:, (frame != "").any()]


def beyond_limits(table: TestTable, row: int) -> dict[str, str]:
    """Return the limits and constraints that a test violates, with its value, in words by column.

    Example:
        >>> table = TestTable.of([1, 2], [[0.1], [0.5]], [[1], [2]])
        >>> beyond_limits(table.under(limits={"f1": 1.5}), 1)
        {'f1': 'f1 at most 1.5 (2)'}
    """
    mask, _ = table.violations()
    texts = {}
    limits = zip(mask[row], all_limits(table), limit_words(table), strict=True)
    for is_violated, (name, limit), words in limits:
        if is_violated:
            value = text_beyond(table, name, limit, table.column(name)[row])
            value = f"{value} {table.schema.units.get(name, '')}".strip()
            texts[name] = f"{words} ({value})"
    return texts


def _words_beyond(table: TestTable, name: str) -> str:
    """Return "beyond", and the limits and constraints that a design violates; "" if none."""
    texts = beyond_limits(table, table.names.index(name))
    if not texts:
        return ""
    return f"beyond {listed([*texts.values()])}"


def position_sentences(table: TestTable) -> list[str]:
    """Return who wants which design, whether it is beyond limits, under which, and why."""
    sentences = []
    for record in positions_frame(table).to_dict("records"):
        choice = record["choice"]
        text = f"wants {choice}"
        if choice in table.names:
            beyond = _words_beyond(table, choice)
            if beyond:
                text += f": {beyond}"
        elif choice != "none":
            text = sentence("foreign choice", design=choice)
        text = f"{record['name']} {text}."
        if record.get("under"):
            text += f" Conditions: {record['under']}."
        if record.get("why"):
            text += f" “{record['why']}”"
        sentences.append(text)
    return sentences


def written_limits(limits: Mapping[str, Limit], units: Mapping[str, str]) -> list[str]:
    """Return limits as they can be typed, with the units of their columns."""
    texts = []
    for name, limit in limits.items():
        if limit != Limit():
            texts.append(f"{limit.written(name)} {units.get(name, '')}".strip())
    return texts


def decision_sentences(table: TestTable) -> list[str]:
    """Return what a group has decided, whether that is beyond limits, and who dissents."""
    decided = table.decision.decided
    if decided is None:
        return []
    on = ""
    if decided["date"]:
        on = f" on {decided['date'][:10]}"
    by = ""
    if decided["agree"]:
        by = f" by {listed(decided['agree'])}"
    chosen = decided["chosen"]
    sentences = [sentence("decided", on=on, design=chosen, by=by)]
    if chosen not in table.names:
        sentences.append(f"{capital(chosen)} is not among these designs.")
    else:
        beyond = _words_beyond(table, chosen)
        if beyond:
            sentences.append(f"{capital(chosen)} is {beyond}.")
    if decided["dissent"]:
        sentences.append(sentence("dissent", dissent=listed(decided["dissent"])))
    return sentences


def ranking_without_limits(table: TestTable) -> EfficiencyRanking:
    """Return the ranking of all designs, as those within the limits are measured, if any are."""
    free = table.under(limits={}, ranges={}).feasible_ranking()
    if table.feasible().any():
        return measured_as(free, table.feasible_ranking())
    return free


def rows_by_name(table: TestTable, ranking: EfficiencyRanking) -> dict[str, int]:
    """Return the rows of tests in a ranking without limits, by name; a repeat has its design's."""
    places = {row: place for place, row in enumerate(ranking.rows.tolist())}
    ranked = table.under(limits={}, ranges={}).ranked_as.tolist()
    rows = zip(table.names, ranked, strict=True)
    return {name: places[row] for name, row in rows if row in places}


def separation_sentences(table: TestTable) -> list[str]:
    """Return what costs all the least, and what separates the positions of a decision."""
    latest = latest_positions(table.decision.positions)
    if not latest:
        return []
    free = ranking_without_limits(table)
    rows = rows_by_name(table, free)
    positions = [position for position in latest if position["chosen"] in rows]
    sentences = []
    for k, one in enumerate(positions):
        for other in positions[:k]:
            both = [rows[other["chosen"]], rows[one["chosen"]]]
            if both[0] == both[1]:
                continue
            pair = compare_designs(free, rows=both)
            sentences.append(pair.sentence("apart", 1, name=one["name"], holder=other["name"]))
    if sentences and table.feasible().any():
        choices = free.objectives.minimized[[rows[one["chosen"]] for one in positions]]
        sentences.insert(0, _least_regret(table, positions, choices, free.lengths))
    return sentences


def _least_regret(
    table: TestTable, positions: Sequence[Entries], choices: Array, lengths: Array
) -> str:
    """Return which design costs somebody least at worst, and what every other one costs.

    What a design costs a position is its greatest loss against the choice of the position.

    Args:
        table: The tests.
        positions: The p positions.
        choices: ``(p, m)`` objectives of their choices, minimised.
        lengths: ``(m,)`` the ranges.
    """
    ranking = table.feasible_ranking()
    objectives = table.schema.objectives
    values = ranking.objectives.minimized[ranking.front]
    losses = _losses(values, choices, lengths, _relative_weights(positions, objectives))
    regrets = losses.max(axis=2, initial=0.0)
    greatest = regrets.max(axis=1)
    keys = np.array([regrets.sum(axis=1), greatest])
    best, *others = np.lexsort(np.round(keys / _TIE))
    design = ranking.name_of(int(ranking.front[best]))
    if greatest[best] < _TIE:
        return sentence("no regret", design=capital(design))
    who, objective = np.argwhere(losses[best] >= greatest[best] - _TIE)[0]
    rest = ""
    if others:
        rest = sentence("others regret", share=percent(greatest[others[0]], table.decimal))
    return sentence(
        "least regret",
        design=design,
        name=positions[who]["name"],
        share=percent(greatest[best], table.decimal),
        objective=objectives[objective],
        others=rest,
    )


def _losses(values: Array, choices: Array, lengths: Array, weights: Array) -> Array:
    """Return ``(k, p, m)`` losses of k designs against p choices, in weighted shares of the ranges.

    In an objective in which all designs left are equal, the range is that of these and the choices.

    Args:
        values: ``(k, m)`` objectives of the designs, minimised.
        choices: ``(p, m)`` those of the choices.
        lengths: ``(m,)`` the ranges; infinite where the designs are equal.
        weights: ``(p, m)`` of the objectives, by those who chose.
    """
    p = len(choices)
    F = without_rounding(np.vstack([choices, values]))
    of_all = unit_lengths(F.min(axis=0), F.max(axis=0))
    lengths = np.where(np.isfinite(lengths), lengths, of_all)
    return np.asarray((F[p:, None] - F[:p]) / lengths * weights)


def _relative_weights(positions: Sequence[Entries], objectives: Names) -> Array:
    """Return ``(p, m)`` weights, 1 by default, over the greatest one of the position."""
    weights = []
    for position in positions:
        own = [position["weights"].get(name, 1.0) for name in objectives]
        weights.append(np.array(own) / (max(own) or 1.0))
    return np.array(weights)
