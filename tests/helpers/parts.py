"""The parts of pymoo that there are."""

import contextlib
import importlib
import inspect
import pkgutil


def parts(package, kind):
    """Yield the classes of a kind that modules of a package define; some need other packages."""
    for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        with contextlib.suppress(Exception):
            module = importlib.import_module(info.name)
            for value in [*vars(module).values()]:
                own = inspect.isclass(value) and value.__module__ == info.name
                if own and issubclass(value, kind):
                    yield value
