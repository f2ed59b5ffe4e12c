"""Histograms, costs of constraints, alike failures, and rules of feasibility.

A constraint whose limit is negotiable (a soft limit) can be looked at as an objective more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1): ``Formulation(objectives=[..., constraint])``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, counted, instance, integer, invalid
from pymoo_psi.errors import PsiError
from pymoo_psi.table._designs import value_ranks
from pymoo_psi.table._layout import Key, Limits, bounds_of
from pymoo_psi.table._table import TestTable

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FOLDER = re.compile(r"; see \S.*$")
_DECIMALS = re.compile(r"\d*\.\d+(?:[eE][+-]?\d+)?|\d+(?:\.\d*)?[eE][+-]?\d+")
# A rule over fewer tests would say little: even if ten are feasible of ten, the share in the region
# is only above 74 % (binomial, 95 %).
_LEAST = 10
_FOLDS = 5  # of a cross-validation
# What a condition must take away from the Gini impurity, which is 0.5 with both kinds of designs
# weighted to a half: less than a hundredth of that is found in noise, too.
_GAIN = 0.005
# Shuffles of feasible and infeasible tests, all of which a tree must explain worse than the truth:
# so rules are found in one of forty tables of noise.
_SHUFFLES = 39
_ENOUGH = 4096  # tests that are shuffled


@dataclass(frozen=True, eq=False)
class Histogram:
    """How many designs have a variable, or another column, in each of k bins.

    Attributes:
        variable: Name of the variable or column.
        edges: ``(k + 1,)`` edges of the bins; the last bin holds its upper edge. If the variable
            takes single values only, the places -1/2, 1/2, … at which these are drawn.
        values: The k values of an integer, a binary variable or a choice, one to a bin; empty
            where bins are intervals.
        tested: ``(k,)`` numbers of tested designs.
        feasible: ``(k,)`` numbers of feasible ones within the limits.
        pareto: ``(k,)`` numbers of Pareto-optimal ones among these.
        outside: How many feasible designs lie below the first edge and above the last one.

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
    outside: tuple[int, int] = (0, 0)


