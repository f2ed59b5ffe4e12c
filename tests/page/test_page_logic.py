"""The logic of the page in Node against Python on the same designs: the same answers."""

import json
import os
import random
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import Preferences, compare_designs, explain, rank_of_efficiency
from pymoo_psi._numbers import NumberFormat, percents
from pymoo_psi.analysis import separation_sentences, switching_sentences, switching_values
from pymoo_psi.files import read_table
from pymoo_psi.page import decision_page
from pymoo_psi.pareto import SENTENCES, nondominated
from pymoo_psi.selection import ReferencePoint
from pymoo_psi.table import Decision, Formulation
from tests.helpers.asked import kept_by_hand
from tests.helpers.documents import payload_of, script_of
from tests.helpers.folders import write_files
from tests.helpers.fronts import on_sphere
from tests.helpers.processes import printed_by

HOSTILE = [
    '{"__proto__": {"dominated": true}, "constructor": {"prototype": {"dominated": true}}}',
    '{"limits": {"toString": [0, 1], "hasOwnProperty": [0, 1], "valueOf": null}}',
    '{"limits": {"f3": [2, 1], "x": ["1", null], "heat": [null, 1, 2], "kind": [0, 1]}}',
    '{"limits": {"f3": [1e999, null], "x": ["1"], "kind": "steel"}}',
    '{"pins": {"length": 3}, "chosen": {"toString": 1}, "kept": 5, "ranks": [7]}',
    '{"pins": [1, null, {}], "chosen": "nobody", "sorted": ["heat"]}',
    '{"sorted": "absent", "reason": 5, "axes": {"order": "x"}}',
    '{"weights": {"f3": -1, "x": 1}, "aspiration": {"f3": "1"}}',
]
# What was typed, and how it is read; None: not.
TYPED = {
    "": None, " 1.5 ": 1.5, "1,5": 1.5, "\u22122e3": -2000.0, "0.125": 0.125, ".5": 0.5,
    "58.375": 58.375, "0,001": 0.001, "1.250e2": 125.0, "58,375": None, "1,234.5": 1234.5, "1.234,5": 1234.5, "1,234,5": None,
    "1 000": 1000.0, "12 34": None, "1.2.3": None, "1e999": None, "five": None, "0x10": None, "Infinity": None,
}  # fmt: skip
pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")


def in_node(cases):
    """Return what the logic answers to cases, see logic_driver.js."""
    driver = Path(__file__).with_name("logic_driver.js")
    asked = json.dumps({"script": script_of(decision_page(np.eye(2))), "cases": cases})
    return json.loads(printed_by("node", driver, input=asked))


