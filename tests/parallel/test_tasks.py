"""Tasks and designs: every result with its number, errors as they were raised."""

import os

import pytest

from pymoo_psi import ProcessRunner
from pymoo_psi.errors import WorkerError
from pymoo_psi.parallel import in_parallel
from tests.helpers.processes import until
from tests.helpers.refusals import refused


def test_expensive_designs_are_spread_over_the_workers(tmp_path):
    """The last four end only when all of them are under way."""

    def meeting(x):
        if x < 100:
            return {"F": x}
        (tmp_path / str(x)).touch()
        return {"F": x if until(lambda: len(os.listdir(tmp_path)) == 4) else None}

    assert ProcessRunner(4)(meeting, range(104)) == [{"F": x} for x in range(104)]


def failing(task):
    if task == 4:
        os._exit(5)
    return 10 // (2 - task)


def test_a_task_raises_what_its_function_raises():
    assert sorted(in_parallel(failing, [0, 1], 2)) == [(0, 5), (1, 10)]
    with pytest.raises(ZeroDivisionError):
        list(in_parallel(failing, [2], 2))
    refused(
        r"worker process died \(exit code 5, 2 times\)",
        list,
        in_parallel(failing, [4], 2),
        error=WorkerError,
    )
