"""Which designs are feasible, and which of them are Pareto optimal; all objectives minimised."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import accumulate

import moocore
import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, integer, invalid
from pymoo_psi.pareto._rounding import settled

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

EQ_TOLERANCE = 1e-4
"""pymoo's: an equality constraint is met where |h| <= 1e-4."""


def violated_constraints(G: Array, H: Array, tolerance: float = EQ_TOLERANCE) -> Mask:
    """Return which constraints are violated; one that is NaN is.

    Args:
        G: ``(..., n_ieq)`` inequality constraints, met where g <= 0.
        H: ``(..., n_eq)`` equality constraints, met where |h| <= tolerance.
        tolerance: Of equality constraints.

    Returns:
        ``(..., n_ieq + n_eq)`` mask, the inequalities first.
    """
    return np.concatenate([~(G <= 0), ~(np.abs(H) <= tolerance)], axis=-1)


def meets_constraints(G: Array, H: Array, tolerance: float = EQ_TOLERANCE) -> Mask:
    """``(...,)`` which designs meet every constraint; those without any do."""
    return np.asarray(~violated_constraints(G, H, tolerance).any(axis=-1))


def constraint_violation(G: Array, H: Array, tolerance: float = EQ_TOLERANCE) -> Array:
    """``(n,)`` pymoo's measure: the sum of what ``(n, n_ieq)`` G and ``(n, n_eq)`` H exceed."""
    return np.asarray(
        np.maximum(G, 0).sum(axis=1) + np.maximum(np.abs(H) - tolerance, 0).sum(axis=1)
    )


def competes(F: Array, feasible: Mask) -> Mask:
    """``(...,)`` which feasible designs have finite objectives, ``(..., m)`` F, too.

    Only these are compared with each other: the others are neither optimal nor dominated.
    """
    return np.asarray(feasible & np.isfinite(F).all(axis=-1))


# Rows that are filtered together. 2n rows of four objectives take more than twice the time of n;
# below some ten thousand rows what all parts have in common outweighs the gain.
_SLAB = 2**15
_SAMPLE = 2**12  # rows that tell whether slabs pay: 4 ms, of the 150 ms that two slabs take
# The shadow (see below) is filtered with every slab; with eight objectives most rows are in it.
_MOST_SHADOW = 0.3


def nondominated(F: Array, *, threads: int = 1) -> Mask:
    """Mark the rows of ``F`` that no other row dominates; equal rows are kept together.

    Values of an objective that differ by no more than rounding noise, 1.4e-14 of their size,
    are equal.

    Args:
        F: ``(n, m)`` objective values without NaN, all minimised; n may be 0, m up to 255.
            Infinity is worse, or better, than every number.
        threads: How many parts of a very large F may be looked at at a time.

    Returns:
        ``(n,)`` mask. A row dominates another if it is nowhere worse and somewhere better.

    Raises:
        ArgumentValueError: There are more than 255 objectives, a value is NaN, or no threads.
        ArgumentTypeError: The number of threads is none.

    Example:
        >>> nondominated(np.array([[1.0, 2.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]))
        array([ True,  True, False,  True])
    """
    threads = integer("threads", threads, minimum=1)
    if len(F) == 0:
        return np.zeros(0, dtype=bool)
    if F.shape[1] > 255:
        raise invalid("F", "of at most 255 objectives", Received(f"{F.shape[1]}"))
    F = settled(F)
    if not np.isfinite(F).all():
        if np.isnan(F).any():
            raise invalid("F", "without NaN", Received("NaN"))
        # Places have the order of the values. With infinities moocore (0.3) gives wrong answers,
        # or ends the process.
        places = [np.unique(column, return_inverse=True)[1] for column in F.T]
        F = np.column_stack(places).astype(np.float64)
    if F.shape[1] == 1:  # moocore takes two objectives or more
        return np.asarray(F[:, 0] == F[:, 0].min(), dtype=bool)
    if len(F) > 2 * _SLAB and F.shape[1] > 3:  # with three, sorting is nearly all there is to do
        j, share = _slab_column(F)
        if share <= _MOST_SHADOW:
            return _by_slabs(F, j, threads)
    return _front(F)


