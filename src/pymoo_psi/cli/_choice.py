"""What the commands say of a choice: its reasons, its cautions, other choices, representatives.

``--prefer`` takes one preference, and may be given several times:

    weights:A=2,B=1     the nearest to the ideal point, with weights of all objectives
    chebyshev           the least bad worst objective; weights as above may follow a colon
    aspire:A=3,B=20     the nearest to wanted values, or the one that exceeds them by most
    order:B,A           the best in the first objective, then in the next, within
                        tolerance=0.1 of the range, if that is the last part
    knee                where the set bulges most towards the ideal point
    tradeoff            what pymoo's HighTradeoffPoints finds
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from pymoo_psi._validation import Received, counted, invalid, known_name
from pymoo_psi.cli._options import names_in, number_in, parts_of
from pymoo_psi.cli._output import print_frame, say, say_sentences, six_digits
from pymoo_psi.pareto import (
    EfficiencyRanking,
    alternative,
    cautions,
    explain,
    measured_in,
    percent,
    representatives,
    wrapped,
)
from pymoo_psi.selection import (
    CompromiseProgramming,
    HighTradeoff,
    Knee,
    Lexicographic,
    RankingSelector,
    ReferencePoint,
    compare_selectors,
)

_COLUMNS = (
    "rank: 6 is the best, 0 the lowest; mu1: distance to the ideal point, mu2: to the line from "
    "there to the worst values, mu3: along that line."
)
_LINES = 7  # of reasons: what a reader takes in at a glance
_METHODS = ("weights", "chebyshev", "aspire", "order", "knee", "tradeoff")


def reasons(ranking: EfficiencyRanking, units: Mapping[str, str]) -> list[str]:
    """Return why the optimum, in sentences that fill a few lines; the first two in any case."""
    units = {name: unit for name, unit in units.items() if name in ranking.objectives.names}
    told: list[str] = []
    for sentence in explain(ranking, int(ranking.salukvadze[0]), units=units).sentences:
        if len(told) >= 2 and len(wrapped([*told, sentence]).splitlines()) > _LINES:
            break
        told.append(sentence)
    return told


def say_choice(ranking: EfficiencyRanking, units: Mapping[str, str]) -> None:
    """Print how it was measured, why the optimum, and what speaks against relying on it."""
    option = "; plain ones by --no-normalize" if ranking.frame.normalize else " (--no-normalize)"
    say(_COLUMNS)
    say(f"{measured_in(ranking)}{option}.")
    say_sentences(reasons(ranking, units))
    say_sentences([f"Caution: {caution}" for caution in cautions(ranking)])


def preferences_in(
    entries: Sequence[str], names: Sequence[str], *, normalize: bool
) -> dict[str, RankingSelector]:
    """Return the selectors that entries of ``--prefer`` describe, by entry.

    Raises:
        ArgumentValueError: There is no such method or objective, or numbers are missing.

    Example:
        >>> found = preferences_in(["aspire:cost=3,yield=20"], ["cost", "yield"], normalize=True)
        >>> found["aspire:cost=3,yield=20"].point
        array([ 3., 20.])
    """
    return {entry: _preference(entry, names, normalize) for entry in entries}


def _preference(entry: str, names: Sequence[str], normalize: bool) -> RankingSelector:
    method, colon, text = entry.partition(":")
    method = known_name("--prefer", method.strip(), _METHODS)
    if method in ("knee", "tradeoff"):
        if colon:
            raise invalid("--prefer", f"just {method}", Received(entry))
        return Knee() if method == "knee" else HighTradeoff(normalize=normalize)
    if method == "order":
        *order, last = parts_of([text], lambda part: part in names)
        tolerance = re.fullmatch(r"tolerance=([0-9.]+)", last)
        if tolerance and last not in names:
            return Lexicographic(
                names_in("--prefer", order, names), tolerance=_number(tolerance[1], entry)
            )
        return Lexicographic(names_in("--prefer", [*order, last], names))
    if method == "chebyshev" and not colon:
        return CompromiseProgramming(np.inf, normalize=normalize)
    values = _values(entry, text, names)
    if method == "aspire":
        return ReferencePoint(values, normalize=normalize)
    p = 2 if method == "weights" else np.inf
    return CompromiseProgramming(p, weights=values, normalize=normalize)


def _values(entry: str, text: str, names: Sequence[str]) -> list[float]:
    """Return the number of each objective; all must be given, so that none is guessed."""
    each = ",".join(f'"{name}=1"' if "," in name else f"{name}=1" for name in names)
    rule = f"with a number for every objective, such as {entry.partition(':')[0]}:{each}"
    given: dict[str, float] = {}
    for part in parts_of([text], lambda part: part.rpartition("=")[0].strip() in names):
        name, equals, number = (piece.strip() for piece in part.rpartition("="))
        if not equals:  # as what follows the comma in A=2,5
            raise invalid("--prefer", rule, Received(entry), "decimals have a point")
        known_name("--prefer", name, names)
        if name in given:
            raise invalid("--prefer", "with each objective once", Received(entry))
        given[name] = _number(number, entry)
    if missing := [name for name in names if name not in given]:
        raise invalid("--prefer", rule, Received(entry), f"{missing[0]} has none")
    return [given[name] for name in names]


def _number(text: str, entry: str) -> float:
    number = number_in(text)
    if not math.isfinite(number):
        rule = "with finite numbers, decimals by a point"
        raise invalid("--prefer", rule, Received(entry))
    return number


def say_preferences(
    ranking: EfficiencyRanking, preferences: Mapping[str, RankingSelector], units: Mapping[str, str]
) -> None:
    """Print what each preference chooses, and what it gains and loses against the optimum."""
    optimum = int(ranking.salukvadze[0])
    if not preferences:
        return
    for entry, chosen in compare_selectors(ranking, preferences).chosen.items():
        say_sentences([f"{entry}: {alternative(ranking, chosen, optimum, units)}"])


def say_representatives(ranking: EfficiencyRanking, k: int) -> None:
    """Print a few designs that stand for all."""
    few = representatives(ranking, k)
    objectives = ranking.objectives
    frame = pd.DataFrame({"design": [ranking.name_of(row) for row in few.rows]})
    for name, column in zip(objectives.names, objectives.values[few.rows].T, strict=True):
        texts = [six_digits(value) for value in column]
        frame[name] = [text.rjust(max(map(len, texts))) for text in texts]
    frame["stands for"] = [percent(share) for share in few.shares]
    n = counted(int(ranking.pareto.sum()), "Pareto-optimal design")
    print_frame(frame, f"{len(few.rows)} for {n}, none farther than {few.radius:.3g} from its own:")
