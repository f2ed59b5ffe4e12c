"""Random tables and what is made of them, compared with loops over all tests.

    python -m benchmarks.tables

Each table has columns of random kinds, constraints, failures, repeated designs and missing values.
It is asked under random formulations, parts of it are taken, and parts are joined again. Status and
Pareto set of all these tables must be those of loops that follow the definitions.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from contextlib import suppress
from functools import reduce
from typing import Any

import numpy as np

from benchmarks.machine import sized
from pymoo_psi import TestTable
from pymoo_psi.table import Schema

Plain = dict[str, Any]

TABLES = sized(300, 60)
NAMES = (
    "width", "time, s", "größe", "a b", "n", "teeth", "status", "mass", "gain", "cost", "x_1",
    "violated", "reason", "in", "price (net)", "k`t", "g", "e1", "pareto", "Länge", "heat", "wear",
)  # fmt: skip
OPTIONS = ([12, "12", 12.0, True], ["oak", "tin", "iron, cast"], [1, 1.0, 0.5, "1"], ["yes", "no"])
LABELS = ("A", "B", "C", "7", "12", "#3", "A #2", "test 2", "", None, 7, 2.5, "é")
TEXTS = [text for text in (*LABELS, *OPTIONS[1], "12", "True") if isinstance(text, str)]
EXPRESSIONS = ("{} + {}", "{} / {}", "{} * 2 - {}", "sqrt({}) + {}", "max({}, {})", "{} ** {} + pi")
VALUES = (-1.5, -0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 5.0, 1 / 3, 1e-12)
INEQUALITIES = (-2.0, -0.5, -0.0, 0.5)
EQUALITIES = (0.0, 5e-5, -9e-5, 1e-4, 2e-4)
GROUPS = {  # how many columns of each there are
    "objectives": (0, 1, 2, 2, 3),
    "inequalities": (0, 0, 1, 2),
    "equalities": (0, 0, 0, 1),
    "outputs": (0, 0, 1, 2),
    "notes": (0, 0, 1, 2),
}
KINDS = {
    "real": (-0.0, 0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 1 / 3),
    "log": (0.01, 0.1, 1.0, 10.0, 1e-300),
    "integer": (-3, 0, 1, 2, 12, 2**53 + 1),
    "binary": (True, False),
    "choice": (),
}


def description(draw: random.Random) -> Plain:
    """Return the columns of a random table by group, and their values."""
    n = draw.choice((0, 1, 2, 3, 5, 8, 12, 20, 30))
    names = draw.sample(NAMES, len(NAMES))
    kinds = draw.choices([*KINDS], k=draw.choice((0, 1, 1, 2, 2, 3, 4)))
    options = [KINDS[kind] or draw.choice(OPTIONS) for kind in kinds]
    groups = {"variables": [names.pop() for _ in kinds]}
    for group, counts in GROUPS.items():
        groups[group] = [names.pop() for _ in range(draw.choice(counts))]
    share = draw.choice((0, 0, 0.05, 0.3))
    table: Plain = {
        "numbers": draw.sample(range(1, 4 * n + 2), n),
        "kinds": kinds,
        "X": [[draw.choice(values) for values in options] for _ in range(n)],
        "F": _matrix(draw, n, len(groups["objectives"]), share, VALUES),
        "G": _matrix(draw, n, len(groups["inequalities"]), share / 3, INEQUALITIES),
        "H": _matrix(draw, n, len(groups["equalities"]), share / 3, EQUALITIES),
        "values": _matrix(draw, n, len(groups["outputs"]), share, VALUES),
        "cells": [[draw.choice(LABELS) for _ in groups["notes"]] for _ in range(n)],
        "label": draw.choice([None, *groups["notes"]]),
        "maximize": [name for name in groups["objectives"] if draw.random() < 0.4],
        "tolerance": draw.choice((1e-4, 1e-4, 0.0, 1e-5)),
        "reasons": {},
        **groups,
    }
    for row in range(n):
        if draw.random() < 0.2:  # a repeated design, often with its objectives
            former = draw.randrange(n)
            table["X"][row] = table["X"][former]
            if draw.random() < 0.7:
                table["F"][row] = table["F"][former]
        if draw.random() < share:
            table["reasons"][table["numbers"][row]] = draw.choice(
                ("it broke", "", "f\0g", "\ud800")
            )
    return table


def _matrix(
    draw: random.Random, n: int, k: int, share: float, values: tuple[float, ...]
) -> list[list[float]]:
    """Return n rows of k numbers, a share of them not finite."""
    rows = []
    for _ in range(n):
        row = [draw.choice(values) for _ in range(k)]
        for j in range(k):
            if draw.random() < share:
                row[j] = draw.choice((float("nan"), float("inf"), float("-inf"), 1e308))
        rows.append(row)
    return rows


def made(plain: Plain, start: int = 0, stop: int | None = None) -> TestTable:
    """Return the table of a description, or of some of its tests."""
    part = slice(start, stop)
    numbers = plain["numbers"][part]
    n = len(numbers)
    groups = [plain[group] for group in ("variables", "objectives", "inequalities", "equalities")]
    X = np.empty((n, len(plain["variables"])), object)
    for i, row in enumerate(plain["X"][part]):
        X[i] = row
    arrays = {}
    for name, group in zip("FGH", groups[1:], strict=True):
        arrays[name] = np.array(plain[name][part], float).reshape(n, len(group))
    values = np.array(plain["values"][part], float).reshape(n, len(plain["outputs"]))
    notes = {}
    for j, name in enumerate(plain["notes"]):
        notes[name] = [row[j] for row in plain["cells"][part]]
    schema = Schema.of(
        *groups,
        lower=[np.nan] * len(plain["kinds"]),
        upper=[np.nan] * len(plain["kinds"]),
        eq_tolerance=plain["tolerance"],
        kinds=plain["kinds"],
        maximize=plain["maximize"],
    )
    return TestTable.of(
        numbers,
        X,
        **arrays,
        reasons={number: why for number, why in plain["reasons"].items() if number in numbers},
        outputs=dict(zip(plain["outputs"], values.T, strict=True)),
        notes=notes,
        label=plain["label"],
        schema=schema,
    )


def formulation(draw: random.Random, plain: Plain, table: TestTable) -> Plain:
    """Return the arguments of a random formulation of a table."""
    groups = ("objectives", "inequalities", "equalities", "outputs")
    columns = [name for group in groups for name in plain[group]]
    asked: Plain = {"computed": {}, "limits": {}}
    for name in ("ratio", "sum, all"):
        if columns and draw.random() < 0.3:
            names = draw.choices([*columns, *asked["computed"]], k=2)
            quoted = [f"`{name.replace('`', '``')}`" for name in names]
            asked["computed"][name] = draw.choice(EXPRESSIONS).format(*quoted)
    columns += asked["computed"]
    objectives = plain["objectives"]
    if columns and draw.random() < 0.4:
        objectives = draw.sample(columns, min(len(columns), draw.choice((1, 2, 2, 3))))
        asked["objectives"] = objectives
    if draw.random() < 0.3:
        asked["maximize"] = [name for name in objectives if draw.random() < 0.5]
    if draw.random() < 0.4:
        constraints = plain["inequalities"] + plain["equalities"]
        asked["omitted"] = [name for name in constraints if draw.random() < 0.6]
    columns += [*plain["notes"], *plain["variables"]]
    if draw.random() < 0.7:
        for name in draw.sample(columns, min(len(columns), draw.choice((1, 1, 2, 3)))):
            asked["limits"][name] = _limit(draw, table, name)
    return asked


def _limit(draw: random.Random, table: TestTable, name: str) -> Any:
    """Return a limit on a column, often at the value of a test."""
    cells = table[name].tolist() if name in table else []
    if not all(isinstance(cell, (int, float)) for cell in cells):
        return draw.sample(TEXTS, draw.choice((1, 2, 3)))
    finite = [float(cell) for cell in cells if math.isfinite(cell)]
    low, high = sorted(draw.choices([*finite, 0.75, 1e9], k=2))
    return draw.choice([high, [low, None], [None, high], [low, high], [low, low], f">= {low}"])


def tables_of(seed: int) -> Iterator[TestTable]:
    """Yield a random table, and those that are made of it."""
    draw = random.Random(seed)
    plain = description(draw)
    table = made(plain)
    n = len(table)
    tables = [table]
    for _ in range(3):
        # A refusal, such as of a limit on an expression without values, is no answer.
        with suppress(ValueError, TypeError):
            tables.append(draw.choice(tables).under(**formulation(draw, plain, table)))
    for asked in [*tables]:
        tables.append(asked.take(draw.sample(range(n), draw.randint(0, n))))
        tables.append(asked.take([draw.random() < 0.5 for _ in range(n)]))
    start, stop = sorted(draw.choices(range(n + 1), k=2))
    tables.append(made(plain, 0, stop).extended(made(plain, stop)))
    # Two parts with tests in common, in both orders.
    parts = [made(plain, 0, stop), made(plain, start)]
    tables += [reduce(TestTable.merge, parts), reduce(TestTable.merge, reversed(parts))]
    yield from tables


# Oracles


def require_oracles(table: TestTable) -> None:
    """Check status and Pareto set of a table with loops."""
    assert table.status.tolist() == [_status(table, row) for row in range(len(table))]
    assert np.flatnonzero(table.pareto()).tolist() == _front(table)


def _status(table: TestTable, row: int) -> str:
    """Return the status of a test, from the definition."""
    if int(table.numbers[row]) in table.failures:
        return "failed"
    tolerance = table.schema.eq_tolerance
    is_met = all(g <= 0 for g in table.G[row]) and all(abs(h) <= tolerance for h in table.H[row])
    is_finite = [math.isfinite(f) for f in table.F[row]]
    if is_met or any(is_finite):  # else a requirement kept it from running
        for name, limit in table.limits.items():
            cell = table[name].tolist()[row]
            if limit.texts is not None:
                is_blank = cell is None or cell != cell
                is_met &= ("" if is_blank else str(cell)) in limit.texts
            else:
                is_met &= math.isfinite(cell) and limit.lower <= float(cell) <= limit.upper
    if not is_met:
        return "infeasible"
    return "ok" if all(is_finite) else "failed"


def _front(table: TestTable) -> list[int]:
    """Return the rows that no other one dominates, each design once."""
    names = [*table.evaluated.variables]
    notes = {*table.evaluated.notes} - {"run", "test_point", "row"}
    rows = np.flatnonzero(table.status == "ok").tolist()
    columns = []
    for name in names:
        cells = table.data[name].tolist()
        columns.append([0 if cell == 0 else cell for cell in cells])  # -0.0 is no other number
    columns += [[*map(str, table.data[name])] for name in notes]
    keys = [*map(repr, zip(table.F.tolist(), *columns, strict=True))]
    front = []
    for k, row in enumerate(rows):
        is_repeat = names and any(keys[other] == keys[row] for other in rows[:k])
        if not is_repeat and not any(_dominates(table.F[other], table.F[row]) for other in rows):
            front.append(row)
    return front


def _dominates(one: Any, other: Any) -> bool:
    """Whether objectives are nowhere worse than others, and somewhere better."""
    pairs = [*zip(one.tolist(), other.tolist(), strict=True)]
    is_equal = [math.isclose(a, b, rel_tol=64 * 2**-52) for a, b in pairs]
    is_less = [a < b for a, b in pairs]
    is_worse = [not equal and not less for equal, less in zip(is_equal, is_less, strict=True)]
    return not any(is_worse) and not all(is_equal)


def main() -> None:
    """Check all tables, and print how many they are."""
    n_tables = 0
    for seed in range(TABLES):
        for table in tables_of(seed):
            try:
                require_oracles(table)
            except AssertionError as error:
                raise AssertionError(f"random table {seed}") from error
            n_tables += 1
    print(f"{TABLES} random tables, {n_tables} in all, agree with loops over their tests")


if __name__ == "__main__":
    main()
