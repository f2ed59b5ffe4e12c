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
from dataclasses import replace
from pathlib import Path
from typing import Any

from pymoo.core.problem import Problem

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, Remark, invalid, known_name
from pymoo_psi.cli._groups import ColumnOptions, FileOptions
from pymoo_psi.pareto import listed
from pymoo_psi.problems._design_space import Variable, design_space, own_names
from pymoo_psi.table import DesignFile, Formulation, Limit, Limits, TestTable
from pymoo_psi.table._roles import Roles
from pymoo_psi.table._sources import designs_of_tests, read_designs_or_tests

# The limit holds no signs, so that the last one counts and a name may hold others: a=b<=1 limits
# the column a=b.
_LIMIT = re.compile(r"(?P<name>.*?)\s*(?P<sign><=|>=|=)\s*(?P<limit>[^<>=]*)", re.DOTALL)
_BEFORE = re.compile(r"\s*(?P<limit>[^<>=]*?)\s*(?P<sign><=|>=)\s*(?P<name>.*)", re.DOTALL)


def tests_in(path: Path) -> tuple[TestTable, str]:
    """Return all tests of a study, a folder of studies or an exported table; which are missing.

    Told by content, whatever the file is called, as for designs.
    """
    found, missing = opened(FileOptions(), path)
    if not isinstance(found, TestTable):
        rule = "a study or a table of tests, of solve --study or export"
        raise invalid(str(path), rule, Received("designs without their tests"))
    return found, missing


def judged(tests: TestTable, asked: Formulation) -> TestTable:
    """Return tests under a formulation, if it asks for anything."""
    # Of tests that all failed, as the first ones may, nobody knows which outputs they have.
    plain = asked == Formulation() or (tests.status == "failed").all()
    return tests if plain else tests.under(asked)


def formulation_of(
    typed: ColumnOptions,
    columns: Sequence[str],
    objectives: Sequence[str],
    maximized: Collection[str],
    constraints: Sequence[str] | None = (),
    *,
    complete: bool = True,
) -> Formulation:
    """Return the formulation in a file with what the single options add to it.

    Args:
        typed: The options.
        columns: Names of all columns.
        objectives: The criteria unless others are named.
        maximized: Columns of which more is better.
        constraints: Those of the columns that are constraints; None if that is not known.
        complete: Whether there are no other columns, as a model may give.

    Raises:
        ArgumentValueError: There is no such column, or an option cannot be read.
        OSError: The file cannot be opened.
    """
    base = Formulation() if typed.formulation is None else Formulation.read_json(typed.formulation)
    known = [*columns, *base.computed]
    named = names_in("--objectives", typed.objectives, known) or base.objectives
    added, computed = [], dict(base.computed)
    for entry in typed.criterion:
        name, equals, text = (part.strip() for part in entry.partition("="))
        if entry.strip() in known or not equals:
            name = entry.strip()
            if complete:
                known_name("--criterion", name, known, "or say name=expression")
        elif name and text and name not in known:
            computed[name] = text
        else:
            rule = "a column, or of the form name=expression with a new name"
            raise invalid("--criterion", rule, entry)
        added.append(name)
    known = list(dict.fromkeys((*known, *added)))
    # Without a word on criteria these stay the table's, whatever they are.
    criteria = tuple(dict.fromkeys((*(named or objectives if added else named), *added)))
    now = criteria or tuple(objectives)
    named = names_in("--maximize", typed.maximize, known)
    if other := [name for name in named if name not in now]:
        raise invalid("--maximize", f"one of the objectives {', '.join(now)}", other[0])
    maximize = tuple(dict.fromkeys((*base.maximize, *named)))
    more = {*maximized, *maximize}.difference(base.minimize)
    relaxed = names_in("--relax", typed.relax, known if constraints is None else constraints)
    relaxed = tuple(dict.fromkeys((*base.relaxed, *relaxed)))
    held = [n for n in constraints or () if n not in {*relaxed, *now}]
    free = [name for name in known if name not in held]
    remedy = "a constraint is limited when it is left out by --relax" if held else ""
    limits = limits_in(typed.limits, free, now, more, complete=complete, remedy=remedy)
    return Formulation(
        criteria, maximize, base.minimize, {**base.limits, **limits}, relaxed, computed
    )


def opened(written: FileOptions, path: Path) -> tuple[DesignFile | TestTable, str]:
    """Return the designs of a file, or all tests if it holds these, and which are missing."""
    rule = "numbers of lines to leave out, such as 1,3, or hidden"
    skip_rows: list[int | str] = []
    for part in written.skip_rows.split(",") if written.skip_rows else ():
        hidden = part.strip() == "hidden"
        skip_rows += ["hidden"] if hidden else numbers_in("--skip-rows", part, rule)
    return read_designs_or_tests(
        path, written.decimal, written.thousands, written.encoding, skip_rows, written.sheet
    )


def read(written: FileOptions, path: Path) -> DesignFile:
    """Return the designs of a file; see :func:`pymoo_psi.table.read_designs`."""
    found, missing = opened(written, path)
    return found if isinstance(found, DesignFile) else designs_of_tests(path, found, missing)


