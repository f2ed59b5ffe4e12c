"""From a frame of designs to the page: checked, ranked, put in the order of drawing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import Received, boolean, invalid, known_name
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.page._data import Column, DecisionPage, Role, text_column
from pymoo_psi.page._decision import Decision
from pymoo_psi.pareto import rank_of_efficiency
from pymoo_psi.table import Bounds, Limit, TestTable, ends, within
from pymoo_psi.table._design_file import design_ids

if TYPE_CHECKING:
    import pandas as pd


def decision_page(
    frame: pd.DataFrame | TestTable,
    objectives: Sequence[str] = (),
    *,
    variables: Sequence[str] = (),
    outputs: Sequence[str] = (),
    maximize: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
    label: str | None = None,
    normalize: bool = True,
    prototype: pd.DataFrame | Mapping[str, Any] | None = None,
    limits: Mapping[str, Limit] | None = None,
    decision: str | PathLike[str] | None = None,
    failed: Mapping[str, int] | None = None,
    infeasible: int = 0,
    title: str = "Pareto set",
) -> DecisionPage:
    """Return a page to decide on a Pareto set with, to be saved as one HTML file.

    On top stands the best compromise (:func:`pymoo_psi.rank_of_efficiency`) among the designs that
    are left under the limits that the reader sets, why it is that, and what others would cost.
    Linked plots and a table show what is left, which is compared, chosen from and exported as CSV;
    limits, choice and reason are kept in the address of the page and in a decision file. Designs
    without a finite value of every objective are left out and counted.

    Args:
        frame: A test table, which knows which of its columns is what: then the arguments from
            ``objectives`` to ``units`` are left out, and its designs that are feasible are on the
            page, the others counted. Or a frame with one row per design, one or more, all of them
            feasible.
        objectives: Names of the columns with the criteria, of a frame.
        variables: Names of the columns with the design variables. Numbers, which may be missing,
            are plotted and limited; of texts some can be chosen.
        outputs: Names of the columns with what else a model gave, likewise.
        maximize: Names of the objectives, and of outputs, of which more is better.
        units: Units of columns by name.
        label: Name of the column with the designs' numbers or names; the frame's index unless
            given. Designs of one label have their row behind it, "A #3": of the frame's index if
            this is called "row", else counted from 1.
        normalize: Rank with each objective in units of its range.
        prototype: An existing design, or several as a frame, with a value for each objective.
            It is not ranked and stays on the page whatever the limits, compared with the best.
        limits: Limits that are set when the page opens and that its reader can move, on objectives,
            variables and outputs: ``(lower, upper)`` with ``None`` for an open end. A number is the
            worse end: at most this, or at least where more is better.
        decision: A decision file that a page has saved; the page opens with what was decided.
        failed: How many more designs failed, by reason; told on the page.
        infeasible: How many designs violate constraints; told on the page.
        title: Heading of the page.

    Returns:
        The page: what it shows as data, ``.html()`` and ``.save(path)``.

    Raises:
        ArgumentValueError: A name is not a column or occurs twice; no design has all objectives;
            a design has the ``status`` "infeasible" of a test table; the limits leave none; the
            decision is about other criteria, directions or columns; a test table is given what it
            knows.
        ArgumentTypeError: An objective is not numbers, or an argument has a wrong type.
        OSError: The decision file cannot be opened.

    Example:
        >>> import pandas as pd
        >>> frame = pd.DataFrame({"cost": [0, 1, 4], "mass": [4, 1, 0]}, index=["A", "B", "C"])
        >>> page = decision_page(frame, ["cost", "mass"], units={"mass": "kg"}, title="Brackets")
        >>> page, page.optima
        (DecisionPage('Brackets': 3 designs), ['B'])
    """
    import pandas as pd

    if isinstance(frame, TestTable):
        told = {"objectives": objectives, "variables": variables, "outputs": outputs,
                "maximize": maximize, "units": units}  # fmt: skip
        for argument, value in told.items():
            if value:
                remedy = "ask anew by table.under(...), or give table.to_frame()"
                raise invalid(argument, "left out, as a test table knows it", value, remedy)
        layout, status = frame.layout, frame.status
        numbers = frame.numbers[status == "failed"].tolist()
        reasons = [frame.reasons.get(number, "no reason is known") for number in numbers]
        failed = Counter(reasons) + Counter(failed or {})
        infeasible += int((status == "infeasible").sum())
        objectives, variables, outputs = layout.objectives, layout.variables, layout.outputs
        maximize = layout.maximize
        # It may have units of constraints, and of outputs that no test has given.
        shown = (*objectives, *variables, *outputs)
        units = {name: layout.units[name] for name in shown if name in layout.units}
        frame = frame.rows(frame.feasible()).to_frame()
    if not isinstance(frame, pd.DataFrame):
        raise ArgumentTypeError(
            f"frame must be a pandas.DataFrame or a TestTable, got {type(frame).__name__}; of "
            f"pymoo's res.F give pd.DataFrame(res.F, columns=names), and names as objectives"
        )
    _check_columns(
        frame, {"objectives": objectives, "variables": variables, "outputs": outputs}, label
    )
    others = [*variables, *outputs]
    # The frame of a whole test table: its infeasible designs would be ranked as any other.
    if "status" in frame and (frame["status"] == "infeasible").any():
        raise invalid(
            "frame",
            "of feasible designs",
            Received(f"{(frame['status'] == 'infeasible').sum()} with the status 'infeasible'"),
            "of a test table give table.rows(table.feasible()).to_frame()",
        )
    for name in maximize:
        known_name("maximize", name, [*objectives, *outputs])
    for name in units or {}:
        known_name("units", name, [*objectives, *others])
    F = np.column_stack([_numbers(frame, name) for name in objectives])
    frame, F, lost = _complete(frame, F, objectives)
    for name, least, greatest in zip(objectives, F.min(axis=0), F.max(axis=0), strict=True):
        # Limits may leave any designs, and the page divides by their range.
        if not np.isfinite(float(greatest) - float(least)):
            received = Received(f"{least} to {greatest}")
            raise invalid(f"column {name!r}", "of finite range", received)
    more = [name for name in objectives if name in maximize]
    normalize = boolean("normalize", normalize)
    ranking = rank_of_efficiency(
        pd.DataFrame(F, columns=list(objectives)), normalize=normalize, maximize=more
    )
    labels = _labels(frame.index if label is None else frame[label])
    # Designs of one label go by the rows of their file where these are known, as in commands.
    rows = frame.index.tolist() if label is not None and frame.index.name == "row" else ()
    ids = design_ids(labels.tolist(), rows)
    # Prototypes stand behind the designs and are not ranked: they must not move U and N.
    existing = _prototype_frame(prototype, objectives, label)
    used = [*objectives, *others, *([] if label is None else [label])]
    whole = frame
    if len(existing):
        for name in objectives:
            _numbers(existing, name, finite=True)
        whole = pd.concat([frame, existing.reindex(columns=used)])
        labels = _labels(whole.index if label is None else whole[label])
        # One of them may be called as one of the others is.
        for called in map(str, labels[len(frame) :].tolist()):
            same = called in ids
            ids.append(f"{called} (existing {len(ids) - len(frame) + 1})" if same else called)
    opens_with: Mapping[str, Any] = {}
    remarks: tuple[str, ...] = ()
    if decision is not None:
        if limits is not None:
            raise invalid("limits", "left out beside a decision, which has its own", limits)
        decided = Decision.read(decision)
        if decided.normalize is not normalize:
            raise invalid("normalize", f"{decided.normalize}, as it was decided", normalize)
        decided.require("the frame", objectives, maximize, units or {}, [*objectives, *others])
        opens_with, limits = decided.state, decided.limits
        remarks = tuple(decided.now(ids, whole))
    bounds = _bounds(limits or {}, frame, [*objectives, *others], maximize)
    return DecisionPage(
        title=str(title),
        columns=_columns(whole, objectives, variables, outputs, maximize, units or {}),
        label_name=label or str(frame.index.name or "design"),
        labels=labels,
        ids=ids,
        n_designs=len(frame),
        ranking=ranking,
        limits=bounds,
        opens_with=opens_with,
        remarks=remarks,
        failed=lost + Counter(failed or {}),
        infeasible=infeasible,
    )


def _check_columns(
    frame: pd.DataFrame, groups: Mapping[str, Sequence[str]], label: str | None
) -> None:
    for argument, names in groups.items():
        if isinstance(names, str):
            raise ArgumentTypeError(f"{argument} must be a list of names, got {names!r}")
    if not groups["objectives"]:
        remedy = "say which columns are objectives, as in decision_page(frame, ['cost', 'mass'])"
        raise invalid("objectives", "names of one column or more", [], remedy)
    have = [str(name) for name in frame.columns]
    seen: set[str] = set()
    for argument, names in [*groups.items(), ("label", [] if label is None else [label])]:
        for name in names:
            known_name(argument, name, have)
            if name in seen or have.count(name) > 1:
                raise invalid(argument, "columns that are named once", name)
            seen.add(name)


def _complete(
    frame: pd.DataFrame, F: NDArray[np.float64], objectives: Sequence[str]
) -> tuple[pd.DataFrame, NDArray[np.float64], Counter[str]]:
    """Return the designs with all objectives, these, and how many lack which first."""
    known = np.isfinite(F)
    kept = known.all(axis=1)
    if not kept.any():
        rule = "of one design or more with a finite value of every objective"
        raise invalid("frame", rule, Received(f"none in {len(F)} rows"))
    first = (~known[~kept]).argmax(axis=1)
    lost = Counter(f"no finite {objectives[j]}" for j in np.sort(first).tolist())
    return frame.iloc[np.flatnonzero(kept)], F[kept], lost


def _bounds(
    limits: Mapping[str, Limit], frame: pd.DataFrame, names: Sequence[str], maximize: Sequence[str]
) -> Bounds:
    """Return the least and the greatest value of limited columns; some design must keep them."""
    bounds = {}
    for name, limit in limits.items():
        known_name("limits", name, names)
        worse_below = name in maximize and not isinstance(limit, (tuple, list))
        bounds[name] = ends(name, (limit, None) if worse_below else limit)
    left = within(bounds, lambda name: _numbers(frame, name), len(frame))
    if not left.any():
        rule = "kept by one design or more"
        raise invalid("limits", rule, Received(f"none of {len(frame)}"))
    return bounds


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
) -> tuple[Column, ...]:
    """Return the columns of the page, those of objectives first."""
    from pandas.api.types import is_numeric_dtype

    groups: list[tuple[Role, Sequence[str]]] = [
        ("criterion", objectives),
        ("variable", variables),
        ("output", outputs),
    ]
    columns = []
    for role, names in groups:
        for name in names:
            values: NDArray[Any] = (
                _numbers(whole, name)
                if role == "criterion" or is_numeric_dtype(whole[name])
                else text_column(whole[name].tolist())
            )
            more = role != "variable" and name in maximize
            columns.append(Column(name, units.get(name, ""), role, more, values))
    return tuple(columns)


def _numbers(frame: pd.DataFrame, name: str, *, finite: bool = False) -> NDArray[np.float64]:
    """Return the ``(n,)`` values of a column; NaN where they are missing, unless ``finite``."""
    from pandas.api.types import is_bool_dtype, is_numeric_dtype

    column = frame[name]
    if not (is_numeric_dtype(column) or is_bool_dtype(column)):  # pyarrow's bool is not numeric
        cells = column.tolist()
        row = next((i for i, cell in enumerate(cells) if not _is_number(cell)), 0)
        raise ArgumentTypeError(
            f"column {name!r} must be numbers, got {cells[row]!r:.40} in row {row + 1}"
        )
    values = column.to_numpy(dtype=np.float64, na_value=np.nan)
    if finite and not np.isfinite(values).all():
        row = int(np.flatnonzero(~np.isfinite(values))[0])
        raise invalid(f"column {name!r}", "finite", Received(f"{values[row]} in row {row + 1}"))
    return values


def _is_number(cell: Any) -> bool:
    try:
        float(cell)
    except (TypeError, ValueError):
        return False
    return True


def _labels(column: Any) -> NDArray[Any]:
    cells = column.tolist()
    if all(type(cell) is int and abs(cell) < 2**53 for cell in cells):
        return np.array(cells, dtype=np.int64)
    return text_column(cells)
