"""Formulations after the tests: the table judged anew is the table of the problem so formulated."""

import itertools
import json
import random
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pymoo.core.problem import Problem

from pymoo_psi import Decision, Formulation, TestTable, investigate, lp_tau
from pymoo_psi.analysis import decision_sentences
from pymoo_psi.errors import ArgumentValueError
from pymoo_psi.files import read_table, write_table
from pymoo_psi.table import Limit, Schema, limits_of
from tests.helpers.draws import examples
from tests.helpers.mutations import mutated
from tests.helpers.refusals import flaw, refused

COUNT = 40


def model(X):
    """What a model of two variables gives, with ties, and NaN and infinity in places."""
    x, y = X.T
    with np.errstate(divide="ignore"):
        return {
            "mass": np.round(4 * x) + y,
            "gain": np.round(3 * np.sin(5 * y) + x, 1),
            "stress": x + y - 1.2,
            "bend": 0.6 - y,
            "volume": np.round(x - y, 1),
            "heat": np.where(x < 0.3, np.nan, 1 / np.maximum(0, y - 0.2)),
        }


# The table as it was tested: of two criteria one maximised, two constraints, an equality, an output.
X = lp_tau(COUNT, 2)
SCHEMA = Schema.of(
    ["width", "wall kg"], ["mass", "gain"], ["stress", "bend"], ["volume"],
    lower=[0, 0], upper=[1, 1], eq_tolerance=0.5, outputs=["heat"], maximize=["gain"],
    units={"mass": "kg"},
)  # fmt: skip


def beam_tests(failed=()):
    out = model(X)
    F = np.column_stack([out["mass"], -out["gain"]])
    G, H = np.column_stack([out["stress"], out["bend"]]), out["volume"][:, None]
    for row in (number - 1 for number in failed):  # as an evaluation leaves what fails
        F[row], G[row], H[row], out["heat"][row] = np.inf, 0, 0, np.nan
    return TestTable.of(
        np.arange(1, COUNT + 1), X, F, G, H, outputs={"heat": out["heat"]},
        reasons=dict.fromkeys(failed, "it broke"), schema=SCHEMA,
    )  # fmt: skip


class ByHand(Problem):
    """The problem as somebody would write it who had known the formulation from the start."""

    def __init__(self, formulation, computed):
        self.asked, self.computed = formulation, computed
        self.criteria = formulation.objectives or ("mass", "gain")
        gone = {*self.criteria, *formulation.omitted}
        self.ieq = [name for name in ("stress", "bend") if name not in gone]
        self.eq = [name for name in ("volume",) if name not in gone]
        super().__init__(
            n_var=2, n_obj=len(self.criteria), n_ieq_constr=len(self.ieq) + len(formulation.limits),
            n_eq_constr=len(self.eq), xl=0.0, xu=1.0,
        )  # fmt: skip

    def _evaluate(self, X, out, *args, **kwargs):
        values = model(X) | {"width": X[:, 0], "wall kg": X[:, 1]}
        for name, function in self.computed.items():
            with np.errstate(all="ignore"):
                values[name] = np.array([float(f"{value:.15g}") for value in function(values)])
        if "volume" in self.criteria:
            values["volume"] = np.abs(values["volume"])
        up = {"gain", *self.asked.maximize}
        signs = [-1.0 if name in up else 1.0 for name in self.criteria]
        out["F"] = np.column_stack([values[name] for name in self.criteria]) * signs
        out["G"] = [values[name] for name in self.ieq]
        for name, (low, high, *_) in self.asked.limits.items():
            column = np.where(np.isfinite(values[name]), values[name], np.nan)
            beyond = np.maximum(low - column, column - high)
            out["G"].append(np.nan_to_num(beyond, nan=1.0))  # what is not known is refused
        out["G"] = np.column_stack([*out["G"], np.zeros((len(X), 0))])
        out["H"] = np.column_stack([*(values[name] for name in self.eq), np.zeros((len(X), 0))])


