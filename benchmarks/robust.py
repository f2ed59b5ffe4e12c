"""The chute's robust optimum beside the nominal one: numbers and a picture.

    python -m benchmarks.robust

Friction and the initial speed are known to a quarter and to a third only, and the floor keeps its
speed to 0.1. The 4096 designs of PSI are searched once with all quantities at their medians, once
for the means of the worst tenth of 64 scenarios. Both optima are then tried in 4096 other
scenarios.
"""

from __future__ import annotations

import time
from pathlib import Path

import matplotlib as mpl
import numpy as np
from scipy.stats import uniform

from benchmarks.machine import describe_machine
from pymoo_psi import Robust, VectorizedSphereChute, investigate, lp_tau

mpl.use("Agg")
from matplotlib import pyplot as plt

PICTURE = Path(__file__).parent / "pictures" / "robust_chute.png"
POINTS = 4096
WITHIN = {
    "tolerances": {"x2": 0.1},
    "uncertainty": {"mu": uniform(0.3, 0.2), "c": uniform(0.2, 0.24)},
    "criteria": "cvar:0.9",
}


def chute(mu: float = 0.4, c: float = 0.32) -> VectorizedSphereChute:
    """Return the chute of a scenario."""
    return VectorizedSphereChute(mu, c=c)


def optimum(table) -> np.ndarray:
    """Return the design of the Salukvadze optimum, with plain distances as in the paper."""
    front = table.rows(table.pareto())
    return front.X[table.under(normalize=False).ranking().salukvadze[0]]


def lives(design: np.ndarray) -> np.ndarray:
    """Return the (4096, 4) criteria of a design in other scenarios than those of the search."""
    # Three dimensions further on in the sequence: none of the 64 scenarios is among them.
    u = lp_tau(POINTS, 3, first=POINTS + 1)
    moved = np.column_stack([np.full(POINTS, design[0]), design[1] + 0.2 * u[:, 0] - 0.1])
    problems = (chute(0.3 + 0.2 * a, 0.2 + 0.24 * b) for a, b in u[:, 1:])
    return np.vstack([p.evaluate(x[None])[0] for p, x in zip(problems, moved, strict=True)])


def main() -> None:
    """Print both optima and draw what becomes of them."""
    print(describe_machine())
    robust_problem = Robust(chute, **WITHIN)
    nominal = investigate(chute(), POINTS)
    start = time.perf_counter()
    robust = investigate(robust_problem, POINTS)
    print(
        f"{POINTS} designs in 64 scenarios: {time.perf_counter() - start:.1f} s; Pareto optimal: "
        f"{nominal.pareto().sum()} of the nominal criteria, {robust.pareto().sum()} of the "
        f"statistics, {(nominal.pareto() & robust.pareto()).sum()} of both"
    )
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for name, table, colour in (("nominal", nominal, "#0072B2"), ("robust", robust, "#D55E00")):
        design = optimum(table)
        F = lives(design)
        worst = np.sort(F, axis=0)[-POINTS // 10 :].mean(axis=0)
        print(
            f"{name} optimum: u1 = {design[0]:.4f}, u2 = {design[1]:.4f}; mean of f1, f2 "
            f"{F[:, 0].mean():.3f}, {F[:, 1].mean():.4f}; of the worst tenth {worst[0]:.3f}, "
            f"{worst[1]:.4f}"
        )
        for ax, j in zip(axes, (0, 1), strict=True):
            ax.hist(F[:, j], 60, histtype="stepfilled", color=colour, alpha=0.45, label=name)
            ax.axvline(worst[j], color=colour, linestyle="-" if name == "robust" else "--")
    for ax, label in zip(axes, ("f1, time", "f2, |W - D|"), strict=True):
        ax.set_xlabel(label)
        ax.set_ylabel(f"of {POINTS} scenarios")
    axes[0].legend(title="optimum; lines: worst tenth")
    figure.savefig(PICTURE, dpi=110)
    print(f"{PICTURE.name}: {PICTURE.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
