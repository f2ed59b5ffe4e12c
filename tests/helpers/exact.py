"""Ranks of efficiency in exact rational arithmetic, by loops over all pairs: slow and obvious.

Values and criteria are equal where they differ by no more than the noise levels that the package
documents. Where a difference is so near to its noise level that rounding may take it for either,
the oracle says that the case is not decided.
"""

from fractions import Fraction
from math import isqrt
from types import SimpleNamespace

import numpy as np

EPS = Fraction(1, 2**52)
NOISE = 64 * EPS  # of a value, as a share of its size
LAST_PLACES = 8 * EPS  # of a term of a distance, as a share of its size


def root(square):
    """The square root of a fraction, to some hundred digits."""
    product = square.numerator * square.denominator
    shift = max(0, 400 - product.bit_length() // 2)
    return Fraction(isqrt(product << 2 * shift), square.denominator << shift)


def as_float(value):
    try:
        return float(value)
    except OverflowError:
        return float("inf") if value > 0 else float("-inf")


def assert_same_ranks(one, other):
    """Require that two rankings, or one and the exact one, say the same of every design."""
    for name in ("pareto", "rank", "place", "salukvadze"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


class Oracle:
    def __init__(self):
        self.decided = True

    def groups(self, values, noise_of):
        """Of each value, the least value that it is equal to up to noise."""
        least, leader = {}, None
        for value in sorted(set(values)):
            if leader is not None:
                noise = noise_of(leader)
                self.decided &= not noise / 2 < value - leader < 2 * noise
            if leader is None or value - leader > noise:
                leader = value
            least[value] = leader
        return [least[value] for value in values]

    def settled(self, rows):
        columns = [
            self.groups(column, lambda v: NOISE * abs(v)) for column in zip(*rows, strict=True)
        ]
        return [tuple(row) for row in zip(*columns, strict=True)]

    def span(self, low, high):
        noise = NOISE * max(abs(low), abs(high))
        self.decided &= not noise / 2 < high - low < 2 * noise
        return high - low if high - low > noise else Fraction(0)


def numbered(column):
    """The values of a column as integers in the same order, equal ones the same."""
    return np.unique(np.array(column, dtype=object), return_inverse=True)[1].tolist()


def best_rows(rows):
    """Which rows no other row dominates."""
    rows = np.array(rows)
    return [not ((rows <= row).all(axis=1) & (rows < row).any(axis=1)).any() for row in rows]


def best_in(levels, j, k):
    """Which points no other beats in two criteria; between equal ones the third decides."""
    a, b, third = levels[:, j], levels[:, k], levels[:, 3 - j - k]
    result = []
    for p, q, r in zip(a, b, third, strict=True):
        better = (a <= p) & (b <= q) & ((a < p) | (b < q))
        result.append(not (better | ((a == p) & (b == q) & (third < r))).any())
    return result


def exact_ranking(F, *, normalize=True, maximize=()):
    """The ranking under its names, the noise of each criterion, and whether it is decided."""
    oracle = Oracle()
    signs = [-1 if j in maximize else 1 for j in range(F.shape[1])]
    raw = [tuple(s * Fraction(v) for s, v in zip(signs, row, strict=True)) for row in F.tolist()]
    rows = oracle.settled(raw)
    pareto = best_rows(
        list(zip(*[numbered(column) for column in zip(*rows, strict=True)], strict=True))
    )
    front = oracle.settled([row for row, is_in in zip(raw, pareto, strict=True) if is_in])
    settled = iter(front)
    raw = [next(settled) if is_in else row for row, is_in in zip(raw, pareto, strict=True)]
    U, N = ([f(column) for column in zip(*front, strict=True)] for f in (min, max))
    span = [oracle.span(u, n) for u, n in zip(U, N, strict=True)]
    scale = span if normalize else [Fraction(1)] * len(span)
    line = [s / c if c else Fraction(0) for s, c in zip(span, scale, strict=True)]
    square = sum(x * x for x in line)
    e2 = [x * x / square if square else x for x in line]

    def exact_criteria(row):
        d = [(f - u) / c if c else Fraction(0) for f, u, c in zip(row, U, scale, strict=True)]
        mu1 = sum(x * x for x in d)
        along = sum(x * y for x, y in zip(d, line, strict=True))
        mu3 = along * abs(along) / square if square else Fraction(0)
        return root(mu1), root(mu1 - abs(mu3)), root(abs(mu3)) * (1 if mu3 >= 0 else -1)

    every = {row: exact_criteria(row) for row in set(raw)}
    criteria = np.array([[as_float(mu) for mu in every[row]] for row in raw])
    size2 = [
        (max(abs(f[j]) for f in front) / scale[j]) ** 2 if span[j] else Fraction(0)
        for j in range(len(span))
    ]
    shares = [[Fraction(1)] * len(e2), [sum(e2) - x for x in e2], e2]
    columns, noise = [], []
    for column, share in zip(zip(*(every[row] for row in front), strict=True), shares, strict=True):
        tolerance = LAST_PLACES * root(sum(s * x for s, x in zip(size2, share, strict=True)))
        noise.append(as_float(tolerance))
        columns.append(numbered(oracle.groups(column, lambda v, t=tolerance: t)))
    levels = np.array(columns).T
    p12, p13, p23 = best_in(levels, 0, 1), best_in(levels, 0, 2), best_in(levels, 1, 2)
    rank, place = np.zeros((2, len(raw)), dtype=int)
    rank[pareto] = np.array([p23, p13, p12]).T @ [3, 2, 1]
    place[pareto] = [1 + sum(other < level for other in levels[:, 0]) for level in levels[:, 0]]
    return SimpleNamespace(
        pareto=pareto,
        rank=rank.tolist(),
        place=place.tolist(),
        salukvadze=np.flatnonzero(place == 1).tolist(),
        criteria=criteria,
        noise=np.array(noise),
        decided=oracle.decided,
    )
