"""Surrogates: cheap approximations of an expensive model, fitted to its tests.

Each output has a Gaussian process with a length and a bend for every variable; it predicts a mean
and a standard deviation. Designs are given to it as points of a unit cube, outputs on scales
without heavy tails.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve, cholesky, lapack, solve, solve_triangular
from scipy.optimize import minimize

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Array, Rows
from pymoo_psi.problems import DesignSpace

# Surrogates learn from tests that are at most this many widths of the bounds outside. Values far
# away, often of another size, would decide what is learned.
REACH = 1.0
_LEAST_VARIANCE = 1e-12


def evenly_spread(n: int, most: int) -> Rows:
    """Return the indices of n tests, or so many of them, evenly spread."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(int))


def encoded(space: DesignSpace, places: Array) -> Array:
    """Return ``(n, n_var)`` places of designs between the bounds as surrogates see them.

    Places of the same design are equal there. An integer is its place between its bounds. A choice
    has a column for every option, as options have no order.
    """
    columns = []
    for variable, u in zip(space.searched, places.T[space.are_searched], strict=True):
        if variable.kind.real:
            columns.append(u)
            continue
        count = int(variable.upper - variable.lower) + 1
        step = np.floor(u * count)
        step[u == 1] = count - 1  # an end of the unit cube; values beyond the bounds give others
        if variable.kind is Kind.CHOICE:
            columns += list(step == np.arange(count)[:, None])
        else:
            columns.append(step / max(count - 1, 1))
    return np.column_stack(columns).astype(float)


# Scales of outputs

# A value is "far out" if it is three quartile distances beyond a quartile (Tukey 1977). A sample
# with such values has a heavy tail.
_FAR_OUT = 3.0
# The middle half of the values may be nearly equal: the unit of a logarithmic scale is at least
# this share of the quartile distance.
_LEAST_UNIT = 0.01
_NEARLY_ONE = 1 - 1e-12  # a value far out on a reciprocal scale


@dataclass(frozen=True)
class Scale:
    """A monotone scale for an output: standardised, and bent where its tail is heavy.

    With ``z = (y - origin) / unit``, the scale is ``arcsinh(z)``, or ``z / (1 + |z|)`` if it is
    reciprocal, minus the mean, divided by the deviation. It is nearly linear within one unit of the
    origin, and logarithmic or reciprocal beyond. A reciprocal scale makes a pole straight, such as
    that of a stress or a deflection where a section vanishes.

    Attributes:
        origin: Where the scale is finest: the best value of an objective, 0 for a constraint.
        unit: The unit; infinite for a linear scale, which is ``y`` standardised.
        reciprocal: Whether the scale is reciprocal.
        most: Twice the largest size of the values. Predictions beyond have no meaning, and those on
            a reciprocal scale are cut there, as they lie on both sides of the pole. On another
            scale they show a search where to go.
        mean: Mean of the values before they are standardised.
        deviation: Their standard deviation.
        met: How far below 0 a constraint is taken to be where it is met, if it is the amount of a
            violation; otherwise 0.
    """

    origin: float
    unit: float
    reciprocal: bool = False
    most: float = np.inf
    mean: float = 0.0
    deviation: float = 1.0
    met: float = 0.0

    @classmethod
    def of(cls, y: Array, origin: float, unit: float, reciprocal: bool = False) -> Scale:
        """Return the scale on which ``(n,)`` values of an output have mean 0 and deviation 1."""
        scale = cls(origin, unit, reciprocal, 2 * float(np.abs(y).max()))
        t = scale.to(y)
        return replace(scale, mean=t.mean(), deviation=t.std() or 1.0)  # all may be equal

    def to(self, y: Array | float) -> Array:
        """Return values of the output on the scale."""
        t = y
        if np.isfinite(self.unit):
            z = (y - self.origin) / self.unit
            t = np.arcsinh(z)
            if self.reciprocal:
                t = z / (1 + np.abs(z))
        return np.asarray((t - self.mean) / self.deviation)

    def back(self, t: Array) -> Array:
        """Return values on the scale as values of the output."""
        t = t * self.deviation + self.mean
        if np.isinf(self.unit):
            return t
        if not self.reciprocal:
            # Useless predictions, as large as sinh(300), must be finite in any unit.
            return self.origin + self.unit * np.sinh(np.clip(t, -300, 300))
        t = np.clip(t, -_NEARLY_ONE, _NEARLY_ONE)
        y = self.origin + self.unit * t / (1 - np.abs(t))
        return np.asarray(np.clip(y, -self.most, self.most))

    def log_slope(self, y: Array) -> float:
        """Return the sum of log dt/dy over values, by which densities on two scales differ."""
        slope = -len(y) * np.log(self.deviation)
        if np.isfinite(self.unit):
            z = (y - self.origin) / self.unit
            curvature = 0.5 * np.log1p(z**2)
            if self.reciprocal:
                curvature = 2 * np.log1p(np.abs(z))
            slope -= curvature.sum() + len(y) * np.log(self.unit)
        return float(slope)


