"""From the word after ``solve`` to a problem: a test problem, a class, a program's TOML file."""

from __future__ import annotations

import ast
import difflib
import importlib
import inspect
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd
from pymoo.core.problem import Problem

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, invalid, job_count, positive_number
from pymoo_psi.cli._output import print_frame, say
from pymoo_psi.cli._source import names_in, number_in, pairs_in
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, PsiError
from pymoo_psi.parallel import JoblibRunner
from pymoo_psi.problems import (
    ProgramProblem,
    Required,
    Restricted,
    VectorizedSphereChute,
    design_space,
    problem_layout,
    problem_name,
)

_WRAPPED = "a model goes into the _evaluate of a class, as in the README and help(pymoo_psi.table)"


def load_problem(
    name: str,
    jobs: int = 1,
    timeout: float | None = None,
    *,
    box: Sequence[str] = (),
    log: Sequence[str] = (),
) -> Problem:
    """Return the problem that a word names, ready to be evaluated by ``jobs`` processes.

    Options that the running command does not know are arguments of the problem.

    Args:
        name: ``chute``, a name known to ``pymoo.problems.get_problem``, the file of a program, or
            ``module:attribute`` where the attribute is a problem, or a class or function that gives
            one. The working directory is searched for the module first.
        jobs: Processes for a problem that evaluates one design at a time; others use one.
        timeout: Seconds that a design of such a problem may take, if there is a limit.
        box: The part of its bounds that is meant, as it is typed; the whole unless given.
        log: Variables of logarithmic scale; those that the problem names unless given.

    Raises:
        PsiError: There is no such problem, or it cannot be made, or not be given a time limit.
    """
    jobs = job_count("--jobs", jobs)
    if timeout is not None:
        positive_number("--timeout", timeout)
    if name == "chute":
        kind: Any = VectorizedSphereChute
    elif name.endswith(".toml"):
        kind = ProgramProblem.from_toml(Path(name).expanduser())
        if timeout is not None:  # so its folder is kept, and named in the reason
            kind.program, timeout = replace(kind.program, timeout=timeout), None
    else:
        kind = _attribute(name) if ":" in name else _test_problem(name)
    problem = _made(name, kind)
    if problem.n_var < 1:  # pymoo's -1 of a problem that names none
        raise invalid("PROBLEM", "a problem with one variable or more", Received(name))
    try:
        if log:
            problem.log = names_in(log)
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


def _test_problem(name: str) -> type[Problem]:
    """Return the class of a test problem of pymoo."""
    from pymoo.problems import get_problem, many, multi, single

    # pymoo's names are mostly those of the classes; its own list of them cannot be read.
    classes = {
        found.__name__.lower(): found
        for module in (single, multi, many)
        for found in vars(module).values()
        if isinstance(found, type) and issubclass(found, Problem)
    }
    try:
        return classes.get(name.lower()) or type(get_problem(name))
    except Exception as error:  # pymoo raises bare exceptions of many kinds here
        near = difflib.get_close_matches(name.lower(), ["chute", *classes], n=1)
        remedy = f"did you mean {near[0]!r}?" if near else f"pymoo says: {error}"
        if name.endswith(".py"):
            remedy = f"of a class Beam in it say {name.removesuffix('.py')}:Beam"
        forms = "'chute', a pymoo test problem such as 'zdt1', module:attribute, or a FILE.toml"
        raise invalid("PROBLEM", forms, name, remedy) from error


def _attribute(name: str) -> Any:
    """Return what ``module:attribute`` names."""
    module, _, attribute = name.partition(":")
    if "" not in sys.path:  # an installed command has its own folder there, not the user's
        sys.path.insert(0, "")
    try:
        value: Any = importlib.import_module(module)
        for part in attribute.split("."):
            value = getattr(value, part)
    except PsiError:  # its message stands for itself
        raise
    # Whatever the user's module does: its sys.exit() would end this command with a code of its own.
    except (Exception, SystemExit) as error:
        reason = f"{type(error).__name__}: {error}"
        if "/" in module or module.endswith(".py"):  # a file, which is no module's name
            path = Path(module)
            reason = f"say {path.stem}:{attribute} in the folder {path.parent}"
        raise invalid("PROBLEM", "a module:attribute that gives a problem", name, reason) from error
    return value


def _made(name: str, kind: Any) -> Problem:
    """Return the problem that a class or function makes with options, or the problem itself.

    Args:
        name: What was typed for it.
        kind: The class, function or problem.
    """
    context, known = click.get_current_context(), _arguments(kind)
    # The command's own options are here for their names, one of which may be meant.
    own = [each for each in context.command.params if isinstance(each, click.Option)]
    more = [click.Option([f"--{word.replace('_', '-')}", word]) for word in known]
    try:
        parsed = click.Command(name, params=[*own, *more]).make_context(name, context.args)
    except click.UsageError as error:
        taken = ", ".join(each.opts[0] for each in more) or "none"
        message = error.format_message().rstrip(".")
        raise PsiError(f"{message}; arguments of {name}: {taken}") from None
    values = {word: _value_in(parsed.params[word]) for word in known if parsed.params[word]}
    try:
        problem = kind if isinstance(kind, Problem) else kind(**values)
        if isinstance(problem, Problem):
            problem_name(problem)  # the user's too, and needed in messages later on
    except PsiError:
        raise
    except (Exception, SystemExit) as error:
        reason = f"{type(error).__name__}: {error}"
        reason += f"; its arguments: {', '.join(known)}" if known else f"; {_WRAPPED}"
        raise invalid("PROBLEM", "one that can be made", name, reason) from error
    if not isinstance(problem, Problem):
        received = f"got {problem!r:.80}; {_WRAPPED}"
        raise ArgumentTypeError(f"PROBLEM {name} must give a pymoo Problem, {received}")
    return problem


