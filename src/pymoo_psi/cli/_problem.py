"""From the argument PROBLEM to a problem: a test problem, a class, or a program's TOML file."""

from __future__ import annotations

import ast
import asyncio
import importlib
import inspect
import logging
import re
import shlex
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
from pymoo.core.problem import Problem

from pymoo_psi._kinds import Kind, named_option, option_text
from pymoo_psi._output import with_unit
from pymoo_psi._validation import (
    Names,
    Received,
    Values,
    instance,
    invalid,
    known_name,
    positive_number,
)
from pymoo_psi.cli._app import Options, print_error
from pymoo_psi.cli._console import command, print_columns, say, say_next
from pymoo_psi.cli._source import pairs_in, typed_options
from pymoo_psi.errors import PsiError
from pymoo_psi.parallel import ExecutorRunner, Runner, one_line, runner_of_jobs
from pymoo_psi.problems import (
    ProgramProblem,
    Required,
    Restricted,
    VectorizedSphereChute,
    design_space,
    layers,
    problem_name,
    streams,
    without_requirements,
)
from pymoo_psi.table import entries_of

# Options that a command must repeat to continue a run.
_OF_RUN = ("sampling", "seed", "bounds", "log", "noisy", "study_key", "timeout", "jobs")
_REMEDY = "a model goes into the _evaluate of a class, as in help(pymoo_psi.table)"
_NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
_CONNECTING = 10  # seconds for a scheduler to answer
_PAUSE = 0.3  # seconds between two looks whether workers have joined


def load_problem(
    options: Options,
    timeout: float | None = None,
    *,
    bounds: Names = (),
    log: Names = (),
    noisy: bool = False,
) -> Problem:
    """Return the problem of the argument PROBLEM.

    That is ``chute``, a name known to ``pymoo.problems.get_problem``, the file of a program, or
    ``module:attribute`` where the attribute is a problem, or a class or function that returns one.
    The working directory is searched for the module first. Options that the command does not have
    are arguments of the problem.

    Args:
        options: The options of the command.
        timeout: Seconds allowed for a design, if limited; a program keeps this limit itself.
        bounds: Entries of ``--bounds``, narrower ones.
        log: Variables on a logarithmic scale; by default those that the problem names.
        noisy: Whether the problem is noisy, whatever it says.

    Raises:
        PsiError: There is no such problem, or it cannot be constructed.
    """
    name = options.problem
    source = _source(name)
    if timeout is not None:
        positive_number("--timeout", timeout)
        if name.endswith(".toml") and not source.by_people:
            # The program's own limit, so that its folder is kept and named in the reason.
            source.program = replace(source.program, timeout=timeout)
    problem = _construct(options, source)
    if problem.n_var < 1:  # pymoo's -1 if a problem gives none
        raise invalid("PROBLEM", "a problem with one variable or more", Received(name))
    if log:
        problem.log = entries_of(log)
    if noisy:
        if not streams(without_requirements(problem)):  # refused before a study is made
            rule = "left out for a problem that is called for many designs at once"
            raise invalid("--noisy", rule, Received(name), "make it an ElementwiseProblem")
        problem.noisy = True
    layers(problem)[-1].command_words = _command_words(options)
    if not bounds:
        return problem
    return Restricted(problem, _bounds_in(bounds, problem))


def _command_words(options: Options) -> str:
    """Return the command, without what may differ when its run is continued."""
    context = options.context
    words = [str(context.info_name), options.problem, *context.args]
    return shlex.join([*words, *typed_options(options, _OF_RUN)])


def _source(name: str) -> Any:
    """Return the class, function or problem of a name."""
    if name == "chute":
        return VectorizedSphereChute
    if name.endswith(".toml"):
        return ProgramProblem.from_toml(Path(name).expanduser())
    if ":" in name:
        return _attribute(name, "PROBLEM", "a module:attribute that gives a problem")
    return _test_problem(name)


def _test_problem(name: str) -> type[Problem]:
    """Return the class of a test problem of pymoo."""
    from pymoo.problems import get_problem

    # get_problem knows more names, but constructs problems without their arguments.
    for package in ("single", "multi", "many"):
        module = importlib.import_module(f"pymoo.problems.{package}")
        for title, value in vars(module).items():
            is_named = title.lower() == name.lower()
            if is_named and isinstance(value, type) and issubclass(value, Problem):
                return value
    try:
        return type(get_problem(name))
    except Exception as error:  # pymoo raises bare exceptions of many kinds here
        forms = "'chute', a test problem of pymoo, module:attribute (beam:Beam), or a FILE.toml"
        raise invalid("PROBLEM", forms, name) from error


