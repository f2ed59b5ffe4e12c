"""What the tests share: examples without a time limit, and what they run on."""

import os
from importlib.metadata import version

from hypothesis import settings

# Before NumPy is loaded, here and in what tests start: each process of pytest-xdist has a core, and
# threads of the linear algebra would only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

settings.register_profile("untimed", deadline=None, max_examples=50)
settings.load_profile("untimed")


def pytest_report_header():
    names = ("pymoo", "numpy", "scipy", "pandas", "matplotlib", "moocore", "joblib", "typer")
    return " ".join(f"{name}-{version(name)}" for name in names)
