"""The command ``pymoo-psi``: its commands with their options, and how it ends.

A command is a class whose fields are its options, and whose bases are options that several take;
``--help`` shows what their docstrings say of each, in brackets how its value is called. The
function that runs it is imported when it is called, and with it NumPy, pymoo and the like: so
``--help`` and the completion of words answer at once.

Exit codes: 0 success, 1 no feasible design or a program that fails its trial, 2 wrong usage or
input (one line says what), 130 interrupted.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from io import StringIO, TextIOWrapper
from pathlib import Path
from typing import Annotated, Any, TypeAlias, TypeVar, get_args, get_type_hints

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
  pymoo-psi rank front.csv
  pymoo-psi page front.csv

Exit code: 0 success, 1 solve or report found no feasible design, 2 a mistake, reported in one line,
130 interrupted. In a pipe or a file each row of a table is one line, however long, unless COLUMNS
says how wide lines may be. A result replaces an older file of its name, but never a file that is
read, nor a study.""",
)

_ARGUMENTS = ("problem", "file", "sources")  # the fields that are no options
# A line "name (HOW ITS VALUE IS CALLED): what it means", and more indented lines, of a docstring.
_DESCRIBED = re.compile(r"^    (\w+)(?: \((.+?)\))?: (.+(?:\n {8}.+)*)", re.MULTILINE)

Names: TypeAlias = list[str] | None
Text: TypeAlias = str | None
File: TypeAlias = Path | None


