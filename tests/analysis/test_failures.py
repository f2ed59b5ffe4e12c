"""The rule on variables that separates failed tests from others is found, and none where none is."""

import re

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import TestTable, investigate
from pymoo_psi.analysis import failure_sentences
from tests.helpers.models import Model


def rule(X, has_failed):
    F = np.where(has_failed, np.nan, 1.0)[:, None]
    return failure_sentences(TestTable.of(np.arange(1, len(X) + 1), X, F))


def requirement(sentence):
    return sentence.split("requirement ")[1].split(" would")[0]


def designs(random, n, d):
    return random.uniform(0.1, 1, (n, d)) * 10 ** random.uniform(-3, 3, d)


@pytest.mark.parametrize(
    ("value", "word"),
    [
        (lambda X: X[:, 0], "x1 <="),
        (lambda X: -X[:, 0], "x1 >="),
        (lambda X: X[:, 0] / X[:, 1], "x1 / x2 <="),
        (lambda X: X[:, 0] * X[:, 1], "x1 * x2 <="),
    ],
)
@pytest.mark.parametrize("wrong", [0, 2])
def test_a_planted_rule_on_failures_is_found(value, word, wrong):
    random = np.random.default_rng(1)
    for _ in range(20):
        X = designs(random, 100, int(random.integers(2, 8)))
        is_beyond = value(X) > np.quantile(value(X), 0.7)
        has_failed = is_beyond ^ np.isin(np.arange(100), random.choice(100, wrong, replace=False))
        [sentence] = rule(X, has_failed)
        assert word in sentence
        is_met = eval(requirement(sentence), {f"x{j}": x for j, x in enumerate(X.T, 1)})
        assert (is_met != is_beyond).mean() >= 1 - 0.01 * wrong
        n_avoided, n_rejected = (~is_met & has_failed).sum(), (~is_met & ~has_failed).sum()
        assert f"avoided {n_avoided} of {has_failed.sum()} failures" in sentence
        assert re.search(rf" rejected {n_rejected} other tests?\.$", sentence)


def test_failures_at_random_or_in_balls_have_no_rule():
    random = np.random.default_rng(2)
    n_random = 0
    for _ in range(40):
        X = designs(random, int(random.integers(2, 100)), int(random.integers(1, 8)))
        n_random += bool(rule(X, random.random(len(X)) < random.choice([0.0, 0.1, 0.5, 0.9, 1.0])))
        X = random.random((200, 3))
        assert rule(X, ((X - 0.5) ** 2).sum(axis=1) < 0.1) == []
    assert n_random <= 1


def test_rules_on_failures_take_variables_of_every_kind():
    random = np.random.default_rng(3)
    offset = random.integers(-9, 10, 60)
    columns = {"material": random.choice(["steel", "brass"], 60), "offset of wall": offset}
    X = pd.DataFrame({**columns, "load": 5.0, "width": random.random(60)})
    [sentence] = rule(X, offset >= 4)
    assert requirement(sentence) == "`offset of wall` <= 3.5"
    assert rule(X[:1], np.array([True])) == []
    X["width"] = np.repeat([0.3, 0.1 + 0.2], 30)  # equal but for rounding
    X["offset of wall"] = random.permutation(60)
    assert rule(X, np.arange(60) >= 30) == []


def test_designs_that_did_not_run_do_not_count():
    size = {"n_var": 2, "n_obj": 1, "xl": 1.0, "xu": 10.0}
    plate = Model(lambda x: {"F": x.sum()}, fails=lambda x: x[0] / x[1] > 2, **size)
    plate.names = {"x1": "a = b"}  # a sign in a name is none of the rule
    table = investigate(plate, 128, requirements=["`a = b` * x2 <= 40"])
    n_failed = table.failed().sum()
    n_run = n_failed + np.isfinite(table.F[:, 0]).sum()
    assert n_run < 128
    [sentence] = failure_sentences(table)
    assert f"avoided {n_failed} of {n_failed} failures in the last {n_run} tests" in sentence
    table = investigate(plate, 128, requirements=["`a = b` * x2 <= 40", requirement(sentence)])
    assert not table.failed().any()
