"""Learning from tests compared with what users would use instead: few evaluations.

The whole study takes a day on one core; its most important results come first. The second command
prints its tables:

    python -m benchmarks.learning --jobs 2
    python -m benchmarks.learning --table

Every run is stored in ``benchmarks/learning.jsonl`` when it is finished: stop the benchmark at any
time, and continue with the same command. To perform some runs only:

    python -m benchmarks.learning osy zdt3 --algorithms surrogate,tpe --evaluations 256 --seeds 3

No algorithm starts with the corner and the middle of the bounds, where some test problems have
their optima: with each seed, PSI takes another part of the LPτ sequence, and all others take
scrambled or random points. One run serves all budgets, as the first designs of a longer run are
those of a shorter one. NSGA-III, whose population depends on the budget, has a run for each budget.

Rivals that are not installed are omitted. ``pip install "optuna>=5"`` adds its samplers,
``pip install parmoo`` adds ParMOO. ``pip install botorch`` adds BoTorch and the Gaussian processes
of Optuna, with a torch of 5 GB, most of it for graphics cards, which are not used. ParMOO and
BoTorch, which propose several designs at a time, begin with as many points as ``SurrogatePSI``.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

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
from benchmarks.machine import describe_machine, output, sized, write_block
from benchmarks.real_world import N_VAR as RE_N_VAR
from benchmarks.real_world import RE
from pymoo_psi import QMCSampling, SurrogatePSI, compare, investigate, nsga3
from pymoo_psi.comparison import Reference, effect_size, holm, p_value
from pymoo_psi.pareto import nondominated

Array = NDArray[np.float64]

HERE = Path(__file__).parent
KEPT = output(HERE / "learning.jsonl")
PAGE = output(HERE / "learning.md")
BEGIN = "<!-- learning: written by python -m benchmarks.learning -->"
END = "<!-- end learning -->"
BUDGETS = (64, 128, 256, 512, 1024)
# The designs that algorithms propose at a time, as SurrogatePSI does from 64 tests on; and the
# points with which they begin.
BATCH = 8
N_FIRST = 20
SIGNIFICANCE = 0.05
INFINITE = 1e30  # replaces infinity for rivals that accept finite values only

# The problems of the benchmark of comparison on which the surrogates' constants were chosen: their
# numbers are optimistic. So are those of mw1.
_COMPARED_TUNED = ("osy", "welded_beam", "truss2d", "mw7", "zdt1", "zdt3", "dtlz2", "dtlz7", "bnh")
TUNED = (*_COMPARED_TUNED, "chute-full-0.4", "mw1")

OLD: dict[str, Callable[[], Any]] = {
    **{name: COMPARED[name] for name in (*_COMPARED_TUNED, "chute-full-0.4", "zdt2")},
    "carside": partial(get_problem, "carside"),
    "mw1": partial(get_problem, "mw1"),
    "ten_bar_truss": TenBarTruss,
    "stepped_cantilever": SteppedCantilever,
}
OPTIONAL = PUBLISHED | CMO
PROBLEMS: dict[str, Callable[[], Any]] = {**OLD, **OPTIONAL, **RE}
N_VAR = {name: make().n_var for name, make in OLD.items()}
N_VAR |= {name: problem.n_var for name, problem in OPTIONAL.items()}
N_VAR |= RE_N_VAR


class Watched(Problem):
    """A problem that remembers what is evaluated, in order."""

    def __init__(self, problem: Any) -> None:
        super().__init__(
            n_var=problem.n_var,
            n_obj=problem.n_obj,
            n_ieq_constr=problem.n_ieq_constr,
            xl=problem.xl,
            xu=problem.xu,
        )
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

    def front(self, n_evaluations: int) -> Array:
        """Return the objectives of the Pareto set of the first designs."""
        feasible = np.array(self.violation[:n_evaluations]) <= 0
        if not feasible.any():
            return np.zeros((0, self.n_obj))
        F = np.array(self.F[:n_evaluations])[feasible]
        return F[nondominated(F)]


# The algorithms that are compared: each evaluates a number of designs.


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
        x = []
        for j, (low, high) in enumerate(zip(problem.xl, problem.xu, strict=True)):
            x.append(trial.suggest_float(f"x{j}", low, high))
        outputs = _outputs(problem, np.array([x]))[0].tolist()
        for j, g in enumerate(outputs[problem.n_obj :]):
            trial.set_constraint(f"g{j}", g)
        return tuple(outputs[: problem.n_obj])

    study.optimize(objective, n_trials=n_evaluations)


def _parmoo(problem: Watched, n_evaluations: int, seed: int) -> None:
    """Run ParMOO with the settings of its own introduction."""
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
        design = [x[name] for name in names]
        return _outputs(problem, np.array([design]))[0]

    def output(j: int, x: Any, outputs: Any) -> Any:
        return outputs["outputs"][j]

    n_outputs = problem.n_obj + problem.n_ieq_constr
    simulation = {
        "name": "outputs",
        "m": n_outputs,
        "sim_func": simulate,
        "search": LatinHypercube,
        "surrogate": GaussRBF,
        "hyperparams": {"search_budget": N_FIRST},
    }
    moop.addSimulation(simulation)
    for j in range(problem.n_obj):
        moop.addObjective({"name": f"f{j}", "obj_func": partial(output, j)})
    for j in range(problem.n_obj, n_outputs):
        moop.addConstraint({"name": f"g{j}", "con_func": partial(output, j)})
    for _ in range(BATCH):
        moop.addAcquisition({"acquisition": RandomConstraint, "hyperparams": {}})
    moop.solve(sim_max=n_evaluations)


def _botorch(problem: Watched, n_evaluations: int, seed: int) -> None:
    """Run BoTorch's qLogNEHVI with the settings of its own introduction, but for the iterations.

    With its 200 iterations instead of 50, and the restarts in two halves, the first proposals on
    osy take twice as long.
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
    n_obj = problem.n_obj
    n_var = problem.n_var
    cube = torch.tensor([[0.0] * n_var, [1.0] * n_var], dtype=torch.double)
    sobol = torch.quasirandom.SobolEngine(n_var, scramble=True, seed=seed)
    Z = sobol.draw(N_FIRST).double()
    Y = torch.zeros((0, n_obj + problem.n_ieq_constr), dtype=torch.double)
    sign = np.repeat([-1.0, 1.0], [n_obj, problem.n_ieq_constr])  # BoTorch maximizes
    while True:
        X = problem.xl + Z[len(Y) :].numpy() * (problem.xu - problem.xl)
        Y = torch.cat([Y, torch.tensor(_outputs(problem, X) * sign)])
        if len(Y) >= n_evaluations:
            return
        # Infinite values count as the worst finite ones, as the models need a scale.
        finite = Y.abs() < INFINITE
        low = torch.where(finite, Y, torch.inf).amin(dim=0)
        high = torch.where(finite, Y, -torch.inf).amax(dim=0)
        model = SingleTaskGP(Z, Y.clamp(low, high), outcome_transform=Standardize(Y.shape[1]))
        fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
        if published is None:
            feasible = (Y[:, n_obj:] <= 0).all(dim=1)
            if not feasible.any():
                feasible = ~feasible
            ref_point = infer_reference_point(Y[feasible, :n_obj])
        else:
            ref_point = torch.tensor(-published)
        constraints = [lambda y, j=j: y[..., j] for j in range(n_obj, Y.shape[1])]
        acquisition = qLogNoisyExpectedHypervolumeImprovement(
            model,
            ref_point,
            Z,
            sampler=SobolQMCNormalSampler(torch.Size([128]), seed=seed),
            objective=IdentityMCMultiOutputObjective(outcomes=list(range(n_obj))),
            constraints=constraints or None,
            prune_baseline=True,
        )
        proposed, _ = optimize_acqf(
            acquisition,
            cube,
            BATCH,
            num_restarts=10,
            raw_samples=512,
            sequential=True,
            options={"batch_limit": 10, "init_batch_limit": 512, "maxiter": 50},
        )
        Z = torch.cat([Z, proposed])


