"""What several tests ask of a table."""

import itertools

from pymoo_psi import Formulation


def freed(table, *names):
    """The table with constraints as further objectives."""
    return table.under(Formulation(objectives=[*table.layout.objectives, *names]))


def violations(table, limits=None):
    """The names of the constraints and limits that designs violate, by test point."""
    mask, names = table.under(limits=limits).violations()
    pairs = zip(table.numbers.tolist(), mask.tolist(), strict=True)
    return {n: tuple(itertools.compress(names, row)) for n, row in pairs if any(row)}
