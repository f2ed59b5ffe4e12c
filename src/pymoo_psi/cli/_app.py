"""The command ``pymoo-psi``: its commands with their options, and how it ends.

A command is a class whose fields are its options, and whose bases are options that several take.
The function that runs it is imported when it is called, and with it NumPy, pymoo and the like: so
``--help`` and the completion of words answer at once.

Exit codes: 0 success, 1 the results are not what they must be, 2 wrong usage or input (one line
says what), 130 interrupted.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from io import StringIO, TextIOWrapper
from pathlib import Path
from typing import Annotated, Any, TypeAlias, TypeVar, get_type_hints

import typer

from pymoo_psi.errors import PsiError

_INTERRUPTED = 130  # 128 and the number of the signal, as shells have it
REPORTED = ("reported",)  # what an interrupt holds of which the user has been told

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

Exit code: 0 success, 1 solve or report found no feasible design, 2 a mistake, reported in one line,
130 interrupted. In a pipe or a file each row of a table is one line, however long, unless COLUMNS
says how wide lines may be.""",
)


def path_in(text: str | Path) -> Path:
    """Return what is typed as a path, ``~`` replaced, which shells leave in ``--out=~/x.csv``."""
    if not os.fspath(text):  # as $FILE gives that is not set; to Path it is "."
        raise typer.BadParameter("a file or folder must have a name, got ''")
    return Path(os.path.expanduser(text))


def _path(metavar: str, help: str, *names: str) -> Any:
    return typer.Option(*names, metavar=metavar, help=help, parser=path_in)


def _option(metavar: str, help: str) -> Any:
    """Return an option, or one that may be given several times where its type is a list."""
    return typer.Option(metavar=metavar, help=help)


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
        "dtlz2 --n-obj 4. Or another program, by a FILE.toml.",
    ),
]
SourceFile: TypeAlias = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="A study, a folder of shares, or a table: CSV or .xlsx.",
        parser=path_in,
    ),
]
Names: TypeAlias = list[str] | None
Text: TypeAlias = str | None
File: TypeAlias = Path | None
Jobs: TypeAlias = Annotated[int, _option("N", "Processes; -1: one per core.")]
Title: TypeAlias = Annotated[str | None, typer.Option(help="Heading [the file's name].")]
Preferences: TypeAlias = Annotated[
    Names,
    _option(
        "P",
        "Show what another preference chooses, too: weights:A=2,B=1, aspire:A=3,B=5, "
        "chebyshev or knee.",
    ),
]


@dataclass(frozen=True, kw_only=True)
class Command:
    """What every command takes that writes."""

    force: Annotated[
        bool, typer.Option("--force", help="Overwrite what this command has not written, too.")
    ] = False


