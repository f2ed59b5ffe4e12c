"""Parameter Space Investigation and decision-making on Pareto sets, for pymoo.

``pymoo-psi guide`` in a terminal lists the guides; they are Markdown files in :mod:`.guide`.

**Names to import first**

- Problems: :class:`SphereChute`, :class:`VectorizedSphereChute`; the mechanics in :mod:`.chute`.
  :class:`ProgramProblem`, an external program.
- Wrappers of any problem: :class:`Restricted` to a part of its bounds, :class:`LogScaled`,
  :class:`Required`, :class:`FailureTolerant`, :class:`Robust` over scenarios, and
  :class:`Recorded`, which keeps every evaluation in a study.
- Sampling: :func:`lp_tau`, :class:`LPTauSampling`, :class:`QMCSampling`,
  :class:`UniformSampling`.
- Algorithms: :class:`PSI`, :class:`SurrogatePSI`, :func:`investigate`; :func:`nsga3`.
- Tables: :class:`TestTable`; :func:`read_table` opens files, studies and frames,
  :func:`write_table` writes them; ``table.under(...)`` asks it under another
  :class:`Formulation`; a :class:`Decision` is what people decided. More in :mod:`.analysis`.
- Decision-making: :func:`rank_of_efficiency` and its :class:`EfficiencyRanking`, :func:`cautions`
  about its optimum; :func:`explain` a design, :func:`compare_designs`, :func:`representatives`;
  :func:`acceptability`, for how many weights a design is the best;
  :class:`SalukvadzeOptimum`, :class:`EfficientSubset`, :class:`CompromiseProgramming`,
  :class:`ReferencePoint`, :class:`Knee`; :class:`Preferences`, whose few questions find the
  design, and :class:`Preferred`; :func:`robustness`, :func:`switching_values`.
  More in :mod:`.selection`.
- Documents: :func:`decision_page`, :func:`decision_report`; figures in :mod:`.plots`;
  :func:`live`, the page of a study that grows.
- Comparison: :func:`compare` PSI with NSGA-III and others. More in :mod:`.comparison`.
- Running: :class:`JoblibRunner`, :class:`ProcessRunner`, :class:`ExecutorRunner`.
- Errors: :class:`PsiError`; all of them in :mod:`.errors`.

**Subpackages**

Each layer imports only from the layers above it, and within a layer each subpackage only from those
before it. Of another subpackage only names of its ``__init__`` are imported, which is an overview
of its subject with two lists: the public names, ``__all__``, and those that subpackages share. What
needs one file is a module instead.

============ ====================================== ======================
layer        subpackages                            knows
============ ====================================== ======================
base         ``errors``, ``guide``, ``_validation`` nothing
             and other small modules
mathematics  ``sequences``, ``chute``, ``pareto``   arrays
data         ``table`` (tests), ``analysis``,       arrays, pandas; SQLite
             ``study`` (the file of tests),         only in ``study``
             ``files`` (sources)
pymoo        ``parallel``, ``problems``,            pymoo
             ``algorithms``, ``selection``
experiments  ``comparison``, ``paper``              all above
presentation ``plots``, ``page``, ``report``,       all above; matplotlib
             ``server``, ``cli``                    only in ``plots``
============ ====================================== ======================

Every name is imported at its first use, so that importing the package costs next to nothing; the
stub beside this file says where each comes from. ``__citation__`` is how to cite the package, in
BibTeX.
"""

from pymoo_psi import _modules
from pymoo_psi._names import attach_names

__version__ = "0.4.0"  # the only place: the build reads this line
__citation__ = f"""\
@software{{pymoo_psi,
  title   = {{pymoo-psi: Parameter Space Investigation and decision-making on Pareto sets, for
             pymoo}},
  author  = {{{{The pymoo-psi developers}}}},
  version = {{{__version__}}},
  license = {{Apache-2.0}},
}}

@article{{cheshankov2012,
  title   = {{Multi-objective Motion Synthesis of a Rolling Sphere in a Rectilinear Chute-conveyor
             with Transformed Dry Friction}},
  author  = {{Cheshankov and Bozduganova and Ivanov and Vitliemov}},
  journal = {{Technische Mechanik}},
  volume  = {{32}},
  number  = {{6}},
  pages   = {{684--697}},
  year    = {{2012}},
}}
"""

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)

_modules.watch()
