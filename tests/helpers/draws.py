"""How often random tests draw: a quarter of the times, and all of them in ``pytest -m slow``."""

import pytest
from hypothesis import settings


def seeds(n):
    """Parameters of a test: n seeds, of which a quarter runs each time."""
    often = n // 4
    return [*range(often), *rarely(*range(often, n))]


def rarely(*values):
    """Parameters of a test that are slow."""
    return [pytest.param(value, marks=pytest.mark.slow) for value in values]


def examples(factor):
    """Let Hypothesis draw a multiple, or a part, of its usual number of examples."""
    return settings(max_examples=int(factor * settings.default.max_examples))
