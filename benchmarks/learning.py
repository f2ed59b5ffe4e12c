"""Learning from tests against what users would take instead: few evaluations, many variables.

The whole study, a day on one core, in the order in which its results are wanted; then its tables:

    python -m benchmarks.learning --jobs 2
    python -m benchmarks.learning --table

Every run is kept in ``benchmarks/learning.jsonl`` as soon as it is done: kill the benchmark when
the machine is wanted, and continue it by the same command. Some runs only:

    python -m benchmarks.learning osy zdt3 --algorithms surrogate,tpe --evaluations 256 --seeds 3

All algorithms start without the corner and the middle of the box, where some test problems have
their optima: PSI takes another stretch of the LPτ sequence with each seed, all else scrambled or
random points. One run serves all budgets, as the first designs of a longer run are those of a
shorter one; NSGA-III, whose population depends on the budget, has a run for each.

Rivals that are not installed are left out: ``pip install optuna``, and ``torch`` for ``optuna-gp``.
"""

from __future__ import annotations

import argparse
import json
import re
import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from benchmarks.comparison_problems import PROBLEMS as COMPARED
from benchmarks.comparison_problems import known_front
from benchmarks.engineering import SteppedCantilever, TenBarTruss
from benchmarks.machine import describe_machine
from pymoo_psi import QMCSampling, SurrogatePSI, compare, investigate, nsga3
from pymoo_psi.comparison import Reference
from pymoo_psi.comparison._algorithms import named_algorithms
from pymoo_psi.comparison._statistics import effect_size, holm, p_value
from pymoo_psi.pareto import nondominated

Array = NDArray[np.float64]

HERE = Path(__file__).parent
KEPT = HERE / "learning.jsonl"
README = HERE / "README.md"
BUDGETS = (64, 128, 256, 512, 1024)
SIGNIFICANCE = 0.05

TUNED = (
    "osy", "welded_beam", "truss2d", "mw7", "zdt1", "zdt3", "dtlz2", "dtlz7", "bnh",
    "chute-full-0.4", "mw1",
)  # fmt: skip
"""Problems on which the surrogates' constants were chosen: their numbers are optimistic."""

PROBLEMS: dict[str, Callable[[], Any]] = {
    **{name: COMPARED[name] for name in (*TUNED, "zdt2") if name in COMPARED},
    "carside": partial(get_problem, "carside"),
    "mw1": partial(get_problem, "mw1"),
    "ten_bar_truss": TenBarTruss,
    "stepped_cantilever": SteppedCantilever,
}


MANY = tuple(name for name, make in PROBLEMS.items() if make().n_var >= 6)


class Watched(Problem):
    """A problem that remembers what is evaluated, in order."""

    def __init__(self, problem: Any) -> None:
        super().__init__(
            n_var=problem.n_var, n_obj=problem.n_obj, n_ieq_constr=problem.n_ieq_constr,
            xl=problem.xl, xu=problem.xu,
        )  # fmt: skip
        self.problem = problem
        self.F: list[Array] = []
        self.feasible: list[bool] = []

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        values = self.problem.evaluate(X, return_as_dictionary=True)
        out["F"] = values["F"]
        if self.n_ieq_constr:
            out["G"] = values["G"]
        good = np.isfinite(values["F"]).all(axis=1)
        if self.n_ieq_constr:
            good &= (values["G"] <= 0).all(axis=1)
        self.F += list(values["F"])
        self.feasible += good.tolist()

    def found(self, n_evaluations: int) -> Array:
        """Return the Pareto set of the first designs."""
        F = np.array(self.F[:n_evaluations])[np.array(self.feasible[:n_evaluations])]
        return F[nondominated(F)] if len(F) else np.zeros((0, self.n_obj))


# What is compared: each evaluates a number of designs.


def _surrogate(problem: Watched, n_evaluations: int, seed: int) -> None:
    minimize(problem, SurrogatePSI(n_evaluations, sampling=QMCSampling("sobol")), seed=seed)


