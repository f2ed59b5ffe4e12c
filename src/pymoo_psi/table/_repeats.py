"""Repeated tests of a design: their mean, and how sure a decision on means is.

The noise of an objective is taken to be normal and independent. Its variance is pooled from the
differences between tests of the same design, as far as designs do not differ in it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from pymoo_psi._validation import (
    AnyArray,
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
    nondominated,
    percent,
    sentence,
    unit_lengths,
    weights_sentence,
)
from pymoo_psi.table._joining import unequal
from pymoo_psi.table._layout import (
    POINT,
    PROPOSAL_ROUND,
    RUN,
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
_FEWEST = 5  # designs with noise from which on variances are moderated, not pooled
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


class _Groups(NamedTuple):
    """The n tests of k designs.

    Attributes:
        by: Name of the column whose equal values mark tests of one design.
        first: ``(k,)`` the row of the first test of each design.
        design: ``(n,)`` the design of each test.
        usable: ``(n,)`` which tests have values.
        counts: ``(k,)`` how many of these each design has.
    """

    by: str
    first: Rows
    design: Rows
    usable: Mask
    counts: Integers

    def sums(self, values: Array) -> Array:
        """Return ``(k, m)`` sums of the ``(n, m)`` values of usable tests."""
        sums = np.zeros((len(self.first), values.shape[1]))
        np.add.at(sums, self.design[self.usable], values[self.usable])
        return sums

    def means(self, values: Array) -> Array:
        """Return ``(k, m)`` means of ``(n, m)`` values; of the first test if none is usable."""
        n = self.counts[:, None]
        return np.where(n == 0, values[self.first], self.sums(values) / np.maximum(n, 1))


def averaged(table: TestTable, by: str | None) -> TestTable:
    """Return :meth:`TestTable.averaged`."""
    tested = table.tested
    layout = tested.layout
    groups = _groups(tested, by)
    first = groups.first
    outputs = groups.means(tested.outputs)
    if PROPOSAL_ROUND in layout.outputs:  # the round that first proposed the design
        j = layout.outputs.index(PROPOSAL_ROUND)
        outputs[:, j] = tested.outputs[first, j]
    errors = _standard_errors(tested.F, groups)
    names = (*layout.outputs, N_TESTS, *map(error_column, layout.objectives))
    extra = _common_extra(tested, groups)
    label = next((name for name in (groups.by, layout.label) if name in extra), None)
    lost = tested.numbers[first[groups.counts == 0]].tolist()
    designs = replace(
        tested.take(first),
        layout=replace(layout, outputs=names, label=label),
        F=groups.means(tested.F),
        G=groups.means(tested.G),
        H=groups.means(tested.H),
        outputs=np.column_stack([outputs, groups.counts, errors]),
        problem=None,  # no run continues a study of means
        reasons={number: tested.reasons[number] for number in lost if number in tested.reasons},
        extra=extra,
        remarks=_remarks(tested, groups, extra),
    )
    return table._asked_as_before(designs)


def _groups(table: TestTable, by: str | None) -> _Groups:
    """Return the tests by their designs.

    Args:
        table: The tests.
        by: As for :meth:`TestTable.averaged`.

    Raises:
        ArgumentValueError: No value recurs, or tests with equal ones have different variables.
    """
    by, labels = _labels(table, by)
    first_of_label = first_of(labels)
    first, design = np.unique(first_of_label, return_inverse=True)
    if len(first) == len(table):
        raise invalid("repeats", "a column in which a value recurs", by, "it has none that does")
    keys = design_keys(table.X)
    for row, i in enumerate(first_of_label.tolist()):
        if keys[row] != keys[i]:
            received = Received(f"{by} {labels[row]} with different ones")
            raise invalid("repeats", "a column whose equal values have equal variables", received)
    usable = ~table.failed() & np.isfinite(table.F).all(axis=1)
    counts = np.bincount(design[usable], minlength=len(first))
    return _Groups(by, first, design, usable, counts)


@np.errstate(divide="ignore", invalid="ignore")
def _standard_errors(F: Array, groups: _Groups) -> Array:
    """Return the ``(k, m)`` standard errors of the means of designs.

    They are not finite if no design has two usable tests, or this one has none.

    Args:
        F: ``(n, m)`` objectives of the tests.
        groups: The tests by their designs.
    """
    deviations = F - groups.means(F)[groups.design]
    deviations[np.abs(deviations) <= _ROUNDED * np.abs(F)] = 0.0
    squares = groups.sums(deviations**2)
    counts = groups.counts
    variances = np.column_stack([_variances(column, counts - 1) for column in squares.T])
    return np.asarray(np.sqrt(variances / counts[:, None]))


def _common_extra(table: TestTable, groups: _Groups) -> dict[str, AnyArray]:
    """Return the extra columns in which all tests of a design agree, a cell for each design."""
    extra = {}
    for name, cells in table.extra.items():
        if not unequal(cells, cells[groups.first[groups.design]]).any():
            extra[name] = cells[groups.first]
    return extra


def _remarks(table: TestTable, groups: _Groups, kept: Collection[str]) -> tuple[str, ...]:
    """Return the remarks on designs: those on their tests, what was averaged, what was left out.

    Args:
        table: The tests.
        groups: The tests by their designs.
        kept: Names of the extra columns of the designs.
    """
    size = f"{counted(len(groups.first), 'design')}, {counted(len(table), 'test')}"
    remarks = [*table.remarks, f"{size}: rows with the same {groups.by} are tests of one design."]
    if not groups.usable.all():
        n_unusable = counted((~groups.usable).sum(), "test")
        remarks.append(f"{n_unusable} have no values and do not count.")
    for name in table.extra:
        if name not in (*kept, "row", RUN, POINT):  # the last three differ in all tests
            remarks.append(f"Left out, as tests of one design differ in it: {name}.")
    return tuple(remarks)


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


def averaged_repeats(table: TestTable) -> TestTable:
    """Return the tests of a noisy model, those of the same design averaged if there are any."""
    if len(np.unique(first_rows(table.X))) == len(table):
        return table
    return table.averaged()


def designs_of_source(
    table: TestTable, repeats: str | Literal[False] | None, *, is_study: bool
) -> TestTable:
    """Return the designs of a source, repeated tests averaged.

    Args:
        table: The tests or designs.
        repeats: As for :func:`read_table`.
        is_study: Whether the source is a study, which tests a design once unless its model is noisy
            or people repeat a test.
    """
    if repeats:
        return table.averaged(repeats)
    if repeats is None and is_study and undeclared_repeats(table):
        return table.averaged()
    return table


def undeclared_repeats(table: TestTable) -> list[str]:
    """Say which rows share a label, or all variables, and differ in objectives."""
    table = table.take(np.isfinite(table.F).all(axis=1))  # others have nothing to differ in
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
    n_designs = len(np.unique(first[differing]))
    return [
        f"{counted(n_designs, 'design')} with the same {word} as others differ in objectives: each "
        f"row counts as a design; if they are repeated tests, say --average-by '{word}', or "
        "repeats= in Python."
    ]


def confidence(table: TestTable) -> pd.DataFrame:
    """Return :meth:`TestTable.confidence`."""
    import pandas as pd

    ranking = table.feasible_ranking()
    objectives = ranking.objectives
    columns = [*map(error_column, objectives.names)]
    if not has_errors(table):
        rule = f"one with standard errors, {', '.join(columns)}"
        raise invalid("the table", rule, Received("none"), "average tests by table.averaged(label)")
    errors = np.column_stack([table.column(name)[ranking.rows] for name in columns])
    degrees = None
    if N_TESTS in table.layout.outputs:
        degrees = _degrees(table.column(N_TESTS)[ranking.rows], errors)
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
    expected = objectives.original(means)
    frame = pd.DataFrame(expected, list(objectives.labels), list(objectives.names))
    frame["pareto"] = n_pareto / n_samples
    frame["best"] = n_best / n_samples
    frame["near_best"] = n_near_best / n_samples
    return frame


def _degrees(n_tests: Array, errors: Array) -> Array:
    """Return the degrees of freedom of the variances in the standard errors of designs.

    A pooled variance has those of all designs. A moderated one has d + n - 1, with
    d of the prior (Smyth 2004, as in :func:`_variances`). Standard errors do not tell d, so it is
    taken as 1, which is low: probabilities are less extreme than with the d of the prior.

    Args:
        n_tests: ``(n,)`` numbers of tests of the designs.
        errors: ``(n, m)`` their standard errors.
    """
    tests = n_tests[:, None]
    variances = errors**2 * tests
    is_pooled = np.ptp(variances, axis=0) <= _ROUNDING * variances.max(axis=0)
    pooled = np.fmax(n_tests - 1, 0).sum()
    return np.where(is_pooled, max(pooled, 1), tests)


def has_errors(table: TestTable) -> bool:
    """Whether the feasible designs have a standard error of each objective."""
    names = [*map(error_column, table.layout.objectives)]
    designs = table.eligible()
    return {*names} <= {*table.layout.outputs} and all(
        np.isfinite(table.column(name)[designs]).all() for name in names
    )


def certainty_sentences(table: TestTable, row: int) -> list[str]:
    """Say for how many weights a design is the best and, if errors are known, how sure that is.

    Args:
        table: The designs.
        row: Row of the design in the ranking of the feasible designs.
    """
    sentences = []
    weights = weights_sentence(table.feasible_ranking(), row)
    if weights:
        sentences.append(weights)
    if has_errors(table):
        chances = table.confidence().iloc[row]
        text = sentence(
            "confidence",
            design=str(chances.name),
            best=percent(chances["best"]),
            near=percent(chances["near_best"]),
            pareto=percent(chances["pareto"]),
        )
        sentences.append(text)
    return sentences


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
