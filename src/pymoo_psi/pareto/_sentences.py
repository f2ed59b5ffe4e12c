"""Sentences about designs: the templates, and how names, numbers and shares are written.

The decision page fills the same templates (:data:`SENTENCES`, which it has as JSON), so that the
page, the command, the report and Python say the same.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from typing import Any

SENTENCES = {
    # What a design is among the others (Explanation); front is "3 Pareto-optimal designs".
    "dominated": "{design} is dominated: {other} is {difference}.",
    "single": "{design} is the only Pareto-optimal design.",
    "optimum": "{design} is the Salukvadze optimum: the nearest of {front} to the ideal point.",
    "optima": "{design} is a Salukvadze optimum: one of {count} of {front} that are equally near "
    "to the ideal point.",
    "ranked": "{design} is one of {front}, of rank of efficiency {rank}.",
    # Its distances from the best, the parts joined by "; ".
    "all best": "It is the best in every objective.",
    "behind": "Behind the best in {changes}",
    "weakest": "weakest in {objectives}",
    "best": "the best in {objectives}",
    # A change of one objective, the first of a sentence and those that follow; without a share
    # where the objective is equal for all Pareto-optimal designs.
    "first change": "{objective} by {amount} ({share} of its range)",
    "change": "{objective} by {amount} ({share})",
    "bare change": "{objective} by {amount}",
    # One design against another, the parts joined by "; ", and in sentences.
    "better": "better in {changes}",
    "worse": "worse in {changes}",
    "equal": "equal in all objectives",
    "against": "{design} against {other}: {difference}.",
    "step": "Towards {objectives} {design} gives up least: {difference}.",
    # Of the decision page: chosen against proposed, and what limits have done.
    "instead": "{design} instead of {other}: {difference}.",
    "far": "In {objectives} it is {share} of the range away from the best.",
    "without limits": "Without limits {design} would be proposed: {difference}.",
    "moved": "{design} keeps to the limits and would be proposed without them: {difference}. They "
    "have moved the best and worst values by which designs are ranked; fixed ranges leave these.",
    "relaxed": "{limit} brings back {back}. {outcome}",
    "without limit": "Without {limit} {back} would come back. {outcome}",
    "none back": "{limit}: without it nothing would come back, as other limits reject the same.",
    "same proposed": "{design} is proposed still.",
    "new proposed": "{design} would be proposed instead of {other}: {difference}.",
    "first proposed": "{design} would be proposed.",
    "new": "Proposed is now {design} instead of {other}: {difference}.",
    "new by ends": "Proposed is now {design} instead of {other}: {difference}. Both were and are "
    "within the limits: the best and worst values by which designs are ranked have moved.",
    "nearest": "No limit brings a design back by itself. Together these do: {changes} ({design}).",
    # Cautions.
    "suspect": "{design}, which would be chosen, has {value} in {objective}, unlike all others, "
    "{low} to {high}: a failure may be written so, or a sign be turned.",
    "sign": "{objective} is maximised, but nowhere above 0: its sign may be turned.",
    "unlike": "{designs} of {value} in {objective}, unlike all others, {low} to {high}: a failure "
    "may be written so.",
    "alone": "All Pareto-optimal designs have the same values: the objectives do not conflict.",
    "constant": "Equal for all Pareto-optimal designs, and without weight: {objectives}.",
    "redundant": "Objectives that agree to within 1 % of their ranges, and so count more than "
    "once: {groups}.",
    "scale": "Without normalising, {objective} with a range of {range} outweighs {other} with one "
    "of {least}.",
    "equidistant": "{near} of {count} Pareto-optimal designs are within 1 % of the least distance "
    "to the ideal point, as on a sphere around it: a preference must choose.",
    "tie": "{design} is as near to the ideal point as {others}.",
    "near tie": "{design} is {farther} farther from the ideal point, and differs by {share} of the "
    "range in {objective}.",
    "extreme": "The optimum is the worst in {objectives}, to within 1 % of the range: it is no "
    "compromise.",
    "edge": "The optimum is the best in {objectives}, to within 1 % of the range: it lies at an "
    "edge of the set.",
    "outlier": "{design} alone stretches the range of {stretched} {times} times; without it the "
    "optimum would be {other}, which differs by {share} of the range in {objective}.",
    "unstable": "Without {design} the optimum would be {other}, which differs by {share} of the "
    "range in {objective}.",
}
"""Templates by name, filled by ``str.format`` with texts only."""


_LONG = 1e9  # from here on numbers have an exponent


def sentence(name: str, **values: object) -> str:
    """Return a template of :data:`SENTENCES`, filled."""
    return SENTENCES[name].format(**values)


def capital(text: str) -> str:
    """Begin a sentence with the name of a design; a name that the user gave stays as it is."""
    ours = text.startswith(("design ", "row ", "test point "))
    return text[0].upper() + text[1:] if ours else text


def listed(names: Sequence[Any], word: str = "and") -> str:
    """Return names as a sentence lists them: "a, b and c"."""
    *before, last = map(str, names)
    return f"{', '.join(before)} {word} {last}" if before else last


def number(value: float, digits: int = 4) -> str:
    """Return a number with a few digits, none lost before the point: 0.1235, 1235, 59 990.

    From five digits on thousands are apart, by a space at which no line breaks.
    """
    value = value + 0.0  # no -0
    whole = abs(value) < _LONG and (abs(value) >= 10**digits - 0.5 or value == round(value))
    text = f"{value:,.0f}" if whole else f"{value:,.{digits}g}"
    text = re.sub(r"^(-?\d),(\d+)(?!,|\d)", r"\1\2", text)  # four digits stay together
    return text.replace(",", "\N{NO-BREAK SPACE}")


def percent(share: float) -> str:
    """Return a share with two digits, above 10 % with none behind the point."""
    hundreds = 100 * share
    if 0 < hundreds < 0.01:
        return "less than 0.01 %"
    return f"{hundreds:.0f} %" if hundreds >= 9.95 else f"{hundreds:.2g} %"


def wrapped(sentences: Sequence[str], columns: int = 80) -> str:
    """Return sentences in lines of at most so many columns, no percent sign off its number."""
    whole = (text.replace(" %", "\0%") for text in sentences)
    lines = (textwrap.fill(text, columns, break_on_hyphens=False) for text in whole)
    return "\n".join(lines).replace("\0", " ")