def scales(y: Array, uniform: Array, *, constraint: bool) -> list[Scale]:
    """Return the scales to choose from: a linear one, and others for a heavy tail.

    Args:
        y: ``(n,)`` all values of the output, finite.
        uniform: The values at uniform points. Only these show the distribution, as proposals lie
            close together.
        constraint: Whether the output is a constraint, whose sign matters.
    """
    linear = Scale.of(y, 0.0, np.inf)
    q1, q3 = np.quantile(uniform, [0.25, 0.75])
    far = _FAR_OUT * (q3 - q1)
    if uniform.min() >= q1 - far and uniform.max() <= q3 + far:
        return [linear]
    origin = 0.0 if constraint else uniform.min()
    low, high = np.quantile(np.abs(uniform - origin), [0.25, 0.75])
    unit = max(low, _LEAST_UNIT * (high - low))
    if unit <= 0:
        return [linear]
    return [linear, Scale.of(y, origin, unit), Scale.of(y, origin, unit, reciprocal=True)]


_HUGE = 1e100  # the squares of larger values overflow
# Values further out than this many quartile distances, such as a penalty of 1e30, are cut there.
_BEYOND = 1e6


def bounded(Y: Array) -> Array:
    """Return ``(n, q)`` outputs in which NaN, infinite and extreme values are replaced.

    NaN becomes the largest finite value of its column; values far from the median are cut.
    """
    Y = np.where(np.isinf(Y), Y, np.clip(Y, -_HUGE, _HUGE))
    for y in Y.T:
        finite = y[np.isfinite(y)]
        if len(finite) == 0:
            y[:] = 0.0
            continue
        q1, median, q3 = np.quantile(finite, [0.25, 0.5, 0.75])
        y[np.isnan(y)] = finite.max()
        far = _BEYOND * (q3 - q1)
        ends = median - far, median + far
        if far == 0:
            ends = finite.min(), finite.max()
        np.clip(y, *ends, out=y)
    return Y


# A value that several tests share is a penalty if it lies this many ranges of all others beyond
# the worst of them. A heavy tail, such as that of a pole, has values in between.
_PENALTY = 1e4


@np.errstate(over="ignore", invalid="ignore")  # infinities, and values near the largest float
def without_penalties(F: Array, uniform: Array) -> Array:
    """Return ``(n, m)`` objectives in which penalties are replaced by the worst other value.

    Models return infinity, or one large number, for a design without meaning. On a scale with such
    a step all other designs would look alike. A pole, towards which values increase, is kept.

    Args:
        F: The objectives of all tests.
        uniform: ``(k, m)`` the objectives of tests at uniform points, which alone show the
            distribution.
    """
    F = F.copy()
    for y, u in zip(F.T, uniform.T, strict=True):
        for _ in range(2):  # some designs may have infinity and others a large number
            others = u[u < u.max(initial=-np.inf)]
            n_equal = len(u) - len(others)
            if n_equal < 2 or len(others) < 2:
                break
            worst = others.max()
            beyond = worst + _PENALTY * np.ptp(others)
            if u.max() > beyond > worst:
                y[y > beyond] = worst
                u = np.minimum(u, worst)
    return F


# Gaussian processes

_ROOT5 = np.sqrt(5.0)
_LEAST_RATE = 1e-4  # a bend of this rate moves values by 1e-5 of the width of a variable


