"""What a test table is outside Python, and its files: a head that JSON can hold, and columns.

    table_of(head_of(table), columns_of(table)) is the table.

The head says what the columns mean. A file or a database stores both and need not know more: the
columns are arrays of float64, int64, bool, or texts. A CSV begins with a comment line, the head as
JSON; then come a header and one row per test point. Numbers are written with as many digits as it
takes to read the same number back, texts in quotation marks, so that ``#``, commas and line breaks
in them are text to every reader. In Parquet the head is an attribute of the frame.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from io import BytesIO, StringIO
from os import PathLike
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi._output import comment, inert, whole_file, written_text
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table._designs import common_dtype
from pymoo_psi.table._layout import Layout

Path: TypeAlias = str | PathLike[str]
Head: TypeAlias = dict[str, Any]
Columns: TypeAlias = dict[str, NDArray[Any]]
Table = TypeVar("Table")

MARK = "pymoo_psi_test_table"
_FORMAT = 4  # of the head
_ATTRIBUTE = "pymoo_psi"  # that holds the head in a frame
_TYPES = {
    Kind.REAL: "fi",
    Kind.LOG: "fi",
    Kind.INTEGER: "i",
    Kind.BINARY: "b",
}  # of columns in a frame
# Entries of a head that are left out where they are as here; in the order of Layout's arguments.
_OPTIONAL: dict[str, Any] = {
    "outputs": (), "maximize": (), "units": {}, "experiments": (), "label": None,
}  # fmt: skip
_LAYOUT = ("variables", "objectives", "inequalities", "equalities", "eq_tolerance")


def head_of(table: Any) -> Head:
    """Return what is not in the columns of a :class:`TestTable`, as values that JSON can hold.

    Returns:
        ``variables``, ``objectives``, ``inequalities``, ``equalities``: lists of names;
        ``kinds``: a word of :class:`Kind` for each variable, or nothing if the table has neither
        tests nor kinds; ``lower``, ``upper``: lists of numbers, NaN where there is no bound;
        ``eq_tolerance``; if there are any ``outputs``, ``maximize`` and ``extra``, lists of names,
        ``units``, texts by name, ``experiments``, pairs of a name and a number, and ``label``;
        ``prototype`` with its ``names``, ``x``, ``f``, ``g``, ``h``; and ``problem``.
    """
    layout: Layout = table.layout
    # Of a table without tests the kinds are unknown: a later block may be of any kind.
    kinds = table.kinds if len(table) else layout.kinds
    head: Head = {name: getattr(layout, name) for name in _LAYOUT}
    head |= {"lower": layout.lower.tolist(), "upper": layout.upper.tolist()}
    head["kinds"] = [kind.value for kind in kinds]
    optional = {name: getattr(layout, name) for name in _OPTIONAL}
    optional |= {"extra": list(table.extra), "problem": table.problem}
    if (former := table.prototype) is not None:
        blocks = {"x": former.X, "f": former.F * layout.sign, "g": former.G, "h": former.H}
        values = {letter: block.tolist() for letter, block in blocks.items()}
        names = former.extra.get(former.layout.label or "", np.array(former.names))
        optional["prototype"] = {"names": list(map(str, names))} | values
    head |= {name: value for name, value in optional.items() if value}
    return {name: list(v) if isinstance(v, tuple) else v for name, v in head.items()}


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
def _described(where: object) -> Iterator[None]:
    """Name the source in the errors of what is no table; readers have errors of many kinds."""
    try:
        yield
    except Exception as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        rule = "a table of tests, of to_csv or 'pymoo-psi export'"
        raise ArgumentValueError(f"{where} must be {rule}: {what}") from None


def _layout_of(head: Mapping[str, Any]) -> Layout:
    known = {name: head[name] for name in (*_LAYOUT, "lower", "upper", "kinds")}
    return Layout(**known, **{name: head.get(name, value) for name, value in _OPTIONAL.items()})


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
    head: Mapping[str, Any],
    columns: Mapping[str, Any],
    where: object,
    make: Callable[..., Table],
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
    with _described(where):
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
        table: Any = make(
            layout, numbers, X, **blocks_of(layout, columns, len(numbers)), status=status,
            reasons=reasons, problem=head.get("problem"),
            extra={name: choice_values(columns[name]) for name in extra},
        )  # fmt: skip
        former = head.get("prototype") or dict.fromkeys(("names", *"xfgh"), ())
        for name, *values in zip(*(former[key] for key in ("names", *"xfgh")), strict=True):
            table = table.with_prototype(*values, name=name)
    return table  # type: ignore[no-any-return]


def read_csv(path: Path, content: str | bytes) -> tuple[Head, Columns]:
    """Return head and columns of a table, of the text or bytes of a file.

    Raises:
        ArgumentValueError: It is no file of a table, or a damaged one.
    """
    import pandas as pd

    with _described(path), np.errstate(invalid="ignore"):  # of what is no integer, and refused
        # With or without the byte-order mark that spreadsheet programs put in front; newline=''
        # leaves line breaks within quoted texts to the parser.
        text = content if isinstance(content, str) else content.decode("utf-8-sig")
        file = StringIO(text.removeprefix("\ufeff"), newline="")
        head, n, kinds = _parsed_head(comment_text(file.readline()))
        types = {inert(name): DTYPES[kind] for name, kind in kinds.items()}
        real = {inert(name): ["nan"] for name, kind in kinds.items() if kind.real}
        # From 3.1 on pandas reads every digit by itself, and warns of being asked.
        old = tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1)
        exact: dict[str, Any] = {"float_precision": "round_trip"} if old else {}
        # By name, not by place: people rearrange columns and add their own, which are not read.
        frame = pd.read_csv(
            file, usecols=types.__contains__, dtype=types, keep_default_na=False,
            na_values=real, **exact,
        )  # fmt: skip
        columns = _complete(frame.rename(columns=written_text), n, kinds)
        for name in (name for name in columns if kinds[name] is Kind.CHOICE):
            texts = {text: written_text(text) for text in {*columns[name]}}
            columns[name] = np.fromiter((texts[text] for text in columns[name]), object)
    return head, columns


def write_parquet(path: Path, head: Head, columns: Columns) -> None:
    """Write a table whole or not at all.

    Raises:
        PsiError: pyarrow is not installed.
        OSError: It cannot be written.
    """
    _require_pyarrow()
    import pandas as pd

    frame = pd.DataFrame(columns)
    # pandas keeps attrs in the metadata of the file, where other readers pass over them.
    frame.attrs = {_ATTRIBUTE: head_comment(head, columns)}
    with whole_file(path) as written:
        frame.to_parquet(written, engine="pyarrow", index=False)


def read_parquet(path: Path, content: bytes) -> tuple[Head, Columns]:
    """Return head and columns of a table, of the bytes of a file.

    Raises:
        PsiError: pyarrow is not installed.
        ArgumentValueError: It is no file of a table, or a damaged one.
    """
    _require_pyarrow()
    import pandas as pd

    with _described(path):
        frame = pd.read_parquet(BytesIO(content), engine="pyarrow")
        text = comment_text(str(frame.attrs.get(_ATTRIBUTE, "")))
        head, n, kinds = _parsed_head(text)
        return head, _complete(frame, n, kinds)


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


def comment_text(line: str) -> str:
    """Return the text of the first line, also if a spreadsheet program took it for cells."""
    if line.startswith('"'):
        line = ",".join(next(csv.reader([line])))
    return line.rstrip("\r\n").rstrip(",").removeprefix("#")


def head_comment(head: Head, columns: Columns) -> str:
    """Return the head of a file, a comment with JSON."""
    marks = {MARK: _FORMAT, "tests": len(columns["test_point"])}
    return comment(marks | head)


def _parsed_head(text: str) -> tuple[Head, int, dict[str, Kind]]:
    """Return head, number of tests, and the kinds of the columns."""
    try:
        head = json.loads(text)
        version, n = head.pop(MARK), int(head.pop("tests"))
        if version in (2, 3):  # of 0.2.0, from which studies come as such tables
            head["maximize"] = head.pop("maximized", [])
            if one := head.get("prototype"):
                head["prototype"] = {"names": [one["name"]]} | {k: [one[k]] for k in "xfgh"}
            version = _FORMAT
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise ValueError("its head, one line of JSON, is missing or damaged") from None
    if version != _FORMAT:
        raise ValueError(f"its format is {version!r:.20}, this version reads 2 to {_FORMAT}")
    return head, n, kinds_of_columns(_layout_of(head), head.get("extra", ()))


def _complete(frame: Any, n: int, kinds: Mapping[str, Kind]) -> Columns:
    """Return the columns of a frame if no column or test is missing."""
    # A CSV cut at the end of a line is a valid CSV with fewer tests; the number in the head tells.
    if len(frame) != n:
        what = f"it holds {len(frame)} of {n} tests, so it was cut or edited"
        raise ValueError(f'{what}; if that is meant, set "tests" in its head to {len(frame)}')
    columns = {}
    for name, kind in ((name, kind) for name, kind in kinds.items() if name in frame):
        # NumPy would make 1 of 1.5, True of 2, and numbers of texts.
        if kind in _TYPES and frame[name].dtype.kind not in _TYPES[kind]:
            raise ValueError(f"the column {name!r} holds other than {kind.value} values")
        columns[name] = frame[name].to_numpy(dtype=DTYPES[kind])
        if kind is Kind.CHOICE and not all(isinstance(cell, str) for cell in columns[name]):
            raise ValueError(f"the column {name!r} holds other than texts, or rows are cut")
    return columns


def _require_pyarrow() -> None:
    if find_spec("pyarrow") is None:
        raise PsiError(
            "Parquet needs pyarrow, which is not installed; pip install pyarrow, or write CSV"
        )


def _kinds(layout: Layout) -> tuple[Kind, ...]:
    return layout.kinds or (Kind.REAL,) * len(layout.variables)
