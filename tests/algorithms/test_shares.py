"""Shares of a run on many machines, and vectorised models on many cores."""

import os

import numpy as np
import pytest
from pymoo.optimize import minimize

from pymoo_psi import PSI, QMCSampling, VectorizedSphereChute, investigate
from pymoo_psi.errors import StudyMismatchError
from pymoo_psi.files import read_table
from tests.helpers.models import Model
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
        (
            {"share": (1, 2), "study": "s.db"},
            "study must be a file or, for a share of the points, a folder, got",
        ),
        ({"share": (1, 2), "sampling": QMCSampling("sobol")}, "seed must be given"),
    ],
)
def test_mistakes(options, message, in_folder):
    investigate(CHUTE, 8, study="s.db")
    refused(message, investigate, CHUTE, 8, **options)


def test_processes_give_the_table_of_one_core(tmp_path):
    whole = investigate(CHUTE, 3000)
    assert investigate(CHUTE, 3000, n_jobs=2, keep="pareto", study=tmp_path / "s.db").equals(
        whole.take(whole.pareto())
    )
    assert read_table(tmp_path / "s.db").equals(whole)
    assert investigate(CHUTE, 3500, n_jobs=2, study=tmp_path / "s.db").equals(
        investigate(CHUTE, 3500)
    )
    assert os.listdir(tmp_path) == ["s.db"]


def recurring(more=0.0, seeds=0, noisy=False):
    """A model whose designs recur in several shares."""

    def results(x, seed=0):
        return {"F": [1e6 * x[0] + seeds * seed + more, -x[0]], "temperature": seed}

    return Model(results, n_var=1, xu=4, vtype=int, noisy=noisy)


def make_share(folder, part, n_parts, **changes):
    return minimize(recurring(**changes), PSI(12, share=(part, n_parts), study=folder))


@pytest.mark.parametrize(("noisy", "seeds"), [(False, 0), (True, 1), (True, 0)])
def test_designs_of_several_shares_are_those_of_one_run(noisy, seeds, tmp_path):
    """Under the same numbers; the tests of a noisy model all count, equal objectives or not."""
    for part in (1, 2, 3):
        make_share(tmp_path / "shares", part, 3, seeds=seeds, noisy=noisy)
    minimize(recurring(seeds=seeds, noisy=noisy), PSI(12, study=tmp_path / "s.db"))
    whole = read_table(tmp_path / "s.db", average_by=False)
    assert len(whole) == (12 if noisy else 5)
    assert read_table(tmp_path / "shares", average_by=False).to_frame().equals(whole.to_frame())


def test_shares_of_two_versions_are_no_table(tmp_path):
    make_share(tmp_path, 1, 2)
    make_share(tmp_path, 2, 2, more=1.0)
    refused("different results for the same design", read_table, tmp_path, error=StudyMismatchError)


@pytest.mark.parametrize("more", [[0, 1e-6], [np.nan, 0], [0] * 4 + [1e-9] * 8])
def test_what_machines_round_otherwise_is_no_other_version(more, tmp_path):
    """Relative to the largest result of all shares; nor is a failure where a licence is missing."""
    for part, change in enumerate(more, 1):
        make_share(tmp_path, part, len(more), more=change)
    table = read_table(tmp_path)
    assert len(table) == 5
    assert np.isfinite(table.F).all(axis=1).sum() >= 3
