"""Figures of test tables, rankings and comparisons, and the paper's figures.

Figures are made to be saved: nothing here opens a window, needs ``pyplot`` or changes matplotlib's
settings. Each figure is a :class:`Drawing`, a matplotlib figure with panel letters, and with a
``caption`` instead of a title. No other subpackage imports matplotlib.

Test tables, under the limits of their formulation:
    :func:`plot_table`: histograms of the variables, and objectives against variables.
    :func:`plot_objectives`: the objectives in pairs.
    :func:`plot_sensitivities`: the share of a column's variance that each variable explains.
    :func:`plot_sections`: objectives while one variable of a design changes, from surrogates.

Rankings:
    :func:`plot_ranking`: parallel coordinates, by place.

Comparisons of algorithms:
    :func:`plot_indicators`: quality against evaluations.

The paper:
    :func:`paper_figures`: Figures 2 to 8.

Files:
    :func:`save_figures`: write figures to files, all of them or none.
"""

from pymoo_psi._names import attach_names

# Names are imported at first use: figures of tables need neither pymoo nor the paper.
__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
