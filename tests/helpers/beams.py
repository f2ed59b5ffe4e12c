"""A set of designs for the tests of the decision page."""

from dataclasses import replace

import numpy as np
import pandas as pd

from pymoo_psi import Formulation, read_table
from pymoo_psi.page import decision_page
from tests.helpers.fronts import on_sphere

OBJECTIVES = ["mass", "cost, total", "strength"]


def beams(n=400, noise=0.1):
    """Designs on a bent front, some of them dominated; named B1001, B1002, …"""
    rng = np.random.default_rng(7)
    F = (1.2 - on_sphere(rng, n, 3)) ** 1.5 * [1, 2, 1]
    F += noise * rng.random((n, 1)) ** 2
    F[:, 2] += 0.3 * F[:, 0]
    frame = pd.DataFrame(F * [1, 100, -1], columns=OBJECTIVES)
    frame["width"] = rng.random(n) * 20
    frame["material"] = rng.choice(["steel", "<b>wood</b>"], n)
    frame["number"] = [f"B{k}" for k in range(1001, 1001 + n)]
    return frame


def page_of_beams(**changes):
    """The page of the beams, with an existing one beside them."""
    former = {"mass": 1.4, "cost, total": 90.0, "strength": 0.2}
    former |= {"width": 5.0, "material": "bronze"}
    arguments = {
        "prototype": pd.DataFrame([former], ["prototype"]),
        "title": "Beams <&> such",
    }
    asked = changes.pop("formulation", Formulation(OBJECTIVES, maximize=["strength"]))
    asked = replace(asked, units={"mass": "kg", "width": "mm"})
    source = read_table(changes.pop("source", beams()), asked, variables=["width", "material"])
    return decision_page(source, **arguments | changes)
