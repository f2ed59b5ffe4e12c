"""What a run is going to test: the columns of its table, its points, its study begun."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import invalid
from pymoo_psi.algorithms._points import Points
from pymoo_psi.algorithms._sampling import UniformSampling, default_sampling, sampling_name
from pymoo_psi.algorithms._store import Memory
from pymoo_psi.errors import PsiError
from pymoo_psi.problems._design_space import DesignSpace, design_space
from pymoo_psi.problems._identity import problem_identity, problem_layout
from pymoo_psi.table import Limits, TestTable, bounds_of, real_column


@dataclass(frozen=True, eq=False)
class Plan:
    """What a run is going to test.

    Attributes:
        problem: The problem, not tolerant of failures.
        space: Its variables.
        table: The test table without tests: the columns that the problem promises, and
            what problem it is.
        points: The test points.
        memory: The study, if there is one.
    """

    problem: Any
    space: DesignSpace
    table: TestTable
    points: Points
    memory: Memory

    @classmethod
    def of(
        cls,
        problem: Any,
        n_points: int,
        *,
        memory: Memory,
        limits: Limits | None,
        first: int = 1,
        sampling: UniformSampling | None = None,
        seed: int | None = None,
        study_key: str | None = None,
        names: Mapping[str, str] | None = None,
        maximize: Collection[str] | None = None,
        units: Mapping[str, str] | None = None,
        further: int = 0,
        method: str = "",
    ) -> Plan:
        """Return the plan of a run; its study is begun last, when nothing else can be wrong.

        Args:
            problem: The problem, not tolerant of failures.
            n_points: How many points there are, those of other shares too.
            first: Number of the first.
            sampling: Where they come from; unless given, as their dimension wants.
            seed: Of a randomised sampling.
            limits: Limits of a user, on the table's columns.
            memory: The study, if there is one, and which share of the points is wanted.
            study_key: What a user says that the study depends on.
            names: The user's names of columns; the problem's unless given.
            maximize: The criteria to be maximised, likewise.
            units: Units of columns, likewise.
            further: How many designs are proposed later and numbered after the points.
            method: By what, for the study.
        """
        space = design_space(problem)
        layout = problem_layout(problem, space, names, maximize, units)
        n_dim = len(space.free.variables)
        sampling = sampling or default_sampling(n_dim)
        points = Points(first, n_points, memory.share, sampling, n_dim, seed)
        last = first + n_points + further - 1
        for number in sorted(memory.retry or ()):
            if not first <= number <= last:
                raise invalid("retry", f"numbers of points of this run, {first} to {last}", number)
        # A column that the problem does not promise may be an output, which its tests will tell.
        if isinstance(limits, Mapping):
            columns = layout.columns
            limits = {k: v for k, v in limits.items() if k in columns or not isinstance(k, str)}
        limited = bounds_of(limits, layout)
        for name, variable in zip(layout.variables, space.variables, strict=True):
            if name in limited and variable.kind is Kind.CHOICE:  # refused now, not after the tests
                plain = (o.item() if isinstance(o, np.generic) else o for o in variable.options)
                real_column(name, np.fromiter(plain, object))

        def identity() -> dict[str, Any]:
            name = sampling_name(sampling, n_points, seed) + method
            return problem_identity(problem, space) | {"sampling": name, "key": study_key}

        table = TestTable.empty(layout)
        # Shares must be of the same points, whether they are stored or not.
        if memory.study is not None or memory.share.of > 1:
            table = replace(table, problem=identity())
            memory.begin(layout, identity(), (first, last))
        else:
            table = replace(table, problem=_plain_or_none(identity))
        return cls(problem, space, table, points, memory)


def _plain_or_none(identity: Callable[[], dict[str, Any]]) -> dict[str, Any] | None:
    """Return an identity that files can hold, or ``None``: a run without a study needs none."""
    try:
        plain: dict[str, Any] = json.loads(json.dumps(identity()))
    except (PsiError, TypeError, ValueError, RecursionError):
        return None
    return plain
