"""The command ``pymoo-psi``: its commands with their options, and how it ends.

A command here only collects what was typed and hands it to the function that runs it. That
function is imported when it is called, and with it NumPy, pymoo and the like: so ``--help`` and the
completion of words answer at once.

Exit codes: 0 success, 1 the results are not what they must be, 2 wrong usage or input (one line
says what), 130 interrupted.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence
from enum import Enum
from io import StringIO, TextIOWrapper
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, TextIO, TypeAlias

import typer

from pymoo_psi.errors import PsiError

_INTERRUPTED = 130  # 128 and the number of the signal, as shells have it

# The base of all usage errors of the click that typer carries or depends on. An installed click's
# own class would catch none of those of a typer that carries a copy.
_ClickException: Any = typer.BadParameter.__mro__[2]

app = typer.Typer(
    name="pymoo-psi",
    rich_markup_mode=None,  # plain help: frames cost width, and rich its import
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _expanded(path: Path | None) -> Path | None:
    """Replace ``~``, which shells leave as it is in ``--out=~/front.csv``."""
    return path and Path(os.path.expanduser(path))


def _path(metavar: str, help: str) -> Any:
    """Return an option that takes a path."""
    return typer.Option(metavar=metavar, help=help, callback=_expanded)


# An option's choices are an enumeration to typer (StrEnum is of Python 3.11 on). They repeat names
# of the library, as its import would keep --help waiting.
class AlgorithmName(str, Enum):
    """The algorithms of ``solve``."""

    psi = "psi"
    surrogate = "surrogate"
    nsga3 = "nsga3"


class ModelName(str, Enum):
    """The models of the chute."""

    full = "full"
    rolling = "rolling"


class FigureFormat(str, Enum):
    """The formats of ``reproduce``'s figures."""

    png = "png"
    pdf = "pdf"
    svg = "svg"


class AssessedName(str, Enum):
    """What ``compare`` measures of a run."""

    evaluated = "evaluated"
    returned = "returned"


# Options of several commands. Those with a list may be given several times. Those of the chute are
# None unless given: with another problem they are refused, and the chute alone has the defaults.
ProblemName: TypeAlias = Annotated[
    str, typer.Argument(help="'chute', the name of a pymoo test problem, or module:attribute.")
]
Friction: TypeAlias = Annotated[
    float | None, typer.Option(help="chute: friction coefficient [0.2].")
]
Speed: TypeAlias = Annotated[float | None, typer.Option(help="chute: initial speed [0.3193].")]
Radius: TypeAlias = Annotated[float | None, typer.Option(help="chute: radius [0.1].")]
Model: TypeAlias = Annotated[ModelName | None, typer.Option(help="chute: the motion [full].")]
Jobs: TypeAlias = Annotated[int, typer.Option(metavar="N", help="Processes; -1: one per core.")]
Designs: TypeAlias = Annotated[
    Path,
    typer.Argument(
        help="A CSV of designs, a test table, a study, or a ranking.", callback=_expanded
    ),
]
Objectives: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(metavar="A,B,…", help="Columns with objectives [f1,f2,… or all numeric]."),
]
Variables: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(metavar="X,Y,…", help="Columns with design variables [x1,x2,…]."),
]
Maximize: TypeAlias = Annotated[
    list[str] | None, typer.Option(metavar="A,…", help="Objectives of which more is better.")
]
Limits: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(metavar="A<=2.5,1<=X<=2", help="Limits on criteria, variables, outputs."),
]
FormulationFile: TypeAlias = Annotated[
    Path | None,
    _path("FILE.json", "Criteria, senses, limits, computed columns, of Formulation.to_json."),
]
Criteria: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--criterion", metavar="NAME[=A/B]", help="A criterion more: a column, or an expression."
    ),
]
Relaxed: TypeAlias = Annotated[
    list[str] | None, typer.Option(metavar="G,…", help="Constraints to leave out.")
]
Units: TypeAlias = Annotated[
    list[str] | None, typer.Option(metavar="A=KG,B=S", help="Units of columns.")
]
Preferences: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        metavar="P",
        help="weights:A=2,B=1, aspire:A=3,B=5, order:B,A, chebyshev, knee or tradeoff.",
    ),
]
DecimalMark: TypeAlias = Annotated[
    str | None, typer.Option(metavar=".|,", help="Decimal mark of the file [as its numbers tell].")
]
ThousandsMark: TypeAlias = Annotated[
    str | None, typer.Option(metavar=".|,|'", help="Mark between thousands, likewise.")
]
Encoding: TypeAlias = Annotated[
    str | None, typer.Option(metavar="NAME", help="Of the file, such as cp1252 [UTF-8].")
]
SkippedRows: TypeAlias = Annotated[
    str | None, typer.Option(metavar="1,3,…", help="Lines of the file to leave out: titles, units.")
]
DropIncomplete: TypeAlias = Annotated[
    bool, typer.Option("--drop-incomplete", help="Leave out designs that lack an objective.")
]
PlainDistances: TypeAlias = Annotated[
    bool, typer.Option("--no-normalize", help="Plain distances, not in units of the ranges.")
]


