"""``pymoo-psi page``: from a file of designs to the page to decide on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pandas as pd

from pymoo_psi._validation import counted, invalid
from pymoo_psi.cli._decision import decided_designs
from pymoo_psi.cli._groups import ColumnOptions, DocumentOptions, FileOptions
from pymoo_psi.cli._options import designs_of, limits_in, read, units_in
from pymoo_psi.cli._output import require_output, say
from pymoo_psi.page import decision_page
from pymoo_psi.pareto import listed
from pymoo_psi.table import DesignFile, Formulation
from pymoo_psi.table._design_file import unfit


def run_page(
    path: Path,
    columns: ColumnOptions,
    written: FileOptions,
    document: DocumentOptions,
    *,
    prototype: Path | None,
    out: Path,
    force: bool,
) -> int:
    """Write the page and say where it is.

    It opens with the limits that are given, or with those of a decision. Existing designs to
    compare with are those of the file ``prototype``, if one is given, and else those of ``path``.
    """
    decision, normalize = document.decision, not document.no_normalize
    require_output(out, (".html", ".htm"), path, prototype, decision, by="page", force=force)
    # Designs that failed are counted on the page.
    written = replace(written, drop_incomplete=True)
    decided = None
    if decision is None:
        file, roles, remarks = designs_of(
            path, replace(columns, limits=()), written, document.variables
        )
        limits = limits_in(columns.limits, file.names, roles.objectives, roles.maximize)
    else:
        file, roles, remarks, decided = decided_designs(
            path, columns, written, decision, normalize, document.variables
        )
        limits, normalize = {}, decided.normalize
    # What is neither label nor text can be limited on the page, whatever its role.
    others = [
        name
        for name in ((*limits,) if decided is None else (*decided.limits, *decided.categories))
        if name not in (*roles.objectives, *roles.variables, *roles.outputs, roles.label)
    ]
    roles = replace(roles, outputs=(*roles.outputs, *others))
    # The label is no column of the page: limits on it leave designs out.
    if roles.label in limits:
        asked = Formulation(limits={roles.label: limits.pop(roles.label)})
        file = replace(file, known=roles, remarks=()).under(asked)
        remarks += file.remarks
    frame = file.frame(roles.objectives)
    if len(frame) < 2:
        raise unfit(path, "there is one design, and nothing to decide")
    # Designs without a label go by their row of the file, counted from 1 as spreadsheets do.
    frame.index = pd.Index(file.rows, name="row")
    existing = file.prototype
    if prototype is not None:
        if not prototype.exists():  # mostly the name of a design
            remedy = f"designs of {path.name} itself are compared on the page"
            raise invalid("--prototype", "a file of existing designs", str(prototype), remedy)
        # Marks and encoding are a habit of who writes files; titles and units are of one file.
        old = read(replace(written, skip_rows=None, sheet=None), prototype)
        existing = _named_designs(old, roles.objectives)
        remarks += [f"{prototype.name}: {remark}" for remark in old.remarks]
    names = [*roles.objectives, *roles.variables, *roles.outputs]
    unseen = [name for name in file.names if name not in (*names, roles.label)]
    if unseen and file.known is None:  # else the file tells what its other columns are
        them = listed([name or "(no name)" for name in unseen])
        remarks.append(f"Not on the page: {them}; name what is to be seen there by --variables.")
    # A file of designs does not tell that a column is a variable, so that it is not shown.
    unshown = "" if file.known is not None else "--variables shows further columns"
    known_units = {name: file.columns[name].unit for name in names}
    if roles.label is not None:
        frame = frame.set_index(roles.label)
    if existing is not None and roles.label in existing:
        existing = existing.set_index(roles.label)
    more = tuple(name for name in roles.maximize if name in roles.objectives)
    asked = Formulation(roles.objectives, maximize=more, normalize=normalize)
    page = decision_page(
        frame[names],
        asked if decision is None else (),
        variables=roles.variables,
        units={n: u for n, u in known_units.items() if u}
        | units_in(document.units, names, unshown),
        prototype=existing,
        limits=limits or None,
        decision=decision,
        title=document.title or path.stem,
    )
    left_out = []
    if file.failed:
        left_out.append(f"{counted(sum(file.failed.values()), 'test')} failed.")
    if file.infeasible:
        left_out.append(f"{counted(file.infeasible, 'design')} with violated constraints left out.")
    page = replace(page, table=replace(page.table, remarks=tuple(left_out)))
    page.save(out)
    for remark in remarks:
        say(remark)
    size = counted(len(frame), "design")
    say(f"{size} by {', '.join(roles.objectives)}: open {out} in a browser")
    return 0


def _named_designs(file: DesignFile, objectives: tuple[str, ...]) -> pd.DataFrame:
    """Return the designs of a file under the names that they have in it."""
    file.require_columns("an objective in --prototype", objectives)
    frame = file.frame(objectives)
    label = file.label
    frame.index = pd.Index(["prototype"] * len(frame) if label is None else frame[label])
    return frame
