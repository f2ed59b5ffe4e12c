"""What the columns of a file of designs are, as far as their names tell."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pymoo_psi.pareto.ranking import RANKING_COLUMNS

__all__ = ["Roles", "guessed_roles"]

_LABELS = ("test_point", "number", "label", "name", "id", "design", "row", "index")
_UNNAMED = re.compile(r"|Unnamed: \d+")  # as data frames write, and read, their row labels


@dataclass(frozen=True)
class Roles:
    """Which columns are what; a column without a role is carried along.

    Attributes:
        objectives: Names of the columns with objectives.
        variables: Names of the columns with design variables.
        label: Name of the column with the designs' numbers or names; ``None`` if there is none.
        maximize: The objectives that the file says are to be maximised.

    Example:
        >>> Roles(("cost", "mass"), label="id").variables
        ()
    """

    objectives: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    label: str | None = None
    maximize: tuple[str, ...] = ()


def guessed_roles(names: Sequence[str], holds_numbers: Callable[[str], bool]) -> Roles:
    """Return the roles of the columns of a file that does not tell them.

    With columns f1, f2, … these are the objectives, and x1, x2, … (or u1, u2, …) the variables.
    Otherwise all columns of numbers are objectives. Numbers and names of designs never are, nor
    are the columns that a ranking adds.

    Args:
        names: Names of all columns.
        holds_numbers: Whether a column is one of numbers.

    Example:
        >>> guessed_roles(["id", "x1", "f1", "f2", "rank"], lambda name: True)
        Roles(objectives=('f1', 'f2'), variables=('x1',), label='id', maximize=())
        >>> guessed_roles(["cost", "metal"], lambda name: name == "cost").objectives
        ('cost',)
    """
    labels = [name for name in names if name.strip().lower() in _LABELS]
    labels.sort(key=lambda name: _LABELS.index(name.strip().lower()))
    labels += [name for name in names if _UNNAMED.fullmatch(name)]
    free = [name for name in names if name not in labels and name not in RANKING_COLUMNS]
    numbered = [name for name in free if re.fullmatch(r"f\d+", name)]
    variables = [name for name in free if re.fullmatch(r"[xu]\d+", name)]
    if not ("f1" in numbered and (variables or len(numbered) > 1)):
        numbered, variables = [name for name in free if holds_numbers(name)], []
    return Roles(tuple(numbered), tuple(variables), labels[0] if labels else None)
