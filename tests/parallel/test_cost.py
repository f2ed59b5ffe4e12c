"""What a runner sends, and when: sizes of chunks, on numbers and a clock of the test."""

import itertools
import math
from collections import deque
from unittest import mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi.parallel import _joblib_runner, LONGEST_CHUNK, chunk_size, evaluate_here


@given(
    n=st.integers(1, 5000),
    workers=st.integers(1, 64),
    cost=st.one_of(st.just(math.nan), st.floats(1e-9, 1e4)),
)
def test_chunks_use_up_the_designs_and_stay_in_their_bounds(n, workers, cost):
    sizes, left = [], n
    while left:
        sizes.append(chunk_size(left, workers, cost))
        assert 1 <= sizes[-1] <= left
        left -= sizes[-1]
    assert sum(sizes) == n
    assert all(a >= b for a, b in itertools.pairwise(sizes)), "chunks never grow towards the end"
    if not math.isnan(cost):
        assert all(size == 1 or (size - 0.5) * cost <= LONGEST_CHUNK for size in sizes)


@pytest.mark.parametrize(
    ("n", "workers", "cost", "size"),
    [
        (1000, 2, 0.01, 10),  # a chunk lasts 0.1 s
        (1000, 2, 1e-4, 250),  # all workers have work
        (20, 2, 0.01, 5),  # the end is shared
        (20, 2, 1e-4, 20),  # but not in crumbs
        (1000, 2, 60.0, 1),
        (1000, 2, math.nan, 1),  # unknown: one at a time
    ],
)
def test_chunk_sizes(n, workers, cost, size):
    assert chunk_size(n, workers, cost) == size


def test_the_cost_is_the_median_and_one_slow_import_does_not_count():
    cost = Cost()
    assert math.isnan(cost.seconds)
    assert not cost.known
    for designs_, seconds in [(1, 0.9), (1, 0.001), (100, 0.1)]:
        assert not cost.known
        cost.add(designs_, seconds)
    assert cost.known
    assert cost.seconds == 0.001
    for _ in range(3):  # the model has become slow
        cost.add(1, 0.5)
    assert cost.seconds == 0.5


def test_a_first_design_of_minutes_is_believed():
    cost = Cost()
    cost.add(1, 60.0)
    assert cost.known


def known(seconds):
    cost = Cost()
    for _ in range(3):
        cost.add(1, seconds)
    return cost


def test_cheap_designs_are_not_worth_sending():
    assert not known(1e-5).worth_sending(100, 2, 0.01)
    assert known(1e-2).worth_sending(100, 2, 0.01)
    assert not known(1e-2).worth_sending(100, 2, 0.3), "when sending takes longer than all of it"
    assert not known(60.0).worth_sending(10**9, 1, 0.0), "when there is one worker"
    assert not Cost().worth_sending(10**9, 2, 0.0), "when nothing is known"


class Clock:
    """Time that passes only when a design is evaluated."""

    def __init__(self, seconds):
        self.now, self.seconds, self.looks = 0.0, seconds, 0

    def __call__(self):
        self.looks += 1
        return self.now

    def evaluate(self, design):
        self.now += self.seconds
        return {"F": design}


def here(clock, n, cost, enough):
    """The values of designs evaluated in this process, in the order of their indices."""
    waiting = deque(enumerate(range(n)))
    with mock.patch.object(_joblib_runner, "perf_counter", clock):
        results = list(evaluate_here(clock.evaluate, waiting, cost, enough))
    assert [index for index, *_ in results] == list(range(n - len(waiting)))
    return [values for _, values, _ in results]


def test_a_cheap_model_is_evaluated_here_with_few_looks_at_the_clock():
    clock, cost = Clock(1e-6), Cost()
    done = here(clock, 5000, cost, lambda left: False)
    assert [values["F"] for values in done] == list(range(5000))
    assert cost.seconds == pytest.approx(1e-6)
    assert clock.looks < 30


def test_a_dear_model_is_left_after_three_designs():
    clock, cost = Clock(0.01), Cost()
    asked = []

    def enough(left):
        asked.append(left)
        return cost.worth_sending(left, 2, 0.01)

    assert len(here(clock, 100, cost, enough)) == 3
    assert asked == [100, 99, 98, 97]
    assert here(clock, 100, cost, enough) == []


def test_a_model_that_becomes_dear_is_noticed_within_a_call():
    clock, cost = Clock(1e-5), Cost()
    here(clock, 1000, cost, lambda left: False)
    clock.seconds = 0.01

    def enough(left):
        return cost.worth_sending(left, 2, 0.01)

    assert 0 < len(here(clock, 500, cost, enough)) <= 300
