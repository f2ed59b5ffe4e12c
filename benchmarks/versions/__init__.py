"""Two versions of the package compared on random cases; see ``__main__``."""
