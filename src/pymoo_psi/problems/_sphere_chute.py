"""The chute-conveyor of the paper as a pymoo problem (Section 4, Eq. 4.1)."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike
from pymoo.core.problem import ElementwiseProblem, Problem

from pymoo_psi._validation import Values, finite_array, known_name
from pymoo_psi.chute import MODELS, ChuteParameters, ModelName, criteria, motion
from pymoo_psi.problems._pymoo import OF_A_MODEL, require_known_keywords


class VectorizedSphereChute(Problem):
    """The sphere in the chute-conveyor: two variables, four objectives, one constraint.

    Variables: u1 = tan α, the slope; u2 = v_P, the speed of the moving plane. Objectives, all
    minimised and dimensionless: f1 the time, f2 the energy balance ``|W − D|``, f3 = u1, f4 = u2
    (Eqs. 3.1–3.4). Constraint: 1 − (η reached), which is <= 0 when the sphere reaches the exit
    and above 0 when it stalls before; a stalled design has f1 = f2 = inf.

    This class evaluates many designs at once; :class:`SphereChute` gives the same values for one
    design at a time.

    Args:
        mu: Friction coefficient μ > 0.
        c: Initial speed of the centre > 0; 0.3193 is 1 m/s for L = 1 m.
        r: Radius over L, > 0.
        omega0: Initial spins (ω_X0, ω_Y0, ω_Z0).
        model: ``"full"``, the paper's model MM, or ``"rolling"``, from which its printed tables
            follow.
        lower: Lower bounds of (u1, u2), not negative.
        upper: Upper bounds; ``None`` is (3.5 μ, 6), as the sphere can roll up to u1 = 3.5 μ (2.12).
        **kwargs: pymoo's own, such as ``elementwise_runner`` or ``callback``.

    Raises:
        ArgumentValueError: A parameter is not positive or finite, a bound is not finite, or the
            model is unknown.
        ArgumentTypeError: A parameter is not a number, or a keyword is unknown.

    Example:
        >>> import numpy as np
        >>> problem = VectorizedSphereChute(0.4, model="rolling")
        >>> F, G = problem.evaluate(np.array([[0.2635, 0.1072], [0.3, 0.2]]))
        >>> F.shape, float(G.max())
        ((2, 4), 0.0)
    """

    def __init__(
        self,
        mu: float = 0.2,
        *,
        c: float = 0.3193,
        r: float = 0.1,
        omega0: ArrayLike = (0.0, 0.0, 0.0),
        model: ModelName = "full",
        lower: ArrayLike = (0.0, 0.1),
        upper: ArrayLike | None = None,
        **kwargs: Any,
    ) -> None:
        require_known_keywords(type(self).__name__, Problem, kwargs, taken=OF_A_MODEL)
        self.parameters = ChuteParameters(mu, c, r, omega0)
        known_name("model", model, MODELS)
        self.model: ModelName = model
        if upper is None:  # Eq. 2.12: above u1 = 3.5 mu the sphere cannot roll
            upper = (3.5 * self.parameters.mu, 6.0)
        bounds = {"xl": finite_array("lower", lower), "xu": finite_array("upper", upper)}
        super().__init__(n_var=2, n_obj=4, n_ieq_constr=1, **bounds, **kwargs)

    def fingerprint(self) -> Values:
        """Return what a study of this problem depends on besides bounds and sizes.

        Example:
            >>> SphereChute(mu=0.4, model="rolling").fingerprint()["mu"]
            0.4
        """
        names = ("mu", "c", "r", "omega_X0", "omega_Y0", "omega_Z0")
        return {"model": self.model, **dict(zip(names, self.parameters.columns, strict=True))}

    def _evaluate(self, x: Any, out: Values, *args: Any, **kwargs: Any) -> None:
        # (n, 2) designs of VectorizedSphereChute or one (2,) of SphereChute
        solved = motion(x[..., 0], x[..., 1], self.parameters, model=self.model)
        out["F"] = criteria(solved)
        # above 0 where the sphere stalls, by the rest of the way: algorithms see how far a design
        # is from reaching the exit
        out["G"] = 1.0 - solved.reached[..., None]


class SphereChute(VectorizedSphereChute, ElementwiseProblem):
    """:class:`VectorizedSphereChute` one design at a time, like a simulation without arrays.

    Example:
        >>> import numpy as np
        >>> SphereChute(0.4, model="rolling").evaluate(np.array([0.2635, 0.1072]))[0].round(4)
        array([2.0459, 0.0476, 0.2635, 0.1072])
    """