COMPUTED = {
    "ratio": ("gain / mass", lambda v: v["gain"] / v["mass"]),
    "odd ratio": ("mass/(`wall kg` - 0.5)", lambda v: v["mass"] / (v["wall kg"] - 0.5)),
    "root": ("sqrt(gain) + width", lambda v: np.sqrt(v["gain"]) + v["width"]),
    "worst": ("max(stress, bend, -1)", lambda v: np.maximum(np.maximum(v["stress"], v["bend"]), -1)),
}  # fmt: skip
CONSTRAINTS = ["stress", "bend", "volume"]


@st.composite
def formulations(draw):
    """A formulation, and the functions of its computed columns."""
    computed = draw(st.lists(st.sampled_from(list(COMPUTED)), unique=True, max_size=2))
    columns = ["mass", "gain", "heat", *CONSTRAINTS, *computed]
    criteria = draw(st.lists(st.sampled_from(columns), unique=True, max_size=3))
    turned = draw(st.lists(st.sampled_from(criteria or ["mass", "gain"]), unique=True))
    omitted = draw(st.lists(st.sampled_from(CONSTRAINTS), unique=True, max_size=2))
    kept = {*CONSTRAINTS}.difference(omitted, criteria)
    free = [n for n in [*columns, "width", "wall kg"] if n not in kept]
    limits = {}
    for name in draw(st.lists(st.sampled_from(free), unique=True, max_size=3)):
        low, high = sorted(draw(st.tuples(*[st.sampled_from([-1.0, 0.0, 0.2, 0.5, 1, 2.0])] * 2)))
        pairs = [(low, high), (None, high), (low, None)]
        pairs += [] if name in {"gain", *turned} else [high]
        limits[name] = draw(st.sampled_from(pairs))
    asked = Formulation(
        objectives=criteria,
        maximize=turned,
        limits=limits,
        omitted=omitted,
        computed={n: COMPUTED[n][0] for n in computed},
    )
    return asked, {n: COMPUTED[n][1] for n in computed}


@examples(2)
@given(formulations=formulations())
def test_a_formulation_later_equals_one_from_the_start(formulations):
    asked, computed = formulations
    table = beam_tests()
    fresh = investigate(ByHand(asked, computed), COUNT)
    fresh = replace(fresh, evaluated=replace(fresh.schema, eq_tolerance=0.5))
    anew = table.under(asked)
    # An evaluation refuses NaN before it looks at constraints; a table looks at these first.
    known = ~np.isnan(anew.F).any(axis=1)
    np.testing.assert_array_equal(anew.status[known], fresh.status[known])
    ok = anew.status == "ok"
    assert not (ok & ~known).any()
    np.testing.assert_array_equal(anew.F[ok], fresh.F[ok])
    np.testing.assert_array_equal(anew.feasible(), fresh.feasible())
    np.testing.assert_array_equal(anew.pareto(), fresh.pareto())
    if ok.any():
        ours, theirs = anew.ranking(), fresh.ranking()
        np.testing.assert_array_equal(ours.rank, theirs.rank)
        np.testing.assert_array_equal(ours.criteria, theirs.criteria)


@given(
    first=formulations(),
    second=formulations(),
    limits=st.sampled_from(
        [{}, {"width": (0.1, 0.9)}, {"heat": (None, 1.0), "width": (0.1, None)}]
    ),
    normalize=st.booleans(),
)
def test_a_formulation_takes_the_place_of_the_one_before(first, second, limits, normalize):
    """Whatever was asked before; attributes given alone take the place of those attributes."""
    table = beam_tests()
    before = table.under(first[0])
    asked = replace(second[0], normalize=normalize)
    assert before.under(asked).equals(table.under(asked))
    assert before.under(Formulation()).data is table.data
    assert before.under(Formulation()).equals(table)
    loosened = before.under(limits=limits).under(normalize=normalize)
    assert loosened.equals(table.under(replace(first[0], limits=limits, normalize=normalize)))