def designs_of(
    path: Path, columns: ColumnOptions, written: FileOptions, variables: Sequence[str] = ()
) -> tuple[DesignFile, Roles, list[str]]:
    """Read a file and settle which of its columns are what.

    Returns:
        The file, the roles of its columns, and what to tell about the choice of columns and rows.

    Raises:
        PsiError: The file holds no designs, or an option names no column of it.
        OSError: It cannot be opened.
    """
    if not columns.formulated:
        return _with_roles(read(written, path), columns, written, variables)
    found, missing = opened(written, path)
    asked = _asked(found, columns)
    if isinstance(found, TestTable):
        names = found.layout.columns
        table = found.under(asked)
        file = designs_of_tests(path, table, missing)
        # What limits leave of a column says nothing that the column does not.
        limits = {*table.layout.inequalities}.difference(names)
        file = replace(file, columns={n: c for n, c in file.columns.items() if n not in limits})
    else:
        file = found.under(asked)
    file, roles, remarks = _with_roles(file, _settled(columns, file), written, variables)
    # As they were read: 11.000 may be meant as eleven thousand, and would limit nothing.
    told = [_told(name, limit) for name, limit in asked.limits.items() if limit != (None, None)]
    return file, roles, [*([f"Limits: {', '.join(told)}"] if told else []), *remarks]


def _told(name: str, limit: Limit) -> str:
    """Return a limit as ``--limits`` takes it, with all digits."""
    lower, upper = limit if isinstance(limit, Sequence) else (None, limit)
    least, most = ("" if end is None else f"{end:.15g}" for end in (lower, upper))
    if not most:
        return f"{name} >= {least}"
    return f"{least} <= {name} <= {most}" if least else f"{name} <= {most}"


def _settled(columns: ColumnOptions, file: DesignFile) -> ColumnOptions:
    """Return the options for a file that knows its objectives and senses by a formulation."""
    # Those that were typed are named again, as what a user has chosen need not be told.
    known = file.known.objectives if columns.objectives and file.known else ()
    return replace(columns, objectives=known)


def formulated_in(
    path: Path,
    columns: ColumnOptions,
    written: FileOptions,
    variables: Sequence[str],
    limited: Collection[str] = (),
) -> tuple[TestTable, Limits, list[str] | None, str | None, list[str]]:
    """Read all tests, or designs as such, under what the options ask for but limits.

    Args:
        path: The file.
        columns: What its columns are, and the limits.
        written: How it is written.
        variables: Those that are design variables, as they are typed.
        limited: Columns that are limited by other than the options.

    Returns:
        The tests, the limits, what their designs are called if not by test point, in which column,
        and what to tell about the choice of columns and rows.

    Raises:
        PsiError: The file holds no designs, or an option names no column of it.
        OSError: It cannot be opened.
    """
    found, missing = opened(written, path)
    asked = _asked(found, columns)
    unlimited = replace(asked, limits={})
    if isinstance(found, TestTable):
        if variables:
            rule = "named for a file of designs only: a test table knows its variables"
            raise invalid("--variables", rule, variables[0])
        remarks = [f"{missing}."] if missing else []
        return judged(found, unlimited), asked.limits, None, None, remarks
    file = found if unlimited == Formulation() else found.under(unlimited)
    if file is not found:
        columns = _settled(columns, file)
    file, roles, remarks = _with_roles(file, columns, written, variables)
    # Any column of numbers can be limited, as by rank and on the page, whatever its role.
    named = {*roles.objectives, *roles.variables, *roles.outputs}
    others = [name for name in file.names if name in {*asked.limits, *limited} - named]
    for name in others:
        file.numbers(name)  # refuses texts
    roles = replace(roles, outputs=(*roles.outputs, *others))
    tests = file.as_tests(roles)
    if lost := [name for name in roles.variables if name not in tests.layout.variables]:
        remarks.append(f"No variable here, as some designs have no value of it: {listed(lost)}.")
    return tests, asked.limits, file.called(roles.label), roles.label, remarks


def _asked(found: DesignFile | TestTable, columns: ColumnOptions) -> Formulation:
    """Return what the options ask of the columns of tests, or of designs."""
    if isinstance(found, TestTable):
        layout = found.layout
        names, constraints = layout.columns, layout.constraints
        return formulation_of(columns, names, layout.objectives, layout.maximize, constraints)
    told = found.roles(() if columns.objectives or columns.formulation else None)
    known = found.known or told
    return formulation_of(columns, found.names, told.objectives, known.maximize, None)


