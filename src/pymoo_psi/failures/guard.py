"""What is checked in the values of one design, and what stands for the values of a failed one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pymoo_psi.errors import EvaluationError
from pymoo_psi.pareto.feasibility import meets_constraints
from pymoo_psi.runners.outcome import Values, one_line

__all__ = ["FAILED", "Guard", "columns"]

FAILED = 1e10  # the violation of a failed design: above any other, and finite for sums and ratios


@dataclass(frozen=True)
class Guard:
    """Checks the values of one design, and gives those that stand for a failed one.

    It goes to the workers in the place of the :class:`FailureTolerant` with all its failures.
    """

    n_var: int
    sizes: tuple[int, int, int]
    nan_stands_for: float | None
    stop: bool

    def row(self, design: Any, evaluate: Callable[[], Values]) -> Values:
        """Return the values of a design with the constraint and the reason added."""
        try:
            return self._checked(evaluate())
        except _BadValues as error:
            return self.failed(design, str(error))
        except EvaluationError as error:
            return self.failed(design, error.reason, error.original)
        except (Exception, SystemExit) as error:  # a legacy model may exit where it should raise
            return self.failed(design, one_line(error), error)

    def failed(self, design: Any, reason: str, cause: BaseException | None = None) -> Values:
        """Return the values of a failed design, or raise if the run must stop."""
        if self.stop:
            raise EvaluationError(design, reason, cause) from cause
        n_obj, n_ieq, n_eq = self.sizes
        return {
            "F": np.full(n_obj, np.inf),
            "G": np.append(np.zeros(n_ieq), FAILED),
            "H": np.zeros(n_eq),
            "failure": reason,
        }

    def split(self, out: Values, n: int) -> list[Values]:
        """Return the values that a vectorised problem gave for ``n`` designs, design by design."""
        rows: list[Values] = [{} for _ in range(n)]
        for name, value in out.items():
            if value is None:
                continue
            array = np.column_stack(value) if isinstance(value, list) else np.asarray(value)
            if array.ndim == 0 or len(array) != n:
                raise _BadValues(f"{name} has shape {array.shape} for {n} designs")
            for row, part in zip(rows, array, strict=True):
                row[name] = part
        return rows

    def _checked(self, raw: Values) -> Values:
        row = {name: value for name, value in raw.items() if value is not None}
        for name, size in zip("FGH", self.sizes, strict=True):
            row[name] = self._numbers(name, row.get(name, () if size == 0 else None), size)
        F, G, H = row["F"], row["G"], row["H"]
        if np.isinf(F).any() and meets_constraints(G, H):
            raise _BadValues(f"F is {F.tolist()} though the design is feasible")
        row["G"] = np.append(G, 0.0)
        if "dG" in row:
            gradients = np.reshape(row["dG"], (len(G), self.n_var))
            row["dG"] = np.vstack([gradients, np.zeros(self.n_var)])
        row["failure"] = ""
        return row

    def _numbers(self, name: str, value: Any, size: int) -> Any:
        if value is None:
            raise _BadValues(f"{name} is missing")
        try:
            numbers = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise _BadValues(f"{name} is not an array of numbers: {error}") from error
        if numbers.size != size:
            raise _BadValues(f"{name} has shape {numbers.shape} instead of {(size,)}")
        numbers = numbers.reshape(size)
        if self.nan_stands_for is not None:
            numbers = np.where(np.isnan(numbers), self.nan_stands_for, numbers)
        if np.isnan(numbers).any():
            raise _BadValues(f"{name} is {numbers.tolist()}")
        return numbers


class _BadValues(Exception):  # noqa: N818 - only ever a message, and never leaves this module
    """What a model returned cannot be used."""


def columns(rows: list[Values]) -> Values:
    """Return the values of designs, one dictionary each, as one dictionary of arrays.

    Where a design lacks a value that others have, as a failed one may, it has nan or None.
    """
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: _column([row.get(name) for row in rows]) for name in names}


def _column(values: list[Any]) -> Any:
    """Return one value of all designs as an array."""
    present = [value for value in values if value is not None]
    if len(present) < len(values):
        shape = np.shape(present[0])
        numeric = all(np.shape(v) == shape and np.asarray(v).dtype.kind in "fiub" for v in present)
        nothing = np.full(shape, np.nan) if numeric else None
        values = [nothing if value is None else value for value in values]
        if not numeric:
            column = np.empty(len(values), dtype=object)
            column[:] = values
            return column
    return np.array(values)
