"""Uniformly distributed sequences: Sobol's LPτ test points.

The points are in natural order, numbered from 1 (the origin), in up to 51 dimensions. Any number of
points may start at any number. With n = number − 1, coordinate j of a point is the exclusive or of
the direction numbers V_jk over the bits k that are set in n. ``scipy.stats.qmc.Sobol`` visits the
same kind of points in Gray-code order and, from the third dimension on, with other direction
numbers, so neither its numbering nor its points are those of the PSI literature.

Source: I. M. Sobol', Yu. L. Levitan (1976), with the direction numbers as distributed by
B. Shukhman, Computer Physics Communications 78 (1994) 279. ``lp_tau_directions.json`` contains
primitive polynomials and initial numbers; the usual recurrence gives the rest.

Example:
    >>> from pymoo_psi import lp_tau
    >>> lp_tau(3, 2, first=2)
    array([[0.5 , 0.5 ],
           [0.25, 0.75],
           [0.75, 0.25]])

    :class:`pymoo_psi.LPTauSampling` starts any algorithm of pymoo from these points,
    :class:`pymoo_psi.QMCSampling` from those of SciPy's engines.

    >>> from pymoo.algorithms.moo.nsga2 import NSGA2
    >>> from pymoo_psi import LPTauSampling
    >>> algorithm = NSGA2(pop_size=100, sampling=LPTauSampling())
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Array, integer, invalid

__all__ = ["lp_tau"]

Integers = NDArray[np.uint64]

MAX_DIMENSIONS = 51  # as many as direction numbers of LPτ are published for

_BITS = 52  # a coordinate is a multiple of 2^-52: exact in a float64


def lp_tau(n_points: int, n_dim: int, *, first: int = 1) -> Array:
    """Return consecutive points of the LPτ sequence in natural order.

    ``lp_tau(n, d)[k:]`` equals ``lp_tau(n - k, d, first=1 + k)``; the cost is proportional to
    ``n_points``, whatever ``first`` is.

    Args:
        n_points: Number of points, 0 or more; it need not be a power of two.
        n_dim: Their dimension, 1 to 51.
        first: Number of the first point, from 1 (the origin); the last point of the sequence has
            the number 2^52.

    Returns:
        ``(n_points, n_dim)`` array in [0, 1).

    Raises:
        ArgumentValueError: A count is out of its range.
        ArgumentTypeError: A count is not an integer.

    Example:
        >>> lp_tau(4, 2)
        array([[0.  , 0.  ],
               [0.5 , 0.5 ],
               [0.25, 0.75],
               [0.75, 0.25]])
    """
    n_points = integer("n_points", n_points, minimum=0)
    n_dim = integer("n_dim", n_dim, minimum=1)
    first = integer("first", first, minimum=1)
    if n_dim > MAX_DIMENSIONS:
        raise invalid(
            "n_dim",
            f"at most {MAX_DIMENSIONS} for LPτ",
            n_dim,
            "use QMCSampling, whose engines have no such limit",
        )
    start = first - 1
    stop = start + n_points
    directions = _directions()[:n_dim]
    # Within an aligned block of 2^low_bits indices the bits above low_bits do not change: about as
    # many blocks as each has indices are two small tables, whose combinations are the points.
    low_bits = (n_points - 1).bit_length() // 2
    low = _points(directions, np.arange(1 << low_bits, dtype=np.uint64))
    blocks = np.arange(start >> low_bits, ((stop - 1) >> low_bits) + 1, dtype=np.uint64)
    high = _points(directions, blocks << np.uint64(low_bits))
    points = (high[:, None, :] ^ low).reshape(-1, n_dim)
    skipped = start & (len(low) - 1)
    return np.ldexp(points[skipped : skipped + n_points].astype(np.float64), -_BITS)


def lp_tau_at(numbers: NDArray[np.int64], n_dim: int) -> Array:
    """Return the points of any ``(n,)`` numbers, from 1; slower than :func:`lp_tau`."""
    indices = numbers.astype(np.uint64) - np.uint64(1)
    points = _points(_directions()[:n_dim], indices)
    return np.ldexp(points.astype(np.float64), -_BITS)


def _points(directions: Integers, indices: Integers) -> Integers:
    """Return the points of any indices as integers.

    Args:
        directions: ``(d, 52)`` V_jk · 2^52.
        indices: ``(n,)`` any below 2^52.

    Returns:
        ``(n, d)`` coordinates · 2^52.
    """
    points = np.zeros((len(indices), len(directions)), dtype=np.uint64)
    for k in range(int(indices.max(initial=0)).bit_length()):
        bits = indices >> np.uint64(k) & np.uint64(1)
        points ^= bits[:, None] * directions[:, k]
    return points


@lru_cache(maxsize=1)
def _directions() -> Integers:
    """Return V_jk · 2^52 for every dimension j and bit k, shape (51, 52)."""
    text = Path(__file__).with_name("lp_tau_directions.json").read_text("utf-8")
    numbers = []
    for entry in json.loads(text)["dimensions"]:
        numbers.append(_extended(entry["degree"], entry["poly_inner"], entry["m"]))
    table = np.array(numbers, dtype=np.uint64)
    table.setflags(write=False)
    return table


def _extended(degree: int, inner: int, initial: list[int]) -> list[int]:
    """Return m_k · 2^(52 − k), k = 1..52, of a primitive polynomial.

    Recurrence: m_k = m_{k−s} xor 2^s m_{k−s} xor (xor of a_q 2^q m_{k−q} over q = 1..s−1).
    """
    numbers = list(initial)
    if degree == 0:  # the van der Corput sequence: every m_k is 1
        numbers = [1] * _BITS
    for k in range(len(numbers), _BITS):
        value = numbers[k - degree] ^ numbers[k - degree] << degree
        for q in range(1, degree):
            if inner >> (degree - 1 - q) & 1:
                value ^= numbers[k - q] << q
        numbers.append(value)
    return [m << (_BITS - k) for k, m in enumerate(numbers, start=1)]
