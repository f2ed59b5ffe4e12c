"""Shares of a run on many machines, and vectorised models on many cores."""

import os

import numpy as np
import pytest
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

from pymoo_psi import PSI, QMCSampling, VectorizedSphereChute, investigate
from pymoo_psi.errors import StudyMismatchError
from pymoo_psi.files import read_table
from tests.helpers.refusals import refused

CHUTE = VectorizedSphereChute(0.4)


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
    investigate(CHUTE, 8, study="s.db")
    refused(message, investigate, CHUTE, 8, **options)


def test_processes_give_the_table_of_one_core(tmp_path):
    whole = investigate(CHUTE, 3000)
    kept = investigate(CHUTE, 3000, n_jobs=2, keep="pareto", study=tmp_path / "s.db")
    assert kept.equals(whole.take(whole.pareto()))
    assert read_table(tmp_path / "s.db").equals(whole)
    again = investigate(CHUTE, 3500, n_jobs=2, study=tmp_path / "s.db")
    assert again.equals(investigate(CHUTE, 3500))
    assert os.listdir(tmp_path) == ["s.db"]


class Recurring(ElementwiseProblem):
    """A model whose designs recur in several shares."""

    more = 0.0

    def __init__(self, noisy, seeds=1):
        super().__init__(n_var=1, n_obj=2, xl=0, xu=4, vtype=int)
        self.noisy = noisy
        self.seeds = seeds

    def _evaluate(self, x, out, *args, seed=0, **kwargs):
        out["F"] = [1e6 * x[0] + self.seeds * seed + self.more, -x[0]]
        out["temperature"] = seed


@pytest.mark.parametrize(("noisy", "seeds"), [(False, 1), (True, 1), (True, 0)])
def test_designs_of_several_shares_are_those_of_one_run(noisy, seeds, tmp_path):
    """Under the same numbers; the tests of a noisy model all count, equal objectives or not."""
    problem = Recurring(noisy, seeds)
    for part in (1, 2, 3):
        minimize(problem, PSI(12, share=(part, 3), study=tmp_path / "shares"))
    minimize(problem, PSI(12, study=tmp_path / "s.db"))
    whole = read_table(tmp_path / "s.db", average_by=False)
    assert len(whole) == (12 if noisy else 5)
    assert read_table(tmp_path / "shares", average_by=False).to_frame().equals(whole.to_frame())


@pytest.mark.parametrize(("more", "is_refused"), [(1e-6, False), (1.0, True)])
def test_shares_of_two_versions_are_no_table(more, is_refused, tmp_path, monkeypatch):
    """What machines round otherwise, relative to the largest result, is no other version."""
    for part in (1, 2):
        minimize(Recurring(False), PSI(12, share=(part, 2), study=tmp_path))
        monkeypatch.setattr(Recurring, "more", more)
    if is_refused:
        with pytest.raises(StudyMismatchError, match="different results for the same design"):
            read_table(tmp_path)
    else:
        assert len(read_table(tmp_path)) == 5


def test_a_design_may_fail_in_one_share_only(tmp_path, monkeypatch):
    """As on a machine without a licence: the result of another share counts."""
    for part, more in ((1, np.nan), (2, 0.0)):
        monkeypatch.setattr(Recurring, "more", more)
        minimize(Recurring(False), PSI(12, share=(part, 2), study=tmp_path))
    table = read_table(tmp_path)
    assert len(table) == 5
    assert np.isfinite(table.F).all(axis=1).sum() >= 3


def test_rounding_is_measured_by_all_shares(tmp_path, monkeypatch):
    """A share of one small value knows no size of its own."""
    for part in range(1, 13):
        monkeypatch.setattr(Recurring, "more", 1e-9 * (part > 4))
        minimize(Recurring(False), PSI(12, share=(part, 12), study=tmp_path))
    assert len(read_table(tmp_path)) == 5
