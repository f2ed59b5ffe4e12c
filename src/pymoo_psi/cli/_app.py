"""The command ``pymoo-psi``: its commands with their options, and how it ends.

A command here only collects what was typed and hands it to the function that runs it. That
function is imported when it is called, and with it NumPy, pymoo and the like: so ``--help`` and the
completion of words answer at once.

Exit codes: 0 success, 1 the results are not what they must be, 2 wrong usage or input (one line
says what), 130 interrupted.
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from enum import Enum
from io import StringIO, TextIOWrapper
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import typer

from pymoo_psi.cli._options import (
    Asked,
    Jobs,
    Opening,
    Overwrite,
    Preferences,
    Source,
    grouped,
    option,
    path_option,
)
from pymoo_psi.errors import PsiError

_INTERRUPTED = 130  # 128 and the number of the signal, as shells have it

# The base of all usage errors of the click that typer carries or depends on. An installed click's
# own class would catch none of those of a typer that carries a copy.
_ClickException: Any = typer.BadParameter.__mro__[2]

app = typer.Typer(
    name="pymoo-psi",
    rich_markup_mode=None,  # plain help: frames cost width, and rich its import
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  pymoo-psi solve chute --points 1024 --out front.csv
  pymoo-psi rank front.csv --top 3
  pymoo-psi page front.csv

Exit code: 0 success, 1 solve or report found no feasible design, or the paper is not matched, 2 a
mistake, reported in one line, 130 interrupted. In a pipe or a file each row of a table is one line,
however long, unless COLUMNS says how wide lines may be.""",
)


# An option's choices are an enumeration to typer (literals only since 0.19, StrEnum is of Python
# 3.11 on). They repeat names of the library, as its import would keep --help waiting.
AlgorithmName = Enum(
    "AlgorithmName", {"psi": "psi", "surrogate": "surrogate", "nsga3": "nsga3"}, type=str
)
SamplingName = Enum(
    "SamplingName", {"lptau": "lptau", "sobol": "sobol", "halton": "halton", "lhs": "lhs"}, type=str
)
ModelName = Enum("ModelName", {"full": "full", "rolling": "rolling"}, type=str)
FigureFormat = Enum("FigureFormat", {"png": "png", "pdf": "pdf", "svg": "svg"}, type=str)

ProblemName: TypeAlias = Annotated[
    str,
    typer.Argument(
        metavar="PROBLEM",
        help="'chute', a test problem of pymoo such as bnh, or your own as module:attribute, "
        "beam:Beam for the class Beam in beam.py. Its arguments are options behind it: "
        "dtlz2 --n-obj 4.",
    ),
]
Title: TypeAlias = Annotated[str | None, typer.Option(help="Heading [the file's name].")]


