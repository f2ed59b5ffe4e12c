"""Parameter Space Investigation and decision-making on Pareto sets, for pymoo.

.. include:: ../../README.md

The names that one imports first
--------------------------------

- Problems: :class:`SphereChute`, :class:`VectorizedSphereChute`; the mechanics in :mod:`.chute`.
  :class:`Restricted`, a part of any problem's box; :class:`Robust`, criteria over scenarios.
- Sampling: :func:`lp_tau`, :class:`LPTauSampling`, :class:`QMCSampling`.
- Algorithms: :class:`PSI`, :class:`SurrogatePSI`, :func:`investigate` and their
  :class:`TestTable`; :func:`nsga3`.
- Decision-making: :func:`rank_of_efficiency` and its :class:`EfficiencyRanking`, :func:`cautions`
  about its optimum; :func:`explain` a design, :func:`compare_designs`, :func:`representatives`;
  :class:`SalukvadzeOptimum`, :class:`EfficientSubset`, :class:`CompromiseProgramming`,
  :class:`ReferencePoint`, :class:`Knee`, :class:`Lexicographic`; :func:`robustness`.
  More in :mod:`.selection`.
- Comparison: :func:`compare` PSI with NSGA-III and others. More in :mod:`.comparison`.
- Running: :class:`JoblibRunner`, :class:`FailureTolerant`, :class:`Recorded`.
- Errors: :class:`PsiError`; all of them in :mod:`.errors`.

Rooms
-----

Each room is a module with a chapter on its subject. A layer imports only those above it.

| layer | rooms | knows |
|---|---|---|
| ground | `errors`, `_validation`, `_files`, `_kinds`, `_tables` | nothing |
| mathematics | `sequences`, `chute`, `pareto` | arrays |
| method | `study` (the study), `table` (the test table) | arrays, pandas; SQLite in `study` |
| pymoo | `problems`, `parallel`, `algorithms`, `selection` | pymoo |
| experiments | `comparison`, `paper` | all above |
| faces | `plots`, `page`, `report`, `cli` | results of all above |

A room's ``__init__`` is its chapter and its index: what is listed there is public, and every module
begins with an underscore.

Every name is imported at its first use, so that importing the package costs next to nothing; the
stub beside this file says where each comes from.
"""

import lazy_loader

__version__ = "0.2.0"  # the only place: the build reads this line

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
