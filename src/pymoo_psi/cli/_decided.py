"""The decision file: what a reader of the page decided, as the page saves it.

JSON for people and programs: criteria with units and directions, limits, the chosen design with
its values, the reason, the verdict of that day. It is data: reading it runs nothing, and what does
not fit the designs at hand is refused or told.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import counted
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.pareto import listed
from pymoo_psi.table import Bounds, Formulation, ends, within

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Decision:
    """What was decided, and by what.

    Attributes:
        path: The file.
        date: The day when it was written, as the file says.
        criteria: Names of the criteria.
        maximize: Those of which more is better.
        units: Units of criteria by name, as far as they have one.
        normalize: Whether designs were ranked in units of the ranges.
        limits: The least and the greatest value of columns, by name.
        categories: The texts that are allowed, by name of the column.
        kept: The designs that were kept by hand; None for all.
        chosen: The chosen design; None if nothing was left to choose.
        values: Its criteria by name, as they were.
        reason: Why, in the reader's words.
        verdict: What the page said of the best design.
        view: What else the page showed, which changes no decision.
    """

    path: Path
    date: str
    criteria: tuple[str, ...]
    maximize: tuple[str, ...]
    units: Mapping[str, str]
    normalize: bool
    limits: Bounds
    categories: Mapping[str, tuple[str, ...]]
    kept: tuple[str, ...] | None
    chosen: str | None
    values: Mapping[str, float]
    reason: str
    verdict: tuple[str, ...]
    view: Mapping[str, Any]

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Decision:
        """Read a decision file.

        Raises:
            ArgumentValueError: It is none, or holds what no page has written.
            OSError: It cannot be opened.
        """
        path, asked = Path(path), Formulation.read_json(path)
        page = asked.page
        state = page.get("state", {})
        return cls(
            path=path,
            date=str(page.get("date", "")).partition("T")[0],
            criteria=tuple(asked.objectives),
            maximize=tuple(asked.maximize),
            units=page.get("units", {}),
            normalize=asked.normalize,
            limits={name: ends(name, limit) for name, limit in asked.limits.items()},
            categories={n: tuple(texts) for n, texts in state.get("categories", {}).items()},
            kept=None if state.get("kept") is None else tuple(map(_plain, state["kept"])),
            chosen=None if asked.chosen is None else _plain(asked.chosen),
            values=page.get("values", {}),
            reason=asked.reason,
            verdict=tuple(page.get("verdict", ())),
            view={},
        )

    def require(
        self,
        what: object,
        criteria: Sequence[str],
        maximize: Sequence[str],
        units: Mapping[str, str],
        columns: Sequence[str],
    ) -> None:
        """Require the criteria, directions, units and columns that the decision is about.

        Args:
            what: What has them, for messages.
            criteria: Names of the criteria.
            maximize: Those of which more is better.
            units: Units by name; none says nothing.
            columns: Names of all columns.

        Raises:
            ArgumentValueError: The decision is about others.
        """
        remedy = "give the designs that it was made for, or decide anew"
        if set(criteria) != set(self.criteria):
            raise self._unfit(
                f"it weighs {listed(self.criteria)}, and {what} has the objectives "
                f"{listed(criteria)}; say --objectives, or {remedy}"
            )
        if turned := sorted(set(maximize).symmetric_difference(self.maximize) & set(criteria)):
            there = "maximised" if turned[0] in self.maximize else "minimised"
            raise self._unfit(
                f"there {turned[0]!r} is {there}, in {what} it is not; say --maximize, or {remedy}"
            )
        for name in self.criteria:
            mine, theirs = self.units.get(name), units.get(name)
            if mine and theirs and mine != theirs:
                raise self._unfit(f"there {name!r} is in {mine}, in {what} in {theirs}; {remedy}")
        needed = [*self.limits, *self.categories]
        if missing := [name for name in needed if name not in columns]:
            raise self._unfit(f"it limits {missing[0]!r}, which {what} does not have; {remedy}")

    def left(self, ids: Sequence[str], frame: pd.DataFrame) -> NDArray[np.bool_]:
        """``(n,)`` which designs keep the limits and are among the texts and designs allowed.

        Args:
            ids: What the n designs are called, see ``design_ids`` of the room ``table``.
            frame: Their columns.

        Raises:
            ArgumentValueError: A limited column is none of numbers.
        """
        try:
            left = within(
                self.limits,
                lambda name: frame[name].to_numpy(np.float64, na_value=np.nan),
                len(ids),
            )
        except (TypeError, ValueError) as error:
            raise self._unfit(str(error)) from None
        for name, texts in self.categories.items():
            left &= np.isin(text_column(frame[name].tolist()).astype(str), texts)
        if self.kept is not None:
            left &= np.isin(ids, self.kept)
        return left

    def now(self, ids: Sequence[str], frame: pd.DataFrame) -> list[str]:
        """Return what has become of the chosen design, as a warning where it has changed.

        Args:
            ids: As for :meth:`left`.
            frame: As for :meth:`left`.
        """
        told = []
        if self.kept is not None and (lost := len(set(self.kept).difference(ids))):
            told.append(f"Warning: {counted(lost, 'design')} that were kept are there no more.")
        if self.chosen is None:
            return told
        if self.chosen not in ids:
            return [*told, f"Warning: {self.chosen}, the chosen design, is not among these."]
        row = ids.index(self.chosen)
        values = {name: float(frame[name].iloc[row]) for name in self.criteria}
        changed = [
            f"{name} was {self.values.get(name, math.nan):.6g} and is {value:.6g}"
            for name, value in values.items()
            if self.values.get(name) != value
        ]
        if changed:
            what = f"{self.chosen}, the chosen design, has changed: {', '.join(changed)}"
        elif not self.left(ids, frame)[row]:
            what = f"{self.chosen}, the chosen design, is beyond the limits"
        else:
            return [*told, f"Chosen: {self.chosen}, unchanged since {self.date}."]
        return [*told, f"Warning: {what}."]

    def _unfit(self, what: str) -> ArgumentValueError:
        return ArgumentValueError(f"{self.path}: {what}")


def _plain(name: str) -> str:
    """Return a number without the word before it: "test point 7" is 7 in a column of numbers."""
    return re.sub(r"^[a-z_ ]+ (?=\d+( #\d+)?$)", "", name)


def text_column(cells: Sequence[object]) -> NDArray[np.object_]:
    """Return cells as texts, missing ones empty."""
    texts = ("" if cell is None or cell != cell else str(cell) for cell in cells)
    return np.fromiter(texts, object)
