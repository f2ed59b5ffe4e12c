"""What shows a run of PSI and what ends it."""

from __future__ import annotations

from typing import Any

from pymoo.core.termination import Termination
from pymoo.util.display.column import Column
from pymoo.util.display.output import Output

__all__ = ["PSIOutput", "PointsTested"]


class PointsTested(Termination):
    """Terminate when every test point has been told; the progress is the share of them."""

    def _update(self, algorithm: Any) -> float:
        progress: float = algorithm.n_tested / algorithm.n_points
        return progress


def _n_tested(algorithm: Any) -> int:
    return int(algorithm.n_tested)


def _n_failed(algorithm: Any) -> int:
    return int((algorithm.table.status == "failed").sum())


def _n_feasible(algorithm: Any) -> int:
    return int(algorithm.table.feasible(algorithm.limits).sum())


def _n_pareto(algorithm: Any) -> int:
    return len(algorithm.opt)


class PSIOutput(Output):
    """The columns shown by ``verbose=True``.

    Evaluations of this run, tested points (with those of a study), failed, feasible and
    Pareto-optimal designs.
    """

    def __init__(self) -> None:
        super().__init__()
        self.columns += [
            Column("tested", width=8, func=_n_tested),
            Column("failed", width=8, func=_n_failed),
            Column("feasible", width=8, func=_n_feasible),
            Column("n_nds", width=6, func=_n_pareto),
        ]
