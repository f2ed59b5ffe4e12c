"""How much a person regrets what :class:`pymoo_psi.Preferences` proposes after a few questions.

Usage:
    python -m benchmarks.questions [--people 100] [--set test|more] [--bounds]

Hidden people have weights, uniform on the simplex, and answer by their weighted distance. The
regret of a design is the share of the difference between the person's best and median design that
it loses. Wrong answers are not drawn: the regret is the mean over all sequences of right and wrong
ones, each with its probability. Fronts have at most 200 designs. Those of TEST and MORE were used
for nothing before: the constants of the method were chosen on ten others and on random fronts.

For comparison: as many random pairs of designs with the same model of answers, SERIES series of
them; weights that the person states, each wrong by a factor between 1/2 and 2, in the best design
of :class:`pymoo_psi.CompromiseProgramming`; and COMET (``pip install pymcdm``), which asks about
pairs of made-up designs, three values an objective: 36 questions for two objectives, 351 for three.

``--bounds`` prints how little anybody could regret who knows that people measure by p = 2 and give
one wrong answer in ten: by the pairs of the front, the best next one of all; and by any questions
at all, each of which may split the weights into any two sets, with the best design for each
sequence of answers. The last is a local optimum by the Lloyd algorithm, the best of RESTARTS; the
least regret may be lower still.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.random import Generator
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
WRONG = 0.1
CASES = ((2, 0.0), (2, WRONG), (1, 0.0), (np.inf, 0.0))
WORDS = {2: "p = 2", 1: "p = 1", np.inf: "p = ∞"}
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
SERIES = sized(5, 2)  # of random pairs
BOUNDED = sized((3, 5), (1,))  # numbers of answers
N_BOUND = sized(1024, 20)  # people
N_PAIRS = sized(4000, 20)
RESTARTS = sized(60, 2)


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
SETS = {"test": TEST, "more": MORE}


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


def regrets_of(F: Array, weights: Array, p: float) -> Array:
    """Return ``(people, designs)`` regrets: 0 of the best design, 1 of the median one."""
    distances = distances_of(F, weights, p)
    least = distances.min(axis=1, keepdims=True)
    return (distances - least) / (np.median(distances, axis=1, keepdims=True) - least)


class Dialogue:
    """All sequences of answers to the questions about a front, each asked once for all people.

    Attributes:
        depth: The most answers.
        nodes: For each sequence of answers, which says for each question whether its first design
            is preferred: the proposal and the next question, None if there is none.
    """

    def __init__(self, F: Array, depth: int, pairs: Sequence[tuple[int, int]] = ()) -> None:
        """Ask the questions of the method, or these pairs."""
        self.depth = depth
        self.nodes: dict[tuple[bool, ...], tuple[int, tuple[int, int] | None]] = {}
        self._person = Preferences(F)
        self._pairs = pairs
        self._visit(())

    def _visit(self, answers: tuple[bool, ...]) -> None:
        pair = None
        if len(answers) < self.depth:
            pair = self._person.question() if not self._pairs else self._pairs[len(answers)]
        self.nodes[answers] = self._person.best, pair
        if pair is None:
            return
        for is_first in (True, False):
            self._person.answer(*(pair if is_first else pair[::-1]))
            self._visit((*answers, is_first))
            self._person.undo()

    def regrets(self, regrets: Array, share: float) -> Array:
        """Return ``(people, depth + 1)`` expected regrets after 0, 1, 2, … answers.

        Args:
            regrets: ``(people, designs)`` the regret of each design, by which people answer.
            share: The probability that an answer is wrong.
        """
        expected = np.zeros((len(regrets), self.depth + 1))
        chances = {(): np.ones(len(regrets))}
        for answers, (proposal, pair) in self.nodes.items():  # each after what precedes it
            chance = chances[answers]
            asked = len(answers)
            if pair is None:  # the proposal stays
                expected[:, asked:] += (chance * regrets[:, proposal])[:, None]
                continue
            expected[:, asked] += chance * regrets[:, proposal]
            is_first = np.where(regrets[:, pair[0]] <= regrets[:, pair[1]], 1 - share, share)
            chances[(*answers, True)] = chance * is_first
            chances[(*answers, False)] = chance * (1 - is_first)
        return expected


def best_pairs(
    regrets: Array, share: float, depth: int, generator: Generator
) -> tuple[float, NDArray[np.intp]]:
    """Return the mean regret after answers of who knows their law, and what is proposed.

    Each question is the pair, of at most N_PAIRS, after whose answer the regret is the least.

    Args:
        regrets: ``(people, designs)`` those of people as likely as each other.
        share: The probability that an answer is wrong.
        depth: The number of answers.
        generator: Draws the pairs.

    Returns:
        The mean, and ``(2**depth,)`` designs, one for each sequence of answers.
    """
    pairs = np.transpose(np.triu_indices(regrets.shape[1], 1))
    one, other = generator.permutation(pairs)[:N_PAIRS].T
    is_first = np.unique((regrets[:, one] < regrets[:, other]).T, axis=0)
    chances_of_first = np.where(is_first, 1 - share, share)
    level = [np.full(len(regrets), 1 / len(regrets))]
    for _ in range(depth):
        following = []
        for chances in level:
            first = (chances_of_first * chances) @ regrets
            after = first.min(axis=1) + (chances @ regrets - first).min(axis=1)
            best = chances_of_first[after.argmin()]
            following += [chances * best, chances * (1 - best)]
        level = following
    losses = np.array(level) @ regrets
    return losses.min(axis=1).sum(), losses.argmin(axis=1)


def any_questions(
    regrets: Array, share: float, designs: NDArray[np.intp], generator: Generator
) -> float:
    """Return the least mean regret found after answers to questions of any kind.

    In turn, each person answers so that the expected regret is the least, and each sequence of
    answers gets the best design.

    Args:
        regrets: As for :func:`best_pairs`.
        share: As there.
        designs: Those to begin with, one for each sequence of answers.
        generator: Draws the changes of the designs with which this begins again.
    """
    least, designs = _least_regret(regrets, share, designs)
    n = len(designs)
    for _ in range(RESTARTS):
        changed = designs.copy()
        changed[generator.integers(n, size=3)] = designs[generator.integers(n, size=3)]
        mean, changed = _least_regret(regrets, share, changed)
        if mean < least:
            least, designs = mean, changed
    return least


def _least_regret(
    regrets: Array, share: float, designs: NDArray[np.intp]
) -> tuple[float, NDArray[np.intp]]:
    """Return a local optimum of the mean regret, and its designs."""
    n_people = len(regrets)
    means = [np.inf]
    while len(means) < 3 or means[-1] < means[-2] - 1e-6:
        expected = regrets[:, designs]
        choices = []
        while expected.shape[1] > 1:
            first, second = expected[:, ::2], expected[:, 1::2]
            choices.append(np.where(first <= second, 1 - share, share))
            expected = choices[-1] * first + (1 - choices[-1]) * second
        chances = np.ones((n_people, 1))
        for choice in reversed(choices):
            both = np.stack([chances * choice, chances * (1 - choice)], axis=2)
            chances = both.reshape(n_people, -1)
        losses = chances.T @ regrets / n_people
        designs = losses.argmin(axis=1)
        means.append(losses.min(axis=1).sum())
    return means[-1], designs


def comet(F: Array, distances: Callable[[Array], Array]) -> int:
    """Return the design that COMET proposes after all its questions about made-up designs."""

    def answer(one: Array, other: Array) -> float:
        of_one, of_other = distances(np.array([one, other]))
        return (np.sign(of_other - of_one) + 1) / 2

    levels = np.tile([0.0, 0.5, 1.0], (F.shape[1], 1))
    return int(COMET(levels, FunctionExpert(answer))(F).argmax())


def study(name: str, n_people: int, seed: int) -> list[dict[str, Any]]:
    """Return the regret of each person, method, case and number of questions."""
    F = front_of(name)
    n, m = F.shape
    generator = np.random.default_rng([ANSWERS_SEED, seed])
    weights = generator.dirichlet(np.ones(m), n_people)
    stated = weights * 2 ** generator.uniform(-1, 1, weights.shape)
    depth = max(ASKED)
    dialogues = {"questions": [Dialogue(F, depth)], "random pairs": []}
    for _ in range(SERIES):
        pairs = [tuple(generator.choice(n, 2, replace=False).tolist()) for _ in range(depth)]
        dialogues["random pairs"].append(Dialogue(F, depth, pairs))
    rows = []
    for p, share in CASES:
        regrets = regrets_of(F, weights, p)
        case = f"{WORDS[p]}, {share:.0%} wrong"

        def keep(method: str, asked: Any, values: Array) -> None:
            for value in values:
                rows.append(
                    {"front": name, "case": case, "method": method, "asked": asked, "regret": value}  # noqa: B023
                )

        for method, series in dialogues.items():
            means = np.mean([one.regrets(regrets, share) for one in series], axis=0)
            for asked in ASKED:
                keep(method, asked, means[:, asked])
        people = np.arange(n_people)
        if share == 0:
            keep("stated weights", "–", regrets[people, distances_of(F, stated, 2).argmin(axis=1)])
            if COMET is not None and m <= 3:
                proposals = []
                for w in weights:
                    of = lambda made_up, w=w: distances_of(made_up, w[None], p)[0]  # noqa: E731, B023
                    proposals.append(comet(F, of))
                keep("COMET", 3**m * (3**m - 1) // 2, regrets[people, proposals])
    return rows


def print_bounds(names: Sequence[str]) -> None:
    """Print for each front and in the mean how little anybody could regret."""
    rows = {}
    for seed, name in enumerate(names):
        F = front_of(name)
        generator = np.random.default_rng([ANSWERS_SEED, seed])
        regrets = regrets_of(F, generator.dirichlet(np.ones(F.shape[1]), N_BOUND), 2)
        row = {}
        for n in BOUNDED:
            by_pairs, designs = best_pairs(regrets, WRONG, n, generator)
            row[f"best pairs, {n}"] = by_pairs
            row[f"any questions, {n}"] = any_questions(regrets, WRONG, designs, generator)
        rows[name] = row
    frame = pd.DataFrame(rows).T
    frame.loc["mean"] = frame.mean()
    print(f"With {WRONG:.0%} wrong, after so many questions:\n{frame.round(3).to_string()}")


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
    parser.add_argument("--bounds", action="store_true")
    options = parser.parse_args()
    names = SETS[options.set][: sized(None, 2)]
    print(describe_machine())
    if options.bounds:
        print_bounds(names)
        return
    rows = []
    for seed, name in enumerate(names):
        rows += study(name, options.people, seed)
    frame = pd.DataFrame(rows)
    print(f"{len(names)} fronts ({', '.join(names)}), {options.people} people each")
    print("\n".join(table(frame)))
    of_method = frame[frame["method"] == "questions"]
    last = of_method[of_method["asked"] == ASKED[-2]]
    means = last.pivot_table(index="front", columns="case", values="regret", sort=False)
    print(f"After {ASKED[-2]} questions:\n{means.round(3).to_string()}")


if __name__ == "__main__":
    main()
