"""Runs of a study: which tests are those of their points, and what must agree of their model."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from pymoo_psi._validation import Integers, flat
from pymoo_psi.errors import StudyMismatchError

Head: TypeAlias = Mapping[str, Any]
Segment: TypeAlias = tuple[int, int, int]

# Entries of a problem's identity that belonged to the model in version 0.3.
_OF_RUNS = ("sampling", "functions", "inequality constraints", "equality constraints")
# Paths that are compared only where both have them: versions differ in them, or outputs were added.
_IN_BOTH = (
    "problem.variables",
    "problem.choices",
    "problem.objectives",
    "problem.parameters.outputs",
    "problem.parameters.hidden and linked files",
    "problem.parameters.template",
)
# Version 0.3 had one hash of the template and all outputs, which may be more now.
_TEMPLATE = "problem.parameters.template"
_IN_ONE = "problem.parameters.template and outputs"


@dataclass(frozen=True)
class StudyRun:
    """A run of a study.

    The tests of a run are numbered as its test points, as long as these numbers are free: those of
    the first run always are. Test points of a later run are shifted behind all numbers before.

    Attributes:
        number: Its number, from 1.
        points: What determines its test points: ``sampling``, ``lower`` and ``upper`` bounds,
            ``log``, ``requirements``.
        record: When, where and with which versions it was begun.
        segments: ``(first, last, shift)``: the tests of test points ``first`` to ``last`` have the
            numbers ``first + shift`` to ``last + shift``, which no other run uses.
        known: ``(k, 2)`` test points, increasing, whose designs another run had tested, and the
            numbers of these tests.
        n_tests: How many tests it has; those of other runs are not counted.
    """

    number: int
    points: Head
    record: Head
    segments: tuple[Segment, ...]
    known: Integers
    n_tests: int = 0

    @property
    def planned(self) -> int:
        """The greatest test point that the run was asked for; 0 if it was asked for none."""
        return max((last for _, last, _ in self.segments), default=0)

    @property
    def is_plain(self) -> bool:
        """Whether its tests are numbered as its test points."""
        return len(self.known) == 0 and all(shift == 0 for _, _, shift in self.segments)

    def has(self, test_point: int) -> bool:
        """Whether a test point has the number of a test."""
        return any(first <= test_point <= last for first, last, _ in self.segments)

    def tests(self, test_points: Integers) -> Integers:
        """Return the numbers of the tests of test points."""
        numbers = np.array(test_points, dtype=np.int64)
        if self.is_plain:
            return numbers
        for first, last, shift in self.segments:
            numbers[(test_points >= first) & (test_points <= last)] += shift
        points, tests = self.known.T
        rows = np.minimum(np.searchsorted(points, test_points), len(points) - 1)
        if len(points):
            is_known = points[rows] == test_points
            numbers[is_known] = tests[rows[is_known]]
        return numbers

    def with_points(self, first: int, last: int, greatest: int) -> tuple[Segment, ...]:
        """Return the segments after test points ``first`` to ``last`` are asked for, too.

        Args:
            first: The first test point.
            last: The last one.
            greatest: The greatest number that a test of any run has or will have; 0 if there is no
                other run.
        """
        if greatest == 0:
            firsts = [first, *(start for start, _, _ in self.segments)]
            lasts = [last, *(end for _, end, _ in self.segments)]
            return ((min(firsts), max(lasts), 0),)
        segments = sorted(self.segments)
        new = []
        for start, end, _ in segments:
            if first < start:
                segment = _shifted(first, min(last, start - 1), greatest)
                greatest = max(greatest, segment[1] + segment[2])
                new.append(segment)
            first = max(first, end + 1)
            if first > last:
                break
        if first <= last:
            new.append(_shifted(first, last, greatest))
        return _merged(sorted([*segments, *new]))

    def ranges(self, first: int, last: int) -> Iterator[tuple[int, int, int]]:
        """Yield the least and the greatest number of the tests of test points, and their shift.

        Args:
            first: The first test point.
            last: The last one.
        """
        for start, end, shift in self.segments:
            low = max(first, start)
            high = min(last, end)
            if low <= high:
                yield low + shift, high + shift, shift

    def known_between(self, first: int, last: int) -> Integers:
        """Return the rows of ``known`` with test points from ``first`` to ``last``."""
        points = self.known[:, 0]
        return self.known[(points >= first) & (points <= last)]


def _merged(segments: Sequence[Segment]) -> tuple[Segment, ...]:
    """Return segments in which neighbours of the same shift are one."""
    merged: list[Segment] = []
    for first, last, shift in segments:
        if merged and merged[-1][1] == first - 1 and merged[-1][2] == shift:
            first = merged.pop()[0]
        merged.append((first, last, shift))
    return tuple(merged)


def _shifted(first: int, last: int, greatest: int) -> Segment:
    """Return a segment whose tests have numbers above the greatest one."""
    return first, last, max(0, greatest - first + 1)


def segments_of(test_points: Integers, tests: Integers) -> tuple[Segment, ...]:
    """Return the segments of test points whose tests have these numbers."""
    order = np.argsort(test_points)
    shifts = (tests - test_points)[order]
    starts = np.flatnonzero(np.diff(shifts, prepend=shifts[:1] - 1))
    segments = []
    for rows in np.split(order, starts[1:]):
        if len(rows):
            first, last = int(test_points[rows[0]]), int(test_points[rows[-1]])
            segments.append((first, last, int(tests[rows[0]]) - first))
    return tuple(segments)


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


def points_of(head: Head, sampling: str | None, requirements: Sequence[str] = ()) -> dict[str, Any]:
    """Return what determines the points of a run.

    Args:
        head: The head of its tests, with the bounds.
        sampling: The sequence or algorithm that the points come from.
        requirements: The rules that designs have to meet before they are evaluated.
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
    plain: dict[str, Any] = json.loads(json.dumps(points))
    return plain
