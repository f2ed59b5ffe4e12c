"""What designs are lost to: how many each limit rejects and what it costs, and why tests failed.

Sentences name limits and constraints as :func:`limit_words` does, in the terminal and in reports.

A constraint whose limit is negotiable (a soft limit) can be looked at as an objective more, a
pseudo-criterion (Statnikov and Matusov, Multicriteria Optimization and Engineering, 1995,
Chapter 1): ``Formulation(objectives=[..., constraint])``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from itertools import permutations
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._names import operand
from pymoo_psi._numbers import NumberFormat, number, one_sided
from pymoo_psi._validation import Array, Mask, counted
from pymoo_psi.analysis._repeats import first_tests
from pymoo_psi.pareto import listed
from pymoo_psi.table import (
    EQUALITY,
    INEQUALITY,
    N_TESTS,
    RUN,
    VARIABLE,
    Expression,
    Limit,
    TestTable,
    blank,
    limits_of,
    require_table,
)

if TYPE_CHECKING:
    import pandas as pd


_FOLDER = re.compile(r"; see \S.*$")
# No exit code, as one of 3 is another failure than one of 4, and no digit of a name such as f1.
_NUMBER = re.compile(r"(?<!exit code )(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?!\w)")
# At least this share of the failures is within a rule, and of the tests within it are failures.
_LEAST_RIGHT = 0.9
# The probability that one of the rules that are tried separates as many failures by chance is at
# most this, and in fact much less, as most of these rules are alike.
_LEVEL = 0.05
_FEW = 3  # designs that are named
_DIGITS = 5  # at least, of a value beyond its limit
_ROUNDING = 1e-12  # the relative difference of ratios that are equal but for rounding
_MOST_TESTS = 1024


def constraint_costs(table: TestTable) -> pd.DataFrame:
    """Return the cost of each constraint and limit, and the gain of relaxing it.

    Returns:
        One row per constraint and then per limit, as it is written. Columns: ``lower`` and
        ``upper``, the least and the greatest value allowed; ``rejects``, how many designs violate
        it; ``alone``, how many designs violate nothing else; and for each objective the best value
        among the feasible designs (``f1_feasible``) and among those that violate nothing else and
        have all objectives (``f1_alone``); NaN if there are none.

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

    require_table(table)
    mask, names = table.violations()
    alone = _alone(mask)
    schema = table.schema
    limits = [limit for _, limit in all_limits(table)]
    is_text = [limit.texts is not None for limit in limits]
    columns = {
        "lower": np.where(is_text, np.nan, [limit.lower for limit in limits]),
        "upper": np.where(is_text, np.nan, [limit.upper for limit in limits]),
        "rejects": mask.sum(axis=0),
        "alone": alone.sum(axis=0),
    }
    # Objectives of infeasible designs need not be finite, and -inf would be the best of all.
    # One that lacks another objective would not be feasible without its constraint, either.
    is_complete = np.isfinite(table.F).all(axis=1, keepdims=True)
    F = pd.DataFrame(np.where(is_complete, table.F, np.nan))
    best = schema.sign * [F[rows].min() for rows in (table.feasible(), *alone.T)]
    for name, (of_feasible, *of_alone) in zip(schema.objectives, best.T, strict=True):
        columns[f"{name}_feasible"] = of_feasible
        columns[f"{name}_alone"] = of_alone
    return pd.DataFrame(columns, pd.Index(names, name="constraint", dtype=object))


def _alone(violated: Mask) -> Mask:
    """Return where a design violates one of ``(n, k)`` constraints and limits, and no other."""
    return np.asarray(violated & (violated.sum(axis=1, keepdims=True) == 1))


def all_limits(table: TestTable) -> list[tuple[str, Limit]]:
    """Return the constraints of a table, as limits on their values, and then its limits."""
    schema = table.schema
    limits = [Limit(upper=0.0)] * len(schema.with_role(INEQUALITY))
    limits += [Limit(-schema.eq_tolerance, schema.eq_tolerance)] * len(schema.with_role(EQUALITY))
    return [*zip(schema.constraints, limits, strict=True), *table.limits.items()]


def limit_words(table: TestTable) -> list[str]:
    """Return the constraints and then the limits of a table in words: "price at most 1400 €"."""
    constraints = table.schema.constraints
    units = table.schema.units
    texts = []
    for name, limit in all_limits(table):
        text = limit.in_words(name, units.get(name, ""), table.decimal)
        if name in constraints and re.search("[<=>]", name):  # the name says it
            text = name
            with suppress(ValueError):  # of a rule on several columns
                [(column, stated)] = limits_of([name]).items()
                text = stated.in_words(column, units.get(column, ""), table.decimal)
        texts.append(text)
    return texts