def _outputs(problem: Watched, X: Array) -> Array:
    """Return objectives and constraints, without infinite values."""
    values = problem.evaluate(X, return_as_dictionary=True)
    outputs = values["F"]
    if problem.n_ieq_constr:
        outputs = np.hstack([outputs, values["G"]])
    return np.nan_to_num(outputs, posinf=INFINITE)


ALGORITHMS: dict[str, Callable[[Watched, int, int], None]] = {
    "surrogate": _surrogate,
    "psi": _psi,
    "nsga3": _nsga3,
    "tpe": partial(_optuna, "TPESampler"),
    "optuna-gp": partial(_optuna, "GPSampler"),
    "parmoo": _parmoo,
    "botorch": _botorch,
}
NEEDED = {  # packages
    "tpe": ("optuna",),
    "optuna-gp": ("optuna", "torch"),
    "parmoo": ("parmoo",),
    "botorch": ("botorch",),
}
GAUSSIAN = ("optuna-gp", "parmoo", "botorch")
OF_BUDGET = ("nsga3",)  # with a run for each budget
OURS = ("psi", "nsga3")

FEW = BUDGETS[:3]
SLOW = ("osy", "welded_beam", "zdt3", "stepped_cantilever")
STUDIED = ("branin_currin", "c2dtlz2", "disc_brake", "truss2d")  # with rivals of its own kind


