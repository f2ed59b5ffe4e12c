"""From a source of any kind to a table: :func:`read_table` is the only way to open one."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, counted, invalid, known_name, real_array
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import RANKING_COLUMNS
from pymoo_psi.table._cells import (
    Cells,
    Column,
    UnfitError,
    cells_of_frame,
    in_a_line,
    is_blank,
    read_columns,
    require_designs,
)
from pymoo_psi.table._formats import SourceFile, recognized, tests_of_folder
from pymoo_psi.table._formulation import Formulation
from pymoo_psi.table._head import (
    DESIGNS_MARK,
    HEAD_REMEDY,
    Head,
    StoredTests,
    described,
    formulation_head,
    formulation_of_head,
    is_of_tests,
    table_of,
    tests_of_rows,
)
from pymoo_psi.table._layout import RESERVED, Layout
from pymoo_psi.table._limits import limits_of
from pymoo_psi.table._table import TestTable
from pymoo_psi.table._tests import STATUSES

# Columns that name designs, and those that number the rows of a file, which names of its designs
# say better. Not "no", which is also an exhaust gas.
_NAMING = ("test_point", "number", "label", "name", "id", "design")
_LABELS = (*_NAMING, "row", "index", "nr", "nr.", "no.", "nummer", "#", "unnamed: 0")
_DERIVED = (*RANKING_COLUMNS, "status", "violated", "reason")  # follow from the others
# As programs write integers, so not 007, a label. 18 digits are below 2^63.
_WHOLE = re.compile(r"-?(?:0|[1-9][0-9]{0,17})")


def read_table(
    source: str | PathLike[str] | Any,
    formulation: Formulation | None = None,
    *,
    variables: Sequence[str] | None = None,
    drop_incomplete: bool = False,
    decimal: str | None = None,
    thousands: str | None = None,
    encoding: str | None = None,
    skip_rows: Collection[int] = (),
    sheet: str | None = None,
) -> TestTable:
    r"""Return the table in a source of any kind, which is read once, so that it may be a pipe.

    A table of tests keeps its layout. Other designs are feasible, without bounds, and their numbers
    are the rows of the source from 1. Their objectives are those that the formulation names, or
    that the source tells, as our rankings and the page's exports do; or f1, f2, … beside x1, x2, …;
    or all columns of numbers but labels. Other columns of numbers become outputs, the rest
    ``extra``. What a reader must know about rows, such as missing shares, is in ``remarks``.

    A number in a text that can be read in two ways, such as ``1.250`` where nothing tells whether
    points divide thousands, is refused with the option that settles it, and so is a column that
    looks like numbers but holds others. With the objectives named, only the columns that the
    formulation names must be readable.

    Args:
        source: A path: a study or a folder of studies; text with commas, semicolons, tabs, bars or
            spaces between its cells; a workbook (.xlsx); a test table as either; a ranking that
            ``pymoo-psi rank --out`` wrote; an export of the page. Or a data
            frame, an ``(n, m)`` array of objectives, all minimised, or a :class:`TestTable`.
        formulation: What is asked; see :meth:`TestTable.under`.
        variables: Names of the columns with design variables; as the source tells unless given.
        drop_incomplete: Let designs without a finite objective fail, instead of refusing them.
        decimal: The decimal mark of texts, ``"."`` or ``","``.
        thousands: The mark between thousands, ``"."``, ``","``, ``" "`` or ``"'"``.
        encoding: Of a text; by its byte-order mark, or UTF-8, unless given.
        skip_rows: Numbers of lines to leave out, from 1, such as titles and lines of units.
        sheet: Name of the sheet of a workbook; the only one unless given.

    Raises:
        OSError: The file cannot be opened.
        ArgumentValueError: It is no table of named columns with one design or more; a row of it
            summarises others; a column that is needed cannot be read; or the formulation does not
            fit.
        StudyError: It is a database but no study, or a damaged one.
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
    skipped = frozenset(skip_rows)
    path = Path(source) if isinstance(source, (str, PathLike)) else None
    try:
        content: TestTable | StoredTests | Cells
        if path is not None:
            content = _read(path, encoding, skipped, sheet)
        elif isinstance(source, TestTable):
            content = source
        else:
            content = _cells_of(source)
        if skipped and not (isinstance(content, Cells) and content.lines):
            rule = "left out, as the source is neither a text of designs nor a workbook"
            raise invalid("skip_rows", rule, skip_rows)
        if variables and not isinstance(content, Cells):
            rule = "left out for a table of tests, which has its own"
            raise invalid("variables", rule, variables)
        if isinstance(content, TestTable):
            table = content
        elif isinstance(content, StoredTests):
            table = table_of(content.head, content.columns, path, TestTable, content.remarks)
        else:
            asked = formulation or Formulation()
            _require_directions(content, asked)
            cells, columns, remarks = _designs(content, decimal, thousands)
            table = _table(cells, columns, asked, variables, remarks, drop_incomplete)
    except UnfitError as error:
        raise ArgumentValueError(f"{path or 'the source'}: {error}") from None
    try:
        return table if formulation is None else _under(table, formulation)
    except ArgumentValueError as error:
        raise ArgumentValueError(f"{path}: {error}" if path else str(error)) from None


