"""What a store of tests must do: every test comes back as it was, and what it cannot do it says."""

import copy
import json
import os
import pickle
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi import investigate
from pymoo_psi.errors import ArgumentValueError, StudyMismatchError
from pymoo_psi.study import Study, read_folder
from tests.helpers.models import Model
from tests.helpers.refusals import refused
from tests.helpers.studies import (
    HEAD,
    begun,
    bits,
    block,
    contents,
    of_one_run,
    proposed,
    read,
    rows,
)


@pytest.fixture
def study(tmp_path):
    return begun(tmp_path / "a study #1?.db", wait=0)


def changed(**problem):
    return HEAD | {"problem": HEAD["problem"] | problem}


# Proposals


def test_the_first_proposals_under_a_number_stay(study):
    nothing = read(study.path)
    assert study.proposals() == []
    made = [(n, 2, "métal", {"point": [0.1, None, 1e-300], "n": n}) for n in (7, 8, 9)]
    assert proposed(study, made) == made
    assert proposed(study, [(n, 3, "other", {}) for n in (7, 8)]) == made[:2]
    refused("must hold plain values", begun, study.path, changed(parameters={"n": np.int64(3)}))
    assert Study(study.path).proposals() == made
    assert str(read(study.path)) == str(nothing)  # they are no tests


# Tests come back


@given(numbers=st.lists(st.integers(1, 2**63 - 1), max_size=6, unique=True), data=st.data())
def test_tests_come_back_in_their_order(tmp_path_factory, numbers, data):
    """In whatever order they were stored; that any values do, test_table_files proves."""
    head = HEAD | {"lower": [-np.inf, -5.0, np.nan, -0.0], "upper": [1e-300, np.inf, 1e308, 0.1]}
    points = {"test_point": np.array(numbers, dtype=np.int64)}
    columns = block(1, len(numbers), failed=[2]) | points
    study = begun(tmp_path_factory.mktemp("study") / "s.db", head)
    cut = data.draw(st.integers(0, len(numbers)))
    for part in (slice(cut, None), slice(0, cut)):
        study.append(rows(columns, part))
    found_head, found = read(study.path)
    assert bits(found) == bits(rows(columns, np.argsort(columns["test_point"])))
    assert json.dumps(found_head) == json.dumps(head)


def test_names_that_sql_reads_as_others_are_kept(tmp_path):
    names = ["a", "A", "number", "NUMBER", "number_", "Seconds", "rowid", "oid", "value", "first"]
    names += ["ä", "Ä", 'in "quotes"', "`", "[x]", "select", "1", " ", "a;b", "--", "naïve 🤖", "?"]
    head = HEAD | {"objectives": names}
    columns = block(1, 3) | {name: np.array([i, 0.1, i / 3]) for i, name in enumerate(names)}
    del columns["f1"], columns["f2"]
    study = begun(tmp_path / "s.db", head)
    study.append(columns)
    assert bits(read(study.path)[1]) == bits(columns)
    assert bits(of_one_run(read_folder(tmp_path)[1])) == bits(columns)
    with study.reading() as database:
        assert database.find(database.keys(columns)).tolist() == [1, 2, 3]


def test_columns_with_similar_names_keep_their_values_in_any_order(study_file):
    """Further outputs whose names SQL takes for one, or for a column of its own."""
    outputs = {"q": 1.0, "Q": 2.0, "repeat_": 3.0}
    similar = Model(lambda x: {"F": x[0], **outputs}, n_var=1, n_obj=1)
    for n_points, units in ((4, {}), (4, {"Q": "kg"}), (8, {"repeat_": "m"})):
        table = investigate(similar, n_points, study=study_file, units=units)
        for name, value in outputs.items():
            assert {*table.column(name)} == {value}


# Anyone can open it


def test_other_programs_read_a_study_without_us(study):
    columns = block(1, 40, failed=[3])
    study.append(columns, origin="LP-tau", seconds=0.25)
    with closing(sqlite3.connect(study.path)) as db:
        frame = pd.read_sql("SELECT * FROM tests ORDER BY test", db)
        facts = {key: json.loads(value) for key, value in db.execute("SELECT key, value FROM meta")}
    names = ["x", "n", "hollow", "metal", "f1", "f2", "g1", "h1"]
    assert list(frame) == [
        "test",
        "design",
        "repeat",
        "status",
        "reason",
        "origin",
        "seconds",
        *names,
    ]
    for name in names:
        np.testing.assert_array_equal(frame[name], columns[name])
    assert frame["test"].tolist() == list(range(1, 41))
    assert frame["reason"].notna().tolist() == [number == 3 for number in range(1, 41)]
    assert set(frame["origin"]) == {"LP-tau"}
    assert facts["head"]["problem"] == HEAD["problem"]


