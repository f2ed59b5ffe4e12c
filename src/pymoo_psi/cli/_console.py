"""What the commands print and write: sentences, tables, the ranking, files.

The ranking of a table is a head, the designs by place, and a few sentences. The objectives have one
number format each; the best and the worst values by which they are ranked are the last rows. Texts
are cut to the width of the terminal, never numbers; objectives for which there is no room are
counted.
"""

from __future__ import annotations

import csv
import math
import os
import re
import shlex
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import product
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any
from unicodedata import combining, east_asian_width

import numpy as np

from pymoo_psi._numbers import NumberFormat, number
from pymoo_psi._output import is_marked
from pymoo_psi._validation import AnyArray, Names, Rows, counted, invalid, known_name
from pymoo_psi.analysis import confidence_sentences
from pymoo_psi.cli._app import Options, printable
from pymoo_psi.files import FORMATS, designs_head, format_of
from pymoo_psi.guide import guides, site_page
from pymoo_psi.pareto import (
    Caution,
    EfficiencyRanking,
    Explanation,
    enough_digits,
    explain,
    wrapped,
)
from pymoo_psi.table import ROW, TEST, TestTable, metadata_path, texts_of

if TYPE_CHECKING:
    import pandas as pd

_WIDTH_OF_PIPE = 80
_MOST_ROWS = 10
_HEADING_WIDTHS = (80, 24, 16, 12)  # the first of these at which a table fits
_LEAST_LABEL = 16
_GAP = "  "
_BESIDE_PLACES = " " * len("place") + _GAP
_MOST_NAMED = 6  # values of the proposed test
_FORMATS = {file_format.suffix: file_format for file_format in FORMATS}
_NUMBER = re.compile(r"[-−+]?\.?\d")
_PLAIN_WORD = re.compile(rf"[\w@%+:,./{re.escape(os.sep)}-]+")


def width() -> int | None:
    """Return the number of columns of the terminal or in COLUMNS; None for a pipe or a file."""
    if sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdigit():
        return shutil.get_terminal_size().columns
    return None


def text_width() -> int:
    """Return the width for tables and paragraphs."""
    return width() or _WIDTH_OF_PIPE


def say(*lines: object) -> None:
    """Print lines, wrapped if there is a width."""
    columns = width()
    for line in lines:
        text = str(line)
        if columns is not None:
            text = wrapped([text], columns)
        print_text(text)


def print_text(text: str) -> None:
    """Print a text as it is."""
    with suppress(BrokenPipeError):  # of a reader such as "head"
        # Flushed, as errors of the stream would otherwise appear only when Python ends.
        print(printable(text), flush=True)


def print_columns(
    named: Iterable[tuple[Any, Iterable[Any]]], title: str, n_keys: int = 1, mark: str = "."
) -> None:
    """Print columns with numbers in 4 digits and blanks for missing values.

    Texts are cut to half of the width. The columns of a table that is too wide continue below.

    Args:
        named: The heading of each column and its values.
        title: What is above them.
        n_keys: How many columns name a row; they are repeated where the table continues.
        mark: The decimal mark.
    """
    columns = []
    for name, values in named:
        texts = [_cell(value, mark) for value in (name, *values)]
        is_text = not any(map(_NUMBER.match, texts[1:]))
        columns.append(_aligned(texts, left=is_text))
    if not columns[0][1:]:
        say(f"{title}: none")
        return
    say(title)
    keys = columns[:n_keys]
    parts = [keys]
    for column in columns[n_keys:]:
        wider = [*parts[-1], column]
        if len(wider) > n_keys + 1 and _columns(_rows(wider)[0]) > text_width():
            parts.append([*keys, column])
        else:
            parts[-1] = wider
    print_text("\n\n".join("\n".join(map(str.rstrip, _rows(part))) for part in parts))


def _rows(columns: list[list[str]]) -> list[str]:
    """Return the lines of a table from its columns, whose texts have the same width."""
    return [_GAP.join(row) for row in zip(*columns, strict=True)]