def _under(table: TestTable, formulation: Formulation) -> TestTable:
    """Return the table of a source under a formulation; limits that it leaves open are its own."""
    limits = {**limits_of(table.formulation.limits), **limits_of(formulation.limits)}
    normalize = table.formulation.normalize and formulation.normalize
    return table.under(replace(formulation, limits=limits, normalize=normalize))


def designs_head(designs: TestTable, columns: Sequence[str], numbers: Collection[str]) -> Head:
    """Return what a file of designs says of its columns; empty if needless.

    It is needed where the names of the columns do not tell the objectives, where one is to be
    maximized, a column has a unit, or a design is chosen: so that :func:`read_table` reads what
    was written.

    Args:
        designs: The designs of the file, as a table.
        columns: Names of all columns of the file.
        numbers: Those that hold numbers.
    """
    layout = designs.layout
    guessed = _guess(columns, numbers.__contains__)[0]
    units = {name: unit for name, unit in layout.units.items() if name in columns}
    asked = formulation_head(designs.formulation)
    for name in ("limits", "normalize"):  # the designs keep the limits
        asked.pop(name, None)
    if guessed == layout.objectives and not (layout.maximize or units or asked):
        return {}
    names = {"objectives": layout.objectives, "maximized": layout.maximize}
    names["variables"] = layout.variables
    return {DESIGNS_MARK: 1, **names, "units": units, **asked}


def _require_directions(cells: Cells, asked: Formulation) -> None:
    """Refuse the frame of a test table: without directions all objectives would be minimized."""
    if {*RESERVED[1:]} <= {*cells.columns} and not (cells.head or asked.objectives):
        rule = "a whole test table, or its frame with the objectives named"
        remedy = "give the table itself, or Formulation(objectives=..., maximize=...)"
        raise invalid("source", rule, Received("a part of one"), remedy)


# From sources to cells


def _read(
    path: Path,
    encoding: str | None,
    skip_rows: Collection[int],
    sheet: str | None,
) -> StoredTests | Cells:
    """Return what a file or a folder of studies holds; its content tells the format."""
    if path.is_dir():
        return tests_of_folder(path)
    with path.open("rb") as stream:
        file = SourceFile(path, stream, encoding, skip_rows, sheet)
        file_format = recognized(file)
        if sheet is not None and not file_format.has_sheets:
            raise invalid("sheet", f"left out, as {path} is no workbook (.xlsx)", sheet)
        content = file_format.read(file)
    if isinstance(content, Cells) and is_of_tests(content.head):
        rows = zip(*content.columns.values(), strict=True)
        with described(path):
            return tests_of_rows(content.head, [[*content.columns], *rows], str)
    return content


def _cells_of(source: Any) -> Cells:
    """Return the cells of a data frame, or of an array of objectives."""
    import pandas as pd

    if isinstance(source, pd.DataFrame):
        return cells_of_frame(source)
    F = real_array("source", source, "or give the path of a file")
    if F.ndim != 2 or F.size == 0:
        raise invalid("source", "of shape (n, m)", Received(f"shape {F.shape}"))
    names = [f"f{j + 1}" for j in range(F.shape[1])]
    columns = dict(zip(names, F.T.tolist(), strict=True))
    return Cells(columns, head={"objectives": names})


# From cells to tables


def _designs(
    cells: Cells, decimal: str | None, thousands: str | None
) -> tuple[Cells, dict[str, Column], list[str]]:
    """Return the rows that are feasible designs, with their label and numbers, and remarks."""
    columns = {name: column for name, column in cells.columns.items() if name not in _DERIVED}
    n = len(next(iter(cells.columns.values()), ()))
    # A column status of somebody else's, with other words in it, selects nothing.
    status = [*map(str, cells.columns.get("status", ["ok"] * n))]
    foreign = not {*status} <= {*STATUSES}
    counts = np.array([word == "ok" or foreign for word in status])
    if {"mark", *RANKING_COLUMNS[:-1]} <= {*cells.columns}:  # as the page exports
        counts &= np.array([mark != "prototype" for mark in columns.pop("mark")])
    taken = np.flatnonzero(counts).tolist()
    if not taken:
        raise UnfitError(f"none of its {counted(n, 'design')} is feasible")
    # Every row of a ranking is a design, whatever it is called: a summary has no place in the set.
    pareto = {str(cell).lower() for cell in cells.columns.get("pareto", ())}
    ranked = {*RANKING_COLUMNS} <= {*cells.columns} and pareto <= {"true", "false"}
    # A failed design may hold anything, so it is left out before numbers are read.
    columns = {name: [column[i] for i in taken] for name, column in columns.items()}
    lines = [cells.lines[i] for i in taken if cells.lines]
    cells = replace(cells, columns=columns, rows=[i + 1 for i in taken], lines=lines)
    read = read_columns(cells, decimal, thousands, [*filter(_is_label, columns)])
    cells = replace(cells, label=cells.label or _label(read))
    if not ranked:
        labels = _labels(cells)
        own = [c for c in read.values() if c.numbers is None or c.name not in labels]
        require_designs(cells, own)
    lost = n - len(taken)
    return cells, read, [f"{counted(lost, 'design')} left out as not feasible."] if lost else []


