"""Sampling operators for any pymoo algorithm: LPτ points and SciPy's quasi-random engines."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Literal, cast

import numpy as np
from pymoo.core.sampling import Sampling

from pymoo_psi._validation import Array, boolean, integer, invalid, known_name, wrong_type
from pymoo_psi.problems import design_space, require_no_permutation, with_requirements
from pymoo_psi.sequences import lp_tau

Engine = Literal["sobol", "halton", "lhs", "latin_hypercube", "poisson_disk"]
SequenceName = Literal["lptau", Engine]

# The engines of scipy.stats.qmc that fill the unit cube without further arguments.
_ENGINES: dict[Engine, str] = {
    "sobol": "Sobol",
    "halton": "Halton",
    "lhs": "LatinHypercube",
    "latin_hypercube": "LatinHypercube",
    "poisson_disk": "PoissonDisk",
}


class UniformSampling(Sampling):
    """Points spread evenly over the unit cube, mapped to the bounds of a problem's variables.

    To add a sequence, derive a class and implement :meth:`unit_points`. An instance of it is a
    valid ``sampling=`` for every pymoo algorithm and for :class:`PSI`, :func:`investigate` and
    :class:`SurrogatePSI`. A study identifies it by the name of its class and by its attributes:
    like LPτ, it can be continued and extended, and the study rejects other attributes.

    Attributes:
        extendable: Whether the first points stay the same if more are requested. Set it to
            ``False`` if points depend on how many there are.
        randomised: Whether points depend on ``random_state``. If ``True``, a study requires a seed.
        log: Variables that are spread evenly in the logarithm; if None, those of the problem's
            attribute ``log``. In a run, the run's ``log`` takes precedence.

    Example:
        >>> import numpy as np
        >>> from pymoo_psi import SphereChute, investigate
        >>> class Kronecker(UniformSampling):
        ...     def unit_points(self, n_points, n_dim, *, first=1, random_state=None):
        ...         numbers = np.arange(first, first + n_points)[:, None]
        ...         return numbers * np.sqrt([2, 3, 5, 7][:n_dim]) % 1
        >>> investigate(SphereChute(), 2, sampling=Kronecker()).X.round(3)
        array([[0.29 , 4.419],
               [0.58 , 2.838]])
    """

    extendable = True
    randomised = False
    log: Collection[str] | None = None

    def _do(
        self, problem: Any, n_samples: int, *args: Any, random_state: Any = None, **kwargs: Any
    ) -> Any:
        if random_state is None:  # pymoo before 0.6.1.6 seeds NumPy's global generator instead
            seed = np.random.randint(2**31)  # noqa: NPY002
            random_state = np.random.default_rng(seed)
        require_no_permutation(problem)
        space = design_space(with_requirements(problem), log=self.log)
        points = self.unit_points(n_samples, len(space.searched), random_state=random_state)
        return space.designs(space.matrix(points))

    def unit_points(
        self, n_points: int, n_dim: int, *, first: int = 1, random_state: Any = None
    ) -> Array:
        """Return ``(n_points, n_dim)`` points of [0, 1), beginning with number ``first``."""
        raise NotImplementedError

    def identity(self, n_points: int, seed: int | None) -> str:
        """Return what determines the points, by which a study recognises them.

        Raises:
            ArgumentValueError: The points are random, and there is no seed.

        Example:
            >>> LPTauSampling().identity(8, None)
            'LP-tau from point 1'
        """
        text = self._name()
        if not self.extendable:
            text += f" of {n_points} points"
        if not self.randomised:
            return text
        if seed is None:
            remedy = "without one the points cannot be repeated"
            raise invalid("seed", "given for randomised points in a study or a share", seed, remedy)
        return f"{text}, seed {seed}"

    def _name(self) -> str:
        """Return the name of the class and its attributes."""
        ignored = {*vars(Sampling()), "log"}
        attributes = []
        for name, value in vars(self).items():
            if name in ignored:
                continue
            if isinstance(value, np.ndarray):  # the repr of a long array omits values
                value = value.tolist()
            attributes.append(f"{name}={value!r}")
        return f"{type(self).__name__}({', '.join(attributes)})"


def uniform_sampling(sampling: object) -> UniformSampling | None:
    """Return a sampling operator, which is given by its name or as it is; ``None`` stays None.

    Raises:
        ArgumentValueError: There is no such name, or an LPτ sampling has another first point.
        ArgumentTypeError: The sampling is something else.
    """
    if sampling is None:
        return None
    if isinstance(sampling, str):
        known_name("sampling", sampling, ("lptau", *_ENGINES))
        if sampling == "lptau":
            return LPTauSampling()
        return QMCSampling(cast(Engine, sampling))
    if not isinstance(sampling, UniformSampling):
        rule = "a name such as 'lhs', LPTauSampling(), QMCSampling(...) or another UniformSampling"
        raise wrong_type("sampling", rule, sampling)
    # Tables and studies number points from the run's own first: two would be ambiguous.
    if isinstance(sampling, LPTauSampling) and sampling.first != 1:
        remedy = "give first= to PSI or investigate"
        raise invalid("first of LPTauSampling", "1 here", sampling.first, remedy)
    return sampling


class LPTauSampling(UniformSampling):
    """The test points of Parameter Space Investigation: the LPτ sequence in natural order.

    The points do not depend on a seed.

    Args:
        first: Number of the first point. Point 1 lies at the lower bounds.
        log: See :class:`UniformSampling`.

    Raises:
        ArgumentValueError: ``first`` is below 1; when sampling, the problem has more than 51
            variables or no finite bounds.

    Example:
        >>> from pymoo.algorithms.moo.nsga2 import NSGA2
        >>> from pymoo_psi import SphereChute
        >>> algorithm = NSGA2(pop_size=100, sampling=LPTauSampling())
        >>> LPTauSampling().do(SphereChute(mu=0.4), 2).get("X")  # corner, centre
        array([[0.  , 0.1 ], [0.7 , 3.05]])
    """

    def __init__(self, *, first: int = 1, log: Collection[str] | None = None) -> None:
        super().__init__()
        self.log = log
        self.first = integer("first", first, minimum=1)

    def unit_points(
        self, n_points: int, n_dim: int, *, first: int = 1, random_state: Any = None
    ) -> Array:
        """Return consecutive LPτ points; ``first=1`` is the first point of the operator.

        Example:
            >>> LPTauSampling(first=2).unit_points(2, 2)
            array([[0.5 , 0.5 ], [0.25, 0.75]])
        """
        return lp_tau(n_points, n_dim, first=self.first + first - 1)

    def _name(self) -> str:
        return f"LP-tau from point {self.first}"


class QMCSampling(UniformSampling):
    """Points of an engine of ``scipy.stats.qmc``, for any number of variables.

    Args:
        engine: ``"sobol"``, ``"halton"``, ``"latin_hypercube"`` (or ``"lhs"``) or
            ``"poisson_disk"``.
        scramble: Randomise the sequence with the algorithm's seed. ``False`` gives the plain
            sequence in SciPy's order, which differs from that of LPτ. Poisson-disk points are
            always random.
        log: See :class:`UniformSampling`.

    Raises:
        ArgumentValueError: The engine is unknown; when sampling, it cannot place that many points.

    Example:
        >>> QMCSampling("halton", scramble=False).unit_points(3, 2).round(3)
        array([[0.   , 0.   ],
               [0.5  , 0.333],
               [0.25 , 0.667]])
    """

    def __init__(
        self,
        engine: Engine = "sobol",
        *,
        scramble: bool = True,
        log: Collection[str] | None = None,
    ) -> None:
        super().__init__()
        self.log = log
        known_name("engine", engine, _ENGINES)
        self.engine = engine
        self.scramble = boolean("scramble", scramble)
        # the sequences; the points of other engines depend on how many there are
        self.extendable = engine in ("sobol", "halton")
        self.randomised = scramble or not self.extendable

    def _name(self) -> str:
        return self.engine

    def unit_points(
        self, n_points: int, n_dim: int, *, first: int = 1, random_state: Any = None
    ) -> Array:
        """Return points of the engine, beginning with number ``first``.

        Only the sequences of Sobol' and Halton can be continued. The points of the other engines
        depend on how many there are, so that ``first`` must be 1.

        Raises:
            ArgumentValueError: ``first`` is not 1, or the engine cannot place that many points.

        Example:
            >>> QMCSampling("sobol", scramble=False).unit_points(1, 2, first=2)
            array([[0.5, 0.5]])
        """
        if first > 1 and not self.extendable:
            rule = f"1 for the engine {self.engine!r}"
            raise invalid("first", rule, first, "use 'sobol' or 'halton'")
        from scipy.stats import qmc  # takes most of a second to import

        options = {"seed": random_state}
        if self.engine != "poisson_disk":  # always random
            options["scramble"] = self.scramble
        engine = getattr(qmc, _ENGINES[self.engine])(n_dim, **options)
        # A seed gives the same points, whether they are drawn in one part or in several.
        if first > 1:
            points = engine.fast_forward(first - 1).random(n_points)
        elif self.engine == "sobol":
            # A full power of two contains the same points, and SciPy does not warn.
            exponent = max(n_points - 1, 0).bit_length()
            points = engine.random_base2(exponent)[:n_points]
        else:
            points = engine.random(n_points)
        if len(points) < n_points:  # Poisson disks keep a distance, and the cube is full
            rule = f"at most {len(points)}, all that the engine {self.engine!r} can place"
            raise invalid("n_samples", rule, n_points, "use another engine")
        return np.asarray(points)
