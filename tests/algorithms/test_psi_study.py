"""PSI with a study file and with designs that fail: nothing is lost, nothing is done twice."""

import pytest
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    SphereChute,
)
from pymoo_psi.errors import StudyMismatchError
from tests.refusals import refused


class Counted(ElementwiseProblem):
    """Two parabolas over a square; counts its evaluations and fails where it is told to."""

    def __init__(self, broken=()):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0, xu=1)
        self.seen, self.broken = [], set(broken)

    def _evaluate(self, x, out, *args, **kwargs):
        self.seen.append(tuple(x))
        if len(self.seen) in self.broken:
            raise RuntimeError(f"no convergence at {x[0]}")
        out["F"] = [x[0] ** 2 + x[1], (1 - x[0]) ** 2 + x[1]]
        out["G"] = [x[0] - 0.9]


def run(problem, n, path, **options):
    return minimize(problem, PSI(n, study=path, block_size=16, **options)).algorithm.table


@pytest.mark.parametrize(
    ("other", "options", "message"),
    [
        (SphereChute(0.4, model="rolling"), {}, "model"),
        (SphereChute(0.5, lower=(0, 0.1), upper=(1.4, 6)), {}, "mu"),
        (SphereChute(0.4), {"study_key": "v2"}, "key"),
    ],
)
def test_another_problem_is_refused(study_file, other, options, message):
    run(SphereChute(0.4), 16, study_file)
    before = study_file.read_bytes()
    refused(message, run, other, 16, study_file, error=StudyMismatchError, **options)
    assert study_file.read_bytes() == before


def test_failed_designs_are_recorded_and_retried(study_file):
    table = run(Counted(broken={3, 7}), 32, study_file)
    assert table.numbers[table.status == "failed"].tolist() == [3, 7]
    assert table.reasons[3].startswith("RuntimeError: no convergence at")
    assert not table.feasible()[[2, 6]].any()
    again = Counted()
    assert run(again, 32, study_file).equals(table)
    assert again.seen == []
    healed = run(again, 32, study_file, retry="failed")
    assert len(again.seen) == 2
    assert healed.equals(minimize(Counted(), PSI(32)).algorithm.table)
