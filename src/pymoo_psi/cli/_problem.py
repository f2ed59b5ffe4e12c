"""The problem that a word on the command line names."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from pymoo.core.problem import Problem

from pymoo_psi._validation import Received, invalid, job_count, positive_number
from pymoo_psi.cli._options import box_in
from pymoo_psi.errors import ArgumentTypeError, PsiError
from pymoo_psi.parallel import JoblibRunner
from pymoo_psi.problems import Restricted, VectorizedSphereChute

_FORMS = "'chute', the name of a pymoo test problem such as 'zdt1', or module:attribute"


def load_problem(
    name: str,
    chute_options: Mapping[str, Any],
    jobs: int = 1,
    timeout: float | None = None,
    box: Sequence[str] = (),
) -> Problem:
    """Return the problem that a word names, ready to be evaluated by ``jobs`` processes.

    Args:
        name: ``chute``, a name known to ``pymoo.problems.get_problem``, or ``module:attribute``
            where the attribute is a problem, or a class or function that gives one without
            arguments. The working directory is searched for the module first.
        chute_options: Options of the chute; an error for any other problem.
        jobs: Processes for a problem that evaluates one design at a time; others use one.
        timeout: Seconds that a design of such a problem may take, if there is a limit.
        box: The part of its box that is meant, as it is typed; the whole unless given.

    Raises:
        PsiError: There is no such problem, or it cannot be made, or not be given a time limit.
    """
    jobs = job_count("--jobs", jobs)
    if timeout is not None:
        positive_number("--timeout", timeout)
    # What the words alone show to be wrong is refused before the user's module is imported.
    if chute_options and name != "chute":
        raise invalid("PROBLEM", f"'chute' where --{next(iter(chute_options))} is given", name)
    if name == "chute":
        problem = VectorizedSphereChute(**chute_options)
    else:
        problem = _from_module(name) if ":" in name else _from_pymoo(name)
    if problem.n_obj < 1:
        raise invalid("PROBLEM", "a problem with one objective or more", Received(name))
    if problem.elementwise and (jobs != 1 or timeout is not None):
        # A model may end its process, and must not end this one.
        problem.elementwise_runner = JoblibRunner(n_jobs=jobs, timeout=timeout, in_process=False)
    elif timeout is not None:
        shown = Received(f"{problem.name()}, which takes many at once")
        rule = "a problem that evaluates one design at a time where --timeout is given"
        raise invalid("PROBLEM", rule, shown)
    return Restricted(problem, box_in(box, problem)) if box else problem


def _from_pymoo(name: str) -> Problem:
    from pymoo.problems import get_problem

    try:
        return get_problem(name)
    except Exception as error:  # pymoo raises bare exceptions of many kinds here
        raise invalid("PROBLEM", _FORMS, name, f"pymoo says: {error}") from error


def _from_module(name: str) -> Problem:
    module_name, _, attribute = name.partition(":")
    if "" not in sys.path:  # an installed command has its own folder there, not the user's
        sys.path.insert(0, "")
    try:
        value: Any = importlib.import_module(module_name)
        for part in attribute.split("."):
            value = getattr(value, part)
        problem = value if isinstance(value, Problem) else value()
        if isinstance(problem, Problem):
            problem.name()  # the user's too, and needed in messages later on
    except PsiError:  # its message stands for itself
        raise
    # Whatever the user's module does: its sys.exit() would end this command with a code of its own.
    except (Exception, SystemExit) as error:
        reason = f"{type(error).__name__}: {error}"
        raise invalid("PROBLEM", "a module:attribute that gives a problem", name, reason) from error
    if not isinstance(problem, Problem):
        raise ArgumentTypeError(f"PROBLEM {name} must give a pymoo Problem, got {problem!r:.80}")
    return problem
