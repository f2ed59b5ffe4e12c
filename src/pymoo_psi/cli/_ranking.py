"""The ranking of a table as the terminal shows it: a head, the designs by place, a few sentences.

The table has the objectives in one number format each, with the best and the worst values of the
designs that no other dominates as its last rows. Texts are cut to the width of the terminal, never
numbers; objectives for which there is no room are counted.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from unicodedata import combining, east_asian_width

import numpy as np

from pymoo_psi._numbers import NumberFormat
from pymoo_psi._validation import Names, counted
from pymoo_psi.analysis import confidence_sentences
from pymoo_psi.cli._console import print_text, width
from pymoo_psi.pareto import Caution, EfficiencyRanking, Explanation, explain, wrapped
from pymoo_psi.table import TEST, TestTable

WIDTH_OF_PIPE = 80
_MOST_ROWS = 10
_LEAST_ROWS = 3
_LINES = 24
_FEW = 12  # designs, whose ranking has fewer lines
_LINES_OF_FEW = 18
_HEADING_WIDTHS = (80, 24, 16, 12)  # the first of these at which a table fits
_LEAST_LABEL = 16
_GAP = "  "
_BESIDE_PLACES = " " * len("place") + _GAP
_MOST_NAMED = 6  # values of the proposed test
_PLAIN_WORD = re.compile(r"[\w@%+:,./-]+")


def say_ranking(
    table: TestTable,
    found: Sequence[Caution],
    head: Names,
    reasons: Names,
    notes: Names,
    following: Names,
    *,
    all_by: str,
    more: str = "",
) -> None:
    """Print the ranking of a table.

    Args:
        table: The tests.
        found: The cautions, of which the most serious one is printed.
        head: Lines before the designs.
        reasons: Lines after the proposal and its costs.
        notes: Lines at the end, before the next command.
        following: The next command: its first words, and its options.
        all_by: The option or command that shows all cautions; empty if that follows.
        more: Where designs are that are not shown.
    """
    ranking = table.feasible_ranking()
    columns = width() or WIDTH_OF_PIPE
    above = wrapped(head, columns).splitlines()
    sentences = [*_proposal(table, found), *reasons]
    if found:
        text = f"Caution: {found[0].sentence}"
        if len(found) > 1 and all_by:
            text += f" ({all_by} shows {len(found) - 1} more.)"
        sentences.append(text)
    below = wrapped([*sentences, *notes], columns).splitlines()
    below += _continued(f"Next: {following[0]}", following[1:], columns)
    lines = _LINES
    if len(table) <= _FEW:
        lines = _LINES_OF_FEW
    # Beside them: two blank lines, the head of the table, its ends, and the count of further rows.
    n_rows = lines - len(above) - len(below) - 6
    n_rows = min(max(n_rows, _LEAST_ROWS), _MOST_ROWS)
    if ranking.pareto.sum() == n_rows + 1:  # the row itself takes no more than its count
        n_rows += 1
    designs = _table(table, ranking, n_rows, columns, more)
    print_text("\n".join([*above, "", *designs, "", *below]))


# The table


def _table(
    table: TestTable, ranking: EfficiencyRanking, n_rows: int, columns: int, more: str
) -> list[str]:
    """Return the lines of the table, which fit into a width.

    Args:
        table: The tests.
        ranking: Their ranking.
        n_rows: How many designs are shown.
        columns: The width of the terminal.
        more: Where the other designs are.
    """
    objectives = ranking.objectives
    optimal = ranking.by_place[: ranking.pareto.sum()]
    shown = optimal[:n_rows]
    numbers = []
    for name, sign, values in zip(
        objectives.names, objectives.sign, objectives.values[optimal].T, strict=True
    ):
        ends = np.sort(sign * values)[[0, -1]] * sign
        text = NumberFormat.of(values).text
        arrow = "↓" if sign > 0 else "↑"
        numbers.append((_one_line(name), arrow, list(map(text, (*values[:n_rows], *ends)))))
    word = (table.schema.label or TEST).replace("_", " ")
    names = [_one_line(ranking.name_of(row).removeprefix(f"{word} ")) for row in shown]
    names = [word, *names, "best", "worst"]
    most = max(map(_columns, names))
    least = min(most, _LEAST_LABEL)
    cells, room = _fitting(numbers, columns - len(_BESIDE_PLACES), least)
    names = [shortened(name, max(room, least)) for name in names]
    places = ["place", *map(str, ranking.place[shown]), "", ""]
    rows = zip(_aligned(places), _aligned(names, left=True), *cells, strict=True)
    lines = [_GAP.join(row).rstrip() for row in rows]
    n_hidden = len(optimal) - len(shown)
    if n_hidden:
        lines.insert(1 + len(shown), f"{_BESIDE_PLACES}… {n_hidden} more{more}")
    n_folded = len(numbers) - len(cells)
    if n_folded:
        lines.append(f"{_BESIDE_PLACES}… {counted(n_folded, 'more objective')}: --long")
    return lines


def _fitting(
    numbers: list[tuple[str, str, list[str]]], columns: int, least: int
) -> tuple[list[list[str]], int]:
    """Return the columns of as many objectives as fit, one or more, and the room that they leave.

    Args:
        numbers: The name of each objective, its direction, and its numbers.
        columns: The width for them and the names of the designs.
        least: The least width for the names.
    """
    for n_shown in range(len(numbers), 0, -1):
        for most in _HEADING_WIDTHS:
            cells = []
            room = columns
            for name, arrow, texts in numbers[:n_shown]:
                cells.append(_aligned([f"{shortened(name, most)} {arrow}", *texts]))
                room -= len(_GAP) + _columns(cells[-1][0])
            if room >= least:
                return cells, room
    return cells, room


def _one_line(name: object) -> str:
    return " ".join(str(name).split())


def _columns(text: str) -> int:
    """Return how many columns of a terminal a text takes."""
    if text.isascii():
        return len(text)
    wide = sum(east_asian_width(letter) in "WF" for letter in text)
    return len(text) + wide - sum(combining(letter) > 0 for letter in text)


def _aligned(texts: list[str], *, left: bool = False) -> list[str]:
    """Return texts of the same width, aligned to the right or to the left."""
    width = max(map(_columns, texts))
    aligned = []
    for text in texts:
        blanks = " " * (width - _columns(text))
        aligned.append(text + blanks if left else blanks + text)
    return aligned


def shortened(text: str, most: int) -> str:
    """Return a text without its middle if it is too wide: names that begin alike end unlike."""
    kept = text
    n_kept = len(text)
    while _columns(kept) > most:
        n_kept -= 1
        half = n_kept // 2
        kept = f"{text[: n_kept - half]}…{text[len(text) - half :]}"
    return kept


# The sentences


def _proposal(table: TestTable, found: Sequence[Caution]) -> list[str]:
    """Return what is proposed, what it costs and, of repeated tests, how sure it is."""
    ranking = table.feasible_ranking()
    why = explain(ranking)
    sentences = [_with_values(why, table)]
    if why.ties and "tie" not in [caution.kind for caution in found[:1]]:  # which says so
        sentences[0] += f" {why.ties}"
    if ranking.pareto.sum() > 1:
        sentences.append(why.costs)
    return [*sentences, *confidence_sentences(table, why.row)]


def _with_values(why: Explanation, table: TestTable) -> str:
    """Return what is proposed; a test, whose name says nothing, with its values."""
    schema = table.schema
    if schema.label not in (None, "row"):
        return why.standing
    ranking = why.ranking
    optimal = ranking.rows[ranking.pareto]
    row = ranking.rows[why.row]
    groups = []
    for names in (schema.objectives, schema.variables):
        texts = []
        for name in names[:_MOST_NAMED]:
            cells = table.column(name)
            text = str(cells[row])
            if cells.dtype.kind in "fi":
                text = NumberFormat.of(cells[optimal]).text(cells[row])
            texts.append(f"{name} {text} {schema.units.get(name, '')}".strip())
        if len(names) > _MOST_NAMED:
            texts.append("…")
        if texts:
            groups.append(", ".join(texts))
    name = ranking.name_of(why.row)
    return why.standing.replace(name, f"{name} ({'; '.join(groups)})", 1)


# The next command


def command(*words: str) -> list[str]:
    """Return a command with its argument, and each option with its value, as shells read them."""
    texts: list[str] = []
    for word in words:
        text = word
        if re.search(r'["$`\\!]', word):
            text = shlex.quote(word)
        elif not _PLAIN_WORD.fullmatch(word):
            text = f'"{word}"'
        if word.startswith("--") or not texts:
            texts.append(text)
        else:
            texts[-1] += f" {text}"
    return texts


def _continued(first: str, options: Names, columns: int) -> list[str]:
    """Return a command in lines that fit into a width and that a shell joins."""
    lines = [first]
    for option in options:
        if _columns(f"{lines[-1]} {option}") + 2 <= columns:
            lines[-1] += f" {option}"
        else:
            lines[-1] += " \\"
            lines.append(f"    {option}")
    return lines