# Continuing


@pytest.mark.parametrize(
    ("head", "said"),
    [
        (changed(key="v2"), 'problem.key is null in the study, "v2" asked'),
        (
            changed(parameters={"mu": 0.2, "outputs_per_day": 3}),
            "problem.parameters.outputs_per_day is absent in the study, 3 asked",
        ),
        (changed(parameters={"mu": 0.4}), "problem.parameters.mu is 0.2 in the study, 0.4 asked"),
        (
            HEAD | {"variables": ["x", "m", "hollow", "metal"]},
            'variables.1 is "n" in the study, "m"',
        ),
        (HEAD | {"kinds": ["real"] * 4}, 'kinds.3 is "choice" in the study, "real" asked'),
    ],
)
def test_another_model_is_refused(study, head, said):
    study.append(block(1, 2))
    before = contents(Path(study.path).parent)
    refused(
        f"belongs to another model: .*{said}.*. Give the name of another file",
        begun,
        study.path,
        head,
        error=StudyMismatchError,
    )
    assert contents(Path(study.path).parent) == before


# Adding


def test_what_is_stored_is_not_written_again(study):
    study.append(block(1, 4, failed=[2]), origin="LP-tau")
    folder = Path(study.path).parent
    before = contents(folder), os.stat(study.path).st_mtime_ns
    assert study.append(block(1, 4, failed=[2])) == 0
    assert study.append(rows(block(1, 4, failed=[2]), [3, 1, 0, 2])) == 0
    begun(study.path)
    read(study.path)
    assert before == (contents(folder), os.stat(study.path).st_mtime_ns)


def test_no_other_test_can_be_changed(study):
    study.append(block(1, 4, failed=[2]))
    refused(
        "got other values for test point 1 of run 1; use another file if the model has chang",
        study.append,
        block(1, 6, seed=1),
        error=ArgumentValueError,
    )
    assert bits(read(study.path)[1]) == bits(block(1, 4, failed=[2]))


def test_tests_of_one_block_are_stored_as_those_of_many(tmp_path):
    """A design that fails at the second point is solved at the fifth."""
    parts = block(1, 3, failed=[2]), block(1, 3) | {"test_point": np.arange(4, 7)}
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    whole, single = begun(tmp_path / "whole.db"), begun(tmp_path / "single.db")
    assert whole.append(columns) == 3
    assert sum(single.append(rows(columns, [i])) for i in range(6)) == 4  # one of them twice
    assert bits(whole.contents()[1]) == bits(single.contents()[1])
    assert (whole.contents()[1]["status"] == "ok").all()


# A value that can go anywhere


@pytest.mark.parametrize("error", [KeyError, TypeError, ValueError, FileNotFoundError])
def test_errors_of_the_caller_are_no_damage(study, error):
    """Nobody is told to move a sound study away."""
    with pytest.raises(error) as caught, study.changes():
        raise error("of the caller")
    assert type(caught.value) is error


def test_an_interrupted_reading_lets_others_write(study):
    def press(_):
        raise KeyboardInterrupt

    def read():
        with study.reading() as database:
            return [press(row) for row in database.db.execute("SELECT * FROM meta")]

    try:
        read()
    except KeyboardInterrupt:
        with study.changes() as database:
            database.log("me")


def test_a_study_is_a_name(study, monkeypatch):
    study.append(block(1, 2))
    with study.writing():
        for number, other in enumerate((copy.deepcopy(study), pickle.loads(pickle.dumps(study)))):
            assert other.append(block(3 + number, 1)) == 1
    monkeypatch.chdir(Path(study.path).parent)
    relative = Study(Path(study.path).name)
    monkeypatch.chdir("/")
    assert relative.path == study.path
    assert bits(of_one_run(relative.contents()[1])) == bits(block(1, 4))


# Outputs, which tests bring


def test_an_output_more_makes_no_other_test(study):
    def hot(*heat):
        return block(1, len(heat)) | {"heat": np.array(heat)}

    study.append(hot(1.0, 2.0, np.nan))
    assert study.append(block(1, 3)) == 0
    # nor does a value that only one of both knows make another test
    assert study.append(hot(1.0, np.nan, np.nan)) == 0
    # but a value that the stored test lacks is added to it
    assert study.append(hot(1.0, 2.0, 3.0)) == 1
    assert bits(read(study.path)[1]) == bits(hot(1.0, 2.0, 3.0))
    refused(
        "other values for test point 2", study.append, hot(1.0, 2.5, 3.0), error=ArgumentValueError
    )