def test_directions_that_are_read_are_those_of_the_columns():
    """A table is the same whether it is read with directions or from a file that states them."""
    frame = pd.DataFrame({"mass": [1.0, 2, 3], "gain": [1.0, 5, 6], "heat": [3.0, 2, 1]})
    table = read_table(
        frame, Formulation(["mass", "gain"], maximize=["gain"], units={"mass": "kg"})
    )
    for asked in (Formulation(limits={"mass": 2}), Decision(Formulation(limits={"mass": 2}))):
        anew = table.under(asked).schema
        assert (anew.objectives, anew.maximize) == (("mass", "gain"), ("gain",))
        assert anew.units == {"mass": "kg"}
    assert table.under(objectives=["mass", "heat"]).schema.objectives == ("mass", "heat")


@given(failed=st.sets(st.integers(1, COUNT)), formulations=formulations())
def test_what_failed_stays_failed(failed, formulations):
    table = beam_tests(failed)
    assert table.under(Formulation()).equals(table)
    anew, whole = (tests.under(formulations[0]) for tests in (table, beam_tests()))
    rows = ~np.isin(table.numbers, list(failed))
    assert anew.take(rows).equals(whole.take(rows))
    assert set(anew.status[~rows].tolist()) <= {"failed"}
    assert {anew.reasons[n] for n in failed} <= {"it broke"}


# Limits without a formulation


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"gain": 0.9}, r"'gain', which is maximised, in limits must be a pair \(lower, upper\), got 0.9; say \(0.9, None\) for at least or \(None, 0.9\) for at most"),
        ({"stress": 0.1}, r"must be one of .*, got 'stress'; leave the constraint out by Formulation\(omitted="),
        ({"mass": (2, 1)}, r"'mass' in limits must be \(lower, upper\) in increasing order, got \(2, 1\)"),
        ({"mass": (-np.inf, -np.inf)}, r"in increasing order, got \(-inf, -inf\)"),
        ({"mass": Limit(3.0, 1.0)}, r"in increasing order, got \(3, 1\)"),
        ({"mass": None}, r"must be a number or a pair \(lower, upper\), got None"),
        ({"mas": 1}, "did you mean 'mass'"),
    ],
)  # fmt: skip
def test_limits_that_could_mean_two_things_are_refused(limits, message):
    refused(message, beam_tests({3}).under, limits=limits)
    refused(message, lambda: beam_tests().under(Formulation(limits=limits)))


# Formulations as values and files


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"objective": ["a"]}', "an entry must be one of .* did you mean 'objectives'"),
        ('{"positions": [{"name": "Ann", "weight": {}}]}', "a position: .*unknown field `weight`; its entries are name, .* weights"),
        ('{"limits": {"mass": NaN}}', "NaN is no finite number"),
        ('{"page": {"a": -Infinity}}', "-Infinity is no finite number"),
        ('{"computed": {"r": "__import__(\'os\').abort()"}}', "arithmetic of columns"),
        ('{"limits": {"mass": [null, 1e400]}}', "1e400 is no finite number"),
        (f'{{"limits": {{"mass": 1{"0" * 400}}}}}', "too large to convert to float"),
        ('{"ranges": {"mass": [-1e400, 1]}}', "-1e400 is no finite number"),
        ('{"page": {"odd": [{"x": 1e400}]}}', "1e400 is no finite number"),
        ('{"chosen": 0}', "chosen must be of type str, got int"),
        ('{"normalize": 1}', "normalize must be True or False, got 1"),
        ('{"objectives": "mass"}', "objectives must be a list of names, got 'mass'"),
        ('{"limits": {"mass": [1]}}', r"'mass' in limits must be a number or a pair"),
        ('{\n "limits": {,}\n}', "line 2 column 13"),
        ("[" * 5000, "recursion|Expecting"),
        ('{"limits": {"mass": 1, "cost": 2, "mass": 3}}', "must be distinct, got 'mass' twice"),
        ("[1]", "it must be an object of JSON"),
    ],
)  # fmt: skip
def test_a_file_without_a_formulation_is_refused(tmp_path, text, message):
    path = tmp_path / "asked.json"
    path.write_text(text, "utf-8")
    refused(rf"asked\.json must be a decision.*({message})", Decision.read_json, path)


