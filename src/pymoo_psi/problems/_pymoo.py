"""What pymoo leaves open: unchecked arguments, unseeded ties, names that are methods."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_psi._validation import invalid, wrong_type
from pymoo_psi.errors import ArgumentTypeError

# Keywords of pymoo's Problem that follow from a model: given beside it they would contradict it.
OF_A_MODEL = (
    *("n_var", "n_obj", "n_ieq_constr", "n_eq_constr", "xl", "xu"),
    *("vtype", "vars", "elementwise"),
)


def require_known_keywords(
    owner: str,
    base: type,
    given: Mapping[str, Any],
    *,
    taken: Collection[str] = (),
    more: Collection[str] = (),
) -> None:
    """Refuse keyword arguments that ``base`` does not name; pymoo itself swallows any.

    Args:
        owner: Name of the callable, for the message.
        base: The pymoo class; keywords of its constructor and its bases' are allowed.
        given: The keyword arguments received.
        taken: Keywords of ``base`` that the owner sets itself.
        more: Keywords that the owner takes itself.

    Raises:
        ArgumentTypeError: There is a keyword that is not allowed.
    """
    # every class on the way to object, since pymoo's constructors pass **kwargs up by name
    signatures = [inspect.signature(cls).parameters for cls in base.__mro__[:-1]]
    known = {n for s in signatures for n, p in s.items() if p.kind != p.VAR_KEYWORD}
    known = known - {*taken} | {*more}
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            if name == "n_jobs":
                hint = "; workers are the problem's: problem.elementwise_runner = JoblibRunner(2)"
            raise ArgumentTypeError(f"{owner} got an unknown keyword argument {name!r}{hint}")


def require_problem(problem: object, uncertain: Collection[str] = ()) -> None:
    """Refuse anything that is not a pymoo problem, or does not read its uncertain parameters."""
    if not isinstance(problem, Problem):
        hint = "pass an instance, not the class" if isinstance(problem, type) else ""
        raise wrong_type("problem", "a pymoo Problem", problem, hint)
    for name in uncertain:
        # There pymoo puts keywords that it does not know: a misspelt one would change nothing.
        if isinstance(problem.data, dict) and name in problem.data:
            rule = f"of parameters that {type(problem).__name__} takes"
            remedy = "pymoo only keeps it; name an argument so, or correct the name"
            raise invalid("uncertainty", rule, name, remedy)


def problem_name(problem: Any) -> str:
    """Return the name of a problem, where ``name`` may be pymoo's method or a text.

    Example:
        >>> from pymoo_psi import SphereChute
        >>> problem_name(SphereChute())
        'SphereChute'
    """
    name = getattr(problem, "name", None)
    return str((name() if callable(name) else name) or type(problem).__name__)


def seed_ties(algorithm: Any) -> None:
    """Let the tournament of pymoo's NSGA-III or U-NSGA-III follow the algorithm's seed alone.

    Between two designs of the same violation, such as two that failed, pymoo 0.6.1.6 and 0.6.2
    draw from a new generator without a seed, so that no run that meets such a pair can be
    repeated. All other runs stay as they are, and so does every other algorithm.

    Args:
        algorithm: A pymoo algorithm that has selected no parents yet.
    """
    # Here, as pymoo's algorithms take longer to import than all of its problems.
    from pymoo.algorithms.moo.nsga3 import comp_by_cv_then_random
    from pymoo.algorithms.moo.unsga3 import comp_by_rank_and_ref_line_dist
    from pymoo.operators.selection.tournament import TournamentSelection

    selection: Any = getattr(getattr(algorithm, "mating", None), "selection", None)
    compare = getattr(selection, "func_comp", None)
    if compare in (comp_by_cv_then_random, comp_by_rank_and_ref_line_dist):
        # a new object: pymoo's is the default argument of every NSGA3
        seeded = partial(_with_seeded_ties, compare)
        algorithm.mating.selection = TournamentSelection(seeded, selection.pressure)


def _with_seeded_ties(
    compare: Callable[..., NDArray[np.int_]],
    population: Any,
    pairs: NDArray[np.int_],
    **kwargs: Any,
) -> NDArray[np.int_]:
    """Return the winners of pymoo's comparison; of equally infeasible designs the first wins.

    A pair stands in random order, that of a permutation which the tournament draws with the seed.
    So the first of it is a fair draw, and takes nothing more from the run's random numbers.

    Args:
        compare: pymoo's comparison.
        population: The designs.
        pairs: ``(n, 2)`` their indices.
        **kwargs: For ``compare``.

    Returns:
        ``(n, 1)`` indices.
    """
    winners = compare(population, pairs, **kwargs)
    first, second = population.get("CV")[pairs, 0].T
    ties = (first == second) & (first > 0)
    winners[ties, 0] = pairs[ties, 0]
    return winners
