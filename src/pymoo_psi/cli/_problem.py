"""The problem that a word on the command line names."""

from __future__ import annotations

import difflib
import importlib
import inspect
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from pymoo.core.problem import Problem

from pymoo_psi._validation import Received, invalid, job_count, positive_number
from pymoo_psi.cli._groups import NEAR, ProblemOptions
from pymoo_psi.cli._options import box_in
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, PsiError
from pymoo_psi.parallel import JoblibRunner
from pymoo_psi.problems import Restricted, VectorizedSphereChute
from pymoo_psi.problems._design_space import design_space
from pymoo_psi.problems._identity import problem_layout

_WRAPPED = "a model goes into the _evaluate of a class, as in the README and help(pymoo_psi.table)"
_FORMS = "'chute', the name of a pymoo test problem such as 'zdt1', or module:attribute"


def load_problem(
    name: str,
    options: ProblemOptions,
    jobs: int = 1,
    timeout: float | None = None,
    box: Sequence[str] = (),
) -> Problem:
    """Return the problem that a word names, ready to be evaluated by ``jobs`` processes.

    Args:
        name: ``chute``, a name known to ``pymoo.problems.get_problem``, or ``module:attribute``
            where the attribute is a problem, or a class or function that gives one. The working
            directory is searched for the module first.
        options: What it is made with.
        jobs: Processes for a problem that evaluates one design at a time; others use one.
        timeout: Seconds that a design of such a problem may take, if there is a limit.
        box: The part of its box that is meant, as it is typed; the whole unless given.

    Raises:
        PsiError: There is no such problem, or it cannot be made, or not be given a time limit.
    """
    jobs = job_count("--jobs", jobs)
    if timeout is not None:
        positive_number("--timeout", timeout)
    if name == "chute":
        problem = _made(name, VectorizedSphereChute, VectorizedSphereChute, options)
    elif ":" in name:
        problem = _from_module(name, options)
    else:
        problem = _from_pymoo(name, options)
    if problem.n_obj < 1:
        raise invalid("PROBLEM", "a problem with one objective or more", Received(name))
    try:  # or its attribute maximize would be taken for the option
        problem_layout(problem, design_space(problem))
    except (ArgumentValueError, ArgumentTypeError) as error:
        raise ArgumentValueError(f"PROBLEM {name}: {error}") from error
    if problem.elementwise and (jobs != 1 or timeout is not None):
        # A model may end its process, and must not end this one.
        problem.elementwise_runner = JoblibRunner(n_jobs=jobs, timeout=timeout, in_process=False)
    elif timeout is not None:
        shown = Received(f"{problem.name()}, which takes many at once")
        rule = "a problem that evaluates one design at a time where --timeout is given"
        raise invalid("PROBLEM", rule, shown)
    return Restricted(problem, box_in(box, problem)) if box else problem


def _from_pymoo(name: str, options: ProblemOptions) -> Problem:
    from pymoo.problems import get_problem, many, multi, single

    # pymoo's names are mostly those of the classes; its own list of them cannot be read.
    classes = {
        found.__name__.lower(): found
        for module in (single, multi, many)
        for found in vars(module).values()
        if isinstance(found, type) and issubclass(found, Problem)
    }
    try:
        kind = classes.get(name.lower()) or type(get_problem(name))
    except Exception as error:  # pymoo raises bare exceptions of many kinds here
        near = [word for word in difflib.get_close_matches(name.lower(), ["chute", *classes], n=5)
                if word == "chute" or "not found" not in _refusal(word)]  # fmt: skip
        remedy = f"did you mean {near[0]!r}?" if near else f"pymoo says: {error}"
        if name.endswith(".py") or Path(f"{name}.py").is_file():
            remedy = f"of a class Beam in it say {name.removesuffix('.py')}:Beam"
        raise invalid("PROBLEM", _FORMS, name, remedy) from error
    return _made(name, partial(get_problem, name), kind, options)


def _refusal(name: str) -> str:
    """Return what pymoo has against a name; it may be that of a class that others derive from."""
    from pymoo.problems import get_problem

    try:
        get_problem(name)
    except Exception as error:
        return str(error)
    return ""


def _from_module(name: str, options: ProblemOptions) -> Problem:
    module_name, _, attribute = name.partition(":")
    if "" not in sys.path:  # an installed command has its own folder there, not the user's
        sys.path.insert(0, "")
    value: Any = None
    try:
        value = importlib.import_module(module_name)
        for part in attribute.split("."):
            names = dir(value)
            value = getattr(value, part)
    # Whatever the user's module does: its sys.exit() would end this command with a code of its own.
    except (Exception, SystemExit) as error:
        if isinstance(error, PsiError):  # its message stands for itself
            raise
        reason = f"{type(error).__name__}: {error}"
        if isinstance(error, AttributeError) and isinstance(value, ModuleType):
            near = difflib.get_close_matches(part, names, n=1)
            reason += f"; did you mean {near[0]!r}?" if near else ""
        folder, slash, stem = module_name.rpartition("/")
        if (stem := stem.removesuffix(".py")) != module_name:  # a file, which is no module's name
            reason = f"say {stem}:{attribute}" + (
                f" in the folder {folder or slash}" if slash else ""
            )
        raise invalid("PROBLEM", "a module:attribute that gives a problem", name, reason) from error
    return _made(name, value, value, options)


def _made(name: str, make: Any, kind: Any, options: ProblemOptions) -> Problem:
    """Return a problem, or what a class or function makes with the options.

    Args:
        name: What was typed for it.
        make: The problem, or what is called with the options.
        kind: The class or function whose arguments these are.
        options: The options.
    """
    known = _arguments(kind)
    taken = [f"--{word.replace('_', '-')}" for word in known]
    given = {}
    for option, text in options.given.items():
        argument = option[2:].replace("-", "_")
        if argument not in known:
            near = difflib.get_close_matches(option, [*options.own, *taken], n=1, cutoff=NEAR)
            told = [f"did you mean {near[0]}?"] if near else []
            told.append(f"arguments of {name}: {', '.join(taken) or 'none'}")
            raise PsiError(f"No such option: {option}; {'; '.join(told)}")
        given[argument] = _value(text)
    try:
        problem = make if isinstance(make, Problem) else make(**given)
        if isinstance(problem, Problem):
            problem.name()  # the user's too, and needed in messages later on
    except (Exception, SystemExit) as error:
        if isinstance(error, PsiError):
            raise
        reason = f"{type(error).__name__}: {error}"
        reason += f"; its arguments: {', '.join(taken)}" if taken else ""
        reason += "" if isinstance(kind, type) else f"; {_WRAPPED}"
        raise invalid("PROBLEM", "one that can be made", name, reason) from error
    if not isinstance(problem, Problem):
        received = f"got {problem!r:.80}; {_WRAPPED}"
        raise ArgumentTypeError(f"PROBLEM {name} must give a pymoo Problem, {received}")
    return problem


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


def _value(text: str) -> Any:
    """Return a number, a list of them with commas, a truth value, or the text as it is."""
    if "," in text:
        return [_value(part) for part in text.split(",")]
    if text in ("True", "False"):
        return text == "True"
    for kind in (int, float):
        with suppress(ValueError):
            return kind(text if "_" not in text else "")  # Python reads 1_0 as 10
    return text
