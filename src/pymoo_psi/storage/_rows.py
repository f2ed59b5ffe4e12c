"""Tests as rows of a database and back, bit for bit, each row with a digest of its content.

Reals are little-endian float64 in one BLOB, so that NaN with its payload, -0.0 and infinity
survive; a design with other values is a JSON array. All text is ASCII.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from hashlib import blake2b
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pymoo_psi.errors import PsiError
from pymoo_psi.storage._errors import corrupt
from pymoo_psi.table import Layout, TestTable

Array = NDArray[np.float64]
DIGEST_SIZE = 16


class Row(NamedTuple):
    """A test as the database holds it.

    Attributes:
        number: Number of the test point.
        x: The design: float64 values, or JSON if one of them is no real number.
        y: Criteria, inequality and equality constraints, float64 values.
        status: "ok", "infeasible" or "failed".
        reason: Why it failed, as a JSON text; None if no reason was given.
        digest: Of all of these.
    """

    number: int
    x: bytes | str
    y: bytes
    status: str
    reason: str | None
    digest: bytes


def rows_of_table(table: TestTable) -> list[Row]:
    """Return the tests of a table as rows."""
    Y = np.hstack([table.F, table.G, table.H]).astype("<f8")
    designs: list[bytes | str]
    if table.X.dtype == np.float64:
        designs = [x.tobytes() for x in table.X.astype("<f8")]
    else:
        designs = [_design(cells) for cells in table.X.tolist()]
    rows = []
    tests = zip(table.numbers.tolist(), designs, Y, table.status.tolist(), strict=True)
    for number, x, y, status in tests:
        text = table.reasons.get(number)
        reason = None if text is None else json.dumps(text)
        fields = (number, x, y.tobytes(), status, reason)
        rows.append(Row(*fields, _digest(*fields)))
    return rows


def table_of_rows(layout: Layout, rows: Sequence[Row], path: str) -> TestTable:
    """Return checked rows as a table, in the order of the rows.

    Raises:
        StudyCorruptError: The rows are no tests of this layout.
    """
    if not rows:
        return TestTable.empty(layout)
    widths = [len(layout.objectives), len(layout.inequalities), len(layout.equalities)]
    try:
        Y = _reals([row.y for row in rows], sum(widths))
        F, G, H = np.split(Y, np.cumsum(widths)[:2], axis=1)
        return TestTable(
            layout,
            np.array([row.number for row in rows], dtype=np.int64),
            _designs([row.x for row in rows], len(layout.variables)),
            F,
            G,
            H,
            np.array([row.status for row in rows]),
            {row.number: json.loads(row.reason) for row in rows if row.reason is not None},
        )
    except (PsiError, ValueError, OverflowError) as error:
        raise corrupt(path, f"its rows are no tests of its layout: {error}") from error


def checked(row: Sequence[Any], path: str) -> Row:
    """Return what came out of the database as a row.

    Raises:
        StudyCorruptError: Its content does not have its digest.
    """
    found = Row(*row)
    try:
        intact = _digest(*found[:-1]) == found.digest
    except (AttributeError, TypeError, ValueError):  # values of other types than were written
        intact = False
    if not intact:
        raise corrupt(path, f"the content of test point {found.number!r:.20} has changed")
    return found


def combined(digest: bytes, *others: bytes) -> bytes:
    """Return the digest of a set of rows after rows with the other digests joined or left it."""
    total = int.from_bytes(digest, "big")
    for other in others:
        total ^= int.from_bytes(other, "big")
    return total.to_bytes(DIGEST_SIZE, "big")


def _digest(number: int, x: bytes | str, y: bytes, status: str, reason: str | None) -> bytes:
    kind, design = ("json", x.encode()) if isinstance(x, str) else ("f8", x)
    text = b"" if reason is None else reason.encode()
    sizes = f"{number:d} {kind} {len(design)} {len(y)} {status} {reason is None} {len(text)};"
    return blake2b(sizes.encode() + design + y + text, digest_size=DIGEST_SIZE).digest()


def _design(cells: list[Any]) -> bytes | str:
    if all(type(cell) is float for cell in cells):
        return np.array(cells, dtype="<f8").tobytes()
    return json.dumps(cells)


def _designs(designs: list[bytes | str], width: int) -> NDArray[Any]:
    reals = [x for x in designs if isinstance(x, bytes)]
    if len(reals) == len(designs):
        return _reals(reals, width)
    X = np.empty((len(designs), width), dtype=object)
    for i, x in enumerate(designs):
        X[i] = json.loads(x) if isinstance(x, str) else _reals([x], width)[0].tolist()
    return X


def _reals(blobs: list[bytes], width: int) -> Array:
    if any(len(blob) != 8 * width for blob in blobs):
        raise ValueError(f"a row does not hold {width} real numbers")
    joined = np.frombuffer(bytearray().join(blobs), dtype="<f8") if width else np.zeros(0)
    return joined.reshape(len(blobs), width).astype(np.float64)
