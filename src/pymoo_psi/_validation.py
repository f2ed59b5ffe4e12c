"""Checks of arguments.

Every message names the argument, the rule, the value received and, where there is one, a remedy.
The functions return the checked value in the form with which the caller computes.
"""

from __future__ import annotations

import difflib
import json
import math
import numbers
import sys
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from os import PathLike
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._names import name_of
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError

Array = NDArray[np.float64]
Designs = NDArray[Any]  # whose type depends on the variables
Mask = NDArray[np.bool_]
Numbers = NDArray[np.int64]  # of tests
Rows = NDArray[np.intp]
Integers = NDArray[np.int64]
AnyArray = NDArray[Any]
Names = Sequence[str]
Entries = Mapping[str, Any]
Values = dict[str, Any]
Columns = dict[str, AnyArray]  # of a table: n cells each, by name
Head = Mapping[str, Any]  # what the columns of a table mean, as values that JSON can hold
FilePath = str | PathLike[str]
Class = TypeVar("Class")


def counted(n: int, one: str) -> str:
    """Return a number of things for a message: "1 design", "2 designs"."""
    figure = str(n)
    if n >= 10_000:
        figure = f"{n:,}".replace(",", "\N{NO-BREAK SPACE}")
    if n == 1:
        return f"{figure} {one}"
    return f"{figure} {one}s"


def invalid(name: str, rule: str, received: object, remedy: str = "") -> ArgumentValueError:
    """Compose the error for a value that violates a rule; the caller raises it."""
    return ArgumentValueError(_message(name, rule, received, remedy))


def wrong_type(name: str, rule: str, received: object, remedy: str = "") -> ArgumentTypeError:
    """Compose the error for a value of a type that cannot be used; the caller raises it."""
    return ArgumentTypeError(_message(name, rule, received, remedy))


def _message(name: str, rule: str, received: object, remedy: str) -> str:
    message = f"{name_of(name)} must be {rule}, got {_shown(received)}"
    if remedy:
        return f"{message}; {remedy}"
    return message


def _shown(value: object) -> str:
    text = repr(value)
    if isinstance(value, Received):
        text = value.strip()
    if len(text) > 80:
        return f"{text[:77]}..."
    return text


def source_type(source: Any) -> str:
    """Return what was given where designs or their objectives are expected.

    Types are recognized by what they have: importing pandas for a test takes half a second.

    Returns:
        "file"; "table", "preferences", of this package; "frame", of pandas; "result", also an
        algorithm, or "population", of pymoo; "array" for anything else.
    """
    if isinstance(source, (str, PathLike)):
        return "file"
    # The class is asked, as columns of a frame, and parts of a result, may have any name.
    if hasattr(type(source), "feasible_ranking"):
        return "table"
    if hasattr(type(source), "trades"):
        return "preferences"
    if hasattr(type(source), "itertuples"):
        return "frame"
    if hasattr(source, "opt"):
        return "result"
    if isinstance(source, np.ndarray) and hasattr(source, "get"):
        return "population"
    return "array"


class Received(str):
    """A description of what was received, shown without quotation marks."""


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
    """Return ``value`` as an ``int``, with joblib's meaning: -1 is one job per core."""
    jobs = integer(name, value, minimum=-1)
    if jobs == 0:
        raise invalid(name, "1 or more, or -1 for one per core", jobs)
    return jobs


def instance(name: str, value: object, kind: type[Class], remedy: str = "") -> Class:
    """Return ``value``; it must be an object of a class."""
    if not isinstance(value, kind):
        received = Received(type(value).__name__)
        raise wrong_type(name, f"of type {kind.__name__}", received, remedy)
    return value


def mapping(name: str, value: object, what: str) -> Mapping[Any, Any]:
    """Return ``value``; it must be a mapping of a kind such as "names to units"."""
    if not isinstance(value, Mapping):
        raise wrong_type(name, f"a mapping from {what}", value)
    return value


def distinct_keys(pairs: Sequence[tuple[str, Any]]) -> Values:
    """Return an object of JSON: the hook ``object_pairs_hook``, which refuses a key given twice."""
    entries: Values = {}
    for key, value in pairs:
        if key in entries:
            raise invalid("the keys of an object of JSON", "distinct", Received(f"{key!r} twice"))
        entries[key] = value
    return entries


def collection(name: str, value: object, rule: str, remedy: str = "") -> Collection[Any]:
    """Return ``value``; it must be a list or the like, not a text."""
    if isinstance(value, str) or not isinstance(value, Collection):
        raise wrong_type(name, rule, value, remedy)
    return value


def identity_text(identity: Mapping[str, Any], **layout: Any) -> str:
    """Return the identity of a problem as JSON; ``layout`` is passed to ``json.dumps``.

    Raises:
        ArgumentTypeError: The fingerprint of the problem holds what JSON cannot hold.
    """
    try:
        return json.dumps(identity, **layout)
    except (TypeError, ValueError, RecursionError) as error:
        raise ArgumentTypeError(
            "what fingerprint() of a problem returns must hold plain values, numbers, texts, "
            f"True, False, None, lists and dicts of Python: {error}"
        ) from None