def _command(
    *examples: str, more: str = "", of_problem: bool = False
) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Make a function a command whose help ends with examples, which can be pasted."""
    epilog = "\n  ".join(["\b\nExamples:", *examples]) + (f"\n\n{more}" if more else "")
    # Options that a command of a problem does not know are the problem's.
    settings = {"ignore_unknown_options": True, "allow_extra_args": True} if of_problem else None
    return lambda function: app.command(epilog=epilog, context_settings=settings)(grouped(function))


@app.callback()
def _about(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=lambda asked: _print_version() if asked else None,
            is_eager=True,
            help="Print the version and exit.",
        ),
    ] = False,
) -> None:
    """Parameter Space Investigation and decision-making on Pareto sets, for pymoo."""


def _print_version() -> None:
    from importlib.metadata import version

    print(f"pymoo-psi {version('pymoo-psi')}")
    raise typer.Exit


_CHUTE = (
    "Of the chute x1 is the slope tan α, x2 the speed of the floor; f1 the time, f2 the energy "
    "balance, f3 = x1, f4 = x2. "
    "Its arguments: --mu 0.2, --c 0.3193 (speed over √(gL)), --r 0.1 (over L), "
    "--model full or rolling."
)


@_command(
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi solve bnh --points 256 --limits "f1<=60, x1<=2" --study bnh.db',
    "pymoo-psi solve dtlz2 --n-obj 4 --n-var 7 --algorithm nsga3 --points 500",
    'pymoo-psi solve chute --mu 0.4 --model rolling --box "x1=0.2:0.8, x2=0.1"',
    more=_CHUTE,
    of_problem=True,
)
def solve(
    context: typer.Context,
    problem: ProblemName,
    *,
    algorithm: Annotated[AlgorithmName, typer.Option(help="How to search.")] = AlgorithmName.psi,
    points: Annotated[
        int | None,
        typer.Option(metavar="N", help="Designs to evaluate [4096, of surrogate 256]."),
    ] = None,
    sampling: Annotated[
        SamplingName, typer.Option(help="Where psi and surrogate take their test points from.")
    ] = SamplingName.lptau,
    seed: Annotated[int, typer.Option(metavar="S", help="Seed; psi by lptau needs none.")] = 1,
    jobs: Jobs = 1,
    asked: Asked,
    box: Annotated[
        list[str] | None, option('"X=1:2,Y=3"', "Narrower bounds of variables, or a fixed value.")
    ] = None,
    timeout: Annotated[
        float | None,
        typer.Option(metavar="S", help="Seconds a design may take; then it has failed."),
    ] = None,
    study: Annotated[
        Path | None, path_option("FILE.db", "Keep every test here; a run continues it.")
    ] = None,
    share: Annotated[
        str | None,
        typer.Option(metavar="K/N", help="Test the K-th of N parts; --study is their folder."),
    ] = None,
    study_key: Annotated[
        str | None,
        typer.Option(metavar="K", help="What else the study depends on: the model's version."),
    ] = None,
    retry: Annotated[
        str | None,
        typer.Option(metavar="failed|1,2", help="Test failed designs of the study once more."),
    ] = None,
    out: Annotated[Path | None, path_option("FILE.csv", "Write the Pareto set here.")] = None,
    force: Overwrite = False,
) -> int:
    """Find the Pareto set of a problem and rank it by efficiency."""
    from pymoo_psi.cli._problem import load_problem
    from pymoo_psi.cli._solve import Search, run_solve

    if points is None:
        points = 256 if algorithm is AlgorithmName.surrogate else 4096
    search = Search(
        algorithm.value, points, sampling.value, seed, jobs, study, study_key, share, retry
    )
    search.run_options(asked)  # wrong ones are refused before a model is imported
    wanted = load_problem(problem, context, jobs, timeout, box)
    return run_solve(wanted, search, asked, out, force=force)


@_command(
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi rank front.csv --limits "f1<=60" --prefer knee --out ranked.csv',
    "pymoo-psi rank front.csv --objectives f1,f2 --maximize f2 --top 3",
    more="""In a list, a name with a comma stands in quotation marks: --objectives