def _cell(value: Any, mark: str) -> str:
    if not isinstance(value, float):
        return shortened(_one_line(value), (text_width() - len(_GAP)) // 2)
    if math.isnan(value):
        return ""
    return number(value, mark=mark)


def cells_of(values: AnyArray, number_format: NumberFormat | None) -> list[str]:
    """Return the cells of a column: numbers in their format, or texts if there is none."""
    if number_format is None:
        return [*texts_of(values)]
    return list(map(number_format.text, values.tolist()))


# The ranking


def say_ranking(
    table: TestTable,
    cautions: Sequence[Caution],
    head: Names,
    notes: Names,
    following: Names,
    *,
    all_by: str,
    out: Path | None,
) -> None:
    """Print the ranking of a table.

    Args:
        table: The tests.
        cautions: The cautions, of which the most serious one is printed.
        head: Lines before the designs.
        notes: Lines after the proposal and the caution, before the next command.
        following: The next command: its first words, and its options.
        all_by: The option or command that shows all cautions.
        out: The file that has the designs which are not shown, if any.
    """
    sentences = proposal(table, cautions)
    if cautions:
        text = f"Caution: {cautions[0]}"
        if len(cautions) > 1:
            text += f" ({all_by} shows {len(cautions) - 1} more.)"
        sentences.append(text)
    print_text(wrapped(head, text_width()) + "\n")
    print_text("\n".join(_table(table, out)) + "\n")
    print_text(wrapped([*sentences, *notes], text_width()))
    say_next(following)


# The table


def _table(table: TestTable, out: Path | None) -> list[str]:
    """Return the lines of the table, with the counts of designs and objectives that are left out.

    Args:
        table: The tests.
        out: The file that has the other designs, if any.
    """
    ranking = table.feasible_ranking()
    optimal = ranking.by_place[: ranking.pareto.sum()]
    columns = _fitting(table, optimal[:_MOST_ROWS])
    headings, units, *designs, best, worst = map(str.rstrip, _rows(columns))
    lines = [headings, *filter(None, [units]), *designs]
    n_hidden = len(optimal) - len(designs)
    if n_hidden:
        where = "" if out else ": --out FILE.csv"
        lines.append(f"{_BESIDE_PLACES}… {n_hidden} more{where}")
    lines += [best, worst]
    n_folded = len(table.schema.objectives) - len(columns[2:])
    if n_folded:
        lines.append(f"{_BESIDE_PLACES}… {counted(n_folded, 'more objective')}: --long")
    return lines


def _fitting(table: TestTable, rows: Rows) -> list[list[str]]:
    """Return the columns of the table: places, names, and the objectives that fit, one or more.

    Each has a heading, a unit, the designs, and the best and the worst values.

    Args:
        table: The tests.
        rows: The rows of the designs in the ranking.
    """
    ranking = table.feasible_ranking()
    places = ["place", "", *map(str, ranking.place[rows]), "", ""]
    word, *names = map(_one_line, name_column(table, rows))
    names = [word, "", *names, "best", "worst"]
    least = min(max(map(_columns, names)), _LEAST_LABEL)
    objectives = _objective_columns(ranking, rows)
    for n_shown, most in product(range(len(objectives), 0, -1), _HEADING_WIDTHS):
        cells = []
        room = text_width() - len(_BESIDE_PLACES)
        for name, arrow, texts in objectives[:n_shown]:
            cells.append(_aligned([f"{shortened(name, most)} {arrow}", *texts]))
            room -= len(_GAP) + _columns(cells[-1][0])
        if room >= least:
            break
    names = [shortened(name, max(room, least)) for name in names]
    return [_aligned(places), _aligned(names, left=True), *cells]


def name_column(table: TestTable, rows: Rows) -> list[str]:
    """Return what designs are called, and the labels of some rows of the ranking."""
    labels = table.feasible_ranking().objectives.labels
    word = table.schema.label or TEST
    names = [str(labels[row]) for row in rows]
    title = word.replace("_", " ")
    start = f"{title} "
    # Numbers are called "id 7"; other columns of labels may have names such as "Model S".
    if word in (TEST, ROW) or not any(str(text).startswith(start) for text in table.column(word)):
        names = [name.removeprefix(start) for name in names]
    return [title, *names]


def _objective_columns(ranking: EfficiencyRanking, rows: Rows) -> list[tuple[str, str, list[str]]]:
    """Return name and direction of each objective, its unit and its numbers, best and worst last.

    Args:
        ranking: The ranking.
        rows: The rows of the designs that are shown.
    """
    objectives = ranking.objectives
    values = np.vstack([objectives.values[rows], ranking.ideal, ranking.nadir])
    columns = []
    for j, (name, number_format) in enumerate(_formats(ranking).items()):
        arrow = "↑" if objectives.sign[j] < 0 else "↓"
        unit = _one_line(objectives.units.get(name, ""))
        columns.append((_one_line(name), arrow, [unit, *map(number_format.text, values[:, j])]))
    return columns


def _formats(ranking: EfficiencyRanking) -> dict[Any, NumberFormat]:
    """Return by name how the objectives are written."""
    front = ranking.objectives.minimized[ranking.pareto]
    written = np.vstack([front, ranking.frame.ideal, ranking.frame.nadir])
    formats = []
    for values, near in zip(written.T, front.T, strict=True):
        formats.append(NumberFormat.of(values, near, ranking.objectives.decimal))
    formats = enough_digits(front, formats)
    return dict(zip(ranking.objectives.names, formats, strict=True))


def _one_line(name: object) -> str:
    return re.sub(r"[^\S\u00a0]+", " ", str(name)).strip()  # numbers keep their blanks


def _columns(text: str) -> int:
    """Return how many columns of a terminal a text takes."""
    if text.isascii():
        return len(text)
    wide = sum(east_asian_width(letter) in "WF" for letter in text)
    return len(text) + wide - sum(combining(letter) > 0 for letter in text)


def _aligned(texts: list[str], *, left: bool = False) -> list[str]:
    """Return texts of the same width, aligned to the right or to the left."""
    widest = max(map(_columns, texts))
    aligned = []
    for text in texts:
        blanks = " " * (widest - _columns(text))
        aligned.append(text + blanks if left else blanks + text)
    return aligned


def shortened(text: str, most: int) -> str:
    """Return a text without its middle if it is too wide: names that begin alike end unlike."""
    kept = text
    n_kept = len(text)
    while _columns(kept) > most:
        n_kept -= 1
        half = n_kept // 2
        kept = f"{text[: n_kept - half]}…{text[len(text) - half :]}"
    return kept


# The sentences


def proposal(table: TestTable, cautions: Sequence[Caution]) -> list[str]:
    """Return what is proposed, what it costs and, of repeated tests, how sure it is."""
    ranking = table.feasible_ranking()
    why = explain(ranking)
    sentences = [_with_values(why, table)]
    if why.ties and "tie" not in [caution.kind for caution in cautions[:1]]:  # which says so
        sentences[0] += f" {why.ties}"
    if ranking.pareto.sum() > 1:
        sentences.append(why.costs)
    return [*sentences, *confidence_sentences(table, why.row)]


def _with_values(why: Explanation, table: TestTable) -> str:
    """Return what is proposed; a test, whose name says nothing, with its values."""
    schema = table.schema
    if schema.label not in (None, ROW):
        return why.standing
    groups = [_values(why, table, names) for names in (schema.objectives, schema.variables)]
    name = why.ranking.name_of(why.row)
    return why.standing_of(f"{name} ({'; '.join(filter(None, groups))})")


def _values(why: Explanation, table: TestTable, names: Names) -> str:
    """Return the values of the proposed design in some columns, or in the first of many."""
    ranking = why.ranking
    formats = _formats(ranking)
    texts = []
    for name in names[:_MOST_NAMED]:
        cells = table.column(name)[ranking.rows]
        text: Callable[[Any], str] = str
        if cells.dtype.kind in "fi":
            own = NumberFormat.of(cells[ranking.pareto], mark=table.decimal)
            text = formats.get(name, own).text
        texts.append(f"{name} {text(cells[why.row])} {table.schema.units.get(name, '')}".strip())
    if len(names) > _MOST_NAMED:
        texts.append("…")
    return ", ".join(texts)


# The next command


def command(*words: str) -> list[str]:
    """Return a command with its argument, and each option with its value, as shells read them."""
    texts: list[str] = []
    for word in words:
        if word.startswith("--") or not texts:
            texts.append(_quoted(word))
        else:
            texts[-1] += f" {_quoted(word)}"
    return texts


def _quoted(word: str) -> str:
    """Return a word as a shell reads it."""
    if _PLAIN_WORD.fullmatch(word):
        return word
    if re.search(r'["$`\\!]', word) and sys.platform != "win32":
        return shlex.quote(word)
    return f'"{word}"'


def say_next(following: Names) -> None:
    """Print the next command: its first words, and its options."""
    print_text("\n".join(continued([f"Next: {following[0]}", *following[1:]], text_width())))


def continued(parts: Names, columns: int = _WIDTH_OF_PIPE) -> list[str]:
    """Return a command in one line if it fits into a width, else in lines that a shell joins.

    Args:
        parts: The command with its argument, and each option with its value.
        columns: The width.
    """
    whole = " ".join(parts)
    if _columns(whole) <= columns or sys.platform == "win32":
        return [whole]
    return " \\\n    ".join(parts).splitlines()


# Files


def require_output(path: Path, suffixes: Names, *inputs: Path | None) -> Path:
    """Refuse an output file that cannot or must not be written, before the work is done.

    Args:
        path: The file to write. An existing file must be a result of pymoo-psi.
        suffixes: Suffixes of the formats that can be written.
        inputs: Files that are read.

    Returns:
        The absolute path, which stays right if a model changes the working directory.

    Raises:
        ArgumentValueError: The file has another suffix, is an input, or is no result of pymoo-psi.
        PsiError: A package is missing that writes such files.
        OSError: Its folder does not exist or cannot be written to.
    """
    for source in inputs:
        # Resolved, as a link to an input is the input.
        if source is not None and source.resolve() == path.resolve():
            raise invalid("--out", "another file than the one that is read", str(path))
    if path.suffix.lower() not in suffixes or path.is_dir():
        raise invalid("--out", f"a file with the suffix {' or '.join(suffixes)}", str(path))
    file_format = _FORMATS.get(path.suffix.lower())
    if file_format is not None:
        file_format.require_packages()
    if path.exists() and not path.is_file():
        return path.absolute()  # /dev/null, a pipe: written to, not replaced
    for file in (path, metadata_path(path)):  # a CSV is written with its metadata
        if file.exists() and not _is_ours(file):
            rule = "a new file, or one that pymoo-psi has written"
            remedy = "choose another name, or remove the file first"
            raise invalid("--out", rule, str(path.with_name(file.name)), remedy)
    return _writable(path.absolute().parent) / path.name


def _is_ours(path: Path) -> bool:
    """Return whether a file is empty or a result of pymoo-psi, which a new one may replace."""
    if path.stat().st_size == 0:  # as made by mktemp
        return True
    file_format = _FORMATS.get(path.suffix.lower())
    if file_format is None:  # HTML
        return is_marked(path)
    return file_format.is_ours(path)


def results_folder(out: Path) -> Path:
    """Make a folder for results and return its absolute path.

    Raises:
        ArgumentValueError: It is a file.
        OSError: The folder cannot be made or written to.
    """
    if out.is_file():
        raise invalid("--out", "a folder", str(out), "there is a file of this name")
    out.mkdir(parents=True, exist_ok=True)
    return _writable(out.absolute())


def _writable(folder: Path) -> Path:
    """Return a folder, in which it must be possible to make files."""
    try:
        with TemporaryFile(dir=folder):  # access rights do not tell of read-only file systems
            return folder
    except OSError as error:  # it names the temporary file, which the user has never seen
        problem = f"{error.strerror}; --out needs a folder that exists and can be written to"
        raise OSError(error.errno, problem, str(folder)) from None


def write_frame(frame: pd.DataFrame, path: Path, designs: TestTable | None = None) -> None:
    """Write a frame in the format of the suffix, whole or not at all, blanks for missing values.

    Args:
        frame: The rows. Texts are never written as formulas.
        path: The file.
        designs: The designs of the rows, if they are that. What their columns are is written with
            the rows.

    Raises:
        ArgumentValueError: The rows are no designs, and there is a file with other columns.
    """
    head = {}
    if designs is not None:
        head = designs_head(designs, [*frame])
    elif path.is_file() and _header(path) != list(map(str, frame)):
        rule = f"a folder without {path.name} of another program"
        raise invalid("--out", rule, str(path), "choose another folder, or remove the file first")
    blanked = frame.astype(object).where(frame.notna(), None)  # integer columns, too
    columns = {str(name): column for name, column in blanked.items()}
    format_of(path, "designs").save(path, columns, head)


def _header(path: Path) -> list[str]:
    """Return the cells in the first line of a CSV file; of another one anything else."""
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        return next(csv.reader(file), [])


def run_guide(options: Options) -> int:
    """Print a guide, or the names and titles of all of them, or open its page."""
    import webbrowser

    texts = guides()
    name = options.name
    if name != "index":
        known_name("NAME", name, texts)
    if options.open:
        page = site_page(name)
        print_text(f"Opening {page}")
        webbrowser.open(page.as_uri())
    elif name != "index":
        print_text(texts[name])
    else:
        for name, text in texts.items():
            title = text.partition("\n")[0].removeprefix("# ")
            print_text(f"{name:18}{title}")
        print_text("pymoo-psi guide NAME prints one of them.")
    return 0
