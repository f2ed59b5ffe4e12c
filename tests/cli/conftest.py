"""What is printed in tests is read as through a pipe, which has no width."""

import os

os.environ.pop("COLUMNS", None)  # as pytest-xdist sets it
