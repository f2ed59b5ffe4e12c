"""Identification: parameters of a model such that it reproduces measured series."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pymoo_psi._validation import (
    Received,
    instance,
    invalid,
    known_name,
    mapping,
    positive_number,
    real_array,
    wrong_type,
)
from pymoo_psi.problems._named import NamedProblem

Array = NDArray[np.float64]

# Of weighted differences of a column, and of several columns.
_MEASURES: dict[str, tuple[Callable[[Array], Any], Callable[[list[Any]], Any]]] = {
    "rms": (lambda off: np.sqrt(np.mean(off**2)), np.mean),
    "max": (lambda off: abs(off).max(), np.max),
}


class Identification(NamedProblem):
    """A model and measured series as a problem: one adequacy objective for each experiment.

    Adequacy of PSI's authors (Statnikov and Statnikov, The Parameter Space Investigation Method
    Toolkit, 2011): how far the simulated series are from the measured ones, to be minimised for
    all experiments at the same time. The investigation, with limits on each experiment, is that
    of any other problem.

    Args:
        simulate: ``simulate(parameters, data)`` returns what the model gives for an experiment:
            ``parameters`` is a value for each variable by name, ``data`` the experiment's frame;
            the result an ``(n,)`` series for one measured column, an array of shape ``(n, k)`` for
            k columns.
        experiments: By name, a frame: the first column is time or another abscissa in increasing
            order, each further one a measured series; NaN is not compared.
        variables: Parameters of the model by name, ``(lower, upper)`` or a :class:`Setting` as a
            mapping, such as ``{"bounds": (1e-3, 10), "scale": "log", "unit": "N/m"}``.
        measure: Of the weighted differences ``"rms"``, the root of the mean square, averaged over
            several columns; or ``"max"``, the greatest.
        weights: Of the columns, by name, which bring them to one unit; needed if there are more
            than one. 1 unless given.
        requirements: Rules on variables, see :class:`Requirement`.
        name: Name of the problem.
        **kwargs: pymoo's own, such as ``elementwise_runner``.

    Attributes:
        experiments: The frames by name.

    Raises:
        ArgumentValueError: A series is not usable, a name not known, or weights are missing.
        ArgumentTypeError: An argument is of another type.

    Example:
        >>> import numpy as np, pandas as pd
        >>> t = np.linspace(0, 5, 30)
        >>> def decay(parameters, data):
        ...     return np.exp(-parameters["rate"] * data["t"])
        >>> measured = {"cooling": pd.DataFrame({"t": t, "T": np.exp(-0.5 * t)})}
        >>> from pymoo_psi import investigate
        >>> table = investigate(Identification(decay, measured, {"rate": (0, 1)}), 63)
        >>> table.best().X
        array([[0.5]])
    """

    def __init__(
        self,
        simulate: Callable[[Mapping[str, Any], pd.DataFrame], Any],
        experiments: Mapping[str, pd.DataFrame],
        variables: Mapping[str, Any],
        *,
        measure: str = "rms",
        weights: Mapping[str, float] | None = None,
        requirements: Any = None,
        name: str = "identification",
        **kwargs: Any,
    ) -> None:
        if not callable(simulate):
            raise wrong_type("simulate", "a function of parameters and data", simulate)
        self.simulate, self.measure = simulate, known_name("measure", measure, _MEASURES)
        given = mapping("experiments", experiments, "names to frames")
        self.experiments = {n: _series(n, data) for n, data in given.items()}
        measured = {column for data in self.experiments.values() for column in data.columns[1:]}
        known = mapping("weights", weights or {}, "columns to numbers")
        if {*known} != measured and (known or len(measured) > 1):
            rule = f"given for {', '.join(sorted(measured))}, whose units may differ"
            raise invalid("weights", rule, weights)
        known = known or dict.fromkeys(measured, 1.0)
        self.weights = {column: positive_number("weights", w) for column, w in known.items()}
        super().__init__(
            variables, [*self.experiments], requirements=requirements, units={}, name=name, **kwargs
        )

    def fingerprint(self) -> dict[str, Any]:
        """Return what a study depends on: the measured series and how they are compared."""
        series = {n: data.to_csv(index=False) for n, data in self.experiments.items()}
        return {"measure": self.measure, "weights": self.weights, "experiments": series}

    def series(self, design: Mapping[str, Any], experiment: str) -> pd.DataFrame:
        """Return what the model gives for an experiment, with the columns of its data.

        Raises:
            PsiError: The model gives something else.
        """
        data = self.experiments[known_name("experiment", experiment, self.experiments)]
        columns, found = data.columns[1:], self.simulate(dict(design), data.copy())
        values = real_array("what simulate returns", found)
        values = values[:, None] if values.ndim == 1 else values
        if values.shape != (len(data), len(columns)):
            rule = f"of shape {(len(data), len(columns))} for {experiment!r}"
            raise invalid("what simulate returns", rule, Received(f"shape {values.shape}"))
        series = pd.DataFrame(values, columns=columns)
        series.insert(0, data.columns[0], data.iloc[:, 0])
        return series

    def values(self, design: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the adequacy of a design in each experiment."""
        return {n: self._adequacy(design, n) for n in self.experiments}

    def _adequacy(self, design: Mapping[str, Any], experiment: str) -> float:
        data, found = self.experiments[experiment], self.series(design, experiment)
        of_column, of_all = _MEASURES[self.measure]
        each = []
        for column in data.columns[1:]:
            known = data[column].notna().to_numpy()
            off = (found[column] - data[column]).to_numpy()[known] * self.weights[column]
            each.append(of_column(off))
        return float(of_all(each))


def _series(name: str, source: Any) -> pd.DataFrame:
    """Return measured series as a frame of numbers."""
    where = f"experiment {name!r}"
    remedy = "read a file by pandas.read_csv"
    data = instance(where, source, pd.DataFrame, remedy).reset_index(drop=True)
    for column in data:
        real_array(f"column {column!r} of {where}", data[column].to_numpy())
    if data.shape[1] < 2 or (data.notna().sum() < 2).any():
        rule = "of two columns or more, each with two numbers or more"
        raise invalid(where, rule, Received(f"shape {data.shape}"))
    if not (np.diff(data.iloc[:, 0]) > 0).all():  # false of NaN, too
        raise invalid(f"the first column of {where}", "in increasing order", data.columns[0])
    return data.astype(np.float64)