def histogram(
    table: TestTable, variable: Key, *, bins: int = 10, limits: Limits | None = None
) -> Histogram:
    """Count the tested, feasible and Pareto-optimal designs over the range of a variable.

    Args:
        table: The tests.
        variable: Name or index of the variable; or name of an objective, constraint or output, the
            bins of which span the feasible designs, and all if there is none, up to three times
            the middle half's range beyond that half: what lies beyond is in no bin.
        bins: Equal bins between the bounds of a real variable, and of an integer of which more
            than twice as many values were tested; others have one for each value.
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
        shown = place[known & masks[1]] if (known & masks[1]).any() else place[known]
        if len(shown):
            # One outlier would leave all others in a single bin (Tukey's outer fences).
            low, high = np.quantile(shown, [0.25, 0.75])
            far = 3 * (high - low) or np.inf
            shown = shown[(shown >= low - far) & (shown <= high + far)]
        edges = _edges(shown, np.nan, np.nan, bins)
    else:
        j = layout.variable(variable)
        name, place, known = layout.variables[j], table.X[:, j], every
        many = table.kinds[j] is Kind.INTEGER and len({*place.tolist()}) > 2 * bins
        if table.kinds[j].real or many:
            place = place.astype(np.float64)  # of variables of several kinds it is objects
            low, high = layout.lower[j], layout.upper[j]
            if table.kinds[j] is Kind.LOG:
                edges = np.exp(_edges(np.log(place), np.log(low), np.log(high), bins))
            else:
                edges = _edges(place, low, high, bins)
        else:
            options, place = value_ranks(place)
            values, edges = tuple(options), np.arange(-0.5, len(options))
    tested, feasible, pareto = (np.histogram(place[m & known], edges)[0] for m in masks)
    inside = place[masks[1] & known]
    outside = int((inside < edges[0]).sum()), int((inside > edges[-1]).sum())
    return Histogram(name, edges, values, tested, feasible, pareto, outside)


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


@dataclass(frozen=True)
class Rule:
    """A part within the bounds, and how many of its tests are feasible.

    Attributes:
        text: What describes it, such as ``x1 > 0.31 and x4 <= 2``; "everywhere" for all.
        box: The same as :class:`~pymoo_psi.Restricted` takes it.
        n_tests: How many tests lie in it.
        n_feasible: How many of these are feasible.

    Example:
        >>> rule = Rule("x1 <= 0.5", {"x1": (None, 0.5)}, 40, 30)
        >>> print(rule)
        x1 <= 0.5: 75 % of 40 tests feasible
    """

    text: str
    box: Mapping[str, Any]
    n_tests: int
    n_feasible: int

    @property
    def share(self) -> float:
        """The share of feasible ones among its tests.

        Example:
            >>> Rule("everywhere", {}, 40, 30).share
            0.75
        """
        return self.n_feasible / self.n_tests

    def __str__(self) -> str:
        """Return the rule as a line."""
        percent = f"{100 * self.share:.0f}"
        # Rounded, a few exceptions of many would be none.
        if 0 < self.n_feasible < self.n_tests:
            percent = {"100": "over 99", "0": "under 1"}.get(percent, percent)
        return f"{self.text}: {percent} % of {self.n_tests} tests feasible"


@dataclass(frozen=True)
class FeasibilityRules:
    """Where designs are feasible: parts within the bounds that divide the tests.

    Attributes:
        rules: The parts, the largest share of feasible tests first.
        importance: Of each variable that a rule names, how much of the distinction is its, the
            most important first; they add up to 1.

    Example:
        >>> print(FeasibilityRules((Rule("everywhere", {}, 4, 3),), {}))
        everywhere: 75 % of 4 tests feasible
    """

    rules: tuple[Rule, ...]
    importance: Mapping[str, float]

    def __str__(self) -> str:
        """Return the rules as lines."""
        return "\n".join(map(str, self.rules))


def feasibility_rules(
    table: TestTable, limits: Limits | None = None, *, depth: int = 3
) -> FeasibilityRules:
    """Find which variables decide on feasibility, and where, by a shallow decision tree.

    There are rules if the tree tells feasible designs from others better than any tree does where
    feasibility is shuffled; how deep it is, is decided by cross-validation. The shares are those of
    the tests from which the rules were found; of new tests they will be a little less extreme. A
    design that failed is not feasible. Bounds are rounded as far as no test changes sides.

    Args:
        table: The tests.
        limits: Limits that a feasible design must keep.
        depth: At most so many conditions to a rule.

    Returns:
        The rules; a single one, "everywhere", where no condition tells feasible designs from
        others, or there are fewer than five of either.

    Raises:
        PsiError: scikit-learn is not installed.
        ArgumentValueError: The table is empty, or a limit does not fit.

    Example:
        >>> from pymoo_psi import lp_tau
        >>> X = lp_tau(256, 3)
        >>> table = TestTable.of(range(1, 257), X, X[:, :1], G=np.maximum(0.3 - X, X - 0.8)[:, :1])
        >>> print(feasibility_rules(table))
        0.3 < x1 <= 0.8: 100 % of 128 tests feasible
        x1 <= 0.3: 0 % of 77 tests feasible
        x1 > 0.8: 0 % of 51 tests feasible
    """
    try:
        from sklearn.model_selection import GridSearchCV, StratifiedKFold
        from sklearn.tree import DecisionTreeClassifier
    except ImportError:
        what = "feasibility rules need scikit-learn, which is not installed"
        raise PsiError(f"{what}; pip install scikit-learn") from None
    depth = integer("depth", depth, minimum=1)
    feasible = instance("table", table, TestTable).feasible(limits)
    if len(table) == 0:
        raise invalid("the table", "one with tests", Received(counted(0, "test")))
    # A tree of ranks is one of values, and exact: scikit-learn rounds to float32. Of a choice each
    # option is a column: 1 for it, 0 for others.
    splits, columns, kinds = [], [], dict(zip(table.layout.variables, table.kinds, strict=True))
    for name, kind in kinds.items():
        values, ranks = value_ranks(table.column(name))
        options = range(len(values)) if kind is Kind.CHOICE else [None]
        splits += [(name, values, option) for option in options]
        columns += [ranks if option is None else ranks == option for option in options]
    ranks = np.column_stack(columns or [np.zeros(len(table))]).astype(np.int64)
    tree: Any = DecisionTreeClassifier(
        max_depth=depth,
        min_samples_leaf=_LEAST,
        min_impurity_decrease=_GAIN,
        class_weight="balanced",  # or a few feasible designs of many would be worth no rule
        random_state=0,
    )
    everywhere = Rule("everywhere", {}, len(table), int(feasible.sum()))
    if min(feasible.sum(), (~feasible).sum()) < _FOLDS or not _explained(tree, ranks, feasible):
        return FeasibilityRules((everywhere,), {})
    # As deep as tells apart best tests from which the tree was not found.
    folds = StratifiedKFold(_FOLDS, shuffle=True, random_state=0)
    depths = {"max_depth": [*range(1, depth + 1)]}
    search = GridSearchCV(tree, depths, scoring="balanced_accuracy", cv=folds)
    tree = search.fit(ranks, feasible).best_estimator_
    nodes, rules = tree.tree_, []

    def follow(node: int, inside: Mask, box: dict[str, Any]) -> None:
        """Collect the rules under a node, which has the tests ``inside`` a box."""
        left, right = nodes.children_left[node], nodes.children_right[node]
        if left == right:  # a leaf has neither
            text = " and ".join(_text(name, kinds[name], part) for name, part in box.items())
            rules.append(Rule(text, box, int(inside.sum()), int((inside & feasible).sum())))
            return
        feature, k = nodes.feature[node], int(nodes.threshold[node])
        name, values, option = splits[feature]
        if option is not None:
            kept = box.get(name, values)
            parts: tuple[Any, Any] = [v for v in kept if v is not values[option]], [values[option]]
        elif kinds[name] is Kind.BINARY:
            parts = False, True
        else:
            low, high = box.get(name, (None, None))
            edge = below = values[k]
            if kinds[name].real:
                edge = below = _shortest(below, values[k + 1], kinds[name] is Kind.LOG)
            parts = (low, below), (edge + (not kinds[name].real), high)
        under = ranks[:, feature] <= k
        follow(left, inside & under, box | {name: parts[0]})
        follow(right, inside & ~under, box | {name: parts[1]})

    follow(0, np.ones(len(table), dtype=bool), {})
    rules.sort(key=lambda rule: (-rule.share, -rule.n_tests))
    gains = Counter[str]()
    for (name, *_), gain in zip(splits, tree.feature_importances_.tolist(), strict=True):
        gains[name] += gain
    return FeasibilityRules(tuple(rules), {name: v for name, v in gains.most_common() if v > 0})


def _explained(tree: Any, ranks: NDArray[Any], feasible: Mask) -> bool:
    """Whether a tree tells feasible tests from others better than it does if they are shuffled."""
    from sklearn.metrics import balanced_accuracy_score

    rng = np.random.default_rng(0)
    rows = rng.permutation(len(ranks))[:_ENOUGH]
    ranks, truth = ranks[rows], feasible[rows]

    def score(labels: Mask) -> float:
        return float(balanced_accuracy_score(labels, tree.fit(ranks, labels).predict(ranks)))

    own = score(truth)
    return all(score(rng.permutation(truth)) < own for _ in range(_SHUFFLES))


def _shortest(low: float, high: float, log: bool) -> float:
    """Return the shortest decimal number from ``low`` on and below ``high``."""
    middle = np.sqrt(low) * np.sqrt(high) if log else (low + high) / 2
    for digits in range(1, 17):
        edge = float(f"{middle:.{digits}g}")
        if low <= edge < high:
            return edge
    return low


def _text(name: str, kind: Kind, part: Any) -> str:
    if kind is Kind.CHOICE:
        return f"{name} = {part[0]}" if len(part) == 1 else f"{name} in {', '.join(map(str, part))}"
    if kind is Kind.BINARY:
        return f"{name} = {part}"
    low, high = ("" if end is None else f"{end:.15g}" for end in part)
    real = kind.real
    if low == high:
        return f"{name} = {low}"
    if low and high:
        return f"{low} {'<' if real else '<='} {name} <= {high}"
    return f"{name} <= {high}" if high else f"{name} {'>' if real else '>='} {low}"


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
