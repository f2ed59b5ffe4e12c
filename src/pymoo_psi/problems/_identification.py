"""Identification: parameters of a model such that it reproduces measured series."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from pymoo_psi._validation import (
    Received,
    invalid,
    known_name,
    mapping,
    positive_number,
    real_array,
    wrong_type,
)
from pymoo_psi.problems._named import NamedProblem

Array = NDArray[np.float64]

# Of weighted differences at times, and of several columns.
_MEASURES: dict[str, tuple[Callable[[Array, Array], Any], Callable[[list[Any]], Any]]] = {
    "rms": (lambda off, time: np.sqrt(np.mean(off**2)), np.mean),
    "max": (lambda off, time: abs(off).max(), np.max),
    "area": (lambda off, time: trapezoid(abs(off), time), np.mean),
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
            the result an ``(n,)`` series for the first measured column, an array of shape
            ``(n, k)`` for k columns, or series by column.
        experiments: By name, a CSV file or a frame: the first column is time or another abscissa
            in increasing order, each further one a measured series; NaN is not compared.
        variables: Parameters of the model by name, ``(lower, upper)`` or a :class:`Setting` as a
            mapping, such as ``{"bounds": (1e-3, 10), "scale": "log", "unit": "N/m"}``.
        measure: Of the weighted differences ``"rms"``, the root of the mean square; ``"max"``, the
            greatest; or ``"area"``, the integral of their size over the abscissa. Several columns
            are averaged, of ``"max"`` the greatest counts.
        weights: Of the columns, by name, which bring them to one unit; needed if there are more
            than one. 1 unless given.
        tolerances: The greatest adequacy that is accepted, by experiment: constraints.
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
        experiments: Mapping[str, pd.DataFrame | str | PathLike[str]],
        variables: Mapping[str, Any],
        *,
        measure: str = "rms",
        weights: Mapping[str, float] | None = None,
        tolerances: Mapping[str, float] | None = None,
        requirements: Any = None,
        name: str = "identification",
        **kwargs: Any,
    ) -> None:
        if not callable(simulate):
            raise wrong_type("simulate", "a function of parameters and data", simulate)
        self.simulate, self.measure = simulate, known_name("measure", measure, _MEASURES)
        given = mapping("experiments", experiments, "names to files or frames")
        self.experiments = {n: _series(n, data) for n, data in given.items()}
        measured = {column for data in self.experiments.values() for column in data.columns[1:]}
        for column in weights or ():
            known_name("weights", column, measured)
        if len(measured) > 1 and {*(weights or ())} != measured:
            rule = f"given for {', '.join(sorted(measured))}, whose units may differ"
            raise invalid("weights", rule, weights)
        given = dict.fromkeys(measured, 1.0) | dict(weights or {})
        self.weights = {column: positive_number("weights", w) for column, w in given.items()}
        limits = {}
        for n, most in mapping("tolerances", tolerances or {}, "experiments to numbers").items():
            known_name("tolerances", n, self.experiments)
            limits[n] = f"<= {positive_number('tolerances', most)!r}"
        super().__init__(
            variables, [*self.experiments], (), limits, requirements, units={}, name=name, **kwargs
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
        if isinstance(found, Mapping):
            each = [found[known_name("a measured series", n, found)] for n in columns]
            found = np.column_stack([*map(np.asarray, each)])
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
            each.append(of_column(off, data.iloc[:, 0].to_numpy()[known]))
        return float(of_all(each))


def _series(name: str, source: Any) -> pd.DataFrame:
    """Return measured series as a frame of numbers."""
    where = f"experiment {name!r}"
    if not isinstance(source, pd.DataFrame):  # as texts: not every pandas reads the last digit
        try:
            source = pd.read_csv(source, dtype=str).apply(
                lambda cells: cells.map(float, na_action="ignore").astype(np.float64)
            )
        except ValueError as error:
            raise invalid(where, "of numbers with a decimal point", Received(error)) from None
    data: pd.DataFrame = source.reset_index(drop=True)
    for column in data:
        real_array(f"column {column!r} of {where}", data[column].to_numpy())
    if data.shape[1] < 2 or (data.notna().sum() < 2).any():
        rule = "of two columns or more, each with two numbers or more"
        raise invalid(where, rule, Received(f"shape {data.shape}"))
    if not (np.diff(data.iloc[:, 0]) > 0).all():  # false of NaN, too
        raise invalid(f"the first column of {where}", "in increasing order", data.columns[0])
    return data.astype(np.float64)
