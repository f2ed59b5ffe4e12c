"""Models that are one function."""

from pymoo.core.problem import ElementwiseProblem


class Model(ElementwiseProblem):
    """A model whose results, by their names in pymoo, a function returns; in the unit cube.

    Args:
        results: Of a design, what pymoo's ``out`` gets.
        options: Arguments of pymoo's problem.
    """

    def __init__(self, results, **options):
        bounds = {} if "vars" in options else {"xl": 0.0, "xu": 1.0}
        super().__init__(**{"n_obj": 2} | bounds | options)
        self.results = results

    def fingerprint(self):
        return {}

    def _evaluate(self, x, out, *args, **kwargs):
        out.update(self.results(x))
