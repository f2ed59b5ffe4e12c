"""``pymoo-psi ask`` and ``tell``: tests that people make."""

from __future__ import annotations

import shlex

from pymoo_psi._output import with_unit
from pymoo_psi._validation import Received, counted, invalid
from pymoo_psi.algorithms import RunOptions, ask_tests, tell_tests
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._console import require_output, say, write_frame
from pymoo_psi.cli._problem import load_problem
from pymoo_psi.cli._solve import import_into_study
from pymoo_psi.cli._source import counts_in
from pymoo_psi.study import Study
from pymoo_psi.table import suffixes_for


def run_ask(options: Options) -> int:
    """Write designs to test into a new file.

    Returns:
        0.
    """
    if options.study is None:
        raise invalid("--study", "the name of a study, which keeps the tests", Received("none"))
    problem = load_problem(options.problem, box=options.box, log=options.log)
    out = require_output(options.out, suffixes_for("designs"), options.study)
    if out is None or out.exists():
        # It may hold results that nobody has told yet.
        raise invalid("--out", "the name of a new file", str(options.out))
    run = RunOptions(study=options.study, study_key=options.study_key, seed=options.seed)
    if getattr(options, "from") is not None:
        import_into_study(problem, options, run)
    with_surrogates = options.algorithm == "surrogate"
    frame = ask_tests(problem, options.points, run, with_surrogates=with_surrogates)
    units = Study(options.study).facts().head.get("units", {})
    write_frame(frame.rename(columns=lambda name: with_unit(name, units.get(name, ""))), out)
    study, file = shlex.quote(str(options.study)), shlex.quote(str(options.out))
    say(f"{counted(len(frame), 'design')} to test in {options.out}.")
    say(f"With results, or why a test failed: pymoo-psi tell {file} --study {study}")
    return 0


def run_tell(options: Options) -> int:
    """Take results into a study, or withdraw and cancel tests.

    Returns:
        0.
    """
    sentences = tell_tests(
        options.file,
        options.study,
        withdraw=counts_in("--withdraw", options.withdraw, "numbers of tests, such as 12,15"),
        cancel=counts_in("--cancel", options.cancel, "numbers of tests, such as 12,15"),
        decimal=options.decimal,
        sheet=options.sheet,
    )
    say(*sentences)
    return 0
