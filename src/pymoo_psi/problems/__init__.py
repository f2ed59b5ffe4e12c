"""pymoo problems: their design spaces and parts of them, and the sphere in the chute-conveyor.

A problem of your own that belongs here: write what it computes as functions of arrays, without
pymoo, in a room beside ``chute``; then a thin ``Problem`` in this room that checks its arguments,
sets bounds and fills ``out["F"]`` and ``out["G"]``, with ``names``, ``units`` and ``maximize`` as
attributes and ``fingerprint()``, which returns its constants for studies. Test it against values
known otherwise: a limiting case, an identity, an independent solver.
``pymoo-psi solve pymoo_psi:YourProblem --points 1024`` runs it.

With many variables, screen: :func:`pymoo_psi.table.sensitivities` of the first tests says which
variables matter, and :class:`Restricted` fixes the others.
"""

from pymoo_psi.problems._restricted import Restricted
from pymoo_psi.problems._sphere_chute import SphereChute, VectorizedSphereChute

__all__ = ["Restricted", "SphereChute", "VectorizedSphereChute"]
