"""``pymoo-psi solve``: from the problem that a word names to its ranked Pareto set."""

from __future__ import annotations

import csv
import difflib
import importlib
import inspect
import io
import re
import shlex
import sys
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from functools import partial
from typing import Any

import numpy as np
import typer
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    Received,
    counted,
    integer,
    invalid,
    job_count,
    known_name,
    positive_number,
)
from pymoo_psi.algorithms import (
    Engine,
    QMCSampling,
    Recorded,
    RunOptions,
    by_number,
    nsga3,
    stored_at_termination,
)
from pymoo_psi.cli._app import Solve
from pymoo_psi.cli._output import keeping, progress, require_output, say, write_csv
from pymoo_psi.cli._rank import (
    designs_frame,
    most_violated,
    require_free_names,
    say_best,
)
from pymoo_psi.cli._source import NUMBER, counts_in, formulation_of, number_in, pairs_in
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, PsiError
from pymoo_psi.parallel import JoblibRunner
from pymoo_psi.problems import (
    FailureTolerant,
    Restricted,
    VectorizedSphereChute,
    design_space,
    problem_layout,
    problem_name,
)
from pymoo_psi.sequences import MAX_DIMENSIONS
from pymoo_psi.table import Formulation, TestTable, alike

_WRAPPED = "a model goes into the _evaluate of a class, as in the README and help(pymoo_psi.table)"
_FORMS = "'chute', the name of a pymoo test problem such as 'zdt1', or module:attribute"
_SHOWN = 12  # designs printed; all are in the file
_REASONS = 3  # of failures, the most frequent ones
_LONGEST = 120  # characters of a reason, so that three of them stay readable
_POINTS = {"psi": 4096, "surrogate": 256, "nsga3": 4096}

# What a search found: the tests, under what was asked (of NSGA-III the designs that it returned),
# how many designs were tested, stored before and failed, in words, and why they failed.
Found = tuple[TestTable, str, Collection[str]]


def run_solve(options: Solve) -> int:
    """Search, write the Pareto set if a file is named, and print the best-ranked designs.

    Returns:
        0, or 1 if no design is feasible.
    """
    algorithm, out = options.algorithm.value, options.out
    if options.points is None:
        options = replace(options, points=_POINTS[algorithm])
    points = integer("--points", options.points, minimum=1)
    run = _run_options(options)  # wrong ones are refused before a model is imported
    problem = load_problem(
        options.problem, options.context, options.jobs, options.timeout, options.box
    )
    target = require_output(out, (".csv",), options.study, by="solve", force=options.force)
    asked, space = formulation_of(options), design_space(problem)
    require_free_names((*problem_layout(problem, space).columns, *asked.computed))
    find = {"psi": _by_psi, "surrogate": _by_surrogate, "nsga3": _by_nsga3}[algorithm]
    with stored_at_termination(), keeping(partial(_kept, options)):
        table, counts, reasons = find(problem, points, options, run, asked)
    if not table.eligible().any():
        say(f"{problem_name(problem)}: no feasible design, {counts}")
        say(f"{most_violated(table)}.")
        for line in _failures(reasons):
            say(line)
        if out is not None:
            say(f"{out} is not written.")
        return 1
    rows, ranking = table.ranked(normalize=asked.normalize)
    designs = table.rows(rows)
    layout = designs.layout
    frame = designs_frame(designs, ranking, asked)
    constraints = [name for name in layout.constraints if name in frame]
    frame = frame[frame["pareto"]].drop(columns=["pareto", *constraints])
    if target is not None:  # before anything is printed, which may fail
        write_csv(frame, target, layout)
    size = counted(len(frame), "Pareto-optimal design")
    title = f"{problem_name(problem)} by {algorithm}: {size}, {counts}, best ranks first"
    say_best(frame.rename(columns=layout.label_of), _SHOWN, title, ranking, layout.units)
    if out is None and len(frame) > _SHOWN:
        say(f"({len(frame) - _SHOWN} more; --out FILE.csv writes all)")
    for line in (*table.remarks, *_failures(reasons)):
        say(line)
    if asked.limits and (box := feasible_box(table, problem)):
        say(f"Where the feasible designs lie: --box {shlex.quote(box)}")
    n_free = len(space.searched)
    if algorithm != "nsga3" and run.sampling is None and n_free > MAX_DIMENSIONS:
        say(f"More variables than LPτ has, {n_free}: the test points are Sobol' points of SciPy.")
    if out is not None:
        say(f"All {len(frame)} written to {out}")
    return 0


