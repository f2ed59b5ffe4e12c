"""A study that is watched and steered while it grows: by people, and by attackers."""

import http.client
import json
import os
import re
import signal
import stat
import subprocess
import sys
from contextlib import ExitStack, closing, suppress
from urllib.parse import urlsplit
from urllib.request import urlopen

import numpy as np
import pytest
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from pymoo_psi import PSI, Recorded, SurrogatePSI, investigate, live, read_table
from pymoo_psi.server import GrowingStudy
from pymoo_psi.study import Study
from tests.helpers.draws import rarely
from tests.helpers.models import Model
from tests.helpers.processes import LONG, posix, until
from tests.helpers.refusals import interrupted, refused
from tests.helpers.steered import Steered

Error = pytest.importorskip("playwright.sync_api", reason="playwright is missing").Error

MODEL = """
import time
from pymoo.core.problem import ElementwiseProblem

class Model(ElementwiseProblem):
    def __init__(self):
        super().__init__(n_var=2, n_obj=2, xl=[0, 0], xu=[1, 1])

    def _evaluate(self, x, out, *args, **kwargs):
        time.sleep(0.02)
        with open("evaluated.txt", "a") as file:
            file.write(f"{x.tolist()}\\n")
        out["F"] = [x[0], 1 - x[0] ** 0.5 + (x[1] - 0.3) ** 2]
"""


STOP = json.dumps({"action": "stop", "name": "Eve"})
BNH = get_problem("bnh")


class Visitor:
    """Somebody in front of the page."""

    def __init__(self, program, address):
        self.page = program.new_page()
        self.page.set_default_timeout(1000 * LONG)
        self.page.goto(address)
        self.page.wait_for_selector("#live:not([hidden])")

    def ask(self, expression):
        """The value of an expression; None while the page is loaded anew."""
        with suppress(Error):
            return self.page.evaluate(expression)

    def until(self, expression):
        assert until(lambda: self.ask(expression), every=0.02), f"never true: {expression}"

    def says(self, text, place="live"):
        self.until(f"document.getElementById('{place}').textContent.includes({json.dumps(text)})")

    def has(self, count):
        self.until(f"decisionPage.data.n == {count}")


def begun(folder):
    """A run in a group of processes of its own."""
    # So many points that the run cannot end before it is stopped.
    command = [sys.executable, "-m", "pymoo_psi", "solve", "model:Model", "--study", "s.db"]
    command += ["--algorithm", "surrogate", "--points", "2000", "--jobs", "2"]
    with open(folder / "output.txt", "w") as output:
        return subprocess.Popen(
            command, cwd=folder, stdout=output, stderr=subprocess.STDOUT, start_new_session=True
        )


@pytest.fixture
def tested(study_file):
    """A study of eight tests."""
    investigate(BNH, 8, study=study_file)
    return study_file


def proposed(study_file):
    """The tests that were proposed."""
    return {point for point, *_ in Study(study_file).proposals()}


