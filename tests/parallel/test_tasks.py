"""Tasks on workers: every result with its number, errors as they were raised."""

import os
import time

import joblib
import pytest

from pymoo_psi.errors import EvaluationError, WorkerError
from pymoo_psi.parallel import in_order, in_parallel


def test_results_come_in_order_and_as_soon_as_they_can():
    asked = []

    def numbered():
        for number in (1, 0, 2, 4, 3):
            asked.append(number)
            yield number, f"task {number}"

    results = in_order(numbered())
    assert next(results) == "task 0"
    assert asked == [1, 0]
    assert list(results) == ["task 1", "task 2", "task 3", "task 4"]


def failing(task):
    if task == 3:
        raise EvaluationError([0.5], "no convergence")
    if task == 4:
        os._exit(5)
    time.sleep(0.2 * (task == 0))
    return 10 // (2 - task)


@pytest.mark.parametrize("backend", ["loky", "threading"])
def test_a_task_raises_what_its_function_raises(backend):
    with joblib.parallel_config(backend):
        assert sorted(in_parallel(failing, [0, 1], 2)) == [(0, 5), (1, 10)]
        with pytest.raises(ZeroDivisionError):
            list(in_parallel(failing, [2], 2))
        with pytest.raises(EvaluationError, match=r"design \[0.5\] cannot be .* no convergence"):
            list(in_parallel(failing, [3], 2))


def test_a_task_that_ends_its_worker_is_told():
    with pytest.raises(WorkerError, match=r"worker process died \(exit code 5, 2 times\)"):
        list(in_parallel(failing, [4], 2))
