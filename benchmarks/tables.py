"""Random tables in another version of this package and in this one: no answer may differ.

    python -m benchmarks.tables [OTHER_CHECKOUT [TABLES]]

This takes minutes, half of one without another checkout.

Random tables, and pairs and triples of runs that are joined, are asked the same questions, each
version in a process of its own. Answers are texts with types and all digits; those that differ are
listed.

Without another checkout, status and Pareto set are compared with loops over all tests.
"""

from __future__ import annotations

import json
import math
import os
import random
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial, reduce
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import sized
from benchmarks.table_descriptions import Model, Plain, description, part
from pymoo_psi import TestTable, investigate
from pymoo_psi.table import Schema

HERE = Path(__file__).resolve().parents[1]
TABLES = sized(3000, 60)
RUNS = sized(300, 6)
ASKED_NAMES = ("A", "B", "C", "7", "12", "#3", "A #2", "", None, 7, 2.5, "é", "3", "1", 0, 2)

# Tables


def made(plain: Plain) -> TestTable:
    """Return the table of a description."""
    X: Any = plain["X"]
    if not X:
        X = np.zeros((0, len(plain["variables"])))
    elif plain["form"] == "mappings" and plain["variables"]:
        X = [dict(zip(plain["variables"], row, strict=True)) for row in X]
    elif plain["form"] == "array":
        cells = np.empty((len(X), len(plain["variables"])), object)
        for i, row in enumerate(X):
            cells[i] = row
        X = cells
        if cells.size and all(type(cell) is float for cell in cells.flat):
            X = cells.astype(float)
    arrays = {}
    for name, group in (("F", "objectives"), ("G", "inequalities"), ("H", "equalities")):
        rows = plain[name]
        arrays[name] = np.array(rows, float).reshape(len(rows), -1 if rows else len(plain[group]))
    reasons = {int(number): why for number, why in plain["reasons"].items()}
    outputs = dict(zip(plain["outputs"], plain["values"], strict=True))
    if plain["is_default"]:
        return TestTable.of(plain["numbers"], X, **arrays, reasons=reasons, outputs=outputs)
    options: Plain = {
        "lower": [np.nan if bound is None else bound for bound in plain["lower"]],
        "upper": [np.nan if bound is None else bound for bound in plain["upper"]],
        "eq_tolerance": plain["tolerance"],
        "kinds": plain["kinds"],
        "outputs": plain["missing"],
        "maximize": plain["maximize"],
        "units": plain["units"],
    }
    groups = [plain[group] for group in ("variables", "objectives", "inequalities", "equalities")]
    notes = dict(zip(plain["notes"], plain["cells"], strict=True))
    given = {**arrays, "outputs": outputs, "reasons": reasons}
    schema = Schema.of(*groups, **options)
    given |= {"notes": notes, "label": plain["label"]}
    return TestTable.of(plain["numbers"], X, **given, schema=schema)


# Answers


