"""The page as one HTML document: Bokeh's parts, the frame around them, style and script."""

from __future__ import annotations

import re
from base64 import b64encode
from dataclasses import dataclass
from hashlib import sha256
from importlib.resources import files
from typing import Any

import numpy as np
from bokeh.document import Document
from bokeh.embed import file_html
from bokeh.models import CDSView, ColumnDataSource, CustomJS, IndexFilter, PlainText
from bokeh.models.widgets import RangeSlider
from bokeh.resources import INLINE
from bokeh.themes import Theme

from pymoo_psi.page._bokeh import (
    designs_source,
    hint_on_designs,
    limit_slider,
    look,
    parallel_axes,
    parallel_plot,
    scatter_plot,
    table_of,
)
from pymoo_psi.page._data import (
    DOMINATED,
    OPTIMUM,
    PROTOTYPE,
    Column,
    PageData,
    columns_with,
    csv_head,
    file_name,
    group_name,
)

_THEME = Theme(
    json={
        "attrs": {
            "Plot": {"outline_line_color": "#BBBBBB", "border_fill_color": None},
            "Axis": {
                "axis_label_text_font": "system-ui, sans-serif",
                "axis_label_text_font_style": "normal",
                "axis_label_text_font_size": "12px",
                "axis_label_text_color": "#222222",
                "axis_label_standoff": 4,
                "major_label_text_font": "system-ui, sans-serif",
                "major_label_text_font_size": "11px",
                "major_label_text_color": "#444444",
                "axis_line_color": "#BBBBBB",
                "major_tick_line_color": "#BBBBBB",
                "minor_tick_line_color": None,
            },
            "BasicTickFormatter": {"power_limit_high": 7},  # as Column.notation has it
            "Grid": {"grid_line_color": "#EEEEEE"},
        }
    }
)


# Scripts that run: Bokeh's data, of the type application/json, need no leave of the policy.
_SCRIPT = '<script(?: type="text/javascript")?>(.*?)</script>'
# Letter for letter as in page.html, or the page has no policy.
_NO_POLICY = '<meta http-equiv="Content-Security-Policy" content="">'


def html_of(data: PageData) -> str:
    """Return the page with all it needs inlined."""
    source = designs_source(data)
    # One filter and one view for all: what a limit hides is hidden everywhere.
    shown = IndexFilter(indices=np.flatnonzero(data.group != DOMINATED).tolist(), name="shown")
    view = CDSView(filter=shown)
    scatters = [
        (panel, scatter_plot(panel.name, source, view, panel.x, panel.y, hint_on_designs(data)))
        for panel in panels(data)
    ]
    # Empty: page.js fills them with what is left, so that designs are not embedded twice.
    lines = ColumnDataSource(
        {key: [] for key in ("xs", "ys", "colour", "width", "alpha", "label", "row")}, name="lines"
    )
    ends = ColumnDataSource({key: [] for key in ("x", "low", "high")})
    table = table_of(data, source, view)
    sliders = [
        (column, limit_slider(column, data.group, data.limits.get(column.name)))
        for column in columns_with(data, "criterion")
    ]

    # A root has a name, by which page.html embeds it.
    document = Document(theme=_THEME, title=data.title)
    for root in (
        *(plot for _, plot in scatters),
        parallel_plot(data, lines, ends),
        table,
        *(slider for _, slider in sliders if slider is not None),
    ):
        document.add_root(root)
    # The names are the variables of page.js, which lists them at its top.
    arguments = {
        "source": source,
        "shown": shown,
        "lines": lines,
        "ends": ends,
        "table": table,
        "limits": [
            {"field": column.field, "slider": slider}
            for column, slider in sliders
            if slider is not None
        ],
        "plots": [
            {"name": panel.name, "plot": plot, "renderer": plot.renderers[0]}
            for panel, plot in scatters
        ],
        "columns": [_described(column) for column in data.columns],
        "texts": {column.field: PlainText(text=column.label) for column in data.columns},
        "parallel": [column.field for column in parallel_axes(data)],
        "names": {"label": data.label_name, "file": file_name(data.title)},
        "head": csv_head(data),
    }
    document.js_on_event("document_ready", CustomJS(args=arguments, code=_asset("page.js")))
    return _sealed(
        file_html(
            document,
            resources=INLINE,
            template=_asset("page.html"),
            template_variables=_frame(data, [panel for panel, _ in scatters], sliders),
        )
    )


