"""The sphere in the chute-conveyor: its motion, criteria and parameters.

Source: Cheshankov, Bozduganova, Ivanov, Vitliemov: *Multi-objective Motion Synthesis of a Rolling
Sphere in a Rectilinear Chute-conveyor with Transformed Dry Friction*, Technische Mechanik 32(6),
2012, 684-697.

A sphere enters an inclined chute whose floor moves sideways. Two variables (slope tan α, floor
speed v_P) and four criteria: time, energy balance, height, floor speed. Everything is
dimensionless: lengths in units of the horizontal distance L, speeds in units of sqrt(L g), times in
units of sqrt(L / g). There are two models, and every result states its model:

- ``model="full"`` is the paper's model as written (Eqs. 2.16-2.21). The sphere enters without spin,
  so it slips on the floor until friction has given it enough spin to roll. On a steep chute it
  slips to the exit.
- ``model="rolling"`` rolls from the start (Eq. 2.20 alone). The tables printed in the paper follow
  from this one, not from the complete model.

The models differ in the slip at the start. While the sphere slips, friction brakes it harder than
in rolling, the moving floor spins it and presses it against the guide-wall, and energy turns into
heat. In the printed designs it slips over almost a third of the way for μ = 0.2, and over a
twentieth for μ = 0.6. ``rolling`` starts with a spin that the sphere does not have. Friction and
floor speed then have no effect on the motion; μ only bounds the slope, so that two printed optima
agree in f1 to f3. f2 is not the work of any force, and the times are too short: under ``full`` the
printed designs take 10 to 14 % longer. The optimum under ``full`` compensates for the slip by a
slope half to two thirds steeper. For a design, trust ``full``; ``rolling`` is there to check the
printed tables.

The motion is solved, not integrated: in a logarithmic time the slip velocity has a closed form, and
two quadratures remain, accurate to 1e-12. :func:`motion` computes some two million designs a second
on one core (``python -m benchmarks.motion`` in a checkout). :func:`trajectory` returns the motion
and the forces along the way, a :class:`Trajectory`.

Example:
    >>> from pymoo_psi import chute
    >>> path = chute.trajectory(0.2635, 0.1072, chute.ChuteParameters(mu=0.4))
    >>> round(path.slip_end, 4), round(float(path.time[-1]), 4)
    (0.0922, 2.3214)
"""

from pymoo_psi.chute._motion import (
    ChuteParameters,
    Motion,
    Trajectory,
    criteria,
    motion,
    trajectory,
)

# A name that other subpackages share; it is no promise to users.
# isort: split
from pymoo_psi.chute._motion import MODELS as MODELS
from pymoo_psi.chute._motion import ModelName as ModelName

__all__ = [
    "ChuteParameters",
    "Motion",
    "Trajectory",
    "criteria",
    "motion",
    "trajectory",
]