def shown(value: Any) -> str:
    """Return a value as a text that tells types, and 0.0 from -0.0, apart."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {value.tolist()}"
    if isinstance(value, tuple):
        return f"({', '.join(map(shown, value))})"
    if hasattr(value, "itertuples"):  # a frame
        columns = {name: cells.tolist() for name, cells in value.items()}
        index = f"{value.index.name} {value.index.tolist()}"
        return f"{index} {[*value.dtypes.map(str)]} {columns}"
    return repr(value)


def answer(question: Callable[..., Any], *arguments: Any) -> str:
    """Return an answer as a text, or the refusal."""
    try:
        text = shown(question(*arguments))
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError) as error:
        text = f"{type(error).__name__}: {error}"
    return text.encode("utf-8", "backslashreplace").decode()


def schema_facts(table: TestTable) -> str:
    """Return the columns of a table, and what they are."""
    schema = table.schema
    names = ("variables", "objectives", "constraints", "outputs", "maximize", "units", "label")
    facts = [getattr(schema, name) for name in names]
    facts[5] = sorted(schema.units.items())
    bounds = (
        schema.lower.tolist(),
        schema.upper.tolist(),
        schema.eq_tolerance,
        schema.sign.tolist(),
    )
    kinds = [kind.value for kind in schema.kinds]
    return f"{facts} {schema.notes} {kinds} {bounds} {schema.words}"


def ranking_facts(ranking: Any) -> str:
    """Return what a ranking says."""
    names = ("rank", "place", "criteria", "pareto", "salukvadze", "rows")
    facts = [shown(getattr(ranking, name)) for name in names]
    facts += [shown(ranking.frame.ideal), shown(ranking.frame.nadir), shown(ranking.lengths)]
    return f"{facts} {shown(ranking.to_frame())} {ranking!r}"


def names_facts(table: TestTable) -> str:
    """Return the names of the designs, and the rows of names, labels and numbers."""
    rows = []
    for design in [*table.names, *map(int, table.numbers), *ASKED_NAMES]:
        rows.append(answer(table.row_of, design))
    return f"{table.names} {rows}"


QUESTIONS: dict[str, Callable[[TestTable], Any]] = {
    "columns": schema_facts,
    "numbers": lambda table: table.numbers,
    "X": lambda table: table.X,
    "F": lambda table: table.F,
    "G": lambda table: table.G,
    "H": lambda table: table.H,
    "cells": lambda table: [f"{name}: {table[name].tolist()}" for name in sorted(table)],
    "status": lambda table: table.status,
    "counts": lambda table: table.status_counts(),
    "reasons": lambda table: sorted(table.reasons.items()),
    "violations": lambda table: table.violations(),
    "feasible": lambda table: (table.feasible(), table.failed()),
    "pareto": lambda table: table.pareto(),
    "repeats": lambda table: table.repeats,
    "names": names_facts,
    "limits": lambda table: [limit.written(name) for name, limit in table.limits.items()],
    "remarks": lambda table: table.remarks,
    "formulation": lambda table: table.formulation.without_columns(),
    "ranking": lambda table: ranking_facts(table.ranking()),
    "feasible ranking": lambda table: ranking_facts(table.feasible_ranking()),
    "best": lambda table: (table.best().names, table.best().X),
    "bounds": lambda table: table.refined_bounds(),
    "sorted": lambda table: [
        table.sort_by(name).numbers.tolist() for name in table.schema.objectives
    ],
    "frame": lambda table: table.to_frame().drop(columns=[*table]),
    "order": lambda table: [*table.to_frame()],
    "repr": repr,
}


def taken(table: TestTable, selection: Any) -> Any:
    """Return the numbers of selected tests."""
    return table.take(selection).numbers


def equal_ones(table: TestTable, tables: dict[str, TestTable]) -> list[str]:
    """Return the names of the tables that are equal to one."""
    return [name for name, other in tables.items() if table.equals(other)]


def tables_of(plain: Plain) -> Iterator[tuple[str, TestTable | Exception]]:
    """Return the table of a description, those made of it, and refusals, by name."""
    try:
        table = made(plain)
    except (ValueError, TypeError) as error:
        yield "of", error
        return
    tables = {"": table}
    for k, asked in enumerate(plain["asked"]):
        former = tables.get("under 1: ", table) if k == 2 else table
        try:
            tables[f"under {k}: "] = former.under(**asked)
        except (ValueError, TypeError) as error:
            yield f"under {k}: ", error
    for name, asked_table in [*tables.items()]:
        for k, selection in enumerate(plain["selections"][:2]):
            if name != "under 0: ":
                tables[f"{name}take {k}: "] = asked_table.take(selection)
    yield from tables.items()
    start, stop = (*plain["parts"]["ends"], 0)[:2]
    options = {name: plain["parts"][name] for name in ("without", "shift", "mended")}
    without = {"without": options["without"]}
    parts = {
        "extended: ": [part(plain, 0, stop), part(plain, stop, None, **without)],
        "merge: ": [
            part(plain, 0, max(start, stop)),
            part(plain, min(start, stop), None, **options),
        ],
        "merge turned: ": [part(plain, start, None, **options), part(plain, 0, stop)],
        "three: ": [
            part(plain, stop, None, **without),
            part(plain, 0, start),
            part(plain, start, stop),
        ],
    }
    for name, descriptions in parts.items():
        try:
            joined = [made(one) for one in descriptions]
            if name in ("merge turned: ", "three: "):
                joined = [one.under(**plain["asked"][0]) for one in joined]
            if name.startswith("merge"):
                yield name, reduce(TestTable.merge, joined)
            else:
                yield name, joined[0].extended(*joined[1:])
        except (ValueError, TypeError) as error:
            yield name, error


def runs_of(seed: int) -> Iterator[tuple[str, TestTable | Exception]]:
    """Return pairs and triples of runs, joined in random ways, by name."""
    draw = random.Random(seed)
    is_finite = draw.random() < 0.5
    share = draw.choice((0.0, 0.2, 0.6))
    factors = draw.choice(
        ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 2.0], [1.0, 1.0, 1 + 2**-52])
    )
    k = draw.choice((2, 3))
    runs = []
    for i in range(k):
        first, n = (
            (i * 8 + 1, 8) if draw.random() < 0.6 else (draw.randint(1, 9), draw.randint(1, 16))
        )
        options = {"first": first}
        if draw.random() < 0.3:
            first, n, options = 1, 24, {"share": (i + 1, k)}
        runs.append(investigate(Model(is_finite, share, factors[i]), n, **options))
    draw.shuffle(runs)
    asked = {"limits": draw.choice(("f1<=0.5", "heat<=0.3", "x1<=0.6, f2<=0.2"))}
    if draw.random() < 0.3:
        asked["objectives"] = draw.choice((["f1", "heat"], ["x1", "x2"], ["f2", "g1"]))

    def under() -> list[TestTable]:
        return [run.under(**asked) for run in runs]

    ways = {
        "extended": lambda: runs[0].extended(*runs[1:]),
        "merge": lambda: reduce(TestTable.merge, runs),
        "merge turned": lambda: reduce(lambda one, other: other.merge(one), reversed(runs)),
        "under, extended": lambda: under()[0].extended(*under()[1:]),
        "under, merge": lambda: reduce(TestTable.merge, under()),
        "merge, under": lambda: reduce(TestTable.merge, runs).under(**asked),
        "one under, merge": lambda: reduce(TestTable.merge, [under()[0], *runs[1:]]),
    }
    for name, way in ways.items():
        try:
            yield f"{name}: ", way()
        except (ValueError, TypeError) as error:
            yield f"{name}: ", error


def answers(
    named: Iterator[tuple[str, TestTable | Exception]], plain: Plain
) -> Iterator[tuple[str, str]]:
    """Return the questions on tables, and the answers."""
    tables = {}
    for name, table in named:
        if isinstance(table, Exception):
            yield name, answer(partial(_raise, table))
        else:
            tables[name] = table
    for name, table in tables.items():
        for question, asks in QUESTIONS.items():
            yield f"{name}{question}", answer(asks, table)
        for selection in plain.get("selections", ()):
            yield f"{name}take {selection}", answer(taken, table, selection)
        widened = partial(table.refined_bounds, margin=plain.get("margin", 0.1))
        yield f"{name}bounds with a margin", answer(widened)
        yield f"{name}equals", answer(equal_ones, table, tables)


def _raise(error: Exception) -> None:
    raise error


def write_answers(n: int, n_runs: int) -> None:
    """Write the answers on tables and runs, a line of JSON for each."""
    for seed in range(n):
        plain = json.loads(json.dumps(description(seed)))
        print(json.dumps(dict(answers(tables_of(plain), plain))))
    for seed in range(n_runs):
        print(json.dumps(dict(answers(runs_of(seed), {}))))


# Comparison

UNCOMPARED = ("remarks",)
"""Questions that do not say whether tables are equal."""


def differences(other: dict[str, str], answers: dict[str, str]) -> Iterator[tuple[str, str, str]]:
    """Return the questions on which two versions differ, with both answers.

    Two tables are equal if all answers on them are: what ``equals`` says of them is asked, too.
    """
    for question in dict.fromkeys((*other, *answers)):
        one = other.get(question, "")
        two = answers.get(question, "")
        if one != two:
            yield question, one, two
        if question in answers and question.endswith("equals"):
            same = str(_same(question, answers))
            is_known = "'failed'" not in answers[question.replace("equals", "status")]
            if is_known and two != same:  # values of failed tests may be unknown
                yield question, same, two


def _same(question: str, answers: dict[str, str]) -> list[str]:
    """Return the tables on which all answers are those on one."""
    facts = {}
    for name in answers:
        if name.endswith("equals"):
            table = name.removesuffix("equals")
            texts = [answers[f"{table}{asked}"] for asked in QUESTIONS if asked not in UNCOMPARED]
            facts[table] = [re.sub(r"-0\.0\b", "0.0", text) for text in texts]  # which are equal
    return [name for name in facts if facts[name] == facts[question.removesuffix("equals")]]


def started(checkout: Path, *arguments: object) -> subprocess.Popen[str]:
    """Start this benchmark with the package of a checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout / "src"), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "benchmarks.tables", *map(str, arguments)]
    return subprocess.Popen(
        command, cwd=HERE, env=environment, stdout=subprocess.PIPE, text=True, encoding="utf-8"
    )