@dataclass(frozen=True, kw_only=True)
class Asked(Command):
    """What is asked of a table: objectives, directions, limits, computed columns."""

    objectives: Annotated[
        Names, _option("A,B,…", "Columns with objectives [f1,f2,… or all numeric].")
    ] = None
    maximize: Annotated[Names, _option("A,…", "Objectives of which more is better.")] = None
    limits: Annotated[
        Names, _option('"A<=2.5,1<=X<=2"', "Limits on any columns of numbers; in quotation marks.")
    ] = None
    compute: Annotated[Names, _option('"NAME=A/B"', "One more column, computed from others.")] = (
        None
    )
    relax: Annotated[Names, _option("G,…", "Constraints that need not hold.")] = None
    formulation: Annotated[
        File,
        _path(
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


@dataclass(frozen=True, kw_only=True)
class Opening(Asked):
    """How a source is opened: what its columns are, and how its numbers are written."""

    variables: Annotated[Names, _option("X,Y,…", "Columns with design variables [x1,x2,…].")] = None
    units: Annotated[Names, _option("A=KG,B=S", "Units of columns.")] = None
    decimal: Annotated[
        Text, _option('"."|","', "Decimal mark of the file [found from its numbers].")
    ] = None
    thousands: Annotated[Text, _option("MARK", "Mark between thousands [as for --decimal].")] = None
    encoding: Annotated[Text, _option("NAME", "Of a text, such as cp1252 [UTF-8].")] = None
    skip_rows: Annotated[
        Text, _option("1,3,…", "Lines to leave out: titles, units; or 'hidden' ones.")
    ] = None
    sheet: Annotated[Text, _option("NAME", "Sheet of a workbook [the only one].")] = None
    drop_incomplete: Annotated[
        bool, typer.Option("--drop-incomplete", help="Leave out designs that lack an objective.")
    ] = False


Kind = TypeVar("Kind")


def _command(
    module: str, *examples: str, more: str = "", of_problem: bool = False
) -> Callable[[type[Kind]], type[Kind]]:
    """Make a class of options a command, run by the function ``run_…`` of a module.

    Its help ends with examples, which can be pasted.
    """
    epilog = "\n  ".join(["\b\nExamples:", *examples]) + (f"\n\n{more}" if more else "")
    # Options that a command of a problem does not know are the problem's.
    settings = {"ignore_unknown_options": True, "allow_extra_args": True} if of_problem else None

    def registered(kind: type[Kind]) -> type[Kind]:
        name, hints = kind.__name__.lower(), get_type_hints(kind, include_extras=True)

        def command(**given: Any) -> int:
            try:
                run = getattr(import_module(f"pymoo_psi.cli.{module}"), f"run_{name}")
                return int(run(kind(**given)))
            except KeyboardInterrupt as stop:
                if stop.args != REPORTED:
                    print_error("pymoo-psi: interrupted; no file is left half-written")
                return _INTERRUPTED

        # Its own options come first in the help, those of its bases behind them.
        fields = [field for each in kind.__mro__ for field in inspect.get_annotations(each)]
        parameters = [
            inspect.Parameter(
                field,
                inspect.Parameter.KEYWORD_ONLY,
                default=getattr(kind, field, inspect.Parameter.empty),
                annotation=hints[field],
            )
            for field in fields
        ]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        command.__annotations__ = {field: hints[field] for field in fields}
        app.command(name, help=kind.__doc__, epilog=epilog, context_settings=settings)(command)
        return kind

    return registered


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
    "_solve",
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi solve bnh --points 256 --limits "f1<=60, x1<=2" --study bnh.db',
    "pymoo-psi solve dtlz2 --n-obj 4 --n-var 7 --algorithm nsga3 --points 500",
    'pymoo-psi solve chute --mu 0.4 --model rolling --box "x1=0.2:0.8, x2=0.1"',
    "pymoo-psi solve --new bracket.toml",
    more=_CHUTE,
    of_problem=True,
)
@dataclass(frozen=True, kw_only=True)
class Solve(Asked):
    """Find the Pareto set of a problem and rank it by efficiency."""

    context: typer.Context
    problem: ProblemName
    algorithm: Annotated[AlgorithmName, typer.Option(help="How to search.")] = AlgorithmName.psi
    points: Annotated[
        int | None,
        _option("N", "Designs to evaluate [4096, of surrogate 256, of a FILE.toml 128]."),
    ] = None
    sampling: Annotated[
        SamplingName, typer.Option(help="Where psi and surrogate take their test points from.")
    ] = SamplingName.lptau
    seed: Annotated[int, _option("S", "Seed; psi by lptau needs none.")] = 1
    jobs: Jobs = 1
    box: Annotated[
        Names, _option('"X=1:2,Y=3"', "Narrower bounds of variables, or a fixed value.")
    ] = None
    log: Annotated[Names, _option("X,…", "Variables of logarithmic scale.")] = None
    fill: Annotated[
        bool, typer.Option("--fill", help="Count only points that meet the requirements.")
    ] = False
    timeout: Annotated[
        float | None,
        _option("S", "Seconds a design may take; then it has failed."),
    ] = None
    study: Annotated[File, _path("FILE.db", "Keep every test here; a run continues it.")] = None
    share: Annotated[
        Text,
        _option("K/N", "Test the K-th of N parts; --study is their folder."),
    ] = None
    study_key: Annotated[
        Text,
        _option("K", "What else the study depends on: the model's version."),
    ] = None
    retry: Annotated[
        Text,
        _option("failed|1,2", "Test failed designs of the study once more."),
    ] = None
    out: Annotated[File, _path("FILE.csv", "Write the Pareto set here.")] = None
    new: Annotated[
        bool, typer.Option("--new", help="Write an example of a FILE.toml, to be edited.")
    ] = False
    trial: Annotated[
        bool, typer.Option("--try", help="Run the program of a FILE.toml once, and show all of it.")
    ] = False


@_command(
    "_rank",
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi rank front.csv --limits "f1<=60" --prefer knee --out ranked.csv',
    "pymoo-psi rank front.csv --objectives f1,f2 --maximize f2 --top 3",
    more="""In a list, a name with a comma stands in quotation marks: --objectives
'"time, s",mass'.""",
)
@dataclass(frozen=True, kw_only=True)
class Rank(Opening):
    """Rank the designs of any Pareto set by efficiency."""

    file: SourceFile
    out: Annotated[File, _path("FILE", "Write all designs, .csv, .xlsx or .json.")] = None
    figure: Annotated[File, _path("FILE", "Draw the Pareto set by rank, .png, .pdf or .svg.")] = (
        None
    )
    top: Annotated[int, _option("N", "Designs to print.")] = 12
    prefer: Preferences = None
    representatives: Annotated[int | None, _option("K", "Print K designs that stand for all.")] = (
        None
    )


@_command(
    "_documents",
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi page front.csv --units f1=kg --limits "f1<=60"',
)
@dataclass(frozen=True, kw_only=True)
class Page(Opening):
    """Make a page to decide on a Pareto set: one file, works offline."""

    file: SourceFile
    title: Title = None
    prototype: Annotated[File, _path("FILE", "Existing designs to compare with.")] = None
    out: Annotated[Path, _path("FILE.html", "Write the page here.")] = Path("page.html")


@_command(
    "_documents",
    "pymoo-psi solve bnh --points 256 --study bnh.db",
    'pymoo-psi report bnh.db --limits "f1<=60" --units f1=kg --prefer knee',
)
@dataclass(frozen=True, kw_only=True)
class Report(Opening):
    """Report on tests and the choice: one file to read and print."""

    file: SourceFile
    title: Title = None
    prefer: Preferences = None
    design: Annotated[
        int | None,
        _option("N", "Test point, or row, that is chosen [the optimum]."),
    ] = None
    out: Annotated[Path, _path("FILE.html", "Write the report here.")] = Path("report.html")


@_command(
    "_documents",
    "pymoo-psi solve bnh --points 256 --study bnh.db",
    'pymoo-psi analyze bnh.db --limits "f1<=60" --out analysis',
)
@dataclass(frozen=True, kw_only=True)
class Analyze(Opening):
    """Say which variables matter, what is feasible, if tests suffice."""

    file: SourceFile
    out: Annotated[File, _path("DIR", "Folder for tables (CSV) and pictures (PNG).")] = None


@_command(
    "_experiments",
    "pymoo-psi compare bnh --evaluations 64,128 --seeds 2",
    "pymoo-psi compare dtlz2 --n-obj 4 --evaluations 64 --seeds 2 --out four",
    more=_CHUTE,
    of_problem=True,
)
@dataclass(frozen=True, kw_only=True)
class Compare(Command):
    """Compare PSI with NSGA-III and others at equal cost."""

    context: typer.Context
    problem: ProblemName
    evaluations: Annotated[
        Text, _option("N,N,…", "Numbers of evaluations [256,1024,4096, of surrogate 64,128,256].")
    ] = None
    seeds: Annotated[int, _option("N", "Runs of each that draws at random.")] = 11
    algorithms: Annotated[
        str,
        _option("A,B,…", "Of psi, psi-scrambled, surrogate, nsga3, psi+nsga3, nsga2, moead, …."),
    ] = "psi,psi-scrambled,nsga3,psi+nsga3"
    jobs: Annotated[int, _option("N", "Runs at a time; -1: one per core.")] = 1
    out: Annotated[
        File,
        _path("DIR", "Write tables, figures, runs here; a later call goes on from them."),
    ] = None


@_command(
    "_documents",
    "pymoo-psi solve bnh --points 64 --study parts --share 1/2",
    "pymoo-psi solve bnh --points 64 --study parts --share 2/2",
    "pymoo-psi export parts --out whole.db",
    'pymoo-psi solve bnh --points 64 --study part.db --box "x1=0:2"',
    "pymoo-psi export whole=whole.db part=part.db --out both.csv",
)
@dataclass(frozen=True, kw_only=True)
class Export(Opening):
    """Write tests as one table for other programs, or as one study."""

    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="[NAME=]SOURCE…",
            help="Tests of one problem: studies, folders of shares, tables. With a name they are "
            "experiments of other bounds or samplings.",
        ),
    ]
    out: Annotated[Path, _path("FILE", "Write here, .csv, .xlsx, or .db, a study to continue.")]


