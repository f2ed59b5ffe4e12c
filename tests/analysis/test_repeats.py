"""Repeated tests are one design: mean, error, number; and how sure a decision on means is."""

import re

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import Formulation, TestTable, read_table
from pymoo_psi.analysis import average_repeats, confidence_sentences, counts_sentence
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.table import Schema
from tests.helpers.refusals import refused

FRAME = pd.DataFrame(
    {
        "variant": [*"AAABBBCC"],
        "cost": [10.0, 12, 11, 20, 21, 22, 15, 16],
        "mass": [5.0, 5.4, 5.2, 2.0, 2.4, 2.2, 3.0, 3.2],
        "size": 7,
        "day": [f"day {k}" for k in (0, 1, 2, 0, 1, 2, 0, 1)],
    }
)
ASKED = Formulation(objectives=["cost", "mass"])


@pytest.fixture
def file(tmp_path):
    shuffled = FRAME.sample(frac=1, random_state=1).sort_values("day", kind="stable")
    shuffled.to_csv(tmp_path / "tests.csv", index=False)
    return tmp_path / "tests.csv"


def test_rows_with_one_label_are_one_design(file):
    table = read_table(file, ASKED, average_by="variant")
    groups = FRAME.groupby("variant")
    designs = groups.agg({"cost": ["mean", "count"], "mass": "mean"})
    columns = [table["cost"], table["tests"], table["mass"]]
    np.testing.assert_allclose(np.transpose(columns), designs.loc[table.names])
    pooled = (groups["cost"].var() * (groups.size() - 1)).sum() / (8 - 3)
    assert np.allclose(table["cost standard error"], np.sqrt(pooled / table["tests"]))
    assert "day" not in table.columns  # tests of a design differ in it


def test_five_tests_give_a_design_its_own_variance():
    counts = [5, 3, 4]
    f = np.random.default_rng(2).normal(size=sum(counts)) * np.repeat([5.0, 1.0, 1.0], counts)
    F = np.column_stack([f, np.repeat([0.1, 9.18559, 0.3], counts)])
    table = TestTable.of(range(1, len(F) + 1), np.repeat([[0], [1], [2]], counts, axis=0), F)
    designs = average_repeats(table)
    errors = designs["f1 standard error"]
    assert designs["f2 standard error"].tolist() == [0, 0, 0]  # of equal values
    groups = np.split(f, np.cumsum(counts)[:-1])
    pooled = sum(np.var(group) * len(group) for group in groups) / (len(f) - 3)
    assert errors[0] == pytest.approx(groups[0].std(ddof=1) / np.sqrt(5))
    assert errors[1:] == pytest.approx(np.sqrt(pooled / np.array([3, 4])))


def test_computed_columns_and_limits_are_of_means(file):
    asked = Formulation(
        objectives=["cost", "ratio"], computed={"ratio": "mass / cost"}, limits={"mass": 5.1}
    )
    table = read_table(file, asked, average_by="variant")
    ratios = (FRAME["mass"] / FRAME["cost"]).groupby(FRAME["variant"])
    pooled = (ratios.var() * (ratios.size() - 1)).sum() / (8 - 3)
    assert np.allclose(table["ratio"], table["mass"] / table["cost"])
    assert np.allclose(table["ratio standard error"], np.sqrt(pooled / table["tests"]))
    table = read_table(file, ASKED, average_by="variant").under(limits={"mass": 5.1})
    assert sorted(np.array(table.names)[table.feasible()]) == ["B", "C"]  # A has 5.2 on average


def test_single_usable_tests_have_means_and_no_confidence():
    F = [[1.0, 2.0], [np.nan, np.nan], [2.0, 1.0]]
    table = average_repeats(TestTable.of([1, 2, 3], [[0], [0], [1]], F))
    assert table.F.tolist() == [[1, 2], [2, 1]]
    refused(
        "errors in columns 'f1 standard error', 'f2", table.confidence, error=ArgumentValueError
    )


def test_a_design_of_one_test_keeps_its_values_to_the_bit():
    table = TestTable.of([1, 2, 3], [[0.1], [0.1], [0.5]], [[1, 2], [1.2, 2], [1 / 3, 2 / 3]])
    designs = average_repeats(table)
    assert designs.F[1].tolist() == [1 / 3, 2 / 3]
    assert counts_sentence(designs, "s.db").startswith("s.db: 2 designs of 3 tests; ")
    more = designs.extended(TestTable.of([4], [[0.9]], [[0, 3]]))  # without a number of tests
    assert counts_sentence(more, "s.db").startswith("s.db: 3 designs; ")


