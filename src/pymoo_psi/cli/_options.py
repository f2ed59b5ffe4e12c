"""What is typed in options that name things: columns, limits, units, numbers.

An option that names columns can be given several times. Each entry is one name, whatever
characters are in it, if the file has such a column; otherwise it is a list with commas, in which a
name with a comma stands in quotation marks. So ``--objectives "time, s" --objectives mass,cost``
means three columns. Entries of ``--limits`` and ``--units`` begin with such a name.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pymoo.core.problem import Problem

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, invalid, known_name
from pymoo_psi.problems._design_space import Variable, design_space, own_names
from pymoo_psi.table import DesignFile, TestTable, read_designs
from pymoo_psi.table._design_file import Roles
from pymoo_psi.table._layout import Limits
from pymoo_psi.table._table import read_tests

# Without underscores in the number: Python reads 1_0 as 10. Nor with signs, so that the last one
# counts and a name may hold others: a=b<=1 limits the column a=b.
_LIMIT = re.compile(r"(?P<name>.*?)\s*(?P<sign><=|>=|=)\s*(?P<limit>[^<>=_]*)", re.DOTALL)


def tests_in(path: Path) -> tuple[TestTable, str]:
    """Return all tests of a study, a folder of studies or an exported table; which are missing."""
    readers = {".csv": TestTable.read_csv, ".parquet": TestTable.read_parquet}
    reader = readers.get(path.suffix.lower())
    return read_tests(path) if reader is None or path.is_dir() else (reader(path), "")


@dataclass(frozen=True)
class ColumnOptions:
    """What the options say of the columns of a file of designs, as it is typed."""

    objectives: Sequence[str] = ()
    maximize: Sequence[str] = ()
    variables: Sequence[str] = ()
    units: Sequence[str] = ()
    limits: Sequence[str] = ()


@dataclass(frozen=True)
class FileOptions:
    """What the options say of how a file of designs is written, as it is typed."""

    decimal: str | None = None
    thousands: str | None = None
    encoding: str | None = None
    skip_rows: str | None = None
    drop_incomplete: bool = False

    def read(self, path: Path) -> DesignFile:
        """Return the designs of a file; see :func:`pymoo_psi.table.read_designs`."""
        rule = "numbers of lines to leave out, such as 1,3"
        skip_rows = numbers_in("--skip-rows", self.skip_rows, rule) if self.skip_rows else ()
        return read_designs(
            path,
            decimal=self.decimal,
            thousands=self.thousands,
            encoding=self.encoding,
            skip_rows=skip_rows,
        )


def designs_of(
    path: Path, columns: ColumnOptions, written: FileOptions
) -> tuple[DesignFile, Roles, list[str]]:
    """Read a file and settle which of its columns are what.

    Returns:
        The file, the roles of its columns, and what to tell about the choice of columns and rows.

    Raises:
        PsiError: The file holds no designs, or an option names no column of it.
        OSError: It cannot be opened.
    """
    file = written.read(path)
    # In the options' own words first, so that a message names the option.
    objectives = names_in("--objectives", columns.objectives, file.names)
    variables = names_in("--variables", columns.variables, file.names)
    roles = file.roles(objectives or None, variables or None)
    # What the file says is not taken back: else it would be minimised without a word.
    typed = names_in("--maximize", columns.maximize, file.names)
    maximize = tuple(dict.fromkeys((*roles.maximize, *typed)))
    if other := [name for name in maximize if name not in roles.objectives]:
        rule = f"one of the objectives {', '.join(roles.objectives)}"
        raise invalid("--maximize", rule, other[0])
    # A choice that the user has made need not be told; one that was made for them must be.
    remarks = [file.told(roles)] if not objectives else []
    if written.drop_incomplete:
        file = file.complete(roles.objectives)
    remarks += file.remarks
    return file, replace(roles, maximize=maximize), remarks


def names_in(option: str, entries: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Return the columns that the entries of an option name.

    Raises:
        ArgumentValueError: A name occurs twice, or there is no such column.

    Example:
        >>> names_in("--objectives", ["time, s", "mass,cost"], ["time, s", "mass", "cost"])
        ('time, s', 'mass', 'cost')
    """
    names = parts_of(entries, lambda entry: entry in known)
    for name in names:
        known_name(option, name, known)
        if names.count(name) > 1:
            raise invalid(option, "columns that are named once", name)
    return tuple(names)


