"""The chute's robust optimum compared with the nominal one: numbers and a picture.

    python -m benchmarks.robust

Friction and the initial speed are known only to a quarter and to a third, and the floor keeps its
speed to 0.1. The 4096 designs of PSI are searched twice: with all quantities at their medians, and
for the mean of the worst tenth of 64 scenarios. Both optima are then evaluated in 4096 other
scenarios.
"""

from __future__ import annotations

import time
from pathlib import Path

import matplotlib as mpl
import numpy as np
from scipy.stats import uniform

from benchmarks.machine import describe_machine, output, sized
from pymoo_psi import Robust, VectorizedSphereChute, investigate, lp_tau

mpl.use("Agg")
from matplotlib import pyplot as plt

PICTURE = output(Path(__file__).parent / "pictures" / "robust_chute.png")
POINTS = sized(4096, 128)
WITHIN = {
    "tolerances": {"x2": 0.1},
    "uncertainty": {"mu": uniform(0.3, 0.2), "c": uniform(0.2, 0.24)},
    "statistics": "cvar:0.9",
}


def chute(mu: float = 0.4, c: float = 0.32) -> VectorizedSphereChute:
    """Return the chute of a scenario."""
    return VectorizedSphereChute(mu, c=c)


def optimum(table) -> np.ndarray:
    """Return the design of the Salukvadze optimum, with plain distances as in the paper."""
    front = table.take(table.pareto())
    return front.X[table.under(normalize=False).ranking().salukvadze[0]]


def in_scenarios(design: np.ndarray) -> np.ndarray:
    """Return the (4096, 4) objectives of a design in other scenarios than those of the search."""
    # Later points of the sequence: none of the 64 scenarios is among them.
    u = lp_tau(POINTS, 3, first=POINTS + 1)
    rows = []
    for u_x2, u_mu, u_c in u:
        x = np.array([[design[0], design[1] + 0.2 * u_x2 - 0.1]])
        problem = chute(0.3 + 0.2 * u_mu, 0.2 + 0.24 * u_c)
        rows.append(problem.evaluate(x)[0])
    return np.vstack(rows)


def main() -> None:
    """Print both optima and draw their objectives in the scenarios."""
    print(describe_machine())
    problem = Robust(chute, **WITHIN)
    nominal = investigate(chute(), POINTS)
    began = time.perf_counter()
    robust = investigate(problem, POINTS)
    seconds = time.perf_counter() - began
    both = nominal.pareto() & robust.pareto()
    print(
        f"{POINTS} designs in 64 scenarios: {seconds:.1f} s; Pareto optimal: "
        f"{nominal.pareto().sum()} by the nominal objectives, {robust.pareto().sum()} by the "
        f"statistics, {both.sum()} by both"
    )
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for name, table, colour, line in (
        ("nominal", nominal, "#0072B2", "--"),
        ("robust", robust, "#D55E00", "-"),
    ):
        design = optimum(table)
        F = in_scenarios(design)
        mean = F.mean(axis=0)
        worst = np.sort(F, axis=0)[-POINTS // 10 :].mean(axis=0)
        print(
            f"{name} optimum: u1 = {design[0]:.4f}, u2 = {design[1]:.4f}; mean of f1, f2 "
            f"{mean[0]:.3f}, {mean[1]:.4f}; of the worst tenth {worst[0]:.3f}, {worst[1]:.4f}"
        )
        for j, ax in enumerate(axes):
            ax.hist(F[:, j], 60, histtype="stepfilled", color=colour, alpha=0.45, label=name)
            ax.axvline(worst[j], color=colour, linestyle=line)
    for ax, label in zip(axes, ("f1, time", "f2, |W - D|"), strict=True):
        ax.set_xlabel(label)
        ax.set_ylabel(f"of {POINTS} scenarios")
    axes[0].legend(title="optimum; lines: worst tenth")
    figure.savefig(PICTURE, dpi=110)
    print(f"{PICTURE.name}: {PICTURE.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
