"""What a file format is, and the open file that one reads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, TYPE_CHECKING

from pymoo_psi._names import argument
from pymoo_psi._output import is_marked, whole_file
from pymoo_psi._validation import Entries, FilePath, Head, invalid
from pymoo_psi.files._cells import Cells, UnfitError
from pymoo_psi.table import TestTable, columns_of, marked

if TYPE_CHECKING:
    import pandas as pd

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
            ArgumentValueError: The bytes are no such text, there is no such encoding, or a sheet
                is named.
        """
        if self.sheet is not None:
            raise invalid("sheet", "left out for a text, which has no sheets", self.sheet)
        encoding = self.encoding
        if not encoding:
            wide = self.start.startswith((b"\xff\xfe", b"\xfe\xff"))
            encoding = "utf-16" if wide else "utf-8-sig"
        try:
            text = self.content.decode(encoding)
            if "\0" in text:
                raise UnicodeError("it holds zero bytes, as UTF-16 does")
        except (UnicodeError, LookupError) as error:  # or there is no such encoding
            # Any bytes are text in cp1252, right or wrong; so it is not guessed.
            raise UnfitError(
                f"it is no text: {error}",
                f"give its encoding, often {argument('encoding', 'cp1252')} on Windows, or save it "
                "as UTF-8",
            ) from None
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
    def read(self, file: SourceFile) -> tuple[Cells | Entries | pd.DataFrame, Head] | TestTable:
        """Return the content of a file.

        Args:
            file: The open file. Its attributes are ``path``; ``start``, the first 1024 bytes;
                ``content``, all bytes; ``text``; and the options ``skip_rows`` and ``sheet``.

        Returns:
            A data frame, or the lists of cells by the names of columns, and the ``head`` that
            :meth:`write` received, with which a table of tests comes back; empty if there is none.
            Or the table itself.

        Raises:
            UnfitError: The file holds no table.
        """

    def require_packages(self) -> None:  # noqa: B027
        """Refuse to write, before any work is done, if a package is missing that this takes."""

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

    def save_tests(self, path: FilePath, table: TestTable) -> None:
        """Write a table, whole or not at all, so that it is read back unchanged.

        Raises:
            OSError: The file cannot be written.
            PsiError: A package that writes such files is not installed.
        """
        self.save(path, table.display_columns() | columns_of(table), marked(table))

    def is_ours(self, path: Path) -> bool:
        """Say whether pymoo-psi wrote a file, so that a new result may replace it."""
        return is_marked(path)