def _psi(problem: Watched, n_evaluations: int, seed: int) -> None:
    investigate(problem, n_evaluations, first=1 + (seed + 1) * max(BUDGETS))


def _psi_scrambled(problem: Watched, n_evaluations: int, seed: int) -> None:
    investigate(problem, n_evaluations, sampling=QMCSampling("sobol"), seed=seed)


def _half_and_half(problem: Watched, n_evaluations: int, seed: int) -> None:
    named_algorithms(["psi-scrambled+nsga3"])[0].search(problem, n_evaluations, seed)


def _nsga3(problem: Watched, n_evaluations: int, seed: int) -> None:
    nsga3(problem, n_evaluations=n_evaluations, seed=seed)


def _optuna(sampler: str, problem: Watched, n_evaluations: int, seed: int) -> None:
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)

    def constraints(trial: Any) -> list[float]:
        return list(trial.user_attrs["G"])

    options = {"constraints_func": constraints} if problem.n_ieq_constr else {}
    study = optuna.create_study(
        directions=["minimize"] * problem.n_obj,
        sampler=getattr(optuna.samplers, sampler)(seed=seed, **options),
    )

    def objective(trial: Any) -> tuple[float, ...]:
        bounds = zip(problem.xl, problem.xu, strict=True)
        x = [trial.suggest_float(f"x{j}", low, high) for j, (low, high) in enumerate(bounds)]
        found = _outputs(problem, np.array([x]))[0].tolist()
        trial.set_user_attr("G", found[problem.n_obj :])
        return tuple(found[: problem.n_obj])

    study.optimize(objective, n_trials=n_evaluations)


def _outputs(problem: Watched, X: Array) -> Array:
    """Return criteria and constraints, finite for those who refuse infinity."""
    values = problem.evaluate(X, return_as_dictionary=True)
    named = [values["F"], values["G"]] if problem.n_ieq_constr else [values["F"]]
    return np.nan_to_num(np.hstack(named), posinf=1e30)


ALGORITHMS: dict[str, Callable[[Watched, int, int], None]] = {
    "surrogate": _surrogate,
    "psi": _psi,
    "psi-scrambled": _psi_scrambled,
    "nsga3": _nsga3,
    "psi+nsga3": _half_and_half,
    "tpe": partial(_optuna, "TPESampler"),
    "optuna-nsga3": partial(_optuna, "NSGAIIISampler"),
    "optuna-gp": partial(_optuna, "GPSampler"),
}
NEEDED = {"tpe": "optuna", "optuna-nsga3": "optuna", "optuna-gp": "torch"}
OF_BUDGET = ("nsga3", "psi+nsga3", "optuna-nsga3")  # with a run for each budget
OURS = ("psi", "psi-scrambled", "nsga3", "psi+nsga3")

FEW = BUDGETS[:3]
SLOW = ("osy", "welded_beam", "zdt3", "stepped_cantilever")
# problems, algorithms, budgets and number of seeds, one after the other
PLAN: tuple[tuple[tuple[str, ...], tuple[str, ...], tuple[int, ...], int], ...] = (
    (MANY, OURS, (256, 1024), 21),
    (MANY, ("surrogate",), FEW, 3),
    (tuple(PROBLEMS), ("surrogate",), FEW, 3),
    (tuple(PROBLEMS), OURS, (256, 1024), 21),
    (tuple(PROBLEMS), ("tpe",), FEW, 3),
    (MANY, ("surrogate",), FEW, 21),
    (tuple(PROBLEMS), OURS, BUDGETS, 21),
    (tuple(PROBLEMS), ("surrogate",), FEW, 21),
    (SLOW, ("optuna-nsga3",), FEW, 5),
    (SLOW, ("optuna-gp",), FEW[:1], 3),
    (tuple(PROBLEMS), ("surrogate",), BUDGETS[:4], 5),
    (tuple(PROBLEMS), ("tpe",), FEW, 21),
    (tuple(PROBLEMS), ("surrogate",), BUDGETS[:4], 21),
)


