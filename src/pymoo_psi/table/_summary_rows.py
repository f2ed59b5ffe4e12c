"""Rows of a file that summarise others, such as totals and means, and are no designs."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.table._text import UnfitError

Array = NDArray[np.float64]

# Words by which spreadsheets and people call rows that summarise others, by what they hold.
_WORDS = {
    word: kind
    for kind, words in {
        "sum": "total totals subtotal sum sums σ summe gesamt insgesamt gesamtsumme "
        "zwischensumme teilsumme ergebnis gesamtergebnis teilergebnis somme suma totale",
        "mean": "mean average avg ø mittel mittelwert durchschnitt moyenne media promedio",
        "median": "median zentralwert",
        "std": "std stdev deviation standardabweichung",
        "extreme": "min minimum max maximum best worst ideal nadir utopia bester schlechtester",
    }.items()
    for word in words.split()
}
_ROUNDED = 0.01  # relative; what is shown is often the rounded summary of unrounded numbers


def require_designs(
    texts: Mapping[str, list[Any]],
    F: Array,
    where: Callable[[int], str],
    line: Callable[[int], int],
) -> str:
    """Refuse rows that summarise others, such as "Total"; return a remark on one that may.

    A name alone says nothing, as a design may be called Max, nor do a few equal numbers: a row is
    refused if it is called by such a word and holds these numbers, of all other rows or of those
    next to it.

    Args:
        texts: The n cells of the columns that hold texts.
        F: ``(n, m)`` numbers; NaN where there are none.
        where: Says where the i-th row stands.
        line: The number by which the i-th row is left out.

    Raises:
        ArgumentValueError: There is such a row.
    """
    n = len(F)
    called: dict[int, tuple[str, str]] = {}
    for cells in texts.values():
        for i, cell in enumerate(cells):
            for word in re.findall(r"\w+", cell.lower()) if isinstance(cell, str) else ():
                if word in _WORDS:
                    called[i] = (cell.strip(), _WORDS[word])
    # Words in most of many rows are values of a column, such as the levels min and max.
    if F.shape[1] == 0 or len(called) > max(10, n // 2):
        return ""
    F = np.where(np.isfinite(F), F, np.nan)
    if not called:
        # Programs add sums without a word for them; of two or three numbers they may be a chance.
        if n <= 3 or np.isfinite(F[-1]).sum() < 2 or _share(F[-1], F[:-1], "sum") < 1:
            return ""
        what = f"{where(n - 1).capitalize()} holds the sums of the rows above"
        return f"{what}; if it is no design, leave it out by --skip-rows {line(n - 1)}."
    order = sorted(called)
    others = np.flatnonzero([i not in called for i in range(n)])
    # Sums of groups stand below or above these, so between the rows that summarise.
    groups = np.split(others, np.searchsorted(others, order))
    for k, i in enumerate(order):
        cell, kind = called[i]
        # Beside sums there may be ratios of sums; but a design may be the best in many columns.
        least = 0.5 if kind == "sum" else 1.0
        if any(_share(F[i], F[rows], kind) >= least for rows in (others, groups[k], groups[k + 1])):
            out = ",".join(str(line(j)) for j in order)
            what = f"{where(i)} is called {cell!r:.40} and summarises other rows"
            raise UnfitError(f"{what}; leave it out by --skip-rows {out}, or rename it")
    return ""


def _share(row: Array, F: Array, kind: str) -> float:
    """Return in what share of the columns that can be compared a row holds a summary of others."""
    F = F[:, np.isfinite(row)]
    row = row[np.isfinite(row)]
    # One number, or one beside zeros, is no sign of a summary, nor are equal numbers.
    varied = (np.isfinite(F) & (np.nan_to_num(F) != 0)).sum(axis=0) > 1
    if len(F) > 0 and kind != "sum":
        varied &= np.fmin.reduce(F, axis=0) < np.fmax.reduce(F, axis=0)
    F, row = F[:, varied], row[varied]
    if F.shape[1] == 0:
        return 0.0
    with np.errstate(all="ignore"):
        if kind == "extreme":
            ends = np.nanmin(F, axis=0), np.nanmax(F, axis=0)
            return float(np.mean((row == ends[0]) | (row == ends[1])))
        values = getattr(np, f"nan{kind}")(F, axis=0)  # nansum, nanmean, nanmedian, nanstd
        return float(np.mean(np.abs(values - row) <= _ROUNDED * np.abs(row)))
