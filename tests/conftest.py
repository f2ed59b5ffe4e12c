"""What the tests share: examples without a time limit, and what they run on."""

from importlib.metadata import version

from hypothesis import settings

settings.register_profile("untimed", deadline=None, max_examples=50)
settings.load_profile("untimed")


def pytest_report_header():
    names = ("pymoo", "numpy", "scipy", "pandas", "matplotlib", "moocore", "joblib", "typer")
    return " ".join(f"{name}-{version(name)}" for name in names)
