"""The problems of the benchmark :mod:`benchmarks.comparison` by name, and those of other packages.

The latter require ``pip install botorch``, and ``pip install cmo`` (GPL).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem
from pymoo.problems import get_problem

from benchmarks.machine import output
from pymoo_psi import VectorizedSphereChute
from pymoo_psi.algorithms import reference_directions
from pymoo_psi.comparison import Reference
from pymoo_psi.pareto import UtopianFrame

REFERENCES = Path(__file__).parent / "references"

PROBLEMS: dict[str, Callable[[], Any]] = {}
for model in ("full", "rolling"):
    for mu in (0.2, 0.4, 0.6):
        PROBLEMS[f"chute-{model}-{mu}"] = partial(VectorizedSphereChute, mu, model=model)
for name in ("bnh", "osy", "welded_beam", "truss2d", "mw7", "zdt1", "zdt2", "zdt3"):
    PROBLEMS[name] = partial(get_problem, name)
PROBLEMS["dtlz2"] = partial(get_problem, "dtlz2", n_var=13, n_obj=4)
PROBLEMS["dtlz7"] = partial(get_problem, "dtlz7", n_var=23, n_obj=4)


def known_front(name: str, problem: Any) -> Any:
    """Return points of the true Pareto front, ``None`` if there is no formula for them."""
    if name == "dtlz2":
        return problem.pareto_front(reference_directions(problem.n_obj, 1000))
    if name in ("bnh", "zdt1", "zdt2", "zdt3"):
        return problem.pareto_front()
    return None


def keep_reference(name: str, reference: Reference) -> None:
    """Write the reference of a problem, against which runs are measured."""
    np.savez_compressed(
        output(REFERENCES / f"{name}.npz"),
        ideal=reference.frame.ideal,
        nadir=reference.frame.nadir,
        points=reference.points,
        optimum=reference.optimum,
    )


def kept_reference(name: str) -> Reference:
    """Read the reference of a problem; a local search has improved its optimum."""
    with np.load(REFERENCES / f"{name}.npz") as arrays:
        frame = UtopianFrame(arrays["ideal"], arrays["nadir"], normalize=True)
        return Reference(frame, arrays["points"], arrays["optimum"])


@dataclass(frozen=True)
class Published:
    """A problem of BoTorch, all objectives minimised.

    Attributes:
        name: Name of BoTorch's class.
        n_var: Number of variables.
        reference: The reference point of the hypervolume in BoTorch.
        maximum: The largest hypervolume by BoTorch, or by three runs of NSGA-III with 20 000
            evaluations.
        options: Arguments of the class.
        published: Whether the maximum is BoTorch's.
    """

    name: str
    n_var: int
    reference: tuple[float, ...]
    maximum: float
    options: dict[str, int] = field(default_factory=dict)
    published: bool = True

    def __call__(self) -> Problem:
        """Return it as a problem of pymoo."""
        from botorch.test_functions import multi_objective

        problem = getattr(multi_objective, self.name)(**self.options)
        return OfBoTorch(problem, self.reference)


class OfBoTorch(Problem):
    """A problem of BoTorch for pymoo, with the reference point ``ref_point``."""

    def __init__(self, problem: Any, ref_point: tuple[float, ...]) -> None:
        self.problem = problem
        self.ref_point = np.array(ref_point)
        xl, xu = problem.bounds.double().numpy()
        n_ieq = getattr(problem, "num_constraints", 0)
        super().__init__(n_var=problem.dim, n_obj=len(ref_point), n_ieq_constr=n_ieq, xl=xl, xu=xu)

    def _evaluate(
        self, X: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        import torch

        tensor = torch.tensor(X, dtype=torch.double)
        out["F"] = self.problem(tensor, noise=False).numpy()
        if self.n_ieq_constr:
            out["G"] = -self.problem.evaluate_slack(tensor, noise=False).numpy()


BRANIN_CURRIN = Published("BraninCurrin", 2, (18.0, 6.0), 59.36011874867746)
VEHICLE_SAFETY = Published(
    "VehicleSafety",
    n_var=5,
    reference=(1864.72022, 11.81993945, 0.2903999384),
    maximum=246.81607081187002,
)
CAR_SIDE_IMPACT = Published(
    "CarSideImpact",
    n_var=7,
    reference=(45.4872, 4.5114, 13.3394, 10.3942),
    maximum=484.72654347642793,
)
PENICILLIN = Published("Penicillin", 7, (25.935, 57.612, 935.5), 2183455.909507436)
C2DTLZ2 = Published(
    "C2DTLZ2",
    n_var=4,
    reference=(1.1, 1.1),
    maximum=0.3996406303723544,
    options={"dim": 4, "num_objectives": 2},
)
DISC_BRAKE = Published("DiscBrake", 4, (5.7771, 3.9651), 11.2053, published=False)
WELDED_BEAM = Published("WeldedBeam", 4, (40.0, 0.015), 0.0701921, published=False)
OSY = Published("OSY", 6, (-75.0, 75.0), 9889.32, published=False)
PUBLISHED = {
    "branin_currin": BRANIN_CURRIN,
    "vehicle_safety": VEHICLE_SAFETY,
    "car_side_impact": CAR_SIDE_IMPACT,
    "penicillin": PENICILLIN,
    "c2dtlz2": C2DTLZ2,
    "disc_brake": DISC_BRAKE,
    "botorch-welded_beam": WELDED_BEAM,
    "botorch-osy": OSY,
}


@dataclass(frozen=True)
class Cmo:
    """A problem of ``cmo``: CRE (Tanabe and Ishibuchi 2020), RCM (Kumar et al. 2021).

    Attributes:
        name: Name of the class, in lower case.
        n_var: Number of variables.
    """

    name: str
    n_var: int

    def __call__(self) -> Problem:
        """Return the problem."""
        from cmo.problems import cre, rcm

        module = rcm
        if self.name.startswith("cre"):
            module = cre
        return getattr(module, self.name.upper())()


# The constraints of CRE are 0 where they are met. Those RCM are omitted that are CRE's problems
# with other constraints.
_CRE = {"cre21": 3, "cre22": 4, "cre23": 4, "cre24": 7, "cre25": 4, "cre31": 7, "cre32": 6}
_CRE["cre51"] = 3
_RCM = {1: 4, 2: 5, 10: 2, 12: 4, 13: 7, 14: 5, 15: 3, 16: 2, 18: 3, 19: 10, 20: 4, 21: 6}
_RCM |= {25: 2, 27: 3, 29: 7}
_N_VAR = _CRE | {f"rcm{number}": n_var for number, n_var in _RCM.items()}
CMO = {name: Cmo(name, n_var) for name, n_var in _N_VAR.items()}
