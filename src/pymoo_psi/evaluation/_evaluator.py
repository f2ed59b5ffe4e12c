"""Evaluating designs some of which may fail.

pymoo's evaluator, guarded: a block is evaluated, and stored, in pieces; failures are kept.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pymoo.core.evaluator import Evaluator
from pymoo.core.population import Population
from pymoo.core.problem import LoopedElementwiseEvaluation

from pymoo_psi._validation import known_name
from pymoo_psi.errors import EvaluationError
from pymoo_psi.evaluation._failures import FailureTolerant
from pymoo_psi.parallel._backend import active_workers
from pymoo_psi.pareto._feasibility import competes, meets_constraints

Array = NDArray[np.float64]


class Evaluated(NamedTuple):
    """The values of n designs, and why those that failed did.

    Attributes:
        F: ``(n, m)`` objectives, infinite where a design failed.
        G: ``(n, n_ieq)`` inequality constraints.
        H: ``(n, n_eq)`` equality constraints.
        reasons: n reasons, empty for a design that did not fail.
    """

    F: Array
    G: Array
    H: Array
    reasons: list[str]


def evaluate_guarded(problem: Any, X: NDArray[Any]) -> Evaluated:
    """Evaluate designs; one that raises, gives NaN or the wrong shape, or is lost, has failed.

    A vectorised problem is asked for all designs at once. If that raises, the guard finds the
    culprits; if only the values of some designs are bad, these alone are evaluated once more.

    Args:
        problem: A pymoo problem.
        X: n designs as the problem takes them.
    """
    if problem.elementwise:
        return _guarded(problem, X)
    try:
        out = problem.evaluate(X, return_values_of=["F", "G", "H"], return_as_dictionary=True)
        F, G, H = (np.asarray(out[name], dtype=np.float64) for name in "FGH")
    except (Exception, SystemExit):  # whose fault it is, the guarded evaluation will find
        return _guarded(problem, X)
    bad = _bad_rows(F, G, H)
    if bad.all():
        return _guarded(problem, X)
    reasons = [""] * len(F)
    if bad.any():
        again = _guarded(problem, X[bad])
        F, G, H = F.copy(), G.copy(), H.copy()  # they may be the model's own
        F[bad], G[bad], H[bad] = again.F, again.G, again.H
        for i, reason in zip(np.flatnonzero(bad), again.reasons, strict=True):
            reasons[i] = reason
    return Evaluated(F, G, H, reasons)


def _bad_rows(F: Array, G: Array, H: Array) -> NDArray[np.bool_]:
    """``(n,)`` which designs have values that the guard would not let pass."""
    bad = np.isnan(np.hstack([F, G, H])).any(axis=1)
    feasible = meets_constraints(G, H)
    bad |= feasible & ~competes(F, feasible)
    return np.asarray(bad)


def _guarded(problem: Any, X: NDArray[Any]) -> Evaluated:
    """Evaluate through a :class:`FailureTolerant`, which checks one design after the other."""
    out = FailureTolerant(problem).evaluate(
        X, return_values_of=["F", "G", "H", "failure"], return_as_dictionary=True
    )
    reasons = [str(reason) for reason in out["failure"]]
    return Evaluated(out["F"], out["G"][:, :-1], out["H"], reasons)


_SECONDS = 2.0  # a piece of a block should take about so long


def failure_action(name: str, value: object) -> str:
    """Return ``value``: ``"record"`` or ``"raise"``."""
    return known_name(name, value, ("record", "raise"))


class GuardedEvaluator(Evaluator):
    """pymoo's evaluator, with designs that fail kept as failed.

    An individual that failed has infinite objectives, an infinite constraint violation, and its
    reason as ``individual.get("failure")``.

    Args:
        on_failure: ``"record"`` goes on; ``"raise"`` stops. A problem that evaluates one design
            after the other stops at the first one; where designs are evaluated together or in
            processes, these are finished first, so that nothing of them is lost.
    """

    def __init__(self, on_failure: str = "record") -> None:
        super().__init__()
        self.on_failure = failure_action("on_failure", on_failure)

    def _eval(self, problem: Any, pop: Population, values: Any, **kwargs: Any) -> None:
        remembers = getattr(kwargs.get("algorithm"), "remembers", False)
        keep = kwargs["algorithm"].keep if remembers else _forget
        for piece in self._pieces(problem, pop, timed=remembers):
            F, G, H, reasons = evaluate_guarded(problem, piece.get("X"))
            piece.set("F", F, "G", G, "H", H, "failure", reasons)
            piece.apply(lambda individual: individual.evaluated.update("FGH"))
            failed = piece[np.array([bool(reason) for reason in reasons])]
            for individual in failed:
                individual.CV = np.array([np.inf])
            keep(piece)
            if len(failed) and self.on_failure == "raise":
                raise EvaluationError(failed[0].X, failed[0].get("failure"))

    def _pieces(self, problem: Any, pop: Population, *, timed: bool) -> Iterator[Population]:
        """Cut a block into what is evaluated, and stored, at a time.

        A study keeps each piece, so that an interruption loses no more than some seconds of a
        slow model; the pieces grow until one takes that long. However slow the model, a piece has
        a design for every worker.
        """
        one_by_one = isinstance(problem.elementwise_runner, LoopedElementwiseEvaluation)
        if not problem.elementwise or not (timed or self.on_failure == "raise"):
            yield pop
            return
        least = 1 if one_by_one else _worker_count(problem.elementwise_runner)
        start, size = 0, least
        while start < len(pop):
            began = time.monotonic()
            yield pop[start : start + size]
            start += size
            if not (one_by_one and self.on_failure == "raise"):
                took = max(time.monotonic() - began, 1e-6)
                size = max(least, min(len(pop), int(size * min(_SECONDS / took, 100))))


def _worker_count(runner: Any) -> int:
    """Return how many designs a runner evaluates at a time; of another's, one for each core."""
    return active_workers(getattr(runner, "n_jobs", -1)).count


def _forget(piece: Population) -> None:
    """Keep nothing, where there is no study."""
