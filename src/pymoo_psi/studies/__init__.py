"""Studies made with the package: the paper's cases beside its printed values."""

from pymoo_psi.studies.paper import PAPER_MU, Reproduction, reproduce

__all__ = ["PAPER_MU", "Reproduction", "reproduce"]
