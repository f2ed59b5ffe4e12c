"""Random runs in one study, against a dictionary as oracle.

Whatever runs a study has, and in whatever order: every design is evaluated once, all values are
those of the model, every run has the points that it would have alone, and the study has what was
evaluated.
"""

import math
import zlib
from collections import Counter
from contextlib import suppress

import numpy as np
import pytest
from pymoo.core.problem import Problem
from pymoo.core.variable import Binary, Choice, Integer, Real
from pymoo.optimize import minimize

from pymoo_psi import (
    PSI,
    FailureTolerant,
    Recorded,
    Restricted,
    investigate,
    read_table,
)
from tests.helpers.draws import rarely, seeds

# Different options, some of which are equal in Python, or are printed alike.
OPTIONS = [12, "12", 12.0, True, 1, 1.0, "true", "True", "oak"]
REAL = {"x": Real(bounds=(-1, 1)), "y": Real(bounds=(0, 2))}
FINITE = {"n": Integer(bounds=(0, 4)), "a": Choice(options=OPTIONS), "b": Binary()}
SPACES = [REAL, FINITE, {"x": REAL["x"], **FINITE}, {"n": FINITE["n"], "b": Binary()}]


def key(values):
    return repr([*values])


def objectives(text, seed=0):
    """Two objectives, by which no design is taken for another one."""
    return [zlib.crc32(text.encode(), start + seed) / 2**32 for start in (1, 2)]


def fails(text):
    return zlib.crc32(text.encode(), 3) % 7 == 0


class Model(Problem):
    """A model that notes its calls, fails for some designs and may be interrupted."""

    def __init__(self, variables, *, elementwise=True, noisy=False, calls=None):
        super().__init__(vars=variables, n_obj=2, elementwise=elementwise)
        self.noisy = noisy
        self.calls = [] if calls is None else calls  # the keys of designs, and their objectives
        self.n_left = math.inf  # how many calls there are before an interrupt

    def fingerprint(self):
        return {}

    def _evaluate(self, x, out, *args, seed=0, **kwargs):
        F = np.array([self._objectives(design, seed) for design in np.atleast_1d(x)])
        out["F"] = F[0] if self.elementwise else F

    def _objectives(self, design, seed):
        if self.n_left == 0:
            raise KeyboardInterrupt
        self.n_left -= 1
        text = key(design[name] for name in self.vars)
        self.calls.append((text, *objectives(text, seed)))
        if self.elementwise and fails(text) and not self.noisy:
            raise ValueError("no solution")
        return objectives(text, seed)


def part(random, variable):
    """A random part of a variable, whose points may be points of other parts."""
    if isinstance(variable, Binary):
        return bool(random.integers(2))
    if isinstance(variable, Choice):
        count = random.integers(1, len(OPTIONS))
        return [OPTIONS[i] for i in sorted(random.choice(len(OPTIONS), count, replace=False))]
    kind, steps = (int, 4) if isinstance(variable, Integer) else (float, 8)
    lower, upper = variable.bounds
    ends = np.sort(random.integers(0, steps + 1, 2)) * (upper - lower) / steps + lower
    low, high = map(kind, ends)
    return low if random.random() < 0.2 else (low, high)


def restricted(random, model):
    names = random.permutation([*model.vars])[: random.integers(len(model.vars))].tolist()
    box = {name: part(random, model.vars[name]) for name in names}
    return lambda problem: Restricted(problem, box) if box else problem


def psi(problem, n_points, **options):
    return minimize(problem, PSI(n_points, **options)).algorithm.table


def rows_of(table):
    """The keys and objectives of the tests of a table, those that failed without objectives."""
    rows = zip(table.X.tolist(), table.F.tolist(), table.failed(), strict=True)
    return [(key(design), *([] if has_failed else F)) for design, F, has_failed in rows]


def by_number(table):
    return dict(zip(table.numbers.tolist(), rows_of(table), strict=True))


