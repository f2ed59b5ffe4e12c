"""The designs of a file, as a page takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING

from pymoo_psi.table import read_designs

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class PageTable:
    """Designs and what their columns are, as :func:`decision_page` takes them.

    Attributes:
        frame: One row per design.
        objectives: Names of the columns with criteria.
        variables: Names of the columns with design variables.
        maximize: The objectives that the file says are to be maximised.
        label: Name of the column with the designs' numbers; None: the frame's index.
        prototype: Rows of existing designs, or None.
        remarks: What to know about the choice of rows and columns, in short sentences.

    Example:
        >>> import pandas as pd
        >>> frame = pd.DataFrame({"f1": [0, 1, 4], "f2": [4, 1, 0], "x1": [1, 2, 3]})
        >>> PageTable(frame, objectives=("f1", "f2"), variables=("x1",)).label is None
        True
    """

    frame: pd.DataFrame
    objectives: tuple[str, ...]
    variables: tuple[str, ...] = ()
    maximize: tuple[str, ...] = ()
    label: str | None = None
    prototype: pd.DataFrame | None = None
    remarks: tuple[str, ...] = ()


def table_from_file(
    path: str | PathLike[str],
    *,
    objectives: Sequence[str] | None = None,
    variables: Sequence[str] | None = None,
) -> PageTable:
    """Read designs from a file; see :func:`pymoo_psi.table.read_designs`.

    Args:
        path: A CSV of designs, a test table or a study.
        objectives: Names of the columns with criteria. Unless given: those the file names; else
            f1, f2, … with variables x1, x2, …, if there are any; else all columns of numbers.
        variables: Names of the columns with design variables, likewise.

    Raises:
        ArgumentValueError: The file is empty, no table, or lacks a column.
        StudyError: It is a database but no study, or a damaged one.
        OSError: The file cannot be opened.

    Example:
        >>> import os, tempfile
        >>> import pandas as pd
        >>> designs = pd.DataFrame({"name": ["A", "B"], "x1": [1, 2], "f1": [0, 4], "f2": [4, 0]})
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     designs.to_csv(os.path.join(folder, "designs.csv"), index=False)
        ...     table = table_from_file(os.path.join(folder, "designs.csv"))
        >>> table.objectives, table.variables, table.label
        (('f1', 'f2'), ('x1',), 'name')
    """
    file = read_designs(path)
    roles = file.roles(objectives, variables)
    frame = file.frame(roles.objectives)
    label = roles.label
    if label == "":  # the row labels of a data frame
        frame, label = frame.set_index(label).rename_axis("row"), None
    elif label is None:
        frame = frame.set_axis(frame.index + 1).rename_axis("row")
    told = [file.told(roles)] if objectives is None else []
    remarks = (*told, *([file.remark] if file.remark else []))
    return PageTable(
        frame, roles.objectives, roles.variables, roles.maximize, label, file.prototype,
        remarks,
    )  # fmt: skip
