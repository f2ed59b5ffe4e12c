"""Checks of arguments, in one place.

Every message names the argument, the rule, the value received and, where there is one, the
remedy. The functions return the checked value in the form in which the caller computes with it.
"""

from __future__ import annotations

import difflib
import json
import math
import numbers
from collections.abc import Collection, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError

Array = NDArray[np.float64]
Kind = TypeVar("Kind")


def counted(n: int, one: str, many: str = "") -> str:
    """Return a number of things as a message says it: "1 design", "2 criteria"."""
    figure = f"{n:,}".replace(",", "\N{NO-BREAK SPACE}") if n >= 10_000 else str(n)
    return f"{figure} {one if n == 1 else many or f'{one}s'}"


def invalid(name: str, rule: str, received: object, remedy: str = "") -> ArgumentValueError:
    """Compose the error for a value that violates a rule; the caller raises it."""
    return ArgumentValueError(_message(name, rule, received, remedy))


def wrong_type(name: str, rule: str, received: object, remedy: str = "") -> ArgumentTypeError:
    """Compose the error for a value of a type that cannot be used; the caller raises it."""
    return ArgumentTypeError(_message(name, rule, received, remedy))


def _message(name: str, rule: str, received: object, remedy: str) -> str:
    text = f"{name} must be {rule}, got {_shown(received)}"
    return f"{text}; {remedy}" if remedy else text


def _shown(value: object) -> str:
    if isinstance(value, np.ndarray) and value.ndim == 0:  # repr() would say array(3)
        value = value.item()
    text = value.strip() if isinstance(value, Received) else repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


class Received(str):
    """A ready description of what was received, to be shown without quotation marks."""


def integer(name: str, value: object, *, minimum: int) -> int:
    """Return ``value`` as an ``int``; it must be a whole number not below ``minimum``."""
    # bool is a subclass of int, but a True among counts is a mistake. numbers.Integral, not int:
    # NumPy's integers are registered there.
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        raise wrong_type(name, f"an integer >= {minimum}", value)
    if value < minimum:
        raise invalid(name, f"an integer >= {minimum}", int(value))
    return int(value)


def job_count(name: str, value: object) -> int:
    """Return ``value`` as an ``int``; joblib's meaning: not 0, and -1 is one job per core."""
    jobs = integer(name, value, minimum=-1)
    if jobs == 0:
        raise invalid(name, "1 or more, or -1 for one per core", jobs)
    return jobs


def instance(name: str, value: object, kind: type[Kind], remedy: str = "") -> Kind:
    """Return ``value``; it must be an object of a class."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        received = Received(type(value).__name__ if value is not None else "None")
        raise wrong_type(name, f"{article} {kind.__name__}", received, remedy)
    return value


def mapping(name: str, value: object, what: str, remedy: str = "") -> Mapping[Any, Any]:
    """Return ``value``; it must map what is said, such as "names to units"."""
    if not isinstance(value, Mapping):
        hint = f"; {remedy}" if remedy else ""
        raise ArgumentTypeError(f"{name} must map {what}, got {_shown(value)}{hint}")
    return value


def collection(name: str, value: object, rule: str, remedy: str = "") -> Collection[Any]:
    """Return ``value``; it must be a list or the like, which a text, of letters, is not."""
    if isinstance(value, str) or not isinstance(value, Collection):
        raise wrong_type(name, rule, value, remedy)
    return value


def identity_text(identity: Mapping[str, Any], **layout: Any) -> str:
    """Return what is known of a problem as JSON, laid out as ``json.dumps`` is told.

    Raises:
        ArgumentTypeError: Its fingerprint holds what JSON cannot hold.
    """
    try:
        return json.dumps(identity, **layout)
    except (TypeError, ValueError, RecursionError) as error:
        raise ArgumentTypeError(
            "what fingerprint() of a problem returns must hold plain values, numbers, texts, "
            f"True, False, None, lists and dicts of Python: {error}"
        ) from None


def flat(values: Any, of: str = "") -> dict[str, str]:
    """Return plain values by their path as JSON, in which NaN is equal to NaN."""
    texts: dict[str, str] = {}
    for name, value in values.items() if isinstance(values, Mapping) else enumerate(values):
        inner = isinstance(value, (Mapping, list))
        text = json.dumps(None if inner else value, ensure_ascii=False)
        texts |= flat(value, f"{of}{name}.") if inner else {f"{of}{name}": text}
    return texts


def boolean(name: str, value: object) -> bool:
    """Return ``value`` as a ``bool``; numbers and strings are not accepted."""
    if not isinstance(value, (bool, np.bool_)):
        raise wrong_type(name, "True or False", value)
    return bool(value)


def finite_number(name: str, value: object) -> float:
    """Return ``value`` as a ``float``; it must be a finite real number."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise wrong_type(name, "a finite number", value)
    number = float(value)
    if not math.isfinite(number):
        raise invalid(name, "a finite number", number)
    return number


