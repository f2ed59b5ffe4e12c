"""The commands that test designs of a problem, and their options."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, TypeAlias

import typer

__all__ = ["compare", "reproduce", "solve"]


class AlgorithmName(str, Enum):
    """The algorithms of ``solve``."""

    psi = "psi"
    nsga3 = "nsga3"


class ModelName(str, Enum):
    """The models of the chute."""

    full = "full"
    rolling = "rolling"


class AssessedName(str, Enum):
    """What ``compare`` measures of a run."""

    evaluated = "evaluated"
    returned = "returned"


ProblemName: TypeAlias = Annotated[
    str, typer.Argument(help="'chute', the name of a pymoo test problem, or module:attribute.")
]
Jobs: TypeAlias = Annotated[
    int, typer.Option(metavar="N", help="Processes for one design at a time; -1: one per core.")
]
Friction: TypeAlias = Annotated[
    float | None, typer.Option(help="chute: friction coefficient [0.2].")
]
Speed: TypeAlias = Annotated[float | None, typer.Option(help="chute: initial speed [0.3193].")]
Radius: TypeAlias = Annotated[float | None, typer.Option(help="chute: radius [0.1].")]
Model: TypeAlias = Annotated[ModelName | None, typer.Option(help="chute: the motion [full].")]


def reproduce(
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for tables (CSV) and figures (PNG).")
    ] = Path("reproduction"),
    points: Annotated[int, typer.Option(metavar="Q", help="Test points per case.")] = 4096,
    jobs: Jobs = 1,
) -> int:
    """Compute the paper's tables under both models, beside the printed values."""
    from pymoo_psi.cli.reproduce import run_reproduce

    return run_reproduce(out, points, jobs)


def solve(
    problem: ProblemName,
    algorithm: Annotated[AlgorithmName, typer.Option(help="How to search.")] = AlgorithmName.psi,
    points: Annotated[int, typer.Option(metavar="N", help="Designs to evaluate.")] = 4096,
    seed: Annotated[int, typer.Option(metavar="S", help="Seed of nsga3; psi needs none.")] = 1,
    jobs: Jobs = 1,
    limits: Annotated[
        str | None,
        typer.Option(metavar="F1=2.5,F4=1", help="Limits on criteria, f1 <= 2.5 … (psi)."),
    ] = None,
    timeout: Annotated[
        float | None,
        typer.Option(metavar="S", help="Seconds a design may take; then it has failed."),
    ] = None,
    study: Annotated[
        Path | None,
        typer.Option(metavar="FILE.db", help="Store every tested design here (psi); continues."),
    ] = None,
    study_key: Annotated[
        str | None, typer.Option(metavar="K", help="What else the study depends on: a version.")
    ] = None,
    retry: Annotated[
        str | None,
        typer.Option(metavar="failed|1,2", help="Test failed designs of the study once more."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Write the Pareto set here.")
    ] = None,
    mu: Friction = None,
    c: Speed = None,
    r: Radius = None,
    model: Model = None,
) -> int:
    """Find the Pareto set of a problem and rank it by efficiency."""
    from pymoo_psi.cli.problem import load_problem
    from pymoo_psi.cli.solve import run_solve
    from pymoo_psi.cli.words import points_in, upper_limits_in

    points_again, upper = points_in("--retry", retry), upper_limits_in(limits)
    return run_solve(
        load_problem(problem, _chute(mu, c, r, model), jobs, timeout),
        algorithm.value,
        points,
        seed=seed,
        limits=upper,
        study=study,
        study_key=study_key,
        retry=points_again,
        out=out,
    )


def compare(
    problem: ProblemName,
    evaluations: Annotated[
        str, typer.Option(metavar="N,N,…", help="Numbers of evaluations.")
    ] = "256,1024,4096",
    seeds: Annotated[int, typer.Option(metavar="N", help="Runs of an algorithm by chance.")] = 11,
    algorithms: Annotated[
        str,
        typer.Option(
            metavar="A,B,…",
            help="Of psi, psi-scrambled, nsga3, psi+nsga3, nsga2, moead, ….",
        ),
    ] = "psi,psi-scrambled,nsga3,psi+nsga3",
    assess: Annotated[
        AssessedName, typer.Option(help="Measure all that was evaluated, or what was returned.")
    ] = AssessedName.evaluated,
    reference: Annotated[
        Path | None,
        typer.Option(metavar="FILE.npz", help="Measure against the reference of another study."),
    ] = None,
    jobs: Annotated[int, typer.Option(metavar="N", help="Runs at a time; -1: one per core.")] = 1,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write tables, figures and runs here; continues."),
    ] = None,
    mu: Friction = None,
    c: Speed = None,
    r: Radius = None,
    model: Model = None,
) -> int:
    """Compare PSI with NSGA-III and others on a problem at equal numbers of evaluations."""
    from pymoo_psi.cli.compare import run_compare
    from pymoo_psi.cli.problem import load_problem

    return run_compare(
        load_problem(problem, _chute(mu, c, r, model), 1), evaluations=evaluations, seeds=seeds,
        algorithms=algorithms, assess=assess.value, reference=reference, jobs=jobs, out=out,
    )  # fmt: skip


def _chute(
    mu: float | None, c: float | None, r: float | None, model: ModelName | None
) -> dict[str, float | str]:
    given = {"mu": mu, "c": c, "r": r, "model": model and model.value}
    return {name: value for name, value in given.items() if value is not None}