class Part(NamedTuple):
    """A part of the study: all its algorithms on all its problems, with seeds from 0.

    Attributes:
        problems: Names of the problems.
        algorithms: Names of the algorithms.
        budgets: Numbers of evaluations.
        n_seeds: Number of seeds.
    """

    problems: Sequence[str]
    algorithms: Sequence[str]
    budgets: Sequence[int]
    n_seeds: int


PLAN = (
    Part([*OLD], OURS, BUDGETS, 21),
    Part([*PROBLEMS], ("surrogate", "nsga3"), FEW, 3),
    Part([*OLD], ("nsga3",), (2048, 4096, 8192, 16384), 2),
    Part(STUDIED, ("surrogate", "optuna-gp", "botorch"), FEW[:2], 5),
    Part(SLOW, ("parmoo",), FEW[:1], 3),
    Part([*PROBLEMS], ("tpe", "psi"), FEW, 3),
    Part([*PROBLEMS], ("surrogate", "nsga3", "tpe"), FEW, 21),
)


def reference_of(name: str) -> Reference:
    """Return the reference of a problem; if none is stored, long runs of NSGA-III make one."""
    if not (REFERENCES / f"{name}.npz").exists():
        problem = PROBLEMS[name]()
        front = None
        if name in COMPARED:
            front = known_front(name, problem)
        elif name == "mw1":
            front = problem.pareto_front()
        comparison = compare(
            problem, n_evaluations=20_000, seeds=3, algorithms=["nsga3"], reference_front=front
        )
        keep_reference(name, comparison.reference)
    return kept_reference(name)


def _measure(name: str, F: Array) -> dict[str, float]:
    """Return the quality of a Pareto set, against the reference of the problem."""
    reference = reference_of(name)
    optimum = np.linalg.norm(reference.frame.scaled(reference.optimum))
    mu1 = np.inf
    if len(F) > 0:
        mu1 = np.linalg.norm(reference.frame.scaled(F), axis=1).min()
    return {
        "hypervolume": reference.measure(F)["hypervolume"],
        # above that of the best known design; several designs may be as good
        "mu1_excess": mu1 - optimum,
    }


def _measure_published(name: str, F: Array) -> dict[str, float]:
    """Return the quality of a Pareto set, against the published maximum."""
    published = PUBLISHED[name]
    hypervolume = 0.0
    if len(F) > 0:
        hypervolume = moocore.hypervolume(F, ref=published.reference)
    return {"hypervolume": hypervolume / published.maximum, "mu1_excess": np.nan}


def run(name: str, algorithm: str, seed: int, budgets: Sequence[int]) -> list[dict[str, Any]]:
    """Run an algorithm once and measure its designs at each budget."""
    problem = Watched(PROBLEMS[name]())
    measure = _measure
    if name in PUBLISHED:
        measure = _measure_published
    began = time.process_time()
    ALGORITHMS[algorithm](problem, max(budgets), seed)
    seconds = time.process_time() - began
    rows = []
    for budget in budgets:
        row = {"problem": name, "algorithm": algorithm, "seed": seed, "evaluations": budget}
        measures = measure(name, problem.front(budget))
        measures["violation"] = min(problem.violation[:budget])
        measures["seconds_a_design"] = seconds / max(budgets)
        for measured, value in measures.items():
            row[measured] = float(f"{value:.6g}")
        rows.append(row)
    return rows


def tasks(part: Part) -> Iterator[tuple[str, str, int, Sequence[int]]]:
    """Yield the runs that are not stored yet, seed by seed, so that all have early results."""
    stored = results()
    columns = (stored["problem"], stored["algorithm"], stored["seed"], stored["evaluations"])
    done = set(zip(*columns, strict=True))
    for seed in range(part.n_seeds):
        for name in part.problems:
            for algorithm in part.algorithms:
                groups = [part.budgets]
                if algorithm in OF_BUDGET:
                    groups = [(budget,) for budget in part.budgets]
                for budgets in groups:
                    runs = {(name, algorithm, seed, budget) for budget in budgets}
                    if not runs <= done:
                        yield name, algorithm, seed, budgets


