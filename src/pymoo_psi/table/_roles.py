"""What the columns of a file of designs are: as it tells, or else by their names."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pymoo_psi.pareto import RANKING_COLUMNS
from pymoo_psi.table._files import comment_text
from pymoo_psi.table._sheet import UnfitError, in_a_line

Units = Mapping[str, str]

# Begins the comment above a CSV that says what its columns are, see `roles_head`.
ROLES_MARK = "pymoo_psi_designs"
# Names of columns that name designs, and of those that number the rows of a file, which names of
# its designs say better. Not "no", which is also an exhaust gas.
NAMING = ("test_point", "number", "label", "name", "id", "design")
_LABELS = (*NAMING, "row", "index", "nr", "nr.", "no.", "nummer", "#")
_UNNAMED = re.compile(r"|Unnamed: \d+")  # as data frames write, and read, their row labels


@dataclass(frozen=True)
class Roles:
    """Which columns are what; a column without a role is carried along.

    Attributes:
        objectives: Names of the columns with objectives.
        variables: Names of the columns with design variables.
        label: Name of the column with the designs' numbers or names; ``None`` if there is none.
        maximize: The objectives of which more is better, and other columns of which it would be if
            they were objectives: a sense must not be lost while a column is none.
        outputs: Names of columns with what else a model gave.
    """

    objectives: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    label: str | None = None
    maximize: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()


def guessed_roles(
    names: Sequence[str], holds_numbers: Callable[[str], bool]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the objectives and variables of a file that does not tell them.

    With columns f1, f2, … these are the objectives, and x1, x2, … (or u1, u2, …) the variables.
    Otherwise all columns of numbers are objectives. Numbers and names of designs never are, nor
    are the columns that a ranking adds.

    Args:
        names: Names of all columns.
        holds_numbers: Whether a column is one of numbers.
    """
    labels = labels_among(names)
    free = [name for name in names if name not in labels and name not in RANKING_COLUMNS]
    numbered = [name for name in free if re.fullmatch(r"f\d+", name)]
    variables = [name for name in free if re.fullmatch(r"[xu]\d+", name)]
    # One column called f1 without any x1 is no numbering, and says nothing about the others.
    if not ("f1" in numbered and (variables or len(numbered) > 1)):
        numbered, variables = [name for name in free if holds_numbers(name)], []
    return tuple(numbered), tuple(variables)


def roles_head(
    names: Sequence[str],
    holds_numbers: Callable[[str], bool],
    roles: Roles,
    units: Units,
) -> dict[str, Any]:
    """Return what to write as JSON, a comment of one line, above a CSV; empty if needless.

    It is needed where the names of the columns do not tell the objectives, where one is to be
    maximised, or a column has a unit: so that the file ranks as what it was written from.

    Args:
        names: Names of all columns of the CSV.
        holds_numbers: Whether a column is one of numbers.
        roles: What the columns are.
        units: Units of columns by name.
    """
    guessed, _ = guessed_roles(names, holds_numbers)
    if guessed == roles.objectives and not roles.maximize and not any(units.values()):
        return {}
    return {
        ROLES_MARK: 1,
        "objectives": roles.objectives,
        "maximized": roles.maximize,
        "variables": roles.variables,
        "outputs": roles.outputs,
        "units": {name: unit for name, unit in units.items() if unit},
    }


def labels_among(names: Collection[str]) -> list[str]:
    """Return the columns whose names say that they number or name designs, the likeliest first."""
    labels = [name for name in names if name.strip().lower() in _LABELS]
    # A file may have both id and test_point; the order of _LABELS decides, not that of the columns.
    labels.sort(key=lambda name: _LABELS.index(name.strip().lower()))
    return labels + [name for name in names if _UNNAMED.fullmatch(name)]


def told_roles(line: str, names: Collection[str], label: str | None) -> tuple[Roles, Units]:
    """Return what the comment above a CSV says: the roles of its columns, and their units.

    Args:
        line: The comment, see :func:`roles_head`.
        names: Names of the columns that there are.
        label: The one with the designs' numbers or names.

    Raises:
        UnfitError: It is damaged, of a later version, or names an objective that is gone.
    """
    try:
        head = json.loads(comment_text(line))
        groups = ("objectives", "maximized", "variables", "outputs")
        objectives, maximized, variables, outputs = (
            tuple(map(in_a_line, head[key])) for key in groups
        )
        units = {in_a_line(name): unit for name, unit in head["units"].items()}
        if head[ROLES_MARK] != 1 or not {*maximized} <= {*objectives, *outputs}:
            raise ValueError
        if not all(isinstance(unit, str) for unit in units.values()):
            raise TypeError
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, csv.Error):
        what = "its first line, which says what the columns are, is damaged or of a later version"
        raise UnfitError(f"{what}; remove it, and say --objectives and --maximize") from None
    if missing := [name for name in objectives if name not in names]:
        what = f"its first line names the objective {missing[0]!r}, which is no column"
        raise UnfitError(f"{what}; restore the column, or remove the line")
    # Other columns may be gone: nothing is ranked by them.
    kept, others, more = (
        tuple(name for name in group if name in names) for group in (variables, outputs, maximized)
    )
    return Roles(objectives, kept, label, more, others), units
