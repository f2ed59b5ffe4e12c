"""Where designs are feasible, as rules that can be read and investigated further."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Received, counted, instance, integer, invalid
from pymoo_psi.errors import PsiError
from pymoo_psi.table._designs import value_ranks
from pymoo_psi.table._layout import Limits
from pymoo_psi.table._table import TestTable

Mask = NDArray[np.bool_]

# A rule over fewer tests would say little: even if ten are feasible of ten, the share in the region
# is only above 74 % (binomial, 95 %).
_LEAST = 10
# What a condition must take away from the Gini impurity, which is 0.5 with both kinds of designs
# weighted to a half: less than a hundredth of that is found in noise, too.
_GAIN = 0.005
_FOLDS = 5  # of a cross-validation
# Shuffles of feasible and infeasible tests, all of which a tree must explain worse than the truth:
# so rules are found in one of forty tables of noise.
_SHUFFLES = 39
_ENOUGH = 4096  # tests that are shuffled


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

    How deep the tree is, and whether there are rules at all, is decided by cross-validation. The
    shares are those of the tests from which the rules were found; of new tests they will be a
    little less extreme. A design that failed is not feasible. Bounds are rounded as far as no test
    changes sides.

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
        from sklearn.model_selection import StratifiedKFold, cross_val_score
        from sklearn.tree import DecisionTreeClassifier
    except ImportError as error:
        what = "feasibility rules need scikit-learn, which is not installed"
        raise PsiError(f"{what}; pip install scikit-learn") from error
    depth = integer("depth", depth, minimum=1)
    feasible = instance("table", table, TestTable).feasible(limits)
    if len(table) == 0:
        raise invalid("the table", "one with tests", Received(counted(0, "test")))
    splits = [split for j, name in enumerate(table.layout.variables) for split in _splits(table, j)]
    # Without any variable there is nothing to tell designs apart by.
    ranks = np.column_stack([split.ranks for split in splits] or [np.zeros(len(table), dtype=int)])

    def tree_of(depth: int) -> Any:
        return DecisionTreeClassifier(
            max_depth=depth,
            min_samples_leaf=_LEAST,
            min_impurity_decrease=_GAIN,
            class_weight="balanced",  # or a few feasible designs of many would be worth no rule
            random_state=0,
        )

    # Rules are found in noise, too. Where there are any, they are as deep as tells apart best tests
    # from which they were not found.
    reliable = 0
    if min(feasible.sum(), (~feasible).sum()) >= _FOLDS and _explained(
        tree_of(depth), ranks, feasible
    ):
        folds = StratifiedKFold(_FOLDS, shuffle=True, random_state=0)
        options = {"scoring": "balanced_accuracy", "cv": folds}
        trees = [tree_of(k) for k in range(1, depth + 1)]
        scores = [cross_val_score(tree, ranks, feasible, **options).mean() for tree in trees]
        reliable = int(np.argmax(scores)) + 1 if max(scores) > 0.5 else 0  # as by chance
    if not reliable:
        return FeasibilityRules((Rule("everywhere", {}, len(table), int(feasible.sum())),), {})
    tree = tree_of(reliable).fit(ranks, feasible)
    nodes, kinds = tree.tree_, dict(zip(table.layout.variables, table.kinds, strict=True))
    rules = []

    def follow(node: int, inside: Mask, box: dict[str, Any]) -> None:
        """Collect the rules under a node, which has the tests ``inside`` a box."""
        left, right = nodes.children_left[node], nodes.children_right[node]
        if left == right:  # a leaf has neither
            text = " and ".join(_text(name, kinds[name], part) for name, part in box.items())
            counts = (int(inside.sum()), int((inside & feasible).sum()))
            rules.append(Rule(text, box, *counts))
            return
        split, k = splits[nodes.feature[node]], int(nodes.threshold[node])
        below, part = split.ranks <= k, box.get(split.variable)
        lower, upper = split.parts(part, k)
        follow(left, inside & below, box | {split.variable: lower})
        follow(right, inside & ~below, box | {split.variable: upper})

    follow(0, np.ones(len(table), dtype=bool), {})
    rules.sort(key=lambda rule: (-rule.share, -rule.n_tests))
    gains = Counter[str]()
    for split, gain in zip(splits, tree.feature_importances_.tolist(), strict=True):
        gains[split.variable] += gain
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


@dataclass(frozen=True, eq=False)
class _Split:
    """A variable, or one option of a choice, by which tests can be told apart.

    Attributes:
        variable: Name of the variable.
        kind: What it is.
        values: Its k distinct values in their order; of a choice its options, this one first.
        ranks: ``(n,)`` index of each test's value; of a choice 1 for this option, else 0. A tree
            of ranks is one of values, and exact: scikit-learn rounds to float32.
    """

    variable: str
    kind: Kind
    values: list[Any]
    ranks: NDArray[np.int64]

    def parts(self, part: Any, k: int) -> tuple[Any, Any]:
        """Return what is left of a variable up to rank k and above, as ``Restricted`` takes it.

        Args:
            part: What a box has left of it so far; ``None`` if all.
            k: The rank.
        """
        if self.kind is Kind.CHOICE:
            kept = self.values if part is None else part
            return [option for option in kept if option is not self.values[0]], self.values[:1]
        if self.kind is Kind.BINARY:
            return False, True
        low, high = (None, None) if part is None else part
        if self.kind is Kind.INTEGER:
            return (low, self.values[k]), (self.values[k] + 1, high)
        edge = _shortest(self.values[k], self.values[k + 1], self.kind is Kind.LOG)
        return (low, edge), (edge, high)


def _splits(table: TestTable, j: int) -> list[_Split]:
    """Return by what the variable of index j tells tests apart."""
    name, kind, column = table.layout.variables[j], table.kinds[j], table.X[:, j]
    values, ranks = value_ranks(column)
    if kind is not Kind.CHOICE:
        return [_Split(name, kind, values, ranks)]
    return [
        _Split(name, kind, [value, *values[:k], *values[k + 1 :]], (ranks == k).astype(np.int64))
        for k, value in enumerate(values)
    ]


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
