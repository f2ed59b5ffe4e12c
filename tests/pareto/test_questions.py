"""Questions that find the design of hidden weights, whatever is asked in whatever units."""

import numpy as np
import pandas as pd
import pytest
from pymoo.core.result import Result

from pymoo_psi import (
    Preferences,
    Preferred,
    PsiError,
    TestTable,
    acceptability,
    explain,
    read_table,
)
from pymoo_psi.errors import ArgumentTypeError, ArgumentValueError
from tests.helpers.draws import rarely, seeds
from tests.helpers.fronts import on_sphere
from tests.helpers.refusals import refused

FIVE = np.array([[0.0, 1.0], [0.1, 0.6], [0.4, 0.3], [0.8, 0.1], [1.0, 0.0]])
SPHERE = 1 - on_sphere(np.random.default_rng(4), 80, 3)  # bulges towards the ideal point


def distances_for(weights, F, p=2):
    """The weighted distances of a hidden person."""
    d = (F - F.min(axis=0)) / np.ptp(F, axis=0)
    return np.linalg.norm(weights * d, ord=p, axis=1)


def regret(person, distances):
    """How far the proposal is behind the best, as a share of how far the median is."""
    least = distances.min()
    return (distances[person.best] - least) / (np.median(distances) - least)


def dialogue(person, distances, n, wrong=()):
    """Answer at most n questions by distances, some of them wrongly; return the questions."""
    asked = []
    while len(asked) < n and (pair := person.question()) is not None:
        is_wrong = len(asked) in wrong
        person.answer(*sorted(pair, key=lambda row: distances[row], reverse=is_wrong))
        asked.append(pair)
    return asked


@pytest.mark.parametrize("p", [2, *rarely(1, np.inf)])
def test_few_answers_find_what_hidden_weights_prefer(p):
    regrets = np.zeros((12, 3))
    for row, weights in zip(
        regrets, np.random.default_rng(0).dirichlet(np.ones(3), 12), strict=True
    ):
        distances, person = distances_for(weights, SPHERE, p), Preferences(SPHERE)
        for k in range(3):
            row[k] = regret(person, distances)
            dialogue(person, distances, 3)
    before, after_three, after_six = regrets.mean(axis=0)
    assert before > 0.3
    assert after_three < before / 3
    assert after_six < 0.05


def test_a_wrong_answer_ruins_nothing():
    distances = distances_for(np.array([0.6, 0.3, 0.1]), SPHERE)
    person = Preferences(SPHERE)
    dialogue(person, distances, 12, wrong=(0,))
    assert regret(person, distances) < 0.1


@pytest.mark.parametrize("F", [FIVE, SPHERE])
def test_questions_differ_visibly_are_asked_once_and_end(F):
    person = Preferences(F)
    asked = dialogue(person, distances_for(np.full(F.shape[1], 1.0), F), 100)
    assert 0 < len(asked) < 30
    assert person.question() is None
    assert len({frozenset(pair) for pair in asked}) == len(asked)
    for one, other in asked:
        assert (np.abs(F[one] - F[other]) / np.ptp(F, axis=0) > 0.0099).sum() >= 2


def test_shares_without_answers_are_those_of_weights():
    shares = Preferences(SPHERE).shares
    assert shares.sum() == pytest.approx(1)
    assert np.abs(shares - acceptability(SPHERE)[:, 0]).sum() < 0.3  # a fifth has other norms


def test_a_repeated_objective_changes_no_question_and_no_proposal():
    doubled = np.column_stack([SPHERE, 3 * SPHERE[:, 0] + 7])
    nearly = doubled + 0.02 * np.outer(np.sin(np.arange(len(doubled))), [0, 0, 0, 1])
    distances = distances_for(np.array([0.2, 0.5, 0.3]), SPHERE)
    plain, twice, almost = map(Preferences, (SPHERE, doubled, nearly * [1, 1, 1, 100]))
    assert dialogue(twice, distances, 20) == dialogue(plain, distances, 20)
    assert np.array_equal(twice.shares, plain.shares)
    assert twice.weights["mean"].tolist() == [*plain.weights["mean"], 0.0]
    dialogue(almost, distances, 20)
    assert almost.best == plain.best


@pytest.mark.parametrize("F", [FIVE, SPHERE])
def test_units_directions_and_dominated_designs_change_nothing(F):
    distances = distances_for(np.linspace(1, 2, F.shape[1]), F)
    values = np.vstack([F * 1000 - 5, F.max(axis=0) * 1001])
    values[:, 0] *= -1
    plain, other = Preferences(F), Preferences(values, maximize=[0])
    assert dialogue(other, distances, 5) == dialogue(plain, distances, 5)
    assert other.best == plain.best
    assert other.regret == pytest.approx(plain.regret)


def test_answers_count_in_any_order():
    person, other = Preferences(FIVE), Preferences(FIVE)
    person.answer(1, 2)
    person.equal(1, 0)
    person.add(3, "?", 4)
    other.equal(0, 1)
    other.answer(1, 2)
    assert person.shares == pytest.approx(other.shares)
    assert person.answers == [(1, ">", 2), (1, "=", 0), (3, "?", 4)]
    for _ in range(4):
        person.undo()
    new = Preferences(FIVE)
    assert (person.answers, person.regret, person.question()) == ([], new.regret, new.question())
    assert np.array_equal(person.shares, new.shares)


def test_an_equal_answer_draws_two_designs_together():
    person = Preferences(FIVE)
    person.answer(1, 3)
    before = person.shares[2]  # of the design between them
    person.equal(1, 3)
    assert person.shares[2] > before


