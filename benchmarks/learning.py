"""Learning from tests against what users would take instead: few evaluations, many variables.

Every run is kept in ``benchmarks/learning.jsonl`` as soon as it is done: kill the benchmark when
the machine is wanted, and continue it by the same command.

    python -m benchmarks.learning --seeds 21 --jobs 2
    python -m benchmarks.learning osy zdt3 --algorithms surrogate,tpe --seeds 3
    python -m benchmarks.learning --table

All algorithms start without the corner and the middle of the box, where some test problems have
their optima: PSI and the surrogates from scrambled points of Sobol'. One run serves all budgets, as
the first designs of a longer run are those of a shorter one; NSGA-III, whose population depends on
the budget, has a run for each.

Rivals that are not installed are left out: ``pip install optuna`` for ``tpe``; with ``torch`` and
``optuna-integration`` also ``optuna-gp``.
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
from scipy.stats import permutation_test

from benchmarks.comparison_problems import PROBLEMS as COMPARED
from benchmarks.comparison_problems import known_front
from benchmarks.engineering import SteppedCantilever, TenBarTruss
from benchmarks.machine import describe_machine
from pymoo_psi import QMCSampling, SurrogatePSI, compare, nsga3
from pymoo_psi.comparison import INDICATORS, Reference
from pymoo_psi.pareto import nondominated

Array = NDArray[np.float64]

HERE = Path(__file__).parent
KEPT = HERE / "learning.jsonl"
README = HERE / "README.md"
BUDGETS = (64, 128, 256, 512)
SHOWN = ("surrogate", "psi", "nsga3", "tpe")
SIGNIFICANCE = 0.05

TUNED = (
    "osy", "welded_beam", "truss2d", "mw7", "zdt1", "zdt3", "dtlz2", "dtlz7", "bnh",
    "chute-full-0.4",
)  # fmt: skip
"""Problems on which the surrogates' constants were chosen: their numbers are optimistic."""

PROBLEMS: dict[str, Callable[[], Any]] = {
    **{name: COMPARED[name] for name in (*TUNED, "zdt2")},
    "carside": partial(get_problem, "carside"),
    "mw1": partial(get_problem, "mw1"),
    "ten_bar_truss": TenBarTruss,
    "stepped_cantilever": SteppedCantilever,
}


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
    state = np.random.default_rng(seed)
    U = QMCSampling("sobol").unit_points(n_evaluations, problem.n_var, random_state=state)
    problem.evaluate(problem.xl + (problem.xu - problem.xl) * U)


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
        values = problem.evaluate(np.array([x]), return_as_dictionary=True)
        trial.set_user_attr("G", values["G"][0].tolist() if problem.n_ieq_constr else [])
        # Optuna refuses infinity in several objectives
        return tuple(np.nan_to_num(values["F"][0], posinf=1e30).tolist())

    study.optimize(objective, n_trials=n_evaluations)


ALGORITHMS: dict[str, Callable[[Watched, int, int], None]] = {
    "surrogate": _surrogate,
    "psi": _psi,
    "nsga3": _nsga3,
    "tpe": partial(_optuna, "TPESampler"),
    "optuna-nsga3": partial(_optuna, "NSGAIIISampler"),
    "optuna-gp": partial(_optuna, "GPSampler"),
}
NEEDED = {"tpe": "optuna", "optuna-nsga3": "optuna", "optuna-gp": "torch"}
OF_BUDGET = ("nsga3", "optuna-nsga3")  # with a run for each budget


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
        measured = reference.measure(F)
        row |= {indicator: measured[indicator] for indicator in INDICATORS}
        mu1 = np.linalg.norm(reference.frame.scaled(F), axis=1).min() if len(F) else np.inf
        # above that of the best design known: also where several designs are as good
        row["mu1_excess"] = float(mu1 - optimum)
        row["seconds_a_design"] = took / max(budgets)
        rows.append(row)
    return rows