class Case:
    """Random designs, and states in which they are looked at."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.seed, self.rng = seed, rng
        self.m = int(rng.integers(2, 9)) if seed else 4
        n = int(rng.integers(30, 160))
        F = self.values(rng, n, seed % 5)
        self.names = [f"f{j + 1}" for j in range(self.m)]
        self.maximize = [name for name in self.names if rng.random() < 0.4]
        if seed == 1:  # names that are properties of every object of JavaScript
            self.names[:2] = ["__proto__", "constructor"]
            self.maximize = ["__proto__"]
        frame = pd.DataFrame(F, columns=self.names)
        frame["x"] = rng.random(n)
        frame["kind"] = rng.choice(["steel", "=1+1", 'a "b", c', ""], n)
        frame["heat"] = np.where(rng.random(n) < 0.2, np.nan, rng.random(n))
        frame.index = pd.Index([f"design {k + 1}" for k in rng.permutation(n)], name="number")
        self.frame = frame
        self.normalize = bool(seed % 4)
        self.prototype = {name: float(F[0, j]) for j, name in enumerate(self.names)}
        self.units = {self.names[0]: "kg"}
        asked = Formulation(
            self.names, maximize=self.maximize, normalize=self.normalize, units=self.units
        )
        self.page = decision_page(
            read_table(frame, asked, variables=["x", "kind"], drop_incomplete=True),
            prototype=pd.DataFrame([self.prototype], ["prototype"]) if seed % 2 else None,
            title=f"set {seed}",
        )
        self.payload = payload_of(self.page)
        self.whole = self.ranking(np.arange(n))
        self.states = [self.state(k) for k in range(4)]
        self.rows = [self.rng.integers(0, n, 4).tolist() for _ in self.states]
        self.pins = [self.rng.choice(n, 4, replace=False).tolist() for _ in self.states]

    def ranking(self, rows, state=None):
        """Rank rows as a state asks for it: by their own ranges, or by those of all designs."""
        ends = {}
        if state is not None and state["fixed"]:
            ends = {"ideal": self.whole.ideal, "nadir": self.whole.nadir}
        left = self.frame.iloc[rows][self.names]
        return rank_of_efficiency(left, normalize=self.normalize, maximize=self.maximize, **ends)

    def values(self, rng, n, kind):
        unit = on_sphere(rng, n, self.m)
        # Noise of rounding, signs, sizes that differ.
        digits = rng.integers(1, 5, (n, self.m)) * (1 + rng.integers(-3, 4, (n, self.m)) * 1.2e-16)
        # A convex front, one criterion constant, dominated rows.
        convex = (1.3 - unit) ** 2 + 0.5 * rng.random((n, 1)) ** 4
        convex[:, -1] = 3.0
        penalized = rng.random((n, self.m))
        penalized[:2, 1] = 1e30
        return [
            1 - unit + 0.2 * rng.random((n, 1)) ** 3,  # a sphere: all of the front equally near
            rng.integers(0, 4, (n, self.m)).astype(float),  # ties and duplicates
            (digits - 2.5) * 10.0 ** rng.integers(-9, 9, self.m),
            convex,
            penalized,
        ][kind]

    def state(self, k):
        rng, frame = self.rng, self.frame
        limits = {}
        for name in rng.choice([*self.names, "x", "heat"], size=k, replace=False):
            low, high = np.sort(rng.choice(frame[name].dropna(), 2)).tolist()
            limits[str(name)] = [(None, high), (low, None), (low, high)][rng.integers(3)]
        if k == 3:
            limits["kind"] = ["", "steel"]
        labels = frame.index.tolist()
        return {
            "limits": limits,
            "fixed": k == 1 and self.seed % 5 != 2,  # whose ideal differs by rounding
            "dominated": True,
            "pins": labels[:3],
            "chosen": labels[0],
            "sorted": [None, None, None, "heat"][k],
            "weights": {n: float(rng.integers(0, 4)) + 0.5 for n in self.names[: k + 1]},
            "aspiration": {n: float(rng.choice(frame[n])) for n in self.names[k:]},
            "positions": [self.position(name, k) for name in ("Ann", "Ben", "Cy", "Ann")],
            "decided": {"date": "2026-02-01", "chosen": labels[0], "agree": ["Ann"], "dissent": []},
            "reason": "Größe \u2028 </script>",
        }

    def position(self, name, k):
        rng, frame = self.rng, self.frame
        optimal = np.flatnonzero(self.whole.pareto)
        limits = {}
        for column in rng.choice([*self.names, "x"], size=k, replace=False):
            value = float(rng.choice(frame[column].dropna()))
            limits[str(column)] = [(None, value), (value, None)][rng.integers(2)]
        if k == 2:
            limits["kind"] = ["steel", ""]
        return {
            "name": name,
            "date": f"2026-01-{rng.integers(10, 30)}T{rng.integers(10, 24)}:00:00.000Z",
            "chosen": str(frame.index[rng.choice(optimal)]),
            "limits": limits,
            "weights": {n: float(rng.integers(0, 4)) for n in self.names[:k]},
            "aspiration": {n: float(rng.choice(frame[n])) for n in self.names[-k:]} if k else {},
            "reason": f"{name}'s",
        }

    def mask(self, state):
        return kept_by_hand(len(self.frame), self.frame.get, state["limits"])

    def table(self, positions=(), **formulation):
        """The designs as Python reads them, under limits, ranges or positions."""
        asked = Formulation(
            self.names,
            maximize=self.maximize,
            normalize=self.normalize,
            units=self.units,
            **formulation,
        )
        return read_table(self.frame, Decision(asked, positions=positions), variables=["x"])

    def ranges(self, state):
        """The ranges of all designs in a state that fixes them, as Python reads them."""
        ends = np.sort([self.whole.ideal, self.whole.nadir], axis=0).T.tolist()
        return dict(zip(self.names, ends, strict=True)) if state["fixed"] else None

    def asked(self):
        return {
            "payload": self.payload,
            "states": self.states,
            "rows": self.rows,
            "pins": self.pins,
            "texts": HOSTILE,
            "typed": list(TYPED),
            "thorough": [self.is_thorough(k) for k in range(4)],
        }

    def is_thorough(self, k):
        """Whether switching values and positions of a state are compared."""
        return (self.seed + k) % EVERY == 0


# Four states each; each kind of values with and without normalising and a prototype. By hand 300
# states, all of them with switching values and positions: PAGE_SEEDS=75 python -m pytest ...
SEEDS = range(int(os.environ.get("PAGE_SEEDS", "10")))
EVERY = 2 if len(SEEDS) == 10 else 1  # state has its switching values and positions compared


@pytest.fixture(scope="module")
def cases():
    return [Case(seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def answers(cases):
    return in_node([case.asked() for case in cases])


@pytest.fixture(scope="module")
def rankings(cases, answers):
    """For each state with designs left: case, state, answer, rows left, Python's ranking."""
    return list(ranked(cases, answers))