def _front(F: Array, *, keep_weakly: bool = True) -> Mask:
    """``(n,)`` which rows no other dominates; of equal rows all, or one."""
    return np.asarray(moocore.is_nondominated(F, keep_weakly=keep_weakly), dtype=bool)


def _slab_column(F: Array) -> tuple[int, float]:
    """Return the column with the smallest shadow, and its share of the rows, both of a sample."""
    sample = F[:: -(-len(F) // _SAMPLE)]
    shares = []
    for j, column in enumerate(sample.T):
        middle = np.sort(column)[len(column) // 2]
        lower = np.delete(sample[column <= middle], j, axis=1)
        shares.append(float(_front(lower, keep_weakly=False).mean()))
    best = int(np.argmin(shares))
    return best, shares[best]


def _by_slabs(F: Array, j: int, threads: int) -> Mask:
    """Return what :func:`_front` returns, by slabs of the values of one objective.

    A row can only be dominated from its own slab or from a lower one; and a row of a lower slab,
    better in objective j, dominates it if it is nowhere worse in the others. So of all lower slabs
    their shadow is enough: the front in the other objectives, mostly some hundreds of rows. This is
    the division of Kung, Luccio and Preparata (1975), here into many parts that fit into a cache
    and can be filtered at the same time: moocore releases Python's lock meanwhile.

    Args:
        F: ``(n, m)`` settled values, m >= 3.
        j: The objective.
        threads: How many slabs are filtered at a time.
    """
    order = np.argsort(F[:, j], kind="stable")
    ordered = F[order]
    # Equal values must not be parted, since then a higher slab could dominate a lower one.
    values = ordered[:, j]
    ends = np.unique(np.searchsorted(values, values[_SLAB - 1 :: _SLAB], side="right"))
    slabs = np.split(ordered, ends[ends < len(F)])

    def shadow(rows: Array) -> Array:
        return rows[_front(np.delete(rows, j, axis=1), keep_weakly=False)]

    def filtered(slab: Array, below: Array) -> Mask:
        return _front(np.concatenate([below, slab]))[len(below) :]

    mask = np.empty(len(F), dtype=bool)
    with ThreadPoolExecutor(threads) as pool:
        shadows: Iterator[Array] = pool.map(shadow, slabs[:-1])
        below = accumulate(shadows, lambda a, b: shadow(np.concatenate([a, b])), initial=F[:0])
        mask[order] = np.concatenate(list(pool.map(filtered, slabs, below)))
    return mask


def front_numbers(F: Array) -> NDArray[np.intp]:
    """Return in which front each row is: 0 if no row dominates it, 1 if only such rows do, ….

    Args:
        F: ``(n, m)`` objective values without NaN, n >= 1, m >= 2.
    """
    return np.asarray(moocore.pareto_rank(F), dtype=np.intp)


def nondominated_pair(a: NDArray[np.intp], b: NDArray[np.intp], other: NDArray[np.intp]) -> Mask:
    """Mark the points (a_i, b_i) that no other point dominates, in O(n).

    Args:
        a: ``(n,)`` first criterion as integer levels (:func:`pymoo_psi.pareto._rounding.levels`),
            n >= 1.
        b: ``(n,)`` second criterion likewise.
        other: ``(n,)`` third criterion likewise, which decides between equal points.

    Returns:
        ``(n,)`` mask.
    """
    # The best b for each level of a; a point stays if it has that b and every smaller a is worse.
    best, least = (np.full(a.max() + 1, np.iinfo(np.intp).max) for _ in range(2))
    np.minimum.at(best, a, b)
    best_before = np.concatenate(([np.iinfo(np.intp).max], np.minimum.accumulate(best)[:-1]))
    mask: Mask = (b == best[a]) & (b < best_before[a])
    np.minimum.at(least, a[mask], other[mask])
    mask &= other == least[a]
    return mask
