"""Parameter Space Investigation on arrays: the table of tests and what is asked of it."""

from pymoo_psi.table._box import section_points
from pymoo_psi.table._design_file import DesignFile, read_designs
from pymoo_psi.table._layout import Layout
from pymoo_psi.table._prototype import Prototype
from pymoo_psi.table._statistics import Dependence, Histogram
from pymoo_psi.table._table import TestTable

__all__ = [
    "Dependence",
    "DesignFile",
    "Histogram",
    "Layout",
    "Prototype",
    "TestTable",
    "read_designs",
    "section_points",
]
