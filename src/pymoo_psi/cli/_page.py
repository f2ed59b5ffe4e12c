"""``pymoo-psi page``: from a file of designs to the page to decide on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from pymoo_psi._validation import Received, invalid
from pymoo_psi.cli._options import limits_in, listed_names
from pymoo_psi.cli._output import require_output, say
from pymoo_psi.page import decision_page, table_from_file


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
    limits: str | None = None,
    title: str | None = None,
) -> int:
    """Write the page and say where it is.

    Args:
        file: A CSV of designs, a test table, a study, or a ranking.
        out: The HTML file to write.
        objectives: Names of columns, separated by commas; guessed unless given.
        variables: Likewise.
        maximize: The objectives of which more is better, likewise.
        units: Such as ``mass=kg,time=s``.
        prototype: A CSV of existing designs to compare with.
        normalize: Rank with each objective in units of its range.
        limits: Limits the page opens with, such as ``mass=2.5,yield>=0.8``.
        title: Heading of the page; the file's name unless given.
    """
    require_output(out, (), file, prototype)
    table = table_from_file(
        file, objectives=listed_names(objectives), variables=listed_names(variables)
    )
    known = table.prototype
    if prototype is not None:
        found = table_from_file(prototype, objectives=table.objectives, variables=())
        known = found.frame.set_index(found.label) if found.label else found.frame
        known.index = known.index if found.label else pd.Index(["prototype"] * len(known))
    more_is_better = listed_names(maximize) or table.maximize
    page = decision_page(
        table.frame,
        table.objectives,
        variables=table.variables,
        maximize=more_is_better,
        units=_units(units),
        label=table.label,
        normalize=normalize,
        prototype=known,
        limits=_limits(limits, more_is_better),
        title=title or file.stem,
    )
    page.save(out)
    for remark in table.remarks:
        say(remark)
    say(f"{len(table.frame)} designs by {', '.join(table.objectives)}: open {out} in a browser")
    return 0


def _limits(text: str | None, maximize: Sequence[str]) -> dict[str, float]:
    limits = limits_in(text)
    for name, (sign, limit) in limits.items():
        if sign != "=" and (sign == ">=") != (name in maximize):
            right = f"{name}>=number" if name in maximize else f"{name}<=number"
            raise invalid("--limits", f"{right} here", Received(f"{name}{sign}{limit:g}"))
    return {name: limit for name, (_, limit) in limits.items()}


def _units(text: str | None) -> dict[str, str]:
    units = {}
    for part in listed_names(text) or []:
        name, equals, unit = part.rpartition("=")
        if not (name and equals):
            raise invalid("--units", "of the form name=unit,name=unit", Received(part))
        units[name.strip()] = unit.strip()
    return units
