"""From a source of any kind to a table: :func:`read_table` is the only way to open one."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import compress
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np

from pymoo_psi._validation import (
    Array,
    FilePath,
    Mask,
    Names,
    Received,
    counted,
    invalid,
    known_name,
    real_array,
)
from pymoo_psi.errors import ArgumentValueError, PsiError
from pymoo_psi.pareto import RANKING_NAMES
from pymoo_psi.table._cells import (
    Cells,
    Column,
    UnfitError,
    cells_of_frame,
    is_blank,
    read_columns,
    require_designs,
)
from pymoo_psi.table._designs import first_of
from pymoo_psi.table._formats import SourceFile, recognized, tests_of_folder
from pymoo_psi.table._formulation import Formulation, limits_of
from pymoo_psi.table._head import (
    StoredTests,
    checked_designs_head,
    formulation_of_head,
    is_of_tests,
    table_of,
    tests_of_cells,
    units_of,
)
from pymoo_psi.table._layout import RESERVED, Layout, names_of
from pymoo_psi.table._repeats import undeclared
from pymoo_psi.table._table import TestTable
from pymoo_psi.table._tests import STATUSES

# Columns that name designs, and after them columns that number the rows of a file, which names of
# designs say better. Not "no", which is also an exhaust gas.
_NAMING = ("test_point", "number", "label", "name", "id", "design")
_LABELS = (*_NAMING, "row", "index", "nr", "nr.", "no.", "nummer", "#", "unnamed: 0")
_DERIVED = (*RANKING_NAMES, "status", "violated", "reason")  # follow from other columns
_DISTANCES = ("mu1", "mu2", "mu3")  # of a ranking, in all versions
# Integers as programs write them, so not 007, a label. 18 digits are below 2^63.
_INTEGER = re.compile(r"-?(?:0|[1-9][0-9]{0,17})")
_N_LISTED = 6  # rows that a remark names


def read_table(
    source: str | PathLike[str] | Any,
    formulation: Formulation | None = None,
    *,
    variables: Sequence[str] | None = None,
    repeats: str | Literal[False] | None = None,
    drop_incomplete: bool = False,
    decimal: str | None = None,
    thousands: str | None = None,
    encoding: str | None = None,
    skip_rows: Collection[int] = (),
    sheet: str | None = None,
) -> TestTable:
    r"""Return the table in a source of any kind, which is read once, so that it may be a pipe.

    A table of tests keeps its layout. Designs of other sources are feasible, have no bounds, and
    are numbered by their rows, from 1. Their objectives are the first of these that exist: those
    that the formulation names; those that the source states, as rankings and exports of the page
    do; f1, f2, … beside x1, x2, …; all columns of numbers except labels. Other columns of numbers
    become outputs, all others ``extra``. ``remarks`` states what a reader must know about the rows,
    such as missing shares.

    An ambiguous number is refused, such as ``1.250`` if the point may be a thousands separator; the
    message names the option that decides. A column of numbers with other cells is refused, too. If
    the formulation names the objectives, only the columns that it names must be readable.

    Args:
        source: A path, a data frame, an ``(n, m)`` array of objectives, all minimised, or a
            :class:`TestTable`. A path leads to a study or a folder of studies; a text with commas,
            semicolons, tabs, bars or spaces between its cells; a workbook (.xlsx); a list of
            designs in JSON; or a file of a format that was added to ``FORMATS``.
        formulation: Objectives, directions and limits; see :meth:`TestTable.under`.
        variables: Names of the columns with design variables; by default as the source says.
        repeats: The column whose equal values mark tests of one design, or ``"variables"``; the
            design is their mean, see :meth:`TestTable.averaged`. By default only repeated tests of
            a study are averaged, by variables; ``False`` averages nothing.
        drop_incomplete: Count designs without a finite objective as failed, instead of refusing the
            source.
        decimal: The decimal mark of texts, ``"."`` or ``","``.
        thousands: The mark between thousands, ``"."``, ``","``, ``" "`` or ``"'"``.
        encoding: The encoding of a text; by its byte-order mark, or UTF-8, unless given.
        skip_rows: Numbers of lines to leave out, from 1, such as titles and lines of units.
        sheet: Name of the sheet of a workbook; the only one unless given.

    Raises:
        OSError: The file cannot be opened.
        ArgumentValueError: The source is not a table of named columns with at least one design, a
            row is a summary of others, a required column cannot be read, or the formulation does
            not fit.
        StudyError: The file is a database but no study, or a damaged one.
        PsiError: A package that reads such files is not installed.

    Example:
        >>> import os, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = os.path.join(folder, "set.csv")
        ...     _ = Path(path).write_text("id;cost;mass\nA;1,5;1.250\nB;2;980\n")
        ...     table = read_table(path, Formulation(maximize=["mass"]), decimal=",")
        >>> table.column("mass"), table.layout.maximize, table.names
        (array([1250.,  980.]), ('mass',), ['A', 'B'])
    """
    path = Path(source) if isinstance(source, (str, PathLike)) else None
    asked = formulation or Formulation()
    try:
        content = _content(source, encoding, frozenset(skip_rows), sheet)
        if skip_rows and not (isinstance(content, Cells) and content.lines):
            rule = "left out, as the source is neither a text of designs nor a workbook"
            raise invalid("skip_rows", rule, skip_rows)
        if variables and not isinstance(content, Cells):
            rule = "left out for a table of tests, which has its own"
            raise invalid("variables", rule, variables)
        if isinstance(content, Cells):
            if repeats and repeats in content.columns:
                content = replace(content, label=repeats)
            # Equal rows may be repeated tests.
            is_file = path is not None and not repeats
            designs = _designs(content, asked, decimal, thousands, is_file=is_file)
            table = _table(designs, asked, variables, drop_incomplete)
        elif isinstance(content, StoredTests):
            table = table_of(
                content.head,
                content.columns,
                path,
                content.remarks,
                is_derived=content.is_derived,
            )
            if content.limits:
                table = table.under(limits=content.limits)
        else:
            table = content
    except UnfitError as error:
        raise ArgumentValueError(f"{path or 'the source'}: {error}") from None
    if repeats:
        table = table.averaged(repeats)
    elif repeats is None and table is not source:
        remarks = undeclared(table)
        # A study tests a design once, unless its model is noisy or people repeat a test.
        if remarks and isinstance(content, StoredTests) and content.is_derived:
            table = table.averaged()
        else:
            table = table._with(remarks=(*table.remarks, *remarks))
    if formulation is None:
        return table
    # Limits that the formulation leaves open are those of the table.
    limits = {**limits_of(table.formulation.limits), **limits_of(formulation.limits)}
    normalize = table.formulation.normalize and formulation.normalize
    try:
        return table.under(replace(formulation, limits=limits, normalize=normalize))
    except ArgumentValueError as error:
        if path is None:
            raise
        raise ArgumentValueError(f"{path}: {error}") from None


# From sources to cells


def _content(
    source: Any,
    encoding: str | None = None,
    skip_rows: Collection[int] = (),
    sheet: str | None = None,
) -> TestTable | StoredTests | Cells:
    """Return what a source holds: a table, or cells with their head and names without units."""
    import pandas as pd

    content: TestTable | StoredTests | Cells
    if isinstance(source, TestTable):
        return source
    if isinstance(source, (str, PathLike)):
        content = _content_of_file(Path(source), encoding, skip_rows, sheet)
    elif isinstance(source, pd.DataFrame):
        content = cells_of_frame(source)
    else:
        F = real_array("source", source, "or give the path of a file")
        if F.ndim != 2 or F.size == 0:
            raise invalid("source", "of shape (n, m)", Received(f"shape {F.shape}"))
        names = [f"f{j + 1}" for j in range(F.shape[1])]
        columns = dict(zip(names, F.T.tolist(), strict=True))
        content = Cells(columns, head={"objectives": names})
    if not isinstance(content, Cells):
        return content
    head = checked_designs_head(content.head)
    names = names_of([*content.columns], head["units"])
    columns = dict(zip(names, content.columns.values(), strict=True))
    n_rows = len(next(iter(columns.values()), ()))
    return replace(content, columns=columns, head=head, rows=range(1, n_rows + 1))


def _content_of_file(
    path: Path, encoding: str | None, skip_rows: Collection[int], sheet: str | None
) -> StoredTests | Cells:
    """Return what a file or a folder of studies holds."""
    if path.is_dir():
        return tests_of_folder(path)
    with path.open("rb") as stream:
        file = SourceFile(path, stream, encoding, skip_rows, sheet)
        file_format = recognized(file)
        if sheet is not None and not file_format.has_sheets:
            raise invalid("sheet", f"left out, as {path} is no workbook (.xlsx)", sheet)
        try:
            content = file_format.read(file)
        except (LookupError, ValueError, TypeError) as error:
            if isinstance(error, PsiError):
                raise
            # of a format that was added, whose reader did not expect such a file
            problem = f"it cannot be read as {file_format.suffix}"
            raise UnfitError(f"{problem}: {error!r:.80}") from error
    if isinstance(content, Cells) and is_of_tests(content.head):
        return tests_of_cells(path, content)
    return content


def source_columns(
    source: FilePath | Any,
    units: Mapping[str, str] = MappingProxyType({}),
    *,
    decimal: str | None = None,
    sheet: str | None = None,
) -> tuple[Cells, dict[str, Column]]:
    """Return the cells of a source that is no table of tests, and its columns with their numbers.

    Args:
        source: A file or a data frame.
        units: Units that may follow the names of columns.
        decimal: The decimal mark, if it is known.
        sheet: The sheet of a workbook.

    Raises:
        OSError: The file cannot be opened.
        UnfitError: It is no table of named columns.
    """
    cells = _content(source, sheet=sheet)
    if not isinstance(cells, Cells):
        raise UnfitError("it is a table of tests, and not one of numbers alone")
    names = names_of([*cells.columns], units)
    cells = replace(cells, columns=dict(zip(names, cells.columns.values(), strict=True)))
    return cells, read_columns(cells, decimal, None, ())


# From cells to designs


class _Designs(NamedTuple):
    """The feasible designs of a source that is no table of tests.

    Attributes:
        cells: Their cells, without columns that follow from others.
        columns: The columns with their numbers.
        labels: The columns that name or number designs.
        remarks: What a reader must know about the rows, in sentences.
    """

    cells: Cells
    columns: dict[str, Column]
    labels: set[str]
    remarks: list[str]


def _designs(
    cells: Cells,
    formulation: Formulation,
    decimal: str | None,
    thousands: str | None,
    *,
    is_file: bool,
) -> _Designs:
    """Return the designs in cells; of equal rows of a file, the first.

    Rows of a frame or an array stay, as its owner counts them, and as results of pymoo may be equal
    in their objectives.

    Raises:
        ArgumentValueError: No design is feasible, or a row summarises others.
    """
    names = cells.columns.keys()
    is_ranking = names >= {*_DISTANCES}
    is_export = is_ranking and "mark" in names  # of the page
    remarks: list[str] = []
    directions: list[str] = []
    if not (cells.head["objectives"] or formulation.objectives):
        directions = _remarks_on_directions(cells, is_ranking and not formulation.maximize)
    # A failed design may hold anything, so it is left out before numbers are read.
    cells = _feasible(cells, is_export, remarks)
    if is_file:
        cells = _without_equals(cells, remarks)
    results = {*_DERIVED}
    if is_export:
        results.add("mark")
    for cell in cells.columns.get("place", ()):
        if isinstance(cell, str) and re.search(r"[^\W\d_]", cell):
            results.discard("place")  # a town, and not the place of a ranking
    is_pareto = {str(cell).lower() for cell in cells.columns.get("pareto", ("none",))}
    kept = {name: column for name, column in cells.columns.items() if name not in results}
    cells = replace(cells, columns=kept)
    labels = set(filter(_is_label, kept))
    columns = read_columns(cells, decimal, thousands, labels)
    if cells.label is None:
        cells = replace(cells, label=_label(columns))
    if cells.label is not None:
        labels.add(cells.label)
    # Every row of a ranking is a design, whatever it is called; a summary is not Pareto optimal.
    if not (is_ranking and is_pareto <= {"true", "false"}):
        require_designs(cells, [c for c in columns.values() if c.name not in labels])
    return _Designs(cells, columns, labels, remarks + directions)


def _remarks_on_directions(cells: Cells, is_ranking: bool) -> list[str]:
    """Refuse tests without their layout, and return a remark on a ranking without it.

    Without directions all objectives are minimized.
    """
    if cells.columns.keys() >= {*RESERVED[1:]}:
        if cells.metadata:
            raise UnfitError(
                f"it holds tests, and {cells.metadata}, which says what they are, is not there",
                "put it beside the file, or say --objectives and --maximize",
            )
        raise invalid(
            "source",
            "a whole test table, or its frame with the objectives named",
            Received("a part of one"),
            "give the table itself, or Formulation(objectives=..., maximize=...)",
        )
    if cells.metadata and is_ranking:
        return [
            f"{cells.metadata}, which says the directions, is not there: all objectives are "
            "minimized unless --maximize says otherwise."
        ]
    return []


def _feasible(cells: Cells, is_export: bool, remarks: list[str]) -> Cells:
    """Return the rows with feasible designs that are no prototypes of the page."""
    is_feasible = np.ones(len(cells.rows), dtype=bool)
    status = [*map(str, cells.columns.get("status", ()))]
    # A column "status" with other words in it is another program's, and selects nothing.
    if status and {*status} <= {*STATUSES}:
        is_feasible &= np.array(status) == "ok"
    if is_export:
        is_feasible &= np.array(cells.columns["mark"], dtype=object) != "prototype"
    n_out = int((~is_feasible).sum())
    if n_out == len(is_feasible):
        raise UnfitError(f"none of its {counted(n_out, 'design')} is feasible")
    if n_out:
        remarks.append(f"{counted(n_out, 'design')} left out as not feasible.")
    return _rows(cells, is_feasible)


def _without_equals(cells: Cells, remarks: list[str]) -> Cells:
    """Return the rows without those that are equal to one before."""
    rows = [
        tuple(str(cell).strip() for cell in row)
        for row in zip(*cells.columns.values(), strict=True)
    ]
    first = first_of(rows)
    is_first = first == np.arange(len(first))
    if not is_first.all():
        n_repeats = counted(int((~is_first).sum()), "row")
        remarks.append(f"{n_repeats} left out, equal to another one in all cells.")
    return _rows(cells, is_first)


def _rows(cells: Cells, is_kept: Mask) -> Cells:
    """Return the cells of some rows of a source."""
    if is_kept.all():
        return cells
    columns = {name: [*compress(column, is_kept)] for name, column in cells.columns.items()}
    rows = [*compress(cells.rows, is_kept)]
    return replace(cells, columns=columns, rows=rows, lines=[*compress(cells.lines, is_kept)])


def _is_label(name: str) -> bool:
    return _folded(name) in _LABELS


def _folded(name: str) -> str:
    return name.strip().lower()


def _label(columns: Mapping[str, Column]) -> str | None:
    """Return the column that names the designs.

    If no name tells it, or only that of a column that numbers rows, it is the first other column,
    if that holds texts of which nine in ten differ: such lists are common, under "Variante" as
    under "Model".
    """
    labels = sorted(filter(_is_label, columns), key=lambda name: _LABELS.index(_folded(name)))
    if not labels or _folded(labels[0]) not in _NAMING:
        others = [column for name, column in columns.items() if name not in labels]
        for column in others[:1]:
            texts = [cell for cell in column.cells if isinstance(cell, str) and not is_blank(cell)]
            n = len(column.cells)
            is_of_texts = len(texts) == n and column.numbers is None and not column.problem
            if is_of_texts and 9 * n <= 10 * len({*texts}):
                labels.insert(0, column.name)
    if labels:
        return labels[0]
    return None


# From designs to a table


def _table(
    designs: _Designs,
    formulation: Formulation,
    variables: Names | None,
    drop_incomplete: bool,
) -> TestTable:
    """Return the table of designs; the columns that a formulation needs must be readable."""
    cells, columns, labels, remarks = designs
    head = cells.head
    objectives, variables = _roles(designs, formulation, variables)
    F = np.column_stack([columns[name].require_numbers() for name in objectives])
    if not formulation.objectives and not head["objectives"] and _are_row_numbers(F[:, 0]):
        remarks.append(
            f"{objectives[0]}, taken as an objective, counts the rows; "
            "if it only numbers designs, name the objectives."
        )
    values = {name: _values(columns[name]) for name in variables}
    uncertain = [name for name in variables if not values[name]]
    if uncertain:
        listed_names = ", ".join(uncertain)
        remarks.append(f"No variable, as not all of its values are certain: {listed_names}.")
        values = {name: column for name, column in values.items() if column}
    outputs = {}
    extra: dict[str, Sequence[Any]] = {}
    for name, column in columns.items():
        if name in objectives or name in values:
            continue
        is_numeric = column.numbers is not None and name not in labels
        if is_numeric or name in formulation.columns:
            outputs[name] = column.require_numbers()
        else:
            extra[name] = _extra_cells(column)
    remarks += _incomplete(cells, objectives, F, drop_incomplete)
    dependent = (*objectives, *outputs)
    used = (*values, *dependent)
    label, numbers = _names_and_numbers(cells, used, extra)
    layout = Layout.of(
        [*values],
        objectives,
        outputs=[*outputs],
        maximize=[name for name in head["maximized"] if name in dependent],
        units=units_of(used, head["units"]),
    )
    layout = replace(layout, label=label)
    X: Any = np.empty((len(F), 0))
    if values:
        X = [*map(list, zip(*values.values(), strict=True))]
    table = TestTable.of(numbers, X, F * layout.sign, outputs=outputs, layout=layout, extra=extra)
    stored = formulation_of_head(head)
    if {*head["objectives"]} != {*objectives}:
        stored = replace(stored, ranges=None)
    decimal = "."
    if any(column.decimal == "," for column in columns.values()):
        decimal = ","
    return replace(table, remarks=tuple(remarks), formulation=stored, decimal=decimal)


def _names_and_numbers(
    cells: Cells, used: Collection[str], extra: dict[str, Sequence[Any]]
) -> tuple[str | None, Sequence[int]]:
    """Return the column that names the designs, if one does, and the numbers of their tests.

    Args:
        cells: The cells.
        used: Names of variables, objectives and outputs.
        extra: The other columns. The rows of the source are added if no column names the designs;
            ``test_point``, a table's own name, is removed.
    """
    label = cells.label
    if label not in extra:
        label = "design" if "row" in used else "row"
        extra.setdefault(label, cells.rows)
    if "test_point" not in extra:
        return label, cells.rows
    numbers = extra.pop("test_point")
    if len({n for n in numbers if type(n) is int and n > 0}) < len(numbers):
        raise UnfitError("its column test_point must number the designs from 1; rename it")
    return None if label == "test_point" else label, numbers


def _roles(
    designs: _Designs, formulation: Formulation, variables: Names | None
) -> tuple[Names, Names]:
    """Return the names of the objectives and variables: as the user or the source says, or guessed.

    Raises:
        ArgumentValueError: A column is not there, or fewer than two may be objectives.
    """
    columns = designs.columns
    head = designs.cells.head
    objectives = formulation.objectives or head["objectives"]
    variables = variables or head["variables"]
    others = [name for name in columns if name not in variables]
    numbered, guessed = _numbered(others)
    if objectives:
        objectives = [name for name in objectives if name not in formulation.computed]
    else:
        objectives = numbered
        if not objectives:
            objectives = [name for name in _free(others) if _is_candidate(designs, name)]
        if len(objectives) < 2:
            received = ", ".join(map(repr, objectives)) or "none"
            raise UnfitError(
                "two columns or more must be of numbers and neither label nor result such as rank, "
                f"got {received}",
                "to rank by one alone, name it by --objectives",
            )
    numeric = [name for name, column in columns.items() if column.numbers is not None]
    for group, names in (("objectives", objectives), ("variables", variables)):
        for name in names:
            if name in columns:
                continue
            remedy = ""
            if name in _DERIVED:
                remedy = "such a column follows from others; rename it"
            known_name(group, name, numeric, remedy)
    return objectives, [name for name in variables or guessed if name not in objectives]


def _incomplete(cells: Cells, objectives: Names, F: Array, drop: bool) -> list[str]:
    """Refuse designs without finite objectives, or return a remark on them."""
    lacking = ~np.isfinite(F)
    rows = np.flatnonzero(lacking.any(axis=1)).tolist()
    if not rows:
        return []
    if len(rows) == len(F):
        raise UnfitError(f"none of its {counted(len(F), 'design')} has finite objectives")
    if not drop:
        place = cells.place(objectives[lacking[rows[0]].argmax()], rows[0])
        raise UnfitError(place, "leave out such designs by --drop-incomplete")
    places = list(map(cells.where, rows[:_N_LISTED]))
    if len(rows) > _N_LISTED:
        places.append("…")
    return [f"{counted(len(rows), 'incomplete design')} left out: {', '.join(places)}."]


def _are_row_numbers(values: Array) -> bool:
    """Say whether numbers count the rows; ranked by them, the first or the last would be best."""
    return len(values) >= 3 and np.array_equal(values, values[0] + np.arange(len(values)))


def _free(names: Collection[str]) -> list[str]:
    """Return the names that are neither labels nor columns of a ranking."""
    return [name for name in names if not _is_label(name) and name not in RANKING_NAMES]


def _numbered(names: Collection[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the objectives f1, f2, … and the variables x1, x2, … (or u1, u2, …) among names."""
    objectives = []
    variables = []
    for name in _free(names):
        if re.fullmatch(r"f\d+", name):
            objectives.append(name)
        elif re.fullmatch(r"[xu]\d+", name):
            variables.append(name)
    # One column called f1 without any x1 is no numbering, and says nothing about the others.
    if "f1" in objectives and (variables or len(objectives) > 1):
        return tuple(objectives), tuple(variables)
    return (), ()


