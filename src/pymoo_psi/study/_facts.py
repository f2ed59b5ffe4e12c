"""What a study knows beside its tests: facts about the whole, runs, shares, and names of columns.

- :class:`Facts` at one moment, with each :class:`StudyRun`.
- The model must be the same for all tests of a study: :func:`require_same_model`.
- A run is continued by the identity that it has: :func:`identity_of_run`.
- :class:`Share`, a part of the test points.
- The head names the columns; a run may add some.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Collection, Mapping, Sequence
from datetime import datetime, timezone
from typing import Any, NamedTuple

import numpy as np

from pymoo_psi._validation import (
    Head,
    Integers,
    Names,
    Values,
    flat,
    identity_facts,
    integer,
    invalid,
    wrong_type,
)
from pymoo_psi.errors import StudyMismatchError

ADDED = ("run", "test_point", "origin", "seconds")  # columns that a study adds to those of a model
NUMBERS = ("test", "run", "test_point")
NOT_VALUES = (*NUMBERS, "status", "reason", "origin", "seconds")  # columns that are not in a head
_GROUPS = ("variables", "objectives", "inequalities", "equalities", "outputs", "notes")

# Requests of people to a run that hold when it is continued.
LASTING = ("search", "more")
_MOST_FURTHER = 1_000_000  # tests of a request, whose points a run keeps in memory
ACTIONS = (*LASTING, "pause", "continue", "stop")

# Outputs are compared only where both have them, as some may have been added.
_OUTPUTS = "problem.parameters.outputs."
_TEMPLATE = "problem.parameters.template."
SUFFIX = ".db"  # the suffix of the studies in a folder
_GOLDEN = 2_654_435_769  # 2^32 divided by the golden ratio, rounded to an odd number
_LOW_BITS = 2**32 - 1

ROOM = 1_000_000
"""Test point p of run r has number ROOM * (r - 1) + p, unless that is taken."""


def further_tests(count: object) -> int:
    """Return how many further tests a request asks for.

    Raises:
        ArgumentValueError: They are none, or more than a million.
        ArgumentTypeError: It is no integer.
    """
    n_tests = integer("count", count, minimum=1)
    if n_tests > _MOST_FURTHER:
        raise invalid("count", f"at most {_MOST_FURTHER} further tests", n_tests, "ask again later")
    return n_tests


def now() -> str:
    """Return the date and the time, as a study keeps them."""
    return datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")


class StudyRun(NamedTuple):
    """A run of a study.

    Attributes:
        number: Its number, from 1.
        identity: What determines its test points, see :func:`identity_of_run`.
        record: When, where and with which versions it was begun, and under ``planned`` which test
            points it was asked for: the first and the last one of each call.
    """

    number: int
    identity: Head
    record: Values

    @property
    def planned(self) -> list[list[int]]:
        """The first and the last test point of each call."""
        return [*self.record.get("planned", ())]


class Facts(NamedTuple):
    """What is known of a study as a whole, at one moment.

    Attributes:
        head: The columns and the formulation of the last run, see :meth:`Study.begin`; the bounds
            are those of all runs together.
        runs: The runs.
        steering: Requests to runs, in the order of time. Each has its ``number``, ``time``, the
            ``name`` of the person, ``action``, one of ``ACTIONS``, its arguments, ``answer``,
            ``run``, the run that has answered, or 0, and ``is_over``, whether a later run has begun
            that does not follow it.
        share: For a share of an investigation: its part and the number of parts.
        id: A random name.
        process: The machine and the number of the last process that added tests.
        n_changes: How often stored tests got other values.
        columns: The names of columns in SQL, by their names.
    """

    head: Head
    runs: Sequence[StudyRun] = ()
    steering: Sequence[Values] = ()
    share: Sequence[int] | None = None
    id: str = ""
    process: Sequence[Any] = ("", 0)
    n_changes: int = 0
    columns: Mapping[str, str] = {}

    @property
    def bounds(self) -> Values:
        """The least and the greatest bounds of all runs, as entries of the head."""
        bounds = {}
        for side, hull in (("lower", np.fmin), ("upper", np.fmax)):
            if side in self.head:
                ends = [run.identity[side] for run in self.runs]
                bounds[side] = ends[0]
                if len(ends) > 1:  # a choice has none: NaN here, and null in one run's identity
                    bounds[side] = hull.reduce(np.array(ends, dtype=np.float64)).tolist()
        return bounds

    @property
    def requests(self) -> list[str]:
        """The requests with their answers, each in a line."""
        return list(map("{time}, {name}: {action}: {answer}".format_map, self.steering))

    def run_with(self, identity: Head) -> StudyRun | None:
        """Return the run with an identity, or ``None``."""
        for run in self.runs:
            if flat(run.identity) == flat(identity):
                return run
        return None


def record_of_run() -> Values:
    """Return the record of a run that begins now, on this machine."""
    from pymoo_psi import __version__

    return {
        "begun": now(),
        "host": platform.node(),
        "pymoo-psi": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


# The model, which must be the same


def require_same_model(path: str, stored: Head, head: Head, where: str = "asked") -> None:
    """Refuse a study of another model.

    The model is the problem with its parameters and key, and the names, kinds and choices of its
    variables; of a problem of pymoo, whose values have places and no names, also the names and
    directions that a user gives these. Bounds, limits and the like may differ.

    Args:
        path: The study, for the message.
        stored: The head of the study.
        head: The head of the problem, or of another study.
        where: Where this comes from, for the message.

    Raises:
        StudyMismatchError: The models differ; the message says in what.
    """
    differences = _differences(_model(stored, head), _model(head, stored), where)
    if differences:
        raise StudyMismatchError(
            f"study {path} belongs to another model: {'; '.join(differences[:4])}. "
            "Give the name of another file, or restore the model of the study (its "
            f"template, its study key, its names)"
        )


def require_fellow(path: str, facts: Facts, others: Facts, where: str = "asked") -> None:
    """Refuse a study that is no share of the same points as another one.

    Raises:
        StudyMismatchError: It is none; the message says what differs.
    """
    require_same_model(path, facts.head, others.head, where)
    numbers_of_shares = {share[1] for share in (facts.share, others.share) if share}
    is_of_run = len(facts.runs) == 1 and others.run_with(facts.runs[0].identity) is not None
    if len(numbers_of_shares) > 1 or not is_of_run:
        raise StudyMismatchError(
            f"study {path} is a share of other points, or of another number of shares, than those "
            f"{where}; give the name of another folder, or join the shares by 'pymoo-psi export' "
            "and go on with that study"
        )


def _differences(stored: Mapping[str, str], model: Mapping[str, str], where: str) -> list[str]:
    differences = []
    for name in {**stored, **model}:
        fact = stored.get(name, "absent")
        other = model.get(name, "absent")
        is_added = name.startswith(_OUTPUTS) and "absent" in (fact, other)
        if fact == other or is_added:
            continue
        if name.startswith(_TEMPLATE):
            file = name.removeprefix(_TEMPLATE)
            differences.append(f"{file} in the template is not as in the study")
        else:
            differences.append(f"{name} is {fact:.120} in the study, {other:.120} {where}")
    return differences


def _model(head: Head, other: Head) -> dict[str, str]:
    """Return what identifies the model, as JSON by path, in which NaN is NaN and 2 is not 2.0.

    The name of the problem comes first, as it says most.

    Args:
        head: The head of its study.
        other: The head that it is compared with.
    """
    problem = head.get("problem") or {}
    facts = identity_facts(problem, other.get("problem") or {})
    # The scale belongs to a run, not to the model.
    kinds = [kind.replace("log", "real") for kind in head["kinds"]]
    model = {"variables": head["variables"], "kinds": kinds}
    if "objectives" in problem:  # how many; those of a program have names of their own
        n_constraints = problem.get("inequalities")
        model |= {
            "objectives": head["objectives"],
            "maximize": head.get("maximize", []),
            "inequalities": head["inequalities"][:n_constraints],
            "equalities": head["equalities"],
        }
    return {f"problem.{name}": fact for name, fact in facts.items()} | flat(model)


# The identity of a run


def identity_of_run(
    head: Head, sampling: str | None, requirements: Names = (), repeat: int = 1
) -> Values:
    """Return what determines the test points of a run; a run that has the same is continued.

    Args:
        head: The head of its tests, with the bounds.
        sampling: The sequence or algorithm that the points come from.
        requirements: The rules that designs have to meet before they are evaluated.
        repeat: Which of the tests of each point the run makes; 0 for tests of a noisy model from
            elsewhere.
    """
    pairs = zip(head["variables"], head["kinds"], strict=True)
    log = [name for name, kind in pairs if kind == "log"]
    identity = {
        "sampling": sampling,
        "lower": head.get("lower"),
        "upper": head.get("upper"),
        "log": log,
        "requirements": [*requirements],
    }
    if repeat != 1:
        identity["repeat"] = repeat
    plain: Values = json.loads(json.dumps(identity))
    return plain


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
        part, of = [integer("k and n of share=(k, n)", number, minimum=1) for number in value]
        if part > of:
            raise invalid("share", "(k, n) with k from 1 to n", (part, of))
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
        rounds = np.arange((first - 1) // self.of, (last - 1) // self.of + 1)
        # Only the lowest 32 bits of the product count, so that its overflow does no harm.
        shifts = (rounds * _GOLDEN & _LOW_BITS) * self.of >> 32
        places = (self.part - 1 + shifts) % self.of
        numbers = rounds * self.of + places + 1
        return numbers[(first <= numbers) & (numbers <= last)]


ALL = Share(1, 1)  # the share of all points


# Columns in a head


def columns_of_head(head: Head) -> list[str]:
    """Return the names of all columns in a head."""
    return [name for group in _GROUPS for name in head.get(group, ())]


def require_other_names(head: Head) -> None:
    """Check that no column of a head has the name of one that a study adds."""
    for name in columns_of_head(head):
        if name in NOT_VALUES:
            raise invalid(
                "a column of a study",
                f"named unlike the columns that a study adds: {', '.join(NOT_VALUES)}",
                name,
                "give the problem, or the program, another name for it",
            )


def beside(head: Head, stored: Head) -> Values:
    """Return the head of a run with the notes of the stored one, and its values as outputs."""
    if "notes" in stored:  # none of them names the tests of the run
        head = {**head, "notes": stored["notes"]}
    return with_outputs(head, columns_of_head(stored))


def with_outputs(head: Head, names: Collection[str]) -> Values:
    """Return a head in which columns of values that it lacks are outputs."""
    present = {*columns_of_head(head), *NOT_VALUES}
    outputs = [*head.get("outputs", ()), *(name for name in names if name not in present)]
    if not outputs:
        return dict(head)
    return {**head, "outputs": outputs}
