"""From a frame of designs to the page: checked, ranked, put in the order of drawing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._files import whole_file
from pymoo_psi._validation import Received, boolean, finite_number, invalid, known_name
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.page._data import (
    DOMINATED,
    OPTIMUM,
    PROTOTYPE,
    Column,
    PageData,
    Role,
    payload,
    text_column,
)
from pymoo_psi.page._document import html_of
from pymoo_psi.pareto import EfficiencyRanking, rank_of_efficiency

if TYPE_CHECKING:
    import pandas as pd


_GEOMETRIC = ("μ1 (to U)", "μ2 (to line UN)", "μ3 (along UN)")


@dataclass(frozen=True, eq=False, repr=False)
class DecisionPage(PageData):
    """A page to decide on a Pareto set with; :func:`decision_page` makes it.

    Attributes:
        title: Heading of the page.
        columns: Criteria, variables, outputs, then μ1, μ2, μ3, each with ``name``, ``unit``,
            ``role``, ``maximize`` and ``(n,)`` ``values``.
        label_name: What the designs' labels are called, such as "test_point".
        labels: ``(n,)`` labels of the designs, integers or texts, the best design last.
        rank: ``(n,)`` ranks of efficiency; -1 for prototypes.
        group: ``(n,)`` how a design is drawn: its rank, but -1 if it is dominated, 6 for the
            Salukvadze optimum whatever its rank, 7 for a prototype.
        n_designs: How many designs there are, shown or not, without prototypes.
        remarks: What a reader must know, in short sentences.
        normalize: Whether the criteria are measured in units of their ranges.
        limits: Limits the page opens with, by name of the criterion.

    Example:
        >>> import pandas as pd
        >>> from pymoo_psi.page import decision_page
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
        >>> decision_page(frame, ["cost", "mass"], title="Brackets")
        DecisionPage('Brackets': 3 of 3 designs)
    """

    def __repr__(self) -> str:
        """Return the title and how many designs are shown."""
        shown = int((self.group != PROTOTYPE).sum())
        return f"DecisionPage({self.title!r}: {shown} of {self.n_designs} designs)"

    def html(self) -> str:
        """Return the page as one HTML document that needs no network.

        Example:
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
            >>> html = decision_page(frame, ["cost", "mass"], title="Brackets").html()
            >>> html.startswith("<!DOCTYPE html>"), "Brackets" in html
            (True, True)
        """
        return html_of(self.title, payload(self))

    def save(self, path: str | PathLike[str]) -> None:
        """Write the page, whole or not at all.

        Raises:
            OSError: The file cannot be written there.

        Example:
            >>> import pathlib, tempfile
            >>> import pandas as pd
            >>> from pymoo_psi.page import decision_page
            >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]})
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = pathlib.Path(folder, "page.html")
            ...     decision_page(frame, ["cost", "mass"], title="Brackets").save(path)
            ...     "Brackets" in path.read_text("utf-8")
            True
        """
        html = self.html()
        with whole_file(path) as written:
            # A title may be the name of a file that is no Unicode.
            written.write_text(html, encoding="utf-8", errors="replace")


def decision_page(
    frame: pd.DataFrame,
    objectives: Sequence[str],
    *,
    variables: Sequence[str] = (),
    outputs: Sequence[str] = (),
    maximize: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    label: str | None = None,
    normalize: bool = True,
    prototype: pd.DataFrame | Mapping[str, Any] | None = None,
    limits: Mapping[str, float] | None = None,
    title: str = "Pareto set",
) -> DecisionPage:
    """Return a page to decide on a Pareto set with, to be saved as one HTML file.

    On top stands the best compromise (:func:`pymoo_psi.rank_of_efficiency`) among the designs that
    are left under the limits that the reader sets, why it is that, and what others would cost.
    Linked plots and a table show what is left, which is compared, chosen from and exported as CSV;
    limits, choice and reason are kept in the address of the page and in a decision file.

    Args:
        frame: One row per design, two or more.
        objectives: Names of the columns with the criteria; finite numbers.
        variables: Names of the columns with the design variables. Numbers, which may be missing,
            are plotted; texts are in the table only.
        outputs: Names of the columns with what else a model gave, likewise.
        maximize: Names of the objectives, and of outputs, of which more is better.
        units: Units of columns by name.
        label: Name of the column with the designs' numbers or names; the frame's index unless
            given.
        normalize: Rank with each objective in units of its range.
        prototype: An existing design, or several as a frame, with a value for each objective.
            It is not ranked and stays on the page whatever the limits.
        limits: Limits on objectives that are set when the page opens and that its reader can move:
            at most this, or at least for an objective of which more is better.
        title: Heading of the page.

    Returns:
        The page: what it shows as data, ``.html()`` and ``.save(path)``.

    Raises:
        ArgumentValueError: A name is not a column or occurs twice; there are fewer than two
            designs; an objective is missing somewhere or infinite; a limit leaves no design.
        ArgumentTypeError: An objective is not numbers, or an argument has a wrong type.

    Example:
        >>> import pandas as pd
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]}, index=["A", "B", "C"])
        >>> page = decision_page(frame, ["cost", "mass"], units={"mass": "kg"}, title="Brackets")
        >>> page, page.optima
        (DecisionPage('Brackets': 3 of 3 designs), ['B'])
    """
    import pandas as pd

    if not isinstance(frame, pd.DataFrame):
        raise ArgumentTypeError(f"frame must be a pandas.DataFrame, got {type(frame).__name__}")
    _check_columns(
        frame, {"objectives": objectives, "variables": variables, "outputs": outputs}, label
    )
    others = [*variables, *outputs]
    for name in maximize:
        known_name("maximize", name, [*objectives, *outputs])
    for name in units or {}:
        known_name("units", name, [*objectives, *others])
    if len(frame) < 2:
        rule = "of at least two designs to decide between"
        raise invalid("frame", rule, Received(f"{len(frame)} rows"))
    # Ranked as criteria that are all minimised; shown as the user has them.
    sign = np.array([-1.0 if name in maximize else 1.0 for name in objectives])
    F = np.column_stack([_numbers(frame, name, complete=True) for name in objectives])
    ranking = rank_of_efficiency(F * sign, normalize=boolean("normalize", normalize))
    order, remarks = _rows_to_show(ranking)
    _check_limits(limits or {}, frame, objectives, maximize)

    # Prototypes are measured by the U and N of the designs, which they must not move.
    extra = _prototype_frame(prototype, objectives, label)
    used = [*objectives, *others, *([] if label is None else [label])]
    mu = ranking.criteria[order]
    whole = frame.iloc[order]
    if len(extra):  # last, as they are drawn on top
        P = np.column_stack([_numbers(extra, name, complete=True) for name in objectives])
        mu = np.vstack([mu, ranking.frame.distances(P * sign)])
        whole = pd.concat([whole, extra.reindex(columns=used)])
    columns = _columns(whole, objectives, variables, outputs, maximize, units or {}, mu)
    return DecisionPage(
        title=str(title),
        columns=columns,
        label_name=label or str(frame.index.name or "design"),
        labels=_labels(whole.index if label is None else whole[label]),
        rank=np.concatenate([ranking.rank[order], np.full(len(extra), -1)]).astype(np.int32),
        group=np.concatenate(
            [_groups(ranking)[order], np.full(len(extra), PROTOTYPE, dtype=np.int32)]
        ),
        n_designs=len(frame),
        remarks=remarks,
        normalize=bool(normalize),
        limits=dict(limits or {}),
    )


def _check_columns(
    frame: pd.DataFrame, groups: Mapping[str, Sequence[str]], label: str | None
) -> None:
    for argument, names in groups.items():
        if isinstance(names, str):
            raise ArgumentTypeError(f"{argument} must be a list of names, got {names!r}")
    if not groups["objectives"]:
        raise invalid("objectives", "names of one column or more", [])
    have = [str(name) for name in frame.columns]
    seen: set[str] = set()
    for argument, names in [*groups.items(), ("label", [] if label is None else [label])]:
        for name in names:
            known_name(argument, name, have)
            if name in seen or have.count(name) > 1:
                raise invalid(argument, "columns that are named once", name)
            seen.add(name)


def _check_limits(
    limits: Mapping[str, float],
    frame: pd.DataFrame,
    objectives: Sequence[str],
    maximize: Sequence[str],
) -> None:
    for name, limit in limits.items():
        known_name("limits", name, list(objectives))
        # Beyond the best value no design would be left, and the page would open empty.
        value, best = finite_number(f"the limit on {name!r}", limit), frame[name].min()
        if name in maximize and value > (best := frame[name].max()):
            raise invalid(f"the limit on {name!r}", f"at most {best:g}, its best value", value)
        if name not in maximize and value < best:
            raise invalid(f"the limit on {name!r}", f"at least {best:g}, its best value", value)


def _groups(ranking: EfficiencyRanking) -> NDArray[np.int32]:
    """Return the ``(n,)`` groups of ranked designs; the optimum is one whatever its rank."""
    groups = np.where(ranking.pareto, ranking.rank, DOMINATED).astype(np.int32)
    groups[ranking.salukvadze] = OPTIMUM
    return groups


def _rows_to_show(ranking: EfficiencyRanking) -> tuple[NDArray[np.intp], tuple[str, ...]]:
    """Return the rows to show, the best last, and what is to be said about them."""
    group, mu1 = _groups(ranking), ranking.criteria[:, 0]
    order = np.lexsort((-mu1, group))  # the best last, since what is drawn last is on top
    remarks: list[str] = []
    if not (ranking.rank == 6).any():
        remarks.append("No design has rank 6: several are equally near to U.")
    return order, tuple(remarks)


def _prototype_frame(
    prototype: pd.DataFrame | Mapping[str, Any] | None,
    objectives: Sequence[str],
    label: str | None,
) -> pd.DataFrame:
    """Return the prototypes as rows, labelled "prototype" unless they say otherwise."""
    import pandas as pd

    if prototype is None:
        return pd.DataFrame(columns=list(objectives))
    if isinstance(prototype, Mapping):
        prototype = pd.DataFrame([dict(prototype)], index=["prototype"])
    if not isinstance(prototype, pd.DataFrame):
        shown = type(prototype).__name__
        raise ArgumentTypeError(f"prototype must be a mapping or a pandas.DataFrame, got {shown}")
    missing = [name for name in objectives if name not in prototype]
    if missing:
        rule = "a design with a value for every objective"
        raise invalid("prototype", rule, Received(f"none for {missing[0]!r}"))
    # Only an index that somebody has made holds names; pandas numbers rows by itself.
    if label is not None and label not in prototype:
        unnamed = isinstance(prototype.index, pd.RangeIndex)
        prototype = prototype.assign(**{label: "prototype" if unnamed else prototype.index})
    return prototype


def _columns(
    whole: pd.DataFrame,
    objectives: Sequence[str],
    variables: Sequence[str],
    outputs: Sequence[str],
    maximize: Sequence[str],
    units: Mapping[str, str],
    mu: NDArray[np.float64],
) -> tuple[Column, ...]:
    """Return the columns of the rows shown; ``mu`` are their ``(n, 3)`` geometric criteria."""
    from pandas.api.types import is_numeric_dtype

    # A field is a column's name within the page, free of the user's characters.
    columns = [
        Column(f"c{j}", name, units.get(name, ""), "criterion", name in maximize,
               _numbers(whole, name, complete=True))
        for j, name in enumerate(objectives)
    ]  # fmt: skip
    others: list[tuple[str, Role, Sequence[str]]] = [
        ("v", "variable", variables),
        ("o", "output", outputs),
    ]
    for letter, role, names in others:
        for j, name in enumerate(names):
            number = is_numeric_dtype(whole[name])
            values: NDArray[Any] = (
                _numbers(whole, name, complete=False)
                if number
                else text_column(whole[name].tolist())
            )
            field, unit = f"{letter}{j}", units.get(name, "")
            more = role == "output" and name in maximize
            columns.append(Column(field, name, unit, role, more, values))
    columns += [
        Column(f"mu{j + 1}", name, "", "geometric", False, mu[:, j])
        for j, name in enumerate(_GEOMETRIC)
    ]
    return tuple(columns)


def _numbers(frame: pd.DataFrame, name: str, *, complete: bool) -> NDArray[np.float64]:
    """Return the ``(n,)`` values of a column; NaN where they are missing, unless ``complete``."""
    from pandas.api.types import is_bool_dtype, is_numeric_dtype

    column = frame[name]
    if not (is_numeric_dtype(column) or is_bool_dtype(column)):  # pyarrow's bool is not numeric
        cells = column.tolist()
        row = next((i for i, cell in enumerate(cells) if not _is_number(cell)), 0)
        raise ArgumentTypeError(
            f"column {name!r} must be numbers, got {cells[row]!r:.40} in row {row + 1}"
        )
    values = column.to_numpy(dtype=np.float64, na_value=np.nan)
    bad = ~np.isfinite(values) if complete else np.isinf(values)
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        received = Received(f"{values[row]} in row {row + 1}")
        remedy = "leave out designs that failed" if complete else ""
        raise invalid(f"column {name!r}", "finite", received, remedy)
    return values


def _is_number(cell: Any) -> bool:
    try:
        float(cell)
    except (TypeError, ValueError):
        return False
    return True


def _labels(column: Any) -> NDArray[Any]:
    cells = column.tolist()
    if all(type(cell) is int and abs(cell) < 2**31 for cell in cells):
        return np.array(cells, dtype=np.int32)
    return text_column(cells)
