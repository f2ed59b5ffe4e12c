"""The command ``pymoo-psi``: its commands with their options, and how it ends.

Options that several commands share are lists in this module. The function that runs a command is
imported only when the command is called. This keeps NumPy, pymoo and pandas out of ``--help``,
which answers at once.

Exit codes: 0 success; 1 no feasible design, or a program that fails its trial; 2 a usage or input
error, reported in one line; 130 interrupted.
"""

from __future__ import annotations

import codecs
import inspect
import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from importlib import import_module
from io import TextIOWrapper
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeAlias

import click

from pymoo_psi import __citation__, __version__
from pymoo_psi._names import named_as
from pymoo_psi.errors import PsiError

_INTERRUPTED = 130  # 128 plus the number of the signal, the convention of shells


Options: TypeAlias = SimpleNamespace
"""The values of a command's options and arguments by name; None or empty if not given.

Its ``context`` is that of click: which of them were typed, and the words that are none of them.
"""


def path_in(text: str | Path) -> Path:
    """Return a typed path with ``~`` expanded, which shells do not do in ``--out=~/x.csv``."""
    if not os.fspath(text):  # an unset $FILE; Path would take it for "."
        raise click.BadParameter("a file or folder must have a name, got ''")
    return Path(os.path.expanduser(text))


def _counts(mark: str) -> Callable[[str], tuple[int, ...]]:
    """Return the type of an option that lists numbers with a mark between them."""
    return lambda text: tuple(_COUNT.convert(part, None, None) for part in text.split(mark))


def _points(text: str) -> tuple[int, bool]:
    """Return a number of points, and whether it counts further ones: ``+64``."""
    return _COUNT.convert(text, None, None), text.startswith("+")


def _whole(least: int, greatest: int | None = None) -> click.IntRange:
    """Return the type of whole numbers, called so in errors: click calls it an integer range."""
    kind = click.IntRange(least, greatest)
    kind.name = "whole number"
    return kind


_COUNT: Any = _whole(1, 10**12)
_COUNTS = _counts(",")


def _option(name: str, metavar: str | None, text: str, **attributes: Any) -> click.Option:
    return click.Option([f"--{name}"], metavar=metavar, help=text, **attributes)


_names = partial(_option, multiple=True)
_file = partial(_option, type=path_in)
_count = partial(_option, type=_whole(1))
_flag = partial(_option, metavar=None, is_flag=True)


def _choice(name: str, options: str, text: str, default: str | None = None) -> click.Option:
    return _option(name, options, text, type=click.Choice(options.split("|")), default=default)


# The formulation: objectives, directions, limits, computed columns.
_FORMULATION = [
    _names("objectives", "A,B,…", "Objective columns [f1,f2,… or the other columns of numbers]."),
    _names("maximize", "A,…", "Objectives to maximize."),
    _names("limits", '"A<=2.5,T=yes"', "Limits in quotes: A<=2.5, 1<=X<=2, T=yes, T in a, b."),
    _names("compute", '"NAME=A/B"', "Add a column computed from others."),
    _file(
        "decision",
        "FILE.json",
        "Read objectives, limits and choice from a decision saved on the page.",
    ),
    _flag("no-normalize", text="Measure distances in original units."),
]
_DECIMAL = _option("decimal", '"."|","', "Decimal mark [detected].")
_SHEET = _option("sheet", "NAME", "Sheet of a workbook [the only one].")
# How a source is read: the roles of its columns and the format of its numbers.
_READING = [
    _names("variables", "X,Y,…", "Design variable columns [x1,x2,…]."),
    _names("units", "A=KG,B=S", "Units of columns."),
    _DECIMAL,
    _option("encoding", "NAME", "Text encoding, such as cp1252 [UTF-8]."),
    _names("skip-rows", "1,3,…", "Lines to skip, such as titles and units.", type=_COUNTS),
    _SHEET,
    _option("average-by", "LABEL", "Column that identifies designs with repeated tests."),
    _flag("drop-incomplete", text="Skip designs that lack an objective."),
    *_FORMULATION,
]
# The names of these options: what another command on the same source or study needs, too.
OF_FORMULATION = [str(option.name) for option in _FORMULATION]
OF_SOURCE = [str(option.name) for option in _READING]
_FILE = click.Argument(["file"], type=path_in)
_PROTOTYPE = _file("prototype", "FILE", "Existing designs for comparison.")
_KEPT = _file("study", "FILE.db", "Study that keeps the tests.", required=True)
_PROBLEM = click.Argument(["problem"])
# Options that describe the argument PROBLEM.
_OF_PROBLEM = [
    _names("bounds", '"X=1:2,Y=3"', "Narrower bounds or fixed values of variables."),
    _names("log", "X,…", "Variables on a logarithmic scale."),
    _option("study-key", "K", "Version of the model; a study rejects a changed one."),
    click.Option(
        ["--from", "source"],
        metavar="FILE",
        help="First add the tests in FILE (.csv, .json, .xlsx, .db) to the study.",
        type=path_in,
    ),
]
_JOBS = _option(
    "jobs",
    "N",
    "Number of processes; -1 uses all cores.",
    type=int,
    default=1,
)
_TITLE = _option("title", "TEXT", "Title [the file's name].")


