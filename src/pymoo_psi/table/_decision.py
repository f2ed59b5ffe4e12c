"""What people decided: a formulation, the chosen design and the reason, and their positions."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np

from pymoo_psi._output import whole_file
from pymoo_psi._validation import (
    Entries,
    FilePath,
    Values,
    collection,
    distinct_keys,
    instance,
    invalid,
    known_name,
    mapping,
    plain_value,
)
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table._formulation import Formulation
from pymoo_psi.table._limits import limits_of

_VERSION = 1  # of the file


@dataclass(frozen=True)
class Decision:
    """A decision on a table of designs: the file that a decision page saves.

    Attributes:
        formulation: What is asked: objectives, directions, limits, normalisation.
        chosen: Name of the chosen design, as in :attr:`TestTable.names`; None if none is chosen.
        reason: Why it was chosen.
        positions: Positions of people, one mapping for each person and date: ``name``; ``date``,
            ``YYYY-MM-DD``, optionally with T or a blank and ``hh:mm``, this optionally with ``:ss``
            and a fraction, and with Z, ``+hh:mm`` or ``-hh:mm``, such as
            ``2026-05-01T10:30+02:00``; or empty, which is before all others; ``chosen``, the name
            of a design or None; ``limits``, ``weights`` and ``aspiration`` of objectives by name;
            ``reason``; ``answers`` to questions, those of
            :attr:`pymoo_psi.Preferences.answers`. Positions with the same name are a
            history. They are kept in the order of their times, each once, so that positions of
            several files can be joined in any order; a date without a time is 0:00, one without an
            offset is UTC.
        decided: The decision of a group, None if there is none: ``chosen``, the name of a design,
            and, where they are known, ``date``; ``agree`` and ``dissent``, lists of names.
        page: Other settings of the decision page, without effect on the decision.

    Raises:
        ArgumentValueError: An entry of a position or decision is unknown or not valid.

    Example:
        >>> decision = Decision(Formulation(limits="mass<=30"), chosen="A", reason="lightest")
        >>> decision.formulation.limits["mass"].written("mass")
        'mass<=30'
    """

    formulation: Formulation = field(default_factory=Formulation)
    chosen: str | None = None
    reason: str = ""
    positions: Sequence[Entries] = ()
    decided: Entries | None = None
    page: Entries = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the entries, and take copies."""
        instance("formulation", self.formulation, Formulation)
        if self.chosen is not None:
            instance("chosen", self.chosen, str)
        instance("reason", self.reason, str)
        page = dict(mapping("page", self.page, "settings to values"))
        rule = "a list of mappings, one for each person and date"
        positions = {}
        for entries in collection("positions", self.positions, rule):
            position = _checked("a position", entries, _Position)
            limits = limits_of(position["limits"], "the limits of a position")
            position["limits"] = {name: limit.plain for name, limit in limits.items()}
            content = json.dumps(position, sort_keys=True, allow_nan=False)
            date = position["date"]
            order = (_time_of(date), date, position["name"], position["chosen"] or "", content)
            positions[order] = position
        # In one order, each once, whatever files they come from and in whatever order.
        ordered = [positions[order] for order in sorted(positions)]
        vars(self).update(page=page, positions=ordered)
        if self.decided is not None:
            vars(self).update(decided=_checked("decided", self.decided, _Group))

    def combine_first(self, other: Decision) -> Decision:
        """Return it with what it leaves open as another one has it.

        Without a chosen design it takes the other choice and, unless it has a reason, the other
        reason; without positions or a decision of a group those of the other; its formulation as in
        :meth:`Formulation.combine_first`.

        Example:
            >>> Decision(Formulation(limits="x1>=2")).combine_first(Decision(chosen="A")).chosen
            'A'
        """
        changes: Values = {
            "formulation": self.formulation.combine_first(other.formulation),
            "positions": self.positions or other.positions,
            "decided": self.decided or other.decided,
        }
        if self.chosen is None:
            changes |= {"chosen": other.chosen, "reason": self.reason or other.reason}
        return replace(self, **changes)

    def to_dict(self) -> Values:
        """Return what differs from the defaults, the formulation first, as values of JSON.

        Example:
            >>> Decision(Formulation(["mass"]), chosen="A").to_dict()
            {'objectives': ['mass'], 'chosen': 'A'}
        """
        stated = self.formulation.to_dict()
        for name in _OF_DECISION:
            value = getattr(self, name)
            if value != getattr(_DEFAULT, name):
                stated[name] = value
        return stated

    @classmethod
    def from_dict(cls, entries: Entries) -> Decision:
        """Return the decision of entries such as :meth:`to_dict` returns.

        Raises:
            ArgumentValueError: An entry is unknown, or not valid.

        Example:
            >>> Decision.from_dict({"objectives": ["mass"], "chosen": "A"}).chosen
            'A'
        """
        arguments = {}
        of_formulation = {}
        for name, value in entries.items():
            known_name("an entry", name, [*_OF_FORMULATION, *_OF_DECISION])
            if name in _OF_DECISION:
                arguments[name] = value
            else:
                of_formulation[name] = value
        return cls(Formulation(**of_formulation), **arguments)

    def to_json(self, path: FilePath) -> None:
        """Write the decision as JSON, to be read by :meth:`read_json` or edited by hand.

        Raises:
            OSError: The file cannot be written.

        Example:
            >>> import os, tempfile
            >>> decision = Decision(Formulation(maximize=["gain"], limits={"mass": (None, 30)}))
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     decision.to_json(os.path.join(folder, "decision.json"))
            ...     print(Path(folder, "decision.json").read_text())
            ...     Decision.read_json(os.path.join(folder, "decision.json")) == decision
            {
             "maximize": ["gain"],
             "limits": {"mass": [null, 30]},
             "version": 1
            }
            <BLANKLINE>
            True
        """
        # One line for each entry: short enough to be read, and to be edited by hand.
        lines = []
        for name, value in self.to_dict().items():
            text = json.dumps(value, ensure_ascii=False, allow_nan=False)
            lines.append(f'"{name}": {text}')
        lines.append(f'"version": {_VERSION}')
        content = ",\n ".join(lines)
        with whole_file(path) as file:
            file.write_text(f"{{\n {content}\n}}\n", encoding="utf-8")

    @classmethod
    def read_json(cls, path: FilePath) -> Decision:
        """Read a decision that a page saved, or a formulation; the file may be untrusted.

        Raises:
            ArgumentValueError: The file is no decision, or an entry is not valid.
            OSError: The file cannot be opened.

        Example:
            >>> import os, tempfile
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     path = Path(folder, "decision.json")
            ...     _ = path.write_text('{"computed": {"r": "mass / stress"}}')
            ...     Decision.read_json(path).formulation.computed
            {'r': 'mass / stress'}
        """
        return cls.from_json(Path(path).read_bytes(), path)

    @classmethod
    def from_json(cls, content: bytes, where: object) -> Decision:
        """Return the decision in the content of such a file; ``where`` names it in messages.

        Raises:
            ArgumentValueError: It is no decision.

        Example:
            >>> Decision.from_json(b'{"limits": {"f1": 60}}', "a request").formulation
            Formulation(limits={'f1': 60})
        """
        try:
            entries = json.loads(
                content.decode("utf-8-sig"),
                object_pairs_hook=distinct_keys,
                parse_constant=_number,
                parse_float=_number,
            )
            if not isinstance(entries, dict):
                raise invalid("it", "an object of JSON", entries)
            version = entries.pop("version", _VERSION)  # a file written by hand needs none
            if version != _VERSION:
                raise invalid("its version", f"{_VERSION}", version)
            return cls.from_dict(entries)
        except (ValueError, TypeError, OverflowError, RecursionError) as error:
            raise ArgumentValueError(
                f"{where} must be a decision, as Decision.to_json and 'Decision file' of the "
                f"page write it: {error}"
            ) from None


