"""Which problem a study belongs to: the layout of its table and the caller's fingerprint."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from pymoo_psi._validation import invalid
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError, StudyMismatchError
from pymoo_psi.table import Layout


@dataclass(frozen=True, eq=False)
class Identity:
    """The problem of a study.

    Attributes:
        layout: Names, bounds and tolerance.
        fingerprint: Plain JSON values by name: whatever else makes a problem another one.
    """

    layout: Layout
    fingerprint: dict[str, Any]

    @classmethod
    def of(cls, layout: Layout, fingerprint: Mapping[str, Any]) -> Identity:
        """Return the identity of these arguments.

        Raises:
            ArgumentTypeError: The layout is none, or the fingerprint no mapping of JSON values.
            ArgumentValueError: A number in the fingerprint is not finite.
        """
        if not isinstance(layout, Layout):
            raise ArgumentTypeError(f"layout must be a Layout, got {layout!r:.80}")
        if not isinstance(fingerprint, Mapping):
            raise ArgumentTypeError(f"fingerprint must be a mapping, got {fingerprint!r:.80}")
        plain: dict[str, Any] = {}
        for key, value in fingerprint.items():
            if not isinstance(key, str):
                raise ArgumentTypeError(f"fingerprint must have names for keys, got {key!r:.80}")
            try:
                plain[key] = json.loads(_canonical(value))
            except TypeError:
                raise ArgumentTypeError(
                    f"fingerprint must hold plain JSON values, got {value!r:.80} for {key!r}; "
                    "use numbers, text, True, False, None, lists and dicts of Python"
                ) from None
            except ValueError:
                rule = f"of finite numbers, without cycles, in {key!r}"
                raise invalid("fingerprint", rule, value) from None
        return cls(layout, plain)

    @classmethod
    def from_json(cls, layout: str, fingerprint: str) -> Identity:
        """Return the identity of the two texts of :meth:`to_json`.

        Raises:
            ArgumentValueError: They are no such texts.
        """
        try:
            return cls(Layout(**json.loads(layout)), dict(json.loads(fingerprint)))
        except (TypeError, ValueError, RecursionError) as error:
            raise ArgumentValueError(f"the texts must be of an identity: {error}") from error

    def to_json(self) -> tuple[str, str]:
        """Return layout and fingerprint as JSON, every number with all its bits."""
        values = {f.name: getattr(self.layout, f.name) for f in fields(Layout)}
        values |= {side: values[side].tolist() for side in ("lower", "upper")}
        return json.dumps(values), _canonical(self.fingerprint)

    def require(self, asked: Identity, path: str) -> None:
        """Raise unless another identity is the same.

        Raises:
            StudyMismatchError: It is another one; the message says in what.
        """
        differences = [
            f"{key} is {_shown(self.fingerprint, key)} in the study, "
            f"{_shown(asked.fingerprint, key)} asked"
            for key in sorted({*self.fingerprint, *asked.fingerprint})
            if _shown(self.fingerprint, key) != _shown(asked.fingerprint, key)
        ]
        columns = self.layout.difference(asked.layout)
        if columns:
            differences.append(f"{columns} (study against asked)")
        if differences:
            raise StudyMismatchError(
                f"study {path} belongs to another problem: {'; '.join(differences)}. Give the "
                "name of another file, or the problem (and study_key) with which it was begun"
            )


def _shown(fingerprint: Mapping[str, Any], key: str) -> str:
    return _canonical(fingerprint[key]) if key in fingerprint else "absent"


def _canonical(value: Any) -> str:
    return json.dumps(value, sort_keys=True, allow_nan=False)