def _help(function: Callable[..., Any]) -> tuple[str, str]:
    """Return the text of a docstring and its examples; the mark before them keeps their lines."""
    docstring = inspect.getdoc(function) or ""
    text, heading, examples = docstring.partition("Examples:")
    return text, f"\b\n{heading}{examples}"


def _cite(ctx: click.Context, _: click.Parameter, is_given: bool) -> None:
    """Print the entries for BibTeX, and end."""
    if is_given:
        click.echo(__citation__, nl=False)
        ctx.exit()


@click.group(context_settings={"help_option_names": ["-h", "--help"], "show_default": True})
@click.version_option(__version__, message="pymoo-psi %(version)s")
@click.option(
    "--cite",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_cite,
    help="Show how to cite, in BibTeX.",
)
def app() -> None:
    """Choose one design when goals conflict: test designs of a model, or read a table of them.

    Examples:
      pymoo-psi solve chute --points 1024 --out front.csv
      pymoo-psi rank front.csv
      pymoo-psi page front.csv

    Exit codes: 0 success; 1 no feasible design (solve, report), or a failed trial of a program; 2 a
    usage or input error, reported in one line; 130 interrupted. Tables fit the terminal or the
    width in COLUMNS, and 80 columns in a pipe or a file. A result replaces an older result of the
    same name, but never an input file or a study.
    """


app.help, app.epilog = _help(app)
# In the order of use; click would sort them by name.
app.list_commands = lambda ctx: list(app.commands)  # type: ignore[method-assign]


def _command(module: str, *params: click.Parameter) -> Callable[[Callable[[], None]], None]:
    """Register a command under the name of a function, whose docstring is the help.

    The module of this subpackage has a function for it: ``run_solve`` for ``solve``.
    """

    def register(function: Callable[[], None]) -> None:
        name = function.__name__

        def callback(**values: Any) -> int:
            run = getattr(import_module(f"pymoo_psi.cli.{module}"), f"run_{name}")
            return int(run(Options(**values, context=click.get_current_context())))

        text, examples = _help(function)
        command = click.Command(name, callback=callback, params=[*params], help=text)
        command.epilog = examples
        if _PROBLEM in params:  # options that the command does not have are the problem's arguments
            command.context_settings = {"ignore_unknown_options": True, "allow_extra_args": True}
        app.add_command(command)

    return register


@_command(
    "_solve",
    _PROBLEM,
    _choice("algorithm", "psi|surrogate|nsga3", "Search method.", "psi"),
    click.Option(
        ["--points", "--evaluations"],
        metavar="N|+N",
        help="Points in all, or N more [default: 4096; surrogate 256; FILE.toml 128].",
        type=_points,
    ),
    _choice(
        "sampling", "lptau|sobol|halton|lhs", "Sequence of test points (psi, surrogate) [lptau]."
    ),
    _option(
        "seed",
        "S",
        "Random seed; psi with lptau uses none. In Python, pymoo draws one unless given.",
        type=_whole(0),
        default=1,
    ),
    _file("study", "FILE.db", "Keep every test here, and rank all of them."),
    *_OF_PROBLEM,
    _flag("noisy", text="The model is stochastic: tests of the same design differ."),
    _count("repeat", "K", "Test each design of a noisy model K times (psi).", default=1),
    _option("timeout", "S", "Seconds allowed per design; a slower design fails.", type=float),
    _flag("live", text="Watch and steer the run in the browser; see 'pymoo-psi live'."),
    _option(
        "share",
        "K/N",
        "Test part K of N only; --study is a folder.",
        type=_counts("/"),
    ),
    _choice(
        "retry",
        "failed|incomplete",
        "Test again the designs that failed or whose outputs are incomplete.",
    ),
    _file("out", "FILE", "Write the Pareto set here (.csv, .xlsx)."),
    _flag("new", text="Write an example FILE.toml to edit."),
    click.Option(
        ["--try", "trial"],
        is_flag=True,
        help="Run the program of a FILE.toml once and show every step.",
    ),
    *_FORMULATION,
    _JOBS,
    _option(
        "cluster", "WHERE", "Evaluate on a Dask cluster: tcp://…, FILE.json, module:attribute."
    ),
)
def solve() -> None:
    """Find the Pareto set of a problem, the best compromise first.

    PROBLEM is 'chute', a test problem of pymoo such as bnh, your own problem as module:attribute
    (beam:Beam for the class Beam in beam.py), or the FILE.toml of an external program. Arguments of
    the problem are given as options: dtlz2 --n-obj 4.

    Examples:
      pymoo-psi solve bnh --points 256 --out front.csv
      pymoo-psi solve bnh --points 256 --limits "f1<=60, x1<=2" --study bnh.db
      pymoo-psi solve dtlz2 --n-obj 4 --n-var 7 --algorithm nsga3 --points 500
      pymoo-psi solve chute --mu 0.4 --model rolling --bounds "x1=0.2:0.8, x2=0.1"
      pymoo-psi solve --new bracket.toml

    The variables of the chute are x1, the slope tan α, and x2, the speed of the floor. Its
    objectives are f1, the time, f2, the energy balance, f3 = x1 and f4 = x2. Its arguments are --mu
    0.2, --c 0.3193 (speed over √(gL)), --r 0.1 (over L), --model full or rolling.
    """