def _checked_head(head: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a source says of its columns."""
    try:
        checked = {
            key: tuple(map(in_a_line, head.get(key, ())))
            for key in ("objectives", "maximized", "variables", "chosen")
        }
        units = {in_a_line(name): str(unit) for name, unit in head.get("units", {}).items()}
        ranges = {in_a_line(name): [*ends] for name, ends in head.get("ranges", {}).items()}
    except (TypeError, AttributeError):
        what = "what it says of its columns is damaged or of a later version"
        raise UnfitError(f"{what}; {HEAD_REMEDY}") from None
    return checked | {"units": units, "ranges": ranges}


def _table(
    cells: Cells,
    columns: Mapping[str, Column],
    asked: Formulation,
    variables: Sequence[str] | None,
    remarks: list[str],
    drop_incomplete: bool,
) -> TestTable:
    """Return the table of designs; the columns that a formulation needs must be readable."""
    head, labels, n = _checked_head(cells.head or {}), _labels(cells), len(cells.rows)
    objectives, named = _roles(columns, head, labels, asked, variables)
    F = np.column_stack([np.empty((n, 0)), *(columns[name].required() for name in objectives)])
    guessed = not asked.objectives and not head["objectives"]
    # Ranked by the number of the design, any other would be the best.
    if guessed and n >= 3 and np.array_equal(F[:, 0], F[0, 0] + np.arange(n)):
        remedy = "if it only numbers designs, name the objectives"
        remarks.append(f"{objectives[0]}, taken as an objective, counts the rows; {remedy}.")
    design = {name: _values(columns[name]) for name in named}
    if lacking := [name for name, values in design.items() if not values]:
        remarks.append(f"No variable, as not all of its values are certain: {', '.join(lacking)}.")
    design = {name: values for name, values in design.items() if values}
    taken = {*objectives, *design}
    numeric = {name for name, c in columns.items() if c.numbers is not None and name not in labels}
    needed = ({*asked.columns} | numeric) - taken
    outputs = {name: column.required() for name, column in columns.items() if name in needed}
    taken |= {*outputs}
    remarks += _incomplete(cells, objectives, F, drop_incomplete)
    extra = {
        name: _integers(column.cells) or [*map(_plain, column.cells)]
        for name, column in columns.items()
        if name not in taken
    }
    free = "row" if "row" not in taken else "design"
    label: str | None = cells.label if cells.label in extra else free
    extra.setdefault(label or free, [*cells.rows])
    numbers = cells.rows
    if "test_point" in extra:  # a table's own name, which no further column can have
        numbers = extra.pop("test_point")
        if len({number for number in numbers if type(number) is int and number > 0}) < n:
            raise UnfitError("its column test_point must number the designs from 1; rename it")
        label = None if label == "test_point" else label
    layout = Layout.of(
        [*design],
        objectives,
        outputs=[*outputs],
        maximize=[name for name in head["maximized"] if name in {*objectives, *outputs}],
        units={name: unit for name, unit in head["units"].items() if name in taken},
    )
    layout = replace(layout, label=label)
    X = [*map(list, zip(*design.values(), strict=True))] or np.empty((n, 0))
    table = TestTable.of(numbers, X, F * layout.sign, outputs=outputs, layout=layout, extra=extra)
    formulation = formulation_of_head(head)
    if {*head["objectives"]} != {*objectives}:
        formulation = replace(formulation, ranges=None)
    return replace(table, remarks=tuple(remarks), formulation=formulation)


def _roles(
    columns: Mapping[str, Column],
    head: Mapping[str, Any],
    labels: Collection[str],
    asked: Formulation,
    named: Sequence[str] | None,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return which columns are objectives and variables: as named, as told, else by their names."""

    def is_candidate(name: str) -> bool:
        column = columns[name]
        # Refused if it is not certain whether it is one.
        if name not in labels and (column.problem or all(map(is_blank, column.cells))):
            column.required()
        return name not in labels and column.numbers is not None

    variables = tuple(named or head["variables"])
    if told := asked.objectives or head["objectives"]:
        objectives = tuple(name for name in told if name not in asked.computed)
        guessed = _guess(columns, lambda name: False)[1]
    else:
        objectives, guessed = _guess([n for n in columns if n not in variables], is_candidate)
        if len(objectives) < 2:
            found = ", ".join(map(repr, objectives)) or "none"
            what = (
                "two columns or more must be of numbers and neither label nor result such as rank"
            )
            raise UnfitError(f"{what}, got {found}; to rank by one alone, name it by --objectives")
    for group, names in (("objectives", objectives), ("variables", variables)):
        for name in names:
            remedy = "such a column follows from others; rename it" if name in _DERIVED else ""
            known_name(group, name, columns, remedy)
    variables = variables or tuple(name for name in guessed if name in columns)
    return objectives, tuple(name for name in variables if name not in objectives)


def _incomplete(
    cells: Cells, names: Sequence[str], F: NDArray[np.float64], drop: bool
) -> list[str]:
    """Refuse designs without finite objectives, or return a remark on them."""
    lacking = ~np.isfinite(F)
    rows = np.flatnonzero(lacking.any(axis=1))
    if len(rows) == len(F):
        raise UnfitError(f"none of its {counted(len(F), 'design')} has finite objectives")
    if len(rows) and not drop:
        i, name = rows[0], names[lacking[rows[0]].argmax()]
        cell = cells.columns[name][i]
        what = "no number" if is_blank(cell) else str(cell).strip()
        where = f"{cells.where(i)} holds {what:.40} in the column {name!r}"
        raise UnfitError(f"{where}; leave out such designs by --drop-incomplete")
    listed = ", ".join(map(cells.where, rows[:6])) + ", …" * (len(rows) > 6)
    return [f"{counted(len(rows), 'incomplete design')} left out: {listed}."][: len(rows)]


def _guess(
    names: Collection[str], is_candidate: Callable[[str], bool]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the objectives and variables of a source that does not tell them, by their names.

    With columns f1, f2, … these are the objectives, and x1, x2, … (or u1, u2, …) the variables;
    otherwise all columns of numbers are objectives, apart from labels and those of a ranking.
    """
    free = [name for name in names if not _is_label(name) and name not in RANKING_COLUMNS]
    numbered = tuple(name for name in free if re.fullmatch(r"f\d+", name))
    variables = tuple(name for name in free if re.fullmatch(r"[xu]\d+", name))
    # One column called f1 without any x1 is no numbering, and says nothing about the others.
    if "f1" in numbered and (variables or len(numbered) > 1):
        return numbered, variables
    return tuple(name for name in free if is_candidate(name)), ()


def _is_label(name: str) -> bool:
    return name.strip().lower() in _LABELS


def _label(columns: Mapping[str, Column]) -> str | None:
    """Return the column that names the designs, as its name tells.

    Where that only numbers rows, or none does, it is the first of the others, if it holds texts,
    nine of ten another: so people write lists, under "Variante" as under "Model".
    """
    labels = sorted(filter(_is_label, columns), key=lambda n: _LABELS.index(n.strip().lower()))
    if labels and labels[0].strip().lower() in _NAMING:
        return labels[0]
    name = next((name for name in columns if name not in labels), "")
    if name and columns[name].numbers is None and not columns[name].problem:
        cells = columns[name].cells
        texts = [c for c in cells if isinstance(c, str) and not is_blank(c)]
        if len(texts) == len(cells) and 10 * len({*texts}) >= 9 * len(texts):
            return name
    return labels[0] if labels else None


def _labels(cells: Cells) -> set[str]:
    """Return the columns that number or name designs."""
    return {name for name in cells.columns if _is_label(name) or name == cells.label}


def _values(column: Column) -> list[Any]:
    """Return the values of a variable; none if a design has none, or none that is certain."""
    if column.problem or any(map(is_blank, column.cells)):
        return []
    if column.numbers is not None:
        return _integers(column.cells) or column.numbers.tolist()
    texts = [str(cell) for cell in column.cells]
    return [text == "True" for text in texts] if {*texts} <= {"True", "False"} else texts


def _plain(cell: Any) -> Any:
    """Return a cell that no role has as a file holds it: a time stamp as a text."""
    return cell if cell is None or isinstance(cell, (str, int, float)) else str(cell)


def _integers(cells: Sequence[Any]) -> list[int]:
    """Return cells as integers, if all of them are."""
    whole = all(_WHOLE.fullmatch(str(cell)) for cell in cells)
    return [int(cell) for cell in cells] if whole else []
