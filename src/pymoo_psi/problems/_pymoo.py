"""What pymoo leaves open: unchecked arguments, unseeded ties, names that are methods."""

from __future__ import annotations

import difflib
import inspect
import warnings
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.algorithm import Algorithm
from pymoo.core.individual import Individual
from pymoo.core.problem import Problem

from pymoo_psi._modules import require_unchanged
from pymoo_psi._validation import Entries, Values, invalid, mapping, wrong_type
from pymoo_psi.errors import ArgumentTypeError

# Keywords of pymoo's Problem that follow from a model, and would contradict it if given.
OF_A_MODEL = (
    "n_var",
    "n_obj",
    "n_ieq_constr",
    "n_eq_constr",
    "xl",
    "xu",
    "vtype",
    "vars",
    "elementwise",
)
# Entries of out that are no outputs of a model: pymoo's, and our reasons of failures.
NO_OUTPUTS = {
    *("F", "G", "H", "dF", "dG", "dH", "ddF", "ddG", "ddH", "CV", "cv", "feas", "X", "hash"),
    "failure",
}
# What pymoo's individuals have besides: such an output would take its place, or could not be set.
_OF_INDIVIDUALS = {*dir(Individual())} - (NO_OUTPUTS - {"cv", "feas"})


def require_known_keywords(
    owner: str,
    base: type,
    keywords: Entries,
    *,
    taken: Collection[str] = (),
    more: Collection[str] = (),
) -> None:
    """Refuse keyword arguments that ``base`` does not name; pymoo itself ignores these.

    Args:
        owner: Name of the callable, for the message.
        base: The pymoo class; keywords of its constructor and its bases' are allowed.
        keywords: The keyword arguments received.
        taken: Keywords of ``base`` that the owner sets itself.
        more: Keywords that the owner takes itself.

    Raises:
        ArgumentTypeError: There is a keyword that is not allowed.
    """
    known = {*more}
    # every class on the way to object, as pymoo's constructors pass **kwargs up by name
    for cls in base.__mro__[:-1]:
        known.update(inspect.signature(cls).parameters)
    known -= {*taken, "kwargs"}
    for name in keywords:
        if name in known:
            continue
        message = f"{owner} got an unknown keyword argument {name!r}"
        near = difflib.get_close_matches(name, known, n=1)
        if near:
            message += f"; did you mean {near[0]!r}?"
        if name == "n_jobs":
            message += "; give the problem elementwise_runner=JoblibRunner(n_jobs)"
        raise ArgumentTypeError(message)


def require_problem(problem: object) -> None:
    """Refuse anything but a pymoo problem whose modules are as this process imported them."""
    if not isinstance(problem, Problem):
        raise wrong_type("problem", "a pymoo Problem", problem, "pass an instance, not the class")
    require_unchanged(problem)


def problem_name(problem: Any) -> str:
    """Return the name of a problem, where ``name`` may be pymoo's method or a text.

    Example:
        >>> from pymoo_psi import SphereChute
        >>> problem_name(SphereChute())
        'SphereChute'
    """
    name = getattr(problem, "name", None)
    if callable(name):
        name = name()
    return str(name or type(problem).__name__)


def column_titles(problem: Any) -> dict[str, str]:
    """Return the problem's own names for columns, by their default names.

    They are in its attribute ``names``, a mapping; a method or text has another purpose.

    Raises:
        ArgumentTypeError: The names are in a list, which does not say of which columns.
    """
    titles = getattr(problem, "names", None)
    if isinstance(titles, (list, tuple)):
        mapping("the attribute names of a problem", titles, "f1, x1, … to names")
    if not isinstance(titles, Mapping):
        return {}
    return {str(name): str(title) for name, title in titles.items()}


def numbered(letter: str, titles: Iterable[str], first: int = 1) -> dict[str, str]:
    """Return titles of columns by the default names of these, a letter and a number."""
    return {f"{letter}{j}": title for j, title in enumerate(titles, first)}


def for_individuals(out: Entries) -> Values:
    """Return values of designs without outputs that pymoo's individuals cannot have."""
    for name in _OF_INDIVIDUALS.intersection(out):
        warnings.warn(
            f"out[{name!r}] is left out: pymoo's individuals have an attribute of this name; give "
            "it another one",
            stacklevel=3,
        )
    return {name: values for name, values in out.items() if name not in _OF_INDIVIDUALS}


def seed_ties(algorithm: Any) -> None:
    """Make the tournament of pymoo's NSGA-III or U-NSGA-III depend on the algorithm's seed alone.

    For two designs with the same violation, such as two that failed, pymoo 0.6.1.6 and 0.6.2 draw
    from a new generator without a seed, so that a run with such a pair cannot be repeated. All
    other runs and algorithms are unchanged.

    Args:
        algorithm: A pymoo algorithm that has selected no parents yet.
    """
    # imported here, as pymoo's algorithms take longer to import than all of its problems
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

    The tournament draws the order of a pair as part of a permutation, with the seed. So its first
    design is a fair choice that takes no further random numbers from the run.

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


def require_inequalities(algorithm: Any) -> None:
    """Refuse an algorithm that searches between bounds for designs that meet equalities."""
    problem = getattr(algorithm, "problem", None)
    space = getattr(problem, "space", None)
    if getattr(space, "equalities", ()):
        where = f"the problem of {type(algorithm).__name__}"
        raise invalid(
            where,
            "one whose requirements have no equality, which its designs would not meet",
            problem_name(problem),
            "search it by PSI or SurrogatePSI",
        )


def leave_failed_out(algorithm: Any) -> None:
    """Keep designs that failed or never ran out of an algorithm's optimum.

    The seed decides between failed designs, as all have the same violation.

    Args:
        algorithm: A pymoo algorithm; anything else is left as it is.
    """
    if not isinstance(algorithm, Algorithm):
        return
    seed_ties(algorithm)
    if "_set_optimum" not in vars(algorithm):
        # a partial, unlike a closure, is copied and pickled with its algorithm
        algorithm._set_optimum = partial(_set_optimum, algorithm)


def _set_optimum(algorithm: Any, **kwargs: Any) -> None:
    """Do what the algorithm's ``_set_optimum`` does, and leave designs without values out.

    pymoo's RVEA regards its whole population as optimal as soon as one design is feasible.
    """
    type(algorithm)._set_optimum(algorithm, **kwargs)
    if algorithm.opt is not None:
        kept = []
        for individual in algorithm.opt:
            kept.append(not individual.get("failure") and bool(np.isfinite(individual.F).all()))
        if any(kept):  # if none is kept, pymoo itself returns no result
            algorithm.opt = algorithm.opt[kept]