class Kernel(NamedTuple):
    """The hyperparameters of a process, in the order in which :func:`fit_kernel` seeks them.

    The kernel is Matérn's, ν = 5/2, of :func:`_bent` designs, and trends. The trends, linear and
    quadratic functions of single variables, are a part of the kernel. With few tests of many
    variables, they hold most of what can be learned.

    Attributes:
        lengths: ``(d,)`` logarithms of the lengths.
        bends: ``(d,)`` the bends.
        noise: ``(1,)`` the logarithm of the share of the variance that noise has.
        trends: ``(2,)`` the same of the linear and the quadratic trends.
    """

    lengths: Array
    bends: Array
    noise: Array
    trends: Array

    @classmethod
    def of(cls, x: Array) -> Kernel:
        """Return the kernel of ``(2 d + 3,)`` values."""
        d = len(x) // 2 - 1
        return cls(*np.split(x, [d, 2 * d, 2 * d + 1]))

    def scaled(self, Z: Array) -> Array:
        """Return ``(n, d)`` designs, bent, in units of lengths: distances give covariances."""
        return _bent(Z, _rates(self.bends)) * np.exp(-self.lengths)


def _rates(bends: Array) -> Array:
    """Return the ``(d,)`` rates of bends; in none of them it is 0, where :func:`_bent` is 0/0."""
    rates = np.sinh(bends)
    return np.where(np.abs(rates) < _LEAST_RATE, _LEAST_RATE, rates)


def _bent(Z: Array, rates: Array) -> Array:
    """Return ``(n, d)`` designs in which one end of each variable is widened.

    The end is the upper one for a positive rate. So a process with one length for a variable can
    change much faster near one end than near the other, as x^100 does. Sides of the cube stay
    where they are, and what lies beyond them, such as tests within other bounds, is not bent.
    """
    inside = np.clip(Z, 0, 1)
    return np.expm1(rates * inside) / np.expm1(rates) + (Z - inside)


def _trends(Z: Array) -> list[Array]:
    """Return the linear and the quadratic functions of each variable, ``(n, d)`` each.

    They are Legendre polynomials: each has mean 0 over the cube, and all of one degree together
    have variance 1.
    """
    d = Z.shape[1]
    u = 2 * Z - 1
    linear = u * np.sqrt(3 / d)
    quadratic = (3 * u**2 - 1) * np.sqrt(5 / 4 / d)
    return [linear, quadratic]


class Covariance:
    """The covariance matrix of tests for a given kernel, factored.

    Args:
        Z: ``(n, d)`` designs in the unit cube.
        kernel: The kernel.

    Attributes:
        factor: ``(n, n)`` the lower Cholesky factor.
        trends: ``(n, 2 d)`` the trends of the tests.
    """

    def __init__(self, Z: Array, kernel: Kernel) -> None:
        self._kernel = kernel
        self._trend_weights = np.repeat(np.exp(kernel.trends / 2), Z.shape[1])
        self.trends = self.trends_of(Z)
        rows = self._rows(Z)
        # The product of rows and these columns has the squared distances of designs.
        self._columns = np.vstack([-2 * rows[:, :-2].T, rows[:, -1], rows[:, -2]])
        K = self.matern(Z) + self.trends @ self.trends.T
        K[np.diag_indices(len(Z))] += np.exp(kernel.noise)
        self.factor = cholesky(K, lower=True, overwrite_a=True, check_finite=False)

    def unexplained(self, Z: Array) -> Array:
        """Return the ``(k,)`` parts of the variance of designs that the tests do not explain."""
        trends = self.trends_of(Z)
        kernel = self.matern(Z) + trends @ self.trends.T
        half = solve_triangular(self.factor, kernel.T, lower=True, check_finite=False)
        prior = 1 + (trends**2).sum(axis=1)
        return np.asarray(np.maximum(prior - np.einsum("ij,ij->j", half, half), 0))

    def trends_of(self, Z: Array) -> Array:
        """Return the ``(k, 2 d)`` trends of designs, whose products are covariances."""
        return np.asarray(np.hstack(_trends(Z)) * self._trend_weights)

    def matern(self, Z: Array) -> Array:
        """Return ``(k, n)`` values of Matérn's kernel of designs and the tests.

        It takes most of the time of a search, and is computed in place of the squared distances.
        """
        squares = self._rows(Z) @ self._columns
        np.abs(squares, out=squares)  # rounding may leave less than 0
        r = np.sqrt(squares)
        squares /= 3
        squares += r
        squares += 1
        squares /= np.exp(r, out=r)
        return squares

    def _rows(self, Z: Array) -> Array:
        """Return ``(k, d + 2)`` designs a, as :meth:`Kernel.scaled`, as rows ``(a, a·a, 1)``."""
        designs = _ROOT5 * self._kernel.scaled(Z)
        return np.column_stack([designs, (designs**2).sum(axis=1), np.ones(len(Z))])


