"""Options that several commands take, and the one way from them to a table.

A command takes a group of options as one argument, such as ``asked: Asked``; typer sees the fields
of the group in its place. NumPy and pymoo are imported where they are used, as ``--help`` would
wait for them.
"""

from __future__ import annotations

import functools
import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_type_hints

import typer

if TYPE_CHECKING:
    from pymoo_psi.table import Formulation, TestTable


def path_in(text: str | Path) -> Path:
    """Return what is typed as a path, ``~`` replaced, which shells leave in ``--out=~/x.csv``."""
    if not os.fspath(text):  # as $FILE gives that is not set; to Path it is "."
        raise typer.BadParameter("a file or folder must have a name, got ''")
    return Path(os.path.expanduser(text))


def path_option(metavar: str, help: str, *names: str) -> Any:
    """Return an option that takes a path."""
    return typer.Option(*names, metavar=metavar, help=help, parser=path_in)


def option(metavar: str, help: str) -> Any:
    """Return an option, or one that may be given several times where its type is a list."""
    return typer.Option(metavar=metavar, help=help, show_default=False)


Source: TypeAlias = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="A study, a folder of shares, or a table: CSV, .xlsx, .parquet, JSON of 'rank'.",
        parser=path_in,
    ),
]
Jobs: TypeAlias = Annotated[int, typer.Option(metavar="N", help="Processes; -1: one per core.")]
Preferences: TypeAlias = Annotated[
    list[str] | None,
    option(
        "P",
        "Show what another preference chooses, too: weights:A=2,B=1, aspire:A=3,B=5, order:B,A, "
        "chebyshev, knee or tradeoff.",
    ),
]
Overwrite: TypeAlias = Annotated[
    bool, typer.Option("--force", help="Overwrite what this command has not written, too.")
]


@dataclass(frozen=True)
class Asked:
    """What is asked of a table: objectives, directions, limits, computed columns."""

    objectives: Annotated[
        list[str] | None, option("A,B,…", "Columns with objectives [f1,f2,… or all numeric].")
    ] = None
    maximize: Annotated[list[str] | None, option("A,…", "Objectives of which more is better.")] = (
        None
    )
    limits: Annotated[
        list[str] | None,
        option('"A<=2.5,1<=X<=2"', "Limits on any columns of numbers; in quotation marks."),
    ] = None
    compute: Annotated[
        list[str] | None, option('"NAME=A/B"', "One more column, computed from others.")
    ] = None
    relax: Annotated[list[str] | None, option("G,…", "Constraints that need not hold.")] = None
    formulation: Annotated[
        Path | None,
        path_option(
            "FILE.json",
            "All this from a file: a decision of the page, or Formulation.to_json; further "
            "options add to it.",
            "--formulation",
            "--decision",
        ),
    ] = None
    no_normalize: Annotated[
        bool, typer.Option("--no-normalize", help="Plain distances, not in units of the ranges.")
    ] = False

    def read(self) -> Formulation:
        """Return the formulation in the file, and what the other options add to it.

        Raises:
            ArgumentValueError: An option cannot be read, or the file is none.
            OSError: The file cannot be opened.
        """
        from pymoo_psi._validation import instance
        from pymoo_psi.cli._text import computed_in, limits_in, names_in
        from pymoo_psi.table import Formulation

        base = Formulation()
        if self.formulation is not None:
            base = Formulation.read_json(self.formulation)
            for key in ("units", "values", "state"):  # of the page, whose file may be untrusted
                instance(f"page.{key} in {self.formulation}", base.page.get(key, {}), dict)
        return replace(
            base,
            objectives=names_in(self.objectives) or base.objectives,
            maximize=list(dict.fromkeys([*base.maximize, *names_in(self.maximize)])),
            limits={**base.limits, **limits_in(self.limits)},
            relaxed=list(dict.fromkeys([*base.relaxed, *names_in(self.relax)])),
            computed={**base.computed, **computed_in(self.compute)},
            normalize=base.normalize and not self.no_normalize,
        )


@dataclass(frozen=True)
class Opening:
    """How a source is opened: what its columns are, and how its numbers are written."""

    variables: Annotated[
        list[str] | None, option("X,Y,…", "Columns with design variables [x1,x2,…].")
    ] = None
    units: Annotated[list[str] | None, option("A=KG,B=S", "Units of columns.")] = None
    decimal: Annotated[
        str | None, option('"."|","', "Decimal mark of the file [found from its numbers].")
    ] = None
    thousands: Annotated[
        str | None, option("MARK", "Mark between thousands [as for --decimal].")
    ] = None
    encoding: Annotated[str | None, option("NAME", "Of a text, such as cp1252 [UTF-8].")] = None
    skip_rows: Annotated[
        str | None, option("1,3,…", "Lines to leave out: titles, units; or 'hidden' ones.")
    ] = None
    sheet: Annotated[str | None, option("NAME", "Sheet of a workbook [the only one].")] = None
    drop_incomplete: Annotated[
        bool, typer.Option("--drop-incomplete", help="Leave out designs that lack an objective.")
    ] = False

    def table(self, path: Path, asked: Formulation) -> TestTable:
        """Return the table of a source under a formulation: every command opens it here.

        Raises:
            ArgumentValueError: It is no table, or an option does not fit it.
            OSError: It cannot be opened.
        """
        from pymoo_psi._validation import known_name
        from pymoo_psi.cli._text import counts_in, names_in, pairs_in
        from pymoo_psi.page import kept_designs
        from pymoo_psi.table import Formulation, read_table

        rule = "numbers of lines to leave out, such as 1,3, or hidden"
        skipped: list[int | str] = []
        for part in self.skip_rows.split(",") if self.skip_rows is not None else ():
            hidden = part.strip() == "hidden"
            skipped += ["hidden"] if hidden else counts_in("--skip-rows", part, rule)
        table = read_table(
            path,
            None if asked == Formulation() else asked,
            variables=names_in(self.variables) or None,
            drop_incomplete=self.drop_incomplete,
            decimal=self.decimal,
            thousands=self.thousands,
            encoding=self.encoding,
            skip_rows=skipped,
            sheet=self.sheet,
        )
        units = pairs_in("--units", self.units, "column=unit")
        for name in units:
            known_name("--units", name, table.layout.columns)
        if units:
            layout = replace(table.layout, units={**table.layout.units, **units})
            table = replace(table, layout=layout)
        if asked.page:  # designs that the page's reader has left out by hand
            table = table.rows(kept_designs(table, asked))
        return table


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
        shown += [
            parameter.replace(
                name=f.name,
                annotation=hints[f.name],
                default=f.default,
                kind=parameter.KEYWORD_ONLY,
            )
            for f in fields(group)
        ]

    @functools.wraps(command)
    def ungrouped(**given: Any) -> int:
        for name, group in groups.items():
            given[name] = group(**{field.name: given.pop(field.name) for field in fields(group)})
        return command(**given)

    ungrouped.__signature__ = inspect.Signature(shown)  # type: ignore[attr-defined]
    ungrouped.__annotations__ = {parameter.name: parameter.annotation for parameter in shown}
    return ungrouped
