"""Parameter Space Investigation on arrays: the table of tests and what is asked of it."""

from pymoo_psi.investigation.box import section_points
from pymoo_psi.investigation.layout import Layout
from pymoo_psi.investigation.prototype import Prototype
from pymoo_psi.investigation.statistics import Dependence, Histogram
from pymoo_psi.investigation.table import TestTable

__all__ = [  # noqa: RUF022 - by subject
    # The table
    "Layout",
    "Prototype",
    "TestTable",
    # Data to draw
    "Dependence",
    "Histogram",
    # Designs to evaluate next
    "section_points",
]
