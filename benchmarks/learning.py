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

Rivals that are not installed are left out. ``pip install "optuna>=5"`` adds its samplers,
``pip install parmoo`` that one, and ``pip install botorch`` both BoTorch and the Gaussian processes
of Optuna, with a torch of 5 GB, most of it for graphics cards, which are not used. ParMOO and
BoTorch, which propose several designs at a time, begin with as many points as ``SurrogatePSI``.
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

import moocore
import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from matplotlib.figure import Figure
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from benchmarks.comparison_problems import (
    CMO,
    PUBLISHED,
    REFERENCES,
    keep_reference,
    kept_reference,
    known_front,
)
from benchmarks.comparison_problems import PROBLEMS as COMPARED
from benchmarks.engineering import SteppedCantilever, TenBarTruss
from benchmarks.machine import describe_machine
from pymoo_psi import QMCSampling, SurrogatePSI, compare, investigate, nsga3
from pymoo_psi.comparison import Reference, effect_size, holm, p_value
from pymoo_psi.pareto import nondominated

Array = NDArray[np.float64]

HERE = Path(__file__).parent
KEPT = HERE / "learning.jsonl"
README = HERE / "README.md"
BUDGETS = (64, 128, 256, 512, 1024)
BATCH = 8  # that of SurrogatePSI from 64 tests on, for all who propose several at a time
SIGNIFICANCE = 0.05
INFINITE = 1e30  # stands for infinity where a rival takes finite values only

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
    **PUBLISHED,
    **CMO,
}


OPTIONAL = PUBLISHED | CMO
N_VAR = {n: (OPTIONAL[n] if n in OPTIONAL else p()).n_var for n, p in PROBLEMS.items()}
MANY = tuple(name for name, n_var in N_VAR.items() if n_var >= 6)