def text_beyond(table: TestTable, name: str, limit: Limit, value: Any) -> str:
    """Return a value that violates a limit: as a limit, the text of a number would let it in.

    It has no fewer digits than in the table.
    """
    if not isinstance(value, float) or not np.isfinite(value):
        return str(value)
    digits = max(NumberFormat.of(table.column(name)).digits(value), _DIGITS)
    end = limit.upper if value > limit.upper else limit.lower
    return one_sided(value, value > limit.upper, [end], digits, mark=table.decimal)


def _missing_texts(table: TestTable) -> list[str]:
    """Return which texts limits allow and no design has, as they may be misspelt."""
    facts = []
    for name, limit in table.limits.items():
        missing = limit.missing(table.column(name))
        if missing:
            row = table.schema.words["row"]
            facts.append(f"no {row} has {listed(missing, 'or')} as {name}")
    return facts


def _gaps_of_computed(table: TestTable) -> list[str]:
    """Return which computed objectives have no value for which designs, such as 1 / 0."""
    facts = []
    for name, text in table.formulation.computed.items():
        if name not in table.schema.objectives:
            continue
        is_gap = ~np.isfinite(table.column(name))
        for operand_name in Expression.of(text).columns:
            is_gap &= ~blank(table.column(operand_name))
        designs = [table.names[row] for row in np.flatnonzero(is_gap)]
        if len(designs) > _FEW:
            designs[_FEW:] = [f"{number(len(designs) - _FEW)} more"]
        if designs:
            facts.append(f"{name} has no value for {listed(designs, 'and')}")
    return facts


def within_limits(table: TestTable) -> str:
    """Return " within the limits", or nothing where there are none."""
    n = len(table.limits) + len(table.schema.constraints)
    if n == 0:
        return ""
    if n == 1:
        return " within the limit"
    return " within the limits"


def counts_sentence(table: TestTable, subject: str = "") -> str:
    """Return how many tests there are, within the limits, and not dominated.

    Args:
        table: The tests.
        subject: What they are tests of, if that is said.
    """
    words = table.schema.words
    size = counted(len(table), words["row"])
    n_failed = int(table.failed().sum())
    failed = f", {number(n_failed)} {words['failed']}" if n_failed else ""
    total = size
    if table.schema.are_means and not n_failed:
        n_tests = table.column(N_TESTS).sum()
        if np.isfinite(n_tests):  # it is unknown of a test that was added to means
            total += f" of {counted(int(n_tests), 'test')}"
    if subject and RUN in table.schema.notes:
        total += f" of {counted(len({*table.column(RUN)}), 'run')}"
    n_within = int(table.feasible().sum())
    limits = limit_words(table)
    within = f"{_are(n_within)}{within_limits(table)} ({', '.join(limits)})"
    if not limits:
        facts = [f"{total}{failed}"]
    elif subject:
        facts = [f"{total}{failed}", f"{number(n_within)} {within}"]
    else:
        facts = [f"{number(n_within)} of {size} {within}{failed}"]
    if n_within > 1:
        n_optimal = int(table.pareto()[table.ranked_as].sum())
        if n_optimal == n_within:
            facts.append("none of them is dominated")
        else:
            facts.append(f"{number(n_optimal)} of them {_are(n_optimal)} not dominated")
    text = f"{'; '.join([*facts, *_missing_texts(table), *_gaps_of_computed(table)])}."
    return f"{subject}: {text}" if subject else text


def _are(n: int) -> str:
    return "is" if n == 1 else "are"


def none_left_reason(table: TestTable) -> str:
    """Say why no design is left, and without which limit one would be."""
    words = table.schema.words
    n_tests = int((~table.failed()).sum())
    if not n_tests:
        return f"of {counted(len(table), words['row'])}, none has values."
    violated, _ = table.violations()
    names = [*table.schema.constraints, *table.limits]
    would_be_left = _alone(violated) & np.isfinite(table.F).all(axis=1, keepdims=True)
    n_left = would_be_left.sum(axis=0)
    if n_left.any():
        k = n_left.argmax()
        remedy = f"Without the limit on {names[k]}, {n_left[k]} {_are(n_left[k])} left"
        remedy += _nearest_value(table, names[k], would_be_left[:, k])
    else:
        rejects = violated.sum(axis=0)
        remedy = f"The limit on {names[rejects.argmax()]} rejects most, {rejects.max()}"
    none = f"none of {n_tests} is{within_limits(table)} ({', '.join(limit_words(table))})"
    return f"{'; '.join([none, *_missing_texts(table)])}. {remedy}."


