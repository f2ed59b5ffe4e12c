"""The comparison of algorithms: fairness, indicators against oracles, statistics, continuing."""

import copy
from functools import partial

import numpy as np
import pytest
from pymoo.algorithms.moo.moead import MOEAD
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.nsga3 import NSGA3
from pymoo.algorithms.moo.spea2 import SPEA2
from pymoo.problems import get_problem
from pymoo.problems.functional import FunctionalProblem
from pymoo.problems.multi.bnh import BNH

import pymoo_psi
from pymoo_psi import PSI, VectorizedSphereChute
from pymoo_psi.comparison import DEFAULT_ALGORITHMS, INDICATORS, Reference
from pymoo_psi.errors import PsiError, StudyMismatchError
from pymoo_psi.pareto import nondominated
from tests.helpers.models import Model
from tests.helpers.processes import until
from tests.helpers.refusals import interrupted, refused, warned
from tests.recipes.test_algorithms import mixed

compare = partial(pymoo_psi.compare, progress=False)


def counted(**options):
    """Two spheres that keep count themselves, apart from any bookkeeping of the comparison."""
    bounds = {"xl": np.array([-1.0, 0, 1]), "xu": np.array([1.0, 2, 3])}
    model = Model(
        lambda x: {"F": [x @ x, (x - 1) @ (x - 1)], "heat": x[0]}, n_var=3, **bounds, **options
    )
    model.units = {"heat": "K"}
    return model


@pytest.mark.parametrize("algorithm", [*DEFAULT_ALGORITHMS, "psi-scrambled+nsga3", "nsga2"])
@pytest.mark.parametrize("budget", [1, 257])
def test_every_algorithm_spends_exactly_its_budget(algorithm, budget):
    problem = counted()
    result = compare(problem, n_evaluations=budget, seeds=[3], algorithms=[algorithm])
    X = np.vstack(problem.calls)
    assert len(X) == budget == result.to_frame()["evaluated"].item()
    assert ((problem.xl <= X) & (problem.xu >= X)).all()
    F = counted().evaluate(X)
    assert sorted(map(tuple, result.runs[0].F)) == sorted(map(tuple, F[nondominated(F)]))


@pytest.mark.parametrize("algorithm", ["nsga2", lambda n: SPEA2(pop_size=20)])
def test_a_run_is_the_same_whatever_ran_before_it(algorithm):
    """All instances of pymoo's SPEA2 share one survival, which remembers the best values."""
    bnh, arguments = get_problem("bnh"), {"n_evaluations": 60, "algorithms": {"one": algorithm}}
    compare(get_problem("dtlz2"), **arguments, seeds=[1])  # of three objectives
    both = compare(bnh, **arguments, seeds=[1, 2]).runs
    assert np.array_equal(both[1].X, compare(bnh, **arguments, seeds=[2]).runs[0].X)


def test_of_an_algorithm_without_chance_one_run_counts():
    result = compare(
        get_problem("bnh"), n_evaluations=[16, 32], seeds=8,
        algorithms={"mine": lambda n: PSI(n), "nsga2": "nsga2"},
    )  # fmt: skip
    assert result.summary().set_index("algorithm").loc["mine", "runs"].tolist() == [1, 1]
    assert (result.tests()["p"] >= 2 / 2**8).all()  # the least of the sign test
    assert [run.task.seed for run in result.runs[:2]] == [None, None]
    # Up to 20 evaluations, surrogates only have the points of the sequence.
    mixed = compare(get_problem("bnh"), n_evaluations=[16, 24], seeds=2, algorithms=["surrogate"])
    assert [run.task.seed for run in mixed.runs] == [None, 1, 2]


class Greedy(NSGA2):
    def _infill(self):
        self.problem.evaluate(self.pop.get("X"))  # past the evaluator, uncounted by it
        return super()._infill()


