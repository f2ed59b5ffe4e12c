"""The paper's results computed anew, beside its printed values."""

from pymoo_psi.paper._published import published_table
from pymoo_psi.paper._reproduction import (
    PAPER_MU,
    PAPER_POINTS,
    Case,
    Reproduction,
    reproduce,
    solve_case,
)

__all__ = [
    "PAPER_MU",
    "PAPER_POINTS",
    "Case",
    "Reproduction",
    "published_table",
    "reproduce",
    "solve_case",
]