DECISION = {
    "objectives": ["mass", "r"],
    "maximize": ["gain"],
    "limits": {"mass": [None, 30], "width": [0.2, 0.4], "x": 5, "mode": ["good"]},
    "omitted": ["g1"],
    "computed": {"r": "mass / stress"},
    "units": {"mass": "kg"},
    "normalize": True,
    "ranges": {"mass": [1, 2]},
    "chosen": "test 7",
    "reason": "light",
    "decided": {"chosen": "A", "agree": ["Ann"], "date": "2026-01-04"},
    "page": {"title": "T", "values": {"mass": 3.0}, "state": {"pins": ["A"]}},
}


def test_odd_files_give_a_formulation_or_an_error(tmp_path, draws):
    path = tmp_path / "asked.json"
    for seed in draws(200):
        # 1e400, which Python writes as Infinity, is a number of JSON.
        text = json.dumps(mutated(DECISION, random.Random(seed))).replace("Infinity", "1e400")
        path.write_text(text, "utf-8")
        message = flaw(Decision.read_json, path)
        assert message.startswith(f"{path} must be a decision") or not message
        if not message:
            asked = Decision.read_json(path)
            asked.to_json(path)
            assert Decision.read_json(path) == asked


def test_positions_are_joined_in_any_order():
    # One name twice on a day, one position twice, one without a date.
    held = [
        {"name": "Ben", "date": "2026-01-02", "chosen": "C", "limits": {"mass": 30}},
        {"name": "Ann", "date": "2026-01-02", "chosen": "B"},
        {"name": "Ann", "date": "2026-01-02", "chosen": None},
        {"name": "Ann", "date": "2026-01-02", "chosen": "B", "reason": "light"},
        {"name": "Cy"},
        {"name": "Ann", "date": "2026-01-02", "chosen": "B"},
    ]
    own = Decision(Formulation(limits={"mass": 20}), chosen="A", decided={"chosen": "A"})
    joined = [replace(own, positions=positions) for positions in itertools.permutations(held)]
    assert joined == [joined[0]] * len(joined)
    assert [one["name"] for one in joined[0].positions] == ["Cy", "Ann", "Ann", "Ann", "Ben"]


@pytest.mark.parametrize(
    "date", ["yesterday", "2026-13-01", "1 May 2026", "20260501", "2026-W18-5", "2026-02-30"]
)
def test_other_dates_of_positions_are_refused(date):
    message = f"date of a position must be a date such as 2026-05-01 or .*got '{date}'"
    refused(message, Decision, positions=[{"name": "Ann", "date": date}])


@pytest.mark.parametrize(
    ("decided", "said"),
    [
        ({"chosen": "A"}, ["Decided for A."]),
        ({"chosen": "A", "agree": ["Ann"], "date": "2026-01-04"}, ["Decided on 2026-01-04 for A by Ann."]),
        ({"chosen": "A", "dissent": ["Ben"]}, ["Decided for A.", "Dissent: Ben."]),
        ({"chosen": "B"}, ["Decided for B.", "B is beyond price at most 2 (3)."]),
        ({"chosen": "Q"}, ["Decided for Q.", "Q is not among these designs."]),
    ],
)  # fmt: skip
def test_decisions_of_groups_may_be_written_by_hand(decided, said, tmp_path):
    path = tmp_path / "d.json"
    path.write_text(json.dumps({"decided": decided}))
    frame = pd.DataFrame({"price": [1.0, 3.0], "days": [2.0, 1.0]}, index=["A", "B"])
    decision = Decision(Formulation(limits={"price": 2}), decided=Decision.read_json(path).decided)
    assert decision_sentences(read_table(frame, decision)) == said
    for wrong in ({"agree": ["Ann"]}, decided | {"agreed": ["Ann"]}, decided | {"agree": "Ann"}):
        path.write_text(json.dumps({"decided": wrong}))
        refused("must be a decision.*decided: .*", Decision.read_json, path)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: beam_tests().under(Formulation(["mass"], maximize=["gain"])), "maximize must be one of 'mass', got 'gain'; only objectives"),
        (lambda: beam_tests().under(Formulation(maximize=["gian"]), objectives=["mass", "gain"]), "maximize must be one of 'gain', 'mass', got 'gian'; did you mean 'gain'"),
        (lambda: beam_tests().under(Formulation(ranges={"mass": (0, 9)}), objectives=["mass", "heat"]), "ranges must be of every objective"),
        (lambda: beam_tests().under(Formulation(computed={"heat": "mass"})), "a name in computed must be unlike other columns, got 'heat'"),
        (lambda: beam_tests().under(limit={"mass": 1}), "got 'limit'; did you mean 'limits'"),
        (lambda: Decision("mass<=1"), "formulation must be of type Formulation, got str"),
        (lambda: write_table("tests.csv", beam_tests()), "table must be of type TestTable, got str"),
        (lambda: beam_tests().under({}), "formulation must be of type Formulation, got dict"),
        (lambda: TWO.under(computed={"loss": "head + 1"}), "must be one of 'f1', 'f2', 'x1', got 'head'"),
        (lambda: TWO.with_notes({"pi": ["A", "B"]}).under(computed={"area": "pi * f1"}), "'pi' holds 'A'"),
        (lambda: limits_of("price<=50 range>=300"), "join limits by commas"),
    ],
)  # fmt: skip
def test_what_a_table_does_not_have_is_refused(call, message):
    refused(message, call)