@_command(
    "_solve",
    _PROBLEM,
    _option("points", "N", "Number of designs; 0 lists pending ones.", type=_whole(0), default=4),
    _KEPT,
    _file("out", "FILE", "Write the designs into this new file (.csv, .xlsx).", required=True),
    _choice("algorithm", "psi|surrogate", "Search method.", "psi"),
    _option("seed", "S", "Random seed (surrogate).", type=_whole(0), default=1),
    *_OF_PROBLEM,
    *_FORMULATION,
)
def ask() -> None:
    """Propose designs for people to test.

    'pymoo-psi tell' adds the results. PROBLEM is as for solve, such as a FILE.toml without
    [program]; it is not evaluated. Designs that are tested or pending are not proposed
    again.

    Examples:
      pymoo-psi ask bnh --points 4 --study lab.db --out next.csv
    """


@_command(
    "_solve",
    click.Argument(["file"], type=path_in, required=False),
    _KEPT,
    _option("cancel", "N,N,…", "Cancel pending tests.", type=_COUNTS),
    _DECIMAL,
    _SHEET,
)
def tell() -> None:
    """Add the results of tests that people made to their study.

    FILE is the file from ask with results filled in. Rows without results stay pending. Several
    rows of one test are repeats. If a variable was changed, its new value is what was tested.
    Results that the study has change nothing; others correct them.

    Examples:
      pymoo-psi ask bnh --study lab.db --out next.csv
      pymoo-psi tell next.csv --study lab.db
      pymoo-psi tell --study lab.db --cancel 2,3
    """


@_command(
    "_documents",
    _FILE,
    _file("out", "FILE", "Write all designs here (.csv, .xlsx)."),
    _flag("long", text="Show all columns and cautions, and what the proposal depends on."),
    *_READING,
)
def rank() -> None:
    """Rank the designs of a table, the best compromise first.

    Each Pareto-optimal design has a place. Place 1 is the nearest to the ideal point; equal
    distances share a place. FILE is a table or study (.csv, .json, .xlsx, .db), or a folder of
    shares. In a list, put a name with a comma in quotation marks: --objectives '"time, s",mass'.

    Examples:
      pymoo-psi solve bnh --points 256 --out front.csv
      pymoo-psi rank front.csv --limits "f1<=60" --out ranked.csv
      pymoo-psi rank front.csv --objectives f1,f2 --maximize f2
    """


@_command(
    "_preferences",
    _FILE,
    _names("answers", '"A>B,C=D"', "Answers: A rather than B, C as good as D, E?F skipped."),
    click.Option(["--as", "person"], metavar="NAME", help="Name of the person who answers."),
    _file(
        "out",
        "FILE.json",
        "Write the answers and the proposal here, into a new file or that of --decision.",
        default="decision.json",
    ),
    *_READING,
)
def prefer() -> None:
    """Find the design that a person prefers by a few questions.

    Each question shows two designs and where they differ. One key answers: a or b for the design
    you would rather have, e if they are equally good, s to skip, u to undo the last answer, q to
    quit. Each answer is written at once, to decision.json unless --out names another file, which
    must be new. To continue, name the same file by --decision and --out; rank, page and report
    read it by --decision, too. In a list, put an answer with a comma in quotation marks.

    Examples:
      pymoo-psi solve bnh --points 256 --out front.csv
      pymoo-psi prefer front.csv --answers "67>98, 71=39"
    """