def _run_options(options: Solve) -> RunOptions:
    """Return the options of the run.

    Raises:
        ArgumentValueError: An option would have no effect, or cannot be read.
    """
    algorithm = options.algorithm.value
    # nsga3 and surrogate search by the problem's objectives; a table can be asked anything.
    formulated = ("objectives", "maximize", "compute", "relax", "formulation", "share")
    for name in (*formulated, "limits", "sampling"):
        algorithms = ("psi",) if name in formulated else ("psi", "surrogate")
        if getattr(options, name) not in (None, "lptau") and algorithm not in algorithms:
            option, rule = f"--{name}", f"used with --algorithm {' or '.join(algorithms)}"
            remedy = f"keep the tests by --study FILE.db, then pymoo-psi rank FILE.db {option}"
            raise invalid(option, rule, algorithm, "" if name in ("share", "sampling") else remedy)
    for name in ("share", "study_key", "retry"):
        if getattr(options, name) is not None and options.study is None:
            option = f"--{name.replace('_', '-')}"
            raise invalid(option, "used with --study", Received("no --study"))
    retry: Any = options.retry or ()
    if retry and retry != "failed":
        retry = counts_in("--retry", retry, "'failed' or numbers of test points, such as 1,2,3")
    share = None
    if options.share is not None:
        found = re.fullmatch(r"([1-9][0-9]{0,8})/([1-9][0-9]{0,8})", options.share.strip())
        if not found or int(found[1]) > int(found[2]):
            raise invalid("--share", "k/n, the k-th of n parts, such as 3/64", options.share)
        share = int(found[1]), int(found[2])
    sampling = options.sampling.value
    return RunOptions(
        sampling=None if sampling == "lptau" else QMCSampling(sampling),
        seed=integer("--seed", options.seed, minimum=0),
        share=share,
        study=options.study,
        study_key=options.study_key,
        retry=retry,
    )


def _kept(options: Solve) -> str:
    """Say what of an interrupted run is kept, and how it goes on."""
    if options.study is None:
        return "nothing is kept; with --study FILE.db the same command continues"
    if not options.study.exists():
        return "no design was tested"
    # What is in the file is counted, not what the bar has shown.
    stored = len(TestTable.read_study(options.study))
    of = "" if options.algorithm.value == "nsga3" else f" of {options.points}"
    return f"{stored}{of} designs are in {options.study}; the same command continues"


def _counting(show: Callable[..., None], asked: Formulation) -> Callable[[TestTable], int]:
    """Return a function that shows more tests and returns their number so far.

    A column that they lack is refused at the first of them.
    """
    statuses: Counter[str] = Counter()

    def count(tests: TestTable) -> int:
        statuses.update(_under(tests, asked).status.tolist())
        show(statuses.total(), f"{statuses['ok']} feasible, {statuses['failed']} failed")
        return statuses.total()

    return count


def _under(tests: TestTable, asked: Formulation) -> TestTable:
    # Of tests that all failed, as the first ones may, it is unknown which outputs they have.
    return tests if (tests.status == "failed").all() else tests.under(asked)


