"""What the tests share: examples without a time limit, what they run on, and which are quick."""

import gc
import os
import shutil
from importlib.metadata import version
from pathlib import Path

import cloudpickle
import pytest
from hypothesis import HealthCheck, settings

from tests.helpers.processes import LONG

# Before NumPy is loaded, here and in what tests start: the processes of pytest-xdist use all cores,
# and threads of the linear algebra would only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# A study is written to the disk after each round, which takes milliseconds, in memory none.
MEMORY = Path("/dev/shm")
if MEMORY.is_dir() and shutil.disk_usage(MEMORY).free > 2**30:
    may_run_programs = not os.statvfs(MEMORY).f_flag & os.ST_NOEXEC
    if may_run_programs:
        os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))
# To look for garbage after every 700 objects takes a twentieth of the time of all tests.
gc.set_threshold(20_000, 20, 20)

# On a busy machine, any example may take long.
UNTIMED = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("untimed", max_examples=10, **UNTIMED)
# A run that decides on a change draws the same examples as the one before it; whoever works on the
# code draws others each time, and so finds what nobody has thought of.
settings.register_profile("same", max_examples=10, derandomize=True, **UNTIMED)
settings.register_profile("slow", max_examples=60, derandomize=True, **UNTIMED)

# What `pytest -m quick` runs: the mathematics of every subpackage, without processes, files in bulk,
# browsers, figures and command lines.
QUICK = (
    "algorithms/test_names.py",
    "algorithms/test_proposals.py",
    "algorithms/test_sampling.py",
    "chute/test_motion.py",
    "comparison/test_statistics.py",
    "pareto/test_explanation.py",
    "pareto/test_indicators.py",
    "pareto/test_objectives.py",
    "pareto/test_ranking.py",
    "pareto/test_representatives.py",
    "problems/test_all_problems.py",
    "problems/test_design_space.py",
    "problems/test_equalities.py",
    "problems/test_evaluation.py",
    "problems/test_logarithmic.py",
    "problems/test_placeholders.py",
    "problems/test_requirements.py",
    "problems/test_restricted.py",
    "problems/test_robust.py",
    "problems/test_sphere_chute.py",
    "problems/test_wrapped.py",
    "selection",
    "sequences",
    "study/test_folder.py",
    "table/test_expression.py",
    "table/test_table.py",
)
# Subpackages whose examples start processes, each of which takes half a second.
WITH_PROCESSES = ("parallel", "server.py")


def pytest_configure(config):
    profile = "untimed"
    if config.option.markexpr == "slow":
        profile = "slow"
    elif os.environ.get("CI"):
        profile = "same"
    settings.load_profile(profile)


@pytest.hookimpl(optionalhook=True, wrapper=True)
def pytest_xdist_auto_num_workers():
    """Three processes for two cores, as many tests wait for processes and browsers."""
    n = yield
    if "PYTEST_XDIST_AUTO_NUM_WORKERS" not in os.environ:
        n += n // 2
    return n


def is_among(path, names, folder):
    return any(path.is_relative_to(folder / name) for name in names)


def is_quick(path):
    return is_among(path, QUICK, Path(__file__).parent)


def pytest_ignore_collect(collection_path, config):
    """Not even import the other files, which takes longer than to run the quick ones."""
    only_quick = config.option.markexpr == "quick" and collection_path.suffix == ".py"
    return True if only_quick and not is_quick(collection_path) else None


def pytest_collection_modifyitems(config, items):
    # Workers get the models of a test by value: to import its module takes them a second each.
    for module in {item.module for item in items if isinstance(item, pytest.Function)}:
        cloudpickle.register_pickle_by_value(module)
    quick = {path for path in {item.path for item in items} if is_quick(path)}
    draws_more = config.option.markexpr == "slow"
    for item in items:
        is_example = isinstance(item, pytest.DoctestItem)
        if is_example and is_among(item.path, WITH_PROCESSES, config.rootpath / "src/pymoo_psi"):
            item.add_marker("slow")
        is_slow = item.get_closest_marker("slow")
        if item.path in quick and not is_slow:
            item.add_marker("quick")
        is_property = getattr(getattr(item, "obj", None), "is_hypothesis_test", False)
        is_random = is_property or "draws" in getattr(item, "fixturenames", ())
        if draws_more and is_random:
            item.add_marker("slow")


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """Let tests share kept workers, which differ by their environment: without pytest's variable."""
    os.environ.pop("PYTEST_CURRENT_TEST", None)


@pytest.fixture
def draws(request):
    """Return the seeds of n random examples: a quarter of them, or all in the slow tests."""
    share = 1 if request.config.option.markexpr == "slow" else 4
    return lambda n: range(n // share)


@pytest.fixture
def said(capsys):
    """Run the command; return all that it says. A mistake is one line and nothing else."""
    from pymoo_psi.cli import main  # which the quick tests need not load

    def command(*words, code=0):
        capsys.readouterr()
        ended = main([str(word) for word in words])
        printed, err = capsys.readouterr()
        assert ended == code, err
        assert "Traceback" not in err
        if code == 2:
            assert (printed, err.count("\n")) == ("", 1)
        return printed + err

    return command


@pytest.fixture
def undrawn(monkeypatch):
    """Leave the pictures of reports out, which take most of the time."""
    from matplotlib.figure import Figure

    from tests.helpers.drawn import saved_empty

    monkeypatch.setattr(Figure, "savefig", saved_empty)


@pytest.fixture
def study_file(tmp_path):
    """Where a study may be; it is not there yet."""
    return tmp_path / "s.db"


def pytest_report_header():
    names = ("pymoo", "numpy", "scipy", "pandas", "matplotlib", "moocore", "joblib", "click")
    return " ".join(f"{name}-{version(name)}" for name in names)


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    """The folder of the test is the current one."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window; one serves all tests of a file."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    names = ("chromium", "chromium-browser", "google-chrome")
    program = next((path for name in names if (path := shutil.which(name))), None)
    if program is None:
        pytest.skip("no Chromium on this machine: apt-get install chromium")
    switches = (
        "headless no-sandbox disable-gpu disable-software-rasterizer disable-quic no-first-run"
        " disable-background-networking disable-component-update disable-sync"
    )
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=program,
            args=[f"--{switch}" for switch in switches.split()],
            timeout=1000 * LONG,
        )
        yield browser
        browser.close()
