"""Files that are written whole or not at all, under their own name and mode."""

import os
import stat

import pytest

from pymoo_psi._files import whole_file
from tests.processes import posix


def write(path, text="new"):
    with whole_file(path) as written:
        written.write_text(text)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    file = tmp_path / "front.csv"
    write(file, "old")

    def fail():
        with whole_file(file) as written:
            written.write_text("half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        fail()
    assert file.read_text() == "old"
    assert os.listdir(tmp_path) == ["front.csv"]


def test_an_error_is_about_the_file_that_was_asked_for(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"absent.front\.csv'$"):
        write(tmp_path / "absent" / "front.csv")


@posix
@pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
def test_a_file_that_is_replaced_keeps_its_mode(tmp_path, mode):
    file = tmp_path / "front.csv"
    file.write_text("old")
    file.chmod(mode)
    write(file)
    assert (file.read_text(), stat.S_IMODE(file.stat().st_mode)) == ("new", mode)


@posix
def test_a_link_is_followed(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link.csv").symlink_to(tmp_path / "there" / "front.csv")
    write(tmp_path / "link.csv")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "there" / "front.csv").read_text() == "new"


@posix
def test_what_is_no_file_is_written_to_and_not_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write(pipe)
    assert os.read(reader, 10) == b"new"
    os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert os.listdir(tmp_path) == ["pipe"]


@posix
def test_the_longest_name_can_be_written(tmp_path):
    write(tmp_path / ("n" * 255))
    assert os.listdir(tmp_path) == ["n" * 255]
