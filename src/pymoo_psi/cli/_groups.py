"""Options that several commands take, groups of them, and texts for terminals.

A command takes a group as one argument, such as ``columns: ColumnOptions``; typer is shown the
fields of the group in its place. Nothing here imports NumPy or pymoo, as ``--help`` would wait.
"""

from __future__ import annotations

import functools
import inspect
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, TypeAlias, get_type_hints

import typer

NEAR = 0.7  # how alike two options are, of which one is meant; --mu and --out are so to 0.6


def path_in(text: str | Path) -> Path:
    """Return what is typed as a path, ``~`` replaced, which shells leave in ``--out=~/x.csv``."""
    if not os.fspath(text):  # as $FILE gives that is not set; to Path it is "."
        raise typer.BadParameter("a file or folder must have a name, got ''")
    return Path(os.path.expanduser(text))


def path_option(metavar: str, help: str) -> Any:
    """Return an option that takes a path."""
    return typer.Option(metavar=metavar, help=help, parser=path_in)


def path_argument(metavar: str, help: str) -> Any:
    """Return an argument that is a path, or several."""
    return typer.Argument(metavar=metavar, help=help, parser=path_in)


def several(metavar: str, help: str, *names: str) -> Any:
    """Return an option that may be given several times."""
    return typer.Option(*names, metavar=metavar, help=help, show_default=False)


ProblemName: TypeAlias = Annotated[
    str,
    typer.Argument(
        metavar="PROBLEM",
        help="'chute', a test problem of pymoo such as bnh, or your own as module:attribute, "
        "beam:Beam for the class Beam in beam.py. Its arguments are options, too: dtlz2 --n-obj 4.",
    ),
]
Designs: TypeAlias = Annotated[
    Path,
    path_argument("FILE", "Designs (CSV, .xlsx), a ranking, a test table, or a study."),
]
Jobs: TypeAlias = Annotated[int, typer.Option(metavar="N", help="Processes; -1: one per core.")]
PlainDistances: TypeAlias = Annotated[
    bool, typer.Option("--no-normalize", help="Plain distances, not in units of the ranges.")
]


Preferences: TypeAlias = Annotated[
    list[str] | None,
    several(
        "P",
        "Show what another preference chooses, too: weights:A=2,B=1, aspire:A=3,B=5, order:B,A, "
        "chebyshev, knee or tradeoff.",
    ),
]
DecisionFile: TypeAlias = Annotated[
    Path | None, path_option("FILE.json", "What was decided on the page: limits, choice, reason.")
]
Overwrite: TypeAlias = Annotated[
    bool,
    typer.Option("--force", help="Overwrite --out even if this command has not written it."),
]


@dataclass(frozen=True)
class ProblemOptions:
    """Options that a command does not know itself: arguments of its problem, if they are.

    Attributes:
        given: Their values, as they are typed, by ``--name``.
        own: The options of the command, for near misses.
    """

    given: dict[str, str]
    own: tuple[str, ...] = ()


@dataclass(frozen=True)
class ColumnOptions:
    """What is typed of criteria, senses, limits and computed columns."""

    objectives: Annotated[
        Sequence[str], several("A,B,…", "Columns with objectives [f1,f2,… or all numeric].")
    ] = ()
    maximize: Annotated[Sequence[str], several("A,…", "Objectives of which more is better.")] = ()
    limits: Annotated[
        Sequence[str],
        several('"A<=2.5,1<=X<=2"', "Limits on criteria, variables, outputs; in quotation marks."),
    ] = ()
    formulation: Annotated[
        Path | None,
        path_option("FILE.json", "These options, from a file of Formulation.to_json."),
    ] = None
    criterion: Annotated[
        Sequence[str],
        several('NAME|"NAME=A/B"', "One more criterion: a column, or an expression of columns."),
    ] = ()
    relax: Annotated[Sequence[str], several("G,…", "Constraints that need not hold.")] = ()

    @property
    def formulated(self) -> bool:
        """Whether more is asked than which columns are what."""
        return bool(self.formulation or self.criterion or self.relax or self.limits)


@dataclass(frozen=True)
class FileOptions:
    """What is typed of how a file of designs is written."""

    decimal: Annotated[
        str | None,
        typer.Option(metavar='"."|","', help="Decimal mark of the file [found from its numbers]."),
    ] = None
    thousands: Annotated[
        str | None, typer.Option(metavar='"."|","', help="Mark between thousands [likewise].")
    ] = None
    encoding: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Its encoding, such as cp1252 [UTF-8]."),
    ] = None
    skip_rows: Annotated[
        str | None,
        typer.Option(metavar="1,3,…", help="Lines to leave out: titles, units; or 'hidden' ones."),
    ] = None
    sheet: Annotated[
        str | None, typer.Option(metavar="NAME", help="Sheet of a workbook [the only one].")
    ] = None
    drop_incomplete: Annotated[
        bool, typer.Option("--drop-incomplete", help="Leave out designs that lack an objective.")
    ] = False


@dataclass(frozen=True)
class DocumentOptions:
    """What is typed for a page or a report of designs."""

    variables: Annotated[
        Sequence[str], several("X,Y,…", "Columns with design variables [x1,x2,…].")
    ] = ()
    units: Annotated[Sequence[str], several("A=KG,B=S", "Units of columns.")] = ()
    decision: DecisionFile = None
    no_normalize: PlainDistances = False
    title: Annotated[str | None, typer.Option(help="Heading [the file's name].")] = None


def grouped(command: Callable[..., int]) -> Callable[..., int]:
    """Return a command that typer sees with the fields of its groups in place of these."""
    groups: dict[str, Any] = {}
    shown: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command, eval_str=True).parameters.items():
        if not is_dataclass(parameter.annotation):
            shown.append(parameter.replace(kind=parameter.KEYWORD_ONLY))
            continue
        group = groups[name] = parameter.annotation
        hints = get_type_hints(group, include_extras=True)
        for field in fields(group):
            kind = hints[field.name]
            if field.default == ():  # typer takes lists, and gives None for none
                kind = Annotated[list[str] | None, kind.__metadata__[0]]
            default = None if field.default == () else field.default
            shown.append(
                inspect.Parameter(
                    field.name, parameter.KEYWORD_ONLY, default=default, annotation=kind
                )
            )

    @functools.wraps(command)
    def ungrouped(**given: Any) -> int:
        for name, group in groups.items():
            values = {field.name: given.pop(field.name) for field in fields(group)}
            given[name] = group(**{key: v for key, v in values.items() if v is not None})
        return command(**given)

    ungrouped.__signature__ = inspect.Signature(shown)  # type: ignore[attr-defined]
    ungrouped.__annotations__ = {parameter.name: parameter.annotation for parameter in shown}
    return ungrouped


def printable(text: str) -> str:
    """Return a text for a terminal, without the characters that would steer it.

    A name, a reason or a message may come out of a file that a stranger has written.
    """
    return re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", "?", text)
