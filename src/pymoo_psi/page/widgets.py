"""Bokeh's widgets of the page: the sliders with two ends, and the table."""

from __future__ import annotations

import numpy as np
from bokeh.models import CDSView, ColumnDataSource, PrintfTickFormatter
from bokeh.models.widgets import (
    CellFormatter,
    DataTable,
    HTMLTemplateFormatter,
    RangeSlider,
    StringFormatter,
    TableColumn,
)
from markupsafe import escape
from numpy.typing import NDArray

from pymoo_psi.page.columns import Column
from pymoo_psi.page.content import PageData
from pymoo_psi.page.groups import PROTOTYPE

__all__ = ["limit_slider", "table_of"]

_FONT = """
:host, .slick-grid { font-family: inherit; }
.bk-slider-title { font-family: inherit; font-size: 12px; white-space: normal; }
"""
_TABLE_STYLE = (
    _FONT
    + """
.slick-header-columns { background: #F3F4F6; }
.slick-column-name { max-width: 100%; overflow: hidden; text-overflow: ellipsis; }
.slick-header-right .slick-column-name { float: right; }
.slick-header-right .slick-sort-indicator { left: 2px; }
.slick-cell.selected { background: #CFE5F5 !important; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
"""
)
_RANK = """<% if (mark === "prototype") { %>prototype<% } else if (mark === "dominated") { %>\
dominated<% } else { %><%= rank %><%= mark ? " ★" : "" %><% } %>"""


def limit_slider(
    column: Column, group: NDArray[np.int32], limit: float | None = None
) -> RangeSlider | None:
    """Return the slider with two ends for the limits of a criterion; None for a constant.

    Args:
        column: The criterion.
        group: ``(n,)`` groups of drawing.
        limit: Where the end of the worse values stands at first, if not at the end of the track.
    """
    values = column.values[group != PROTOTYPE]
    low, high = float(values.min()), float(values.max())
    if not low < high:
        return None
    bounds = (low, high)
    if limit is not None:
        bounds = (max(low, limit), high) if column.maximize else (low, min(high, limit))
    return RangeSlider(
        name=f"limit_{column.field}",
        title=column.label,
        start=low,
        end=high,
        value=bounds,
        step=(high - low) / 1000,
        format=PrintfTickFormatter(format=column.printf),
        sizing_mode="stretch_width",
        bar_color="#0072B2",
        margin=(2, 14, 4, 8),
        stylesheets=[_FONT],
    )


def table_of(data: PageData, source: ColumnDataSource, view: CDSView) -> DataTable:
    """Return the sortable table of what is left."""
    wide = 104 if data.labels.dtype == object else 76
    columns = [
        _heading("label", data.label_name, wide, _text()),
        _heading("group", "rank", 84, HTMLTemplateFormatter(template=_RANK)),
    ]
    for column in data.columns:
        if column.is_number:
            formatter: CellFormatter = HTMLTemplateFormatter(template=_number(column))
        else:
            formatter = _text()
        name = column.name.partition(" ")[0] if column.role == "geometric" else column.label
        columns.append(
            _heading(column.field, name, min(max(68, 7 * len(name) + 24), 150), formatter)
        )
    return DataTable(
        name="table",
        source=source,
        view=view,
        columns=columns,
        index_position=None,
        autosize_mode="none",
        row_height=22,
        frozen_columns=2,
        sizing_mode="stretch_both",
        reorderable=False,
        stylesheets=[_TABLE_STYLE],
    )


def _heading(field: str, name: str, width: int, formatter: CellFormatter) -> TableColumn:
    return TableColumn(field=field, title=str(escape(name)), width=width, formatter=formatter)


def _text() -> CellFormatter:
    return StringFormatter()


def _number(column: Column) -> str:
    kind, digits = column.notation
    method = "toFixed" if kind == "fixed" else "toExponential"
    shown = f'<%= isNaN(value) ? "–" : value.{method}({digits}) %>'
    return f'<div class="number">{shown}</div>'