def all_answers(checkout: Path, n: int) -> Iterator[dict[str, str]]:
    """Return the answers of a package on n tables and all runs, from a process of its own."""
    with started(checkout, "--answers", n, RUNS) as process:
        for line in process.stdout or ():
            yield json.loads(line)
    if process.returncode:
        raise SystemExit(f"no answers from {checkout}")


def compare(checkout: Path, n: int) -> int:
    """Print the differences between the answers on n tables, and return how many there are."""
    n_answers = 0
    n_differing = 0
    pairs = zip(all_answers(checkout, n), all_answers(HERE, n), strict=True)
    for seed, (one, two) in enumerate(pairs):
        n_answers += len(two)
        for question, other, answer in differences(one, two):
            n_differing += 1
            print(f"table {seed}, {question}" if seed < n else f"runs {seed - n}, {question}")
            print(f"    other: {other[:300]}")
            print(f"    this:  {answer[:300]}")
    print(f"{n} tables, {RUNS} runs, {n_answers} answers, {n_differing} differ")
    return n_differing


# Oracles


def require_oracles(n: int) -> int:
    """Check status and Pareto sets of n tables with loops, and return how many tables they are."""
    n_tables = 0
    for seed in range(n):
        for name, table in tables_of(json.loads(json.dumps(description(seed)))):
            if isinstance(table, Exception):
                continue
            n_tables += 1
            status = [_status(table, row) for row in range(len(table))]
            assert table.status.tolist() == status, f"table {seed}, {name}status"
            assert np.flatnonzero(table.pareto()).tolist() == _front(table), f"table {seed}, {name}"
    return n_tables


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
    columns = [table.data[name].tolist() for name in names]
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
    """Compare another checkout of the package with this one."""
    option, *sizes = *sys.argv[1:], ""
    if option == "--answers":
        write_answers(*map(int, sizes[:2]))
        return
    print(f"{require_oracles(min(TABLES, 300))} tables agree with loops over their tests")
    if option and compare(Path(option).resolve(), int(sizes[0] or TABLES)):
        sys.exit(1)


if __name__ == "__main__":
    main()
