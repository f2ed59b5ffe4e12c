"""The values printed in Tables 6.1 and 6.2 of the paper, to be compared with computed ones.

Cheshankov, Bozduganova, Ivanov, Vitliemov: Multi-objective Motion Synthesis of a Rolling Sphere
in a Rectilinear Chute-conveyor with Transformed Dry Friction, Technische Mechanik 32(6), 2012,
684–697. The test point that Table 6.2 calls 1356 is number 2571 by its f3 and f4.
"""

from __future__ import annotations

import json
from importlib import resources

import pandas as pd


def published_table(number: str) -> pd.DataFrame:
    """Return a printed table.

    Args:
        number: ``"6.1"`` (Salukvadze optima) or ``"6.2"`` (selected designs of rank 5).

    Returns:
        One row per printed row; columns ``mu``, ``test_point``, ``paper_f1`` … ``paper_f4``.

    Example:
        >>> print(published_table("6.1"))
            mu  test_point  paper_f1  paper_f2  paper_f3  paper_f4
        0  0.2        3599    1.9829    0.0532    0.3074    0.1130
        1  0.4        3085    2.0454    0.0476    0.2635    0.1072
        2  0.6        1029    2.0454    0.0476    0.2635    0.1144
    """
    text = resources.files(__package__).joinpath("published.json").read_text("utf-8")
    rows = json.loads(text)[f"table_{number.replace('.', '_')}"]
    return pd.DataFrame(
        [
            {"mu": row["mu"], "test_point": row["test_point"]}
            | {f"paper_f{j}": value for j, value in enumerate(row["f"], start=1)}
            for row in rows
        ]
    )
