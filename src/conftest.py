"""What the examples in docstrings have at hand beside what they say themselves."""

from typing import Any

import pytest


@pytest.fixture(scope="session")
def bnh() -> Any:
    """The problem of the examples of ``Comparison`` and ``Reference``."""
    from pymoo.problems import get_problem

    return get_problem("bnh")


@pytest.fixture(scope="session")
def result(bnh: Any) -> Any:
    """The comparison of the examples of ``Comparison`` and ``Reference``."""
    from pymoo_psi.comparison import compare

    return compare(bnh, n_evaluations=[32, 64], seeds=3, algorithms=["psi", "nsga3"])


@pytest.fixture(scope="session")
def case() -> Any:
    """The case of the example of ``Case``."""
    from pymoo_psi.paper import solve_case

    return solve_case(0.4, "rolling", 4096)


@pytest.fixture(scope="session", name="TestTable")
def test_table() -> Any:
    """The class of which the examples of its bases are."""
    from pymoo_psi import TestTable

    return TestTable


# What the examples of a file go on with; to compute it for each would take most of their time.
SHARED = {
    "table/_tests.py": ["TestTable"],
    "comparison/_comparison.py": ["bnh", "result"],
    "comparison/_runs.py": ["result"],
    "pymoo_psi/paper.py": ["case"],
}


@pytest.fixture(autouse=True)
def names(request: pytest.FixtureRequest, doctest_namespace: dict[str, Any]) -> None:
    """Give an example what another one of its file has made."""
    for file, shared in SHARED.items():
        if request.node.path.match(file):
            for name in shared:
                doctest_namespace[name] = request.getfixturevalue(name)
