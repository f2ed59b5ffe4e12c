"""The decision file: what a reader of the page decided, as the page saves it.

JSON for people and programs: criteria with units and directions, limits, the chosen design with
its values, the reason, the verdict of that day. It is data: reading it runs nothing, and what does
not fit the designs at hand is refused or told.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._validation import counted
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError
from pymoo_psi.page._data import text_column
from pymoo_psi.pareto import listed
from pymoo_psi.table import Bounds, ends, within

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")

_MARK = "pymoo_psi_decision"


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
        path = Path(path)
        content = path.read_bytes()
        try:
            found = json.loads(content.decode("utf-8-sig"))
            if not isinstance(found, dict) or found.get(_MARK) != 1:
                raise ValueError
            return cls._of(path, found)
        except (
            ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError
        ) as error:  # fmt: skip
            detail = f" ({error})" if isinstance(error, ArgumentValueError) else ""
            raise ArgumentValueError(
                f"{path}: it is no decision that the page has saved, or a damaged one{detail}; "
                "open the page and save the decision again"
            ) from None

    @classmethod
    def _of(cls, path: Path, found: Mapping[str, Any]) -> Decision:
        criteria = {_text(c["name"]): c for c in found["criteria"]}
        chosen = found["chosen"]
        kept = found["kept"]
        return cls(
            path=path,
            date=_text(found["date"]).partition("T")[0],
            criteria=tuple(criteria),
            maximize=tuple(name for name, c in criteria.items() if _checked(bool, c["maximize"])),
            units={name: _text(c["unit"]) for name, c in criteria.items() if c["unit"]},
            normalize=_checked(bool, found["normalize"]),
            limits={_text(name): _ends(name, pair) for name, pair in found["limits"].items()},
            categories={name: _texts(texts) for name, texts in found["categories"].items()},
            kept=None if kept is None else _texts(kept),
            chosen=None if chosen is None else _text(chosen["label"]),
            values={
                name: _number(value)
                for name, value in ({} if chosen is None else chosen["criteria"]).items()
            },
            reason=_text(found["reason"]),
            verdict=_texts(found["verdict"]),
            view=dict(found["view"]) | {"pins": list(_texts(found["pins"]))},
        )

    @property
    def state(self) -> dict[str, Any]:
        """What the page opens with beside the limits; its script checks it once more."""
        return {
            **self.view,
            "categories": {name: list(texts) for name, texts in self.categories.items()},
            "kept": None if self.kept is None else list(self.kept),
            "chosen": self.chosen,
            "reason": self.reason,
        }

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


def _checked(kind: type[T], value: object) -> T:
    """Return a value; it must be of this kind."""
    if not isinstance(value, kind):
        raise TypeError
    return value


def _text(value: object) -> str:
    return _checked(str, value)


def _texts(values: object) -> tuple[str, ...]:
    return tuple(map(_text, _checked(list, values)))


def _number(value: object) -> float:
    """Return a number; null stands for one that JSON cannot hold."""
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError
    return float(value)


def _ends(name: str, pair: object) -> tuple[float, float]:
    try:
        return ends(name, _checked(list, pair))
    except ArgumentTypeError as error:
        raise ArgumentValueError(str(error)) from None