def _attribute(name: str, argument: str, rule: str) -> Any:
    """Return the value of ``module:attribute``.

    Args:
        name: The text.
        argument: What was given by it, for the message.
        rule: What it has to be, for the message.
    """
    module, _, attribute = name.partition(":")
    if "" not in sys.path:  # an installed command has its own folder there, not the user's
        sys.path.insert(0, "")
    try:
        value = importlib.import_module(module)
        for part in attribute.split("."):
            value = getattr(value, part)
        return value
    except PsiError:  # its message is complete
        raise
    # A user's module may do anything; its sys.exit() would end this command with another code.
    except (Exception, SystemExit) as error:
        remedy = f"a file's name without .py, in its folder; {type(error).__name__}: {error}"
        raise invalid(argument, rule, name, remedy) from error


def _construct(options: Options, source: Any) -> Problem:
    """Return the problem that a class or function returns, or the problem itself.

    Args:
        options: The options of the command.
        source: The class, function or problem.
    """
    if isinstance(source, Problem):
        _arguments(options, [])  # it has none: any is refused
        return source
    remedy = _REMEDY
    try:
        parameters = inspect.signature(source).parameters.values()
        names = [parameter.name for parameter in parameters if parameter.kind in _NAMED]
        if names:
            remedy = f"its arguments: {', '.join(names)}"
        problem = source(**_arguments(options, names))
        problem_name(problem)  # a method of pymoo, which may raise
    except PsiError:
        raise
    except (Exception, SystemExit) as error:
        reason = f"{type(error).__name__}: {error}; {remedy}"
        rule = "one that can be constructed"
        raise invalid("PROBLEM", rule, options.problem, reason) from error
    return instance(f"PROBLEM {options.problem}", problem, Problem, _REMEDY)


def _arguments(options: Options, names: Names) -> Values:
    """Return the arguments of a problem by name from the options that the command does not have."""
    problem = options.problem
    context = options.context
    # With the command's own options click can suggest one of them for a misspelt name.
    own = [param for param in context.command.params if not param.required]
    further = [click.Option([f"--{name.replace('_', '-')}", name]) for name in names]
    parser = click.Command(problem, params=[*own, *further])
    try:
        texts = parser.make_context(problem, [*context.args]).params
    except click.UsageError as error:
        message = error.format_message().rstrip(".")
        listed = ", ".join(option.opts[0] for option in further) or "none"
        raise PsiError(f"{message}; arguments of {problem}: {listed}") from None
    arguments = {}
    for name in names:
        if texts[name]:
            arguments[name] = _literal(texts[name])
    return arguments


def _literal(text: str) -> Any:
    """Return the Python value of a text, such as a number or a list, or the text itself."""
    try:
        return ast.literal_eval(text.strip())
    except (ValueError, SyntaxError):
        return text


def runner_of(problem: Problem, options: Options) -> Runner | None:
    """Return the runner of a problem that ``--jobs``, ``--timeout`` and ``--cluster`` ask for.

    Raises:
        PsiError: The options contradict each other, or there is no such cluster.
    """
    timeout = options.timeout
    if not problem.elementwise and timeout is not None:
        received = Received(f"{problem_name(problem)}, which takes many at once")
        rule = "a problem that evaluates one design at a time if --timeout is given"
        raise invalid("PROBLEM", rule, received)
    if not problem.elementwise and options.cluster is not None and options.algorithm != "psi":
        rule = "used with --algorithm psi if a problem takes many designs at once"
        raise invalid("--cluster", rule, options.algorithm)
    if isinstance(layers(problem)[-1], ProgramProblem):
        timeout = None  # the program's own
    if options.cluster is not None:
        return _cluster_runner(options.cluster, timeout)
    if options.jobs == 1 and timeout is None:
        return None
    return runner_of_jobs(options.jobs, timeout)  # other processes, as a model may end its own


def _cluster_runner(place: str, timeout: float | None) -> Runner:
    """Return a runner on a cluster that has a worker; until it has one, a line says so.

    Args:
        place: The address of a scheduler of Dask, the name of its file, or ``module:attribute``
            where the attribute is an executor, a cluster of Dask, a runner, or a function that
            returns one of these.
        timeout: Seconds allowed for a design, if limited.
    """
    cluster: Any = place
    if re.fullmatch(r"[\w.]+:[A-Za-z_][\w.]*", place):
        rule = "a module:attribute that gives an executor, a cluster of Dask or a runner"
        cluster = _attribute(place, "--cluster", rule)
        if callable(cluster) and not isinstance(cluster, Runner):
            cluster = cluster()
        if isinstance(cluster, Runner):
            return cluster
    if not hasattr(cluster, "submit"):
        cluster = _dask_client(cluster)
    runner = ExecutorRunner(cluster, timeout=timeout)
    if runner.n_workers == 0:
        print_error(f"pymoo-psi: {place} has no workers yet; waiting for the first one")
        while runner.n_workers == 0:
            time.sleep(_PAUSE)
    return runner


