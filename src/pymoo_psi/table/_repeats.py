"""Repeated tests of a design: their mean, and how sure a decision on means is.

The noise of an objective is taken to be normal and independent. Its variance is pooled from the
differences between tests of the same designs, unless a design has five tests or more.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pymoo_psi._validation import (
    Array,
    Integers,
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
_MANY_TESTS = 5  # of a design, from which on the variance is its own
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


def averaged(table: TestTable, by: str | None) -> TestTable:
    """Return :meth:`TestTable.averaged`."""
    tested = table.tested
    layout = tested.layout
    by, first, design = _tests_by_design(tested, by)
    usable = ~tested.failed() & np.isfinite(tested.F).all(axis=1)
    counts = np.bincount(design[usable], minlength=len(first))

    def means(values: Array) -> Array:
        """Return the means of usable tests, the value of the first test if none is usable."""
        sums = _sums(values[usable], design[usable], len(first))
        n = counts[:, None]
        return np.where(n == 0, values[first], sums / np.maximum(n, 1))

    F = means(tested.F)
    deviations = tested.F[usable] - F[design[usable]]
    deviations[np.abs(deviations) <= _ROUNDED * np.abs(tested.F[usable])] = 0.0
    errors = _standard_errors(_sums(deviations**2, design[usable], len(first)), counts)
    outputs = means(tested.outputs)
    if PROPOSAL_ROUND in layout.outputs:  # the round that first proposed the design
        j = layout.outputs.index(PROPOSAL_ROUND)
        outputs[:, j] = tested.outputs[first, j]
    # Columns in which all tests of a design agree are kept.
    extra = {}
    remarks = [
        f"{counted(len(first), 'design')}, {counted(len(tested), 'test')}: "
        f"rows with the same {by} are tests of one design."
    ]
    if not usable.all():
        n_unusable = counted((~usable).sum(), "test")
        remarks.append(f"{n_unusable} have no values and do not count.")
    for name, cells in tested.extra.items():
        if not unequal(cells, cells[first[design]]).any():
            extra[name] = cells[first]
        elif name not in ("row", RUN, POINT):  # these differ in all tests
            remarks.append(f"Left out, as tests of one design differ in it: {name}.")
    label = next((name for name in (by, layout.label) if name in extra), None)
    lost = tested.numbers[first[counts == 0]].tolist()
    names = (*layout.outputs, N_TESTS, *map(error_column, layout.objectives))
    designs = replace(
        tested.take(first),
        layout=replace(layout, outputs=names, label=label),
        F=F,
        G=means(tested.G),
        H=means(tested.H),
        outputs=np.column_stack([outputs, counts, errors]),
        problem=None,  # no run continues a study of means
        reasons={number: tested.reasons[number] for number in lost if number in tested.reasons},
        extra=extra,
        remarks=(*tested.remarks, *remarks),
    )
    return table._asked_as_before(designs)


def _tests_by_design(table: TestTable, by: str | None) -> tuple[str, Rows, Rows]:
    """Return which tests are those of one design.

    Args:
        table: The n tests.
        by: As for :meth:`TestTable.averaged`.

    Returns:
        The name of the column whose equal values mark the tests of one design; ``(k,)`` the row of
        the first test of each design; ``(n,)`` the design of each test.

    Raises:
        ArgumentValueError: No value recurs, or tests with equal ones have different variables.
    """
    keys = design_keys(table.X)
    labels: list[Any] = keys
    if by is None or (by == _VARIABLES and by not in table.columns):
        by = _VARIABLES
        if not table.layout.variables:
            raise invalid("by", "the column that names designs, as there are no variables", None)
    else:
        cells = table.column(known_name("repeats", by, table.columns))
        gaps = blank(cells)
        if gaps.any():
            received = Received(f"none in row {int(gaps.argmax()) + 1} of {by}")
            raise invalid("repeats", "a column without gaps", received)
        labels = cells.tolist()
    first_of_label = first_of(labels)
    first, design = np.unique(first_of_label, return_inverse=True)
    if len(first) == len(table):
        raise invalid("repeats", "a column in which a value recurs", by, "it has none that does")
    for row, i in enumerate(first_of_label.tolist()):
        if keys[row] != keys[i]:
            received = Received(f"{by} {labels[row]} with different ones")
            raise invalid("repeats", "a column whose equal values have equal variables", received)
    return by, first, design


def _sums(values: Array, design: Rows, n_designs: int) -> Array:
    """Return ``(n_designs, m)`` sums of ``(n, m)`` values of tests, by the design of each test."""
    sums = np.zeros((n_designs, values.shape[1]))
    np.add.at(sums, design, values)
    return sums


@np.errstate(divide="ignore", invalid="ignore")
def _standard_errors(squares: Array, counts: Integers) -> Array:
    """Return the ``(k, m)`` standard errors of the means of designs.

    Args:
        squares: ``(k, m)`` sums of the squared deviations from the means of the designs.
        counts: ``(k,)`` numbers of usable tests.

    Returns:
        Not finite if no design has two usable tests, or this one has none.
    """
    n = counts[:, None]
    degrees = np.maximum(n - 1, 0)
    pooled = squares.sum(axis=0) / degrees.sum()
    variances = np.where(n < _MANY_TESTS, pooled, squares / degrees)
    return np.asarray(np.sqrt(variances / n))


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
        n_tests = table.column(N_TESTS)[ranking.rows]
        pooled = np.fmax(n_tests - 1, 0).sum()
        degrees = np.where(n_tests < _MANY_TESTS, max(pooled, 1), n_tests - 1)[:, None]
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
            steps *= np.sqrt(degrees / generator.chisquare(degrees, means.shape))
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
