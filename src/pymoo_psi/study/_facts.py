"""What a study knows beside its tests: facts about the whole, runs, shares, and names of columns.

- :class:`Facts` of the study and :class:`StudyRun`, of which it may have several.
- The model must be the same for all tests of a study: :func:`require_same_model`.
- A run is continued by the identity that it has: :func:`identity_of_run`.
- :class:`Share`, a part of the test points.
- The head names the columns; a run may add some, or give others new names: :class:`Renaming`.
"""

from __future__ import annotations

import json
import platform
import secrets
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Any, NamedTuple

import numpy as np

from pymoo_psi._validation import (
    Columns,
    Head,
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

ADDED = ("test", "run", "origin", "seconds")  # columns that a study adds to those of a model
NUMBERS = ("test", "run", "test_point")
NOT_VALUES = (*NUMBERS, "status", "reason", "origin", "seconds")  # columns that are not in a head
_GROUPS = ("variables", "objectives", "inequalities", "equalities", "outputs")

# Requests of people to a run that hold when it is continued.
LASTING = ("search", "more")
_MOST_FURTHER = 1_000_000  # tests of a request, whose points a run keeps in memory
ACTIONS = (*LASTING, "pause", "continue", "stop")

# Outputs are compared only where both have them, as some may have been added.
_OUTPUTS = "problem.parameters.outputs."
_TEMPLATE = "problem.parameters.template."
SUFFIX = ".db"  # the suffix of the studies in a folder
_GOLDEN = 2_654_435_769  # 2^32 divided by the golden ratio, rounded to an odd number

ROOM = 1_000_000
"""How many numbers of tests there are for a run, unless it is the last one."""


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


@dataclass
class Facts:
    """What is known of a study as a whole.

    Attributes:
        head: The columns and the formulation of the last run; see :meth:`Study.begin`.
        share: For a share of an investigation: its part and the number of parts.
        is_complete: Whether stored tests have all values that can be computed from others.
        n_changes: How often stored tests got other values.
        id: A random name.
        process: The machine and the number of the last process that added tests.
        steering: Requests to runs, in the order of time. Each has its ``number``, ``time``, the
            ``name`` of the person, ``action``, one of ``ACTIONS``, its arguments, ``answer`` and
            ``run``, the run that has answered, or 0.
        runs: The runs.
    """

    head: Head
    share: Sequence[int] | None = None
    is_complete: bool = True
    n_changes: int = 0
    id: str = field(default_factory=lambda: secrets.token_hex(16))
    process: Sequence[Any] = ("", 0)
    steering: list[Values] = field(default_factory=list)
    runs: list[StudyRun] = field(default_factory=list)

    @property
    def requests(self) -> list[str]:
        """The requests with their answers, each in a line."""
        return list(map("{time}, {name}: {action}: {answer}".format_map, self.steering))

    def run(self, number: int) -> StudyRun:
        """Return the run of a number."""
        return next(run for run in self.runs if run.number == number)

    def run_with(self, identity: Head) -> StudyRun | None:
        """Return the run with an identity, or ``None``."""
        for run in self.runs:
            if flat(run.identity) == flat(identity):
                return run
        return None


@dataclass
class StudyRun:
    """A run of a study.

    The number of a test says its run and test point: 3 000 017 is test point 17 of run 4, and 17
    that of the first run. A run with more than a million test points also uses the numbers of the
    next runs, so that these runs do not exist.

    Attributes:
        number: Its number, from 1.
        identity: What determines its test points, see :func:`identity_of_run`.
        record: When, where and with which versions it was begun, and under ``planned`` which test
            points it was asked for: the first and the last one of each call.
        last: The greatest test point that it has; 0 if it has none.
    """

    number: int
    identity: Head
    record: Values
    last: int = 0

    @property
    def start(self) -> int:
        """The number before that of the test of its first test point."""
        return (self.number - 1) * ROOM


def new_run(number: int, identity: Head, last: int = 0) -> StudyRun:
    """Return a run that begins now, on this machine."""
    from pymoo_psi import __version__

    record = {
        "begun": now(),
        "host": platform.node(),
        "pymoo-psi": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }
    return StudyRun(number, identity, record, last)


# The model, which must be the same


def require_same_model(path: str, stored: Head, head: Head, where: str = "asked") -> None:
    """Refuse a study of another model.

    The model is the problem with its parameters and key, and the names, kinds and choices of its
    variables. Bounds, objectives, limits and the like may differ.

    Args:
        path: The study, for the message.
        stored: The head of the study.
        head: The head of the problem, or of another study.
        where: Where this comes from, for the message.

    Raises:
        StudyMismatchError: The models differ; the message says in what.
    """
    differences = _differences(_model(stored), _model(head), where)
    if differences:
        raise StudyMismatchError(
            f"study {path} belongs to another model: {'; '.join(differences[:4])}. "
            "Give the name of another file, or restore the model with which it was begun (its "
            "template, its study_key)"
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


def _model(head: Head) -> dict[str, str]:
    """Return what identifies the model, as JSON by path, in which NaN is NaN and 2 is not 2.0.

    The name of the problem comes first, as it says most.
    """
    problem = head.get("problem") or {}
    # The scale belongs to a run, not to the model.
    kinds = [kind.replace("log", "real") for kind in head["kinds"]]
    return flat({"problem": problem, "variables": head["variables"], "kinds": kinds})


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
        rounds = np.arange((first - 1) // self.of, (last - 1) // self.of + 1)
        # Only the lowest 32 bits of the product count, so that its overflow does no harm.
        shifts = (rounds * _GOLDEN % 2**32) * self.of // 2**32
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
            rule = f"named unlike the columns that a study adds: {', '.join(NOT_VALUES)}"
            remedy = "give the problem, or the program, another name for it"
            raise invalid("a column of a study", rule, name, remedy)


def with_outputs(head: Head, names: Collection[str]) -> Values:
    """Return a head in which columns of values that it lacks are outputs."""
    present = {*columns_of_head(head), *NOT_VALUES}
    outputs = [*head.get("outputs", ()), *(name for name in names if name not in present)]
    if not outputs:
        return dict(head)
    return {**head, "outputs": outputs}


@dataclass(frozen=True)
class Renaming:
    """Other names and directions of columns that a problem knows by their places, as pymoo's do.

    The outputs of a program have names of their own, which stay.

    Attributes:
        new_names: The names of stored objectives and constraints by those that they have.
        turned: Objectives, by their new names, that are maximised now, or no longer: their values
            change sign.
    """

    new_names: Mapping[str, str]
    turned: Collection[str]

    @classmethod
    def between(cls, stored: Head, head: Head) -> Renaming:
        """Return what makes the columns of a stored head those of another one."""
        if "objectives" not in (head.get("problem") or {}):
            return cls({}, ())
        pairs = [*zip(stored["objectives"], head["objectives"], strict=False)]
        # Requirements, which may change, follow the constraints of the model.
        n_constraints = head.get("model_inequalities")
        pairs += zip(stored["inequalities"], head["inequalities"][:n_constraints], strict=False)
        pairs += zip(stored["equalities"], head["equalities"], strict=False)
        new_names = dict(pairs)
        maximized = {new_names[name] for name in stored.get("maximize", ())}
        return cls(new_names, maximized ^ {*head.get("maximize", ())})

    def __bool__(self) -> bool:
        """Whether anything changes."""
        return bool(self.turned) or [*self.new_names] != [*self.new_names.values()]

    def of_columns(self, columns: Columns) -> Columns:
        """Return stored columns under the new names, and in the new directions."""
        renamed = {}
        for name, cells in columns.items():
            name = self.new_names.get(name, name)
            if name in self.turned:
                cells = -cells
            renamed[name] = cells
        return renamed
