"""Three models of engineers, whose programs are installed from Debian or PyPI."""