def _value_in(text: str) -> Any:
    """Return what a text is in Python, such as a number or a list, or the text itself."""
    try:
        return ast.literal_eval(text.strip())
    except (ValueError, SyntaxError):
        return text


def _arguments(kind: Any) -> list[str]:
    """Return the names of the arguments of a class or function, also those it passes on."""
    if isinstance(kind, Problem) or not callable(kind) or inspect.isbuiltin(kind):
        return []
    # What a class takes as **kwargs goes to its base, up to pymoo's, whose are no user's options.
    calls = [kind]
    if isinstance(kind, type):
        bases = [each for each in kind.__mro__ if each.__module__ != Problem.__module__]
        calls = [vars(each)["__init__"] for each in bases if "__init__" in vars(each)]
    names: list[str] = []
    for call in calls:
        parameters = inspect.signature(call).parameters.values()
        names += [p.name for p in parameters if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
        if not any(p.kind is p.VAR_KEYWORD for p in parameters):
            break
    return [name for name in dict.fromkeys(names) if name != "self"]


def _box_in(entries: Sequence[str], problem: Problem) -> dict[str, Any]:
    """Return a part of the bounds as :class:`~pymoo_psi.Restricted` takes it.

    Each entry is ``name=lower:upper``, of which either may be missing, ``name=value``, or for a
    choice ``name=option|option``.
    """
    variables = {v.title: v for v in design_space(problem).variables}
    form = "variable=lower:upper or variable=value"
    box: dict[str, Any] = {}
    for name, text in pairs_in("--box", entries, form, variables).items():
        kind = variables[name].kind
        if kind is Kind.CHOICE:
            words = {str(option): option for option in variables[name].options}
            box[name] = [words.get(word, word) for word in text.split("|")]
        elif kind is Kind.BINARY:
            box[name] = _value_in(text)
        else:
            ends = [number_in("--box", e, form) if e.strip() else None for e in text.split(":")]
            box[name] = tuple(ends) if len(ends) > 1 else ends[0]
    return box


def write_example(name: str) -> int:
    """Write the commented example of a program's file, unless there is a file already."""
    path = Path(name).expanduser()
    if path.suffix != ".toml" or path.exists():
        remedy = "it is not overwritten" if path.exists() else "give it the suffix .toml"
        raise invalid("--new", "used with a new file, such as bracket.toml", name, remedy)
    text = files("pymoo_psi.problems").joinpath("program.toml").read_text(encoding="utf-8")
    path.write_text(text.replace("bracket", path.stem), encoding="utf-8")
    say(f"{path} written. Edit it; then: pymoo-psi solve {shlex.quote(name)} --try")
    return 0


def try_program(name: str, problem: Any, points: int) -> int:
    """Run a program once, in the middle of the bounds, and show all of it.

    Returns:
        0, or 1 if something is wrong.
    """
    if not isinstance(getattr(problem, "wrapped", problem), ProgramProblem):
        raise invalid("--try", "used with the FILE.toml of a program", problem_name(problem))
    space = design_space(problem)
    units = np.random.default_rng(0).random((1000, len(space.searched)))
    units[0] = 0.5
    designs = space.matrix(units)
    met = (Required(problem).amounts(designs) <= 0).all(axis=1)
    if not met.any():
        raise PsiError("[requirements]: none of 1000 designs meets them; widen bounds or rules")
    row = int(met.argmax())
    where = "The middle of the bounds" if row == 0 else "A design that meets the requirements"
    design = dict(zip(problem.variables, designs[row].tolist(), strict=True))
    labels = {n: f"{n} [{unit}]" for n, unit in problem.units.items()}
    say(f"{where}: {', '.join(f'{labels.get(n, n)} = {v}' for n, v in design.items())}")
    run = problem.run(design, keep=True)
    say(f"Command: {shlex.join(run.words)}")
    say(f"Folder: {run.folder}")
    for file, written in run.written.items():
        filled = [f"{k} is {'no variable' if k == text else text}" for k, text in written.items()]
        say(f"In {file}: {', '.join(filled) or 'no placeholder'}")
    outputs = problem.outputs.items()
    rows = [(labels.get(n, n), run.outputs.get(n, ""), o.file or o.expression) for n, o in outputs]
    print_frame(pd.DataFrame(rows, columns=["output", "value", "from"]), "Outputs:")
    say(f"Took {run.seconds:.1f} s.")
    if run.flaw:
        say(f"Wrong: {run.flaw}")
        return 1
    more = f"--points {points} --study {shlex.quote(f'{Path(name).stem}.db')}"
    say(f"Nothing is wrong; next: pymoo-psi solve {shlex.quote(name)} {more}")
    return 0