def path_in(text: str | Path) -> Path:
    """Return what is typed as a path, ``~`` replaced, which shells leave in ``--out=~/x.csv``."""
    if not os.fspath(text):  # as $FILE gives that is not set; to Path it is "."
        raise typer.BadParameter("a file or folder must have a name, got ''")
    return Path(os.path.expanduser(text))


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What is asked of a table: objectives, directions, limits, computed columns.

    Attributes:
        objectives (A,B,…): Columns with objectives [f1,f2,… or all numeric].
        maximize (A,…): Objectives of which more is better.
        limits ("A<=2.5,1<=X<=2"): Limits on any columns of numbers; in quotation marks.
        compute ("NAME=A/B"): One more column, computed from others.
        relax (G,…): Constraints that need not hold.
        decision (FILE.json): All this from a file: a decision of the page, or Formulation.to_json;
            further options add to it.
        no_normalize: Plain distances, not in units of the ranges.
    """

    objectives: Names = None
    maximize: Names = None
    limits: Names = None
    compute: Names = None
    relax: Names = None
    decision: File = None
    no_normalize: bool = False


@dataclass(frozen=True, kw_only=True)
class Opening(Asked):
    """How a source is opened: what its columns are, and how its numbers are written.

    Attributes:
        variables (X,Y,…): Columns with design variables [x1,x2,…].
        units (A=KG,B=S): Units of columns.
        decimal ("."|","): Decimal mark of the file [found from its numbers].
        thousands (MARK): Mark between thousands [as for --decimal].
        encoding (NAME): Of a text, such as cp1252 [UTF-8].
        skip_rows (1,3,…): Lines to leave out: titles, units.
        sheet (NAME): Sheet of a workbook [the only one].
        drop_incomplete: Leave out designs that lack an objective.
    """

    variables: Names = None
    units: Names = None
    decimal: Text = None
    thousands: Text = None
    encoding: Text = None
    skip_rows: Text = None
    sheet: Text = None
    drop_incomplete: bool = False


@dataclass(frozen=True, kw_only=True)
class OfFile(Opening):
    """A source that is opened.

    Attributes:
        file (FILE): A study, a folder of shares, or a table: CSV or .xlsx.
    """

    file: Path


@dataclass(frozen=True, kw_only=True)
class OfProblem:
    """A problem.

    Attributes:
        problem (PROBLEM): 'chute', a test problem of pymoo such as bnh, or your own as
            module:attribute, beam:Beam for the class Beam in beam.py. Its arguments are options
            behind it: dtlz2 --n-obj 4. Or another program, by a FILE.toml.
        jobs (N): Processes; -1: one per core.
    """

    context: typer.Context
    problem: str
    jobs: int = 1


Kind = TypeVar("Kind")


def _command(module: str, *examples: str, more: str = "") -> Callable[[type[Kind]], type[Kind]]:
    """Make a class of options a command, run by the function ``run_…`` of a module.

    Its help ends with examples, which can be pasted.
    """
    epilog = "\n  ".join(["\b\nExamples:", *examples]) + (f"\n\n{more}" if more else "")

    def registered(kind: type[Kind]) -> type[Kind]:
        name, hints = kind.__name__.lower(), get_type_hints(kind)
        # Options that a command of a problem does not know are the problem's.
        settings = {"ignore_unknown_options": True, "allow_extra_args": True}

        def command(**given: Any) -> int:
            try:
                run = getattr(import_module(f"pymoo_psi.cli.{module}"), f"run_{name}")
                return int(run(kind(**given)))
            except KeyboardInterrupt as stop:
                if stop.args != REPORTED:
                    print_error("pymoo-psi: interrupted; no file is left half-written")
                return _INTERRUPTED

        # Its own options come first in the help, those of its bases behind them.
        bases = kind.__mro__[:-1]
        fields = [field for each in bases for field in inspect.get_annotations(each)]
        described = {}
        for each in reversed(bases):
            for field, metavar, text in _DESCRIBED.findall(inspect.cleandoc(each.__doc__ or "")):
                described[field] = metavar or None, " ".join(text.split())
        command.__annotations__ = {
            field: _declared(field, hints[field], *described.get(field, ("", "")))
            for field in fields
        }
        known = inspect.signature(kind).parameters
        parameters = [
            known[field].replace(annotation=declared)
            for field, declared in command.__annotations__.items()
        ]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        app.command(
            name,
            help=(kind.__doc__ or "").partition("\n")[0],
            epilog=epilog,
            context_settings=settings if issubclass(kind, OfProblem) else None,
        )(command)
        return kind

    return registered


def _declared(field: str, hint: Any, metavar: str | None, text: str) -> Any:
    """Return the type of a field as typer reads it, with how it is called and what it means."""
    if field == "context":
        return hint
    parser = path_in if Path in (hint, *get_args(hint)) else None
    if field in _ARGUMENTS:
        return Annotated[hint, typer.Argument(metavar=metavar, help=text, parser=parser)]
    # Named, an option has no second name such as --no-fill.
    name = f"--{'try' if field == 'trial' else field.replace('_', '-')}"
    return Annotated[hint, typer.Option(name, metavar=metavar, help=text, parser=parser)]


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


_CHUTE = """Of the chute x1 is the slope tan α, x2 the speed of the floor; f1 the time,
f2 the energy balance, f3 = x1, f4 = x2. Its arguments: --mu 0.2, --c 0.3193 (speed over √(gL)),
--r 0.1 (over L), --model full or rolling."""


@_command(
    "_solve",
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi solve bnh --points 256 --limits "f1<=60, x1<=2" --study bnh.db',
    "pymoo-psi solve dtlz2 --n-obj 4 --n-var 7 --algorithm nsga3 --points 500",
    'pymoo-psi solve chute --mu 0.4 --model rolling --box "x1=0.2:0.8, x2=0.1"',
    "pymoo-psi solve --new bracket.toml",
    more=_CHUTE,
)
@dataclass(frozen=True, kw_only=True)
class Solve(Asked, OfProblem):
    """Find the Pareto set of a problem and rank it by efficiency.

    Attributes:
        algorithm (psi|surrogate|nsga3): How to search.
        points (N): Designs to evaluate [4096, of surrogate 256, of a FILE.toml 128].
        sampling (lptau|sobol|halton|lhs): Where psi and surrogate take their test points from.
        seed (S): Seed; psi by lptau needs none.
        box ("X=1:2,Y=3"): Narrower bounds of variables, or a fixed value.
        log (X,…): Variables of logarithmic scale.
        fill: Count only points that meet the requirements.
        timeout (S): Seconds a design may take; then it has failed.
        study (FILE.db): Keep every test here; a run continues it.
        share (K/N): Test the K-th of N parts; --study is their folder.
        study_key (K): What else the study depends on: the model's version.
        retry (failed|1,2): Test failed designs of the study once more.
        out (FILE): Write the Pareto set here, .csv or .xlsx.
        new: Write an example of a FILE.toml, to be edited.
        trial: Run the program of a FILE.toml once, and show all of it.
    """

    algorithm: str = "psi"
    points: int | None = None
    sampling: str = "lptau"
    seed: int = 1
    box: Names = None
    log: Names = None
    fill: bool = False
    timeout: float | None = None
    study: File = None
    share: Text = None
    study_key: Text = None
    retry: Text = None
    out: File = None
    new: bool = False
    trial: bool = False


@_command(
    "_rank",
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi rank front.csv --limits "f1<=60" --prefer knee --out ranked.csv',
    "pymoo-psi rank front.csv --objectives f1,f2 --maximize f2",
    more="""In a list, a name with a comma stands in quotation marks: --objectives
