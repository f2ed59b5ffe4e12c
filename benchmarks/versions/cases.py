"""The cases by which ``benchmarks.versions`` compares two versions; it runs in each of them.

    python benchmarks/versions/cases.py RESULTS.pickle SEED '{"tables": [FIRST, NUMBER]}'

A case is a function of a random generator: both versions draw the same. It returns a mapping of
names to values. Public names only, those of the newer version; ``adapter.py`` has what differs.
"""

from __future__ import annotations

import contextlib
import inspect
import io
import json
import os
import pickle
import re
import sys
import tempfile
import warnings
from pathlib import Path

import adapter  # beside this script
import numpy as np
import pandas as pd
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.problem import ElementwiseProblem, Problem
from pymoo.core.variable import Binary, Choice, Integer, Real
from pymoo.optimize import minimize
from pymoo.problems import get_problem
from scipy import stats

import pymoo_psi as psi
from pymoo_psi import chute, pareto, report, selection, table
from pymoo_psi.cli import main

# What is compared ---------------------------------------------------------------------------------


def fields(thing, names):
    return {name: getattr(thing, name) for name in names.split()}


def read_values(path, objectives, **options):
    """Rows and objectives of a file of designs, in the original direction."""
    if "thousands" not in inspect.signature(table.read_table).parameters:
        options.pop("thousands", None)  # since 0.4 the decimal mark settles both
    tests = table.read_table(path, psi.Formulation(objectives=objectives), **options)
    names = tests.layout.objectives
    values = np.column_stack([tests.column(name) for name in names])
    columns = adapter.without_repeats({"row": tests.numbers, "values": values}, path)
    return {"names": list(names)} | columns


