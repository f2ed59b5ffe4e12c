"""Parameter Space Investigation on arrays: the table of tests."""

from pymoo_psi.investigation.table import TestTable

__all__ = ["TestTable"]
