"""Shares of a run on many machines, and vectorised models on many cores."""

import os

import numpy as np
import pytest
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

from pymoo_psi import PSI, QMCSampling, VectorizedSphereChute, investigate
from pymoo_psi.table import read_table
from tests.refusals import refused

CHUTE = VectorizedSphereChute(0.4)


class Holed(Problem):
    """Fails at some points, and says in which process it runs."""

    def __init__(self):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=0.0, xu=1.0)

    def _evaluate(self, x, out, *args, **kwargs):
        out["F"] = np.column_stack([x[:, 0] ** 2 + x[:, 1], (1 - x[:, 0]) ** 2 + x[:, 1]])
        out["F"][x[:, 0] == 0.5] = np.nan
        out["G"] = x[:, :1] - 0.9


def of_psi(n, **options):
    return minimize(Holed(), PSI(n, **options)).algorithm.table


def of_investigate(n, **options):
    return investigate(Holed(), n, **options)


@pytest.mark.parametrize("by", [of_psi, of_investigate])
@pytest.mark.parametrize("sampling", [None, QMCSampling("sobol", scramble=False)])
def test_shares_together_are_the_run(tmp_path, by, sampling):
    whole = by(300, first=3, sampling=sampling)
    parts = []
    for k in (2, 3, 1):
        parts.append(by(300, first=3, sampling=sampling, share=(k, 3), study=tmp_path / "runs"))
    assert sum(map(len, parts)) == 300
    assert parts[0].merge(parts[1]).merge(parts[2]).equals(whole)
    assert read_table(tmp_path / "runs").equals(whole)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"share": (5, 4)}, r"share must be \(k, n\) with k from 1 to n, got \(5, 4\)"),
        (
            {"share": (9, 16)},
            "share must be one that gets a point of points 1 to 8, got 9 of 16; test as many",
        ),
        ({"share": (1, 2), "study": "s.db"}, "study must be the name of a folder with a share"),
        ({"share": (1, 2), "sampling": QMCSampling("sobol")}, "seed must be given"),
    ],
)
def test_mistakes(options, message, in_folder):
    of_investigate(8, study="s.db")
    refused(message, of_investigate, 8, **options)


def test_processes_give_the_table_of_one_core_and_a_study_has_all_of_it(tmp_path):
    whole = investigate(CHUTE, 3000)
    kept = investigate(CHUTE, 3000, n_jobs=2, keep="pareto", study=tmp_path / "s.db")
    assert kept.equals(whole.take(whole.pareto()))
    assert read_table(tmp_path / "s.db").equals(whole)
    again = investigate(CHUTE, 3500, n_jobs=2, study=tmp_path / "s.db")
    assert again.equals(investigate(CHUTE, 3500))
    assert os.listdir(tmp_path) == ["s.db"]
