"""Repeated tests of a design: their mean, and how sure a decision on means is.

The noise of an objective is taken to be normal and independent. Its variance is pooled from the
differences between tests of the same design, as far as designs do not differ in it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pymoo_psi._validation import (
    Array,
    Integers,
    Mask,
    Received,
    Rows,
    counted,
    invalid,
    known_name,
)
from pymoo_psi.pareto import (
    listed,
    nondominated,
    percent,
    sentence,
    unit_lengths,
)
from pymoo_psi.table._joining import unequal
from pymoo_psi.table._layout import (
    POINT,
    PROPOSAL_ROUND,
    RUN,
    Layout,
    blank,
    design_keys,
    first_of,
    first_rows,
)

if TYPE_CHECKING:
    import pandas as pd

    from pymoo_psi.table._table import TestTable

N_TESTS = "tests"
"""The column with the number of tests of a design."""

NEAR_BEST = 0.05
"""Designs at most 5 % farther from the ideal point than the best one are as good as it."""

_VARIABLES = "variables"
_SURE = 0.9  # the probability from which on no further tests are proposed
_FEWEST = 5  # designs with noise from which on variances are moderated, not pooled
_N_LISTED = 3  # the most designs that a remark names
_SAMPLES = 1000
_MANY = 2000  # designs above which there are fewer samples
_SAMPLES_OF_MANY = 200
_FEWEST_FOR_PRIOR = 5  # designs for each objective from which on means are shrunk
_LEAST_VARIANCE = 1e-9  # on scaled objectives, so that no matrix is singular
_SEED = 1
_ROUNDED = 1e-13  # the relative rounding error of a mean of equal values
_ROUNDING = 1e-9  # the relative difference up to which distances or variances are equal


def error_column(objective: str) -> str:
    """Return the name of the column with the standard errors of an objective."""
    return f"{objective} standard error"


@dataclass(frozen=True)
class _Groups:
    """Which of n tests are of the same of k designs.

    Attributes:
        column: The column whose values are equal for tests of a design, or "variables".
        first: ``(k,)`` row of the first test of each design.
        design: ``(n,)`` the design of each test, 0 to k - 1.
        usable: ``(n,)`` which tests have values.
    """

    column: str
    first: Rows
    design: Rows
    usable: Mask

    @classmethod
    def of(cls, table: TestTable, by: str | None) -> _Groups:
        """Return the groups of the tests of a table; see :meth:`TestTable.averaged`.

        Raises:
            ArgumentValueError: No value recurs, or equal values have different variables.
        """
        column, labels = _labels(table, by)
        first, design = np.unique(first_of(labels), return_inverse=True)
        usable = ~table.failed() & np.isfinite(table.F).all(axis=1)
        groups = cls(column, first, design, usable)
        if len(first) == len(design):
            rule = "a column in which a value recurs"
            raise invalid("repeats", rule, column, "it has none that does")
        keys = design_keys(table.X)
        for row, i in enumerate(first[design].tolist()):
            if keys[row] != keys[i]:
                received = Received(f"{column} {labels[row]} with different ones")
                raise invalid(
                    "repeats", "a column whose equal values have equal variables", received
                )
        return groups

    @property
    def counts(self) -> Integers:
        """``(k,)`` how many usable tests each design has."""
        return np.bincount(self.design[self.usable], minlength=len(self.first))

    def sums(self, values: Array) -> Array:
        """Return ``(k, m)`` sums of the ``(n, m)`` values of usable tests."""
        sums = np.zeros((len(self.first), values.shape[1]))
        np.add.at(sums, self.design[self.usable], values[self.usable])
        return sums

    def means(self, values: Array) -> Array:
        """Return ``(k, m)`` means of ``(n, m)`` values; of the first test if none is usable."""
        counts = self.counts[:, None]
        with np.errstate(invalid="ignore"):
            return np.where(counts == 0, values[self.first], self.sums(values) / counts)

    @np.errstate(divide="ignore", invalid="ignore")
    def standard_errors(self, F: Array) -> Array:
        """Return the ``(k, m)`` standard errors of the means of ``(n, m)`` objectives.

        They are not finite where they are unknown: if no design has two usable tests, or this one
        has none.
        """
        deviations = F - self.means(F)[self.design]
        deviations[np.abs(deviations) <= _ROUNDED * np.abs(F)] = 0.0
        squares = self.sums(deviations**2)
        counts = self.counts
        variances = np.column_stack([_variances(column, counts - 1) for column in squares.T])
        return np.asarray(np.sqrt(variances / counts[:, None]))


def averaged(table: TestTable, by: str | None) -> TestTable:
    """Return :meth:`TestTable.averaged`."""
    tested = table.tested
    groups = _Groups.of(tested, by)
    first = groups.first
    means: dict[str, Any] = {}
    for name in ("F", "G", "H", "outputs"):
        means[name] = groups.means(getattr(tested, name))
    if PROPOSAL_ROUND in tested.layout.outputs:  # the round that first proposed the design
        rounds = tested.layout.outputs.index(PROPOSAL_ROUND)
        means["outputs"][:, rounds] = tested.outputs[first, rounds]
    errors = groups.standard_errors(tested.F)
    means["outputs"] = np.column_stack([means["outputs"], groups.counts, errors])
    extra, varying = _common_cells(tested, first[groups.design])
    lost = tested.numbers[first[groups.counts == 0]].tolist()

    size = f"{counted(len(first), 'design')}, {counted(len(tested), 'test')}"
    remarks = [*tested.remarks]
    remarks.append(f"{size}: rows with the same {groups.column} are tests of one design.")
    n_unusable = int((~groups.usable).sum())
    if n_unusable:
        remarks.append(f"{counted(n_unusable, 'test')} have no values and do not count.")
    if varying:
        remarks.append(f"Left out, as tests of one design differ in it: {', '.join(varying)}.")
    designs = replace(
        tested.rows(first),
        layout=_layout_of_means(tested.layout, [groups.column, tested.layout.label], extra),
        problem=None,  # no run continues a study of means
        reasons={number: tested.reasons[number] for number in lost if number in tested.reasons},
        extra=extra,
        remarks=tuple(remarks),
        **means,
    )
    return table._asked_as_before(designs)


def _layout_of_means(
    layout: Layout, labels: Sequence[str | None], extra: Collection[str]
) -> Layout:
    """Return a layout with the columns of means, and the first of some labels that is there."""
    outputs = [*layout.outputs, N_TESTS]
    units = dict(layout.units)
    for objective in layout.objectives:
        outputs.append(error_column(objective))
        if objective in units:
            units[error_column(objective)] = units[objective]
    label = next((label for label in labels if label in extra), None)
    return replace(layout, outputs=tuple(outputs), units=units, label=label)


def _labels(table: TestTable, by: str | None) -> tuple[str, list[Any]]:
    """Return the name and the n values of the column whose equal values mark one design."""
    if by is None or (by == _VARIABLES and by not in table.columns):
        if not table.layout.variables:
            raise invalid("by", "the column that names designs, as there are no variables", by)
        return _VARIABLES, design_keys(table.X)
    known_name("repeats", by, table.columns)
    cells = table.column(by)
    gaps = blank(cells)
    if gaps.any():
        row = int(gaps.argmax()) + 1
        raise invalid("repeats", "a column without gaps", Received(f"none in row {row} of {by}"))
    return by, list(cells.tolist())


def _variances(squares: Array, degrees: Integers) -> Array:
    """Return ``(n,)`` variances of the tests of each design: the mean of its own and of all.

    How much all count follows from how much the variances of designs differ beyond chance
    (Smyth, Statistical Applications in Genetics and Molecular Biology 3, 2004, section 6).

    Args:
        squares: ``(n,)`` sums of the squared deviations from the mean of the design.
        degrees: ``(n,)`` their degrees of freedom.
    """
    from scipy.special import digamma, polygamma

    degrees = np.maximum(degrees, 0)
    variance = np.full(len(squares), squares.sum() / degrees.sum())
    has_noise = (degrees > 0) & (squares > 0)
    if np.count_nonzero(has_noise) < _FEWEST:
        return variance
    half = degrees[has_noise] / 2
    logs = np.log(squares[has_noise] / 2) - digamma(half)
    excess = logs.var(ddof=1) - polygamma(1, half).mean()
    if excess <= 0:
        return variance
    # The trigamma function of half the degrees of freedom of the prior is the excess; it is about
    # 1 / y + 1 / (2 y^2).
    half_prior = (1 + np.sqrt(1 + 2 * excess)) / (2 * excess)
    half_squares = np.exp(logs.mean() + digamma(half_prior))
    return np.asarray((2 * half_squares + squares) / (2 * half_prior + degrees))


def _common_cells(table: TestTable, first: Rows) -> tuple[dict[str, Any], list[str]]:
    """Return the extra columns in which all tests of each design agree, and the names of others.

    Args:
        table: The tests.
        first: ``(n,)`` row of the first test of the same design.
    """
    cells = {}
    varying = []
    for name, column in table.extra.items():
        if unequal(column, column[first]).any():
            varying.append(name)
        else:
            cells[name] = column[np.unique(first)]
    # Repeated tests always differ in the rows of a file without names, and in their runs.
    return cells, [name for name in varying if name not in ("row", RUN, POINT)]


def averaged_repeats(table: TestTable) -> TestTable:
    """Return the tests of a noisy model, those of the same design averaged if there are any."""
    if len(np.unique(first_rows(table.X))) == len(table):
        return table
    return table.averaged()


def with_repeats(
    table: TestTable, repeats: str | Literal[False] | None, *, is_study: bool
) -> TestTable:
    """Return the designs of a source, repeated tests averaged or reported.

    Args:
        table: The tests or designs.
        repeats: As for :func:`read_table`.
        is_study: Whether the source is a study, which tests a design once unless its model is noisy
            or people repeat a test.
    """
    if repeats:
        return table.averaged(repeats)
    if repeats is False:
        return table
    remarks = _undeclared(table)
    if remarks and is_study:
        return table.averaged()
    return table._with(remarks=(*table.remarks, *remarks))


def _undeclared(table: TestTable) -> list[str]:
    """Say which rows share a label, or all variables, and differ in objectives."""
    label = table.layout.label
    word = "variables"
    first = first_rows(table.X)
    if label is not None:
        first_of_label = first_of(table.extra[label].tolist())
        if len(np.unique(first_of_label)) < len(table):
            first = first_of_label
            word = label
    differing = unequal(table.F, table.F[first]).any(axis=1)
    if not differing.any():
        return []
    names = [table.names[row] for row in np.flatnonzero(differing)[:_N_LISTED]]
    n_designs = len(np.unique(first[differing]))
    return [
        f"{counted(n_designs, 'design')} with the same {word} as others differ in objectives "
        f"({', '.join(names)}): each row counts as a design; if they are repeated tests, say "
        "--repeats LABEL (or variables), or repeats= in Python."
    ]


def confidence(table: TestTable, noise: Mapping[str, float] | None) -> pd.DataFrame:
    """Return :meth:`TestTable.confidence`."""
    import pandas as pd

    ranking = table.feasible_ranking()
    objectives = ranking.objectives
    errors = _errors(table.rows(ranking.rows), noise)
    degrees = None
    if noise is None and N_TESTS in table.layout.outputs:
        degrees = _degrees(table.column(N_TESTS), ranking.rows, errors)
    means, factors = _posterior(objectives.minimized, errors)
    n_designs = len(means)
    n_samples = _SAMPLES
    if n_designs > _MANY:
        n_samples = _SAMPLES_OF_MANY
    generator = np.random.default_rng(_SEED)
    n_pareto = np.zeros(n_designs)
    n_best = np.zeros(n_designs)
    n_near_best = np.zeros(n_designs)
    for _ in range(n_samples):
        steps = generator.standard_normal(means.shape)
        if degrees is not None:  # the variance of the noise is an estimate, too
            steps *= np.sqrt(degrees / generator.chisquare(degrees))
        sample = means + np.einsum("ijk,ik->ij", factors, steps)
        is_pareto = nondominated(sample)
        distance = ranking.frame.around(sample[is_pareto]).distances(sample)[:, 0]
        least = distance[is_pareto].min()
        n_pareto += is_pareto
        n_best += is_pareto & (distance <= least * (1 + _ROUNDING))
        n_near_best += distance <= least * (1 + NEAR_BEST)
    columns = dict(zip(objectives.names, objectives.original(means).T, strict=True))
    columns["pareto"] = n_pareto / n_samples
    columns["best"] = n_best / n_samples
    columns["near_best"] = n_near_best / n_samples
    return pd.DataFrame(columns, index=list(objectives.labels))


def _degrees(n_tests: Array, rows: Rows, errors: Array) -> Array:
    """Return the degrees of freedom of the variances in the standard errors of some designs.

    A pooled variance has those of all designs, feasible or not. A moderated one has d + n - 1, with
    d of the prior (Smyth 2004, as in :func:`_variances`). Standard errors do not tell d, so it is
    taken as 1, which is low: probabilities are less extreme than with the d of the prior.

    Args:
        n_tests: ``(n,)`` numbers of tests of all designs.
        rows: ``(k,)`` rows of some of them.
        errors: ``(k, m)`` their standard errors.
    """
    tests = n_tests[rows, None]
    variances = errors**2 * tests
    is_pooled = np.ptp(variances, axis=0) <= _ROUNDING * variances.max(axis=0)
    pooled = np.fmax(n_tests - 1, 0).sum()
    return np.where(is_pooled, max(pooled, 1), tests)


def _errors(designs: TestTable, noise: Mapping[str, float] | None) -> Array:
    """Return the ``(n, m)`` standard errors of designs, by their columns or a known noise."""
    errors = np.empty(designs.F.shape)
    for j, name in enumerate(designs.layout.objectives):
        column = error_column(name)
        if noise is not None:
            if name not in noise or not 0 <= noise[name] < np.inf:
                rule = f"a standard deviation >= 0 of each objective, such as {name}"
                raise invalid("noise", rule, noise)
            tests: Any = 1.0
            if N_TESTS in designs.layout.outputs:
                tests = designs.column(N_TESTS)
            errors[:, j] = noise[name] / np.sqrt(tests)
        elif column in designs.layout.outputs and np.isfinite(designs.column(column)).all():
            errors[:, j] = designs.column(column)
        else:
            rule = f"one with standard errors ({column})"
            remedy = "average repeated tests by table.averaged(label), or give noise={...}"
            raise invalid("the table", rule, Received("none"), remedy)
    return errors


def has_errors(table: TestTable) -> bool:
    """Whether designs are means with numbers of tests and standard errors."""
    names = [error_column(name) for name in table.layout.objectives]
    if not {*names, N_TESTS} <= {*table.layout.outputs}:
        return False
    designs = table.rows(table.eligible())
    return all(np.isfinite(designs.column(name)).all() for name in names)


def confidence_sentence(table: TestTable, row: int) -> str:
    """Say how sure it is that a design is the best; nothing if no errors are known.

    Args:
        table: The designs.
        row: Row of the design in the ranking of the feasible designs.
    """
    if not has_errors(table):
        return ""
    frame = table.confidence()
    chances = frame.iloc[row]
    text = sentence(
        "confidence",
        design=str(chances.name),
        best=percent(chances["best"]),
        near=percent(chances["near_best"]),
        pareto=percent(chances["pareto"]),
    )
    likeliest = frame["best"].nlargest(2)
    share = likeliest.iloc[0] / likeliest.sum()
    n_more = tests_to_settle(share, table.column(N_TESTS).mean())
    if n_more == 0 or chances["near_best"] >= _SURE:
        return text
    designs = listed(likeliest.index.tolist())
    return f"{text} {sentence('settle', n=n_more, designs=designs)}"


def tests_to_settle(share: float, n_tests: float) -> int:
    """Return how many more tests of two designs say which is better with a probability of 90 %.

    Args:
        share: The probability that the first one is better, from 0.5.
        n_tests: How many tests each of them has.

    Returns:
        A power of 2 up to 64; 0 if none are needed, or these are not enough.
    """
    from scipy.special import ndtr, ndtri

    quantiles = ndtri((np.arange(_SAMPLES) + 0.5) / _SAMPLES)
    for n_more in (0, 1, 2, 4, 8, 16, 32, 64):
        # Further tests leave this part of the variance of the difference.
        left = n_tests / (n_tests + n_more)
        expected = ndtri(share) + np.sqrt(1 - left) * quantiles
        if ndtr(np.abs(expected) / np.sqrt(left)).mean() >= _SURE:
            return n_more
    return 0


def _posterior(values: Array, errors: Array) -> tuple[Array, Array]:
    """Return the normal distribution of the true values of each design, given its means.

    The designs themselves say how true values are distributed (empirical Bayes): normally, with
    the covariance of the means less that of their errors. So a mean that is unlike those of the
    other designs is pulled towards them. Of few designs, means stay as they are.

    Args:
        values: ``(n, m)`` means.
        errors: ``(n, m)`` their standard errors.

    Returns:
        ``(n, m)`` expectations, and ``(n, m, m)`` factors L of the covariances L Lᵀ.
    """
    n, m = values.shape
    lengths = unit_lengths(values.min(axis=0), values.max(axis=0))
    lengths = np.where(np.isfinite(lengths), lengths, 1.0)
    # The noise of each design, as a diagonal matrix.
    noise = ((errors / lengths) ** 2)[:, :, None] * np.eye(m)
    if n < _FEWEST_FOR_PRIOR * m:
        return values, np.sqrt(noise) * lengths[:, None]
    scaled = values / lengths
    spread = np.atleast_2d(np.cov(scaled.T)) - noise.mean(axis=0)
    sizes, axes = np.linalg.eigh(spread)
    prior = (axes * np.maximum(sizes, _LEAST_VARIANCE)) @ axes.T
    gains = prior @ np.linalg.inv(prior + noise)
    center = scaled.mean(axis=0)
    means = center + np.einsum("ijk,ik->ij", gains, scaled - center)
    covariances = prior - gains @ prior
    covariances = (covariances + covariances.transpose(0, 2, 1)) / 2
    sizes, axes = np.linalg.eigh(covariances)
    factors = axes * np.sqrt(np.maximum(sizes, 0.0))[:, None, :]
    return means * lengths, factors * lengths[:, None]