@posix
@pytest.mark.slow
def test_two_watch_and_steer_a_killed_run(browser, tmp_path, study_file):
    (tmp_path / "model.py").write_text(MODEL)
    run = begun(tmp_path)
    with live(study_file, steer=True, port=0) as view:
        one, other = Visitor(browser, view.address), Visitor(browser, view.address)
        one.until("decisionPage.data.n >= 16")
        one.page.fill("#steerer", "Anna <i>")
        one.page.click("[name=pause]")
        other.says("Paused.")
        n_paused = len(read_table(study_file))
        one.has(n_paused)
        limits = {"f1": [None, 0.3], "f2": [None, 0.8]}
        one.ask(f"decisionPage.set({{...decisionPage.state(), limits: {json.dumps(limits)}}})")
        one.page.fill("#steerer", "")
        one.page.click("[name=search]")
        # As long as no tests come, by which a page may begin anew.
        one.says("your name", "messages")
        one.page.fill("#steerer", "Anna <i>")
        one.page.click("[name=search]")
        one.page.fill("#more", "8")
        one.page.focus("[name=more]")
        for _ in range(3):  # one key that is held
            one.page.keyboard.down("Enter")
        other.says("Anna <i>: search: f1, f2 within f1<=0.3, f2<=0.8")
        other.says("of 2008 tests")
        before = proposed(study_file)
        assert other.ask("document.getElementById('steered').textContent").count(": more") == 1
        assert other.ask("document.querySelectorAll('#live i').length") == 0
        other.has(n_paused)
        one.page.click("[name=continue]")
        other.until(f"decisionPage.data.n >= {n_paused + 8}")
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        one.says("No run is at work")
        assert [one.page.is_enabled(f"[name={name}]") for name in ("stop", "more")] == [False, True]
    one.until("!document.getElementById('offline').hidden")
    run = begun(tmp_path)
    with live(study_file, steer=True, port=urlsplit(view.address).port) as again:
        assert again.address == view.address
        one.until(
            "document.getElementById('offline').hidden && !document.getElementById('live').hidden"
        )
        one.until(f"decisionPage.data.n >= {len(read_table(study_file)) + 4}")
        assert one.ask("decisionPage.state().limits") == limits
        assert until(lambda: len(proposed(study_file) - before) > 8)
        one.page.click("[name=stop]")
        assert run.wait() == 0, (tmp_path / "output.txt").read_text()
        one.says("Anna <i>: stop: done")
        table = read_table(study_file)
        one.has(len(table))
        assert one.page.input_value("#steerer") == "Anna <i>"
        best = one.ask("decisionPage.data.names[decisionPage.ranking.best[0]]")
    # What it shows is what Python says of the study; nothing is lost or tested twice.
    evaluated = (tmp_path / "evaluated.txt").read_text().splitlines()
    assert len(table) == len({*evaluated}) < 2008  # stopped before the end
    assert len(evaluated) <= len(table) + 8  # a round, not stored when the run was killed
    within = table.under(limits={name: limit[1] for name, limit in limits.items()})
    assert [best] == [*within.best().names]
    is_directed = np.isin(table.numbers, [*proposed(study_file) - before])
    assert within.feasible()[is_directed].mean() > within.feasible()[~is_directed].mean()


def answer(view, target, method="GET", body=None, **headers):
    """Status of the answer to a request; HOME is the address of the page, OWN its origin."""
    address = urlsplit(view.address)
    own = f"http://{address.netloc}"
    sent = {name.replace("_", "-"): text.replace("OWN", own) for name, text in headers.items()}
    with closing(http.client.HTTPConnection(address.netloc)) as connection:
        connection.request(method, target.replace("HOME", address.path), body, sent)
        return connection.getresponse().status


SEARCH = b'{"action": "search", "name": "Eve", "formulation": %s}'
STRANGE = [
    # A site may have its name changed to this address by the rebinding of DNS.
    *(
        (400, "HOME", "GET", None, {"Host": name})
        for name in ("evil.example", "127.0.0.1.evil.example", "[", "")
    ),
    (403, "HOMEevents?from=x-0", "GET", None, {"Origin": "http://evil.example"}),
    (405, "HOMEsteer", "GET", None, {}),
    (403, "HOMEsteer", "POST", STOP, {}),
    (403, "HOMEsteer", "POST", STOP, {"Origin": "http://evil.example"}),
    (403, "HOMEsteer", "POST", STOP, {"Origin": "null"}),
    (404, "/", "GET", None, {}),
    (404, f"/{'x' * 32}/", "GET", None, {}),
    (404, "HOME../../etc/passwd", "GET", None, {}),
    (404, "HOME%2e%2e/s.db", "GET", None, {}),
    (404, "HOMEs.db", "GET", None, {}),
    (400, "HOMEsteer", "POST", b"x", {"Origin": "OWN"}),
    (400, "HOMEsteer", "POST", b"[]", {"Origin": "OWN"}),
    (400, "HOMEsteer", "POST", b"[" * 2**17, {"Origin": "OWN"}),
    (400, "HOMEsteer", "POST", SEARCH % (b"[" * 900 + b"]" * 900), {"Origin": "OWN"}),
    (400, "HOMEsteer", "POST", SEARCH % rb'{"limits": {"\ud800": 1}}', {"Origin": "OWN"}),
    (400, "HOMEsteer", "POST", b'{"action": "rm", "name": "Eve"}', {"Origin": "OWN"}),
    (400, "HOMEsteer", "POST", b'{"action": "stop", "name": " "}', {"Origin": "OWN"}),
    (413, "HOMEsteer", "POST", b"x" * 2**19, {"Origin": "OWN"}),
    (413, "HOMEsteer", "POST", [b"x"], {"Origin": "OWN", "Transfer_Encoding": "chunked"}),
]