'"time, s",mass'.""",
)
def rank(
    file: Source,
    asked: Asked,
    opening: Opening,
    out: Annotated[Path | None, path_option("FILE", "Write all designs, .csv or .json.")] = None,
    figure: Annotated[
        Path | None, path_option("FILE", "Draw the Pareto set by rank, .png, .pdf or .svg.")
    ] = None,
    force: Overwrite = False,
    top: Annotated[int, typer.Option(metavar="N", help="Designs to print.")] = 12,
    prefer: Preferences = None,
    representatives: Annotated[
        int | None, typer.Option(metavar="K", help="Print K designs that stand for all.")
    ] = None,
) -> int:
    """Rank the designs of any Pareto set by efficiency."""
    from pymoo_psi.cli._rank import run_rank

    return run_rank(
        file, asked, opening,
        prefer=prefer, n_representatives=representatives, out=out, figure=figure, force=force,
        top=top,
    )  # fmt: skip


@_command(
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi page front.csv --units f1=kg --limits "f1<=60"',
)
def page(
    file: Source,
    asked: Asked,
    opening: Opening,
    title: Title = None,
    prototype: Annotated[
        Path | None, path_option("FILE", "Existing designs to compare with.")
    ] = None,
    out: Annotated[Path, path_option("FILE.html", "Write the page here.")] = Path("page.html"),
    force: Overwrite = False,
) -> int:
    """Make a page to decide on a Pareto set: one file, works offline."""
    from pymoo_psi.cli._documents import run_page

    return run_page(file, asked, opening, prototype=prototype, title=title, out=out, force=force)


@_command(
    "pymoo-psi solve bnh --points 256 --study bnh.db",
    'pymoo-psi report bnh.db --limits "f1<=60" --units f1=kg --prefer knee',
)
def report(
    file: Source,
    asked: Asked,
    opening: Opening,
    title: Title = None,
    prefer: Preferences = None,
    design: Annotated[
        int | None,
        typer.Option(metavar="N", help="Test point, or row, that is chosen [the optimum]."),
    ] = None,
    out: Annotated[Path, path_option("FILE.html", "Write the report here.")] = Path("report.html"),
    force: Overwrite = False,
) -> int:
    """Report on tests and the choice: one file to read and print."""
    from pymoo_psi.cli._documents import run_report

    return run_report(
        file, asked, opening, prefer=prefer, design=design, title=title, out=out, force=force
    )


@_command(
    "pymoo-psi solve bnh --points 256 --study bnh.db",
    'pymoo-psi analyze bnh.db --limits "f1<=60" --out analysis',
)
def analyze(
    file: Source,
    asked: Asked,
    opening: Opening,
    out: Annotated[
        Path | None, path_option("DIR", "Folder for tables (CSV) and pictures (PNG).")
    ] = None,
    force: Overwrite = False,
) -> int:
    """Say which variables matter, what is feasible, if tests suffice."""
    from pymoo_psi.cli._documents import run_analyze

    return run_analyze(file, asked, opening, out, force=force)


@_command(
    "pymoo-psi compare bnh --evaluations 64,128 --seeds 2",
    "pymoo-psi compare dtlz2 --n-obj 4 --evaluations 64 --seeds 2 --out four",
    more=_CHUTE,
    of_problem=True,
)
def compare(
    context: typer.Context,
    problem: ProblemName,
    evaluations: Annotated[
        str | None,
        typer.Option(
            metavar="N,N,…",
            help="Numbers of evaluations; 256,1024,4096, with surrogates 64,128,256.",
        ),
    ] = None,
    seeds: Annotated[
        int, typer.Option(metavar="N", help="Runs of each that draws at random.")
    ] = 11,
    algorithms: Annotated[
        str,
        typer.Option(
            metavar="A,B,…",
            help="Of psi, psi-scrambled, surrogate, nsga3, psi+nsga3, nsga2, moead, ….",
        ),
    ] = "psi,psi-scrambled,nsga3,psi+nsga3",
    reference: Annotated[
        Path | None, path_option("FILE.npz", "Measure against the reference of another comparison.")
    ] = None,
    jobs: Annotated[int, typer.Option(metavar="N", help="Runs at a time; -1: one per core.")] = 1,
    out: Annotated[
        Path | None,
        path_option("DIR", "Write tables, figures, runs here; a later call goes on from them."),
    ] = None,
    force: Overwrite = False,
) -> int:
    """Compare PSI with NSGA-III and others at equal cost."""
    from pymoo_psi.cli._experiments import run_compare
    from pymoo_psi.cli._problem import load_problem

    return run_compare(
        load_problem(problem, context), evaluations, seeds, algorithms,
        reference=reference, jobs=jobs, out=out, force=force,
    )  # fmt: skip


@_command(
    "pymoo-psi solve bnh --points 64 --study parts --share 1/2",
    "pymoo-psi solve bnh --points 64 --study parts --share 2/2",
    "pymoo-psi export parts --out whole.db",
    'pymoo-psi solve bnh --points 64 --study part.db --box "x1=0:2"',
    "pymoo-psi export whole=whole.db part=part.db --out both.csv",
)
def export(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="[NAME=]SOURCE…",
            help="Tests of one problem: studies, folders of shares, tables. With a name they are "
            "experiments of other bounds or samplings.",
        ),
    ],
    asked: Asked,
    opening: Opening,
    out: Annotated[
        Path, path_option("FILE", "Write here, .csv, .parquet, or .db, a study to continue.")
    ],
    force: Overwrite = False,
) -> int:
    """Write tests as one table for other programs, or as one study."""
    from pymoo_psi.cli._documents import run_export

    return run_export(sources, asked, opening, out, force=force)


@_command(
    "pymoo-psi reproduce",
    "pymoo-psi reproduce --mu 0.3 --model full --points 1024 --out mu03",
)
def reproduce(
    out: Annotated[Path, path_option("DIR", "Folder for tables (CSV) and figures.")] = Path(
        "reproduction"
    ),
    points: Annotated[int, typer.Option(metavar="Q", help="Test points per case.")] = 4096,
    mu: Annotated[
        list[float] | None,
        typer.Option(metavar="MU", help="Friction coefficient, may be repeated [0.2, 0.4, 0.6]."),
    ] = None,
    c: Annotated[
        float, typer.Option(metavar="C", help="Initial speed over √(gL), of 1 m/s for L = 1 m.")
    ] = 0.3193,
    r: Annotated[float, typer.Option(metavar="R", help="Radius over L, the horizontal way.")] = 0.1,
    model: Annotated[ModelName | None, typer.Option(help="The motion [both].")] = None,
    jobs: Jobs = 1,
    figures: Annotated[
        FigureFormat, typer.Option(help="Format of the figures.")
    ] = FigureFormat.png,
    force: Overwrite = False,
) -> int:
    """Compute the tables of the chute's paper, and compare with them."""
    from pymoo_psi.cli._experiments import run_reproduce

    models = [each.value for each in ModelName if model in (None, each)]
    return run_reproduce(
        out, points, jobs, figures.value, mu=mu or (), c=c, r=r, models=models, force=force
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code, and never a traceback for a user's mistake.

    Args:
        arguments: The words after ``pymoo-psi``; those of the process by default.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # what a terminal cannot show becomes "?"
            stream.reconfigure(errors="replace")
    words = list(sys.argv[1:] if arguments is None else arguments)
    message = None
    try:
        # No words are a mistake to typer, code 2; here they ask for help, code 0. The name is given
        # for 'python -m pymoo_psi', whose help would show another one.
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning  # type: ignore[assignment]
            code = app(args=words or ["--help"], standalone_mode=False, prog_name="pymoo-psi")
    except PsiError as error:  # before OSError, which StudyAccessError is too
        message = str(error)
    except _ClickException as error:
        message = error.format_message()
    except SystemExit as end:
        if not isinstance(end.__context__, BrokenPipeError):
            raise
        return 0  # nobody reads the help to its end
    except OSError as error:
        message = f"{error.filename or 'file'}: {error.strerror or error}"
    except MemoryError:
        message = "out of memory; reduce --points"
    except (KeyboardInterrupt, typer.Abort):
        code = _INTERRUPTED
    if message is not None:
        # A message of pymoo or of a user's model may have several lines; scripts count on one.
        _print_error(f"pymoo-psi: error: {' '.join(message.split())}")
        return 2
    if code == _INTERRUPTED:  # which later versions of typer return
        _print_error("pymoo-psi: interrupted")
    return code if isinstance(code, int) else 0


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: object
) -> None:
    """Show a warning of this package in one line; those of a user's model as Python does."""
    if category is UserWarning:
        _print_error(f"pymoo-psi: warning: {message}")
    else:
        _print_error(warnings.formatwarning(message, category, filename, lineno).rstrip())


def _print_error(line: str) -> None:
    # What steers a terminal may come out of untrusted input.
    shown = re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", "?", line)
    try:
        print(shown, file=sys.stderr, flush=True)
    except OSError:  # then the code says it; Python would try again at its end, and exit with 120
        sys.stderr = None


def run() -> None:
    """Entry point of the console script."""
    # A stream that the shell has closed is None, which nothing can be written to.
    sys.stdout, sys.stderr = sys.stdout or StringIO(), sys.stderr or StringIO()
    code = main()
    try:
        sys.stdout.flush()
    except OSError:  # or Python would complain, and change the code, when it ends
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)
