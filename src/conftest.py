"""What the examples in docstrings have at hand beside what they say themselves."""

from typing import Any

import pytest


@pytest.fixture(scope="session")
def comparison() -> Any:
    """The comparison of the example of ``save_comparison``, which the other pages go on with."""
    from pymoo.problems import get_problem

    from pymoo_psi.comparison import compare

    return compare(get_problem("bnh"), n_evaluations=(32, 64), seeds=2, algorithms=["psi", "nsga3"])


@pytest.fixture(autouse=True)
def names(request: pytest.FixtureRequest, doctest_namespace: dict[str, Any]) -> None:
    """Give the examples of the pages of a comparison this one."""
    if request.node.path.match("plots/_comparison.py"):
        doctest_namespace["comparison"] = request.getfixturevalue("comparison")
