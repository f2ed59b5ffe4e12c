"""How sentences about designs name them, and tell shares of ranges."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from pymoo_psi.pareto._ranking import EfficiencyRanking


def labelled(ranking: EfficiencyRanking, labels: Sequence[str]) -> EfficiencyRanking:
    """Return a ranking whose designs have other names."""
    return replace(ranking, objectives=replace(ranking.objectives, labels=labels))


def measured_in(ranking: EfficiencyRanking) -> str:
    """Return in what the distances of a ranking are measured."""
    if ranking.frame.normalize:
        return "Normalised: distances in units of the ranges"
    return "Not normalised: plain distances, as in the paper"


def label(ranking: EfficiencyRanking, row: int) -> str:
    """Return what a design is called: a label that is a text stands for itself."""
    name = ranking.objectives.labels[row]
    return name if isinstance(name, str) else f"design {name}"


def capital(text: str) -> str:
    """Begin a sentence with what a design is called; a name that the user gave stays as it is."""
    ours = text.startswith(("design ", "row ", "test point "))
    return text[0].upper() + text[1:] if ours else text


def listed(names: Sequence[Any], word: str = "and") -> str:
    """Return names as a sentence lists them: "a, b and c"."""
    *before, last = map(str, names)
    return f"{', '.join(before)} {word} {last}" if before else last


def number(value: float, digits: int = 4) -> str:
    """Return a number with a few digits, large ones as people write them: 59990, not 5.999e+04."""
    text = f"{value + 0.0:.{digits}g}"  # of -0.0, a zero whose sign was turned, 0
    return f"{float(text):.0f}" if "e+" in text and abs(value) < 1e7 else text


def percent(share: float) -> str:
    """Return a share as a sentence tells it: two digits, and none behind the point above 10."""
    hundreds = 100 * share
    if 0 < hundreds < 0.01:
        return "less than 0.01 %"
    return f"{hundreds:.0f} %" if hundreds >= 9.95 else f"{hundreds:.2g} %"


def wrapped(sentences: Sequence[str], columns: int = 80) -> str:
    """Return sentences in lines that are no longer, no percent sign apart from its number."""
    whole = (sentence.replace(" %", "\0%") for sentence in sentences)
    lines = (textwrap.fill(sentence, columns, break_on_hyphens=False) for sentence in whole)
    return "\n".join(lines).replace("\0", " ")
