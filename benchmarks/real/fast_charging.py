"""Fast charging of a lithium-ion cell by PyBaMM: time against plating and heat.

The single-particle model with electrolyte, the parameters of O'Kane et al. (2022): charged from
10 % by two constant currents and a hold. Where the solver gives up, the design has failed.

    pip install pybamm
    pymoo-psi solve benchmarks.real.fast_charging:FastCharging --points 256 --study cell.db
"""

from __future__ import annotations

from typing import Any

import pybamm
from pymoo.core.problem import ElementwiseProblem

pybamm.set_logging_level("CRITICAL")


class FastCharging(ElementwiseProblem):
    """Variables: two charging rates, the voltage between them, that of the hold, ambient T."""

    def __init__(self) -> None:
        self.names = {"x1": "rate1", "x2": "rate2", "x3": "switch", "x4": "hold", "x5": "ambient"}
        self.names |= {"f1": "time", "f2": "plating", "f3": "charge", "g1": "temperature<=60"}
        self.units = {"rate1": "C", "rate2": "C", "switch": "V", "hold": "V", "ambient": "°C"}
        self.units |= {"time": "min", "plating": "mAh", "charge": "Ah", "temperature": "°C"}
        self.maximize = ["charge"]
        super().__init__(
            n_var=5, n_obj=3, n_ieq_constr=1,
            xl=[0.5, 0.3, 3.7, 4.0, 5.0], xu=[4.0, 2.0, 4.1, 4.2, 45.0],
        )  # fmt: skip

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        rate1, rate2, switch, hold, ambient = map(float, x)
        options = {"thermal": "lumped", "lithium plating": "irreversible"}
        model = pybamm.lithium_ion.SPMe(options)
        values = pybamm.ParameterValues("OKane2022")
        for name in ("Ambient temperature [K]", "Initial temperature [K]"):
            values[name] = ambient + 273.15
        steps = (
            f"Charge at {rate1} C until {switch} V",
            f"Charge at {rate2} C until {hold} V",
            f"Hold at {hold} V until C/10",
        )
        experiment = pybamm.Experiment([steps])
        found = pybamm.Simulation(model, parameter_values=values, experiment=experiment)
        solution = found.solve(initial_soc=0.1)
        last = solution["Current [A]"].entries[-1]
        if abs(last) > 0.55:  # C/10 of 5 Ah: PyBaMM returns what it has when its solver gives up
            raise ArithmeticError(f"the solver gave up at {last:.3g} A")
        plated = "Loss of capacity to negative lithium plating [A.h]"
        hottest = solution["Volume-averaged cell temperature [K]"].entries.max() - 273.15
        out["F"] = [
            solution["Time [min]"].entries[-1],
            1000 * solution[plated].entries[-1],
            solution["Discharge capacity [A.h]"].entries[-1],  # negative while it is charged
        ]
        out["G"] = [hottest - 60]
        out["temperature"] = hottest