class GaussianProcess:
    """A Gaussian process with constant mean.

    Mean and variance are the most likely ones for a given kernel (Rasmussen and Williams, Gaussian
    Processes for Machine Learning, 2006, sections 2.2, 2.7 and 5.4).

    Args:
        covariance: The covariance of the tests.
        t: ``(n,)`` their values of an output, of mean 0 and deviation 1.
    """

    def __init__(self, covariance: Covariance, t: Array) -> None:
        self._covariance = covariance
        self._t = t
        columns = np.column_stack([np.ones(len(t)), t])
        ones, solved = cho_solve((covariance.factor, True), columns, check_finite=False).T
        self.mean = ones @ t / ones.sum()
        self._weights = solved - self.mean * ones
        self._trend_weights = covariance.trends.T @ self._weights
        self.variance = max(((t - self.mean) @ self._weights) / len(t), _LEAST_VARIANCE)

    def __call__(self, Z: Array) -> Array:
        """Return the ``(k,)`` means at designs."""
        covariance = self._covariance
        trend = covariance.trends_of(Z) @ self._trend_weights
        return np.asarray(self.mean + covariance.matern(Z) @ self._weights + trend)

    def deviation(self, Z: Array) -> Array:
        """Return the ``(k,)`` standard deviations at designs."""
        return np.asarray(np.sqrt(self.variance * self._covariance.unexplained(Z)))

    def left_out(self) -> tuple[Array, Array]:
        """Return ``(n,)`` means and variances of each value, given all others (eq. 5.12)."""
        diagonal = np.diag(_inverse(self._covariance.factor))
        return self._t - self._weights / diagonal, self.variance / diagonal


def _inverse(factor: Array) -> Array:
    """Return the inverse of a matrix, given its lower Cholesky factor."""
    half, _ = lapack.dpotri(factor, lower=1)
    inverse = half + half.T
    np.fill_diagonal(inverse, np.diag(half))
    return np.asarray(inverse)


# Fits of outputs

# A constraint that is met is taken to be this far below 0, in units of the median violation, where
# violations do not say how far.
_MET = 0.02
# Kernels are fitted to at most this many tests. The time grows with the third power (a second for
# an output with 512), and more tests change them little.
_MOST = 256


@dataclass(frozen=True)
class OutputFit:
    """The scale and the kernel of one output.

    Attributes:
        scale: The scale.
        kernel: The kernel.
        error: Root mean square error of leave-one-out predictions, in standard deviations of the
            output.
        log_density: The sum of the log predictive densities of every value, given all others
            (Rasmussen and Williams, equation 5.10).
    """

    scale: Scale
    kernel: Kernel
    error: float
    log_density: float

    @classmethod
    def of(cls, Z: Array, y: Array, uniform: Array, *, constraint: bool) -> OutputFit:
        """Fit ``(n,)`` values at ``(n, d)`` designs, on the scale on which they are most likely.

        The other arguments are those of :func:`scales`.
        """
        options = scales(y, uniform, constraint=constraint)
        if constraint and y.max() > y.min() == 0:
            violations = uniform[uniform > 0]
            if len(violations) == 0:
                violations = y[y > 0]
            met = _MET * float(np.median(violations))
            # On a reciprocal scale all large violations would be alike.
            options = scales(y, y[y > 0], constraint=True)[:2]
            options = [replace(scale, met=met) for scale in options]
        rows = evenly_spread(len(y), _MOST)  # points and proposals are both among them
        fits = [cls.on_scale(Z[rows], y[rows], scale) for scale in options]
        return max(fits, key=lambda fit: fit.log_density)

    @classmethod
    def on_scale(cls, Z: Array, y: Array, scale: Scale) -> OutputFit:
        """Fit ``(n,)`` values at ``(n, d)`` designs on a scale."""
        t = scale.to(y)
        if scale.met > 0:
            is_violated = y > 0
            kernel = fit_kernel(Z[is_violated], t[is_violated])
            t = _continued(Covariance(Z, kernel), t, scale)
        kernel = fit_kernel(Z, t)
        mean, variance = GaussianProcess(Covariance(Z, kernel), t).left_out()
        squares = (t - mean) ** 2
        terms = np.log(2 * np.pi * variance) + squares / variance
        # densities of y, as those of t cannot be compared between scales
        log_density = -0.5 * terms.sum() + scale.log_slope(y)
        return cls(scale, kernel, np.sqrt(squares.mean()), log_density)

    def process(self, Z: Array, t: Array) -> GaussianProcess:
        """Return the process of ``(n,)`` values on the scale, at ``(n, d)`` designs."""
        covariance = Covariance(Z, self.kernel)
        if self.scale.met > 0:
            t = _continued(covariance, t, self.scale)
        return GaussianProcess(covariance, t)


