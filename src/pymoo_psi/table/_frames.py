"""What a frame or a file of a test table holds: a head of names and bounds, and columns.

    read(head, columns) of (head(table), columns(table)) is the table.

Columns are ``test_point``, the variables, criteria and constraints under their names, ``status``
and ``reason``, and two that follow from these, ``broken`` and ``pareto``, for the reader's eye.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table._constraints import broken_texts
from pymoo_psi.table._designs import Kind, column_kinds
from pymoo_psi.table._judgement import JudgedRecords
from pymoo_psi.table._layout import Layout
from pymoo_psi.table._prototype import Prototype
from pymoo_psi.table._records import Records

if TYPE_CHECKING:
    import pandas as pd


Table = TypeVar("Table", bound=Records)

_COLUMN_TYPES: dict[str, Any] = {"real": np.float64, "integer": np.int64, "boolean": np.bool_}
FORMAT = 1  # of the files; a reader refuses a later one


def damaged(path: object, what: str) -> ArgumentValueError:
    """Compose the error for a file that is not a test table; the caller raises it."""
    return ArgumentValueError(f"{path} must be a file of a TestTable: {what}")


def table_columns(table: JudgedRecords) -> dict[str, NDArray[Any]]:
    """Return the columns of a table by name, in the order of frame and file."""
    layout = table.layout
    columns: dict[str, NDArray[Any]] = {"test_point": table.numbers}
    for name, column, kind in zip(layout.variables, table.X.T, column_kinds(table.X), strict=True):
        columns[name] = column.astype(_COLUMN_TYPES.get(kind, np.object_))
    columns |= dict(zip(layout.objectives, table.F.T, strict=True))
    columns |= dict(zip(layout.inequalities, table.G.T, strict=True))
    columns |= dict(zip(layout.equalities, table.H.T, strict=True))
    reasons = np.full(len(table), "", dtype=object)
    if table.reasons:
        reasons[:] = [table.reasons.get(number, "") for number in table.numbers.tolist()]
    columns["status"] = table.status.astype(object)
    columns |= {"broken": broken_texts(table), "reason": reasons, "pareto": table.pareto()}
    return columns


def table_frame(table: JudgedRecords) -> pd.DataFrame:
    """Return the table as a frame; see :meth:`TestTable.to_frame`."""
    import pandas as pd

    frame = pd.DataFrame(table_columns(table)).set_index("test_point")
    for name, kind in zip(table.layout.variables, column_kinds(table.X), strict=True):
        if kind == "mixed":
            frame[name] = frame[name].astype(object)
    return frame


def encoded(columns: dict[str, NDArray[Any]], kinds: Mapping[str, Kind]) -> dict[str, NDArray[Any]]:
    """Return the columns as a file holds them: cells of mixed columns as JSON."""
    result = dict(columns)
    for name, kind in kinds.items():
        if kind == "mixed":
            texts = np.empty(len(columns[name]), dtype=object)
            texts[:] = [json.dumps(cell, ensure_ascii=False) for cell in columns[name]]
            result[name] = texts
    return result


def head_text(table: JudgedRecords) -> str:
    """Return what is not in the columns, as JSON in one line."""
    layout, prototype = table.layout, table.prototype
    head: dict[str, Any] = {
        "pymoo_psi_test_table": FORMAT,
        "tests": len(table),
        "variables": layout.variables,
        "kinds": column_kinds(table.X),
        "objectives": layout.objectives,
        "inequalities": layout.inequalities,
        "equalities": layout.equalities,
        "lower": layout.lower.tolist(),
        "upper": layout.upper.tolist(),
        "eq_tolerance": layout.eq_tolerance,
    }
    if prototype is not None:
        head["prototype"] = {"name": prototype.name} | {
            letter: getattr(prototype, letter).tolist() for letter in "xfgh"
        }
    return json.dumps(head, ensure_ascii=False)


def parsed_head(path: object, text: str) -> dict[str, Any]:
    """Return the head of a file with its layout and prototype.

    Raises:
        ArgumentValueError: The text is not such a head; the message names the file.
    """
    try:
        head = json.loads(text)
        version = head["pymoo_psi_test_table"]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise damaged(path, "its head, one line of JSON, is missing or damaged") from None
    if version != FORMAT:
        what = f"its format is {version!r:.20}, this version of pymoo-psi reads {FORMAT}"
        raise damaged(path, what)
    try:
        layout = Layout(**{f.name: head[f.name] for f in fields(Layout)})
        kinds = dict(zip(layout.variables, head["kinds"], strict=True))
        if not set(kinds.values()) <= set(PARSERS) or type(head["tests"]) is not int:
            raise ValueError("unknown kind of variable, or no number of tests")
        prototype = head.get("prototype")
        if prototype is not None:
            x = np.array(prototype["x"], dtype=object)  # the types of its cells as they are
            prototype = Prototype(**prototype | {"x": x}).checked(layout)
    except (PsiError, ValueError, KeyError, TypeError) as error:
        raise damaged(path, f"its head is damaged: {error}") from None
    return {"layout": layout, "kinds": kinds, "tests": head["tests"], "prototype": prototype}


def column_formats(layout: Layout, kinds: Mapping[str, Kind]) -> dict[str, str]:
    """Return the columns a file must have, each with the name of its parser."""
    real = dict.fromkeys((*layout.objectives, *layout.constraints), "real")
    return {"test_point": "integer", **kinds, **real, "status": "text", "reason": "text"}


def table_of_columns(
    path: object, head: Mapping[str, Any], columns: Mapping[str, Any], make: type[Table]
) -> Table:
    """Return the table, of a class, of a head and the columns of :func:`column_formats`.

    Raises:
        ArgumentValueError: The columns are no table; the message names the file.
    """
    layout: Layout = head["layout"]
    numbers = np.asarray(columns["test_point"])
    if len(numbers) != head["tests"]:
        what = f"it holds {len(numbers)} of {head['tests']} tests, so it was cut or edited"
        raise damaged(path, f'{what}; if that is meant, set "tests" in its head to {len(numbers)}')
    texts = zip(numbers.tolist(), columns["status"], columns["reason"], strict=True)
    reasons = {number: reason for number, status, reason in texts if status == "failed" and reason}
    kinds = set(head["kinds"].values()) or {"real"}
    dtype = _COLUMN_TYPES.get(kinds.pop(), object) if len(kinds) == 1 else object
    status = np.array(list(columns["status"]), dtype=str)
    try:
        return make(
            layout,
            numbers if len(numbers) else np.zeros(0, dtype=np.int64),
            _block(columns, layout.variables, len(numbers), dtype),
            _block(columns, layout.objectives, len(numbers), np.float64),
            _block(columns, layout.inequalities, len(numbers), np.float64),
            _block(columns, layout.equalities, len(numbers), np.float64),
            status,
            reasons,
            head["prototype"],
        )
    except PsiError as error:
        raise damaged(path, str(error)) from None


def _block(columns: Mapping[str, Any], names: Sequence[str], n: int, dtype: Any) -> NDArray[Any]:
    block = np.empty((n, len(names)), dtype=dtype)
    for j, name in enumerate(names):
        block[:, j] = columns[name]
    return block


def _boolean(text: str) -> bool:
    return {"true": True, "false": False}[text.strip().lower()]


def _choice(text: str) -> Any:
    value = json.loads(text)
    if not isinstance(value, (bool, int, float, str)):
        raise ValueError(text)
    return value


PARSERS: dict[str, Callable[[str], Any]] = {
    "real": float,
    "integer": int,
    "boolean": _boolean,
    "text": str,
    "mixed": _choice,
}
"""How the text of a cell is read; each raises ValueError or KeyError."""