def reference_of(name: str) -> Reference:
    """Return the reference of a problem, kept, or made by long runs of NSGA-III."""
    path = HERE / "references" / f"{name}.npz"
    if not path.exists():
        problem = PROBLEMS[name]()
        front = known_front(name, problem) if name in COMPARED else None
        if name == "mw1":
            front = problem.pareto_front()
        made = compare(
            problem, n_evaluations=20_000, seeds=3, algorithms=["nsga3"], reference_front=front
        )
        made.reference.save(path)
    return Reference.load(path)


def run(name: str, algorithm: str, seed: int, budgets: tuple[int, ...]) -> list[dict[str, Any]]:
    """Run an algorithm once and measure what it has found at each budget."""
    problem, reference = Watched(PROBLEMS[name]()), reference_of(name)
    began = time.process_time()
    ALGORITHMS[algorithm](problem, max(budgets), seed)
    took = time.process_time() - began
    optimum = np.linalg.norm(reference.frame.scaled(reference.optimum))
    rows = []
    for budget in budgets:
        F = problem.found(budget)
        row = {"problem": name, "algorithm": algorithm, "seed": seed, "evaluations": budget}
        mu1 = np.linalg.norm(reference.frame.scaled(F), axis=1).min() if len(F) else np.inf
        measured = {
            "hypervolume": reference.measure(F)["hypervolume"],
            # above that of the best design known: also where several designs are as good
            "mu1_excess": mu1 - optimum,
            "seconds_a_design": took / max(budgets),
        }
        rows.append(row | {what: float(f"{value:.6g}") for what, value in measured.items()})
    return rows


def tasks(
    problems: tuple[str, ...], algorithms: tuple[str, ...], budgets: tuple[int, ...], seeds: int
) -> Iterator[tuple[str, str, int, tuple[int, ...]]]:
    """Yield the runs that are not kept yet, seed by seed, so that early results are of all."""
    kept = results()
    done = set(
        zip(kept["problem"], kept["algorithm"], kept["seed"], kept["evaluations"], strict=True)
    )
    for seed in range(seeds):
        for name in problems:
            for algorithm in algorithms:
                groups = [(b,) for b in budgets] if algorithm in OF_BUDGET else [budgets]
                for group in groups:
                    if any((name, algorithm, seed, b) not in done for b in group):
                        yield name, algorithm, seed, group


def carry_out(
    problems: tuple[str, ...],
    algorithms: tuple[str, ...],
    budgets: tuple[int, ...],
    seeds: int,
    *,
    jobs: int,
) -> None:
    """Run what is not kept yet, and keep it."""
    for name in problems:
        reference_of(name)
    missing = [a for a in algorithms if find_spec(NEEDED.get(a, "numpy")) is None]
    if missing:
        print(f"not installed: {', '.join(missing)}", flush=True)
    there = tuple(a for a in algorithms if a not in missing)
    todo = list(tasks(problems, there, budgets, seeds))
    done = Parallel(jobs, return_as="generator_unordered")(delayed(run)(*task) for task in todo)
    for count, rows in enumerate(done, 1):
        with KEPT.open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(row) + "\n" for row in rows)
        last = rows[-1]
        print(
            f"{count} of {len(todo)}: {last['problem']} {last['algorithm']} {last['seed']} "
            f"{last['evaluations']}: {last['hypervolume']:.4f}", flush=True,
        )  # fmt: skip


def results() -> pd.DataFrame:
    """Return the runs that are kept; a line that was cut off by a kill is left out."""
    rows = []
    if KEPT.exists():
        for line in KEPT.read_text("utf-8").splitlines():
            try:
                rows.append(json.loads(line))
            except json.JSONDecodeError:
                continue
    columns = ["problem", "algorithm", "seed", "evaluations", "hypervolume", "seconds_a_design"]
    frame = pd.DataFrame(rows, columns=None if rows else columns)
    return frame.drop_duplicates(["problem", "algorithm", "seed", "evaluations"], keep="last")