def _continued(covariance: Covariance, t: Array, scale: Scale) -> Array:
    """Return a constraint with negative values where it is met, which the violations suggest.

    Many models return the amount of a violation, 0 where the constraint is met. A process of such
    values would be wrong about the boundary, where the best designs often lie. Values of met
    constraints are the most likely ones that are below 0: their expectations given the violations,
    and given those that would be above 0 otherwise, which are a little below.

    Args:
        covariance: The covariance of the tests.
        t: ``(n,)`` the constraint, on its scale.
        scale: This scale.
    """
    zero = scale.to(0.0)
    met = scale.to(-scale.met)
    inverse = _inverse(covariance.factor)
    ones = inverse.sum(axis=1)
    least = 2 * zero - t.max()
    is_known = t > zero
    t = np.where(is_known, t, met)
    while not is_known.all():
        mean = ones @ t / ones.sum()
        pull = inverse[np.ix_(~is_known, is_known)] @ (t[is_known] - mean)
        t[~is_known] = mean - solve(inverse[np.ix_(~is_known, ~is_known)], pull, assume_a="pos")
        is_above = ~is_known & (t > zero)
        if not is_above.any():
            break
        t[is_above] = np.maximum(met, 2 * zero - t[is_above])
        is_known |= is_above
    return np.asarray(np.maximum(t, least))


# Fits of kernels

# Bounds for the logarithm of the noise's share of the variance. The lower one keeps the covariance
# matrix regular in float64; beyond a tenth, the variables do not describe the output.
_LOG_NOISE = (np.log(1e-6), np.log(1e-1))
# Bounds for the logarithm of a length. Below, tests carry no information about each other; above,
# the process is a straight line.
_LOG_LENGTH = (np.log(0.03), np.log(100.0))
# Prior mean of the logarithm of a trend's share of the variance.
_LOG_TREND = -2.0
_LOG_TREND_BOUNDS = (-12.0, 6.0)
# Bounds for the bend of a variable, and its prior standard deviation with up to _FEW_BENDS
# variables. With more it decreases by the square of their number, as few tests of many variables
# say little about bends: with 20 variables, WFG5 lost by a deviation of 0.2.
_BENDS = (-6.0, 6.0)
_BEND_SPREAD = 0.5
_FEW_BENDS = 8
_STEPS = 40  # L-BFGS-B makes at most so many


def fit_kernel(Z: Array, t: Array) -> Kernel:
    """Return the most likely kernel, whose lengths are about the width of the cube a priori.

    Args:
        Z: ``(n, d)`` designs in the unit cube.
        t: ``(n,)`` values of an output, of mean 0 and deviation 1.
    """
    d = Z.shape[1]
    bend_spread = _BEND_SPREAD * min(1.0, (_FEW_BENDS / d) ** 2)
    # The start, the mean and the deviation of a normal prior, and bounds. The prior of a length is
    # that of Hvarfner, Hellsten and Nardi (ICML 2024): lengths grow with the diagonal of the cube,
    # or nothing can be learned in many dimensions. That of the noise is a half-normal one, lest a
    # model without noise is smoothed.
    diagonal = 0.5 * np.log(d)
    rules = [
        (np.log(0.5) + diagonal, np.sqrt(2) + diagonal, np.sqrt(3), *_LOG_LENGTH),
        (0.0, 0.0, bend_spread, *_BENDS),
        (np.log(1e-4), _LOG_NOISE[0], 5.0, *_LOG_NOISE),
        (_LOG_TREND, _LOG_TREND, 3.0, *_LOG_TREND_BOUNDS),
    ]
    start, prior, spread, *bounds = np.repeat(rules, [d, d, 1, 2], axis=0).T

    def loss(x: Array) -> tuple[float, Array]:
        value, slope = _negative_log_likelihood(Z, t, Kernel.of(x))
        z = (x - prior) / spread
        return value + 0.5 * (z @ z), slope + z / spread

    optimum = minimize(
        loss,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=np.transpose(bounds),
        options={"maxiter": _STEPS},
    )
    return Kernel.of(optimum.x)


