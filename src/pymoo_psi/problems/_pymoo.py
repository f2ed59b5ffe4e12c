"""What pymoo leaves open: problems around others, unchecked arguments, unseeded ties, reprs."""

from __future__ import annotations

import difflib
import hashlib
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
_LONGEST = 1000  # characters of a constant of a model that a study shows


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


def own_parameters(problem: Any) -> dict[str, Any]:
    """Return what ``fingerprint()`` of a problem returns, or numbers and texts it was made with.

    These are the arguments of its classes that it keeps as attributes of the same name, or with an
    underscore before it, but for default values and what pymoo's ``Problem`` takes. A text that is
    a path says where, not what.
    """
    if callable(own := getattr(problem, "fingerprint", None)):
        return dict(own())
    while isinstance(problem, WrappedProblem):
        problem = problem.wrapped
    classes = [c for c in reversed(type(problem).__mro__) if issubclass(c, Problem)]
    parameters = {n: p for c in classes for n, p in inspect.signature(c).parameters.items()}
    found = {}
    for name in [n for n in parameters if n not in inspect.signature(Problem).parameters]:
        default = parameters[name].default
        value = getattr(problem, name, getattr(problem, f"_{name}", default))
        value = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
        if _is_plain(value) and value != default:
            text = repr(value)
            long = len(text) > _LONGEST
            found[name] = hashlib.sha256(text.encode()).hexdigest()[:16] if long else value
    return found


def _is_plain(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return all(map(_is_plain, value))
    return isinstance(value, (bool, int, float)) or (
        isinstance(value, str) and not {"/", "\\"} & {*value}
    )


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


class WrappedProblem(Problem):
    """A problem around another one: its sizes, variables, bounds, runner, name and attributes.

    Args:
        problem: The other problem.
        **changed: Arguments of pymoo's ``Problem`` in which the two differ.

    Attributes:
        wrapped: The other problem.
    """

    _same_front = True

    def __init__(self, problem: Any, **changed: Any) -> None:
        self.wrapped = problem
        # without replace_nan_values_by: pymoo would look for NaN in the reasons of failures, too
        same = [*("n_obj", "n_ieq_constr", "n_eq_constr"), *("elementwise", "elementwise_runner")]
        named = getattr(problem, "vars", None)
        same += ["vars"] if named else ["n_var", "xl", "xu", "vtype"]
        own = {name: getattr(problem, name) for name in [*same, "requires_kwargs"]}
        super().__init__(**{**own, **changed})
        self.data = problem.data  # pymoo's further arguments, or what the model has called so

    def __getattr__(self, name: str) -> Any:
        """Give what only the wrapped problem has, to repairs and operators that ask for it."""
        # While it is unpickled there is no wrapped problem yet, and the search would not end.
        if name.startswith("_") or "wrapped" not in self.__dict__:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self.wrapped, name)

    @property
    def elementwise_runner(self) -> Any:
        """What runs the evaluations: the wrapped problem's, also where it is changed here."""
        return self.wrapped.elementwise_runner

    @elementwise_runner.setter
    def elementwise_runner(self, runner: Any) -> None:
        self.wrapped.elementwise_runner = runner

    def name(self) -> str:
        """Return the name of the wrapped problem.

        Example:
            >>> from pymoo_psi import FailureTolerant, SphereChute
            >>> FailureTolerant(SphereChute()).name()
            'SphereChute'
        """
        return problem_name(self.wrapped)

    def formatted(self, X: Any, out: dict[str, Any], names: Any) -> dict[str, Any]:
        """Return values of designs as pymoo's ``do`` returns them."""
        out = dict.fromkeys(names) | out
        return dict(self._format_dict(out, len(X), names))

    def _calc_pareto_front(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_front(*args, **kwargs) if self._same_front else None

    def _calc_pareto_set(self, *args: Any, **kwargs: Any) -> Any:
        return self.wrapped._calc_pareto_set(*args, **kwargs) if self._same_front else None
