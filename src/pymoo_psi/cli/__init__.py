"""The command ``pymoo-psi``."""

from pymoo_psi.cli._app import main, run

__all__ = ["main", "run"]
