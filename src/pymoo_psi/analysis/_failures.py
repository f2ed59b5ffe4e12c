"""A rule on variables that separates designs whose tests fail from all others."""

from __future__ import annotations

from collections import Counter
from itertools import permutations

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import Array, Mask, Rows
from pymoo_psi.analysis._costs import alike
from pymoo_psi.analysis._repeats import first_tests
from pymoo_psi.table import TestTable

# At least this share of the failures is within a rule, and of the tests within it are failures.
_LEAST_RIGHT = 0.9
# The probability that one of the rules that are tried separates as many failures by chance is at
# most this, and in fact much less, as most of these rules are alike.
_LEVEL = 0.05
_MOST_TESTS = 1024
_MOST_REASONS = 3  # those that occur most


def failure_sentences(table: TestTable) -> list[str]:
    """Say which rule on variables separates failed tests from others, if one does.

    A rule is a value of a variable, or of a ratio or product of two, beyond which nearly all tests
    fail, and nearly none elsewhere. The probability of as many failures there, if these had nothing
    to do with the design (hypergeometric), is multiplied by the number of rules. Of equal ones,
    a variable goes before ratios and products. Each of the most frequent reasons has a rule of its
    own; if none has one, there may be a rule of all failures. Tests that did not run, because of a
    requirement, do not count, nor do repeated ones, nor those before the last 1024. Designs of a
    file, which may be incomplete, have no rule.

    Returns:
        One sentence a rule; none if no rule separates them, or if that may be chance.

    Example:
        >>> X = np.random.default_rng(0).uniform([10, 1], [100, 5], (40, 2))
        >>> F = X.sum(axis=1, keepdims=True)
        >>> F[X[:, 0] / X[:, 1] > 30] = np.nan
        >>> failure_sentences(TestTable.of(np.arange(1, 41), X, F))[0].split(" in ")[0]
        'The requirement x1 / x2 <= 30 would have avoided 9 of 9 failures'
    """
    if table.schema.words["row"] != "test" or not table.failed().any():
        return []
    has_run = table.failed() | np.isfinite(table.F).any(axis=1)
    rows = np.unique(first_tests(table)[has_run])[-_MOST_TESTS:]
    table = table.take(rows)
    reasons = np.array(alike(table.reasons.get(number, "") for number in table.numbers.tolist()))
    counts = Counter(reasons[table.failed()].tolist())
    if len(counts) == 1:
        return _rule(table, table.failed(), "failures")
    sentences = []
    for reason, _ in counts.most_common(_MOST_REASONS):
        sentences += _rule(table, reasons == reason, f"failures with '{reason:.60}'")
    return sentences or _rule(table, table.failed(), "failures")


def _rule(table: TestTable, has_failed: Mask, failures: str) -> list[str]:
    """Return a sentence on the rule that separates some failed tests from successful ones.

    Args:
        table: The tests, each of which ran or failed.
        has_failed: ``(n,)`` the failed tests, if other failures do not count.
        failures: What they are called.
    """
    from scipy.stats import hypergeom  # heavy to import

    n_tests = len(table)
    rows = np.flatnonzero(has_failed | ~table.failed())
    has_failed = has_failed[rows]
    n = len(rows)
    n_failed = has_failed.sum()
    n_beyond = np.arange(1, n)
    sentences: list[str] = []
    terms = _terms(table, rows)
    least_right = _LEAST_RIGHT * np.maximum(n_beyond, n_failed)
    least = np.log(_LEVEL / (2 * n * len(terms) + 1))
    for term, values in terms.items():
        for sign, relation in ((-1, "<="), (1, ">=")):
            if sign > 0 and " / " in term:  # h / t <= 45 stands for t / h >= 0.0222
                continue
            order = np.argsort(sign * values, kind="stable")
            v = values[order]
            n_right = np.cumsum(has_failed[order])[:-1]
            for k in np.flatnonzero((n_right >= least_right) & (np.diff(v) != 0)):
                chance = hypergeom.logsf(n_right[k] - 1, n, n_failed, n_beyond[k])
                if chance < least:
                    least = chance
                    limit = _short(v[k], v[k + 1])
                    sentences = [
                        f"The requirement {term} {relation} {limit} would have avoided "
                        f"{n_right[k]} of {n_failed} {failures} in the last {n_tests} tests, and "
                        f"rejected {n_beyond[k] - n_right[k]} others."
                    ]
    return sentences


def _terms(table: TestTable, rows: Rows) -> dict[str, Array]:
    """Return values of variables, and of ratios and products of positive ones, by expression."""
    terms = {}
    for j, name in enumerate(table.schema.variables):
        if table.schema.kinds[j] is not Kind.CHOICE:
            if not name.isidentifier():
                name = f"`{name}`"
            terms[name] = table.X[rows, j].astype(float)
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