def table(frame: pd.DataFrame, indicator: str, budget: int) -> list[str]:
    """Return medians at a budget, marked where the surrogates are surely better (+) or worse (-).

    The last column is NSGA-III with four times the budget.
    """
    known = set(zip(frame["algorithm"], frame["evaluations"], strict=True))
    rivals = [a for a in ALGORITHMS if a != "surrogate" and (a, budget) in known]
    entries = [(a, budget) for a in rivals] + [("nsga3", b) for b in BUDGETS if b == 4 * budget]
    titles = [a if b == budget else f"{a}, {b}" for a, b in entries]
    lines = [
        f"| problem (variables) | surrogate | {' | '.join(titles)} |",
        f"|---|---|{'---|' * len(titles)}",
    ]
    more = 1 if indicator == "hypervolume" else -1
    for name in PROBLEMS:
        ours, *others = (
            frame.loc[
                (frame["problem"] == name)
                & (frame["algorithm"] == algorithm)
                & (frame["evaluations"] == evaluations),
                indicator,
            ].to_numpy(dtype=float)
            for algorithm, evaluations in [("surrogate", budget), *entries]
        )
        if not len(ours):
            continue
        p = [p_value(ours, v, fixed=(False, False)) if len(v) else np.nan for v in others]
        cells = [_cell(ours, more)]
        for v, adjusted in zip(others, holm(np.array(p)), strict=True):
            mark = ""
            if adjusted < SIGNIFICANCE:
                mark = " +" if more * (effect_size(ours, v) - 0.5) > 0 else " -"
            cells.append(_cell(v, more) + mark)
        used = "" if name in TUNED else " ◦"
        lines.append(f"| {name}{used} ({PROBLEMS[name]().n_var}) | {' | '.join(cells)} |")
    return lines


def _cell(values: Array, more: int) -> str:
    if not len(values):
        return "–"
    worst = (more * values).min() * more
    return f"{np.median(values):.3f} ({worst:.3f}, {len(values)})".replace("inf", "∞")


def tables(frame: pd.DataFrame) -> list[str]:
    """Return all tables in Markdown, and what a design costs."""
    lines = []
    for indicator, budget in (
        *(("hypervolume", b) for b in (256, 64, 128, 512)), ("mu1_excess", 256),
    ):  # fmt: skip
        what = "hypervolume" if indicator == "hypervolume" else "excess of μ1"
        rows = table(frame, indicator, budget)
        if len(rows) > 2:  # else no runs yet
            lines += [f"**{budget} evaluations, {what}**", "", *rows, ""]
    costs = frame.groupby("algorithm")["seconds_a_design"].median()
    told = ", ".join(f"{a} {costs[a]:.3f}" for a in ALGORITHMS if a in costs)
    return [*lines, f"Processor seconds a design, medians: {told}."]


def main() -> None:
    """Run what is missing; print the tables, and write them into the README."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", choices=[[], *PROBLEMS], metavar="PROBLEM")
    parser.add_argument("--algorithms", default=",".join(OURS))
    parser.add_argument("--evaluations", default=",".join(map(str, FEW)))
    parser.add_argument("--seeds", type=int, default=21)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--table", action="store_true", help="only the tables of what is kept")
    given = parser.parse_args()
    if not given.table:
        algorithms = tuple(given.algorithms.split(","))
        budgets = tuple(int(word) for word in given.evaluations.split(","))
        asked = (tuple(given.problems), algorithms, budgets, given.seeds)
        for part in (asked,) if given.problems else PLAN:
            carry_out(*part, jobs=given.jobs)
    lines = tables(results())
    print("\n".join(lines))
    marks = "<!-- learning: written by python -m benchmarks.learning -->", "<!-- end learning -->"
    text = "\n".join([marks[0], "", f"On {describe_machine()}.", "", *lines, "", marks[1]])
    pattern = f"{re.escape(marks[0])}.*?{re.escape(marks[1])}"
    README.write_text(
        re.sub(pattern, lambda _: text, README.read_text("utf-8"), flags=re.DOTALL), "utf-8"
    )


if __name__ == "__main__":
    main()