def _with_roles(
    file: DesignFile, columns: ColumnOptions, written: FileOptions, variables: Sequence[str]
) -> tuple[DesignFile, Roles, list[str]]:
    # In the options' own words first, so that a message names the option.
    objectives = names_in("--objectives", columns.objectives, file.names)
    named = names_in("--variables", variables, file.names)
    roles = file.roles(objectives or None, named or None)
    # What the file says is not taken back: else it would be minimised without a word.
    typed = names_in("--maximize", columns.maximize, file.names)
    maximize = tuple(dict.fromkeys((*roles.maximize, *typed)))
    if other := [name for name in typed if name not in roles.objectives]:
        rule = f"one of the objectives {', '.join(roles.objectives)}"
        raise invalid("--maximize", rule, other[0])
    # A choice that the user has made need not be told; one that was made for them must be.
    remarks: list[str] = [file.told(roles)] if not objectives else []
    for name in typed:
        if (file.numbers(name) < 0).all():  # as in F of pymoo, which minimises
            hint = "if its sign is turned, as in F of pymoo, leave --maximize out, or turn it back"
            remarks.append(Remark(f"{name} is maximised, and negative throughout", f": {hint}."))
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
    entries: Sequence[str],
    known: Collection[str],
    objectives: Collection[str],
    maximize: Collection[str] = (),
    *,
    complete: bool = True,
    remedy: str = "",
) -> dict[str, tuple[float | None, float | None]]:
    """Return limits on columns, ``(lower, upper)`` each, in their own sense.

    Args:
        entries: Each ``name<=2.5``, ``name>=2.5`` or ``1<=name<=2.5``, joined by commas. For a
            criterion ``name=2.5`` limits its worse side.
        known: The columns that can be limited.
        objectives: Those of them that are criteria.
        maximize: Those of which more is better.
        complete: Whether there are no other columns.
        remedy: What may help where a column cannot be limited.

    Raises:
        ArgumentValueError: A part is no limit, names no such column, or a side has two limits.

    Example:
        >>> limits_in(["f1=2.5, yield=0.8", "1<=x1<=2"], ["f1", "yield", "x1"], ["f1", "yield"],
        ...           ["yield"])
        {'f1': (None, 2.5), 'yield': (0.8, None), 'x1': (1.0, 2.0)}
    """
    limits: dict[str, tuple[float | None, float | None]] = {}
    for part in parts_of(entries, lambda entry: _limit(entry, known)[0] in known):
        name, ends = _limit(part, known)
        if not name or any(math.isnan(end) for _, end in ends):
            rule = "of the form criterion=number, column<=number or number<=column<=number"
            remedy = "write <= for <, >= for >" if re.search("[<>](?!=)", part) else ""
            # A list is divided at the comma of 2,5, which leaves its last digits alone.
            if re.search(r"\d,\d", part) or part.strip().isdigit():
                remedy = "write 2.5 for 2,5"
            if re.search(r"[<>=]\s*[-+\d.eE]*\d\s*[^\W\d_]+$", part):
                remedy = "write the number without its unit"
            raise invalid(
                "--limits", f"{rule}, joined by commas", Received(part or "nothing"), remedy
            )
        if complete or re.search("[<>]=", name):
            several = name not in known and re.search("[<>]=", name)
            known_name("--limits", name, known, "join limits by commas" if several else remedy)
        for sign, end in ends:
            if sign == "=" and name not in known:
                known_name("--limits", name, known, f"of an output say {name}<= or >= a number")
            if sign == "=" and name not in objectives:
                rule = f"{name}<={end:g} or {name}>={end:g}, as {name} is no criterion"
                raise invalid("--limits", rule, Received(part))
            side = int(sign == "<=" or (sign == "=" and name not in maximize))
            pair = list(limits.get(name, (None, None)))
            if pair[side] is not None:
                raise invalid("--limits", "given once for each side of a column", Received(part))
            pair[side] = end
            limits[name] = (pair[0], pair[1])
    return limits


def _limit(part: str, known: Collection[str]) -> tuple[str, list[tuple[str, float]]]:
    """Return name, signs and numbers of a limit; no name or NaN if it is none."""
    found, name, ends = _LIMIT.fullmatch(part), "", []
    if found and not math.isnan(end := number_in(found["limit"])):
        name, ends = found["name"], [(found["sign"], end)]
        if name in known:  # that a name holds signs goes before what else it could mean
            return name, ends
    before = _BEFORE.fullmatch(name or part)
    if before and not math.isnan(end := number_in(before["limit"])):
        return before["name"], [(">=" if before["sign"] == "<=" else "<=", end), *ends]
    return name or (found["name"] if found else ""), ends or [("", math.nan)]


def number_in(text: str) -> float:
    """Return the number that is typed; NaN if it is none."""
    try:
        return float(text) if "_" not in text else math.nan  # Python reads 1_0 as 10
    except ValueError:
        return math.nan


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


def units_in(entries: Sequence[str], known: Collection[str], remedy: str = "") -> dict[str, str]:
    """Return the units of columns, each entry ``name=unit``.

    Args:
        entries: What is typed.
        known: The columns that are shown.
        remedy: How another one would be.

    Raises:
        ArgumentValueError: A part is no such pair, there is no such column, or it is named twice.

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
        if known_name("--units", name, known, remedy) in units:
            raise invalid("--units", "given once for each column", Received(part))
        units[name] = unit
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
