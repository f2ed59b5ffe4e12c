"""Studies on disk: what was evaluated is kept, whatever happens to the process that did it."""

from pymoo_psi.storage._folder import read_folder
from pymoo_psi.storage._study import Study, read_study, write_study

__all__ = ["Study", "read_folder", "read_study", "write_study"]