def _negative_log_likelihood(Z: Array, t: Array, kernel: Kernel) -> tuple[float, Array]:
    """Return -log likelihood at the best mean and variance, and its gradient by the kernel.

    Args:
        Z: ``(n, d)`` designs.
        t: ``(n,)`` values.
        kernel: The kernel.
    """
    n = len(Z)
    S = kernel.scaled(Z)
    K, slope = _matern(S)
    shares = zip(kernel.trends, _trends(Z), strict=True)
    trends = [np.exp(log_share) * (B @ B.T) for log_share, B in shares]
    K += sum(trends)
    noise = np.exp(kernel.noise)
    K[np.diag_indices(n)] += noise
    # The transpose is the same matrix in LAPACK's order.
    L = cholesky(K.T, lower=True, overwrite_a=True, check_finite=False)
    # A copy, as NumPy 1.25 takes another logarithm for strided values, depending on whether the
    # result lies behind them in memory: a continued run would differ in the last digit.
    log_det = 2 * np.log(np.diag(L).copy()).sum()
    W = _inverse(L)
    ones = W.sum(axis=1)
    r = t - (ones @ t / ones.sum())
    a = W @ r
    variance = max((r @ a) / n, _LEAST_VARIANCE)
    value = 0.5 * (n * np.log(variance) + log_det)
    # dL/dK = (K^-1 - a a' / variance) / 2: equation 5.9 at the best variance
    W -= np.outer(a, a / variance)
    # The derivative of K by the logarithm of a share is that share of K.
    by_share = [*(noise * np.trace(W)), *((W * trend).sum() for trend in trends)]
    by_length, by_bend = _slopes_by_variable(Z, kernel, S, W * slope)
    return value, np.concatenate([by_length, by_bend, 0.5 * np.array(by_share)])


def _matern(S: Array) -> tuple[Array, Array]:
    """Return Matérn's kernel of scaled designs, and a factor of its derivative by log lengths."""
    sizes = (S**2).sum(axis=1)
    squares = sizes[:, None] + sizes - 2 * (S @ S.T)
    r = np.sqrt(np.maximum(squares, 0)) * _ROOT5
    e = np.exp(-r)
    kernel = (r + 1 + r * r / 3) * e
    slope = (r + 1) * (5.0 / 3.0) * e
    return kernel, slope


def _slopes_by_variable(Z: Array, kernel: Kernel, S: Array, W: Array) -> tuple[Array, Array]:
    """Return the ``(d,)`` derivatives of the likelihood by log lengths, and those by bends.

    Args:
        Z: ``(n, d)`` designs.
        kernel: The kernel.
        S: ``(n, d)`` the designs, bent and in units of lengths.
        W: ``(n, n)`` dL/dK times the factor of dK by log lengths.
    """
    # dK/dlog l_j = slope * (difference of column j)^2, summed over all pairs by products
    differences = S * W.sum(axis=1)[:, None] - W @ S
    by_length = (S * differences).sum(axis=0)
    # the derivative of S by a bend; that of K is -slope * its difference * that of S
    rates = _rates(kernel.bends)
    inside = np.clip(Z, 0, 1)
    by_rate = inside * np.exp(rates * inside) - _bent(inside, rates) * np.exp(rates)
    by_rate /= np.expm1(rates)
    bending = by_rate * np.cosh(kernel.bends) * np.exp(-kernel.lengths)
    return by_length, -(bending * differences).sum(axis=0)