@pytest.mark.parametrize("asks", [True, False])
@pytest.mark.parametrize("seed", seeds(24))
def test_no_design_that_an_answer_puts_below_another_is_proposed(asks, seed):
    generator = np.random.default_rng(seed)
    F = generator.dirichlet(np.ones(generator.integers(2, 4)), 12) ** generator.uniform(0.2, 2)
    person = Preferences(F)
    order = generator.permutation(12)  # of a person whom no weights explain
    for _ in range(6):
        pair = person.question() if asks else generator.choice(12, 2, replace=False).tolist()
        if pair is None:
            break
        person.answer(*sorted(pair, key=order.__getitem__))
        assert person.best not in {worse for _, _, worse in person.answers}
        assert person.best in person.to_frame().index


@pytest.mark.parametrize("circle", [(2, 1, 3), (1, 2), (3, 1, 2, 4)])
def test_answers_in_a_circle_put_no_design_below_another(circle):
    person = Preferences(FIVE)
    for one, other in zip(circle, [*circle[1:], circle[0]], strict=True):
        person.answer(one, other)
    assert person.best in circle
    assert 0 < person.regret < 1
    assert person.shares.sum() == pytest.approx(1)
    person.answer(0, circle[0])  # and so to all of them
    assert person.best not in circle


@pytest.mark.parametrize("F", [[[1.0, 2.0]], [[1.0, 2.0]] * 3, [[1.0], [2.0]]])
def test_sets_of_one_and_of_equal_designs_ask_nothing(F):
    person = Preferences(F)
    assert (person.question(), person.best, round(person.regret, 9)) == (None, 0, 0)


def test_of_two_designs_one_is_asked_for():
    person = Preferences([[0.0, 1.0], [1.0, 0.0]])
    assert {*person.question()} == {0, 1}
    person.answer(1, 0)
    assert (person.best, person.question()) == (1, None)


@pytest.mark.parametrize(
    ("source", "names", "asked"),
    [
        (pd.DataFrame(FIVE, list("ABCDE")), list("ABCDE"), ("B", "C")),
        (pd.DataFrame(FIVE, [10, 20, 30, 40, 50]), ["10", "20", "30", "40", "50"], ("20", "30")),
        (
            TestTable.of(range(11, 16), FIVE[:, :1], FIVE),
            [f"test {k}" for k in range(11, 16)],
            (12, "test 13"),
        ),
    ],
)
def test_designs_have_the_names_of_their_source(source, names, asked):
    person, by_row = Preferences(source), Preferences(FIVE)
    assert person.question() == tuple(names[row] for row in by_row.question())
    person.answer(*asked)
    by_row.answer(1, 2)
    assert person.answers == [(names[1], ">", names[2])]
    assert person.best == names[by_row.best]
    assert person.to_frame().loc[names[1], "share"] == by_row.shares[1]


def test_a_selector_gives_the_proposal_of_the_answers():
    result = Result()
    result.F, result.opt, result.CV = SPHERE, None, None
    person = Preferences(result)
    dialogue(person, distances_for(np.array([0.7, 0.2, 0.1]), SPHERE), 4)
    assert Preferred(person.answers).do(SPHERE).tolist() == [person.best]


def test_the_explanation_says_what_the_answers_give_up():
    table = read_table(pd.DataFrame(FIVE, list("ABCDE"), ["cost", "mass"]))
    person = Preferences(table)
    person.answer("B", "C")
    why = explain(person)
    assert why.ranking.name_of(why.row) == person.best
    assert why.sentences[2:] == (*person.trades(), *explain(table, person.best).sentences[2:])


SIX = Preferences(np.vstack([FIVE, [2.0, 2.0]]))
TWINS = Preferences(pd.DataFrame(FIVE, list("ABCDD")))


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: SIX.answer(0, 7), ArgumentValueError, "design"),
        (lambda: SIX.answer(0, "A"), ArgumentValueError, "design"),
        (lambda: SIX.answer(-1, 0), ArgumentValueError, "design"),
        (lambda: SIX.answer(0, 5), ArgumentValueError, "design"),
        (lambda: SIX.equal(1, 1), ArgumentValueError, "two different ones"),
        (lambda: SIX.answer(0, np.nan), ArgumentTypeError, "integer"),
        (lambda: SIX.add(0, "<", 1), ArgumentValueError, "one of > = ?"),
        (lambda: TWINS.answer("D", "A"), ArgumentValueError, "the name of one design"),
        (lambda: Preferences(np.eye(40), factor=1.05), ArgumentValueError, "factor must be larger"),
        (lambda: Preferences(FIVE, p=np.nan), PsiError, "p must be"),
        (lambda: Preferences(FIVE, factor=1), PsiError, "factor"),
        (lambda: Preferences([[np.nan, 1.0]]), PsiError, "F"),
    ],
)
def test_what_cannot_be_answered_is_refused(call, kind, message):
    refused(message, call, error=kind)
    assert SIX.answers == TWINS.answers == []


def test_designs_of_one_name_are_told_apart_by_their_numbers():
    frame = pd.DataFrame(FIVE, ["A", "A", "A", "A #1", "B"])
    assert Preferred([]).do(frame) == Preferred([]).do(FIVE)
    person, by_row = Preferences(frame), Preferences(FIVE)
    assert person.question() == ("A #3", "A #2")
    person.answer(*person.question())
    by_row.answer(2, 1)
    assert explain(person).row == person.row == by_row.row
    names = ["A #1 #1", "A #2", "A #3", "A #1", "B"]
    assert sorted(person.to_frame().index) == sorted(names)
    assert explain(frame, "A #1").row == 3
    assert {*read_table(frame).names} == {*names}