def _nearest_value(table: TestTable, name: str, rows: Mask) -> str:
    """Return which value of some tests is the nearest to a limit on numbers, else nothing."""
    limit = table.limits.get(name)
    if limit is None or limit.texts is not None:
        return ""
    values = table.column(name)[rows]
    nearest = values[limit.excess(name, values).argmin()]
    if not np.isfinite(nearest):
        return f"; none of them has a value of {name}"
    text = text_beyond(table, name, limit, float(nearest))
    return f"; the nearest has {name} {text} {table.schema.units.get(name, '')}".rstrip()


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


def failure_sentences(table: TestTable) -> list[str]:
    """Say which rule on variables separates failed tests from others, if one does.

    A rule is a value of a variable, or of a ratio or product of two, beyond which nearly all tests
    fail, and nearly none elsewhere. The probability of as many failures there, if these had nothing
    to do with the design (hypergeometric), is multiplied by the number of rules. Of equal ones,
    a variable goes before ratios and products. Tests that did not run, because of a requirement, do
    not count, nor do repeated ones, nor those before the last 1024. Designs of a file, which may be
    incomplete, have no rule.

    Returns:
        One sentence; none if no rule separates them, or if that may be chance.

    Example:
        >>> X = np.random.default_rng(0).uniform([10, 1], [100, 5], (40, 2))
        >>> F = X.sum(axis=1, keepdims=True)
        >>> F[X[:, 0] / X[:, 1] > 30] = np.nan
        >>> failure_sentences(TestTable.of(np.arange(1, 41), X, F))[0].split(" in ")[0]
        'The requirement x1 / x2 <= 30 would have avoided 9 of 9 failures'
    """
    if table.schema.words["failed"] != "failed" or not table.failed().any():
        return []
    has_run = table.failed() | np.isfinite(table.F).any(axis=1)
    table = table.take(np.unique(first_tests(table)[has_run])[-_MOST_TESTS:])
    has_failed = table.failed()
    terms = _terms(table)
    level = np.log(_LEVEL / (2 * len(table) * len(terms) + 1))
    rules = _rules(terms, has_failed)
    chance, rule, n_right, n_beyond = min(rules, key=itemgetter(0), default=(level, "", 0, 0))
    if chance >= level:
        return []
    return [
        f"The requirement {rule} would have avoided {n_right} of {has_failed.sum()} failures in "
        f"the last {len(table)} tests, and rejected {counted(n_beyond - n_right, 'other test')}."
    ]


def _rules(terms: Mapping[str, Array], has_failed: Mask) -> Iterator[tuple[float, str, int, int]]:
    """Yield rules that nearly all failed tests violate, and nearly no others.

    Args:
        terms: ``(n,)`` values of expressions, by expression.
        has_failed: ``(n,)`` the failed tests.

    Yields:
        The logarithm of the probability that a rule separates as many failures by chance, the rule,
        how many failed tests violate it, and how many tests.
    """
    from scipy.stats import hypergeom  # heavy to import

    n = len(has_failed)
    n_failed = has_failed.sum()
    n_beyond = np.arange(1, n)
    least_right = _LEAST_RIGHT * np.maximum(n_beyond, n_failed)
    for term, values in terms.items():
        for sign, relation in ((-1, "<="), (1, ">=")):
            if sign > 0 and " / " in term:  # h / t <= 45 stands for t / h >= 0.0222
                continue
            order = np.argsort(sign * values, kind="stable")
            v = values[order]
            n_right = np.cumsum(has_failed[order])[:-1]
            are_apart = np.abs(np.diff(v)) > _ROUNDING * np.abs(v[1:])
            for k in np.flatnonzero((n_right >= least_right) & are_apart):
                chance = hypergeom.logsf(n_right[k] - 1, n, n_failed, n_beyond[k])
                yield chance, f"{term} {relation} {_short(v[k], v[k + 1])}", n_right[k], n_beyond[k]


def _terms(table: TestTable) -> dict[str, Array]:
    """Return values of variables, and of ratios and products of positive ones, by expression."""
    terms = {}
    for column in table.schema.with_role(VARIABLE):
        if column.kind is not Kind.CHOICE:
            terms[operand(column.name)] = table.column(column.name).astype(float)
    positive = [name for name, values in terms.items() if (values > 0).all()]
    for a, b in permutations(positive, 2):
        terms[f"{a} / {b}"] = terms[a] / terms[b]
        if a < b:
            terms[f"{a} * {b}"] = terms[a] * terms[b]
    return terms


def _short(a: float, b: float) -> str:
    """Return the number of fewest digits between two numbers."""
    for digits in range(1, 16):
        number = float(f"{(a + b) / 2:.{digits}g}")
        if min(a, b) < number < max(a, b):
            break
    return f"{number:.15g}"
