"""How much a person regrets what :class:`pymoo_psi.Preferences` proposes after a few questions.

Usage:
    python -m benchmarks.questions [--people 100] [--set test|more|chosen]

Hidden people have weights, uniform on the simplex, and answer by their weighted distance, some of
them wrongly. The regret of a design is the share of the difference between the person's best and
median design that it loses. Fronts have at most 200 designs. Those of TEST and MORE were used for
nothing before: the constants of the method were chosen with those of CHOSEN and with random fronts.

For comparison: as many random pairs of designs with the same model of answers; weights that the
person states, each wrong by a factor between 1/2 and 2, in the best design of
:class:`pymoo_psi.CompromiseProgramming`; and COMET (``pip install pymcdm``), which asks about pairs
of made-up designs, three values an objective: 36 questions for two objectives, 351 for three.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks.comparison_problems import kept_reference
from benchmarks.machine import describe_machine, sized
from pymoo_psi import Preferences, lp_tau
from pymoo_psi.pareto import nondominated

try:
    from pymcdm.methods import COMET
    from pymcdm.methods.comet_tools import FunctionExpert
except ImportError:
    COMET = None

Array = NDArray[np.float64]

N_DESIGNS = sized(200, 30)
ASKED = sized((0, 1, 2, 3, 5, 8), (0, 1))
# The hidden norm, and the share of wrong answers.
CASES = ((2, 0.0), (2, 0.1), (1, 0.0), (np.inf, 0.0))
WORDS = {2: "p = 2", 1: "p = 1", np.inf: "p = ∞"}
CHOSEN = (
    "chute-full-0.2",
    "chute-rolling-0.6",
    "bnh",
    "osy",
    "welded_beam",
    "truss2d",
    "mw7",
    "zdt3",
    "dtlz7",
    "dtlz2",
)
REFERENCES = (
    "cre21",  # a truss of two bars
    "cre23",  # a disc brake
    "cre24",  # a speed reducer
    "cre31",  # a car in a side impact
    "cre32",  # a ship
    "cre51",  # water resources, five objectives
    "ten_bar_truss",
    "stepped_cantilever",
)
ANSWERS_SEED = 64


def crash(x: Array) -> Array:
    """Return mass, acceleration and intrusion of a car body (Liao et al., SMO 35, 2008)."""
    x1, x2, x3, x4, x5 = 1 + 2 * x.T
    mass = 1640.2823 + 2.3573285 * x1 + 2.3220035 * x2 + 4.5688768 * x3
    mass += 7.7213633 * x4 + 4.4559504 * x5
    acceleration = 6.5856 + 1.15 * x1 - 1.0427 * x2 + 0.9738 * x3 + 0.8364 * x4
    acceleration += -0.3695 * x1 * x4 + 0.0861 * x1 * x5 + 0.3628 * x2 * x4
    acceleration += -0.1106 * x1**2 - 0.3437 * x3**2 + 0.1764 * x4**2
    intrusion = -0.0551 + 0.0181 * x1 + 0.1024 * x2 + 0.0421 * x3 - 0.0073 * x1 * x2
    intrusion += 0.024 * x2 * x3 - 0.0118 * x2 * x4 - 0.0204 * x3 * x4 - 0.008 * x3 * x5
    intrusion += -0.0241 * x2**2 + 0.0109 * x4**2
    return np.column_stack([mass, acceleration, intrusion])


def injector(x: Array) -> Array:
    """Return two temperatures and the length of combustion of a rocket (Vaidyanathan, 2003)."""
    a, h, o, t = x.T
    face = 0.692 + 0.477 * a - 0.687 * h - 0.080 * o - 0.0650 * t - 0.167 * a**2
    face += -0.0129 * h * a + 0.0796 * h**2 - 0.0634 * o * a - 0.0257 * o * h + 0.0877 * o**2
    face += -0.0521 * t * a + 0.00156 * t * h + 0.00198 * t * o + 0.0184 * t**2
    length = 0.153 - 0.322 * a + 0.396 * h + 0.424 * o + 0.0226 * t + 0.175 * a**2
    length += 0.0185 * h * a - 0.0701 * h**2 - 0.251 * o * a + 0.179 * o * h + 0.0150 * o**2
    length += 0.0134 * t * a + 0.0296 * t * h + 0.0752 * t * o + 0.0192 * t**2
    tip = 0.370 - 0.205 * a + 0.0307 * h + 0.108 * o + 1.019 * t - 0.135 * a**2
    tip += 0.0141 * h * a + 0.0998 * h**2 + 0.208 * o * a - 0.0301 * o * h - 0.226 * o**2
    tip += 0.353 * t * a - 0.0497 * t * o - 0.423 * t**2 + 0.202 * h * a**2 - 0.281 * o * a**2
    tip += -0.342 * h**2 * a - 0.245 * h**2 * o + 0.281 * o**2 * h - 0.184 * t**2 * a
    tip += -0.281 * h * a * o
    return np.column_stack([face, length, tip])


FORMULAS: dict[str, tuple[int, Callable[[Array], Array]]] = {
    "crash": (5, crash),
    "injector": (4, injector),
}
TEST = (*REFERENCES, *FORMULAS)
MORE = tuple(f"rcm{k}" for k in (1, 2, 10, 12, 13, 14, 16, 18, 19, 21))  # parts of machines
SETS = {"test": TEST, "more": MORE, "chosen": CHOSEN}


def front_of(name: str) -> Array:
    """Return at most 200 Pareto-optimal designs, ranges from 0 to 1."""
    if name in FORMULAS:
        n_var, formula = FORMULAS[name]
        F = formula(lp_tau(4096, n_var))
    else:
        F = kept_reference(name).points
    F = F[nondominated(F)]
    F = F[np.random.default_rng(3).permutation(len(F))[:N_DESIGNS]]
    F = F[nondominated(F)]
    return (F - F.min(axis=0)) / np.ptp(F, axis=0)


def distances_of(F: Array, weights: Array, p: float) -> Array:
    """Return ``(people, designs)`` weighted distances from the best values, which are 0."""
    return np.linalg.norm(weights[:, None] * F, ord=p, axis=2)


class Questions:
    """The questions about a front after any answers, each computed once for all people."""

    def __init__(self, F: Array) -> None:
        self.person = Preferences(F)
        self.known: dict[tuple[tuple[int, int], ...], tuple[int, Any]] = {}

    def after(self, answers: tuple[tuple[int, int], ...]) -> tuple[int, Any]:
        """Return the proposal and the question after answers: pairs, the better design first."""
        if answers not in self.known:
            proposal = answered(self.person, answers)
            self.known[answers] = proposal, self.person.question()
        return self.known[answers]


def answered(person: Preferences, answers: tuple[tuple[int, int], ...]) -> int:
    """Return the proposal after these answers instead of those that were given."""
    while person.answers:
        person.take_back()
    for better, worse in answers:
        person.answer(better, worse)
    return int(person.best)


def dialogues(questions: Questions, distances: Array, wrong: Array, pairs: Array | None) -> Array:
    """Return ``(people, counts)`` designs that are proposed after numbers of questions.

    Args:
        questions: Those about the front.
        distances: ``(people, designs)`` the distances by which people answer.
        wrong: ``(people, questions)`` which answers are wrong.
        pairs: ``(people, questions, 2)`` the pairs to ask; those of the method unless given.
    """
    proposals = np.zeros((len(distances), max(ASKED) + 1), dtype=int)
    for k, values in enumerate(distances):
        answers: tuple[tuple[int, int], ...] = ()
        for n in range(max(ASKED) + 1):
            if pairs is None:
                proposals[k, n], pair = questions.after(answers)
            else:
                proposals[k, n] = answered(questions.person, answers)
                pair = pairs[k, n]
            if pair is None:
                proposals[k, n:] = proposals[k, n]
                break
            one, other = pair
            if (values[one] > values[other]) != wrong[k, n]:
                one, other = other, one
            answers = (*answers, (int(one), int(other)))
    return proposals[:, ASKED]


def comet(F: Array, distances: Callable[[Array], Array]) -> int:
    """Return the design that COMET proposes after all its questions about made-up designs."""

    def answer(one: Array, other: Array) -> float:
        of_one, of_other = distances(np.array([one, other]))
        return (np.sign(of_other - of_one) + 1) / 2

    levels = np.tile([0.0, 0.5, 1.0], (F.shape[1], 1))
    return int(COMET(levels, FunctionExpert(answer))(F).argmax())


def study(name: str, n_people: int) -> list[dict[str, Any]]:
    """Return the regret of each person, method, case and number of questions."""
    F = front_of(name)
    n, m = F.shape
    generator = np.random.default_rng(ANSWERS_SEED)
    weights = generator.dirichlet(np.ones(m), n_people)
    draws = generator.random((n_people, max(ASKED) + 1))
    pairs = generator.integers(n, size=(n_people, max(ASKED) + 1, 2))
    pairs[..., 1] = (pairs[..., 0] + 1 + pairs[..., 1] % (n - 1)) % n  # two different ones
    stated = weights * 2 ** generator.uniform(-1, 1, weights.shape)
    questions = Questions(F)
    rows = []
    for p, share in CASES:
        distances = distances_of(F, weights, p)
        least = distances.min(axis=1)
        stake = np.median(distances, axis=1) - least

        def keep(method: str, asked: Any, proposals: Array) -> None:
            lost = np.take_along_axis(distances, proposals[:, None], axis=1)[:, 0]  # noqa: B023
            regrets = (lost - least) / stake  # noqa: B023
            case = f"{WORDS[p]}, {share:.0%} wrong"  # noqa: B023
            for regret in regrets:
                rows.append(
                    {
                        "front": name,
                        "case": case,
                        "method": method,
                        "asked": asked,
                        "regret": regret,
                    }
                )

        wrong = draws < share
        for method, asked_pairs in (("questions", None), ("random pairs", pairs)):
            proposals = dialogues(questions, distances, wrong, asked_pairs)
            for asked, column in zip(ASKED, proposals.T, strict=True):
                keep(method, asked, column)
        if share == 0:
            keep("stated weights", "–", distances_of(F, stated, 2).argmin(axis=1))
            if COMET is not None and m <= 3:
                proposals = []
                for w in weights:
                    of = lambda made_up, w=w: distances_of(made_up, w[None], p)[0]  # noqa: E731, B023
                    proposals.append(comet(F, of))
                keep("COMET", 3**m * (3**m - 1) // 2, np.array(proposals))
    return rows


def table(frame: pd.DataFrame) -> list[str]:
    """Return the mean regrets with intervals of 95 %, as Markdown."""
    cases = frame["case"].unique()
    lines = [f"| method | questions | {' | '.join(cases)} |", "|---" * (len(cases) + 2) + "|"]
    for (method, asked), rows in frame.groupby(["method", "asked"], sort=False):
        cells = []
        for case in cases:
            of_case = rows[rows["case"] == case]
            if of_case.empty:
                cells.append("")
                continue
            fronts = of_case.groupby("front")["regret"]
            # The fronts are fixed, the people are drawn.
            error = np.sqrt((fronts.var() / fronts.count()).sum()) / fronts.ngroups
            cells.append(f"{fronts.mean().mean():.3f} ± {1.96 * error:.3f}")
        lines.append(f"| {method} | {asked} | {' | '.join(cells)} |")
    return lines


def main() -> None:
    """Print the regrets of all fronts together, and of each after five questions."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=sized(100, 2))
    parser.add_argument("--set", choices=[*SETS], default="test")
    options = parser.parse_args()
    names = SETS[options.set][: sized(None, 2)]
    rows = itertools.chain.from_iterable(study(name, options.people) for name in names)
    frame = pd.DataFrame(rows)
    print(describe_machine())
    print(f"{len(names)} fronts ({', '.join(names)}), {options.people} people each")
    print("\n".join(table(frame)))
    of_method = frame[frame["method"] == "questions"]
    last = of_method[of_method["asked"] == ASKED[-2]]
    means = last.pivot_table(index="front", columns="case", values="regret", sort=False)
    print(f"After {ASKED[-2]} questions:\n{means.round(3).to_string()}")


if __name__ == "__main__":
    main()