def _is_candidate(designs: _Designs, name: str) -> bool:
    """Say whether a column is one of numbers; if that is not certain, it is refused."""
    column = designs.columns[name]
    if name in designs.labels:
        return False
    if column.problem or all(map(is_blank, column.cells)):
        column.require_numbers()
    return column.numbers is not None


def _values(column: Column) -> list[Any]:
    """Return the values of a variable; none if a design has none, or none that is certain."""
    if column.problem or any(map(is_blank, column.cells)):
        return []
    if column.numbers is not None:
        return _integers(column.cells) or column.numbers.tolist()
    texts = list(map(str, column.cells))
    if {*texts} <= {"True", "False"}:
        return [text == "True" for text in texts]
    return texts


def _extra_cells(column: Column) -> list[Any]:
    """Return the cells of a column without a role as a file holds them: time stamps as texts."""
    cells = _integers(column.cells)
    if not cells:
        for cell in column.cells:
            if cell is not None and not isinstance(cell, (str, int, float)):
                cell = str(cell)
            cells.append(cell)
    return cells


def _integers(cells: Sequence[Any]) -> list[Any]:
    """Return cells as integers; nothing if one is no integer."""
    integers = []
    for cell in cells:
        if not _INTEGER.fullmatch(str(cell)):
            return []
        integers.append(int(cell))
    return integers
