"""``python -m pymoo_psi``: the command ``pymoo-psi``."""

from pymoo_psi.cli import run

if __name__ == "__main__":
    run()
