"""Checksums of the rows of a study, by which a changed cell is noticed."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.uint64]

# The finalizer of splitmix64 (Steele, Lea and Flood, Fast splittable pseudorandom number
# generators, OOPSLA 2014): a bijection, so that a cell with another value has another word.
_STEPS = ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB), (31, 1))


def checksums(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
    """Return ``(n,)`` checksums of n rows; a change of one cell changes the checksum of its row.

    They are sums over the columns, to which NaN and empty texts add nothing. So rows keep their
    checksums when a column is added in which they have no values.

    Args:
        columns: Arrays of n numbers or texts by name.
    """
    total = np.zeros(len(next(iter(columns.values()))), dtype=np.uint64)
    for name, cells in columns.items():
        salt = np.uint64(zlib.crc32(name.encode()) << 32)
        words = _mixed(_words(cells) ^ salt)
        words[_empty(cells)] = 0
        total += words
    return total.view(np.int64)


def text_checksum(texts: Any) -> int:
    """Return the checksum of some texts or numbers."""
    return zlib.crc32(repr(texts).encode())


def _words(cells: NDArray[Any]) -> Words:
    """Return the bits of numbers; checksums of texts."""
    if cells.dtype.kind == "f":
        return np.ascontiguousarray(cells).view(np.uint64)
    if cells.dtype.kind in "biu":
        return cells.astype(np.int64).view(np.uint64)
    texts = cells.tolist()
    checksum_by_text = {text: zlib.crc32(text.encode(errors="surrogatepass")) for text in {*texts}}
    return np.array([checksum_by_text[text] for text in texts], dtype=np.uint64)


def _empty(cells: NDArray[Any]) -> NDArray[np.bool_]:
    """``(n,)`` which cells are NaN or empty texts."""
    if cells.dtype.kind == "f":
        return np.asarray(np.isnan(cells))
    return np.asarray(cells == "")


def _mixed(words: Words) -> Words:
    for shift, factor in _STEPS:
        words = (words ^ (words >> np.uint64(shift))) * np.uint64(factor)
    return words
