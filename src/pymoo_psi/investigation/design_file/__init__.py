"""Files of designs, from whatever program: what they hold, and which columns are objectives."""

from pymoo_psi.investigation.design_file.file import DesignFile, unfit
from pymoo_psi.investigation.design_file.reading import read_designs
from pymoo_psi.investigation.design_file.roles import Roles

__all__ = ["DesignFile", "Roles", "read_designs", "unfit"]
