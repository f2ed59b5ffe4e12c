"""The decision page: a ranked Pareto set to look at, limit and choose from, in one HTML file.

:func:`decision_page` makes a :class:`DecisionPage`, which is what it shows as data, and the file.

This is the only room that uses Bokeh (the extra ``page``), imported when a page is written.
"""

from pymoo_psi.page._page import DecisionPage, decision_page

__all__ = ["DecisionPage", "decision_page"]
