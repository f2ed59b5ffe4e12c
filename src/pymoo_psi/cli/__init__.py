"""The command ``pymoo-psi``."""

from pymoo_psi.cli.app import main, run

__all__ = ["main", "run"]
