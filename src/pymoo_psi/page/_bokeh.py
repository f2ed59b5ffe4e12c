"""Bokeh's parts of the page: the source of the designs, plots, sliders, the table.

The parts only look right here; what they do together is in ``page.js``.

Names are text. Bokeh renders what stands between ``$$`` in a string as TeX, which can load an
address or run a script: so names go to it as ``PlainText``, as escaped HTML where HTML is wanted
(the table's headings), as data, and to no property that takes a string only (a slider's title).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from bokeh.models import (
    BasicTicker,
    BoxSelectTool,
    BoxZoomTool,
    CDSView,
    ColumnDataSource,
    FixedTicker,
    HoverTool,
    LassoSelectTool,
    MultiLine,
    PanTool,
    PlainText,
    PrintfTickFormatter,
    Range1d,
    ResetTool,
    Scatter,
    TapTool,
    Text,
    WheelZoomTool,
)
from bokeh.models.widgets import (
    CellFormatter,
    DataTable,
    HTMLTemplateFormatter,
    RangeSlider,
    StringFormatter,
    TableColumn,
)
from bokeh.plotting import figure
from markupsafe import escape
from numpy.typing import NDArray

from pymoo_psi._markers import MARKERS, Marker
from pymoo_psi.page._data import DOMINATED, PROTOTYPE, Column, PageData, columns_with

_FADED = 0.10  # opacity of what is not selected
_MOST_AXES = 12  # of the parallel coordinates; more have no room for their names
_MOST_LINES_IN_HINT = 18  # more would not fit beside the pointer on a laptop
_FONT = """
:host, .slick-grid { font-family: inherit; }
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
# <%= writes a field as HTML: right for texts of the page's own only, never for a user's.
_RANK = """<% if (mark === "prototype") { %>prototype<% } else if (mark === "dominated") { %>\
dominated<% } else { %><%= rank %><%= mark ? " ★" : "" %><% } %>"""

_SHAPES = {".": "circle", "^": "triangle", "s": "square", "D": "diamond", "*": "star", "x": "x"}
_OTHERS = {
    DOMINATED: Marker("x", "0.8", 2.5, level=1.0),
    PROTOTYPE: Marker("x", "#000000", 8.0, level=7.0),
}
_PIXELS = 1.55  # per point; a screen is looked at from further away than a print
_PATHS = {  # on a square of 16, for the legend
    "circle": '<circle cx="8" cy="8" r="3"/>',
    "triangle": '<path d="M8 3 L13 13 H3 Z"/>',
    "square": '<path d="M4 4 H12 V12 H4 Z"/>',
    "diamond": '<path d="M8 2 L13 8 L8 14 L3 8 Z"/>',
    "star": '<path d="M8 1 L10 6 H15 L11 9 L12 14 L8 11 L4 14 L5 9 L1 6 H6 Z"/>',
    "x": '<path d="M3.5 3.5 L12.5 12.5 M12.5 3.5 L3.5 12.5" stroke-width="2.2"/>',
}


def designs_source(data: PageData) -> ColumnDataSource:
    """Return the one source of the designs, which plots and table look at."""
    looks = {group: look(group) for group in np.unique(data.group).tolist()}
    looks_of_rows = [looks[group] for group in data.group.tolist()]
    columns: dict[str, Any] = {column.field: column.values for column in data.columns}
    columns |= {"label": data.labels, "rank": data.rank, "group": data.group, "mark": data.marks}
    # Columns and not one glyph a group: one renderer is one selection and one order of drawing.
    columns["shape"] = [row.shape for row in looks_of_rows]
    columns["colour"] = [row.colour for row in looks_of_rows]
    columns["stroke"] = np.where(data.group == PROTOTYPE, 2.5, 1.0).astype(np.float32)
    columns["size"] = np.array([row.size for row in looks_of_rows], dtype=np.float32)
    return ColumnDataSource(columns, name="designs")


