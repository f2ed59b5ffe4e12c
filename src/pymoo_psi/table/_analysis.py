"""Analysis of tests: histograms, costs of constraints, sensitivities and convergence.

A constraint whose limit is negotiable (a soft limit) can be looked at as an objective more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1): ``Formulation(objectives=[..., constraint])``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._output import Shown
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Integers,
    Names,
    Received,
    counted,
    instance,
    integer,
    invalid,
    known_name,
)
from pymoo_psi.pareto import UtopianFrame, hypervolume, percent
from pymoo_psi.table._layout import PROPOSAL_ROUND, RUN, has_runs, value_ranks
from pymoo_psi.table._table import TestTable

if TYPE_CHECKING:
    import pandas as pd


_FOLDER = re.compile(r"; see \S.*$")
# No exit code, as one of 3 is another failure than one of 4, and no digit of a name such as f1.
_NUMBER = re.compile(r"(?<!exit code )(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?!\w)")
_BY_ALGORITHM = "an algorithm"  # samplings that follow no sequence
_BY_PEOPLE = "tests of "
_SAMPLE = "an even sample of one set of bounds"
_COSINES = 10  # terms that show the effect of a variable with many values
_LEAST_TESTS = 40  # tests, of which ten terms explain a quarter by chance
_FIRST = 8  # tests of the first row of a convergence; fewer have no front to speak of
# The reference point of the hypervolume, in units of the last front's range: a little beyond its
# worst values, so that the designs at its ends count, too.
_REFERENCE = 1.1
# The least gain for which the other half of the tests is worth it: the share of μ1 by which the
# best design came nearer, or the share of the last hypervolume that the first half lacks.
_WORTH = 0.01


@dataclass(frozen=True, eq=False)
class Histogram:
    """How many designs have a variable, or another column, in each of k bins.

    Attributes:
        variable: Name of the variable or column.
        edges: ``(k + 1,)`` edges of the bins; the last bin includes its upper edge. For single
            values the edges are -1/2, 1/2, …, between which they are drawn.
        values: The k values of an integer, a binary variable or a choice, one to a bin; empty
            where bins are intervals.
        tested: ``(k,)`` numbers of tested designs.
        feasible: ``(k,)`` numbers of feasible ones within the limits.
        pareto: ``(k,)`` numbers of Pareto-optimal ones among these.
        outside: How many feasible designs lie below the first edge and above the last one.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.2], [1.0]], [[1], [2], [3]])
        >>> counts = histogram(table, "x1", bins=2)
        >>> counts.tested, counts.pareto
        (array([2, 1]), array([1, 0]))
    """

    variable: str
    edges: Array
    values: tuple[Any, ...]
    tested: Integers
    feasible: Integers
    pareto: Integers
    outside: tuple[int, int] = (0, 0)


def histogram(table: TestTable, variable: str, *, bins: int = 10) -> Histogram:
    """Count the tested, feasible and Pareto-optimal designs over the range of a variable.

    Args:
        table: The tests.
        variable: Name of a variable, objective, constraint or output. Bins of all but variables
            span the feasible designs, or all if there are none, except for outliers
            beyond three times the interquartile range, which are in no bin.
        bins: The number of equal bins between the bounds of a real variable, or of an integer with
            more than twice as many tested values; other columns have one bin for each value.

    Raises:
        ArgumentValueError: There is no such column, or no bin.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.75], [1.0]], [[1], [2], [3]])
        >>> counts = histogram(table.under(limits={"f1": 2}), "x1", bins=2)
        >>> counts.edges, counts.tested, counts.feasible
        (array([0. , 0.5, 1. ]), array([1, 2]), array([1, 1]))
    """
    bins = integer("bins", bins, minimum=1)
    layout = table.layout
    feasible = table.feasible()
    values: tuple[Any, ...] = ()
    places = table.column(known_name("variable", variable, layout.columns))
    if variable not in layout.variables:
        edges = _edges(_near(places[feasible] if feasible.any() else places), bins)
    else:
        j = layout.variables.index(variable)
        kind = table.kinds[j]
        options, ranks = value_ranks(places)
        points = np.append(places, [layout.lower[j], layout.upper[j]])
        if kind is Kind.LOG:
            edges = np.exp(_edges(np.log(points.astype(np.float64)), bins))
        elif kind.real or (kind is Kind.INTEGER and len(options) > 2 * bins):
            edges = _edges(points.astype(np.float64), bins)
        else:
            places = ranks
            values = tuple(options)
            edges = np.arange(-0.5, len(values))
    places = places.astype(np.float64)  # the array is of objects if variables have several kinds
    inside = places[feasible & np.isfinite(places)]
    return Histogram(
        variable=variable,
        edges=edges,
        values=values,
        tested=np.histogram(places, edges)[0],
        feasible=np.histogram(inside, edges)[0],
        pareto=np.histogram(places[table.pareto()], edges)[0],
        outside=(int((inside < edges[0]).sum()), int((inside > edges[-1]).sum())),
    )


def _near(places: Array) -> Array:
    """Return finite values without outliers: one would leave all others in a single bin."""
    places = places[np.isfinite(places)]
    if len(places) == 0:
        return places
    low, high = np.quantile(places, [0.25, 0.75])
    fence = 3 * (high - low) or np.inf  # Tukey's outer fences
    return np.asarray(places[(places >= low - fence) & (places <= high + fence)])


def _edges(points: Array, bins: int) -> Array:
    """Return equidistant edges from the least to the greatest of finite points."""
    points = points[np.isfinite(points)]
    if len(points) == 0:
        points = np.array([0.0, 1.0])
    low = float(points.min())
    high = float(points.max())
    size = max(abs(low), abs(high))
    if high - low <= 1e-9 * size:
        # About a single value: half a unit, or space for the bins beside it.
        pad = max(0.5, 1e-9 * size)
        low -= pad
        high += pad
    return np.linspace(low, high, bins + 1)


def alike(reasons: Iterable[str]) -> list[str]:
    """Return reasons of failures as lines; dots stand for numbers in which only they differ.

    Programs quote the design that they fail at, so that no two reasons are the same. Exit codes
    stay. Of the folders that runs of a program leave, the first is named.
    """
    lines = [" ".join(reason.split()) for reason in reasons]
    lines_by_pattern: dict[str, list[str]] = {}
    patterns = [_NUMBER.sub("…", _FOLDER.sub("", line)) for line in lines]
    for line, pattern in zip(lines, patterns, strict=True):
        lines_by_pattern.setdefault(pattern, []).append(line)
    for i, pattern in enumerate(patterns):
        same = lines_by_pattern[pattern]
        if len({*same}) > 1:
            lines[i] = pattern + "".join(_FOLDER.findall(same[0]))
    return lines


def constraint_costs(table: TestTable) -> pd.DataFrame:
    """Return the cost of each constraint and limit, and the gain of relaxing it.

    Returns:
        One row per constraint and then per limit, as it is written. Columns: ``lower`` and
        ``upper``, the least and the greatest value allowed; ``rejects``, how many designs violate
        it; ``alone``, how many designs violate nothing else; and for each objective the best value
        among the feasible designs (``f1_feasible``) and among those that violate nothing else
        (``f1_alone``); NaN if there are none.

    Example:
        Test 2 violates only the constraint; without it f1 could be 1 instead of 2.

        >>> X, F, G = [[0.1], [0.5], [0.9]], [[2], [1], [4]], [[0.0], [0.5], [0.0]]
        >>> table = TestTable.of([1, 2, 3], X, F, G).under(limits={"f1": 3})
        >>> print(constraint_costs(table))
                    lower  upper  rejects  alone  f1_feasible  f1_alone
        constraint
        g1           -inf    0.0        1      1          2.0       1.0
        f1<=3        -inf    3.0        1      1          2.0       4.0
    """
    import pandas as pd

    mask, names = instance("table", table, TestTable).violations()
    layout = table.layout
    bounds = [(-np.inf, 0.0)] * len(layout.inequalities)
    bounds += [(-layout.eq_tolerance, layout.eq_tolerance)] * len(layout.equalities)
    for limit in table.limits.values():
        bounds.append((np.nan, np.nan) if isinstance(limit, list) else limit)
    alone = mask & (mask.sum(axis=1) == 1)[:, None]
    index = pd.Index(names, name="constraint", dtype=object)
    frame = pd.DataFrame(bounds, index, ["lower", "upper"], dtype=np.float64)
    frame["rejects"] = mask.sum(axis=0)
    frame["alone"] = alone.sum(axis=0)
    # Objectives of infeasible designs need not be finite, and -inf would be the best of all.
    F = pd.DataFrame(np.where(np.isfinite(table.F), table.F, np.nan))
    feasible = table.feasible()
    for j, name in enumerate(layout.objectives):
        sign = layout.sign[j]
        frame[f"{name}_feasible"] = sign * F[j][feasible].min()
        frame[f"{name}_alone"] = [sign * F[j][rows].min() for rows in alone.T]
    return frame


# Analyses of an even sample of the bounds


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
        95 % confidence band. Variables with one value are omitted; NaN if a column is constant.

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
    layout = table.layout
    dependent = []
    for name in layout.columns[len(layout.variables) :]:
        if name != PROPOSAL_ROUND:
            dependent.append(name)
    variables = []
    for name in layout.variables:
        if len(set(table.column(name).tolist())) > 1:
            variables.append(name)
    rows = []
    # The bases are those of all columns that are known of the same tests.
    bases_by_tests = {}
    for name in dependent if columns is None else columns:
        known_name("a column", name, dependent)
        values = table.column(name)
        finite = np.isfinite(values)
        y = values[finite]
        if len(y) < _LEAST_TESTS:
            raise invalid(
                name,
                f"known of {_LEAST_TESTS} tests or more",
                Received(counted(len(y), "finite value")),
                "test more points",
            )
        key = finite.tobytes()
        if key not in bases_by_tests:
            bases_by_tests[key] = [_basis(table.column(v)[finite]) for v in variables]
        shares = np.full((len(variables), 3), np.nan)
        if y.min() < y.max():
            shares = _shares(bases_by_tests[key], y)
        for variable, row in zip(variables, shares, strict=True):
            rows.append((name, variable, *row))
    frame = pd.DataFrame(rows, columns=["column", "variable", "first_order", "lower", "upper"])
    return frame.set_index(["column", "variable"])


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
    n = len(y)
    y = y / np.abs(y).max()  # no square overflows
    y = (y - y.mean()) / y.std()
    strengths = [float(((Q.T @ y) ** 2).sum()) - Q.shape[1] for Q in bases]
    shares = np.full((len(bases), 3), np.nan)
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


def even_part(table: TestTable) -> tuple[TestTable, tuple[str, ...]]:
    """Return the tests that sample the bounds evenly, and remarks on them.

    Sensitivities and convergence use these tests only, because designs chosen by an algorithm show
    where it searched. If the sampling is unknown, all tests are returned, and a remark says so.

    Args:
        table: Tests of any origin.

    Returns:
        The tests, in their order, and sentences on which they are and how many failed.

    Raises:
        ArgumentValueError: There is none.

    Example:
        >>> from pymoo_psi import lp_tau
        >>> table, sentences = even_part(TestTable.of(range(1, 65), lp_tau(64, 2), lp_tau(64, 2)))
        >>> print(len(table), *sentences)
        64 It is unknown how designs were sampled: ...
    """
    instance("table", table, TestTable)
    sentences = []
    if has_runs(table.extra):
        run, table = _largest_sample(table)
        sentences.append(f"By {counted(len(table), 'test')} of run {run} alone.")
    sampling = str((table.problem or {}).get("sampling") or "")
    if _BY_ALGORITHM in sampling:
        raise invalid("the tests", _SAMPLE, Received("those that an algorithm has chosen"))
    if PROPOSAL_ROUND in table.layout.outputs:
        # Tests that failed have no round.
        proposed = table.numbers[table.column(PROPOSAL_ROUND) > 0]
        n = len(table)
        table = table.take(table.numbers < proposed.min(initial=np.iinfo(np.int64).max))
        if len(table) < n:
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
            f"Of {counted(len(table), 'test')} {lost} failed or were rejected and do not count; if "
            "they are many, the others are not spread evenly and sensitivities are rough."
        )
    return table, tuple(sentences)


def _largest_sample(table: TestTable) -> tuple[str, TestTable]:
    """Return the run of a study that has most points of a sequence, and its tests."""
    runs = (table.problem or {}).get("runs", {})
    sizes = {}
    for run, points in runs.items():
        if not str(points.get("sampling")).startswith((_BY_ALGORITHM, _BY_PEOPLE)):
            sizes[run] = np.sum(table.extra[RUN] == int(run))
    if not any(sizes.values()):  # tests of a run may all be those of another one
        received = Received("tests that algorithms or people have chosen")
        raise invalid("the tests", _SAMPLE, received)
    run = max(sizes, key=lambda run: sizes[run])
    points = runs[run]
    lower, upper = (np.array(points[side], dtype=np.float64) for side in ("lower", "upper"))
    part = table.take(table.extra[RUN] == int(run))
    layout = replace(table.layout, lower=lower, upper=upper)
    return run, replace(part, layout=layout, problem={"sampling": points.get("sampling")})


@dataclass(frozen=True, eq=False, repr=False)
class Convergence(Shown):
    """The decision that the first n tests give; n doubles from row to row up to all tests.

    Distances use the scale of all tests, so that rows can be compared. If one design is the best in
    every objective, there is no scale, and ``mu1``, ``hypervolume`` and ``moved`` are NaN.

    Attributes:
        tests: ``(k,)`` numbers n of tests, increasing.
        feasible: ``(k,)`` how many are feasible.
        pareto: ``(k,)`` how many of these are Pareto optimal among the first n.
        hypervolume: ``(k,)`` what their front dominates, as a share of what the last one does.
        volume_error: ``(k,)`` standard error of that share; 0 where it is exact.
        optimum: ``(k,)`` the test point nearest to U by the ranking of the first n; 0 where no
            design is feasible.
        mu1: ``(k,)`` its distance to the U of all tests; infinite where there is none.
        moved: ``(k,)`` how far it is from the optimum of the row before: the largest difference in
            an objective, in units of the objective's range over the last front; NaN if there was
            none.
        best: ``(k, m)`` its objectives, in the original directions; NaN where there is none.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
        >>> steps = convergence(table.under(normalize=False))
        >>> steps.tests[-4:], steps.optimum[-4:]
        (array([ 128,  256,  512, 1024]), array([  35,  205,  205, 1021]))
    """

    tests: Integers
    feasible: Integers
    pareto: Integers
    hypervolume: Array
    volume_error: Array
    optimum: Integers
    mu1: Array
    moved: Array
    best: Array

    def __repr__(self) -> str:
        """Return how many tests there are, and what they decide."""
        return f"Convergence({self.tests[-1]} tests: the best is no. {self.optimum[-1]})"

    def to_frame(self) -> pd.DataFrame:
        """Return a frame with the index ``tests`` and a column for each other array.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> steps = convergence(investigate(VectorizedSphereChute(0.4, model="rolling"), 64))
            >>> print(steps.to_frame()[["pareto", "optimum", "mu1"]].round(2))
                   pareto  optimum   mu1
            tests
            8           6        5  0.78
            16         12       13  0.58
            32         18       21  0.49
            64         36       21  0.49
        """
        import pandas as pd

        names = ("feasible", "pareto", "hypervolume", "optimum", "mu1", "moved")
        frame = pd.DataFrame({name: getattr(self, name) for name in names})
        return frame.set_index(pd.Index(self.tests, name="tests"))

    def verdict(self) -> str:
        """Return a sentence on what the last doubling of the tests changed in the decision.

        The effect of the next doubling is not predicted, because no such estimate proved reliable
        on problems with known solutions.

        Example:
            >>> from pymoo_psi import VectorizedSphereChute, investigate
            >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 1024)
            >>> print(convergence(table.under(normalize=False)).verdict())
            The last doubling, from 512 to 1024 tests, still mattered: it brought ...
        """
        n = int(self.tests[-1])
        if len(self.tests) < 2 or not self.optimum[-2]:
            return (
                f"Too few tests to tell: {int(self.feasible[-1])} of {n} are feasible, and half of "
                "the tests must have had some."
            )
        doubling = f"The last doubling, from {self.tests[-2]} to {n} tests,"
        unknown = (
            "Not known: whether there is a better region between the tests, and how right the "
            "model is."
        )
        if np.isnan(self.moved[-1]):  # distances have no unit
            is_same = np.array_equal(self.best[-1], self.best[-2])
            change = "nothing" if is_same else "the design that is the best in every objective"
            return f"{doubling} changed {change}. {unknown}"
        before, now = self.mu1[-2:].tolist()
        nearer = max(0.0, before - now) / (before or 1.0)
        share = self.hypervolume[-2]
        mattered = "hardly mattered"
        if max(nearer, 1 - share - 2 * self.volume_error[-2]) > _WORTH:
            mattered = "still mattered"
        return (
            f"{doubling} {mattered}: it brought the best design {percent(nearer)} nearer to the "
            f"ideal point, moved it by {percent(self.moved[-1])} of a range, and enlarged the "
            f"hypervolume from {percent(share)} of its present value. {unknown}"
        )


def convergence(table: TestTable) -> Convergence:
    """Return the decisions that the first half, quarter, … of the tests give.

    Args:
        table: The tests of an investigation.

    Raises:
        ArgumentValueError: There is no feasible design, there are fewer than eight tests, or an
            algorithm has chosen them, see :func:`even_part`.

    Example:
        >>> from pymoo_psi import VectorizedSphereChute, investigate
        >>> table = investigate(VectorizedSphereChute(0.4, model="rolling"), 64)
        >>> convergence(table).pareto
        array([ 6, 12, 18, 36])
    """
    table, _ = even_part(table)
    if len(table) < _FIRST:
        received = Received(counted(len(table), "test"))
        raise invalid("the table", f"of {_FIRST} tests or more", received, "test more points")
    # What the first n tests decide, n doubling: their front, and their optimum or -1.
    n_sizes = (len(table) // _FIRST).bit_length()
    sizes = len(table) >> np.arange(n_sizes)[::-1]
    fronts = []
    optima = []
    for n in sizes:
        first = table.take(np.arange(n))
        fronts.append(np.flatnonzero(first.pareto()))
        optima.append(-1)
        if len(fronts[-1]):
            ranking = first.ranking()
            optima[-1] = int(ranking.rows[ranking.salukvadze[0]])
    # Measured in the units of the ranking of all tests; no optimum has NaN for its objectives.
    frame = table.ranking().frame
    scale = UtopianFrame(frame.ideal, frame.nadir, True)
    best = np.insert(table.F, len(table), np.nan, axis=0)[optima]
    mu1 = frame.distances(best)[:, 0]
    moved = np.abs(np.diff(scale.scaled(best), axis=0, prepend=np.nan)).max(axis=1)
    pairs = [hypervolume(scale.scaled(table.F[front]), _REFERENCE) for front in fronts]
    volumes, errors = np.array(pairs).T / (pairs[-1][0] or 1.0)
    if not frame.line.any():  # one design is the best in every objective
        mu1, volumes, moved = np.full((3, len(sizes)), np.nan)
    return Convergence(
        tests=sizes,
        feasible=np.cumsum(table.feasible())[sizes - 1],
        pareto=np.array([*map(len, fronts)]),
        hypervolume=volumes,
        volume_error=errors,
        optimum=np.append(table.numbers, 0)[optima],
        mu1=mu1,
        moved=moved,
        best=best * table.layout.sign,
    )
