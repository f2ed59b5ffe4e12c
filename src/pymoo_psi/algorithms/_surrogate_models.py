"""Surrogates: cheap functions through the tests of an expensive model.

A Gaussian process for each output learns a length for every variable, and knows how sure it is. It
sees designs as points of a unit cube, and outputs on scales without heavy tails.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, lapack
from scipy.optimize import minimize

Array = NDArray[np.float64]

_ROOT5 = np.sqrt(5.0)
# Of the logarithm of the noise's share of the variance. The floor keeps the covariance matrix
# regular in float64; above a tenth, an output is not described by the variables.
_LOG_NOISE = (np.log(1e-6), np.log(1e-1))
# Of the logarithm of a length: below, tests say nothing of each other; above, a line is straight.
_LOG_LENGTH = (np.log(0.03), np.log(100.0))
# Tukey (1977) calls a value far out that is three quartile distances beyond a quartile. A sample
# with such values has a heavy tail. The middle half, however, may be all of a kind: then the unit
# of a logarithmic scale is at least a hundredth of it.
_FAR_OUT, _LEAST_UNIT = 3.0, 0.01
# Values beyond so many quartile distances, such as a penalty of 1e30, say nothing more.
_BEYOND = 1e6
# What several tests share, so many ranges of all others beyond the worst of them, stands for none:
# a tail, as of a pole, has values on the way.
_PENALTY = 1e4
_MET = 0.02  # of the median violation: how far below 0 a constraint is taken to be that is met
_HUGE = 1e100  # the squares of larger values overflow
# A priori, the logarithm of a trend's share of the variance.
_LOG_TREND = -2.0
# Tests to which lengths are fitted: more take the third power of their number in time, a second
# for an output with 512, and change lengths little.
_MOST = 256
_STEPS = 40  # of L-BFGS-B, at most


@dataclass(frozen=True)
class Scale:
    """A monotone scale of an output: standardised, and logarithmic where its tail is heavy.

    Attributes:
        origin: Where the scale is finest: the best value of an objective, 0 of a constraint.
        unit: The scale is about linear within so much of the origin and logarithmic beyond,
            ``arcsinh((y - origin) / unit)``; infinite: ``y`` itself.
        mean: Of the values on the scale.
        deviation: Their standard deviation.
    """

    origin: float
    unit: float
    mean: float = 0.0
    deviation: float = 1.0

    @classmethod
    def of(cls, y: Array, origin: float, unit: float) -> Scale:
        """Return the scale on which ``(n,)`` values of an output have mean 0 and deviation 1."""
        t = cls(origin, unit).to(y)
        deviation = float(t.std())
        return cls(origin, unit, float(t.mean()), deviation if deviation > 0 else 1.0)

    def to(self, y: Array | float) -> Array:
        """Return values of the output on the scale."""
        t = y if np.isinf(self.unit) else np.arcsinh((y - self.origin) / self.unit)
        return np.asarray((t - self.mean) / self.deviation)

    def back(self, t: Array) -> Array:
        """Return values on the scale as values of the output."""
        t = t * self.deviation + self.mean
        if np.isinf(self.unit):
            return t
        # A prediction as far off as sinh(300) is of no use, but must be finite in any unit.
        return np.asarray(self.origin + self.unit * np.sinh(np.clip(t, -300, 300)))

    def log_slope(self, y: Array) -> float:
        """Return the sum of log dt/dy over values: what densities on two scales differ by."""
        slope = -len(y) * np.log(self.deviation)
        if not np.isinf(self.unit):
            z = (y - self.origin) / self.unit
            slope -= float((0.5 * np.log1p(z**2)).sum()) + len(y) * np.log(self.unit)
        return float(slope)


def scales(y: Array, uniform: Array, *, constraint: bool) -> list[Scale]:
    """Return the scales that an output may have: linear; and logarithmic, if it has a heavy tail.

    Args:
        y: ``(n,)`` all its values, finite.
        uniform: Those at uniform points, which alone show its distribution: proposals crowd.
        constraint: Whether its sign counts.
    """
    found = [Scale.of(y, 0.0, np.inf)]
    q1, q3 = np.quantile(uniform, [0.25, 0.75])
    far = _FAR_OUT * (q3 - q1)
    if uniform.min() < q1 - far or uniform.max() > q3 + far:
        origin = 0.0 if constraint else float(uniform.min())
        low, high = np.quantile(np.abs(uniform - origin), [0.25, 0.75])
        unit = float(max(low, _LEAST_UNIT * (high - low)))
        if unit > 0:
            found.append(Scale.of(y, origin, unit))
    return found


def bounded(Y: Array) -> Array:
    """Return ``(n, q)`` outputs without NaN and infinities, and without values far beyond all."""
    Y = np.where(np.isinf(Y), Y, np.clip(Y, -_HUGE, _HUGE))
    for y in Y.T:
        finite = y[np.isfinite(y)]
        if len(finite) == 0:
            y[:] = 0.0
            continue
        q1, middle, q3 = np.quantile(finite, [0.25, 0.5, 0.75])
        y[np.isnan(y)] = finite.max()
        far = _BEYOND * (q3 - q1)
        low, high = (middle - far, middle + far) if far > 0 else (finite.min(), finite.max())
        np.clip(y, low, high, out=y)
    return Y


@np.errstate(over="ignore", invalid="ignore")  # infinities, and values near the largest float
def without_penalties(F: Array, uniform: Array) -> Array:
    """Return ``(n, m)`` objectives with the worst real value where they stand for "none".

    Models give infinity, or one large number, where a design has no meaning. On a scale with such
    a step all other designs would be the same. A pole, towards which values rise, is not meant.

    Args:
        F: The objectives of all tests.
        uniform: ``(k, m)`` those of tests at uniform points, which alone show how they are
            distributed.
    """
    F = F.copy()
    for y, u in zip(F.T, uniform.T, strict=True):
        for _ in range(2):  # below infinity may be a number
            others = u[u < u.max(initial=-np.inf)]
            if len(u) - len(others) < 2 or len(others) < 2:
                break
            worst = others.max()
            beyond = worst + _PENALTY * np.ptp(others)
            if u.max() > beyond > worst:
                y[y > beyond] = worst
                u = np.minimum(u, worst)
    return F


def below_zero(G: Array, n_uniform: int) -> Array:
    """Return ``(n, k)`` constraints that are below 0 where they are met.

    Many models give the amount of a violation, 0 where there is none. A surrogate of it is above 0
    as often as below wherever the constraint is met.

    Args:
        G: The constraints of all tests, NaN where unknown.
        n_uniform: How many of the first tests are at uniform points; these alone are compared.
    """
    G = G.copy()
    for g in G.T:
        first = g[:n_uniform]
        if not (first < 0).any() and (first > 0).any():
            g[g == 0] = -_MET * np.median(first[first > 0])
    return G


@dataclass(frozen=True)
class Fit:
    """What is fitted to tests now and then: a scale and lengths for each output.

    Attributes:
        scales: Of the q outputs.
        lengths: For each output, as :func:`fit_lengths` returns them.
        errors: ``(q,)`` root mean squares of what Gaussian processes miss tests by that they do
            not know, in standard deviations.
    """

    scales: tuple[Scale, ...]
    lengths: tuple[Array, ...]
    errors: Array

    @classmethod
    def of(cls, Z: Array, Y: Array, n_uniform: int, n_obj: int) -> Fit:
        """Fit to tests.

        Of two scales the one is taken on which values are the likelier given all others.

        Args:
            Z: ``(n, d)`` designs in the unit cube.
            Y: ``(n, q)`` their outputs, :func:`bounded`, the objectives first.
            n_uniform: How many of the first tests are at uniform points.
            n_obj: How many outputs are objectives.
        """
        best = []
        # evenly, so that both points and proposals are among them; the first n stay the first
        some = np.unique(np.linspace(0, len(Z) - 1, min(len(Z), _MOST)).round().astype(int))
        n_uniform = max(int((some < n_uniform).sum()), 1)
        Z, Y = Z[some], Y[some]
        for j, y in enumerate(Y.T):
            fits = []
            for scale in scales(y, y[:n_uniform], constraint=j >= n_obj):
                t = scale.to(y)
                lengths = fit_lengths(Z, t)
                mean, variance = GaussianProcess(Z, t, lengths).left_out(t)
                squares = (t - mean) ** 2
                # of each value given all others (Rasmussen and Williams, equation 5.10)
                density = -0.5 * float((np.log(2 * np.pi * variance) + squares / variance).sum())
                fits.append((density + scale.log_slope(y), scale, lengths, np.sqrt(squares.mean())))
            best.append(max(fits, key=lambda fit: fit[0])[1:])
        found, lengths_found, errors = zip(*best, strict=True)
        return cls(found, lengths_found, np.array(errors))

    def to(self, Y: Array) -> Array:
        """Return ``(n, q)`` outputs on their scales."""
        columns = [scale.to(y) for scale, y in zip(self.scales, Y.T, strict=True)]
        return np.column_stack(columns)

    def back(self, T: Array) -> Array:
        """Return values of the first outputs, or of all, from their scales."""
        return np.column_stack([s.back(t) for s, t in zip(self.scales, T.T, strict=False)])


class GaussianProcess:
    """A Gaussian process with constant mean, Matérn's kernel, ν = 5/2, and trends.

    The trends, linear and quadratic functions of single variables, are a part of the kernel. They
    are most of what few tests tell of many variables.

    Mean and variance are those that make the data likeliest for given lengths (Rasmussen and
    Williams, Gaussian Processes for Machine Learning, 2006, sections 2.2, 2.7 and 5.4).

    Args:
        Z: ``(n, d)`` designs in the unit cube.
        t: ``(n,)`` values of an output, of mean 0 and deviation 1.
        lengths: ``(d + 3,)`` as fitted by :func:`fit_lengths`.
    """

    def __init__(self, Z: Array, t: Array, lengths: Array) -> None:
        self._scale, self._trend = np.exp(-lengths[:-3]), np.exp(lengths[-2:] / 2)
        self._seen = self._features(Z)
        K = self._kernel(self._seen)
        K[np.diag_indices(len(K))] += np.exp(lengths[-3])
        self._factor = cho_factor(K, lower=True, overwrite_a=True, check_finite=False)
        ones = cho_solve(self._factor, np.ones(len(K)), check_finite=False)
        self.mean = float(ones @ t / ones.sum())
        self._weights = cho_solve(self._factor, t - self.mean, check_finite=False)
        self.variance = max(float((t - self.mean) @ self._weights) / len(t), 1e-12)

    def __call__(self, Z: Array) -> Array:
        """Return the ``(k,)`` means at designs."""
        return np.asarray(self.mean + self._kernel(self._features(Z)) @ self._weights)

    def deviation(self, Z: Array) -> Array:
        """Return the ``(k,)`` standard deviations at designs."""
        scaled, trend = self._features(Z)
        K, prior = self._kernel((scaled, trend)), 1 + (trend**2).sum(axis=1)
        known = (K * cho_solve(self._factor, K.T, check_finite=False).T).sum(axis=1)
        return np.asarray(np.sqrt(self.variance * np.maximum(prior - known, 0)))

    def left_out(self, t: Array) -> tuple[Array, Array]:
        """Return what all others say of each value: ``(n,)`` means and variances (eq. 5.12)."""
        inverse, _ = lapack.dpotri(self._factor[0], lower=1)
        diagonal = np.diag(inverse)
        return t - self._weights / diagonal, self.variance / diagonal

    def _features(self, Z: Array) -> tuple[Array, Array]:
        """Return designs as Matérn's kernel and as the trend see them."""
        weights = np.repeat(self._trend, Z.shape[1])
        return Z * self._scale, np.hstack(_trends(Z)) * weights

    def _kernel(self, at: tuple[Array, Array]) -> Array:
        (scaled, trend), (scaled_seen, trend_seen) = at, self._seen
        return _matern(scaled, scaled_seen)[0] + trend @ trend_seen.T


