"""The decision page: a ranked Pareto set to look at, limit and choose from, in one HTML file.

Making the page
    :class:`DecisionPage`: :func:`decision_page`.
Its data
    :class:`PageData`.
Where the designs come from
    :class:`PageTable`: :func:`table_from_file`.

This is the only place that uses Bokeh (the extra ``page``), imported when a page is made.
"""

from pymoo_psi.page.content import PageData
from pymoo_psi.page.making import decision_page
from pymoo_psi.page.page_file import DecisionPage
from pymoo_psi.page.source import PageTable, table_from_file

__all__ = [  # noqa: RUF022 - in the order of the text above
    "decision_page",
    "DecisionPage",
    "PageData",
    "PageTable",
    "table_from_file",
]