def answered(cases, answers):
    """Each case with the number of one of its states and the answer to it."""
    for case, answer in zip(cases, answers, strict=True):
        for k, found in enumerate(answer["states"]):
            yield case, k, found


def ranked(cases, answers):
    for case, k, found in answered(cases, answers):
        rows = np.flatnonzero(case.mask(case.states[k]))
        if len(rows):
            yield case, k, found, rows, case.ranking(rows, case.states[k])


def person_of(case, k):
    """A person of hidden weights who has answered questions on the designs of a state."""
    state = case.states[k]
    person = Preferences(case.table(limits=state["limits"], ranges=case.ranges(state)))
    rng = np.random.default_rng(case.seed)
    losses = person.ranking.frame.scaled(person.ranking.objectives.minimized) @ rng.random(case.m)
    said = []
    for _ in range(6):
        pair = person.question()
        said.append((person.best, person.regret, person.shares, pair))
        if pair is None:
            break
        better, worse = sorted(pair, key=lambda name: losses[person.ranking.row_of(name)])
        relation = rng.choice([">", ">", ">", "=", "?"])
        person.add(*((worse, ">", better) if rng.random() < 0.3 else (better, relation, worse)))
        if len(said) == 5:  # all answers are contradicted
            for one, _, other in person.answers:
                said.append((person.best, person.regret, person.shares, person.question()))
                person.add(other, ">", one)
    return person, said


