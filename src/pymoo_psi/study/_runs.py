"""Runs of a study: their points, shares of these, and what must agree of their model."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from pymoo_psi._validation import (
    Integers,
    Names,
    Received,
    Values,
    flat,
    integer,
    invalid,
    wrong_type,
)
from pymoo_psi.errors import StudyMismatchError

Head: TypeAlias = Mapping[str, Any]

# Entries of a problem's identity that belonged to the model in version 0.3.
_OF_RUNS = ("sampling", "functions", "inequality constraints", "equality constraints")
# Paths that are compared only where both have them: versions differ in them, or outputs were added.
_IN_BOTH = (
    "problem.variables",
    "problem.choices",
    "problem.objectives",
    "problem.parameters.outputs",
    "problem.parameters.template",
)
# Version 0.3 had one hash of the template and all outputs, which may be more now.
_TEMPLATE = "problem.parameters.template"
_IN_ONE = "problem.parameters.template and outputs"


ROOM = 1_000_000
"""How many numbers of tests there are for a run, unless it is the last one."""


@dataclass(frozen=True)
class StudyRun:
    """A run of a study.

    The number of a test says its run and test point: 3 000 017 is test point 17 of run 4, and 17
    that of the first run. A run with more than a million test points takes up the numbers of the
    runs after it, which then do not exist.

    Attributes:
        number: Its number, from 1.
        points: What determines its test points: ``sampling``, ``lower`` and ``upper`` bounds,
            ``log``, ``requirements``.
        record: When, where and with which versions it was begun.
        last: The greatest test point that it was asked for; 0 if it was asked for none.
    """

    number: int
    points: Head
    record: Head
    last: int = 0

    @property
    def start(self) -> int:
        """The number before that of the test of its first test point."""
        return (self.number - 1) * ROOM


def require_same_model(path: str, stored: Head, asked: Head, where: str = "asked") -> None:
    """Refuse a study of another model.

    The model is the problem with its parameters and key, and the names, kinds and choices of its
    variables. Bounds, objectives, limits and the like may differ.

    Args:
        path: The study, for the message.
        stored: The head of the study.
        asked: The head of the problem, or of another study.
        where: Where this comes from, for the message.

    Raises:
        StudyMismatchError: The models differ; the message says in what.
    """
    differences = _differences(_model(stored), _model(asked), where)
    if differences:
        raise StudyMismatchError(
            f"study {path} belongs to another model: {'; '.join(differences[:4])}. "
            "Give the name of another file, or the problem (and study_key) with which it was begun"
        )


def same_points(points: Head, others: Head) -> bool:
    """Whether the test points of two runs are the same.

    Which requirements the run of version 0.3 had is not known.
    """
    if None in (points.get("requirements"), others.get("requirements")):
        points = {**points, "requirements": None}
        others = {**others, "requirements": None}
    return flat(points) == flat(others)


def _differences(stored: Mapping[str, str], asked: Mapping[str, str], where: str) -> list[str]:
    differences = []
    for name in {**stored, **asked}:
        in_both = name in stored and name in asked
        if name.startswith(_IN_BOTH) and not in_both:
            continue
        if name == _IN_ONE and _TEMPLATE in stored and _TEMPLATE in asked:
            continue
        one = stored.get(name, "absent")
        two = asked.get(name, "absent")
        if one != two:
            differences.append(f"{name} is {one:.120} in the study, {two:.120} {where}")
    return differences


def _model(head: Head) -> dict[str, str]:
    """Return what identifies the model, as JSON by path, in which NaN is NaN and 2 is not 2.0.

    The name of the problem comes first, as it says most.
    """
    problem = dict(head.get("problem") or {})
    for name in _OF_RUNS:
        problem.pop(name, None)
    kinds = [kind.replace("log", "real") for kind in head["kinds"]]  # the scale is of a run
    return flat({"problem": problem, "variables": head["variables"], "kinds": kinds})


def points_of(
    head: Head, sampling: str | None, requirements: Names = (), repeat: int = 1
) -> Values:
    """Return what determines the points of a run.

    Args:
        head: The head of its tests, with the bounds.
        sampling: The sequence or algorithm that the points come from.
        requirements: The rules that designs have to meet before they are evaluated.
        repeat: Which of the tests of each point the run makes.
    """
    log = []
    for name, kind in zip(head["variables"], head["kinds"], strict=True):
        if kind == "log":
            log.append(name)
    points = {
        "sampling": sampling,
        "lower": head.get("lower"),
        "upper": head.get("upper"),
        "log": log,
        "requirements": [*requirements],
    }
    if repeat > 1:
        points["repeat"] = repeat
    plain: Values = json.loads(json.dumps(points))
    return plain


SUFFIX = ".db"  # of the studies in a folder
_GOLDEN = 2_654_435_769  # 2^32 divided by the golden ratio, rounded to an odd number


class Share(NamedTuple):
    """The k-th of n parts of the test points.

    The points are assigned in rounds of n consecutive numbers, of which each share gets one. So the
    first results of all shares together are the beginning of the sequence, which is uniform. A
    longer run extends every share, and the share of a point does not depend on their number.

    The k-th share does not get the k-th point of every round: the low binary digits of a number
    are the leading ones of a point of LPτ. Every 64th point lies in one strip, a 64th of the first
    variable, and a lost share would leave that strip empty. Instead each round begins with another
    share, by multiples of the golden ratio (Fibonacci hashing, Knuth, The Art of Computer
    Programming 3, section 6.4), so that every single share is spread over the bounds.

    Attributes:
        part: The part, from 1 to ``of``.
        of: The number of parts.
    """

    part: int
    of: int

    @classmethod
    def checked(cls, value: object) -> Share:
        """Return the share that a user gives as ``(k, n)``.

        Raises:
            ArgumentValueError: There is no k-th of n parts.
            ArgumentTypeError: It is no pair of integers.
        """
        if not isinstance(value, (tuple, list)) or len(value) != 2:
            raise wrong_type("share", "a pair (k, n), the k-th of n parts", value)
        part = integer("k and n of share=(k, n)", value[0], minimum=1)
        of = integer("k and n of share=(k, n)", value[1], minimum=1)
        if part > of:
            raise invalid("share", "(k, n) with k from 1 to n", Received(f"({part}, {of})"))
        return cls(part, of)

    def __str__(self) -> str:
        """Return "3 of 64"."""
        return f"{self.part} of {self.of}"

    @property
    def file(self) -> str:
        """The name of its file in a folder of studies; the names sort by part."""
        digits = len(str(self.of))
        return f"share-{self.part:0{digits}}-of-{self.of}{SUFFIX}"

    def numbers(self, first: int, last: int) -> Integers:
        """Return its test points from ``first`` to ``last``, increasing."""
        if self.of == 1:
            return np.arange(first, last + 1)
        rounds = np.arange((first - 1) // self.of, (last - 1) // self.of + 1)
        # Only the lowest 32 bits of the product count, so that its overflow does no harm.
        shifts = (rounds * _GOLDEN % 2**32) * self.of // 2**32
        places = (self.part - 1 + shifts) % self.of
        numbers = rounds * self.of + places + 1
        return numbers[(first <= numbers) & (numbers <= last)]


ALL = Share(1, 1)  # all points
