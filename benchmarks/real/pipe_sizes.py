"""Pipe sizes of a water network by EPANET (WNTR): cost against pressure and pumping.

Network 1 of EPANET (Rossman, EPANET 2 users manual, 2000), as WNTR ships it: a pump, a tank and
twelve pipes whose diameters are chosen among those on sale; a day is simulated by the hour.

    pip install wntr
    pymoo-psi solve benchmarks.real.pipe_sizes:PipeSizes --points 256 --study pipes.db
"""

from __future__ import annotations

import os
import tempfile
from typing import Any

import wntr
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Choice

INCHES = [6, 8, 10, 12, 14, 16, 18]  # sizes for which WNTR knows the cost
PIPES = ("10", "11", "12", "21", "22", "31", "110", "111", "112", "113", "121", "122")


class PipeSizes(ElementwiseProblem):
    """A diameter for each pipe; yearly cost, energy of pumping a day, least pressure."""

    def __init__(self) -> None:
        self.names = {"f1": "cost", "f2": "energy", "f3": "pressure", "g1": "chlorine>=0.15"}
        self.units = {"cost": "$/a", "energy": "kWh", "pressure": "m", "chlorine": "mg/l"}
        self.maximize = ["pressure"]
        pipes = {f"pipe_{name}": Choice(options=INCHES) for name in PIPES}
        super().__init__(vars=pipes, n_obj=3, n_ieq_constr=1)

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        network = wntr.network.WaterNetworkModel("Net1")
        for name in PIPES:
            network.get_link(name).diameter = 0.0254 * x[f"pipe_{name}"]
        # EPANET writes its files where it runs, and two workers must not share them.
        with tempfile.TemporaryDirectory() as folder:
            found = wntr.sim.EpanetSimulator(network).run_sim(file_prefix=os.path.join(folder, "a"))
        flow, head = found.link["flowrate"], found.node["head"]
        joules = wntr.metrics.pump_energy(flow, head, network).sum().sum()
        pressure = found.node["pressure"][network.junction_name_list].to_numpy().min()
        if pressure < 0:  # EPANET goes on with demands that nothing supplies
            raise ArithmeticError(f"a junction is not supplied, its pressure is {pressure:.0f} m")
        # the first hours still have the chlorine of the start
        chlorine = (
            1000 * found.node["quality"][network.junction_name_list].iloc[12:].to_numpy().min()
        )
        out["F"] = [wntr.metrics.annual_network_cost(network), joules / 3.6e6, -pressure]
        out["G"] = [0.15 - chlorine]
        out["chlorine"] = chlorine
