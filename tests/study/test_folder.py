"""A folder of studies, the shares of one investigation: dealt out, read as one, told what lacks."""

import shutil

import numpy as np
import pytest

from pymoo_psi.errors import StudyAccessError, StudyCorruptError, StudyMismatchError
from pymoo_psi.sequences import lp_tau
from pymoo_psi.study import Share, read_folder, write_study
from tests.helpers.refusals import refused
from tests.helpers.studies import HEAD, begun, bits, block, of_one_run, read, rows


@pytest.mark.parametrize(("first", "last"), [(1, 1000), (7, 70), (64, 64)])
@pytest.mark.parametrize("of", [1, 2, 3, 7, 64])
def test_every_point_is_of_one_share(of, first, last):
    numbers = [share.numbers(first, last) for share in (Share(k, of) for k in range(1, of + 1))]
    assert sorted(np.concatenate(numbers)) == list(range(first, last + 1))
    assert all((np.diff(own) > 0).all() for own in numbers)


@pytest.mark.parametrize("of", [2, 16, 63, 64])
def test_every_share_is_spread_over_the_box(of):
    """Every 64th point of LPτ has the same six leading digits in the first coordinate."""
    points = lp_tau(of * 64, 2)
    for k in range(1, of + 1):
        share = points[Share(k, of).numbers(1, of * 64) - 1]
        assert (np.ptp(share, axis=0) > 0.9).all()
        assert all(len({*np.floor(column * 8)}) >= 7 for column in share.T)


def shares(folder, of, last, parts=None, head=HEAD):
    """Write the shares of a run, those of its parts that are wanted."""
    whole = block(1, last, failed=[2])
    for k in parts or range(1, of + 1):
        share = Share(k, of)
        study = begun(folder / share.file, head, share)
        study.append(rows(whole, share.numbers(1, last) - 1))
    return whole


def test_points_that_are_missing_are_told(tmp_path):
    shares(tmp_path, 4, 20, [1, 3])
    _, columns, missing = read_folder(tmp_path)
    assert len(columns["x"]) == 10
    assert missing == "Missing between test points 1 and 20: 5 of share 2 of 4, 5 of share 4 of 4"
    shares(tmp_path, 4, 40, [1, 2, 3, 4])  # a longer run extends them
    assert read_folder(tmp_path)[2] == ""


def test_a_point_of_two_files_counts_once(tmp_path):
    whole = shares(tmp_path, 2, 10)
    begun(tmp_path / "other.db").append(block(1, 10, failed=[2]))
    assert bits(of_one_run(read_folder(tmp_path)[1])) == bits(whole)
    begun(tmp_path / "third.db").append(rows(block(1, 10, seed=1), [3]))
    refused(
        r"db and one .* different results for the same .* 4",
        read_folder,
        tmp_path,
        error=StudyMismatchError,
    )


def test_an_output_that_a_share_lacks_is_unknown(tmp_path):
    whole = shares(tmp_path, 3, 12, [1, 2])
    numbers = Share(3, 3).numbers(1, 12)
    share = begun(tmp_path / Share(3, 3).file, share=Share(3, 3))
    heat = np.where(np.isin(whole["test_point"], numbers), whole["x"], np.nan)
    share.append(rows(whole | {"heat": heat}, numbers - 1))
    # another file holds some of these points without the output: they are the same tests
    begun(tmp_path / "z.db").append(rows(whole, numbers[:2] - 1))
    assert bits(of_one_run(read_folder(tmp_path)[1])) == bits(whole | {"heat": heat})


OTHER = HEAD | {"upper": [2.0, 5.0, np.nan, np.nan]}


@pytest.mark.parametrize(
    ("of", "head", "message"),
    [
        (2, OTHER, r"share-1-of-2.db is a share of other points"),
        (3, HEAD, "share-1-of-2.db is a share of .* another number of shares"),
    ],
)
def test_a_share_of_another_problem_is_refused(tmp_path, of, head, message):
    shares(tmp_path, 2, 10, [1])
    refused(message, shares, tmp_path, of, 10, [2], head, error=StudyMismatchError)


def test_a_share_of_another_problem_is_no_part_of_a_folder(tmp_path, tmp_path_factory):
    other = tmp_path_factory.mktemp("other")
    shares(tmp_path, 2, 10, [1])
    shares(other, 2, 10, [2], OTHER)
    shutil.copy(other / "share-2-of-2.db", tmp_path)
    refused(
        r"share-2-of-2.db is a share of other points.*1-of-2.db",
        read_folder,
        tmp_path,
        error=StudyMismatchError,
    )


@pytest.mark.parametrize("content", [b"", b"no study", b"SQLite format 3\0 and nothing else"])
def test_a_damaged_file_of_a_folder_is_named(tmp_path, content):
    (tmp_path / "notes.txt").write_bytes(b"these are none")
    refused("holds no study", read_folder, tmp_path, error=StudyAccessError)
    shares(tmp_path, 3, 12, [1, 3])
    assert len(read_folder(tmp_path)[1]["x"]) == 8
    (tmp_path / "share-2-of-3.db").write_bytes(content)
    refused(
        r"share-2-of-3.db .*move (it|this one) away", read_folder, tmp_path, error=StudyCorruptError
    )


def test_a_study_is_never_written_over_another(study_file):
    write_study(study_file, HEAD, block(1, 10))
    assert bits(read(study_file)[1]) == bits(block(1, 10))
    assert begun(study_file).append(block(9, 4)) == 2
    refused(
        "exists already and was left as it is",
        write_study,
        study_file,
        HEAD,
        block(1, 3),
        error=StudyAccessError,
    )
    assert bits(read(study_file)[1]) == bits(block(1, 12))
