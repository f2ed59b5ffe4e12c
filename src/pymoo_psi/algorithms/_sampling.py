"""Sampling operators for any pymoo algorithm: LPτ points and SciPy's quasi-random engines."""

from __future__ import annotations

import inspect
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.sampling import Sampling

from pymoo_psi._validation import boolean, integer, invalid, known_name, wrong_type
from pymoo_psi.problems import design_space
from pymoo_psi.sequences import lp_tau

Array = NDArray[np.float64]

# Of scipy.stats.qmc, those that place points anywhere in the cube without further arguments.
_ENGINES = {
    "sobol": "Sobol",
    "halton": "Halton",
    "lhs": "LatinHypercube",
    "latin_hypercube": "LatinHypercube",
    "poisson_disk": "PoissonDisk",
}


class UniformSampling(Sampling):
    """Points spread evenly over the unit cube, laid out in the design space of a problem.

    A sequence of your own is a subclass with :meth:`unit_points`. It serves as ``sampling=`` of
    every pymoo algorithm and of :class:`PSI`, :func:`investigate` and :class:`SurrogatePSI`, where
    a study knows it by the name of its class and its attributes: it is continued and extended as
    LPτ is, and refused with other attributes.

    Attributes:
        extendable: Whether more points leave the first ones as they are. Set it to ``False`` where
            points depend on how many there are.
        randomised: Whether points depend on ``random_state``. Set it to ``True`` where they do;
            then a study wants a seed.
        log: Variables that are spread evenly in the logarithm; those of the problem's attribute
            ``log`` if None. In a run, the run's ``log`` counts.

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
            random_state = np.random.default_rng(np.random.randint(2**31))  # noqa: NPY002
        space = design_space(problem, log=self.log)
        points = self.unit_points(n_samples, len(space.searched), random_state=random_state)
        return space.designs(space.matrix(points))

    def unit_points(
        self, n_points: int, n_dim: int, *, first: int = 1, random_state: Any = None
    ) -> Array:
        """Return ``(n_points, n_dim)`` points of [0, 1), from number ``first`` on."""
        raise NotImplementedError

    def identity(self, n_points: int, seed: int | None) -> str:
        """Return what a study must know of its points, so that the same ones come again."""
        known = {*vars(Sampling()), "log"}
        own = {name: value for name, value in vars(self).items() if name not in known}
        own = {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in own.items()}
        attributes = ", ".join(f"{name}={value!r}" for name, value in own.items())
        name = getattr(self, "engine", f"{type(self).__name__}({attributes})")
        name += "" if self.extendable else f" of {n_points} points"
        if self.randomised and seed is None:
            rule = "given where a study has randomised points"
            raise invalid("seed", rule, seed, "they must come again")
        return f"{name}, seed {seed}" if self.randomised else str(name)


def uniform_sampling(sampling: object) -> UniformSampling | None:
    """Return a sampling that is given by name, or as one of the operators of this module."""
    if sampling is None:
        return None
    if isinstance(sampling, str):
        known_name("sampling", sampling, ("lptau", *_ENGINES))
        return LPTauSampling() if sampling == "lptau" else QMCSampling(sampling)
    if not isinstance(sampling, UniformSampling):
        rule = "a name such as 'lhs', LPTauSampling(), QMCSampling(...) or another UniformSampling"
        raise wrong_type("sampling", rule, sampling)
    # Numbers in table and study are those of PSI: a second origin would make them ambiguous.
    if isinstance(sampling, LPTauSampling) and sampling.first != 1:
        remedy = "give first= to PSI or investigate"
        raise invalid("first of LPTauSampling", "1 here", sampling.first, remedy)
    return sampling


class LPTauSampling(UniformSampling):
    """The test points of Parameter Space Investigation: LPτ in natural order.

    The points do not depend on a seed: the same call gives the same points.

    Args:
        first: Number of the first point, from 1, which lies at the lower bounds.
        log: See :class:`UniformSampling`.

    Raises:
        ArgumentValueError: ``first`` is below 1; in use: the problem has more than 51 variables
            or no finite bounds.

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
        """Return consecutive LPτ points; ``first`` counts from the operator's own first.

        Example:
            >>> LPTauSampling(first=2).unit_points(2, 2)
            array([[0.5 , 0.5 ], [0.25, 0.75]])
        """
        return lp_tau(n_points, n_dim, first=self.first + first - 1)

    def identity(self, n_points: int, seed: int | None) -> str:
        """Return what a study must know of its points.

        Example:
            >>> LPTauSampling().identity(8, None)
            'LP-tau from point 1'
        """
        return f"LP-tau from point {self.first}"


class QMCSampling(UniformSampling):
    """Points of an engine of ``scipy.stats.qmc``, for any number of variables.

    Args:
        engine: ``"sobol"``, ``"halton"``, ``"latin_hypercube"`` (or ``"lhs"``) or
            ``"poisson_disk"``.
        scramble: Randomise the sequence by the algorithm's seed. ``False`` gives the plain
            sequence, whose numbering is SciPy's and not that of LPτ. Poisson-disk points are
            always random.
        log: See :class:`UniformSampling`.

    Raises:
        ArgumentValueError: The engine is unknown; in use: it cannot give so many points.

    Example:
        >>> QMCSampling("halton", scramble=False).unit_points(3, 2).round(3)
        array([[0.   , 0.   ],
               [0.5  , 0.333],
               [0.25 , 0.667]])
    """

    def __init__(
        self, engine: str = "sobol", *, scramble: bool = True, log: Collection[str] | None = None
    ) -> None:
        super().__init__()
        self.log = log
        self.engine = known_name("engine", engine, _ENGINES)
        self.scramble = boolean("scramble", scramble)
        # that can be continued; the points of others depend on how many they are
        self.extendable = engine in ("sobol", "halton")
        self.randomised = scramble or not self.extendable

    def unit_points(
        self, n_points: int, n_dim: int, *, first: int = 1, random_state: Any = None
    ) -> Array:
        """Return points of the engine from number ``first`` on, seeded by ``random_state``.

        Only the sequences of Sobol' and Halton can be continued; the points of the other engines
        depend on how many there are, so that ``first`` must be 1.

        Example:
            >>> QMCSampling("sobol", scramble=False).unit_points(1, 2, first=2)
            array([[0.5, 0.5]])
        """
        if first > 1 and not self.extendable:
            rule = f"1 for the engine {self.engine!r}"
            raise invalid("first", rule, first, "use 'sobol' or 'halton'")
        from scipy.stats import qmc  # takes most of a second to import

        make = getattr(qmc, _ENGINES[self.engine])
        known = inspect.signature(make).parameters
        options = {"scramble": self.scramble} if "scramble" in known else {}
        options["rng" if "rng" in known else "seed"] = random_state  # "seed" before SciPy 1.15
        engine = make(n_dim, **options)
        # A seed gives the same points however they are cut into runs.
        if first > 1:
            points = engine.fast_forward(first - 1).random(n_points)
        elif self.engine == "sobol":  # a full power of two draws the same without a warning
            points = engine.random_base2(max(n_points - 1, 0).bit_length())[:n_points]
        else:
            points = engine.random(n_points)
        if len(points) < n_points:  # Poisson disks keep a distance, and the cube is full
            rule = f"at most {len(points)}, all that the engine {self.engine!r} can place"
            raise invalid("n_samples", rule, n_points, "use another engine")
        return np.asarray(points)
