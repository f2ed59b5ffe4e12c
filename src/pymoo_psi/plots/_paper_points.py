"""Figures 3 to 6: the Pareto-optimal test points, by rank of efficiency, in four spaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from pymoo_psi._validation import known_name
from pymoo_psi.plots._style import MARKERS, axis_label, enlarged_markers, on_axes, subject

if TYPE_CHECKING:
    from pymoo_psi.paper import Case


Array = NDArray[np.float64]

_CRITERIA = ("f1", "f2", "f3", "f4")

# The geometric criteria lie on the cone μ1² = μ2² + μ3², near the plane μ1 = μ3: seen from there.
_VIEWS: dict[tuple[str, ...], tuple[int, int]] = {("mu1", "mu2", "mu3"): (34, -155)}


@dataclass(frozen=True, eq=False)
class RankedPoints:
    """Points of a Pareto set in a space of two or three coordinates.

    Attributes:
        model: ``"full"`` or ``"rolling"``.
        mu: Friction coefficient.
        names: The k coordinates, such as ``("u1", "u2")``.
        values: ``(n, k)`` the points.
        rank: ``(n,)`` their ranks of efficiency, 0 for the unranked.
        optimum: ``(n,)`` which of them is the Salukvadze optimum.

    Example:
        >>> from pymoo_psi.paper import solve_case
        >>> points = design_points(solve_case(0.4, "rolling", 64))
        >>> points.names, int(points.optimum.sum())
        (('u1', 'u2'), 1)
    """

    model: str
    mu: float
    names: tuple[str, ...]
    values: Array
    rank: NDArray[np.int64]
    optimum: NDArray[np.bool_]

    @property
    def distinguished(self) -> NDArray[np.bool_]:
        """``(n,)`` which points are ranked or the optimum.

        Example:
            >>> values, rank = np.array([[1.0], [2.0]]), np.array([0, 6])
            >>> points = RankedPoints("full", 0.4, ("u1",), values, rank, optimum=rank == 6)
            >>> points.distinguished
            array([False,  True])
        """
        distinguished: NDArray[np.bool_] = (self.rank > 0) | self.optimum
        return distinguished

    def groups(self) -> dict[str, NDArray[np.intp]]:
        """Return what the legend tells apart, and the indices of the points of each group.

        Example:
            >>> values, rank = np.array([[1.0], [2.0]]), np.array([0, 6])
            >>> points = RankedPoints("full", 0.4, ("u1",), values, rank, optimum=rank == 6)
            >>> points.groups()
            {'unranked': array([0]), 'Salukvadze optimum (rank 6)': array([1])}
        """
        others = ~self.optimum
        groups = {"unranked": np.flatnonzero(others & (self.rank == 0))}
        for rank in (3, 4, 5, 6):
            groups[f"rank {rank}"] = np.flatnonzero(others & (self.rank == rank))
        groups["Salukvadze optimum (rank 6)"] = np.flatnonzero(self.optimum)
        return {name: members for name, members in groups.items() if len(members)}

    def nearby(self, margin: float = 0.15) -> RankedPoints:
        """Return the points in the smallest box around the distinguished ones.

        Args:
            margin: By how much of its length the box is longer on each side.

        Example:
            >>> values, rank = np.array([[1.0], [1.4], [9.0], [2.0]]), np.array([5, 0, 0, 6])
            >>> points = RankedPoints("full", 0.4, ("u1",), values, rank, optimum=rank == 6)
            >>> points.nearby().values.ravel()
            array([1. , 1.4, 2. ])
        """
        core = self.values[self.distinguished]
        low, high = core.min(axis=0), core.max(axis=0)
        wider = margin * (high - low)
        inside = ((self.values >= low - wider) & (self.values <= high + wider)).all(axis=1)
        return replace(
            self, values=self.values[inside], rank=self.rank[inside], optimum=self.optimum[inside]
        )


def geometric_points(case: Case) -> RankedPoints:
    """Return the Pareto set in the space of the geometric criteria μ1, μ2, μ3 (Figure 3).

    Example:
        >>> from pymoo_psi.paper import solve_case
        >>> mu1, mu2, mu3 = geometric_points(solve_case(0.4, "rolling", 64)).values.T
        >>> np.allclose(mu1**2, mu2**2 + mu3**2)
        True
    """
    return _ranked_points(case, ("mu1", "mu2", "mu3"), case.ranking.criteria)


def design_points(case: Case) -> RankedPoints:
    """Return the Pareto set in the design box, u1 and u2 (Figure 4).

    Example:
        >>> from pymoo_psi.paper import solve_case
        >>> u1, u2 = design_points(solve_case(0.4, "rolling", 64)).values.T
        >>> bool(0 <= u1.min() and u1.max() <= 3.5 * 0.4)
        True
    """
    return _ranked_points(case, ("u1", "u2"), case.X)


def objective_points(case: Case, names: Sequence[str] = ("f1", "f2", "f3")) -> RankedPoints:
    """Return the Pareto set in the space of two or three objectives (Figures 5 and 6).

    Args:
        case: A ranked Pareto set.
        names: Two or three of ``"f1"`` … ``"f4"``.

    Raises:
        ArgumentValueError: A name is unknown.

    Example:
        >>> from pymoo_psi.paper import solve_case
        >>> objective_points(solve_case(0.4, "rolling", 64), ("f1", "f4")).names
        ('f1', 'f4')
    """
    columns = [_CRITERIA.index(known_name("names", name, _CRITERIA)) for name in names]
    return _ranked_points(case, tuple(names), case.F[:, columns])


def _ranked_points(case: Case, names: tuple[str, ...], values: Array) -> RankedPoints:
    optimum = np.zeros(len(values), dtype=bool)
    optimum[case.ranking.salukvadze] = True
    return RankedPoints(case.model, case.mu, names, values, case.ranking.rank, optimum)


def draw_points(
    points: RankedPoints, *, ax: Axes | None = None, legend: bool = True, title: str = ""
) -> Axes:
    """Draw the points, each rank with a colour and a marker of its own, the optimum as a star.

    Args:
        points: In two or three dimensions.
        ax: Axes to draw on, three-dimensional for three coordinates; new ones by default.
        legend: Put a legend with the number of points of each rank under the axes.
        title: What the points are; the model and μ follow it.

    Returns:
        The axes.

    Example:
        >>> from pymoo_psi.paper import solve_case
        >>> ax = draw_points(design_points(solve_case(0.4, "rolling", 64)), title="Designs")
        >>> [text.get_text() for text in ax.get_legend().get_texts()][-1]
        'Salukvadze optimum (rank 6) (1)'
    """
    in_space = len(points.names) == 3
    with on_axes(ax, three_d=in_space) as axes:
        for name, members in points.groups().items():
            marker = MARKERS[6 if points.optimum[members[0]] else int(points.rank[members[0]])]
            plain = name == "unranked"
            axes.plot(
                *points.values[members].T,
                linestyle="none",
                marker=marker.shape,
                markersize=marker.size,
                markerfacecolor=marker.colour,
                markeredgecolor="none" if plain else "black",
                markeredgewidth=0.5,
                zorder=marker.level,
                label=f"{name} ({len(members)})",
                rasterized=plain,
            )
        unit = not in_space
        for letter, name in zip("xyz", points.names, strict=False):
            axis = getattr(axes, f"{letter}axis")
            axis.set_label_text(axis_label(name, unit=unit))
            axis.set_major_locator(MaxNLocator(5))
        axes.set_title(f"{title}\n{subject(points.model, points.mu)}".strip())
        if in_space:
            elevation, azimuth = _VIEWS.get(points.names, (24, -60))
            axes.view_init(elev=elevation, azim=azimuth)
            axes.set_box_aspect(None, zoom=0.88)
        if legend:
            below = 1.0 if in_space else 4.0  # in units of the font size
            enlarged_markers(
                axes.legend(
                    loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=below, ncols=2,
                    frameon=False,
                )
            )  # fmt: skip
    return axes  # type: ignore[no-any-return]
