"""pymoo problems: their design spaces and parts of them, and the sphere in the chute-conveyor."""

from pymoo_psi.problems._restricted import Restricted
from pymoo_psi.problems._sphere_chute import SphereChute, VectorizedSphereChute

__all__ = ["Restricted", "SphereChute", "VectorizedSphereChute"]
