"""The advice and its cautions on sets of every shape are what a specialist would say."""

import re

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pymoo.problems import get_problem

from pymoo_psi import (
    acceptability,
    cautions,
    explain,
    investigate,
    lp_tau,
    rank_of_efficiency,
)
from tests.helpers.refusals import refused
from tests.pareto.test_objectives import PUBLISHED, published

X = np.linspace(0, 1, 101)


def kinds(F, **options):
    return [caution.kind for caution in cautions(rank_of_efficiency(F, **options))]


def said(F, kind, **options):
    (caution,) = [c for c in cautions(rank_of_efficiency(F, **options)) if c.kind == kind]
    return str(caution)


def bulging(p, m=2, n=101):
    """Points with sum f^p = 1: convex below p = 1, straight at 1, a sphere at 2."""
    if m == 2:
        return np.column_stack([X, np.maximum(1 - X**p, 0) ** (1 / p)])
    shares = lp_tau(n, m, first=2) + 1e-3
    corners = np.eye(m) if p >= 1 else np.empty((0, m))  # farther out than the others, if convex
    return np.vstack([corners, shares / shares.sum(axis=1, keepdims=True)]) ** (1 / p)


@pytest.mark.parametrize(
    "F", [*(bulging(0.6, m, 400) for m in (2, 3, 5, 10)), bulging(0.6)[(X < 0.3) | (X > 0.7)]]
)
def test_a_convex_set_has_a_clear_compromise(F):
    """The middle, or one of two pieces, is much nearer to the ideal than anything else."""
    assert kinds(F) == []
    assert explain(F).shares.max() < 0.35


def test_fixed_ranges_do_not_make_the_best_the_worst():
    """Neither is a value the worst, nor the best, as all are within 1 % of a wide range."""
    assert explain(rank_of_efficiency(WITHIN, **WIDE)).best_in == ["f1"]


def test_a_single_peak_is_no_repetition_of_a_constant():
    """Though they differ by less than 4 % in the root mean square."""
    x = np.linspace(0, 1, 701)
    F = np.column_stack([np.full(701, 3.0), x, (1 - x) ** 2, np.zeros(701)])
    F[rank_of_efficiency(F).salukvadze, 3] = 1
    assert "redundant" not in kinds(F)
    assert "f2 and f5 are nearly the same" in said(np.column_stack([F, x]), "redundant")


CODES = [[0.96, 66], [0.05, 29], [9999, 89], [9999, 83], [0.23, 56], [0.48, 24]]
# Each is dominated by the one before only, the last by usual designs.
HIDDEN = np.column_stack([np.linspace(-2, -1.99997, 30), np.linspace(1000, 1000.029, 30)])
# Places 2 and 3 are worse than the proposal in its bad value, or the worst in another one.
BAD = [[0.01, 0.995], [0.005, 0.998], [0, 1], [1, 0], [0.85, 0.94], [0.88, 0.92], [0.9, 0.9]]


@pytest.mark.parametrize(
    ("kind", "F", "options", "text"),
    [
        ("suspect", CODES, {"maximize": [1]}, "Design 2 and design 3: 9999 in f1, where all others have 0.05 to 0.96. "),
        # Without the first alone, the second one would take its place.
        ("outlier", CODES, {"maximize": [1]}, "2 and design 3, design 4 is proposed"),
        ("outlier", np.vstack([bulging(1), HIDDEN, [[0.5, 2000.0]]]), {}, "because of design 101, design 102, design 103 and 27 more alone"),
        ("extreme", [*BAD, [0.92, 0.88], [0.94, 0.85]], {}, "Compare place 5, design 4."),
    ],
)  # fmt: skip
def test_a_caution_names_the_designs_it_is_about(kind, F, options, text):
    assert text in said(F, kind, **options)


SHAPES = ("convex", "concave", "straight", "in pieces", "in clusters")


def random_front(shape, rng):
    """10 to 300 designs of 2 to 6 objectives in units of their own."""
    m = rng.integers(2, 7)
    shares = rng.dirichlet(np.full(m, rng.choice([0.5, 1, 2])), rng.integers(10, 301))
    if shape == "in clusters":
        centres = rng.dirichlet(np.ones(m), rng.integers(2, 5))
        shares = np.abs(centres[rng.integers(len(centres), size=len(shares))])
        shares = shares + np.abs(rng.normal(0, 0.01, shares.shape))
        shares /= shares.sum(axis=1, keepdims=True)
    if shape == "in pieces":
        shares = shares[(4 * shares[:, 0] % 2 < 1) | (np.arange(len(shares)) < 10)]
    p = {"convex": rng.uniform(0.5, 0.9), "concave": rng.uniform(1.5, 4)}.get(shape, 1)
    units = 10 ** rng.uniform(-2, 4, m)
    return shares ** (1 / p) * units + rng.choice([0, 1, -3, 50], m) * units