def scatter_plot(
    name: str, source: ColumnDataSource, view: CDSView, x: Column, y: Column, hint: HoverTool
) -> figure:
    """Return one of the linked scatter plots; its axes are set again where the page runs."""
    brush = BoxSelectTool()
    plot = figure(
        name=name,
        sizing_mode="stretch_both",
        x_range=Range1d(start=0, end=1),
        y_range=Range1d(start=0, end=1),
        x_axis_label=PlainText(text=x.label),
        y_axis_label=PlainText(text=y.label),
        tools=[brush, LassoSelectTool(), TapTool(), PanTool(), BoxZoomTool(), WheelZoomTool(),
               ResetTool(), hint],
        active_drag=brush,
        toolbar_location="right",
        lod_threshold=10_000,  # of more points only some are drawn while the plot is dragged
        min_border=4,
    )  # fmt: skip
    plot.xaxis.ticker = BasicTicker(desired_num_ticks=6)
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    drawn: dict[str, Any] = {
        "x": x.field,
        "y": y.field,
        "marker": {"field": "shape"},
        "size": {"field": "size"},
        "fill_color": {"field": "colour"},
        "line_color": {"field": "colour"},
        "line_width": {"field": "stroke"},
    }
    # The plot's only renderer: page.js puts other columns on its two glyphs.
    glyph = Scatter(**drawn, fill_alpha=0.85, line_alpha=0.85)
    faded = Scatter(**drawn, fill_alpha=_FADED, line_alpha=_FADED)
    hint.renderers = [plot.add_glyph(source, glyph, nonselection_glyph=faded, view=view)]
    return plot


def hint_on_designs(data: PageData) -> HoverTool:
    """Return what hovering shows: the number of a design and its values."""
    # By fields, which are free of the user's characters: @, { and $ mean something to Bokeh here.
    columns = data.columns[:_MOST_LINES_IN_HINT]
    tips = [(data.label_name, "@label"), ("rank", "@rank @mark")]
    tips += [(column.label, f"@{column.field}{_pattern(column)}") for column in columns]
    formats: dict[str, Any] = {
        f"@{column.field}": "printf" for column in columns if column.is_number
    }
    return HoverTool(tooltips=tips, formatters=formats, limit=1, visible=False)


def _pattern(column: Column) -> str:
    return f"{{{column.printf}}}" if column.is_number else ""


def parallel_plot(data: PageData, source: ColumnDataSource, ends: ColumnDataSource) -> figure:
    """Return parallel coordinates; the page fills its sources with what is left.

    Args:
        data: What the page shows.
        source: One row per line: ``xs``, ``ys``, ``colour``, ``width``, ``alpha``, ``label``.
        ends: The values at the ends of the axes: ``x``, ``low``, ``high``.
    """
    axes = parallel_axes(data)
    pick = TapTool()
    plot = figure(
        name="parallel",
        sizing_mode="stretch_both",
        # Room for names beside the outer axes, and for the values at their ends.
        x_range=Range1d(start=-0.35, end=len(axes) - 0.65),
        y_range=Range1d(start=-0.12, end=1.12),
        tools=[pick],
        toolbar_location=None,
        min_border=4,
    )
    plot.yaxis.visible = False
    plot.ygrid.visible = False
    plot.xgrid.grid_line_color = "#888888"
    plot.xgrid.level = "glyph"
    plot.xaxis.ticker = FixedTicker(ticks=list(range(len(axes))))
    names = enumerate(_axis_names(axes))
    plot.xaxis.major_label_overrides = {j: PlainText(text=name) for j, name in names}
    plot.xaxis.axis_line_color = None
    plot.xaxis.major_tick_line_color = None
    plot.outline_line_color = None
    drawn: dict[str, Any] = {
        "xs": "xs",
        "ys": "ys",
        "line_color": {"field": "colour"},
        "line_width": {"field": "width"},
    }
    line = MultiLine(**drawn, line_alpha={"field": "alpha"})
    faded = MultiLine(**drawn, line_alpha=_FADED / 2)
    lines = plot.add_glyph(source, line, nonselection_glyph=faded)
    pick.renderers = [lines]
    plot.add_tools(HoverTool(renderers=[lines], limit=1, tooltips=[(data.label_name, "@label")]))
    for field, place in (("low", 0), ("high", 1)):
        style: dict[str, Any] = {
            "y_offset": 4 - 8 * place,
            "text_align": "center",
            "text_baseline": "bottom" if place else "top",
            "text_font_size": "11px",
            "text_color": "#444444",
            "background_fill_color": "white",
            "background_fill_alpha": 0.85,
        }
        text = Text(x="x", y={"value": place}, text={"field": field}, **style)
        plot.add_glyph(ends, text, level="annotation")
    return plot


