"""Figures of a comparison of algorithms: each its data, what draws them, and a page."""

from pymoo_psi.figures.comparison.attaining import (
    Attainment,
    attainment,
    attainment_page,
    draw_attainment,
)
from pymoo_psi.figures.comparison.fronts import (
    MedianFronts,
    draw_front,
    fronts_page,
    median_fronts,
)
from pymoo_psi.figures.comparison.indicators import (
    IndicatorCurves,
    draw_indicator,
    indicator_curves,
    indicators_page,
)
from pymoo_psi.figures.comparison.save import save_comparison
from pymoo_psi.figures.comparison.times import RunTimes, draw_times, run_times, time_page

__all__ = [  # noqa: RUF022 - in the order of the pages
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
