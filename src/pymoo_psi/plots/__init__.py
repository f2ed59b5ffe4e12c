"""Figures of the paper, 2 to 8, and of any test table: for each its data, and what draws them.

The data are arrays in frozen dataclasses, to be looked at or tested as numbers. The drawing
functions take ``ax``, or make axes of their own, and return the axes; they show nothing, write
nothing, and leave matplotlib's settings alone. This is the only place that imports matplotlib.

Figure 2, the criteria over the design box
    :class:`CriterionSurfaces`: :func:`criterion_surfaces`, :func:`draw_surface`.
Figures 3 to 6, the ranked Pareto set in four spaces
    :class:`RankedPoints`: :func:`geometric_points`, :func:`design_points`,
    :func:`objective_points`, :func:`draw_points`.
Figure 7, the transportation of the sphere
    :class:`MotionPanel`: :func:`motion_panels`, :func:`draw_motion_panel`.
Figure 8, the optimum as a function of the initial speed
    :class:`SalukvadzeFunctions`: :func:`salukvadze_functions`, :func:`draw_salukvadze_functions`.
Designs under uncertainty
    :class:`RobustDesigns`: :func:`robust_designs`, :func:`draw_shares`, :func:`draw_regret`,
    :func:`robustness_page`.
Whole pages
    :func:`paper_figures`, :func:`save_figures`.

Of a :class:`~pymoo_psi.TestTable`, with limits on criteria:

Where the designs lie over a variable
    :class:`~pymoo_psi.table.Histogram`: :meth:`.TestTable.histogram`,
    :func:`draw_histogram`.
Criterion against variable, criterion against criterion
    :class:`DesignPlane`: :func:`variable_plane`, :func:`criteria_plane`,
    :func:`dependence_plane`, :func:`draw_plane`.
One-at-a-time section of the criteria
    :class:`Section`: :func:`section`, :func:`draw_section`.
Whole pages
    :func:`table_page`, :func:`criteria_page`, :func:`section_page`.

Of a :class:`~pymoo_psi.comparison.Comparison` of algorithms:

Indicators of quality against evaluations
    :class:`IndicatorCurves`: :func:`indicator_curves`, :func:`draw_indicator`,
    :func:`indicators_page`.
Fronts of the median runs
    :class:`MedianFronts`: :func:`median_fronts`, :func:`draw_front`, :func:`fronts_page`.
Empirical attainment surfaces, for two objectives
    :class:`Attainment`: :func:`attainment`, :func:`draw_attainment`, :func:`attainment_page`.
Time against quality
    :class:`RunTimes`: :func:`run_times`, :func:`draw_times`, :func:`time_page`.
All pages as files
    :func:`save_comparison`.
"""

from pymoo_psi.plots._comparison import save_comparison
from pymoo_psi.plots._comparison_fronts import (
    Attainment,
    MedianFronts,
    attainment,
    attainment_page,
    draw_attainment,
    draw_front,
    fronts_page,
    median_fronts,
)
from pymoo_psi.plots._comparison_indicators import (
    IndicatorCurves,
    RunTimes,
    draw_indicator,
    draw_times,
    indicator_curves,
    indicators_page,
    run_times,
    time_page,
)
from pymoo_psi.plots._designs import (
    DesignPlane,
    criteria_plane,
    dependence_plane,
    draw_plane,
    variable_plane,
)
from pymoo_psi.plots._histogram import draw_histogram
from pymoo_psi.plots._paper import paper_figures, save_figures
from pymoo_psi.plots._paper_curves import (
    CriterionSurfaces,
    MotionPanel,
    SalukvadzeFunctions,
    criterion_surfaces,
    draw_motion_panel,
    draw_salukvadze_functions,
    draw_surface,
    motion_panels,
    salukvadze_functions,
)
from pymoo_psi.plots._paper_points import (
    RankedPoints,
    design_points,
    draw_points,
    geometric_points,
    objective_points,
)
from pymoo_psi.plots._robustness import (
    RobustDesigns,
    draw_regret,
    draw_shares,
    robust_designs,
    robustness_page,
)
from pymoo_psi.plots._section import Section, draw_section, section
from pymoo_psi.plots._table import criteria_page, section_page, table_page

__all__ = [
    "Attainment",
    "CriterionSurfaces",
    "DesignPlane",
    "IndicatorCurves",
    "MedianFronts",
    "MotionPanel",
    "RankedPoints",
    "RobustDesigns",
    "RunTimes",
    "SalukvadzeFunctions",
    "Section",
    "attainment",
    "attainment_page",
    "criteria_page",
    "criteria_plane",
    "criterion_surfaces",
    "dependence_plane",
    "design_points",
    "draw_attainment",
    "draw_front",
    "draw_histogram",
    "draw_indicator",
    "draw_motion_panel",
    "draw_plane",
    "draw_points",
    "draw_regret",
    "draw_salukvadze_functions",
    "draw_section",
    "draw_shares",
    "draw_surface",
    "draw_times",
    "fronts_page",
    "geometric_points",
    "indicator_curves",
    "indicators_page",
    "median_fronts",
    "motion_panels",
    "objective_points",
    "paper_figures",
    "robust_designs",
    "robustness_page",
    "run_times",
    "salukvadze_functions",
    "save_comparison",
    "save_figures",
    "section",
    "section_page",
    "table_page",
    "time_page",
    "variable_plane",
]
