"""How often random tests draw: a quarter of the times, and all of them in ``pytest -m slow``."""

import pytest
from hypothesis import settings


def seeds(n):
    """Parameters of a test: n seeds, of which a quarter runs each time."""
    often = n // 4
    rare = [pytest.param(seed, marks=pytest.mark.slow) for seed in range(often, n)]
    return [*range(often), *rare]


def examples(factor):
    """Let Hypothesis draw a multiple of its usual number of examples."""
    return settings(max_examples=factor * settings.default.max_examples)
