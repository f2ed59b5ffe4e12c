"""What a test table is outside Python: a head that JSON can hold, and named columns.

    table_of(head_of(table), columns_of(table)) is the table.

The head says what the columns mean. A file or a database stores both and need not know more: the
columns are arrays of float64, int64, bool, or texts.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.table._designs import common_dtype
from pymoo_psi.table._layout import Layout

Head: TypeAlias = dict[str, Any]
Columns: TypeAlias = dict[str, NDArray[Any]]
Table = TypeVar("Table")
_LAYOUT = ("variables", "objectives", "inequalities", "equalities", "eq_tolerance")
# Left out of a head where there are none: so a table without them has the head of earlier versions.
_FURTHER: dict[str, Any] = {
    "outputs": [],
    "maximize": [],
    "units": {},
    "experiments": [],
    "label": None,
}


def head_of(table: Any) -> Head:
    """Return what is not in the columns of a :class:`TestTable`, as values that JSON can hold.

    Returns:
        ``variables``, ``objectives``, ``inequalities``, ``equalities``: lists of names;
        ``kinds``: a word of :class:`Kind` for each variable, or nothing if the table has neither
        tests nor kinds; ``lower``, ``upper``: lists of numbers, NaN where there is no bound;
        ``eq_tolerance``; if there are any ``outputs`` and ``maximize``, lists of names, ``units``,
        texts by name, and ``experiments``, pairs of a name and a number; ``prototype`` with its
        ``name``, ``x``, ``f``, ``g``, ``h`` if there is one; and ``problem`` if it is known.
    """
    layout: Layout = table.layout
    # Of a table without tests nothing can be told: a later block may be of any kind.
    kinds = table.kinds if len(table) else layout.kinds
    head: Head = {name: getattr(layout, name) for name in _LAYOUT}
    head = {name: list(v) if isinstance(v, tuple) else v for name, v in head.items()}
    head |= {"lower": layout.lower.tolist(), "upper": layout.upper.tolist()}
    head["kinds"] = [kind.value for kind in kinds]
    for key, nothing in _FURTHER.items():
        if value := getattr(layout, key):
            head[key] = value if nothing is None else type(nothing)(value)
    if table.extra:
        head["extra"] = list(table.extra)
    if (former := table.prototype) is not None:
        blocks = {"x": former.X, "f": former.F * layout.sign, "g": former.G, "h": former.H}
        values = {letter: block.tolist() for letter, block in blocks.items()}
        head["prototype"] = {"names": former.extra["prototype"].tolist()} | values
    if table.problem is not None:
        head["problem"] = table.problem
    return head


def columns_of(table: Any) -> Columns:
    """Return the columns that make a :class:`TestTable`, n cells each, in the order of its tests.

    Returns:
        ``test_point`` (int64); the variables, criteria, constraints and outputs under their names,
        criteria in their own sense; ``status`` and ``reason`` (texts, empty where there is none).
        A choice is text, see :func:`choice_texts`; other variables have the dtype of their kind.
    """
    layout: Layout = table.layout
    columns: Columns = {"test_point": table.numbers}
    for name, column, kind in zip(layout.variables, table.X.T, table.kinds, strict=True):
        texts = kind is Kind.CHOICE
        columns[name] = choice_texts(column.tolist()) if texts else column.astype(DTYPES[kind])
    # Turning a sign twice gives every float64 back, zeros and NaN too.
    columns |= zip(layout.objectives, (table.F * layout.sign).T, strict=True)
    columns |= zip(layout.inequalities, table.G.T, strict=True)
    columns |= zip(layout.equalities, table.H.T, strict=True)
    columns |= zip(layout.outputs, table.outputs.T, strict=True)
    columns |= {name: choice_texts(cells.tolist()) for name, cells in table.extra.items()}
    # Looked up only if there are any: else it is a pass in Python over all tests for nothing.
    reasons = np.full(len(table), "", dtype=object)
    if table.reasons:
        reasons[:] = [table.reasons.get(number, "") for number in table.numbers.tolist()]
    columns |= {"status": table.status.astype(object), "reason": reasons}
    return columns


def layout_of(head: Mapping[str, Any], where: object) -> Layout:
    """Return the layout in a head; see :func:`table_of` for the arguments."""
    try:
        bounds = {side: head[side] for side in ("lower", "upper")}
        further = {key: head.get(key, nothing) for key, nothing in _FURTHER.items()}
        if "maximized" in head:  # before version 0.3
            further["maximize"] = head["maximized"]
        known = {name: head[name] for name in _LAYOUT}
        return Layout(**known, **bounds, kinds=head["kinds"], **further)
    except (PsiError, ValueError, KeyError, TypeError) as error:
        raise damaged(where, f"its head is damaged: {error}") from None


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
    layout = layout_of(head, where)
    if missing := [name for name in kinds_of_columns(layout) if name not in columns]:
        raise damaged(where, f"the columns {', '.join(map(repr, missing))} are missing")
    numbers = np.asarray(columns["test_point"], dtype=np.int64)
    # A reason is kept for what has failed only; "" stands for none in a column of texts.
    texts = zip(numbers.tolist(), columns["status"], columns["reason"], strict=True)
    reasons = {number: reason for number, status, reason in texts if status == "failed" and reason}
    kinds = _kinds(layout)
    X = np.empty((len(numbers), len(kinds)), dtype=common_dtype(kinds))
    for j, (name, kind) in enumerate(zip(layout.variables, kinds, strict=True)):
        X[:, j] = choice_values(columns[name]) if kind is Kind.CHOICE else columns[name]
    F, G, H, outputs = (
        _reals(columns, names, len(numbers))
        for names in (layout.objectives, layout.inequalities, layout.equalities, layout.outputs)
    )
    F *= layout.sign
    # The status is taken from the file, not derived: the table checks it against the constraints,
    # and so finds a file in which one of both was edited.
    status = np.array(list(columns["status"]), dtype=str)
    extra = {name: choice_values(columns[name]) for name in head.get("extra", ())}
    try:
        problem = head.get("problem")
        table = make(layout, numbers, X, F, G, H, status, reasons, None, outputs, problem, extra)
        for name, *values in _prototypes(head.get("prototype")):
            table = table.with_prototype(*values, name=name)  # type: ignore[attr-defined]
        return table
    except PsiError as error:
        raise damaged(where, str(error)) from None


def _kinds(layout: Layout) -> tuple[Kind, ...]:
    return layout.kinds or (Kind.REAL,) * len(layout.variables)


def _prototypes(values: Any) -> list[Any]:
    """Return name and values of the prototypes in a head, which the table checks."""
    if values is None:
        return []
    try:
        if "name" in values:  # before version 0.3 there was one
            values = {"names": [values["name"]], **{k: [values[k]] for k in "xfgh"}}
        return list(zip(*(values[key] for key in ("names", *"xfgh")), strict=True))
    except (KeyError, TypeError, ValueError) as error:
        raise ArgumentValueError(f"its head is damaged: {error} of its prototype") from None


def damaged(where: object, what: str) -> ArgumentValueError:
    """Compose the error for what is no test table; the caller raises it."""
    return ArgumentValueError(
        f"{where} must be a table of tests, of to_csv or 'pymoo-psi export': {what}"
    )


def choice_texts(cells: Iterable[Any]) -> NDArray[np.object_]:
    """Return the options that designs have chosen as texts that tell them apart.

    An option that is text stays as it is unless it could be taken for JSON; all others are JSON:
    ``oak``, ``"12"``, ``12``, ``12.0``, ``true``.
    """
    # The types matter: a choice of 12 is another option than one of "12", and must come back so.
    texts = (
        c if isinstance(c, str) and not _is_json(c) else json.dumps(c, ensure_ascii=False)
        for c in cells
    )
    return np.fromiter(texts, object)


def choice_values(texts: Iterable[str]) -> NDArray[np.object_]:
    """Return the options of the texts of :func:`choice_texts`."""
    return np.fromiter((json.loads(text) if _is_json(text) else text for text in texts), object)


def _is_json(text: str) -> bool:
    """Say whether a text is a number, true, false, null or a text of JSON."""
    if text.lstrip()[:1] in ("[", "{"):  # no option; of these a long one is a RecursionError
        return False
    try:
        # Python's JSON also has NaN and Infinity: as options they are put in quotation marks.
        json.loads(text)
    except ValueError:
        return False
    return True


def _reals(columns: Mapping[str, Any], names: Sequence[str], n: int) -> NDArray[np.float64]:
    block = np.empty((n, len(names)), dtype=np.float64)
    for j, name in enumerate(names):
        block[:, j] = columns[name]
    return block