def fit_lengths(Z: Array, t: Array) -> Array:
    """Return the likeliest lengths for the tests, a priori as long as a cube is wide.

    Args:
        Z: ``(n, d)`` designs in the unit cube.
        t: ``(n,)`` values of an output, of mean 0 and deviation 1.

    Returns:
        ``(d + 3,)`` logarithms of the lengths, and of the shares that noise and linear and
        quadratic trends have of the variance.
    """
    d = Z.shape[1]
    # Hvarfner, Hellsten and Nardi (ICML 2024): lengths grow with the diagonal of the cube, or
    # nothing can be learned in many dimensions; log-normal, of this median and deviation.
    prior, spread = np.sqrt(2) + 0.5 * np.log(d), np.sqrt(3)

    def loss(x: Array) -> tuple[float, Array]:
        value, slope = _negative_log_likelihood(Z, t, x)
        z = (x[:d] - prior) / spread
        slope[:d] += z / spread
        # of the noise a half-normal prior, lest a model that has none is smoothed
        w = (x[d] - _LOG_NOISE[0]) / 5.0
        slope[d] += w / 5.0
        v = (x[d + 1 :] - _LOG_TREND) / 3.0
        slope[d + 1 :] += v / 3.0
        return value + 0.5 * float(z @ z) + 0.5 * w**2 + 0.5 * float(v @ v), slope

    lengths = np.full(d, np.log(0.5) + 0.5 * np.log(d))
    start = np.append(lengths, [np.log(1e-4), _LOG_TREND, _LOG_TREND])
    bounds = [_LOG_LENGTH] * d + [_LOG_NOISE] + [(-12.0, 6.0)] * 2
    options = {"maxiter": _STEPS}
    found = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return np.asarray(found.x)


