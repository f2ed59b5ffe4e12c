"""pymoo problems: the sphere in the chute-conveyor."""

from pymoo_psi.problems.sphere_chute import SphereChute, VectorizedSphereChute

__all__ = ["SphereChute", "VectorizedSphereChute"]