def test_failed_tests_do_not_count_in_means():
    X = [[1.0], [1.0], [2.0], [2.0], [3.0]]
    F = [[1.0], [3.0], [5.0], [np.nan], [np.nan]]
    G = [[1.0], [-2.0], [0.5], [0.0], [0.0]]
    table = TestTable.of([3, 4, 5, 6, 7], X, F, G, reasons={7: "no licence"})
    designs = average_repeats(table, "x1")
    assert designs.status.tolist() == ["ok", "infeasible", "failed"]
    assert designs["f1"][:2].tolist() == [2.0, 5.0]
    assert designs.reasons == {7: "no licence"}
    assert average_repeats(table).equals(designs)
    refused("^by must be", average_repeats, TestTable.of([1, 2], np.zeros((2, 0)), [[1.0], [2.0]]))


def test_tests_without_a_name_are_not_those_of_one_design():
    frame = pd.DataFrame({"name": ["A", "A", "", ""], "f1": [1, 2, 3, 4], "f2": [2, 1, 0, 4]})
    refused(
        "^average_by must be .* without gaps, got none in row 3",
        read_table,
        frame,
        average_by="name",
    )
    assert read_table(frame[1:], Formulation(["f1", "f2"])).remarks == ()


@pytest.mark.parametrize(
    ("column", "rule"),
    [("day", "different ones"), ("none", "one of")],
)
def test_a_column_that_does_not_tell_designs_is_refused(column, rule):
    refused(
        f"^average_by must be.*{rule}",
        read_table,
        FRAME.assign(x=range(8)),
        ASKED,
        variables=["x"],
        average_by=column,
    )


IDS = FRAME.rename(columns={"variant": "id"})


@pytest.mark.parametrize(
    ("frame", "average_by", "remarks"),
    [
        (IDS, None, ["For 3 designs, rows .*--average-by id"]),
        (FRAME[::2].reset_index(drop=True), None, ["For 1 design, rows .*--average-by variant"]),
        (FRAME, None, []),  # most recur, as categories do
        (IDS.assign(cost=1.0, mass=2.0), None, []),
        (
            IDS,
            "id",
            [
                "3 designs, 8 tests: rows with the same id are tests of one design.",
            ],
        ),
    ],
)
def test_remarks_tell_repeats(frame, average_by, remarks):
    for remark, expected in zip(
        read_table(frame, ASKED, average_by=average_by).remarks, remarks, strict=True
    ):
        assert re.search(expected, remark)


def known(F, error):
    """A table of two objectives with a standard error that is known, the same for both or two."""
    columns = np.broadcast_to(error, (len(F), 2)).T
    errors = {f"f{j} standard error": column for j, column in enumerate(columns, 1)}
    return TestTable.of(range(1, len(F) + 1), np.zeros((len(F), 0)), F, outputs=errors)


def test_without_noise_probabilities_are_0_or_1():
    """Of designs on a line, far apart, and one behind them."""
    t = np.linspace(0, 1, 12)
    table = known(np.vstack([np.column_stack([t, (1 - t) ** 2]), [0.5, 0.3]]), 0.0)
    frame = table.confidence()
    assert np.array_equal(frame["pareto"] == 1, table.pareto())
    assert frame.index[frame["best"] == 1].tolist() == table.best().names
    assert np.allclose(frame[["f1", "f2"]], table.F)


def test_two_designs_have_the_probability_of_a_normal_difference():
    """B dominates A if both differences are below 0; of two designs means are not shrunk."""
    from scipy.stats import norm

    frame = known([[0.0, 0.0], [-0.3, -0.5]], 1.0).confidence()
    a_is_dominated = norm.cdf(0.3 / np.sqrt(2)) * norm.cdf(0.5 / np.sqrt(2))
    b_is_dominated = norm.cdf(-0.3 / np.sqrt(2)) * norm.cdf(-0.5 / np.sqrt(2))
    assert frame["pareto"].to_numpy() == pytest.approx(
        [1 - a_is_dominated, 1 - b_is_dominated], abs=0.04
    )
    assert (frame["best"] == frame["pareto"]).all()  # each is the best in an objective: a tie
    assert (frame["near_best"] == frame["best"]).all()  # a dominated one is not near


def test_nothing_is_said_of_the_best_of_designs_that_usually_tie():
    assert confidence_sentences(known([[0.0, 9.0], [9.0, 0.0]], 1.0), 0) == []
    assert confidence_sentences(known([[0.0, 9.0], [1.0, 1.0], [9.0, 0.0]], 1.0), 1) != []


