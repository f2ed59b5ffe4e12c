"""What a test table is outside Python, and its files: a head that JSON can hold, and columns.

    table_of(head_of(table), columns_of(table)) is the table.

The head says what the columns mean. A file or a database stores both and need not know more: the
columns are arrays of float64, int64, bool, or texts. A CSV has the head as JSON in a comment below
its rows, a workbook on its second sheet. Numbers are written with as many digits as it takes to
read the same number back, texts in quotation marks, so that ``#``, commas and line breaks in them
are text to every reader.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from io import StringIO
from os import PathLike
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._output import written_text
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table._designs import common_dtype
from pymoo_psi.table._layout import ORIGIN, Layout

Path: TypeAlias = str | PathLike[str]
Head: TypeAlias = dict[str, Any]
Columns: TypeAlias = dict[str, NDArray[Any]]
Table = TypeVar("Table")

MARK = "pymoo_psi_test_table"
DESIGNS = "pymoo_psi_designs"
MARKS = (MARK, DESIGNS)  # of a head: of tests, or of designs, whose columns are not all known
_FORMAT = 4  # of the head
_OPTIONAL = ("outputs", "maximize", "units", "label", "ranges")  # in a head only if there are any


def head_of(table: Any) -> Head:
    """Return what is not in the columns of a :class:`TestTable`, as values that JSON can hold.

    Returns:
        ``variables``, ``objectives``, ``inequalities``, ``equalities``: lists of names;
        ``kinds``: a word of :class:`Kind` for each variable, or nothing if the table has neither
        tests nor kinds; ``lower``, ``upper``: lists of numbers, NaN where there is no bound;
        ``eq_tolerance``; if there are any ``outputs``, ``maximize`` and ``extra``, lists of names,
        ``units``, texts by name, ``label`` and ``ranges``; ``chosen``, the name of a design and
        why; and ``problem``.
    """
    layout: Layout = table.layout
    # Of a table without tests the kinds are unknown: a later block may be of any kind.
    kinds = table.kinds if len(table) else layout.kinds
    head: Head = {f.name: getattr(layout, f.name) for f in fields(layout)}
    head |= {"lower": layout.lower.tolist(), "upper": layout.upper.tolist()}
    head["kinds"] = [kind.value for kind in kinds]
    optional = {name: head.pop(name) for name in _OPTIONAL}
    optional |= {"extra": [*table.extra], "chosen": table.chosen, "problem": table.problem}
    head |= {name: value for name, value in optional.items() if value}
    return {name: list(v) if isinstance(v, tuple) else v for name, v in head.items()}


def marked(table: Any) -> Head:
    """Return the head of a file of a table."""
    return {MARK: _FORMAT, "tests": len(table), **head_of(table)}


def columns_of(table: Any) -> Columns:
    """Return the columns that make a :class:`TestTable`, n cells each, in the order of its tests.

    Returns:
        ``test_point`` (int64); the variables, objectives, constraints and outputs under their
        names, objectives in the original direction; ``status`` and ``reason`` (texts, empty where
        there is none). A choice and an extra column are texts, see :func:`choice_texts`; other
        variables have the dtype of their kind.
    """
    layout: Layout = table.layout
    columns: Columns = {"test_point": table.numbers}
    for name, column, kind in zip(layout.variables, table.X.T, table.kinds, strict=True):
        texts = kind is Kind.CHOICE
        columns[name] = choice_texts(column.tolist()) if texts else column.astype(DTYPES[kind])
    # Turning a sign twice gives every float64 back, zeros and NaN too.
    columns |= zip(layout.objectives, (table.F * layout.sign).T, strict=True)
    columns |= zip(layout.constraints, np.hstack([table.G, table.H]).T, strict=True)
    columns |= zip(layout.outputs, table.outputs.T, strict=True)
    columns |= {name: choice_texts(cells.tolist()) for name, cells in table.extra.items()}
    # Looked up only if there are any: else it is a pass in Python over all tests for nothing.
    reasons = np.full(len(table), "", dtype=object)
    if table.reasons:
        reasons[:] = [table.reasons.get(number, "") for number in table.numbers.tolist()]
    return columns | {"status": table.status.astype(object), "reason": reasons}


def blocks_of(layout: Layout, columns: Mapping[str, Any], n: int) -> dict[str, NDArray[Any]]:
    """Return the arrays F, G, H and outputs of a table of n rows, by its columns."""
    blocks = {
        block: np.column_stack([np.zeros((n, 0)), *(columns[name] for name in names)])
        for block, names in layout.blocks.items()
        if block != "X"
    }
    blocks["F"] *= layout.sign
    return blocks


@contextmanager
def described(where: object) -> Iterator[None]:
    """Name the source in the errors of what is no table; readers have errors of many kinds."""
    try:
        yield
    except Exception as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        rule = "a table of tests, of to_csv or 'pymoo-psi export'"
        raise ArgumentValueError(f"{where} must be {rule}: {what}") from None


def _layout_of(head: Mapping[str, Any]) -> Layout:
    return Layout(**{f.name: head[f.name] for f in fields(Layout) if f.name in head})


def kinds_of_columns(layout: Layout, extra: Iterable[str] = ()) -> dict[str, Kind]:
    """Return the kind of every column that :func:`table_of` needs; texts are those of a choice."""
    real = layout.objectives + layout.constraints + layout.outputs
    return {
        "test_point": Kind.INTEGER,
        **dict(zip(layout.variables, _kinds(layout), strict=True)),
        **dict.fromkeys(real, Kind.REAL),
        **dict.fromkeys((*extra, "status", "reason"), Kind.CHOICE),
    }


def table_of(
    head: Mapping[str, Any], columns: Mapping[str, Any], where: object, make: Callable[..., Table]
) -> Table:
    """Return the table of a head and the columns of :func:`columns_of`.

    Args:
        head: As :func:`head_of` returns it.
        columns: In any order; further ones are not read.
        where: What they come from, such as the path of a file, for messages.
        make: The class :class:`TestTable`, which stands above this module.

    Raises:
        ArgumentValueError: They are those of no table; the message says where.
    """
    with described(where):
        layout, extra = _layout_of(head), head.get("extra", ())
        if missing := [name for name in kinds_of_columns(layout, extra) if name not in columns]:
            raise ValueError(f"the columns {', '.join(map(repr, missing))} are missing")
        numbers = np.asarray(columns["test_point"], dtype=np.int64)
        status, kinds = np.array(list(columns["status"]), dtype=str), _kinds(layout)
        # A reason is kept for what has failed only; "" stands for none in a column of texts.
        texts = zip(numbers.tolist(), status, columns["reason"], strict=True)
        reasons = {n: reason for n, status, reason in texts if status == "failed" and reason}
        X = np.empty((len(numbers), len(kinds)), dtype=common_dtype(kinds))
        for j, (name, kind) in enumerate(zip(layout.variables, kinds, strict=True)):
            X[:, j] = choice_values(columns[name]) if kind is Kind.CHOICE else columns[name]
        if len(numbers):  # units of outputs that no test has brought say nothing any more
            units = {name: unit for name, unit in layout.units.items() if name in layout.columns}
            layout = replace(layout, units=units)
        # The status is taken from the file, not derived: the table checks it against the
        # constraints, and so finds a file in which one of both was edited.
        return make(
            layout, numbers, X, **blocks_of(layout, columns, len(numbers)), status=status,
            reasons=reasons, problem=head.get("problem"),
            extra={name: choice_values(columns[name]) for name in extra},
            chosen=tuple(map(str, head.get("chosen", ()))),
        )  # fmt: skip


def text_rows(text: str) -> Iterator[list[str]]:
    """Return the rows of a table of tests in CSV, apart from its head."""
    return csv.reader(StringIO(text.removeprefix("#\n"), newline=""))


def file_head(text: str) -> tuple[Head | None, str]:
    """Return what a text says of its columns, if it does, and the text without that.

    It is the last line, or the first in files of version 0.2.0; then a
    comment stays in its place, as lines are counted.

    Raises:
        ValueError: The line is damaged.
    """
    first, _, rest = text.partition("\n")
    body, _, last = text.rstrip().rpartition("\n")
    for line, other in ((first, f"#\n{rest}"), (last, f"{body}\n")):
        if line.lstrip('"').startswith("#") and any(mark in line for mark in MARKS):
            # A spreadsheet program may have taken it for cells.
            cells = ",".join(next(csv.reader([line]))) if line.startswith('"') else line
            try:
                return dict(json.loads(cells.rstrip(",\r\n ").removeprefix("#"))), other
            except (ValueError, TypeError, RecursionError):
                raise ValueError("the line that says what its columns are is damaged") from None
    return None, text


def sheet_head(rows: Iterable[Sequence[Any]]) -> Head:
    """Return what the second sheet of a workbook says of the columns on its first one.

    Raises:
        ValueError: It is damaged.
    """
    texts = {str(row[0]): "".join(str(c) for c in row[1:] if c is not None) for row in rows if row}
    return {name: json.loads(text) for name, text in texts.items()}


def columns_of_rows(
    head: Head | None, rows: Iterable[Sequence[Any]], text: Callable[[str], str] = written_text
) -> tuple[Head, Columns]:
    """Return head and columns of a table by the head of its file and its rows, names first.

    Args:
        head: As :func:`file_head` returns it.
        rows: Texts, or the values in the cells of a workbook; blank ones are skipped.
        text: Gives the text that is meant by one in a cell.

    Raises:
        ValueError: They are those of no table, or damaged.
    """
    head, n, kinds = _checked(head)
    names, *tests = [row for row in rows if any(cell not in ("", None) for cell in row)] or [()]
    # A file cut at the end of a line is one with fewer tests; the number in the head tells.
    if len(tests) != n:
        what = f"it holds {len(tests)} of {n} tests, so it was cut or edited"
        raise ValueError(f'{what}; if that is meant, set "tests" in its head to {len(tests)}')
    if any(len(row) != len(names) for row in tests):
        raise ValueError("its rows differ in length, so that one was cut or edited")
    # By name, not by place: people rearrange columns and add their own, which are not read.
    found = [*zip(*tests, strict=True)] or [()] * len(names)
    cells = dict(zip(map(text, names), found, strict=True))
    values: dict[Kind, Callable[[Any], Any]] = {
        Kind.INTEGER: _integer,
        Kind.BINARY: _boolean,
        Kind.CHOICE: lambda cell: "" if cell is None else text(str(cell)),
    }
    columns = {}
    for name, kind in kinds.items():
        if name in cells:
            value = values.get(kind, _real)
            try:
                columns[name] = np.fromiter(map(value, cells[name]), DTYPES[kind], n)
            except ValueError:
                what = f"the column {name!r} holds other than {kind.value} values"
                raise ValueError(what) from None
    return head, columns


def _integer(cell: Any) -> int:
    return int(str(cell).replace("_", " "))  # not of 1.5, nor of 1_0, which Python takes for 10


def _boolean(cell: Any) -> bool:
    return ("false", "true").index(str(cell).lower()) == 1


def _real(cell: Any) -> float:
    return np.nan if cell in ("", None) else float(str(cell).replace("_", " "))


def _checked(head: Head | None) -> tuple[Head, int, dict[str, Kind]]:
    """Return head, number of tests, and the kinds of the columns."""
    head = dict(head or {})
    try:
        version, n = head.pop(MARK), int(head.pop("tests"))
        if version in (2, 3):  # of 0.2.0, from which studies come as such tables
            head["maximize"] = head.pop("maximized", [])
            version = _FORMAT
        if head.pop("experiments", ()):  # columns of their own in 0.2.0
            head["extra"] = [*head.get("extra", ()), *ORIGIN]
    except (ValueError, KeyError, TypeError):
        raise ValueError("its head, one line of JSON, is missing or damaged") from None
    if version != _FORMAT:
        raise ValueError(f"its format is {version!r:.20}, this version reads 2 to {_FORMAT}")
    return head, n, kinds_of_columns(_layout_of(head), head.get("extra", ()))


def choice_texts(cells: Iterable[Any]) -> NDArray[np.object_]:
    """Return the options that designs have chosen as texts that tell them apart.

    An option that is text stays as it is unless it could be taken for JSON; all others are JSON:
    ``oak``, ``"12"``, ``12``, ``12.0``, ``true``.
    """
    # The types matter: a choice of 12 is another option than one of "12", and must come back so.
    plain = ((c, isinstance(c, str) and _option(c) is c) for c in cells)
    return np.fromiter((c if p else json.dumps(c, ensure_ascii=False) for c, p in plain), object)


def choice_values(texts: Iterable[str]) -> NDArray[np.object_]:
    """Return the options of the texts of :func:`choice_texts`."""
    return np.fromiter(map(_option, texts), object)


def _option(text: str) -> Any:
    """Return what a text is in JSON, or the text itself."""
    try:
        # Python's JSON also has NaN and Infinity: as options they are put in quotation marks.
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def _kinds(layout: Layout) -> tuple[Kind, ...]:
    return layout.kinds or (Kind.REAL,) * len(layout.variables)