def limits_in(
    entries: Sequence[str], known: Collection[str], maximize: Collection[str] = ()
) -> dict[str, float]:
    """Return the limits on criteria: at most, or at least for one to be maximised.

    Args:
        entries: Each ``name=2.5``, or with the sign ``<=`` (``>=`` where more is better).
        known: The criteria.
        maximize: Those of them to be maximised.

    Raises:
        ArgumentValueError: A part is no limit, names no criterion, limits the wrong side, or a
            criterion has two.

    Example:
        >>> limits_in(["f1=2.5, yield>=0.8"], ["f1", "yield"], ["yield"])
        {'f1': 2.5, 'yield': 0.8}
    """
    limits: dict[str, float] = {}
    for part in parts_of(entries, lambda entry: _limit(entry)[0] in known):
        name, sign, limit = _limit(part)
        if not name or math.isnan(limit):
            rule = "of the form criterion=number or criterion<=number, joined by commas"
            raise invalid("--limits", rule, Received(part or "nothing"))
        known_name("--limits", name, known)
        if name in limits:
            raise invalid("--limits", "given once for each criterion", Received(part))
        # "=" limits whichever side is the worse one; another sign must agree with that.
        right = ">=" if name in maximize else "<="
        if sign not in ("=", right):
            sense = "more" if name in maximize else "less"
            rule = f"{name}{right}number, as {sense} of it is better"
            raise invalid("--limits", rule, Received(part))
        limits[name] = limit
    return limits


def _limit(part: str) -> tuple[str, str, float]:
    """Return name, sign and number of a limit; no name or NaN if it is none."""
    found = _LIMIT.fullmatch(part)
    try:
        return (found["name"], found["sign"], float(found["limit"])) if found else ("", "", 0.0)
    except ValueError:
        return found["name"] if found else "", "", math.nan


def box_in(entries: Sequence[str], problem: Problem) -> dict[str, Any]:
    """Return the part of a box, as :class:`~pymoo_psi.Restricted` takes it.

    Args:
        entries: Each ``name=lower:upper``, of which either may be missing, ``name=value``, or for
            a choice ``name=option|option``.
        problem: The problem.

    Raises:
        ArgumentValueError: A part is no such pair, there is no such variable, or it is named twice.

    Example:
        >>> from pymoo_psi import SphereChute
        >>> box_in(["x1=0.2:, x2=3"], SphereChute())
        {'x1': (0.2, None), 'x2': 3.0}
    """
    space = design_space(problem)
    own = own_names(problem, space)
    variables = {own[v.name]: replace(v, name=own[v.name]) for v in space.variables}

    def pair(part: str) -> tuple[str, str]:
        """Split at the first sign behind the name of a variable: names may hold one, too."""
        signs = [place for place, letter in enumerate(part) if letter == "="]
        names = [(part[:place].strip(), part[place + 1 :].strip()) for place in signs]
        return next((p for p in names if p[0] in variables), names[0] if names else ("", ""))

    box: dict[str, Any] = {}
    for part in parts_of(
        entries, lambda entry: pair(entry)[0] in variables and "=" not in pair(entry)[1]
    ):
        name, text = pair(part)
        if not name or not text:
            rule = "of the form variable=lower:upper or variable=value, joined by commas"
            raise invalid("--box", rule, Received(part or "nothing"))
        known_name("--box", name, variables)
        if name in box:
            raise invalid("--box", "given once for each variable", Received(part))
        box[name] = _part_in(text, variables[name], part)
    return box


