"""pymoo problems: their design spaces, and the sphere in the chute-conveyor."""

from pymoo_psi.problems._design_space import DesignSpace, design_space
from pymoo_psi.problems._sphere_chute import SphereChute, VectorizedSphereChute

__all__ = ["DesignSpace", "SphereChute", "VectorizedSphereChute", "design_space"]