def test_what_is_computed_keeps_a_limit_that_it_has_in_decimals():
    table = TestTable.of([1, 2], [[0.1], [0.5]], [[0.1, 0.2], [0.1, 0.3]])
    asked = table.under(objectives=["f1", "sum"], computed={"sum": "f1 + f2"}, limits="sum<=0.3")
    assert asked.feasible().tolist() == [True, False]
    greatest = table.with_outputs({"f3": [np.finfo(float).max, 1.0]})
    assert greatest.under(objectives=["s"], computed={"s": "f3"}).feasible().all()


def test_ranges_are_fixed_kept_or_given_up():
    """None are those of the tests, empty ones those of the Pareto set."""
    table, fixed = beam_tests(), {"mass": [0, 10], "gain": [-5, 5]}
    wide = table.under(Formulation(ranges=fixed))
    # fixed ranges are (lower, upper) in the original direction: of gain the ideal is 5
    F = np.column_stack([table.column("mass"), table.column("gain")])[table.pareto()]
    mu1 = np.hypot(F[:, 0] / 10, (5 - F[:, 1]) / 10)
    np.testing.assert_allclose(wide.ranking().criteria[:, 0], mu1)
    assert wide.under(Formulation()).equals(wide)
    assert wide.under(limits={"width": 1}).ranking().ideal.tolist() == [0, 5]
    assert wide.under(Formulation(ranges={})).equals(table)
    assert wide.under(objectives=[*fixed]).fixed_ranges == wide.fixed_ranges
    # fixed for other objectives, they say nothing
    heat = Formulation(objectives=["mass", "heat"])
    assert wide.under(heat).equals(table.under(heat))
    for stated in (None, Formulation(maximize=["gain"], ranges=fixed)):
        assert wide.under(stated, objectives=["mass", "heat"]).equals(table.under(heat))


def test_units_of_a_decision_are_those_of_its_limits():
    table = TestTable.of([1, 2], [[0.1], [0.5]], [[1.0], [90.0]])
    asked = Formulation(units={"f1": "%", "x1": "mm"}, limits={"f1": 80})
    under = table.under(asked)
    assert under.schema.units == {"f1": "%", "x1": "mm"}
    assert under.status.tolist() == ["ok", "infeasible"]
    metres = replace(table, evaluated=table.schema.with_units({"x1": "m"}))
    refused("unit of 'x1' must be that of the formulation, mm, got 'm'", metres.under, asked)


TWO = TestTable.of([1, 2], [[0.1], [0.5]], [[1.0, 4.0], [2.0, 3.0]])


OFFERS = pd.DataFrame(
    {
        "price": [3.0, 2.0, 1.0, 4.0],
        "days": [1.0, 2.0, 3.0, 4.0],
        "rail": ["yes", "no", "yes", None],
        "material": ["alu", "steel", "tin", "alu"],
        "coated": [True, False, False, True],
    }
)