# NSGA-II gives itself criteria, by which a small one would end after some 300 evaluations.
@pytest.mark.parametrize(
    ("algorithm", "budget", "spent"),
    [(NSGA2(pop_size=2), 400, 400), (Greedy(pop_size=20), 50, 40)],
)
def test_only_its_budget_ends_an_algorithm(algorithm, budget, spent):
    problem = counted()
    result = compare(
        problem,
        n_evaluations=budget,
        seeds=1,
        algorithms={"one": lambda n: copy.deepcopy(algorithm)},
    )
    assert len(problem.calls) == spent
    assert result.to_frame()["hypervolume"].item() > 0


def test_an_algorithm_that_finds_nothing_has_hypervolume_0():
    objectives = [lambda x: x[0], lambda x: 1 - x[0]]
    rare = FunctionalProblem(2, objectives, constr_ieq=[lambda x: 0.99 - x[1]], xl=0, xu=1)
    result = compare(rare, n_evaluations=[16, 256], seeds=2, algorithms=["psi", "psi-scrambled"])
    few, many = result.to_frame().query("algorithm == 'psi'").to_dict("records")
    of_nothing = [few[name] for name in ("hypervolume", "igd_plus", "epsilon", "optimum_distance")]
    assert of_nothing == [0, np.inf, np.inf, np.inf]
    assert many["hypervolume"] > 0
    assert np.isfinite(result.summary().query("evaluations == 256")["hypervolume"]).all()


def test_all_runs_share_the_reference_of_all_results():
    result = compare(get_problem("bnh"), n_evaluations=[32, 64], seeds=2)
    union, reference = np.vstack([run.F for run in result.runs]), result.reference
    best = np.unique(union[nondominated(union)], axis=0)
    assert len(reference.points) == len(best) < 1000
    ends = [reference.frame.ideal, reference.frame.nadir]
    np.testing.assert_array_equal(ends, [best.min(axis=0), best.max(axis=0)])
    # No run is better than all of them together.
    everything = reference.measure(best)
    for run, measured in zip(result.runs, result.to_frame().to_dict("records"), strict=True):
        assert reference.measure(run.F)["hypervolume"] == measured["hypervolume"]
        assert everything["hypervolume"] >= measured["hypervolume"]
        assert everything["igd_plus"] <= measured["igd_plus"]


def test_an_objective_that_is_constant_up_to_rounding_still_counts_against_a_worse_run():
    runs = [np.array(F) for F in ([[1, 0.3]], [[1, 0.1 + 0.2]], [[2, 5.0]])]
    reference = Reference.of(runs)
    best, same, _ = map(reference.measure, runs)
    assert best == pytest.approx(same)
    worse = reference.measure(np.array([[1, 5.0]]))
    assert worse["hypervolume"] == pytest.approx(best["hypervolume"] * 0.1 / 1.1)
    assert worse["igd_plus"] == worse["epsilon"] == worse["optimum_distance"] == pytest.approx(1)
    # Without a worse run nothing tells how much another value matters.
    reference = Reference.of([*runs[:2], np.array([[2, 0.3]])])
    assert reference.measure(runs[1]) == pytest.approx(reference.measure(runs[0]))
    refused(
        r"objectives of runs of the reference.*Reference.of",
        reference.measure,
        np.array([[1, 5.0]]),
    )


def test_a_known_front_joins_the_reference():
    zdt1 = get_problem("zdt1", n_var=2)
    front = zdt1.pareto_front(n_pareto_points=2000)
    result = compare(zdt1, n_evaluations=256, seeds=2, algorithms=["nsga3"], reference_front=front)
    frame = result.reference.frame
    np.testing.assert_allclose([frame.ideal, frame.nadir], [[0, 0], [1, 1]], atol=1e-2)
    # min |(f1, 1 - sqrt f1)|: the derivative 2 f1 - (1 - sqrt f1) / sqrt f1 vanishes.
    f1 = next(r.real**2 for r in np.roots([2, 0, 1, -1]) if abs(r.imag) < 1e-12)
    np.testing.assert_allclose(result.reference.optimum, [f1, 1 - np.sqrt(f1)], atol=1e-3)


