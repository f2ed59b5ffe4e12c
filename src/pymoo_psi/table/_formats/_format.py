"""What a file format is, the open file that one reads, and the format of studies."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np

from pymoo_psi._output import is_marked, whole_file
from pymoo_psi._validation import Entries, FilePath, Head
from pymoo_psi.table._cells import Cells, UnfitError
from pymoo_psi.table._formulation import limits_of
from pymoo_psi.table._head import StoredTests, columns_of, head_of, marked, stored_tests
from pymoo_psi.table._layout import POINT, RUN, has_runs

_START = 1024  # bytes by which a format is recognized


@dataclass
class SourceFile:
    """A file to be read, once and from its beginning, since it may be a pipe.

    Attributes:
        path: The name of the file.
        stream: The open file.
        encoding: The encoding of a text, if the user gave one.
        skip_rows: Numbers of lines to be left out, from 1.
        sheet: The sheet of a workbook, if the user named one.
    """

    path: Path
    stream: IO[bytes]
    encoding: str | None = None
    skip_rows: Collection[int] = ()
    sheet: str | None = None

    @cached_property
    def start(self) -> bytes:
        """The first bytes."""
        return self.stream.read(_START)

    @cached_property
    def content(self) -> bytes:
        """All bytes."""
        return self.start + self.stream.read()

    @cached_property
    def text(self) -> str:
        """The text, decoded by the encoding given, else by a byte-order mark, else as UTF-8.

        Raises:
            ArgumentValueError: The bytes are no such text, or there is no such encoding.
        """
        encoding = self.encoding
        if not encoding:
            wide = self.start.startswith((b"\xff\xfe", b"\xfe\xff"))
            encoding = "utf-16" if wide else "utf-8-sig"
        try:
            text = self.content.decode(encoding)
        except (UnicodeError, LookupError) as error:  # or there is no such encoding
            # Any bytes are text in cp1252, right or wrong; so it is not guessed.
            raise UnfitError(
                f"it is no text: {error}",
                "give its encoding, often encoding='cp1252' on Windows, or save it as UTF-8",
            ) from None
        # UTF-16 without a mark is valid UTF-8 where it has ASCII only: every second byte is NUL.
        if "\0" in text:
            raise UnfitError(
                "it is no text, as it holds null characters",
                "give its encoding, such as encoding='utf-16-le'",
            )
        return text.removeprefix("\ufeff")  # utf-16-le leaves the mark in the text


class FileFormat(ABC):
    """A format of files that hold designs or tests; each format is a subclass.

    Attributes:
        suffix: The suffix of such files, in lower case.
        writes: What can be written in this format: ``"tests"``, tables of tests as of
            ``pymoo-psi export``; ``"designs"``, designs with their ranking as of ``pymoo-psi
            rank``; both or nothing.
    """

    suffix: str
    writes: Collection[str] = ()

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether a file is of this format; by its suffix unless a subclass knows better.

        A subclass that can tell from the content also reads pipes, which have no suffix.
        """
        return file.path.suffix.lower() == self.suffix

    @abstractmethod
    def read(self, file: SourceFile) -> tuple[Cells, Head] | StoredTests:
        """Return the content of a file.

        Args:
            file: The open file. Its attributes are ``path``; ``start``, the first 1024 bytes;
                ``content``, all bytes; ``text``; and the options ``skip_rows`` and ``sheet``.

        Returns:
            A data frame, or the lists of cells by the names of columns, and the ``head`` that
            :meth:`write` received, with which a table of tests comes back; empty if there is none.

        Raises:
            UnfitError: The file holds no table.
        """

    def write(self, path: Path, columns: Entries, head: Head) -> None:
        """Write a new file; a format needs this method if it writes anything.

        Args:
            path: The file.
            columns: ``(n,)`` arrays, or series of pandas, by name. None and NaN are blank.
            head: What the columns are, as values that JSON can hold; may be empty.
        """
        raise NotImplementedError(f"{self.suffix} files are not written")

    def save(self, path: FilePath, columns: Entries, head: Head | None = None) -> None:
        """Write columns as :meth:`write` does, whole or not at all.

        Raises:
            OSError: The file cannot be written.
            PsiError: A package that writes such files is not installed.
        """
        with whole_file(path) as new:
            self.write(new, columns, head or {})

    def save_tests(self, path: FilePath, table: Any) -> None:
        """Write a :class:`TestTable`, whole or not at all, so that it is read back unchanged.

        Raises:
            OSError: The file cannot be written.
            PsiError: A package that writes such files is not installed.
        """
        self.save(path, table._shown_columns(), marked(table))

    def is_ours(self, path: Path) -> bool:
        """Say whether pymoo-psi wrote a file, so that a new result may replace it."""
        return is_marked(path)


class StudyFile(FileFormat):
    """A study as runs write it; see :mod:`pymoo_psi.study`."""

    suffix = ".db"
    writes = ("tests",)

    def recognizes(self, file: SourceFile) -> bool:
        """Say whether a file is a database of SQLite."""
        return file.start.startswith(b"SQLite format 3\0")

    def read(self, file: SourceFile) -> StoredTests:
        """Return the tests of a study; SQLite opens it by name, so it cannot be a pipe."""
        from pymoo_psi.study import Study

        return stored_tests(*Study(file.path).contents())

    def save_tests(self, path: FilePath, table: Any) -> None:
        """Write a table as a new study, whole or not at all; extra columns are left out.

        Tests are written as they were before any limits, so that a run can continue the study.

        Raises:
            StudyAccessError: The file exists already, or cannot be written.
        """
        from pymoo_psi.study import write_study

        layout = replace(table.layout, label=None)
        plain = table.under(limits={}, chosen=None, positions=(), decided=None)
        tests = plain._with(layout=layout, extra={})
        head = head_of(tests)
        limits = {}
        for name, limit in limits_of(table.formulation.limits).items():
            if name in table.layout.columns:
                limits[name] = limit
        if limits:
            head["limits"] = limits
        columns = columns_of(tests)
        if has_runs(table.extra):
            columns["test"] = table.numbers
            for name in (RUN, POINT):
                columns[name] = table.extra[name].astype(np.int64)
        write_study(path, head, columns)

    def is_ours(self, path: Path) -> bool:
        """Return True: :meth:`save_tests` refuses every file that is there, and says so."""
        return True


def tests_of_folder(path: Path) -> StoredTests:
    """Return the tests of all studies in a folder; a remark says which test points are missing.

    Raises:
        StudyMismatchError: The studies belong to different problems.
        StudyError: One of them is damaged, or there is none.
    """
    from pymoo_psi.study import read_folder

    facts, columns, missing = read_folder(path)
    tests = stored_tests(facts, columns)
    if missing:
        return tests._replace(remarks=(f"{missing}.", *tests.remarks))
    return tests
