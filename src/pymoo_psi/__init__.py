"""Parameter Space Investigation and decision-making on Pareto sets, for pymoo.

Problems
    :class:`SphereChute`, :class:`VectorizedSphereChute`; the mechanics in :mod:`.chute`.
Sampling
    :func:`lp_tau`, :class:`LPTauSampling`, :class:`QMCSampling`.
Algorithms
    :class:`PSI`, :func:`investigate` and their :class:`TestTable`; :func:`nsga3`; :func:`refine`.
Decision-making
    :func:`rank_of_efficiency` and its :class:`EfficiencyRanking`;
    :class:`SalukvadzeOptimum`, :class:`EfficientSubset`, :class:`CompromiseProgramming`,
    :class:`McdmMethod`; :func:`compare_selectors` and its :class:`SelectorComparison`;
    :func:`robustness` and its :class:`Robustness`.
Comparison
    :func:`compare` of PSI with NSGA-III and others, and its :class:`Comparison`.
Running
    :class:`JoblibRunner`, :class:`FailureTolerant`.
Errors
    :class:`PsiError`.

Every name is imported at its first use, so that importing the package costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # "as" tells them that the names are public
    from pymoo_psi import chute as chute
    from pymoo_psi.algorithms import PSI as PSI
    from pymoo_psi.algorithms import investigate as investigate
    from pymoo_psi.algorithms import nsga3 as nsga3
    from pymoo_psi.algorithms import refine as refine
    from pymoo_psi.deciding import CompromiseProgramming as CompromiseProgramming
    from pymoo_psi.deciding import EfficientSubset as EfficientSubset
    from pymoo_psi.deciding import McdmMethod as McdmMethod
    from pymoo_psi.deciding import SalukvadzeOptimum as SalukvadzeOptimum
    from pymoo_psi.deciding import SelectorComparison as SelectorComparison
    from pymoo_psi.deciding import compare_selectors as compare_selectors
    from pymoo_psi.deciding import robustness as robustness
    from pymoo_psi.errors import PsiError as PsiError
    from pymoo_psi.failures import FailureTolerant as FailureTolerant
    from pymoo_psi.investigation import TestTable as TestTable
    from pymoo_psi.pareto import EfficiencyRanking as EfficiencyRanking
    from pymoo_psi.pareto import Robustness as Robustness
    from pymoo_psi.pareto import rank_of_efficiency as rank_of_efficiency
    from pymoo_psi.problems import SphereChute as SphereChute
    from pymoo_psi.problems import VectorizedSphereChute as VectorizedSphereChute
    from pymoo_psi.runners import JoblibRunner as JoblibRunner
    from pymoo_psi.sampling import LPTauSampling as LPTauSampling
    from pymoo_psi.sampling import QMCSampling as QMCSampling
    from pymoo_psi.sequences import lp_tau as lp_tau
    from pymoo_psi.studies.comparison import Comparison as Comparison
    from pymoo_psi.studies.comparison import compare as compare

    __version__: str

_HOME = {
    # Problems
    "SphereChute": "problems",
    "VectorizedSphereChute": "problems",
    # Sampling
    "lp_tau": "sequences",
    "LPTauSampling": "sampling",
    "QMCSampling": "sampling",
    # Algorithms
    "PSI": "algorithms",
    "TestTable": "investigation",
    "investigate": "algorithms",
    "nsga3": "algorithms",
    "refine": "algorithms",
    # Decision-making
    "CompromiseProgramming": "deciding",
    "EfficiencyRanking": "pareto",
    "EfficientSubset": "deciding",
    "McdmMethod": "deciding",
    "Robustness": "pareto",
    "SalukvadzeOptimum": "deciding",
    "SelectorComparison": "deciding",
    "compare_selectors": "deciding",
    "rank_of_efficiency": "pareto",
    "robustness": "deciding",
    # Comparison
    "Comparison": "studies.comparison",
    "compare": "studies.comparison",
    # Running
    "FailureTolerant": "failures",
    "JoblibRunner": "runners",
    # Errors
    "PsiError": "errors",
}

__all__ = [  # noqa: PLE0604 - the names above, in their order, and the subpackage
    *_HOME,
    "chute",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("pymoo-psi")
    elif name == "chute":
        return import_module("pymoo_psi.chute")
    elif name in _HOME:
        value = getattr(import_module(f"pymoo_psi.{_HOME[name]}"), name)
    else:
        raise AttributeError(f"module 'pymoo_psi' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})
