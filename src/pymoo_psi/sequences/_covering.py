"""How far the farthest place of the unit cube is from a set of points: their covering radius."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pymoo_psi._validation import Received, finite_array, invalid

# Points by dimension up to which Voronoi cells take less than two seconds.
_EXACT = {2: 10_000, 3: 3_000}
_PROBES = 2**12


def covering_radius(points: ArrayLike) -> float:
    """Return the radius of the largest ball about a place of the unit cube that holds no point.

    No design is farther from a tested one, in a box scaled to the unit cube; what is smaller may
    have been missed between them. The measure is also called dispersion (Niederreiter, Random
    Number Generation and Quasi-Monte Carlo Methods, 1992, Chapter 6).

    Exact in one dimension, in two up to 10 000 points and in three up to 3000. Beyond, the farthest
    of 4096 places and of the corners, which the radius is at least.

    Args:
        points: ``(n, d)`` points of [0, 1], n and d >= 1.

    Raises:
        ArgumentValueError: There is no point, or one outside the cube.

    Example:
        >>> covering_radius([[0.25], [0.5]])
        0.5
    """
    from scipy.spatial import QhullError, Voronoi, cKDTree

    points = finite_array("points", points)
    if points.ndim != 2 or 0 in points.shape:
        rule = "two-dimensional (n points, d dimensions), with at least one point"
        raise invalid("points", rule, Received(f"shape {points.shape}"))
    if (points < 0).any() or (points > 1).any():
        outside = points[((points < 0) | (points > 1)).any(axis=1)][0]
        raise invalid("points", "inside the unit cube", Received(str(outside.tolist())))
    points = np.unique(points, axis=0)
    n, d = points.shape
    if d == 1:
        ends = [points[0, 0], 1 - points[-1, 0]]
        return float(max(*ends, *np.diff(points[:, 0]) / 2))
    places = _probes(d)
    if n <= _EXACT.get(d, 0):
        # Mirrored at every face, the points have cells that the faces bound, and the place that is
        # farthest from all of them is a vertex of these cells.
        mirrored = [points]
        for j in range(d):
            for face in (0.0, 2.0):
                image = points.copy()
                image[:, j] = face - image[:, j]
                mirrored.append(image)
        try:
            vertices = Voronoi(np.unique(np.vstack(mirrored), axis=0)).vertices
        except QhullError:  # the points are on a line, or too few
            pass
        else:
            inside = (vertices > -1e-9) & (vertices < 1 + 1e-9)
            places = np.vstack([places, vertices[inside.all(axis=1)].clip(0, 1)])
    distances, _ = cKDTree(points).query(places)
    return float(distances.max())


def _probes(d: int) -> NDArray[np.float64]:
    """Return places of the cube that are spread evenly, the corners among them."""
    places = np.random.default_rng(0).random((_PROBES, d))
    if d <= 12:  # the sequences leave them out longest; from there on they are too many
        corners = np.array(np.meshgrid(*[[0.0, 1.0]] * d)).reshape(d, -1).T
        places = np.vstack([places, corners])
    return places
