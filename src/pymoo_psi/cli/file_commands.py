"""The commands that take the designs of a file, and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["export", "page", "rank"]


def export(
    study: Annotated[Path, typer.Argument(metavar="STUDY.db", help="A study of 'solve'.")],
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="Write here, .csv or .parquet.")],
) -> int:
    """Write all tests of a study as a table for other programs."""
    from pymoo_psi.cli.export import run_export

    return run_export(study, out)


def rank(
    file: Annotated[
        Path, typer.Argument(help="A CSV of designs, a test table, a study, or a ranking.")
    ],
    objectives: Annotated[
        list[str] | None,
        typer.Option(metavar="A,B,…", help="Columns with objectives [f1,f2,… or all numeric]."),
    ] = None,
    maximize: Annotated[
        list[str] | None, typer.Option(metavar="A,…", help="Objectives to be maximised.")
    ] = None,
    no_normalize: Annotated[
        bool, typer.Option("--no-normalize", help="Plain distances, not in units of the ranges.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write all designs, .csv or .json.")
    ] = None,
    top: Annotated[int, typer.Option(metavar="N", help="Designs to print.")] = 12,
) -> int:
    """Rank the designs of any Pareto set by efficiency."""
    from pymoo_psi.cli.rank import run_rank

    return run_rank(file, objectives or [], maximize or [], not no_normalize, out, top)


def page(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A CSV of designs, a test table, or a study.")
    ],
    out: Annotated[Path, typer.Option(metavar="FILE.html", help="Write the page here.")] = Path(
        "page.html"
    ),
    objectives: Annotated[
        str | None,
        typer.Option(metavar="A,B,C", help="Columns with criteria [f1,f2,… or all numeric ones]."),
    ] = None,
    variables: Annotated[
        str | None, typer.Option(metavar="X,Y", help="Columns with design variables [x1,x2,…].")
    ] = None,
    maximize: Annotated[
        str | None, typer.Option(metavar="B", help="Objectives of which more is better.")
    ] = None,
    units: Annotated[str | None, typer.Option(metavar="A=KG,B=S", help="Units of columns.")] = None,
    prototype: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Existing designs to compare with.")
    ] = None,
    no_normalize: Annotated[
        bool, typer.Option("--no-normalize", help="Plain distances, not in units of the ranges.")
    ] = False,
    limits: Annotated[
        str | None,
        typer.Option(metavar="A=2.5,B>=1", help="Limits that are set when the page opens."),
    ] = None,
    title: Annotated[str | None, typer.Option(help="Heading [the file's name].")] = None,
) -> int:
    """Make a page to decide on a Pareto set with: one HTML file that works offline."""
    from pymoo_psi.cli.page import run_page

    return run_page(
        file, out, objectives=objectives, variables=variables, maximize=maximize, units=units,
        prototype=prototype, normalize=not no_normalize, limits=limits, title=title,
    )  # fmt: skip