@pytest.mark.parametrize(
    ("limits", "kept"),
    [
        ({"rail": "yes"}, [0, 2]),
        ("rail=yes", [0, 2]),
        ({"material": ["steel", "alu"]}, [0, 1, 3]),
        ("material in steel, alu, price<=3", [0, 1]),
        (["price<=3", "material in steel, alu"], [0, 1]),
        ({"rail": ["yes", ""], "price": (2, None)}, [0, 3]),
        ({"rail": []}, []),
        ({"coated": True}, [0, 3]),
        ({"coated": np.False_, "price": 1}, [2]),
        ("coated in True, False, price<=3", [0, 1, 2]),
    ],
)
def test_limits_on_texts(limits, kept):
    asked = Formulation(["price", "days"], limits=limits)
    for table in (
        read_table(OFFERS, asked),
        read_table(OFFERS, asked, variables=["coated"]),
        read_table(OFFERS, Formulation(["price", "days"])).under(limits=limits),
    ):
        assert np.flatnonzero(table.feasible()).tolist() == kept
        np.testing.assert_array_equal(table.violations()[0].any(axis=1), ~table.feasible())


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"rail": "yez"}, "must be one of '', 'no', 'yes', got 'yez'; did you mean 'yes'?"),
        ({"price": "yes"}, "numbers"),
        ("price=3", "numbers"),
        ("colour=red", "colour"),
        ("rail=yes, rail=no", "once"),
        ("rail=yes, rail<=3", "given once for a column of texts"),
    ],
)
def test_limits_on_texts_that_do_not_fit(limits, said):
    refused(
        re.escape(said),
        lambda: read_table(OFFERS, Formulation(["price", "days"], limits=limits)),
        error=ArgumentValueError,
    )


def test_a_number_as_a_limit_on_true_and_false_is_refused():
    table = read_table(OFFERS, Formulation(["price", "days"]), variables=["coated"])
    message = r"'coated', which is true or false, .* got 1; say \(1, None\) for at least or"
    refused(message, table.under, limits={"coated": 1})
    assert table.under(limits={"coated": (None, 0)}).feasible().tolist() == [
        False,
        True,
        True,
        False,
    ]


# Names and texts that look like parts of a limit.
parts = st.lists(st.sampled_from(["in", "5", "1e3", "x", ",", '"', "a,b", " ", "é"]), min_size=1)
words = (
    parts.map(" ".join)
    .map(lambda text: " ".join(text.split()))
    .filter(lambda text: text and not re.search(r"(^|\s)in(\s|$)|^[\de]+$", text))
)
ends = st.floats(allow_nan=False, allow_infinity=False)
pairs = st.one_of(ends, ends.map(lambda low: (low, None)), st.tuples(ends, ends).map(sorted))


@given(
    limits=st.dictionaries(
        words,
        st.one_of(pairs, st.lists(words, min_size=1, max_size=4, unique=True) | st.just([""])),
        min_size=1,
        max_size=4,
    )
)
@example(limits={'"a': 1.25, "x y": (1.0, None), "time, s": (-12.125, 1e-7)})
@example(limits={'the "time", in s': (999.999, None), "rail": ["a, b", 'the "c", d']})
def test_what_is_written_is_read_back(limits):
    limits = {name: Limit.of(name, value) for name, value in limits.items()}
    text = ", ".join(limit.written(name) for name, limit in limits.items())
    expected = {name: limit._replace(is_bare=False) for name, limit in limits.items()}
    assert limits_of(text) == expected


@pytest.mark.parametrize(
    "limits", ["f1<=1.250, f1>=-1", {"f1": ">= -1, <= 1.250"}, {"f1": (-1, 1.25)}]
)
def test_numbers_in_texts_have_a_decimal_point(limits):
    assert limits_of(limits) == {"f1": Limit(-1.0, 1.25)}


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (Decision(reason="x"), Decision(), Decision(reason="x")),
        (Decision(reason="x"), Decision(chosen="A", reason="cheap"), Decision(chosen="A", reason="x")),
        (Decision(), Decision(chosen="A", reason="cheap"), Decision(chosen="A", reason="cheap")),
    ],
)  # fmt: skip
def test_a_reason_without_a_choice_is_kept(one, other, expected):
    assert one.combine_first(other) == expected
