"""The test table: tested points under limits, their analysis, and their files.

Also any file of designs, see :func:`read_designs`.
"""

from pymoo_psi._kinds import Kind
from pymoo_psi.table._convergence import Convergence, convergence
from pymoo_psi.table._design_file import DesignFile, read_designs
from pymoo_psi.table._formulation import Formulation
from pymoo_psi.table._layout import Layout
from pymoo_psi.table._prototype import Prototype
from pymoo_psi.table._rules import FeasibilityRules, Rule, feasibility_rules
from pymoo_psi.table._sensitivity import sensitivities
from pymoo_psi.table._table import TestTable
from pymoo_psi.table.analysis import (
    Dependence,
    Histogram,
    compare_with_prototype,
    constraint_as_criterion,
    constraint_costs,
    dependence,
    histogram,
    section_points,
    violations,
)

__all__ = [
    "Convergence",
    "Dependence",
    "DesignFile",
    "FeasibilityRules",
    "Formulation",
    "Histogram",
    "Kind",
    "Layout",
    "Prototype",
    "Rule",
    "TestTable",
    "compare_with_prototype",
    "constraint_as_criterion",
    "constraint_costs",
    "convergence",
    "dependence",
    "feasibility_rules",
    "histogram",
    "read_designs",
    "section_points",
    "sensitivities",
    "violations",
]