@pytest.mark.parametrize("shape", SHAPES)
def test_of_random_fronts_only_penalties_are_suspect(shape, draws):
    """Two to a tenth of the designs have penalties near 1e6; each is the best elsewhere."""
    for seed in draws(20):
        rng = np.random.default_rng(seed)
        F = random_front(shape, rng)
        assert not {"suspect", "decades"}.intersection(kinds(F))
        n = max(2, len(F) // 10)
        low = F.min(axis=0)
        width = np.ptp(F, axis=0)
        penalised = F[rng.integers(len(F), size=n)]
        penalised[:, 0] = low[0] - width[0] * np.linspace(0.01, 0.05, n)
        penalised[:, 1] = low[1] + width[1] * np.sort(rng.uniform(1e6, 1.1e6, n))
        found = cautions(np.vstack([F, penalised]))
        names = f"Design {len(F)}, design {len(F) + 1}" if n > 2 else f"Design {len(F)} and"
        assert found[0].kind == "suspect"
        assert found[0].sentence.startswith(names)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_outliers_are_noticed_however_many(n):
    """The optimum without them is named, also if they dominate some or hide behind another."""
    clean = np.column_stack([X, (1 - X) ** 2])
    (optimum,) = rank_of_efficiency(clean).salukvadze
    far = np.column_stack([-0.01 * np.arange(1, n + 1), 1000 + np.arange(n)])
    for bad in (far, np.vstack([far, far + np.array([1e-3, 1])])):
        found = {caution.kind: caution.sentence for caution in cautions(np.vstack([clean, bad]))}
        assert "1000" in found["suspect"]
        assert f"design {optimum} is proposed" in found["outlier"]


def test_an_objective_over_decades_gets_its_logarithm():
    """The column to compute is written out; with it the named design is the optimum."""
    x = lp_tau(60, 2, first=2)[:, 0]
    frame = pd.DataFrame({"cost `life`": 10 ** (2 + 6 * x), "f2": (1 - x) ** 0.8})
    text = said(frame, "decades")
    assert "compute 'log_cost `life`=log10(`cost ``life```)'" in text
    by_logarithm = frame.assign(**{"cost `life`": 2 + 6 * x})
    assert f"design {rank_of_efficiency(by_logarithm).salukvadze[0]} is proposed" in text
    assert "decades" not in kinds(by_logarithm)


@pytest.mark.parametrize("noise", [0, 0.01])
def test_an_objective_listed_twice_is_named_if_it_counts(noise, draws):
    """The optimum without it is that of the set before."""
    for seed in draws(40):
        rng = np.random.default_rng(seed)
        F = random_front(SHAPES[seed % len(SHAPES)], rng)
        m = F.shape[1]
        once = rank_of_efficiency(F).salukvadze
        again = F[:, -1] + noise * np.ptp(F[:, -1]) * rng.normal(size=len(F))
        twice = np.column_stack([F, 7 + 2 * again])
        is_moved = not np.isin(once, rank_of_efficiency(twice).salukvadze).any()
        named = [str(one) for one in cautions(twice) if one.kind == "redundant"]
        expected = (
            f"f{m} and f{m + 1} are nearly the same, and count several times. "
            f"Without f{m + 1}, design {once[0]} is proposed."
        )
        assert [text[: len(expected)] for text in named] == [expected] * is_moved


VALLEY = np.column_stack([3 + X[::4], 5 + (1 - X[::4]) ** 2])


@pytest.mark.parametrize(
    "bad",
    [[mark, other] for mark in (-9999.0, -99999.0, -1e30, -1.0, -4000.0) for other in (mark, 5.1)],
)
@pytest.mark.parametrize("dominated", [0, 1])
def test_a_mark_of_failure_that_wins_leads_all_cautions(bad, dominated):
    """In all objectives it dominates the others, in one of them it is an end of the set."""
    F = np.vstack([VALLEY, np.full((dominated, 2), 1e30), [bad]])  # what loses is no harm
    first = cautions(F)[0]
    assert first.kind == "suspect"
    assert first.sentence.startswith(f"Design {len(F) - 1}")


def test_of_unlike_designs_the_one_that_no_other_dominates_is_named_first():
    F = np.vstack([np.full((4, 2), 1e6), VALLEY, [[1e6, -0.1]]])
    assert said(F, "suspect").startswith(f"Design {len(F) - 1}, design 0, ")


FRONT = np.column_stack([[0, 1, 2, 1e6], [3.0, 2, 1, 0]])
DECADES = np.array([[1.0, 10], [2, 6], [48, 5], [2500, 0]])
CIRCLE = [[0.0, 10], [6, 8], [10, 0]]
YIELDS = pd.DataFrame({"cost": [1.0, 2.0], "yield": [-1.0, 0.0]})
ENDS = {"ideal": [0.0, 0.0], "nadir": [128.0, 128.0]}
FAR = np.vstack([np.column_stack([X, (1 - X) ** 2]), [[-1.0, 1.5]]])


def against_its_row(values):
    return np.column_stack([values, -np.arange(len(values))])


# All values are within 1 % of a wide range.
WITHIN = [[1, 5, 5, 7], [2, 0, 9, 7], [3, 9, 0, 7]]
WIDE = {"ideal": [0, 0, 0, 0], "nadir": [1000, 10, 10, 10]}


@pytest.mark.parametrize(
    ("kind", "F", "options", "is_given"),
    [
        # On a sphere around the ideal all designs tie; which comes first means nothing.
        *(("equidistant", bulging(2, m, 91), {}, True) for m in (2, 3, 5, 10)),
        *(("tie", bulging(2, m, 91), {}, False) for m in (2, 3, 5, 10)),
        # Farther out than a sphere the corners are nearest, all at distance 1: no compromise.
        *((kind, bulging(4, m, 200), {}, True) for kind in ("extreme", "tie") for m in (2, 3, 10)),
        ("extreme", WITHIN, WIDE, False),
        # Where m - 1 objectives can be bad at once (inverted DTLZ1) the least distance is flat.
        *(("near tie", 1 - bulging(1, m, 400), {}, True) for m in (3, 5)),
        # ZDT3: the next piece across the gap is as near within half a percent.
        ("near tie", np.column_stack([X, 1 - np.sqrt(X) - X * np.sin(10 * np.pi * X)]), {}, True),
        # A value is suspect ten ranges away,
        ("suspect", against_its_row([0, 1, 2, 3, 4, 44]), {}, False),
        ("suspect", against_its_row([0, 1, 2, 3, 4, 44.1]), {}, True),
        # farther than the others, in logarithms,
        ("suspect", against_its_row([1, 2, 4, 8, 16, 256]), {}, False),
        ("suspect", against_its_row([1, 2, 4, 8, 16, 257]), {}, True),
        # as a mark a range away, of which 1e20 is the least.
        ("suspect", against_its_row([1, 2000, 3000, 5000, 9999]), {}, False),
        ("suspect", against_its_row([1, 2000, 3000, 4999, 9999]), {}, True),
        ("suspect", against_its_row([3e19, 4e19, 5e19, 6e19, 9.99e19]), {}, False),
        ("suspect", against_its_row([3e19, 4e19, 5e19, 6e19, 1e20]), {}, True),
        ("suspect", -np.vstack([VALLEY, [-9999.0, 5.1]]), {"maximize": [0, 1]}, True),
        # Four optimal designs do not show what is usual; those that would be optimal without them may.
        ("suspect", FRONT, {}, False),
        ("suspect", np.vstack([FRONT, [1.5, 2.5]]), {}, True),
        ("suspect", np.vstack([FRONT, np.linspace([2e5, 2.9], [9e5, 1.1], 8)]), {}, False),
        # A hundred times the median, and three quarters in a tenth of the range; 0 has no logarithm.
        ("decades", DECADES, {}, True),
        ("decades", np.minimum(DECADES, 2499), {}, False),
        ("decades", np.vstack([DECADES, [300, 1]]), {}, False),
        ("decades", DECADES - [1, 0], {}, False),
        # Beyond a tenth of a range; near ties end at a hundredth of the distance.
        ("tie", [[0.0, 10], [1, 2], [2, 1], [10, 0]], {}, False),
        ("tie", [[0.0, 10], [1, 3], [3, 1], [10, 0]], {}, True),
        ("near tie", [[28.0, 96], [99, 20]], ENDS, True),
        ("near tie", [[28.0, 96], [99.01, 20]], ENDS, False),
        # Two designs in two objectives are the ends of each range, and so equally far; of three
        # objectives the one that is worse in two of them is farther.
        ("tie", [[1.0, 2.0]], {}, False),
        ("tie", [[1.0, 2.0], [1.0, 2.0]], {}, False),
        ("tie", [[1.0, 2.0], [2.0, 1.0]], {}, True),
        ("tie", [[1.0, 2.0, 2.0], [2.0, 1.0, 1.0]], {}, False),
        # Equal for all designs that no other dominates.
        ("constant", np.insert(CIRCLE, 1, 3.0, axis=1), {}, True),
        ("constant", CIRCLE, {}, False),
        # More than half of them.
        ("equidistant", CIRCLE, {}, True),
        ("equidistant", [*CIRCLE, [2, 9.95], [7, 7.9], [8, 7]], {}, False),
        # A range without one design; a point that is given stays where the design goes.
        ("outlier", [[7.0, 12], [10, 9], [13, 7], [16, 6], [17, 7]], {}, True),
        ("outlier", FAR, {"normalize": False}, True),
        ("outlier", FAR, {"normalize": False, "ideal": [-1.5, -1]}, False),
        ("outlier", FAR, {"nadir": [0.5, 0.5]}, False),
        # Nowhere above 0.
        ("sign", YIELDS, {"maximize": ["yield"]}, True),
        ("sign", YIELDS + 7, {"maximize": ["yield"]}, False),
        ("sign", YIELDS, {}, False),
    ],
)
def test_a_caution_is_given_beyond_its_limit_only(kind, F, options, is_given):
    assert (kind in kinds(F, **options)) == is_given


def test_no_false_alarm_of_values(draws):
    """Published sets, tests of pymoo's problems, and random sets."""
    sets = [F for name in PUBLISHED for F in published(name)]
    for name in (
        "zdt1",
        "zdt2",
        "zdt3",
        "zdt6",
        "kursawe",
        "dtlz1",
        "dtlz2",
        "dtlz7",
        "bnh",
        "osy",
    ):
        tests = investigate(get_problem(name), 512, first=2)
        sets += [tests.F[:n] for n in (16, 64, 512)]
    rng = np.random.default_rng(0)
    for _ in draws(60):
        shape = rng.integers(3, 200), rng.integers(1, 6)
        sets += [rng.normal(size=shape), np.round(9 * rng.random(shape))]
    of_values = {"suspect", "sign"}  # whatever the ranking makes of them
    assert not [F for F in sets if of_values & {*kinds(F)}]


def test_a_ranking_has_the_directions_of_its_objectives():
    ranking = rank_of_efficiency([[1.0, 2.0]])
    refused("maximize must be left out where a table or ranking", cautions, ranking, maximize=[0])


def moved_without(F, i):
    """By what share of a range the optimum moves when a row is left out, ranked by the library."""
    before = F[rank_of_efficiency(F).salukvadze]
    rest = np.delete(F, i, axis=0)
    ranking = rank_of_efficiency(rest)
    lengths = np.ptp(rest[ranking.pareto], axis=0)
    lengths[lengths == 0] = np.inf
    after = rest[ranking.salukvadze]
    return float((np.abs(after[:, None] - before) / lengths).max(axis=2).min())


# The first design, once left out, frees the second.
@example(F=np.array([[6.0, 0], [6, 1], [0, 6], [2, 3], [1, 5]]))
# The optimum is the best in the first objective.
@example(F=np.array([[0.0, 1, 1], [6, 0, 3], [3, 6, 0], [5, 5, 1]]))
@given(
    F=arrays(
        float,
        st.tuples(st.integers(3, 9), st.integers(2, 3)),
        elements=st.integers(0, 30).map(float),
    )
)
def test_leaving_out_every_single_design_finds_the_same(F):
    """Among them dominated ones, which move nothing, and those that free what they dominate."""
    # Without the dominated designs beyond N, which are looked for at the ends only.
    F = F[(rank_of_efficiency(F).nadir >= F).all(axis=1)]
    ranking = rank_of_efficiency(F)
    found = {caution.kind for caution in cautions(ranking)}
    assume("equidistant" not in found)
    others = [i for i in range(len(F)) if i not in ranking.salukvadze]
    most = max((moved_without(F, i) for i in others), default=0.0)
    if abs(most - 0.1) > 1e-9 and ranking.pareto.sum() > 1:
        assert bool(found & {"outlier", "unstable"}) == (most > 0.1)


def test_another_design_is_best_for_more_weights():
    F = pd.DataFrame({"f1": [0, 0.05, 0.6, 1], "f2": [1, 0.9, 0.6, 0]}, index=list("LABR"))
    shares = 100 * acceptability(F, factor=2)[:, 0]
    expected = f"B is the best in {shares[2]:.0f} % .* A in {shares[1]:.0f} %"
    assert re.search(expected, said(F, "weights"))