def _axis_names(axes: list[Column]) -> list[str]:
    """Return the labels of the axes as far as there is room; in two rows if one is too narrow."""
    room = 64 // len(axes)  # some 64 characters stand side by side on a laptop's screen
    labels = [column.label for column in axes]
    if all(len(label) <= room for label in labels):
        return labels
    short = [text if len(text) <= 2 * room else f"{text[: 2 * room - 1]}…" for text in labels]
    return [f"\n{text}" if j % 2 else text for j, text in enumerate(short)]


def parallel_axes(data: PageData) -> list[Column]:
    """Return the columns with an axis in the parallel coordinates, the criteria first."""
    return columns_with(data, "criterion", "variable", "output")[:_MOST_AXES]


def limit_slider(
    column: Column, group: NDArray[np.int32], limit: float | None = None
) -> RangeSlider | None:
    """Return the slider with two ends for the limits of a criterion; None for a constant.

    Args:
        column: The criterion.
        group: ``(n,)`` groups of drawing.
        limit: Where the end of the worse values stands at first, if not at the end of the track.
    """
    # Prototypes stay whatever the limits, so that their values do not stretch the track.
    values = column.values[group != PROTOTYPE]
    low, high = float(values.min()), float(values.max())
    if not low < high:
        return None
    bounds = (low, high)
    if limit is not None:
        bounds = (max(low, limit), high) if column.maximize else (low, min(high, limit))
    return RangeSlider(
        name=f"limit_{column.field}",
        show_value=False,
        start=low,
        end=high,
        value=bounds,
        # Finer than a pixel of the track, at whose ends page.js takes the slider for no limit.
        step=(high - low) / 1000,
        format=PrintfTickFormatter(format=column.printf),
        sizing_mode="stretch_width",
        bar_color="#0072B2",
        margin=(0, 14, 4, 8),
        stylesheets=[_FONT],
    )


def table_of(data: PageData, source: ColumnDataSource, view: CDSView) -> DataTable:
    """Return the sortable table of what is left."""
    wide = 104 if data.labels.dtype == object else 76
    columns = [
        _heading("label", data.label_name, wide, StringFormatter()),
        _heading("group", "rank", 84, HTMLTemplateFormatter(template=_RANK)),
    ]
    for column in data.columns:
        if column.is_number:
            formatter: CellFormatter = HTMLTemplateFormatter(template=_number(column))
        else:
            formatter = StringFormatter()
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
        autosize_mode="none",  # or Bokeh would squeeze all columns into the window
        row_height=22,
        frozen_columns=2,  # which design, and its rank, whatever is scrolled
        sizing_mode="stretch_both",
        reorderable=False,
        stylesheets=[_TABLE_STYLE],
    )


def _heading(field: str, name: str, width: int, formatter: CellFormatter) -> TableColumn:
    return TableColumn(field=field, title=str(escape(name)), width=width, formatter=formatter)


def _number(column: Column) -> str:
    kind, digits = column.notation
    method = "toFixed" if kind == "fixed" else "toExponential"
    shown = f'<%= isNaN(value) ? "–" : value.{method}({digits}) %>'
    return f'<div class="number">{shown}</div>'


class Look(NamedTuple):
    """How a group is drawn: Bokeh's name of the marker, colour, size in pixels."""

    shape: str
    colour: str
    size: float

    @property
    def svg(self) -> str:
        """The marker as a picture for the legend."""
        paint = f'fill="{self.colour}" stroke="{self.colour}"'
        return f'<svg width="16" height="16" aria-hidden="true" {paint}>{_PATHS[self.shape]}</svg>'


def look(group: int) -> Look:
    """Return how a group is drawn."""
    # The optimum has the look of rank 6 even if its rank is lower, as its group is that number.
    marker = {**MARKERS, **_OTHERS}.get(group, MARKERS[0])
    colour = marker.colour
    if not colour.startswith("#"):  # matplotlib writes greys as a share of white
        colour = "#" + f"{round(255 * float(colour)):02X}" * 3
    return Look(_SHAPES[marker.shape], colour, round(max(marker.size * _PIXELS, 3.5), 1))
