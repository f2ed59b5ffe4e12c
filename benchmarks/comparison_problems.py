"""The problems of the benchmark :mod:`benchmarks.comparison`, by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
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
