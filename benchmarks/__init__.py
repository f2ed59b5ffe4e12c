"""Measurements too long for the tests; each prints what it measures: ``python -m benchmarks.NAME``."""
