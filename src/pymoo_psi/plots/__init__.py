"""Figures of tables, rankings and comparisons, and the paper's figures.

This is the only subpackage that imports matplotlib. Nothing here opens a window, needs ``pyplot``
or changes matplotlib's settings: figures are to be saved. They have panel letters and no titles:
each is a :class:`Drawing`, a figure of matplotlib with a ``caption``, saved as a text beside it.

Of a :class:`~pymoo_psi.TestTable`, with limits on columns:
    :func:`plot_table`: histograms of the variables, and every objective against every variable.
    :func:`plot_objectives`: the objectives in pairs.
    :func:`plot_sensitivities`: how much each variable explains of each column.
    :func:`plot_identification`: the best designs' curves over measured series.

Of any ranked set:
    :func:`plot_ranking`: parallel coordinates, by rank.

Of a :class:`~pymoo_psi.comparison.Comparison` of algorithms:
    :func:`plot_indicators`, :func:`plot_indicator`: quality against evaluations.

Of the paper:
    :func:`paper_figures`: figures 2 to 8, one by one.

Names and files:
    :func:`literal`: a name as it is written, without formulas.
    :func:`save_figures`: figures as files, all of them or none.
"""

from pymoo_psi._lazy import attach_names

# Each name at its first use: figures of tests need neither pymoo nor the paper.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