def carry_out(part: Part, jobs: int) -> None:
    """Perform the runs that are not stored yet, and store them."""
    for name in part.problems:
        if name not in PUBLISHED:
            reference_of(name)
    missing = []
    installed = []
    for algorithm in part.algorithms:
        packages = NEEDED.get(algorithm, ())
        if all(map(find_spec, packages)):
            installed.append(algorithm)
        else:
            missing.append(algorithm)
    if missing:
        print(f"not installed: {', '.join(missing)}", flush=True)
    todo = list(tasks(part._replace(algorithms=installed)))
    done = Parallel(jobs, return_as="generator_unordered")(delayed(run)(*task) for task in todo)
    for count, rows in enumerate(done, 1):
        with KEPT.open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(row) + "\n" for row in rows)
        last = rows[-1]
        print(
            f"{count} of {len(todo)}: {last['problem']} {last['algorithm']} {last['seed']} "
            f"{last['evaluations']}: {last['hypervolume']:.4f}",
            flush=True,
        )


def results() -> pd.DataFrame:
    """Return the stored runs; an incomplete line, written when a run was killed, is ignored."""
    rows = []
    if KEPT.exists():
        for line in KEPT.read_text("utf-8").splitlines():
            try:
                rows.append(json.loads(line))
            except json.JSONDecodeError:
                continue
    key = ["problem", "algorithm", "seed", "evaluations"]
    # earlier runs have no violation
    measured = ["hypervolume", "mu1_excess", "violation", "seconds_a_design"]
    return pd.DataFrame(rows, columns=[*key, *measured]).drop_duplicates(key, keep="last")


class Rival(NamedTuple):
    """The runs of a rival of the surrogates.

    Attributes:
        algorithm: Name of the algorithm.
        evaluations: Number of evaluations.
        values: ``(n,)`` hypervolumes.
        mark: ``+`` if the surrogates are significantly better, ``-`` if they are worse.
    """

    algorithm: str
    evaluations: int
    values: Array
    mark: str

    def title(self, budget: int) -> str:
        """Return the name of the algorithm, with its evaluations if they are not the budget."""
        if self.evaluations == budget:
            return self.algorithm
        return f"{self.algorithm}, {self.evaluations}"


def compared(frame: pd.DataFrame, budget: int) -> Iterator[tuple[str, Array, list[Rival]]]:
    """Yield a problem, the surrogates' hypervolumes at a budget, and the rivals.

    The last rival is NSGA-III with four times the budget.
    """
    values = {}
    for key, group in frame.groupby(["problem", "algorithm", "evaluations"])["hypervolume"]:
        values[key] = group.to_numpy()
    entries = _rivals(frame, budget)
    for name in PROBLEMS:
        ours = values.get((name, "surrogate", budget))
        if ours is None:
            continue
        theirs = [values.get((name, *entry), np.zeros(0)) for entry in entries]
        marks = _marks(ours, theirs)
        rivals = []
        for entry, hypervolumes, mark in zip(entries, theirs, marks, strict=True):
            rivals.append(Rival(*entry, hypervolumes, mark))
        yield name, ours, rivals


def _rivals(frame: pd.DataFrame, budget: int) -> list[tuple[str, int]]:
    """Return algorithm and evaluations of the rivals that have runs."""
    wanted = [(name, budget) for name in ALGORITHMS if name != "surrogate"]
    if 4 * budget in BUDGETS:
        wanted.append(("nsga3", 4 * budget))
    available = set(zip(frame["algorithm"], frame["evaluations"], strict=True))
    return [entry for entry in wanted if entry in available]


def _marks(ours: Array, rivals: list[Array]) -> list[str]:
    """Return the mark of each rival, see :class:`Rival`."""
    p = np.full(len(rivals), np.nan)
    for k, theirs in enumerate(rivals):
        if len(theirs) > 0:
            p[k] = p_value(ours, theirs)
    marks = []
    for theirs, corrected in zip(rivals, holm(p), strict=True):
        mark = ""
        if corrected < SIGNIFICANCE:
            mark = "-"
            if effect_size(ours, theirs) > 0.5:
                mark = "+"
        marks.append(mark)
    return marks


