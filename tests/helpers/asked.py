"""What several tests ask of a table."""

import itertools

import numpy as np
import pandas as pd

from pymoo_psi import Formulation


def freed(table, *names):
    """The table with constraints as further objectives."""
    return table.under(Formulation(objectives=[*table.schema.objectives, *names]))


def violations(table, limits=None):
    """The names of the constraints and limits that designs violate, by test point."""
    mask, names = table.under(limits=limits).violations()
    pairs = zip(table.numbers.tolist(), mask.tolist(), strict=True)
    return {n: tuple(itertools.compress(names, row)) for n, row in pairs if any(row)}


def kept_by_hand(n, column, limits):
    """Which of n rows a reader of their columns would keep: between two ends, or of these texts."""
    mask = np.ones(n, dtype=bool)
    for name, limit in limits.items():
        values = pd.Series(column(name))
        if all(isinstance(end, str) for end in limit):
            mask &= values.isin(limit).to_numpy()
        else:
            low, high = limit
            ends = (-np.inf if low is None else low, np.inf if high is None else high)
            mask &= values.between(*ends).to_numpy()
    return mask
