"""Pictures of tables, robustness and comparisons, and the paper's figures.

This is the only place that imports matplotlib. Nothing here shows a window, needs ``pyplot`` or
changes matplotlib's settings: pages are figures to be saved, and what draws on one pair of axes
takes ``ax``, or makes axes of its own.

Of a :class:`~pymoo_psi.TestTable`, with limits on criteria:
    :func:`table_page`: histograms of the variables, and every criterion against every variable.
    :func:`criteria_page`: the criteria in pairs.
    :func:`section_page`: the criteria along one variable, through a chosen design.
    :func:`draw_histogram`: where the feasible designs lie over one variable.
    :func:`draw_feasibility`: where they lie over the two variables that decide most on it.
    :func:`sensitivity_page`: how much each variable explains of each column.
    :func:`convergence_page`: how good the tests are against their number.

Of any ranked set:
    :func:`ranking_page`: its criteria in pairs and as parallel coordinates, by rank.

Of a :class:`~pymoo_psi.SurrogatePSI`:
    :func:`predictions_page`: what its surrogates expected, and what was found.

Of designs under uncertainty:
    :func:`robustness_page`: how often each stays the best, and what it loses otherwise.

Of a :class:`~pymoo_psi.comparison.Comparison` of algorithms:
    :func:`indicators_page`, :func:`draw_indicator`: quality against evaluations.
    :func:`differences_page`: how the others differ from one of them, with intervals.
    :func:`fronts_page`: what the median runs found.
    :func:`attainment_page`: what half of the runs attain, of two objectives.
    :func:`time_page`: time against quality.
    :func:`save_comparison`: all pages as files.

Of the paper:
    :func:`paper_figures`: figures 2 to 8, one by one.
    :func:`save_figures`: all of them as files.
    :func:`points_page`: whether the number of points is enough.
"""

from pymoo_psi.plots._analysis import convergence_page, draw_feasibility, sensitivity_page
from pymoo_psi.plots._comparison import (
    attainment_page,
    differences_page,
    draw_indicator,
    fronts_page,
    indicators_page,
    save_comparison,
    time_page,
)
from pymoo_psi.plots._histogram import draw_histogram
from pymoo_psi.plots._paper import paper_figures, points_page, save_figures
from pymoo_psi.plots._predictions import predictions_page
from pymoo_psi.plots._ranking import ranking_page
from pymoo_psi.plots._robustness import robustness_page
from pymoo_psi.plots._section import section_page
from pymoo_psi.plots._table import criteria_page, table_page

__all__ = [
    "attainment_page",
    "convergence_page",
    "criteria_page",
    "differences_page",
    "draw_feasibility",
    "draw_histogram",
    "draw_indicator",
    "fronts_page",
    "indicators_page",
    "paper_figures",
    "points_page",
    "predictions_page",
    "ranking_page",
    "robustness_page",
    "save_comparison",
    "save_figures",
    "section_page",
    "sensitivity_page",
    "table_page",
    "time_page",
]