def decision_of(
    formulation: Formulation | Decision | None, former: Decision = Decision()
) -> Decision:
    """Return a decision as it is, and a formulation as that of a former decision.

    Args:
        formulation: A formulation or decision; None is the former decision.
        former: What people decided before.

    Raises:
        ArgumentTypeError: It is neither.
    """
    if formulation is None:
        return former
    if isinstance(formulation, Decision):
        return formulation
    remedy = "such as Formulation(['mass', 'cost']); limits have a name, as limits={'mass': 30}"
    stated = instance("formulation", formulation, Formulation, remedy)
    return replace(former, formulation=stated)


class _Position(msgspec.Struct, forbid_unknown_fields=True):
    """What somebody holds; see :attr:`Decision.positions`."""

    name: Annotated[str, msgspec.Meta(min_length=1)]
    date: str = ""
    chosen: str | None = None
    limits: Values = {}
    weights: dict[str, Annotated[float, msgspec.Meta(ge=0)]] = {}
    aspiration: dict[str, float] = {}
    reason: str = ""
    answers: list[tuple[str, Literal[">", "=", "?"], str]] = []


class _Group(msgspec.Struct, forbid_unknown_fields=True):
    """The decision of a group; see :attr:`Decision.decided`."""

    chosen: str
    date: str = ""
    agree: list[str] = []
    dissent: list[str] = []


def _checked(where: str, entries: Any, kind: Any) -> Values:
    """Return entries as a class has them, complete."""
    plain = msgspec.to_builtins(entries, enc_hook=plain_value)
    try:
        values: Values = msgspec.to_builtins(msgspec.convert(plain, kind))
    except msgspec.ValidationError as error:
        entries = ", ".join(kind.__struct_fields__)
        raise ArgumentValueError(f"{where}: {error}; its entries are {entries}") from None
    return values


# The same as DATE in page/decisions.js, as what Python and browsers read as dates differs.
_DATE = re.compile(
    r"\d{4}-\d\d-\d\d([T ]([01]\d|2[0-3]):[0-5]\d(:[0-5]\d(\.(?P<fraction>\d+))?)?"
    r"(Z|[+-]([01]\d|2[0-3]):[0-5]\d)?)?",
    re.ASCII,
)


def _time_of(date: str) -> tuple[float, str]:
    """Return the second in UTC, and its fraction; an empty date is before all others."""
    if not date:
        return -math.inf, ""
    parts = _DATE.fullmatch(date)
    try:
        if parts is None:
            raise ValueError
        fraction = parts["fraction"] or ""
        whole = date.replace(f".{fraction}", "").replace("Z", "+00:00")
        time = datetime.fromisoformat(whole)  # there is no 30 February
    except ValueError:
        rule = "a date such as 2026-05-01 or 2026-05-01T10:30+02:00, or empty"
        raise invalid("date of a position", rule, date) from None
    if time.tzinfo is None:
        time = time.replace(tzinfo=timezone.utc)
    return time.timestamp(), fraction.rstrip("0")


def _number(text: str) -> float:
    """Return a number of JSON, which is finite here."""
    number = float(text)
    if not np.isfinite(number):
        raise ValueError(f"{text:.20} is no finite number")
    return number


_DEFAULT = Decision()
_OF_FORMULATION = [attribute.name for attribute in fields(Formulation)]
_OF_DECISION = [attribute.name for attribute in fields(Decision)[1:]]
