"""The sphere in the chute-conveyor: its motion, criteria and parameters.

Everything is dimensionless: lengths in units of the horizontal distance L, speeds in units of
sqrt(L g), times in units of sqrt(L / g).

Parameters: :class:`ChuteParameters`.
Motion: :class:`Motion`, :func:`motion` (solved), :func:`integrate` (by SciPy, as reference);
:class:`Trajectory`, :func:`trajectory` (along the way).
Criteria f1 to f4: :func:`criteria`.
"""

from pymoo_psi.chute._motion import MODELS, Motion, criteria, motion
from pymoo_psi.chute._parameters import ChuteParameters
from pymoo_psi.chute._reference import integrate
from pymoo_psi.chute._trajectory import Trajectory, trajectory

__all__ = [
    "MODELS",
    "ChuteParameters",
    "Motion",
    "Trajectory",
    "criteria",
    "integrate",
    "motion",
    "trajectory",
]