def test_requests_of_others_are_refused(tested):
    before = tested.read_bytes()
    with live(tested, steer=True) as view:
        for status, target, method, body, headers in STRANGE:
            assert answer(view, target, method, body, **headers) == status, target
        assert tested.read_bytes() == before
        assert answer(view, "HOMEsteer", "POST", STOP, Origin="OWN") == 200
        assert {answer(view, "HOME", Host=name) for name in ("127.0.0.1", "localhost:8741")} == {
            200
        }
        address = urlsplit(view.address)
        # Readers that never read: they hold up neither others nor each other.
        with ExitStack() as slow:
            for _ in range(8):
                connection = http.client.HTTPConnection(address.netloc)
                slow.enter_context(closing(connection))
                connection.request("GET", f"{address.path}events?from=x-0")
            assert {answer(view, "/wrong/") for _ in range(50)} == {404}
            assert answer(view, "HOME") == 200
        refused("cannot start", live, tested, port=address.port)
    assert stat.S_IMODE(os.stat(f"{tested}-live").st_mode) == 0o600
    refused("read-only", GrowingStudy(tested, steer=False).steer, STOP.encode())


def steering_answers(study):
    return [request["answer"] for request in Study(study).facts().steering]


def place_of(view):
    """From where a page that was just loaded asks for tests."""
    with urlopen(view.address) as page:
        return re.search(r'"from": *"(\w+-\d+)"', page.read().decode())[1]


def progress(study):
    """Whether a run of a study is at work, and what its page says of it."""
    growing = GrowingStudy(study, steer=False)
    growing.look()
    return growing.progress["is_running"], growing.progress["lines"]


DONE = "All planned tests are done."


@pytest.mark.parametrize("firsts", [[101, 1], *rarely([9], [1, 5])])
def test_runs_from_any_test_point_are_done(study_file, firsts):
    for first in firsts:
        investigate(BNH, 8, first=first, study=study_file)
    n_tests = len(read_table(study_file))
    assert progress(study_file) == (False, [f"{n_tests} of {n_tests} tests", DONE])


@pytest.mark.slow
def test_a_share_and_a_run_that_adopts_tests_are_done(tested, tmp_path):
    investigate(BNH, 10, share=(2, 3), study=tmp_path / "shares")
    assert DONE in progress(tmp_path / "shares" / "share-2-of-3.db")[1]
    minimize(BNH, SurrogatePSI(20, n_points=8, study=tested), seed=1)
    assert progress(tested) == (False, ["20 of 20 tests", DONE])


def test_a_run_without_a_plan_is_not_over(tested):
    minimize(Recorded(BNH, study=tested), NSGA2(10), ("n_gen", 2), seed=1)
    is_running, lines = progress(tested)  # as long as its process is there
    assert (is_running, lines[0]) == (True, "28 of 28 tests")


STOPPED = ({"action": "search", "formulation": {}}, {"action": "stop"})