def table(frame: pd.DataFrame, budget: int) -> list[str]:
    """Return a table of median hypervolumes at a budget, with the marks of :class:`Rival`."""
    lines = []
    for name, ours, rivals in compared(frame, budget):
        if not lines:
            titles = [rival.title(budget) for rival in rivals]
            lines = [
                f"| problem (variables) | surrogate | {' | '.join(titles)} |",
                f"|---|---|{'---|' * len(titles)}",
            ]
        cells = [_cell(ours)]
        for rival in rivals:
            cells.append(f"{_cell(rival.values)} {rival.mark}".rstrip())
        label = name
        if name not in TUNED:
            label += " ◦"
        lines.append(f"| {label} ({N_VAR[name]}) | {' | '.join(cells)} |")
    return lines


def _cell(values: Array) -> str:
    """Return the median, and in parentheses the least value and the number of values."""
    if len(values) == 0:
        return "–"
    return f"{np.median(values):.3f} ({values.min():.3f}, {len(values)})"


def verdicts(frame: pd.DataFrame) -> list[str]:
    """Return a table: on how many problems the surrogates are ahead of each rival, or behind.

    Problems without any feasible design are counted, neither as ahead nor as behind.
    """
    counts: dict[tuple[int, str, str], Array] = {}
    behind = []
    for budget in FEW:
        for name, ours, rivals in compared(frame, budget):
            size = "2 to 5"
            if N_VAR[name] >= 6:
                size = "6 or more"
            for rival in rivals:
                if len(rival.values) == 0:
                    continue
                a = np.median(ours)
                b = np.median(rival.values)
                better = rival.mark == "+"
                worse = rival.mark == "-"
                row = np.array([1, better, worse, a > b, ours.min() > b, a < 0.95 * b])
                key = (budget, rival.title(budget), size)
                counts[key] = counts.get(key, 0) + row
                if a < 0.95 * b and rival.evaluations == budget:
                    behind.append(f"{name} at {budget} {a:.3f}, {rival.algorithm} {b:.3f}")
    lines = [
        "| evaluations | against | variables | problems | surely better | surely worse "
        "| median ahead | worst run above its median | more than 5 % behind |",
        f"|---|---|{'---|' * 7}",
    ]
    for key, numbers in counts.items():
        cells = [str(cell) for cell in (*key, *numbers)]
        lines.append(f"| {' | '.join(cells)} |")
    listed = "; ".join(behind) or "none"
    return [*lines, "", f"More than 5 % behind a rival of the same budget (medians): {listed}."]


def differences(frame: pd.DataFrame) -> list[str]:
    """Return a table of log10 of the difference to the published maximum, as BoTorch plots it."""
    runs = frame[frame["problem"].isin(PUBLISHED)]
    medians = runs.groupby(["problem", "evaluations", "algorithm"])["hypervolume"].median()
    available = medians.index.unique("algorithm")
    algorithms = [name for name in ALGORITHMS if name in available]
    lines = [
        f"| problem (variables), evaluations | {' | '.join(algorithms)} |",
        f"|---|{'---|' * len(algorithms)}",
    ]
    for name, problem in PUBLISHED.items():
        if not problem.published:
            continue
        for budget in FEW:
            cells = []
            for algorithm in algorithms:
                share = medians.get((name, budget, algorithm), np.nan)
                cells.append(_difference(problem.maximum * (1 - share)))
            lines.append(f"| {name} ({problem.n_var}), {budget} | {' | '.join(cells)} |")
    return lines


def _difference(missing: float) -> str:
    """Return the cell of a hypervolume that is missing to the maximum."""
    if np.isnan(missing):
        return "–"
    if missing <= 0:
        return "above"
    return f"{np.log10(missing):.2f}"


