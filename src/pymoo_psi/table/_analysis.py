"""Histograms, one-at-a-time sections, costs of constraints, gains on a prototype, sensitivities.

A constraint whose limit is negotiable (a soft limit) can be looked at as an objective more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1): ``Formulation(objectives=[..., constraint])``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    Received,
    counted,
    finite_number,
    instance,
    integer,
    invalid,
    known_name,
)
from pymoo_psi.pareto import listed
from pymoo_psi.table._designs import design_row, value_ranks
from pymoo_psi.table._layout import Key, Limits, bounds_of
from pymoo_psi.table._table import TestTable

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

_COSINES = 10  # that show the effect of a variable with many values
_LEAST = 40  # tests, of which ten terms explain a quarter by chance
_LOST = 0.05  # share of failed tests; more than bands of a few hundredths can hide
PROPOSAL_ROUND = "proposal_round"
"""Name of the output that tells points of the sequence, 0, from proposals, by their round."""
_FOLDER = re.compile(r"; see \S.*$")
_DECIMALS = re.compile(r"\d*\.\d+(?:[eE][+-]?\d+)?|\d+(?:\.\d*)?[eE][+-]?\d+")


@dataclass(frozen=True, eq=False, repr=False)
class Histogram:
    """How many designs have a variable, or another column, in each of k bins.

    Attributes:
        variable: Name of the variable or column.
        edges: ``(k + 1,)`` edges of the bins; the last bin holds its upper edge. If the variable
            takes single values only, the places -1/2, 1/2, … at which these are drawn.
        values: The k values of an integer, a binary variable or a choice, one to a bin; empty for
            a real variable, and for another column.
        tested: ``(k,)`` numbers of tested designs.
        feasible: ``(k,)`` numbers of feasible ones within the limits.
        pareto: ``(k,)`` numbers of Pareto-optimal ones among these.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.2], [1.0]], [[1], [2], [3]])
        >>> seen = histogram(table, "x1", bins=2)
        >>> seen.tested, seen.pareto
        (array([2, 1]), array([1, 0]))
    """

    variable: str
    edges: Array
    values: tuple[Any, ...]
    tested: NDArray[np.int64]
    feasible: NDArray[np.int64]
    pareto: NDArray[np.int64]

    def __repr__(self) -> str:
        """Return what is counted."""
        bins = counted(len(self.tested), "bin")
        tests = f"{self.tested.sum()} tested, {self.feasible.sum()} feasible"
        return f"Histogram({self.variable} in {bins}: {tests}, {self.pareto.sum()} Pareto optimal)"


def histogram(
    table: TestTable, variable: Key, *, bins: int = 10, limits: Limits | None = None
) -> Histogram:
    """Count the tested, feasible and Pareto-optimal designs over the range of a variable.

    Args:
        table: The tests.
        variable: Name or index of the variable; or name of an objective, constraint or output, the
            bins of which span the feasible designs, and all if there is none: what lies beyond is
            in no bin.
        bins: Equal bins between the bounds of a real variable; others have one for each value.
        limits: Limits on columns.

    Raises:
        ArgumentValueError: There is no such column, or no bin.

    Example:
        >>> table = TestTable.of([1, 2, 3], [[0.0], [0.75], [1.0]], [[1], [2], [3]])
        >>> seen = histogram(table, "x1", bins=2, limits={"f1": 2})
        >>> seen.edges, seen.tested, seen.feasible
        (array([0. , 0.5, 1. ]), array([1, 2]), array([1, 1]))
    """
    bins = integer("bins", bins, minimum=1)
    layout, values = table.layout, ()
    every = np.ones(len(table), dtype=bool)
    masks = (every, table.feasible(limits), table.pareto(limits))
    if isinstance(variable, str) and variable in layout.columns[len(layout.variables) :]:
        name, place = variable, table.column(variable)
        known = np.isfinite(place)
        shown = known & masks[1] if (known & masks[1]).any() else known
        edges = _edges(place[shown], np.nan, np.nan, bins)
    else:
        j = layout.variable(variable)
        name, place, known = layout.variables[j], table.X[:, j], every
        if table.kinds[j].real:
            place = place.astype(np.float64)  # of variables of several kinds it is objects
            low, high = layout.lower[j], layout.upper[j]
            if table.kinds[j] is Kind.LOG:
                edges = np.exp(_edges(np.log(place), np.log(low), np.log(high), bins))
            else:
                edges = _edges(place, low, high, bins)
        else:
            options, place = value_ranks(place)
            values, edges = tuple(options), np.arange(-0.5, len(options))
    counts = (np.histogram(place[mask & known], edges)[0] for mask in masks)
    return Histogram(name, edges, values, *counts)


def section_points(
    table: TestTable,
    design: int | ArrayLike,
    variable: Key,
    n: int,
    lower: float | None = None,
    upper: float | None = None,
) -> NDArray[Any]:
    """Return the designs of a one-at-a-time section: one variable runs, the others stay.

    Args:
        table: The tests.
        design: Number of the test point the section goes through, or ``(n_var,)`` a design.
        variable: Name or index of the variable that runs, a real one or an integer.
        n: Number of designs, 2 or more.
        lower: Where the variable starts; at its lower bound unless given.
        upper: Where it ends; at the upper bound unless given.

    Returns:
        ``(n, n_var)`` designs, to be evaluated by the problem. The values of an integer are
        rounded and each is taken once, so that there may be fewer.

    Raises:
        ArgumentValueError: The test point or variable is not there, or has no bounds, or is a
            choice or binary.
        ArgumentTypeError: A number is none.

    Example:
        >>> table = TestTable.of([1, 2], X=[[1.0, 5.0], [2.0, 4.0]], F=[[6.0], [6.0]])
        >>> section_points(table, 2, "x1", 3, lower=0, upper=4)
        array([[0., 4.], [2., 4.], [4., 4.]])
    """
    j, n = table.layout.variable(variable), integer("n", n, minimum=2)
    row = design_of(table, design)
    kind = table.kinds[j]
    if not kind.real and kind is not Kind.INTEGER:
        rule = "a real number or an integer"
        raise invalid("variable", rule, Received(f"one that is a {kind.value}"))
    start = finite_number("lower", float(table.layout.lower[j]) if lower is None else lower)
    end = finite_number("upper", float(table.layout.upper[j]) if upper is None else upper)
    if start > end:
        raise invalid("lower", "at most upper", Received(f"{start} > {end}"))
    values = (np.geomspace if kind is Kind.LOG else np.linspace)(start, end, n)
    if kind is Kind.INTEGER:
        values = np.unique(np.rint(values)).astype(np.int64)
    points = np.tile(row, (len(values), 1))
    points[:, j] = values.tolist()  # Python's numbers, the only ones that a matrix of objects holds
    return points


def design_of(table: TestTable, design: int | ArrayLike) -> NDArray[Any]:
    """Return a ``(n_var,)`` design that is given so, or by the number of its test point."""
    if isinstance(design, (int, np.integer)):
        rows = np.flatnonzero(table.numbers == design)
        if len(rows) == 0:
            raise invalid("design", "a tested point's number, or a design", int(design))
        row: NDArray[Any] = table.X[rows[0]]
        return row
    return design_row("design", design, table.layout.variables, table.kinds)


def alike(reasons: Iterable[str]) -> list[str]:
    """Return reasons of failures as lines; those that differ in decimals only have dots for these.

    Programs quote the design that they fail at, so that no two reasons are the same. Whole numbers
    stay: a program that exits with 3 fails otherwise than one that exits with 4. Of the folders
    that runs of a program leave, the first is named.
    """
    lines = [" ".join(reason.split()) for reason in reasons]
    dotted = [_DECIMALS.sub("…", _FOLDER.sub("", line)) for line in lines]
    count = Counter(same for _, same in {*zip(lines, dotted, strict=True)})
    folders = {
        s: "".join(_FOLDER.findall(line)) for line, s in zip(lines[::-1], dotted[::-1], strict=True)
    }
    pairs = zip(lines, dotted, strict=True)
    return [s + folders[s] if count[s] > 1 else line for line, s in pairs]


def constraint_costs(table: TestTable, limits: Limits | None = None) -> pd.DataFrame:
    """Return what each constraint and limit costs, and what relaxing it would gain.

    Returns:
        One row per constraint and then per limit. Columns: ``lower`` and ``upper``, the least and
        the greatest value allowed; ``rejects``, how many designs violate it; ``alone``, how many
        it alone rejects; and for each objective the best value among the feasible designs
        (``f1_feasible``) and among those it alone rejects (``f1_alone``); NaN where there are none.

    Example:
        Test 2 violates the constraint only; without it f1 = 1 would be had instead of 2.

        >>> X, F, G = [[0.1], [0.5], [0.9]], [[2], [1], [4]], [[0.0], [0.5], [0.0]]
        >>> print(constraint_costs(TestTable.of([1, 2, 3], X, F, G), {"f1": 3}))
                    lower  upper  rejects  alone  f1_feasible  f1_alone
        constraint
        g1           -inf    0.0        1      1          2.0       1.0
        f1           -inf    3.0        1      1          2.0       4.0
    """
    import pandas as pd

    mask, names = instance("table", table, TestTable).violations(limits)
    layout = table.layout
    bounds = [(-np.inf, 0.0)] * len(layout.inequalities)
    bounds += [(-layout.eq_tolerance, layout.eq_tolerance)] * len(layout.equalities)
    bounds += bounds_of(limits, layout).values()
    alone = mask & (mask.sum(axis=1) == 1)[:, None]
    lower, upper = np.array(bounds).reshape(len(names), 2).T
    counts = {"rejects": mask.sum(axis=0), "alone": alone.sum(axis=0)}
    index = pd.Index(names, name="constraint", dtype=object)
    frame = pd.DataFrame({"lower": lower, "upper": upper, **counts}, index=index)
    feasible = table.feasible(limits)
    for j, name in enumerate(layout.objectives):
        sign = layout.sign[j]
        frame[f"{name}_feasible"] = sign * _best(table.F[feasible, j])
        frame[f"{name}_alone"] = [sign * _best(table.F[column, j]) for column in alone.T]
    return frame


def compare_with_prototype(table: TestTable, limits: Limits | None = None) -> pd.DataFrame:
    """Return what the Pareto-optimal designs gain on the (first) prototype, the best first.

    Returns:
        Index ``test_point``; columns: the objectives; ``gain_f1`` …, by how much the design is
        better than the prototype, below 0 where it is worse; ``better_in``, in how many objectives
        it is; ``dominates``, nowhere worse and somewhere better; ``better_in_all``.

    Raises:
        ArgumentValueError: The table has no prototype.

    Example:
        >>> table = TestTable.of([1, 2], [[0.0], [1.0]], [[1.0, 4.0], [2.0, 2.0]])
        >>> compare_with_prototype(table.with_prototype([0.3], [3.0, 3.0])).iloc[:, 2:5]
                    gain_f1  gain_f2  better_in
        test_point
        2               1.0      1.0          2
        1               2.0     -1.0          1
    """
    import pandas as pd

    if table.prototype is None:
        remedy = "give it by with_prototype(x, f)"
        raise invalid("the table", "one with a prototype", Received("none"), remedy)
    pareto = table.pareto(limits)
    names, sign = table.layout.objectives, table.layout.sign
    F = table.F[pareto] * sign
    gain = table.prototype.F[0] - table.F[pareto]
    better = (gain > 0).sum(axis=1)
    dominates = (gain >= 0).all(axis=1) & (better > 0)
    index = pd.Index(table.numbers[pareto], name="test_point")
    frame = pd.DataFrame(F, columns=list(names), index=index)
    frame[[f"gain_{name}" for name in names]] = gain
    frame["better_in"], frame["dominates"] = better, dominates
    frame["better_in_all"] = better == len(names)
    # lexsort takes its last key first: those that dominate, then by better_in, then by number.
    return frame.iloc[np.lexsort((index.to_numpy(), -better, ~dominates))]


def sensitivities(table: TestTable, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Return the first-order sensitivity of columns to each variable, from the tests at hand.

    The index S_i of a variable is the share of a column's variance that the variable explains by
    itself: Var(E[y | x_i]) / Var(y). What the S_i lack to 1 is interaction. E[y | x_i] is the mean
    of each value of a variable with few of them, binary ones and choices among these, and else a
    sum of ten cosines of its rank, as in the given-data estimates of Plischke (Reliability
    Engineering and System Safety 95, 2010). The share that as many terms explain by chance is
    taken off; what a stronger variable explains is taken off before, as few points of a sequence
    may confound two. So an estimate may be below 0 where a variable explains nothing. A jump in a
    real variable loses up to 4 % of its share.

    All tests whose value is finite count, feasible or not: the variables must be independent and
    uniform within the bounds, which is not so of the feasible designs only, nor where many fail.
    Of a surrogate's study the points before the first proposal count; see :func:`even_part`.

    Args:
        table: The tests of one investigation.
        columns: Names of objectives, constraints and further outputs; all of them unless given.

    Returns:
        Index ``(column, variable)``; ``first_order``, the index S_i; ``lower`` and ``upper``, the
        ends of its band, which holds the true value at 95 %. Variables with one value are left
        out; NaN where a column is constant.

    Raises:
        ArgumentValueError: The tests are no even sample; there is no such column, it is a
            variable, or it has too few values.

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
    dependent = [n for n in layout.columns[len(layout.variables) :] if n != PROPOSAL_ROUND]
    variables = [name for name in layout.variables if len(set(table.column(name).tolist())) > 1]
    rows, bases = [], {}  # the bases are those of all columns that are known of the same tests
    for name in dependent if columns is None else columns:
        known_name("a column", name, dependent)
        y = table.column(name)
        finite = np.isfinite(y)
        y = y[finite]
        if len(y) < _LEAST:
            found = Received(counted(len(y), "finite value"))
            raise invalid(name, f"known of {_LEAST} tests or more", found, "test more points")
        if (key := finite.tobytes()) not in bases:
            bases[key] = [_basis(table.column(variable)[finite]) for variable in variables]
        shares = np.full((len(variables), 3), np.nan)
        if y.min() < y.max():
            shares = _shares(bases[key], y)
        rows += [(name, *row) for row in zip(variables, *shares.T, strict=True)]
    frame = pd.DataFrame(rows, columns=["column", "variable", "first_order", "lower", "upper"])
    return frame.set_index(["column", "variable"])


def _basis(column: NDArray[Any]) -> Array:
    """Return ``(n, p)`` orthonormal functions of a variable, each of mean 0."""
    values, ranks = value_ranks(column)
    counts = np.bincount(ranks)
    if len(values) <= _COSINES + 1 or isinstance(values[0], str):
        functions = np.eye(len(values))[ranks][:, 1:]
    else:
        places = ((np.cumsum(counts) - counts / 2) / len(column))[ranks]
        functions = np.cos(np.pi * np.outer(places, np.arange(1, _COSINES + 1)))
    basis: Array = np.linalg.qr(functions - functions.mean(axis=0))[0]
    return basis


def _shares(bases: list[Array], y: Array) -> Array:
    """Return ``(n_var, 3)`` the share of the variance that each basis explains, and its band."""
    n, y = len(y), y / np.abs(y).max()  # so that no square overflows
    y = (y - y.mean()) / y.std()
    rest, shares = y, np.full((len(bases), 3), np.nan)
    strength = [float(((Q.T @ y) ** 2).sum()) - Q.shape[1] for Q in bases]
    for j in np.argsort(strength)[::-1]:  # the strongest first
        Q, p = bases[j], bases[j].shape[1]
        if (free := n - p - 1) < 1:
            continue
        fit, own = Q @ (Q.T @ rest), Q @ (Q.T @ y)
        raw = (fit**2).mean()
        share = raw - p / free * ((rest - fit) ** 2).mean()
        # The standard error of 1 - left as a ratio of two means, and what p terms have by chance.
        left = ((y - own) ** 2).mean()
        ratio = left * y**2 - (y - own) ** 2
        half = 1.96 * np.sqrt((ratio**2).mean() / free + 2 * p * left**2 / (n * free))
        # A sequence may be so even that nothing is explained by chance: then raw is right.
        shares[j] = share, share - half, max(share + half, raw)
        if share > half:
            rest = rest - fit
    return shares


def even_part(table: TestTable, *, ordered: bool = False) -> tuple[TestTable, tuple[str, ...]]:
    """Return the tests that are an even sample of the bounds, and what must be known of them.

    Sensitivities and convergence are of these tests only: what an algorithm has chosen says where
    it looked. Where it is unknown how designs were sampled, their values decide.

    Args:
        table: Tests of any origin.
        ordered: Whether the first tests must be an even sample, too.

    Returns:
        The tests, in their order, and sentences: which ones these are, and how many have failed.

    Raises:
        ArgumentValueError: There is none.

    Example:
        >>> from pymoo_psi import lp_tau
        >>> table, said = even_part(TestTable.of(range(1, 65), lp_tau(64, 2), lp_tau(64, 2)))
        >>> len(table), said
        (64, ('It is unknown how the designs were sampled; they lie evenly within their range.',))
    """
    rule, layout = "an even sample of one set of bounds", instance("table", table, TestTable).layout
    sampling = str((table.problem or {}).get("sampling") or "")
    said, n = [], len(table)
    if len(table.experiments) > 1:
        raise invalid("the tests", rule, Received(f"those of {listed(table.experiments)}"))
    if "an algorithm" in sampling:
        raise invalid("the tests", rule, Received("those that an algorithm has chosen"))
    if PROPOSAL_ROUND in layout.outputs:
        # Tests that failed have no round.
        proposed = table.numbers[table.column(PROPOSAL_ROUND) > 0]
        table = table.rows(table.numbers < proposed.min(initial=np.iinfo(np.int64).max))
        if len(table) < n:
            said.append(
                f"By the first {len(table)} of {n} tests, the points of a sequence: surrogates "
                "proposed the others."
            )
    elif not sampling and not _lies_evenly(table, ordered):
        found = Received("tests of unknown sampling that crowd, or whose variables depend")
        raise invalid("the tests", rule, found)
    elif not sampling:
        said.append(
            "It is unknown how the designs were sampled; they lie evenly within their range."
        )
    failed = int(np.sum(table.status == "failed"))
    lost = int(np.sum((table.status == "infeasible") & ~np.isfinite(table.F).all(axis=1)))
    texts = [f"{k} {what}" for k, what in ((failed, "failed"), (lost, "were rejected")) if k]
    if texts:
        rough = " The others are not spread evenly, so that sensitivities are rough."
        said.append(
            f"Of {counted(len(table), 'test')} {listed(texts)} and count for nothing."
            + (rough if failed + lost > _LOST * len(table) else "")
        )
    return table, tuple(said)


def _lies_evenly(table: TestTable, ordered: bool) -> bool:
    """Whether designs may be an even sample by what they are; a chance of 1 in 1000 to be wrong."""
    from scipy import stats

    chances, columns = [1.0], [np.arange(len(table))] if ordered else []
    for column in table.X.T:
        values, ranks = value_ranks(column)
        if len(values) < 2:
            continue
        if len(values) <= len(column) / 5 or isinstance(values[0], str):
            chances.append(stats.chisquare(np.bincount(ranks)).pvalue)
        else:
            x = column.astype(np.float64)
            scales = [x, np.log(x)] if x.min() > 0 else [x]
            units = [(x - x.min()) / np.ptp(x) for x in scales]
            chances.append(max(stats.kstest(unit, "uniform").pvalue for unit in units))
        columns.append(stats.rankdata(ranks))
    if len(columns) > 1 and len(table) > 2:
        together = np.asarray(np.corrcoef(columns))[np.triu_indices(len(columns), 1)]
        chances += (2 * stats.norm.sf(np.abs(together) * np.sqrt(len(table) - 1))).tolist()
    return min(chances) * len(chances) > 1e-3


def _edges(place: Array, lower: float, upper: float, bins: int) -> Array:
    """Return equidistant edges between bounds, widened to all values; theirs without bounds."""
    known = np.array([lower, upper])
    points = np.concatenate([known[np.isfinite(known)], place])
    low, high = (float(points.min()), float(points.max())) if len(points) else (0.0, 1.0)
    size = max(abs(low), abs(high))
    # About a single value: half a unit, or room for the bins beside it.
    pad = max(0.5, 1e-9 * size) if high - low <= 1e-9 * size else 0.0
    return np.linspace(low - pad, high + pad, bins + 1)


def _best(values: Array) -> float:
    # Objectives of infeasible designs need not be finite, and -inf would be the best of all.
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else float("nan")
