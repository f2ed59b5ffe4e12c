"""Models that are one function."""

from pymoo.core.problem import ElementwiseProblem


class Model(ElementwiseProblem):
    """A model whose results, by their names in pymoo, a function returns; in the unit cube.

    It notes what the function was called with, and may be interrupted.

    Args:
        results: Of a design, what pymoo's ``out`` gets; of a noisy model, of a design and a seed.
        fails: Whether a design, of the same arguments, has no results.
        noisy: Whether the model is noisy.
        stop: After how many calls Ctrl-C is pressed.
        options: Arguments of pymoo's problem.
    """

    def __init__(self, results, *, fails=None, noisy=False, stop=None, **options):
        bounds = {} if "vars" in options else {"xl": 0.0, "xu": 1.0}
        super().__init__(**{"n_obj": 2} | bounds | options)
        self.results, self.fails, self.noisy, self.stop = results, fails, noisy, stop
        self.calls = []

    def fingerprint(self):
        return {}

    def _evaluate(self, x, out, *args, seed=None, **kwargs):
        if len(self.calls) == self.stop:
            raise KeyboardInterrupt
        self.calls.append((x, seed) if self.noisy else (x,))
        if self.fails is not None and self.fails(*self.calls[-1]):
            raise ArithmeticError("no convergence")
        out.update(self.results(*self.calls[-1]))


class Sum(ElementwiseProblem):
    """Two objectives of two variables; before a design is evaluated, a function may see it."""

    def __init__(self, before=lambda x: None, **options):
        super().__init__(n_var=2, n_obj=2, xl=0, xu=1, **options)
        self.before = before

    def fingerprint(self):
        return {}

    def _evaluate(self, x, out, *args, **kwargs):
        self.before(x)
        out["F"] = [x[0] + x[1] ** 2, 1 - x[0] * x[1]]


def asked_and_told(problem, algorithm):
    """Return an algorithm after it was asked and told until it has no more points."""
    algorithm.setup(problem)
    while algorithm.has_next():
        designs = algorithm.ask()
        algorithm.tell(infills=algorithm.evaluator.eval(algorithm.problem, designs))
    return algorithm