@_command(
    "_documents",
    _FILE,
    _TITLE,
    _PROTOTYPE,
    _file("out", "FILE.html", "Write the page here.", default="page.html"),
    *_READING,
)
def page() -> None:
    """Make an offline page on which a group chooses a design.

    FILE is a table or study (.csv, .json, .xlsx, .db), or a folder of shares.

    Examples:
      pymoo-psi solve bnh --points 256 --out front.csv
      pymoo-psi page front.csv --units f1=kg --limits "f1<=60"
    """


@_command(
    "_documents",
    _FILE,
    _option("port", "N", "Port [8741 or any].", type=_whole(0, 65535)),
    _flag("steer", text="Let the page steer the run."),
    _flag("no-browser", text="Only print the address."),
    _flag("attached", text="End with the standard input.", hidden=True),
)
def live() -> None:
    """Watch a study in the browser while it grows, and steer its run.

    FILE is a study, to which a run on this or another machine adds tests; the page shows them as
    they arrive. The first line printed is the address of the page. It contains a secret and works
    on this machine only. Ctrl-C ends the page; the run continues.

    Examples:
      pymoo-psi solve bnh --algorithm surrogate --points 64 --study bnh.db --live
      pymoo-psi live bnh.db --steer
    """


@_command(
    "_documents",
    _FILE,
    _TITLE,
    _option("question", "TEXT", "The question that the report answers."),
    _option("design", "NAME", "Name of the chosen design [that of the decision]."),
    _PROTOTYPE,
    _file("out", "FILE.html", "Write the report here.", default="report.html"),
    *_READING,
)
def report() -> None:
    """Report on the tests and the chosen design in one HTML file.

    FILE is a table or study (.csv, .json, .xlsx, .db), or a folder of shares.

    Examples:
      pymoo-psi solve bnh --points 256 --study bnh.db
      pymoo-psi report bnh.db --limits "f1<=60" --units f1=kg
    """


@_command(
    "_documents",
    _FILE,
    _file("out", "DIR", "Folder for tables (CSV) and figures (PNG)."),
    *_READING,
)
def analyze() -> None:
    """Analyze sensitivities, sections and convergence of tests.

    Sections through the chosen design show how each objective changes with one variable, as
    predicted by surrogates of the tests. Convergence shows whether the decision still changes with
    more tests.

    FILE is a table or study (.csv, .json, .xlsx, .db), or a folder of shares.

    Examples:
      pymoo-psi solve bnh --points 256 --study bnh.db
      pymoo-psi analyze bnh.db --limits "f1<=60" --out analysis
    """


@_command(
    "_experiments",
    _PROBLEM,
    click.Option(
        ["--evaluations", "--points"],
        metavar="N,N,…",
        help="Budgets [256,1024,4096; surrogate 64,128,256].",
        type=_COUNTS,
    ),
    _count("seeds", "N", "Runs of each algorithm that uses random numbers.", default=11),
    _option(
        "algorithms",
        "A,B,…",
        "Algorithms to compare: psi, psi-scrambled, surrogate, nsga3, psi+nsga3, nsga2, ….",
        default="psi,psi-scrambled,nsga3,psi+nsga3",
    ),
    _file("out", "DIR", "Folder for tables, a figure and runs [comparison_NAME]."),
    _JOBS,
)
def compare() -> None:
    """Compare PSI with NSGA-III and others at equal cost.

    PROBLEM and its arguments are those of solve. A later call continues from the finished runs in
    the folder.

    Examples:
      pymoo-psi compare bnh --evaluations 64,128 --seeds 2
      pymoo-psi compare dtlz2 --n-obj 4 --evaluations 64 --seeds 2 --out four
    """


@_command(
    "_documents",
    click.Argument(["sources"], nargs=-1, required=True, metavar="SOURCE…"),
    _file("out", "FILE", "File to write (.csv, .xlsx, .db); a study must be new.", required=True),
    *_READING,
)
def export() -> None:
    """Export tests as one table or study.

    SOURCE is a study, a folder of shares or a table. Several sources are parts of one run.

    Examples:
      pymoo-psi solve bnh --points 64 --study parts --share 1/2
      pymoo-psi solve bnh --points 64 --study parts --share 2/2
      pymoo-psi export parts --out whole.db
    """