@app.callback()
def _command(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=lambda asked: _print_version() if asked else None,
            is_eager=True,
            help="Print it, exit.",
        ),
    ] = False,
) -> None:
    """Parameter Space Investigation and decision-making on Pareto sets, for pymoo."""


def _print_version() -> None:
    from importlib.metadata import version

    print(f"pymoo-psi {version('pymoo-psi')}")
    raise typer.Exit


@app.command()
def reproduce(
    out: Annotated[Path, _path("DIR", "Folder for tables (CSV) and figures.")] = Path(
        "reproduction"
    ),
    points: Annotated[int, typer.Option(metavar="Q", help="Test points per case.")] = 4096,
    jobs: Jobs = 1,
    figures: Annotated[
        FigureFormat, typer.Option(help="Format of the figures.")
    ] = FigureFormat.png,
) -> int:
    """Compute the paper's tables under both models, beside the printed values."""
    from pymoo_psi.cli._reproduce import run_reproduce

    return run_reproduce(out, points, jobs, figures.value)


@app.command()
def solve(
    problem: ProblemName,
    algorithm: Annotated[AlgorithmName, typer.Option(help="How to search.")] = AlgorithmName.psi,
    points: Annotated[
        int | None,
        typer.Option(metavar="N", help="Designs to evaluate: 4096, of surrogate 256."),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="S", help="Seed; psi needs none.")] = 1,
    jobs: Jobs = 1,
    limits: Limits = None,
    formulation: FormulationFile = None,
    criterion: Criteria = None,
    maximize: Maximize = None,
    relax: Relaxed = None,
    box: Annotated[
        list[str] | None,
        typer.Option(metavar="X=1:2,Y=3", help="Part of the box: bounds, or the value to fix at."),
    ] = None,
    timeout: Annotated[
        float | None,
        typer.Option(metavar="S", help="Seconds a design may take; then it has failed."),
    ] = None,
    study: Annotated[
        Path | None,
        _path("FILE.db", "Store every design here; continues."),
    ] = None,
    share: Annotated[
        str | None,
        typer.Option(metavar="K/N", help="Test the K-th of N parts; --study is their folder."),
    ] = None,
    study_key: Annotated[
        str | None, typer.Option(metavar="K", help="What else the study depends on: a version.")
    ] = None,
    retry: Annotated[
        str | None,
        typer.Option(metavar="failed|1,2", help="Test failed designs of the study once more."),
    ] = None,
    no_normalize: PlainDistances = False,
    out: Annotated[
        Path | None,
        _path("FILE.csv", "Write the Pareto set here."),
    ] = None,
    mu: Friction = None,
    c: Speed = None,
    r: Radius = None,
    model: Model = None,
) -> int:
    """Find the Pareto set of a problem and rank it by efficiency."""
    from pymoo_psi.cli._options import ColumnOptions
    from pymoo_psi.cli._problem import load_problem
    from pymoo_psi.cli._solve import Search, run_solve

    # A wrong option is told before a model is imported, which may take its time.
    if points is None:
        points = 256 if algorithm is AlgorithmName.surrogate else 4096
    columns = ColumnOptions(
        maximize=maximize or (), limits=limits or (), formulation=formulation,
        criteria=criterion or (), relax=relax or (),
    )  # fmt: skip
    search = Search(algorithm.value, points, seed, columns, study, study_key, retry, share, jobs)
    wanted = load_problem(problem, _chute(mu, c, r, model), jobs, timeout, box or ())
    return run_solve(wanted, search, out, normalize=not no_normalize)


@app.command()
def compare(
    problem: ProblemName,
    evaluations: Annotated[
        str, typer.Option(metavar="N,N,…", help="Numbers of evaluations.")
    ] = "256,1024,4096",
    seeds: Annotated[int, typer.Option(metavar="N", help="Runs of an algorithm by chance.")] = 11,
    algorithms: Annotated[
        str,
        typer.Option(
            metavar="A,B,…",
            help="Of psi, psi-scrambled, surrogate, nsga3, psi+nsga3, nsga2, moead, ….",
        ),
    ] = "psi,psi-scrambled,nsga3,psi+nsga3",
    assess: Annotated[
        AssessedName, typer.Option(help="Measure all that was evaluated, or what was returned.")
    ] = AssessedName.evaluated,
    reference: Annotated[
        Path | None,
        _path("FILE.npz", "Measure against the reference of another study."),
    ] = None,
    jobs: Annotated[int, typer.Option(metavar="N", help="Runs at a time; -1: one per core.")] = 1,
    out: Annotated[
        Path | None,
        _path("DIR", "Write tables, figures and runs here; continues."),
    ] = None,
    mu: Friction = None,
    c: Speed = None,
    r: Radius = None,
    model: Model = None,
) -> int:
    """Compare PSI with NSGA-III and others on a problem at equal numbers of evaluations."""
    from pymoo_psi.cli._compare import run_compare
    from pymoo_psi.cli._problem import load_problem

    return run_compare(
        load_problem(problem, _chute(mu, c, r, model)), evaluations, seeds, algorithms,
        assess=assess.value, reference=reference, jobs=jobs, out=out,
    )  # fmt: skip


