"""Random histories of tests from elsewhere, asking, telling and solving, beside a dictionary."""

from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pymoo_psi import ProgramProblem, investigate, lp_tau, read_table
from pymoo_psi.algorithms import RunOptions, ask_tests, import_tests, tell_tests
from pymoo_psi.problems import ProgramRun
from tests.helpers.draws import rarely

POINTS = lp_tau(32, 2)


class Model(ProgramProblem):
    """A model that people test, too; its third output is an expression."""

    def __init__(self, noisy):
        super().__init__(
            {"a": (0, 1), "b": (0, 1)},
            None,
            {"f": {}, "g": {}, "ratio": {"expression": "f/g"}},
            {"minimize": ["f", "ratio"]},
            {"ratio": "<= 2"},
            noisy=noisy,
        )
        self.by_people = False

    def fingerprint(self):
        return {}

    def run(self, design):
        f = 1 + design["a"] + design["b"] ** 2
        g = 2 - design["a"]
        if self.noisy:
            f += np.random.default_rng(design["seed"]).random()
        return ProgramRun(Path(), outputs={"f": f, "g": g, "ratio": f / g})


def counted(tests):
    """How often each design has each result, in whatever order."""
    return {design: Counter(results) for design, results in tests.items()}


class History:
    """Steps on a study, and what it must then have: the results by design, and what is pending.

    A failed test has the result None.
    """

    def __init__(self, seed, study, noisy):
        self.rng = np.random.default_rng(seed)
        self.problem = Model(noisy)
        self.options = RunOptions(study=study)
        self.results = {}
        self.pending = {}

    def measured(self):
        """Two results of people, who measure other values than the model."""
        return tuple(np.round(1 + self.rng.random(2), 3).tolist())

    def from_elsewhere(self):
        """Rows of any designs, one of them twice and beyond the bounds, one without a result."""
        points = POINTS[self.rng.choice(len(POINTS), 5, replace=False)].tolist()
        rows = [(*point, *self.measured()) for point in [*points, (2.0, 2.0)]]
        rows.append(rows[-1])
        frame = pd.DataFrame(rows, columns=["a", "b", "f", "g"])
        frame.loc[0, "f"] = np.nan
        tests = import_tests(self.problem, frame, self.options)
        n_new = 0
        for a, b, *result in rows[1:]:
            known = self.results.setdefault((a, b), [])
            if known == [None] and not self.problem.noisy:
                known.clear()
            if not known or self.problem.noisy:
                known.append(tuple(result))
                n_new += 1
        assert tests.remarks[0].startswith(f"{n_new} of 7 tests taken")

    def ask(self):
        frame = ask_tests(self.problem, int(self.rng.integers(1, 4)), self.options)
        for test, a, b in frame[["test", "a", "b"]].itertuples(index=False):
            assert (a, b) not in {*self.results, *self.pending.values()}
            self.pending[test] = (a, b)

    def tell(self):
        """Some designs are tested, fail, are tested at other values, or lack a value yet."""
        if not self.pending:
            return
        frame = ask_tests(self.problem, 0, self.options)
        assert frame["test"].tolist() == sorted(self.pending)
        for row, test in frame["test"].items():
            a, b = self.pending[test]
            chance = self.rng.random()
            if chance < 0.3:
                frame.loc[row, "g"] = 1.0
                continue
            del self.pending[test]
            if chance < 0.5 and (a, b) not in self.results:
                frame.loc[row, "failure"] = "cracked"
                self.results[a, b] = [None]
                continue
            result = self.measured()
            frame.loc[row, ["f", "g"]] = result
            if chance < 0.6:
                b = float(self.rng.random())
                frame.loc[row, "b"] = b
            self.results.setdefault((a, b), []).append(result)
        tell_tests(frame, self.options.study)
        pending = ", ".join(map(str, sorted(self.pending))) or "none"
        assert tell_tests(frame, self.options.study)[-1] == f"Pending tests: {pending}."

    def solve(self):
        """Points that have no test are tested; of a noisy model, perhaps twice."""
        n = int(self.rng.integers(1, len(POINTS)))
        repeat = int(self.rng.integers(1, 3 if self.problem.noisy else 2))
        table = investigate(self.problem, n, repeat=repeat, study=self.options.study)
        designs = [*map(tuple, POINTS[:n].tolist())]
        assert sorted(map(tuple, table.X)) == sorted(designs)
        tests = self.stored()
        for design in designs:
            known = self.results.setdefault(design, [])
            if self.problem.noisy:  # a seed decides on the values
                new = [*(Counter(tests[design]) - Counter(known)).elements()]
                assert repeat - len(known) <= len(new) <= repeat
                known += new
            elif not known:
                outputs = self.problem.run(dict(zip("ab", design, strict=True))).outputs
                known.append((outputs["f"], outputs["g"]))

    def stored(self):
        if not self.options.study.exists():
            return {}
        tests, table = {}, read_table(self.options.study, average_by=False)
        if len(table):
            np.testing.assert_array_equal(table["ratio"], table["f"] / table["g"])
        for row, design in enumerate(table.X.tolist()):
            result = None if table.failed()[row] else (table["f"][row], table["g"][row])
            tests.setdefault(tuple(design), []).append(result)
        return tests


@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("seed", [*range(3), *rarely(*range(3, 30))])
def test_a_study_has_what_a_dictionary_has(seed, noisy, study_file):
    history = History(seed, study_file, noisy)
    steps = [history.from_elsewhere, history.ask, history.tell, history.solve]
    for step in history.rng.choice(len(steps), 6):
        steps[step]()
        assert counted(history.stored()) == counted(history.results)