@_command(
    "_experiments",
    _file("out", "DIR", "Folder for tables (CSV) and figures (PNG).", default="reproduction"),
    _count("points", "Q", "Test points per case.", default=4096),
    _names("mu", "MU", "Friction coefficient; may be repeated [0.2, 0.4, 0.6].", type=float),
    _choice("model", "full|rolling", "Model of the motion [both]."),
    _JOBS,
)
def reproduce() -> None:
    """Compute the tables and figures of the paper on the chute.

    Examples:
      pymoo-psi reproduce
      pymoo-psi reproduce --mu 0.3 --model full --points 1024 --out mu03
    """


@_command(
    "_console",
    click.Argument(["name"], default="index"),
    _flag("open", text="Open the page of the guide in the browser."),
)
def guide() -> None:
    """Print a guide, or the list of all guides.

    --open opens its page instead, if this folder or the checkout has the built site.

    Examples:
      pymoo-psi guide
      pymoo-psi guide tutorial
    """


def main(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code; a user's mistake never gives a traceback.

    Args:
        arguments: The words after ``pymoo-psi``.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="pymoo_psi")
    # Without any words click reports a mistake, code 2; here they ask for help, code 0.
    words = list(arguments) or ["--help"]
    try:
        with warnings.catch_warnings(), named_as(_typed_names(words), _options_of(words[0])):
            warnings.showwarning = _show_warning  # type: ignore[assignment]
            # app.main() would handle errors in its own way. The name is for
            # 'python -m pymoo_psi'.
            with app.make_context("pymoo-psi", words, obj=tuple(words)) as context:
                return int(app.invoke(context))
    except click.exceptions.Exit as end:  # --help, --version
        return end.exit_code
    except KeyboardInterrupt as interrupt:
        remark = [*interrupt.args, "no file is left half-written"][0]
        print_error(f"pymoo-psi: interrupted; {remark}")
        return _INTERRUPTED
    except (PsiError, click.ClickException, OSError, MemoryError) as error:
        # A message of pymoo or of a user's model may have several lines; scripts count on one.
        print_error(f"pymoo-psi: error: {' '.join(_message(error).split())}")
        return 2


def _message(error: Exception) -> str:
    """Return the message of an error that a user can mend."""
    if isinstance(error, click.ClickException):
        return error.format_message()
    if isinstance(error, MemoryError):
        return "out of memory; reduce --points"
    if isinstance(error, OSError) and not isinstance(error, PsiError):  # some are both
        return f"{error.filename or 'file'}: {error.strerror or error}"
    return str(error)


# Letters that some encodings lack, such as that of a pipe on Windows; arrows are directions.
_PLAIN = str.maketrans("↑↓\u00a0−—…“”", '^v --~""')


def _plain(error: Any) -> tuple[str, int]:
    """Return what is written for letters that the encoding of a stream lacks: like ones, or "?"."""
    text = error.object[error.start : error.end].translate(_PLAIN)
    return text.encode("ascii", "replace").decode("ascii"), error.end


codecs.register_error("pymoo_psi", _plain)

# Arguments of Python that have other names in a command.
_TYPED = {
    "problem": "PROBLEM",
    "study": "FILE",  # of live; another command has it as an option
    "n_points": "--points",
    "more": "--points +N",
    "n_evaluations": "--points",
    "n_jobs": "--jobs",
    "computed": "--compute",
}


def _typed_names(words: Sequence[str]) -> dict[str, str]:
    """Return the options that were typed, by the names of their arguments in Python."""
    names: dict[str, str] = {}
    for word in words:
        option, _, _ = word.partition("=")
        name = option.lstrip("-").replace("-", "_")
        names |= {name: option, f"n_{name}": option}
    return _TYPED | names


def _options_of(command: str) -> list[str]:
    """Return the names of the options of a command, if there is such a command."""
    params = getattr(app.commands.get(command), "params", ())
    return [str(param.name) for param in params]


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: object
) -> None:
    """Print a warning of this package in one line; print one of a user's model as Python does."""
    text = f"pymoo-psi: warning: {message}"
    if category is not UserWarning:
        text = warnings.formatwarning(message, category, filename, lineno).rstrip()
    print_error(text)


def printable(text: str) -> str:
    """Return a text, which may be untrusted, with "?" for characters that control a terminal."""
    return re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", "?", text)


def print_error(line: str) -> None:
    """Print a line on standard error, or nothing if that cannot be written to."""
    with suppress(OSError):  # the exit code still reports the error
        print(printable(line), file=sys.stderr, flush=True)


def run() -> None:
    """Entry point of the console script."""
    code = main(sys.argv[1:])
    try:
        sys.stdout.flush()
    except OSError:  # otherwise Python complains when it ends, and changes the exit code
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, sys.stdout.fileno())
    sys.exit(code)