def numbers_in(texts):
    """The numbers of sentences, whose words may differ.

    0.3 has no places, 0.4 no ranks and no shares beyond a range; shares are compared as arrays.
    """
    known = r"has place \d+ of|, of rank of efficiency \d|\([\d.e+]+ %[^)]*\)"
    plain = re.sub(known, "", " ".join(map(str, texts)))
    return [float(number) for number in re.findall(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?", plain)]


def of_ranking(ranking):
    found = fields(ranking, "criteria rank pareto ideal nadir salukvadze")
    found["order"] = adapter.order_by_rank(ranking)
    return found | {f"subset {k}": ranking.subset(k) for k in range(7)}


def of_table(tests):
    layout = tests.layout
    found = fields(tests, "numbers X F H status kinds")
    names = "variables objectives equalities lower upper eq_tolerance outputs maximize"
    found |= prefixed("layout", fields(layout, names))
    found["layout inequalities"], found["G"] = adapter.constraints_of(tests)
    found |= {f"output {name}": tests.column(name) for name in layout.outputs}
    reasons = sorted(tests.reasons.items())
    return found | {
        "layout units": sorted(layout.units.items()),
        "layout kinds": [kind.value for kind in layout.kinds],
        "failed": [number for number, _ in reasons],
        "reasons": [reason for _, reason in reasons],
    }


def prefixed(prefix, found):
    return {f"{prefix} {name}": value for name, value in found.items()}


def attempt(found, name, function):
    """Add what a function gives, or that it refuses, to what is found."""
    try:
        value = function()
    except psi.PsiError:
        value = "refused"
    if isinstance(value, dict):
        found |= prefixed(name, value)
    else:
        found[name] = value


# Random material ----------------------------------------------------------------------------------


def random_objectives(rng, most=60):
    n, m = int(rng.integers(1, most)), int(rng.choice([1, 2, 2, 3, 3, 4, 6, 10]))
    F = rng.normal(size=(n, m))
    match rng.integers(7):
        case 0:
            F = np.round(F * 2)
        case 1:
            F = np.abs(F) / np.linalg.norm(F, axis=1)[:, None]
        case 2:
            F = 10.0 ** (3 * F)
        case 3:
            F[:, 0] = 7.25
        case 4:
            F = F + rng.choice([1e6, -1e9, 1e-9])
        case 5:
            F = F[rng.integers(0, n, n)]
    return F


def random_limits(rng, columns, share=0.4):
    limits = {}
    for name, values in columns.items():
        finite = np.asarray(values, float)
        finite = finite[np.isfinite(finite)]
        if rng.random() < share and len(finite) > 0:
            low, high = np.sort(np.quantile(finite, rng.random(2)))
            limits[name] = [float(high), (None, float(high)), (float(low), None),
                            (float(low), float(high))][rng.integers(4)]  # fmt: skip
            if low == high:
                limits[name] = float(high)
    return limits


def random_table(rng, mixed=True, most=80):
    n, d, m = int(rng.integers(2, most)), int(rng.integers(1, 5)), int(rng.integers(1, 5))
    n_g, n_h, n_o = (int(k) for k in rng.integers(0, 3, 3))
    lower, upper = -1 - rng.random(d), 1 + rng.random(d)
    X, kinds = lower + rng.random((n, d)) * (upper - lower), ["real"] * d
    if mixed and rng.random() < 0.3:
        kinds[0], X[:, 0] = "integer", rng.integers(-2, 3, n)
        lower[0], upper[0] = -2, 2
    F, G = rng.normal(size=(n, m)), rng.normal(size=(n, n_g)) - 1
    if rng.random() < 0.3:
        F = np.round(F, 1)
    H, outputs = rng.choice([0.0, 5e-5, 0.3], size=(n, n_h), p=[0.8, 0.1, 0.1]), {}
    for k in range(n_o):
        outputs[f"out {k}"] = rng.normal(size=n) * 10**k
    reasons = {}
    numbers = np.arange(1, n + 1) if rng.random() < 0.7 else np.sort(rng.permutation(3 * n)[:n]) + 1
    for i in np.flatnonzero(rng.random(n) < 0.1):
        F[i], G[i], H[i] = np.inf, 0, 0
        for values in outputs.values():
            values[i] = np.nan
        reasons[int(numbers[i])] = f"ValueError: case {i}"
    objectives = [f"goal {k}" for k in range(m)]
    layout = table.Layout.of(
        [f"v{k}" for k in range(d)], objectives,
        [f"g{k}" for k in range(n_g)], [f"h{k}" for k in range(n_h)],
        lower=lower, upper=upper, kinds=kinds, outputs=list(outputs),
        maximize=[name for name in objectives if rng.random() < 0.3],
        units={"v0": "mm"} if rng.random() < 0.5 else None,
    )  # fmt: skip
    return psi.TestTable.of(numbers, X, F, G, H, outputs=outputs, reasons=reasons, layout=layout)


def columns_of(tests):
    layout = tests.layout
    names = (*layout.variables, *layout.objectives, *layout.outputs)
    return {name: tests.column(name) for name in names}


def random_formulation(rng, tests):
    layout, columns = tests.layout, columns_of(tests)
    goals = list(layout.objectives)
    computed = {}
    if rng.random() < 0.4:
        a, b = rng.choice([*goals, *layout.variables, *layout.outputs], 2)
        operation = rng.choice(["+", "-", "*", "/"])
        computed["made again" if "made" in columns else "made"] = (
            f"abs(`{a}`) {operation} (2 + `{b}` ** 2)"
        )
    pool = [*goals, *layout.outputs, *layout.inequalities, *computed]
    objectives = [name for name in pool if rng.random() < 0.6] if rng.random() < 0.7 else []
    asked = objectives or goals
    maximize = [name for name in asked if rng.random() < 0.3]
    constraints = [*layout.inequalities, *layout.equalities]
    relaxed = [name for name in constraints if name not in asked and rng.random() < 0.3]
    limits = random_limits(rng, columns, 0.25)
    more = {*maximize, *layout.maximize}
    limits |= {k: (None, v) for k, v in limits.items() if k in more and not isinstance(v, tuple)}
    if relaxed and rng.random() < 0.5:
        limits |= random_limits(rng, {relaxed[0]: tests.column(relaxed[0])}, 1)
    return psi.Formulation(
        objectives, maximize=maximize, limits=limits, relaxed=relaxed, computed=computed,
        normalize=bool(rng.random() < 0.8),
    )  # fmt: skip


# Problems -----------------------------------------------------------------------------------------


class Mixed(ElementwiseProblem):
    """Variables of every kind, a constraint, an output, a maximum; some designs fail."""

    maximize = ("gain",)

    def __init__(self, a=1.0):
        self.a, self.names, self.units = a, {"f1": "cost", "f2": "gain"}, {"cost": "k€"}
        variables = {
            "x": Real(bounds=(0, 2)), "n": Integer(bounds=(1, 6)),
            "on": Binary(), "steel": Choice(options=["S235", "S355", "S460"]),
        }  # fmt: skip
        super().__init__(vars=variables, n_obj=2, n_ieq_constr=1)

    def _evaluate(self, X, out, *args, **kwargs):
        x, n, on, steel = X["x"], X["n"], X["on"], X["steel"]
        if x > 1.8 and on:
            raise RuntimeError("no licence")
        strength = {"S235": 235, "S355": 355, "S460": 460}[steel] / 100
        out["F"] = [self.a * x * n + 0.3 * strength, -(x + 1) * strength / (1 + on)]
        out["G"] = [x * n - 8]
        out["load"] = x / n if n != 5 else np.nan


class Fragile(Problem):
    """Vectorised; NaN for some designs."""

    def __init__(self):
        super().__init__(n_var=3, n_obj=3, n_ieq_constr=1, n_eq_constr=1, xl=-1.0, xu=1.0)

    def _evaluate(self, x, out, *args, **kwargs):
        F = np.column_stack([x[:, 0] ** 2, (x[:, 1] - 1) ** 2, x[:, 2] + x[:, 0]])
        F[x[:, 2] > 0.8, 1] = np.nan
        out["F"], out["G"] = F, x[:, :1] + x[:, 1:2] - 1
        out["H"] = np.where(x[:, 1:2] > -0.5, 0.0, 1.0)
        out["area"] = x[:, 0] * x[:, 1]


class Loaded(Problem):
    """Its parameters may be uncertain."""

    def __init__(self, load=1.0, strength=0.6):
        super().__init__(n_var=2, n_obj=3, n_ieq_constr=1, xl=0.0, xu=2.0)
        self.load, self.strength = load, strength

    def _evaluate(self, x, out, *args, **kwargs):
        a, b = x.T
        out["F"] = np.column_stack([a + b, self.load / (0.1 + a), (b - self.load) ** 2])
        out["G"] = (self.load * b - self.strength)[:, None]


def random_problem(rng, mixed=True):
    names = ["bnh", "osy", "zdt1", "zdt3", "dtlz2", "mw7", "truss2d", "welded_beam", "kursawe"]
    some = [
        lambda: Mixed(), lambda: Fragile(), lambda: Loaded(),
        lambda: psi.VectorizedSphereChute(float(rng.uniform(0.1, 0.7)), model="rolling"),
        lambda: psi.SphereChute(float(rng.uniform(0.1, 0.7))),
        *[lambda name=name: get_problem(name) for name in names],
    ]  # fmt: skip
    return some[rng.integers(0 if mixed else 1, len(some))]()


def random_sampling(rng):
    engine = rng.choice(["lptau", "sobol", "halton", "lhs"], p=[0.55, 0.15, 0.15, 0.15])
    if engine == "lptau":
        return {}
    return {"sampling": psi.QMCSampling(str(engine), scramble=bool(rng.random() < 0.8))}


# Kinds of cases -----------------------------------------------------------------------------------


def rankings(rng, folder):
    F = random_objectives(rng)
    options = {"normalize": bool(rng.random() < 0.6)}
    if rng.random() < 0.4:
        options["maximize"] = [int(k) for k in np.flatnonzero(rng.random(F.shape[1]) < 0.5)]
    if "maximize" not in options and rng.random() < 0.4:
        options["ideal"] = F.min(axis=0) - rng.random(F.shape[1])
        options["nadir"] = F.max(axis=0) + rng.random(F.shape[1])
    found = {}
    attempt(found, "ranking", lambda: of_ranking(psi.rank_of_efficiency(F, **options)))
    attempt(found, "nondominated", lambda: pareto.nondominated(F))

    def frame():
        shown = psi.rank_of_efficiency(F, **options).to_frame()
        return adapter.shown_columns({str(name): shown[name].to_numpy() for name in shown.columns})

    attempt(found, "frame", frame)
    return found


def explanations(rng, folder):
    F = random_objectives(rng)
    names = [f"c{k}" for k in range(F.shape[1])]
    labels = [f"design {k}" for k in range(len(F))] if rng.random() < 0.5 else None
    frame = pd.DataFrame(F, columns=names, index=labels)
    options = {"normalize": bool(rng.random() < 0.7)}
    options["maximize"] = [name for name in names if rng.random() < 0.3]
    i, found = int(rng.integers(len(F))), {}
    rows = [int(k) for k in rng.permutation(len(F))[:3]]

    def explained():
        why = adapter.explain(frame, i, **options)
        return fields(why, "row behind shares neighbours dominated_by") | {
            "weakest": list(why.weakest), "gains": why.steps.gains, "steps": why.steps.rows,
            "step shares": why.steps.shares, "numbers": numbers_in(why.sentences),
        }  # fmt: skip

    def compared():
        return fields(adapter.compare_designs(frame, rows, **options), "rows gains shares")

    def cautioned():
        said = psi.cautions(psi.rank_of_efficiency(frame, **options))
        kinds, texts = adapter.cautions_by_kind(said)
        return {"kinds": kinds, "numbers": numbers_in(texts)}

    attempt(found, "explain", explained)
    attempt(found, "compare", compared)
    attempt(found, "cautions", cautioned)
    return found


def selectors(rng, folder):
    F = random_objectives(rng)
    m, normalize = F.shape[1], bool(rng.random() < 0.7)
    weights, point = rng.random(m) + 0.1, F[rng.integers(len(F))] - 0.1
    maximize = [int(k) for k in np.flatnonzero(rng.random(m) < 0.3)]
    chosen = {
        "salukvadze": psi.SalukvadzeOptimum(normalize=normalize),
        "subset": psi.EfficientSubset(int(rng.integers(3, 7)), normalize=normalize),
        "p": psi.CompromiseProgramming(
            float(rng.choice([1, 2, 3.5, np.inf])), weights=weights, normalize=normalize),
        "point": psi.ReferencePoint(point, weights=weights, normalize=normalize),
        "knee": psi.Knee(),
    }  # fmt: skip
    found = {}
    for name, selector in chosen.items():
        attempt(found, name, lambda selector=selector: selector.do(F))
        attempt(found, f"{name} max", lambda selector=selector: selector.do(F, maximize=maximize))

    def several():
        compared = selection.compare_selectors(F, chosen, normalize=normalize, maximize=maximize)
        return dict(compared)

    attempt(found, "compared", several)
    return found


def representatives(rng, folder):
    F, k, found = random_objectives(rng), int(rng.integers(1, 8)), {}
    normalize = bool(rng.random() < 0.7)
    few = lambda: fields(  # noqa: E731
        psi.representatives(F, k, normalize=normalize), "rows shares radius"
    )
    attempt(found, "few", few)
    return found


def points(rng, folder):
    n, d, first = int(rng.integers(1, 300)), int(rng.integers(1, 52)), int(rng.integers(1, 9999))
    found = {"lp_tau": psi.lp_tau(n, d, first=first)}
    problem, seed = random_problem(rng, mixed=False), int(rng.integers(99))
    sampling = random_sampling(rng).get("sampling") or psi.LPTauSampling(first=first)
    found["sampling"] = sampling(problem, n, random_state=np.random.default_rng(seed)).get("X")
    return found


def motions(rng, folder):
    n = int(rng.integers(1, 200))
    parameters = chute.ChuteParameters(
        mu=float(rng.uniform(0.05, 0.9)), c=float(rng.choice([0.3193, 0.01, 1.5])),
        r=float(rng.uniform(0.02, 0.3)), omega0=tuple(rng.normal(size=3) * rng.integers(0, 3)),
    )  # fmt: skip
    u1, v_p = rng.uniform(0, 3.5 * parameters.mu, n), rng.uniform(0.05, 6, n)
    model, found = str(rng.choice(["full", "rolling"])), {}
    moved = chute.motion(u1, v_p, parameters, model=model)
    found |= fields(moved, "time exit_speed slip_end slip_time exit_spin plane_work dissipation")
    found["reached"], found["criteria"] = moved.reached, chute.criteria(moved)
    way = lambda: fields(  # noqa: E731
        chute.trajectory(float(u1[0]), float(v_p[0]), parameters, n=31),
        "eta time speed spin slip_velocity friction normal slipping slip_end slip_time",
    )
    attempt(found, "trajectory", way)
    if rng.random() < 0.05:
        slow = chute.integrate(u1[:2], v_p[:2], parameters)
        found |= prefixed("integrate", fields(slow, "time slip_end plane_work"))
    return found


def answers_of(question):
    """All that a table answers."""
    found = {}
    ask = adapter.ask
    for name in ("feasible", "eligible", "pareto"):
        attempt(found, name, lambda name=name: ask(getattr(psi.TestTable, name), question))
    attempt(found, "ranking", lambda: of_ranking(ask(psi.TestTable.ranking, question)))
    attempt(found, "best", lambda: ask(psi.TestTable.best, question).numbers)
    attempt(found, "violations", lambda: adapter.violations_of(question))

    def all_feasible():
        rows, ranking = adapter.feasible_ranking(question)
        return {"rows": rows} | of_ranking(ranking)

    attempt(found, "all feasible", all_feasible)

    def refined():
        low, high = ask(psi.TestTable.refined_bounds, question, margin=0.1)
        return {"lower": low, "upper": high}

    attempt(found, "refined", refined)

    def explained():
        why = adapter.explain_best(question)
        return fields(why, "row behind shares neighbours") | {"numbers": numbers_in(why.sentences)}

    attempt(found, "explain", explained)
    return found


def tables(rng, folder):
    tests = random_table(rng)
    limits = random_limits(rng, columns_of(tests))
    more = tests.layout.maximize
    limits |= {k: (v, None) for k, v in limits.items() if k in more and not isinstance(v, tuple)}
    question = adapter.under(tests, limits=limits, normalize=bool(rng.random() < 0.7))
    found = of_table(tests) | answers_of(question)
    attempt(found, "costs", lambda: adapter.costs_of(question))
    some = rng.random(len(tests)) < 0.5
    found |= prefixed("rows", of_table(tests.rows(some)))
    attempt(found, "merge", lambda: of_table(tests.rows(some).merge(tests.rows(~some))))

    def combined():
        both = psi.TestTable.combined({"a": tests.rows(some), "b": tests})
        return of_table(both) | {"experiment": both.column("experiment")}

    attempt(found, "combined", combined)
    return found


def formulations(rng, folder):
    tests, found = random_table(rng), {}
    asked = random_formulation(rng, tests)

    def under():
        question = adapter.under(tests, asked)
        return of_table(adapter.table_of(question)) | answers_of(question)

    attempt(found, "under", under)
    other = random_formulation(rng, tests)

    def again():
        # A formulation takes the place of the one before, in 0.3 by beginning anew.
        first = tests.under(asked) if adapter.CARRIES_FORMULATION else tests
        return of_table(adapter.table_of(adapter.under(first, other)))

    if found.get("under") != "refused":
        attempt(found, "again", again)
    return found


def written(rng, folder):
    tests, found = random_table(rng), {}
    if rng.random() < 0.5:
        with contextlib.suppress(psi.PsiError):
            tests = tests.under(random_formulation(rng, tests))
    for name in ("csv", "xlsx", "study"):

        def there_and_back(name=name):
            path = folder / f"table.{name.replace('study', 'db')}"
            getattr(tests, f"to_{name}")(path)
            read = adapter.read(path)
            return of_table(read) | {"equals": tests.equals(read)}

        attempt(found, name, there_and_back)
    csv = folder / "table.csv"
    if csv.exists():
        found["file"] = shown_file(csv)
    frame = tests.to_frame()
    columns = {str(name): frame[name].to_numpy() for name in frame.columns}
    return found | prefixed("frame", adapter.shown_columns(columns))


def analyses(rng, folder):
    tests, found = psi.investigate(random_problem(rng, mixed=False), 96), {}
    limits = random_limits(rng, {k: tests.column(k) for k in tests.layout.objectives}, 0.3)

    question = adapter.under(tests, limits=limits, normalize=bool(rng.random() < 0.7))
    names = "tests feasible pareto hypervolume optimum mu1 moved"
    attempt(found, "sensitivities", lambda: shown_frame(table.sensitivities(tests)))
    attempt(found, "costs", lambda: adapter.costs_of(question))
    attempt(found, "convergence", lambda: fields(adapter.ask(table.convergence, question), names))
    for name in (tests.layout.variables[-1], tests.layout.objectives[0]):

        def counted(name=name):
            histogram = adapter.ask(table.histogram, question, name)
            return fields(histogram, "edges values tested feasible pareto outside")

        attempt(found, f"histogram {name}", counted)
    return found


def shown_frame(frame):
    columns = {str(name): frame[name].to_numpy() for name in frame.columns}
    return columns | {"index": [str(row) for row in frame.index]}


def documents(rng, folder):
    """What report and page say of tests; both are laid out anew, with the numbers of a table."""
    tests, found = random_table(rng), {}
    formulation = random_formulation(rng, tests)

    def reported():
        question = adapter.under(tests, formulation, limits_apart=True)
        document = adapter.ask(report.decision_report, question)
        return numbers_in(adapter.common_cautions(document.cautions))

    def paged():
        document = adapter.decision_page(tests, formulation)
        cautions = numbers_in(adapter.common_cautions(document.cautions))
        return of_table(document.table) | {"cautions": cautions}

    attempt(found, "report cautions", reported)
    attempt(found, "page", paged)
    return found


def investigations(rng, folder):
    problem, n = random_problem(rng), int(rng.integers(2, 60))
    options = random_sampling(rng)
    seed = int(rng.integers(99))
    if not options:
        options["first"] = int(rng.integers(1, 50))
    if rng.random() < 0.5:
        options["block_size"] = int(rng.integers(1, 20))
    found = {}
    study = {"study": folder / "run.db", "study_key": "v1"} if rng.random() < 0.5 else {}

    def investigated():
        return of_table(psi.investigate(problem, n, seed=seed, **options, **study))

    attempt(found, "investigate", investigated)

    def by_psi(n=n):
        result = minimize(problem, psi.PSI(n, **options, **study), seed=seed)
        tests = result.algorithm.table
        got = {"F": result.F, "X": result.X, "evaluations": result.algorithm.evaluator.n_eval}
        if result.opt is not None:
            got["test points"] = result.opt.get("test_point")
        return prefixed("table", of_table(tests)) | got

    attempt(found, "psi", by_psi)
    attempt(found, "longer", lambda: by_psi(n + 7))
    if study:
        attempt(found, "study", lambda: of_table(adapter.read(study["study"])))
    limits = {}
    if rng.random() < 0.5:
        limits = {"cost": 6.0} if isinstance(problem, Mixed) else {"f1": 10.0}
    for keep in ("all", "feasible", "pareto"):

        def kept(keep=keep):
            tests = psi.investigate(problem, n, seed=seed, keep=keep, limits=limits, **options)
            tests, feasible = adapter.tests_of_run(tests, limits)
            return of_table(tests) | {"feasible": feasible}

        attempt(found, keep, kept)
    return found


def shares(rng, folder):
    problem, n, parts, found = random_problem(rng), int(rng.integers(6, 40)), 3, {}
    options = random_sampling(rng)
    for k in range(1, parts + 1):

        def part(k=k):
            share = {"share": (k, parts), "study": folder / "parts"}
            return of_table(psi.investigate(problem, n, seed=5, **options, **share))

        attempt(found, f"share {k}", part)
    attempt(found, "folder", lambda: of_table(adapter.read(folder / "parts")))
    return found


def surrogates(rng, folder):
    """Tests of the sequence, before the first proposal, and that a longer run keeps all of a run.

    Proposals differ: see "Numbers of proposals change" in the CHANGELOG of 0.4.
    """
    problem, seed, found = random_problem(rng), int(rng.integers(99)), {}
    n = int(rng.integers(10, 22))
    limits = {}
    if rng.random() < 0.5:
        limits = {"cost": 6.0} if isinstance(problem, Mixed) else {"f1": 10.0}
    sequence = psi.investigate(problem, n + 4).X
    designs = []

    def run(n=n):
        algorithm = psi.SurrogatePSI(n, batch=3, study=folder / "s.db", limits=limits)
        result = minimize(problem, algorithm, seed=seed)
        tests, feasible = adapter.tests_of_run(result.algorithm.table, limits)
        designs.append(tests.X)
        proposed = (sequence[:n] != tests.X).any(axis=1)
        before = np.logical_or.accumulate(proposed) == 0
        return of_table(tests.rows(before)) | {"feasible": feasible[before], "tests": len(tests)}

    attempt(found, "run", run)
    attempt(found, "longer", lambda: run(n + 4))
    if len(designs) == 2:
        found["kept"] = np.array_equal(designs[0], designs[1][:n])
    return found


def other_algorithms(rng, folder):
    problem, seed, found = random_problem(rng, mixed=False), int(rng.integers(99)), {}

    def searched():
        result = psi.nsga3(problem, 150, seed=seed)
        return {"F": result.F, "X": result.X}

    attempt(found, "nsga3", searched)

    def recorded():
        path = folder / "recorded.db"
        known = psi.Recorded(problem, study=path)
        result = minimize(known, NSGA2(pop_size=10), ("n_gen", 4), seed=seed)
        return {"F": result.F, "X": result.X} | of_table(adapter.read(path))

    attempt(found, "recorded", recorded)
    attempt(found, "again", recorded)
    return found


def wrappers(rng, folder):
    problem, found = random_problem(rng, mixed=False), {}
    X = problem.xl + psi.lp_tau(20, problem.n_var) * (problem.xu - problem.xl)
    low, high = problem.xl[0] * 0.7 + problem.xu[0] * 0.3, problem.xu[0]
    box = {"x1": (float(low), float(high))}
    if problem.n_var > 2:
        box["x3"] = float(problem.xl[2])

    def evaluated(wrapped, X=X):
        out = wrapped.evaluate(X, return_as_dictionary=True)
        names = [name for name in ("F", "G", "H") if name in out and out[name] is not None]
        return {name: np.asarray(out[name], float) for name in names}

    for how in ("constraint", "penalty"):
        tolerant = lambda how=how: evaluated(  # noqa: E731
            psi.FailureTolerant(problem, failed_as=how)
        )
        attempt(found, how, tolerant)

    def restricted():
        part = psi.Restricted(problem, box)
        return of_table(psi.investigate(part, 12)) | {"xl": part.xl, "xu": part.xu}

    attempt(found, "restricted", restricted)
    width = float(problem.xu[0] - problem.xl[0]) * 0.05
    what = str(rng.choice(["mean", "worst", "cvar:0.75"]))

    def robust():
        wrapped = psi.Robust(problem, tolerances={"x1": width}, n_scenarios=7, criteria=what)
        return evaluated(wrapped, X[:6])

    attempt(found, "robust", robust)
    return found


def scenarios(rng, folder):
    load = {"load": stats.norm(1.0, 0.2), "strength": stats.uniform(0.2, 0.7)}
    X, found = 2 * psi.lp_tau(int(rng.integers(2, 30)), 2, first=int(rng.integers(1, 99))), {}
    names = "scenarios optimum_share efficient_share pareto_share infeasible_share"
    held = lambda: fields(  # noqa: E731
        psi.robustness(
            Loaded, X, uncertainty=load, n_scenarios=int(rng.integers(2, 40)),
            normalize=bool(rng.random() < 0.6),
        ),
        names + " mean_regret worst_regret",
    )  # fmt: skip
    attempt(found, "robustness", held)
    return found


def shown_file(path):
    """The columns of a written table; what reads as numbers is numbers."""
    text = path.read_text("utf-8")
    text = "".join(line for line in text.splitlines(True) if not line.startswith("# "))
    frame = pd.read_csv(io.StringIO(text), dtype=str, keep_default_na=False)
    columns = adapter.shown_columns({str(name): frame[name].tolist() for name in frame.columns})
    return {name: as_numbers(cells) for name, cells in columns.items()}


def as_numbers(cells):
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except (TypeError, ValueError):
        return cells


def command(*words):
    """The exit code of the command, silent."""
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(out):
        code = main([str(word) for word in words])
    return code, out.getvalue()


HABITS = [  # each 9 becomes any digit but 0
    "9.999", "9,999", "9,999,999", "9.999.999", "9.999,9", "9,999.9", "9'999", "9 999",
    "9\u00a0999", "9_999", "+9", ".99", "99.", "9e9", "9E+9", "9e-9", "9d9", "-9", "\u22129",
    "9-", "(9)", "$9", "9 €", "9 kg", "9e9 kg", "9:99", "2009-09-09", "09", "9/9", "TRUE",
    "0x99", "1e999", "inf", "Infinity", "nan", "NA", "n/a", "-", "", "#N/A", "9%", "9,9 %",
    "９９", "9;9", '="9"', "9 ± 9", "<9", "~9", "9.99.99", "9,99,999", "9.9999", "9,9999",
    "0.999", "0,999", "99.999", "-9,999", "9.999e9",
]  # fmt: skip


def random_file(rng, path):
    """A CSV as others write it; return its columns of numbers."""
    n, m = int(rng.integers(1, 30)), int(rng.integers(2, 5))
    separator = str(rng.choice([",", ";", "\t"]))
    decimal = "," if separator != "," and rng.random() < 0.5 else "."
    F = random_objectives(rng, n + 1)
    F = np.tile(F, (-(-n // len(F)), -(-m // F.shape[1])))[:n, :m]
    style = str(rng.choice(["%.3f", "%.6g", "%r", "%d"]))
    cells = [[(style % (float(v) if style != "%d" else int(np.clip(v, -1e9, 1e9)))).replace(
        ".", decimal) for v in row] for row in F]  # fmt: skip
    heads = [f"c{k}" + str(rng.choice(["", " [kg]"])) for k in range(m)]
    names = list(heads)
    event = rng.integers(16)
    if event >= 12:  # one cell, or all of its column, as people and programs write numbers
        column, habit = int(rng.integers(m)), str(rng.choice(HABITS))
        for row in cells if rng.random() < 0.6 else cells[-1:]:
            row[column] = re.sub("9", lambda found: str(rng.integers(1, 10)), habit)
    if event == 0:  # a gap
        cells[-1][0] = ""
    elif event == 1:  # thousands
        other = "." if decimal == "," else ","
        for row in cells:
            row[0] = f"{rng.integers(1, 3)}{other}{rng.integers(100, 999)}"
            if rng.random() < 0.5:
                row[0] += f"{decimal}{rng.integers(10, 99)}"
    elif event == 2:  # per cent
        for row in cells:
            row[0] = f"{rng.integers(1, 99)} %"
    if event == 3:
        cells[int(rng.integers(n))][0] = str(rng.choice(["n/a", "failed", "12 kg", "1e400", "nan"]))
    label = rng.random() < 0.6
    if label:
        heads = ["name", *heads]
        cells = [[f"design {chr(65 + i)}", *row] for i, row in enumerate(cells)]
        if event == 4:
            cells[-1][0] = str(rng.choice(["Total", "Mean", "Max", "Ideal", "Best"]))
    quoted = lambda c: '"' + c.replace('"', '""') + '"' if {separator, '"'} & {*c} else c  # noqa: E731
    lines = [separator.join(map(quoted, row)) for row in (heads, *cells)]
    encoding = str(rng.choice(["utf-8", "utf-8-sig", "utf-16"], p=[0.7, 0.2, 0.1]))
    end = "\r\n" if rng.random() < 0.3 else "\n"
    path.write_bytes((end.join(lines) + end).encode(encoding))
    return names, F, decimal


def random_workbook(rng, path):
    """A sheet as others write it: formats, a hidden row or column, a total, numbers as text."""
    from openpyxl import Workbook

    n, m = int(rng.integers(2, 20)), int(rng.integers(2, 5))
    F, names = np.round(rng.normal(size=(n, m)) * 100, 3), [f"c{k}" for k in range(m)]
    book = Workbook()
    sheet = book.active
    sheet.append(["name", *names])
    for i, row in enumerate(F):
        sheet.append([f"design {chr(65 + i)}", *map(float, row)])
    event = rng.integers(10)
    if event == 0:
        sheet.row_dimensions[3].hidden = True
    elif event == 1:
        sheet.append(["Total", *map(float, F.sum(axis=0))])
    elif event == 2:
        for cell in sheet["B"][1:]:
            cell.number_format = "0.00%"
    elif event == 3:
        sheet["B2"] = str(rng.choice(["1,5", "1.5", "n/a", "12 kg"]))
    elif event == 4:
        sheet["C3"] = None
    elif event == 5:
        book.create_sheet("other").append(["a", "b"])
    elif event == 6:
        sheet.column_dimensions["B"].hidden = True
    elif event == 7:
        sheet.insert_rows(1)
        sheet["A1"] = "Results of spring"
    book.save(path)
    return names, F, "."


def foreign_files(rng, folder):
    file, found = folder / "designs.csv", {}
    if rng.random() < 0.2:
        file = folder / "designs.xlsx"
        names, F, decimal = random_workbook(rng, file)
    else:
        names, F, decimal = random_file(rng, file)
    words = []
    if rng.random() < 0.5:
        words += ["--maximize", names[0]]
    if rng.random() < 0.3:
        words += ["--objectives", ",".join(names[:2])]
    if rng.random() < 0.3:
        words += ["--limits", f"{names[0]}<={float(np.median(F[:, 0])):.4g}"]
    if rng.random() < 0.3:
        words += ["--drop-incomplete"]
    if rng.random() < 0.3:
        words += ["--no-normalize"]
    if rng.random() < 0.4:
        words += ["--decimal", decimal]
    code, _ = command("rank", file, *words, "--out", folder / "ranked.csv")
    if code != 0:
        return {"written": "refused", "code": code}
    written = adapter.without_repeats(shown_file(folder / "ranked.csv"), file)
    found = {"code": code, **prefixed("written", written)}
    # 0.3 takes the distances of a written ranking for normalised ones, unless it is told again.
    plain = [word for word in words if word == "--no-normalize"]
    code, _ = command("rank", folder / "ranked.csv", *plain, "--out", folder / "again.csv")
    if code == 0:
        again = adapter.without_repeats(shown_file(folder / "again.csv"), file)
        found |= prefixed("again", again)
    else:
        found["again"] = "refused"
    return found


def sources(rng, folder):
    file, found = folder / "designs.csv", {}
    if rng.random() < 0.2:
        file = folder / "designs.xlsx"
        names, _, decimal = random_workbook(rng, file)
    else:
        names, _, decimal = random_file(rng, file)
    attempt(found, "all", lambda: read_values(file, []))
    attempt(found, "named", lambda: read_values(file, names[:2]))
    attempt(found, "decimal", lambda: read_values(file, names, decimal=decimal))
    thousands = "." if decimal == "," else ","
    both = {"decimal": decimal, "thousands": thousands}
    attempt(found, "marks", lambda: read_values(file, names, **both))
    return found


def commands(rng, folder):
    """A study by the command, ranked and exported."""
    problem = str(rng.choice(["bnh", "osy", "zdt3", "chute"]))
    n, found = int(rng.integers(8, 60)), {}
    solve = ["solve", problem, "--points", n, "--study", folder / "s.db"]
    solve += ["--out", folder / "front.csv"]
    if rng.random() < 0.3:
        solve += ["--sampling", "halton", "--seed", 3]
    limits = []
    if rng.random() < 0.7:
        limits = ["--limits", f"f1<={rng.choice([3, 60, 200])},{rng.choice([0, 0.2])}<=x1<=2.5"]
    found["solve"] = command(*solve, *limits)[0]
    found["rank"] = command("rank", folder / "s.db", *limits, "--out", folder / "ranked.csv")[0]
    found["export"] = command("export", folder / "s.db", "--out", folder / "all.csv")[0]
    found["all"] = command("rank", folder / "all.csv", *limits, "--out", folder / "again.csv")[0]
    found["analyze"] = command("analyze", folder / "all.csv", *limits)[0]
    for name in ("front", "ranked", "all", "again"):
        path = folder / f"{name}.csv"
        if path.exists():
            found |= prefixed(f"{name}.csv", shown_file(path))
    return found


def comparisons(rng, folder):
    name, seeds = (
        str(rng.choice(["bnh", "zdt1", "dtlz2"])),
        [int(s) for s in rng.integers(9, size=2)],
    )
    compared = psi.compare(
        get_problem(name), n_evaluations=[16, 32], seeds=sorted({*seeds, 11}),
        algorithms=["psi", "psi-scrambled", "nsga3"],
    )  # fmt: skip
    found = {}
    for what in ("to_frame", "summary"):
        frame = getattr(compared, what)()
        frame = frame[[name for name in frame.columns if "seconds" not in str(name)]]
        found |= {f"{what} {name}": frame[name].to_numpy() for name in frame.columns}
    return found


KINDS = {  # with their share of the cases
    rankings: 170, explanations: 90, selectors: 80, representatives: 40, points: 50, motions: 70,
    tables: 100, formulations: 100, written: 50, analyses: 30, documents: 20, investigations: 60,
    shares: 15, surrogates: 10, other_algorithms: 10, wrappers: 30, scenarios: 20,
    foreign_files: 60, sources: 60, commands: 13, comparisons: 2,
}  # fmt: skip


def run(kind, seed, case):
    """What one version finds in one case."""
    rng = np.random.default_rng(
        [seed, [each.__name__ for each in KINDS].index(kind.__name__), case]
    )
    with tempfile.TemporaryDirectory() as place, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return kind(rng, Path(place))
        except Exception as error:
            return {"error": f"{type(error).__name__}: {error}"}


if __name__ == "__main__":
    results, seed, asked = sys.argv[1], int(sys.argv[2]), json.loads(sys.argv[3])
    os.environ.pop("COLUMNS", None)
    found = {}
    for kind in KINDS:
        first, number = asked.get(kind.__name__, (0, 0))
        found[kind.__name__] = [run(kind, seed, case) for case in range(first, first + number)]
    with open(results, "wb") as file:
        pickle.dump(found, file)
