"""Studies to test: their head, blocks of tests, and what is compared of them and of folders."""

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np

from pymoo_psi.study import Study, identity_of_run

HEAD = {
    "variables": ["x", "n", "hollow", "metal"],
    "kinds": ["real", "integer", "binary", "choice"],
    "objectives": ["f1", "f2"],
    "inequalities": ["g1"],
    "equalities": ["h1"],
    "lower": [0.0, -5.0, np.nan, np.nan],
    "upper": [1.0, 5.0, np.nan, np.nan],
    "eq_tolerance": 1e-4,
    "problem": {"problem": "chute", "parameters": {"mu": 0.2}, "key": None},
}
METALS = np.array(["steel", "Müßig'\"", "1.5", ""], dtype=object)


def block(first, count, seed=0, failed=()):
    """The tests ``first``, ``first + 1``, … as columns; the same ones however they are cut."""
    numbers = np.arange(first, first + count)
    made = [np.random.default_rng(number) for number in numbers]
    values = np.array([rng.normal(size=5) for rng in made]).reshape(count, 5)
    values[:, 1:] += seed
    fails = np.isin(numbers, list(failed))
    values[fails, 1:] = np.nan
    return {
        "test_point": numbers,
        "x": values[:, 0],
        "n": numbers % 7 - 3,
        "hollow": numbers % 2 == 0,
        "metal": METALS[numbers % 4],
        "f1": values[:, 1],
        "f2": values[:, 2],
        "g1": values[:, 3],
        "h1": values[:, 4],
        "status": np.where(fails, "failed", "ok").astype(object),
        "reason": np.where(fails, f"seed {seed}: no convergence", "").astype(object),
    }


def rows(columns, selection):
    return {name: column[selection] for name, column in columns.items()}


def bits(columns):
    """Everything that columns hold, every number with all its bits."""
    return {
        name: (column.dtype, column.tolist() if column.dtype == object else column.tobytes())
        for name, column in columns.items()
    }


def contents(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def of_one_run(columns):
    """The columns of tests of a single run, without the numbers that say that it is one."""
    assert (columns["test"] == columns["test_point"]).all()
    assert (columns["run"] == 1).all()
    return {name: columns[name] for name in columns if name not in ("test", "run")}


def read(path):
    """The head and the tests of a study of one run."""
    facts, columns = Study(path).contents()
    return facts.head, of_one_run(columns)


def proposed(study, made):
    with study.changes() as database:
        return database.propose(1, made)


def begun(path, head=HEAD, share=None, **options):
    study = Study(path, **options)
    study.begin(head, identity_of_run(head, None), share)
    return study


def sql(path, *statements):
    """Run statements of SQL on a file; return the rows that the last of them finds."""
    with closing(sqlite3.connect(path, isolation_level=None)) as db:
        return [db.execute(statement).fetchall() for statement in statements][-1]
