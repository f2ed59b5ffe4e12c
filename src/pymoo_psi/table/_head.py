"""A test table outside Python: its columns, and a head that says what they mean.

    StoredTests(head_of(table), columns_of(table)).table("a file") is the table.

A :class:`TestTable` has matrices, a :class:`Layout` and a :class:`Formulation`. Files and studies
hold the same as ``Columns``, an array of float64, int64, bool or texts for each name, and a
``Head``: the layout, the formulation and the identity of the problem, as values that JSON can hold.

- From a table: :func:`head_of`, :func:`columns_of`.
- Back to one: :class:`StoredTests`; :func:`stored_tests` of a study, :func:`tests_of_cells` of the
  cells of a file.
- A file of designs has a shorter head, as not all of its columns are known: :func:`designs_head`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import DTYPES, Kind, option_of, option_text
from pymoo_psi._validation import (
    AnyArray,
    Columns,
    Entries,
    Head,
    Names,
    Received,
    Values,
    counted,
    invalid,
)
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table._cells import UnfitError
from pymoo_psi.table._formulation import Formulation
from pymoo_psi.table._layout import (
    GROUPS,
    POINT,
    RUN,
    Layout,
    column_names,
    common_dtype,
    names_of,
    number_column,
    result_columns,
)

if TYPE_CHECKING:
    from pymoo_psi.study import Facts
    from pymoo_psi.table._table import TestTable

MARK = "pymoo_psi_test_table"  # an entry in the head of a file of tests
# The entry in the head of a file of designs, which does not say what all columns are.
DESIGNS_MARK = "pymoo_psi_designs"
HEAD_REMEDY = "remove that description, and say --objectives and --maximize"

_FORMAT = 1  # the version of the head
# Entries that are in a head only if there are any.
_OPTIONAL = ("outputs", "maximize", "units", "label", "extra", "problem")


class StoredTests(NamedTuple):
    """A table of tests as a file holds it.

    Attributes:
        head: As :func:`head_of` returns it.
        columns: As :func:`columns_of` returns them, in any order; further ones are not read.
        remarks: What a reader must know about the rows, in sentences.
        limits: Under which they are asked, if their ``status`` is that without limits.
        is_derived: Whether the status follows from the head, which may be another one than that
            under which the tests were made; only those that failed have failed. Otherwise the
            status is checked.
    """

    head: Head
    columns: Columns
    remarks: tuple[str, ...] = ()
    limits: Entries = MappingProxyType({})
    is_derived: bool = False

    def table(self, where: object) -> TestTable:
        """Return the table.

        Args:
            where: What the tests come from, such as the path of a file, for messages.

        Raises:
            ArgumentValueError: They are those of no table; the message says where.
        """
        from pymoo_psi.table._table import TestTable  # TestTable imports this module

        columns = self.columns
        with described(where):
            layout = _layout_of(self.head)
            extra = self.head.get("extra", ())
            numbers = np.asarray(columns[number_column(extra)], dtype=np.int64)
            n = len(numbers)
            blocks: Any = blocks_of(layout, columns, n)
            results = result_columns((*layout.columns, *extra))
            status = columns[results["status"]]
            has_failed = status == "failed"
            failed = numbers[has_failed].tolist()
            if n:  # units of outputs that no test has are left out
                layout = replace(layout, units=units_of(layout.columns, layout.units))
            table = TestTable(
                layout,
                numbers,
                _designs(layout, columns, n),
                **blocks,
                reasons=dict(zip(failed, columns[results["reason"]][has_failed], strict=True)),
                problem=self.head.get("problem"),
                extra={name: choice_values(columns[name]) for name in extra},
                formulation=formulation_of_head(self.head),
                remarks=self.remarks,
                decimal=self.head.get("decimal", "."),
                separator=self.head.get("separator", ","),
            )
            if self.is_derived:
                table = _without_rejected(table, status)
            else:
                _require_status(table, status)
        if self.limits:
            return table.under(limits=self.limits)
        return table


# From a table to a head and columns


def head_of(table: Any) -> Values:
    """Return what is not in the columns of a :class:`TestTable`, as values that JSON can hold.

    Returns:
        ``variables``, ``objectives``, ``inequalities``, ``equalities``: lists of names;
        ``kinds``: a word of :class:`Kind` for each variable, or nothing if the table has neither
        tests nor kinds; ``lower``, ``upper``: lists of numbers, None where there is no bound;
        ``eq_tolerance``; if there are any ``outputs``, ``maximize`` and ``extra``, lists of names,
        ``units``, texts by name, and ``label``; of the formulation, ``limits``, ``ranges``,
        ``normalize`` if it is false, ``chosen``, the name of a design and why, ``positions`` and
        ``decided``; and ``problem``.
    """
    layout = table.layout
    head: Values = {field.name: getattr(layout, field.name) for field in fields(layout)}
    for side in ("lower", "upper"):  # JSON has null, but no NaN
        bounds = head[side].astype(object)
        bounds[bounds != bounds] = None
        head[side] = bounds.tolist()
    # The kinds of a table without tests are unknown: a later block may be of any kind.
    if len(table):
        head["kinds"] = table.kinds
    head["kinds"] = [kind.value for kind in head["kinds"]]
    head["extra"] = [*table.extra]
    head["problem"] = table.problem
    for name in _OPTIONAL:
        if not head[name]:
            del head[name]
    return head | formulation_head(table.formulation)


def formulation_head(formulation: Formulation) -> Values:
    """Return the entries of a head for a formulation: what no column shows."""
    head: Values = {}
    if formulation.limits:
        head["limits"] = formulation.limits
    if formulation.ranges:
        head["ranges"] = formulation.ranges
    if not formulation.normalize:
        head["normalize"] = False
    if formulation.chosen is not None:
        head["chosen"] = [formulation.chosen, formulation.reason]
    if formulation.positions:
        head["positions"] = formulation.positions
    if formulation.decided is not None:
        head["decided"] = formulation.decided
    return head


def formulation_of_head(head: Head) -> Formulation:
    """Return the formulation in a head."""
    chosen, reason = head.get("chosen") or (None, "")
    return Formulation(
        limits=head.get("limits", {}),
        ranges=head.get("ranges"),
        normalize=head.get("normalize", True),
        chosen=chosen,
        reason=reason,
        positions=head.get("positions", ()),
        decided=head.get("decided"),
    )


def marked(table: Any) -> Values:
    """Return the head of a file of a table."""
    return {MARK: _FORMAT, "tests": len(table), **head_of(table), **_marks(table)}


def _marks(table: Any) -> Values:
    """Return the entries of a head for the marks of the source, which files keep."""
    marks = {}
    if table.decimal != ".":
        marks["decimal"] = table.decimal
    if table.separator != ",":
        marks["separator"] = table.separator
    return marks


def is_of_tests(head: Head) -> bool:
    """Say whether the head of a file is that of a table of tests."""
    return MARK in head


def columns_of(table: Any) -> Columns:
    """Return the columns that make a :class:`TestTable`, n cells each, in the order of its tests.

    Returns:
        ``test_point``, or ``test`` of tests of several runs (int64); the variables, objectives,
        constraints and outputs under their names, objectives in the original direction; ``status``
        and ``reason`` (texts, empty where there is none). A choice and an extra column are texts,
        see :func:`choice_texts`; other variables have the dtype of their kind.
    """
    layout = table.layout
    columns = {number_column(table.extra): table.numbers}
    columns |= columns_of_designs(layout.variables, table.kinds, table.X)
    # Turning a sign twice gives every float64 back, zeros and NaN too.
    columns |= zip(layout.objectives, (table.F * layout.sign).T, strict=True)
    columns |= zip(layout.constraints, np.hstack([table.G, table.H]).T, strict=True)
    columns |= zip(layout.outputs, table.outputs.T, strict=True)
    for name, cells in table.extra.items():
        columns[name] = choice_texts(cells.tolist())
        is_integer = np.array([type(cell) is int for cell in cells.tolist()], dtype=bool)
        columns[name][is_integer] = cells[is_integer]  # a spreadsheet reads 7 as a number
    results = result_columns(table.columns)
    columns[results["status"]] = table.status.astype(object)
    reasons = np.full(len(table), "", dtype=object)
    columns[results["reason"]] = reasons
    # Looked up only if there are any: else it is a pass in Python over all tests for nothing.
    if table.reasons:
        numbers = table.numbers.tolist()
        reasons[:] = [table.reasons.get(number, "") for number in numbers]
    return columns


def columns_of_designs(names: Names, kinds: Sequence[Kind], X: AnyArray) -> Columns:
    """Return the columns of ``(n, n_var)`` designs; choices are texts."""
    columns = {}
    for name, column, kind in zip(names, X.T, kinds, strict=True):
        if kind is Kind.CHOICE:
            columns[name] = choice_texts(column.tolist())
        else:
            columns[name] = column.astype(DTYPES[kind])
    return columns


def lacking(columns: Columns, names: Names) -> tuple[str, ...]:
    """Return a remark on tests of a study that are older than an output and lack its values.

    Args:
        columns: The columns of the tests.
        names: The objectives, and the columns that have limits.
    """
    was_ok = columns["status"] == "ok"
    unknown = np.full(len(was_ok), np.nan)
    counts = []
    for name in names:
        cells = columns.get(name, unknown)[was_ok]
        n_unknown = int((cells != cells).sum())  # NaN
        if n_unknown:
            counts.append(f"{name} in {counted(n_unknown, 'test')}")
    if not counts:
        return ()
    return (
        f"Values are missing, {' and '.join(counts)}: the model did not return them then; "
        "--retry incomplete runs these tests again.",
    )


def choice_texts(cells: Iterable[Any]) -> NDArray[np.object_]:
    """Return the texts of the options that designs have chosen, see :func:`option_text`."""
    return np.fromiter(map(option_text, cells), object)


def choice_values(texts: Iterable[str]) -> NDArray[np.object_]:
    """Return the options of the texts of :func:`choice_texts`."""
    return np.fromiter(map(option_of, texts), object)


# Studies, whose limits are not part of the status of their tests


def stored_tests(facts: Facts, columns: Columns) -> StoredTests:
    """Return tests of a study, whose limits are not part of their status.

    Args:
        facts: What is known of the study.
        columns: Its tests.
    """
    head = dict(facts.head)
    limits = head.pop("limits", {})
    problem = dict(head.get("problem") or {})
    runs = {run.number: run.identity for run in facts.runs}
    if [*runs] == [1]:
        sampling = runs[1].get("sampling")
        if sampling is not None:
            problem["sampling"] = sampling
    else:
        problem["runs"] = {str(number): dict(identity) for number, identity in runs.items()}
        head["extra"] = [RUN, POINT]
        if any(RUN in head.get(group, ()) for group in GROUPS):
            head["extra"] = [POINT]
        columns = columns | {name: choice_texts(columns[name].tolist()) for name in head["extra"]}
    head["problem"] = problem or None
    steered = [f"Steered {request}." for request in facts.requests]
    remarks = (*lacking(columns, (*head["objectives"], *limits)), *steered)
    return StoredTests(head, columns, remarks, limits, is_derived=True)


# The head of a file of designs, whose columns are not all known


def designs_head(designs: Any, columns: Collection[str]) -> Values:
    """Return the head of a file of designs, with which :func:`read_table` reads what was written.

    Args:
        designs: The designs of the file, as a table.
        columns: Names of all columns of the file.
    """
    layout = designs.layout
    head = formulation_head(designs.formulation)
    head.pop("limits", None)  # the designs keep them
    return {
        DESIGNS_MARK: 1,
        "objectives": layout.objectives,
        "maximized": layout.maximize,
        "variables": layout.variables,
        "units": units_of(columns, layout.units),
        **head,
        **_marks(designs),
    }


def stated_by_designs(head: Head) -> tuple[Formulation, Names]:
    """Return the formulation of designs and the names of their variables, as their head says.

    Raises:
        UnfitError: The head is damaged.
    """
    try:
        formulation = replace(
            formulation_of_head(head),
            objectives=head.get("objectives", ()),
            maximize=head.get("maximized", ()),
            units=head.get("units", {}),
        )
        return formulation, column_names("variables", head.get("variables", ()))
    except (TypeError, AttributeError, ValueError):
        raise UnfitError(
            "what it says of its columns is damaged or of a later version", HEAD_REMEDY
        ) from None


def units_of(names: Collection[str], units: Mapping[str, str]) -> dict[str, str]:
    """Return the units of some columns."""
    return {name: unit for name, unit in units.items() if name in names}


# From a head and columns to a table


def _designs(layout: Layout, columns: Columns, n: int) -> AnyArray:
    """Return the ``(n, n_var)`` designs in columns."""
    kinds = _kinds(layout)
    X = np.empty((n, len(kinds)), dtype=common_dtype(kinds))
    for j, (name, kind) in enumerate(zip(layout.variables, kinds, strict=True)):
        column = columns[name]
        if kind is Kind.CHOICE:
            column = choice_values(column)
        X[:, j] = column
    return X


def _require_status(table: TestTable, status: AnyArray) -> None:
    """Refuse a file in which the status or a value was edited."""
    differing = np.flatnonzero(status != table.status)
    if len(differing):
        row = differing[0]
        raise invalid(
            "status",
            "ok where constraints and limits are met, infeasible where not, or failed",
            Received(f"{str(status[row])!r} for test point {table.numbers[row]}"),
        )


def _without_rejected(table: TestTable, stored_status: AnyArray) -> TestTable:
    """Return tests without designs that never ran, for requirements that do not hold any more."""
    is_unknown = ~np.isfinite(table.F).any(axis=1) & np.isnan(table.outputs).all(axis=1)
    is_rejected = table.failed() & (stored_status != "failed") & is_unknown
    if not is_rejected.any():
        return table
    return table.take(~is_rejected)


def blocks_of(layout: Layout, columns: Columns, n: int) -> Columns:
    """Return the arrays F, G, H and outputs of a table of n rows, by its columns."""
    blocks = {}
    for block, names in layout.blocks.items():
        if block != "X":
            arrays = [columns[name] for name in names]
            blocks[block] = np.column_stack([np.zeros((n, 0)), *arrays])
    blocks["F"] *= layout.sign
    return blocks


@contextmanager
def described(where: object) -> Iterator[None]:
    """Turn errors of a source without a table into one that names the source and the problem."""
    try:
        yield
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        problem = str(error)
        if isinstance(error, KeyError):
            problem = f"the column or entry {error} is missing"
        raise ArgumentValueError(
            f"{where} must be a table of tests, of to_csv or 'pymoo-psi export': {problem}"
        ) from error


def kinds_of_columns(layout: Layout, extra: Collection[str] = ()) -> dict[str, Kind]:
    """Return the kind of every column that a table needs; texts are those of a choice."""
    kinds = {number_column(extra): Kind.INTEGER}
    kinds |= zip(layout.variables, _kinds(layout), strict=True)
    kinds |= dict.fromkeys(layout.objectives + layout.constraints + layout.outputs, Kind.REAL)
    results = result_columns((*layout.columns, *extra))
    kinds |= dict.fromkeys((*extra, results["status"], results["reason"]), Kind.CHOICE)
    return kinds


def _layout_of(head: Head) -> Layout:
    arguments = {}
    for field in fields(Layout):
        if field.name in head:
            arguments[field.name] = head[field.name]
    for side in ("lower", "upper"):
        arguments[side] = np.array(head[side], dtype=np.float64)
    return Layout(**arguments)


def _kinds(layout: Layout) -> tuple[Kind, ...]:
    return layout.kinds or (Kind.REAL,) * len(layout.variables)


# From the cells of a file to columns


def tests_of_cells(where: object, head: Head, cells: Entries) -> StoredTests:
    """Return the tests in the cells of a file whose head is that of a table.

    Args:
        where: What they come from, for messages.
        head: As :func:`marked` returns it.
        cells: Those of each column by its name, texts or values.

    Raises:
        ArgumentValueError: They are those of no table, or damaged; the message says where.
    """
    with described(where):
        head = dict(head)
        version = head.pop(MARK)
        if version != _FORMAT:
            raise ValueError(f"its format is {version!r:.20}, not {_FORMAT}")
        # By name, not by place: people rearrange columns and add their own, which are not read.
        names = names_of([*cells], head.get("units", {}))
        cells_by_name = dict(zip(names, map(cells.__getitem__, cells), strict=True))
        kinds = kinds_of_columns(_layout_of(head), head.get("extra", ()))
        n = len(cells_by_name[next(iter(kinds))])
        # A file cut at the end of a line is one with fewer tests; the number in the head tells.
        expected = head.pop("tests")
        if n != expected:
            raise ValueError(
                f"it holds {n} of {expected} tests, so it was cut or edited; "
                f'if that is meant, set "tests" in its head to {n}'
            )
        columns = {}
        for name, kind in kinds.items():
            if name in cells_by_name:
                try:
                    columns[name] = _cells(cells_by_name[name], kind, head.get("decimal", "."))
                except ValueError:
                    raise ValueError(
                        f"the column {name!r} holds other than {kind.value} values"
                    ) from None
        return StoredTests(head, columns)


def _cells(cells: Iterable[Any], kind: Kind, decimal: str) -> AnyArray:
    """Return the values of a column of a kind."""
    texts = ["" if cell is None else str(cell) for cell in cells]
    if kind is Kind.CHOICE:
        return np.fromiter(texts, object)
    if kind is Kind.BINARY:
        return np.array([("false", "true").index(text.lower()) == 1 for text in texts], dtype=bool)
    number: Any = int if kind is Kind.INTEGER else float
    # Python takes 1_0 for 10.
    values = [number(text.replace("_", " ").replace(decimal, ".") or "nan") for text in texts]
    return np.array(values, DTYPES[kind])
