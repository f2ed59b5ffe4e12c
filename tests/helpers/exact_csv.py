"""Numbers of a CSV file to the last digit, whatever the release of pandas."""

import pandas as pd

# From 3.1 on pandas reads so by itself, and warns of being asked.
BEFORE = tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1)
EXACT = {"float_precision": "round_trip"} if BEFORE else {}
