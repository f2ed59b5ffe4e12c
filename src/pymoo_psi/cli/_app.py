"""The command ``pymoo-psi``: its commands with their options, and how it ends.

Options that several commands take are lists here. What runs a command is imported when it is
called, and with it NumPy, pymoo and the like: so ``--help`` answers at once.

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
from functools import partial
from io import StringIO, TextIOWrapper
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import click

from pymoo_psi.errors import PsiError

_INTERRUPTED = 130  # 128 and the number of the signal, as shells have it


class Options(SimpleNamespace):
    """The values of a command's options and arguments, by name, None or empty if not given."""


Run = TypeVar("Run", bound=Callable[[Options], int])


def path_in(text: str | Path) -> Path:
    """Return what is typed as a path, ``~`` replaced, which shells leave in ``--out=~/x.csv``."""
    if not os.fspath(text):  # as $FILE gives that is not set; to Path it is "."
        raise click.BadParameter("a file or folder must have a name, got ''")
    return Path(os.path.expanduser(text))


def _option(name: str, metavar: str | None, text: str, **more: Any) -> click.Option:
    return click.Option([f"--{name}"], metavar=metavar, help=text, **more)


_names = partial(_option, multiple=True)
_file = partial(_option, type=path_in)
_count = partial(_option, type=click.IntRange(1))
_flag = partial(_option, metavar=None, is_flag=True)


def _choice(name: str, options: str, text: str, default: str | None = None) -> click.Option:
    return _option(name, options, text, type=click.Choice(options.split("|")), default=default)


# What is asked of a table: objectives, directions, limits, computed columns.
_ASKED = [
    _names("objectives", "A,B,…", "Columns with objectives [f1,f2,… or all numeric]."),
    _names("maximize", "A,…", "Objectives of which more is better."),
    _names("limits", '"A<=2.5,1<=X<=2"', "Limits on any columns of numbers; in quotation marks."),
    _names("compute", '"NAME=A/B"', "One more column, computed from others."),
    _file("decision", "FILE.json", "All this from a decision of the page or Formulation.to_json."),
    _flag("no-normalize", text="Plain distances, not in units of the ranges."),
]
# How a source is opened: what its columns are, and how its numbers are written.
_OPENING = [
    _names("variables", "X,Y,…", "Columns with design variables [x1,x2,…]."),
    _names("units", "A=KG,B=S", "Units of columns."),
    _option("decimal", '"."|","', "Decimal mark of the file [found from its numbers]."),
    _option("thousands", "MARK", "Mark between thousands [as for --decimal]."),
    _option("encoding", "NAME", "Of a text, such as cp1252 [UTF-8]."),
    _option("skip-rows", "1,3,…", "Lines to leave out: titles, units."),
    _option("sheet", "NAME", "Sheet of a workbook [the only one]."),
    _flag("drop-incomplete", text="Leave out designs that lack an objective."),
    *_ASKED,
]
_FILE = click.Argument(["file"], type=path_in)
_PROBLEM = click.Argument(["problem"])
_JOBS = _option("jobs", "N", "Processes; -1: one per core.", type=int, default=1)
_TITLE = _option("title", "TEXT", "Heading [the file's name].")


