"""What results look like at the prompt: one short line, whatever their size."""

import numpy as np
import pytest
from scipy.stats import uniform

from pymoo_psi import (
    CompromiseProgramming,
    SalukvadzeOptimum,
    VectorizedSphereChute,
    chute,
    investigate,
    rank_of_efficiency,
    robustness,
)
from pymoo_psi.selection import compare_selectors

F = np.array([[0.0, 1.0], [0.3, 0.4], [0.6, 0.1], [1.0, 0.0], [1.0, 1.0]])
CIRCLE = np.array([[np.cos(t), np.sin(t)] for t in np.linspace(0, np.pi / 2, 6)])


def beam(load):
    return VectorizedSphereChute(load)


TABLE = investigate(VectorizedSphereChute(0.4, model="rolling"), 256)


@pytest.mark.parametrize(
    ("result", "shown"),
    [
        (
            rank_of_efficiency(F),
            "EfficiencyRanking(5 designs by 2 objectives: 4 Pareto optimal, the best in row 1)",
        ),
        (
            rank_of_efficiency(CIRCLE, normalize=False),
            "EfficiencyRanking(6 designs by 2 objectives: 6 Pareto optimal, the best in row 0, 1, 2, …)",
        ),
        (
            compare_selectors(F, {"a": SalukvadzeOptimum(), "b": CompromiseProgramming(2)}),
            "SelectorComparison(2 selectors, 5 designs: row 1 is chosen most often, by 2)",
        ),
    ],
)
def test_it_says_how_much_there_is_and_what_is_best(result, shown):
    assert repr(result) == shown


def test_counts_are_those_of_the_arrays():
    motion = chute.motion(np.linspace(0, 1, 50), 0.3)
    slips = int(np.isnan(motion.slip_end).sum())
    assert 0 < slips < 50
    assert (
        repr(motion) == f"Motion(50 designs: {50 - slips} roll at the exit, {slips} slip, 0 stall)"
    )
    limits = {"f1": 2.2}
    counts = f"256 tested, {TABLE.feasible(limits).sum()} feasible, {TABLE.pareto(limits).sum()} Pareto optimal"
    assert repr(TABLE.histogram("x1", limits=limits)) == f"Histogram(x1 in 10 bins: {counts})"
    assert repr(TABLE.dependence("f1", "x2", limits=limits)) == f"Dependence(f1 on x2: {counts})"


def test_a_trajectory_says_how_far_it_slips():
    path = chute.trajectory(0.2635, 0.1072, chute.ChuteParameters(mu=0.4), n=11)
    end = f"Trajectory(13 points to eta 1 at time {path.time[-1]:.4g}, slipping"
    assert repr(path) == f"{end} until eta {path.slip_end:.4g})"
    fast = chute.trajectory(0.3, 3.0, chute.ChuteParameters(mu=0.2), n=11)
    assert np.isnan(fast.slip_end)
    assert repr(fast).endswith("slipping to there)")


def test_a_sphere_that_stalls_is_counted():
    motion = chute.motion([0.05, 0.5], 0.1, chute.ChuteParameters(mu=0.2, omega0=(0, -30, 0)))
    assert (motion.reached < 1).sum() == 1
    assert "1 stall)" in repr(motion)


def test_robustness_names_its_parameters():
    result = robustness(
        beam, [[0.2, 0.1], [0.3, 0.1]], uncertainty={"load": uniform(0.3, 0.2)}, n_scenarios=8
    )
    share = result.optimum_share.max()
    assert repr(result).startswith("Robustness(2 designs in 8 scenarios of load: row ")
    assert repr(result).endswith(f"is the optimum in {100 * share:.3g} %)")
