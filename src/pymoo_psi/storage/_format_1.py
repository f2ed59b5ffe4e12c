"""Studies of the first format: they are read, and a run that continues one turns it into today's.

Table ``study`` has one row: layout and fingerprint as JSON, the number of tests, the exclusive or
of their digests, a seal. Table ``tests`` has a design as float64 values, or as a JSON array if one
of them is no real number; criteria, inequality and equality constraints as float64 values; a
status; the reason of a failure as JSON; a digest.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from hashlib import blake2b
from typing import Any

import numpy as np

from pymoo_psi.storage._database import Columns, corrupt

_KINDS = {float: "real", int: "integer", bool: "binary"}
_INT64 = range(-(2**63), 2**63)


def head_of_format_1(db: sqlite3.Connection, path: str) -> tuple[dict[str, Any], tuple[int, bytes]]:
    """Return layout and fingerprint, and of the tests how many there are and what they sum up to.

    Raises:
        StudyCorruptError: The file is damaged.
    """
    try:
        query = "SELECT layout, fingerprint, tests, digest, seal FROM study"
        ((layout, fingerprint, tests, digest, seal),) = db.execute(query).fetchall()
        sizes = f"1 {len(layout)} {len(fingerprint)} {tests:d};"
        if _digest((sizes + layout + fingerprint).encode() + digest) == seal:
            return {**json.loads(layout), "problem": json.loads(fingerprint)}, (tests, digest)
    except (sqlite3.DatabaseError, UnicodeError, AttributeError, TypeError, ValueError):
        pass
    raise corrupt(path, "the seal of its head is broken")


def read_format_1(
    db: sqlite3.Connection, path: str, kinds: Sequence[str] = ()
) -> tuple[dict[str, Any], Columns]:
    """Return the head of a study and all its tests.

    Args:
        db: The study.
        path: Its file, for messages.
        kinds: What its variables are; what its designs show unless given.

    Raises:
        StudyCorruptError: The file is damaged.
    """
    head, expected = head_of_format_1(db, path)
    query = "SELECT number, x, y, status, reason, digest FROM tests ORDER BY number"
    rows = []
    total = 0
    for number, x, y, status, reason, digest in db.execute(query):
        try:
            kind, design = ("json", x.encode()) if isinstance(x, str) else ("f8", x)
            text = b"" if reason is None else reason.encode()
            sizes = (
                f"{number:d} {kind} {len(design)} {len(y)} {status} {reason is None} {len(text)};"
            )
            if _digest(sizes.encode() + design + y + text) != digest:
                raise ValueError("another digest")
        except (AttributeError, TypeError, ValueError):
            raise corrupt(path, f"the content of test point {number!r:.20} has changed") from None
        total ^= int.from_bytes(digest, "big")
        cells = json.loads(x) if isinstance(x, str) else _reals(x)
        rows.append((number, *cells, *_reals(y), status, json.loads(reason or '""')))
    if (len(rows), total.to_bytes(16, "big")) != expected:
        raise corrupt(path, "its tests are not those that were committed last")
    groups = ("objectives", "inequalities", "equalities")
    names = [*head["variables"], *(name for group in groups for name in head[group])]
    number, *values, status, reason = zip(*rows, strict=True) if rows else [()] * (len(names) + 3)
    columns: Columns = {"test_point": np.array(number, dtype=np.int64)}
    known = dict(zip(head["variables"], kinds, strict=False))
    for name, cells in zip(names, values, strict=True):
        known.setdefault(name, _kind(cells))
        texts = known[name] == "choice"
        columns[name] = np.fromiter(map(_text, cells), object) if texts else np.array(cells)
    head["kinds"] = [known[name] for name in head["variables"]]
    columns["status"], columns["reason"] = (np.fromiter(t, object) for t in (status, reason))
    return head, columns


def _kind(cells: Sequence[Any]) -> str:
    types = set(map(type, cells)) or {float}
    if len(types) > 1 or (types == {int} and not all(cell in _INT64 for cell in cells)):
        return "choice"
    return _KINDS.get(types.pop(), "choice")


def _reals(values: bytes) -> list[float]:
    reals: list[float] = np.frombuffer(values, dtype="<f8").tolist()
    return reals


def _text(cell: Any) -> str:
    """Return an option as today's studies hold it: as it is if it is text and no JSON."""
    if isinstance(cell, str):
        try:
            json.loads(cell)
        except ValueError:
            return cell
    return json.dumps(cell, ensure_ascii=False)


def _digest(content: bytes) -> bytes:
    return blake2b(content, digest_size=16).digest()