def test_mixed_variables_are_compared_and_kept_with_their_types(tmp_path):
    arguments = {
        "n_evaluations": [24],
        "seeds": 2,
        "folder": tmp_path,
        "algorithms": ["psi", "psi-scrambled", "surrogate"],
    }
    result, again = compare(mixed(), **arguments), compare(mixed(), **arguments)
    for run, stored in zip(result.runs, again.runs, strict=True):
        assert stored.X.tolist() == run.X.tolist()
        assert [*map(type, stored.X[0])] == [bool, str, int, float]
    assert (result.to_frame()["hypervolume"] > 0).all()


# Conclusions


def test_the_better_algorithm_is_named_for_every_indicator():
    result = compare(
        get_problem("zdt1"), n_evaluations=256, seeds=6, algorithms=["psi-scrambled", "nsga3"],
    )  # fmt: skip
    for indicator, sense in INDICATORS.items():
        row = result.tests(indicator).iloc[0]
        medians = result.to_frame().groupby("algorithm")[indicator].median() * sense
        assert medians[row["better"]] >= medians[row["worse"]], indicator
    (test,) = result.tests().itertuples()
    assert (test.better, test.effect, test.p) == ("nsga3", 1.0, 2 / 924)  # 924 = C(12, 6)


# Keeping and continuing


def test_a_comparison_continues_where_it_was_interrupted(tmp_path):
    problem = counted(stop=2 * 64)
    arguments = {"n_evaluations": [32, 64], "seeds": 2, "algorithms": ["psi", "nsga2"]}
    interrupted(compare, problem, **arguments, folder=tmp_path)
    assert len(list(tmp_path.glob("*.db"))) == 2
    problem.stop = None
    expected = compare(counted(), **arguments).to_frame()
    columns = ["algorithm", "evaluations", "seed", "evaluated", *INDICATORS, "n_nondominated"]
    for n_evaluated in (64 + 3 * 32, 0):  # the third time nothing
        problem.calls = []
        result = compare(problem, **arguments, folder=tmp_path)
        assert result.to_frame()[columns].equals(expected[columns])
        assert len(problem.calls) == n_evaluated


def test_processes_and_the_order_of_work_change_no_number(tmp_path):
    arguments = {
        "n_evaluations": [64, 32], "seeds": [4, 2], "algorithms": ["psi", "nsga3"],
    }  # fmt: skip
    one = compare(get_problem("bnh"), **arguments).to_frame()
    two = compare(get_problem("bnh"), **arguments, n_jobs=2, folder=tmp_path).to_frame()
    times = ["seconds", "evaluation_seconds"]
    assert two.drop(columns=times).equals(one.drop(columns=times))


@pytest.mark.parametrize("changed", [{"c": 0.3}, {"upper": (1, 6)}])
def test_runs_on_another_problem_are_refused(tmp_path, changed):
    arguments = {"n_evaluations": 16, "seeds": 1, "algorithms": ["psi"], "folder": tmp_path}
    compare(VectorizedSphereChute(0.4), **arguments)
    refused(
        "another problem.*give another folder",
        compare,
        VectorizedSphereChute(0.4, **changed),
        error=StudyMismatchError,
        **arguments | {"n_evaluations": 32},
    )


def test_functions_that_a_folder_cannot_tell_apart_are_named(tmp_path):
    lines = FunctionalProblem(2, [lambda x: x[0], lambda x: 1 - x[0]], xl=0, xu=1)
    arguments = {"n_evaluations": 8, "seeds": 1, "algorithms": ["psi"], "folder": tmp_path}
    warned("the folder does not compare what .* objs", compare, lines, **arguments)


# Wrong arguments


