"""What surrogates expected of their proposals, against what was found."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from pymoo_psi._validation import instance, invalid
from pymoo_psi.plots._style import CURVES, HUGE, literal, new_page, tick_counts

_COLUMNS = 3  # panels side by side
_SUFFIX = "_predicted"


def predictions_page(predictions: pd.DataFrame, *, title: str = "") -> Figure:
    """Return for every criterion and constraint what was found against what was expected.

    Points on the diagonal were predicted exactly. The darker a point the later its round: dark
    points near the diagonal say that the surrogates can be trusted now where they propose.

    Args:
        predictions: From :meth:`pymoo_psi.SurrogatePSI.predictions`.
        title: What the designs are.

    Raises:
        ArgumentValueError: The frame has no predictions.
        ArgumentTypeError: ``predictions`` is no frame.

    Example:
        >>> from pymoo.optimize import minimize
        >>> from pymoo_psi import SphereChute, SurrogatePSI
        >>> algorithm = minimize(SphereChute(model="rolling"), SurrogatePSI(36)).algorithm
        >>> figure = predictions_page(algorithm.predictions())
        >>> [axes.get_title() for axes in figure.axes][:2]
        ['f1', 'f2']
    """
    frame = instance("predictions", predictions, pd.DataFrame, "SurrogatePSI.predictions() is one")
    names = [name.removesuffix(_SUFFIX) for name in frame.columns if name.endswith(_SUFFIX)]
    known = frame[frame["surrogate"] != ""] if names else frame[:0]
    if len(known) == 0:
        raise invalid("predictions", "of at least one tested proposal of a surrogate", len(frame))
    rows = -(-len(names) // _COLUMNS)
    rounds = known["round"].to_numpy()
    shade = (0.75 * (1 - rounds / rounds.max())).astype(str)
    with new_page(15 + 55 * rows) as figure:
        panels = np.ravel(figure.subplots(rows, min(_COLUMNS, len(names)), squeeze=False))
        for axes in panels[len(names) :]:
            axes.remove()
        for axes, name in zip(panels, names, strict=False):
            pairs = known[[name + _SUFFIX, name]].to_numpy(float)
            pairs = np.where(np.abs(pairs) < HUGE, pairs, np.nan)  # what axes can hold
            for look, kind in zip(CURVES, sorted(set(known["surrogate"])), strict=False):
                of_kind = (known["surrogate"] == kind).to_numpy()
                axes.scatter(
                    *pairs[of_kind].T, marker=look["marker"], s=12,
                    c=shade[of_kind], edgecolors=look["color"], linewidths=0.5, label=kind,
                )  # fmt: skip
            found = pairs[np.isfinite(pairs[:, 1]), 1]
            if len(found):
                axes.axline((float(np.median(found)),) * 2, slope=1, color="0.5", linewidth=0.6)
            axes.set_title(literal(name))
            axes.set_xlabel("predicted")
            axes.set_ylabel("found")
            tick_counts(axes, x=5, y=5)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        told = f"{len(known)} proposals in {rounds.max()} rounds, the later the darker"
        figure.suptitle(f"{title}\n{told}".strip())
    return figure
