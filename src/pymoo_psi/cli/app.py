"""The command ``pymoo-psi``: what it consists of, and how it ends.

Exit codes: 0 success, 1 the results are not what they must be, 2 wrong usage or input (one line
says what), 130 interrupted.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer

from pymoo_psi.cli.file_commands import export, page, rank
from pymoo_psi.cli.problem_commands import compare, reproduce, solve
from pymoo_psi.errors import PsiError

__all__ = ["app", "main", "run"]

app = typer.Typer(
    name="pymoo-psi",
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_INTERRUPTED = 130  # 128 and the number of the signal, as shells have it

# The base of all usage errors of the click that typer carries or depends on.
_ClickException: Any = typer.BadParameter.__mro__[2]


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"pymoo-psi {version('pymoo-psi')}")
        raise typer.Exit


@app.callback()
def _command(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print it, exit."),
    ] = False,
) -> None:
    """Parameter Space Investigation and decision-making on Pareto sets, for pymoo."""


for _function in (reproduce, solve, compare, export, rank, page):
    app.command()(_function)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code, and never a traceback for a user's mistake.

    Args:
        arguments: The words after ``pymoo-psi``; those of the process by default.
    """
    try:
        words = list(sys.argv[1:] if arguments is None else arguments)
        code = app(args=words or ["--help"], standalone_mode=False, prog_name="pymoo-psi")
    except PsiError as error:
        message = str(error)
    except _ClickException as error:
        message = error.format_message()
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
    print(f"pymoo-psi: error: {' '.join(message.split())}", file=sys.stderr)
    return 2


def _interrupted() -> int:
    print("pymoo-psi: interrupted", file=sys.stderr)
    return _INTERRUPTED


def run() -> None:
    """Entry point of the console script."""
    sys.exit(main())