def _dask_client(cluster: Any) -> Any:
    """Return a client of Dask for a cluster, an address, or the file of a scheduler."""
    try:
        distributed = importlib.import_module("distributed")
    except ImportError as error:
        remedy = "pip install 'pymoo-psi[cluster]'"
        raise PsiError(f"--cluster needs dask.distributed: {remedy}") from error
    # The run reports a lost scheduler as an error in one line; Dask's own log is left out.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    argument = "address"
    if isinstance(cluster, str) and Path(cluster).is_file():
        argument = "scheduler_file"
    try:
        return distributed.Client(**{argument: cluster}, timeout=_CONNECTING)
    except (OSError, TypeError, ValueError, asyncio.TimeoutError) as error:
        rule = "the address or the file of a running scheduler of Dask, or a module:attribute"
        raise invalid("--cluster", rule, cluster, one_line(error)) from error


def _bounds_in(entries: Names, problem: Problem) -> Values:
    """Return narrowed bounds as :class:`~pymoo_psi.Restricted` takes them.

    Each entry is ``name=lower:upper``, where one of the two may be missing, ``name=value``, or for
    a choice ``name=option|option``.
    """
    variables = {variable.title: variable for variable in design_space(problem).variables}
    form = "variable=lower:upper or variable=value"
    bounds: Values = {}
    for name, text in pairs_in("--bounds", entries, form).items():
        variable = variables[known_name("--bounds", name, variables)]
        if variable.kind is Kind.CHOICE:
            options = {option_text(option): option for option in variable.options}
            words = [named_option(f"--bounds {name}", word, options) for word in text.split("|")]
            bounds[name] = [options[word] for word in words]
        elif ":" in text:
            ends = [_literal(end) for end in text.split(":")]
            bounds[name] = tuple(None if end == "" else end for end in ends)
        else:
            bounds[name] = _literal(text)
    return bounds


def write_example(name: str) -> int:
    """Write the commented example of a program's file, unless the file exists."""
    from importlib.resources import files

    path = Path(name).expanduser()
    if path.exists() or path.suffix != ".toml":
        rule = "used with a new file of the suffix .toml, such as bracket.toml"
        raise invalid("--new", rule, name, "an existing file is not overwritten")
    text = files("pymoo_psi.problems").joinpath("program.toml").read_text(encoding="utf-8")
    path.write_text(text.replace("bracket", path.stem), encoding="utf-8")
    say(
        f"{path} written. Its template is a folder 'model' beside it: make it, with the files that "
        f"your program needs. Edit {path.name}."
    )
    say_next(command("pymoo-psi", "solve", name, "--try"))
    return 0


def try_program(problem: Any, options: Options) -> int:
    """Run a program once, for a design in the middle of the bounds, and print what it gives.

    Args:
        problem: The problem of the program.
        options: The options of the command.

    Returns:
        0, or 1 if something is wrong.
    """
    if not isinstance(layers(problem)[-1], ProgramProblem):
        raise invalid("--try", "used with the FILE.toml of a program", problem_name(problem))
    design = _trial_design(problem)
    run = problem.run(design, keep=True)
    say(f"Command: {shlex.join(run.words)}")
    say(f"Folder: {run.folder}")
    for line in run.filled:
        say(f"Filled: {line}")
    values = {**design, **run.outputs}
    names = [with_unit(name, problem.units.get(name, "")) for name in values]
    print_columns([("column", names), ("value", values.values())], "Variables and outputs")
    say(f"Took {run.seconds:.1f} s.")
    for flaw in run.flaws:
        say(f"Wrong: {flaw}")
    if run.flaws:
        return 1
    say("Nothing is wrong.")
    words = [word for word in options.context.obj if word != "--try"]
    if options.study is None:
        words += ["--study", f"{Path(options.problem).stem}.db"]
    say_next(command("pymoo-psi", *words))
    return 0


def _trial_design(problem: Any) -> Values:
    """Return the middle of the bounds; equalities hold."""
    space = design_space(Required(problem))
    designs = space.matrix(np.full((1, len(space.searched)), 0.5))
    return dict(zip(problem.variables, designs[0].tolist(), strict=True))