class Watched(Problem):
    """A problem that remembers what is evaluated, in order."""

    def __init__(self, problem: Any) -> None:
        super().__init__(
            n_var=problem.n_var, n_obj=problem.n_obj, n_ieq_constr=problem.n_ieq_constr,
            xl=problem.xl, xu=problem.xu,
        )  # fmt: skip
        self.problem = problem
        self.F: list[Array] = []
        self.violation: list[float] = []  # 0 where feasible

    def _evaluate(self, X: Array, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        values = self.problem.evaluate(X, return_as_dictionary=True)
        out["F"] = values["F"]
        if self.n_ieq_constr:
            out["G"] = values["G"]
        violation = np.where(np.isfinite(values["F"]).all(axis=1), 0.0, np.inf)
        if self.n_ieq_constr:
            violation += np.maximum(values["G"], 0).sum(axis=1)
        self.F += list(values["F"])
        self.violation += violation.tolist()

    def found(self, n_evaluations: int) -> Array:
        """Return the Pareto set of the first designs."""
        F = np.array(self.F[:n_evaluations])[np.array(self.violation[:n_evaluations]) <= 0]
        return F[nondominated(F)] if len(F) else np.zeros((0, self.n_obj))


# What is compared: each evaluates a number of designs.


def _surrogate(problem: Watched, n_evaluations: int, seed: int) -> None:
    minimize(problem, SurrogatePSI(n_evaluations, sampling=QMCSampling("sobol")), seed=seed)


def _psi(problem: Watched, n_evaluations: int, seed: int) -> None:
    investigate(problem, n_evaluations, first=1 + (seed + 1) * max(BUDGETS))


def _nsga3(problem: Watched, n_evaluations: int, seed: int) -> None:
    nsga3(problem, n_evaluations=n_evaluations, seed=seed)


def _optuna(sampler: str, problem: Watched, n_evaluations: int, seed: int) -> None:
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(
        directions=["minimize"] * problem.n_obj,
        sampler=getattr(optuna.samplers, sampler)(seed=seed),
    )

    def objective(trial: Any) -> tuple[float, ...]:
        bounds = zip(problem.xl, problem.xu, strict=True)
        x = [trial.suggest_float(f"x{j}", low, high) for j, (low, high) in enumerate(bounds)]
        found = _outputs(problem, np.array([x]))[0].tolist()
        for j, g in enumerate(found[problem.n_obj :]):
            trial.set_constraint(f"g{j}", g)
        return tuple(found[: problem.n_obj])

    study.optimize(objective, n_trials=n_evaluations)


def _n_first(problem: Watched) -> int:
    """Return with how many points those begin that ask for it: as :class:`SurrogatePSI`."""
    return 20


def _parmoo(problem: Watched, n_evaluations: int, seed: int) -> None:
    """ParMOO, with what its own introduction takes."""
    from parmoo import MOOP
    from parmoo.acquisitions import RandomConstraint
    from parmoo.optimizers import LocalSurrogate_PS
    from parmoo.searches import LatinHypercube
    from parmoo.surrogates import GaussRBF

    moop = MOOP(LocalSurrogate_PS, hyperparams={"np_random_gen": seed})
    names = [f"x{j}" for j in range(problem.n_var)]
    for name, low, high in zip(names, problem.xl, problem.xu, strict=True):
        limits = {"lb": float(low), "ub": float(high)}
        moop.addDesign({"name": name, "des_type": "continuous", **limits})

    def simulate(x: Any) -> Array:
        return _outputs(problem, np.array([[x[name] for name in names]]))[0]

    def output(j: int, x: Any, outputs: Any) -> Any:
        return outputs["outputs"][j]

    n_outputs = problem.n_obj + problem.n_ieq_constr
    moop.addSimulation({
        "name": "outputs", "m": n_outputs, "sim_func": simulate, "search": LatinHypercube,
        "surrogate": GaussRBF, "hyperparams": {"search_budget": _n_first(problem)},
    })  # fmt: skip
    for j in range(problem.n_obj):
        moop.addObjective({"name": f"f{j}", "obj_func": partial(output, j)})
    for j in range(problem.n_obj, n_outputs):
        moop.addConstraint({"name": f"g{j}", "con_func": partial(output, j)})
    for _ in range(BATCH):
        moop.addAcquisition({"acquisition": RandomConstraint, "hyperparams": {}})
    moop.solve(sim_max=n_evaluations)


def _botorch(problem: Watched, n_evaluations: int, seed: int) -> None:
    """BoTorch's qLogNEHVI, with what its own introduction takes but for the iterations.

    With 200 instead of 50, and the restarts in two halves, its first proposals on osy take twice as
    long.
    """
    import torch
    from botorch.acquisition.multi_objective.logei import qLogNoisyExpectedHypervolumeImprovement
    from botorch.acquisition.multi_objective.objective import IdentityMCMultiOutputObjective
    from botorch.fit import fit_gpytorch_mll
    from botorch.models import SingleTaskGP
    from botorch.models.transforms import Standardize
    from botorch.optim import optimize_acqf
    from botorch.sampling import SobolQMCNormalSampler
    from botorch.utils.multi_objective.hypervolume import infer_reference_point
    from gpytorch.mlls import ExactMarginalLogLikelihood

    torch.manual_seed(seed)
    published = getattr(problem.problem, "ref_point", None)
    n_obj, n_var = problem.n_obj, problem.n_var
    cube = torch.tensor([[0.0] * n_var, [1.0] * n_var], dtype=torch.double)
    Z = (
        torch.quasirandom.SobolEngine(n_var, scramble=True, seed=seed)
        .draw(_n_first(problem))
        .double()
    )
    Y = torch.zeros((0, n_obj + problem.n_ieq_constr), dtype=torch.double)
    while True:
        X = problem.xl + Z[len(Y) :].numpy() * (problem.xu - problem.xl)
        # of its criteria more is better
        sign = np.repeat([-1.0, 1.0], [n_obj, problem.n_ieq_constr])
        Y = torch.cat([Y, torch.tensor(_outputs(problem, X) * sign)])
        if len(Y) >= n_evaluations:
            return
        # Infinite values count as the worst finite ones, as the models need a scale.
        finite = Y.abs() < INFINITE
        low = torch.where(finite, Y, torch.inf).amin(dim=0)
        high = torch.where(finite, Y, -torch.inf).amax(dim=0)
        model = SingleTaskGP(Z, Y.clamp(low, high), outcome_transform=Standardize(Y.shape[1]))
        fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
        feasible = (Y[:, n_obj:] <= 0).all(dim=1)
        if published is None:
            ref_point = infer_reference_point(Y[feasible if feasible.any() else ~feasible, :n_obj])
        else:
            ref_point = torch.tensor(-published)
        acquisition = qLogNoisyExpectedHypervolumeImprovement(
            model, ref_point, Z,
            sampler=SobolQMCNormalSampler(torch.Size([128]), seed=seed),
            objective=IdentityMCMultiOutputObjective(outcomes=list(range(n_obj))),
            constraints=[lambda y, j=j: y[..., j] for j in range(n_obj, Y.shape[1])] or None,
            prune_baseline=True,
        )  # fmt: skip
        proposed, _ = optimize_acqf(
            acquisition, cube, BATCH, num_restarts=10, raw_samples=512, sequential=True,
            options={"batch_limit": 10, "init_batch_limit": 512, "maxiter": 50},
        )  # fmt: skip
        Z = torch.cat([Z, proposed])


def _outputs(problem: Watched, X: Array) -> Array:
    """Return criteria and constraints, finite for those who refuse infinity."""
    values = problem.evaluate(X, return_as_dictionary=True)
    named = [values["F"], values["G"]] if problem.n_ieq_constr else [values["F"]]
    return np.nan_to_num(np.hstack(named), posinf=INFINITE)


ALGORITHMS: dict[str, Callable[[Watched, int, int], None]] = {
    "surrogate": _surrogate,
    "psi": _psi,
    "nsga3": _nsga3,
    "tpe": partial(_optuna, "TPESampler"),
    "optuna-gp": partial(_optuna, "GPSampler"),
    "parmoo": _parmoo,
    "botorch": _botorch,
}
NEEDED = {
    "tpe": ("optuna",), "optuna-gp": ("optuna", "torch"),
    "parmoo": ("parmoo",), "botorch": ("botorch",),
}  # fmt: skip
GAUSSIAN = ("optuna-gp", "parmoo", "botorch")
OF_BUDGET = ("nsga3",)  # with a run for each budget
OURS = ("psi", "nsga3")

FEW = BUDGETS[:3]
SLOW = ("osy", "welded_beam", "zdt3", "stepped_cantilever")
# problems, algorithms, budgets and number of seeds, one after the other
STUDIED = ("branin_currin", "c2dtlz2", "disc_brake", "truss2d")  # with rivals of its own kind
OLD = tuple(name for name in PROBLEMS if name not in OPTIONAL)
PLAN: tuple[tuple[tuple[str, ...], tuple[str, ...], tuple[int, ...], int], ...] = (
    (OLD, OURS, BUDGETS, 21),
    (tuple(PROBLEMS), ("surrogate", "nsga3"), FEW, 3),
    (OLD, ("nsga3",), (2048, 4096, 8192, 16384), 2),
    (STUDIED, ("surrogate", "optuna-gp", "botorch"), FEW[:2], 5),
    (SLOW, ("parmoo",), FEW[:1], 3),
    (tuple(PROBLEMS), ("tpe", "psi"), FEW, 3),
    (tuple(PROBLEMS), ("surrogate", "nsga3", "tpe"), FEW, 21),
)


def reference_of(name: str) -> Reference:
    """Return the reference of a problem, kept, or made by long runs of NSGA-III."""
    if not (REFERENCES / f"{name}.npz").exists():
        problem = PROBLEMS[name]()
        front = known_front(name, problem) if name in COMPARED else None
        if name == "mw1":
            front = problem.pareto_front()
        made = compare(
            problem, n_evaluations=20_000, seeds=3, algorithms=["nsga3"], reference_front=front
        )
        keep_reference(name, made.reference)
    return kept_reference(name)


def _measure(name: str, F: Array) -> dict[str, float]:
    reference = reference_of(name)
    optimum = np.linalg.norm(reference.frame.scaled(reference.optimum))
    mu1 = np.linalg.norm(reference.frame.scaled(F), axis=1).min() if len(F) else np.inf
    return {
        "hypervolume": reference.measure(F)["hypervolume"],
        # above that of the best design known: also where several designs are as good
        "mu1_excess": mu1 - optimum,
    }


def _measure_published(name: str, F: Array) -> dict[str, float]:
    published = PUBLISHED[name]
    found = moocore.hypervolume(F, ref=published.reference) if len(F) else 0.0
    return {"hypervolume": found / published.maximum, "mu1_excess": np.nan}


def run(name: str, algorithm: str, seed: int, budgets: tuple[int, ...]) -> list[dict[str, Any]]:
    """Run an algorithm once and measure what it has found at each budget."""
    problem = Watched(PROBLEMS[name]())
    measure = _measure_published if name in PUBLISHED else _measure
    began = time.process_time()
    ALGORITHMS[algorithm](problem, max(budgets), seed)
    took = time.process_time() - began
    rows = []
    for budget in budgets:
        row = {"problem": name, "algorithm": algorithm, "seed": seed, "evaluations": budget}
        measured = measure(name, problem.found(budget)) | {
            "violation": min(problem.violation[:budget]),
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
        if name not in PUBLISHED:
            reference_of(name)
    missing = [a for a in algorithms if not all(map(find_spec, NEEDED.get(a, ())))]
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
    key = ["problem", "algorithm", "seed", "evaluations"]
    measured = ["hypervolume", "mu1_excess", "violation", "seconds_a_design"]
    # of earlier runs the violation is not kept
    return pd.DataFrame(rows, columns=[*key, *measured]).drop_duplicates(key, keep="last")


def compared(
    frame: pd.DataFrame, budget: int
) -> Iterator[tuple[str, Array, dict[tuple[str, int], tuple[Array, str]]]]:
    """Yield a problem, the surrogates' hypervolumes at a budget, and each rival's with a mark.

    The mark is + where the surrogates are surely better, - where they are surely worse. The last
    rival is NSGA-III with four times the budget.
    """
    known = set(zip(frame["algorithm"], frame["evaluations"], strict=True))
    entries = [(a, budget) for a in ALGORITHMS if a != "surrogate" and (a, budget) in known]
    entries += [("nsga3", b) for b in BUDGETS if b == 4 * budget and ("nsga3", b) in known]
    runs = frame.groupby(["problem", "algorithm", "evaluations"])["hypervolume"]
    values = {key: group.to_numpy() for key, group in runs}
    for name in PROBLEMS:
        ours, *others = (
            values.get((name, *entry), np.zeros(0)) for entry in [("surrogate", budget), *entries]
        )
        if not len(ours):
            continue
        p = [p_value(ours, v, fixed=(False, False)) if len(v) else np.nan for v in others]
        marks = []
        for v, adjusted in zip(others, holm(np.array(p)), strict=True):
            better = adjusted < SIGNIFICANCE and effect_size(ours, v) > 0.5
            marks.append("+" if better else "-" if adjusted < SIGNIFICANCE else "")
        yield name, ours, dict(zip(entries, zip(others, marks, strict=True), strict=True))


def _title(algorithm: str, evaluations: int, budget: int) -> str:
    return algorithm if evaluations == budget else f"{algorithm}, {evaluations}"


def table(frame: pd.DataFrame, budget: int) -> list[str]:
    """Return median hypervolumes at a budget, with the marks of :func:`compared`."""
    lines = []
    for name, ours, rivals in compared(frame, budget):
        if not lines:
            titles = [_title(*entry, budget) for entry in rivals]
            lines = [
                f"| problem (variables) | surrogate | {' | '.join(titles)} |",
                f"|---|---|{'---|' * len(titles)}",
            ]
        cells = [_cell(ours), *(f"{_cell(v)} {mark}".rstrip() for v, mark in rivals.values())]
        used = "" if name in TUNED else " ◦"
        lines.append(f"| {name}{used} ({N_VAR[name]}) | {' | '.join(cells)} |")
    return lines


def verdicts(frame: pd.DataFrame) -> list[str]:
    """Return on how many problems the surrogates are ahead of each rival, and where behind.

    Problems where nobody has a feasible design count, and are neither ahead nor behind.
    """
    counts: dict[tuple[int, str, str], list[Array]] = {}
    behind = []
    for budget in FEW:
        for name, ours, rivals in compared(frame, budget):
            size = "6 or more" if name in MANY else "2 to 5"
            for (rival, evaluations), (theirs, mark) in rivals.items():
                if not len(theirs):
                    continue
                a, b = np.median(ours), np.median(theirs)
                row = [1, mark == "+", mark == "-", a > b, ours.min() > b, a < 0.95 * b]
                title = _title(rival, evaluations, budget)
                counts.setdefault((budget, title, size), []).append(np.array(row))
                if a < 0.95 * b and evaluations == budget:
                    behind.append(f"{name} at {budget} {a:.3f}, {rival} {b:.3f}")
    lines = [
        "| evaluations | against | variables | problems | surely better | surely worse "
        "| median ahead | worst run above its median | more than 5 % behind |",
        f"|---|---|{'---|' * 7}",
    ]
    for key, rows in counts.items():
        cells = [*map(str, key), *map(str, np.sum(rows, axis=0).astype(int))]
        lines.append(f"| {' | '.join(cells)} |")
    found = "; ".join(behind) or "none"
    return [*lines, "", f"More than 5 % behind a rival of the same budget (medians): {found}."]


def _cell(values: Array) -> str:
    if not len(values):
        return "–"
    return f"{np.median(values):.3f} ({values.min():.3f}, {len(values)})"


def differences(frame: pd.DataFrame) -> list[str]:
    """Return the logarithms of what is missing to the published maximum, as BoTorch draws them."""
    runs = frame[frame["problem"].isin(PUBLISHED)].groupby(["problem", "evaluations", "algorithm"])
    medians = runs["hypervolume"].median()
    shown = [a for a in ALGORITHMS if a in medians.index.unique("algorithm")]
    lines = [
        f"| problem (variables), evaluations | {' | '.join(shown)} |",
        f"|---|{'---|' * len(shown)}",
    ]
    for name, problem in PUBLISHED.items():
        for budget in FEW if problem.published else ():
            cells = []
            for algorithm in shown:
                missing = problem.maximum * (1 - medians.get((name, budget, algorithm), np.nan))
                above = "above" if missing <= 0 else "–"
                cells.append(f"{np.log10(missing):.2f}" if missing > 0 else above)
            lines.append(f"| {name} ({problem.n_var}), {budget} | {' | '.join(cells)} |")
    return lines


def evaluations_needed(frame: pd.DataFrame) -> pd.DataFrame:
    """Return how many evaluations NSGA-III needs, in the median, for what the surrogates have.

    One row for each problem, one column for each of their budgets; infinite where its longest runs
    have less, NaN where nobody has a hundredth yet.
    """
    medians = frame.groupby(["algorithm", "problem", "evaluations"])["hypervolume"].median()
    found: dict[str, list[float]] = {}
    for name in PROBLEMS:
        if name not in medians["surrogate"].index or max(medians["nsga3", name].index) < 10_000:
            continue
        theirs = medians["nsga3", name].cummax()
        row = []
        for budget in FEW:
            ours = medians["surrogate", name].get(budget, np.nan)
            k = int(np.searchsorted(theirs, ours))
            if not ours > 0.01:
                row.append(np.nan)
            elif k == len(theirs):
                row.append(np.inf)
            else:  # between two budgets by the logarithm
                ends = np.log(theirs.index[[max(k - 1, 0), k]])
                row.append(np.exp(np.interp(ours, theirs.iloc[[max(k - 1, 0), k]], ends)))
        found[name] = row
    return pd.DataFrame(found, index=list(FEW)).T.dropna(how="all")


def picture(frame: pd.DataFrame) -> None:
    """Draw :func:`evaluations_needed`."""
    needed = evaluations_needed(frame).sort_values(FEW[-1])
    most = frame.loc[frame["algorithm"] == "nsga3", "evaluations"].max()
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.subplots()
    rows = np.arange(len(needed))
    for budget, shade in zip(FEW, ("#9ecae1", "#4292c6", "#08306b"), strict=True):
        values = needed[budget].to_numpy()
        reached = np.isfinite(values)
        axes.plot(values[reached], rows[reached], "o", color=shade, label=f"{budget}")
        beyond = rows[np.isinf(values)]
        axes.plot(
            np.full(len(beyond), most * 1.3 ** (1 + FEW.index(budget))), beyond, ">", color=shade
        )
        axes.axvline(budget, color=shade, linewidth=1)
    axes.set_xscale("log", base=2)
    axes.set_xticks([2**k for k in range(6, 15)], [f"{2**k}" for k in range(6, 15)])
    axes.set_yticks(rows, [f"{name} ({N_VAR[name]})" for name in needed.index])
    axes.set_xlabel(f"Evaluations that NSGA-III needs (arrows: more than {most})")
    axes.legend(title="for what SurrogatePSI has after", loc="lower right", ncols=3)
    figure.savefig(HERE / "pictures" / "learning_evaluations.png", dpi=110)


def tables(frame: pd.DataFrame) -> list[str]:
    """Return all tables in Markdown, and what a design costs."""
    slow = frame["algorithm"].isin(GAUSSIAN)
    lines = [*verdicts(frame), ""]
    for budget in (64, 256):
        lines += [f"**Hypervolume, {budget} evaluations**", "", *table(frame[~slow], budget), ""]
    some = frame[frame["problem"].isin(frame.loc[slow, "problem"])]
    for budget in FEW[:2]:
        shown = some[some["algorithm"].isin(("surrogate", *GAUSSIAN))]
        shown = shown[
            shown["problem"].isin(shown.loc[slow & (shown["evaluations"] == budget), "problem"])
        ]
        if rows := table(shown, budget):
            lines += [f"**Other surrogates, {budget} evaluations**", "", *rows, ""]
    lines += ["**log10 of the hypervolume that is missing to the published maximum**", ""]
    lines += [*differences(frame), ""]
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
    picture(results())
    print("\n".join(lines))
    marks = "<!-- learning: written by python -m benchmarks.learning -->", "<!-- end learning -->"
    pattern = f"{re.escape(marks[0])}\\n\\n(.*?)\\n.*?{re.escape(marks[1])}"
    # The line of the machine on which runs were timed; tables alone are made on any.
    machine = r"\1" if given.table else f"On {describe_machine()}."

    def written(found: re.Match[str]) -> str:
        return "\n".join([marks[0], "", found.expand(machine), "", *lines, "", marks[1]])

    README.write_text(re.sub(pattern, written, README.read_text("utf-8"), flags=re.DOTALL), "utf-8")


if __name__ == "__main__":
    main()
