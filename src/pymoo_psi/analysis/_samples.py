"""What an even sample of the bounds tells: sensitivities, and convergence of the decision."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pymoo_psi._numbers import percent
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Entries,
    Names,
    Received,
    counted,
    invalid,
    known_names,
)
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import UtopianFrame, hypervolume, unit_lengths, without_rounding
from pymoo_psi.table import (
    BY_ALGORITHM,
    BY_PEOPLE,
    NUMBERS_ROLES,
    POINT,
    PROPOSAL_ROUND,
    RUN,
    TestTable,
    require_table,
    value_ranks,
)

if TYPE_CHECKING:
    import pandas as pd


_COSINES = 10  # terms that show the effect of a variable with many values
_LEAST_TESTS = 40  # tests, of which ten terms explain a quarter by chance
_FIRST = 8  # tests of the first row of a convergence; fewer have no front to speak of
# The reference point of the hypervolume, in units of the last front's range: a little beyond its
# worst values, so that the designs at its ends count, too.
_REFERENCE = 1.1
# The least gain for which the other half of the tests is worth it: the share of μ1 by which the
# best design came nearer, or the share of the last hypervolume that the first half lacks.
_WORTH = 0.01


def even_part(table: TestTable) -> tuple[TestTable, tuple[str, ...]]:
    """Return the tests that sample the bounds evenly, and remarks on them.

    Sensitivities and convergence use these tests only, because designs chosen by an algorithm show
    where it searched. If the sampling is unknown, all tests are returned, and a remark says so.

    Args:
        table: Tests of any origin.

    Returns:
        The tests, by their numbers, and sentences on which they are and how many failed.

    Raises:
        ArgumentValueError: There is none.

    Example:
        >>> from pymoo_psi import lp_tau
        >>> table, sentences = even_part(TestTable.of(range(1, 65), lp_tau(64, 2), lp_tau(64, 2)))
        >>> print(len(table), *sentences)
        64 It is unknown how designs were sampled: ...
    """
    require_table(table)
    table = table.take(np.argsort(table.numbers))  # as they were tested
    sentences = []
    known = table.problem or {}
    if {RUN, POINT} <= {*table.schema.notes}:
        run, table = _largest_sample(table, known.get("runs", {}))
        known = known["runs"][run]
        sentences.append(f"By {counted(len(table), 'test')} of run {run} alone.")
    sampling = known.get("sampling")
    if not _is_even(sampling):
        raise _no_sample()
    if PROPOSAL_ROUND in table.schema.outputs:
        is_proposed = table.column(PROPOSAL_ROUND) > 0  # tests that failed have no round
        if is_proposed.any():
            n = len(table)
            table = table.take(np.arange(is_proposed.argmax()))
            sentences.append(
                f"By the first {len(table)} of {n} tests, the points of a sequence: surrogates "
                "proposed the others."
            )
    elif not sampling:
        sentences.append(
            "It is unknown how designs were sampled: sensitivities and convergence hold only if "
            "they are spread evenly over the bounds, and in no order of their values."
        )
    # A requirement has rejected a design that is infeasible without objectives.
    lost = int(np.sum((table.status == "failed") | ~np.isfinite(table.F).all(axis=1)))
    if lost:
        sentences.append(
            f"Without values, as they failed or were rejected: {lost} of "
            f"{counted(len(table), 'test')}. If these are many, the others are not spread evenly "
            "and sensitivities are rough."
        )
    return table, tuple(sentences)


def _largest_sample(table: TestTable, runs: Entries) -> tuple[str, TestTable]:
    """Return the run of a study that has most points of a sequence, and its tests."""
    parts = {}
    for run, points in runs.items():
        part = table.take(table[RUN] == int(run))
        if len(part) and _is_even(points.get("sampling")):  # another run may have all its tests
            parts[run] = part
    if not parts:
        raise _no_sample()
    return max(parts.items(), key=lambda item: len(item[1]))


def _is_even(sampling: str | None) -> bool:
    """Whether points are those of a sequence; an unknown sampling may be one."""
    return not str(sampling).startswith((BY_ALGORITHM, BY_PEOPLE))


def _no_sample() -> ArgumentValueError:
    received = Received("tests that algorithms or people have chosen")
    return invalid("the tests", "an even sample of one set of bounds", received)


def sensitivities(table: TestTable, columns: Names | None = None) -> pd.DataFrame:
    """Return the first-order sensitivity of columns to each variable, from the tests at hand.

    The index S_i of a variable is the share of a column's variance that the variable explains by
    itself: Var(E[y | x_i]) / Var(y). The rest, 1 minus the sum, is due to interactions. For a
    variable with few values, such as a choice, E[y | x_i] is the mean for each value; otherwise it
    is a sum of ten cosines of its rank, as in the given-data estimates of Plischke (Reliability
    Engineering and System Safety 95, 2010). The share that as many terms explain by chance is
    subtracted, so that an estimate may be negative. The effects of stronger variables are
    subtracted first, because few points of a sequence may confound two variables. A jump in a real
    variable loses up to 4 % of its share.

    All tests with a finite value count, feasible or not, because the variables must be independent
    and uniform within the bounds; this does not hold for the feasible designs alone, nor if many
    fail. For the role of an algorithm's proposals see :func:`even_part`.

    Args:
        table: The tests of one investigation.
        columns: Names of objectives, constraints and further outputs; all of them unless given.

    Returns:
        Index ``(column, variable)``; ``first_order``, the index S_i; ``lower`` and ``upper``, its
        95 % confidence band. Variables with one value are omitted; NaN if a column is constant up
        to rounding.

    Raises:
        ArgumentValueError: The tests are no even sample, or a column is unknown, a variable or has
            too few values.

    Example:
        Of x1 + 2 x2 the first variable explains 1/5 of the variance, the second 4/5.

        >>> from pymoo_psi import lp_tau
        >>> X = lp_tau(1024, 2)
        >>> table = TestTable.of(range(1, 1025), X, (X @ [1, 2])[:, None])
        >>> sensitivities(table)["first_order"].round(2).tolist()
        [0.2, 0.8]
    """
    import pandas as pd

    table, _ = even_part(table)
    dependent = []
    for name in table.schema.of_role(*NUMBERS_ROLES):
        if name != PROPOSAL_ROUND:
            dependent.append(name)
    variables = []
    for name in table.schema.variables:
        if len(set(table.column(name).tolist())) > 1:
            variables.append(name)
    names = dependent
    if columns is not None:
        names = known_names("columns", columns, dependent)
    shares = []
    # The bases are those of all columns that are known of the same tests.
    bases_by_tests = {}
    for name in names:
        values = table.column(name)
        finite = np.isfinite(values)
        y = values[finite]
        if len(y) < _LEAST_TESTS:
            rule = f"known of {_LEAST_TESTS} tests or more"
            raise invalid(name, rule, Received(counted(len(y), "finite value")), "test more points")
        key = finite.tobytes()
        if key not in bases_by_tests:
            bases_by_tests[key] = [_basis(table.column(v)[finite]) for v in variables]
        shares.append(_shares(bases_by_tests[key], y))
    index = pd.MultiIndex.from_product([names, variables], names=["column", "variable"])
    data = np.reshape(shares, (len(index), 3))
    return pd.DataFrame(data, index, ["first_order", "lower", "upper"])


def _basis(column: AnyArray) -> Array:
    """Return ``(n, p)`` orthonormal functions of a variable, each of mean 0."""
    values, ranks = value_ranks(column)
    if len(values) <= _COSINES + 1 or isinstance(values[0], str):
        functions = np.eye(len(values))[ranks][:, 1:]
    else:
        counts = np.bincount(ranks)
        midpoints = (np.cumsum(counts) - counts / 2) / len(column)
        functions = np.cos(np.pi * np.outer(midpoints[ranks], np.arange(1, _COSINES + 1)))
    return np.linalg.qr(functions - functions.mean(axis=0))[0]


def _shares(bases: list[Array], y: Array) -> Array:
    """Return ``(n_var, 3)`` the share of the variance that each basis explains, and its band."""
    shares = np.full((len(bases), 3), np.nan)
    if np.isinf(unit_lengths(y.min(), y.max())):
        return shares
    n = len(y)
    y = (y - y.mean()) / y.std()
    strengths = [float(((Q.T @ y) ** 2).sum()) - Q.shape[1] for Q in bases]
    unexplained = y
    for j in np.argsort(strengths)[::-1]:  # the strongest first
        Q = bases[j]
        p = Q.shape[1]
        free = n - p - 1
        if free < 1:
            continue
        fit = Q @ (Q.T @ unexplained)
        fit_of_y = Q @ (Q.T @ y)
        explained = (fit**2).mean()
        share = explained - p / free * ((unexplained - fit) ** 2).mean()
        half = _half_width(y, fit_of_y, p, free)
        # A sequence may be so even that nothing is explained by chance: then `explained` is right.
        shares[j] = share, share - half, max(share + half, explained)
        if share > half:
            unexplained = unexplained - fit
    return shares


def _half_width(y: Array, fit: Array, p: int, free: int) -> float:
    """Return half the width of the band about a share of the variance that p terms explain.

    The standard error of 1 - left as a ratio of two means, and what p terms have by chance.
    """
    left = ((y - fit) ** 2).mean()
    ratio = left * y**2 - (y - fit) ** 2
    half: float = 1.96 * np.sqrt((ratio**2).mean() / free + 2 * p * left**2 / (len(y) * free))
    return half


def convergence(table: TestTable) -> pd.DataFrame:
    """Return the decisions that the first half, quarter, … of the tests give.

    The number of tests n doubles from row to row up to all tests. Distances use the scale of all
    tests, so that rows can be compared. If one design is the best in every objective, there is no
    scale, and ``mu1``, ``hypervolume`` and ``moved`` are NaN. :func:`convergence_sentence` states
    the result.

    Args:
        table: The tests of an investigation.

    Returns:
        Index: ``tests``, the numbers n. Columns:

        - ``feasible``, how many are feasible;
        - ``pareto``, how many of these are Pareto optimal among the first n;
        - ``hypervolume``, what their front dominates, as a share of what the last one does;
        - ``hypervolume_error``, the standard error of that share; 0 where it is exact;
        - ``optimum``, the test nearest to U by the ranking of the first n; 0 where no design is
          feasible;
        - ``mu1``, its distance to the U of all tests; infinite where there is none;
        - ``moved``, how far it is from the optimum of the row before: the largest difference in an
          objective, in units of the objective's range over the last front; NaN if there was none.

    Raises:
        ArgumentValueError: There is no feasible design, there are fewer than eight tests, or an
            algorithm has chosen them, see :func:`even_part`.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> steps = convergence(investigate(VectorizedSphereChute(0.4, model="rolling"), 64))
        >>> print(steps[["pareto", "optimum", "mu1"]].round(2))
               pareto  optimum   mu1
        tests
        8           6        5  0.78
        16         12       13  0.58
        32         18       21  0.49
        64         36       21  0.49
    """
    import pandas as pd

    table, _ = even_part(table)
    if len(table) < _FIRST:
        received = Received(counted(len(table), "test"))
        raise invalid("the table", f"of {_FIRST} tests or more", received, "test more points")
    n_sizes = (len(table) // _FIRST).bit_length()
    sizes = len(table) >> np.arange(n_sizes)[::-1]
    # Measured in the units of the ranking of all tests, and of their front: ranges may be fixed.
    frame = table.ranking().frame
    last = without_rounding(table.F[table.pareto()])
    scale = UtopianFrame(last.min(axis=0), last.max(axis=0), True)
    rows = []
    for n in sizes:
        first = table.take(np.arange(n))
        front = first.F[first.pareto()]
        volume, error = hypervolume(scale.scaled(front), _REFERENCE)
        optimum = 0
        if len(front):
            optimum = first.best().numbers[0]
        rows.append((first.feasible().sum(), len(front), volume, error, optimum))
    columns = ["feasible", "pareto", "hypervolume", "hypervolume_error", "optimum"]
    steps = pd.DataFrame(rows, pd.Index(sizes, name="tests"), columns)
    steps[["hypervolume", "hypervolume_error"]] /= steps["hypervolume"].iloc[-1] or 1.0
    optima = table.F[np.searchsorted(table.numbers, steps["optimum"])]
    optima[steps["optimum"] == 0] = np.nan
    steps["mu1"] = frame.distances(optima)
    moves = np.diff(scale.scaled(optima), axis=0, prepend=np.nan)
    steps["moved"] = np.abs(moves).max(axis=1)
    if not scale.line.any():  # one design is the best in every objective
        steps[["hypervolume", "mu1", "moved"]] = np.nan
    steps.attrs["decimal"] = table.decimal
    return steps


def convergence_sentence(steps: pd.DataFrame) -> str:
    """Return a sentence on what the last doubling of the tests changed in the decision.

    The effect of the next doubling is not predicted, because no such estimate proved reliable on
    problems with known solutions.

    Args:
        steps: What :func:`convergence` returns.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
        >>> print(convergence_sentence(convergence(table.under(normalize=False))))
        The last doubling, from 512 to 1024 tests, still mattered: the proposal ...
    """
    n = steps.index[-1]
    last = steps.iloc[-1]
    mark = steps.attrs.get("decimal", ".")
    if len(steps) < 2 or not steps["optimum"].iloc[-2]:
        return (
            f"Too few tests to tell: {last['feasible']:.0f} of {n} are within the limits; "
            f"{2 * _FIRST} are needed, and one within the limits in the first half."
        )
    before = steps.iloc[-2]
    doubling = f"The last doubling, from {steps.index[-2]} to {n} tests,"
    unknown = (
        "Tests do not show whether there is a better region between them, nor how accurate the "
        "model is."
    )
    if np.isnan(last["moved"]):  # distances have no unit
        change = "the design that is the best in every objective"
        if last["optimum"] == before["optimum"]:
            change = "nothing"
        return f"{doubling} changed {change}. {unknown}"
    nearer = max(0.0, before["mu1"] - last["mu1"]) / (before["mu1"] or 1.0)
    mattered = "hardly mattered"
    if max(nearer, 1 - before["hypervolume"] - 2 * before["hypervolume_error"]) > _WORTH:
        mattered = "still mattered"
    proposal = "stayed the same"
    if last["moved"] > 0:
        moved = percent(last["moved"], mark)
        came = percent(nearer, mark)
        proposal = f"came {came} nearer to the best values and moved by {moved} of a range"
    share_before = percent(before["hypervolume"], mark)
    return (
        f"{doubling} {mattered}: the proposal {proposal}; the hypervolume was {share_before} of "
        f"its present value before. {unknown}"
    )
