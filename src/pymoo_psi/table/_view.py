"""Tests under a formulation: the arrays that pymoo and the mathematics of Pareto sets take.

Nothing here is kept in a file: it follows from columns as evaluated, and is computed when it is
asked for. This is the only place that knows signs: ``F`` is minimised, columns have the original
direction.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_psi._kinds import Kind
from pymoo_psi._validation import (
    AnyArray,
    Array,
    Integers,
    Mask,
    Rows,
    invalid,
    known_name,
)
from pymoo_psi.pareto import nondominated, violated_constraints
from pymoo_psi.table._data import Data
from pymoo_psi.table._expression import Expression
from pymoo_psi.table._formulation import Formulation
from pymoo_psi.table._limits import Limit, texts_of
from pymoo_psi.table._schema import (
    EQUALITY,
    INEQUALITY,
    NOT_OF_DESIGNS,
    OBJECTIVE,
    VARIABLE,
    Schema,
    first_of,
    real_column,
)

STATUSES = ("ok", "infeasible", "failed")
_OK, _INFEASIBLE, _FAILED = range(3)
_N_SHOWN = 50  # the most rows whose texts a message names


class View:
    """The arrays of n tests under a formulation.

    Args:
        schema: The columns as evaluated.
        data: Their cells.
        numbers: ``(n,)`` the numbers of the tests.
        failures: Why evaluations failed, by the number of the test.
        formulation: What is asked.

    Attributes:
        schema: The columns in the roles that the formulation gives them.
    """

    def __init__(
        self,
        schema: Schema,
        data: Data,
        numbers: Integers,
        failures: Mapping[int, str],
        formulation: Formulation,
    ) -> None:
        self.schema = schema
        if formulation.changes_columns:
            self.schema = formulation.roles_in(schema)
        self._evaluated = schema
        self._data = data
        self._numbers = numbers
        self._failures = failures
        self._formulation = formulation

    @cached_property
    def columns(self) -> Data:
        """The columns of the formulation, with computed ones, in the original directions."""
        if self.schema is self._evaluated:
            return self._data
        columns = {name: self._data[name] for name in self._evaluated.values}
        for name, text in self._formulation.computed.items():
            columns[name] = Expression.of(text).values(columns)
        for name in self.schema.objectives:
            columns[name] = real_column(name, columns[name])
            if name in self._evaluated.names and self._evaluated[name].role == EQUALITY:
                columns[name] = np.abs(columns[name])
        if all(cells is self._data.get(name) for name, cells in columns.items()):
            return self._data  # with the matrices that other formulations have made
        return Data({**self._data, **columns})

    def _matrix(self, role: str) -> Array:
        turned: tuple[str, ...] = ()
        if role == OBJECTIVE:
            turned = self.schema.maximize
        return self.columns.matrix(len(self._numbers), self.schema.of_role(role), turned)

    @cached_property
    def F(self) -> Array:
        """``(n, m)`` objectives, all minimised."""
        return self._matrix(OBJECTIVE)

    @cached_property
    def G(self) -> Array:
        """``(n, n_ieq)`` inequality constraints, met where <= 0."""
        return self._matrix(INEQUALITY)

    @cached_property
    def H(self) -> Array:
        """``(n, n_eq)`` equality constraints, met within the tolerance."""
        return self._matrix(EQUALITY)

    @cached_property
    def X(self) -> AnyArray:
        """``(n, n_var)`` designs: objects if the kinds of the variables differ."""
        return self.columns.matrix(len(self._numbers), self.schema.of_role(VARIABLE))

    @cached_property
    def limits(self) -> dict[str, Limit]:
        """The limits by column: in the order of the columns, those on texts last.

        Raises:
            ArgumentValueError: A column is unknown or a constraint, has other values, or it is
                unclear which side of it a number limits.
        """
        free = [name for name in self.schema.values if name not in self.schema.constraints]
        on_numbers: dict[str, Limit] = {}
        on_texts: dict[str, Limit] = {}
        for name, limit in self._formulation.allowed.items():
            if name not in self.schema.names and self._all_failed:
                continue  # which outputs a model has is unknown before its first value
            if limit.texts is not None:
                self._require_texts(name, limit)
                on_texts[name] = limit
                continue
            remedy = ""
            if name in self.schema.constraints:
                remedy = (
                    "leave the constraint out by Formulation(omitted=...) to give it other limits"
                )
            known_name("a name in limits", name, free, remedy)
            if limit.is_bare and self.schema[name].maximize:
                high = limit.plain
                raise invalid(
                    f"{name!r}, which is maximised, in limits",
                    "a pair (lower, upper)",
                    high,
                    f"say ({high}, None) for at least or (None, {high}) for at most",
                )
            if not limit.is_open:
                on_numbers[name] = limit
        # The order of the columns, not of the mapping: columns of violations stand in it.
        ordered = {name: on_numbers[name] for name in free if name in on_numbers}
        return ordered | on_texts

    def _require_texts(self, name: str, limit: Limit) -> None:
        """Refuse a limit on texts on a column of numbers."""
        known_name("a name in limits", name, self.schema.names)
        if name not in self.schema.notes and self.schema[name].kind is not Kind.CHOICE:
            raise invalid(
                f"{name!r} in limits",
                "numbers, as its values are",
                limit.plain,
                "a limit on numbers is such as '<= 250'",
            )

    def require_met_texts(self) -> None:
        """Refuse a limit on texts that no test meets: it is more likely misspelt.

        Rows that are taken from a table keep its limits, even if they meet none.
        """
        for name, limit in self.limits.items():
            if not limit.texts:
                continue
            cells = texts_of(self.columns[name])
            if len(cells) and not np.isin(cells, limit.texts).any():
                known_name(f"{name!r} in limits", limit.texts[0], {*cells[:_N_SHOWN].tolist()})

    @property
    def _failed(self) -> Mask:
        """``(n,)`` which tests failed in their evaluation."""
        if not self._failures:
            return np.zeros(len(self._numbers), dtype=bool)
        return np.isin(self._numbers, [*self._failures])

    @property
    def _all_failed(self) -> bool:
        return bool(self._failed.all())

    def violated(self) -> Mask:
        """``(n, k)`` which tests violate each constraint, and then each limit.

        A design that a requirement kept from running violates no limit.
        """
        constraints = violated_constraints(self.G, self.H, self.schema.eq_tolerance)
        masks = [constraints]
        if self.limits:
            has_run = ~constraints.any(axis=1) | np.isfinite(self.F).any(axis=1)
            for name, limit in self.limits.items():
                exceeds = limit.excess(name, self.columns[name]) > 0
                masks.append((exceeds & has_run)[:, None])
        return np.hstack(masks)

    @cached_property
    def codes(self) -> NDArray[np.int8]:
        """``(n,)`` the indices of the statuses: a text takes 40 bytes.

        A test failed if its evaluation did, or if it meets its constraints and limits but an
        objective is not finite. All others are infeasible if they violate one, else ok.
        """
        codes = np.asarray(self.violated().any(axis=1)).astype(np.int8)
        codes[(codes == _OK) & ~np.isfinite(self.F).all(axis=1)] = _FAILED
        codes[self._failed] = _FAILED
        codes.setflags(write=False)
        return codes

    def has_status(self, status: str) -> Mask:
        """``(n,)`` which tests have a status."""
        return np.asarray(self.codes == STATUSES.index(status))

    @cached_property
    def reasons(self) -> dict[int, str]:
        """Why tests failed, by their numbers."""
        reasons = dict(self._failures)
        for row in np.flatnonzero(self.has_status("failed") & ~self._failed).tolist():
            j = int(np.argmin(np.isfinite(self.F[row])))
            name = self.schema.objectives[j]
            reasons[int(self._numbers[row])] = f"{name} is {self.columns[name][row]}"
        return reasons

    @cached_property
    def pareto(self) -> Mask:
        """``(n,)`` which designs are Pareto optimal among those that are ok, each once."""
        mask = self.has_status("ok")
        if self.F.shape[1] > 0:  # without objectives no design is better than another
            mask[mask] = nondominated(self.F[mask])
        mask[mask] = ~self.repeated(np.flatnonzero(mask))
        mask.setflags(write=False)
        return mask

    def repeated(self, rows: Rows) -> Mask:
        """Return which of some tests repeat design, objectives and notes of an earlier one of them.

        The design is that of all variables, also of those that the formulation makes objectives.
        """
        repeats = np.zeros(len(rows), dtype=bool)
        variables = self._evaluated.variables
        if not variables or len(rows) < 2:  # without variables, no design equals another
            return repeats
        F = self.F[rows]
        first = F[:, 0] if F.shape[1] else real_or_zeros(self._data[variables[0]][rows])
        # A row with a value that occurs once occurs once.
        ordered = np.sort(first)
        recurring = ordered[1:][ordered[1:] == ordered[:-1]]
        if len(recurring) == 0 and not np.isnan(first).any():
            return repeats
        places = np.flatnonzero(np.isin(first, recurring) | np.isnan(first))
        designs = {name: self._data[name][rows[places]] for name in variables}
        notes = []
        for name in self._evaluated.notes:
            if name not in NOT_OF_DESIGNS:
                notes.append(map(str, self._data[name][rows[places]]))
        keys = zip(self._evaluated.keys(designs), map(bytes, F[places]), *notes, strict=True)
        repeats[places] = first_of(keys) < np.arange(len(places))
        return repeats


def real_or_zeros(cells: AnyArray) -> Array:
    """Return cells of numbers as float64, zeros of others."""
    if cells.dtype == object:
        return np.zeros(len(cells))
    return cells.astype(np.float64)
