"""Plain descriptions of random tables, which JSON can hold, and a model for random runs.

See :mod:`benchmarks.tables`.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Integer

Plain = dict[str, Any]

NAMES = (
    "width", "time, s", "größe", "a b", "n", "teeth", "status", "mass", "gain", "cost", "x_1",
    "violated", "reason", "in", "price (net)", "k`t", "g", "e1", "pareto", "Länge", "heat", "wear",
)  # fmt: skip
UNITS = ("", "", "kg", "mm", "N/mm²", "%")
OPTIONS = ([12, "12", 12.0, True], ["oak", "tin", "iron, cast"], [1, 1.0, 0.5, "1"], ["yes", "no"])
LABELS = ("A", "B", "C", "7", "12", "#3", "A #2", "test 2", "", None, 7, 2.5, "é")
EXPRESSIONS = ("{} + {}", "{} / {}", "{} * 2 - {}", "sqrt({}) + {}", "max({}, {})", "{} ** {} + pi")
MISTAKES = (
    "number twice", "number 0", "NaN in X", "width of F", "label", "note", "name twice", "bounds",
    "log", "maximize", "units", "kinds", "tolerance", "kind of a value", "reserved", "length",
)  # fmt: skip


def description(seed: int) -> Plain:
    """Return the plain description of a random table, and of what it is asked."""
    draw = random.Random(seed)
    n = draw.choice((0, 1, 2, 3, 5, 8, 12, 20, 30))
    names = draw.sample(NAMES, len(NAMES))
    variables = [_variable(draw, names.pop()) for _ in range(draw.choice((0, 1, 1, 2, 2, 3, 4)))]
    groups = {}
    for group, counts in (
        ("objectives", (0, 1, 2, 2, 3)),
        ("inequalities", (0, 0, 1, 2)),
        ("equalities", (0, 0, 0, 1)),
        ("outputs", (0, 0, 1, 2)),
        ("missing", (0, 0, 1)),
        ("notes", (0, 0, 1, 2)),
    ):
        groups[group] = [names.pop() for _ in range(draw.choice(counts))]
    if draw.random() < 0.2 and groups["notes"]:
        groups["notes"][0] = draw.choice(("run", "row", "test_point"))
    share = draw.choice((0, 0, 0.05, 0.3))
    table: Plain = {
        "seed": seed,
        "numbers": sorted(draw.sample(range(1, 4 * n + 2), n)),
        "variables": [variable["name"] for variable in variables],
        "kinds": [variable["kind"] for variable in variables],
        "lower": [variable["lower"] for variable in variables],
        "upper": [variable["upper"] for variable in variables],
        "X": [[draw.choice(variable["values"]) for variable in variables] for _ in range(n)],
        "F": _matrix(draw, n, len(groups["objectives"]), share),
        "G": _matrix(draw, n, len(groups["inequalities"]), share / 3, (-2.0, -0.5, -0.0, 0.5)),
        "H": _matrix(draw, n, len(groups["equalities"]), share / 3, (0.0, 5e-5, -9e-5, 1e-4, 2e-4)),
        "values": [*zip(*_matrix(draw, n, len(groups["outputs"]), share), strict=True)],
        "cells": [[draw.choice(LABELS) for _ in range(n)] for _ in groups["notes"]],
        "label": draw.choice([None, *groups["notes"]]),
        "reasons": {},
        "form": draw.choice(("rows", "mappings", "array")),
        "is_default": draw.random() < 0.1,
        **groups,
    }
    if not groups["outputs"]:
        table["values"] = []
    if table["is_default"]:
        _give_default_names(table)
    if not variables or not all(variable["kind"] for variable in variables):
        table["kinds"] = []
    if draw.random() < 0.3:
        draw.shuffle(table["numbers"])
    for row in range(n):
        if n > 1 and draw.random() < 0.2:  # a repeated design, often with its objectives
            former = draw.randrange(n)
            table["X"][row] = table["X"][former]
            if draw.random() < 0.7:
                table["F"][row] = table["F"][former]
        if draw.random() < share:
            reason = draw.choice(("it broke", "", "f\0g", "\ud800", "no mesh"))
            table["reasons"][str(table["numbers"][row])] = reason
    directed = [] if table["is_default"] else [*table["objectives"], *table["missing"]]
    table["maximize"] = [name for name in directed if draw.random() < 0.4]
    named = [*table["variables"], *table["objectives"], *table["inequalities"]]
    table["units"] = {name: draw.choice(UNITS) for name in named if draw.random() < 0.4}
    table["tolerance"] = draw.choice((1e-4, 1e-4, 0.0, 1e-5))
    table["mistake"] = draw.choice(MISTAKES) if draw.random() < 0.1 else ""
    _with_mistake(draw, table)
    table["asked"] = [_formulation(draw, table) for _ in range(3)]
    table["selections"] = [
        draw.sample(range(n), draw.randint(0, n)),
        [draw.random() < 0.5 for _ in range(n)],
        [-1, n],
    ]
    shift = draw.choice((0.0, 0.0, 1e-12, 1e-3))
    table["parts"] = {
        "ends": sorted(draw.sample(range(n + 1), min(n + 1, 2))),
        "shift": shift,
        "without": draw.random() < 0.5,
        "mended": draw.random() < 0.2,
    }
    table["margin"] = draw.choice((0.0, 0.1, 1.0, -1.0))
    return table


def _give_default_names(table: Plain) -> None:
    """Let a description be one of arrays alone, without a schema."""
    for group, letter in (
        ("variables", "x"), ("objectives", "f"), ("inequalities", "g"), ("equalities", "h")
    ):  # fmt: skip
        table[group] = [f"{letter}{j + 1}" for j in range(len(table[group]))]
    table |= {"missing": [], "notes": [], "cells": [], "label": None, "kinds": []}


def _variable(draw: random.Random, name: str) -> Plain:
    kind = draw.choice(("real", "real", "log", "integer", "binary", "choice", "mixed", None))
    values: list[Any] = [-0.0, 0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 1 / 3]
    if kind == "log":
        values = [0.01, 0.1, 1.0, 10.0, 1e-300]
    elif kind == "integer":
        values = [-3, 0, 1, 2, 12, 2**53 + 1]
    elif kind == "binary":
        values = [True, False]
    elif kind in ("choice", "mixed"):
        values = draw.choice(OPTIONS)
        kind = "choice"
    lower = upper = None
    if kind in ("real", "log", "integer", None) and not isinstance(values[0], str):
        lower = draw.choice((None, min(values)))
        upper = draw.choice((None, max(values)))
    if draw.random() < 0.3:
        kind = None
    return {"name": name, "kind": kind, "values": values, "lower": lower, "upper": upper}


def _matrix(
    draw: random.Random,
    n: int,
    k: int,
    share: float,
    values: tuple[float, ...] = (-1.5, -0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 5.0, 1 / 3, 1e-12),
) -> list[list[float]]:
    """Return rows of k numbers, a share of them not finite."""
    rows = []
    for _ in range(n):
        row = [draw.choice(values) for _ in range(k)]
        for j in range(k):
            if draw.random() < share:
                row[j] = draw.choice((float("nan"), float("inf"), float("-inf"), 1e308))
        rows.append(row)
    return rows


def _with_mistake(draw: random.Random, table: Plain) -> None:
    """Put a mistake into a description, where it has what the mistake needs."""
    mistake = table["mistake"]
    n = len(table["numbers"])
    if mistake == "number twice" and n > 1:
        table["numbers"][1] = table["numbers"][0]
    elif mistake == "number 0" and n:
        table["numbers"][0] = draw.choice((0, -1, 1.5))
    elif mistake == "NaN in X" and n and table["variables"]:
        table["X"][0] = [float("nan"), *table["X"][0][1:]]
    elif mistake == "width of F" and n:
        table["F"] = [[*row, 1.0] for row in table["F"]]
    elif mistake == "label":
        table["label"] = "nobody"
    elif mistake == "note":
        table["notes"] = [*table["notes"], *table["objectives"][:1]]
        table["cells"] = [*table["cells"], ["A"] * n]
    elif mistake == "name twice":
        table["outputs"] = [*table["outputs"], *table["objectives"][:1]]
        table["values"] = [*table["values"], [1.0] * n]
    elif mistake == "bounds" and table["variables"]:
        table["lower"][0], table["upper"][0] = 2.0, 1.0
    elif mistake == "log" and table["kinds"]:
        table["kinds"][0], table["lower"][0] = "log", 0.0
    elif mistake == "maximize":
        table["maximize"] = [*table["maximize"], draw.choice(["nobody", *table["variables"][:1]])]
    elif mistake == "units":
        table["units"] = {"nobody": "kg", **table["units"]}
    elif mistake == "kinds":
        table["kinds"] = ["real", *table["kinds"]]
    elif mistake == "tolerance":
        table["tolerance"] = -1.0
    elif mistake == "kind of a value" and n and table["kinds"]:
        table["X"][0] = [draw.choice((0.5, "oak", True, None)), *table["X"][0][1:]]
    elif mistake == "reserved":
        table["objectives"] = ["", *table["objectives"][1:]]
    elif mistake == "length" and table["cells"]:
        table["cells"][0] = [*table["cells"][0], "A"]


def _formulation(draw: random.Random, table: Plain) -> Plain:
    """Return the arguments of a random formulation of a table."""
    numbers = _numbers_by_column(table)
    asked: Plain = {}
    computed: Plain = {}
    for name in draw.sample(("ratio", "sum, all", "margin"), draw.choice((0, 0, 0, 1, 2))):
        names = draw.choices([*numbers, *computed] or ["nobody"], k=2)
        quoted = [f"`{name.replace('`', '``')}`" for name in names]
        computed[name] = draw.choice(EXPRESSIONS).format(*quoted)
    if computed:
        asked["computed"] = computed
    objectives = table["objectives"]
    if draw.random() < 0.4:
        columns = [*numbers, *computed, *table["missing"]]
        objectives = draw.sample(columns, min(len(columns), draw.choice((1, 2, 2, 3))))
        if draw.random() < 0.2:
            objectives = table["variables"]
        asked["objectives"] = objectives
    if draw.random() < 0.3:
        asked["maximize"] = [name for name in objectives if draw.random() < 0.5]
    constraints = table["inequalities"] + table["equalities"]
    if draw.random() < 0.4:
        asked["omitted"] = [name for name in constraints if draw.random() < 0.6]
    if draw.random() < 0.7:
        columns = [*numbers, *table["notes"], *table["variables"], *computed]
        limits = {}
        for name in draw.sample(columns, min(len(columns), draw.choice((1, 1, 2, 3)))):
            limits[name] = _limit(draw, name, numbers.get(name, [0.0]), table)
        asked["limits"] = limits
        if draw.random() < 0.5:
            statements = [_statement(draw, name, limit) for name, limit in limits.items()]
            asked["limits"] = statements
            if draw.random() < 0.5:
                asked["limits"] = ", ".join(statements)
    if draw.random() < 0.2:
        asked["normalize"] = False
    if draw.random() < 0.2:
        asked["ranges"] = {
            name: draw.choice(([0.0, 4.0], [1, 1], [-2, 0.5])) for name in objectives
        }
    if draw.random() < 0.1:
        asked["units"] = {
            name: draw.choice(UNITS)
            for name in draw.sample([*numbers, *computed], 1 if numbers else 0)
        }
    if draw.random() < 0.06:
        mistakes = (
            {"objectives": ["nobody"]}, {"objectives": [*objectives, *objectives]},
            {"maximize": ["nobody"]}, {"omitted": ["nobody"]}, {"limits": {"nobody": 1}},
            {"limits": "width"}, {"limits": {"width": None}}, {"limits": {"mass": [3, 1]}},
            {"limits": {"mass": ">= 3, <= 1"}}, {"limits": {"mass": float("nan")}}, {"limits": 3},
            {"ranges": {"nobody": [0, 1]}}, {"computed": {"ratio": "1 +"}}, {"wrong": 1},
            {"limits": {"mass": True}}, {"computed": {"ratio": "nobody + 1"}}, {"normalize": 2},
            {"computed": {"status": "1"}}, {"limits": "mass<=1.125"}, {"limits": {1: 2}},
            {"limits": "mass<=1, mass<=2"}, {"limits": "a b in oak, tin, a b in x"},
            {"units": {"nobody": "kg"}}, {"ranges": {"mass": [0, float("inf")]}},
            {"limits": {"mass": [1, 2, 3]}},
        )  # fmt: skip
        asked |= draw.choice(mistakes)
    return asked


def _numbers_by_column(table: Plain) -> dict[str, list[float]]:
    """Return the numbers of each column of numbers, as people see them."""
    columns: dict[str, list[float]] = {}
    for group, rows in (
        ("variables", "X"),
        ("objectives", "F"),
        ("inequalities", "G"),
        ("equalities", "H"),
    ):
        for name, cells in zip(table[group], zip(*table[rows], strict=False), strict=False):
            if all(isinstance(cell, (int, float)) for cell in cells):
                columns[name] = [float(cell) for cell in cells]
    for name, cells in zip(table["outputs"], table["values"], strict=False):
        columns[name] = [float(cell) for cell in cells]
    for name in table["maximize"]:
        columns[name] = [-cell for cell in columns.get(name, [])]
    return columns


def _limit(draw: random.Random, name: str, numbers: list[float], table: Plain) -> Any:
    """Return a limit in one of its forms, often at the value of a test."""
    texts = [text for text in (*LABELS, *OPTIONS[1], "12", "True") if isinstance(text, str)]
    is_of_texts = name in table["notes"] or name in table["variables"]
    if is_of_texts and draw.random() < (0.9 if name in table["notes"] else 0.3):
        chosen = draw.sample(texts, draw.choice((0, 1, 2, 3)))
        return draw.choice([chosen, (chosen or ["A"])[0]])
    finite = sorted(number for number in numbers if np.isfinite(number)) or [0.0]
    low, high = sorted(draw.choices([*finite, 0.75, 1e9], k=2))
    return draw.choice(
        [high, int(max(-1e9, min(1e9, high))), [low, None], [None, high], [low, high], [low, low],
         f">= {low}", f"<={high}", f">= {low}, <= {high}", [None, None], [None, float("inf")]]
    )  # fmt: skip


def _statement(draw: random.Random, name: str, limit: Any) -> str:
    """Return a limit as people write it on a command line."""
    if isinstance(limit, str) and limit[:1] not in "<>":
        text = f"{name}={limit}"
    elif isinstance(limit, list) and all(isinstance(entry, str) for entry in limit):
        return ", ".join(map(_quoted, [f"{name} in {(limit or ['A'])[0]}", *limit[1:]]))
    elif isinstance(limit, list):
        low, high = limit
        text = name
        if low is not None:
            text = draw.choice((f"{low} <= {text}", f"{low}<={text}"))
        if high is not None:
            text = draw.choice((f"{text}<={high}", f"{text} <= {high}"))
    elif isinstance(limit, str):
        text = f"{name} {limit}"
    else:
        text = draw.choice((f"{name}<={limit}", f"{limit} >= {name}", f"{limit}>={name}"))
    return _quoted(text)


def _quoted(text: str) -> str:
    return '"{}"'.format(text.replace('"', '""')) if "," in text else text


def part(
    plain: Plain,
    start: int,
    stop: int,
    *,
    without: bool = False,
    shift: float = 0.0,
    mended: bool = False,
) -> Plain:
    """Return the description of some tests, perhaps without what not every run has."""
    of_rows = {name: plain[name][start:stop] for name in ("numbers", "X", "F", "G", "H")}
    if shift:  # -0.0 + 0.0 would be another value
        of_rows["F"] = [[value + shift for value in row] for row in of_rows["F"]]
    for name in ("values", "cells"):
        of_rows[name] = [cells[start:stop] for cells in plain[name]]
    changed = {**plain, **of_rows}
    if without:
        changed |= {
            "outputs": [],
            "values": [],
            "missing": [],
            "kinds": [],
            "maximize": [name for name in plain["maximize"] if name in plain["objectives"]],
        }
    numbers = set(map(str, changed["numbers"] if not mended else ()))
    changed["reasons"] = {key: why for key, why in plain["reasons"].items() if key in numbers}
    return changed


class Model(ElementwiseProblem):
    """A model of two numbers, or of two integers, whose designs may fail."""

    def __init__(self, is_finite: bool, share_of_failures: float, factor: float) -> None:
        options: Plain = {"n_var": 2, "xl": 0.0, "xu": 1.0}
        if is_finite:
            options = {"vars": {name: Integer(bounds=(0, 4)) for name in ("x1", "x2")}}
        super().__init__(n_obj=2, n_ieq_constr=1, **options)
        self.size = 4 if is_finite else 1
        self.share_of_failures = share_of_failures
        self.factor = factor

    def _evaluate(self, x: Any, out: Plain, *args: Any, **kwargs: Any) -> None:
        one, two = (value / self.size for value in (x.values() if isinstance(x, dict) else x))
        if (7 * one + 3 * two) % 1 < self.share_of_failures:
            raise ValueError("no mesh")
        out["F"], out["G"] = [one * self.factor, (two - one) ** 2], [one + two - 1.5]
        out["heat"] = one * two