@pytest.mark.parametrize("n_tests", [2, 5])
def test_errors_of_one_estimate_are_wrong_together(n_tests):
    """A has tests at ±1 and B as many, or a single one: the difference is Student's or Welch's."""
    from scipy.stats import t

    f1 = [*np.resize([1.0, -1.0], n_tests), *np.resize([3.0, 1.0], 1 if n_tests == 2 else n_tests)]
    is_a = np.arange(len(f1)) < n_tests
    tests = TestTable.of(
        range(1, len(f1) + 1), np.where(is_a, 1, 2)[:, None], np.column_stack([f1, is_a])
    )
    designs = average_repeats(tests)
    difference = designs["f1"][1] - designs["f1"][0]
    errors = designs["f1 standard error"]
    chance = t.cdf(difference / np.hypot(*errors), n_tests - 1)
    if n_tests == 5:  # each has an estimate of its own: integrated over that of B
        values = t.ppf((np.arange(100_000) + 0.5) / 100_000, 4)
        chance = t.cdf((difference + errors[1] * values) / errors[0], 4).mean()
    assert designs.confidence()["pareto"].iloc[0] == pytest.approx(chance, abs=0.02)


def test_a_true_value_better_than_a_fixed_range_is_not_farther():
    """A is nearer than B where max(0, z)² + 0.5² < 2.5² / 100 + 0.45², of z normal about 0."""
    from scipy.stats import norm

    errors = {"f1 standard error": [3.0, 0.0], "f2 standard error": [0.0, 0.0]}
    table = TestTable.of([1, 2], np.zeros((2, 0)), [[0.0, 5.0], [2.5, 4.5]], outputs=errors)
    frame = table.under(ranges={"f1": (0, 10), "f2": (0, 10)}).confidence()
    a_is_nearer = norm.cdf(10 * np.sqrt(0.25**2 + 0.45**2 - 0.5**2) / 3)
    assert frame["best"].to_numpy() == pytest.approx([a_is_nearer, 1 - a_is_nearer], abs=0.04)


def test_shrunk_means_are_nearer_to_the_truth():
    generator = np.random.default_rng(3)
    t = generator.random(200)
    truth = np.column_stack([t, (1 - t) ** 2]) + 0.1 * generator.random((200, 1))
    noisy = truth + 0.1 * generator.standard_normal(truth.shape)
    table = known(noisy, 0.1)
    shrunk = table.confidence()[["f1", "f2"]].to_numpy()
    assert ((shrunk - truth) ** 2).mean() < 0.8 * ((noisy - truth) ** 2).mean()
    front = table.pareto()
    assert abs((shrunk - truth)[front].mean()) < 0.5 * abs((noisy - truth)[front].mean())


@pytest.mark.parametrize("other", ["mass", None])
@pytest.mark.parametrize("name", ["tests", "cost standard error"])
def test_a_column_with_the_name_of_a_further_output_is_not_overwritten(name, other):
    """An objective or an output called so would hold the counts or errors instead."""
    frame = FRAME.assign(**{name: FRAME["size"] + FRAME["cost"]})
    table = read_table(frame, Formulation(objectives=["cost", other or name]))
    refused(f"{name!r}.*rename", average_repeats, table, "variant")


def test_a_repeated_test_of_an_optimal_design_is_not_dominated():
    table = TestTable.of([1, 2, 3], [[0.1], [0.2], [0.1]], [[1, 2], [2, 1], [1, 2]])
    assert counts_sentence(table) == "3 tests; none of them is dominated."


def test_constraints_named_by_a_limit_are_said_as_limits():
    schema = Schema.of(1, 2, ["a <= 4", "1 <= a/b <= 4", "a <= 4*b"])
    table = TestTable.of(
        [1, 2], [[0], [1]], [[1, 2], [2, 1]], [[0, 0, 0], [0, 0, 1]], schema=schema
    )
    assert "limits (a at most 4, a/b from 1 to 4, a <= 4*b)." in counts_sentence(table)


def test_designs_without_a_computed_objective_are_named():
    """Not those whose operands are missing."""
    table = TestTable.of(
        range(1, 7), np.zeros((6, 1)), [[k, k // 5] for k in range(5)] + [[np.nan] * 2]
    )
    counts = counts_sentence(table.under(objectives=["f1", "r"], computed={"r": "f1 / f2"}))
    assert counts.endswith("; r has no value for test 1, test 2, test 3 and 2 more.")


def test_equal_values_without_noise_stay_equal():
    """Three prices that are known, and a noisy mass: of equal price only the lightest can be best."""
    price, mass = np.divmod(np.arange(12), 4)
    frame = known(np.column_stack([price, 9 - 3 * price + mass]), [0.0, 0.1]).confidence()
    assert np.array_equal(frame["pareto"], mass == 0)
    assert np.array_equal(frame["f1"], price)
