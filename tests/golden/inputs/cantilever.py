"""A small problem for the transcripts: a constraint, an output, units, a failure, a maximum."""

from typing import ClassVar

from pymoo.core.problem import ElementwiseProblem


class Beam(ElementwiseProblem):
    """Light and stiff; a wide and flat one cannot be computed."""

    names: ClassVar = {
        "x1": "width",
        "x2": "height",
        "f1": "mass",
        "f2": "stiffness",
        "g1": "slender",
    }
    units: ClassVar = {
        "width": "mm",
        "height": "mm",
        "mass": "kg",
        "stiffness": "N/mm",
        "price": "k€",
    }
    maximize: ClassVar = ["stiffness"]

    def __init__(self, price=2.5):
        super().__init__(n_var=2, n_obj=2, n_ieq_constr=1, xl=[10, 20], xu=[50, 120])
        self.price = price

    def fingerprint(self):
        return {"price": self.price}

    def _evaluate(self, x, out, *args, **kwargs):
        width, height = x
        if width > 40 and height < 40:
            raise ValueError("the mesh is distorted")
        mass = 7.85e-3 * width * height
        out["F"] = [mass, -52.5e-6 * width * height**3]
        out["G"] = [height - 4 * width]
        out["price"] = self.price * mass**0.5 + 0.01 * width
