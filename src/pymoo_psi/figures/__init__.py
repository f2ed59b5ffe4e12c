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
    :class:`~pymoo_psi.investigation.Histogram`: :meth:`.TestTable.histogram`,
    :func:`draw_histogram`.
Criterion against variable, criterion against criterion
    :class:`DesignPlane`: :func:`variable_plane`, :func:`criteria_plane`,
    :func:`dependence_plane`, :func:`draw_plane`.
One-at-a-time section of the criteria
    :class:`Section`: :func:`section`, :func:`draw_section`.
Whole pages
    :func:`table_page`, :func:`criteria_page`, :func:`section_page`.

Of a :class:`~pymoo_psi.Comparison` of algorithms:

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

from pymoo_psi.figures.comparison import (
    Attainment,
    IndicatorCurves,
    MedianFronts,
    RunTimes,
    attainment,
    attainment_page,
    draw_attainment,
    draw_front,
    draw_indicator,
    draw_times,
    fronts_page,
    indicator_curves,
    indicators_page,
    median_fronts,
    run_times,
    save_comparison,
    time_page,
)
from pymoo_psi.figures.histograms import draw_histogram
from pymoo_psi.figures.plane_axes import draw_plane
from pymoo_psi.figures.planes import (
    DesignPlane,
    criteria_plane,
    dependence_plane,
    variable_plane,
)
from pymoo_psi.figures.points import (
    RankedPoints,
    design_points,
    draw_points,
    geometric_points,
    objective_points,
)
from pymoo_psi.figures.robustness import (
    RobustDesigns,
    draw_regret,
    draw_shares,
    robust_designs,
    robustness_page,
)
from pymoo_psi.figures.save import paper_figures, save_figures
from pymoo_psi.figures.sections import Section, draw_section, section
from pymoo_psi.figures.sensitivity import (
    SalukvadzeFunctions,
    draw_salukvadze_functions,
    salukvadze_functions,
)
from pymoo_psi.figures.surfaces import CriterionSurfaces, criterion_surfaces, draw_surface
from pymoo_psi.figures.table_pages import criteria_page, section_page, table_page
from pymoo_psi.figures.transport import MotionPanel, draw_motion_panel, motion_panels

__all__ = [  # noqa: RUF022 - in the order of the figures
    # Figure 2
    "CriterionSurfaces",
    "criterion_surfaces",
    "draw_surface",
    # Figures 3 to 6
    "RankedPoints",
    "geometric_points",
    "design_points",
    "objective_points",
    "draw_points",
    # Figure 7
    "MotionPanel",
    "motion_panels",
    "draw_motion_panel",
    # Figure 8
    "SalukvadzeFunctions",
    "salukvadze_functions",
    "draw_salukvadze_functions",
    # Designs under uncertainty
    "RobustDesigns",
    "robust_designs",
    "draw_shares",
    "draw_regret",
    "robustness_page",
    # Whole pages
    "paper_figures",
    "save_figures",
    # Of a test table
    "draw_histogram",
    "DesignPlane",
    "variable_plane",
    "criteria_plane",
    "dependence_plane",
    "draw_plane",
    "Section",
    "section",
    "draw_section",
    "table_page",
    "criteria_page",
    "section_page",
    # Of a comparison of algorithms
    "IndicatorCurves",
    "indicator_curves",
    "draw_indicator",
    "indicators_page",
    "MedianFronts",
    "median_fronts",
    "draw_front",
    "fronts_page",
    "Attainment",
    "attainment",
    "draw_attainment",
    "attainment_page",
    "RunTimes",
    "run_times",
    "draw_times",
    "time_page",
    "save_comparison",
]