def _sealed(html: str) -> str:
    """Forbid the page every request, and every script but those that it has now.

    Bokeh compiles the code of its callbacks and templates, which takes ``'unsafe-eval'``; no name
    of a user's is part of any, and a script or a handler in the markup runs by its hash only.
    """
    hashes = [
        b64encode(sha256(script.encode("utf-8")).digest()).decode("ascii")
        for script in re.findall(_SCRIPT, html, re.DOTALL)
    ]
    scripts = " ".join(f"'sha256-{digest}'" for digest in hashes)
    policy = (
        f"default-src 'none'; script-src 'unsafe-eval' {scripts}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    # Only the first one, in the head: a text of the user's further down is left alone.
    return html.replace(_NO_POLICY, _NO_POLICY.replace('""', f'"{policy}"'), 1)


@dataclass(frozen=True)
class Panel:
    """One scatter plot: its name and what is on its axes at first."""

    name: str
    x: Column
    y: Column


def panels(data: PageData) -> list[Panel]:
    """Return the scatter plots: of criteria, of variables, of the geometric criteria.

    Without variables the second one is of further criteria, if there are any.
    """
    criteria, variables = columns_with(data, "criterion"), columns_with(data, "variable")
    mu1, mu2, mu3 = columns_with(data, "geometric")
    pairs = [("criteria", criteria[0], criteria[1] if len(criteria) > 1 else mu1)]
    # A variable alone has the first criterion on the other axis, not itself.
    if variables:
        pairs.append(("variables", variables[0], (variables[1:] or criteria)[0]))
    elif len(criteria) > 2:
        pairs.append(("variables", criteria[-2], criteria[-1]))
    pairs.append(("geometric", mu3, mu2))
    return [Panel(*pair) for pair in pairs]


def _described(column: Column) -> dict[str, Any]:
    kind, digits = column.notation if column.is_number else ("text", 0)
    return {
        "field": column.field,
        # What the export calls it: the geometric criteria as ``rank --out`` does.
        "name": column.field if column.role == "geometric" else column.name,
        "maximize": column.maximize,
        "notation": [kind, digits],
    }


def _frame(
    data: PageData, shown: list[Panel], sliders: list[tuple[Column, RangeSlider | None]]
) -> dict[str, Any]:
    """Return what the template writes around Bokeh's parts."""
    # The best rank on top. Prototypes have no box, as they cannot be switched off.
    groups = [g for g in sorted(np.unique(data.group).tolist(), reverse=True) if g != PROTOTYPE]
    return {
        "heading": data.title,
        "style": _asset("page.css"),
        "panels": shown,
        "choices": {
            "Criteria": columns_with(data, "criterion"),
            "Design variables": columns_with(data, "variable"),
            "Further outputs": columns_with(data, "output"),
            "Geometric criteria": columns_with(data, "geometric"),
        },
        "ranks": [
            {
                "group": g,
                "name": group_name(g),
                "svg": look(g).svg,
                "count": int((data.group == g).sum()),
                "on": g != DOMINATED,
            }
            for g in groups
        ],
        "prototype": look(PROTOTYPE).svg if (data.group == PROTOTYPE).any() else "",
        "optimum": {"svg": look(OPTIMUM).svg, "labels": data.optima, "kind": data.label_name},
        "sliders": [(column, slider and slider.name) for column, slider in sliders],
        "remarks": data.remarks,
        "normalize": data.normalize,
    }


def _asset(name: str) -> str:
    return files("pymoo_psi.page").joinpath(name).read_text(encoding="utf-8")
