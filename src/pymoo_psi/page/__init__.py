"""The decision page: a ranked Pareto set to look at, limit and choose from, in one HTML file.

:func:`decision_page` makes a :class:`DecisionPage`, which is what it shows as data, and the file.

The file needs no network and no library: ``logic.js`` ranks and explains what is left,
``charts.js`` draws on canvas, ``page.js`` has the controls, texts and the table.
"""

from pymoo_psi.page._page import DecisionPage, decision_page

__all__ = ["DecisionPage", "decision_page"]
