"""Parameter Space Investigation and decision-making on Pareto sets, for pymoo.

.. include:: ../../README.md

The names that one imports first
--------------------------------

- Problems: :class:`SphereChute`, :class:`VectorizedSphereChute`; the mechanics in :mod:`.chute`.
  :class:`ProgramProblem`, an external program; :class:`Identification` of parameters.
- Wrappers of any problem: :class:`Restricted` to a part of its bounds, :class:`LogScaled`,
  :class:`Required`, :class:`FailureTolerant`, :class:`Robust` over scenarios, and
  :class:`Recorded`, which keeps every evaluation in a study.
- Sampling: :func:`lp_tau`, :class:`LPTauSampling`, :class:`QMCSampling`,
  :class:`UniformSampling`.
- Algorithms: :class:`PSI`, :class:`SurrogatePSI`, :func:`investigate`; :func:`nsga3`.
- Tables: :class:`TestTable`; :func:`read_table` opens files, studies and frames;
  ``table.under(...)`` asks it under another :class:`Formulation`.
- Decision-making: :func:`rank_of_efficiency` and its :class:`EfficiencyRanking`, :func:`cautions`
  about its optimum; :func:`explain` a design, :func:`compare_designs`, :func:`representatives`;
  :func:`acceptability`, for how many weights a design is the best;
  :class:`SalukvadzeOptimum`, :class:`EfficientSubset`, :class:`CompromiseProgramming`,
  :class:`ReferencePoint`, :class:`Knee`; :func:`robustness`, :func:`switching_values`.
  More in :mod:`.selection`.
- Documents: :func:`decision_page`, :func:`decision_report`; figures in :mod:`.plots`.
- Comparison: :func:`compare` PSI with NSGA-III and others. More in :mod:`.comparison`.
- Running: :class:`JoblibRunner`, :class:`ExecutorRunner`.
- Errors: :class:`PsiError`; all of them in :mod:`.errors`.

Subpackages
-----------

A layer imports only those above it. Of another subpackage it imports only names of its
``__init__``, which is an overview of the subject and has two lists: the public names, ``__all__``,
and those that subpackages share.

| layer | subpackages | knows |
|---|---|---|
| base | `errors`, `_validation` and other small modules; `guide`, texts | nothing |
| mathematics | `sequences`, `chute`, `pareto` | arrays |
| data | `study` (the file of tests), `table` (tests and designs, sources, analysis) | arrays, \
pandas; SQLite only in `study` |
| pymoo | `parallel`, `problems`, `algorithms`, `selection` | pymoo |
| experiments | `comparison`, `paper` | all above |
| presentation | `plots`, `page`, `report`, `cli` | all above; matplotlib only in `plots` |

Within a layer, too, a subpackage imports only those before it.

Every name is imported at its first use, so that importing the package costs next to nothing; the
stub beside this file says where each comes from.
"""

import lazy_loader

__version__ = "0.4.0.dev0"  # the only place: the build reads this line

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
