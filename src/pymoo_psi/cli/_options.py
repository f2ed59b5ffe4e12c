"""What the words of options mean: lists of names, limits, test points."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Sequence

from pymoo_psi._validation import Received, invalid, known_name

_LIMIT = re.compile(r"(?P<name>.*?)\s*(?P<sign><=|>=|=)\s*(?P<limit>[^<>=]*)", re.DOTALL)


def listed_names(text: str | None) -> list[str] | None:
    """Return the names in a list with commas; a name with a comma stands in quotation marks.

    Example:
        >>> listed_names('mass, "cost, total"')
        ['mass', 'cost, total']
    """
    if text is None:
        return None
    try:
        return [name.strip() for name in next(csv.reader([text], skipinitialspace=True), [])]
    except csv.Error:  # a line break in a name
        return [text.strip()]


def names_in(option: str, entries: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Return the columns that the entries of a repeatable option name.

    An entry is the name of a column, whatever is in it, or a list with commas.

    Raises:
        ArgumentValueError: A name occurs twice, or there is no such column.

    Example:
        >>> names_in("--objectives", ["time, s", "mass,cost"], ["time, s", "mass", "cost"])
        ('time, s', 'mass', 'cost')
    """
    names = [
        name
        for entry in entries
        for name in ([entry] if entry in known else listed_names(entry) or [""])
    ]
    for name in names:
        known_name(option, name, known)
        if names.count(name) > 1:
            raise invalid(option, "columns that are named once", name)
    return tuple(names)


def limits_in(text: str | None) -> dict[str, tuple[str, float]]:
    """Return sign and limit for each criterion in a text such as ``f1=2.5,f4<=1``.

    Raises:
        ArgumentValueError: A part is no limit, or a criterion has two.

    Example:
        >>> limits_in("f1=2.5, yield>=0.8")
        {'f1': ('=', 2.5), 'yield': ('>=', 0.8)}
    """
    limits: dict[str, tuple[str, float]] = {}
    for part in listed_names(text) or []:
        found = _LIMIT.fullmatch(part)
        try:
            name, sign, limit = found["name"], found["sign"], float(found["limit"])  # type: ignore[index]
        except (TypeError, ValueError):
            rule = "of the form criterion=number or criterion<=number, joined by commas"
            raise invalid("--limits", rule, Received(part or "nothing")) from None
        if not name or name in limits:
            raise invalid("--limits", "given once for each criterion", Received(part))
        limits[name] = sign, limit
    return limits


def upper_limits_in(text: str | None) -> dict[str, float]:
    """Return the limits in a text such as ``f1=2.5,f4<=1``, on criteria that are all minimised.

    Raises:
        ArgumentValueError: A part is no limit, or a lower one.

    Example:
        >>> upper_limits_in("f1=2.5,f4<=1")
        {'f1': 2.5, 'f4': 1.0}
    """
    limits = limits_in(text)
    if wrong := [name for name, (sign, _) in limits.items() if sign == ">="]:
        rule = f"an upper limit, as criteria are minimised: {wrong[0]}<=number"
        raise invalid("--limits", rule, Received(f"{wrong[0]}>={limits[wrong[0]][1]:g}"))
    return {name: limit for name, (_, limit) in limits.items()}


def points_in(option: str, text: str | None) -> str | tuple[int, ...]:
    """Return ``"failed"``, or the numbers of test points in a list; none for no text.

    Raises:
        ArgumentValueError: It is neither.

    Example:
        >>> points_in("--retry", "failed"), points_in("--retry", "1, 3")
        ('failed', (1, 3))
    """
    if text is None:
        return ()
    if text.strip() == "failed":
        return "failed"
    parts = [part.strip() for part in text.split(",")]
    if not all(re.fullmatch(r"[1-9][0-9]{0,17}", part) for part in parts):
        raise invalid(option, "'failed' or numbers of test points, such as 1,2,3", text)
    return tuple(int(part) for part in parts)