class _Commands(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands in the order of their use, not of the alphabet."""
        return list(self.commands)


def _help(function: Callable[..., Any]) -> tuple[str, str]:
    """Return what a docstring says, and its examples, which end the help as they are printed."""
    text, heading, examples = (inspect.getdoc(function) or "").partition("Examples:")
    return text, f"\b\n{heading}{examples}"


@click.group(
    cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "show_default": True}
)
@click.version_option(package_name="pymoo-psi", message="pymoo-psi %(version)s")
def app() -> None:
    """Parameter Space Investigation and decision-making on Pareto sets, for pymoo.

    Examples:
      pymoo-psi solve chute --points 1024 --out front.csv
      pymoo-psi rank front.csv
      pymoo-psi page front.csv

    Exit code: 0 success, 1 solve or report found no feasible design, 2 a mistake, reported in one
    line, 130 interrupted. In a pipe or a file each row of a table is one line, however long, unless
    COLUMNS says how wide lines may be. A result replaces an older file of its name, but never a
    file that is read, nor a study.
    """


app.help, app.epilog = _help(app)


def _command(*params: click.Parameter) -> Callable[[Run], Run]:
    """Make a function a command of its name; its docstring is the help."""

    def registered(function: Run) -> Run:
        text, examples = _help(function)
        command = click.Command(
            function.__name__,
            callback=lambda **given: function(Options(**given)),
            params=[*params],
            help=text,
            epilog=examples,
        )
        if _PROBLEM in params:  # options that the command does not know are the problem's
            command.context_settings = {"ignore_unknown_options": True, "allow_extra_args": True}
        app.add_command(command)
        return function

    return registered


@_command(
    _PROBLEM,
    _choice("algorithm", "psi|surrogate|nsga3", "How to search.", "psi"),
    _count("points", "N", "Designs to evaluate [4096, of surrogate 256, of a FILE.toml 128]."),
    _choice("sampling", "lptau|sobol|halton|lhs", "Test points of psi and surrogate.", "lptau"),
    _option("seed", "S", "Seed; psi by lptau needs none.", type=click.IntRange(0), default=1),
    _names("box", '"X=1:2,Y=3"', "Narrower bounds of variables, or a fixed value."),
    _names("log", "X,…", "Variables of logarithmic scale."),
    _flag("fill", text="Count only points that meet the requirements."),
    _option("timeout", "S", "Seconds a design may take; then it has failed.", type=float),
    _file("study", "FILE.db", "Keep every test here; a run continues it."),
    _option("share", "K/N", "Test the K-th of N parts; --study is their folder."),
    _option("study-key", "K", "What else the study depends on: the model's version."),
    _option("retry", "failed", "Test failed designs of the study once more."),
    _file("out", "FILE", "Write the Pareto set here, .csv or .xlsx."),
    _flag("new", text="Write an example of a FILE.toml, to be edited."),
    _flag("try", text="Run the program of a FILE.toml once, and show all of it."),
    *_ASKED,
    _JOBS,
)
def solve(options: Options) -> int:
    """Find the Pareto set of a problem and rank it by efficiency.

    PROBLEM is 'chute', a test problem of pymoo such as bnh, or your own as module:attribute,
    beam:Beam for the class Beam in beam.py. Its arguments are options behind it: dtlz2 --n-obj 4.
    Or another program, by a FILE.toml.

    Examples:
      pymoo-psi solve bnh --points 256 --out front.csv
      pymoo-psi solve bnh --points 256 --limits "f1<=60, x1<=2" --study bnh.db
      pymoo-psi solve dtlz2 --n-obj 4 --n-var 7 --algorithm nsga3 --points 500
      pymoo-psi solve chute --mu 0.4 --model rolling --box "x1=0.2:0.8, x2=0.1"
      pymoo-psi solve --new bracket.toml

    Of the chute x1 is the slope tan α, x2 the speed of the floor; f1 the time, f2 the energy
    balance, f3 = x1, f4 = x2. Its arguments: --mu 0.2, --c 0.3193 (speed over √(gL)), --r 0.1 (over
    L), --model full or rolling.
    """
    from pymoo_psi.cli._solve import run_solve

    return run_solve(options)


@_command(_FILE, _file("out", "FILE", "Write all designs here, .csv or .xlsx."), *_OPENING)
def rank(options: Options) -> int:
    """Rank the designs of any Pareto set by efficiency.

    FILE is a study, a folder of shares, or a table: CSV or .xlsx. In a list, a name with a comma
    stands in quotation marks: --objectives '"time, s",mass'.

    Examples:
      pymoo-psi solve bnh --points 256 --out front.csv
      pymoo-psi rank front.csv --limits "f1<=60" --out ranked.csv
      pymoo-psi rank front.csv --objectives f1,f2 --maximize f2
    """
    from pymoo_psi.cli._rank import run_rank

    return run_rank(options)


@_command(
    _FILE,
    _TITLE,
    _file("prototype", "FILE", "Existing designs to compare with."),
    _file("out", "FILE.html", "Write the page here.", default="page.html"),
    *_OPENING,
)
def page(options: Options) -> int:
    """Make a page to decide on a Pareto set: one file, works offline.

    FILE is a study, a folder of shares, or a table: CSV or .xlsx.

    Examples:
      pymoo-psi solve bnh --points 256 --out front.csv
      pymoo-psi page front.csv --units f1=kg --limits "f1<=60"
    """
    from pymoo_psi.cli._documents import run_page

    return run_page(options)


@_command(
    _FILE,
    _TITLE,
    _option("design", "NAME", "Name of the design that is chosen [the decision's, or none]."),
    _file("out", "FILE.html", "Write the report here.", default="report.html"),
    *_OPENING,
)
def report(options: Options) -> int:
    """Report on tests and the choice: one file to read and print.

    FILE is a study, a folder of shares, or a table: CSV or .xlsx.

    Examples:
      pymoo-psi solve bnh --points 256 --study bnh.db
      pymoo-psi report bnh.db --limits "f1<=60" --units f1=kg
    """
    from pymoo_psi.cli._documents import run_report

    return run_report(options)


@_command(_FILE, _file("out", "DIR", "Folder for tables (CSV) and pictures (PNG)."), *_OPENING)
def analyze(options: Options) -> int:
    """Say which variables matter, what is feasible, if tests suffice.

    FILE is a study, a folder of shares, or a table: CSV or .xlsx.

    Examples:
      pymoo-psi solve bnh --points 256 --study bnh.db
      pymoo-psi analyze bnh.db --limits "f1<=60" --out analysis
    """
    from pymoo_psi.cli._documents import run_analyze

    return run_analyze(options)


@_command(
    _PROBLEM,
    _option("evaluations", "N,N,…", "How many [256,1024,4096, of surrogate 64,128,256]."),
    _count("seeds", "N", "Runs of each that draws at random.", default=11),
    _option(
        "algorithms",
        "A,B,…",
        "Of psi, psi-scrambled, surrogate, nsga3, psi+nsga3, nsga2, ….",
        default="psi,psi-scrambled,nsga3,psi+nsga3",
    ),
    _file("out", "DIR", "Folder for tables, a figure and runs [comparison_ and the problem]."),
    _JOBS,
)
def compare(options: Options) -> int:
    """Compare PSI with NSGA-III and others at equal cost.

    PROBLEM and its options are as of solve. A later call goes on from the runs in its folder.

    Examples:
      pymoo-psi compare bnh --evaluations 64,128 --seeds 2
      pymoo-psi compare dtlz2 --n-obj 4 --evaluations 64 --seeds 2 --out four
    """
    from pymoo_psi.cli._experiments import run_compare

    return run_compare(options)


@_command(
    click.Argument(["sources"], nargs=-1, required=True, metavar="[NAME=]SOURCE…"),
    _file("out", "FILE", "Write .csv, .xlsx, or .db, a new study to continue.", required=True),
    *_OPENING,
)
def export(options: Options) -> int:
    """Write tests as one table for other programs, or as one study.

    The sources are tests of one problem: studies, folders of shares, tables. With a name they are
    experiments of other bounds or samplings.

    Examples:
      pymoo-psi solve bnh --points 64 --study parts --share 1/2
      pymoo-psi solve bnh --points 64 --study parts --share 2/2
      pymoo-psi export parts --out whole.db
      pymoo-psi solve bnh --points 64 --study part.db --box "x1=0:2"
      pymoo-psi export whole=whole.db part=part.db --out both.csv
    """
    from pymoo_psi.cli._documents import run_export

    return run_export(options)


@_command(
    _file("out", "DIR", "Folder for tables (CSV) and figures.", default="reproduction"),
    _count("points", "Q", "Test points per case.", default=4096),
    _names("mu", "MU", "Friction coefficient, may be repeated [0.2, 0.4, 0.6].", type=float),
    _choice("model", "full|rolling", "The motion [both]."),
    _JOBS,
)
def reproduce(options: Options) -> int:
    """Compute the tables of the chute's paper, and compare with them.

    Examples:
      pymoo-psi reproduce
      pymoo-psi reproduce --mu 0.3 --model full --points 1024 --out mu03
    """
    from pymoo_psi.cli._experiments import run_reproduce

    return run_reproduce(options)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code, and never a traceback for a user's mistake.

    Args:
        arguments: The words after ``pymoo-psi``; those of the process by default.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # what a terminal cannot show becomes "?"
            stream.reconfigure(errors="replace")
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        # No words are a mistake to click, code 2; here they ask for help, code 0. Not app.main(),
        # which has ends of its own. The name is given for 'python -m pymoo_psi'.
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning  # type: ignore[assignment]
            with app.make_context("pymoo-psi", words or ["--help"]) as context:
                return int(app.invoke(context))
    except click.exceptions.Exit as end:  # --help, --version
        return end.exit_code
    except PsiError as error:  # before OSError, which StudyAccessError is too
        message = str(error)
    except click.ClickException as error:
        message = error.format_message()
    except OSError as error:
        message = f"{error.filename or 'file'}: {error.strerror or error}"
    except MemoryError:
        message = "out of memory; reduce --points"
    except KeyboardInterrupt as stop:
        kept = stop.args[0] if stop.args else "no file is left half-written"
        print_error(f"pymoo-psi: interrupted; {kept}")
        return _INTERRUPTED
    # A message of pymoo or of a user's model may have several lines; scripts count on one.
    print_error(f"pymoo-psi: error: {' '.join(message.split())}")
    return 2


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
