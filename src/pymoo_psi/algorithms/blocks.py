"""Blocks of test points: pymoo's populations on the one side, the test table on the other."""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.core.population import Population

from pymoo_psi.arguments import Received, broken_rule
from pymoo_psi.host import DesignSpace
from pymoo_psi.investigation import Layout, TestTable

__all__ = ["problem_layout", "recall", "require_next", "table_of_block"]


def problem_layout(problem: Any, space: DesignSpace) -> Layout:
    """Return the columns of the test table of a problem: names and bounds."""
    discrete = np.array([variable.kind in ("binary", "choice") for variable in space.variables])
    return Layout.of(
        space.names,
        problem.n_obj,
        problem.n_ieq_constr,
        problem.n_eq_constr,
        lower=np.where(discrete, np.nan, space.lower),
        upper=np.where(discrete, np.nan, space.upper),
    )


def recall(block: Population, stored: TestTable) -> None:
    """Give designs of a block their stored values; pymoo then evaluates only the others.

    Args:
        block: Consecutive test points.
        stored: Some of them, evaluated.
    """
    if len(stored) == 0:
        return
    known = block[stored.numbers - block[0].get("test_point")]
    reasons = [stored.reasons.get(number, "") for number in stored.numbers.tolist()]
    known.set("F", stored.F, "G", stored.G, "H", stored.H, "failure", reasons)
    for individual in known:
        individual.evaluated.update("FGH")
        if individual.get("failure"):
            individual.CV = np.array([np.inf])


def require_next(block: Population, first: int) -> None:
    """Refuse a block that a user tells and that does not continue where the last one ended."""
    numbers = block.get("test_point").tolist()
    if numbers != list(range(first, first + len(numbers))):
        raise broken_rule(
            "infills",
            f"the test points asked for, from number {first}, in their order",
            Received(str(numbers)),
            "tell the population that ask() returned",
        )


def table_of_block(block: Population, space: DesignSpace, layout: Layout) -> TestTable:
    """Return evaluated designs as a table.

    Raises:
        ArgumentValueError: The block is not evaluated.
    """
    groups = {"F": layout.objectives, "G": layout.inequalities, "H": layout.equalities}
    for name, columns in groups.items():
        values = block.get(name)
        if values.shape != (len(block), len(columns)):
            raise broken_rule(
                f"{name} of infills",
                f"{len(columns)} values for each design",
                Received(f"an array of shape {values.shape}"),
                "evaluate the population before it is told",
            )
    numbers, X, failures = block.get("test_point", "X", "failure")
    reasons = {n: r for n, r in zip(numbers.tolist(), failures, strict=True) if r}
    return TestTable.of(
        numbers, space.to_matrix(X), *block.get("F", "G", "H"), reasons=reasons, layout=layout
    )