def evaluations_needed(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the evaluations with which NSGA-III reaches the surrogates' hypervolume.

    There is one row for each problem and one column for each budget of the surrogates. Medians are
    compared. The value is infinite if NSGA-III's longest runs do not reach the hypervolume, NaN if
    this is below a hundredth.
    """
    medians = frame.groupby(["algorithm", "problem", "evaluations"])["hypervolume"].median()
    rows: dict[str, list[float]] = {}
    for name in PROBLEMS:
        if name not in medians["surrogate"].index:
            continue
        theirs = medians["nsga3", name].cummax()
        if max(theirs.index) < 10_000:
            continue
        row = []
        for budget in FEW:
            ours = medians["surrogate", name].get(budget, np.nan)
            row.append(_needed(ours, theirs))
        rows[name] = row
    return pd.DataFrame(rows, index=list(FEW)).T.dropna(how="all")


def _needed(ours: float, theirs: pd.Series) -> float:
    """Return the evaluations with which a rival, whose values increase, reaches a hypervolume."""
    if not ours > 0.01:
        return np.nan
    k = int(np.searchsorted(theirs, ours))
    if k == len(theirs):
        return np.inf
    ends = [max(k - 1, 0), k]  # interpolated in the logarithm of evaluations
    return float(np.exp(np.interp(ours, theirs.iloc[ends], np.log(theirs.index[ends]))))


def picture(frame: pd.DataFrame) -> None:
    """Draw :func:`evaluations_needed`."""
    needed = evaluations_needed(frame).sort_values(FEW[-1])
    most = frame.loc[frame["algorithm"] == "nsga3", "evaluations"].max()
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.subplots()
    rows = np.arange(len(needed))
    for k, (budget, shade) in enumerate(zip(FEW, ("#9ecae1", "#4292c6", "#08306b"), strict=True)):
        values = needed[budget].to_numpy()
        reached = np.isfinite(values)
        axes.plot(values[reached], rows[reached], "o", color=shade, label=f"{budget}")
        beyond = rows[np.isinf(values)]
        right = np.full(len(beyond), most * 1.3 ** (1 + k))
        axes.plot(right, beyond, ">", color=shade)
        axes.axvline(budget, color=shade, linewidth=1)
    axes.set_xscale("log", base=2)
    ticks = [2**k for k in range(6, 15)]
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.set_yticks(rows, [f"{name} ({N_VAR[name]})" for name in needed.index])
    axes.set_xlabel(f"Evaluations that NSGA-III needs (arrows: more than {most})")
    axes.legend(title="for what SurrogatePSI has after", loc="lower right", ncols=3)
    figure.savefig(output(HERE / "pictures" / "learning_evaluations.png"), dpi=110)


def tables(frame: pd.DataFrame) -> list[str]:
    """Return all tables in Markdown, and the cost of a design."""
    is_gaussian = frame["algorithm"].isin(GAUSSIAN)
    lines = [*verdicts(frame), ""]
    for budget in (64, 256):
        lines += [f"**Hypervolume, {budget} evaluations**", ""]
        lines += [*table(frame[~is_gaussian], budget), ""]
    for budget in FEW[:2]:
        problems = frame.loc[is_gaussian & (frame["evaluations"] == budget), "problem"]
        similar = is_gaussian | (frame["algorithm"] == "surrogate")
        rows = table(frame[similar & frame["problem"].isin(problems)], budget)
        if rows:
            lines += [f"**Other surrogates, {budget} evaluations**", "", *rows, ""]
    lines += ["**log10 of the hypervolume that is missing to the published maximum**", ""]
    lines += [*differences(frame), ""]
    costs = frame.groupby("algorithm")["seconds_a_design"].median()
    cells = [f"{name} {costs[name]:.3f}" for name in ALGORITHMS if name in costs]
    return [*lines, f"Processor seconds a design, medians: {', '.join(cells)}."]


def write_page(lines: list[str], machine: str) -> None:
    """Write tables into ``learning.md``.

    Args:
        lines: The tables.
        machine: The machine on which the runs were timed; empty: that of the page stays.
    """
    _, _, block = PAGE.read_text("utf-8").partition(BEGIN)
    machine = machine or block.strip().splitlines()[0]
    write_block(PAGE, BEGIN, END, [machine, "", *lines])


def main() -> None:
    """Perform the missing runs; print the tables, and write them into ``learning.md``."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("problems", nargs="*", choices=[[], *PROBLEMS], metavar="PROBLEM")
    parser.add_argument("--algorithms", default=",".join(OURS))
    parser.add_argument("--evaluations", default=",".join(map(str, FEW)))
    parser.add_argument("--seeds", type=int, default=21)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--table", action="store_true", help="only the tables of the stored runs")
    arguments = parser.parse_args()
    machine = ""
    if not arguments.table:
        machine = f"On {describe_machine()}."
        plan = sized(PLAN, (Part(["bnh"], ("surrogate", "nsga3"), FEW[:1], 22),))
        if arguments.problems:
            algorithms = arguments.algorithms.split(",")
            budgets = tuple(int(word) for word in arguments.evaluations.split(","))
            plan = (Part(arguments.problems, algorithms, budgets, arguments.seeds),)
        for part in plan:
            carry_out(part, arguments.jobs)
    frame = results()
    lines = tables(frame)
    picture(frame)
    print("\n".join(lines))
    write_page(lines, machine)


if __name__ == "__main__":
    main()
