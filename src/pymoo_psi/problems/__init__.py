"""pymoo problems: their design spaces, and the sphere in the chute-conveyor."""

from pymoo_psi.problems._sphere_chute import SphereChute, VectorizedSphereChute

__all__ = ["SphereChute", "VectorizedSphereChute"]