@pytest.fixture(scope="module")
def persons(cases):
    """A case, a person, and what was said; of the states with all kinds of designs."""
    found = []
    for case in cases:
        for k in (case.seed % 2, case.seed % 2 + 2)[: 1 + case.seed // 2 % 2]:
            if case.mask(case.states[k]).any():
                found.append((case, k, *person_of(case, k)))
    return found


def test_questions_and_what_answers_say_are_those_of_python(persons):
    answers = in_node(
        [
            {"payload": case.payload, "state": case.states[k], "answers": person.answers}
            for case, k, person, _ in persons
        ]
    )
    n_asked = 0
    for (case, _, person, said), found in zip(persons, answers, strict=True):
        names = case.frame.index.astype(str)
        for (best, regret, shares, pair), one in zip(said, found["said"], strict=False):
            assert names[one["row"]] == best
            assert one["regret"] == pytest.approx(regret, abs=1e-7)
            kept = {names[row]: share for row, share in one["shares"] if share > 1e-12}
            positive = np.flatnonzero(shares > 1e-12)
            assert kept == pytest.approx({person.ranking.name_of(i): shares[i] for i in positive})
            texts = zip(person.ranking.objectives.labels, percents(shares), strict=True)
            assert {(names[row], text) for row, text in one["texts"]} <= {*texts}
            asked = one["question"]
            assert (asked and tuple(names[row] for row in asked)) == pair
            n_asked += pair is not None
    assert n_asked > 30


def test_states_keep_the_designs_of_python_and_come_back_from_files(cases, answers):
    """Limits on numbers and on texts; Python reads the same from the decision of the page."""
    for case, k, found in answered(cases, answers):
        mask = case.mask(case.states[k])
        assert found["mask"] == [*mask.astype(int).tolist(), *[1] * (case.seed % 2)]
        assert (found["count"], found["remarks"]) == (mask.sum(), [])
        assert found["opened"] == {"state": found["state"], "remarks": []}
        expected = json.loads(json.dumps(case.states[k]))
        for key in ("limits", "pins", "chosen", "weights", "aspiration", "reason", "decided"):
            assert found["state"][key] == expected[key]
        decision = {**json.loads(found["written"]), "ranges": None}
        assert decision.pop("version") == 1
        table = read_table(case.frame, Decision.from_dict(decision), variables=["x"])
        assert table.feasible().tolist() == mask.tolist()


def test_places_and_order_are_those_of_python(rankings):
    freed = tied = 0
    for case, k, found, rows, ranking in rankings:
        assert [found["place"][i] for i in rows] == ranking.place.tolist()
        assert not any(found["place"][len(case.frame) :])  # of prototypes
        tied += ranking.pareto.sum() - len(set(ranking.place[ranking.pareto]))
        assert [found["pareto"][i] for i in rows] == ranking.pareto.astype(int).tolist()
        optima = [rows[ranking.pareto].tolist(), rows[ranking.salukvadze].tolist()]
        assert [found["front"], found["best"]] == optima
        ends = [ranking.ideal, ranking.nadir]
        np.testing.assert_allclose([found["ideal"], found["nadir"]], ends, rtol=1e-14)
        distances = np.array(found["mu1"], dtype=float)[rows]
        np.testing.assert_allclose(distances, ranking.criteria[:, 0], rtol=1e-12)
        freed += (ranking.pareto & ~case.whole.pareto[rows]).sum()
        shown = found["order"][case.seed % 2 :]
        assert sorted(shown) == rows.tolist()
        at = np.searchsorted(rows, shown)
        if k < 3:  # distances of dominated designs that are equal up to rounding stand either way
            n = ranking.pareto.sum()
            assert at[:n].tolist() == ranking.by_place[:n].tolist()
            mu1 = ranking.criteria[at[n:], 0]
            assert (np.diff(mu1) >= -1e-12 * np.maximum(mu1[1:], 1)).all()
    assert freed > 50  # dominated designs whose dominators are rejected
    assert tied > 200


class Drag:
    """Designs that lose all dominators under limits on variables, and what a slider passes."""

    def __init__(self, m):
        rng = np.random.default_rng(m)
        n = 4200 if m == 8 else 500  # from 4096 on sorted by their bits
        F = (1.2 - on_sphere(rng, n, m)) ** 1.5
        frame = pd.DataFrame(rng.random((n, 2)), columns=["x", "y"])
        # The front lies where x is least, as in ZDT's problems, and crosses the whole range of y.
        F += 0.3 * frame[["x"]].to_numpy()
        if m % 2:  # ties and duplicates; a column of few values fills parts of its order alone
            F = np.round(F, 2)
            F[:, 0] = np.round(F[:, 0], 1)
        if m == 6:
            F[:, 1] = 2.0
        F[:20, 0] = np.nan  # failed
        frame.loc[::9, "y"] = np.nan
        # Signs, sizes, missing values, ties, also of both zeros, and differences in the last digits.
        wild = rng.choice([-1.0, 0.0, -0.0, 1.0, np.nan], n) * 10 ** rng.uniform(-300, 300, n)
        frame["heat"] = np.where(rng.random(n) < 0.5, wild, 1 + rng.integers(0, n, n) * 1e-15)
        names = [f"f{j + 1}" for j in range(m)]
        frame[names] = F
        self.names, self.frame = names, frame.iloc[20:]
        self.page = decision_page(
            read_table(frame, Formulation(names), variables=["x"], drop_incomplete=True)
        )
        down = [{"y": [None, end]} for end in (0.9, 0.85, 0.8, 0.5, 0.55, 0.95)]
        up = [{"x": [end, None]} for end in (0.05, 0.1, 0.3, 0.25, 0.7, 0.1)]
        both = [{"x": [0.2, 0.9], "y": [end, None]} for end in (0.1, 0.6, 0.2)]
        front = {"f1": [float(np.nanquantile(F[:, 0], 0.4)), None], "x": [0.1, None]}
        self.limits = [*down, *up, {}, *both, front, {"x": [0.99, None]}, {"x": [0.0, None]}]

    def asked(self):
        view = {"dominated": True, "sorted": "heat"}
        states = [{"limits": one, **view} for one in self.limits]
        return {"payload": payload_of(self.page), "states": states}

    def left(self, limits):
        return np.flatnonzero(kept_by_hand(len(self.frame), self.frame.get, limits))


def test_designs_whose_dominators_are_rejected_are_found_among_many():
    """Each state against Python, whatever was looked at before; sorted by a column, too."""
    freed, drags = 0, [Drag(m) for m in (2, 3, 6, 8)]
    for drag, answers in zip(drags, in_node([drag.asked() for drag in drags]), strict=True):
        whole = set(answers[drag.limits.index({})]["front"])
        heat = drag.frame["heat"].to_numpy()
        for limits, found in zip(drag.limits, answers, strict=True):
            rows = drag.left(limits)
            left = drag.frame.iloc[rows][drag.names]
            assert found["front"] == rows[nondominated(left.to_numpy())].tolist()
            assert [found["place"][i] for i in rows] == rank_of_efficiency(left).place.tolist()
            assert found["order"] == rows[np.argsort(heat[rows], kind="stable")].tolist()
            freed += len(set(found["front"]) - whole)
    assert freed > 500


def test_explanations_and_comparisons_are_those_of_python(rankings):
    for case, k, found, rows, ranking in rankings:
        best, units = int(ranking.salukvadze[0]), case.units
        why = explain(ranking, row=best, units=units)
        verdict, design = found["verdict"], ranking.name_of(best)
        merit = SENTENCES["optimum"].format(design=design, best=verdict["merit"])
        said = f"{merit} {verdict['ties']}".strip()
        assert (verdict["row"], said) == (rows[best], why.sentences[0])
        for row, one, instead in zip(
            case.rows[k], found["explained"], found["instead"], strict=True
        ):
            if row not in rows:
                continue
            at = int(np.searchsorted(rows, row))
            why = explain(ranking, row=at, units=units)
            # The rows of the page have the shares.
            costs = re.sub(r" \([^()]* %( of its (fixed )?range)?\)", "", why.sentences[1])
            assert one["costs"] == costs
            for step, text in zip(one["steps"], why.sentences[2:], strict=True):
                parts = [step[part] for part in ("better", "worse") if step[part]]
                assert text.endswith(f": {'. But '.join(parts)}.")
            shares = np.array(one["shares"], dtype=float)
            np.testing.assert_allclose(shares, why.shares, rtol=1e-12, atol=1e-13)
            two = compare_designs(ranking, rows=[best, at], units=units)
            parts = {"design": ranking.name_of(at).capitalize(), "other": ranking.name_of(best)}
            expected = SENTENCES["instead"].format(difference=two.difference(1), **parts)
            assert instead == ("" if at in ranking.salukvadze else expected)
        if {*case.pins[k]} <= {*rows.tolist()}:
            pins = np.searchsorted(rows, case.pins[k]).tolist()
            two = compare_designs(ranking, rows=pins, units=units)
            for k, pinned in enumerate(found["compared"], start=1):
                assert np.sign(pinned["gains"]).tolist() == np.sign(two.gains[k]).tolist()
                shares = np.array(pinned["shares"], dtype=float)
                np.testing.assert_allclose(shares, two.shares[k], rtol=1e-12)


def test_without_limits_designs_are_measured_by_the_same_fixed_ranges(cases):
    """Else limits that are not there were said to have changed the proposal."""
    n_remarks = 0
    asked, ranges = [], []
    verdict_only = {"rows": [[]] * 4, "pins": [[]] * 4, "texts": [], "thorough": [False] * 4}
    for case in cases:
        low, high = case.frame[case.names].agg(["min", "max"]).to_numpy()
        wide = [low - np.linspace(0.3, 1, case.m) * (high - low), high + 0.1]
        ranges.append(dict(zip(case.names, np.transpose(wide).tolist(), strict=True)))
        payload = case.payload | {"opens_with": case.payload["opens_with"] | {"ranges": ranges[-1]}}
        states = [state | {"fixed": True} for state in case.states]
        asked.append(case.asked() | verdict_only | {"payload": payload, "states": states})
    for (case, k, found), fixed in zip(
        answered(cases, in_node(asked)), np.repeat(ranges, 4), strict=True
    ):
        if found["verdict"] is None:
            continue
        whole = case.table(ranges=fixed).ranking()
        first = whole.name_of(int(whole.salukvadze[0]))
        left = case.table(ranges=fixed, limits=case.states[k]["limits"]).feasible_ranking()
        shares = np.array(found["verdict"]["shares"], dtype=float)
        np.testing.assert_allclose(shares, explain(left).shares, rtol=1e-12, atol=1e-13)
        remark = found["verdict"]["remark"]
        if first in map(left.name_of, left.salukvadze):
            assert remark == ""
        else:
            assert remark.startswith(f"Without the limits {first} is proposed")
            n_remarks += 1
    assert n_remarks > 5


def test_switching_values_and_what_separates_positions_are_those_of_python(rankings):
    compared = changed = n_regrets = 0
    for case, k, found, *_ in rankings:
        state = case.states[k]
        if not case.is_thorough(k):
            continue
        table = case.table(limits=state["limits"], ranges=case.ranges(state))
        limits = switching_values(table)
        told = {(one["name"], one["end"], one["looser"]): one for one in found["switches"]["rows"]}
        assert len(told) == len(limits)
        for row in limits.itertuples():
            one = told[row.column, int(row.end == "upper"), row.direction == "looser"]
            design = case.payload["names"][one["row"]] if one["row"] >= 0 else None
            value = None if np.isnan(row.value) else row.value
            assert (one["value"], design, one["isExact"]) == (value, row.design, True)
            changed += row.design is not None
        compared += len(limits)
        positions = found["state"]["positions"]
        held = case.table(limits=state["limits"], ranges=case.ranges(state), positions=positions)
        separating = separation_sentences(held)
        assert found["separation"] == separating
        n_regrets += any("At worst" in text for text in separating)
        said = "".join(switching_sentences(table))
        for text in found["switches"]["texts"]:
            assert text in said
            said = said.replace(text, "", 1)
        assert re.fullmatch("(Tighter|Looser|limits|[:;. ])*", said), said
    assert compared > 130
    assert changed > 60
    assert n_regrets > 6


def test_where_nothing_is_left_a_way_back_is_said(cases, answers):
    for case, k, found in answered(cases, answers):
        state = case.states[k]
        rows = found["switches"]["rows"] if not found["count"] else []
        for one in rows:
            if one["looser"] and one["next"] is not None:
                pair = list(state["limits"][one["name"]])
                pair[one["end"]] = one["next"]
                wider = case.mask(state | {"limits": state["limits"] | {one["name"]: pair}})
                assert wider[one["row"]]


def test_numbers_of_two_readings_are_refused(answers):
    found = dict(zip(TYPED, answers[0]["typed"], strict=True))
    assert {text: one.get("value") for text, one in found.items()} == TYPED
    refused = {text for text, one in found.items() if "wrong" in one}
    assert refused == {text for text, value in TYPED.items() if value is None and text}


def test_preferences_choose_what_reference_point_chooses(rankings):
    for case, k, found, rows, ranking in rankings:
        wish = case.states[k]
        weights = [wish["weights"].get(name, 1.0) for name in case.names]
        ideal = dict(zip(case.names, ranking.ideal, strict=True))
        point = [wish["aspiration"].get(name, ideal[name]) for name in case.names]
        if case.states[k]["fixed"]:  # selectors measure by the ranges of what they choose from
            continue
        selector = ReferencePoint(point, weights=weights, normalize=case.normalize)
        chosen = selector.do(case.frame.iloc[rows][case.names], maximize=case.maximize)
        assert found["preferred"] == rows[chosen].tolist()


def test_a_decision_about_something_else_is_not_opened(answers):
    """As the commands refuse it: its limits would mean something else here."""
    for answer in answers:
        assert answer["foreign"][:4] == [answer["initial"]] * 4
        assert len(answer["foreign"]) == 14
        for one in answer["foreign"][4:]:
            assert one["state"] is None
            assert "other objectives, directions, units" in one["remarks"][0]


def opened(case, **changes):
    """The state in which a page opens with other entries of a decision, and what it says."""
    opens_with = case.payload["opens_with"] | changes
    asked = case.asked() | {"states": [], "payload": case.payload | {"opens_with": opens_with}}
    (answer,) = in_node([asked])
    return answer["initial"]


def test_what_a_page_opens_with_is_checked(cases):
    """Entries that no longer fit are reported; people keep what they hold."""
    case = cases[0]
    name, first = case.names[0], case.payload["names"][0]
    by_hand = {"name": "Ann", "limits": {name: 5, "x": [0, None]}}
    held = Decision(
        positions=[by_hand, {"name": "Ben " * 20 + "B", "chosen": "ghost"}],
        decided={"chosen": first},
    )
    found = opened(case, positions=held.positions, decided=held.decided)
    assert (found["remarks"], found["state"]["decided"]) == ([], held.decided)
    of_ann, of_ben = found["state"]["positions"]
    assert of_ann["limits"] == {name: [None, 5], "x": [0, None]}
    assert of_ben == held.positions[1]
    # A command writes no owners: a reason is that of who has a position with it.
    by_command = {"chosen": first, "reason": "Proposed after 1 answer."}
    said = opened(case, **by_command, positions=[{"name": "Dan", **by_command}])
    assert said["state"]["owners"] == {"reason": "Dan"}
    cy = {"name": "Cy", "date": "1 May 2026", "weights": {name: 2.0, "gone": 1.0}}
    pins = case.payload["names"][:5]
    gone = {"pins": ["nobody", *pins], "weights": {"gone": 1}}
    found = opened(case, page={"state": gone}, positions=[cy])
    lost = "Not applied, as it does not fit these designs: pins, positions (date), positions (weights), weights."
    assert (found["remarks"], found["state"]["pins"]) == ([lost], pins)
    assert found["state"]["positions"][0]["weights"] == {name: 2.0}


def test_dates_and_the_order_of_positions_are_those_of_python(cases):
    dates = [
        *("", "2026-05-01", "2028-02-29", "2026-05-01 10:30", "2026-05-01T10:30Z"),
        *("2026-05-01T23:59:59", "2026-05-01T10:30:00.5", "2026-05-01T08:30:00.49Z"),
        *("2026-05-01 12:30:00.50+02:00", "2026-05-01T10:30:00.12-23:59", "0099-12-31"),
    ]
    held = [{"name": f"on {date}", "date": date} for date in dates]
    # Several positions of a person at one time, too: all in the order of Python.
    held += [
        {"name": name, "date": date, "chosen": chosen}
        for name in ("Ann", "Ann B", "Ann!", "Ben")
        for date in ("", "2026-01-02", "2026-01-02T09:00", "2026-01-02 08:00:00.500Z")
        for chosen in (*cases[0].payload["names"][:2], None)
    ]
    random.Random(1).shuffle(held)
    found = opened(cases[0], positions=held)
    assert (found["remarks"], found["state"]["positions"]) == (
        [],
        Decision(positions=held).positions,
    )


def test_numbers_are_written_as_python_writes_them(cases):
    dice = random.Random(3)
    numbers = [
        *((0, False, -0.31415), (2, False, -0.001), (3, True, 1.2345)),
        *((3, True, 0.0), (3, True, -0.0), (0, False, -0.0)),
    ]
    for _ in range(3000):  # halves of a digit are frequent, as in points of LPtau
        value = dice.choice([-1, 1]) * dice.randrange(1, 2**14) / 2 ** dice.randrange(20)
        numbers.append((dice.randrange(9), dice.random() < 0.3, value))
    formats = [(NumberFormat(*kind, minus="\N{MINUS SIGN}"), value) for *kind, value in numbers]
    asked = {"states": [], "numbers": [(one.pattern, value) for one, value in formats]}
    (answer,) = in_node([cases[0].asked() | asked])
    assert answer["numbers"] == [number_format.text(value) for number_format, value in formats]


def test_hostile_states_change_nothing(cases, answers):
    for answer in answers:
        for text, found in zip(HOSTILE, answer["checked"], strict=True):
            assert found["state"] == answer["initial"]["state"], text
            # An entry that no state has is not even looked at.
            assert bool(found["remarks"]) != ('"__proto__": {' in text), text
        assert not answer["polluted"]


def test_a_csv_comes_back_with_objectives_and_directions(cases, answers, tmp_path):
    for case, _, found, *_ in ranked(cases[:8], answers[:8]):
        path = tmp_path / "left.csv"
        write_files(
            tmp_path, {path.name: found["csv"], f"{path.name}-metadata.json": found["metadata"]}
        )
        table = read_table(path)
        schema = table.schema
        assert (schema.objectives, {*schema.maximize}) == (tuple(case.names), {*case.maximize})
        assert schema.units == case.units
        chosen = found["state"]["chosen"]
        reason = "" if chosen is None else found["state"]["reason"]
        assert (table.decision.chosen, table.decision.reason) == (chosen, reason)
        expected = case.frame.iloc[found["order"][case.seed % 2 :]][case.names]
        np.testing.assert_array_equal(table.F * schema.sign, expected)
        places = pd.read_csv(path)["place"].fillna(0)
        assert places.tolist() == [found["place"][row] for row in found["order"]]
