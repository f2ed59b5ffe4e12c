"""The decision page: a ranked Pareto set to look at, limit and choose from, in one HTML file.

Making the page
    :class:`DecisionPage`: :func:`decision_page`.
Its data
    :class:`PageData`.
Where the designs come from
    :class:`PageTable`: :func:`table_from_file`.

This is the only place that uses Bokeh (the extra ``page``), imported when a page is made.
"""

from pymoo_psi.page._data import PageData
from pymoo_psi.page._page import DecisionPage, decision_page
from pymoo_psi.page._source import PageTable, table_from_file

__all__ = ["DecisionPage", "PageData", "PageTable", "decision_page", "table_from_file"]
