"""The problems of the benchmark :mod:`benchmarks.comparison`, by name, and those of others.

Those need ``pip install botorch``, and ``pip install cmo`` (GPL).
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

from pymoo_psi import VectorizedSphereChute
from pymoo_psi.algorithms import reference_directions
from pymoo_psi.comparison import Reference
from pymoo_psi.pareto import UtopianFrame

REFERENCES = Path(__file__).parent / "references"

PROBLEMS: dict[str, Callable[[], Any]] = {
    **{
        f"chute-{model}-{mu}": partial(VectorizedSphereChute, mu, model=model)
        for model in ("full", "rolling")
        for mu in (0.2, 0.4, 0.6)
    },
    "bnh": partial(get_problem, "bnh"),
    "osy": partial(get_problem, "osy"),
    "welded_beam": partial(get_problem, "welded_beam"),
    "truss2d": partial(get_problem, "truss2d"),
    "mw7": partial(get_problem, "mw7"),
    "zdt1": partial(get_problem, "zdt1"),
    "zdt2": partial(get_problem, "zdt2"),
    "zdt3": partial(get_problem, "zdt3"),
    "dtlz2": partial(get_problem, "dtlz2", n_var=13, n_obj=4),
    "dtlz7": partial(get_problem, "dtlz7", n_var=23, n_obj=4),
}


def known_front(name: str, problem: Any) -> Any:
    """Return points of the true Pareto front where there is a formula for them, else nothing."""
    if name == "dtlz2":
        return problem.pareto_front(reference_directions(problem.n_obj, 1000))
    return problem.pareto_front() if name in ("bnh", "zdt1", "zdt2", "zdt3") else None


def keep_reference(name: str, reference: Reference) -> None:
    """Write what the runs on a problem are measured against."""
    frame = reference.frame
    np.savez_compressed(
        REFERENCES / f"{name}.npz", ideal=frame.ideal, nadir=frame.nadir, points=reference.points,
        n_union=reference.n_union, optimum=reference.optimum,
    )  # fmt: skip


def kept_reference(name: str) -> Reference:
    """Read what runs were measured against; its optimum was polished by a local search."""
    with np.load(REFERENCES / f"{name}.npz") as kept:
        frame = UtopianFrame(kept["ideal"], kept["nadir"], normalize=True)
        return Reference(frame, kept["points"], int(kept["n_union"]), kept["optimum"])


@dataclass(frozen=True)
class Published:
    """A problem of BoTorch, all objectives minimised.

    Attributes:
        name: BoTorch's class.
        n_var: How many variables.
        reference: The reference point of the hypervolume in BoTorch.
        maximum: The hypervolume of BoTorch, or of three runs of NSGA-III with 20 000 evaluations.
        options: Of the class.
        published: Whether BoTorch has a maximum.
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

        return OfBoTorch(getattr(multi_objective, self.name)(**self.options), self.reference)


class OfBoTorch(Problem):
    """A problem of BoTorch for pymoo, with the reference point ``ref_point``."""

    def __init__(self, problem: Any, ref_point: tuple[float, ...]) -> None:
        self.problem, self.ref_point = problem, np.array(ref_point)
        xl, xu = problem.bounds.double().numpy()
        n_ieq = getattr(problem, "num_constraints", 0)
        super().__init__(n_var=problem.dim, n_obj=len(ref_point), n_ieq_constr=n_ieq, xl=xl, xu=xu)

    def _evaluate(
        self, X: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        import torch

        given = torch.tensor(X, dtype=torch.double)
        out["F"] = self.problem(given, noise=False).numpy()
        if self.n_ieq_constr:
            out["G"] = -self.problem.evaluate_slack(given, noise=False).numpy()


PUBLISHED = {
    "branin_currin": Published("BraninCurrin", 2, (18.0, 6.0), 59.36011874867746),
    "vehicle_safety": Published(
        "VehicleSafety", 5, (1864.72022, 11.81993945, 0.2903999384), 246.81607081187002
    ),
    "car_side_impact": Published(
        "CarSideImpact", 7, (45.4872, 4.5114, 13.3394, 10.3942), 484.72654347642793
    ),
    "penicillin": Published("Penicillin", 7, (25.935, 57.612, 935.5), 2183455.909507436),
    "c2dtlz2": Published(
        "C2DTLZ2", 4, (1.1, 1.1), 0.3996406303723544, {"dim": 4, "num_objectives": 2}
    ),
    "disc_brake": Published("DiscBrake", 4, (5.7771, 3.9651), 11.2053, published=False),
    "botorch-welded_beam": Published("WeldedBeam", 4, (40.0, 0.015), 0.0701921, published=False),
    "botorch-osy": Published("OSY", 6, (-75.0, 75.0), 9889.32, published=False),
}


@dataclass(frozen=True)
class Cmo:
    """A problem of ``cmo``: CRE (Tanabe and Ishibuchi 2020), RCM (Kumar et al. 2021).

    Attributes:
        name: Of the class, in small letters.
        n_var: How many variables.
    """

    name: str
    n_var: int

    def __call__(self) -> Problem:
        """Return it."""
        from cmo.problems import cre, rcm

        return getattr(cre if self.name.startswith("cre") else rcm, self.name.upper())()


CMO = {
    name: Cmo(name, n_var)
    for name, n_var in {
        "cre21": 3, "cre22": 4, "cre23": 4, "cre24": 7, "cre25": 4, "cre31": 7, "cre32": 6,
        "cre51": 3, "rcm1": 4, "rcm2": 5, "rcm10": 2, "rcm12": 4, "rcm13": 7, "rcm14": 5,
        "rcm15": 3, "rcm16": 2, "rcm18": 3, "rcm19": 10, "rcm20": 4, "rcm21": 6, "rcm25": 2,
        "rcm27": 3, "rcm29": 7,
    }.items()
}  # fmt: skip
"""CRE's constraints are 0 where they are met. The RCM left out are CRE's with other constraints."""