def box_text(table: TestTable, limits: Limits, problem: Problem) -> str:
    """Return where the feasible designs lie, as ``--box`` takes it; empty if everywhere.

    Bounds are rounded outwards, to a thousandth of their distance; those of the problem's own box
    are left out. What the problem has fixed, or left of a choice, stays.
    """
    kept, parts = getattr(problem, "box", {}), []
    bounds = zip(*table.refined_bounds(limits), strict=True)
    space = design_space(problem)
    own_name = own_names(problem, space)
    for variable, ends in zip(space.variables, bounds, strict=True):
        name, (low, high) = own_name[variable.name], ends
        if low < high:  # not so of choices, where they are NaN, and of fixed variables
            digits = 3 - math.floor(math.log10(high - low))
            grid = 10.0**-digits
            ends = (math.floor(low / grid) * grid, math.ceil(high / grid) * grid)
            low, high = (round(end, max(digits, 0)) for end in ends)
        value, own = "", name in kept  # where a bound is not that of the whole box
        if variable.fixed or variable.kind in (Kind.CHOICE, Kind.BINARY):
            given = kept.get(name, [])
            value = "|".join(map(str, given if isinstance(given, list) else [given]))
        elif own or low > variable.lower or high < variable.upper:
            first = f"{max(low, variable.lower):.12g}" if own or low > variable.lower else ""
            last = f"{min(high, variable.upper):.12g}" if own or high < variable.upper else ""
            value = f"{first}:{last}"
        part = f"{name}={value}" if value else ""
        parts += [f'"{part}"' if "," in part else part] if part else []
    return ",".join(parts)


def _part_in(text: str, variable: Variable, part: str) -> Any:
    """Return bounds, value or options of a variable; ``part`` is what was typed, for messages."""
    words: dict[str, Any] = {"True": True, "False": False}
    if variable.kind is Kind.CHOICE:
        words = {str(option): option for option in variable.options}
        if len(words) < len(variable.options):
            rule = "a choice whose options differ as text, to be restricted by --box"
            raise invalid(variable.name, rule, Received(", ".join(map(repr, variable.options))))
    if variable.kind in (Kind.CHOICE, Kind.BINARY):
        if text in words:
            return words[text]
        return [words[known_name("--box", word.strip(), words)] for word in text.split("|")]
    ends = [end.strip() for end in text.split(":")]
    try:
        if len(ends) > 2 or "_" in text:  # Python reads 1_0 as 10
            raise ValueError
        numbers = [float(end) if end else None for end in ends]
    except ValueError:
        rule = f"{variable.name}=lower:upper or {variable.name}=value, in numbers"
        raise invalid("--box", rule, Received(part)) from None
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def units_in(entries: Sequence[str], known: Collection[str]) -> dict[str, str]:
    """Return the units of columns, each entry ``name=unit``.

    Raises:
        ArgumentValueError: A part is no such pair, or there is no such column.

    Example:
        >>> units_in(["mass=kg", "time, s=s"], ["mass", "time, s"])
        {'mass': 'kg', 'time, s': 's'}
    """
    units = {}
    for part in parts_of(entries, lambda entry: entry.rpartition("=")[0].strip() in known):
        # At the last sign: a name may hold one, a unit does not.
        name, equals, unit = (text.strip() for text in part.rpartition("="))
        if not (name and equals):
            raise invalid("--units", "of the form name=unit,name=unit", Received(part or "nothing"))
        units[known_name("--units", name, known)] = unit
    return units


def numbers_in(option: str, text: str, rule: str) -> tuple[int, ...]:
    """Return the whole numbers, each 1 or more, of a list with commas.

    Raises:
        ArgumentValueError: The text is something else; ``rule`` says what it must be.

    Example:
        >>> numbers_in("--retry", "1, 3", "numbers of test points")
        (1, 3)
    """
    parts = [part.strip() for part in text.split(",")]
    # \d would take the digits of every script; 18 of them always fit an int64.
    if not all(re.fullmatch(r"[1-9][0-9]{0,17}", part) for part in parts):
        raise invalid(option, rule, text)
    return tuple(int(part) for part in parts)


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


def parts_of(entries: Sequence[str], is_one: Callable[[str], bool]) -> list[str]:
    """Return the entries, those that are not one as a whole split at their commas."""
    # An empty entry stays as an empty name, to be refused: --objectives "" is not "no option".
    return [
        part for entry in entries for part in ([entry] if is_one(entry) else _split(entry) or [""])
    ]


def _split(entry: str) -> list[str]:
    try:
        return [name.strip() for name in next(csv.reader([entry], skipinitialspace=True), [])]
    except csv.Error:  # a line break in a name
        return [entry.strip()]