def test_a_run_that_people_stopped_says_so(study_file):
    problem = Steered(study_file, *STOPPED)
    table = minimize(problem, PSI(200, study=study_file)).algorithm.table
    assert 0 < len(table) < 200
    is_running, (counts, sentence) = progress(study_file)
    assert (is_running, counts) == (False, f"{len(table)} of 200 tests")
    assert sentence.startswith("Stopped.")
    # What was stopped is not what goes on.
    investigate(problem, 200, study=study_file)
    assert progress(study_file) == (False, ["200 of 200 tests", DONE])


def test_more_tests_than_a_run_can_have_are_refused(tested):
    request = {"action": "more", "name": "Eve", "count": 10**30}
    refused("count", GrowingStudy(tested, steer=True).steer, json.dumps(request).encode())
    with Study(tested).changes() as study:  # by another program
        study.steer(request)
    assert len(investigate(BNH, 9, study=tested)) == 9
    assert "refused: count" in steering_answers(tested)[0]


@pytest.mark.slow
def test_a_page_has_values_that_stored_tests_get_later(tested):
    study = Study(tested)
    columns = study.contents()[1]
    study.append(columns | {"gain": np.r_[np.full(7, 1.0), np.nan]})
    with live(tested) as view:
        before = place_of(view)
        study.append(columns | {"gain": np.full(8, 1.0)})
        assert until(lambda: place_of(view) != before)


# Most tests of it repeat a design.
TEETH = Model(lambda x: {"F": [x[0], -x[0]]}, n_var=1, xl=1, xu=6, vtype=int)


def test_a_page_that_grows_has_each_design_once(study_file, tmp_path):
    investigate(TEETH, 4, study=study_file)
    whole = investigate(TEETH, 12, study=tmp_path / "more.db")
    names = list(read_table(study_file).names)
    with live(study_file) as view:
        place = place_of(view)
        Study(study_file).append(Study(tmp_path / "more.db").contents()[1])
        with urlopen(f"{view.address}events?from={place}") as events:
            data = (line for line in events if line.startswith(b"data: "))
            while len(names) < 6:
                for rows in json.loads(next(data).removeprefix(b"data: "))["rows"]:
                    names += rows["names"]
    assert names == np.array(whole.names)[~whole.repeats].tolist()


def test_a_run_answers_in_the_study(tested):
    for action in ("search", "pause", "more"):
        with Study(tested).changes() as study:
            study.steer({"name": "Bo", "action": action, "count": 8, "formulation": {}})
    assert len(investigate(BNH, 4, study=tested)) == 4  # of the 8 that the run has
    assert len(investigate(BNH, 9, study=tested)) == 17
    search, *others = steering_answers(tested)
    assert re.search("refused.*surrogates", search)
    assert others == ["waits for the run; over when the run began", "17 tests in all"]
    # The same call goes on as before; one of fewer points has these.
    for n_points, n_tests in ((9, 17), (12, 17), (17, 17), (20, 20), (8, 8)):
        table = investigate(BNH, n_points, study=tested)
        assert len(table) == n_tests
        assert bool(table.remarks) == (n_tests > n_points)


def test_a_round_cut_off_is_tested_later(study_file):
    def table(n_evaluations, study=None):
        search = SurrogatePSI(n_evaluations, n_points=20, batch=4, study=study)
        problem = Steered(study, {"action": "more", "count": 6}, at=22 if study else 0)
        return minimize(problem, search, seed=1).algorithm.table

    np.testing.assert_array_equal(table(22, study_file).X, table(28).X)


def test_any_algorithm_stops_and_is_continued(study_file):
    first, again = (Recorded(Steered(study_file, *STOPPED), study=study_file) for _ in range(2))
    interrupted(minimize, first, NSGA2(150), ("n_gen", 2), seed=1)
    search, stop = steering_answers(study_file)
    assert "refused" in search
    assert stop == "done"
    n_tests = len(first.table)
    assert 0 < n_tests < 150
    minimize(again, NSGA2(150), ("n_gen", 2), seed=1)
    assert n_tests + again.n_evaluated == len(again.table) == 300
