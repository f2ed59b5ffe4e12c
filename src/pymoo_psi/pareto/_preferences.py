"""Preferences: a few questions find the design that a person wants.

Nobody likes to state weights, but anyone can say which of two designs they would rather have. The
value of a design is its weighted distance to the ideal point. Weights are spread over the simplex,
and each has the probability that the answers give it. An answer is right with a logistic chance of
the difference in value, so that a wrong one costs something and ruins nothing. The next question is
the pair of designs after whose answer the proposal is expected to be regretted least.

The weights that fit comparisons are those of UTA (Jacquet-Lagrèze and Siskos, European Journal of
Operational Research 10, 1982) and of robust ordinal regression (Greco, Mousseau and Słowiński,
European Journal of Operational Research 191, 2008). Asking what the proposal gains most from is
Bayesian preference exploration (Lin, Astudillo, Frazier and Bakshy, AISTATS 2022).

The decision page computes the same numbers by the same steps: whatever differs by rounding only
counts as equal, and of equal ones the first is taken.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._numbers import percent, percents
from pymoo_psi._output import Shown
from pymoo_psi._validation import Array, Rows, counted, invalid
from pymoo_psi.pareto._acceptability import (
    nearest_designs,
    require_norm,
    simplex_weights,
    weighted_distances,
    weighted_terms,
)
from pymoo_psi.pareto._cautions import originals
from pymoo_psi.pareto._dominance import first_equal
from pymoo_psi.pareto._explanation import TIE, by_size, compare_designs
from pymoo_psi.pareto._ranking import EfficiencyRanking, rank_of_efficiency, with_units
from pymoo_psi.pareto._sentences import sentence, wrapped

if TYPE_CHECKING:
    import pandas as pd

RELATIONS = (">", "=", "?")
"""Of two designs the first is preferred, both are equally good, or the question is skipped."""

N_WEIGHTS = 1024
# A person may mean another norm than the assumed one: an eighth of the weights measures by each.
_ORDERS = (1.0, 2.0, np.inf)
N_OTHERS = 128
N_AVERAGED = 128  # designs of whose distances the average is taken
N_LIKELIEST = 256  # designs among which the proposal after an answer is looked for
N_ASKED = 12  # designs of which pairs are asked
SHARPNESS = 30.0  # a difference of a twentieth of what is at stake is told by a chance of 95 %
MISTAKES = 0.15  # the share of answers that have nothing to do with the values
VISIBLE = 0.01  # the least difference in two objectives that people can weigh, in ranges
CERTAIN = 0.9  # an answer of this probability is not asked for
ENOUGH = 0.01  # the expected regret at which the questions end


class Preferences(Shown):
    """What answers to questions say about the designs of a Pareto set.

    The value of a design for some weights is linear in the weighted distance of
    :class:`pymoo_psi.CompromiseProgramming`: 1 for the best design, 0 for the average distance of
    the Pareto set. The proposal has the greatest expected value of the designs that no answer puts
    below another one, directly or through others. Where answers contradict each other, as of three
    designs each is preferred to the next in a circle, none of these is below another. The expected
    regret of the proposal is what its value lacks of 1. An objective that nearly repeats an earlier
    one has no weight of its own, so that nothing counts twice.

    Args:
        F: ``(n, m)`` objective values, or anything else that :func:`pymoo_psi.rank_of_efficiency`
            accepts: a test table, a frame, a result of pymoo, a ranking.
        p: Order of the norm that is assumed, from 1 to 32, or ``numpy.inf``. One of eight
            persons is expected to measure by each other one of 1, 2 and infinity.
        factor: Only weights between 1 / factor and factor times equal ones; all unless given.
        normalize: As for :func:`pymoo_psi.rank_of_efficiency`.
        maximize: As for :func:`pymoo_psi.rank_of_efficiency`.

    Attributes:
        ranking: The ranking of the designs.

    Raises:
        ArgumentValueError: ``F`` does not fit, or another argument is out of its range.

    Example:
        >>> F = [[0.0, 1.0], [0.1, 0.6], [0.4, 0.3], [0.8, 0.1], [1.0, 0.0]]
        >>> person = Preferences(F)
        >>> person.best, person.question()
        (2, (2, 1))
        >>> person.answer(1, 2)
        >>> person.best, round(person.regret, 2)
        (1, 0.13)
    """

    def __init__(
        self,
        F: Any,
        *,
        p: float = 2,
        factor: float | None = None,
        normalize: bool | None = None,
        maximize: Collection[Any] = (),
    ) -> None:
        require_norm(p, factor)
        self.ranking: EfficiencyRanking = rank_of_efficiency(
            F, normalize=normalize, maximize=maximize
        )
        # The probabilities of the weights after 0, 1, 2, … answers, which are about rows.
        self._chances = [np.full(N_WEIGHTS, 1 / N_WEIGHTS)]
        self._answers: list[tuple[int, str, int]] = []
        self._front: Rows = self.ranking.front
        terms, weighted = weighted_terms(self.ranking)
        terms = terms[:, weighted]
        # The distances from the best values in units of the ranges, of which people see a part.
        self._steps: Array = (terms - terms.min(axis=0)) / np.maximum(np.ptp(terms, axis=0), 1e-300)
        has_weight = originals(self._steps) == np.arange(len(weighted))
        self._weighted: Rows = weighted[has_weight]
        self._terms: Array = terms[:, has_weight]
        self._weights = _weights_by_order(p, len(self._weighted), factor)
        self._rows: Rows = self._front[_best_for_some(self._terms, self._weights)]
        self._least = self._distances(self._rows).min(axis=1, keepdims=True)
        some = self._front[:: -(-len(self._front) // N_AVERAGED)]
        average = self._distances(some).mean(axis=1, keepdims=True)
        self._stake = np.maximum(average - self._least, 1e-12)
        self._values = self._values_of(self._rows)
        self._winners: Rows = (self._values >= 1 - TIE).argmax(axis=1)

    def _distances(self, rows: Rows | list[int]) -> Array:
        """``(n_weights, k)`` weighted distances of Pareto-optimal designs."""
        terms = self._terms[np.searchsorted(self._front, rows)].T
        blocks = []
        for p, weights in self._weights.items():
            if np.isinf(p):
                blocks.append(weighted_distances(terms, weights, p))
            else:
                blocks.append(weighted_distances(terms**p, weights**p, p) ** (1 / p))
        return np.concatenate(blocks)

    def _values_of(self, rows: Rows | list[int]) -> Array:
        """``(n_weights, k)`` values of Pareto-optimal designs: 1 the best one, 0 the average."""
        return np.asarray(1 - (self._distances(rows) - self._least) / self._stake)

    # What the answers say

    @property
    def answers(self) -> list[tuple[Any, str, Any]]:
        """The answers so far, each with two designs.

        Between them is ">" if the first is preferred, "=" if they are equally good, "?" if the
        question was skipped.
        """
        return [(self._name(a), relation, self._name(b)) for a, relation, b in self._answers]

    @property
    def _preferred(self) -> list[tuple[int, int]]:
        """The rows of the designs of which an answer prefers the first to the second."""
        return [(one, other) for one, relation, other in self._answers if relation == ">"]

    def _proposals(self) -> tuple[Rows, Array]:
        """Return the rows of what can be proposed, and the values; an answer may prefer others."""
        preferred = [one for one, _ in self._preferred]
        rows = np.array([*dict.fromkeys([*self._rows.tolist(), *preferred])])
        others = rows[len(self._rows) :]
        return rows, np.hstack([self._values, self._values_of(others)])

    def _proposed(self) -> tuple[int, float]:
        """Return the row of the proposal, and its expected value."""
        rows, values = self._proposals()
        expected = _of_unbeaten(self._chances[-1] @ values, rows, self._preferred)
        best = int((expected >= expected.max() - TIE).argmax())
        return int(rows[best]), float(expected[best])

    @property
    def row(self) -> int:
        """The row in the ranking of the design that is proposed."""
        return self._proposed()[0]

    @property
    def best(self) -> Any:
        """The design that is proposed, as :meth:`question` names it."""
        return self._name(self.row)

    @property
    def regret(self) -> float:
        """The expected regret of the proposal; 1 is that of the average distance.

        It is more than 1 if no weights explain the answers: the design that they prefer is farther
        from the best values than an average one.
        """
        return max(1 - self._proposed()[1], 0.0)

    @property
    def shares(self) -> Array:
        """``(n,)`` the probability that each design is the best for this person.

        Of equal designs the first one has it.
        """
        winners = self._rows[self._winners]
        shares = np.bincount(winners, self._chances[-1], len(self.ranking.pareto))
        return np.asarray(shares, dtype=float)

    @property
    def weights(self) -> pd.DataFrame:
        """The mean weight of each objective, and an interval that holds it with 90 %.

        The weight is 0 for an objective that is equal for all Pareto-optimal designs, or nearly
        repeats an earlier one.

        Example:
            >>> person = Preferences([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]])
            >>> person.answer(0, 1)
            >>> print(person.weights.round(1))
                mean  lower  upper
            f1   0.8    0.2    1.0
            f2   0.2    0.0    0.8
        """
        import pandas as pd

        chances = self._chances[-1]
        columns = np.concatenate([*self._weights.values()]).T
        rows = np.zeros((len(self.ranking.objectives.names), 3))
        for j, column in zip(self._weighted, columns, strict=True):
            order = column.argsort(kind="stable")
            ends = np.searchsorted(chances[order].cumsum(), [0.05, 0.95])
            rows[j] = [chances @ column, *column[order[ends]]]
        return pd.DataFrame(rows, list(self.ranking.objectives.names), ["mean", "lower", "upper"])

    def to_frame(self) -> pd.DataFrame:
        """Return the designs that can be proposed, the most probable ones first.

        Returns:
            Index: the designs. Columns: the objectives, and ``share``, the probability that it is
            the best one for this person.

        Example:
            >>> print(Preferences([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]]).to_frame().round(2))
                f1   f2  share
            1  0.3  0.4   0.44
            2  1.0  0.0   0.30
            0  0.0  1.0   0.25
        """
        import pandas as pd

        objectives = self.ranking.objectives
        rows, _ = self._proposals()
        names = list(map(self._name, rows))
        frame = pd.DataFrame(objectives.values[rows], names, list(objectives.names))
        frame["share"] = self.shares[rows]
        return frame.sort_values("share", ascending=False, kind="stable")

    @property
    def sentences(self) -> tuple[str, ...]:
        """What is proposed, how sure that is, what answers give up, and why questions end.

        Example:
            >>> person = Preferences([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]])
            >>> person.answer(0, 1)
            >>> print(person)
            Proposed after 1 answer: design 0, the best for this person with a probability of
            80 %. The expected loss is 35 % of the difference between this person's best
            design and an average one.
            Design 0 rather than design 1: you give up 0.6 of f2 for 0.3 of f1.
        """
        n_answers = sum(relation != "?" for _, relation, _ in self._answers)
        name = "preferred" if n_answers else "unanswered"
        proposed = sentence(
            name,
            design=self.ranking.name_of(self.row),
            answers=counted(n_answers, "answer"),
            share=percents(self.shares)[self.row],
            regret=percent(self.regret, self.ranking.objectives.decimal),
        )
        texts = [proposed, *self.trades()]
        if self.regret < ENOUGH:
            texts.append(sentence("enough"))
        elif self.question() is None:
            texts.append(sentence("none left"))
        return tuple(texts)

    def trades(self, units: Mapping[Any, str] | None = None) -> tuple[str, ...]:
        """Return what each answer gives up for what.

        Args:
            units: Units of objectives by name; by default those of a test table.

        Example:
            >>> person = Preferences([[0.0, 1.0], [0.3, 0.4], [1.0, 0.0]])
            >>> person.equal(0, 1)
            >>> person.trades()
            ('Design 0 is as good as design 1: you would give up 0.6 of f2 for 0.3 of f1.',)
        """
        ranking = with_units(self.ranking, units)
        sentences = []
        for one, relation, other in self._answers:
            pair = compare_designs(ranking, rows=[other, one])
            if relation in _TRADES and pair.gains.min() < 0 < pair.gains.max():
                better, worse = pair.amounts(1)
                sentences.append(pair.sentence(_TRADES[relation], 1, better=better, worse=worse))
        return tuple(sentences)

    def __repr__(self) -> str:
        """Return :attr:`sentences`, wrapped at 80 columns."""
        return wrapped(self.sentences)

    # Questions and answers

    def question(self) -> tuple[Any, Any] | None:
        """Return the two designs whose comparison is expected to help most.

        None is left if the expected regret is below a hundredth, or if no pair is left that differs
        visibly in two objectives, was not asked, and whose answer is not certain.

        Returns:
            Two designs, as :meth:`answer` takes them: rows of an array, names of a table or frame.
        """
        if self.regret < ENOUGH:
            return None
        chances = self._chances[-1]
        preferred = self._preferred
        rows, values = self._likeliest()
        expected = chances @ values
        question = None
        most = -np.inf
        for a, b in combinations(range(min(N_ASKED, len(rows))), 2):
            if not self._can_be_asked(rows[[a, b]]):
                continue
            prefers = chances * _chance(values[:, a], values[:, b])
            if not 1 - CERTAIN < prefers.sum() < CERTAIN:
                continue
            in_favour = prefers @ values
            one, other = rows[[a, b]].tolist()
            after = _of_unbeaten(in_favour, rows, [*preferred, (one, other)]).max()
            after += _of_unbeaten(expected - in_favour, rows, [*preferred, (other, one)]).max()
            if after > most + TIE:
                most = after
                question = self._name(one), self._name(other)
        return question

    def _likeliest(self) -> tuple[Rows, Array]:
        """Return the rows and values of what is probably the best, the proposal in any case."""
        rows, values = self._proposals()
        likely = np.bincount(self._winners, self._chances[-1], len(rows))
        likely[rows == self.row] += 1
        likeliest = by_size(likely)[:N_LIKELIEST]
        return rows[likeliest], values[:, likeliest]

    def _can_be_asked(self, pair: Rows) -> bool:
        """Whether two designs differ visibly in two objectives, and were not asked about."""
        steps = self._steps[np.searchsorted(self._front, pair)]
        differs = np.abs(np.diff(steps, axis=0)) >= VISIBLE - TIE
        answered = [{one, other} for one, _, other in self._answers]
        return bool(differs.sum() >= 2 and {*pair} not in answered)

    def answer(self, better: Any, worse: Any) -> None:
        """Take an answer: one design is preferred to another one.

        Answers that contradict each other make no error; each counts what it is worth.

        Args:
            better: The label or the name of a Pareto-optimal design, or its row in an array.
            worse: The other one.

        Raises:
            ArgumentValueError: There is no such Pareto-optimal design, or they are the same.
            ArgumentTypeError: A design is neither a row nor a name.
        """
        self.add(better, ">", worse)

    def equal(self, one: Any, other: Any) -> None:
        """Take the answer that two designs are equally good; as :meth:`answer` otherwise."""
        self.add(one, "=", other)

    def add(self, one: Any, relation: str, other: Any) -> None:
        """Take an answer as :attr:`answers` has it; a pair skipped by "?" is not asked again.

        Raises:
            ArgumentValueError: As for :meth:`answer`, or it is another relation.
        """
        if relation not in RELATIONS:
            raise invalid("the relation of an answer", f"one of {' '.join(RELATIONS)}", relation)
        rows = [self._row(one), self._row(other)]
        if rows[0] == rows[1]:
            raise invalid("the designs of an answer", "two different ones", one)
        chances = self._chances[-1]
        if relation != "?":
            chance = _chance(*self._values_of(rows).T)
            if relation == "=":
                chance = 4 * chance * (1 - chance)
            chances = chances * chance
        self._chances.append(chances / chances.sum())
        self._answers.append((rows[0], relation, rows[1]))

    def undo(self) -> None:
        """Forget the last answer, if there is one."""
        if self._answers:
            self._answers.pop()
            self._chances.pop()

    def _row(self, design: Any) -> int:
        """Return the row of a Pareto-optimal design."""
        row = self.ranking.row_of(design)
        if not self.ranking.pareto[row]:
            rule = "Pareto optimal, as no other one can be the best"
            raise invalid("a design that is compared", rule, design)
        return row

    def _name(self, row: int) -> Any:
        """Return what a design of the ranking is called: a row of an array, a label as a text."""
        objectives = self.ranking.objectives
        label = objectives.labels[row]
        if len(objectives.numbers) and not isinstance(label, str):
            return int(label)
        return str(label)


def _weights_by_order(p: float, m: int, factor: float | None) -> dict[float, Array]:
    """Return ``(k, m)`` weights by the order of the norm that they are used with, p the last."""
    weights = simplex_weights(N_WEIGHTS, m, factor)
    others = [order for order in _ORDERS if order != p]
    parts = np.split(weights, N_OTHERS * np.arange(1, len(others) + 1))
    return dict(zip([*others, p], parts, strict=True))


def _best_for_some(terms: Array, weights_by_order: dict[float, Array]) -> Rows:
    """Return which designs are the best for some weights, of equal ones the first."""
    best = []
    for order, weights in weights_by_order.items():
        best.append(nearest_designs(terms, weights, order, 1)[:, 0])
    return np.unique(first_equal(terms)[np.concatenate(best)])


_TRADES = {">": "rather", "=": "as good"}  # the templates


def _chance(values: Array, others: Array) -> Array:
    """Return the chance that designs of some values are preferred to those of others."""
    logistic = np.tanh(SHARPNESS * (values - others))
    return (1 + (1 - MISTAKES) * logistic) / 2


def _of_unbeaten(values: Array, rows: Rows, preferred: list[tuple[int, int]]) -> Array:
    """Return values, -inf for rows that answers put below others, and not above these again."""
    below = {row: _below(row, preferred) for pair in preferred for row in pair}
    beaten = [row for one in below for row in below[one] if one not in below[row]]
    return np.where(np.isin(rows, beaten), -np.inf, values)


def _below(row: int, preferred: list[tuple[int, int]]) -> list[int]:
    """Return a row, and those that answers put below it, directly or through others."""
    below = [row]
    for one in below:
        below += [worse for better, worse in preferred if better == one and worse not in below]
    return below
