"""The arrays of a test table: checked once, read-only after, cut and joined by rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, invalid, real_array
from pymoo_psi.errors import ArgumentTypeError
from pymoo_psi.pareto._feasibility import violated_constraints
from pymoo_psi.table._designs import design_matrix, joined_designs
from pymoo_psi.table._entries import point_numbers, reason_texts, require_distinct, widths
from pymoo_psi.table._layout import Layout
from pymoo_psi.table._prototype import Prototype

if TYPE_CHECKING:
    from typing_extensions import Self


Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

STATUSES = ("ok", "infeasible", "failed")
_BLOCKS = ("X", "F", "G", "H", "status")


@dataclass(frozen=True, eq=False, repr=False)
class Records:
    """Tested points in the order of testing; see :class:`TestTable` for the attributes."""

    layout: Layout
    numbers: NDArray[np.int64]
    X: NDArray[Any]
    F: Array
    G: Array
    H: Array
    status: NDArray[np.str_]
    reasons: Mapping[int, str] = field(default_factory=dict)
    prototype: Prototype | None = None

    def __post_init__(self) -> None:
        """Bring the arrays into their normal form and check that they belong together."""
        numbers = point_numbers(self.numbers)
        checked: dict[str, Any] = {
            "numbers": numbers,
            "X": design_matrix("X", self.X, self.layout.variables),
            "status": np.asarray(self.status, dtype=str),
            "reasons": reason_texts(self.reasons),
        }
        for name in "FGH":
            checked[name] = np.array(real_array(name, getattr(self, name)), order="C")
        for name, width in widths(self.layout).items():
            shape = (len(numbers), width)
            if checked[name].shape != shape:
                found = Received(f"shape {checked[name].shape}")
                raise invalid(name, f"of shape {shape} (tests, columns)", found)
        self._set(checked)
        self._check_status()
        self._check_reasons()
        if self.prototype is not None:
            self._set({"prototype": self.prototype.checked(self.layout)})

    def _check_status(self) -> None:
        if self.status.shape != self.numbers.shape:
            found = Received(f"shape {self.status.shape}")
            raise invalid("status", f"of shape {self.numbers.shape}", found)
        right = self._status(self.status == "failed")
        for i in np.flatnonzero(self.status != right):
            raise invalid(
                "status",
                "ok where the constraints are met, infeasible where not, or failed",
                Received(f"{str(self.status[i])!r} for test point {self.numbers[i]}"),
            )
        self._set({"status": right})

    def _check_reasons(self) -> None:
        if not self.reasons:
            return
        unknown = set(self.reasons).difference(self.numbers[self.status == "failed"].tolist())
        if unknown:
            found = Received(f"one for {min(unknown)}")
            raise invalid("reasons", "given for failed test points", found)

    def _status(self, failed: Mask) -> NDArray[np.str_]:
        """``(n,)`` the status that follows from what failed and from the constraints."""
        broken = self.broken_constraints.any(axis=1)
        status: NDArray[np.str_] = np.array(STATUSES)[np.where(failed, 2, broken)]
        return status

    @classmethod
    def of(
        cls,
        numbers: ArrayLike,
        X: Any,
        F: ArrayLike,
        G: ArrayLike | None = None,
        H: ArrayLike | None = None,
        *,
        reasons: Mapping[int, str] | None = None,
        layout: Layout | None = None,
    ) -> Self:
        """Return a table of evaluated designs; their status follows from the constraints.

        A design with a reason has failed. A design that meets its constraints but whose criteria
        are not all finite has failed as well, for that reason.

        Args:
            numbers: ``(n,)`` numbers of the test points, from 1, each once.
            X: ``(n, n_var)`` designs, or n mappings from variable to value.
            F: ``(n, m)`` criteria, all minimised; NaN and infinity are allowed.
            G: ``(n, n_ieq)`` inequality constraints, met where <= 0.
            H: ``(n, n_eq)`` equality constraints, met within the tolerance.
            reasons: Why designs failed, for their numbers.
            layout: Names, bounds and tolerance; default names and no bounds unless given.

        Raises:
            ArgumentValueError: The arrays do not fit each other or the layout.
            ArgumentTypeError: An array holds what it cannot.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], X=[[0.0], [0.5]], F=[[3.0], [4.0]], G=[[0.0], [0.1]])
            >>> table.status.tolist()
            ['ok', 'infeasible']
        """
        numbers = point_numbers(numbers)
        F = real_array("F", F)
        G, H = (np.zeros((len(numbers), 0)) if v is None else v for v in (G, H))
        G, H = real_array("G", G), real_array("H", H)
        if layout is None:
            X = design_matrix("X", X)
            layout = Layout.of(X.shape[1], _width(F), _width(G), _width(H))
        given = reason_texts({} if reasons is None else reasons)
        table = cls(layout, numbers, X, F, G, H, np.full(len(numbers), "failed"))
        failed = np.isin(table.numbers, list(given)) if given else np.zeros(len(table), dtype=bool)
        lost = ~failed & ~np.isfinite(table.F).all(axis=1)
        lost &= ~table.broken_constraints.any(axis=1)
        for i in np.flatnonzero(lost):
            j = int(np.flatnonzero(~np.isfinite(table.F[i]))[0])
            given[int(table.numbers[i])] = f"{layout.objectives[j]} is {table.F[i, j]}"
        table._set({"status": table._status(failed | lost), "reasons": given})
        table._check_reasons()
        return table

    @classmethod
    def empty(cls, layout: Layout | None = None) -> Self:
        """Return a table without any test.

        Args:
            layout: Names, bounds and tolerance. Without one the table takes the layout of the
                first block it is extended by.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.empty()
            >>> len(table), len(table.extended(TestTable.of([1], [[0.5]], [[2.0]])))
            (0, 1)
        """
        layout = Layout.of() if layout is None else layout
        blocks = {name: np.zeros((0, width)) for name, width in widths(layout).items()}
        numbers, status = np.zeros(0, dtype=np.int64), np.zeros(0, dtype="<U10")
        return cls(layout, numbers, blocks["X"], blocks["F"], blocks["G"], blocks["H"], status)

    def __repr__(self) -> str:
        """Return the size of the table."""
        counts = ", ".join(f"{np.sum(self.status == status)} {status}" for status in STATUSES)
        constraints = len(self.layout.constraints)
        sizes = (
            f"{self.X.shape[1]} variables, {self.F.shape[1]} criteria, {constraints} constraints"
        )
        return f"{type(self).__name__}({len(self)} tests: {counts}; {sizes})"

    def __len__(self) -> int:
        """Return the number of tested points."""
        return len(self.numbers)

    @property
    def broken_constraints(self) -> Mask:
        """``(n, n_ieq + n_eq)`` which constraints a design breaks; one that is NaN is broken.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2], [[0.0], [0.5]], [[1], [2]], G=[[0.0], [0.1]])
            >>> table.broken_constraints
            array([[False], [ True]])
        """
        return violated_constraints(self.G, self.H, self.layout.eq_tolerance)

    def extended(self, *blocks: Self) -> Self:
        """Return this table with the tests of others behind its own, in their order.

        Joining many blocks in one call copies the rows once.

        Raises:
            ArgumentValueError: A block has another layout, or a test point occurs twice.

        Example:
            >>> from pymoo_psi import TestTable
            >>> first, second = (TestTable.of([n], [[0.1 * n]], [[1.0]]) for n in (1, 2))
            >>> first.extended(second).numbers
            array([1, 2])
        """
        tables = [t for t in (self, *blocks) if len(t) or not t.layout.is_blank]
        if len(tables) < 2:
            return tables[0] if tables else self
        base = tables[0]
        for block in tables[1:]:
            difference = base.layout.difference(block.layout)
            if difference:
                raise invalid("block", "of the table's layout", Received(difference))
        numbers = np.concatenate([t.numbers for t in tables])
        require_distinct(numbers)
        joined: dict[str, Any] = {
            name: np.concatenate([getattr(t, name) for t in tables]) for name in _BLOCKS[1:]
        }
        joined["X"] = joined_designs([t.X for t in tables])
        reasons = {n: text for t in tables for n, text in t.reasons.items()}
        prototype = next((t.prototype for t in tables if t.prototype is not None), None)
        return base._with(numbers=numbers, reasons=reasons, prototype=prototype, **joined)

    def rows(self, selection: ArrayLike) -> Self:
        """Return the table of some rows.

        Args:
            selection: ``(n,)`` mask, or ``(k,)`` indices of rows in the wanted order.

        Raises:
            ArgumentValueError: A mask of another length, an index out of range or twice.
            ArgumentTypeError: The selection is neither mask nor indices.

        Example:
            >>> from pymoo_psi import TestTable
            >>> table = TestTable.of([1, 2, 3], [[0.1], [0.5], [0.9]], [[1], [2], [3]])
            >>> table.rows([2, 0]).numbers, table.rows(table.F[:, 0] > 1).numbers
            (array([3, 1]), array([2, 3]))
        """
        chosen = np.asarray(selection)
        if chosen.size == 0 and chosen.dtype != bool:
            chosen = chosen.astype(np.intp)
        if chosen.dtype.kind not in "biu":
            raise ArgumentTypeError(
                f"selection must be a mask or indices, got dtype {chosen.dtype}"
            )
        try:
            numbers = self.numbers[chosen]
        except IndexError as error:
            rule = f"a mask or indices of {len(self)} rows"
            raise invalid("selection", rule, Received(error)) from error
        require_distinct(numbers)
        cut: dict[str, Any] = {name: getattr(self, name)[chosen] for name in _BLOCKS}
        kept = set(numbers.tolist()) if self.reasons else set()
        reasons = {n: text for n, text in self.reasons.items() if n in kept}
        return self._with(numbers=numbers, reasons=reasons, **cut)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return the table itself, which never changes; pymoo copies its algorithms often."""
        return self

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a pickled table with its arrays read-only."""
        self._set(state)

    def _with(self, **changes: Any) -> Self:
        """Return the table with new arrays that are known to be right."""
        table = object.__new__(type(self))
        table._set({f.name: getattr(self, f.name) for f in fields(self)} | changes)
        return table

    def _set(self, values: Mapping[str, Any]) -> None:
        for name, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)


def _width(values: Array) -> int:
    return values.shape[1] if values.ndim == 2 else 0