def tasks(
    problems: list[str], algorithms: list[str], budgets: tuple[int, ...], seeds: int
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


def p_value(a: Array, b: Array) -> float:
    """Return the p value of a difference of means, by permutations of the runs."""
    if len(a) < 2 or len(b) < 2:
        return 1.0
    found = permutation_test(
        (a, b), lambda x, y, axis: x.mean(axis=axis) - y.mean(axis=axis), vectorized=True,
        n_resamples=9999, rng=np.random.default_rng(0),
    )  # fmt: skip
    return float(found.pvalue)


def holm(p: list[float]) -> list[float]:
    """Return p values adjusted for their number (Holm 1979)."""
    adjusted, largest = [0.0] * len(p), 0.0
    for place, i in enumerate(np.argsort(p)):
        largest = max(largest, min(1.0, (len(p) - place) * p[i]))
        adjusted[i] = largest
    return adjusted


def table(frame: pd.DataFrame) -> list[str]:
    """Return median hypervolumes, with those marked that are surely not the surrogates'."""
    shown = [a for a in (*SHOWN, "optuna-nsga3", "optuna-gp") if a in set(frame["algorithm"])]
    lines = [
        f"| problem (variables) | evaluations | {' | '.join(shown)} |",
        f"|---|---|{'---|' * len(shown)}",
    ]
    for name in PROBLEMS:
        for budget in sorted(set(frame["evaluations"])):
            at = frame[(frame["problem"] == name) & (frame["evaluations"] == budget)]
            values = {a: at[at["algorithm"] == a]["hypervolume"].to_numpy() for a in shown}
            if not len(values["surrogate"]):
                continue
            rivals = [a for a in shown[1:] if len(values[a])]
            adjusted = holm([p_value(values["surrogate"], values[a]) for a in rivals])
            sure = {a for a, p in zip(rivals, adjusted, strict=True) if p < SIGNIFICANCE}
            cells = []
            for a in shown:
                v = values[a]
                cell = f"{np.median(v):.3f} ({v.min():.3f}, {len(v)})" if len(v) else "–"
                cells.append(f"*{cell}*" if a in sure else cell)
            mark = "" if name in TUNED else " ◦"
            size = PROBLEMS[name]().n_var
            lines.append(f"| {name}{mark} ({size}) | {budget} | {' | '.join(cells)} |")
    costs = frame.groupby("algorithm")["seconds_a_design"].median()
    told = ", ".join(f"{a} {costs[a]:.3f}" for a in shown)
    return [*lines, "", f"Processor seconds a design, medians: {told}."]


def main() -> None:
    """Run what is missing; print the table, and write it into the README."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", choices=[[], *PROBLEMS], metavar="PROBLEM")
    parser.add_argument("--algorithms", default=",".join(SHOWN))
    parser.add_argument("--evaluations", default=",".join(map(str, BUDGETS)))
    parser.add_argument("--seeds", type=int, default=21)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--table", action="store_true", help="only the table of what is kept")
    given = parser.parse_args()
    if not given.table:
        wanted = given.algorithms.split(",")
        missing = [a for a in wanted if find_spec(NEEDED.get(a, "numpy")) is None]
        if missing:
            print(f"not installed: {', '.join(missing)}", flush=True)
        budgets = tuple(int(word) for word in given.evaluations.split(","))
        names = given.problems or list(PROBLEMS)
        for name in names:
            reference_of(name)
        todo = list(tasks(names, [a for a in wanted if a not in missing], budgets, given.seeds))
        done = Parallel(given.jobs, return_as="generator_unordered")(
            delayed(run)(*task) for task in todo
        )
        for count, rows in enumerate(done, 1):
            with KEPT.open("a", encoding="utf-8") as file:
                file.writelines(json.dumps(row) + "\n" for row in rows)
            last = rows[-1]
            print(
                f"{count} of {len(todo)}: {last['problem']} {last['algorithm']} {last['seed']} "
                f"{last['evaluations']}: {last['hypervolume']:.4f}", flush=True,
            )  # fmt: skip
    lines = table(results())
    print("\n".join(lines))
    marks = "<!-- learning: written by python -m benchmarks.learning -->", "<!-- end learning -->"
    text = "\n".join([marks[0], "", f"On {describe_machine()}.", "", *lines, "", marks[1]])
    pattern = f"{re.escape(marks[0])}.*?{re.escape(marks[1])}"
    README.write_text(
        re.sub(pattern, lambda _: text, README.read_text("utf-8"), flags=re.DOTALL), "utf-8"
    )


if __name__ == "__main__":
    main()
