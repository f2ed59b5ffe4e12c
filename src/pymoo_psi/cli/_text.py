"""What is typed of columns, limits, units, bounds and numbers, as values of Python.

A list has commas between its entries; a name that holds one stands in quotation marks, as in
``--objectives '"time, s",mass'``. An option that takes a list may be given several times.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from typing import Any

from pymoo_psi._validation import Received, invalid

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_LIMIT = re.compile(
    rf"(?:(?P<first>{_NUMBER})\s*(?P<left><=|>=)\s*)?(?P<name>.*?[^<>=\s])"
    rf"(?:\s*(?P<right><=|>=)\s*(?P<last>{_NUMBER}))?",
    re.DOTALL,
)
End = float | None


def names_in(entries: Sequence[str] | None) -> list[str]:
    """Return the entries of lists with commas; quotation marks keep a comma in a name.

    Example:
        >>> names_in(['"time, s",mass', "cost"])
        ['time, s', 'mass', 'cost']
    """
    names: list[str] = []
    for entry in entries or ():
        # An empty entry stays an empty name, to be refused: --objectives "" is not "no option".
        found = next(csv.reader([entry.replace("\n", " ")], skipinitialspace=True), [])
        names += [name.strip() for name in found] or [""]
    return names


def limits_in(entries: Sequence[str] | None) -> dict[str, tuple[End, End]]:
    """Return limits ``name<=2.5``, ``name>=2.5`` or ``1<=name<=2.5`` as ``(lower, upper)``.

    Raises:
        ArgumentValueError: A part is no limit, or a side of a column has two.

    Example:
        >>> limits_in(["f1<=2.5, yield>=0.8", "1<=x1<=2"])
        {'f1': (None, 2.5), 'yield': (0.8, None), 'x1': (1.0, 2.0)}
    """
    limits: dict[str, tuple[End, End]] = {}
    for part in names_in(entries):
        found = _LIMIT.fullmatch(part)
        if not found or not (found["left"] or found["right"]):
            remedy = "use <= or >=, plain numbers with a decimal point, and no units"
            rule = "of the form column<=number or number<=column<=number, joined by commas"
            raise invalid("--limits", rule, Received(part or "nothing"), remedy)
        ends: list[End] = [*limits.get(found["name"], (None, None))]
        pairs = ((found["left"], found["first"], "<="), (found["right"], found["last"], ">="))
        for sign, number, lower in pairs:
            if sign is None:
                continue
            side = int(sign != lower)
            if ends[side] is not None:
                raise invalid("--limits", "given once for each side of a column", Received(part))
            ends[side] = float(number)
        limits[found["name"]] = (ends[0], ends[1])
    return limits


def pairs_in(option: str, entries: Sequence[str] | None, form: str) -> dict[str, str]:
    """Return the values of entries ``name=value`` by name; a name may hold the sign, too.

    Raises:
        ArgumentValueError: A part has another form, or a name occurs twice.

    Example:
        >>> pairs_in("--units", ["mass=kg", '"time, s=s"'], "column=unit")
        {'mass': 'kg', 'time, s': 's'}
    """
    pairs: dict[str, str] = {}
    for part in names_in(entries):
        name, equals, value = (text.strip() for text in part.rpartition("="))
        if not (equals and name and value):
            raise invalid(option, f"of the form {form}", Received(part or "nothing"))
        if name in pairs:
            raise invalid(option, f"given once for each name, as {form}", Received(part))
        pairs[name] = value
    return pairs


def computed_in(entries: Sequence[str] | None) -> dict[str, str]:
    """Return computed columns, each entry ``name=expression``.

    Raises:
        ArgumentValueError: An entry has another form.
    """
    computed = {}
    for entry in entries or ():
        name, _, expression = (text.strip() for text in entry.partition("="))
        if not (name and expression):
            raise invalid("--compute", "of the form name=expression", entry)
        computed[name] = expression
    return computed


def number_in(option: str, text: str, form: str) -> float:
    """Return a number with a decimal point.

    Raises:
        ArgumentValueError: The text is none.
    """
    if not re.fullmatch(_NUMBER, text.strip()):
        raise invalid(option, f"{form}, numbers with a decimal point", text)
    return float(text)


def counts_in(option: str, text: str, form: str) -> tuple[int, ...]:
    """Return the whole numbers, each 1 or more, of a list with commas.

    Raises:
        ArgumentValueError: The text is something else; ``form`` says what it must be.

    Example:
        >>> counts_in("--retry", "1, 3", "numbers of test points")
        (1, 3)
    """
    parts = [part.strip() for part in text.split(",")]
    # \d would take the digits of every script; 18 of them always fit an int64.
    if not all(re.fullmatch(r"[1-9][0-9]{0,17}", part) for part in parts):
        raise invalid(option, form, text)
    return tuple(map(int, parts))


def share_in(text: str) -> tuple[int, int]:
    """Return the pair (k, n) of a share k/n.

    Raises:
        ArgumentValueError: The text is no such share.

    Example:
        >>> share_in("3/64")
        (3, 64)
    """
    found = re.fullmatch(r"([1-9][0-9]{0,8})/([1-9][0-9]{0,8})", text.strip())
    if not found or int(found[1]) > int(found[2]):
        raise invalid("--share", "k/n, the k-th of n parts, such as 3/64", text)
    return int(found[1]), int(found[2])


def value_in(text: str) -> Any:
    """Return a number, a list of them with commas, a truth value, or the text as it is.

    Example:
        >>> value_in("1,2.5"), value_in("True"), value_in("full")
        ([1, 2.5], True, 'full')
    """
    if "," in text:
        return [value_in(part) for part in text.split(",")]
    if text in ("True", "False"):
        return text == "True"
    if re.fullmatch(r"[+-]?[0-9]{1,18}", text):
        return int(text)
    return float(text) if re.fullmatch(_NUMBER, text) else text