class Check:
    """Runs of one model in one study, and all that holds after each of them."""

    def __init__(self, random, study_file):
        self.random = random
        self.study = study_file
        noisy = random.random() < 0.15
        variables = SPACES[random.integers(len(SPACES))]
        elementwise = bool(noisy or random.random() < 0.7)
        self.model = Model(variables, elementwise=elementwise, noisy=noisy)

    def run(self):
        others = [] if self.model.noisy else [self.recorded]
        choices = [*others, self.sequence, self.sequence, self.sequence]
        choices[self.random.integers(len(choices))]()
        self.check_study()

    def sequence(self):
        """Points of the sequence, the same ones as without a study."""
        random = self.random
        box = restricted(random, self.model)
        n_points = int(random.integers(1, 14))
        options = {"first": int(random.integers(1, 6))}
        copy = Model(self.model.vars, elementwise=self.model.elementwise, noisy=self.model.noisy)
        alone = investigate(box(copy), n_points, **options)
        assert len(copy.calls) == len({*copy.calls}) or self.model.noisy
        if self.model.noisy and random.random() < 0.5:
            options["repeat"] = 2
        if random.random() < 0.3:
            self.interrupted(box, n_points, options)
        by = [investigate, psi]["repeat" not in options and random.integers(2)]
        table = by(box(self.model), n_points, study=self.study, **options)
        designs = {row[0] for row in rows_of(table)}
        assert designs == {row[0] for row in rows_of(alone)}
        # investigate averages repeats, PSI does not
        assert len(table) == len(designs) or self.model.noisy
        self.check_table(table)
        n_calls = len(self.model.calls)
        again = by(box(self.model), n_points, study=self.study, **options)
        assert [*by_number(again).items()] == [*by_number(table).items()]
        assert len(self.model.calls) == n_calls

    def interrupted(self, box, n_points, options):
        self.model.n_left = int(self.random.integers(n_points))
        with suppress(KeyboardInterrupt):
            investigate(box(self.model), n_points, study=self.study, **options)
        self.model.n_left = math.inf

    def recorded(self):
        """Designs that somebody evaluates, known ones and new ones, some of them twice."""
        problem = Recorded(FailureTolerant(self.model), study=self.study)
        n, variables = self.random.integers(1, 6), self.model.vars.values()
        rows = [[self.value(variable) for variable in variables] for _ in range(n)]
        if self.study.exists():
            rows += read_table(self.study, average_by=False).X[:3].tolist()
        designs = [dict(zip(self.model.vars, row, strict=True)) for row in [*rows, *rows[:2]]]
        F = problem.evaluate(np.array(designs, dtype=object), return_values_of=["F"])
        for design, values in zip(designs, F.tolist(), strict=True):
            text = key(design.values())
            if not (self.model.elementwise and fails(text)):
                assert values == objectives(text)

    def value(self, variable):
        if isinstance(variable, Real):  # the two zeros are two designs, and so are neighbours
            values = [-0.0, 0.0, 0.25, 0.75, math.nextafter(0.75, 1), float(self.random.random())]
            return values[self.random.integers(len(values))]
        if isinstance(variable, Integer):
            return int(self.random.integers(5))
        if isinstance(variable, Binary):
            return bool(self.random.integers(2))
        return OPTIONS[self.random.integers(len(OPTIONS))]

    def check_table(self, table):
        """All tests are of the model, and they are those of the study."""
        if self.model.noisy:
            return
        whole = read_table(self.study, average_by=False)
        assert by_number(table).items() <= by_number(whole).items()
        assert (f"the study has {len(whole)}" in repr(table)) == (len(whole) > len(table))

    def check_study(self):
        calls = self.model.calls
        whole = rows_of(read_table(self.study, average_by=False))
        if self.model.noisy:
            assert Counter(whole) == Counter(calls)
            return
        of_one = self.model.elementwise
        oracle = {text: [] if of_one and fails(text) else F for text, *F in calls}
        assert len(oracle) == len(calls) or not of_one, "a design was evaluated twice"
        assert {text: F for text, *F in whole} == oracle
        assert len(whole) == len(oracle)


@pytest.mark.parametrize("six", [0, *rarely(*range(1, 17))])
def test_any_runs_in_one_study_agree_with_a_dictionary(six, tmp_path):
    for seed in range(6 * six, 6 * six + 6):
        random = np.random.default_rng(seed)
        check = Check(random, tmp_path / f"{seed}.db")
        for _ in range(random.integers(2, 4)):
            check.run()


@pytest.mark.parametrize("seed", seeds(20))
def test_shares_in_any_order_are_one_run(seed, tmp_path):
    random = np.random.default_rng(seed)
    variables = SPACES[random.integers(len(SPACES))]
    n_parts = int(random.integers(2, 5))
    models = {part: Model(variables) for part in range(1, n_parts + 1)}
    expected = {}
    for _ in range(6):
        part = int(random.integers(1, n_parts + 1))
        n_points, share = int(random.integers(4, 24)), (part, n_parts)
        table = investigate(models[part], n_points, share=share, study=tmp_path / "parts")
        alone = investigate(Model(variables), n_points, share=share)
        assert table.equals(alone.take(~alone.repeats))
        expected |= by_number(alone)
        calls = [text for text, *_ in models[part].calls]
        assert len({*calls}) == len(calls)
    tests = by_number(read_table(tmp_path / "parts", average_by=False))
    assert {*map(repr, tests.values())} == {*map(repr, expected.values())}
    assert len(tests) == len({row[0] for row in tests.values()})
    assert tests.items() <= expected.items()