@app.command()
def export(
    study: Annotated[
        Path,
        typer.Argument(
            metavar="STUDY", help="A study of 'solve', or a folder.", callback=_expanded
        ),
    ],
    out: Annotated[
        Path,
        _path("FILE.csv", "Write here, .csv or .parquet."),
    ],
) -> int:
    """Write all tests of a study as a table for other programs."""
    from pymoo_psi.cli._solve import run_export

    return run_export(study, out)


@app.command()
def merge(
    inputs: Annotated[
        list[Path],
        typer.Argument(
            metavar="STUDY|FOLDER|CSV…", help="Studies, folders of shares, test tables."
        ),
    ],
    out: Annotated[Path, _path("FILE.db", "Write here, a new file.")],
) -> int:
    """Make one study of the tests of several, which 'solve --study' continues."""
    from pymoo_psi.cli._merge import run_merge

    return run_merge(inputs, out)


@app.command()
def analyze(
    tests: Annotated[
        Path,
        typer.Argument(
            metavar="TESTS",
            help="A study of 'solve', or all its tests as 'export' writes them.",
            callback=_expanded,
        ),
    ],
    limits: Limits = None,
    formulation: FormulationFile = None,
    criterion: Criteria = None,
    out: Annotated[
        Path | None,
        _path("DIR", "Folder for tables (CSV) and pictures (PNG)."),
    ] = None,
) -> int:
    """Tell what drives the criteria, where designs are feasible, and whether tests suffice."""
    from pymoo_psi.cli._analyze import run_analyze
    from pymoo_psi.cli._options import ColumnOptions

    columns = ColumnOptions(limits=limits or (), formulation=formulation, criteria=criterion or ())
    return run_analyze(tests, columns, out)


@app.command()
def combine(
    experiments: Annotated[
        list[str],
        typer.Argument(metavar="[NAME=]FILE…", help="Studies or tables of tests of one problem."),
    ],
    out: Annotated[
        Path,
        _path("FILE.csv", "Write here, .csv or .parquet."),
    ],
) -> int:
    """Join the tests of experiments with other boxes, sequences or methods in one table."""
    from pymoo_psi.cli._merge import run_combine

    return run_combine(experiments, out)


@app.command()
def rank(
    file: Designs,
    objectives: Objectives = None,
    maximize: Maximize = None,
    limits: Limits = None,
    formulation: FormulationFile = None,
    criterion: Criteria = None,
    relax: Relaxed = None,
    no_normalize: PlainDistances = False,
    out: Annotated[
        Path | None,
        _path("FILE", "Write all designs, .csv or .json."),
    ] = None,
    figure: Annotated[
        Path | None,
        _path("FILE", "Draw the Pareto set by rank, .png, .pdf or .svg."),
    ] = None,
    top: Annotated[int, typer.Option(metavar="N", help="Designs to print.")] = 12,
    prefer: Preferences = None,
    representatives: Annotated[
        int | None, typer.Option(metavar="K", help="Print K designs that stand for all.")
    ] = None,
    decimal: DecimalMark = None,
    thousands: ThousandsMark = None,
    encoding: Encoding = None,
    skip_rows: SkippedRows = None,
    drop_incomplete: DropIncomplete = False,
) -> int:
    """Rank the designs of any Pareto set by efficiency."""
    from pymoo_psi.cli._options import ColumnOptions, FileOptions
    from pymoo_psi.cli._rank import run_rank

    columns = ColumnOptions(
        objectives or (), maximize or (), limits=limits or (), formulation=formulation,
        criteria=criterion or (), relax=relax or (),
    )  # fmt: skip
    written = FileOptions(decimal, thousands, encoding, skip_rows, drop_incomplete)
    return run_rank(
        file, columns, written,
        normalize=not no_normalize, prefer=prefer or (), representatives=representatives,
        out=out, figure=figure, top=top,
    )  # fmt: skip


