"""Identification: the parameters with which a model reproduces measured series."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from scipy.integrate import trapezoid

from pymoo_psi._validation import (
    Array,
    Entries,
    FilePath,
    Received,
    Values,
    invalid,
    known_name,
    mapping,
    positive_number,
    real_array,
    require_shape,
)
from pymoo_psi.problems._named import NamedProblem
from pymoo_psi.table import UnfitError, source_columns

# The distance of a series, from its weighted differences and their places.
_MEASURES: dict[str, Callable[[Array, Array], Any]] = {
    "rms": lambda differences, places: np.sqrt(np.mean(differences**2)),
    "max": lambda differences, places: differences.max(),
    "area": trapezoid,
}


class Identification(NamedProblem):
    """A model and measured series as a problem: one adequacy objective for each experiment.

    Adequacy is the term of PSI's authors (Statnikov and Statnikov, The Parameter Space
    Investigation Method Toolkit, 2011) for the distance between simulated and measured series. It
    is minimised for all experiments at the same time. The problem is investigated like any other,
    with limits on each experiment.

    Args:
        simulate: ``simulate(parameters, data)`` returns the series of the model for an experiment:
            ``parameters`` is a value for each variable by name, ``data`` the experiment's frame;
            the result is a frame or a mapping with the series of each measured column; or an
            array of shape ``(n, k)`` for k columns in their order, ``(n,)`` for one.
        experiments: By name, a file as :func:`read_table` reads it, or a frame: the first column is
            time or another abscissa in increasing order, each further one a measured series; NaN is
            not compared.
        variables: Parameters of the model by name, ``(lower, upper)`` or a :class:`Setting` as a
            mapping, such as ``{"bounds": (1e-3, 10), "scale": "log", "unit": "N/m"}``.
        measure: How weighted differences are measured: ``"rms"``, the root of their mean square;
            ``"max"``, the greatest; or ``"area"``, the integral of their absolute values over the
            abscissa. The adequacy is the mean over the columns, for ``"max"`` the greatest.
        weights: Factors of the columns, by name, that bring them to one unit; needed if there is
            more than one column. 1 unless given.
        tolerances: The greatest adequacy that is accepted, by experiment: constraints.
        requirements: Rules on variables, see :class:`Requirement`.
        name: Name of the problem.
        **kwargs: pymoo's own, such as ``elementwise_runner``.

    Attributes:
        experiments: The frames by name.

    Raises:
        ArgumentValueError: A series is not usable, a name is unknown, or weights are missing.
        ArgumentTypeError: An argument has the wrong type.

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
        simulate: Callable[[Entries, pd.DataFrame], Any],
        experiments: Mapping[str, pd.DataFrame | FilePath],
        variables: Entries,
        *,
        measure: str = "rms",
        weights: Entries | None = None,
        tolerances: Entries | None = None,
        requirements: Any = None,
        name: str = "identification",
        **kwargs: Any,
    ) -> None:
        self.simulate = simulate
        self.measure = known_name("measure", measure, _MEASURES)
        self.experiments: dict[str, pd.DataFrame] = {}
        mapping("experiments", experiments, "names to files or frames")
        for experiment, source in experiments.items():
            self.experiments[experiment] = _series(experiment, source)
        self.weights = self._checked_weights(weights)
        limits = {}
        tolerances = mapping("tolerances", tolerances or {}, "experiments to numbers")
        for experiment, greatest in tolerances.items():
            known_name("tolerances", experiment, self.experiments)
            limits[experiment] = f"<= {positive_number('tolerances', greatest)!r}"
        super().__init__(
            variables,
            objectives=[*self.experiments],
            limits=limits,
            requirements=requirements,
            units={},
            name=name,
            **kwargs,
        )

    def _checked_weights(self, weights: Entries | None) -> dict[str, float]:
        """Return the weight of each measured column."""
        measured: set[str] = set()
        for data in self.experiments.values():
            measured.update(data.columns[1:])
        weights = mapping("weights", weights or {}, "columns to numbers")
        if not weights and len(measured) == 1:
            weights = dict.fromkeys(measured, 1.0)
        if weights.keys() != measured:
            rule = f"given for {', '.join(sorted(measured))}, whose units may differ"
            raise invalid("weights", rule, weights)
        return {column: positive_number("weights", weight) for column, weight in weights.items()}

    def fingerprint(self) -> Values:
        """Return what a study depends on: the measured series and how they are compared."""
        series = {name: data.to_csv(index=False) for name, data in self.experiments.items()}
        return {"measure": self.measure, "weights": self.weights, "experiments": series}

    def series(self, design: Entries, experiment: str) -> pd.DataFrame:
        """Return the series of the model for an experiment, with the columns of its data.

        Raises:
            PsiError: The model returns something else.
        """
        data = self.experiments[experiment]
        abscissa, *columns = data.columns
        where = f"what simulate returns for {experiment!r}"
        simulated: Any = self.simulate(dict(design), data.copy())
        if isinstance(simulated, Mapping):  # series, too, are taken in their order
            arrays = map(np.atleast_1d, simulated.values())
            simulated = pd.DataFrame(dict(zip(simulated, arrays, strict=True)))
        if isinstance(simulated, pd.DataFrame):
            simulated = simulated.reset_index()  # the index may be the abscissa
            for column in columns:
                known_name("a measured series", column, [*simulated])
            places = simulated.get(abscissa, data[abscissa])
            if len(simulated) != len(data) or not np.allclose(places, data[abscissa]):
                rule = f"at the values of {abscissa!r}, or without this column"
                raise invalid(where, rule, Received("others"))
            simulated = simulated[columns]
        values = real_array(where, simulated)
        if values.ndim == 1:
            values = values[:, None]
        require_shape(where, values, (len(data), len(columns)))
        series = data.copy()
        series[columns] = values
        return series

    def values(self, design: Entries) -> Entries:
        """Return the adequacy of a design in each experiment."""
        return {experiment: self._adequacy(design, experiment) for experiment in self.experiments}

    def _adequacy(self, design: Entries, experiment: str) -> float:
        data = self.experiments[experiment]
        simulated = self.series(design, experiment)
        places = data.iloc[:, 0].to_numpy()
        distances = []
        for column in data.columns[1:]:
            measured = data[column].notna().to_numpy()
            differences = (simulated[column] - data[column]).to_numpy()[measured]
            weighted = abs(differences * self.weights[column])
            distances.append(_MEASURES[self.measure](weighted, places[measured]))
        if self.measure == "max":
            return float(np.max(distances))
        return float(np.mean(distances))


def _series(name: str, source: Any) -> pd.DataFrame:
    """Return measured series from a frame or a file as a checked frame of numbers."""
    where = f"experiment {name!r}"
    if isinstance(source, pd.DataFrame):
        source = source.reset_index(drop=True)
    try:
        _, columns = source_columns(source)
        numbers = {name: column.require_numbers() for name, column in columns.items()}
    except UnfitError as error:
        rule = "a table with columns of numbers"
        raise invalid(where, rule, Received(error.problem)) from None
    data = pd.DataFrame(numbers)
    if data.shape[1] < 2 or (data.notna().sum() < 2).any():
        rule = "of two columns or more, each with two numbers or more"
        raise invalid(where, rule, Received(f"shape {data.shape}"))
    if not (np.diff(data.iloc[:, 0]) > 0).all():  # the comparison is false for NaN, too
        raise invalid(f"the first column of {where}", "in increasing order", data.columns[0])
    return data