class Noisy(BNH):
    noisy = True


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n_evaluations": 0}, "n_evaluations must be an integer >= 1, got 0"),
        ({"n_evaluations": []}, r"n_evaluations must be one or more integers, got \[\]"),
        ({"algorithms": []}, r"algorithms must be one or more, such as psi, .* got \[\]"),
        ({"problem": get_problem("sphere")}, "objectives of problem must be at least 2, got 1"),
        ({"problem": Noisy()}, "the problem of a comparison must be one whose tests of a design"),
        ({"algorithms": ["pso"]}, "algorithms must be one of .*, got 'pso'"),
        ({"algorithms": {"a": PSI(16, study="a.db")}}, "without a study; compare has folder="),
        ({"algorithms": {"a": NSGA2}}, "a name, an algorithm or a function.*give lambda n: NSGA2"),
        ({"reference_front": [[1, 2, 3]]}, r"reference_front must be of shape \(1, 2\)"),
    ],
)
def test_wrong_arguments_are_named(change, message):
    arguments = {"n_evaluations": 16, "seeds": 1, "algorithms": ["psi"]} | change
    refused(message, compare, **{"problem": get_problem("bnh")} | arguments)


def test_an_error_names_its_run_and_finished_runs_stay(tmp_path):
    finished = tmp_path / "psi_32.db"

    def fails_after_the_other(n_evaluations):
        until(finished.exists)
        raise AssertionError("only without constraints")

    algorithms = {"psi": "psi", "late": fails_after_the_other}
    refused(
        "run of late, 32 evaluations, seed 1 ended in Assertion",
        compare,
        get_problem("bnh"),
        error=PsiError,
        n_evaluations=32,
        seeds=1,
        algorithms=algorithms,
        folder=tmp_path,
        n_jobs=2,
    )
    assert [path.name for path in tmp_path.glob("*.db")] == [finished.name]


@pytest.mark.parametrize("algorithm", ["psi", "surrogate", "psi+nsga3", "nsga3"])
@pytest.mark.parametrize("most", [0.5, -1])
def test_a_design_that_fails_ends_the_run_of_every_algorithm(algorithm, most, recwarn):
    """Without a warning of PSI, which goes on, that all tests failed."""
    problem = Model(lambda x: {"F": [x[0], 1 - x[0] + x[1]]}, fails=lambda x: x[0] > most, n_var=2)
    refused(
        "ended in a design that failed: .*no convergence; use FailureTolerant",
        partial(compare, problem, n_evaluations=33, seeds=1, algorithms=[algorithm]),
    )
    assert len(problem.calls) <= 66
    assert UserWarning not in [warning.category for warning in recwarn]


@pytest.mark.parametrize("problem", [get_problem("bnh"), get_problem("dtlz2")])
def test_an_unsuitable_algorithm_is_found_in_its_first_run(problem, tmp_path):
    """NSGA-III with two directions of two objectives, MOEA/D, which takes no constraints."""
    moead, nsga3 = MOEAD(np.eye(2)), NSGA3(np.eye(2))
    algorithms = {"psi-scrambled": "psi-scrambled", "unfit": nsga3 if problem.n_obj > 2 else moead}
    refused(
        r"unfit, 32 .*, seed 1 .*; .* leave out of algorithms",
        compare,
        problem,
        error=PsiError,
        n_evaluations=[16, 32],
        algorithms=algorithms,
        folder=tmp_path,
    )
    assert [path.name for path in tmp_path.iterdir()] == ["psi-scrambled_32_seed1.db"]


@pytest.mark.parametrize(("algorithms", "largest"), [(["psi", "surrogate"], 256), (["psi"], 4096)])
def test_surrogates_take_fewer_evaluations_by_default(algorithms, largest, tmp_path):
    interrupted(compare, counted(stop=largest), algorithms=algorithms, folder=tmp_path, seeds=1)
    assert [path.name for path in tmp_path.glob("*.db")] == [f"psi_{largest}.db"]