def flat(values: Any, of: str = "") -> dict[str, str]:
    """Return nested values by their path, each as JSON, in which NaN is equal to NaN."""
    texts: dict[str, str] = {}
    if not isinstance(values, Mapping):
        values = dict(enumerate(values))
    for name, value in values.items():
        path = f"{of}{name}"
        if isinstance(value, (Mapping, list)):
            texts |= flat(value, f"{path}.")
        else:
            texts[path] = json.dumps(value, ensure_ascii=False)
    return texts


def identity_facts(identity: Head, other: Head) -> dict[str, str]:
    """Return the identity of a problem by path, as far as it is to be compared with another one.

    An argument that only one of two identities has is left out if it has its default value there:
    it was added to the class, or removed from it, and the values are as before. If each of the two
    has one that the other lacks, both count: one may be the other under a new name.

    Args:
        identity: What :func:`problem_identity` returns, or nothing.
        other: The identity of the other problem.
    """
    arguments = _arguments(identity)
    other_arguments = _arguments(other)
    may_be_renamed = arguments - other_arguments and other_arguments - arguments
    others = ("defaults", "inequalities")  # how many; the columns themselves are compared
    facts = flat({name: value for name, value in identity.items() if name not in others})
    for name, value in identity.get("defaults", {}).items():
        if name in other_arguments or may_be_renamed:
            facts |= flat({f"parameters.{name}": value})
    return facts


def _arguments(identity: Head) -> set[str]:
    """Return the paths of all arguments in the identity of a problem."""
    paths = {*identity.get("defaults", ())}
    parameters = identity.get("parameters")
    of = ""
    while isinstance(parameters, Mapping):
        paths |= {f"{of}{name}" for name in parameters}
        parameters = parameters.get("wrapped")
        of += "wrapped."
    return paths


def plain_value(value: Any) -> Any:
    """Return a value of NumPy or pandas as numbers and lists, or as text if it is none of these."""
    plain = np.asarray(value).tolist()
    if plain is value:  # such as a time of pandas
        return str(value)
    return plain


def boolean(name: str, value: object) -> bool:
    """Return ``value`` as a ``bool``; numbers and strings are not accepted."""
    if not isinstance(value, (bool, np.bool_)):
        raise wrong_type(name, "True or False", value)
    return bool(value)


def is_real(value: object) -> bool:
    """Whether it is a real number, which may be NaN or infinite; True and False are none."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def finite_number(name: str, value: Any) -> float:
    """Return ``value`` as a ``float``; it must be a finite real number."""
    if not is_real(value):
        raise wrong_type(name, "a finite number", value)
    number = math.inf
    with suppress(OverflowError):  # of an integer beyond float64
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
    """Return ``value``; it must be one of ``names``, and the error names the nearest one."""
    if isinstance(value, str) and value in names:
        return value
    rule = f"one of {', '.join(map(repr, sorted(names))) or 'no names'}"
    if not isinstance(value, str):
        raise wrong_type(name, rule, value, remedy)
    # Without regard to case: F1 differs from f1 in all its letters.
    folded = {option.casefold(): option for option in names}
    for near in difflib.get_close_matches(value.casefold(), folded, n=1):
        remedy = f"did you mean {folded[near]!r}? {remedy}".strip()
    raise invalid(name, rule, value, remedy)


def name_list(name: str, values: object) -> Collection[Any]:
    """Return a list of names; a text would be read letter by letter."""
    return collection(name, values, "a list of names", "one goes into a list too")


def known_names(name: str, values: object, names: Collection[str], remedy: str = "") -> list[str]:
    """Return a list of names; each must be one of ``names``."""
    return [known_name(name, value, names, remedy) for value in name_list(name, values)]


def real_array(name: str, value: ArrayLike, remedy: str = "") -> Array:
    """Return ``value`` as a new or shared float64 array; text and objects are refused."""
    # asarray would take the numbers under the mask for values. NumPy imports its masks when needed.
    if "numpy.ma" in sys.modules and np.ma.is_masked(value):
        raise invalid(name, "without masked values", Received("a masked array"), remedy)
    array = np.asarray(value)
    # astype() would turn texts such as "1" into numbers, and drop the imaginary parts of others.
    if array.dtype.kind not in "fiub":
        raise wrong_type(name, "an array of real numbers", value, remedy)
    return array.astype(np.float64, copy=False)


def require_shape(name: str, array: AnyArray, shape: tuple[int, ...]) -> None:
    """Refuse an array of another shape."""
    if array.shape != shape:
        raise invalid(name, f"of shape {shape}", Received(f"shape {array.shape}"))


def finite_array(name: str, value: ArrayLike, remedy: str = "") -> Array:
    """Return ``value`` as a float64 array of finite numbers."""
    array = real_array(name, value)
    is_finite = np.isfinite(array)
    if not is_finite.all():
        index = np.argwhere(~is_finite)[0].tolist()
        received = f"{array[tuple(index)]} at index {index}"
        raise invalid(name, "finite", Received(received), remedy)
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