def positive_number(name: str, value: object) -> float:
    """Return ``value`` as a ``float``; it must be finite and above zero."""
    number = finite_number(name, value)
    if number <= 0:
        raise invalid(name, "a positive number", number)
    return number


def known_name(name: str, value: object, names: Collection[str], remedy: str = "") -> str:
    """Return ``value``; it must be one of ``names``, and a near miss is pointed out."""
    if isinstance(value, str) and value in names:
        return value
    options = ", ".join(repr(option) for option in sorted(names))
    rule = f"one of {options}" if names else "left out, as there is nothing to choose from"
    if not isinstance(value, str):
        raise wrong_type(name, rule, value, remedy)
    # F1 for f1 differs in all its letters
    folded = {option.casefold(): option for option in names}
    near = difflib.get_close_matches(value.casefold(), folded, n=1)
    hint = "; ".join(
        part for part in (f"did you mean {folded[near[0]]!r}?" if near else "", remedy) if part
    )
    raise invalid(name, rule, value, hint)


def real_array(name: str, value: ArrayLike, remedy: str = "") -> Array:
    """Return ``value`` as a new or shared float64 array; text and objects are refused."""
    if np.ma.is_masked(value):  # asarray would take what is under the mask for values
        raise invalid(name, "without masked values", Received("a masked array"), remedy)
    try:
        array = np.asarray(value)
    except ValueError as error:  # rows of unequal length
        raise ArgumentValueError(
            f"{name} must be a rectangular array of numbers: {error}"
        ) from error
    # astype() would turn texts such as "1" into numbers, and drop the imaginary parts of others.
    if array.dtype.kind not in "fiub":
        found = Received(f"dtype {array.dtype}")
        raise wrong_type(name, "an array of real numbers", found, remedy)
    return array.astype(np.float64, copy=False)


def finite_array(name: str, value: ArrayLike, remedy: str = "") -> Array:
    """Return ``value`` as a float64 array of finite numbers."""
    array = real_array(name, value)
    bad = ~np.isfinite(array)
    if bad.any():
        first = tuple(int(i) for i in np.argwhere(bad)[0])
        where = f"{array[first]} at index {first[0] if len(first) == 1 else first}"
        raise invalid(name, "finite", Received(where if array.ndim else str(array)), remedy)
    return array


def objective_matrix(name: str, value: Any) -> Array:
    """Return an ``(n, m)`` float64 array of finite objective values with n, m >= 1."""
    remedy = "of a pymoo result, res.F, which is None if it found no feasible design"
    array = real_array(name, value, f"{remedy}; a test table has its own ranking()")
    if array.ndim != 2 or array.size == 0:
        rule = "of shape (n designs, m objectives), one or more of each"
        remedy = f"use {name}[None, :] for one design, {name}[:, None] for one objective"
        raise invalid(name, rule, Received(f"shape {array.shape}"), remedy)
    return finite_array(name, array, "leave out designs that failed or are infeasible")