'"time, s",mass'.""",
)
@dataclass(frozen=True, kw_only=True)
class Rank(OfFile):
    """Rank the designs of any Pareto set by efficiency.

    Attributes:
        out (FILE): Write all designs here, .csv or .xlsx.
        prefer (P): Show what another preference chooses, too: weights:A=2,B=1, aspire:A=3,B=5,
            chebyshev or knee.
    """

    out: File = None
    prefer: Names = None


@_command(
    "_documents",
    "pymoo-psi solve bnh --points 256 --out front.csv",
    'pymoo-psi page front.csv --units f1=kg --limits "f1<=60"',
)
@dataclass(frozen=True, kw_only=True)
class Page(OfFile):
    """Make a page to decide on a Pareto set: one file, works offline.

    Attributes:
        title: Heading [the file's name].
        prototype (FILE): Existing designs to compare with.
        out (FILE.html): Write the page here.
    """

    title: Text = None
    prototype: File = None
    out: Path = Path("page.html")


@_command(
    "_documents",
    "pymoo-psi solve bnh --points 256 --study bnh.db",
    'pymoo-psi report bnh.db --limits "f1<=60" --units f1=kg --prefer knee',
)
@dataclass(frozen=True, kw_only=True)
class Report(OfFile):
    """Report on tests and the choice: one file to read and print.

    Attributes:
        title: Heading [the file's name].
        prefer (P): What else could choose, as for rank [knee, chebyshev and other distances].
        design (NAME): Name or number of the design that is chosen [the decision's, or none].
        out (FILE.html): Write the report here.
    """

    title: Text = None
    prefer: Names = None
    design: Text = None
    out: Path = Path("report.html")


@_command(
    "_documents",
    "pymoo-psi solve bnh --points 256 --study bnh.db",
    'pymoo-psi analyze bnh.db --limits "f1<=60" --out analysis',
)
@dataclass(frozen=True, kw_only=True)
class Analyze(OfFile):
    """Say which variables matter, what is feasible, if tests suffice.

    Attributes:
        out (DIR): Folder for tables (CSV) and pictures (PNG).
    """

    out: File = None


@_command(
    "_experiments",
    "pymoo-psi compare bnh --evaluations 64,128 --seeds 2",
    "pymoo-psi compare dtlz2 --n-obj 4 --evaluations 64 --seeds 2 --out four",
    more=_CHUTE,
)
@dataclass(frozen=True, kw_only=True)
class Compare(OfProblem):
    """Compare PSI with NSGA-III and others at equal cost.

    Attributes:
        evaluations (N,N,…): Numbers of evaluations [256,1024,4096, of surrogate 64,128,256].
        seeds (N): Runs of each that draws at random.
        algorithms (A,B,…): Of psi, psi-scrambled, surrogate, nsga3, psi+nsga3, nsga2, ….
        jobs (N): Runs at a time; -1: one per core.
        out (DIR): Write tables, a figure and runs here; a later call goes on from them
            [comparison_ and the problem's name].
    """

    evaluations: Text = None
    seeds: int = 11
    algorithms: str = "psi,psi-scrambled,nsga3,psi+nsga3"
    out: File = None


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
    """Write tests as one table for other programs, or as one study.

    Attributes:
        sources ([NAME=]SOURCE…): Tests of one problem: studies, folders of shares, tables. With a
            name they are experiments of other bounds or samplings.
        out (FILE): Write here, .csv, .xlsx, or .db, a new study to continue.
    """

    sources: list[str]
    out: Path


@_command(
    "_experiments",
    "pymoo-psi reproduce",
    "pymoo-psi reproduce --mu 0.3 --model full --points 1024 --out mu03",
)
@dataclass(frozen=True, kw_only=True)
class Reproduce:
    """Compute the tables of the chute's paper, and compare with them.

    Attributes:
        out (DIR): Folder for tables (CSV) and figures.
        points (Q): Test points per case.
        mu (MU): Friction coefficient, may be repeated [0.2, 0.4, 0.6].
        model (full|rolling): The motion [both].
        jobs (N): Processes; -1: one per core.
    """

    out: Path = Path("reproduction")
    points: int = 4096
    mu: list[float] | None = None
    model: Text = None
    jobs: int = 1


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