@app.command()
def page(
    file: Designs,
    out: Annotated[Path, _path("FILE.html", "Write the page here.")] = Path("page.html"),
    objectives: Objectives = None,
    variables: Variables = None,
    maximize: Maximize = None,
    formulation: FormulationFile = None,
    criterion: Criteria = None,
    relax: Relaxed = None,
    units: Units = None,
    prototype: Annotated[
        Path | None,
        _path("FILE.csv", "Existing designs to compare with."),
    ] = None,
    no_normalize: PlainDistances = False,
    limits: Limits = None,
    title: Annotated[str | None, typer.Option(help="Heading [the file's name].")] = None,
    decimal: DecimalMark = None,
    thousands: ThousandsMark = None,
    encoding: Encoding = None,
    skip_rows: SkippedRows = None,
    drop_incomplete: DropIncomplete = False,
) -> int:
    """Make a page to decide on a Pareto set with: one HTML file that works offline."""
    from pymoo_psi.cli._options import ColumnOptions, FileOptions
    from pymoo_psi.cli._page import run_page

    columns = ColumnOptions(
        objectives or (), maximize or (), variables or (), units or (), limits or (),
        formulation, criterion or (), relax or (),
    )  # fmt: skip
    written = FileOptions(decimal, thousands, encoding, skip_rows, drop_incomplete)
    return run_page(
        file, columns, written,
        prototype=prototype, normalize=not no_normalize, title=title, out=out,
    )  # fmt: skip


@app.command()
def report(
    file: Designs,
    out: Annotated[Path, _path("FILE.html", "Write the report here.")] = Path("report.html"),
    objectives: Objectives = None,
    variables: Variables = None,
    maximize: Maximize = None,
    limits: Limits = None,
    formulation: FormulationFile = None,
    criterion: Criteria = None,
    relax: Relaxed = None,
    units: Units = None,
    prefer: Preferences = None,
    design: Annotated[
        int | None,
        typer.Option(metavar="N", help="Test point, or row, that is chosen [the optimum]."),
    ] = None,
    no_normalize: PlainDistances = False,
    title: Annotated[str | None, typer.Option(help="Heading [the file's name].")] = None,
    decimal: DecimalMark = None,
    thousands: ThousandsMark = None,
    encoding: Encoding = None,
    skip_rows: SkippedRows = None,
    drop_incomplete: DropIncomplete = False,
) -> int:
    """Report on tests and the choice among them: one HTML file to be read and printed."""
    from pymoo_psi.cli._options import ColumnOptions, FileOptions
    from pymoo_psi.cli._report import run_report

    columns = ColumnOptions(
        objectives or (), maximize or (), variables or (), units or (), limits or (),
        formulation, criterion or (), relax or (),
    )  # fmt: skip
    written = FileOptions(decimal, thousands, encoding, skip_rows, drop_incomplete)
    return run_report(
        file, columns, written,
        normalize=not no_normalize, prefer=prefer or (), design=design, title=title, out=out,
    )  # fmt: skip


def _chute(
    mu: float | None, c: float | None, r: float | None, model: ModelName | None
) -> dict[str, float | str]:
    given = {"mu": mu, "c": c, "r": r, "model": model and model.value}
    return {name: value for name, value in given.items() if value is not None}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code, and never a traceback for a user's mistake.

    Args:
        arguments: The words after ``pymoo-psi``; those of the process by default.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # what a terminal cannot show becomes "?"
            stream.reconfigure(errors="replace")
    try:
        words = list(sys.argv[1:] if arguments is None else arguments)
        if "--out=" in words or ("--out", "") in pairwise(words):  # typer takes it for "."
            raise PsiError("--out must be the name of a file or folder, got ''")
        # No words are a mistake to typer, code 2; here they ask for help, code 0. The name is given
        # for 'python -m pymoo_psi', whose help would show another one.
        with warnings.catch_warnings():
            warnings.showwarning = _tell_warning
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
        message = "there is not enough memory for that many designs; ask for fewer"
    except (KeyboardInterrupt, typer.Abort):
        return _interrupted()
    else:
        if code == _INTERRUPTED:  # as later versions of typer return it
            return _interrupted()
        return code if isinstance(code, int) else 0
    # A message of pymoo or of a user's model may have several lines; scripts count on one.
    _tell(f"pymoo-psi: error: {' '.join(message.split())}")
    return 2


def _interrupted() -> int:
    _tell("pymoo-psi: interrupted")
    return _INTERRUPTED


def _tell_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Show a warning of this package in one line; those of a user's model as Python does."""
    if category is UserWarning:
        _tell(f"pymoo-psi: warning: {message}")
    else:
        _tell(warnings.formatwarning(message, category, filename, lineno).rstrip())


def _tell(line: str) -> None:
    try:
        print(line, file=sys.stderr, flush=True)
    except OSError:  # if nobody can be told, the code tells; Python would try again at its end,
        sys.stderr = None  # and exit with 120


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