@_command(
    "_experiments",
    "pymoo-psi reproduce",
    "pymoo-psi reproduce --mu 0.3 --model full --points 1024 --out mu03",
)
@dataclass(frozen=True, kw_only=True)
class Reproduce(Command):
    """Compute the tables of the chute's paper, and compare with them."""

    out: Annotated[Path, _path("DIR", "Folder for tables (CSV) and figures.")] = Path(
        "reproduction"
    )
    points: Annotated[int, _option("Q", "Test points per case.")] = 4096
    mu: Annotated[
        list[float] | None,
        _option("MU", "Friction coefficient, may be repeated [0.2, 0.4, 0.6]."),
    ] = None
    model: Annotated[ModelName | None, typer.Option(help="The motion [both].")] = None
    jobs: Jobs = 1
    figures: Annotated[FigureFormat, typer.Option(help="Format of the figures.")] = FigureFormat.png


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
        return _INTERRUPTED
    if message is not None:
        # A message of pymoo or of a user's model may have several lines; scripts count on one.
        print_error(f"pymoo-psi: error: {' '.join(message.split())}")
        return 2
    return code if isinstance(code, int) else 0


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: object
) -> None:
    """Show a warning of this package in one line; those of a user's model as Python does."""
    if category is UserWarning:
        print_error(f"pymoo-psi: warning: {message}")
    else:
        print_error(warnings.formatwarning(message, category, filename, lineno).rstrip())


def printable(text: str) -> str:
    """Return a text without the characters that steer a terminal: it may be untrusted input."""
    return re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", "?", text)


def print_error(line: str) -> None:
    """Print a line on standard error, or nothing where that cannot be written to."""
    try:
        print(printable(line), file=sys.stderr, flush=True)
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
