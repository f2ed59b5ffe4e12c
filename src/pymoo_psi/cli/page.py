"""``pymoo-psi page``: from a file of designs to the page to decide on."""

from __future__ import annotations

import csv
from pathlib import Path

import pandas as pd

from pymoo_psi.arguments import Received, broken_rule
from pymoo_psi.cli.output import require_folder, say
from pymoo_psi.page import decision_page, table_from_file

__all__ = ["run_page"]


def run_page(
    file: Path,
    out: Path,
    *,
    objectives: str | None = None,
    variables: str | None = None,
    maximize: str | None = None,
    units: str | None = None,
    prototype: Path | None = None,
    normalize: bool = True,
    title: str | None = None,
) -> int:
    """Write the page and say where it is.

    Args:
        file: A CSV of designs, or a test table.
        out: The HTML file to write.
        objectives: Names of columns, separated by commas; guessed unless given.
        variables: Likewise.
        maximize: The objectives of which more is better, likewise.
        units: Such as ``mass=kg,time=s``.
        prototype: A CSV of existing designs to compare with.
        normalize: Rank with each objective in units of its range.
        title: Heading of the page; the file's name unless given.
    """
    require_folder(out)
    if out.resolve() == file.resolve():
        raise broken_rule("--out", "another file than the one that is read", str(out))
    table = table_from_file(file, objectives=_names(objectives), variables=_names(variables))
    known = table.prototype
    if prototype is not None:
        found = table_from_file(prototype, objectives=table.objectives, variables=())
        known = found.frame.set_index(found.label) if found.label else found.frame
        known.index = known.index if found.label else pd.Index(["prototype"] * len(known))
    page = decision_page(
        table.frame,
        table.objectives,
        variables=table.variables,
        maximize=_names(maximize) or [],
        units=_units(units),
        label=table.label,
        normalize=normalize,
        prototype=known,
        title=title or file.stem,
    )
    page.save(out)
    say(f"{len(table.frame)} designs by {', '.join(table.objectives)}: open {out} in a browser")
    return 0


def _names(text: str | None) -> list[str] | None:
    """Return the names in a list with commas; a name with a comma stands in quotation marks."""
    if text is None:
        return None
    return [name.strip() for name in next(csv.reader([text], skipinitialspace=True), [])]


def _units(text: str | None) -> dict[str, str]:
    units = {}
    for part in _names(text) or []:
        name, equals, unit = part.rpartition("=")
        if not (name and equals):
            raise broken_rule("--units", "of the form name=unit,name=unit", Received(part))
        units[name.strip()] = unit.strip()
    return units