def _by_psi(
    problem: Problem, points: int, options: Solve, run: RunOptions, asked: Formulation
) -> Found:
    # On arrays, not by `PSI`: pymoo's objects for a million designs take minutes. Blocks are so
    # small that the bar moves; a problem of one design at a time has a runner with the jobs.
    run = replace(run, block_size=min(65_536, max(64, -(-points // 32))))
    engine = Engine(problem, points, run, n_jobs=1 if problem.elementwise else options.jobs)
    tables, n_new = [engine.table], 0
    with progress("psi", len(engine.points)) as show, closing(engine.tests()) as blocks:
        count = _counting(show, asked)
        for tests, called in blocks:
            count(tests)
            tables.append(tests)
            n_new += int(called.sum())
    return _found(by_number(tables), asked, n_new)


def _by_surrogate(
    problem: Problem, points: int, options: Solve, run: RunOptions, asked: Formulation
) -> Found:
    from pymoo_psi.algorithms import SurrogatePSI  # brings half of SciPy, a second

    algorithm = SurrogatePSI(
        points,
        limits=asked.limits,
        sampling=run.sampling,
        study=run.study,
        study_key=run.study_key,
        retry=run.retry,
    )
    with progress("surrogate", points) as show:
        count, shown = _counting(show, asked), 0

        def callback(now: SurrogatePSI) -> None:
            nonlocal shown
            shown = count(now.table.rows(np.arange(shown, now.n_tested)))

        done = minimize(problem, algorithm, seed=run.seed, callback=callback).algorithm
    return _found(done.table, asked, done.evaluator.n_eval)


def _found(tests: TestTable, asked: Formulation, n_new: int) -> Found:
    """Return what tests give, of which ``n_new`` were evaluated now, the others before."""
    table = _under(tests, asked)
    failed = int((table.status == "failed").sum())
    n_designs = len(table) - np.count_nonzero(table.repeats)
    different = f", {n_designs} different designs" if n_designs < len(table) else ""
    stored = f", {n_designs - n_new} of them from the study" if n_new < n_designs else ""
    counts = f"{len(table)} tested{different}{stored}" + (f", {failed} failed" if failed else "")
    return table, counts, table.reasons.values()


def _by_nsga3(
    problem: Problem, points: int, options: Solve, run: RunOptions, asked: Formulation
) -> Found:
    # A design that fails must neither end the run nor give NSGA-III a NaN to sort.
    searched: Any = FailureTolerant(problem)
    if run.study is not None:
        searched = Recorded(searched, study=run.study, study_key=run.study_key, retry=run.retry)
    with progress("nsga3", points) as show:

        def callback(algorithm: Any) -> None:
            show(algorithm.evaluator.n_eval)

        result = nsga3(searched, n_evaluations=points, seed=run.seed, callback=callback)
    reasons = tuple(failure.reason for failure in searched.failures)
    stored = 0 if run.study is None else points - searched.n_evaluated
    counts = f"{points} evaluated" + (f", {stored} of them from the study" if stored else "")
    counts += f", {len(reasons)} failed" if reasons else ""
    # pymoo has no F where no design is feasible.
    last = result.pop if result.F is None else result.opt
    if run.study is not None:
        table = searched.table
        return table.rows(np.isin(table.numbers, last.get("test_point"))), counts, reasons
    X, F, G, H, failures = last.get("X", "F", "G", "H", "failure")
    numbers, space = np.arange(1, len(F) + 1), design_space(problem)
    # The last constraint is the one that FailureTolerant has added.
    table = TestTable.of(
        numbers, space.to_matrix(X), F, G[:, :-1], H,
        reasons={n: why for n, why in zip(numbers.tolist(), failures, strict=True) if why},
        layout=replace(problem_layout(problem, space), label="row"),
        extra={"row": numbers.astype(object)},
    )  # fmt: skip
    return table, counts, reasons


def _failures(reasons: Iterable[str]) -> list[str]:
    """Say in a line why designs failed, the most frequent reason first; nothing if none did."""
    counts = Counter(alike(reasons))
    if not counts:
        return []
    top, half = counts.most_common(_REASONS), _LONGEST // 2
    # Without its middle: the error is in front, and often the cause at its end.
    shown = [
        f"{n} × {why if len(why) <= _LONGEST else f'{why[:half].rstrip()}…{why[-half:]}'}"
        for why, n in top
    ]
    if rest := counts.total() - sum(n for _, n in top):
        shown.append(f"{rest} × {counted(len(counts) - len(top), 'other reason')}")
    return [f"Failed: {'; '.join(shown)}"]


def load_problem(
    name: str,
    context: typer.Context,
    jobs: int = 1,
    timeout: float | None = None,
    box: Sequence[str] | None = None,
) -> Problem:
    """Return the problem that a word names, ready to be evaluated by ``jobs`` processes.

    Args:
        name: ``chute``, a name known to ``pymoo.problems.get_problem``, or ``module:attribute``
            where the attribute is a problem, or a class or function that gives one. The working
            directory is searched for the module first.
        context: The command's; options that it does not know are arguments of the problem.
        jobs: Processes for a problem that evaluates one design at a time; others use one.
        timeout: Seconds that a design of such a problem may take, if there is a limit.
        box: The part of its bounds that is meant, as it is typed; the whole unless given.

    Raises:
        PsiError: There is no such problem, or it cannot be made, or not be given a time limit.
    """
    jobs, given = job_count("--jobs", jobs), _arguments_in(context.args)
    own = [option for parameter in context.command.params for option in parameter.opts]
    if timeout is not None:
        positive_number("--timeout", timeout)
    if name == "chute":
        problem = _made(name, VectorizedSphereChute, VectorizedSphereChute, given, own)
    elif ":" in name:
        found = _attribute(name)
        problem = _made(name, found, found, given, own)
    else:
        kind = _kind_of_pymoo(name)
        from pymoo.problems import get_problem

        problem = _made(name, partial(get_problem, name), kind, given, own)
    if problem.n_obj < 1 or problem.n_var < 1:
        rule = "a problem with one variable and one objective or more"
        raise invalid("PROBLEM", rule, Received(name))
    try:
        problem_layout(problem, design_space(problem))
    except (ArgumentValueError, ArgumentTypeError) as error:
        raise ArgumentValueError(f"PROBLEM {name}: {error}") from error
    if problem.elementwise and (jobs != 1 or timeout is not None):
        # A model may end its process, and must not end this one.
        problem.elementwise_runner = JoblibRunner(n_jobs=jobs, timeout=timeout, in_process=False)
    elif timeout is not None:
        shown = Received(f"{problem_name(problem)}, which takes many at once")
        rule = "a problem that evaluates one design at a time where --timeout is given"
        raise invalid("PROBLEM", rule, shown)
    return Restricted(problem, _box_in(box, problem)) if box else problem


def _arguments_in(words: Sequence[str]) -> dict[str, str]:
    """Return the values of options by name, each behind it or its sign of equality."""
    given: dict[str, str] = {}
    rest = list(words)
    while rest:
        name, equals, value = rest.pop(0).partition("=")
        if not name.startswith("--") or name in given:
            raise PsiError(f"Unexpected argument: {name}; each option is given once")
        given[name] = value if equals else rest.pop(0) if rest else ""
    return given


def _kind_of_pymoo(name: str) -> type[Problem]:
    """Return the class of a test problem of pymoo."""
    from pymoo.problems import get_problem, many, multi, single

    # pymoo's names are mostly those of the classes; its own list of them cannot be read.
    classes = {
        found.__name__.lower(): found
        for module in (single, multi, many)
        for found in vars(module).values()
        if isinstance(found, type) and issubclass(found, Problem)
    }
    if name.lower() in classes:
        return classes[name.lower()]
    try:
        return type(get_problem(name))
    except Exception as error:  # pymoo raises bare exceptions of many kinds here
        near = difflib.get_close_matches(name.lower(), ["chute", *classes], n=1)
        remedy = f"did you mean {near[0]!r}?" if near else f"pymoo says: {error}"
        if name.endswith(".py"):
            remedy = f"of a class Beam in it say {name.removesuffix('.py')}:Beam"
        raise invalid("PROBLEM", _FORMS, name, remedy) from error


def _attribute(name: str) -> Any:
    """Return what ``module:attribute`` names."""
    module, _, attribute = name.partition(":")
    if "" not in sys.path:  # an installed command has its own folder there, not the user's
        sys.path.insert(0, "")
    try:
        value: Any = importlib.import_module(module)
        for part in attribute.split("."):
            value = getattr(value, part)
    # Whatever the user's module does: its sys.exit() would end this command with a code of its own.
    except (Exception, SystemExit) as error:
        if isinstance(error, PsiError):  # its message stands for itself
            raise
        reason = f"{type(error).__name__}: {error}"
        if "/" in module or module.endswith(".py"):  # a file, which is no module's name
            folder, slash, file = module.rpartition("/")
            reason = f"say {file.removesuffix('.py')}:{attribute}"
            reason += f" in the folder {folder or slash}" if slash else ""
        raise invalid("PROBLEM", "a module:attribute that gives a problem", name, reason) from error
    return value


def _made(name: str, make: Any, kind: Any, given: Mapping[str, str], own: Sequence[str]) -> Problem:
    """Return a problem, or what a class or function makes with the options.

    Args:
        name: What was typed for it.
        make: The problem, or what is called with the options.
        kind: The class or function whose arguments these are.
        given: The options.
        own: Names of the command's options, one of which may be meant.
    """
    known = {f"--{word.replace('_', '-')}": word for word in _arguments(kind)}
    for option in given:
        if option not in known:
            near = difflib.get_close_matches(option, [*known, *own], n=1, cutoff=0.7)
            meant = f"did you mean {near[0]}? " if near else ""
            taken = ", ".join(known) or "none"
            raise PsiError(f"No such option: {option}; {meant}arguments of {name}: {taken}")
    values = {known[option]: _value_in(text) for option, text in given.items()}
    try:
        problem = make if isinstance(make, Problem) else make(**values)
        if isinstance(problem, Problem):
            problem_name(problem)  # the user's too, and needed in messages later on
    except (Exception, SystemExit) as error:
        if isinstance(error, PsiError):
            raise
        reason = f"{type(error).__name__}: {error}"
        reason += f"; its arguments: {', '.join(known)}" if known else f"; {_WRAPPED}"
        raise invalid("PROBLEM", "one that can be made", name, reason) from error
    if not isinstance(problem, Problem):
        received = f"got {problem!r:.80}; {_WRAPPED}"
        raise ArgumentTypeError(f"PROBLEM {name} must give a pymoo Problem, {received}")
    return problem


def _value_in(text: str) -> Any:
    """Return a number, a list of them with commas, a truth value, or the text as it is."""
    if "," in text:
        return [_value_in(part) for part in text.split(",")]
    if text in ("True", "False"):
        return text == "True"
    if re.fullmatch(r"[+-]?[0-9]{1,18}", text):
        return int(text)
    return float(text) if re.fullmatch(NUMBER, text) else text


def _arguments(kind: Any) -> list[str]:
    """Return the names of the arguments of a class or function, also those it passes on."""
    if isinstance(kind, Problem) or not callable(kind):
        return []
    # What a class takes as **kwargs goes to its base, up to pymoo's, whose are no user's options.
    calls = [kind]
    if isinstance(kind, type):
        bases = [each for each in kind.__mro__ if each.__module__ != Problem.__module__]
        calls = [vars(each)["__init__"] for each in bases if "__init__" in vars(each)]
    names: list[str] = []
    for call in calls:
        try:
            parameters = inspect.signature(call).parameters.values()
        except (TypeError, ValueError):  # a built-in one that does not tell
            break
        names += [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
        if not any(p.kind is p.VAR_KEYWORD for p in parameters):
            break
    return [name for name in dict.fromkeys(names) if name != "self"]


def _box_in(entries: Sequence[str], problem: Problem) -> dict[str, Any]:
    """Return a part of the bounds as :class:`~pymoo_psi.Restricted` takes it.

    Each entry is ``name=lower:upper``, of which either may be missing, ``name=value``, or for a
    choice ``name=option|option``.
    """
    space = design_space(problem)
    variables = dict(zip(problem_layout(problem, space).variables, space.variables, strict=True))
    form = "variable=lower:upper or variable=value"
    box: dict[str, Any] = {}
    for name, text in pairs_in("--box", entries, form, variables).items():
        variable = variables[name]
        if variable.kind in (Kind.CHOICE, Kind.BINARY):
            options = variable.options if variable.kind is Kind.CHOICE else (False, True)
            words = {str(option): option for option in options}
            parts = [text] if text in words else map(str.strip, text.split("|"))
            chosen = [words[known_name("--box", word, words)] for word in parts]
            box[name] = chosen if len(chosen) > 1 else chosen[0]
        else:
            ends = [number_in("--box", e, form) if e.strip() else None for e in text.split(":")]
            if len(ends) > 2:
                raise invalid("--box", form, text)
            box[name] = tuple(ends) if len(ends) == 2 else ends[0]
    return box


def feasible_box(table: TestTable, problem: Problem) -> str:
    """Return where the feasible designs lie, as ``--box`` takes it; empty if everywhere.

    Bounds are rounded outwards. What the box of the problem fixes, or leaves of a choice, stays.
    """
    given, parts = getattr(problem, "box", {}), []
    space, layout = design_space(problem), table.layout
    variables = dict(zip(problem_layout(problem, space).variables, space.variables, strict=True))
    for name, low, high in zip(layout.variables, *table.refined_bounds(), strict=True):
        variable, own = variables[name], given.get(name)
        if own is not None and not isinstance(own, tuple):
            parts.append(f"{name}={'|'.join(map(str, own if isinstance(own, list) else [own]))}")
        elif low < high:  # not so of choices, where they are NaN, and of fixed variables
            least, most = Decimal(float(low)), Decimal(float(high))
            grid = Decimal(1).scaleb((most - least).adjusted() - 3)
            first = float((least / grid).to_integral_value(ROUND_FLOOR) * grid)
            last = float((most / grid).to_integral_value(ROUND_CEILING) * grid)
            ends = max(first, float(variable.lower)), min(last, float(variable.upper))
            if own is not None or ends != (variable.lower, variable.upper):
                parts.append(f"{name}={':'.join(repr(end).removesuffix('.0') for end in ends)}")
    line = io.StringIO()
    csv.writer(line, lineterminator="").writerow(parts)
    return line.getvalue()