def _negative_log_likelihood(Z: Array, t: Array, x: Array) -> tuple[float, Array]:
    """Return -log likelihood at the best mean and variance, and its gradient.

    Args:
        Z: ``(n, d)`` designs.
        t: ``(n,)`` values.
        x: ``(d + 3,)`` logarithms of lengths, noise and trends.
    """
    n, d = Z.shape
    S = Z * np.exp(-x[:d])
    K, slope = _matern(S, S)
    trends = [np.exp(weight) * (B @ B.T) for weight, B in zip(x[d + 1 :], _trends(Z), strict=True)]
    K += sum(trends)
    diagonal = np.diag_indices(n)
    noise = np.exp(x[d])
    K[diagonal] += noise
    # of the transpose, which is the same and in LAPACK's order; above the diagonal 0
    L, failed = lapack.dpotrf(K.T, lower=1, overwrite_a=1)
    if failed:  # not positive definite to rounding: no lengths to be looked for here
        return 1e10, np.zeros(d + 3)
    # A copy: of values that are apart, NumPy 1.25 takes another logarithm where the result happens
    # to lie behind them in memory, so that a run that goes on would differ in the last digit.
    log_det = 2 * float(np.log(np.diag(L).copy()).sum())
    half, _ = lapack.dpotri(L, lower=1, overwrite_c=1)
    inverse = half + half.T
    inverse[diagonal] = half[diagonal]
    ones = inverse.sum(axis=1)
    r = t - float(ones @ t / ones.sum())
    a = inverse @ r
    variance = max(float(r @ a) / n, 1e-12)
    value = 0.5 * (n * np.log(variance) + log_det)
    # dL/dK = (K^-1 - a a' / variance) / 2; equation 5.9, with the variance at its best
    W = inverse
    W -= np.outer(a, a / variance)
    # dK/dlog of a share is that share of K
    shares = [noise * float(np.trace(W)), *(float((W * trend).sum()) for trend in trends)]
    W *= slope
    # dK/dlog l_j = slope * (difference of column j)^2; sums of it over all pairs by products
    gradient = (S**2 * W.sum(axis=1)[:, None]).sum(axis=0) - (S * (W @ S)).sum(axis=0)
    return value, np.append(gradient, 0.5 * np.array(shares))


def _trends(Z: Array) -> list[Array]:
    """Return the linear and the quadratic functions of each variable, ``(n, d)`` each.

    Legendre's polynomials: over the cube each has mean 0, and all of a degree together variance 1.
    """
    u, d = 2 * Z - 1, Z.shape[1]
    return [u * np.sqrt(3 / d), (3 * u**2 - 1) * np.sqrt(5 / 4 / d)]


def _matern(A: Array, B: Array) -> tuple[Array, Array]:
    """Return Matérn's kernel of scaled designs, and what its derivative by log lengths has."""
    squares = (A**2).sum(axis=1)[:, None] + (B**2).sum(axis=1) - 2 * (A @ B.T)
    r = np.sqrt(np.maximum(squares, 0)) * _ROOT5
    e = np.exp(-r)
    return (r + 1 + r * r / 3) * e, (r + 1) * (5.0 / 3.0) * e
