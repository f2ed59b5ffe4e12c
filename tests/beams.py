"""A set of designs for the tests of the decision page."""

import numpy as np
import pandas as pd

CRITERIA = ["mass", "cost, total", "strength"]
SETTINGS = {
    "variables": ["width", "material"],
    "maximize": ["strength"],
    "units": {"mass": "kg", "width": "mm"},
    "label": "number",
    "title": "Beams <&> such",
    "prototype": {"mass": 1.4, "cost, total": 90.0, "strength": 0.2, "width": 5.0},
}


def beams(n=400, noise=0.1):
    """Designs on a bent front, some of them dominated; numbered 1001, 1002, …"""
    rng = np.random.default_rng(7)
    F = np.abs(rng.normal(size=(n, 3)))
    F = (1.2 - F / np.linalg.norm(F, axis=1)[:, None]) ** 1.5 * [1, 2, 1]
    F += noise * rng.random((n, 1)) ** 2
    F[:, 2] += 0.3 * F[:, 0]
    frame = pd.DataFrame(F * [1, 100, -1], columns=CRITERIA)
    frame["width"] = rng.random(n) * 20
    frame["material"] = rng.choice(["steel", "<b>wood</b>"], n)
    frame["number"] = np.arange(1001, 1001 + n)
    return frame
