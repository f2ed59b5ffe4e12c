"""Rows of a file that summarise others, such as totals and means, and are no designs."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.table._cells import Column
from pymoo_psi.table._sheet import UnfitError

# Words by which spreadsheets and people call rows that summarise others. Those of the last kind are
# compared with nothing, but are no designs either where they stand beside sums or means.
_SUMMARIES = {
    word: kind
    for kind, words in {
        "sum": "total totals subtotal sum sums σ summe gesamt insgesamt gesamtsumme "
        "zwischensumme teilsumme ergebnis gesamtergebnis teilergebnis somme suma totale",
        "mean": "mean average avg ø mittel mittelwert durchschnitt moyenne media promedio",
        "least": "min minimum",
        "greatest": "max maximum",
        "further": "median count anzahl std stdev deviation standardabweichung",
    }.items()
    for word in words.split()
}


def require_designs(
    table: Mapping[str, Column],
    apart: Collection[str],
    lines: Sequence[int],
    hidden: Collection[int],
    where: Callable[[int], str],
) -> str:
    """Refuse rows that summarise others, such as "Total"; return what to tell of one that may.

    A name alone says nothing, as a design may be called Max, nor do a few equal numbers.

    Args:
        table: The n cells of each column by its name.
        apart: Names of columns whose numbers nobody sums up: those of labels and of a ranking.
        lines: The n lines of the file on which the rows end.
        hidden: The lines that a sheet hides.
        where: Says where the i-th row stands.

    Raises:
        UnfitError: There is such a row.
    """
    n = len(lines)
    columns = [c for name, c in table.items() if c.numbers is not None and name not in apart]
    called: dict[int, str] = {}
    for column in table.values():
        texts = enumerate(column.cells if column.numbers is None else ())
        called |= {i: text for i, text in texts if _summaries(text)}
    # Words in most of many rows are values of a column, such as the levels min and max.
    if not columns or len(called) > max(10, n // 2):
        return ""
    F = np.column_stack([column.numbers for column in columns if column.numbers is not None])
    F[~np.isfinite(F)] = np.nan
    if not called:
        # Programs add sums without a word for them; of two or three numbers they may be a chance.
        cells = [column.cells[-1] for column in columns]
        shares = _shares(F[-1], cells, _statistics(F[:-1]))
        if n <= 3 or np.isfinite(F[-1]).sum() < 2 or shares.get("sum") != 1:
            return ""
        remedy = f"if it is no design, leave it out by --skip-rows {lines[-1]}"
        return f"{where(n - 1).capitalize()} holds the sums of the rows above; {remedy}."
    others, order = np.flatnonzero([i not in called for i in range(n)]), sorted(called)
    seen = np.array([i for i in others.tolist() if lines[i] not in hidden], dtype=np.intp)
    whole, shown = _statistics(F[others]), _statistics(F[seen])
    # Sums of groups stand below or above these, so between the rows that summarise.
    groups = [_statistics(F[rows]) for rows in np.split(others, np.searchsorted(others, order))]
    for k, i in enumerate(order):
        cells = [column.cells[i] for column in columns]
        # Beside sums there may be ratios of sums; but a design may be the best in many columns.
        least = {name: 0.5 if name == "sum" else 1 for name in _summaries(called[i])}
        for known in (whole, shown, groups[k], groups[k + 1]):
            shares = _shares(F[i], cells, known)
            if any(shares.get(name, 0) >= share for name, share in least.items()):
                out = [str(lines[j]) for j in order]
                them = "such rows" if out[1:] else "it"
                remedy = f"leave {them} out by --skip-rows {','.join(out)}, or rename a design"
                what = f"{where(i)} is called {called[i].strip()!r:.40}"
                raise UnfitError(f"{what} and summarises other rows; {remedy}")
    if {"count", "mean", "std", "min", "max"} <= {text.strip().lower() for text in called.values()}:
        # As pandas' describe() calls them, which are compared with rows that are not there.
        what = "its rows count, mean, std, min and max are statistics of designs and no designs"
        raise UnfitError(f"{what}; give the designs themselves")
    return ""


def _summaries(cell: Any) -> list[str]:
    """Return the kinds of summaries that a cell names."""
    words = re.findall(r"\w+", cell.lower()) if isinstance(cell, str) else []
    return [_SUMMARIES[word] for word in words if word in _SUMMARIES]


def _statistics(F: NDArray[np.float64]) -> dict[str, tuple[NDArray[np.float64], int]]:
    """Return summaries of ``(n, m)`` numbers by kind.

    Each is ``(m,)`` numbers, NaN where they tell nothing, and of how many of the n the rounding
    adds up in it.
    """
    few = np.isfinite(F).sum(axis=0) < 2
    if few.all():
        return {}
    F = np.where(few, 0.0, F)
    least, greatest = np.nanmin(F, axis=0), np.nanmax(F, axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        mean, total = np.nanmean(F, axis=0), np.nansum(F, axis=0)
    # The sum of one number beside zeros is that number, and no sign of a sum.
    total[(np.nan_to_num(F) != 0).sum(axis=0) < 2] = np.inf
    found = {"mean": (mean, 1), "least": (least, 0), "greatest": (greatest, 0)}
    differ = least < greatest
    found = {name: (np.where(differ, values, np.nan), k) for name, (values, k) in found.items()}
    return {"sum": (np.where(few, np.nan, total), len(F)), **found}


def _shares(
    row: NDArray[np.float64],
    cells: Sequence[Any],
    statistics: Mapping[str, tuple[NDArray[np.float64], int]],
) -> dict[str, float]:
    """Return in what share of the columns that can be compared a row holds summaries, by kind.

    Args:
        row: ``(m,)`` numbers, NaN where there are none.
        cells: The m cells that hold them.
        statistics: Summaries of other rows by kind, as :func:`_statistics` returns them.
    """
    # Means are often rounded: half a unit of the last digit that is written.
    texts = ["0" if x != x else str(cell).strip() for cell, x in zip(cells, row, strict=True)]
    parts = [text.lower().partition("e") for text in texts]
    digits = [int(power or 0) - len(body.partition(".")[2]) for body, _, power in parts]
    halves = np.array([float(f"5e{digit - 1}") for digit in digits])
    shares = {}
    for name, (values, rounded) in statistics.items():
        known = np.isfinite(row) & ~np.isnan(values)
        with np.errstate(over="ignore"):
            # What is shown is mostly the rounded sum of numbers that are rounded only when shown.
            # Of small counts that would allow anything; half a per cent is no chance.
            apart = rounded * np.minimum(halves, 0.005 / max(rounded, 1) * np.abs(row))
            equal = np.abs(values - row) <= 1e-9 * np.abs(row) + halves + apart
        if known.any():
            shares[name] = float(equal[known].mean())
    return shares
