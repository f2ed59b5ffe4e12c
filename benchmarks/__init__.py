"""Measurements too long for the tests; each prints its results: ``python -m benchmarks.NAME``."""
